//! Vertices on edges of other curves. If one of two neighbours has an additional vertex on their
//! common border, both get it.

use glam::DVec3;

use super::crossings::{self, Line, Place};
use super::stop::Stop;
use super::vertices::Vertices;
use crate::batch::CurveBatch;

/// The largest distance of a vertex on an edge, in roundings of the largest coordinate.
const ROUNDINGS: f64 = 4.0;

/// Inserts into all edges the vertices that lie on them, within `snap` or rounding.
pub(super) fn complete(paths: &mut [Vec<Stop>], batch: &CurveBatch, vertices: &Vertices, alone: &[bool], snap: f64) {
    let mut largest = 0.0_f64;
    let mut points: Vec<Vec<DVec3>> = Vec::with_capacity(paths.len());
    for (path, &alone) in paths.iter().zip(alone) {
        let stops: &[Stop] = if alone { &[] } else { path };
        points.push(stops.iter().map(|stop| vertices.position(stop.vertex, stop.turn).into()).collect());
        largest =
            points[points.len() - 1].iter().fold(largest, |largest, point| largest.max(point.abs().max_element()));
    }
    let lines: Vec<Line> =
        points.iter().enumerate().map(|(i, points)| Line { points, closed: batch.is_closed(i) }).collect();
    let tolerance = snap.max(ROUNDINGS * f64::EPSILON * largest);
    let mut missing: Vec<(Place, f64, Stop)> = Vec::new();
    for ((path, edge), along, (other, k)) in crossings::points_on_segments(&lines, tolerance) {
        let (stops, stop) = (&paths[path as usize], paths[other as usize][k as usize]);
        let ends = [stops[edge as usize], stops[(edge as usize + 1) % stops.len()]];
        if ends.iter().all(|end| end.vertex != stop.vertex) {
            missing.push(((path, edge), along, Stop { curve: ends[0].curve, point: ends[0].point, ..stop }));
        }
    }
    // Inserting from the last to the first keeps the indices of edges valid.
    missing.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.vertex.cmp(&b.2.vertex)));
    missing.dedup_by(|a, b| a.0 == b.0 && a.2.vertex == b.2.vertex);
    for ((path, edge), _, stop) in missing {
        paths[path as usize].insert(edge as usize + 1, stop);
    }
}
