//! [`InSurface`]: energies f(|m|², Δa) of the bend m = Δa K_g of a curve within a surface.

use super::Partials;
use super::penalty::Penalty;
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, dot, scale, subtract};

/// A vertex between two edges in a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<S, const D: usize> {
    /// T and T′.
    pub tangent: [Vector<S, D>; 2],
    /// Δa
    pub measure: S,
    /// n at the vertex.
    pub normal: Vector<S, D>,
    /// The penalty of the geodesic curvature at the vertex.
    pub penalty: Penalty<S>,
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

/// A function f(s, Δa) of s = |m|², and its first derivatives.
pub(crate) struct First<S> {
    pub value: S,
    /// 2 ∂f/∂s
    pub across: S,
    /// ½ ∂f/∂Δa
    pub by_length: S,
}

/// The second derivatives of f, and 2 ∂f/∂s.
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

/// The arguments of f: s = |m|², where m is the part of T′ − T in the tangent plane, and Δa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts<S> {
    pub square: S,
    pub measure: S,
}

/// An energy of the bend at a vertex in a surface.
pub(crate) trait InSurface {
    /// f
    fn value_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> S;
    /// f and its first derivatives.
    fn first_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> First<S>;
    /// Its second derivatives.
    fn second_of<S: Scalar>(&self, parts: &Parts<S>, penalty: &Penalty<S>) -> Second<S>;

    /// The value, its derivatives with respect to tangents and lengths, and x: the derivative with
    /// respect to the position of the vertex is x W m, with W = ∇²F/|∇F|.
    #[inline(always)]
    fn gradient<S: Scalar, const D: usize>(
        &self,
        turn: &Turn<S, D>,
        bend: Vector<S, D>,
        q: S,
    ) -> (Partials<S, D, 2>, S) {
        let parts = Parts { square: dot(bend, bend), measure: turn.measure };
        let First { value, across, by_length } = self.first_of(&parts, &turn.penalty);
        let by_tangent = scale(across, bend);
        let partials =
            Partials { value, tangent: [scale(-S::ONE, by_tangent), by_tangent], length: [by_length, by_length] };
        (partials, -across * q)
    }

    /// The value alone.
    #[inline(always)]
    fn value<S: Scalar, const D: usize>(&self, turn: &Turn<S, D>) -> S {
        let (bend, _) = turn.bend();
        self.value_of(&Parts { square: dot(bend, bend), measure: turn.measure }, &turn.penalty)
    }
}
