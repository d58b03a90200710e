//! Points of cubic splines from values and second derivatives at the knots. Twin: `shaders/spline/sample.wgsl`.

use super::knots::Knots;
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

impl Sites {
    /// `n` samples a curve at equal steps of the parameter, both ends of open curves included.
    pub fn evenly(knots: &Knots, n: usize) -> Self {
        let mut sites = Sites { offsets: vec![0], knots: Vec::new(), fractions: Vec::new() };
        for i in 0..knots.len() {
            let t = knots.t(i);
            if let Some(last) = t.len().checked_sub(1) {
                let steps = if knots.closed[i] { n } else { n.saturating_sub(1) }.max(1) as f64;
                let mut k = 0;
                for sample in 0..n {
                    let at = (t[0] + (t[last] - t[0]) * (sample as f64 / steps)).min(t[last]);
                    while k + 2 < t.len() && t[k + 1] <= at {
                        k += 1;
                    }
                    sites.knots.push(k as u32);
                    sites.fractions.push(((at - t[k]) / (t[k + 1] - t[k])).clamp(0.0, 1.0));
                }
            }
            sites.offsets.push(sites.knots.len());
        }
        sites
    }
}

/// The point at the fraction `u` of a span of length `h`, of one coordinate: `values` and `second` are those at its two ends.
pub(crate) fn evaluate<T: Real>(h: T, u: T, values: [T; 2], second: [T; 2]) -> T {
    let a = T::ONE - u;
    let sixth = h * h / T::from_f64(6.0);
    let wa = (a * a * a - a) * sixth;
    let wu = (u * u * u - u) * sixth;
    a * values[0] + u * values[1] + (wa * second[0] + wu * second[1])
}
