//! Geodesic bending: Σ |K_g|^ν Δa, of the curvature within a surface.

// Loops over coordinates by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;

use super::bending::Bending;
use super::fence::Fence;
use super::{Energy, Facts, Functional, Partials, SecondPartials};
use crate::discrete::block::{Block, outer};
use crate::linalg::scalar::{Vector, dot, scale, subtract};
use crate::linalg::{Real, Scalar};

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
    /// The fence of the geodesic curvature at the vertex.
    pub fence: Fence<S>,
}

impl<S: Scalar, const D: usize> Turn<S, D> {
    /// m, the part of T′ − T in the tangent plane.
    #[inline(always)]
    pub fn bend(&self) -> Vector<S, D> {
        Parts::of(self).bend
    }
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
pub(crate) struct Parts<S, const D: usize> {
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

impl<S: Scalar, const D: usize> Parts<S, D> {
    #[inline(always)]
    fn of(turn: &Turn<S, D>) -> Self {
        let d = subtract(turn.tangent[1], turn.tangent[0]);
        let along_normal = dot(turn.normal, d);
        let bend = subtract(d, scale(along_normal, turn.normal));
        let measure = S::of(0.5) * (turn.length[0] + turn.length[1]);
        Parts { along_normal, bend, square: dot(bend, bend), measure, slope: times(&turn.shape, bend) }
    }
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

/// A function f(|m|², Δa) of the bend in a surface, with its derivatives: f of what is at hand, and those by s = |m|² and by the
/// lengths.
pub(crate) struct First<S> {
    value: S,
    /// 2 ∂f/∂s
    across: S,
    /// ½ ∂f/∂Δa
    by_length: S,
}

/// Second derivatives of such a function.
pub(crate) struct Second<S> {
    /// 2 ∂f/∂s
    across: S,
    /// 4 ∂²f/∂s²
    along: S,
    /// ∂²f/∂s∂Δa
    mixed: S,
    /// ¼ ∂²f/∂Δa²
    by_lengths: S,
}

/// An energy of the bend at a vertex in a surface.
pub(crate) trait InSurface {
    /// f
    fn value_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> S;
    /// f and its first derivatives.
    fn first_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> First<S>;
    /// Its second derivatives.
    fn second_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> Second<S>;

    /// The value, and the derivatives by tangents and lengths and by the place of the vertex.
    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> (Partials<S, D, 2>, Vector<S, D>) {
        let parts = Parts::of(turn);
        let First { value, across, by_length } = self.first_of(&parts, &turn.fence);
        let by_tangent = scale(across, parts.bend);
        let partials =
            Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] };
        (partials, scale(-across * parts.along_normal, parts.slope))
    }

    /// The second derivatives by tangents and lengths, and those that involve the place.
    ///
    /// `third` is the derivative of ∇²F along m over |∇F|, see [`bend`](Turn::bend).
    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(
        &self,
        turn: &Turn<S, D>,
        third: &Block<S, D>,
    ) -> (SecondPartials<S, D, 2>, ByPlace<S, D>) {
        let parts = Parts::of(turn);
        let Second { across, along, mixed, by_lengths } = self.second_of(&parts, &turn.fence);
        let Parts { along_normal: q, bend: m, slope: k, .. } = parts;
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

    /// The value alone.
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> S {
        self.value_of(&Parts::of(turn), &turn.fence)
    }
}

impl InSurface for GeodesicBending {
    #[inline(always)]
    fn value_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, _: &Fence<S>) -> S {
        self.bending.power(parts.square, 0.0) * self.bending.measure(parts.measure, 0.0)
    }

    #[inline(always)]
    fn first_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, _: &Fence<S>) -> First<S> {
        let nu = self.bending.exponent;
        let measure = self.bending.measure(parts.measure, 0.0);
        let value = self.bending.power(parts.square, 0.0) * measure;
        let across = S::of(nu) * self.bending.power(parts.square, 1.0) * measure;
        First { value, across, by_length: S::of(0.5 * (1.0 - nu)) * value / parts.measure }
    }

    #[inline(always)]
    fn second_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, _: &Fence<S>) -> Second<S> {
        let nu = self.bending.exponent;
        let Parts { square, measure: a, .. } = *parts;
        let (power, measure) = (self.bending.power(square, 1.0), self.bending.measure(a, 0.0));
        let across = S::of(nu) * power * measure;
        let along =
            if nu == 2.0 { S::ZERO } else { S::of(nu * (nu - 2.0)) * self.bending.power(square, 2.0) * measure };
        let mixed = S::of(0.5 * (1.0 - nu) * nu) * power * self.bending.measure(a, 1.0);
        let by_lengths = S::of(0.25 * nu * (nu - 1.0)) * self.bending.power(square, 0.0) * self.bending.measure(a, 2.0);
        Second { across, along, mixed, by_lengths }
    }
}

/// The [fence](super::fence) of the geodesic curvature |m|/Δa, as [`Curb`](super::curb::Curb) is that of |K|.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GeodesicCurb;

impl Facts for GeodesicCurb {
    fn degree(&self) -> f64 {
        0.0
    }
}

impl GeodesicCurb {
    /// |m|, at least the rounding of tangents, so that it can divide; and |m|/Δa.
    #[inline(always)]
    fn curvature<S: Scalar, const D: usize>(parts: &Parts<S, D>) -> (S, S) {
        let rounding = S::of(<S::Number as Real>::EPSILON.to_f64());
        // The order of the operands keeps NaN.
        let turn = rounding.max(parts.square.sqrt());
        (turn, turn / parts.measure)
    }
}

impl InSurface for GeodesicCurb {
    #[inline(always)]
    fn value_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> S {
        fence.value(Self::curvature(parts).1)
    }

    #[inline(always)]
    fn first_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> First<S> {
        let (turn, curvature) = Self::curvature(parts);
        let by_curvature = fence.stiffness * fence.beyond(curvature) * fence.slope;
        First {
            value: fence.value(curvature),
            across: by_curvature / (turn * parts.measure),
            by_length: S::of(-0.5) * by_curvature * curvature / parts.measure,
        }
    }

    #[inline(always)]
    fn second_of<S: Scalar, const D: usize>(&self, parts: &Parts<S, D>, fence: &Fence<S>) -> Second<S> {
        let (turn, curvature) = Self::curvature(parts);
        let beyond = fence.beyond(curvature);
        let by_curvature = fence.stiffness * beyond * fence.slope;
        let twice = beyond.if_positive(fence.stiffness * fence.slope * fence.slope, S::ZERO);
        let inverse = S::ONE / parts.measure;
        // q = √s/a: 2 q_s = 1/(|m| a), 4 q_ss = −1/(|m|³ a), q_a = −q/a, q_sa = −q_s/a, q_aa = 2 q/a².
        let across = inverse / turn;
        let by_measure = -curvature * inverse;
        Second {
            across: by_curvature * across,
            along: twice * across * across - by_curvature * across / (turn * turn),
            mixed: S::of(0.5) * across * (twice * by_measure - by_curvature * inverse),
            by_lengths: S::of(0.25) * (twice * by_measure * by_measure)
                + S::of(0.5) * by_curvature * curvature * inverse * inverse,
        }
    }
}
