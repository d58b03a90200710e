//! Tautness: Σ Δs/w², with w the width of the span.

use super::{Energy, Facts, Partials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::width::widths;

/// The tautness Σ Δs/w², in 1/length, where w is the width that the data leave a curve in the span of
/// the edge Δs.
///
/// ```text
/// w = max(h′ (1 + cos θ)/2, h/10)
/// ```
///
/// h is the chord of the span, h′ the shortest of it and the chords beside it, and θ the larger turn of
/// the data's polygon at its two ends; an open curve has no turn at its own ends. Tautness is the length
/// of every span, weighed by what loops have room for there. Bending has the same unit, so that a weight
/// τ against bending is a number: metres and degrees, small and large, all give the same shapes.
/// A disturbance dies away as e^(−√τ s/w) along a span: 1 leaves gentle curves almost as they are without
/// it, and keeps curves from loops where the data turn sharply or spans are unequal. With bending alone many
/// data have no curve of least energy; with both, one exists for all.
///
/// Where planar curves of [`Fair`](crate::discrete::Fair) cross themselves all the same, and the polygon of their
/// points does not, the spans that cross get narrower widths.
///
/// Its order is 1. w is at least h/10, so that 16 edges a span can follow the turns. Divided into fewer,
/// sharp data converge slowly. In [`Energy::evaluate`] the data points are
/// those of [`targets`](crate::discrete::Evaluate::targets); without these every vertex is one.
///
/// Source: splines in tension (D. G. Schweikert, *An interpolation curve using a spline in tension*,
/// 1966), with a tension a span. The width is faircurve's: `benches/RESULTS.md` has the table that
/// chose it.
pub fn tautness() -> Energy {
    Tautness.into()
}

/// Δs/w²
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tautness;

impl Facts for Tautness {
    fn degree(&self) -> f64 {
        -1.0
    }

    fn stiffness(&self, _: f64) -> f64 {
        1.0
    }

    fn bounds_length(&self) -> bool {
        true
    }
}

impl Term<1> for Tautness {
    const BY_TANGENT: bool = false;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> S {
        window.taut * window.length[0]
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        Partials { value: window.taut * window.length[0], tangent: [[S::ZERO; D]], length: [window.taut] }
    }
}

/// 1/w² of every edge, with w the width of its span.
///
/// `rows` are the vertices of the data points, at the end of a closed curve the first once more.
/// Lengths are in units of `size`.
pub(crate) fn of_spans<const D: usize>(points: &[Vector<f64, D>], rows: &[u32], closed: bool, size: f64) -> Vec<f64> {
    // Spans between repeated points have no edge and no direction.
    let spans: Vec<usize> = (1..rows.len()).map(|k| k - 1).filter(|&k| rows[k] < rows[k + 1]).collect();
    let chord = |&k: &usize| subtract(points[(k + 1) % points.len()], points[k]).map(|x| x / size);
    let chords: Vec<Vector<f64, D>> = spans.iter().map(chord).collect();
    let lengths: Vec<f64> = chords.iter().map(|chord| dot(*chord, *chord).sqrt()).collect();
    let cosine = |before: usize, after: usize| dot(chords[before], chords[after]) / (lengths[before] * lengths[after]);
    let mut taut = vec![0.0; rows.last().map_or(0, |&last| last as usize)];
    for (&span, width) in spans.iter().zip(widths(&lengths, closed, cosine)) {
        taut[rows[span] as usize..rows[span + 1] as usize].fill(1.0 / (width * width));
    }
    taut
}
