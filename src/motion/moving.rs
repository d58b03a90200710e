//! [`Moving`]: a [`Motion`](super::Motion) in the plane or in space, its length and its curvature.

use super::roots::{MOST_HALVINGS, bernstein, sign_changes};
use super::vector::Vector;
use crate::arclength;

/// V(v) = V₀ + v V₁ + v² V₂ and A(v) = A₀ + v A₁.
#[derive(Clone, Copy)]
pub(crate) struct Moving<V> {
    pub velocity: [V; 3],
    pub acceleration: [V; 2],
}

/// The number of coefficients of the polynomial whose roots are where the curvature is stationary.
const STATIONARY: usize = 10;

/// A piece whose speed falls below this part of the largest is divided where the speed is least.
const SLOW: f64 = 0.01;

/// Cross products below this part of |V||A| are rounding.
const STRAIGHT: f64 = 16.0 * f64::EPSILON;

/// Squares and cubes of such numbers, and products of some, are normal.
const MODERATE: std::ops::Range<f64> = 1e-20..1e20;

/// Rounding of a bound on squares of curvatures.
const BOUND_ROUNDING: f64 = 1e-11;

impl<V: Vector> Moving<V> {
    #[inline(always)]
    fn velocity_at(&self, v: f64) -> V {
        let [a, b, c] = self.velocity;
        a + (b + c * v) * v
    }

    /// |V(v)|
    #[inline(always)]
    pub fn speed(&self, v: f64) -> f64 {
        let velocity = self.velocity_at(v);
        velocity.dot(velocity).sqrt()
    }

    /// |V × A|² and |V|² at v. κ² is the first over the cube of the second.
    #[inline(always)]
    fn squares(&self, v: f64) -> [f64; 2] {
        let velocity = self.velocity_at(v);
        let turn = velocity.cross(self.acceleration[0] + self.acceleration[1] * v);
        [V::product(turn, turn), velocity.dot(velocity)]
    }

    /// |κ(v)|. 0 where V vanishes.
    #[inline(always)]
    fn curvature(&self, v: f64) -> f64 {
        let [turn, speed] = self.squares(v);
        if speed == 0.0 { 0.0 } else { turn.sqrt() / (speed * speed.sqrt()) }
    }

    /// The largest of `known` and of |κ| at both ends and in the middle.
    #[inline(always)]
    pub fn curvature_seen(&self, known: f64) -> f64 {
        // A piece with numbers out of range waits for the search.
        if !MODERATE.contains(&self.size()) {
            return known;
        }
        let square = known * known;
        let exceeds = |[turn, speed]: [f64; 2]| turn > square * (speed * speed * speed);
        let places = [0.0, 0.5, 1.0];
        // Roots and quotients are computed only for what exceeds `known`.
        if !places.map(|v| exceeds(self.squares(v))).contains(&true) {
            return known;
        }
        places.iter().fold(known, |known, &v| known.max(self.curvature(v)))
    }

    /// Largest coordinate of any coefficient.
    #[inline(always)]
    fn size(&self) -> f64 {
        let ([a, b, c], [d, e]) = (self.velocity, self.acceleration);
        a.largest().max(b.largest()).max(c.largest()).max(d.largest()).max(e.largest())
    }

    fn scaled(&self, by: f64) -> Self {
        Moving { velocity: self.velocity.map(|v| v * by), acceleration: self.acceleration.map(|a| a * by) }
    }

    /// See [`Motion::length`](super::Motion::length).
    #[inline(always)]
    pub fn length(&self) -> f64 {
        let size = self.size();
        if !MODERATE.contains(&size) {
            return self.length_of_size(size);
        }
        if self.is_steady() {
            return arclength::steady_length(|v| self.speed(v));
        }
        arclength::span_length(|v| self.speed(v))
    }

    /// Whether six speeds give the length to 2e-11 of it.
    ///
    /// With |V₁| r + |V₂| r² ≤ (√2 − 1) |V₀| the speed has no branch point within r of the piece's
    /// start. Gauss' rule of n points then errs by some 64/15 ρ⁻²ⁿ, with ρ = x + √(x² − 1) and x =
    /// 2r − 1. r = 2.88 is asked for here, where that is 1e-11. Edges of fair curves are such
    /// pieces if they turn by 0.1 at most.
    #[inline(always)]
    fn is_steady(&self) -> bool {
        let [a, b, c] = self.velocity;
        // (|V₁| + 3 |V₂|)² ≤ 2 (|V₁|² + 9 |V₂|²) ≤ |V₀|²/49
        98.0 * (b.dot(b) + 9.0 * c.dot(c)) <= a.dot(a)
    }

    #[cold]
    fn length_of_size(&self, size: f64) -> f64 {
        if size == 0.0 || !size.is_finite() {
            return size;
        }
        // Scaled in two steps, since one factor might be out of range.
        let scaled = self.scaled(size.sqrt().recip()).scaled(size.sqrt().recip());
        arclength::span_length(|v| scaled.speed(v)) * size
    }

    /// See [`Motion::max_curvature`](super::Motion::max_curvature).
    #[inline(always)]
    pub fn max_curvature(&self, known: f64) -> f64 {
        let size = self.size();
        if !MODERATE.contains(&size) {
            return self.max_curvature_of_size(known, size);
        }
        if self.is_below(known) { known } else { self.largest_curvature(known) }
    }

