//! Every kernel through a second WGSL compiler: dispatches are captured on this machine's adapter
//! and run again in headless Chromium's WebGPU by `tests/browser/run.mjs`, which compares the
//! buffers. Skipped with a notice where Chromium or its driver is absent.

use std::process::Command;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use faircurve::bezier::{Energy, Given, Polygons, complete, elevate};
use faircurve::discrete::{
    Evaluate, Fair, Segments, SpacingRegularisation, Want, bending, length, tension, torsion, variation,
};
use faircurve::gpu::reflect::Access;
use faircurve::gpu::{CapturedDispatch, Gpu};
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use faircurve::linalg::block_ring::{BlockBatch, solve_blocks_on_gpu};
use faircurve::linalg::ring::{RingKernel, solve_on_gpu};
use faircurve::linalg::{Cyclic, Matrix, TridiagonalBatch};
use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::spline::{Natural, Smoothing, SmoothingTarget, uniform};
use faircurve::{CurveBatch, Device, Precision, Sampling};
use rand::RngExt;
use serde_json::{Value, json};

use crate::common;
use crate::common::{gpu, seeded};

/// Two compilers may contract and reorder f32 operations differently; the systems here have
/// condition numbers below 10.
const TOLERANCE: f64 = 2e-5;

/// The smoothing kernel's scratch holds second derivatives and what they were made of side by side:
/// its words are measured by the largest of them, and agree to some 16 roundings of that.
const SCRATCH_TOLERANCE: f64 = 2e-6;

/// Under tension shapes end where a chord is closed to 256 ε, and second derivatives are good to 4,096 ε: the bound to
/// which `src/scf/gpu/tests/taut.rs` holds them in f32 against f64.
const TAUT_TOLERANCE: f64 = 4.9e-4;

/// Exit code of the script where there is no browser to run in.
const NO_BROWSER: i32 = 77;

#[test]
fn kernels_give_the_same_numbers_through_a_browsers_compiler() {
    let Some(gpu) = gpu() else { return };
    let captured = capture_everything(gpu);
    let kernels: std::collections::BTreeSet<&str> = captured.iter().map(|dispatch| dispatch.kernel.as_str()).collect();
    println!("{} dispatches of {} kernels", captured.len(), kernels.len());
    assert!(kernels.len() >= 12, "only {kernels:?}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("captured.json");
    let json: Vec<Value> = captured.iter().map(as_json).collect();
    std::fs::write(&file, serde_json::to_vec(&json).unwrap()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/browser/run.mjs");
    let required = std::env::var_os("FAIRCURVE_REQUIRE_BROWSER").is_some();
    let Ok(output) = Command::new("node").arg(script).arg(&file).output() else {
        assert!(!required, "FAIRCURVE_REQUIRE_BROWSER is set, but there is no node to drive a browser");
        println!("NOTICE: skipped, there is no node to drive a browser");
        return;
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    println!("{text}");
    match output.status.code() {
        Some(NO_BROWSER) if !required => println!("NOTICE: skipped, there is no browser with WebGPU"),
        code => assert_eq!(code, Some(0), "{text}"),
    }
}

/// Small problems that reach every kernel that has no subgroup operations (which browsers spell
/// differently).
fn capture_everything(gpu: Gpu) -> Vec<CapturedDispatch> {
    let gpu = gpu.without_subgroups().with_lanes(8);
    let mut captured = tridiagonal(&gpu);
    captured.extend(gpu.capture(|| block_rings(&gpu)).unwrap().1);
    let device = Device::from_gpu(gpu).with_precision(Precision::F32);
    let gpu = device.as_gpu().expect("it is one");
    captured.extend(gpu.capture(|| splines(&device)).unwrap().1);
    captured.extend(gpu.capture(|| discrete_energies(&device)).unwrap().1);
    captured.extend(gpu.capture(|| descents(&device)).unwrap().1);
    captured.extend(gpu.capture(|| segments(&device)).unwrap().1);
    captured.extend(gpu.capture(|| taut(&device)).unwrap().1);
    captured.extend(gpu.capture(|| beziers(&device)).unwrap().1);
    captured.extend(gpu.capture(|| grids(&device)).unwrap().1);
    captured
}

fn tridiagonal(gpu: &Gpu) -> Vec<CapturedDispatch> {
    let mut rng = seeded(11);
    let sizes = [1usize, 2, 3, 7, 8, 15, 40, 129, 300];
    let rows: usize = sizes.iter().sum();
    let mut offsets = vec![0];
    sizes.iter().for_each(|n| offsets.push(offsets[offsets.len() - 1] + n));
    let cyclic: Vec<bool> = (0..sizes.len()).map(|i| i % 2 == 0).collect();
    let mut numbers = |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(0.1..1.0)).collect() };
    let (excess, weights, rhs) = (numbers(rows), numbers(rows), numbers(3 * rows));
    let upper: Vec<f32> = weights.iter().map(|w| -w).collect();
    let diagonal = vec![3.0; rows];
    let bands = Matrix::Bands { lower: &upper, diagonal: &diagonal, upper: &upper };
    let network = Matrix::Network { excess: &excess, weights: &weights };
    let mut captured = Vec::new();
    for kernel in [RingKernel::Workgroup, RingKernel::Thread, RingKernel::Long] {
        for matrix in [bands, network] {
            let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic: Cyclic::Each(&cyclic) };
            let solve = || solve_on_gpu(gpu, Precision::F32, kernel, &systems, &rhs, 3);
            captured.extend(gpu.capture(solve).unwrap().1);
        }
    }
    captured
}

