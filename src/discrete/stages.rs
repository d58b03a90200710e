//! The device, the precision and the stages of a descent.
//!
//! - Exponents ν of bending far from 2 are approached in stages. Each stage starts where the one
//!   before ended. For large ν the energy is that of the sharpest bend alone, and its Hessian says
//!   nothing about the others.
//! - Where the precision is left to the program, the host finishes some curves in f64. These are
//!   curves that f32 could not finish, and curves whose edges are too fine for f32 on a device that
//!   has nothing else. They go on from where f32 left them, and Newton's method takes an iteration
//!   or two.

use super::descent_gpu::descend_on_gpu;
use super::energy::Energy;
use super::fair::Fair;
use super::lane::Standing;
use super::plan::{Direction, Plan};
use super::problem::{Ended, Outcome, Problem, descend_on_cpu};
use super::setup::Ready;
use super::within::has_kernel;
use crate::batch::Unfitted;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::scalar::{Vector, add};
use crate::precision::Precision;

/// The most edges a span for which f32 has enough digits for bending.
///
/// The condition grows as the fourth power of the edges.
const MOST_EDGES_IN_F32: u32 = 200;

/// Exponents from [`LEAST_EXPONENT`] to this one need no stages.
///
/// They take as long from the spline as through stages.
const MOST_EXPONENT: f64 = 5.0;

/// See [`MOST_EXPONENT`].
const LEAST_EXPONENT: f64 = 1.5;

/// From stage to stage ν − 1 at most doubles or halves.
const STAGE: f64 = 2.0;

/// The tolerance of the norm of the gradient in all stages but the last.
///
/// It is near enough for the next to start from.
const STAGE_TOLERANCE: f64 = 1e-2;

/// See [`Outcome::rest`].
const AT_REST: f64 = 16.0;

/// The most iterations of all stages but the last.
const STAGE_ITERATIONS: u32 = 40;

/// A descent on one device.
pub(super) struct Descender<'a> {
    pub plan: Plan,
    pub energy: &'a Energy,
    pub gpu: Option<(&'a Gpu, Precision)>,
}

impl Descender<'_> {
    pub fn descend<const D: usize>(&self, problems: &[Problem<D>], ended: Ended<'_, D>) -> Result<Vec<Outcome<D>>> {
        match self.gpu {
            Some((gpu, precision)) => descend_on_gpu(gpu, precision, &self.plan, self.energy, problems, ended),
            None => Ok(descend_on_cpu(&self.plan, self.energy, problems, ended)),
        }
    }
}

impl Fair {
    /// How its descents go.
    pub(super) fn plan(&self) -> Plan {
        let order = self.energy.order();
        let gauge = match order {
            1 if self.energy.attachment_weight() > 0.0 => 2,
            1 => 0,
            2 if self.surface.is_some() || self.energy.is_fenced() => 1,
            _ => order,
        };
        Plan { direction: self.direction, step: self.step, order, gauge, most_iterations: self.max_iterations }
    }

    /// Descends all curves that are ready.
    ///
    /// Returns the device that did the work. After an error nothing is ready any more.
    ///
    /// `ended` is called for every curve that is finished, by its number among those that are
    /// ready.
    pub(super) fn descend<const D: usize>(
        &self,
        ready: &mut [Result<Ready<D>, Unfitted>],
        device: &Device,
        ended: Ended<'_, D>,
    ) -> Result<(Vec<Outcome<D>>, DeviceReport)> {
        // They are lent, and not copied.
        let mut problems: Vec<Problem<D>> =
            ready.iter_mut().flatten().map(|ready| std::mem::take(&mut ready.problem)).collect();
        let plan = self.plan();
        let order = plan.order;
        let edges_a_span = |ready: &Ready<D>| ready.rows.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        let coarse: Vec<bool> = ready.iter().flatten().map(|ready| edges_a_span(ready) <= MOST_EDGES_IN_F32).collect();
        let well_conditioned = coarse.iter().all(|coarse| *coarse);
        // f32 cannot hold the inner product of order 3, and kernels of that order know Newton's method
        // alone. Other such curves go to the CPU.
        // Nor has it the digits for fences: such descents go to the CPU where kernels have no f64.
        let is_fenced = self.energy.is_fenced();
        // Not every surface has kernels, and of some only in f64.
        let has_kernel = |gpu: &Gpu, precision| {
            self.surface.as_ref().is_none_or(|surface| match surface.local() {
                Some((local, _)) => has_kernel(&*local, precision, gpu.limits()),
                None => has_kernel(&**surface, precision, gpu.limits()),
            })
        };
        let is_f32_enough = device.as_gpu().is_none_or(|gpu| has_kernel(gpu, Precision::F32));
        let well_conditioned = well_conditioned && order < 3 && !is_fenced && is_f32_enough;
        let gpu = match device.as_gpu() {
            Some(gpu) => Some((gpu, device.kernel_precision(gpu, well_conditioned)?)),
            None => None,
        };
        let gpu = gpu.filter(|(gpu, precision)| has_kernel(gpu, *precision));
        let is_newton = self.direction == Direction::Newton;
        let gpu = gpu.filter(|(_, precision)| order < 3 || is_newton && *precision == Precision::F64);
        let gpu = gpu.filter(|(_, precision)| !is_fenced || *precision == Precision::F64);
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
        let mut outcomes = self.descend_in_stages(&plan, gpu, &problems, &on_device)?;
        if in_f32 && !goes_on && self.surface.is_some() {
            outcomes.iter_mut().zip(&problems).for_each(|(outcome, problem)| outcome.rest(problem.tolerance));
        }
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
            unfinished.into_iter().zip(finished).for_each(|(i, finished)| outcomes[i].go_on(finished));
        }
        for ((ready, problem), tolerance) in ready.iter_mut().flatten().zip(problems).zip(tolerances) {
            ready.problem = Problem { tolerance, ..problem };
        }
        if report.is_gpu {
            report.finished_on_cpu = outcomes.iter().filter(|outcome| outcome.on_cpu).count();
        }
        Ok((outcomes, report))
    }

    fn descend_in_stages<const D: usize>(
        &self,
        plan: &Plan,
        gpu: Option<(&Gpu, Precision)>,
        problems: &[Problem<D>],
        ended: Ended<'_, D>,
    ) -> Result<Vec<Outcome<D>>> {
        // Curves with limits start from one that has gone through the stages.
        let stages = if self.energy.is_fenced() { vec![] } else { stages(&self.energy) };
        if stages.is_empty() {
            return Descender { plan: *plan, energy: &self.energy, gpu }.descend_rough(problems, ended);
        }
        let mut problems = problems.to_vec();
        let mut before: Option<Vec<Outcome<D>>> = None;
        for bound in stages {
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
        let outcomes = Descender { plan: *plan, energy: &self.energy, gpu }.descend_rough(&problems, ended)?;
        Ok(going_on(before, outcomes))
    }
}

