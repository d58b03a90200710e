//! Tautness: Σ Δs/w², where w is the width of the span.

use super::{Energy, Facts, Partials, Term, Window};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::width::widths;

/// The tautness Σ Δs/w², in 1/length, where w is the width that the data leave for the curve in the
/// span of the edge.
///
/// ```text
/// w = max(h′ (1 + cos θ)/2, h/10)
/// ```
///
/// h is the chord of the span, h′ the shortest of this chord and its neighbours, and θ the larger
/// turn of the data polygon at the span's two ends. An open curve has no turn at its own ends.
/// Tautness is the length of every span, weighted by the room for loops there. Bending has the same
/// unit, so the weight τ of tautness relative to bending is dimensionless, and shapes do not depend
/// on the unit of length. A disturbance decays as e^(−√τ s/w) along a span. τ = 1 hardly changes
/// gentle curves, and prevents loops where the data turn sharply or spans are unequal. With bending
/// alone many data have no curve of least energy; with both, one exists for all.
///
/// If a planar curve of [`Fair`](crate::discrete::Fair) intersects itself where its data polygon
/// does not, the spans involved get smaller widths.
///
/// Its order is 1. Because w ≥ h/10, 16 edges per span can follow the turns. With fewer edges,
/// sharp data converge slowly. In [`Energy::evaluate`] the data points are the
/// [`targets`](crate::discrete::Evaluate::targets); without targets, every vertex is one.
///
/// Source: splines in tension (D. G. Schweikert, *An interpolation curve using a spline in
/// tension*, 1966), with one tension per span. The width is faircurve's, chosen by the table in
/// `benches/RESULTS.md`.
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

/// 1/w² of every edge, where w is the width of its span.
///
/// `rows` are the vertex indices of the data points. On a closed curve the number of vertices
/// follows, for the first point again. Lengths are in units of `size`.
pub(crate) fn of_spans<const D: usize>(points: &[Vector<f64, D>], rows: &[u32], closed: bool, size: f64) -> Vec<f64> {
    // Spans between repeated points have no edge and no direction.
    let spans: Vec<usize> = (1..rows.len()).map(|k| k - 1).filter(|&k| rows[k] < rows[k + 1]).collect();
    let chord = |&k: &usize| subtract(points[(k + 1) % points.len()], points[k]).map(|x| x / size);
    let mut taut = vec![0.0; rows.last().map_or(0, |&last| last as usize)];
    for (&span, own) in spans.iter().zip(of_chords(spans.iter().map(chord).collect(), closed)) {
        taut[rows[span] as usize..rows[span + 1] as usize].fill(own);
    }
    taut
}

/// 1/w² of every span, from the chords.
pub(crate) fn of_chords<const D: usize>(chords: Vec<Vector<f64, D>>, closed: bool) -> impl Iterator<Item = f64> {
    let lengths: Vec<f64> = chords.iter().map(|chord| dot(*chord, *chord).sqrt()).collect();
    let cosine = |before: usize, after: usize| dot(chords[before], chords[after]) / (lengths[before] * lengths[after]);
    widths(&lengths, closed, cosine).into_iter().map(|width| 1.0 / (width * width))
}
