//! Tests that a curve does not depend on how its ticks are divided, on its neighbours, or on their
//! fate.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::discrete::descent_gpu::packing::DescentCurve;
use crate::discrete::descent_gpu::turns::loop_turns;
use crate::discrete::variation;
use crate::gpu::plan::Limits;
use crate::gpu::reflect::assert_layout;

pub(super) fn bits<const D: usize>(outcome: &Outcome<D>) -> (Vec<u64>, String) {
    let displacements = outcome.displacements.iter().flatten().map(|x| x.to_bits()).collect();
    let Outcome { termination, energy, norm, iterations, evaluations, .. } = outcome;
    (displacements, format!("{termination:?} {:x} {:x} {iterations} {evaluations}", energy.to_bits(), norm.to_bits()))
}

const SOLVERS: [Solver; 2] = [Solver::Sobolev, Solver::Newton];

/// Every solver in every precision of the adapter.
fn both(gpu: &Gpu) -> Vec<(Solver, Precision)> {
    SOLVERS.into_iter().flat_map(|solver| precisions(gpu).into_iter().map(move |p| (solver, p))).collect()
}

fn ragged_problems(seed: u64) -> (Fair, Vec<Problem<2>>) {
    let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(6), ..sobolev() };
    // More than two workgroups. The last one is not full.
    let sizes: Vec<usize> = RAGGED.into_iter().cycle().take(2 * GROUP + 5).collect();
    let problems = problems::<2>(&fair, &batch::<2>(&sizes, |i| i % 2 == 1, seed));
    (fair, problems)
}

#[test]
fn a_descent_has_the_same_bits_however_its_ticks_are_divided() {
    let Some(gpu) = gpu() else { return };
    let (fair, mut problems_of_all) = ragged_problems(51);
    // llvmpipe would not finish 64 ticks of this curve in one dispatch.
    let long = Fair { segments: Segments::PerSpan(100), ..fair.clone() };
    problems_of_all.extend(problems::<2>(&long, &batch::<2>(&[5], |_| true, 55)));
    for (solver, precision) in both(&gpu) {
        let plan = Plan { solver, ..plan_of(&fair) };
        let problems = loosened(&problems_of_all, precision);
        let run = |most_ticks: u32, ended: &mut Vec<usize>| {
            let run = Run {
                gpu: &gpu,
                precision,
                plan: &plan,
                energy: &fair.energy,
                problems: &refs(&problems),
                most_ticks,
                lanes: None,
            };
            run.descend(&mut |count| ended.push(count), &|_, _| {}).unwrap()
        };
        let mut counts = [Vec::new(), Vec::new(), Vec::new()];
        let whole = run(64, &mut counts[0]);
        for (k, most_ticks) in [(1, 1), (2, 7)] {
            let divided = run(most_ticks, &mut counts[k]);
            for (i, (a, b)) in whole.iter().zip(&divided).enumerate() {
                assert_eq!(bits(a), bits(b), "{solver:?} {precision:?}, {most_ticks} ticks a dispatch, curve {i}");
            }
        }
        // Curves end at different ticks, and every one is reported once.
        assert!(counts[1].len() > 3, "{counts:?}");
        counts.iter().for_each(|ended| assert_eq!(ended.iter().sum::<usize>(), problems.len()));
    }
}

#[test]
fn a_curve_has_the_same_bits_whatever_its_neighbours() {
    let Some(gpu) = gpu() else { return };
    let (fair, problems) = ragged_problems(52);
    for (solver, precision) in both(&gpu) {
        let plan = Plan { solver, ..plan_of(&fair) };
        let problems = loosened(&problems, precision);
        let together = descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap();
        let backwards: Vec<_> = problems.iter().rev().cloned().collect();
        let backwards = descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&backwards), &|_, _| {}).unwrap();
        for (i, (a, b)) in together.iter().zip(backwards.iter().rev()).enumerate() {
            assert_eq!(bits(a), bits(b), "{solver:?} {precision:?}, curve {i} of the batch and of its reverse");
        }
        for i in [0, 1, 20] {
            let alone =
                descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&problems[i..=i]), &|_, _| {}).unwrap();
            assert_eq!(bits(&together[i]), bits(&alone[0]), "{solver:?} {precision:?}, curve {i} alone");
        }
    }
}

