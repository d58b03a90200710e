//! Geometries cut at the antimeridian.

use std::io;

use super::Shape;
use super::lists::{has_places, is_flat, list, nested, position};
use crate::batch::CurveBatch;
use crate::io::antimeridian::{Path, concerns, cut_line, cut_polygon};
use crate::io::longitude::settled_on_turns;
use crate::io::text::Text;

/// The parts of a geometry.
pub(super) enum Cut {
    /// The positions, and at the end of each the number of its point, or one between two.
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
            let settled = |point: &[f64]| [&[settled_on_turns(point[0])], &point[1..axes]].concat();
            points.chunks_exact(batch.dimension()).map(settled).collect()
        };
        let line = |i: usize| {
            let mut path = path(i);
            path.extend(path.first().cloned().filter(|_| batch.is_closed(i)));
            path.iter_mut().enumerate().for_each(|(k, position)| position.push(k as f64));
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
            Cut::Lines(lines) => nested(text, lines.len(), |text, k| {
                list(text, lines[k].len(), |text, at| position(text, lines[k][at].split_last().map_or(&[], |(_, x)| x)))
            }),
            Cut::Polygons(polygons) if polygons.len() == 1 => rings(text, &polygons[0]),
            Cut::Polygons(polygons) => list(text, polygons.len(), |text, k| rings(text, &polygons[k])),
        }
    }
}

fn rings(text: &mut Text, polygon: &[Path]) -> io::Result<()> {
    list(text, polygon.len(), |text, k| ring(text, &polygon[k]))
}

/// The positions of a ring, which repeats its first, and has four at least.
fn ring(text: &mut Text, path: &Path) -> io::Result<()> {
    let count = (path.len() + 1).max(4);
    list(text, if path.is_empty() { 0 } else { count }, |text, k| position(text, path.get(k).unwrap_or(&path[0])))
}
