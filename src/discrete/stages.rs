//! How fits are descended: on which device and in which precision, and in which stages where one
//! will not do.
//!
//! * Exponents ν of bending far from 2 are approached in stages, each from where the one before
//!   ended: for large ν the energy is that of the sharpest bend alone, and its Hessian says nothing
//!   of the others.
//! * Where the precision is left to the program, curves that f32 could not finish, or whose edges
//!   are too fine for it on a device that has nothing else, are finished by the host in f64, from
//!   where f32 left them: Newton's method then takes an iteration or two.

use super::descent_gpu::descend_on_gpu;
use super::energy::{Energy, Functional};
use super::fair::Fair;
use super::lane::Standing;
use super::plan::Plan;
use super::problem::{Ended, Outcome, Problem, descend_on_cpu};
use super::setup::Ready;
use crate::batch::Unfitted;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::scalar::add;
use crate::precision::Precision;

/// Bending in f32 has the digits for so many edges a span: its condition grows as their fourth
/// power.
const MOST_EDGES_IN_F32: u32 = 200;

/// Exponents up to this one, and down to [`LEAST_EXPONENT`], need no stages: from the spline they
/// take as long as through them.
const MOST_EXPONENT: f64 = 5.0;

/// See [`MOST_EXPONENT`].
const LEAST_EXPONENT: f64 = 1.5;

/// From stage to stage ν − 1 at most doubles, or halves.
const STAGE: f64 = 2.0;

/// √⟨g, L⁻¹g⟩ of stages but the last: near enough for the next to start from.
const STAGE_TOLERANCE: f64 = 1e-2;

/// Iterations of stages but the last.
const STAGE_ITERATIONS: u32 = 40;

/// What descends, and how.
struct Descender<'a> {
    plan: Plan,
    energy: &'a Energy,
    gpu: Option<(&'a Gpu, Precision)>,
}

impl Descender<'_> {
    fn descend<const D: usize>(&self, problems: &[Problem<D>], ended: Ended<'_, D>) -> Result<Vec<Outcome<D>>> {
        match self.gpu {
            Some((gpu, precision)) => descend_on_gpu(gpu, precision, &self.plan, self.energy, problems, ended),
            None => Ok(descend_on_cpu(&self.plan, self.energy, problems, ended)),
        }
    }
}

impl Fair {
    /// Descends what is ready; and says what did it. `ended` is told of every curve that needs no
    /// more, by its number among those that are ready.
    pub(super) fn descend<const D: usize>(
        &self,
        ready: &[Result<Ready<D>, Unfitted>],
        device: &Device,
        ended: Ended<'_, D>,
    ) -> Result<(Vec<Outcome<D>>, DeviceReport)> {
        let mut problems: Vec<Problem<D>> = ready.iter().flatten().map(|ready| ready.problem.clone()).collect();
        let order = self.energy.order();
        let plan = Plan {
            direction: self.direction,
            step: self.step,
            order,
            gauge: match order {
                1 if self.energy.attachment_weight() > 0.0 => 2,
                1 => 0,
                _ => order,
            },
            most_iterations: self.max_iterations,
        };
        let edges_a_span = |ready: &Ready<D>| ready.rows.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        let coarse: Vec<bool> = ready.iter().flatten().map(|ready| edges_a_span(ready) <= MOST_EDGES_IN_F32).collect();
        let well_conditioned = coarse.iter().all(|coarse| *coarse);
        // f32 cannot hold the inner product of order 3: such curves are the CPU's.
        let gpu = match device.as_gpu().filter(|_| order < 3) {
            Some(gpu) => Some((gpu, device.kernel_precision(gpu, well_conditioned)?)),
            None => None,
        };
        let in_f32 = gpu.is_some_and(|(_, precision)| precision == Precision::F32);
        let tolerances: Vec<f64> = problems.iter().map(|problem| problem.tolerance).collect();
        if in_f32 {
            problems
                .iter_mut()
                .for_each(|problem| problem.tolerance = problem.tolerance.max(problem.rounding_in_f32(&self.energy)));
        }
        let goes_on = in_f32 && device.precision() == Precision::Auto;
        let left = |i: usize, outcome: &Outcome<D>| goes_on && (!coarse[i] || outcome.is_short());
        let on_device = |i: usize, outcome: &Outcome<D>| {
            if !left(i, outcome) {
                ended(i, outcome);
            }
        };
        let mut outcomes = self.descend_in_stages(&plan, gpu, &mut problems, &on_device)?;
        let mut report = match gpu {
            Some(_) => device.report(well_conditioned)?,
            None => Device::cpu().report(true)?,
        };
        let unfinished: Vec<usize> = (0..problems.len()).filter(|&i| left(i, &outcomes[i])).collect();
        if !unfinished.is_empty() {
            let rebased = |&i: &usize| {
                let mut problem = Problem { tolerance: tolerances[i], ..problems[i].clone() };
                problem.rebase(&outcomes[i].displacements);
                problem
            };
            let own: Vec<Problem<D>> = unfinished.iter().map(rebased).collect();
            let finished = descend_on_cpu(&plan, &self.energy, &own, &|k, outcome| ended(unfinished[k], outcome));
            report.finished_on_cpu = unfinished.len();
            unfinished.into_iter().zip(finished).for_each(|(i, finished)| outcomes[i].go_on(finished));
        }
        Ok((outcomes, report))
    }