#[test]
fn a_curve_that_is_no_number_breaks_and_leaves_its_neighbours_bits() {
    let Some(gpu) = gpu() else { return };
    let (fair, problems) = ragged_problems(53);
    for (solver, precision) in both(&gpu) {
        let plan = Plan { solver, ..plan_of(&fair) };
        let sound = loosened(&problems, precision);
        let mut spoilt = sound.clone();
        let (nan, infinite, nothing) = (9, 12, 3);
        spoilt[nan].base[2][1] = f64::NAN;
        spoilt[infinite].base[2][1] = f64::INFINITY;
        spoilt[nothing].base[1] = [0.0; 2];
        let wanted = descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&sound), &|_, _| {}).unwrap();
        let found = descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&spoilt), &|_, _| {}).unwrap();
        for i in 0..found.len() {
            if [nan, infinite, nothing].contains(&i) {
                assert_eq!(found[i].termination, TerminationStatus::Broken, "{solver:?} {precision:?}, curve {i}");
                assert!(!found[i].energy.is_finite(), "{solver:?} {precision:?}, curve {i}");
                assert!(
                    found[i].displacements.iter().flatten().all(|&x| x == 0.0),
                    "{solver:?} {precision:?}, curve {i}"
                );
            } else {
                assert_eq!(bits(&wanted[i]), bits(&found[i]), "{solver:?} {precision:?}, curve {i}");
            }
        }
    }
}

#[test]
fn what_the_iterations_or_the_length_end_is_said_as_by_the_cpu() {
    let Some(gpu) = gpu() else { return };
    // Hairpins, for which bending alone has no minimum, and a curve that runs out of iterations.
    let hairpin = [0.0, 0.0, 1.0, 0.05, 0.0, 0.1, 1.0, 0.15, 0.0, 0.2];
    let batch = CurveBatch::from_ragged(2, hairpin.to_vec(), vec![0, 5]).unwrap();
    let fair = Fair { energy: bending(2.0), segments: Segments::PerSpan(8), ..sobolev() };
    let bounded = Fair { energy: bending(2.0) + length(), max_iterations: 3, ..fair.clone() };
    let fairs = [Fair { max_iterations: 5000, ..fair }, bounded];
    for (fair, solver) in fairs.into_iter().flat_map(|fair| SOLVERS.map(|solver| (fair.clone(), solver))) {
        let fair = Fair { solver, ..fair };
        let (plan, problems) = (plan_of(&fair), problems::<2>(&fair, &batch));
        let wanted = &descend_on_cpu(&plan, &fair.energy, &refs(&problems), &|_, _| {})[0];
        assert!(
            [TerminationStatus::Unbounded, TerminationStatus::Exhausted].contains(&wanted.termination),
            "{:?}",
            wanted.termination
        );
        for precision in precisions(&gpu) {
            let found = &descend_on_gpu(&gpu, precision, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap()[0];
            assert_eq!(found.termination, wanted.termination, "{} {solver:?} {precision:?}", fair.energy);
        }
    }
}

#[test]
fn curves_up_to_the_longest_for_a_thread_descend_there_and_longer_ones_on_the_host() {
    let Some(gpu) = gpu() else { return };
    // 5 (n + 8) turns for n vertices.
    let longest = LOOP_TURNS / 5 - 8;
    assert!(loop_turns(2, 1, longest) <= LOOP_TURNS && loop_turns(2, 1, longest + 1) > LOOP_TURNS);
    let spans = 4;
    let n = (longest - 1) / spans;
    let fair = Fair { energy: bending(2.0) + length(), ..sobolev() };
    let fair_of = |n: usize| Fair { segments: Segments::PerSpan(n), ..fair.clone() };
    let batch = batch::<2>(&[5], |_| false, 61);
    let mut mixed = problems::<2>(&fair_of(n + 1), &batch);
    mixed.extend(problems::<2>(&fair_of(n), &batch));
    mixed.extend(problems::<2>(&fair_of(3), &batch));
    // Above the rounding of the host for this number of vertices.
    mixed.iter_mut().for_each(|problem| problem.tolerance = 1e-5);
    let plan = plan_of(&fair);
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(&mixed), &|_, _| {});
    for precision in precisions(&gpu).into_iter().filter(|p| *p == Precision::F64) {
        let run = Run {
            gpu: &gpu,
            precision,
            plan: &plan,
            energy: &fair.energy,
            problems: &refs(&mixed),
            most_ticks: MOST_TICKS,
            lanes: None,
        };
        let mut on_device = 0;
        let found = run.descend(&mut |count| on_device += count, &|_, _| {}).unwrap();
        assert_eq!(on_device, 2);
        for (i, (wanted, found)) in wanted.iter().zip(&found).enumerate() {
            assert_eq!(
                (wanted.termination, found.termination),
                (TerminationStatus::Converged, TerminationStatus::Converged),
                "curve {i}"
            );
            let off = (wanted.energy - found.energy).abs() / wanted.energy;
            assert!(off < 1e-9, "curve {i} of {} edges: {off:e}", mixed[i].base.len());
        }
    }
}

