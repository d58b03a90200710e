//! Shapes near one that is known, by Newton's method on the closure of the chord: two unknowns, a
//! quadrature a step, where the nested roots take dozens.
//!
//! The kind of the shape is kept: its unknowns are those of the second derivatives, in which the
//! closure is smooth even where an inflection passes an end. What does not converge in some steps,
//! leaves its kind, or is no minimum, is left to the nested roots.

use super::{Course, Pull, Shape, Solver};
use crate::scf::tension::hessian;
use crate::scf::tension::quadrature::{Compliance, Growth, Law};

/// Steps of Newton's method at most.
const STEPS: usize = 12;

/// Least remainders of a closed chord, in units of rounding of the lengths that add up to it.
const ROUNDING: f64 = 4.0;

/// A remainder that is no smaller than this part of the one before it is rounding, if it is small.
const STUCK: f64 = 0.1;

/// The largest remainder that may be rounding, in the same units.
const SMALL: f64 = 256.0;

/// The farthest a step changes logarithms, and angles.
const FARTHEST_LOGARITHM: f64 = 2.0;
const FARTHEST_ANGLE: f64 = 0.5;

/// Whether remainders of Newton's steps have come down to rounding.
struct Closing {
    before: f64,
}

impl Closing {
    fn new() -> Self {
        Closing { before: f64::INFINITY }
    }

    fn is_done(&mut self, missing: f64, size: f64) -> bool {
        let rounding = f64::EPSILON * size;
        let stuck = missing <= SMALL * rounding && missing >= STUCK * self.before;
        self.before = missing;
        // Arcs that bend back are infinitely long.
        missing.is_finite() && (missing <= ROUNDING * rounding || stuck)
    }
}

/// A step of two unknowns, shortened to what is believed.
fn shortened([logarithm, angle]: [f64; 2]) -> [f64; 2] {
    let most = (logarithm.abs() / FARTHEST_LOGARITHM).max(angle.abs() / FARTHEST_ANGLE).max(1.0);
    [logarithm / most, angle / most]
}

/// The power of an overshoot in which arcs move smoothly through the end.
pub(in crate::scf::tension) fn smoothed(law: &Law, overshoot: f64) -> f64 {
    overshoot.abs().powf(law.q).copysign(overshoot) / law.q
}

