//! Curves that turn one way. The outer unknown is the strength of the pull. The inner one is its
//! direction, in which the displacement across the pull is elementary.

use super::{Course, DEEPEST, PI, Pull, Shape, Solver, root, widened};

impl Solver<'_> {
    /// The direction of the pull for which the chord closes across the pull, for a curve without
    /// inflection. Returns the law's arguments of the ends, and the remainder of the chord along
    /// the pull.
    fn along_circle(&self, pull: Pull) -> ([f64; 2], f64) {
        let law = self.law;
        let (strength, opening) = (law.strength(pull), law.opening(pull));
        let above = opening > 0.0;
        let turning = self.high - self.low;
        // The unknown is the overshoot of the inflection above the upper end, or the direction of
        // the pull.
        let ends = |x: f64| if above { [x + turning, x] } else { [self.low - x, self.high - x] };
        let direction = |x: f64| if above { self.high + x + opening } else { x };
        let across = |x: f64| {
            let [low, high] = ends(x).map(|end| law.excess(pull, end).powf(law.q));
            law.factor * (high - low) + law.q * strength * direction(x).sin()
        };
        let missing = |x: f64| {
            let [low, high] = ends(x);
            let [_, along, aside] = law.arc(pull, low.min(high), low.max(high));
            // From the frame of the inflection's tangent to that of the pull.
            (ends(x), direction(x).cos() - (along * opening.cos() - aside * opening.sin()))
        };
        let middle = 0.5 * (self.low + self.high);
        let (first, last) =
            if above { ((-opening - self.high).max(0.0), PI - opening - 0.5 * turning) } else { (0.0, middle + PI) };
        if middle == 0.0 && !above {
            return missing(self.symmetric_direction());
        }
        let (at_first, at_last) = (across(first), across(last));
        if at_last <= 0.0 {
            return missing(last);
        }
        if at_first >= 0.0 {
            if above {
                // The best direction has an inflection at the upper end: the derivative along that
                // line decides.
                let [_, _, aside] = law.arc(pull, 0.0, turning);
                return (ends(first), aside - self.high.sin());
            }
            return missing(first);
        }
        missing(root(across, (first, at_first), (last, at_last), 0.0))
    }

    pub(super) fn convex(&self) -> Option<Shape> {
        let axis = self.critical_direction();
        let inside = axis < self.high && axis > self.low;
        let missing = if inside && self.law.nu <= 2.0 { -1.0 } else { self.along_circle(Pull::Critical).1 };
        if missing >= 0.0 && inside {
            let ends = [self.low - axis, self.high - axis];
            return Some(Shape { pull: Pull::Critical, axis, ends, course: Course::Through(axis), flat: missing });
        }
        // Below the tension the unknown is the logarithm of the gap, above it the logarithm of t.
        let below = missing < 0.0;
        let least = self.law.tension.ln();
        let pull = |log: f64| if below { Pull::Below((-log).exp()) } else { Pull::Above(log.exp()) };
        let f = |log: f64| self.along_circle(pull(log)).1;
        let mut near = if below { (0.0, self.missing_of_circle()) } else { (least - 1.0, f(least - 1.0)) };
        if near.1 < 0.0 {
            [_, near] = widened(f, near, -1.0, least - DEEPEST, |value| value < 0.0)?;
        }
        let [near, far] = widened(f, near, 1.0, DEEPEST + least.max(0.0), |value| value > 0.0)?;
        if let Some(shape) = self.convex_near(pull(far.0)) {
            return Some(shape);
        }
        let pull = pull(root(f, near, far, 1e-15));
        let (ends, _) = self.along_circle(pull);
        let axis = if below { self.low - ends[0] } else { self.high + ends[1] };
        Some(Shape { pull, axis, ends, course: Course::Direct, flat: 0.0 })
    }

    /// The curve near a pull that closes the chord only across it. The curve is unique, so any one
    /// found is the right one.
    fn convex_near(&self, pull: Pull) -> Option<Shape> {
        let (ends, _) = self.along_circle(pull);
        let shape = match pull {
            Pull::Below(gap) => self.near_convex(gap, self.low - ends[0]),
            Pull::Critical => None,
            Pull::Above(t) => self.near_inflected(t, -ends[1]),
        };
        shape.filter(|shape| shape.course == Course::Direct)
    }

    /// The remainder of the chord for a circular arc, which has no pull: 0 or more.
    fn missing_of_circle(&self) -> f64 {
        let [_, x, y] = self.law.arc(Pull::Below(1.0), self.low, self.high);
        (1.0 - x).hypot(y)
    }

    /// The pull of a symmetric pair is along the chord, and forwards if the circular arc is too
    /// short for it.
    fn symmetric_direction(&self) -> f64 {
        let circle = 2.0 * self.high.sin() * self.law.factor / self.law.tension.powf(1.0 / self.law.nu);
        if circle <= 1.0 { 0.0 } else { PI }
    }

    /// The direction at the critical pull, without the remainder along it, which for ν ≤ 2 may be
    /// infinite.
    fn critical_direction(&self) -> f64 {
        let middle = 0.5 * (self.low + self.high);
        if middle == 0.0 {
            return self.symmetric_direction();
        }
        let across =
            |axis: f64| self.critical_across(self.high - axis) - self.critical_across(self.low - axis) + axis.sin();
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
