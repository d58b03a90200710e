//! Shapes near a known one, by Newton's method on the closure of the chord. It has two unknowns and
//! one quadrature per step, where nested roots take dozens.
//!
//! The kind of the shape is kept. Its unknowns are those of the second derivatives, in which the
//! closure is smooth even as an inflection passes an end. If Newton's method does not converge in a
//! few steps, leaves the kind, or does not find a minimum, nested roots take over.

use super::{Course, Pull, Shape, Solver};
use crate::scf::tension::hessian::{Inflected, solve};
use crate::scf::tension::quadrature::{Integrals, Law};

/// The most Newton steps.
const STEPS: usize = 12;

/// The remainder at which a chord counts as closed, in units of the rounding of the lengths that
/// add up to it.
const ROUNDING: f64 = 4.0;

/// A small remainder is rounding if it is at least this fraction of the previous one.
const STUCK: f64 = 0.1;

/// The largest remainder that may be rounding, in the same units.
const SMALL: f64 = 256.0;

/// The largest changes of logarithms and of angles per step.
const FARTHEST_LOGARITHM: f64 = 2.0;
const FARTHEST_ANGLE: f64 = 0.5;

/// Detects when the remainders of Newton's steps have reached rounding.
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
        // Arcs that bend back have infinite length.
        missing.is_finite() && (missing <= ROUNDING * rounding || stuck)
    }
}

/// A step of two unknowns, shortened to the largest changes.
fn shortened([logarithm, angle]: [f64; 2]) -> [f64; 2] {
    let most = (logarithm.abs() / FARTHEST_LOGARITHM).max(angle.abs() / FARTHEST_ANGLE).max(1.0);
    [logarithm / most, angle / most]
}

/// The power of an overshoot in which arcs move smoothly through the end.
pub(in crate::scf::tension) fn smoothed(law: &Law, overshoot: f64) -> f64 {
    overshoot.abs().powf(law.q).copysign(overshoot) / law.q
}

