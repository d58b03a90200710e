//! Geodesic bending: Σ |K_g|^ν Δa, of the curvature within a surface.

// Loops over coordinates by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;

use super::bending::Bending;
use super::{Energy, Facts, Functional, Partials, SecondPartials};
use crate::discrete::block::{Block, outer};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, scale, subtract};

/// The geodesic bending energy ∫|κ_g|^ν ds as Σ |K_g|^ν Δa, in units of length^(1−ν), for curves in a
/// [surface](crate::discrete::Fair::surface).
///
/// K_g = (I − n nᵀ)(T′ − T)/Δa at every vertex between two edges, with the unit normal n there and Δa = (Δs + Δs′)/2. Its
/// order is 2. The `exponent` is ν ≥ 1. It is 0 on geodesics: on a great circle of equal edges exactly.
///
/// Source: R. J. Renka, *A Sobolev gradient method for construction of elastic curves in regular surfaces*, Nonlinear
/// Analysis 63 (2005), for elastic curves in surfaces. This form and its derivatives are faircurve's.
pub fn geodesic_bending(exponent: f64) -> Energy {
    Energy::of(Functional::GeodesicBending(GeodesicBending { bending: Bending { exponent } }))
}

/// |T′ − T − n (n·(T′ − T))|^ν Δa^(1−ν)
///
/// It depends on the place of a vertex besides tangents and lengths, and so has no [`Term`](super::Term).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GeodesicBending {
    /// The same in terms of the full curvature.
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

    fn definitions(&self, epsilon: f64) -> Result<BTreeMap<&'static str, String>, String> {
        self.bending.definitions(epsilon)
    }

    fn note(&self) -> String {
        self.bending.note()
    }
}

/// A vertex between two edges in a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<S, const D: usize> {
    /// T and T′.
    pub tangent: [Vector<S, D>; 2],
    /// Δs and Δs′.
    pub length: [S; 2],
    /// n at the vertex.
    pub normal: Vector<S, D>,
    /// W = ∇²F/|∇F| at the vertex.
    pub shape: Block<S, D>,
}

/// Second partial derivatives that involve the place of the vertex.
pub(crate) struct ByPlace<S, const D: usize> {
    /// By a component of each tangent and one of the place.
    pub tangents: [Block<S, D>; 2],
    /// By each length and the place.
    pub lengths: Vector<S, D>,
    /// By the place twice.
    pub place: Block<S, D>,
}

/// What the derivatives have in common.
struct Parts<S, const D: usize> {
    /// q = n·(T′ − T)
    along_normal: S,
    /// m = T′ − T − q n
    bend: Vector<S, D>,
    /// |m|²
    square: S,
    /// Δa
    measure: S,
    /// ∇q by the place: W m.
    slope: Vector<S, D>,
}

/// M x
#[inline(always)]
pub(crate) fn times<S: Scalar, const D: usize>(matrix: &Block<S, D>, x: Vector<S, D>) -> Vector<S, D> {
    let mut product = x;
    for a in 0..D {
        product[a] = dot(matrix[a], x);
    }
    product
}

impl GeodesicBending {
    #[inline(always)]
    fn parts<S: Scalar, const D: usize>(turn: &Turn<S, D>) -> Parts<S, D> {
        let d = subtract(turn.tangent[1], turn.tangent[0]);
        let along_normal = dot(turn.normal, d);
        let bend = subtract(d, scale(along_normal, turn.normal));
        let measure = S::of(0.5) * (turn.length[0] + turn.length[1]);
        Parts { along_normal, bend, square: dot(bend, bend), measure, slope: times(&turn.shape, bend) }
    }

