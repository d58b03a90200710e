//! Tests of Newton's method on the GPU against the CPU in f64.

use std::sync::Arc;

use super::divided::bits;
use super::*;
use crate::discrete::{geodesic_bending, variation};
use crate::surface::{Quadric, Surface, Torus};

/// The worst differences from the CPU in f64 at the same tolerances. In f64 the trials agree too.
struct Worst {
    vertices: f64,
    tolerance: f64,
    most_iterations: u32,
    trials: u32,
    /// Descents whose trials are not compared.
    long: usize,
}

fn compared<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    lanes: usize,
    fair: &Fair,
    problems: &[Problem<D>],
) -> Worst {
    let plan = plan_of(fair);
    assert_eq!(plan.solver, Solver::Newton);
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(problems), &|_, _| {});
    let mut own = problems.to_vec();
    if precision == Precision::F32 {
        // As in a fit.
        own.iter_mut()
            .for_each(|problem| problem.tolerance = fair.tolerance.max(problem.rounding_in_f32(&fair.energy)));
    }
    let found = with_lanes(gpu, precision, lanes, &plan, &fair.energy, &own);
    let mut worst = Worst { vertices: 0.0, tolerance: 0.0, most_iterations: 0, trials: 0, long: 0 };
    for (i, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
        let name =
            format!("{} {precision:?} {lanes} lanes, curve {i} of {} edges", fair.energy, problems[i].base.len());
        assert_eq!(
            (wanted.termination, found.termination),
            (TerminationStatus::Converged, TerminationStatus::Converged),
            "{name} {} {}",
            found.iterations,
            found.norm
        );
        assert!(found.norm <= own[i].tolerance, "{name}: {:e}", found.norm);
        // At order 3 hundreds of trials may be damped, and rounding decides some of them.
        let is_long = plan.order == 3 && wanted.evaluations > 40;
        worst.long += usize::from(is_long);
        if precision == Precision::F64 && !is_long {
            let trials = |outcome: &Outcome<D>| (outcome.iterations, outcome.evaluations);
            assert_eq!(trials(found), trials(wanted), "{name}: iterations and evaluations");
        }
        for (a, b) in wanted.displacements.iter().flatten().zip(found.displacements.iter().flatten()) {
            worst.vertices = worst.vertices.max((a - b).abs());
        }
        worst.tolerance = worst.tolerance.max(own[i].tolerance);
        worst.most_iterations = worst.most_iterations.max(found.iterations);
        worst.trials += found.evaluations;
    }
    worst
}

/// Descends with this number of lanes per curve.
fn with_lanes<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    lanes: usize,
    plan: &Plan,
    energy: &Energy,
    problems: &[Problem<D>],
) -> Vec<Outcome<D>> {
    let run =
        Run { gpu, precision, plan, energy, problems: &refs(problems), most_ticks: MOST_TICKS, lanes: Some(lanes) };
    run.descend(&mut |_| {}, &|_, _| {}).unwrap()
}

fn check<const D: usize>(gpu: &Gpu, fair: &Fair, problems: &[Problem<D>], ways: &[(Precision, usize)]) {
    for &(precision, lanes) in ways {
        let Worst { vertices, tolerance, most_iterations, trials, long } =
            compared(gpu, precision, lanes, fair, problems);
        assert!(4 * long <= problems.len(), "{long} of {} descents are long", problems.len());
        let mean = f64::from(trials) / problems.len() as f64;
        println!(
            "{D}-D {} {precision:?}, {lanes} lanes: vertices {vertices:.1e} at {tolerance:.0e}, at most {most_iterations} iterations, {mean:.1} evaluations, {long} long",
            fair.energy
        );
        // In f32 the distance from the minimum is proportional to the tolerance: here a tenth of it
        // or less.
        let most = if precision == Precision::F64 { 1e-9 } else { 1e-6_f64.max(tolerance / 5.0) };
        assert!(vertices < most, "{D}-D {} {precision:?}: vertices differ by {vertices:e}", fair.energy);
    }
}

/// Every precision of the adapter with each of these numbers of lanes.
fn ways(gpu: &Gpu, lanes: &[usize]) -> Vec<(Precision, usize)> {
    precisions(gpu).into_iter().flat_map(|precision| lanes.iter().map(move |&lanes| (precision, lanes))).collect()
}

fn check_ragged(gpu: &Gpu, fair: &Fair, lanes: &[usize], seed: u64) {
    let both = ways(gpu, lanes);
    check::<2>(gpu, fair, &problems(fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, seed)), &both);
    check::<3>(gpu, fair, &problems(fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, seed + 10)), &both);
}

