//! Segments whose upper end is free. They have no moment there, so they begin with an inflection or
//! a straight piece.

use super::{Course, DEEPEST, Pull, Shape, Solver, root, widened};

/// The step of the search for the first turning that fits, in radians.
const STEP: f64 = 0.1;

impl Solver<'_> {
    /// The segment between the free end and the angle `low` ≤ 0 at the other.
    ///
    /// All arcs that begin at an inflection under a given pull are the same whatever the chord.
    /// Such an arc turns until its end has the required angle from the chord. The pull then follows
    /// from the chord's length.
    pub(crate) fn free(&self) -> Option<Shape> {
        if self.low == 0.0 {
            return Some(self.through(Pull::Critical, 0.0, 1.0));
        }
        if self.law.nu > 2.0
            && let Some(shape) = self.flat_from_free()
        {
            return Some(shape);
        }
        let least = self.law.tension.ln();
        let over = |log: f64| self.turning_from_free(Pull::Above(log.exp())).map_or(-1.0, |(_, chord)| chord - 1.0);
        let start = (self.usual(), over(self.usual()));
        let [(low, at_low), (high, at_high)] = if start.1 < 0.0 {
            let [high, low] = widened(over, start, -1.0, least - DEEPEST, |value| value < 0.0)?;
            [low, high]
        } else {
            widened(over, start, 1.0, least.max(0.0) + DEEPEST, |value| value >= 0.0)?
        };
        if let Some((long, _)) = self.turning_from_free(Pull::Above(low.exp())) {
            let between = |shape: &Shape| matches!(shape.pull, Pull::Above(t) if (low..=high).contains(&t.ln()));
            if let Some(shape) = self.near_inflected_free(low.exp(), long).filter(between) {
                return Some(shape);
            }
        }
        let pull = Pull::Above(root(over, (low, at_low), (high, at_high), 1e-15).exp());
        let (long, _) = self.turning_from_free(pull)?;
        Some(self.after_free(pull, long, 0.0))
    }

    pub(super) fn after_free(&self, pull: Pull, long: f64, flat: f64) -> Shape {
        let axis = self.low + long;
        match pull {
            Pull::Above(_) => Shape { pull, axis, ends: [long, 0.0], course: Course::Direct, flat },
            _ => Shape { pull, axis, ends: [-long, 0.0], course: Course::Through(axis), flat },
        }
    }

    /// The turning from the inflection to an end at the required angle from the chord, and the
    /// chord. `None` if the arc bends back first.
    fn turning_from_free(&self, pull: Pull) -> Option<(f64, f64)> {
        let most = 2.0 * (std::f64::consts::PI - self.law.opening(pull));
        let turned = |long: f64| {
            let [_, along, across] = self.law.arc(pull, 0.0, long);
            let (sine, cosine) = (self.low + long).sin_cos();
            (along * sine - across * cosine, along * cosine + across * sine)
        };
        let mut near = (-self.low, turned(-self.low).0);
        if near.0 >= most {
            return None;
        }
        loop {
            let long = (near.0 + STEP).min(most);
            let far = (long, turned(long).0);
            if far.1 >= 0.0 {
                let long = root(|long| turned(long).0, near, far, 0.0);
                let chord = turned(long).1;
                return (chord > 0.0).then_some((long, chord));
            }
            if long >= most {
                return None;
            }
            near = far;
        }
    }

    /// A straight piece from the free end, followed by an arc.
    fn flat_from_free(&self) -> Option<Shape> {
        let across = |long: f64| (self.low + long).sin() - self.critical_across(long);
        let mut near = (-self.low, across(-self.low));
        // Beyond this the straight piece would lead backwards.
        let last = 0.5 * std::f64::consts::PI - self.low;
        while near.0 < last {
            let long = (near.0 + STEP).min(last);
            let far = (long, across(long));
            if far.1 >= 0.0 {
                let long = root(across, near, far, 0.0);
                let [_, along, _] = self.law.arc(Pull::Critical, 0.0, long);
                let flat = (self.low + long).cos() - along;
                return (flat >= 0.0).then(|| self.after_free(Pull::Critical, long, flat));
            }
            near = far;
        }
        None
    }
}
