//! The pull that a pair of end angles on a chord of 1 takes: nested roots, each bracketed.
//!
//! At a given shape of turning the problem is convex in the radius of curvature as a function of the tangent's angle:
//! least ∫(ρ^{1−ν} + λρ) dθ under ∫ρT dθ = chord. Its dual is a concave function of the pull P, of which every root
//! below is a derivative along a line or a circle; so the roots of a pair without inflection are the only ones. With an
//! inflection at the angle ω there is one such problem for each ω, which allows a straight piece at the inflection; the
//! cost falls with ω while that piece is longer than 0 and rises where it would be negative, so the curve wanted is
//! the first ω, counted from the ends, at which the piece's length passes from above to below 0.

use super::quadrature::{Law, Pull};
use std::f64::consts::PI;

/// The solution in the frame where a + b ≤ 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub pull: Pull,
    /// Angle of the pull, or, above the tension, of the tangent at an inflection, beyond both ends' angles.
    pub axis: f64,
    pub course: Course,
    /// Length of the straight piece.
    pub flat: f64,
}

/// The angles between which the tangent turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    /// From one end's angle to the other's.
    Direct,
    /// To an angle, where there may be a straight piece, and on or back to the other end's.
    Through(f64),
    /// Beyond both ends' angles, to the axis at the greater and to this angle at the lesser.
    Around(f64),
}

/// A root of `f` in a bracket, by Chandrupatla's choice between bisection and inverse quadratic interpolation
/// (Advances in Engineering Software 28, 1997).
pub(super) fn root(mut f: impl FnMut(f64) -> f64, (a, fa): (f64, f64), (b, fb): (f64, f64), tolerance: f64) -> f64 {
    let (mut a, mut fa, mut b, mut fb) = (a, fa, b, fb);
    if fa == 0.0 || fb == 0.0 {
        return if fa == 0.0 { a } else { b };
    }
    let mut share = 0.5;
    for _ in 0..200 {
        let x = a + share * (b - a);
        let fx = f(x);
        let (c, fc);
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let (best, fbest) = if fa.abs() < fb.abs() { (a, fa) } else { (b, fb) };
        let smallest = (2.0 * f64::EPSILON * best.abs() + 0.5 * tolerance) / (b - a).abs();
        if fbest == 0.0 || smallest >= 0.5 {
            return best;
        }
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        share = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        share = share.clamp(smallest, 1.0 - smallest);
    }
    a
}

/// Widest and tightest logarithm of a gap or of a pull over the tension that is searched.
const DEEPEST: f64 = 690.0;

/// What a curve that turns back at ω needs.
#[derive(Clone, Copy, Debug)]
enum Balance {
    /// No pull above the tension: ω is too large.
    Slack,
    /// The pull, and the length of the straight piece at ω that would close the chord.
    At(f64, f64),
    /// A pull that would bend the far end back: the length of the straight piece at ω, where one at the far end helps.
    Beyond(f64),
}

impl Balance {
    fn sign(self) -> f64 {
        match self {
            Self::Slack => -1.0,
            Self::At(_, missing) | Self::Beyond(missing) => missing,
        }
    }
}

pub(super) struct Solver<'a> {
    pub law: &'a Law,
    pub low: f64,
    pub high: f64,
}

