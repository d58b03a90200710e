//! Loops with an inflection beyond either end, between which the tangent turns from one inflection
//! to the other.
//!
//! Between the inflections the tangent turns by 2π less twice the angle of an inflection from the
//! pull. This angle, the pull's opening, is the outer unknown, and the overshoot beyond the lower
//! end is the inner one.

use super::{Course, DEEPEST, PI, Pull, Shape, Solver, root};

impl Solver<'_> {
    /// The loop with an inflection beyond either end: as the pull decreases, the remainder along it
    /// changes from positive to negative. (The change from negative to positive, at a larger pull,
    /// is a saddle.)
    pub(super) fn around(&self) -> Option<Shape> {
        const STEP: f64 = 0.05;
        let missing = |opening: f64| self.loop_of(opening).map(|(_, missing)| missing);
        let mut opening = (PI - 0.5 * (self.high - self.low)).min(0.5 * PI) - 1e-9;
        let mut before = (opening, None);
        while opening > 1e-12 {
            let value = missing(opening);
            match (before.1, value) {
                (Some(above), Some(below)) if above > 0.0 && below <= 0.0 => {
                    return self.loop_between((before.0, above), (opening, below));
                }
                (None, Some(below)) if below <= 0.0 => {
                    // The positive part may begin between two steps, exactly where the lower end is
                    // itself an inflection.
                    let (mut first, mut last) = (opening, before.0);
                    for _ in 0..50 {
                        let middle = 0.5 * (first + last);
                        match missing(middle) {
                            None => last = middle,
                            Some(at) if at > 0.0 => return self.loop_between((middle, at), (opening, below)),
                            Some(_) => first = middle,
                        }
                    }
                    if let Some(shape) = self.loop_at_edge(first, last) {
                        return Some(shape);
                    }
                }
                _ => {}
            }
            before = (opening, value);
            opening = if opening > 2.0 * STEP { opening - STEP } else { 0.5 * opening };
        }
        None
    }

    fn loop_between(&self, above: (f64, f64), below: (f64, f64)) -> Option<Shape> {
        let missing = |opening: f64| self.loop_of(opening).map_or(f64::NAN, |(_, missing)| missing);
        let opening = root(missing, above, below, 0.0);
        self.loop_of(opening).map(|(lower, _)| self.loop_shape(opening, lower))
    }

    /// The loop whose overshoot at the lower end is too small to be distinguished from the pull's
    /// opening. The unknown is the overshoot's logarithm. The opening follows, between two of which
    /// only the first leaves an overshoot.
    fn loop_at_edge(&self, inside: f64, outside: f64) -> Option<Shape> {
        let (largest, below) = self.loop_of(inside)?;
        let opening = |lower: f64| {
            let across = |opening: f64| self.loop_across(opening, lower);
            let ends = [inside, outside].map(|end| (end, across(end)));
            if ends[0].1 * ends[1].1 > 0.0 { inside } else { root(across, ends[0], ends[1], 0.0) }
        };
        let missing = |log: f64| self.loop_missing(opening(log.exp()), log.exp());
        let least = (-DEEPEST, missing(-DEEPEST));
        if largest <= 0.0 || least.1 <= 0.0 || below > 0.0 {
            return None;
        }
        let lower = root(missing, least, (largest.ln(), below), 1e-15).exp();
        Some(self.loop_shape(opening(lower), lower))
    }

    fn loop_shape(&self, opening: f64, lower: f64) -> Shape {
        let upper = self.overshoots(opening) - lower;
        let pull = Pull::Above(self.law.tension * opening.tan());
        let course = Course::Around(self.low - lower);
        Shape { pull, axis: self.high + upper, ends: [lower, upper], course, flat: 0.0 }
    }

    /// The sum of the two overshoots of a loop.
    fn overshoots(&self, opening: f64) -> f64 {
        self.low - self.high + 2.0 * (PI - opening)
    }

    /// A multiple of the remainder of the chord across the pull.
    fn loop_across(&self, opening: f64, lower: f64) -> f64 {
        let law = self.law;
        let pull = Pull::Above(law.tension * opening.tan());
        let upper = self.overshoots(opening) - lower;
        law.factor * (law.excess(pull, lower).powf(law.q) - law.excess(pull, upper).powf(law.q))
            + law.q * law.strength(pull) * (self.high + upper + opening).sin()
    }

    /// The remainder of the chord along the pull.
    fn loop_missing(&self, opening: f64, lower: f64) -> f64 {
        let pull = Pull::Above(self.law.tension * opening.tan());
        let upper = self.overshoots(opening) - lower;
        let along = |length: f64| {
            let [_, along, across] = self.law.arc(pull, 0.0, length);
            along * opening.cos() - across * opening.sin()
        };
        (self.high + upper + opening).cos() - along(upper) - along(lower) - 2.0 * along(PI - opening)
    }

    /// The overshoot at the lower end for which a loop between two inflections closes the chord
    /// across the pull, and the remainder along it.
    fn loop_of(&self, opening: f64) -> Option<(f64, f64)> {
        let both = self.overshoots(opening);
        if both < 0.0 {
            return None;
        }
        let across = |lower: f64| self.loop_across(opening, lower);
        // From equal overshoots to none at the lower end, or to a pull opposite to the chord, where
        // the sum is 0 or below.
        let first = 0.5 * both;
        let against = both - (PI - opening - self.high);
        let last = against.max(0.0);
        let (at_first, at_last) = (across(first), across(last));
        let lower = if at_first <= 0.0 || first - last <= 8.0 * f64::EPSILON {
            first
        } else if at_last <= 0.0 {
            root(across, (first, at_first), (last, at_last), 0.0)
        } else if against >= 0.0 {
            last
        } else {
            return None;
        };
        Some((lower, self.loop_missing(opening, lower)))
    }
}