fn block_rings(gpu: &Gpu) -> faircurve::Result<()> {
    let mut rng = seeded(14);
    for (dimension, reach, lanes) in [(2, 2, 8), (2, 2, 64), (3, 3, 8)] {
        let sizes = [3usize, 4, 7, 16, 40];
        let mut offsets = vec![0];
        sizes.iter().for_each(|n| offsets.push(offsets[offsets.len() - 1] + n));
        let vertices = offsets[sizes.len()];
        let closed: Vec<bool> = (0..sizes.len()).map(|i| i % 2 == 0).collect();
        let movable: Vec<bool> = (0..vertices).map(|v| v % 6 != 1).collect();
        let mut blocks: Vec<f32> =
            (0..vertices * 4 * dimension * dimension).map(|_| rng.random_range(-0.05..0.05)).collect();
        for own in blocks.chunks_exact_mut(4 * dimension * dimension) {
            // The blocks on the diagonal are symmetric; a multiple of the unit one is.
            own[..dimension * dimension].fill(0.0);
            (0..dimension).for_each(|c| own[c * (dimension + 1)] = 2.0);
        }
        let rhs: Vec<f32> = (0..vertices * dimension).map(|_| rng.random_range(-1.0..1.0)).collect();
        let systems =
            BlockBatch { dimension, reach, offsets: &offsets, closed: &closed, blocks: &blocks, movable: &movable };
        let solutions = solve_blocks_on_gpu(gpu, Precision::F32, lanes, &systems, &rhs)?;
        assert!(solutions.pivots.iter().all(|&pivot| pivot > 0.1), "{:?}", solutions.pivots);
    }
    Ok(())
}

fn splines(device: &Device) -> faircurve::Result<()> {
    let mut rng = seeded(12);
    let curves: Vec<Vec<[f64; 2]>> =
        (2..12).map(|n| (0..n).map(|k| [k as f64, rng.random_range(-1.0..1.0)]).collect()).collect();
    let slices: Vec<&[[f64; 2]]> = curves.iter().map(Vec::as_slice).collect();
    let batch = CurveBatch::from_slices(&slices)?.closed_each((0..curves.len()).map(|i| i % 3 == 2).collect())?;
    for sampling in [Sampling::PerSpan(4), Sampling::Count(9)] {
        Natural::default().fit_sampled(&batch, sampling, device)?;
    }
    // Little smoothing, so that the system stays as well conditioned as the others.
    Smoothing { target: SmoothingTarget::Lambda(1e-4), ..Smoothing::default() }.fit(&batch, device)?;
    let coefficients = uniform::coefficients(&batch, device)?;
    uniform::interpolated(&coefficients, device)?;
    uniform::subdivide(&coefficients, 2, device)?;
    uniform::discrete_energies(&coefficients, 0, device)?;
    uniform::exact_energies(&coefficients, device)?;
    Ok(())
}

fn discrete_energies(device: &Device) -> faircurve::Result<()> {
    let mut rng = seeded(13);
    for dimension in [2, 3] {
        let batch = common::batches::walks(dimension, &[3, 7, 40], &mut rng);
        let direction: Vec<f64> = batch.coords().iter().map(|x| x.cos()).collect();
        let (weights, is_data) = (vec![1.0; batch.len()], vec![false; batch.total_points()]);
        let energy = length() + tension() + bending(2.7) + variation() + torsion();
        let regularisation = Some(SpacingRegularisation { weights: &weights, is_data: &is_data });
        for want in [Want::Value, Want::Slope(&direction), Want::Hessian] {
            energy.evaluate(&batch, Evaluate { want, regularisation, ..Evaluate::default() }, device)?;
        }
    }
    Ok(())
}

/// Segments that turn enough for second derivatives to keep their digits, some with an inflection.
/// By Newton's method with lanes that share a curve.
fn descents(device: &Device) -> faircurve::Result<()> {
    let batch = common::batches::walks(2, &[3, 4, 7], &mut seeded(17));
    let fair = Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(5), ..Fair::default() };
    // A step and a trial: what differs by rounding grows from step to step.
    Fair { max_iterations: 1, ..fair }.fit(&batch, device)?;
    Ok(())
}

