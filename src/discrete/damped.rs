//! Newton's method damped in the Sobolev metric: one trial of (H + λL) p = −g per tick, until the
//! decrement √(−g·p) is small.
//!
//! [Sobolev gradients](Solver::Sobolev) have L in place of H.

use super::descent::Descent;
use super::lane::TerminationStatus;
use super::newton::Newton;
use crate::damping::{Trial, Verdict};
use crate::linalg::scalar::{dot, scale, subtract};
use crate::linalg::{Scalar, operation};

impl<S: Scalar, const D: usize> Descent<'_, S, D> {
    /// Storage for the systems of [`tick`](Self::tick).
    ///
    /// It reuses `kept`, the storage of earlier curves, if it fits.
    pub(super) fn newton<'n>(&self, kept: &'n mut Option<Newton<S, D>>) -> &'n mut Newton<S, D> {
        let (plan, in_surfaces) = (self.plan, self.within.is_some());
        match kept.take().filter(|kept| kept.is_for(plan, in_surfaces)) {
            Some(mut newton) => {
                newton.renew(&self.edges, &self.movable);
                kept.insert(newton)
            }
            None => kept.insert(Newton::new(plan, in_surfaces, &self.edges, &self.movable)),
        }
    }

    /// Makes one trial in every lane, after [`begin`](Self::begin).
    pub(super) fn tick(&mut self, newton: &mut Newton<S, D>) {
        let (smallest, slope) = self.newton_direction(newton);
        // Limits the change of every edge.
        let most = self.edges.most_step(&self.p);
        // 1 in lanes with a trial.
        let (mut tried, mut alpha) = (S::ZERO, S::ZERO);
        for (l, lane) in self.lanes.iter_mut().enumerate() {
            let step = lane.alpha(most.lane(l));
            if lane.aim(smallest.lane(l), slope.lane(l), step) {
                tried.set_lane(l, S::ONE.lane(0));
                alpha.set_lane(l, step);
            }
        }
        let is_tried = |l: usize| tried.lane(l) != S::ZERO.lane(0);
        if !(0..self.lanes.len()).any(is_tried) {
            return;
        }
        self.advance(alpha);
        let (energy, slope_there, length) = self.evaluate();
        let mut accepted = S::ZERO;
        for (l, lane) in self.lanes.iter_mut().enumerate().filter(|(l, _)| is_tried(*l)) {
            lane.evaluations += 1;
            let trial = Trial {
                smallest: smallest.lane(l),
                slopes: [slope.lane(l), slope_there.lane(l)],
                energies: [lane.energy, energy.lane(l)],
                alpha: alpha.lane(l),
            };
            let verdict = lane.judge(&trial);
            // Rounding may decide whether the last step is accepted, so the count does not depend
            // on it.
            lane.iterations +=
                u32::from(verdict == Verdict::Accept || lane.termination == TerminationStatus::Converged);
            if verdict == Verdict::Accept {
                (lane.energy, lane.length) = (energy.lane(l), length.lane(l));
                accepted.set_lane(l, S::ONE.lane(0));
            }
        }
        if (0..self.lanes.len()).any(|l| accepted.lane(l) != S::ZERO.lane(0)) {
            self.take(accepted);
        }
    }

    /// Adds the second derivatives of the anchors and the region penalties.
    #[inline(always)]
    fn add_anchors(&self, newton: &mut Newton<S, D>) {
        for (row, (target, anchor)) in self.anchors.iter().enumerate() {
            newton.add_at_vertex(row, anchor.hessian(subtract(self.u[row], *target)), self.weights.vertices[row]);
        }
        for regions in &self.regions {
            for (row, penalty) in regions.iter().enumerate() {
                newton.add_at_vertex(row, penalty.hessian(self.u[row]), S::ZERO);
            }
        }
    }

    /// Computes p at the current curves, and returns the smallest pivot of each lane and g·p.
    pub(super) fn newton_direction(&mut self, newton: &mut Newton<S, D>) -> (S, S) {
        let mut lambda = S::ZERO;
        for (l, lane) in self.lanes.iter().enumerate() {
            lambda.set_lane(l, lane.lambda());
        }
        lambda = lambda.max(self.least_damping);
        self.edges.place(&self.u);
        let regularisation = (self.plan.regularisation > 0).then_some((self.plan.regularisation, self.regularisation));
        newton.assemble(&self.edges, &self.terms, regularisation, &self.weights, lambda);
        S::run(AddAnchors { descent: self, newton });
        let is_enclosing = const { D == 2 } && self.is_enclosing;
        if is_enclosing {
            self.enclose(newton);
        }
        if const { D == 3 }
            && let Some(within) = &mut self.within
        {
            within.assemble(newton, &self.edges, &self.terms, &self.u);
        }
        let smallest = newton.factor();
        self.p.copy_from_slice(&self.g);
        newton.solve(&mut self.p);
        let mut slope = S::run(Turn { descent: self });
        if is_enclosing {
            slope = self.enclose_direction(newton);
        }
        self.edges.close(&mut self.p);
        (smallest, slope)
    }
}

impl<S: Scalar, const D: usize> Descent<'_, S, D> {
    /// Negates p, and returns g·p.
    #[inline(always)]
    fn turn_about(&mut self) -> S {
        let mut slope = S::ZERO;
        for (p, g) in self.p.iter_mut().zip(&self.g) {
            *p = scale(-S::ONE, *p);
            slope += dot(*g, *p);
        }
        slope
    }
}

impl<S: Scalar, const D: usize> Descent<'_, S, D> {
    /// Adds the second derivatives of the area's term, except for ρ ∇A∇Aᵀ.
    fn enclose(&self, newton: &mut Newton<S, D>) {
        let block = self.edges.enclosing_block(self.enclosing);
        for j in 0..self.edges.windows::<1>() {
            newton.couple(j, block.map(|row| scale(self.edges.starts::<1>(j), row)));
        }
    }

    /// Turns p = −M⁻¹g into −(M + ρ ∇A∇Aᵀ)⁻¹g, and returns g·p.
    fn enclose_direction(&mut self, newton: &mut Newton<S, D>) -> S {
        self.edges.clear();
        let all = self.edges.enclosed().1;
        self.edges.add_area(S::ONE, all);
        self.edges.gradient(&self.movable, &mut self.trial);
        self.x.copy_from_slice(&self.trial);
        newton.solve(&mut self.x);
        let (mut along, mut square) = (S::ZERO, S::ZERO);
        for row in 0..self.p.len() {
            along += dot(self.trial[row], self.p[row]);
            square += dot(self.trial[row], self.x[row]);
        }
        let stiffness = self.enclosing.stiffness;
        let share = stiffness * along / (S::ONE + stiffness * square);
        let mut slope = S::ZERO;
        for row in 0..self.p.len() {
            self.p[row] = subtract(self.p[row], scale(share, self.x[row]));
            slope += dot(self.g[row], self.p[row]);
        }
        slope
    }
}

operation! {
    /// [`Descent::turn_about`]
    Turn<'d, 'a, S: Scalar; D> { descent: &'d mut Descent<'a, S, D> } -> S { descent.turn_about() }
}

operation! {
    /// [`Descent::add_anchors`]
    AddAnchors<'d, 'a, S: Scalar; D> { descent: &'d Descent<'a, S, D>, newton: &'d mut Newton<S, D> } -> () { descent.add_anchors(newton) }
}
