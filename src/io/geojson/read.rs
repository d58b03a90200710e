//! Reading in two passes. The first finds the members of every object and checks the syntax. The
//! second reads coordinates.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use serde::de::{DeserializeSeed, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::coordinates::{Lines, List};
use super::topology::as_geojson;
use super::{Document, Mark, Object, Part, Shape, Slot};
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::error::{Error, Result, quoted, shortened};
use crate::io::source::Source;
use crate::io::{ReadOptions, Selection, close, counted, grouped_names, longitude, part};
use crate::sort;

/// An upper bound of the memory that a comma or an opening bracket stands for.
///
/// It covers entries of lists of references to the text, names, flags and places of curves, and
/// cuts of the text. The text is kept a second time without its coordinates.
const COMMA_BYTES: usize = 24;
const BRACKET_BYTES: usize = 64;

/// Geometry collections nested deeper than this are refused.
const MAX_NESTING: usize = 64;

/// Reads a document: a feature collection, a feature or a geometry.
pub(in crate::io) fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let text = source.text()?;
    if is_topology(&text) {
        let (text, objects) = as_geojson(source, &text)?;
        return read_text(source, &text, objects, options);
    }
    read_text(source, &text, vec![], options)
}

/// Whether a document is a topology, which has its type at the beginning, or at the end.
fn is_topology(text: &str) -> bool {
    #[derive(serde::Deserialize)]
    struct Root<'a> {
        #[serde(rename = "type", borrow)]
        kind: Option<&'a RawValue>,
    }
    text.contains("\"Topology\"")
        && serde_json::from_str::<Root>(text)
            .is_ok_and(|root| root.kind.is_some_and(|kind| kind.get() == "\"Topology\""))
}

/// Reads the text of a document, whose features are of these objects of a topology.
fn read_text(source: &Source, text: &str, objects: Vec<Object>, options: &ReadOptions) -> Result<CurveBatch> {
    let count = |wanted: fn(&u8) -> bool| text.bytes().filter(wanted).count();
    source
        .take(text.len() + COMMA_BYTES * count(|&c| c == b',') + BRACKET_BYTES * count(|&c| c == b'[' || c == b'{'))?;
    let root: &RawValue = serde_json::from_str(text).map_err(|error| {
        let (line, column) = (error.line() as u64, error.column());
        let what = without_place(&error);
        source.error(line, format!("column {column}: {what}: this is no JSON, or the file was cut off"))
    })?;
    let mut reader = Reader::new(source, text, options.selected.as_ref());
    reader.root(root)?;
    reader.finish(objects, options)
}

fn without_place(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let what = text.rsplit_once(" at line ").map_or(text.as_str(), |(what, _)| what);
    shortened(what).into_owned()
}

/// Properties that hold what people call a feature, the best ones first.
const TITLES: [&str; 6] = ["name", "NAME", "Name", "title", "id", "ID"];

/// A member of an object: its name with the quotation marks, and its value.
type Member<'a> = (&'a str, &'a RawValue);

struct Members<'a>(Vec<Member<'a>>);

impl<'de> serde::Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Members<'de>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Self::Value, A::Error> {
                let mut members = Vec::with_capacity(4);
                while let Some((name, value)) = map.next_entry::<&RawValue, &RawValue>()? {
                    members.push((name.get(), value));
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Object)
    }
}

impl<'a> Members<'a> {
    fn get(&self, name: &str) -> Option<&'a RawValue> {
        self.0.iter().find(|(key, _)| key[1..key.len() - 1] == *name).map(|(_, value)| *value)
    }
}

