//! Data points from a subpath's elements: its vertices, or the control points of its chain of cubic
//! Béziers.

use crate::bounds::Bounds;
use kurbo::{PathEl, Point};

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
fn straight(from: Point, to: Point) -> [Point; 3] {
    [from.lerp(to, 1.0 / 3.0), from.lerp(to, 2.0 / 3.0), to]
}
