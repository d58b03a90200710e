//! Tests of descents on the GPU against descents on the CPU in f64.

mod divided;
mod newton;

use glam::DVec3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::CurveBatch;
use crate::discrete::energy::{bending, length, tautness, tension};
use crate::discrete::problem::descend;
use crate::discrete::setup::set_up;
use crate::discrete::{Fair, Pins, Segments};
use crate::gpu::testing::{gpu, precisions};

/// Gentle curves: open ones along a line, and closed ones around a circle.
fn batch<const D: usize>(sizes: &[usize], closed: impl Fn(usize) -> bool, seed: u64) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets, mut are_closed) = (Vec::new(), vec![0], Vec::new());
    for (i, &points) in sizes.iter().enumerate() {
        let closed = closed(i) && points > 2;
        for k in 0..points {
            let turn = std::f64::consts::TAU * k as f64 / points as f64;
            let mut noise = || rng.random_range(-0.3..0.3) / points as f64;
            let mut at = [0.0; D];
            (at[0], at[1]) = if closed { (turn.cos(), turn.sin()) } else { (k as f64 / points as f64, 0.0) };
            at.iter_mut().for_each(|x| *x += noise());
            coords.extend(at);
        }
        offsets.push(coords.len() / D);
        are_closed.push(closed);
    }
    CurveBatch::from_ragged(D, coords, offsets).unwrap().closed_each(are_closed).unwrap()
}

fn sobolev() -> Fair {
    Fair { solver: Solver::Sobolev, ..Fair::default() }
}

fn plan_of(fair: &Fair) -> Plan {
    fair.plan(&fair.energy)
}

fn problems<const D: usize>(fair: &Fair, batch: &CurveBatch) -> Vec<Problem<D>> {
    set_up::<D>(fair, batch).unwrap().into_iter().map(|ready| *ready.unwrap().problem).collect()
}

fn refs<const D: usize>(problems: &[Problem<D>]) -> Vec<&Problem<D>> {
    problems.iter().collect()
}

/// Problems with a tolerance that all curves here reach in f32. Rounding leaves about 1.1 ε √E/h,
/// which is 3e-5 for the finest.
fn loosened<const D: usize>(problems: &[Problem<D>], precision: Precision) -> Vec<Problem<D>> {
    let mut problems = problems.to_vec();
    if precision == Precision::F32 {
        for problem in &mut problems {
            problem.tolerance = 1e-4;
        }
    }
    problems
}

struct Agreement {
    vertices: f64,
    energy: f64,
    most_iterations: u32,
    mean_evaluations: f64,
}

fn compare<const D: usize>(gpu: &Gpu, precision: Precision, fair: &Fair, batch: &CurveBatch) -> Agreement {
    let plan = plan_of(fair);
    let exact = problems::<D>(fair, batch);
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(&exact), &|_, _| {});
    let own = loosened(&exact, precision);
    let found = descend_on_gpu(gpu, precision, &plan, &fair.energy, &refs(&own), &|_, _| {}).unwrap();
    let mut agreement = Agreement { vertices: 0.0, energy: 0.0, most_iterations: 0, mean_evaluations: 0.0 };
    for (i, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
        assert_eq!(
            wanted.termination,
            TerminationStatus::Converged,
            "curve {i} of {} edges on the CPU: {} {}",
            exact[i].base.len(),
            wanted.norm,
            wanted.iterations
        );
        let numbers = (found.iterations, found.evaluations, found.norm, found.energy, wanted.energy, wanted.iterations);
        assert_eq!(found.termination, TerminationStatus::Converged, "curve {i}, {precision:?}: {numbers:?}");
        assert!(found.norm <= own[i].tolerance, "curve {i}: {numbers:?}");
        for (a, b) in wanted.displacements.iter().zip(&found.displacements) {
            (0..D).for_each(|c| agreement.vertices = agreement.vertices.max((a[c] - b[c]).abs()));
        }
        agreement.energy = agreement.energy.max((wanted.energy - found.energy).abs() / wanted.energy.abs().max(1e-3));
        agreement.most_iterations = agreement.most_iterations.max(found.iterations);
        agreement.mean_evaluations += f64::from(found.evaluations) / own.len() as f64;
    }
    agreement
}

