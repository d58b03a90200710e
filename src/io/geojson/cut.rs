//! Geometries cut at the antimeridian.

use std::io;

use super::Shape;
use super::write::{has_places, is_flat, list, position};
use crate::batch::CurveBatch;
use crate::io::antimeridian::{Path, concerns, cut_line, cut_polygon};
use crate::io::text::Text;

/// The parts of a geometry.
pub(super) enum Cut {
    Lines(Vec<Path>),
    Polygons(Vec<Vec<Path>>),
}

impl Cut {
    /// The parts of a geometry whose first curve this is, if it runs past ±180.
    pub fn of(batch: &CurveBatch, first: usize, shape: &Shape) -> Option<Self> {
        let curves = first..first + shape.curves();
        if !curves.clone().any(|i| concerns(batch, i)) {
            return None;
        }
        let path = |i: usize| -> Path {
            let points = if has_places(batch, i) { batch.points(i) } else { &[] };
            let axes = if is_flat(batch, i) { 2 } else { batch.dimension() };
            points.chunks_exact(batch.dimension()).map(|point| point[..axes].to_vec()).collect()
        };
        let line = |i: usize| {
            let mut path = path(i);
            path.extend(path.first().cloned().filter(|_| batch.is_closed(i)));
            cut_line(&path)
        };
        let polygons = |counts: &[usize]| {
            let mut from = first;
            let polygon = |&count: &usize| {
                let rings: Vec<Path> = (from..from + count).map(path).collect();
                from += count;
                cut_polygon(&rings)
            };
            Cut::Polygons(counts.iter().flat_map(polygon).collect())
        };
        Some(match shape {
            Shape::Line | Shape::Lines(_) => Cut::Lines(curves.flat_map(line).collect()),
            Shape::Polygon(rings) => polygons(&[*rings]),
            Shape::Polygons(rings) => polygons(rings),
        })
    }

    /// The type in GeoJSON's words.
    pub fn kind(&self) -> &'static str {
        match self {
            Cut::Lines(lines) if lines.len() == 1 => "LineString",
            Cut::Lines(_) => "MultiLineString",
            Cut::Polygons(polygons) if polygons.len() == 1 => "Polygon",
            Cut::Polygons(_) => "MultiPolygon",
        }
    }

    /// Writes the coordinates.
    pub fn write(&self, text: &mut Text) -> io::Result<()> {
        match self {
            Cut::Lines(lines) if lines.len() == 1 => positions(text, &lines[0], false),
            Cut::Lines(lines) => list(text, lines.len(), |text, k| positions(text, &lines[k], false)),
            Cut::Polygons(polygons) if polygons.len() == 1 => rings(text, &polygons[0]),
            Cut::Polygons(polygons) => list(text, polygons.len(), |text, k| rings(text, &polygons[k])),
        }
    }
}

fn rings(text: &mut Text, polygon: &[Path]) -> io::Result<()> {
    list(text, polygon.len(), |text, k| positions(text, &polygon[k], true))
}

/// The positions of a path. A ring repeats its first, and has four at least.
fn positions(text: &mut Text, path: &Path, ring: bool) -> io::Result<()> {
    let count = if ring { (path.len() + 1).max(4) } else { path.len() };
    list(text, if path.is_empty() { 0 } else { count }, |text, k| {
        text.push("[")?;
        text.point(position(path.get(k).unwrap_or(&path[0])), ",")?;
        text.push("]")
    })
}
