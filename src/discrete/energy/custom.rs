//! Custom energies of a user.

// Loops over coordinates by index match the formulas.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Facts, MOST_EDGES, Partials, SecondPartials, Term, Visitor, Window};
use crate::linalg::scalar::number;
use crate::linalg::{Real, Scalar};
use crate::sort;

/// A custom energy: Σ term(tangents, lengths) over every run of [`edges`](Self::edges) consecutive
/// edges of a curve.
///
/// The term is a function of unit tangents T and lengths Δs, taken as independent variables. The
/// chain rule to the vertices is faircurve's. 2-D curves have z = 0 everywhere.
///
/// A GPU needs the same three functions in WGSL, see [`wgsl`](Self::wgsl). Without them the CPU
/// fits the curves.
pub trait Custom: Send + Sync + std::fmt::Debug {
    /// The name, of letters, digits and underscores.
    fn name(&self) -> &str;

    /// The number of edges that a term sees, from 1 to [`MOST_EDGES`].
    ///
    /// It is also the number of derivatives that the term holds.
    fn edges(&self) -> usize;

    /// The degree of E(c·f) = c^degree E(f).
    ///
    /// Bending ∫κ² ds has −1.
    fn degree(&self) -> f64;

    /// The term.
    ///
    /// Tangents and lengths have [`edges`](Self::edges) entries.
    fn value(&self, tangents: &[DVec3], lengths: &[f64]) -> f64;

    /// The partial derivatives of the term.
    ///
    /// They are written, not added.
    fn gradient(&self, tangents: &[DVec3], lengths: &[f64], by_tangent: &mut [DVec3], by_length: &mut [f64]);

    /// The second partial derivatives, written into arrays that hold 0.
    ///
    /// They are by two tangents, by tangent and length, and by two lengths. The row of a matrix is
    /// the component of the first tangent. Both entries of a symmetric pair must be written.
    fn hessian(
        &self,
        tangents: &[DVec3],
        lengths: &[f64],
        by_tangents: &mut [[DMat3; MOST_EDGES]; MOST_EDGES],
        mixed: &mut [[DVec3; MOST_EDGES]; MOST_EDGES],
        by_lengths: &mut [[f64; MOST_EDGES]; MOST_EDGES],
    );

    /// The three functions in WGSL, if the energy is to run on a GPU.
    ///
    /// They use the alias `real` and the vector `vector` of 2 or 3 components. Their names are
    /// `NAME_value`, `NAME_gradient` and `NAME_hessian`, as in the files of
    /// `shaders/discrete/energy`. Everything else that the text defines needs a name of its own.
    /// Energies with the same name and text count as one.
    fn wgsl(&self) -> Option<String> {
        None
    }
}

impl Facts for Arc<dyn Custom> {
    fn degree(&self) -> f64 {
        self.as_ref().degree()
    }

    fn stiffness(&self, _: f64) -> f64 {
        if self.edges() == 1 { 1.0 } else { 2.0 }
    }

    fn definitions(&self, _: f64) -> Result<BTreeMap<&'static str, String>, String> {
        let text = self.wgsl().ok_or_else(|| format!("the energy {} has no WGSL: fit on the CPU", self.name()))?;
        Ok(sort::map([("WGSL", text)]))
    }

    fn check(&self) -> Result<(), String> {
        match self.edges() {
            1..=MOST_EDGES => Ok(()),
            edges => {
                let name = self.name();
                Err(format!("a term of the energy {name} is of {edges} edges; 1 to {MOST_EDGES} are possible"))
            }
        }
    }
}

/// Shows a user's term to a visitor.
#[inline(never)]
pub(super) fn visit<V: Visitor>(custom: &dyn Custom, visitor: V) -> V::Output {
    // Sizes beyond the most edges are left out at compile time.
    match custom.edges() {
        1 => visitor.visit(&Adapter::<1>(custom)),
        2 => visitor.visit(&Adapter::<2>(custom)),
        4 if MOST_EDGES >= 4 => visitor.visit(&Adapter::<4>(custom)),
        5 if MOST_EDGES >= 5 => visitor.visit(&Adapter::<5>(custom)),
        _ => visitor.visit(&Adapter::<3>(custom)),
    }
}

/// A custom energy as a [`Term`], computed lane by lane in f64.
struct Adapter<'a, const W: usize>(&'a dyn Custom);

impl<const W: usize> Adapter<'_, W> {
    fn arguments<S: Scalar, const D: usize>(window: &Window<S, D, W>, lane: usize) -> ([DVec3; W], [f64; W]) {
        let component = |k: usize, c: usize| window.tangent[k].get(c).map_or(0.0, |x| x.lane(lane).to_f64());
        (
            std::array::from_fn(|k| DVec3::new(component(k, 0), component(k, 1), component(k, 2))),
            std::array::from_fn(|k| window.length[k].lane(lane).to_f64()),
        )
    }
}

impl<const W: usize> Term<W> for Adapter<'_, W> {
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S {
        let mut value = S::ZERO;
        for lane in 0..S::LANES {
            let (tangents, lengths) = Self::arguments(window, lane);
            value.set_lane(lane, number::<S>(self.0.value(&tangents, &lengths)));
        }
        value
    }

    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W> {
        let mut partials = Partials { value: S::ZERO, tangent: [[S::ZERO; D]; W], length: [S::ZERO; W] };
        for lane in 0..S::LANES {
            let (tangents, lengths) = Self::arguments(window, lane);
            let (mut by_tangent, mut by_length) = ([DVec3::ZERO; W], [0.0; W]);
            self.0.gradient(&tangents, &lengths, &mut by_tangent, &mut by_length);
            partials.value.set_lane(lane, number::<S>(self.0.value(&tangents, &lengths)));
            for k in 0..W {
                partials.length[k].set_lane(lane, number::<S>(by_length[k]));
                for c in 0..D {
                    partials.tangent[k][c].set_lane(lane, number::<S>(by_tangent[k][c]));
                }
            }
        }
        partials
    }

    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W> {
        let mut second = SecondPartials::<S, D, W>::ZERO;
        for lane in 0..S::LANES {
            let (tangents, lengths) = Self::arguments(window, lane);
            let mut by_tangents = [[DMat3::ZERO; MOST_EDGES]; MOST_EDGES];
            let mut mixed = [[DVec3::ZERO; MOST_EDGES]; MOST_EDGES];
            let mut by_lengths = [[0.0; MOST_EDGES]; MOST_EDGES];
            self.0.hessian(&tangents, &lengths, &mut by_tangents, &mut mixed, &mut by_lengths);
            for j in 0..W {
                for k in 0..W {
                    second.lengths[j][k].set_lane(lane, number::<S>(by_lengths[j][k]));
                    for a in 0..D {
                        second.mixed[j][k][a].set_lane(lane, number::<S>(mixed[j][k][a]));
                        for b in 0..D {
                            second.tangents[j][k][a][b].set_lane(lane, number::<S>(by_tangents[j][k].col(b)[a]));
                        }
                    }
                }
            }
        }
        second
    }
}
