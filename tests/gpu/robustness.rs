//! What can go wrong with a GPU: every failure is an error with a sentence, or the status of a
//! curve, never a panic.

use faircurve::bezier::Complete;
use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::gpu::plan::Limits;
use faircurve::gpu::{AdapterSummary, Gpu, Interrupted, Pending, once, pipeline};
use faircurve::laplacian::{Rule, Subdivide};
use faircurve::linalg::ring::{RingKernel, solve_on_gpu};
use faircurve::linalg::{Cyclic, Matrix, TridiagonalBatch};
use faircurve::spline::{Natural, Smoothing, SmoothingTarget, uniform};
use faircurve::{Choice, Costs, CurveBatch, CurveReport, CurveStatus, Device, Error, Grids, Precision, Sampling, Work};

use crate::common::batches::walks;
use crate::common::conform::{Outcome, Unit, conform};
use crate::common::{gpu, seeded, tolerance};

fn batch() -> CurveBatch {
    walks(2, &(1..=16).collect::<Vec<_>>(), &mut seeded(301))
}

fn sampled(batch: &CurveBatch, device: &Device) -> faircurve::Result<Outcome> {
    let (fit, samples) = Natural::default().fit_sampled(batch, Sampling::PerSpan(4), device)?;
    Ok(Outcome::of_curves(&samples, fit.reports()))
}

#[test]
fn an_adapter_that_is_not_there_is_refused_with_those_that_are() {
    let Some(_) = gpu() else { return };
    let last = faircurve::gpu::adapters().len() - 1;
    let error = Gpu::open(99).unwrap_err().to_string();
    let there = match last {
        0 => "there is one adapter, gpu:0; `gpu::adapters` describes it".to_string(),
        _ => format!("the adapters are gpu:0 … gpu:{last}; `gpu::adapters` lists them"),
    };
    let wanted = format!("no usable GPU: gpu:99 was asked for, but {there}");
    assert_eq!(error, wanted);
    assert_eq!(Device::gpu(99).unwrap_err().to_string(), wanted);
}

/// NVIDIA's driver gave no adapter to a process that had opened and closed some 28 devices.
#[test]
fn forty_devices_open_one_after_another() {
    let Some(_) = gpu() else { return };
    for k in 0..40 {
        Gpu::open(0).unwrap_or_else(|error| panic!("device {k}: {error}"));
    }
}

#[test]
fn a_device_lost_before_the_work_is_an_error_with_its_reason() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu);
    let batch = batch();
    // Kernels are compiled while the device lives, and are refused afterwards all the same.
    sampled(&batch, &device).unwrap();
    let gpu = device.as_gpu().expect("it is one");
    gpu.wgpu_device().destroy();
    type Work<'a> = (&'a str, &'a dyn Fn() -> faircurve::Result<()>);
    let works: [Work<'_>; 6] = [
        ("fit", &|| Natural::default().fit(&batch, &device).map(drop)),
        ("samples", &|| sampled(&batch, &device).map(drop)),
        ("coefficients", &|| uniform::coefficients(&batch, &device).map(drop)),
        ("subdivision", &|| uniform::subdivide(&batch, 2, &device).map(drop)),
        ("energies", &|| uniform::exact_energies(&batch, &device).map(drop)),
        ("solve", &|| {
            let matrix = Matrix::Network { excess: &[1.0; 3], weights: &[1.0; 3] };
            let systems = TridiagonalBatch { matrix, offsets: &[0, 3], cyclic: Cyclic::All };
            solve_on_gpu(gpu, Precision::F32, RingKernel::Auto, &systems, &[1.0_f64; 3], 1).map(drop)
        }),
    ];
    for (what, work) in works {
        let error = work().expect_err(what);
        assert!(matches!(error, Error::DeviceLost(_)), "{what}: {error}");
        let text = error.to_string();
        assert!(text.starts_with("the device was lost: "), "{what}: {text}");
        assert!(text.ends_with("; run again, or use the CPU"), "{what}: {text}");
    }
    assert!(gpu.lost().is_some_and(|reason| reason.contains("Destroyed")), "{:?}", gpu.lost());
}