fn segments(device: &Device) -> faircurve::Result<()> {
    let angles = [[1.0, -0.8], [0.9, -0.3], [0.7, 0.5], [-1.2, 0.4], [0.3, 1.1]];
    let exponents = [1.5, 2.0, 3.0];
    let query = |(exponent, angles)| Query { chord: 1.0, angles, exponent };
    let queries: Vec<Query> =
        exponents.into_iter().flat_map(|exponent| angles.map(|angles| query((exponent, angles)))).collect();
    let costs = evaluate_segments(&queries, device)?;
    assert!(costs.iter().all(Option::is_some), "{costs:?}");
    Ok(())
}

/// A curve under tension whose spans become others on the way, so that the host is asked.
fn taut(device: &Device) -> faircurve::Result<()> {
    let points = [[0.0, 0.0], [1.0, 0.0], [1.1, 0.1], [0.0, 0.4], [0.2, 1.0], [2.0, 1.0]];
    let smooth = Smooth { exponent: 3.0, tension: 1.0, ..Smooth::default() };
    let fit = smooth.fit(&CurveBatch::from_slices(&[&points[..]])?, device)?;
    assert_eq!(fit.usable(), 1, "{:?}", fit.reports());
    Ok(())
}

/// Completions of degrees whose energies are small numbers still, and elevations, in every
/// dimension.
fn beziers(device: &Device) -> faircurve::Result<()> {
    let mut rng = seeded(15);
    for dimension in 1..=4 {
        let (mut known, mut offsets) = (Vec::new(), vec![0]);
        for i in 0..200 {
            known.extend((0..3 + i % 3).map(|k| k != 1 + i % 2));
            offsets.push(known.len());
        }
        let coords: Vec<f64> = (0..known.len() * dimension).map(|_| rng.random_range(-1.0..1.0)).collect();
        let polygons = Polygons { dimension, coords: &coords, offsets: &offsets };
        let given = Given { known: Some(&known), ..Given::default() };
        let solved = complete(&polygons, &given, &Energy::bending(), device)?;
        assert!(solved.refusals.is_empty(), "{:?}", solved.refusals);
        elevate(&polygons, 2, device)?;
    }
    Ok(())
}

/// Grids of a few shapes, by both rules.
fn grids(device: &Device) -> faircurve::Result<()> {
    let mut rng = seeded(16);
    let shapes = [[2, 2], [3, 8], [9, 9], [12, 5], [9, 9]];
    for dimension in [1, 3] {
        let count: usize = shapes.iter().map(|[rows, columns]| rows * columns * dimension).sum();
        let values = (0..count).map(|_| rng.random_range(-1.0..1.0)).collect();
        let grids = Grids::new(dimension, shapes.to_vec(), values)?;
        for rule in [Rule::Exact, Rule::Sparse(SparseRule::of_support(5, Reproduces::Constants)?)] {
            let fine = Subdivide { rule, rounds: 2 }.fit(&grids, device)?;
            assert_eq!(fine.usable(), shapes.len());
        }
    }
    Ok(())
}

/// The largest magnitude among the numbers a dispatch wrote.
fn largest(dispatch: &CapturedDispatch) -> f64 {
    let written = dispatch.buffers.iter().filter(|buffer| buffer.name != "status").filter_map(|b| b.after.as_ref());
    let words = written.flat_map(|bytes| bytes.as_chunks::<4>().0);
    words.map(|word| f64::from(f32::from_le_bytes(*word)).abs()).filter(|x| x.is_finite()).fold(0.0, f64::max)
}

fn as_json(dispatch: &CapturedDispatch) -> Value {
    let smoothing = dispatch.kernel.starts_with("spline/reinsch");
    let scratch = SCRATCH_TOLERANCE * largest(dispatch);
    let is_evaluation = dispatch.kernel.starts_with("scf/evaluation");
    let taut = is_evaluation && dispatch.buffers.iter().any(|buffer| buffer.name == "shapes");
    let tolerance = if smoothing {
        scratch
    } else if taut {
        TAUT_TOLERANCE
    } else {
        TOLERANCE
    };
    let buffers: Vec<Value> = dispatch
        .buffers
        .iter()
        .map(|buffer| {
            let kind = match buffer.access {
                Access::Uniform => "uniform",
                Access::Read => "read",
                Access::ReadWrite => "read_write",
            };
            let words = if buffer.name == "status" { "u32" } else { "f32" };
            let after = buffer.after.as_ref().map(|bytes| STANDARD.encode(bytes));
            let before = STANDARD.encode(&buffer.before);
            // That of descents holds blocks of Hessians, and what is left of them.
            let tolerance = if buffer.name == "work" { scratch } else { tolerance };
            json!({"group": 0, "binding": buffer.binding, "kind": kind, "words": words, "before": before, "after": after,
                   "tolerance": tolerance})
        })
        .collect();
    json!({"kernel": dispatch.kernel, "wgsl": dispatch.wgsl, "entry": dispatch.entry, "constants": {},
           "groups": dispatch.groups, "tolerance": tolerance, "buffers": buffers})
}
