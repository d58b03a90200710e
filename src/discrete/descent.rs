//! [`Descent`]: curves that descend an energy, one curve per lane and one trial per tick.
//!
//! A tick evaluates the energy and its gradient at u + αp, where [`damped`](super::damped) gives
//! the direction p. Lanes that have ended do not change. A lane holds the whole state of its
//! descent, so a descent can stop after any tick and resume.

use super::edges::Edges;
use super::enclosed::Enclosing;
use super::energy::{Anchor, Functional, RegionPenalty};
use super::lane::{Bounds, Lane, TerminationStatus};
use super::newton::Weights;
use super::plan::Plan;
use super::within::Within;
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};
use crate::linalg::{Real, Scalar, operation};

/// The curves of all lanes.
pub(crate) struct Descent<'a, S: Scalar, const D: usize> {
    pub plan: Plan,
    pub edges: Edges<S, D>,
    /// For each vertex 1 if it may move, else 0.
    pub movable: Vec<S>,
    pub weights: Weights<S>,
    /// Functionals and their weights.
    ///
    /// Weights differ from lane to lane, because curves are normalised.
    pub terms: Vec<(S, &'a Functional)>,
    pub regularisation: S,
    /// The displacement of each vertex's data point, and the anchor that holds the vertex there.
    pub anchors: Vec<(Vector<S, D>, Anchor<S, D>)>,
    /// The region penalties of the vertices, one per layer.
    pub regions: Vec<Vec<RegionPenalty<S, D>>>,
    /// The term that keeps the area of planar curves.
    pub enclosing: Enclosing<S>,
    /// Whether any lane has that term.
    pub is_enclosing: bool,
    /// The surface that the curves lie in.
    pub within: Option<Within<S, D>>,
    /// The smallest λ: 0, except where curves may slide along themselves.
    pub least_damping: S,
    pub u: Vec<Vector<S, D>>,
    pub(super) x: Vec<Vector<S, D>>,
    pub(super) p: Vec<Vector<S, D>>,
    pub(super) g: Vec<Vector<S, D>>,
    pub(super) trial: Vec<Vector<S, D>>,
    pub lanes: Vec<Lane<S::Number>>,
}

impl<'a, S: Scalar, const D: usize> Descent<'a, S, D> {
    /// Curves at their bases.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        plan: Plan,
        edges: Edges<S, D>,
        movable: Vec<S>,
        weights: Weights<S>,
        terms: Vec<(S, &'a Functional)>,
        regularisation: S,
        anchors: Vec<(Vector<S, D>, Anchor<S, D>)>,
        bounds: &[Bounds],
    ) -> Self {
        let rows = vec![[S::ZERO; D]; edges.rows()];
        Descent {
            lanes: bounds.iter().map(|bounds| Lane::new(plan.solver, bounds)).collect(),
            u: rows.clone(),
            x: rows.clone(),
            p: rows.clone(),
            g: rows.clone(),
            trial: rows,
            plan,
            edges,
            movable,
            weights,
            terms,
            regularisation,
            anchors,
            regions: Vec::new(),
            enclosing: Enclosing::default(),
            is_enclosing: false,
            within: None,
            least_damping: S::ZERO,
        }
    }

    /// Whether any lane is still running.
    pub fn is_running(&self) -> bool {
        self.lanes.iter().any(|lane| lane.termination == TerminationStatus::Running)
    }

    /// The energy of the current curves, without the regularisation.
    pub fn energy_without_regularisation(&mut self) -> S {
        self.x.copy_from_slice(&self.u);
        self.edges.place(&self.u);
        let mut energy = if self.weights.attached { self.attach() } else { S::ZERO };
        energy += self.region_in();
        for (weight, functional) in &self.terms {
            energy += *weight * self.edges.value(functional);
        }
        if const { D == 2 } && self.is_enclosing {
            energy += self.edges.enclose(self.enclosing);
        }
        if const { D == 3 }
            && let Some(within) = &mut self.within
        {
            within.frame(&self.x);
            energy += within.value(&self.edges, &self.terms);
        }
        energy
    }

    /// Evaluates the curves that have not been evaluated yet.
    pub fn begin(&mut self) {
        self.advance(S::ZERO);
        let (energy, _, length) = self.evaluate();
        let mut accepted = S::ZERO;
        let is_new = |lane: &Lane<S::Number>| lane.termination == TerminationStatus::Running && lane.evaluations == 0;
        for (l, lane) in self.lanes.iter_mut().enumerate().filter(|(_, lane)| is_new(lane)) {
            if lane.begin(energy.lane(l), length.lane(l)) {
                accepted.set_lane(l, S::ONE.lane(0));
            }
        }
        self.take(accepted);
    }

    /// Replaces the curve of a lane by another at its base. Both differ in their edges and weights
    /// only.
    pub fn replace(&mut self, l: usize, weights: &[f64], [highest, regularisation]: [f64; 2], bounds: &Bounds) {
        for ((term, _), weight) in self.terms.iter_mut().zip(weights) {
            term.set_lane(l, number::<S>(*weight));
        }
        self.weights.highest.set_lane(l, number::<S>(highest));
        self.regularisation.set_lane(l, number::<S>(regularisation));
        let zero = S::ZERO.lane(0);
        self.u.iter_mut().chain(&mut self.p).flatten().for_each(|x| x.set_lane(l, zero));
        self.lanes[l] = Lane::new(self.plan.solver, bounds);
        if self.plan.order > 2 {
            self.edges.stand_for_ends();
        }
    }

