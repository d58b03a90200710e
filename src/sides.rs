//! The sides to which planar curves turn that keep the shape of their points.
//!
//! At a point it is the side to which the polygon of the points turns. In a span between two points that turn to one
//! side it is that side, and between an end and its neighbour that of the neighbour. A span between turns to different
//! sides may turn to both, which is one inflection. Where the polygon goes straight on through a point, both spans beside
//! it are straight. Where it reverses there is no side.
//!
//! Source: T. N. T. Goodman and K. Unsworth, *Shape preserving interpolation by curvature continuous parametric curves*,
//! Computer Aided Geometric Design 5 (1988), section 2.

/// A turn of the polygon of less than this sine is none, and so is a way along a direction of less than this part of a chord.
pub(crate) const STRAIGHT: f64 = 1e-9;

/// What a span asks of its curvature: 1 for the left, −1 for the right, 0 for nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Asked {
    /// At its start and at its end.
    pub ends: [f64; 2],
    /// All along it.
    pub within: f64,
    /// Whether it is straight, which leaves it no side.
    pub straight: bool,
}

/// The side to which a polygon turns from an edge to the next.
pub(crate) fn side(a: [f64; 2], b: [f64; 2]) -> f64 {
    // Unit vectors first: products of long edges may be out of range.
    let unit = |[x, y]: [f64; 2]| {
        let length = x.hypot(y);
        [x / length, y / length]
    };
    let ([a, b], [u, v]) = (unit(a), unit(b));
    let sine = a * v - b * u;
    if sine.abs() < STRAIGHT || sine.is_nan() { 0.0 } else { sine.signum() }
}

/// Whether a polygon goes straight on from an edge to the next.
pub(crate) fn goes_on([a, b]: [f64; 2], [u, v]: [f64; 2]) -> bool {
    // Vectors in a line have their larger components along the same axis. Products may be out of range.
    let same = if a.abs() > b.abs() { a.signum() == u.signum() } else { b.signum() == v.signum() };
    side([a, b], [u, v]) == 0.0 && same
}

/// The side of two ends that agree, one of which may have none of its own.
pub(crate) fn agreed(sides: [Option<f64>; 2]) -> f64 {
    match sides {
        [Some(a), Some(b)] if a == b => a,
        [Some(_), Some(_)] => 0.0,
        [a, b] => a.or(b).unwrap_or(0.0),
    }
}

/// What the spans between points ask for, of which no two that follow each other are equal.
pub(crate) fn of_spans(points: &[[f64; 2]], closed: bool) -> Vec<Asked> {
    let n = points.len();
    let spans = if closed { n } else { n.saturating_sub(1) };
    let chord = |k: usize| {
        let ([x, y], [u, v]) = (points[k % n], points[(k + 1) % n]);
        [u - x, v - y]
    };
    let is_end = |k: usize| !closed && (k == 0 || k + 1 == n);
    let at = |k: usize| (!is_end(k)).then(|| side(chord((k + n - 1) % n), chord(k)));
    let is_in_line = |k: usize| !is_end(k) && goes_on(chord((k + n - 1) % n), chord(k));
    let span = |k: usize| {
        let points = [k, (k + 1) % n];
        if points.into_iter().any(is_in_line) {
            return Asked { straight: true, ..Asked::default() };
        }
        let sides = points.map(at);
        let within = agreed(sides);
        Asked { ends: sides.map(|side| side.unwrap_or(within)), within, straight: false }
    };
    (0..spans).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_asks_for_the_side_on_which_its_ends_agree_and_an_end_for_that_of_its_neighbour() {
        // Left, left, right.
        let points = [[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [1.0, 2.0], [1.5, 3.0]];
        let [left, both, right] = [1.0, 0.0, -1.0];
        let asked = of_spans(&points, false);
        let of = |ends, within| Asked { ends, within, straight: false };
        assert_eq!(asked, [of([left; 2], left), of([left; 2], left), of([left, right], both), of([right; 2], right)]);
    }

    #[test]
    fn spans_in_a_line_are_straight_and_others_keep_sides() {
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 5.0], [4.0, 5.0], [5.0, 5.0]];
        let straight = Asked { straight: true, ..Asked::default() };
        let rise = Asked { ends: [1.0, -1.0], within: 0.0, straight: false };
        assert_eq!(of_spans(&points, false), [straight, straight, rise, straight, straight]);
    }

    #[test]
    fn reversals_and_two_points_ask_for_nothing_at_any_scale() {
        let nothing = Asked::default();
        for scale in [1e-300, 1.0, 1e300] {
            let at = |x: f64, y: f64| [scale * x, scale * y];
            assert_eq!(of_spans(&[at(0.0, 0.0), at(1.0, 0.0), at(0.5, 0.0)], false), [nothing; 2], "{scale:e}");
            let line = [at(0.0, 0.0), at(1.0, 1e-10), at(2.0, 0.0)];
            assert_eq!(of_spans(&line, false), [Asked { straight: true, ..nothing }; 2], "{scale:e}");
            assert_eq!(of_spans(&[at(0.0, 0.0), at(1.0, 0.0)], false), [nothing]);
            assert_eq!(of_spans(&[at(0.0, 0.0), at(1.0, 0.0)], true), [nothing; 2]);
            let ring = of_spans(&[at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], true);
            assert_eq!(ring, [Asked { ends: [1.0; 2], within: 1.0, straight: false }; 3], "{scale:e}");
        }
    }
}
