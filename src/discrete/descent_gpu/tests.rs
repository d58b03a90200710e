//! Descents on the GPU against those of the CPU in f64.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::discrete::setup::set_up;
use crate::discrete::{Custom, Fair, Pins, Segments};
use crate::{CurveBatch, Device};

fn gpu() -> Option<Gpu> {
    match Gpu::open(0) {
        Ok(gpu) => Some(gpu.with_poisoned_arrays()),
        Err(error) if std::env::var_os("FAIRCURVE_REQUIRE_GPU").is_some() => panic!("{error}"),
        Err(_) => None,
    }
}

fn precisions(gpu: &Gpu) -> Vec<Precision> {
    let mut precisions = vec![Precision::F32];
    precisions.extend(gpu.summary().has_f64.then_some(Precision::F64));
    precisions
}

/// Gentle curves: open ones along a line, closed ones around a circle.
fn batch<const D: usize>(sizes: &[usize], closed: impl Fn(usize) -> bool, seed: u64) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets, mut are_closed) = (Vec::new(), vec![0], Vec::new());
    for (i, &points) in sizes.iter().enumerate() {
        let closed = closed(i) && points > 2;
        for k in 0..points {
            let turn = std::f64::consts::TAU * k as f64 / points as f64;
            let mut noise = || rng.random_range(-0.08..0.08);
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

fn plan_of(fair: &Fair) -> Plan {
    let order = fair.energy.order();
    Plan {
        direction: fair.direction,
        step: fair.step,
        order,
        gauge: if order > 1 { order } else { 0 },
        most_iterations: fair.max_iterations,
    }
}

fn problems<const D: usize>(fair: &Fair, batch: &CurveBatch) -> Vec<Problem<D>> {
    set_up::<D>(fair, batch).unwrap().into_iter().map(|ready| ready.unwrap().problem).collect()
}

/// What f32 can reach: rounding of an energy E of edges h leaves 2 ε √E/h, said the founder of the tolerance; a few times that.
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
    let wanted = descend_on_cpu(&plan, &fair.energy, &exact);
    let own = loosened(&exact, precision);
    let found = descend_on_gpu(gpu, precision, &plan, &fair.energy, &own).unwrap();
    let mut agreement = Agreement { vertices: 0.0, energy: 0.0, most_iterations: 0, mean_evaluations: 0.0 };
    for (i, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
        assert_eq!(wanted.standing, Standing::Converged, "curve {i} on the CPU: {:?}", wanted);
        let numbers = (found.iterations, found.evaluations, found.norm, found.energy, wanted.energy, wanted.iterations);
        assert_eq!(found.standing, Standing::Converged, "curve {i}, {precision:?}: {numbers:?}");
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
            "{D}-D {} {precision:?}: vertices {vertices:.1e}, energy {energy:.1e}, at most {most_iterations} iterations, \
             {mean_evaluations:.1} evaluations a curve",
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
            let fair = Fair { energy, segments: Segments::PerSpan(n), ..Fair::default() };
            check::<2>(&gpu, &fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, seed));
            check::<3>(&gpu, &fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, seed + 10));
        }
    }
}

#[test]
fn curves_end_where_those_of_the_cpu_end_attached() {
    let Some(gpu) = gpu() else { return };
    let energies =
        [bending(2.0) + length() + 1e3 * attachment(), length() + 10.0 * attachment()];
    for (energy, pins) in energies.into_iter().flat_map(|e| [(e.clone(), Pins::None), (e, Pins::Ends)]) {
        let fair = Fair { energy, pins, segments: Segments::PerSpan(6), ..Fair::default() };
        check::<2>(&gpu, &fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, 21));
        check::<3>(&gpu, &fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, 22));
    }
}
