//! [`Stretches`]: second derivatives of energies that depend on lengths only.
//!
//! For an energy f of the lengths of edges, with e = Δs T and P = I − T Tᵀ, they are
//!
//! ```text
//! ∂²f/∂e_j∂e_k = f_jk T_j T_kᵀ + δ_jk f_j P_j/Δs_j
//! ```
//!
//! One number per f_jk and one per f_j/Δs_j therefore represent the sum of all such energies.
//! Systems in tangent planes use this form: see [`within`](super::within).

// Loops over edges by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use super::edges::Edges;
use super::energy::regularisation::{DifferenceRegularisation, RatioRegularisation};
use super::energy::{Functional, MOST_EDGES, Term, Visitor};
use crate::linalg::{Scalar, operation};

/// The second derivatives at an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<S> {
    /// f_jk of the edges j and k = j, j + 1, …
    pub along: [S; MOST_EDGES],
    /// f_j/Δs_j
    pub across: S,
}

/// The second derivatives of one curve, or of one curve per lane.
///
/// Closed curves continue in edges that repeat their first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stretches<S> {
    edges: Vec<Stretch<S>>,
}

impl<S: Scalar> Stretches<S> {
    /// Reuses the storage for the edges of other curves.
    pub fn renew(&mut self, edges: usize) {
        self.edges.resize(edges + MOST_EDGES - 1, Stretch { along: [S::ZERO; MOST_EDGES], across: S::ZERO });
    }

    /// The second derivatives at an edge.
    #[inline(always)]
    pub fn of(&self, edge: usize) -> &Stretch<S> {
        &self.edges[edge]
    }

    /// Sums the terms of lengths only, and the regularisation, given by its kind and weight.
    pub fn gather<const D: usize>(
        &mut self,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        regularisation: Option<(usize, S)>,
    ) {
        self.edges.fill(Stretch { along: [S::ZERO; MOST_EDGES], across: S::ZERO });
        for (weight, functional) in terms {
            functional.visit(Gathering { stretches: self, edges, weight: *weight });
        }
        match regularisation {
            Some((2, weight)) => Gathering { stretches: self, edges, weight }.visit(&RatioRegularisation),
            Some((_, weight)) => Gathering { stretches: self, edges, weight }.visit(&DifferenceRegularisation),
            None => {}
        }
    }

    #[inline(always)]
    fn sweep<T: Term<W>, const W: usize, const D: usize>(&mut self, edges: &Edges<S, D>, weight: S, term: &T) {
        for start in 0..edges.windows::<W>() {
            self.add_window(edges, start, weight * edges.starts::<W>(start), term);
        }
    }

    #[inline(always)]
    fn add_window<T: Term<W>, const W: usize, const D: usize>(
        &mut self,
        edges: &Edges<S, D>,
        start: usize,
        weight: S,
        term: &T,
    ) {
        let window = edges.window(term, start);
        let (first, second) = (term.gradient(&window), term.by_lengths(&window));
        for j in 0..W {
            let own = &mut self.edges[start + j];
            own.across += weight * first.length[j] * edges.inverse[start + j];
            for k in j..W {
                own.along[k - j] += weight * second[j][k];
            }
        }
    }
}

/// [`Stretches::gather`] with one functional's term.
struct Gathering<'a, S, const D: usize> {
    stretches: &'a mut Stretches<S>,
    edges: &'a Edges<S, D>,
    weight: S,
}

impl<S: Scalar, const D: usize> Visitor for Gathering<'_, S, D> {
    type Output = ();

    fn visit<T: Term<W>, const W: usize>(self, term: &T) {
        if const { !T::BY_TANGENT } {
            S::run(Sweep { sum: self, term });
        }
    }
}

operation! {
    /// [`Stretches::sweep`]
    Sweep<'a, S: Scalar, T: Term<W>; D, W> { sum: Gathering<'a, S, D>, term: &'a T }
        -> () { sum.stretches.sweep(sum.edges, sum.weight, term) }
}