struct Reader<'a> {
    source: &'a Source<'a>,
    text: &'a str,
    lines: Lines<'a>,
    /// Whether coordinates are longitudes and latitudes.
    ///
    /// They are, unless an old `crs` member says otherwise.
    geographic: bool,
    /// Parts of the text to leave out, and the coordinates that stood there.
    cuts: Vec<(Range<usize>, Option<Part>)>,
    /// The first curve and the shape of every geometry.
    shapes: Vec<(usize, Shape)>,
    rings: Vec<bool>,
    feature: usize,
    /// For each feature its first curve, and its name by the property `curve`.
    features: Vec<(usize, Option<String>)>,
    /// For each feature its first curve, and what people call it.
    titles: Vec<(usize, Option<String>)>,
    /// What is selected, and the features that have it among their properties.
    selection: Option<&'a Selection>,
    selected: Vec<usize>,
    unwrapped: Vec<usize>,
    round_pole: Vec<usize>,
    /// Rings that wind once round a pole, the turns of their points, and the pole.
    framed: Vec<(usize, Vec<f64>, f64)>,
    within_half_turn: bool,
}

impl<'a> Reader<'a> {
    fn new(source: &'a Source<'a>, text: &'a str, selection: Option<&'a Selection>) -> Self {
        Reader {
            source,
            text,
            lines: Lines::new(&source.room),
            geographic: true,
            cuts: Vec::new(),
            shapes: Vec::new(),
            rings: Vec::new(),
            feature: 0,
            features: Vec::new(),
            titles: Vec::new(),
            selection,
            selected: Vec::new(),
            unwrapped: Vec::new(),
            round_pole: Vec::new(),
            framed: Vec::new(),
            within_half_turn: true,
        }
    }

    fn wrong(&self, what: impl fmt::Display) -> Error {
        self.source.error(None, format!("feature {}: {what}", self.feature))
    }

    fn root(&mut self, root: &'a RawValue) -> Result<()> {
        let members = self.members(root, "the document")?;
        self.geographic = members.get("crs").is_none_or(|crs| is_in_degrees(crs.get()));
        match self.kind(&members)?.as_str() {
            "FeatureCollection" => {
                let Some(features) = members.get("features") else {
                    return Err(self.source.error(None, "the FeatureCollection has no \"features\": add them"));
                };
                let features: Vec<&RawValue> = serde_json::from_str(features.get())
                    .map_err(|_| self.source.error(None, "\"features\" is no list: make it one"))?;
                for feature in features {
                    if feature.get() == "null" {
                        self.features.push((self.rings.len(), None));
                        self.feature += 1;
                        continue;
                    }
                    let members = self.members(feature, "a feature")?;
                    match self.kind(&members)?.as_str() {
                        "Feature" => self.feature(&members)?,
                        other => {
                            return Err(self.wrong(format!("its type is {}: it must be \"Feature\"", quoted(other))));
                        }
                    }
                }
                self.cut_bbox(&members, 0);
                Ok(())
            }
            "Feature" => self.feature(&members),
            _ => {
                self.features.push((0, None));
                self.geometry(root, 0)?;
                let start = self.span(members.0[0].0).start;
                self.mark(0, "status", start..start, ["", ","], "");
                Ok(())
            }
        }
    }

    fn feature(&mut self, members: &Members<'a>) -> Result<()> {
        let first = self.rings.len();
        let properties: Option<Members> =
            members.get("properties").and_then(|properties| serde_json::from_str(properties.get()).ok());
        let property = |key: &str| properties.as_ref().and_then(|own| own.get(key));
        // Numbers, true and false are selected as they are written.
        let has =
            |own: &Selection, value: &RawValue| own.has(value.get()) || name(value).is_some_and(|name| own.has(&name));
        if self.selection.is_some_and(|own| property(&own.key).is_some_and(|value| has(own, value))) {
            self.selected.push(self.feature);
        }
        self.titles.push((first, TITLES.iter().find_map(|key| property(key).and_then(name))));
        self.features.push((first, property("curve").and_then(name)));
        if let Some(geometry) = members.get("geometry") {
            self.geometry(geometry, 0)?;
        }
        self.cut_bbox(members, first);
        self.mark_feature(members, properties, first);
        self.feature += 1;
        Ok(())
    }