#[test]
fn pinned_curves_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for (n, seed) in [(1, 1), (2, 2), (7, 3), (20, 4)] {
        let energy = bending(2.0) + length();
        check_ragged(&gpu, &Fair { energy, segments: Segments::PerSpan(n), ..Fair::default() }, &[1, 8], seed);
    }
}

#[test]
fn curves_of_other_exponents_and_of_a_users_energy_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for energy in [bending(3.0) + length(), square() + length(), bending(2.0) + 0.2 * bending(3.0) + length()] {
        check_ragged(&gpu, &Fair { energy, segments: Segments::PerSpan(5), ..Fair::default() }, &[1], 31);
    }
    // On a straight curve |T′ − T|^1.5 has no second derivative, and rounding decides the number of
    // trials.
    let curved: Vec<usize> = RAGGED.into_iter().filter(|&points| points > 2).collect();
    let fair = Fair { energy: bending(1.5) + length(), segments: Segments::PerSpan(5), ..Fair::default() };
    let both = ways(&gpu, &[1]);
    check::<2>(&gpu, &fair, &problems(&fair, &batch::<2>(&curved, |i| i % 2 == 1, 31)), &both);
    check::<3>(&gpu, &fair, &problems(&fair, &batch::<3>(&curved, |i| i % 2 == 0, 41)), &both);
}

#[test]
fn attached_curves_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let energy = bending(2.0) + length() + 1e3 * attachment();
    for pins in [Pins::None, Pins::Ends] {
        check_ragged(
            &gpu,
            &Fair { energy: energy.clone(), pins, segments: Segments::PerSpan(6), ..Fair::default() },
            &[1, 8],
            21,
        );
    }
}

/// Zigzags of random heights, whose Hessians are far from positive definite at the start.
fn rough<const D: usize>(points: usize, curves: usize, closed: impl Fn(usize) -> bool, seed: u64) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(seed);
    let coords = (0..curves * points).flat_map(|i| {
        let mut at = [0.0; D].map(|_| rng.random_range(-0.4..0.4));
        at[0] += (i % points) as f64 / points as f64;
        at
    });
    let coords: Vec<f64> = coords.collect();
    let offsets = (0..=curves).map(|i| i * points).collect();
    CurveBatch::from_ragged(D, coords, offsets)
        .unwrap()
        .closed_each((0..curves).map(closed).collect::<Vec<_>>())
        .unwrap()
}

// In f64 only: at sharp turns the gradient in f32 stays above the tolerance, whatever the path.
#[test]
fn rough_curves_are_damped_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for precision in precisions(&gpu).into_iter().filter(|p| *p == Precision::F64) {
        for energy in [bending(2.0) + length(), bending(1.5) + length()] {
            let fair = Fair { energy, segments: Segments::PerSpan(8), ..Fair::default() };
            check::<2>(
                &gpu,
                &fair,
                &problems(&fair, &rough::<2>(7, 40, |i| i % 2 == 1, 51)),
                &[(precision, 1), (precision, 8)],
            );
            check::<3>(
                &gpu,
                &fair,
                &problems(&fair, &rough::<3>(7, 40, |i| i % 2 == 1, 52)),
                &[(precision, 1), (precision, 8)],
            );
        }
    }
}

#[test]
fn rings_of_more_lanes_than_a_subgroup_has_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let energy = bending(2.0) + length();
    let fair = Fair { energy, segments: Segments::PerSpan(20), ..Fair::default() };
    let problems = problems::<2>(&fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, 4));
    check(&gpu, &fair, &problems, &[(Precision::F32, 32)]);
}

#[test]
fn fine_curves_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let both = ways(&gpu, &[1, 8]);
    for n in [16, 64, 75] {
        let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(n), ..Fair::default() };
        check::<2>(&gpu, &fair, &problems(&fair, &batch::<2>(&[5; 8], |i| i % 2 == 1, 41)), &both);
        check::<3>(&gpu, &fair, &problems(&fair, &batch::<3>(&[5; 8], |i| i % 2 == 1, 42)), &both);
    }
}

