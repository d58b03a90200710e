//! The sides to which planar curves turn that keep the shape of their points.
//!
//! At a point it is the side to which the polygon of the points turns. In a span between two points that turn to one
//! side it is that side, and between an end and its neighbour that of the neighbour. A span between turns to different
//! sides may turn to both, which is one inflection. Points in a line ask for nothing.
//!
//! Source: T. N. T. Goodman and K. Unsworth, *Shape preserving interpolation by curvature continuous parametric curves*,
//! Computer Aided Geometric Design 5 (1988), section 2.

/// A turn of the polygon of less than this sine is none, and so is a way along a direction of less than this part of a chord.
pub(crate) const STRAIGHT: f64 = 1e-9;

/// What a span asks of its curvature: 1 for the left, −1 for the right, 0 for nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Asked {
    /// At its start and at its end.
    pub ends: [f64; 2],
    /// All along it.
    pub within: f64,
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
    let at = |k: usize| match k {
        0 if !closed => None,
        k if !closed && k + 1 == n => None,
        k => Some(side(chord((k + n - 1) % n), chord(k))),
    };
    let span = |k: usize| {
        let sides = [at(k), at((k + 1) % n)];
        let within = agreed(sides);
        Asked { ends: sides.map(|side| side.unwrap_or(within)), within }
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
        assert_eq!(asked[0], Asked { ends: [left; 2], within: left });
        assert_eq!(asked[1], Asked { ends: [left; 2], within: left });
        assert_eq!(asked[2], Asked { ends: [left, right], within: both });
        assert_eq!(asked[3], Asked { ends: [right; 2], within: right });
    }

    #[test]
    fn lines_reversals_and_two_points_ask_for_nothing_at_any_scale() {
        let nothing = Asked { ends: [0.0; 2], within: 0.0 };
        for scale in [1e-300, 1.0, 1e300] {
            let at = |x: f64, y: f64| [scale * x, scale * y];
            for points in
                [&[at(0.0, 0.0), at(1.0, 0.0), at(0.5, 0.0)][..], &[at(0.0, 0.0), at(1.0, 1e-10), at(2.0, 0.0)]]
            {
                assert_eq!(of_spans(points, false), [nothing; 2], "{scale:e}");
            }
            assert_eq!(of_spans(&[at(0.0, 0.0), at(1.0, 0.0)], false), [nothing]);
            assert_eq!(of_spans(&[at(0.0, 0.0), at(1.0, 0.0)], true), [nothing; 2]);
            let ring = of_spans(&[at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], true);
            assert_eq!(ring, [Asked { ends: [1.0; 2], within: 1.0 }; 3], "{scale:e}");
        }
    }
}