impl Solver<'_> {
    /// The shape between these ends that is of the kind of another, and near it.
    pub(in crate::scf::tension) fn near(&self, known: &Shape) -> Option<Shape> {
        match (known.pull, known.course) {
            _ if self.low == 0.0 && self.high == 0.0 => None,
            (Pull::Below(gap), Course::Direct) => self.near_convex(gap, known.axis),
            // For ν ≤ 2 only what is straight from end to end has a straight piece.
            (Pull::Critical, Course::Through(axis)) if self.law.nu > 2.0 => self.near_flat(axis),
            (Pull::Above(t), Course::Direct) => self.near_inflected(t, -known.ends[1]),
            (Pull::Above(t), Course::Through(_)) => self.near_inflected(t, known.ends[1]),
            _ => None,
        }
    }

    /// The same with a free upper end.
    pub(in crate::scf::tension) fn near_free(&self, known: &Shape) -> Option<Shape> {
        match (known.pull, known.course) {
            _ if self.low == 0.0 => None,
            (Pull::Critical, Course::Through(_)) if self.law.nu > 2.0 => self.near_flat_free(known.ends[0].abs()),
            (Pull::Above(t), Course::Direct) => self.near_inflected_free(t, known.ends[0]),
            _ => None,
        }
    }

    /// Without inflection, on a pull below the tension.
    pub(super) fn near_convex(&self, gap: f64, axis: f64) -> Option<Shape> {
        let (law, mut gap, mut axis) = (self.law, gap, axis);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let pull = Pull::Below(gap);
            let ends = [self.low - axis, self.high - axis];
            let Compliance { sums: [length, along, across], changes: [aa, ab, bb] } =
                law.compliance(pull, ends[0], ends[1]);
            let (sine, cosine) = axis.sin_cos();
            let missing = [cosine - along, -sine - across];
            if closing.is_done(missing[0].hypot(missing[1]), length.max(1.0)) {
                return Some(Shape { pull, axis, ends, course: Course::Direct, flat: 0.0 });
            }
            let [[right, up], _] = hessian::solve([[aa, ab], [ab, bb]], [missing, [0.0; 2]]);
            // In units of the tension.
            let [right, up] = [right / law.tension, up / law.tension];
            if gap < 0.1 {
                // Near the critical pull the gap's logarithm is what the length goes by.
                axis += shortened([0.0, up / (1.0 - gap)])[1];
                gap *= shortened([-right / gap, 0.0])[0].exp();
            } else {
                let ahead = 1.0 - gap + right;
                axis += up.atan2(ahead);
                gap = 1.0 - ahead.hypot(up);
            }
            if !(0.0..=1.0).contains(&gap) || gap == 0.0 {
                return None;
            }
        }
        None
    }

    /// With a straight piece along an axis between the ends' angles or beyond the upper one.
    pub(super) fn near_flat(&self, axis: f64) -> Option<Shape> {
        let (law, mut axis) = (self.law, axis);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let (long, short) = (axis - self.low, axis - self.high);
            if long <= 0.0 {
                return None;
            }
            let (sine, cosine) = axis.sin_cos();
            let [far, near] = [long, short.abs()].map(|x| self.critical_across(x));
            let missing = sine - far - near.copysign(short);
            if closing.is_done(missing.abs(), far.max(near).max(1.0)) {
                let lengths = [long, short.abs()].map(|x| law.arc(Pull::Critical, 0.0, x)[1]);
                let flat = cosine - lengths[0] - lengths[1];
                let ends = [-long, -short];
                return (flat >= 0.0).then_some(Shape {
                    pull: Pull::Critical,
                    axis,
                    ends,
                    course: Course::Through(axis),
                    flat,
                });
            }
            let moment = |x: f64| if x > 0.0 { x.sin() / law.curvature(Pull::Critical, x) } else { 0.0 };
            let slope = cosine - moment(long) - moment(short.abs());
            axis -= shortened([0.0, missing / slope])[1];
        }
        None
    }

    /// One inflection, within (`overshoot` above 0) or beyond the upper end.
    pub(super) fn near_inflected(&self, t: f64, overshoot: f64) -> Option<Shape> {
        let (law, turning) = (self.law, self.high - self.low);
        let (mut t, mut smooth) = (t, smoothed(law, overshoot));
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let (side, short) = (1f64.copysign(smooth), (law.q * smooth.abs()).powf(1.0 / law.q));
            let (pull, axis, long) = (Pull::Above(t), self.high + short, turning + short);
            let (sine, cosine) = axis.sin_cos();
            let [far, near] = [long, short].map(|x| law.growth(t, x));
            let right = cosine - far.sums[1] - side * near.sums[1];
            let up = sine - far.sums[2] - side * near.sums[2];
            let radius = 1.0 / law.curvature(pull, long);
            let scale = short.powf(1.0 / law.nu);
            let slope = if short > 0.0 { law.excess(pull, short) / short } else { t };
            let scaled_radius = ((law.nu - 1.0) / slope).powf(1.0 / law.nu);
            let moved = side * scale;
            let rows = [
                [
                    far.changes[0] + side * near.changes[0],
                    (radius * long.cos() + sine) * moved + scaled_radius * short.cos(),
                ],
                [
                    far.changes[1] + side * near.changes[1],
                    (radius * long.sin() - cosine) * moved + scaled_radius * short.sin(),
                ],
            ];
            let size = (far.sums[0] + near.sums[0]).max(1.0);
            if closing.is_done(right.hypot(up), size) {
                // Where the piece that would close the chord grows with the overshoot, it is a
                // saddle.
                let minimum = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0] > 0.0;
                let course = if smooth > 0.0 { Course::Through(axis) } else { Course::Direct };
                let shape = Shape { pull, axis, ends: [long, short], course, flat: 0.0 };
                return (minimum || smooth <= 0.0).then_some(shape);
            }
            let [step, _] = hessian::solve(rows, [[right, up], [0.0; 2]]);
            let [grown, turned] = shortened(step);
            (t, smooth) = (t * grown.exp(), smooth + turned);
            if !(grown.is_finite() && turned.is_finite()) {
                return None;
            }
        }
        None
    }

    /// An arc from the free end's inflection.
    pub(super) fn near_inflected_free(&self, t: f64, long: f64) -> Option<Shape> {
        let (law, mut t, mut long) = (self.law, t, long);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let pull = Pull::Above(t);
            let (sine, cosine) = (self.low + long).sin_cos();
            let Growth { sums: [length, along, across], changes } = law.growth(t, long);
            let missing = [cosine - along, sine - across];
            if closing.is_done(missing[0].hypot(missing[1]), length.max(1.0)) {
                return Some(self.after_free(pull, long, 0.0));
            }
            let radius = 1.0 / law.curvature(pull, long);
            let rows = [[changes[0], radius * long.cos() + sine], [changes[1], radius * long.sin() - cosine]];
            let [step, _] = hessian::solve(rows, [missing, [0.0; 2]]);
            let [grown, turned] = shortened(step);
            (t, long) = (t * grown.exp(), long + turned);
            if !grown.is_finite() || long.is_nan() || long <= -self.low {
                return None;
            }
        }
        None
    }

    /// A straight piece from the free end, and an arc.
    fn near_flat_free(&self, long: f64) -> Option<Shape> {
        let (law, mut long) = (self.law, long);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let (sine, cosine) = (self.low + long).sin_cos();
            let across = self.critical_across(long);
            let missing = sine - across;
            if closing.is_done(missing.abs(), across.max(1.0)) {
                let flat = cosine - law.arc(Pull::Critical, 0.0, long)[1];
                return (flat >= 0.0).then(|| self.after_free(Pull::Critical, long, flat));
            }
            let slope = cosine - long.sin() / law.curvature(Pull::Critical, long);
            long -= shortened([0.0, missing / slope])[1];
            if long.is_nan() || long <= -self.low {
                return None;
            }
        }
        None
    }
}
