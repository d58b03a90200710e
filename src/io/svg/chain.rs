//! Data points from a subpath's elements: its vertices, or the control points of its chain of cubic
//! Béziers.

use crate::bounds::Bounds;
use kurbo::{CubicBez, ParamCurve, PathEl, Point, QuadBez};

/// The data points of one subpath.
pub(super) type Vertices = Vec<Point>;

/// A gap between end and start of a subpath this small, relative to its size, is rounding.
///
/// Arcs leave such gaps, and so do sums of relative coordinates. They are not a straight piece.
const ROUNDING: f64 = 1e-9;

/// Adds the end of an element.
pub(super) fn add_vertex(vertices: &mut Vertices, element: PathEl) {
    vertices.extend(element.end_point());
}

/// An element as a cubic, and the number of equal steps of its parameter whose chords stay within a
/// distance (> 0) of it. `None` for what is straight.
///
/// The chords of n steps stray by no more than max |B″| / (8 n²).
pub(super) fn steps(vertices: &Vertices, element: PathEl, within: f64) -> Option<(CubicBez, usize)> {
    let from = *vertices.last()?;
    let cubic = match element {
        PathEl::CurveTo(b, c, d) => CubicBez::new(from, b, c, d),
        PathEl::QuadTo(b, c) => QuadBez::new(from, b, c).raise(),
        _ => return None,
    };
    let second = |a: Point, b: Point, c: Point| 6.0 * ((a - b) + (c - b)).hypot();
    let most = second(cubic.p0, cubic.p1, cubic.p2).max(second(cubic.p1, cubic.p2, cubic.p3));
    let steps = (most / (8.0 * within)).sqrt().ceil();
    Some((cubic, if steps > 1.0 { steps.min(MOST_STEPS) as usize } else { 1 }))
}

/// The most points of one segment.
pub(super) const MOST_STEPS: f64 = 1000.0;

/// Adds the points of a cubic at the ends of `steps` equal steps of its parameter.
pub(super) fn add_sampled(vertices: &mut Vertices, cubic: CubicBez, steps: usize) {
    vertices.extend((1..steps).map(|k| cubic.eval(k as f64 / steps as f64)));
    vertices.push(cubic.p3);
}

/// Adds the control points of an element: one for a move, three for any other.
///
/// Closing adds a straight piece if the end is not the start, which then is repeated.
pub(super) fn add_cubic(points: &mut Vertices, element: PathEl) {
    let Some((&start, &from)) = points.first().zip(points.last()) else {
        points.extend(element.end_point());
        return;
    };
    points.extend(match element {
        PathEl::MoveTo(_) => return,
        PathEl::LineTo(to) => straight(from, to),
        PathEl::QuadTo(q, to) => [from.lerp(q, 2.0 / 3.0), to.lerp(q, 2.0 / 3.0), to],
        PathEl::CurveTo(b, c, to) => [b, c, to],
        PathEl::ClosePath
            if from.distance(start) <= ROUNDING * Bounds::of(points.iter().map(|p| [p.x, p.y])).size() =>
        {
            points.pop();
            points.push(start);
            return;
        }
        PathEl::ClosePath => straight(from, start),
    });
}

/// A straight piece at constant speed.
pub(super) fn straight(from: Point, to: Point) -> [Point; 3] {
    [from.lerp(to, 1.0 / 3.0), from.lerp(to, 2.0 / 3.0), to]
}
