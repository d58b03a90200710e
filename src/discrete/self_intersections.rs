//! Removes self-intersections of a planar curve where its data polygon has none, by drawing the
//! spans involved tauter.
//!
//! Tautness takes the width of a span from its chord, its neighbours and the turns of the data. It
//! does not account for a distant part of the curve that comes near. If two spans cross, both get a
//! smaller width and the descent continues, until they do not cross.

use std::ops::Range;

use glam::DVec3;

use super::curves::Vertices;
use super::lane::TerminationStatus;
use super::minimise::minimise;
use super::problem::Outcome;
use super::queue::{CurveFit, Goal};
use super::setup::PreparedCurve;
use crate::linalg::scalar::{Vector, dot, subtract};
use crate::topology::crossings::{Line, crossings};

/// The largest number of rounds. After this many a width of h/10 has reached its minimum.
pub(super) const ROUNDS: usize = 8;

/// The factor of 1/w² per round. With 4 more curves fail to converge on the way.
const TAUTER: f64 = 2.0;

/// The least width of a span, in edges. Within half an edge a curve cannot turn. With 1 instead of
/// 2/3 more crossings remain.
const LEAST_WIDTH: f64 = 2.0 / 3.0;

/// The most iterations of a round. A curve that needs more has no room to turn within its edges.
const MOST_ITERATIONS: u32 = 100;

/// The message for a curve that was drawn tauter in these spans.
pub(super) fn message(spans: &[usize]) -> String {
    format!(
        "from this point to the next it crossed itself where its points do not: it is drawn tauter in {} of its spans",
        spans.len()
    )
}

/// The result for a curve that may have crossed itself.
#[derive(Default)]
pub(super) struct Untangled {
    /// The spans that were drawn tauter, in increasing order.
    pub tauter: Vec<usize>,
    /// Whether it may still cross itself.
    pub may_cross: bool,
}

/// Draws spans tauter that cross although their data do not.
///
/// A curve that does not converge with more tension stays as it was.
pub(super) async fn untangle<const D: usize>(
    curve: &CurveFit<'_, D>,
    ready: &mut PreparedCurve<D>,
    outcome: &mut Outcome<D>,
) -> Untangled {
    let mut found = Untangled::default();
    if D != 2 || !curve.fair.energy.is_taut() {
        return found;
    }
    for _ in 0..ROUNDS {
        let spans = ready.tangled(outcome);
        found.may_cross = !spans.is_empty();
        let Some(mut trial) = ready.tauter(&spans, outcome) else { break };
        let most = trial.problem.most_iterations;
        trial.problem.most_iterations = most.min(MOST_ITERATIONS);
        let (trial, after) = Box::pin(minimise(curve, trial, Goal::Free)).await;
        if after.termination != TerminationStatus::Converged {
            outcome.iterations += after.iterations;
            break;
        }
        ready.problem.taut = trial.problem.taut;
        outcome.go_on(after);
        found.tauter.extend(spans);
    }
    found.tauter.sort_unstable();
    found.tauter.dedup();
    found
}

impl<const D: usize> PreparedCurve<D> {
    /// The spans of a converged curve that cross where its data polygon does not, in increasing
    /// order.
    pub(super) fn tangled(&self, outcome: &Outcome<D>) -> Vec<usize> {
        if outcome.termination != TerminationStatus::Converged {
            return vec![];
        }
        let Vertices { coords, rows, .. } = Vertices::of(self, self.vertices_of(outcome));
        tangled(coords.as_chunks::<D>().0, &rows, self.problem.closed)
    }

    /// The curve with these spans narrower, to continue the descent from. `None` if there are no
    /// spans, or all have their least width.
    fn tauter(&self, spans: &[usize], outcome: &Outcome<D>) -> Option<Self> {
        if spans.is_empty() {
            return None;
        }
        let mut ready = self.clone();
        ready.narrow(spans).then(|| {
            ready.problem.rebase(&outcome.displacements);
            ready
        })
    }