#[test]
fn curves_that_fold_or_run_away_end_as_on_the_cpu_and_leave_their_neighbours_bits() {
    let Some(gpu) = gpu() else { return };
    let hairpin = [[0.0, 0.0], [1.0, 0.05], [0.0, 0.1], [1.0, 0.15], [0.0, 0.2]];
    let arc = [[0.0, 0.0], [0.5, 0.2], [1.0, 0.25], [1.5, 0.2], [2.0, 0.0]];
    let loose = CurveBatch::from_slices(&[&arc[..], &hairpin[..], &arc[..], &arc[..]]).unwrap();
    let fair = Fair { energy: bending(2.0), segments: Segments::PerSpan(8), max_iterations: 2000, ..Fair::default() };
    let plan = plan_of(&fair);
    let mut given = problems::<2>(&fair, &loose);
    // The edge goes back along the previous one.
    given[2].base[9] = given[2].base[8].map(|x| -x);
    given.iter_mut().for_each(|problem| problem.tolerance = 1e-4);
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(&given), &|_, _| {});
    assert_eq!(
        (wanted[0].termination, wanted[1].termination),
        (TerminationStatus::Converged, TerminationStatus::Unbounded)
    );
    for (precision, lanes) in ways(&gpu, &[1, 8]) {
        let found = with_lanes(&gpu, precision, lanes, &plan, &fair.energy, &given);
        let standings =
            |outcomes: &[Outcome<2>]| outcomes.iter().map(|outcome| outcome.termination).collect::<Vec<_>>();
        assert_eq!(standings(&found), standings(&wanted), "{precision:?}");
        for i in [0, 3] {
            let alone = &with_lanes(&gpu, precision, lanes, &plan, &fair.energy, &given[i..=i])[0];
            assert_eq!(found[i].displacements, alone.displacements, "{precision:?}, {lanes} lanes, curve {i}");
        }
    }
}

#[test]
fn a_damped_descent_has_the_same_bits_however_its_ticks_are_divided() {
    let Some(gpu) = gpu() else { return };
    let fair =
        Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(6), max_iterations: 40, ..Fair::default() };
    let (plan, problems) = (plan_of(&fair), problems::<3>(&fair, &rough::<3>(6, GROUP + 3, |i| i % 2 == 1, 61)));
    for (precision, lanes) in ways(&gpu, &[1, 8]) {
        let run = |most_ticks: u32| {
            let lanes = Some(lanes);
            let run = Run {
                gpu: &gpu,
                precision,
                plan: &plan,
                energy: &fair.energy,
                problems: &refs(&problems),
                most_ticks,
                lanes,
            };
            run.descend(&mut |_| {}, &|_, _| {}).unwrap()
        };
        let whole = run(1000);
        // More than one trial per step: λ is not 0 where dispatches end.
        let damped = whole.iter().filter(|outcome| outcome.evaluations > outcome.iterations + 1).count();
        assert!(2 * damped > whole.len(), "{precision:?}: {damped}");
        for most_ticks in [1, 7] {
            for (i, (a, b)) in whole.iter().zip(&run(most_ticks)).enumerate() {
                assert_eq!(bits(a), bits(b), "{precision:?}, {lanes} lanes, {most_ticks} ticks a dispatch, curve {i}");
            }
        }
    }
}

#[test]
fn where_rounding_leaves_no_way_down_a_curve_stalls() {
    let Some(gpu) = gpu() else { return };
    let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(16), ..Fair::default() };
    let plan = plan_of(&fair);
    let mut problems = problems::<2>(&fair, &batch::<2>(&[5; 8], |i| i % 2 == 1, 71));
    problems.iter_mut().for_each(|problem| problem.tolerance = 0.0);
    let mut outcomes = vec![descend_on_cpu(&plan, &fair.energy, &refs(&problems), &|_, _| {})];
    for precision in precisions(&gpu) {
        outcomes.push(descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap());
    }
    for (i, outcome) in outcomes.iter().flatten().enumerate() {
        assert_eq!(
            outcome.termination,
            TerminationStatus::Stalled,
            "outcome {i} of {}: {}",
            outcomes.len(),
            outcome.norm
        );
    }
}

#[test]
fn terms_that_couple_more_vertices_than_l_are_left_to_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let fair =
        Fair { energy: bending(2.0) + length() + 0.0 * variation(), segments: Segments::PerSpan(4), ..Fair::default() };
    let problems = loosened(&problems::<2>(&fair, &batch::<2>(&[4, 5], |i| i == 1, 71)), Precision::F32);
    let plan = plan_of(&fair);
    assert_eq!(plan.order, 2);
    let found = descend_on_gpu(&gpu, Precision::F32, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap();
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(&problems), &|_, _| {});
    for (found, wanted) in found.iter().zip(&wanted) {
        assert_eq!(found.termination, TerminationStatus::Converged);
        assert_eq!(found.displacements, wanted.displacements);
    }
}

