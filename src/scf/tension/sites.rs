//! Points of a segment under tension, by arc length.

use super::quadrature::{Law, Pull};
use super::{Piece, Site, TensionSegment};

/// The intervals of a table per piece. From a value interpolated in it, Newton's method takes two
/// or three steps.
const INTERVALS: usize = 8;

/// The most Newton steps. Brackets catch what they miss.
const STEPS: usize = 60;

/// The law's argument, length and point (for a chord of 1) at a place of a piece.
#[derive(Clone, Copy, Debug)]
struct Node {
    argument: f64,
    length: f64,
    point: [f64; 2],
}

/// The nodes of the four pieces.
#[derive(Clone, Debug)]
pub(super) struct Tables([Vec<Node>; 4]);

/// A scale of the law's arguments in which the length of an arc is approximately linear, however
/// near its curvature comes to 0.
struct Scale {
    pull: Pull,
    power: f64,
    width: f64,
}

impl Scale {
    fn new(law: &Law, pull: Pull) -> Self {
        let (power, width): (f64, f64) = match pull {
            Pull::Below(gap) => (1.0, (2.0 * gap / (1.0 - gap)).sqrt().min(1.0)),
            Pull::Critical => (1.0 - 2.0 / law.nu, 0.0),
            Pull::Above(_) => (law.q, 2.0 * law.opening(pull)),
        };
        Scale { pull, power, width }
    }

    fn of(&self, x: f64) -> f64 {
        let Scale { power, width, .. } = *self;
        match self.pull {
            Pull::Below(_) => (x / width).asinh(),
            Pull::Critical => x.abs().powf(power).copysign(x),
            Pull::Above(_) => (x.max(0.0) / width).sqrt().asinh().powf(2.0 * power),
        }
    }

    fn argument(&self, y: f64) -> f64 {
        let Scale { power, width, .. } = *self;
        match self.pull {
            Pull::Below(_) => width * y.sinh(),
            Pull::Critical => y.abs().powf(1.0 / power).copysign(y),
            Pull::Above(_) => width * y.powf(0.5 / power).sinh().powi(2),
        }
    }

    /// dx/dy at y, for the argument x of y.
    fn slope(&self, x: f64, y: f64) -> f64 {
        let Scale { power, width, .. } = *self;
        match self.pull {
            Pull::Below(_) => width * y.cosh(),
            Pull::Critical => (x / y).abs() / power,
            Pull::Above(_) => {
                let root = y.powf(0.5 / power);
                width * (2.0 * root).sinh() * root / (2.0 * power * y)
            }
        }
    }
}

impl TensionSegment {
    /// Computes tables for many sites.
    pub(crate) fn tabulated(mut self) -> Self {
        let scale = Scale::new(&self.law, self.shape.pull);
        let table = |piece: Piece| {
            if piece.is_straight() {
                return Vec::new();
            }
            let [from, to] = piece.arguments;
            let [first, last] = [from, to].map(|x| scale.of(x));
            let mut node = Node { argument: from, length: 0.0, point: piece.point };
            let mut nodes = vec![node];
            for k in 1..=INTERVALS {
                let part = k as f64 / INTERVALS as f64;
                let argument = if k == INTERVALS { to } else { scale.argument(first + part * (last - first)) };
                let [length, x, y] = self.arc(piece, node.argument, argument);
                let [u, v] = node.point;
                node = Node { argument, length: node.length + length, point: [u + x, v + y] };
                nodes.push(node);
            }
            nodes
        };
        self.tables = Some(Box::new(Tables(self.pieces.map(table))));
        self
    }