    fn descend_in_stages<const D: usize>(
        &self,
        plan: &Plan,
        gpu: Option<(&Gpu, Precision)>,
        problems: &mut [Problem<D>],
        ended: Ended<'_, D>,
    ) -> Result<Vec<Outcome<D>>> {
        let mut before: Option<Vec<Outcome<D>>> = None;
        for bound in stages(&self.energy) {
            let energy = self.energy.within(bound);
            let plan = Plan { most_iterations: plan.most_iterations.min(STAGE_ITERATIONS), ..*plan };
            let staged: Vec<Problem<D>> = problems.iter().map(|problem| problem.within(&self.energy, bound)).collect();
            let mut outcomes = Descender { plan, energy: &energy, gpu }.descend(&staged, &|_, _| {})?;
            for (problem, outcome) in problems.iter_mut().zip(&mut outcomes) {
                if !outcome.leads_on() {
                    outcome.displacements.fill([0.0; D]);
                }
                problem.rebase(&outcome.displacements);
            }
            before = Some(going_on(before, outcomes));
        }
        let outcomes = Descender { plan: *plan, energy: &self.energy, gpu }.descend(problems, ended)?;
        Ok(going_on(before, outcomes))
    }
}

fn going_on<const D: usize>(before: Option<Vec<Outcome<D>>>, after: Vec<Outcome<D>>) -> Vec<Outcome<D>> {
    let Some(mut outcomes) = before else { return after };
    outcomes.iter_mut().zip(after).for_each(|(outcome, after)| outcome.go_on(after));
    outcomes
}

/// Exponents that those of the energy are bounded by (from above where they are large, from below
/// where they are small), one a stage, before the energy itself.
fn stages(energy: &Energy) -> Vec<f64> {
    let exponents = energy.terms().iter().filter_map(|(weight, functional)| match functional {
        Functional::Bending(bending) if *weight > 0.0 => Some(bending.exponent),
        _ => None,
    });
    let farthest =
        exponents.fold(2.0, |far: f64, nu| if (nu - 1.0).ln().abs() > (far - 1.0).ln().abs() { nu } else { far });
    let mut stages = Vec::new();
    if farthest > MOST_EXPONENT {
        let mut nu = MOST_EXPONENT;
        while nu < farthest {
            stages.push(nu);
            nu = 1.0 + STAGE * (nu - 1.0);
        }
    } else if farthest > 1.0 {
        let mut nu = LEAST_EXPONENT;
        while nu > farthest {
            stages.push(nu);
            nu = 1.0 + (nu - 1.0) / STAGE;
        }
    }
    stages
}

impl Energy {
    /// With the exponents of bending no farther from 2 than `bound`.
    fn within(&self, bound: f64) -> Energy {
        let mut energy = self.clone();
        for (_, functional) in energy.terms_mut() {
            if let Functional::Bending(bending) = functional {
                bending.exponent = nearer(bending.exponent, bound);
            }
        }
        energy
    }
}

fn nearer(exponent: f64, bound: f64) -> f64 {
    if bound > 2.0 { exponent.min(bound) } else { exponent.max(bound) }
}

impl<const D: usize> Problem<D> {
    /// The problem of [`Energy::within`]: where the curve has its mean curvature all exponents
    /// weigh alike.
    fn within(&self, energy: &Energy, bound: f64) -> Problem<D> {
        let mut problem = self.clone();
        problem.tolerance = problem.tolerance.max(STAGE_TOLERANCE);
        let mut highest = (0.0, 0.0);
        for (weight, (_, functional)) in problem.weights.iter_mut().zip(energy.terms()) {
            if let Functional::Bending(bending) = functional {
                let exponent = bending.exponent;
                let nu = nearer(exponent, bound);
                let share = *weight * self.curvature.powf(exponent - 2.0);
                highest.0 += share * exponent * (exponent - 1.0);
                highest.1 += share * nu * (nu - 1.0);
                *weight *= self.curvature.powf(exponent - nu);
            }
        }
        if energy.order() == 2 && highest.0 > 0.0 {
            problem.highest *= highest.1 / highest.0;
            problem.gauge *= highest.1 / highest.0;
        }
        problem
    }
}

impl<const D: usize> Outcome<D> {
    /// Whether a curve is worth going on from.
    fn leads_on(&self) -> bool {
        matches!(self.standing, Standing::Converged | Standing::Exhausted | Standing::Stalled)
    }

    /// Whether rounding or the number of iterations ended it.
    fn is_short(&self) -> bool {
        matches!(self.standing, Standing::Exhausted | Standing::Stalled)
    }

    /// This, and what was done from there.
    fn go_on(&mut self, after: Outcome<D>) {
        let sum = self.displacements.iter().zip(&after.displacements).map(|(before, after)| add(*before, *after));
        let displacements = sum.collect();
        let iterations = self.iterations + after.iterations;
        let evaluations = self.evaluations + after.evaluations;
        *self = Outcome { displacements, iterations, evaluations, ..after };
    }
}

#[cfg(test)]
mod tests {
    use super::super::{bending, length};
    use super::*;

    #[test]
    fn exponents_near_two_need_no_stages_and_others_are_approached_by_doubling_and_halving() {
        let of = |nu: f64| stages(&(bending(nu) + length()));
        for nu in [1.0, 1.5, 2.0, 3.0, 5.0] {
            assert!(of(nu).is_empty(), "{nu}");
        }
        assert_eq!(of(20.0), [5.0, 9.0, 17.0]);
        assert_eq!(of(1.2), [1.5, 1.25]);
        assert!(stages(&length()).is_empty());
    }
}
