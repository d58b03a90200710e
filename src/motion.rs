//! [`Motion`]: a smooth piece of a curve whose velocity is quadratic, its length and its largest
//! curvature.

mod moving;
mod roots;
mod vector;

use crate::arclength;
use glam::DVec3;

pub(crate) use moving::Moving;
pub(crate) use vector::Vector;

/// Velocity and acceleration along a piece, by its fraction v (0 … 1): V(v) = V₀ + v V₁ + v² V₂ and
/// A(v) = A₀ + v A₁.
///
/// For a cubic A is V′. Other curves may have another A. The curvature is κ = |V × A| / |V|³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// V₀, V₁, V₂
    pub velocity: [DVec3; 3],
    /// A₀, A₁
    pub acceleration: [DVec3; 2],
}

impl Motion {
    /// The motion of the cubic p₀ + v (a + v (b + v c)).
    #[inline(always)]
    pub fn of_cubic(a: DVec3, b: DVec3, c: DVec3) -> Self {
        Motion { velocity: [a, 2.0 * b, 3.0 * c], acceleration: [2.0 * b, 6.0 * c] }
    }

    /// The motion of a cubic Bézier.
    pub fn of_bezier([p, q, r, s]: [DVec3; 4]) -> Self {
        Motion::of_cubic(3.0 * (q - p), 3.0 * (p - 2.0 * q + r), (s - p) - 3.0 * (r - q))
    }

    /// The same piece gone through from its end to its start.
    pub(crate) fn reversed(&self) -> Self {
        // V and A at 1 − v; the velocity turns round.
        let ([v0, v1, v2], [a0, a1]) = (self.velocity, self.acceleration);
        Motion { velocity: [-(v0 + v1 + v2), v1 + 2.0 * v2, -v2], acceleration: [a0 + a1, -a1] }
    }

    /// The same motion with vectors of the plane or of space.
    #[inline(always)]
    pub(crate) fn moving<V: Vector>(&self) -> Moving<V> {
        Moving { velocity: self.velocity.map(V::of), acceleration: self.acceleration.map(V::of) }
    }

    /// |V(v)|
    #[inline(always)]
    pub fn speed(&self, v: f64) -> f64 {
        self.moving::<DVec3>().speed(v)
    }

    /// Arc length, to a relative error of 1e-9.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        self.moving::<DVec3>().length()
    }

    /// The fraction at which the arc length from the start is `target`, of a piece of this length.
    #[inline(always)]
    pub(crate) fn fraction_at(self, length: f64, target: f64) -> f64 {
        arclength::fraction_at(|v| self.speed(v), length, target)
    }

    /// The largest of `known` and of |κ| on the piece.
    ///
    /// The relative error is 1e-9, but for the effect of rounded coefficients near cusps. The
    /// result is infinite at a cusp, where V vanishes and the piece is not straight.
    ///
    /// κ² = N/q³ with N = |V × A|² and q = |V|² is stationary where N′q − 3Nq′ = 0. All roots of
    /// that polynomial are found by the sign changes of its Bernstein coefficients. A piece that
    /// comes near a cusp is expanded from its least speed on, so that the polynomial keeps its
    /// digits.
    #[inline(always)]
    pub fn max_curvature(&self, known: f64) -> f64 {
        self.moving::<DVec3>().max_curvature(known)
    }
}

/// The largest |κ| of a smooth piece of any kind.
///
/// Only the curvature at fractions of the piece is known. The search looks at [`PLACES`] places.
/// Where one is the largest among its neighbours, it follows the curvature to the maximum.
pub(crate) fn searched_curvature(curvature: impl Fn(f64) -> f64) -> f64 {
    /// Places of the search. The curvature of a Bézier of degree 30 has some ten maxima.
    const PLACES: usize = 128;
    /// Steps down to 1e-9 of the distance of two places, where maxima are flat to 1e-16.
    const STEPS: usize = 45;
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let at = |k: usize| k as f64 / PLACES as f64;
    let values: Vec<f64> = (0..=PLACES).map(|k| curvature(at(k))).collect();
    let mut largest = values.iter().copied().fold(0.0, f64::max);
    for k in 0..=PLACES {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(PLACES));
        if !(values[k] >= values[before] && values[k] >= values[after]) {
            continue;
        }
        let (mut low, mut high) = (at(before), at(after));
        for _ in 0..STEPS {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            let (at_a, at_b) = (curvature(a), curvature(b));
            largest = largest.max(at_a).max(at_b);
            if at_a > at_b { high = b } else { low = a }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// The length of a piece by Gauss' rule of two points on many parts, which errs by their fourth
    /// power.
    fn by_parts(motion: &Motion) -> f64 {
        const PARTS: usize = 4096;
        let off = 0.5 / 3f64.sqrt();
        let at = |k: usize, off: f64| motion.speed((k as f64 + 0.5 + off) / PARTS as f64);
        (0..PARTS).map(|k| 0.5 * (at(k, -off) + at(k, off))).sum::<f64>() / PARTS as f64
    }

    #[test]
    fn lengths_of_steady_pieces_are_those_of_a_sum_over_thousands_of_parts() {
        let mut rng = StdRng::seed_from_u64(57);
        let mut largest = 0.0_f64;
        for k in 0..2000 {
            let mut random = |size: f64| DVec3::from_array([0; 3].map(|_| size * rng.random_range(-1.0..1.0)));
            // As unsteady as six speeds are asked to bear, and then more: where the rule changes.
            let size = [0.02, 0.05, 0.08, 0.3][k % 4];
            let (a, b, c) = (DVec3::X + random(0.1), random(size), random(size / 3.0));
            let velocity = if k % 8 < 4 { [a, b, c] } else { [a, 1.5 * b, DVec3::ZERO] };
            let motion = Motion { velocity, acceleration: [DVec3::ZERO; 2] };
            let length = by_parts(&motion);
            largest = largest.max((motion.length() - length).abs() / length);
        }
        println!("largest relative error {largest:.1e}");
        assert!(largest < 2e-11, "{largest:e}");
    }
}
