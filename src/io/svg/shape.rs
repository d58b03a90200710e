//! The paths of elements that have another shape: rectangles, circles, ellipses, lines, polygons.

use kurbo::{BezPath, PathEl, Point, Shape};
use roxmltree::Node;

use super::path;

/// The elements that draw a path, and have none.
pub(super) const SHAPES: [&str; 6] = ["polyline", "polygon", "line", "rect", "circle", "ellipse"];

/// The path of an element, or what is wrong with it. A size of 0 draws nothing. `None` where a length
/// has a unit: `100%` depends on what is around.
pub(super) fn path(node: Node) -> Result<Option<BezPath>, String> {
    match node.tag_name().name() {
        "polyline" => path::parse(&vertices(node, "")).map(Some),
        "polygon" => path::parse(&vertices(node, "Z")).map(Some),
        name => Ok(of_lengths(node, name)),
    }
}

fn of_lengths(node: Node, name: &str) -> Option<BezPath> {
    let optional = |name: &str| length(node, name);
    let number = |name: &str| optional(name).map(|x| x.unwrap_or(0.0));
    // One radius stands for both.
    let radii = || Some((optional("rx")?, optional("ry")?)).map(|(x, y)| [x.or(y), y.or(x)].map(|r| r.unwrap_or(0.0)));
    let draws = |sizes: &[f64]| sizes.iter().all(|size| *size > 0.0);
    Some(match name {
        "line" => {
            let [from, to] =
                [[number("x1")?, number("y1")?], [number("x2")?, number("y2")?]].map(|[x, y]| Point::new(x, y));
            [PathEl::MoveTo(from), PathEl::LineTo(to)].into_iter().collect()
        }
        "rect" => {
            let [x, y, width, height] = [number("x")?, number("y")?, number("width")?, number("height")?];
            let [rx, ry] = radii()?;
            match draws(&[width, height]) {
                true => rounded(x, y, width, height, rx.min(0.5 * width), ry.min(0.5 * height)),
                false => BezPath::new(),
            }
        }
        _ => {
            let centre = Point::new(number("cx")?, number("cy")?);
            let [rx, ry] = if name == "circle" { [number("r")?; 2] } else { radii()? };
            match draws(&[rx, ry]) {
                true => ellipse(centre, rx, ry),
                false => BezPath::new(),
            }
        }
    })
}

/// The middle of a cubic with these handles, as parts of the radius, lies on the quarter of a circle. It
/// strays from it by 2.7e-4 of the radius.
const HANDLE: f64 = 0.552_284_749_830_793_4;

/// Where the quarters of the unit circle begin.
const AXES: [(f64, f64); 4] = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];

/// Quarter `k` of an ellipse, a cubic.
fn quarter(path: &mut BezPath, centre: Point, [rx, ry]: [f64; 2], k: usize) {
    let at = |x: f64, y: f64| Point::new(centre.x + rx * x, centre.y + ry * y);
    let [(a, b), (c, d)] = [AXES[k], AXES[(k + 1) % 4]];
    path.curve_to(at(a + HANDLE * c, b + HANDLE * d), at(c + HANDLE * a, d + HANDLE * b), at(c, d));
}

/// Four quarters.
fn ellipse(centre: Point, rx: f64, ry: f64) -> BezPath {
    let mut path = BezPath::new();
    path.move_to((centre.x + rx, centre.y));
    (0..4).for_each(|k| quarter(&mut path, centre, [rx, ry], k));
    path.close_path();
    path
}

/// A rectangle whose corners are quarters of ellipses.
fn rounded(x: f64, y: f64, width: f64, height: f64, rx: f64, ry: f64) -> BezPath {
    if rx <= 0.0 || ry <= 0.0 {
        return kurbo::Rect::new(x, y, x + width, y + height).to_path(1.0);
    }
    let (left, right, top, bottom) = (x + rx, x + width - rx, y + ry, y + height - ry);
    let mut path = BezPath::new();
    path.move_to((right + rx, top));
    for (k, centre) in [(right, bottom), (left, bottom), (left, top), (right, top)].into_iter().enumerate() {
        let (c, s) = AXES[k];
        let start = Point::new(centre.0 + rx * c, centre.1 + ry * s);
        // Sides between corners that touch have no length.
        if path.elements().last().and_then(PathEl::end_point) != Some(start) {
            path.line_to(start);
        }
        quarter(&mut path, centre.into(), [rx, ry], k);
    }
    path.close_path();
    path
}

/// The attribute `points` as path data. Its grammar is that of the points after a move.
fn vertices(node: Node, end: &str) -> String {
    match node.attribute("points").map(str::trim).unwrap_or_default() {
        "" => String::new(),
        points => format!("M{points}{end}"),
    }
}

/// A length in units of the drawing, `Some(None)` where none is given.
fn length(node: Node, name: &str) -> Option<Option<f64>> {
    let Some(text) = node.attribute(name).map(str::trim).filter(|text| !text.is_empty() && *text != "auto") else {
        return Some(None);
    };
    let number = text.strip_suffix("px").unwrap_or(text).trim_end().parse::<f64>();
    number.ok().filter(|x| x.is_finite()).map(Some)
}
