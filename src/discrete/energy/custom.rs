//! Energies of a user's own.

// Loops over coordinates by number read as the formulas do.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Facts, MOST_EDGES, Partials, SecondPartials, Term, Visitor, Window};
use crate::linalg::scalar::number;
use crate::linalg::{Real, Scalar};

/// An energy Σ term(tangents, lengths) over every run of [`edges`](Self::edges) consecutive edges
/// of a curve.
///
/// The term is a function of unit tangents T and lengths Δs, taken as independent variables; the
/// chain rule to the vertices is faircurve's. 2-D curves have z = 0 everywhere.
///
/// On a GPU the same three functions are needed in WGSL, see [`wgsl`](Self::wgsl); without them
/// curves are fitted by the CPU.
pub trait Custom: Send + Sync + std::fmt::Debug {
    /// A name of letters, digits and underscores.
    fn name(&self) -> &str;

    /// From 1 to [`MOST_EDGES`]: how many edges a term sees, which is also the number of
    /// derivatives it holds.
    fn edges(&self) -> usize;

    /// E(c·f) = c^degree E(f): bending ∫κ² ds has −1.
    fn degree(&self) -> f64;

    /// The term; tangents and lengths have [`edges`](Self::edges) entries.
    fn value(&self, tangents: &[DVec3], lengths: &[f64]) -> f64;

    /// Partial derivatives of the term: written, not added.
    fn gradient(&self, tangents: &[DVec3], lengths: &[f64], by_tangent: &mut [DVec3], by_length: &mut [f64]);

    /// Second partial derivatives, written into arrays that hold 0: by two tangents (row: component
    /// of the first), by tangent and length, by two lengths; both of a symmetric pair are wanted.
    fn hessian(
        &self,
        tangents: &[DVec3],
        lengths: &[f64],
        by_tangents: &mut [[DMat3; MOST_EDGES]; MOST_EDGES],
        mixed: &mut [[DVec3; MOST_EDGES]; MOST_EDGES],
        by_lengths: &mut [[f64; MOST_EDGES]; MOST_EDGES],
    );

    /// The three functions in WGSL, over the alias `real` and the vector `vector` (2 or 3
    /// components), by the names `NAME_value`, `NAME_gradient` and `NAME_hessian`, as the files in
    /// `shaders/discrete/energy` have them. Energies of one name and one text are one; what else it
    /// defines has a name of its own.
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
        Ok(BTreeMap::from([("WGSL", text)]))
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
    // What has more edges than is possible is left out when it is compiled.
    match custom.edges() {
        1 => visitor.visit(&Adapter::<1>(custom)),
        2 => visitor.visit(&Adapter::<2>(custom)),
        4 if MOST_EDGES >= 4 => visitor.visit(&Adapter::<4>(custom)),
        5 if MOST_EDGES >= 5 => visitor.visit(&Adapter::<5>(custom)),
        _ => visitor.visit(&Adapter::<3>(custom)),
    }
}

/// A user's energy as a [`Term`], lane by lane in f64.
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
    const APART: bool = true;

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
