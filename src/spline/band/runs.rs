//! Straight runs of a polygon, and the knots on its edges.

use crate::linalg::scalar::{Vector, dot, scale, subtract};
use crate::sort::farthest;

/// The distance of a run's vertices from its chord, in units of D.
const STRAIGHT: f64 = 0.01;

/// The distances of every vertex from the ends of its straight run, along the polygon: on the side
/// of the edge before it, and of the edge after it. Points are in units of D.
///
/// The vertices of a run are within [`STRAIGHT`] of its chord. A closed polygon has its first vertex
/// again at its end.
pub(super) fn from_ends<const D: usize>(points: &[Vector<f64, D>], t: &[f64]) -> Vec<[f64; 2]> {
    let mut found = vec![[0.0; 2]; points.len()];
    for run in ends_of_runs(points, STRAIGHT).windows(2) {
        for k in run[0]..=run[1] {
            let away = (t[k] - t[run[0]]).min(t[run[1]] - t[k]);
            if k > run[0] {
                found[k][0] = away;
            }
            if k < run[1] {
                found[k][1] = away;
            }
        }
    }
    found
}

/// The vertices at which runs begin that are this near to their chords, and the last vertex.
pub(super) fn ends_of_runs<const D: usize>(points: &[Vector<f64, D>], straight: f64) -> Vec<usize> {
    let n = points.len();
    let mut ends = vec![0];
    while ends[ends.len() - 1] + 1 < n {
        let start = ends[ends.len() - 1];
        ends.push(farthest(start + 1, |end| end < n && is_straight(&points[start..=end], straight)));
    }
    ends
}

/// Whether all points are this near to the chord from the first to the last, and in order along it.
fn is_straight<const D: usize>(points: &[Vector<f64, D>], straight: f64) -> bool {
    let chord = subtract(points[points.len() - 1], points[0]);
    let length = dot(chord, chord).sqrt();
    let mut farthest = 0.0;
    points[1..].iter().all(|point| {
        let own = subtract(*point, points[0]);
        let along = dot(own, chord) / length;
        let across = subtract(own, scale(along / length, chord));
        let is_next = along > farthest;
        farthest = along;
        is_next && dot(across, across).sqrt() <= straight
    })
}

/// The places of the knots inside an edge of this length, in units of D, in increasing order. Its
/// ends are `from` and `to` away from the ends of its run.
///
/// From either end towards the middle a knot is as far from the next as from the end of the run, at
/// least 1.
pub(super) fn inside(length: f64, [from, to]: [f64; 2]) -> Vec<f64> {
    let steps = |from: f64| {
        let mut places = Vec::new();
        let mut at = from.max(1.0);
        while at < 0.45 * length {
            places.push(at);
            at += (from + at).max(1.0);
        }
        places
    };
    let mut places = steps(from);
    if length > from.min(to).max(1.0) {
        places.push(0.5 * length);
    }
    places.extend(steps(to).into_iter().rev().map(|at| length - at));
    places
}

/// The distance that a knot may be from the polygon, in units of D, at a distance from the ends of
/// its run.
pub(super) fn radius(away: f64) -> f64 {
    if away <= 1.0 { 1.0 } else { (1.0 / (away * away)).max(STRAIGHT) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_goes_on_over_vertices_on_its_line_and_ends_at_a_turn() {
        let points = [[0.0, 0.0], [10.0, 0.005], [20.0, 0.0], [20.0, 5.0], [20.0, 3.0]];
        let t = [0.0, 10.0, 20.0, 25.0, 27.0];
        assert_eq!(from_ends(&points, &t), [[0.0; 2], [10.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]]);
    }

    #[test]
    fn noise_below_a_hundredth_is_straight_and_a_fine_arc_is_not() {
        let arc: Vec<[f64; 2]> =
            (0..=200).map(|k| f64::from(k) * 0.01).map(|a| [30.0 * a.sin(), 30.0 * a.cos()]).collect();
        let t: Vec<f64> = (0..=200).map(|k| f64::from(k) * 0.3).collect();
        let farthest = from_ends(&arc, &t).into_iter().flatten().fold(0.0, f64::max);
        // A chord of 2 √(2 R 0.01).
        assert!(farthest > 0.3 && farthest < 1.6, "{farthest}");
    }

    #[test]
    fn knots_lie_closer_the_nearer_to_the_end_of_a_run() {
        assert_eq!(
            inside(100.0, [0.0, 0.0]),
            [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 50.0, 68.0, 84.0, 92.0, 96.0, 98.0, 99.0]
        );
        assert_eq!(inside(10.0, [2.0, 30.0]), [2.0, 5.0]);
        assert!(inside(10.0, [20.0, 30.0]).is_empty() && inside(0.9, [0.0, 0.0]).is_empty());
        assert_eq!([0.5, 1.0, 2.0, 100.0].map(radius), [1.0, 1.0, 0.25, 0.01]);
    }
}