fn in_f64(gpu: &Gpu, lanes: &[usize]) -> Vec<(Precision, usize)> {
    ways(gpu, lanes).into_iter().filter(|(precision, _)| *precision == Precision::F64).collect()
}

#[test]
fn curves_of_order_3_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let fair = |n| {
        let energy = 0.05 * variation() + bending(2.0) + length();
        Fair { energy, segments: Segments::PerSpan(n), ..Fair::default() }
    };
    let planar = |fair: &Fair, lanes, seed| {
        let problems = problems(fair, &batch::<2>(&RAGGED, |i| i % 2 == 1, seed));
        check::<2>(&gpu, fair, &problems, &in_f64(&gpu, &[lanes]));
    };
    // With one edge per span there are closed curves of three and of four vertices. The CPU
    // descends the triangles.
    for (n, seed) in [(1, 81), (5, 82)] {
        planar(&fair(n), 4, seed);
        let problems = problems(&fair(n), &batch::<3>(&RAGGED, |i| i % 2 == 0, seed + 10));
        check::<3>(&gpu, &fair(n), &problems, &in_f64(&gpu, &[4]));
    }
    planar(&fair(20), 8, 83);
}

#[test]
fn curves_of_order_3_with_attached_points_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let energy = variation() + bending(2.0) + length() + 1e3 * attachment();
    for pins in [Pins::None, Pins::Ends] {
        let fair = Fair { energy: energy.clone(), pins, segments: Segments::PerSpan(6), ..Fair::default() };
        let problems = problems(&fair, &batch::<3>(&RAGGED, |i| i % 2 == 0, 91));
        check::<3>(&gpu, &fair, &problems, &in_f64(&gpu, &[4]));
    }
}

/// A batch moved onto a quadric or a torus.
///
/// For a torus, x and y are scaled to angles that spread the points over it.
fn onto(surface: &dyn Surface, batch: &CurveBatch) -> CurveBatch {
    let place = |p: &[f64]| match surface.kind().quadric() {
        Some(_) => DVec3::from_slice(p) + DVec3::new(0.0, 0.0, 1.2),
        None => {
            let ((up, out), (sin, cos)) = ((0.4 * p[1]).sin_cos(), (0.3 * p[0]).sin_cos());
            DVec3::new((3.0 + 1.5 * out) * cos, (3.0 + 1.5 * out) * sin, 1.5 * up)
        }
    };
    let lifted = batch.coords().chunks_exact(3).map(place);
    let coords = lifted.flat_map(|p| surface.closest(p).unwrap().to_array()).collect();
    batch.moved(3, coords, vec![])
}

#[test]
fn curves_in_surfaces_take_the_steps_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let on =
        |surface: &dyn Surface, within: Arc<dyn Surface>, energy: Energy, pins: Pins, n: usize, lanes: &[usize]| {
            let segments = Segments::PerSpan(n);
            let fair = Fair { energy, segments, pins, surface: Some(within), ..Fair::default() };
            let batch = onto(surface, &batch::<3>(&RAGGED, |i| i % 2 == 0, n as u64));
            let has_kernel = |way: &(Precision, usize)| surface.kind().quadric().is_some() || way.0 == Precision::F64;
            let ways: Vec<_> = ways(&gpu, lanes).into_iter().filter(has_kernel).collect();
            check::<3>(&gpu, &fair, &problems(&fair, &batch), &ways);
        };
    let sphere = Quadric::sphere(1.5);
    for n in [2, 7, 20] {
        on(&sphere, Arc::new(sphere.clone()), geodesic_bending(2.0) + tautness(), Pins::All, n, &[1, 8]);
    }
    let attached = geodesic_bending(3.0) + bending(2.0) + length() + 1e3 * attachment();
    let ellipsoid = Quadric::ellipsoid(DVec3::new(2.0, 1.4, 1.1));
    on(&ellipsoid, Arc::new(ellipsoid.clone()), attached, Pins::Ends, 6, &[1]);
    // Surfaces given by WGSL code have kernels in f64 only.
    let torus = Torus::new(3.0, 1.5).unwrap();
    on(&torus, Arc::new(torus), geodesic_bending(2.0) + tautness(), Pins::All, 7, &[1, 8]);
    on(&torus, Arc::new(torus), geodesic_bending(2.0) + bending(2.0) + length(), Pins::All, 6, &[1]);
}