fn going_on<const D: usize>(before: Option<Vec<Outcome<D>>>, after: Vec<Outcome<D>>) -> Vec<Outcome<D>> {
    let Some(mut outcomes) = before else { return after };
    outcomes.iter_mut().zip(after).for_each(|(outcome, after)| outcome.go_on(after));
    outcomes
}

/// The bounds of the exponents, one for each stage before the energy itself.
///
/// They bound large exponents from above and small ones from below.
fn stages(energy: &Energy) -> Vec<f64> {
    let weighed = energy.terms().iter().filter(|(weight, _)| *weight > 0.0);
    let exponents = weighed.filter_map(|(_, functional)| functional.exponent());
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
    /// The energy with the exponents of bending no farther from 2 than `bound`.
    fn within(&self, bound: f64) -> Energy {
        let mut energy = self.clone();
        for (_, functional) in energy.terms_mut() {
            if let Some(exponent) = functional.exponent() {
                functional.set_exponent(nearer(exponent, bound));
            }
        }
        energy
    }
}

fn nearer(exponent: f64, bound: f64) -> f64 {
    if bound > 2.0 { exponent.min(bound) } else { exponent.max(bound) }
}

impl<const D: usize> Problem<D> {
    /// The problem of [`Energy::within`].
    ///
    /// All exponents weigh the same where the curve has its mean curvature.
    fn within(&self, energy: &Energy, bound: f64) -> Problem<D> {
        let mut problem = self.clone();
        problem.tolerance = problem.tolerance.max(STAGE_TOLERANCE);
        let mut highest = (0.0, 0.0);
        for (weight, (_, functional)) in problem.weights.iter_mut().zip(energy.terms()) {
            if let Some(exponent) = functional.exponent() {
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
    /// Whether the next stage can start from this curve.
    fn leads_on(&self) -> bool {
        matches!(self.standing, Standing::Converged | Standing::Exhausted | Standing::Stalled)
    }

    /// Whether the descent ended by rounding or by the number of iterations.
    fn is_short(&self) -> bool {
        matches!(self.standing, Standing::Exhausted | Standing::Stalled)
    }

    /// Takes a curve in a surface that no step in f32 leads further for converged, where its gradient is near the tolerance.
    ///
    /// Of 1,800 curves with bending in an ellipsoid 14 came to rest above the tolerance, within 4e-7 of their size of the result in
    /// f64. 13 were within 16 tolerances.
    fn rest(&mut self, tolerance: f64) {
        if self.standing == Standing::Stalled && self.norm <= AT_REST * tolerance {
            self.standing = Standing::Converged;
        }
    }

    /// A move without a descent.
    pub(super) fn moved(displacements: Vec<Vector<f64, D>>) -> Self {
        Outcome {
            displacements,
            standing: Standing::Running,
            energy: f64::NAN,
            norm: f64::NAN,
            iterations: 0,
            evaluations: 0,
            on_cpu: false,
        }
    }

    /// Appends a descent that started where this one ended.
    pub(super) fn go_on(&mut self, after: Outcome<D>) {
        let sum = self.displacements.iter().zip(&after.displacements).map(|(before, after)| add(*before, *after));
        let displacements = sum.collect();
        let iterations = self.iterations + after.iterations;
        let evaluations = self.evaluations + after.evaluations;
        let on_cpu = self.on_cpu || after.on_cpu;
        *self = Outcome { displacements, iterations, evaluations, on_cpu, ..after };
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
