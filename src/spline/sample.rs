//! Points of cubic splines from points and second derivatives at the knots.
//! Twin: `shaders/spline/sample.wgsl`.
//!
//! On a span of length h between the points p, q with second derivatives m, n, at the fraction u
//! (Press et al., *Numerical Recipes*, section 3.3, written as a polynomial in u):
//!
//! ```text
//! p(u) = p + u·(A + u·(B + u·C)),   A = q − p − h²(2m + n)/6,   B = h²m/2,   C = h²(n − m)/6
//! ```

use super::knots::Knots;

/// Samples that are not evenly spread over the spans: the knot before each, and the fraction of the
/// span after it.
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

/// A, B and C of the module's formula, from p, q, m and n.
#[inline(always)]
pub(super) fn coefficients(h: f64, [p, q, m, n]: [f64; 4]) -> [f64; 3] {
    // h twice, never h²: that may be out of range where the product is not.
    let (start, end) = (h * (h * m), h * (h * n));
    [q - p - (2.0 * start + end) / 6.0, 0.5 * start, (end - start) / 6.0]
}

/// The polynomial of a span: p, A, B, C of the module's formula, for each coordinate.
pub(crate) struct Cubic<const D: usize>([[f64; 4]; D]);

impl<const D: usize> Cubic<D> {
    /// From the span's length and the points and second derivatives at its two ends, `D` numbers
    /// each.
    #[inline(always)]
    pub fn new(h: f64, points: &[f64], second: &[f64]) -> Self {
        let (p, m) = (&points[..2 * D], &second[..2 * D]);
        let mut cubic = [[0.0; 4]; D];
        for (coordinate, cubic) in cubic.iter_mut().enumerate() {
            let [a, b, c] = coefficients(h, [p[coordinate], p[D + coordinate], m[coordinate], m[D + coordinate]]);
            *cubic = [p[coordinate], a, b, c];
        }
        Cubic(cubic)
    }

    /// The point at the fraction `u`.
    #[inline(always)]
    pub fn at(&self, u: f64) -> [f64; D] {
        // A loop, which unlike a closure of the standard library's becomes part of its caller and
        // of the caller's instruction set.
        let mut point = [0.0; D];
        for (x, [p, a, b, third]) in point.iter_mut().zip(&self.0) {
            *x = p + u * (a + u * (b + u * third));
        }
        point
    }

    /// Writes the points `from .. to` at their fractions `u`, [`LANES`] at a time.
    ///
    /// Points of the next span may be overwritten. They are written later.
    #[inline(always)]
    pub fn write(&self, points: &mut [[f64; D]], (from, to): (usize, usize), u: impl Fn(f64) -> f64, given: &[f64]) {
        let mut i = from;
        while i < to {
            let (Some(points), Some(given)) =
                (points[i..].first_chunk_mut::<LANES>(), given[i..].first_chunk::<LANES>())
            else {
                points[i..to].iter_mut().zip(&given[i..to]).for_each(|(point, &given)| *point = self.at(u(given)));
                return;
            };
            for (point, &given) in points.iter_mut().zip(given) {
                *point = self.at(u(given));
            }
            i += LANES;
        }
    }
}

/// Enough points to fill the registers, and not many more than a span has.
const LANES: usize = 4;