    /// The value, and the derivatives by tangents and lengths and by the place of the vertex.
    #[inline(always)]
    pub fn gradient<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> (Partials<S, D, 2>, Vector<S, D>) {
        let (nu, parts) = (self.bending.exponent, Self::parts(turn));
        let measure = self.bending.measure(parts.measure, 0.0);
        let value = self.bending.power(parts.square, 0.0) * measure;
        let slope = S::of(nu) * self.bending.power(parts.square, 1.0) * measure;
        let by_tangent = scale(slope, parts.bend);
        let by_length = S::of(0.5 * (1.0 - nu)) * value / parts.measure;
        let partials =
            Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] };
        (partials, scale(-slope * parts.along_normal, parts.slope))
    }

    /// The second derivatives by tangents and lengths, and those that involve the place.
    ///
    /// `third` is the derivative of ∇²F along m over |∇F|, see [`bend`](Self::bend).
    #[inline(always)]
    pub fn hessian<S: Scalar, const D: usize>(
        &self,
        turn: &Turn<S, D>,
        third: &Block<S, D>,
    ) -> (SecondPartials<S, D, 2>, ByPlace<S, D>) {
        let (nu, parts) = (self.bending.exponent, Self::parts(turn));
        let Parts { along_normal: q, bend: m, square, measure: a, slope: k } = parts;
        let (power, measure) = (self.bending.power(square, 1.0), self.bending.measure(a, 0.0));
        let across = S::of(nu) * power * measure;
        let along =
            if nu == 2.0 { S::ZERO } else { S::of(nu * (nu - 2.0)) * self.bending.power(square, 2.0) * measure };
        let mixed = S::of(0.5 * (1.0 - nu) * nu) * power * self.bending.measure(a, 1.0);
        let by_lengths = S::of(0.25 * nu * (nu - 1.0)) * self.bending.power(square, 0.0) * self.bending.measure(a, 2.0);
        let (n, shape) = (turn.normal, &turn.shape);
        // W n, and P W for P = I − n nᵀ.
        let w = times(shape, n);
        let mut tangential = outer(-S::ONE, n, w);
        for a in 0..D {
            for b in 0..D {
                tangential[a][b] += shape[a][b];
            }
        }
        let mut second = SecondPartials::ZERO;
        let mut by = ByPlace { tangents: [[[S::ZERO; D]; D]; 2], lengths: [S::ZERO; D], place: [[S::ZERO; D]; D] };
        for a in 0..D {
            let squared = times(shape, shape[a]);
            for b in 0..D {
                let unit = if a == b { S::ONE } else { S::ZERO };
                let bent = along * m[a] * m[b] + across * (unit - n[a] * n[b]);
                second.tangents[0][0][a][b] = bent;
                second.tangents[1][1][a][b] = bent;
                second.tangents[0][1][a][b] = -bent;
                second.tangents[1][0][a][b] = -bent;
                // ∂m/∂x = −(n ∇qᵀ + q P W)
                let moved = along * m[a] * q * k[b] + across * (n[a] * k[b] + q * tangential[a][b]);
                by.tangents[0][a][b] = moved;
                by.tangents[1][a][b] = -moved;
                // ∇²q = −(∇q wᵀ + w ∇qᵀ) + ∇³F[m]/|∇F| − q (W² − w wᵀ)
                let curved = third[a][b] - k[a] * w[b] - w[a] * k[b] - q * (squared[b] - w[a] * w[b]);
                by.place[a][b] = along * q * q * k[a] * k[b] - across * (k[a] * k[b] + q * curved);
            }
            second.mixed[1][0][a] = mixed * m[a];
            second.mixed[1][1][a] = mixed * m[a];
            second.mixed[0][0][a] = -mixed * m[a];
            second.mixed[0][1][a] = -mixed * m[a];
            by.lengths[a] = -mixed * q * k[a];
        }
        second.lengths = [[by_lengths; 2]; 2];
        (second, by)
    }

    /// m, the part of T′ − T in the tangent plane.
    #[inline(always)]
    pub fn bend<S: Scalar, const D: usize>(turn: &Turn<S, D>) -> Vector<S, D> {
        Self::parts(turn).bend
    }

    /// The value alone.
    #[inline(always)]
    pub fn value<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> S {
        let parts = Self::parts(turn);
        self.bending.power(parts.square, 0.0) * self.bending.measure(parts.measure, 0.0)
    }
}
