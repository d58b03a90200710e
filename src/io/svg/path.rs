//! Paths: svgtypes reads their data, and a pen follows it from point to point.

use kurbo::{Affine, PathEl, Point, Vec2};
use svgtypes::{Error, NumberListParser, PathParser, PathSegment};

use super::arc::Arc;
use crate::error::quoted;

/// A segment of a path. Arcs stay arcs until it is known how exact they must be.
#[derive(Clone, Copy, Debug)]
pub(super) enum Segment {
    Element(PathEl),
    Arc(Arc),
}

impl Segment {
    /// The elements that draw it elsewhere, an arc as cubics within a distance (> 0) of it.
    pub fn elements(self, place: Affine, within: f64) -> impl Iterator<Item = PathEl> {
        let (element, arc) = match self {
            Segment::Element(element) => (Some(element), None),
            Segment::Arc(arc) => (None, Some(arc.cubics(within / largest_scale(place)))),
        };
        let elements = element.into_iter().chain(arc.into_iter().flatten());
        elements.map(move |element| if place == Affine::IDENTITY { element } else { place * element })
    }
}

/// No less than the most that a map lengthens a vector.
pub(super) fn largest_scale(map: Affine) -> f64 {
    map.as_coeffs()[..4].iter().fold(0.0, |length: f64, x| length.hypot(*x))
}

/// The most memory that path data makes: a segment takes at least two bytes ("h1 1 1"), and the
/// vector of segments grows by doubling.
pub(super) fn most_bytes(data: &str) -> usize {
    data.len().saturating_mul(size_of::<Segment>())
}

/// The segments of path data, or what is wrong with it. `none` is no path (SVG 2).
pub(super) fn parse(data: &str) -> Result<Vec<Segment>, String> {
    if data.trim() == "none" {
        return Ok(Vec::new());
    }
    let mut pen = Pen::default();
    for segment in PathParser::from(data) {
        pen.draw(segment.map_err(|error| unread("path data", data, &error, "mend it"))?);
    }
    Ok(pen.path)
}

/// The segments from point to point of an attribute `points`.
pub(super) fn through(points: &str, closed: bool) -> Result<Vec<Segment>, String> {
    let numbers: Result<Vec<f64>, _> = NumberListParser::from(points).collect();
    let numbers = numbers.map_err(|error| unread("list of points", points, &error, "mend it"))?;
    let (points, odd) = numbers.as_chunks::<2>();
    if let [x] = odd {
        return Err(format!("its list of points ends with an x, {x}, that has no y: add it, or remove the x"));
    }
    let element = |(k, &[x, y]): (usize, &[f64; 2])| match k {
        0 => PathEl::MoveTo(Point::new(x, y)),
        _ => PathEl::LineTo(Point::new(x, y)),
    };
    let closing = (closed && !points.is_empty()).then_some(PathEl::ClosePath);
    Ok(points.iter().enumerate().map(element).chain(closing).map(Segment::Element).collect())
}

/// Names the place where data cannot be read on.
pub(super) fn unread(what: &str, data: &str, error: &Error, remedy: &str) -> String {
    let at = match *error {
        Error::UnexpectedData(at)
        | Error::InvalidNumber(at)
        | Error::InvalidChar(_, at)
        | Error::InvalidString(_, at) => data.char_indices().nth(at.saturating_sub(1)),
        _ => None,
    };
    match at.map(|(at, _)| data[at..].trim()).filter(|rest| !rest.is_empty()) {
        Some(rest) => format!("its {what} cannot be read from {} on: {remedy}", quoted(rest)),
        None => format!("its {what} ends where a number must follow: complete it"),
    }
}

/// What draws a path.
#[derive(Default)]
struct Pen {
    path: Vec<Segment>,
    at: Point,
    start: Point,
    is_closed: bool,
    /// The last control point where the command before was C or S, and where it was Q or T.
    cubic: Option<Point>,
    quadratic: Option<Point>,
}

impl Pen {
    fn draw(&mut self, segment: PathSegment) {
        let from = self.at;
        let to = |x: f64, y: f64| match segment.is_abs() {
            true => Point::new(x, y),
            false => from + Vec2::new(x, y),
        };
        // A shorthand continues a curve of the same kind, and else starts without a handle.
        let mirrored = |control: Option<Point>| control.map_or(from, |control| from + (from - control));
        let (cubic, quadratic) = (mirrored(self.cubic.take()), mirrored(self.quadratic.take()));
        if self.is_closed && !matches!(segment, PathSegment::MoveTo { .. }) {
            self.add(PathEl::MoveTo(from));
        }
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                self.start = to(x, y);
                self.add(PathEl::MoveTo(self.start));
            }
            PathSegment::LineTo { x, y, .. } => self.add(PathEl::LineTo(to(x, y))),
            PathSegment::HorizontalLineTo { x, .. } => self.add(PathEl::LineTo(Point::new(to(x, 0.0).x, from.y))),
            PathSegment::VerticalLineTo { y, .. } => self.add(PathEl::LineTo(Point::new(from.x, to(0.0, y).y))),
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => self.curve(to(x1, y1), to(x2, y2), to(x, y)),
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => self.curve(cubic, to(x2, y2), to(x, y)),
            PathSegment::Quadratic { x1, y1, x, y, .. } => self.quadratic(to(x1, y1), to(x, y)),
            PathSegment::SmoothQuadratic { x, y, .. } => self.quadratic(quadratic, to(x, y)),
            PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
                let end = to(x, y);
                match Arc::between(from, end, Vec2::new(rx, ry), x_axis_rotation.to_radians(), [large_arc, sweep]) {
                    Some(arc) => self.path.push(Segment::Arc(arc)),
                    None => self.path.push(Segment::Element(PathEl::LineTo(end))),
                }
                self.at = end;
            }
            PathSegment::ClosePath { .. } => {
                self.add(PathEl::ClosePath);
                self.at = self.start;
            }
        }
        self.is_closed = matches!(segment, PathSegment::ClosePath { .. });
    }

    fn add(&mut self, element: PathEl) {
        self.path.push(Segment::Element(element));
        self.at = element.end_point().unwrap_or(self.at);
    }

    fn curve(&mut self, first: Point, second: Point, end: Point) {
        self.cubic = Some(second);
        self.add(PathEl::CurveTo(first, second, end));
    }

    fn quadratic(&mut self, control: Point, end: Point) {
        self.quadratic = Some(control);
        self.add(PathEl::QuadTo(control, end));
    }
}
