//! Bending: Σ |K|^ν Δa, the elastica for ν = 2.

use std::collections::BTreeMap;

use super::wgsl::{literal, power};
use super::{Energy, Facts, Partials, SecondPartials, Term, Window};
use crate::linalg::Real;
use crate::linalg::Scalar;
use crate::linalg::scalar::{dot, scale, subtract};
use crate::sort;

/// The bending energy ∫|κ|^ν ds as Σ |K|^ν Δa, in units of length^(1−ν).
///
/// At a vertex between two edges, K = (T′ − T)/Δa and Δa = (Δs + Δs′)/2. Its order is 2. The
/// `exponent` is ν ≥ 1. Below 2 the energy has no second derivative where the curve is straight.
///
/// Alone it has a minimiser only if the points lie in order on a line: otherwise ever larger loops
/// cost less and less. Add [`length`](super::length).
pub fn bending(exponent: f64) -> Energy {
    Bending { exponent }.into()
}

/// |T′ − T|^ν Δa^(1−ν)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bending {
    pub exponent: f64,
}

impl Default for Bending {
    fn default() -> Self {
        Bending { exponent: 2.0 }
    }
}

impl Facts for Bending {
    fn degree(&self) -> f64 {
        1.0 - self.exponent
    }

    fn stiffness(&self, _: f64) -> f64 {
        (self.exponent * (self.exponent - 1.0)).max(1.0)
    }

    fn stiffening(&self) -> f64 {
        self.exponent - 2.0
    }

    fn check(&self) -> Result<(), String> {
        match self.exponent {
            nu if nu >= 1.0 && nu.is_finite() => Ok(()),
            nu => Err(format!("the exponent of bending is {nu}: give a finite number of at least 1")),
        }
    }

    /// Powers of q = |T′ − T|², of c = max(q, ε²) and of a = Δa, in WGSL.
    fn definitions(&self, epsilon: f64, _: usize) -> BTreeMap<&'static str, String> {
        let nu = self.exponent;
        let mut own = sort::map([
            ("ROUNDING", literal(epsilon * epsilon)),
            ("EXPONENT", literal(nu)),
            ("BY_LENGTH", literal(0.5 * (1.0 - nu))),
            ("BY_LENGTHS", literal(0.25 * nu * (nu - 1.0))),
        ]);
        if nu != 2.0 {
            own.insert("ALONG", literal(nu * (nu - 2.0)));
        }
        let names = [("POWER_0", "MEASURE_0"), ("POWER_1", "MEASURE_1"), ("POWER_2", "MEASURE_2")];
        for (lower, (of_q, of_a)) in (0..).map(f64::from).zip(names) {
            let exponent = 0.5 * nu - lower;
            own.insert(of_q, power(if exponent == 1.0 { "q" } else { "c" }, exponent));
            own.insert(of_a, power("a", 1.0 - nu - lower));
        }
        if own.values().any(|text| text.contains("power(")) {
            own.insert("POWER", "1".into());
        }
        own
    }

    fn note(&self) -> String {
        if self.exponent == 2.0 { String::new() } else { format!(" (ν = {})", self.exponent) }
    }
}

impl Bending {
    /// q^(ν/2 − lower) for q = |T′ − T|².
    ///
    /// For exponents other than 0 and 1, q is at least ε², the rounding of tangents.
    #[inline(always)]
    pub(super) fn power<S: Scalar>(&self, q: S, lower: f64) -> S {
        let exponent = 0.5 * self.exponent - lower;
        if exponent == 0.0 {
            S::ONE
        } else if exponent == 1.0 {
            q
        } else {
            let rounding = <S::Number as Real>::EPSILON.to_f64();
            // With the operands in this order, NaN propagates.
            S::of(rounding * rounding).max(q).powf(exponent)
        }
    }

    /// a^(1 − ν − lower)
    #[inline(always)]
    pub(super) fn measure<S: Scalar>(&self, a: S, lower: f64) -> S {
        match 1.0 - self.exponent - lower {
            -1.0 => S::ONE / a,
            -2.0 => S::ONE / (a * a),
            -3.0 => S::ONE / (a * a * a),
            exponent => a.powf(exponent),
        }
    }
}

impl Term<2> for Bending {
    const AT_ENDS: bool = true;

    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> S {
        let d = subtract(window.tangent[1], window.tangent[0]);
        let a = S::of(0.5) * (window.length[0] + window.length[1]);
        self.power(dot(d, d), 0.0) * self.measure(a, 0.0)
    }

    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> Partials<S, D, 2> {
        let nu = self.exponent;
        let d = subtract(window.tangent[1], window.tangent[0]);
        let q = dot(d, d);
        let a = S::of(0.5) * (window.length[0] + window.length[1]);
        let measure = self.measure(a, 0.0);
        let slope = self.power(q, 1.0) * measure;
        let value = self.power(q, 0.0) * measure;
        let by_tangent = scale(S::of(nu) * slope, d);
        let by_length = S::of(0.5 * (1.0 - nu)) * value / a;
        Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] }
    }

    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, 2>) -> SecondPartials<S, D, 2> {
        let nu = self.exponent;
        let d = subtract(window.tangent[1], window.tangent[0]);
        let q = dot(d, d);
        let a = S::of(0.5) * (window.length[0] + window.length[1]);
        let along =
            if nu == 2.0 { S::ZERO } else { S::of(nu * (nu - 2.0)) * self.power(q, 2.0) * self.measure(a, 0.0) };
        let slope = S::of(nu) * self.power(q, 1.0);
        let across = slope * self.measure(a, 0.0);
        let mixed = scale(S::of(0.5 * (1.0 - nu)) * slope * self.measure(a, 1.0), d);
        let by_lengths = S::of(0.25 * nu * (nu - 1.0)) * self.power(q, 0.0) * self.measure(a, 2.0);
        let mut second = SecondPartials::ZERO;
        for j in 0..2 {
            for k in 0..2 {
                let sign = if j == k { S::ONE } else { -S::ONE };
                for c in 0..D {
                    second.tangents[j][k][c] = scale(sign * along * d[c], d);
                    second.tangents[j][k][c][c] += sign * across;
                }
                second.mixed[j][k] = if j == 0 { scale(-S::ONE, mixed) } else { mixed };
                second.lengths[j][k] = by_lengths;
            }
        }
        second
    }
}