impl Solver<'_> {
    /// The shape for these end angles of the same kind as a known one, and near it.
    pub(in crate::scf::tension) fn near(&self, known: &Shape) -> Option<Shape> {
        match (known.pull, known.course) {
            _ if self.low == 0.0 && self.high == 0.0 => None,
            (Pull::Below(gap), Course::Direct) => self.near_convex(gap, known.axis),
            // For ν ≤ 2 only straight segments have a straight piece.
            (Pull::Critical, Course::Through(axis)) if self.law.nu > 2.0 => self.near_flat(axis, false),
            (Pull::Above(t), Course::Direct) => self.near_inflected(t, -known.ends[1]),
            (Pull::Above(t), Course::Through(_)) => self.near_inflected(t, known.ends[1]),
            _ => None,
        }
    }

    /// The same with a free upper end.
    pub(in crate::scf::tension) fn near_free(&self, known: &Shape) -> Option<Shape> {
        match (known.pull, known.course) {
            _ if self.low == 0.0 => None,
            (Pull::Critical, Course::Through(_)) if self.law.nu > 2.0 => self.near_flat(known.ends[0].abs(), true),
            (Pull::Above(t), Course::Direct) => self.near_inflected_free(t, known.ends[0]),
            _ => None,
        }
    }

    /// Without inflection, with a pull below the tension.
    pub(super) fn near_convex(&self, gap: f64, axis: f64) -> Option<Shape> {
        let (law, mut gap, mut axis) = (self.law, gap, axis);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let pull = Pull::Below(gap);
            let ends = [self.low - axis, self.high - axis];
            let Integrals { arc: [length, along, across], changes: [aa, ab, bb] } =
                law.compliance(pull, ends[0], ends[1]);
            let (sine, cosine) = axis.sin_cos();
            let missing = [cosine - along, -sine - across];
            if closing.is_done(missing[0].hypot(missing[1]), length.max(1.0)) {
                return Some(Shape { pull, axis, ends, course: Course::Direct, flat: 0.0 });
            }
            let [[right, up], _] = solve([[aa, ab], [ab, bb]], [missing, [0.0; 2]]);
            // In units of the tension.
            let [right, up] = [right / law.tension, up / law.tension];
            if gap < 0.1 {
                // Near the critical pull the length depends on the logarithm of the gap.
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

    /// With a straight piece along an axis between the end angles or beyond the upper one, or along
    /// the free upper end. The unknown is the axis, or its distance from the lower end.
    pub(super) fn near_flat(&self, unknown: f64, is_free: bool) -> Option<Shape> {
        let (law, mut unknown) = (self.law, unknown);
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let (axis, long) = if is_free { (self.low + unknown, unknown) } else { (unknown, unknown - self.low) };
            let short = if is_free { 0.0 } else { axis - self.high };
            if !is_free && long <= 0.0 {
                return None;
            }
            let (sine, cosine) = axis.sin_cos();
            let [far, near] = [long, short.abs()].map(|x| self.critical_across(x));
            let missing = sine - far - near.copysign(short);
            if closing.is_done(missing.abs(), far.max(near).max(1.0)) {
                let lengths = [long, short.abs()].map(|x| law.arc(Pull::Critical, 0.0, x)[1]);
                let flat = cosine - lengths[0] - lengths[1];
                let (ends, course) = ([-long, if is_free { 0.0 } else { -short }], Course::Through(axis));
                return (flat >= 0.0).then_some(Shape { pull: Pull::Critical, axis, ends, course, flat });
            }
            let moment = |x: f64| if x > 0.0 { x.sin() / law.curvature(Pull::Critical, x) } else { 0.0 };
            let slope = cosine - moment(long) - moment(short.abs());
            unknown -= shortened([0.0, missing / slope])[1];
            if is_free && (unknown.is_nan() || unknown <= -self.low) {
                return None;
            }
        }
        None
    }

    /// One inflection, inside or beyond the upper end, or at that end if it is free. The unknowns
    /// are t, and the overshoot (positive inside) to the power in which it is smooth, or the
    /// distance of a free end from the lower one.
    fn near_inflection(&self, mut t: f64, mut unknown: f64, is_free: bool) -> Option<Shape> {
        let law = self.law;
        let mut closing = Closing::new();
        for _ in 0..STEPS {
            let (side, short) =
                if is_free { (0.0, 0.0) } else { (1f64.copysign(unknown), (law.q * unknown.abs()).powf(1.0 / law.q)) };
            let [axis, long] =
                if is_free { [self.low + unknown, unknown] } else { [self.high + short, self.high - self.low + short] };
            let course = if unknown > 0.0 && !is_free { Course::Through(axis) } else { Course::Direct };
            let shape = Shape { pull: Pull::Above(t), axis, ends: [long, short], course, flat: 0.0 };
            let Inflected { far, near, rows, .. } = Inflected::new(law, t, side, &shape);
            let (sine, cosine) = axis.sin_cos();
            let right = cosine - far.arc[1] - side * near.arc[1];
            let up = sine - far.arc[2] - side * near.arc[2];
            if closing.is_done(right.hypot(up), (far.arc[0] + near.arc[0]).max(1.0)) {
                // If the piece that would close the chord grows with the overshoot, the shape is a
                // saddle.
                let minimum = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0] > 0.0;
                return (minimum || unknown <= 0.0 || is_free).then_some(shape);
            }
            let [step, _] = solve(rows, [[right, up], [0.0; 2]]);
            let [grown, turned] = shortened(step);
            (t, unknown) = (t * grown.exp(), unknown + turned);
            let bends_back = is_free && unknown <= -self.low;
            if !(grown.is_finite() && turned.is_finite()) || bends_back {
                return None;
            }
        }
        None
    }

    /// One inflection, inside (`overshoot` above 0) or beyond the upper end.
    pub(super) fn near_inflected(&self, t: f64, overshoot: f64) -> Option<Shape> {
        self.near_inflection(t, smoothed(self.law, overshoot), false)
    }

    /// An arc from the free end's inflection.
    pub(super) fn near_inflected_free(&self, t: f64, long: f64) -> Option<Shape> {
        self.near_inflection(t, long, true)
    }
}