    /// Notes where the status of a feature's curves belongs: before its properties, which may be
    /// missing.
    fn mark_feature(&mut self, members: &Members<'a>, own: Option<Members<'a>>, first: usize) {
        let properties = members.get("properties");
        let name = if own.as_ref().is_some_and(|own| own.get("status").is_some()) { "status_" } else { "status" };
        match (properties, own) {
            (Some(object), Some(own)) => {
                let start = self.span(object.get()).start + 1;
                self.mark(first, name, start..start, ["", if own.0.is_empty() { "" } else { "," }], "");
            }
            (Some(null), _) if null.get() == "null" => {
                self.mark(first, name, self.span(null.get()), ["{", "}"], "null");
            }
            (Some(_), _) => {}
            // A feature has a type at least.
            (None, _) => {
                let start = self.span(members.0[0].0).start;
                self.mark(first, name, start..start, ["\"properties\":{", "},"], "");
            }
        }
    }

    /// Notes a place for the status of the curves from `first` on.
    fn mark(
        &mut self,
        first: usize,
        name: &'static str,
        place: Range<usize>,
        around: [&'static str; 2],
        otherwise: &'static str,
    ) {
        let curves = first..self.rings.len();
        if !curves.is_empty() {
            self.cuts.push((place, Some(Part::Status(Mark { curves, name, around, otherwise }))));
        }
    }

    fn geometry(&mut self, geometry: &'a RawValue, depth: usize) -> Result<()> {
        if depth > MAX_NESTING {
            return Err(self.wrong(format!("geometry collections nest deeper than {MAX_NESTING}: flatten them")));
        }
        if geometry.get() == "null" {
            return Ok(());
        }
        let first = self.rings.len();
        let members = self.members(geometry, "a geometry")?;
        let kind = self.kind(&members)?;
        let list = if kind == "GeometryCollection" { "geometries" } else { "coordinates" };
        if !matches!(kind.as_str(), "Point" | "MultiPoint" | "GeometryCollection")
            && let Some(kind) = members.get("type")
        {
            // It is known after the coordinates.
            let span = self.span(kind.get());
            self.cuts.push((span, Some(Part::Kind(self.shapes.len()))));
        }
        let value = || members.get(list).ok_or_else(|| self.wrong(format!("its {kind} has no {list:?}: add them")));
        match kind.as_str() {
            "Point" | "MultiPoint" => return Ok(()),
            "LineString" => self.coordinates(value()?, 1, |_| Shape::Line)?,
            "MultiLineString" => self.coordinates(value()?, 2, |counts| Shape::Lines(counts.iter().sum()))?,
            "Polygon" => self.coordinates(value()?, 2, |counts| Shape::Polygon(counts.iter().sum()))?,
            "MultiPolygon" => self.coordinates(value()?, 3, |counts| Shape::Polygons(counts.to_vec()))?,
            "GeometryCollection" => {
                let parts: Vec<&RawValue> = serde_json::from_str(value()?.get())
                    .map_err(|_| self.wrong("\"geometries\" is no list: make it one"))?;
                for part in parts {
                    self.geometry(part, depth + 1)?;
                }
            }
            other => {
                return Err(self.wrong(format!(
                    "the type {} is none of GeoJSON's: FeatureCollection, Feature and the geometries are",
                    quoted(other)
                )));
            }
        }
        self.cut_bbox(&members, first);
        Ok(())
    }

    /// Reads coordinates that nest `depth` lists of positions, and removes them from the text.
    fn coordinates(&mut self, raw: &'a RawValue, depth: usize, shape: impl Fn(&[usize]) -> Shape) -> Result<()> {
        let first = self.rings.len();
        self.lines.counts.clear();
        let mut json = serde_json::Deserializer::from_str(raw.get());
        List { depth, lines: &mut self.lines }.deserialize(&mut json).map_err(|error| {
            if let Some(full) = self.lines.full {
                return self.source.full(full);
            }
            let what = without_place(&error);
            self.wrong(format!("its coordinates do not nest as its type asks, or are no numbers: {what}"))
        })?;
        let shape = shape(&self.lines.counts);
        let ring = matches!(shape, Shape::Polygon(_) | Shape::Polygons(_));
        self.rings.resize(first + shape.curves(), ring);
        match &shape {
            Shape::Line | Shape::Lines(_) => (first..self.rings.len()).for_each(|i| self.unwrap(i, None)),
            Shape::Polygon(rings) => self.unwrap_rings(first, &[*rings]),
            Shape::Polygons(rings) => self.unwrap_rings(first, rings),
        }
        self.cuts.push((self.span(raw.get()), Some(Part::Coordinates(self.shapes.len()))));
        self.shapes.push((first, shape));
        Ok(())
    }

    fn unwrap_rings(&mut self, mut shell: usize, polygons: &[usize]) {
        for rings in polygons {
            let before = self.framed.len();
            (shell..shell + rings).for_each(|i| self.unwrap(i, Some(shell)));
            self.find_pole(before);
            shell += rings;
        }
    }

    /// The pole that the rings of a polygon wind round, of those from `first` on: that beyond its
    /// hole, or else the nearer one.
    fn find_pole(&mut self, first: usize) {
        let mean = |(i, ..): &(usize, Vec<f64>, f64)| longitude::mean_latitude(&self.lines.xy[self.lines.range(*i)], 2);
        let latitude = match &self.framed[first..] {
            [] => return,
            [ring] => mean(ring),
            [shell, .., hole] => mean(hole) - mean(shell),
        };
        self.framed[first..].iter_mut().for_each(|(.., pole)| *pole = longitude::POLE.copysign(latitude));
    }

    /// Carries the longitudes of curve `i` past ±180 where it crosses.
    ///
    /// `shell` is the first ring of its polygon.
    fn unwrap(&mut self, i: usize, shell: Option<usize>) {
        let points = self.lines.range(i);
        let mut x = self.lines.xy[points.clone()].iter().step_by(2);
        self.within_half_turn &= x.all(|&x| longitude::within_half_turn(x));
        if !self.geographic || !longitude::is_geographic(&self.lines.xy[points.clone()], 2) {
            return;
        }
        longitude::settle(&mut self.lines.xy[points.clone()], 2);
        if let Some(shell) =
            shell.filter(|shell| *shell < i && self.unwrapped.binary_search(shell).is_ok() && !points.is_empty())
        {
            let x = self.lines.xy[points.start];
            let turn = longitude::turns_to_shell(&self.lines.xy[self.lines.range(shell)], x, 2);
            longitude::apply(&mut self.lines.xy[points.clone()], 2, &vec![turn; points.len() / 2]);
        }
        let points = &mut self.lines.xy[points];
        let Some(turns) = longitude::turns(points, 2) else { return };
        let is_ring = points[..2] == points[points.len() - 2..];
        let winds = is_ring && longitude::winds(&turns);
        if winds && shell.is_some() {
            if (turns[turns.len() - 1] - turns[0]).abs() == 1.0 {
                self.framed.push((i, turns, longitude::POLE));
            }
            return;
        }
        if winds {
            self.round_pole.push(i);
        }
        longitude::apply(points, 2, &turns);
        if shell == Some(i) {
            longitude::centre(points, 2);
        }
        self.unwrapped.push(i);
    }

    fn members(&self, raw: &'a RawValue, what: &str) -> Result<Members<'a>> {
        serde_json::from_str(raw.get())
            .map_err(|_| self.wrong(format!("{what} is no JSON object: GeoJSON needs one with a \"type\"")))
    }

    fn kind(&self, members: &Members) -> Result<String> {
        let kind = members.get("type").and_then(|kind| serde_json::from_str(kind.get()).ok());
        kind.ok_or_else(|| self.wrong("an object has no \"type\": GeoJSON needs one, such as \"Feature\""))
    }

    /// Removes the bounding box of an object that holds the curves from `first` on.
    ///
    /// Their coordinates will change.
    fn cut_bbox(&mut self, members: &Members<'a>, first: usize) {
        let Some((name, value)) = members.0.iter().find(|(name, _)| *name == "\"bbox\"") else { return };
        if self.rings.len() == first {
            return;
        }
        let (mut start, mut end) = (self.span(name).start, self.span(value.get()).end);
        let after = self.text[end..].trim_start();
        if let Some(rest) = after.strip_prefix(',') {
            end = self.text.len() - rest.trim_start().len();
        } else {
            let before = self.text[..start].trim_end();
            start = before.strip_suffix(',').unwrap_or(before).trim_end().len();
        }
        self.cuts.push((start..end, None));
    }

    /// The place of a part in the text.
    fn span(&self, part: &str) -> Range<usize> {
        let start = part.as_ptr() as usize - self.text.as_ptr() as usize;
        start..start + part.len()
    }

    fn finish(mut self, objects: Vec<Object>, options: &ReadOptions) -> Result<CurveBatch> {
        let (dimension, coords, flat) = self.lines.interleave(options.columns.drops("z"));
        let names = self.names();
        let note_of_flat = flat.first().map(|&first| {
            let (have, name) = (counted(flat.len(), "line has", "lines have"), shortened(&names[first]));
            format!("{have} no altitudes, such as {name}: 0 is taken, and not written in GeoJSON")
        });
        // The curve and the point of it, since frames of the map move what follows.
        let lacking: Vec<(usize, usize)> = self.lines.lacking.iter().map(|&point| self.lines.locate(point)).collect();
        let lacks_altitude = |point: &[f64]| point[2..].iter().any(|z| z.is_nan());
        let without_altitude = |i: usize| {
            let points = &coords[dimension * self.lines.offsets[i]..dimension * self.lines.offsets[i + 1]];
            Some((i, points.chunks_exact(dimension).position(lacks_altitude)?))
        };
        let unselected = self.unselected(&objects);
        let sunk: Vec<(usize, usize)> = (0..self.rings.len()).filter_map(without_altitude).collect();
        let coords = self.with_frames(coords, dimension);
        sort::by(&mut self.cuts, |a, b| (a.0.start, a.0.end).cmp(&(b.0.start, b.0.end)));
        let shapes = std::mem::take(&mut self.shapes);
        let mut document = Document { curves: self.rings.len(), objects, shapes, flat, ..Document::default() };
        let mut done = 0;
        for (span, part) in std::mem::take(&mut self.cuts) {
            document.text.push_str(&self.text[done..span.start]);
            document.slots.extend(part.map(|part| Slot { at: document.text.len(), part }));
            done = span.end;
        }
        document.text.push_str(&self.text[done..]);
        let notes = self.note_of_frames().into_iter().chain(note_of_flat).collect();
        let origin = Origin {
            within_half_turn: self.within_half_turn,
            unselected,
            titles: self.titles,
            names: Some(names),
            unwrapped: self.unwrapped,
            is_map: self.rings.contains(&true),
            geographic: self.geographic && longitude::are_geographic(&coords, dimension),
            document: Some(Arc::new(document)),
            notes,
            ..self.source.origin()
        };
        let mut batch = CurveBatch::from_file(dimension, coords, self.lines.offsets, Arc::new(origin))?;
        for (i, point) in sunk {
            let what = "it has no altitude, and others of its line have one: add it, or drop all altitudes with \
                        `ReadOptions::columns` z=";
            batch.refuse(i, point, what);
        }
        for (i, point) in lacking {
            batch.refuse(i, point, "its position is null, or lacks a number: fill it in, or remove it");
        }
        close(batch, options.closed, &self.rings, &self.round_pole)
    }

    /// The curves of features that are not selected, by a property or by the object of a topology.
    fn unselected(&self, objects: &[Object]) -> Vec<usize> {
        let Some(selection) = self.selection else { return vec![] };
        let layers = objects.iter().flat_map(|object| std::iter::repeat_n(&object.name, object.features));
        let layers: Vec<&String> = if selection.key == "layer" { layers.collect() } else { vec![] };
        let is_selected = |feature: &usize| {
            self.selected.binary_search(feature).is_ok() || layers.get(*feature).is_some_and(|name| selection.has(name))
        };
        let curves = |feature: usize| {
            let end = self.features.get(feature + 1).map_or(self.rings.len(), |next| next.0);
            self.features[feature].0..end
        };
        (0..self.features.len()).filter(|feature| !is_selected(feature)).flat_map(curves).collect()
    }

    /// The coordinates, with the frame of the map in rings that wind round a pole.
    fn with_frames(&mut self, coords: Vec<f64>, dimension: usize) -> Vec<f64> {
        if self.framed.is_empty() {
            return coords;
        }
        let (mut all, mut offsets, mut framed) =
            (Vec::with_capacity(coords.len()), vec![0], self.framed.iter().peekable());
        for i in 0..self.rings.len() {
            let points = &coords[dimension * self.lines.offsets[i]..dimension * self.lines.offsets[i + 1]];
            match framed.next_if(|(ring, ..)| *ring == i) {
                Some((_, turns, pole)) => all.extend(longitude::framed(points, dimension, turns, *pole)),
                None => all.extend_from_slice(points),
            }
            offsets.push(all.len() / dimension);
        }
        self.lines.offsets = offsets;
        all
    }

    fn note_of_frames(&self) -> Option<String> {
        let rings = counted(self.framed.len(), "ring that winds", "rings that wind");
        let note = format!("{rings} round a pole: closed along ±180 degrees of longitude and over the pole");
        (!self.framed.is_empty()).then_some(note)
    }

    /// Names of the curves: the features' properties `curve` if those are unique, else the
    /// features' numbers.
    fn names(&self) -> Vec<String> {
        let ends = self.features.iter().skip(1).map(|(first, _)| *first).chain([self.rings.len()]);
        let groups = self.features.iter().zip(ends).enumerate();
        let groups = groups.map(|(number, ((first, name), end))| (number, name.as_ref(), end - first));
        grouped_names(&groups.filter(|(.., count)| *count > 0).collect::<Vec<_>>(), part)
    }
}

/// Geographic coordinate reference systems: those of EPSG by their codes, and names that files give.
const GEOGRAPHIC: &[&str] = &[
    "4326", "4979", "4258", "4937", "4269", "4267", "4283", "7844", "4617", "4674", "4490", "4612", "6668", "4167",
    "4171", "4277", "4230", "4322", "CRS84", "CRS84h", "CRS83", "CRS27", "WGS 84", "WGS84", "ETRS89", "NAD83",
];

/// Whether an old `crs` member is of longitudes and latitudes in degrees, as it is where it is null.
fn is_in_degrees(crs: &str) -> bool {
    let Ok(crs) = serde_json::from_str::<serde_json::Value>(crs) else { return false };
    // urn:ogc:def:crs:EPSG::4326, EPSG:4326, http://www.opengis.net/def/crs/OGC/1.3/CRS84. "WGS 84 / UTM zone 33N" is
    // in metres.
    let code = |name: &str| GEOGRAPHIC.contains(&name.rsplit([':', '/']).next().unwrap_or(name));
    match crs["properties"]["name"].as_str().or(crs.as_str()) {
        Some(name) => code(name),
        None => crs.is_null() || crs["properties"]["code"].as_u64().is_some_and(|number| code(&number.to_string())),
    }
}

/// The value of a property that is a text or a number.
fn name(value: &RawValue) -> Option<String> {
    match value.get().as_bytes()[0] {
        b'"' => serde_json::from_str(value.get()).ok(),
        b'-' | b'0'..=b'9' => Some(value.get().to_string()),
        _ => None,
    }
}