    #[cold]
    fn max_curvature_of_size(&self, known: f64, size: f64) -> f64 {
        if size == 0.0 || !size.is_finite() {
            return known;
        }
        let scaled = self.scaled(size.sqrt().recip()).scaled(size.sqrt().recip());
        known.max(scaled.max_curvature(0.0) / size)
    }

    /// Control points of V.
    #[inline(always)]
    fn controls(&self) -> [V; 3] {
        let [a, b, c] = self.velocity;
        [a, a + b * 0.5, a + b + c]
    }

    /// Whether |κ| is nowhere on the piece above `known`.
    ///
    /// Control points of V × A, and of V in the direction of its middle, give a bound.
    #[inline(always)]
    fn is_below(&self, known: f64) -> bool {
        let controls = self.controls();
        let along = controls[0] + controls[1] + controls[2];
        let [p, q, r] = controls.map(|control| control.dot(along));
        let least = p.min(q).min(r);
        let most = cubic_controls(self.turns()).map(|turn| V::product(turn, turn)).into_iter().fold(0.0, f64::max);
        // |V × A|² ≤ most, and |V| ≥ least / |along|.
        let (least, along) = (least * least, along.dot(along));
        p.min(q).min(r) > 0.0
            && most * (along * along * along) * (1.0 + BOUND_ROUNDING) <= known * known * (least * least * least)
    }

    /// Coefficients of V × A.
    #[inline(always)]
    fn turns(&self) -> [V::Turn; 4] {
        let ([a, b, c], [d, e]) = (self.velocity, self.acceleration);
        [a.cross(d), a.cross(e) + b.cross(d), b.cross(e) + c.cross(d), c.cross(e)]
    }

    /// Whether V × A is nothing but rounding.
    fn is_straight(&self) -> bool {
        let most = |vectors: &[V]| vectors.iter().map(|v| v.dot(*v)).fold(0.0, f64::max);
        let turns = self.turns().map(|turn| V::product(turn, turn)).into_iter().fold(0.0, f64::max);
        turns <= STRAIGHT * STRAIGHT * most(&self.velocity) * most(&self.acceleration)
    }

    #[inline(never)]
    fn largest_curvature(&self, known: f64) -> f64 {
        if self.is_straight() {
            return known;
        }
        let [a, b, c] = self.velocity;
        let along = a + b * 0.5 + c / 3.0;
        let least = self.controls().map(|control| control.dot(along)).into_iter().fold(f64::INFINITY, f64::min);
        if least > SLOW * along.dot(along).sqrt() * self.size() {
            return self.largest_from_an_end(known);
        }
        // q′
        let [p, q, r] = [a.dot(b), b.dot(b) + 2.0 * a.dot(c), 3.0 * b.dot(c)];
        let slope = bernstein([p, q, r, 2.0 * c.dot(c)]);
        let mut cuts = vec![0.0];
        sign_changes(&slope, true, (0.0, 1.0), MOST_HALVINGS, &mut |v| cuts.push(v));
        cuts.push(1.0);
        cuts.windows(2).fold(known, |known, pair| {
            let forward = self.speed(pair[0]) <= self.speed(pair[1]);
            let part = if forward { self.part(pair[0], pair[1]) } else { self.part(pair[1], pair[0]) };
            part.largest_from_an_end(known)
        })
    }

    /// The part of the piece from one fraction to another, as a piece with its own fraction.
    fn part(&self, from: f64, to: f64) -> Self {
        let ([_, b, c], [d, e], width) = (self.velocity, self.acceleration, to - from);
        let velocity = [self.velocity_at(from), (b + c * (2.0 * from)) * width, c * (width * width)];
        Moving {
            velocity: velocity.map(|v| v * width),
            acceleration: [d + e * from, e * width].map(|a| a * (width * width)),
        }
    }

    fn largest_from_an_end(&self, known: f64) -> f64 {
        let ([a, b, c], turns) = (self.velocity, self.turns());
        let mut squares = [0.0; 7];
        for (i, turn) in turns.iter().enumerate() {
            for (j, other) in turns.iter().enumerate() {
                squares[i + j] += V::product(*turn, *other);
            }
        }
        let speeds = [a.dot(a), 2.0 * a.dot(b), b.dot(b) + 2.0 * a.dot(c), 2.0 * b.dot(c), c.dot(c)];
        // A cusp: V vanishes, and the piece turns.
        if speeds[0] == 0.0 {
            return f64::INFINITY;
        }
        let mut condition = [0.0; STATIONARY];
        for (i, square) in squares.iter().enumerate() {
            for (j, speed) in speeds.iter().enumerate() {
                if i + j > 0 {
                    condition[i + j - 1] += (i as f64 - 3.0 * j as f64) * square * speed;
                }
            }
        }
        let mut largest = known.max(self.curvature(0.0)).max(self.curvature(1.0));
        let largest_at = &mut |v| largest = largest.max(self.curvature(v));
        sign_changes(&bernstein(condition), false, (0.0, 1.0), MOST_HALVINGS, largest_at);
        largest
    }
}

/// Control points of a cubic from its coefficients.
#[inline(always)]
fn cubic_controls<T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>>(
    [a, b, c, d]: [T; 4],
) -> [T; 4] {
    const THIRD: f64 = 1.0 / 3.0;
    [a, a + b * THIRD, a + (b + b + c) * THIRD, a + b + c + d]
}
