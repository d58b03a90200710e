//! Obstacles, as GeoJSON has them.

use std::f64::consts::TAU;
use std::path::Path;

use faircurve::discrete::{Limits, Obstacle, Region};
use faircurve::{Error, Result};
use serde_json::Value;

/// The obstacles of a file.
#[derive(Default)]
pub struct Obstacles {
    pub polygons: Vec<Obstacle>,
    pub discs: Vec<Region>,
}

impl Obstacles {
    /// Reads polygons, and points with a property `radius`, whose discs are obstacles. Each ring of a polygon is
    /// one. The properties `name` and `curve` say what messages call it, and which curve stays out of it.
    ///
    /// # Errors
    /// A file that cannot be read, is no GeoJSON or has other geometries.
    pub fn read(path: &Path) -> Result<Self> {
        let wrong = |what: String| Error::argument(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| wrong(format!("it cannot be read: {error}")))?;
        let root: Value =
            serde_json::from_str(&text).map_err(|error| wrong(format!("it is no GeoJSON of obstacles: {error}")))?;
        let features = match &root["features"] {
            Value::Array(features) => &features[..],
            _ => std::slice::from_ref(&root),
        };
        let mut own = Obstacles::default();
        for (k, feature) in features.iter().enumerate() {
            let geometry = if feature["type"] == "Feature" { &feature["geometry"] } else { feature };
            let property = |name: &str| Some(&feature["properties"][name]).filter(|own| !own.is_null());
            let name = property("name").map_or_else(|| (k + 1).to_string(), text_of);
            let place = |what: &str| wrong(format!("feature {} (obstacle {name}) {what}", k + 1));
            let rings: Vec<&Value> = match (geometry["type"].as_str(), geometry["coordinates"].as_array()) {
                (Some("Polygon"), Some(rings)) => rings.iter().collect(),
                (Some("MultiPolygon"), Some(parts)) => parts.iter().filter_map(Value::as_array).flatten().collect(),
                (Some("Point"), Some(_)) => {
                    let radius = property("radius").and_then(Value::as_f64);
                    let ([x, y], Some(radius)) = (corner(&geometry["coordinates"]), radius) else {
                        return Err(place("is a point: give it a property radius, or a polygon in its place"));
                    };
                    if property("curve").is_some() {
                        return Err(place("is a disc for one curve: give a polygon in its place"));
                    }
                    own.discs.push(Region::Outside { center: [x, y, f64::NAN], radius });
                    continue;
                }
                (None, _) if geometry.is_null() => continue,
                (kind, _) => {
                    let kind = kind.unwrap_or("no geometry");
                    return Err(place(&format!("is {kind}: give polygons, or points with a property radius")));
                }
            };
            for ring in rings {
                let mut corners: Vec<[f64; 2]> = ring.as_array().into_iter().flatten().map(corner).collect();
                if corners.len() > 1 && corners.first() == corners.last() {
                    corners.pop();
                }
                own.polygons.push(Obstacle { corners, name: name.clone(), curve: property("curve").map(text_of) });
            }
        }
        Ok(own)
    }
}

fn text_of(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

/// NaN for what is no number, which the check of obstacles names.
fn corner(position: &Value) -> [f64; 2] {
    [0, 1].map(|c| position[c].as_f64().unwrap_or(f64::NAN))
}

/// The polygons that limits keep curves out of, with discs among them.
pub fn polygons(limits: &Limits) -> Vec<Vec<[f64; 2]>> {
    let disc = |region: &Region| match *region {
        Region::Outside { center: [x, y, _], radius } => {
            let corner = |k: u32| (TAU / 64.0 * f64::from(k)).sin_cos();
            Some((0..64).map(corner).map(|(sin, cos)| [x + radius * cos, y + radius * sin]).collect())
        }
        _ => None,
    };
    let obstacles = limits.obstacles.iter().map(|obstacle| obstacle.corners.clone());
    obstacles.chain(limits.regions.iter().filter_map(disc)).collect()
}
