//! Topologies: they are written out as GeoJSON, which is then read.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, SeqAccess, Visitor};
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::Object;
use crate::error::{Error, Result, quoted};
use crate::io::source::Source;

/// Most bytes of memory that a byte of text stands for: a position of "[0,0]," is three numbers.
const TIMES: usize = 8;

/// Geometry collections nested deeper than this are refused.
const MAX_NESTING: usize = 64;

#[derive(Deserialize)]
struct Topology<'a> {
    #[serde(borrow)]
    arcs: Option<&'a RawValue>,
    objects: Option<Map<String, Value>>,
    transform: Option<Transform>,
}

#[derive(Clone, Copy, Deserialize)]
struct Transform {
    scale: [f64; 2],
    translate: [f64; 2],
}

/// A position: two numbers, and perhaps an altitude.
struct Position([f64; 3]);

impl<'de> Deserialize<'de> for Position {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Numbers;
        impl<'de> Visitor<'de> for Numbers {
            type Value = Position;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a position of two or three numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> std::result::Result<Position, A::Error> {
                let mut next = |k: usize| -> std::result::Result<f64, A::Error> {
                    list.next_element()?.ok_or_else(|| serde::de::Error::invalid_length(k, &self))
                };
                let (x, y) = (next(0)?, next(1)?);
                let z = list.next_element()?.unwrap_or(f64::NAN);
                while list.next_element::<IgnoredAny>()?.is_some() {}
                Ok(Position([x, y, z]))
            }
        }
        deserializer.deserialize_seq(Numbers)
    }
}

/// The GeoJSON of a topology, and which objects its features are of.
pub(super) fn as_geojson(source: &Source, text: &str) -> Result<(String, Vec<Object>)> {
    source.take(TIMES * text.len())?;
    let wrong = |what: String| source.error(None, what);
    let topology: Topology = serde_json::from_str(text)
        .map_err(|error| wrong(format!("this is no topology: {error}: see TopoJSON's specification")))?;
    let arcs = topology.arcs.ok_or_else(|| wrong("the topology has no \"arcs\": add them".into()))?;
    let arcs: Vec<Vec<Position>> = serde_json::from_str(arcs.get())
        .map_err(|error| wrong(format!("\"arcs\" must be lists of positions, numbers all of them: {error}")))?;
    let arcs = arcs.into_iter().map(|arc| placed(arc, topology.transform)).collect();
    let objects = topology.objects.ok_or_else(|| wrong("the topology has no \"objects\": add them".into()))?;
    let (out, digits) = (String::new(), zmij::Buffer::new());
    let mut reader = Reader { source, arcs, transform: topology.transform, out, digits, place: String::new() };
    reader.push("{\"type\":\"FeatureCollection\",\"features\":[")?;
    let mut found = Vec::new();
    for (name, object) in &objects {
        found.push(reader.object(name, object)?);
    }
    reader.push("\n]}\n")?;
    Ok((reader.out, found))
}

/// Positions from steps, where the topology is quantised.
fn placed(arc: Vec<Position>, transform: Option<Transform>) -> Vec<[f64; 3]> {
    let Some(Transform { scale, translate }) = transform else {
        return arc.into_iter().map(|position| position.0).collect();
    };
    let (mut x, mut y) = (0.0, 0.0);
    let step = |Position([dx, dy, z]): Position| {
        (x, y) = (x + dx, y + dy);
        [x * scale[0] + translate[0], y * scale[1] + translate[1], z]
    };
    arc.into_iter().map(step).collect()
}

struct Reader<'a> {
    source: &'a Source<'a>,
    arcs: Vec<Vec<[f64; 3]>>,
    transform: Option<Transform>,
    /// The GeoJSON.
    out: String,
    digits: zmij::Buffer,
    /// "object countries, geometry 3", for errors.
    place: String,
}