#[test]
fn chunks_finished_before_the_device_was_lost_are_kept() {
    let Some(gpu) = gpu() else { return };
    let mut finished = Vec::new();
    let result = pipeline(
        vec![0..1, 1..2, 2..3, 3..4],
        |chunk| {
            let mut recording = gpu.record(Precision::F32);
            let array = recording.upload(&[chunk.start as u32; 64]);
            recording.download(&array);
            recording.submit()
        },
        once(Pending::wait),
        |chunk, arrays| {
            assert_eq!(arrays[0].as_slice::<u32>(), [chunk.start as u32; 64]);
            finished.push(chunk.clone());
            if chunk.end == 2 {
                gpu.wgpu_device().destroy();
            }
            Ok(())
        },
    );
    let Err(Interrupted { error, finished: first_left }) = result else { panic!("the device was lost") };
    assert!(matches!(error, Error::DeviceLost(_)), "{error}");
    // The third chunk may have ended well, being under way.
    assert!((2..=3).contains(&first_left), "{first_left}");
    assert_eq!(finished.last().map(|chunk| chunk.end), Some(first_left));
}

#[test]
fn a_fit_interrupted_by_the_loss_of_the_device_keeps_what_it_has() {
    for moment in [0.1, 0.4, 0.8] {
        let Some(gpu) = gpu() else { return };
        let limits = Limits { chunk_bytes: 2000, ..*gpu.limits() };
        interrupt(&Device::from_gpu(gpu.with_limits(limits)), moment);
    }
}

/// Does some work while the device is lost, after that share of the time it takes: before, between
/// or after its chunks.
fn losing<T>(device: &Device, moment: f64, work: &dyn Fn(&Device) -> faircurve::Result<T>) -> Option<T> {
    let start = std::time::Instant::now();
    work(device).unwrap();
    let wait = start.elapsed().mul_f64(moment);
    let lost = device.as_gpu().expect("it is one").wgpu_device().clone();
    let killer = std::thread::spawn(move || {
        std::thread::sleep(wait);
        lost.destroy();
    });
    let result = work(device);
    killer.join().unwrap();
    if let Err(error) = &result {
        println!("lost before the first chunk: {error}");
        assert!(matches!(error, Error::DeviceLost(_)), "{error}");
    }
    result.ok()
}

/// What a method says of every curve.
type Said = Vec<(CurveStatus, Option<String>)>;

