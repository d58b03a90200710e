//! What the tests of smooth connection functions share.

use std::f64::consts::{PI, TAU};

use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::{CurveBatch, Device, Fit};
use glam::DVec2;
use serde::Deserialize;

/// A row of the reference values: the least ∫|κ|^ν ds through points.
#[derive(Clone, Debug, Deserialize)]
pub struct Exact {
    pub name: String,
    pub closed: bool,
    pub nu: f64,
    pub points: Vec<[f64; 2]>,
    pub total_cost: f64,
    pub slopes_radians: Option<Vec<f64>>,
}

pub fn exact() -> Vec<Exact> {
    serde_json::from_str(include_str!("../data/scf_splines.json")).unwrap()
}

/// The points of a set of that name, and whether it is closed.
pub fn set(name: &str) -> (Vec<[f64; 2]>, bool) {
    let row = exact().into_iter().find(|row| row.name == name).unwrap();
    (row.points, row.closed)
}

/// The method of this exponent.
pub fn of(exponent: f64) -> Smooth {
    Smooth { exponent, ..Smooth::default() }
}

pub fn fit(smooth: &Smooth, batch: &CurveBatch) -> Fit {
    smooth.fit(batch, &Device::cpu()).unwrap()
}

/// An angle, from −π to π.
pub fn wrap(angle: f64) -> f64 {
    let turns = angle - TAU * (angle / TAU).round();
    turns.clamp(-PI, PI)
}

/// The directions of fitted curve `i` at its data points.
pub fn slopes(fit: &Fit, i: usize) -> Vec<f64> {
    let curve = fit.curve(i);
    let spans = curve.spans();
    let ends = (0..spans).map(|span| (span, 0.0)).chain((!curve.is_closed()).then_some((spans - 1, 1.0)));
    ends.map(|(span, u)| curve.jet(span, u).first).map(|first| first.y.atan2(first.x)).collect()
}

/// The cost of every segment of curves through the same points with these slopes; NaN where one has
/// no minimiser.
pub fn total_costs(points: &[[f64; 2]], closed: bool, exponent: f64, slopes: &[Vec<f64>]) -> Vec<f64> {
    let n = points.len();
    let segments = if closed { n } else { n - 1 };
    let query = |slopes: &Vec<f64>, k: usize| {
        let ([x, y], [u, v]) = (points[k], points[(k + 1) % n]);
        let direction = (v - y).atan2(u - x);
        let angles = [slopes[k], slopes[(k + 1) % n]].map(|slope| wrap(slope - direction));
        Query { chord: (u - x).hypot(v - y), angles, exponent }
    };
    let queries: Vec<Query> = slopes.iter().flat_map(|slopes| (0..segments).map(move |k| query(slopes, k))).collect();
    let found = evaluate_segments(&queries, &Device::cpu()).unwrap();
    found.chunks(segments).map(|all| all.iter().map(|cost| cost.map_or(f64::NAN, |cost| cost.cost)).sum()).collect()
}

pub const SCALENE: [[f64; 2]; 3] = [[0.0, 0.0], [2.0, 0.2], [0.7, 1.4]];

pub const S: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.2, -0.5], [4.0, 0.3]];

/// Centre and radius of the circle through three points.
pub fn circumcircle([a, b, c]: [[f64; 2]; 3]) -> (DVec2, f64) {
    let [a, b, c] = [a, b, c].map(DVec2::from);
    let (u, v) = (b - a, c - a);
    let centre = a + (v.length_squared() * u - u.length_squared() * v).perp() / (2.0 * u.perp_dot(v));
    (centre, (centre - a).length())
}