impl Solver<'_> {
    pub(super) fn solve(&self) -> Option<Shape> {
        if self.low == 0.0 && self.high == 0.0 {
            return Some(Shape { pull: Pull::Critical, axis: 0.0, course: Course::Through(0.0), flat: 1.0 });
        }
        if self.turns_back() { self.inflected().or_else(|| self.around()) } else { self.convex() }
    }

    /// Displacement along and (negated) across the tangent at ω of the two arcs that meet there.
    fn inflected_sums(&self, t: f64, omega: f64) -> [f64; 2] {
        let pull = Pull::Above(t);
        self.doubled(pull, omega - self.high, omega - self.low)
    }

    fn doubled(&self, pull: Pull, short: f64, long: f64) -> [f64; 2] {
        let [_, along, across] = self.law.arc(pull, 0.0, short);
        let [_, along_rest, across_rest] = self.law.arc(pull, short, long);
        [2.0 * along + along_rest, 2.0 * across + across_rest]
    }

    /// ∫ sin x ρ dx from 0 on the critical circle, elementary.
    fn critical_across(&self, x: f64) -> f64 {
        let law = self.law;
        law.factor * law.excess(Pull::Critical, x).powf(law.q) / (law.q * law.tension)
    }

    fn balance(&self, omega: f64) -> Balance {
        let (short, long) = (omega - self.high, omega - self.low);
        let wanted = omega.sin();
        if wanted >= self.critical_across(short) + self.critical_across(long) {
            return Balance::Slack;
        }
        if long <= PI && wanted <= 0.0 {
            return if omega <= 0.0 { Balance::Beyond(1.0) } else { Balance::Slack };
        }
        let across = |log: f64| self.inflected_sums(log.exp(), omega)[1] - wanted;
        let mut high = self.law.tension.max(1e-3).ln();
        let mut at_high;
        if long > PI {
            // Beyond this pull the far end would bend back.
            let limit = (self.law.tension * (0.5 * long).tan().abs()).ln() - 1e-9;
            high = limit;
            at_high = across(high);
            if at_high >= 0.0 {
                let straight = -at_high / long.sin();
                let missing = omega.cos() - self.inflected_sums(high.exp(), omega)[0] - straight * long.cos();
                return Balance::Beyond(missing);
            }
        } else {
            at_high = across(high);
        }
        let mut low = high;
        let mut at_low = at_high;
        let mut step = 1.0;
        while at_high > 0.0 {
            (low, at_low) = (high, at_high);
            high += step;
            step *= 2.0;
            if high > DEEPEST {
                return Balance::Beyond(1.0);
            }
            at_high = across(high);
        }
        step = 1.0;
        while at_low <= 0.0 {
            (high, at_high) = (low, at_low);
            low -= step;
            step *= 2.0;
            if low - self.law.tension.ln() < -DEEPEST {
                return Balance::Slack;
            }
            at_low = across(low);
        }
        let t = root(across, (low, at_low), (high, at_high), 1e-15).exp();
        Balance::At(t, omega.cos() - self.inflected_sums(t, omega)[0])
    }

    /// Whether the best curve that turns by no more than b − a wants a straight piece at its upper end.
    fn turns_back(&self) -> bool {
        if self.high <= 0.0 || self.high == self.low {
            return true;
        }
        self.balance(self.high).sign() > 0.0
    }

    fn inflected(&self) -> Option<Shape> {
        const STEP: f64 = 0.1;
        let mut near = (self.high.max(0.0), Balance::Beyond(1.0));
        let last = self.low + 2.0 * PI;
        let mut steps = 0;
        loop {
            steps += 1;
            let omega = near.0 + STEP;
            if omega >= last || steps > 100 {
                return None;
            }
            let balance = self.balance(omega);
            if balance.sign() <= 0.0 {
                return self.refine(near, (omega, balance));
            }
            near = (omega, balance);
        }
    }

    /// The root between two angles, of which the first is too small and the second too large.
    fn refine(&self, near: (f64, Balance), far: (f64, Balance)) -> Option<Shape> {
        let (mut near, mut far) = (near, far);
        // Near the critical pull ω no longer tells pulls apart, so there the pull is the outer unknown.
        for _ in 0..60 {
            if let Balance::At(t, _) = near.1 {
                let bound = self.turning_limit(far.0);
                let settled = matches!(far.1, Balance::At(other, _) if t < 1.5 * other);
                if settled || t < 0.5 * bound && matches!(far.1, Balance::Slack | Balance::At(..)) && t < self.law.tension
                {
                    break;
                }
            }
            let omega = 0.5 * (near.0 + far.0);
            let balance = self.balance(omega);
            *(if balance.sign() > 0.0 { &mut near } else { &mut far }) = (omega, balance);
        }
        let Balance::At(t_near, missing_near) = near.1 else { return None };
        let inner = |t: f64| -> f64 {
            let f = |omega: f64| omega.sin() - self.inflected_sums(t, omega)[1];
            root(f, (near.0, f(near.0)), (far.0, f(far.0)), 0.0)
        };
        let missing = |log: f64| {
            let t = log.exp();
            let omega = inner(t);
            omega.cos() - self.inflected_sums(t, omega)[0]
        };
        let (log_near, mut log_far, mut missing_far) = match far.1 {
            Balance::At(t, missing) => (t_near.ln(), t.ln(), missing),
            _ => {
                if self.law.nu > 2.0
                    && let Some(shape) = self.flat_s(near.0, far.0)
                {
                    return Some(shape);
                }
                (t_near.ln(), f64::NAN, f64::NAN)
            }
        };
        let mut bracket = (log_near, missing_near);
        let mut step = 1.0;
        while log_far.is_nan() {
            let log = bracket.0 - step;
            if log < self.law.tension.ln() - DEEPEST {
                return None;
            }
            let value = missing(log);
            if value <= 0.0 {
                (log_far, missing_far) = (log, value);
            } else {
                bracket = (log, value);
                step *= 2.0;
            }
        }
        let t = root(missing, bracket, (log_far, missing_far), 1e-15).exp();
        let omega = inner(t);
        Some(Shape { pull: Pull::Above(t), axis: omega, course: Course::Through(omega), flat: 0.0 })
    }

    /// The pull above the tension at which an arc from ω to the far end bends back.
    fn turning_limit(&self, omega: f64) -> f64 {
        let long = omega - self.low;
        if long <= PI { f64::INFINITY } else { self.law.tension * (0.5 * long).tan().abs() }
    }

    /// Two arcs that turn opposite ways, and a straight piece between them.
    fn flat_s(&self, near: f64, far: f64) -> Option<Shape> {
        let f = |omega: f64| {
            omega.sin() - self.critical_across(omega - self.high) - self.critical_across(omega - self.low)
        };
        let omega = root(f, (near, f(near)), (far, f(far)), 0.0);
        let flat = omega.cos() - self.doubled(Pull::Critical, omega - self.high, omega - self.low)[0];
        (flat >= 0.0).then_some(Shape { pull: Pull::Critical, axis: omega, course: Course::Through(omega), flat })
    }

    /// A loop with an inflection beyond either end, the least overshoot first.
    fn around(&self) -> Option<Shape> {
        const STEP: f64 = 0.05;
        let highest = (PI - 0.5 * (self.high - self.low)).min(0.5 * PI);
        let missing = |opening: f64| self.loop_of(opening).map(|(_, missing)| missing);
        let mut above = None;
        let mut none = highest;
        let mut opening = highest - 1e-9;
        while opening > 1e-12 {
            match (missing(opening), above) {
                (None, _) => none = opening,
                (Some(value), _) if value > 0.0 => above = Some((opening, value)),
                (Some(value), Some(bracket)) => {
                    return self.loop_between(bracket, (opening, value));
                }
                (Some(value), None) => {
                    // The loop begins between two steps: just where the lower end is itself an inflection.
                    let (mut first, mut last) = (opening, none);
                    for _ in 0..50 {
                        let middle = 0.5 * (first + last);
                        match missing(middle) {
                            None => last = middle,
                            Some(at) if at > 0.0 => return self.loop_between((middle, at), (opening, value)),
                            Some(_) => first = middle,
                        }
                    }
                    return None;
                }
            }
            opening = if opening > 2.0 * STEP { opening - STEP } else { 0.5 * opening };
        }
        None
    }

    fn loop_between(&self, above: (f64, f64), below: (f64, f64)) -> Option<Shape> {
        let missing = |opening: f64| self.loop_of(opening).map_or(f64::NAN, |(_, missing)| missing);
        let opening = root(missing, above, below, 0.0);
        let (direction, _) = self.loop_of(opening)?;
        let course = Course::Around(direction - (2.0 * PI - opening));
        Some(Shape { pull: Pull::Above(self.law.tension * opening.tan()), axis: direction - opening, course, flat: 0.0 })
    }

    /// The direction of the pull with which a loop between two inflections closes the chord across it, and what is then
    /// missing along it.
    fn loop_of(&self, opening: f64) -> Option<(f64, f64)> {
        let law = self.law;
        let pull = Pull::Above(law.tension * opening.tan());
        let overshoots = |direction: f64| {
            (direction - opening - self.high, self.low - direction + (2.0 * PI - opening))
        };
        let across = |direction: f64| {
            let (upper, lower) = overshoots(direction);
            law.factor * (law.excess(pull, lower).powf(law.q) - law.excess(pull, upper).powf(law.q))
                + law.q * law.strength(pull) * direction.sin()
        };
        let first = 0.5 * (self.low + self.high) + PI;
        let last = PI.min(self.low + 2.0 * PI - opening);
        let (at_first, at_last) = (across(first), across(last));
        let direction = if at_first <= 0.0 {
            first
        } else if last > first && at_last <= 0.0 {
            root(across, (first, at_first), (last, at_last), 0.0)
        } else {
            return None;
        };
        let (upper, lower) = overshoots(direction);
        if upper < 0.0 || lower < 0.0 {
            return None;
        }
        let along = |length: f64| {
            let [_, along, across] = law.arc(pull, 0.0, length);
            along * opening.cos() - across * opening.sin()
        };
        Some((direction, direction.cos() - along(upper) - along(lower) - 2.0 * along(PI - opening)))
    }

    /// The direction of the pull at which the chord closes across it, for a curve without inflection, and what is
    /// missing along it.
    fn along_circle(&self, pull: Pull) -> (f64, f64) {
        let law = self.law;
        let (strength, opening) = (law.strength(pull), law.opening(pull));
        let sign = if opening > 0.0 { -1.0 } else { 1.0 };
        let middle = 0.5 * (self.low + self.high);
        // x of an angle: from the inflection backwards, or from the pull forwards.
        let place = |angle: f64, axis: f64| sign * (angle - axis);
        let across = |axis: f64| {
            let term = |angle: f64| law.excess(pull, place(angle, axis)).powf(law.q);
            law.factor * (term(self.high) - term(self.low)) + law.q * strength * (axis + opening).sin()
        };
        let missing = |axis: f64| {
            let [from, to] = if sign > 0.0 { [self.low, self.high] } else { [self.high, self.low] };
            let [_, along, aside] = law.arc(pull, place(from, axis), place(to, axis));
            // From the frame of the inflection's tangent to that of the pull.
            (axis + opening).cos() - (along * opening.cos() - aside * opening.sin())
        };
        let (first, last) = match pull {
            Pull::Above(_) => (self.high.max(-opening), middle + PI - opening),
            _ => (0.0, middle + PI),
        };
        if middle == 0.0 && opening == 0.0 {
            // By symmetry the pull is along the chord: forwards if the circular arc is too short for it.
            let circle = 2.0 * self.high.sin() * law.factor / law.tension.powf(1.0 / law.nu);
            let axis = if circle <= 1.0 { 0.0 } else { PI };
            return (axis, missing(axis));
        }
        let (at_first, at_last) = (across(first), across(last));
        if at_last <= 0.0 {
            return (last, missing(last));
        }
        if at_first >= 0.0 {
            if opening > 0.0 {
                // The best direction has an inflection at the upper end: the derivative along that line decides.
                let [_, _, aside] = law.arc(pull, 0.0, self.high - self.low);
                return (first, aside - self.high.sin());
            }
            return (first, missing(first));
        }
        let axis = root(across, (first, at_first), (last, at_last), 0.0);
        (axis, missing(axis))
    }

    fn convex(&self) -> Option<Shape> {
        let (direction, missing) = {
            let inside = |axis: f64| axis < self.high && axis > self.low;
            let axis = self.critical_direction();
            if inside(axis) && self.law.nu <= 2.0 { (axis, -1.0) } else { self.along_circle(Pull::Critical) }
        };
        if missing >= 0.0 && direction <= self.high {
            return Some(Shape { pull: Pull::Critical, axis: direction, course: Course::Through(direction), flat: missing });
        }
        // Below the tension the unknown is the logarithm of the gap, above it that of the inflections' opening.
        let below = missing < 0.0;
        let pull = |log: f64| if below { Pull::Below((-log).exp()) } else { Pull::Above(log.exp()) };
        let f = |log: f64| self.along_circle(pull(log)).1;
        let mut near = if below { 0.0 } else { self.law.tension.ln() - 1.0 };
        let mut at_near = if below { self.missing_of_circle() } else { f(near) };
        let mut step = 1.0;
        while !below && at_near < 0.0 {
            near -= step;
            step *= 2.0;
            if near < self.law.tension.ln() - DEEPEST {
                return None;
            }
            at_near = f(near);
        }
        step = 1.0;
        let mut far = near + step;
        let mut at_far = f(far);
        while at_far > 0.0 {
            (near, at_near) = (far, at_far);
            step *= 2.0;
            far += step;
            if far > DEEPEST {
                return None;
            }
            at_far = f(far);
        }
        let pull = pull(root(f, (near, at_near), (far, at_far), 1e-15));
        Some(Shape { pull, axis: self.along_circle(pull).0, course: Course::Direct, flat: 0.0 })
    }

    /// What a circular arc, which takes no pull, leaves of the chord: 0 or more.
    fn missing_of_circle(&self) -> f64 {
        let [_, x, y] = self.law.arc(Pull::Below(1.0), self.low, self.high);
        (1.0 - x).hypot(y)
    }

    /// The direction at the critical pull, without what is missing along it, which for ν ≤ 2 may be infinite.
    fn critical_direction(&self) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        if middle == 0.0 {
            return 0.0;
        }
        let across = |axis: f64| {
            self.critical_across(self.high - axis) - self.critical_across(self.low - axis) + axis.sin()
        };
        let (first, last) = (0.0, middle + PI);
        let (at_first, at_last) = (across(first), across(last));
        if at_first >= 0.0 {
            return first;
        }
        if at_last <= 0.0 {
            return last;
        }
        root(across, (first, at_first), (last, at_last), 0.0)
    }
}
