//! Geodesic bending: Σ |K_g|^ν Δa, with the curvature within a surface.

use std::collections::BTreeMap;

use super::bending::Bending;
use super::in_surface::{First, InSurface, Parts, Second};
use super::penalty::Penalty;
use super::{Energy, Facts, Functional};
use crate::linalg::Scalar;

/// The geodesic bending energy ∫|κ_g|^ν ds as Σ |K_g|^ν Δa, in units of length^(1−ν), for curves in
/// a [surface](crate::discrete::Fair::surface).
///
/// At a vertex between two edges, K_g = (I − n nᵀ)(T′ − T)/Δa with the unit normal n there and
/// Δa = (Δs + Δs′)/2. Its order is 2. The `exponent` is ν ≥ 1. The energy vanishes on geodesics,
/// exactly so on a great circle with equal edges.
///
/// Source: R. J. Renka, *A Sobolev gradient method for construction of elastic curves in regular
/// surfaces*, Nonlinear Analysis 63 (2005), for elastic curves in surfaces. This discrete form and
/// its derivatives are faircurve's.
pub fn geodesic_bending(exponent: f64) -> Energy {
    Energy::of(Functional::GeodesicBending(GeodesicBending { bending: Bending { exponent } }))
}

/// |T′ − T − n (n·(T′ − T))|^ν Δa^(1−ν)
///
/// It also depends on the position of the vertex, so it has no [`Term`](super::Term).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GeodesicBending {
    /// Bending with the same exponent, whose powers apply here too.
    pub bending: Bending,
}

impl Facts for GeodesicBending {
    fn degree(&self) -> f64 {
        self.bending.degree()
    }

    fn stiffness(&self, length: f64) -> f64 {
        self.bending.stiffness(length)
    }

    fn stiffening(&self) -> f64 {
        self.bending.stiffening()
    }

    fn check(&self) -> Result<(), String> {
        self.bending.check().map_err(|why| why.replace("of bending", "of geodesic bending"))
    }

    fn definitions(&self, epsilon: f64, dimension: usize) -> BTreeMap<&'static str, String> {
        self.bending.definitions(epsilon, dimension)
    }

    fn note(&self) -> String {
        self.bending.note()
    }
}

impl InSurface for GeodesicBending {
    #[inline(always)]
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, _: &Penalty<S>) -> S {
        self.bending.power(parts.square, 0.0) * self.bending.measure(parts.measure, 0.0)
    }

    #[inline(always)]
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, _: &Penalty<S>) -> First<S> {
        let nu = self.bending.exponent;
        let measure = self.bending.measure(parts.measure, 0.0);
        let value = self.bending.power(parts.square, 0.0) * measure;
        let across = S::of(nu) * self.bending.power(parts.square, 1.0) * measure;
        First { value, across, by_length: S::of(0.5 * (1.0 - nu)) * value / parts.measure }
    }

    #[inline(always)]
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, _: &Penalty<S>) -> Second<S> {
        let nu = self.bending.exponent;
        let Parts { square, measure: a } = *parts;
        let (power, measure) = (self.bending.power(square, 1.0), self.bending.measure(a, 0.0));
        let across = S::of(nu) * power * measure;
        let along =
            if nu == 2.0 { S::ZERO } else { S::of(nu * (nu - 2.0)) * self.bending.power(square, 2.0) * measure };
        let mixed = S::of(0.5 * (1.0 - nu) * nu) * power * self.bending.measure(a, 1.0);
        let by_lengths = S::of(0.25 * nu * (nu - 1.0)) * self.bending.power(square, 0.0) * self.bending.measure(a, 2.0);
        Second { across, along, mixed, by_lengths }
    }
}
