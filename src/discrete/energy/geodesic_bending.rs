//! Geodesic bending: Σ |K_g|^ν Δa, of the curvature within a surface.

// Loops over coordinates by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;

use super::bending::Bending;
use super::fence::Fence;
use super::{Energy, Facts, Functional, Partials};
use crate::discrete::block::Block;
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
    /// Δa
    pub measure: S,
    /// n at the vertex.
    pub normal: Vector<S, D>,
    /// The fence of the geodesic curvature at the vertex.
    pub fence: Fence<S>,
}

impl<S: Scalar, const D: usize> Turn<S, D> {
    /// m = T′ − T − q n and q = n·(T′ − T).
    #[inline(always)]
    pub fn bend(&self) -> (Vector<S, D>, S) {
        let d = subtract(self.tangent[1], self.tangent[0]);
        let along_normal = dot(self.normal, d);
        (subtract(d, scale(along_normal, self.normal)), along_normal)
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
    pub value: S,
    /// 2 ∂f/∂s
    pub across: S,
    /// ½ ∂f/∂Δa
    pub by_length: S,
}

/// Second derivatives of such a function.
pub(crate) struct Second<S> {
    /// 2 ∂f/∂s
    pub across: S,
    /// 4 ∂²f/∂s²
    pub along: S,
    /// ∂²f/∂s∂Δa
    pub mixed: S,
    /// ¼ ∂²f/∂Δa²
    pub by_lengths: S,
}

/// The bend at a vertex: |m|² for m, the part of T′ − T in the tangent plane, and Δa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts<S> {
    pub square: S,
    pub measure: S,
}

/// An energy of the bend at a vertex in a surface.
pub(crate) trait InSurface {
    /// f
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> S;
    /// f and its first derivatives.
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> First<S>;
    /// Its second derivatives.
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> Second<S>;

    /// The value, and the derivatives by tangents and lengths; and x, where that by the place of the vertex is x W m for
    /// W = ∇²F/|∇F|.
    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(
        &self,
        turn: &Turn<S, D>,
        bend: Vector<S, D>,
        q: S,
    ) -> (Partials<S, D, 2>, S) {
        let parts = Parts { square: dot(bend, bend), measure: turn.measure };
        let First { value, across, by_length } = self.first_of(&parts, &turn.fence);
        let by_tangent = scale(across, bend);
        let partials =
            Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] };
        (partials, -across * q)
    }

    /// The value alone.
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> S {
        let (bend, _) = turn.bend();
        self.value_of(&Parts { square: dot(bend, bend), measure: turn.measure }, &turn.fence)
    }
}

impl InSurface for GeodesicBending {
    #[inline(always)]
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, _: &Fence<S>) -> S {
        self.bending.power(parts.square, 0.0) * self.bending.measure(parts.measure, 0.0)
    }

    #[inline(always)]
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, _: &Fence<S>) -> First<S> {
        let nu = self.bending.exponent;
        let measure = self.bending.measure(parts.measure, 0.0);
        let value = self.bending.power(parts.square, 0.0) * measure;
        let across = S::of(nu) * self.bending.power(parts.square, 1.0) * measure;
        First { value, across, by_length: S::of(0.5 * (1.0 - nu)) * value / parts.measure }
    }

    #[inline(always)]
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, _: &Fence<S>) -> Second<S> {
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
    fn curvature<S: Scalar>(parts: &Parts<S>) -> (S, S) {
        let rounding = S::of(<S::Number as Real>::EPSILON.to_f64());
        // The order of the operands keeps NaN.
        let turn = rounding.max(parts.square.sqrt());
        (turn, turn / parts.measure)
    }
}

impl InSurface for GeodesicCurb {
    #[inline(always)]
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> S {
        fence.value(Self::curvature(parts).1)
    }

    #[inline(always)]
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> First<S> {
        let (turn, curvature) = Self::curvature(parts);
        let by_curvature = fence.stiffness * fence.beyond(curvature) * fence.slope;
        First {
            value: fence.value(curvature),
            across: by_curvature / (turn * parts.measure),
            by_length: S::of(-0.5) * by_curvature * curvature / parts.measure,
        }
    }

    #[inline(always)]
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, fence: &Fence<S>) -> Second<S> {
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
