//! Writing: the arcs of the curves, and the document with their numbers in place of coordinates.

use std::io::{self, Write};

use serde_json::{Map, Value, json};

use crate::batch::CurveBatch;
use crate::io::geojson;
use crate::io::source::Source;
use crate::io::text::Text;
use crate::io::{Antimeridian, ReadOptions, WriteOptions, antimeridian, is_finite};
use crate::status::CurveStatus;
use crate::topology::{Options, Topology};

/// The name of the object of a document that names none.
const OBJECT: &str = "features";

/// Writes the batch, quantised to the decimals asked for, or with all digits.
pub(in crate::io) fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let WriteOptions { decimals, ref statuses, .. } = *options;
    let named = geojson::objects(batch);
    if options.antimeridian != Antimeridian::Cut || !(0..batch.len()).any(|i| antimeridian::concerns(batch, i)) {
        return write_arcs(out, batch, (statuses, decimals), &named);
    }
    // Cut geometries are another document, whose curves share other arcs.
    let mut cut = Vec::new();
    geojson::write(&mut cut, batch, &WriteOptions { decimals: None, ..options.clone() })?;
    let read = |mut source| geojson::read(&mut source, &ReadOptions::default());
    let batch = Source::of_reader(&cut[..]).and_then(read).map_err(io::Error::other)?;
    write_arcs(out, &batch, (&[], decimals), &named)
}

fn write_arcs(
    out: &mut dyn Write,
    batch: &CurveBatch,
    (statuses, decimals): (&[CurveStatus], Option<u8>),
    named: &[geojson::Object],
) -> io::Result<()> {
    let plain = batch.with_points(batch.coords().to_vec(), batch.offsets().to_vec());
    let shared = Options { geographic: false, ..Options::of(&plain) };
    // Curves that are not finite have no arcs: JSON has no such numbers.
    let drawn: Vec<usize> = (0..batch.len()).filter(|&i| is_finite(batch, i) && batch.count(i) > 0).collect();
    let topology = Topology::new(&plain.select(&drawn), &shared).map_err(io::Error::other)?;
    let mut features = Vec::new();
    geojson::write_with(Text::new(&mut features), batch, statuses, false, false, &mut |text, i, _| {
        let numbers = drawn.binary_search(&i).map_or_else(|_| vec![], |k| topology.numbers(k));
        text.push(serde_json::to_string(&numbers)?)
    })?;
    let document: Value = serde_json::from_slice(&features)?;
    let mut text = Text::new(out);
    text.push("{\"type\":\"Topology\",\"objects\":")?;
    text.push(objects(document, named).to_string())?;
    arcs(&mut text, &topology, decimals)?;
    text.push("}\n")?;
    text.finish()
}

/// Arcs as they are, or as steps of the last decimal.
fn arcs(text: &mut Text, topology: &Topology, decimals: Option<u8>) -> io::Result<()> {
    let step = decimals.map(|decimals| 10_f64.powi(-i32::from(decimals)));
    if let Some(step) = step {
        text.push(format!(",\"transform\":{{\"scale\":[{step},{step}],\"translate\":[0,0]}}"))?;
    }
    text.push(",\"arcs\":[")?;
    for (arc, points) in topology.arc_points().enumerate() {
        text.push(if arc == 0 { "\n[" } else { ",\n[" })?;
        let mut last = [0_i64; 2];
        let mut first = true;
        for point in points {
            let Some(step) = step else {
                text.push(if first { "[" } else { ",[" })?;
                text.point(&point, ",")?;
                text.push("]")?;
                first = false;
                continue;
            };
            let here = [point[0], point[1]].map(|x| (x / step).round() as i64);
            if first || here != last {
                text.push(if first { "[" } else { ",[" })?;
                text.push(format!("{},{}]", here[0] - last[0], here[1] - last[1]))?;
            }
            (last, first) = (here, false);
        }
        text.push("]")?;
    }
    text.push("\n]")
}

/// The objects of a topology from the GeoJSON of its features.
fn objects(document: Value, named: &[geojson::Object]) -> Value {
    let features: Vec<Value> = match document {
        Value::Object(mut root) if root.get("type").is_some_and(|kind| kind == "FeatureCollection") => {
            match root.remove("features") {
                Some(Value::Array(features)) => features,
                _ => vec![],
            }
        }
        other => vec![other],
    };
    let mut geometries = features.into_iter().map(geometry);
    let mut objects = Map::new();
    for object in named {
        let mut of_object: Vec<Value> = geometries.by_ref().take(object.features).collect();
        for &k in &object.nulls {
            of_object[k] = Value::Null;
        }
        objects.insert(object.name.clone(), json!({"type": "GeometryCollection", "geometries": of_object}));
    }
    let rest: Vec<Value> = geometries.collect();
    if !rest.is_empty() || named.is_empty() {
        objects.insert(OBJECT.into(), json!({"type": "GeometryCollection", "geometries": rest}));
    }
    Value::Object(objects)
}

/// A geometry of TopoJSON from a feature or a geometry of GeoJSON, whose coordinates are numbers of
/// arcs.
fn geometry(feature: Value) -> Value {
    let Value::Object(mut members) = feature else { return Value::Null };
    if members.get("type").is_none_or(|kind| kind != "Feature") {
        return Value::Object(with_arcs(members));
    }
    let mut geometry = match members.remove("geometry") {
        Some(Value::Object(geometry)) => with_arcs(geometry),
        _ => Map::from_iter([("type".to_string(), Value::Null)]),
    };
    members.remove("type");
    let kept = members.into_iter().filter(|(name, value)| name != "properties" || !value.is_null());
    geometry.extend(kept);
    Value::Object(geometry)
}

fn with_arcs(mut geometry: Map<String, Value>) -> Map<String, Value> {
    let is_point = geometry.get("type").is_some_and(|kind| kind == "Point" || kind == "MultiPoint");
    if let Some(Value::Array(inner)) = geometry.get_mut("geometries") {
        for entry in inner {
            *entry = self::geometry(entry.take());
        }
    } else if let Some(arcs) = geometry.remove("coordinates") {
        geometry.insert(if is_point { "coordinates" } else { "arcs" }.into(), arcs);
    }
    geometry
}
