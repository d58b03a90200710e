//! Tests that curves on the device begin as the host would begin them.

use super::super::descent_gpu::{DescentCurve, NUMBERS};
use super::super::setup::{PreparedCurve, set_up};
use super::super::{bending, length, tautness};
use super::*;
use crate::gpu::CapturedDispatch;
use crate::gpu::reflect::assert_layout;
use crate::gpu::testing::{gpu, precisions};
use crate::{CurveStatus, Sampling};

/// Open and closed random walks of 2 to 9 points.
fn walks<const D: usize>(curves: usize) -> CurveBatch {
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for i in 0..curves {
        let n = 2 + 5 * i % 8;
        closed.push(i % 3 == 0 && n > 2);
        for k in 0..n {
            let turn = (1.0 + i as f64) * (k as f64).sin();
            coords.extend((0..D).map(|c| 100.0 + k as f64 * [1.0, 0.3, 0.1][c] + [turn.cos(), turn.sin(), turn][c]));
        }
        offsets.push(coords.len() / D);
    }
    CurveBatch::from_ragged(D, coords, offsets).unwrap().closed_each(closed).unwrap()
}

/// The numbers of an array after a dispatch.
fn after(dispatch: &CapturedDispatch, name: &str, precision: Precision) -> Vec<f64> {
    let array = dispatch.buffers.iter().find(|array| array.name == name).unwrap();
    let bytes = array.after.as_ref().unwrap_or(&array.before);
    match precision {
        Precision::F64 => bytemuck::pod_collect_to_vec(bytes),
        _ => bytemuck::pod_collect_to_vec::<u8, f32>(bytes).into_iter().map(f64::from).collect(),
    }
}

fn check<const D: usize>(device: &Device, fair: &Fair, bound: f64) {
    let (batch, precision) = (walks::<D>(100), device.precision());
    let (_, dispatches) = device.as_gpu().unwrap().capture(|| fair.fit(&batch, device)).unwrap();
    let prepare = dispatches.iter().find(|dispatch| dispatch.entry == "prepare").expect("the batch is plain");
    let (fixed, lanes) = (after(prepare, "fixed", precision), after(prepare, "lanes", precision));
    let table = &prepare.buffers.iter().find(|array| array.name == "curves").unwrap().before;
    let table: Vec<DescentCurve> = bytemuck::pod_collect_to_vec(table);
    let ready = set_up::<D>(fair, &batch).unwrap();
    let mut problems: Vec<PreparedCurve<D>> = ready.into_iter().map(Result::unwrap).collect();
    problems.sort_by_key(|ready| (ready.problem.vertices(), ready.problem.closed));
    let composition = Composition::of(&fair.energy, 2, D, precision).unwrap();
    let (numbers, is_taut) = (NUMBERS + composition.width(), fair.energy.is_taut());
    let width = D + 2 + usize::from(is_taut);
    let mut worst = 0.0_f64;
    for (slot, PreparedCurve { problem, .. }) in problems.iter().enumerate() {
        let at = |row: usize, number: usize| fixed[table[slot].fixed_start as usize + (row * width + number) * GROUP];
        let (rows, h) = (problem.vertices(), problem.length() / problem.base.len() as f64);
        for (j, edge) in problem.base.iter().enumerate() {
            let apart = (0..D).map(|c| (at(j, c) - edge[c]).abs() / h).fold(0.0, f64::max);
            let free = problem.free[(j + 1) % rows];
            let taut = problem.taut.get(j).map_or(0.0, |taut| (at(j, D + 2) / taut - 1.0).abs());
            worst = [apart, (at(j, D) - free).abs(), taut].into_iter().fold(worst, f64::max);
        }
        for row in 0..rows {
            assert_eq!(at(row, D + 1) == 0.0, problem.pinned.contains(&(row as u32)), "slot {slot}, row {row}");
        }
        let own = &lanes[slot * numbers..(slot + 1) * numbers];
        let wanted = composition.entries(&problem.weights, problem.regularisation);
        for (found, wanted) in own[NUMBERS..].iter().zip(&wanted) {
            worst = worst.max((found / wanted - 1.0).abs());
        }
        worst = worst.max((own[0] / problem.highest - 1.0).abs());
        assert!(own[2] == problem.longest || (own[2] / problem.longest - 1.0).abs() < bound, "slot {slot}");
    }
    println!("{D}-D, {}, {precision:?}: {worst:.1e}", fair.energy);
    assert!(worst < bound, "{D}-D, {}, {precision:?}: {worst:e}", fair.energy);
}

#[test]
fn the_device_begins_plain_curves_as_the_host_does() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu);
    for precision in precisions(device.as_gpu().unwrap()) {
        let device = device.clone().with_precision(precision);
        // Sums of 16 edges, and differences of places of up to a span.
        let bound = if precision == Precision::F64 { 1e-12 } else { 1e-4 };
        for (energy, segments) in
            [(bending(2.0) + 0.1 * length(), 16), (bending(2.0) + tautness(), 7), (bending(2.0), 1)]
        {
            let fair = Fair { energy, segments: Segments::PerSpan(segments), ..Fair::default() };
            check::<2>(&device, &fair, bound);
            check::<3>(&device, &fair, bound);
        }
    }
}

#[test]
fn what_is_not_plain_or_crosses_is_fitted_beside_what_is() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu);
    // A repeated point, too few points, and one that is no number.
    let odd = CurveBatch::from_ragged(
        2,
        vec![0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 0.0, 5.0, 5.0, 0.0, 0.0, f64::NAN, 1.0, 2.0, 2.0],
        vec![0, 4, 5, 8],
    )
    .unwrap();
    let coords = [walks::<2>(40).coords(), odd.coords()].concat();
    let sizes =
        [walks::<2>(40), odd].map(|batch| (0..batch.len()).map(|i| batch.count(i)).collect::<Vec<_>>()).concat();
    let batch = CurveBatch::from_ragged(2, coords, ragged::offsets(sizes)).unwrap();
    for precision in precisions(device.as_gpu().unwrap()) {
        let device = device.clone().with_precision(precision);
        let [(cpu, wanted), (gpu, found)] = [Device::cpu(), device]
            .map(|device| Fair::default().fit_sampled(&batch, Sampling::PerSpan(16), &device).unwrap());
        let statuses = |fit: &crate::Fit| fit.reports().iter().map(|report| report.status).collect::<Vec<_>>();
        assert_eq!(statuses(&cpu), statuses(&gpu));
        assert!(statuses(&gpu).iter().filter(|status| **status == CurveStatus::Converged).count() > 35);
        assert_eq!(wanted.offsets(), found.offsets());
        let repeated = gpu.device().finished_on_cpu;
        println!("{precision:?}: the CPU finished {repeated} of {}", batch.len());
        assert!(repeated < batch.len() / 2, "{repeated}");
    }
}

#[test]
fn structs_are_those_of_the_kernels() {
    for precision in [Precision::F32, Precision::F64] {
        let [divide, prepare, list, _] = resident_kernels(precision).collect::<Vec<_>>().try_into().unwrap();
        assert_layout!(
            divide,
            ResidentParams {
                slots,
                splines,
                knots,
                dimension,
                segments,
                side,
                width,
                given,
                numbers,
                regularisation,
                most_iterations,
                per_group,
                ticks
            }
        );
        assert_layout!(list, DescentTask { slot, ticks });
        assert_layout!(
            prepare.clone(),
            DescentCurve { fixed_start, displacement_start, work_start, stride, segments, closed }
        );
        assert_layout!(
            prepare,
            DescentState { termination, iterations, evaluations, flags, since_best, most_iterations }
        );
    }
}
