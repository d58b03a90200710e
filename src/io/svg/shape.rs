//! The paths of elements that have another shape: rectangles, circles, ellipses, lines, polygons.

use kurbo::{PathEl, Point, Vec2};
use roxmltree::Node;

use super::arc::Arc;
use super::length::{Viewport, length};
use super::path::{self, Segment};

/// The elements that draw a path, and have none.
pub(super) const SHAPES: [&str; 6] = ["polyline", "polygon", "line", "rect", "circle", "ellipse"];

/// The elements among them whose shape is exact.
pub(super) const EXACT: [&str; 4] = ["line", "rect", "circle", "ellipse"];

/// The path of an element, or what is wrong with it. A size of 0 draws nothing.
pub(super) fn path(node: Node, viewport: Viewport) -> Result<Vec<Segment>, String> {
    let optional = |name: &str| length(node, name, viewport);
    let number = |name: &str| optional(name).map(|x| x.unwrap_or(0.0));
    // One radius stands for both.
    let radii = || {
        let (x, y) = (optional("rx")?, optional("ry")?);
        Ok::<_, String>(Vec2::new(x.or(y).unwrap_or(0.0), y.or(x).unwrap_or(0.0)))
    };
    let points = node.attribute("points").unwrap_or_default();
    match node.tag_name().name() {
        "polyline" => path::through(points, false),
        "polygon" => path::through(points, true),
        "line" => {
            let [from, to] =
                [["x1", "y1"], ["x2", "y2"]].map(|[x, y]| Ok::<_, String>(Point::new(number(x)?, number(y)?)));
            Ok([PathEl::MoveTo(from?), PathEl::LineTo(to?)].map(Segment::Element).to_vec())
        }
        "rect" => {
            let (corner, size) =
                (Point::new(number("x")?, number("y")?), Vec2::new(number("width")?, number("height")?));
            Ok(rectangle(corner, size, radii()?))
        }
        name => {
            let centre = Point::new(number("cx")?, number("cy")?);
            let radii = if name == "circle" { Vec2::new(1.0, 1.0) * number("r")? } else { radii()? };
            Ok(if radii.x > 0.0 && radii.y > 0.0 { outline([centre; 4], radii) } else { Vec::new() })
        }
    }
}

/// A rectangle whose corners are quarters of ellipses.
fn rectangle(corner: Point, size: Vec2, radii: Vec2) -> Vec<Segment> {
    if !(size.x > 0.0 && size.y > 0.0) {
        return Vec::new();
    }
    let opposite = corner + size;
    if !(radii.x > 0.0 && radii.y > 0.0) {
        let corners = [(corner.x, corner.y), (opposite.x, corner.y), (opposite.x, opposite.y), (corner.x, opposite.y)];
        let [first, sides @ ..] = corners.map(Point::from);
        let sides = sides.map(PathEl::LineTo);
        return [PathEl::MoveTo(first)]
            .into_iter()
            .chain(sides)
            .chain([PathEl::ClosePath])
            .map(Segment::Element)
            .collect();
    }
    let radii = Vec2::new(radii.x.min(0.5 * size.x), radii.y.min(0.5 * size.y));
    let (low, high) = (corner + radii, opposite - radii);
    outline([high, Point::new(low.x, high.y), low, Point::new(high.x, low.y)], radii)
}

/// Four quarters of an ellipse about these centres, and lines between.
fn outline(centres: [Point; 4], radii: Vec2) -> Vec<Segment> {
    let mut path: Vec<Segment> = Vec::new();
    let mut at = Arc::quarter(centres[3], radii, 3).end();
    path.push(Segment::Element(PathEl::MoveTo(at)));
    for (k, centre) in centres.into_iter().enumerate() {
        let arc = Arc::quarter(centre, radii, k);
        // Sides between corners that touch have no length.
        if arc.start() != at {
            path.push(Segment::Element(PathEl::LineTo(arc.start())));
        }
        path.push(Segment::Arc(arc));
        at = arc.end();
    }
    path.push(Segment::Element(PathEl::ClosePath));
    path
}