    /// The site at an arc length, and dκ/ds there, or 0 if that is infinite.
    pub(crate) fn place_of(&self, arc_length: f64) -> (Site, f64) {
        let target = (arc_length / self.chord).clamp(0.0, self.length);
        let index = self.pieces.iter().rposition(|piece| target >= piece.start && piece.length > 0.0).unwrap_or(0);
        let piece = self.pieces[index];
        let along = (target - piece.start).min(piece.length);
        if piece.is_straight() {
            let (sine, cosine) = piece.from.sin_cos();
            let point = [piece.point[0] + along * cosine, piece.point[1] + along * sine];
            return (self.site(point, piece.from, 0.0), 0.0);
        }
        let nodes = self.tables.as_ref().map_or(&[][..], |tables| &tables.0[index]);
        let [from, to] = piece.arguments;
        // Both ends are exact.
        if along <= 0.0 {
            return self.site_at(piece, from, piece.point);
        }
        if along >= piece.length {
            let point = match self.pieces.get(index + 1) {
                Some(next) => next.point,
                None => [1.0, 0.0],
            };
            return self.site_at(piece, to, point);
        }
        let first = Node { argument: from, length: 0.0, point: piece.point };
        let last = Node { argument: to, length: piece.length, point: piece.point };
        let (near, far) = match nodes.partition_point(|node| node.length <= along) {
            0 => (first, last),
            next if next == nodes.len() => (nodes[next - 2], nodes[next - 1]),
            next => (nodes[next - 1], nodes[next]),
        };
        let (argument, [x, y]) = self.reach(piece, near, far, along);
        self.site_at(piece, argument, [near.point[0] + x, near.point[1] + y])
    }

    /// The law's argument at a length along a piece, between two of its nodes, and the displacement
    /// from the first node.
    fn reach(&self, piece: Piece, near: Node, far: Node, along: f64) -> (f64, [f64; 2]) {
        let scale = Scale::new(&self.law, self.shape.pull);
        let [mut low, mut high] = [near, far].map(|node| (scale.of(node.argument), node.length));
        let wanted = along - near.length;
        let share = wanted / (high.1 - low.1);
        let mut y = low.0 + share * (high.0 - low.0);
        let span = (high.0 - low.0).abs();
        let mut best = (near.argument, [0.0; 2]);
        for _ in 0..STEPS {
            let argument = scale.argument(y);
            let [length, dx, dy] = self.arc(piece, near.argument, argument);
            best = (argument, [dx, dy]);
            let left = wanted - length;
            if left.abs() <= 2.0 * f64::EPSILON * piece.length {
                break;
            }
            if left > 0.0 {
                low.0 = y
            } else {
                high.0 = y
            }
            // Along the piece the argument increases or decreases, while the length increases.
            let rate = scale.slope(argument, y) / self.law.curvature(self.shape.pull, argument);
            let next = y + (high.0 - low.0).signum() * left / rate;
            let inside = (next - low.0) * (next - high.0) < 0.0;
            let next = if inside { next } else { 0.5 * (low.0 + high.0) };
            if (next - y).abs() <= f64::EPSILON * span.max(y.abs()) {
                break;
            }
            y = next;
        }
        best
    }

    fn site_at(&self, piece: Piece, argument: f64, point: [f64; 2]) -> (Site, f64) {
        let curvature = self.law.curvature(self.shape.pull, argument).copysign(piece.to - piece.from);
        let angle = piece.axis + piece.sense * argument;
        // ν(ν − 1)|κ|^{ν−2} κ′ = −P·N
        let nu = self.law.nu;
        let [x, y] = self.pull();
        let across = y * angle.cos() - x * angle.sin();
        let slope = -across * curvature.abs().powf(2.0 - nu) / (nu * (nu - 1.0)) / (self.chord * self.chord);
        let slope = if slope.is_finite() { self.mirror * slope } else { 0.0 };
        (self.site(point, angle, curvature), slope)
    }

    fn site(&self, [x, y]: [f64; 2], angle: f64, curvature: f64) -> Site {
        Site {
            point: [self.chord * x, self.mirror * self.chord * y],
            angle: self.mirror * angle,
            curvature: self.mirror * curvature / self.chord,
        }
    }

    /// The largest |κ|: at an end of a piece, or where the tangent is opposite to the pull.
    pub(crate) fn max_curvature(&self) -> f64 {
        let against = std::f64::consts::PI - self.law.opening(self.shape.pull);
        let of_piece = |piece: &Piece| {
            let [from, to] = piece.arguments.map(f64::abs);
            let over = if piece.arguments[0] * piece.arguments[1] < 0.0 {
                from.max(to) >= against
            } else {
                from.max(to) >= against && from.min(to) <= against
            };
            let ends = [from, to].map(|x| self.law.curvature(self.shape.pull, x));
            let top = if over { self.law.curvature(self.shape.pull, against) } else { 0.0 };
            ends[0].max(ends[1]).max(top)
        };
        let turning = self.pieces.iter().filter(|piece| !piece.is_straight());
        turning.map(of_piece).fold(0.0, f64::max) / self.chord
    }
}