#[test]
fn every_method_with_a_status_a_curve_keeps_what_was_finished_before_the_device_was_lost() {
    let batch = walks(2, &(3..=12).cycle().take(300).collect::<Vec<_>>(), &mut seeded(306));
    let polygons = walks(2, &(3..=12).cycle().take(4000).collect::<Vec<_>>(), &mut seeded(307));
    let grids = Grids::new(1, vec![[4, 5]; 400], (0..8000).map(f64::from).collect()).unwrap();
    let said = |reports: &[CurveReport]| reports.iter().map(|own| (own.status, own.message.clone())).collect();
    let smoothing = Smoothing { target: SmoothingTarget::Lambda(0.1), ..Smoothing::default() };
    let solve = |device: &Device| {
        let matrix = Matrix::Network { excess: &[1.0; 9000], weights: &[1.0; 9000] };
        let offsets: Vec<usize> = (0..=900).map(|i| 10 * i).collect();
        let systems = TridiagonalBatch { matrix, offsets: &offsets, cyclic: Cyclic::None };
        let gpu = device.as_gpu().expect("it is one");
        let solved = solve_on_gpu(gpu, Precision::F32, RingKernel::Auto, &systems, &[1.0_f64; 9000], 1)?;
        assert!((0..900).all(|i| solved.x[10 * i].is_nan() == (solved.status[i] == CurveStatus::NotConverged)));
        Ok(solved.status.into_iter().map(|status| (status, None)).collect())
    };
    let subdivide = |device: &Device| {
        let subdivided = Subdivide { rule: Rule::Exact, rounds: 2 }.fit(&grids, device)?;
        Ok(subdivided.reports().iter().map(|own| (own.status, own.message.clone())).collect())
    };
    type Method<'a> = (&'a str, &'a dyn Fn(&Device) -> faircurve::Result<Said>);
    let methods: [Method<'_>; 4] = [
        ("smoothing", &|device| smoothing.fit(&batch, device).map(|fit| said(fit.reports()))),
        ("bezier", &|device| Complete::default().fit(&polygons, device).map(|fit| said(fit.reports()))),
        ("grids", &subdivide),
        ("systems", &solve),
    ];
    for (what, method) in methods {
        for moment in [0.4, 0.8] {
            let Some(gpu) = gpu() else { return };
            let limits = Limits { chunk_bytes: 2000, ..*gpu.limits() };
            let device = Device::from_gpu(gpu.with_limits(limits));
            let whole = method(&device).unwrap();
            let Some(found) = losing(&device, moment, method) else { continue };
            let left = found.iter().zip(&whole).filter(|(found, whole)| found != whole);
            println!("{what}: {} of {} are left", left.clone().count(), whole.len());
            for ((status, message), _) in left {
                assert_eq!(*status, CurveStatus::NotConverged, "{what}");
                let is_told = message.as_ref().is_some_and(|message| message.contains(": the device was lost"));
                assert_eq!(is_told, what != "systems", "{what}: {message:?}");
            }
        }
    }
}

fn interrupt(device: &Device, moment: f64) {
    let batch = walks(2, &(2..=16).cycle().take(900).collect::<Vec<_>>(), &mut seeded(302));
    let whole = sampled(&batch, device).unwrap();
    let Some(fit) = losing(device, moment, &|device| Natural::default().fit(&batch, device)) else { return };
    let first_left = (0..batch.len()).find(|&i| fit.reports()[i].status != whole.status[i]);
    println!("lost at curve {first_left:?} of {}", batch.len());
    let samples = fit.polylines(Sampling::PerSpan(4));
    for i in 0..first_left.unwrap_or(batch.len()) {
        assert_eq!(samples.points(i).len(), whole.curve(i).len(), "curve {i}");
        let far = samples.points(i).iter().zip(whole.curve(i)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far <= 1e-5, "curve {i}: {far}");
    }
    for i in first_left.unwrap_or(batch.len())..batch.len() {
        let report = &fit.reports()[i];
        assert_eq!(report.status, CurveStatus::NotConverged, "curve {i}");
        let message = report.message.as_deref().expect("a sentence");
        let wanted = format!("curve {i}, point 0: it was not fitted: the device was lost: ");
        assert!(message.starts_with(&wanted), "{message}");
        assert_eq!(samples.points(i), batch.points(i), "an unfitted curve is its polyline");
    }
}

#[test]
fn a_curve_larger_than_the_device_takes_is_refused_with_sizes() {
    let Some(gpu) = gpu() else { return };
    let limits = Limits { binding_bytes: 4096, ..*gpu.limits() };
    let device = Device::from_gpu(gpu.with_limits(limits)).with_precision(Precision::F32);
    let batch = walks(2, &[3, 700], &mut seeded(303));
    let refused = |result: faircurve::Result<()>| {
        let error = result.expect_err("it is too large");
        assert!(matches!(error, Error::Limit { .. }), "{error}");
        error.to_string()
    };
    let remedy = "but the device allows 4096: fit it on the CPU, or with fewer samples";
    let fit = refused(Natural::default().fit(&batch, &device).map(drop));
    assert_eq!(fit, format!("curve 2 with 700 points needs 5600, {remedy}"));
    let values = refused(uniform::interpolated(&batch, &device).map(drop));
    assert_eq!(values, format!("curve 2 with 700 points needs 5600, {remedy}"));
    // Four rounds make sixteen times as many.
    let small = walks(2, &[40], &mut seeded(304));
    let finer = refused(uniform::subdivide(&small, 4, &device).map(drop));
    assert_eq!(finer, format!("curve 0 with 40 points needs 5120, {remedy}"));
    let gpu = device.as_gpu().expect("it is one");
    let matrix = Matrix::Network { excess: &[1.0; 600], weights: &[1.0; 600] };
    let systems = TridiagonalBatch { matrix, offsets: &[0, 600], cyclic: Cyclic::None };
    let solve = solve_on_gpu(gpu, Precision::F32, RingKernel::Auto, &systems, &[1.0_f64; 1200], 2).map(drop);
    assert_eq!(refused(solve), format!("curve 0 with 600 points needs 4800, {remedy}"));
}

