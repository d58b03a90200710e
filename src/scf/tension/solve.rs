//! [`Solver`]: finds the pull for a pair of end angles on a chord of 1, by nested bracketed roots.
//!
//! For a given course of the tangent the problem is convex in the radius of curvature as a function
//! of the tangent's angle: least ∫(ρ^{1−ν} + λρ) dθ subject to ∫ρT dθ = chord. Its dual is a
//! concave function of the pull P, and every root below is one of its derivatives along a line or a
//! circle. The roots of a pair without inflection are therefore unique. With an inflection at the
//! angle ω there is one such problem for each ω, which allows a straight piece at the inflection.
//! The cost falls with ω while that piece has positive length, and rises where the length would be
//! negative. The solution is the first ω, counted from the ends, at which the length of the piece
//! changes from positive to negative.
//!
//! Once a root is bracketed, Newton's method on both unknowns ([`near`]) is used if it stays within
//! the bracket.

mod convex;
mod free;
mod loops;
pub(super) mod near;

use super::quadrature::{Law, Pull};
use super::shape::{Course, Shape};
use std::f64::consts::PI;

/// A root of `f` in a bracket, by Chandrupatla's choice between bisection and inverse quadratic
/// interpolation (Advances in Engineering Software 28, 1997).
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
        // NaN if both ends are 0.
        if fbest == 0.0 || smallest >= 0.5 || smallest.is_nan() {
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

/// Takes steps of doubling size from a start, as long as `goes_on` holds for the value.
///
/// Returns both ends of the last step. `None` if it leads beyond the limit.
fn widened(
    f: impl Fn(f64) -> f64,
    mut near: (f64, f64),
    mut step: f64,
    limit: f64,
    goes_on: impl Fn(f64) -> bool,
) -> Option<[(f64, f64); 2]> {
    loop {
        let x = near.0 + step;
        if (x - limit) * step > 0.0 {
            return None;
        }
        let far = (x, f(x));
        if !goes_on(far.1) {
            return Some([near, far]);
        }
        near = far;
        step *= 2.0;
    }
}

/// The tolerance of a logarithm in a rough evaluation.
const ROUGHLY: f64 = 1e-3;

/// A straight piece of this length, in chords, is certainly not of length 0 in a rough evaluation:
/// an error of [`ROUGHLY`] in a pull's logarithm changes it by 1e-3 of the arcs' length.
const CLEARLY: f64 = 0.1;

/// The largest absolute logarithm of a gap, or of a pull over the tension, that is searched.
const DEEPEST: f64 = 690.0;

/// The condition for a curve that turns back at ω.
#[derive(Clone, Copy, Debug)]
enum Balance {
    /// No pull above the tension: ω is too large.
    Slack,
    /// The logarithm of the pull across the tangent at ω, and the length of the straight piece
    /// there that would close the chord.
    At(f64, f64),
    /// A pull that would bend the far end back. Holds the length of the straight piece at ω, if one
    /// at the far end helps.
    Beyond(f64),
}

impl Balance {
    fn sign(self) -> f64 {
        match self {
            Self::Slack => -1.0,
            Self::At(_, missing) | Self::Beyond(missing) => missing,
        }
    }

    fn logarithm(self) -> Option<f64> {
        if let Self::At(log, _) = self { Some(log) } else { None }
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
            return Some(self.through(Pull::Critical, 0.0, 1.0));
        }
        if self.turns_back() { self.inflected().or_else(|| self.around()) } else { self.convex() }
    }

    /// A segment that is straight approximately along the chord.
    pub(super) fn nearly_straight(&self) -> Option<Shape> {
        if self.law.nu > 2.0 { self.near_flat(0.0, false) } else { None }
    }

    /// The solution of [`solve`](Self::solve), and the loop between two inflections if that is a
    /// different one.
    pub(super) fn all(&self) -> Vec<Shape> {
        let nearest = self.solve();
        let around =
            if matches!(nearest, Some(Shape { course: Course::Around(_), .. })) { None } else { self.around() };
        nearest.into_iter().chain(around).collect()
    }

    /// The displacement along and (negated) across the tangent at ω of the two arcs that meet
    /// there.
    fn inflected_sums(&self, pull: Pull, overshoot: f64) -> [f64; 2] {
        let [_, along, across] = self.law.arc(pull, 0.0, overshoot);
        let [_, along_rest, across_rest] = self.law.arc(pull, overshoot, self.long(overshoot));
        [2.0 * along + along_rest, 2.0 * across + across_rest]
    }

    /// The turning between ω and the lower end.
    fn long(&self, overshoot: f64) -> f64 {
        overshoot + (self.high - self.low)
    }

    /// ∫ sin x ρ dx from 0 on the critical circle, which is elementary.
    fn critical_across(&self, x: f64) -> f64 {
        let law = self.law;
        law.factor * law.excess(Pull::Critical, x).powf(law.q) / (law.q * law.tension)
    }

    /// The remainder of the chord across the tangent at ω for the critical pull. If it is negative,
    /// the pull is above the tension.
    fn critical_excess(&self, overshoot: f64) -> f64 {
        (self.high + overshoot).sin() - self.critical_across(overshoot) - self.critical_across(self.long(overshoot))
    }

    /// The [`Balance`] at ω = high + overshoot, with the pull's logarithm to a tolerance, from a
    /// guess.
    fn balance(&self, overshoot: f64, guess: f64, tolerance: f64) -> Balance {
        let (omega, long) = (self.high + overshoot, self.long(overshoot));
        let wanted = omega.sin();
        if self.critical_excess(overshoot) >= 0.0 {
            return Balance::Slack;
        }
        if long <= PI && wanted <= 0.0 {
            return if omega <= 0.0 { Balance::Beyond(f64::INFINITY) } else { Balance::Slack };
        }
        if long <= PI
            && let Some(found) = self.balance_near(overshoot, guess, tolerance)
        {
            return found;
        }
        let sums = |log: f64| self.inflected_sums(Pull::Above(log.exp()), overshoot);
        let across = |log: f64| sums(log)[1] - wanted;
        let least = self.law.tension.ln();
        let (mut high, mut at_high, mut limit) = (guess, f64::NAN, least + DEEPEST);
        if long > PI {
            // Beyond this pull the far end would bend back.
            limit = least + (0.5 * long).tan().abs().ln() - 1e-9;
            let [along, aside] = sums(limit);
            if aside >= wanted {
                let straight = (wanted - aside) / long.sin();
                return Balance::Beyond(omega.cos() - along - straight * long.cos());
            }
            if limit <= guess {
                (high, at_high) = (limit, aside - wanted);
            }
        }
        if at_high.is_nan() {
            at_high = across(high);
        }
        let (mut low, mut at_low) = (high, at_high);
        let mut step = 0.5;
        while at_high > 0.0 {
            (low, at_low) = (high, at_high);
            if high >= limit {
                return Balance::Beyond(f64::INFINITY);
            }
            high = (high + step).min(limit);
            step *= 2.0;
            at_high = across(high);
        }
        if at_low <= 0.0 {
            let Some(bracket) = widened(across, (low, at_low), -0.5, least - DEEPEST, |value| value <= 0.0) else {
                return Balance::Slack;
            };
            [(high, at_high), (low, at_low)] = bracket;
        }
        let log = root(across, (low, at_low), (high, at_high), tolerance);
        Balance::At(log, omega.cos() - sums(log)[0])
    }

    /// The same by Newton's method on the logarithm, in which the displacement across decreases.
    /// `None` if it does not converge in a few steps.
    fn balance_near(&self, overshoot: f64, guess: f64, tolerance: f64) -> Option<Balance> {
        const STEPS: usize = 6;
        // The next step would be of the order of the square of this.
        let last = tolerance.max(1e-8);
        let (sine, cosine) = (self.high + overshoot).sin_cos();
        let mut log = guess;
        for _ in 0..STEPS {
            let [near, far] = [overshoot, self.long(overshoot)].map(|x| self.law.growth(log.exp(), x));
            let [along, across] = [1, 2].map(|k| near.arc[k] + far.arc[k]);
            let [stretched, lifted] = [0, 1].map(|k| near.changes[k] + far.changes[k]);
            let step = (sine - across) / lifted;
            log += step.clamp(-2.0, 2.0);
            if step.abs() <= last {
                return Some(Balance::At(log, cosine - along - stretched * step));
            }
        }
        None
    }

    /// The [`Balance`] to rounding.
    fn exact(&self, (overshoot, near): (f64, Balance)) -> Balance {
        self.balance(overshoot, near.logarithm().unwrap_or(self.usual()), 1e-15)
    }

    fn usual(&self) -> f64 {
        self.law.tension.max(1e-3).ln()
    }

    /// Whether the best curve that turns by at most b − a would have a straight piece at its upper
    /// end.
    fn turns_back(&self) -> bool {
        if self.high <= 0.0 || self.high == self.low {
            return true;
        }
        let rough = self.balance(0.0, self.usual(), ROUGHLY).sign();
        // A longer piece certainly has positive length.
        let sign = if rough.abs() > CLEARLY { rough } else { self.exact((0.0, Balance::Slack)).sign() };
        sign > 0.0
    }

    fn inflected(&self) -> Option<Shape> {
        const STEP: f64 = 0.1;
        // No pull, however large, suits a tangent below the chord.
        let start = (-self.high).max(0.0);
        let mut near = (
            start,
            if self.high > 0.0 { self.balance(start, self.usual(), ROUGHLY) } else { Balance::Beyond(f64::INFINITY) },
        );
        let last = 2.0 * PI - (self.high - self.low);
        while near.0 + STEP < last {
            let overshoot = near.0 + STEP;
            let rough = self.balance(overshoot, near.1.logarithm().unwrap_or(self.usual()), ROUGHLY);
            let mut next = (overshoot, rough);
            if rough.sign() <= 0.0 {
                next.1 = self.exact(next);
                if next.1.sign() <= 0.0 {
                    return self.refine(near, next);
                }
            }
            near = next;
        }
        None
    }

    /// The root between two overshoots, the first too small and the second too large.
    fn refine(&self, near: (f64, Balance), far: (f64, Balance)) -> Option<Shape> {
        if let (Balance::At(_, missing), Balance::At(log, too_much)) = (near.1, far.1) {
            let guess = near.0 + (far.0 - near.0) * missing / (missing - too_much);
            let within = |shape: &Shape| (near.0..=far.0).contains(&shape.ends[1]);
            if let Some(shape) = self.near_inflected(log.exp(), guess).filter(within) {
                return Some(shape);
            }
        }
        let (mut near, mut far) = (near, far);
        if near.1.logarithm().is_some() {
            near.1 = self.exact(near);
        }
        // Near the critical pull ω does not distinguish pulls. There the pull is the outer unknown,
        // elsewhere ω.
        let critical = self.law.tension.ln() - 5.0;
        for _ in 0..60 {
            if self.law.nu > 2.0
                && matches!(far.1, Balance::Slack)
                && let Some(shape) = self.flat_s(near.0, far.0)
            {
                return Some(shape);
            }
            match (near.1, far.1) {
                (Balance::At(_, at_near), Balance::At(log, at_far)) if log >= critical => {
                    let missing = |overshoot| self.balance(overshoot, log, 1e-15).sign();
                    let overshoot = root(missing, (near.0, at_near), (far.0, at_far), 0.0);
                    let log = self.balance(overshoot, log, 1e-15).logarithm()?;
                    return Some(self.through(Pull::Above(log.exp()), overshoot, 0.0));
                }
                (Balance::At(log, _), Balance::At(other, _)) if log < critical + 1.0 && other < log => break,
                (Balance::At(log, _), Balance::Slack) if log < critical + 1.0 => break,
                (Balance::Beyond(missing), Balance::Beyond(_)) if missing.is_finite() => return None,
                _ => {}
            }
            let overshoot = 0.5 * (near.0 + far.0);
            let balance = self.exact((overshoot, far.1));
            *(if balance.sign() > 0.0 { &mut near } else { &mut far }) = (overshoot, balance);
        }
        let Balance::At(log_near, missing_near) = near.1 else { return None };
        let inner = |pull: Pull| -> f64 {
            let f = |overshoot: f64| (self.high + overshoot).sin() - self.inflected_sums(pull, overshoot)[1];
            root(f, (near.0, f(near.0)), (far.0, f(far.0)), 0.0)
        };
        let missing = |log: f64| {
            let pull = Pull::Above(log.exp());
            let overshoot = inner(pull);
            (self.high + overshoot).cos() - self.inflected_sums(pull, overshoot)[0]
        };
        let mut bracket = [(log_near, missing_near); 2];
        if let Balance::At(log, missing) = far.1 {
            bracket[1] = (log, missing);
        }
        if bracket[1].1 > 0.0 {
            bracket = widened(missing, bracket[1], -1.0, self.law.tension.ln() - DEEPEST, |value| value > 0.0)?;
        }
        let pull = Pull::Above(root(missing, bracket[0], bracket[1], 1e-15).exp());
        Some(self.through(pull, inner(pull), 0.0))
    }

    fn through(&self, pull: Pull, overshoot: f64, flat: f64) -> Shape {
        let axis = self.high + overshoot;
        let ends = match pull {
            Pull::Above(_) => [self.long(overshoot), overshoot],
            _ => [-self.long(overshoot), -overshoot],
        };
        Shape { pull, axis, ends, course: Course::Through(axis), flat }
    }

    /// Two arcs that turn opposite ways, with a straight piece between them.
    fn flat_s(&self, near: f64, far: f64) -> Option<Shape> {
        let f = |overshoot: f64| self.critical_excess(overshoot);
        if f(near) > 0.0 {
            return None;
        }
        let overshoot = root(f, (near, f(near)), (far, f(far)), 0.0);
        let flat = (self.high + overshoot).cos() - self.inflected_sums(Pull::Critical, overshoot)[0];
        (flat >= 0.0).then(|| self.through(Pull::Critical, overshoot, flat))
    }
}