fn check<const D: usize>(gpu: &Gpu, fair: &Fair, batch: &CurveBatch) {
    for precision in precisions(gpu) {
        let Agreement { vertices, energy, most_iterations, mean_evaluations } =
            compare::<D>(gpu, precision, fair, batch);
        println!(
            "{D}-D {} {precision:?}: vertices {vertices:.1e}, energy {energy:.1e}, \
             at most {most_iterations} iterations, {mean_evaluations:.1} evaluations a curve",
            fair.energy
        );
        let (most_vertices, most_energy) = if precision == Precision::F64 { (1e-6, 1e-10) } else { (1e-4, 1e-5) };
        assert!(vertices < most_vertices, "{} {precision:?}: vertices differ by {vertices:e}", fair.energy);
        assert!(energy < most_energy, "{} {precision:?}: energies differ by {energy:e}", fair.energy);
    }
}

const RAGGED: [usize; 23] = [2, 3, 4, 5, 6, 7, 8, 9, 2, 9, 3, 8, 5, 5, 5, 4, 4, 3, 6, 7, 7, 3, 2];

#[test]
fn curves_end_where_those_of_the_cpu_end_pinned() {
    let Some(gpu) = gpu() else { return };
    for (n, seed) in [(1, 1), (2, 2), (7, 3), (20, 4)] {
        for energy in [bending(2.0) + length(), length() + 0.5 * tension()] {
            let fair = Fair { energy, segments: Segments::PerSpan(n), ..sobolev() };
            check::<2>(&gpu, &fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, seed));
            check::<3>(&gpu, &fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, seed + 10));
        }
    }
}

#[test]
fn curves_end_where_those_of_the_cpu_end_attached() {
    let Some(gpu) = gpu() else { return };
    let energies = [bending(2.0) + length() + 1e3 * attachment(), length() + tension() + 10.0 * attachment()];
    for (energy, pins) in energies.into_iter().flat_map(|e| [(e.clone(), Pins::None), (e, Pins::Ends)]) {
        let fair = Fair { energy, pins, segments: Segments::PerSpan(6), ..sobolev() };
        check::<2>(&gpu, &fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, 21));
        check::<3>(&gpu, &fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, 22));
    }
}

#[test]
fn curves_of_other_exponents_and_of_a_users_energy_end_where_those_of_the_cpu_end() {
    let Some(gpu) = gpu() else { return };
    for energy in [bending(3.0) + length(), bending(2.5) + 2.0 * length(), square() + length()] {
        let fair = Fair { energy, segments: Segments::PerSpan(5), ..sobolev() };
        check::<2>(&gpu, &fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, 31));
        check::<3>(&gpu, &fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, 32));
    }
}

#[test]
fn single_precision_takes_the_steps_of_its_twin() {
    let Some(gpu) = gpu() else { return };
    let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(16), ..sobolev() };
    let problems = problems::<2>(&fair, &batch::<2>(&[5; 40], |i| i % 2 == 1, 43));
    let problems = loosened(&problems, Precision::F32);
    let plan = plan_of(&fair);
    let functionals: Vec<_> = fair.energy.terms().iter().map(|(_, functional)| functional).collect();
    let found = descend_on_gpu(&gpu, Precision::F32, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap();
    let mut apart = 0;
    for (i, (problem, found)) in problems.iter().zip(&found).enumerate() {
        let twin = &descend::<f32, 2>(&plan, &functionals, &[problem], &mut None)[0];
        assert_eq!(
            (found.termination, twin.termination),
            (TerminationStatus::Converged, TerminationStatus::Converged),
            "curve {i}"
        );
        apart += found.iterations.abs_diff(twin.iterations);
        // If the numbers of steps agree, the curves differ only by rounding.
        if found.iterations == twin.iterations && found.evaluations == twin.evaluations {
            for (a, b) in twin.displacements.iter().flatten().zip(found.displacements.iter().flatten()) {
                assert!((a - b).abs() < 2e-5, "curve {i}: {a} {b}");
            }
        }
    }
    assert!(apart as usize <= problems.len() / 10, "{apart} iterations more or less in all");
}

/// Bending of exponent 2 as a user would write it.
fn square() -> Energy {
    Energy::custom("square", 2, -1.0, |t, s| 2.0 * (t[1] - t[0]).length_squared() / (s[0] + s[1]))
}