/// A device as a host program opens it: nothing but what every adapter has.
fn bare() -> Option<Gpu> {
    gpu()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let (device, queue) = pollster::block_on(adapters[0].request_device(&wgpu::DeviceDescriptor::default())).unwrap();
    Some(Gpu::from_wgpu(device, queue))
}

#[test]
fn a_borrowed_device_without_any_feature_computes_in_f32_and_says_that_it_has_no_f64() {
    let Some(gpu) = bare() else { return };
    let summary = gpu.summary().clone();
    assert!(!summary.has_f64 && !summary.has_subgroups && !summary.has_timestamps, "{summary:?}");
    let device = Device::from_gpu(gpu.with_poisoned_arrays());
    let batch = batch();
    conform("bare device", &device, tolerance::SPLINE, Unit::Size(2), |device| sampled(&batch, device).unwrap());
    let asked = device.clone().with_precision(Precision::F64);
    let wanted =
        format!("no usable GPU: {} has no 64-bit floats; use `Precision::F32`, or `Device::cpu`", summary.name);
    assert_eq!(sampled(&batch, &asked).unwrap_err().to_string(), wanted);
    assert_eq!(uniform::coefficients(&batch, &asked).unwrap_err().to_string(), wanted);
    // The solver takes the precision itself: the compiler refuses what the device lacks.
    let matrix = Matrix::Network { excess: &[1.0; 3], weights: &[1.0; 3] };
    let systems = TridiagonalBatch { matrix, offsets: &[0, 3], cyclic: Cyclic::None };
    let gpu = device.as_gpu().expect("it is one");
    let error = solve_on_gpu(gpu, Precision::F64, RingKernel::Auto, &systems, &[1.0_f64; 3], 1).unwrap_err();
    assert!(matches!(error, Error::Kernel { .. }), "{error}");
    // And goes on afterwards.
    solve_on_gpu(gpu, Precision::F32, RingKernel::Auto, &systems, &[1.0_f64; 3], 1).unwrap();
}

#[test]
fn arrays_that_no_kernel_wrote_are_not_a_number_where_that_is_asked_for() {
    let (Some(plain), Some(poisoned)) = (gpu(), gpu()) else { return };
    let poisoned = poisoned.with_poisoned_arrays();
    let contents = |gpu: &Gpu| {
        let mut recording = gpu.record(Precision::F32);
        let array = recording.storage(64);
        recording.download(&array);
        recording.submit().unwrap().wait().unwrap()[0].as_slice::<u32>().to_vec()
    };
    assert_eq!(contents(&plain), [0; 16]);
    let found = contents(&poisoned);
    assert!(found.iter().all(|&word| f32::from_bits(word).is_nan()));
    assert!(f64::from_bits(u64::from(found[1]) << 32 | u64::from(found[0])).is_nan());
}

