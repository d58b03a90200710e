//! [`Arc`]: an arc of an ellipse, by its end points.
//!
//! Points are measured from the start, so that they keep their digits where the radius is much
//! larger than the arc.

use std::f64::consts::{FRAC_PI_2, TAU};

use kurbo::{PathEl, Point, Vec2};

/// An arc of an ellipse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    from: Point,
    to: Point,
    radii: Vec2,
    /// Of the ellipse's axes, in radians.
    rotation: f64,
    /// The angle at the start, before the rotation, and the angle to the end, where the ellipse is
    /// the unit circle.
    start: f64,
    sweep: f64,
}

/// Cubics over these parts of a turn are within this of the unit circle, and the distance falls
/// with the sixth power of the number of parts.
const TURN_PIECES: f64 = 4.0;
const QUARTER_ERROR: f64 = 2.726e-4;

/// Quarters are not divided for the sake of a rounding error.
const ROUNDING: f64 = 1e-7;

impl Arc {
    /// The arc of an SVG path (<https://www.w3.org/TR/SVG2/implnote.html#ArcImplementationNotes>).
    /// `None` for what is straight.
    pub fn between(
        from: Point,
        to: Point,
        radii: Vec2,
        rotation: f64,
        [is_large, clockwise]: [bool; 2],
    ) -> Option<Self> {
        let (rx, ry) = (radii.x.abs(), radii.y.abs());
        let half = 0.5 * turned(to - from, -rotation);
        // Half the chord where the ellipse is the unit circle, and its length, which grows radii
        // that are too small.
        let half = Vec2::new(half.x / rx, half.y / ry);
        let length = half.hypot();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let grown = length.max(1.0);
        let (length, direction) = (length / grown, half / length);
        let side = if is_large == clockwise { -1.0 } else { 1.0 };
        let height = side * ((1.0 - length) * (1.0 + length)).sqrt();
        let centre = length * direction + height * Vec2::new(-direction.y, direction.x);
        let smaller = 2.0 * length.asin();
        let sweep = if is_large { TAU - smaller } else { smaller };
        Some(Arc {
            from,
            to,
            radii: grown * Vec2::new(rx, ry),
            rotation,
            start: (-centre).atan2(),
            sweep: if clockwise { sweep } else { -sweep },
        })
    }

    /// Quarter `k` of an ellipse, clockwise as seen from the right.
    pub fn quarter(centre: Point, radii: Vec2, k: usize) -> Self {
        let at = |k: usize| {
            let (x, y) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][k % 4];
            centre + Vec2::new(radii.x * x, radii.y * y)
        };
        Arc { from: at(k), to: at(k + 1), radii, rotation: 0.0, start: k as f64 * FRAC_PI_2, sweep: FRAC_PI_2 }
    }

    pub fn start(&self) -> Point {
        self.from
    }

    pub fn end(&self) -> Point {
        self.to
    }

    /// Cubics within a distance (> 0) of the arc, each over a quarter of a turn at most.
    pub fn cubics(self, within: f64) -> impl Iterator<Item = PathEl> {
        let pieces = (QUARTER_ERROR / self.of_radius(within)).powf(1.0 / 6.0).max(1.0) * TURN_PIECES;
        let count = self.count(pieces);
        let step = self.sweep / count as f64;
        let arm = 4.0 / 3.0 * (0.25 * step).tan();
        (0..count).map(move |k| {
            let [before, after] = [k as f64 * step, (k + 1) as f64 * step];
            let end = if k + 1 == count { self.to } else { self.point(after) };
            let handle = |angle: f64| arm * self.tangent(angle);
            PathEl::CurveTo(self.point(before) + handle(before), self.point(after) - handle(after), end)
        })
    }

    /// Points on the arc after its start, of which the last is its end. Their chords are within a
    /// distance (> 0) of the arc, each over a quarter of a turn at most.
    pub fn points(self, within: f64, most: f64) -> impl ExactSizeIterator<Item = Point> {
        // A chord over the angle a is 1 − cos(a/2) away, at most a²/8.
        let count = self.count((TAU / (8.0 * self.of_radius(within)).sqrt()).clamp(TURN_PIECES, most.max(TURN_PIECES)));
        let step = self.sweep / count as f64;
        (1..count + 1).map(move |k| if k == count { self.to } else { self.point(k as f64 * step) })
    }

    /// A distance as a part of the larger radius, no smaller than what rounding takes.
    fn of_radius(&self, within: f64) -> f64 {
        (within / self.radii.x.max(self.radii.y)).max(f64::EPSILON)
    }

    /// Number of equal pieces of the arc where a turn has this many.
    fn count(&self, of_turn: f64) -> usize {
        ((of_turn * self.sweep.abs() / TAU - ROUNDING).ceil() as usize).max(1)
    }

    /// The point at an angle from the start, by the chord to it.
    fn point(&self, angle: f64) -> Point {
        let (sin, cos) = (self.start + 0.5 * angle).sin_cos();
        self.from + self.placed(2.0 * (0.5 * angle).sin() * Vec2::new(-sin, cos))
    }

    /// The derivative by the angle.
    fn tangent(&self, angle: f64) -> Vec2 {
        let (sin, cos) = (self.start + angle).sin_cos();
        self.placed(Vec2::new(-sin, cos))
    }

    fn placed(&self, v: Vec2) -> Vec2 {
        turned(Vec2::new(self.radii.x * v.x, self.radii.y * v.y), self.rotation)
    }
}

fn turned(v: Vec2, angle: f64) -> Vec2 {
    let (sin, cos) = angle.sin_cos();
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}