    /// Makes spans narrower. Returns whether any had room for it.
    pub(super) fn narrow(&mut self, spans: &[usize]) -> bool {
        let most = |edges: Range<usize>| {
            let length: f64 = self.problem.base[edges.clone()].iter().map(|edge| dot(*edge, *edge).sqrt()).sum();
            (edges.len() as f64 / (LEAST_WIDTH * length)).powi(2)
        };
        let of_span = |&k: &usize| {
            let edges = self.rows[k] as usize..self.rows[k + 1] as usize;
            (edges.clone(), most(edges))
        };
        let narrower: Vec<(Range<usize>, f64)> =
            spans.iter().map(of_span).filter(|(edges, most)| self.problem.taut[edges.start] < *most).collect();
        let any = !narrower.is_empty();
        for (edges, most) in narrower {
            self.problem.taut[edges].iter_mut().for_each(|taut| *taut = (TAUTER * *taut).min(most));
        }
        any
    }
}

/// The spans of a curve that cross where its data polygon does not, in increasing order. `rows` are
/// the vertex indices of the data points.
pub(super) fn tangled<const D: usize>(vertices: &[Vector<f64, D>], rows: &[u32], closed: bool) -> Vec<usize> {
    if is_simple(vertices, closed) {
        return vec![];
    }
    let crossing = edges_that_cross(vertices, closed);
    if crossing.is_empty() {
        return vec![];
    }
    // Spans between repeated points have no edge.
    let data: Vec<usize> = (1..rows.len()).map(|k| k - 1).filter(|&k| rows[k] < rows[k + 1]).collect();
    let mut corners: Vec<Vector<f64, D>> = data.iter().map(|&k| vertices[rows[k] as usize]).collect();
    corners.extend((!closed).then(|| vertices[vertices.len() - 1]));
    let of_data: Vec<[usize; 2]> =
        edges_that_cross(&corners, closed).into_iter().map(|pair| pair.map(|edge| data[edge as usize])).collect();
    let spans = rows.len() - 1;
    let near = |a: usize, b: usize| a.abs_diff(b) <= 1 || (closed && a.abs_diff(b) + 1 >= spans);
    let is_new = |[a, b]: &[usize; 2]| !of_data.iter().any(|[c, d]| near(*a, *c) && near(*b, *d));
    let span = |edge: u32| rows.partition_point(|&row| row <= edge) - 1;
    let mut tangled: Vec<usize> = crossing.into_iter().map(|pair| pair.map(span)).filter(is_new).flatten().collect();
    tangled.sort_unstable();
    tangled.dedup();
    tangled
}

/// The pairs of non-adjacent edges of a polygon that cross, touch or overlap.
fn edges_that_cross<const D: usize>(vertices: &[Vector<f64, D>], closed: bool) -> Vec<[u32; 2]> {
    let points: Vec<DVec3> = vertices.iter().map(|vertex| DVec3::new(vertex[0], vertex[1], 0.0)).collect();
    let pairs = crossings(&[Line { points: &points, closed }], |_| true);
    pairs.into_iter().map(|pair| pair.map(|(_, edge)| edge)).collect()
}