#[test]
fn a_second_fit_of_the_same_kind_makes_no_arrays_and_has_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu);
    let batch = batch();
    let fair =
        Fair { energy: bending(2.0) + length(), segments: Segments::PerSpan(4), max_iterations: 30, ..Fair::default() };
    let made = || device.as_gpu().expect("it is one").arrays_made();
    let fit = || {
        let (fairs, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(4), &device).unwrap();
        let both = [sampled(&batch, &device).unwrap(), Outcome::of_curves(&samples, fairs.reports())];
        both.map(|outcome| (0..batch.len()).map(|i| outcome.bits(i)).collect::<Vec<_>>())
    };
    let first = (fit(), made());
    let second = (fit(), made());
    assert!(first == second, "{} arrays at first, {} after", first.1, second.1);
    // Another kind in between leaves its numbers where the next has its own.
    Smoothing { target: SmoothingTarget::Lambda(0.1), ..Smoothing::default() }.fit(&batch, &device).unwrap();
    assert!(fit() == first.0);
}

/// Positions of samples are computed on the device: its host sends knots alone.
#[test]
fn a_fit_with_samples_is_one_submission_of_knots_and_samples() {
    let Some(gpu) = gpu() else { return };
    let (points, samples) = (10, 80);
    let batch = walks(2, &vec![points; 500], &mut seeded(302));
    let curves = batch.len();
    let device = Device::from_gpu(gpu).with_precision(Precision::F32);
    Natural::default().fit_sampled(&batch, Sampling::Count(samples), &device).unwrap();
    let traffic = device.as_gpu().expect("it is one").take_traffic();
    println!("{traffic:?}");
    assert_eq!(traffic.submissions, 1);
    assert!(traffic.dispatches <= 8, "{traffic:?}");
    // A closed curve has its first knot again at its end.
    let knots = curves * points + (0..curves).filter(|&i| batch.is_closed(i)).count();
    // In bytes: spans, edges, the first sample of each span, its fraction and the step; a system.
    let up = knots * (4 + 8 + 4 + 8) + curves * (16 + 4);
    // Second derivatives, samples and a status.
    let down = knots * 8 + curves * (8 * samples + 4);
    assert!(traffic.up as usize <= up + 1_000, "{traffic:?}, {up}");
    assert!(traffic.down as usize <= down + 1_000, "{traffic:?}, {down}");
}

#[test]
fn gentle_fair_curves_are_one_submission_of_points_and_vertices() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu).with_precision(Precision::F64);
    let (curves, points, segments) = (200, 5, 16);
    let point = |k: usize| [(k % 5) as f64, 0.2 * (1.7 * k as f64).sin()];
    let coords = (0..curves * points).flat_map(point).collect();
    let gentle = CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| points * i).collect()).unwrap();
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(segments), ..Fair::default() };
    assert_eq!(fair.fit(&gentle, &device).unwrap().usable(), curves);
    let traffic = device.as_gpu().expect("it is one").take_traffic();
    println!("{traffic:?}");
    assert_eq!(traffic.submissions, 1);
    assert!(traffic.dispatches <= 20, "{traffic:?}");
    // In bytes a curve: spans and edges; its system, first knot and slot; its places in the arrays;
    // four numbers of its descent and four weights.
    let up = curves * (points * 8 * 3 + 16 + 4 + 4 + 24 + 8 * 8);
    // Vertices but for the last, which is a data point; a state and a record.
    let down = curves * ((points - 1) * segments * 16 + 24 + 4 * 8);
    assert!(traffic.up as usize <= up + 2_000, "{traffic:?}, {up}");
    assert!(traffic.down as usize <= down + 100, "{traffic:?}, {down}");
}

#[test]
fn auto_is_f64_for_splines_where_f64_was_measured_fast() {
    let Some(gpu) = gpu() else { return };
    if !gpu.summary().has_f64 {
        return;
    }
    for (f64_rate, wanted) in [(0.03, Precision::F32), (0.5, Precision::F64)] {
        let costs = |adapter: &AdapterSummary| Costs { f64_rate, ..Costs::estimated(adapter) };
        let device = Device::choose_by(Choice::Gpu(0), &Work::ENDLESS, &costs).unwrap();
        let fit = Natural::default().fit(&batch(), &device).unwrap();
        assert_eq!(fit.device().precision, wanted, "{f64_rate}");
    }
}