#[test]
fn energies_of_order_3_are_descended_by_the_host() {
    let Some(gpu) = gpu() else { return };
    let fair = Fair { energy: variation() + length(), segments: Segments::PerSpan(4), ..sobolev() };
    let (plan, problems) = (plan_of(&fair), problems::<2>(&fair, &batch::<2>(&[4, 5], |i| i == 1, 71)));
    let wanted = descend_on_cpu(&plan, &fair.energy, &refs(&problems), &|_, _| {});
    let found = descend_on_gpu(&gpu, Precision::F32, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap();
    assert!(
        wanted.iter().zip(&found).all(|(a, b)| bits(a) == bits(b) && a.termination == TerminationStatus::Converged)
    );
}

#[test]
fn what_was_finished_before_the_device_was_lost_is_kept() {
    let Some(gpu) = gpu() else { return };
    // One chunk per workgroup.
    let limits = Limits { chunk_bytes: 1, ..*gpu.limits() };
    let gpu = gpu.with_limits(limits);
    let (fair, problems) = ragged_problems(91);
    let (plan, problems) = (plan_of(&fair), loosened(&problems, Precision::F32));
    let whole = descend_on_gpu(&gpu, Precision::F32, &plan, &fair.energy, &refs(&problems), &|_, _| {}).unwrap();
    let run = Run {
        gpu: &gpu,
        precision: Precision::F32,
        plan: &plan,
        energy: &fair.energy,
        problems: &refs(&problems),
        most_ticks: MOST_TICKS,
        lanes: None,
    };
    // The device is lost when the first workgroup is back and the second is running.
    let back = AtomicUsize::new(0);
    let found = run
        .descend(&mut |_| {}, &|_, _| {
            if back.fetch_add(1, Ordering::Relaxed) + 1 == GROUP {
                gpu.wgpu_device().destroy();
            }
        })
        .unwrap();
    let kept = whole.iter().zip(&found).filter(|(a, b)| bits(a) == bits(b)).count();
    let lost: Vec<_> = found.iter().filter(|outcome| outcome.termination == TerminationStatus::Running).collect();
    assert_eq!((kept, lost.len()), (GROUP, problems.len() - GROUP));
    assert!(lost.iter().all(|outcome| outcome.displacements.iter().flatten().all(|&x| x == 0.0)));
    let error = run.descend(&mut |_| {}, &|_, _| {}).unwrap_err();
    assert!(error.to_string().starts_with("the device was lost"), "{error}");
}

#[test]
fn curves_too_long_for_a_thread_descend_with_lanes() {
    let Some(gpu) = gpu() else { return };
    let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(3100), ..Fair::default() };
    let mut own = problems::<2>(&fair, &batch::<2>(&[5, 5], |i| i == 1, 61));
    // Above rounding for this number of vertices.
    own.iter_mut().for_each(|problem| problem.tolerance = 1e-5);
    let plan = plan_of(&fair);
    let all = refs(&own);
    let wanted = descend_on_cpu(&plan, &fair.energy, &all, &|_, _| {});
    for precision in precisions(&gpu).into_iter().filter(|p| *p == Precision::F64) {
        let most_ticks = MOST_TICKS;
        let run = |lanes: usize| {
            let energy = &fair.energy;
            Run { gpu: &gpu, precision, plan: &plan, energy, problems: &all, most_ticks, lanes: Some(lanes) }
        };
        let (alone, shared) = (run(1), run(8));
        assert!((0..2).all(|i| alone.turns(1, i) > LOOP_TURNS));
        assert!((0..2).all(|i| shared.turns(8, i) <= LOOP_TURNS));
        let (mut ended, found) = (0, shared);
        let found = found.descend(&mut |more| ended += more, &|_, _| {}).unwrap();
        assert_eq!(ended, 2, "on the device");
        for (wanted, found) in wanted.iter().zip(&found) {
            assert_eq!((found.termination, found.iterations), (wanted.termination, wanted.iterations));
            let pairs = wanted.displacements.iter().flatten().zip(found.displacements.iter().flatten());
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-7, "{apart:e}");
        }
    }
}

#[test]
fn threads_of_a_workgroup_share_the_ticks_of_its_longest_curve() {
    let turns = [vec![100; GROUP], vec![5000; 2], vec![LOOP_TURNS; 1]].concat();
    let slots: Vec<u32> = (0..turns.len() as u32).collect();
    let tasks = tasks(&slots, &turns, MOST_TICKS);
    assert!(tasks[..GROUP].iter().all(|task| task.ticks == MOST_TICKS));
    assert!(tasks[GROUP..].iter().all(|task| task.ticks == 1));
    let without: Vec<u32> = slots[..GROUP + 2].to_vec();
    assert_eq!(super::tasks(&without, &turns, MOST_TICKS)[GROUP].ticks, 12);
}

#[test]
fn structs_are_those_of_the_kernel() {
    let key = descent_kernels(Precision::F32).remove(0);
    assert_layout!(key, DescentParams { tasks, numbers, ticks, lanes });
    assert_layout!(key, DescentTask { slot, ticks });
    assert_layout!(key, DescentCurve { fixed_start, displacement_start, work_start, stride, segments, closed });
    assert_layout!(key, DescentState { termination, iterations, evaluations, flags, since_best, most_iterations });
}
