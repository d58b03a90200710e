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
use crate::numbers::Numbers;
use crate::parallel;

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

/// `n` samples per curve at equal steps of the parameter, both ends of open curves included.
pub(crate) struct EvenSites {
    pub n: usize,
    /// For every knot, the first sample of its curve at or after it, to rounding; n for the last
    /// knot. The span after knot k has the samples `first[k] .. first[k + 1]`.
    pub first: Vec<u32>,
}

impl EvenSites {
    pub fn new(knots: &Knots, n: usize) -> Self {
        let mut first = vec![0; knots.t.len()];
        parallel::parts(&mut first, &knots.offsets, |i, first| {
            let Some(last) = first.len().checked_sub(1) else { return };
            let (t, steps) = (knots.t(i), Steps::of(knots, i, n));
            // A little slower than samples are, so that rounding passes over none at a knot.
            let pace = (1.0 - 4.0 * f64::EPSILON) / steps.step;
            for k in 1..last {
                let exact = (t[k] - t[0]) * pace;
                let before = exact as usize;
                first[k] = (before + usize::from(exact > before as f64)).min(n) as u32;
            }
            first[last] = n as u32;
        });
        EvenSites { n, first }
    }

    /// For every span of curve `i`, the fraction of it at its first sample and the step to the
    /// next, at most 1: a span with a larger step has one sample. The last knot has none.
    pub fn fractions(&self, knots: &Knots, i: usize, to: &mut [f64]) {
        let first = &self.first[knots.range(i)];
        if first.is_empty() {
            return;
        }
        let (t, steps) = (knots.t(i), Steps::of(knots, i, self.n));
        for ((to, pair), first) in to.as_chunks_mut::<2>().0.iter_mut().zip(t.windows(2)).zip(first) {
            let h = pair[1] - pair[0];
            *to = [((steps.at(*first as usize) - pair[0]) / h).clamp(0.0, 1.0), (steps.step / h).min(1.0)];
        }
    }
}

/// Samples that a GPU took, by knots. The CPU replaces samples that are not finite, and all samples of
/// curves that it has changed.
pub(super) enum Taken {
    None,
    /// Where the samples of the batch are to be.
    Here,
    /// Elsewhere, since some curves have more samples, with the start of every curve.
    There(Numbers, Vec<usize>),
}

/// Equal steps of the parameter along a curve.
pub(super) struct Steps {
    from: f64,
    to: f64,
    step: f64,
}

impl Steps {
    pub fn of(knots: &Knots, i: usize, n: usize) -> Self {
        let t = knots.t(i);
        let (from, to) = (t[0], t[t.len() - 1]);
        let steps = if knots.closed[i] { n } else { n.saturating_sub(1) }.max(1) as f64;
        Steps { from, to, step: (to - from) / steps }
    }

    /// The parameter of a sample.
    pub fn at(&self, sample: usize) -> f64 {
        (self.from + self.step * sample as f64).min(self.to)
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