impl Reader<'_> {
    fn wrong(&self, what: impl fmt::Display) -> Error {
        self.source.error(None, format!("{}: {what}", self.place))
    }

    /// Appends text.
    fn push(&mut self, text: &str) -> Result<()> {
        if self.out.capacity() - self.out.len() < text.len() {
            let more = text.len().max(self.out.len()).max(1 << 16);
            self.source.take(more)?;
            self.out.reserve_exact(more);
        }
        self.out.push_str(text);
        Ok(())
    }

    /// An object: a collection of features, or one.
    fn object(&mut self, name: &str, object: &Value) -> Result<Object> {
        let features = match object.get("geometries").and_then(Value::as_array) {
            Some(geometries) if object.get("type").is_some_and(|kind| kind == "GeometryCollection") => &geometries[..],
            _ => std::slice::from_ref(object),
        };
        for (k, feature) in features.iter().enumerate() {
            self.place = format!("object {}, geometry {k}", quoted(name));
            self.feature(feature)?;
        }
        let nulls = (0..features.len()).filter(|&k| features[k].is_null()).collect();
        Ok(Object { name: name.into(), features: features.len(), nulls })
    }

    fn feature(&mut self, geometry: &Value) -> Result<()> {
        let none = Map::new();
        let members = match geometry {
            Value::Object(members) => members,
            // A shape that vanished when a map was made simpler.
            Value::Null => &none,
            _ => return Err(self.wrong("it is no JSON object: TopoJSON needs one with a \"type\"")),
        };
        let own = |name: &str| !matches!(name, "type" | "arcs" | "coordinates" | "geometries" | "bbox" | "properties");
        self.push(if self.out.ends_with('[') { "\n{\"type\":\"Feature\"," } else { ",\n{\"type\":\"Feature\"," })?;
        for (name, value) in members.iter().filter(|(name, _)| own(name)) {
            self.push(&format!("{}:{value},", Value::from(name.as_str())))?;
        }
        let properties = members.get("properties").unwrap_or(&Value::Null);
        self.push(&format!("\"properties\":{properties},\"geometry\":"))?;
        self.geometry(geometry, 0)?;
        self.push("}")
    }

    fn geometry(&mut self, geometry: &Value, depth: usize) -> Result<()> {
        if depth > MAX_NESTING {
            return Err(self.wrong(format!("geometry collections nest deeper than {MAX_NESTING}: flatten them")));
        }
        let kind = match geometry.get("type") {
            None | Some(Value::Null) => {
                return self.push("null");
            }
            Some(Value::String(kind)) => kind.as_str(),
            Some(other) => return Err(self.wrong(format!("its type is {other}: it must be a word"))),
        };
        if kind == "GeometryCollection" {
            let Some(geometries) = geometry.get("geometries").and_then(Value::as_array) else {
                return Err(self.wrong("its GeometryCollection has no list \"geometries\": add it"));
            };
            self.push("{\"type\":\"GeometryCollection\",\"geometries\":[")?;
            for (k, inner) in geometries.iter().enumerate() {
                self.push(if k > 0 { "," } else { "" })?;
                self.geometry(inner, depth + 1)?;
            }
            return self.push("]}");
        }
        self.push(&format!("{{\"type\":{},\"coordinates\":", Value::from(kind)))?;
        match kind {
            "Point" | "MultiPoint" => {
                let coordinates = geometry.get("coordinates").unwrap_or(&Value::Null);
                let placed = self.points(coordinates);
                self.push(&placed.to_string())?;
            }
            "LineString" => self.lines(geometry, 1)?,
            "MultiLineString" | "Polygon" => self.lines(geometry, 2)?,
            "MultiPolygon" => self.lines(geometry, 3)?,
            other => return Err(self.wrong(format!("the type {} is none of TopoJSON's", quoted(other)))),
        }
        self.push("}")
    }

    /// Coordinates of points, out of their quantisation.
    fn points(&self, coordinates: &Value) -> Value {
        match (coordinates.as_array(), self.transform) {
            (Some(list), Some(Transform { scale, translate })) if list.iter().all(Value::is_number) => {
                let place = |(k, x): (usize, &Value)| match x.as_f64().filter(|_| k < 2) {
                    Some(x) => Value::from(x * scale[k] + translate[k]),
                    None => x.clone(),
                };
                list.iter().enumerate().map(place).collect()
            }
            (Some(list), Some(_)) => list.iter().map(|point| self.points(point)).collect(),
            _ => coordinates.clone(),
        }
    }

    /// Lines of arcs that nest `depth` lists of numbers.
    fn lines(&mut self, geometry: &Value, depth: usize) -> Result<()> {
        match geometry.get("arcs") {
            Some(arcs) => self.nested(arcs, depth),
            None => Err(self.wrong("it has no \"arcs\": add them")),
        }
    }

    fn nested(&mut self, list: &Value, depth: usize) -> Result<()> {
        if list.is_null() {
            return self.push("null");
        }
        let Some(entries) = list.as_array() else {
            return Err(self.wrong("its arcs do not nest as its type asks: see TopoJSON's specification"));
        };
        if depth == 1 {
            return self.line(entries);
        }
        self.push("[")?;
        for (k, entry) in entries.iter().enumerate() {
            self.push(if k > 0 { "," } else { "" })?;
            self.nested(entry, depth - 1)?;
        }
        self.push("]")
    }

    /// One line: arcs by their numbers, those that run backwards as −1 − number.
    fn line(&mut self, numbers: &[Value]) -> Result<()> {
        let mut line: Vec<[f64; 3]> = Vec::new();
        for number in numbers {
            let Some(number) = number.as_i64() else {
                return Err(self.wrong(format!("its arc {number} is no whole number: arcs are named by their numbers")));
            };
            let (place, backwards) = if number < 0 { (-1 - number, true) } else { (number, false) };
            let Some(arc) = usize::try_from(place).ok().and_then(|place| self.arcs.get(place)) else {
                let count = self.arcs.len();
                return Err(self.wrong(format!(
                    "it names arc {number}, but there are {count} arcs: from −{count} to {} are possible",
                    count as i64 - 1
                )));
            };
            // The first point of an arc is the last of the one before.
            let skipped = usize::from(!line.is_empty());
            match backwards {
                false => line.extend(arc.iter().skip(skipped)),
                true => line.extend(arc.iter().rev().skip(skipped)),
            }
        }
        self.push("[")?;
        for (k, point) in line.iter().enumerate() {
            self.push(if k > 0 { ",[" } else { "[" })?;
            // An altitude that is not there is NaN.
            for (axis, &x) in point.iter().enumerate().filter(|(_, x)| !x.is_nan()) {
                let number = self.digits.format(x).to_string();
                self.push(if axis > 0 { "," } else { "" })?;
                self.push(&number)?;
            }
            self.push("]")?;
        }
        self.push("]")
    }
}
