//! The frame of a map of longitudes and latitudes: edges along the antimeridian and the poles.
//!
//! They bound the drawing and are nothing on the ground, so they stay straight. Only the coast
//! between them is fitted.

use super::TURN;
use crate::batch::CurveBatch;
use crate::curve::vector;

/// The distance within which points lie on the frame, in degrees: rounding of conversions.
const ROUNDING: f64 = 1e-9;

/// Whether curve `i` has an edge of the frame.
pub(super) fn is_in(batch: &CurveBatch, i: usize) -> bool {
    let points: Vec<[f64; 3]> = batch.points(i).chunks_exact(batch.dimension()).map(|p| vector(p).to_array()).collect();
    (0..batch.spans(i)).any(|k| {
        let edge = [points[k], points[(k + 1) % points.len()]];
        edge[0] != edge[1] && holds(edge)
    })
}

/// Whether an edge belongs to the frame: it goes along the antimeridian, along a pole, or along a
/// meridian to a pole.
pub(super) fn holds([a, b]: [[f64; 3]; 2]) -> bool {
    let is_pole = |point: [f64; 3]| (point[1].abs() - 0.25 * TURN).abs() <= ROUNDING;
    let antimeridian = || ((a[0] / TURN).rem_euclid(1.0) - 0.5).abs() * TURN <= ROUNDING;
    let same = |axis: usize| (a[axis] - b[axis]).abs() <= ROUNDING;
    same(1) && is_pole(a) || same(0) && (is_pole(a) || is_pole(b) || antimeridian())
}