    /// Moves to x = u + αp, and returns g·p.
    pub(super) fn advance(&mut self, alpha: S) -> S {
        S::run(Advance { descent: self, alpha })
    }

    #[inline(always)]
    fn advance_inlined(&mut self, alpha: S) -> S {
        let mut slope = S::ZERO;
        for row in 0..self.u.len() {
            slope += dot(self.g[row], self.p[row]);
            self.x[row] = add(self.u[row], scale(alpha, self.p[row]));
        }
        self.retract();
        slope
    }

    /// Moves x back to the surface, if the curves lie in one.
    #[inline(always)]
    pub(super) fn retract(&mut self) {
        if const { D == 3 }
            && let Some(within) = &self.within
        {
            within.retract(&self.movable, &mut self.x);
        }
    }

    /// The energy, slope and length at x.
    ///
    /// The gradient goes to `trial`.
    pub(super) fn evaluate(&mut self) -> (S, S, S) {
        self.edges.close(&mut self.x);
        self.edges.place(&self.x);
        self.edges.clear();
        let mut energy = S::ZERO;
        for (weight, functional) in &self.terms {
            energy += self.edges.add(*weight, functional);
        }
        if const { D == 2 } && self.is_enclosing {
            energy += self.edges.enclose(self.enclosing);
        }
        if self.plan.regularisation > 0 {
            energy += self.edges.add_regularisation(self.plan.regularisation, self.regularisation);
        }
        if const { D == 3 }
            && let Some(within) = &mut self.within
        {
            within.frame(&self.x);
            energy += within.add(&mut self.edges, &self.terms);
        }
        S::run(Complete { descent: self, energy })
    }

    /// Completes an evaluation, given the energy of the edges.
    ///
    /// Computes the gradient at the vertices, the energy of anchors and region penalties, and the
    /// slope along p.
    #[inline(always)]
    fn complete(&mut self, mut energy: S) -> (S, S, S) {
        self.edges.gradient(&self.movable, &mut self.trial);
        if self.weights.attached {
            energy += self.attach();
        }
        energy += self.region_in();
        if const { D == 3 }
            && let Some(within) = &mut self.within
        {
            within.settle(&self.movable, &mut self.trial);
        }
        let mut slope = S::ZERO;
        for row in 0..self.trial.len() {
            slope += dot(self.trial[row], self.p[row]);
        }
        (energy, slope, self.edges.total_length())
    }

    /// The energy of the anchors.
    ///
    /// Adds its gradient to `trial`.
    #[inline(always)]
    fn attach(&mut self) -> S {
        let mut energy = S::ZERO;
        for (row, (target, anchor)) in self.anchors.iter().enumerate() {
            let offset = subtract(self.x[row], *target);
            energy += anchor.value(offset);
            self.trial[row] = add(self.trial[row], scale(self.movable[row], anchor.gradient(offset)));
        }
        energy
    }

    /// The energy of the region penalties.
    ///
    /// Adds its gradient to `trial`.
    #[inline(always)]
    fn region_in(&mut self) -> S {
        let mut energy = S::ZERO;
        for regions in &self.regions {
            for (row, penalty) in regions.iter().enumerate() {
                energy += penalty.value(self.x[row]);
                self.trial[row] = add(self.trial[row], scale(self.movable[row], penalty.gradient(self.x[row])));
            }
        }
        energy
    }

    /// Accepts the step and its gradient in lanes where `accepted` is 1.
    pub(super) fn take(&mut self, accepted: S) {
        let squares = S::run(Take { descent: self, accepted });
        for (l, lane) in self.lanes.iter_mut().enumerate() {
            if accepted.lane(l) != S::ZERO.lane(0) {
                lane.took(squares.lane(l).is_finite());
            }
        }
    }

    #[inline(always)]
    fn take_inlined(&mut self, accepted: S) -> S {
        if const { D == 3 }
            && let Some(within) = &mut self.within
        {
            within.accept(accepted);
        }
        let mut squares = S::ZERO;
        for row in 0..self.u.len() {
            squares += dot(self.trial[row], self.trial[row]);
            self.u[row] = taken(accepted, self.x[row], self.u[row]);
            self.g[row] = taken(accepted, self.trial[row], self.g[row]);
        }
        squares
    }

    /// The displacements of a lane, vertex by vertex.
    pub fn displacements(&self, l: usize) -> Vec<Vector<f64, D>> {
        let count = self.edges.counts()[l] + usize::from(!self.edges.is_closed());
        self.u[..count].iter().map(|u| std::array::from_fn(|c| u[c].lane(l).to_f64())).collect()
    }
}

operation! {
    /// [`Descent::advance`]
    Advance<'d, 'a, S: Scalar; D> { descent: &'d mut Descent<'a, S, D>, alpha: S } -> S { descent.advance_inlined(alpha) }
}

operation! {
    /// [`Descent::complete`]
    Complete<'d, 'a, S: Scalar; D> { descent: &'d mut Descent<'a, S, D>, energy: S } -> (S, S, S) { descent.complete(energy) }
}

operation! {
    /// [`Descent::take`]
    Take<'d, 'a, S: Scalar; D> { descent: &'d mut Descent<'a, S, D>, accepted: S } -> S { descent.take_inlined(accepted) }
}

/// `new` where `accepted` is 1, else `old`.
#[inline(always)]
fn taken<S: Scalar, const D: usize>(accepted: S, new: Vector<S, D>, old: Vector<S, D>) -> Vector<S, D> {
    let mut taken = new;
    for c in 0..D {
        taken[c] = accepted.if_positive(new[c], old[c]);
    }
    taken
}

#[cfg(test)]
mod tests;
