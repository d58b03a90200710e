//! Points of cubic splines from values and second derivatives at the knots. Twin: `shaders/spline/sample.wgsl`.

use crate::linalg::Real;

/// Samples that are not evenly spread over the spans: the knot before each, and the fraction of the span after it.
pub(crate) struct Sites {
    /// First sample of every curve, and the number of all at the end.
    pub offsets: Vec<usize>,
    /// Knots, counted within their curve.
    pub knots: Vec<u32>,
    /// Fractions 0 … 1 of the span after the knot.
    pub fractions: Vec<f64>,
}

/// The point at the fraction `u` of a span of length `h`, of one coordinate: `values` and `second` are those at its two ends.
pub(crate) fn evaluate<T: Real>(h: T, u: T, values: [T; 2], second: [T; 2]) -> T {
    let a = T::ONE - u;
    let sixth = h * h / T::from_f64(6.0);
    let wa = (a * a * a - a) * sixth;
    let wu = (u * u * u - u) * sixth;
    a * values[0] + u * values[1] + (wa * second[0] + wu * second[1])
}