/// Whether a curve is certain not to cross itself: it moves forwards all the way, or turns by at
/// most half a turn.
///
/// A curve that crosses itself has a loop, which turns by more than half a turn. The test may be
/// false for other simple curves.
pub(super) fn is_simple<const D: usize>(vertices: &[Vector<f64, D>], closed: bool) -> bool {
    if closed {
        return false;
    }
    let along = subtract(vertices[vertices.len() - 1], vertices[0]);
    let edge = |j: usize| subtract(vertices[j + 1], vertices[j]);
    let edges = vertices.len() - 1;
    if (0..edges).all(|j| dot(edge(j), along) > 0.0) {
        return true;
    }
    let mut turned = 0.0;
    let mut before = edge(0);
    for j in 1..edges {
        let here = edge(j);
        let (across, forward) = (before[0] * here[1] - before[1] * here[0], before[0] * here[0] + before[1] * here[1]);
        // An angle is at most its tangent, and turns of fine polygons are small.
        turned += if forward > across.abs() { across.abs() / forward } else { across.atan2(forward).abs() };
        before = here;
    }
    turned <= std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::super::problem::descend_on_cpu;
    use super::super::setup::set_up;
    use super::super::{Fair, bending, tautness};
    use super::*;
    use crate::{CurveBatch, CurveStatus, Device};

    /// The north-east of an island: a long, narrow cape, and a coast that passes near it.
    const CAPE: [[f64; 2]; 7] = [
        [32.733, 35.14],
        [32.802, 35.145],
        [32.946, 35.387],
        [33.666, 35.373],
        [34.576, 35.671],
        [33.9, 35.246],
        [33.975, 35.058],
    ];

    const GENTLE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];

    /// Passes through one point twice, as does its polygon.
    const EIGHT: [[f64; 2]; 5] = [[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.0], [-0.5, 0.4]];

    fn crossings_of(vertices: &[f64]) -> usize {
        edges_that_cross(vertices.as_chunks::<2>().0, false).len()
    }

    #[test]
    fn spans_that_cross_where_their_points_do_not_are_drawn_tauter_until_they_do_not() {
        let fair = Fair { energy: bending(2.0) + 0.5 * tautness(), ..Fair::default() };
        let batch = CurveBatch::from_slices(&[&CAPE[..], &GENTLE[..], &EIGHT[..]]).unwrap();
        let plan = fair.plan(&fair.energy);
        let mut before = Vec::new();
        for ready in set_up::<2>(&fair, &batch).unwrap() {
            let ready = ready.unwrap();
            let outcomes = descend_on_cpu(&plan, &fair.energy, &[&ready.problem], &|_, _| {});
            before.push(edges_that_cross(&ready.vertices_of(&outcomes[0]), false).len());
        }
        assert!(before[0] > 0 && before[1] == 0 && before[2] > 0, "{before:?}");

        let (fit, samples) = fair.fit_sampled(&batch, crate::Sampling::PerSpan(16), &Device::cpu()).unwrap();
        let reports = fit.reports();
        assert!(reports.iter().all(|report| report.status == CurveStatus::Converged), "{reports:?}");
        assert_eq!(crossings_of(samples.points(0)), 0);
        let message = reports[0].message.as_deref().unwrap();
        assert!(
            message.contains("crossed itself where its points do not: it is drawn tauter in 2 of its spans"),
            "{message}"
        );
        // The other curves keep every bit, and crossings of the data remain.
        assert_eq!([&reports[1].message, &reports[2].message], [&None, &None]);
        assert_eq!(crossings_of(samples.points(2)), before[2]);
        for (k, points) in [(1, &GENTLE[..]), (2, &EIGHT[..])] {
            let alone = CurveBatch::from_slices(&[points]).unwrap();
            let (_, alone) = fair.fit_sampled(&alone, crate::Sampling::PerSpan(16), &Device::cpu()).unwrap();
            assert_eq!(alone.points(0), samples.points(k));
        }
    }

    #[test]
    fn energies_without_tautness_stay_as_they_are() {
        let batch = CurveBatch::from_slices(&[&CAPE[..]]).unwrap();
        let fair = Fair { energy: bending(2.0) + 100.0 * super::super::length(), ..Fair::default() };
        let fit = fair.fit(&batch, &Device::cpu()).unwrap();
        assert!(fit.reports()[0].message.is_none(), "{:?}", fit.reports());
        assert!((bending(2.0) + tautness()).is_taut() && !fair.energy.is_taut());
    }

    #[test]
    fn what_is_called_simple_does_not_cross_itself() {
        let spiral = |turns: f64| -> Vec<[f64; 2]> {
            (0..60)
                .map(|k| f64::from(k) / 59.0)
                .map(|part| (0.3 + part, turns * std::f64::consts::TAU * part))
                .map(|(radius, angle)| [radius * angle.cos(), radius * angle.sin()])
                .collect()
        };
        assert!(is_simple(&spiral(0.3), false), "half a turn at most");
        assert!(!is_simple(&spiral(2.0), false), "it turns, and may cross itself for all that is known");
        assert!(is_simple(&[[0.0, 0.0], [1.0, 0.9], [2.0, -0.9], [3.0, 0.9]], false), "forward all the way");
        assert!(!is_simple(&[[0.0, 0.0], [4.0, 1.0], [2.0, 3.0], [1.0, -1.0]], false), "a loop");
        assert!(!is_simple(&spiral(0.3), true));
    }
}
