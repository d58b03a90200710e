//! Required signs of the curvature of planar curves that preserve the shape of their points.
//!
//! At a point the curve turns to the side of the data polygon. A span between turns to the same
//! side keeps to that side, and a span at an end keeps to its neighbour's side. A span between
//! turns to different sides may have one inflection. If the polygon goes straight on through a
//! point, both adjacent spans are straight. A reversal imposes no side.
//!
//! Source: T. N. T. Goodman and K. Unsworth, *Shape preserving interpolation by curvature
//! continuous parametric curves*, Computer Aided Geometric Design 5 (1988), section 2.

/// Turns with a smaller sine count as straight, and so do smaller fractions of a chord along a
/// direction.
pub(crate) const STRAIGHT: f64 = 1e-9;

/// The required sign of a span's curvature: 1 for left, −1 for right, 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Asked {
    /// At its start and at its end.
    pub ends: [f64; 2],
    /// Along the whole span.
    pub within: f64,
    /// Whether the span is straight.
    pub straight: bool,
}

/// The side to which a polygon turns between two edges.
pub(crate) fn side(a: [f64; 2], b: [f64; 2]) -> f64 {
    // Unit vectors first: products of long edges may overflow.
    let unit = |[x, y]: [f64; 2]| {
        let length = x.hypot(y);
        [x / length, y / length]
    };
    let ([a, b], [u, v]) = (unit(a), unit(b));
    let sine = a * v - b * u;
    if sine.abs() < STRAIGHT || sine.is_nan() { 0.0 } else { sine.signum() }
}

/// Whether a polygon goes straight on between two edges.
pub(crate) fn goes_on([a, b]: [f64; 2], [u, v]: [f64; 2]) -> bool {
    // The larger components of collinear vectors have the same axis. Products may overflow.
    let same = if a.abs() > b.abs() { a.signum() == u.signum() } else { b.signum() == v.signum() };
    side([a, b], [u, v]) == 0.0 && same
}

/// The side on which both ends agree, if an end has one.
pub(crate) fn agreed(sides: [Option<f64>; 2]) -> f64 {
    match sides {
        [Some(a), Some(b)] if a == b => a,
        [Some(_), Some(_)] => 0.0,
        [a, b] => a.or(b).unwrap_or(0.0),
    }
}

/// The required sign per span. Consecutive points must be distinct.
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
