//! Smoothing splines on the GPU are those of the CPU.

use faircurve::spline::{Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Precision, Sampling};
use rand::RngExt;

use crate::common;
use crate::common::conform::{Outcome, Unit, conform};
use crate::common::{batches, device, seeded, tolerance};

const SAMPLING: Sampling = Sampling::PerSpan(4);

/// Open and closed curves of 2 to 40 points, and a few longer ones, with weights over two decades.
fn weighted(dimension: usize) -> CurveBatch {
    let mut rng = seeded(300 + dimension as u64);
    let sizes: Vec<usize> = (2..=40).chain([64, 65, 200, 1500]).collect();
    let batch = batches::walks(dimension, &sizes, &mut rng);
    let weights = (0..batch.total_points()).map(|_| 10_f64.powf(rng.random_range(-1.0..1.0))).collect();
    batch.with_weights(weights).unwrap()
}

/// Half the largest extent of every curve or of its data: smoothed curves may be far smaller than
/// these, and between points of almost one parameter far larger.
fn sizes(batch: &CurveBatch, smoothing: &Smoothing) -> Vec<f64> {
    let (_, curves) = smoothing.fit_sampled(batch, SAMPLING, &faircurve::Device::cpu()).unwrap();
    let pairs = extents(batch).into_iter().zip(extents(&curves));
    pairs.map(|(data, curve)| data.max(curve)).collect()
}

fn extents(batch: &CurveBatch) -> Vec<f64> {
    let size = |i: usize| {
        let d = batch.dimension();
        let extent = |c: usize| {
            let axis = || batch.points(i).iter().skip(c).step_by(d).filter(|x| x.is_finite());
            let low = axis().fold(f64::INFINITY, |low, x| low.min(*x));
            0.5 * axis().fold(f64::NEG_INFINITY, |high, x| high.max(*x)) - 0.5 * low
        };
        (0..d).map(extent).fold(0.0, f64::max)
    };
    (0..batch.len()).map(size).collect()
}

#[test]
fn for_a_given_lambda_every_curve_is_the_cpus() {
    let Some(device) = device() else { return };
    let cases = [("storms", batches::storms()), ("walks, 2-D", weighted(2)), ("walks, 3-D", weighted(3))];
    for (name, batch) in cases {
        for (lambda, pin_ends) in [(1e-3, false), (0.1, true), (10.0, false)] {
            let smoothing = Smoothing { target: SmoothingTarget::Lambda(lambda), pin_ends, ..Smoothing::default() };
            let name = format!("{name}, λ = {lambda}, pinned: {pin_ends}");
            conform(&name, &device, tolerance::SMOOTHING, Unit::Each(&sizes(&batch, &smoothing)), |device| {
                let (fit, samples) = smoothing.fit_sampled(&batch, SAMPLING, device).unwrap();
                Outcome::of_curves(&samples, fit.reports())
            });
        }
    }
}

#[test]
fn nasty_curves_have_the_cpus_statuses_and_spoil_no_neighbour() {
    let Some(device) = device() else { return };
    let smoothing = Smoothing { target: SmoothingTarget::Lambda(1e-6), ..Smoothing::default() };
    for batch in [batches::nasty(2), batches::nasty(3), batches::nasty_parameters()] {
        conform("nasty curves", &device, tolerance::SMOOTHING, Unit::Each(&sizes(&batch, &smoothing)), |device| {
            let (fit, samples) = smoothing.fit_sampled(&batch, SAMPLING, device).unwrap();
            Outcome::of_curves(&samples, fit.reports())
        });
    }
}

#[test]
fn a_deviation_is_kept_by_every_curve_in_every_precision_and_in_f64_by_the_cpus_lambda() {
    let Some(device) = device() else { return };
    let batch = batches::storms();
    let smoothing =
        Smoothing { target: SmoothingTarget::Deviation(0.3.into()), pin_ends: true, ..Smoothing::default() };
    let cpu = smoothing.fit(&batch, &faircurve::Device::cpu()).unwrap();
    for precision in common::precisions(device.as_gpu().unwrap()) {
        let gpu = smoothing.fit(&batch, &device.clone().with_precision(precision)).unwrap();
        let mut other_lambda = 0;
        for (i, (found, wanted)) in gpu.reports().iter().zip(cpu.reports()).enumerate() {
            assert_eq!(found.status, wanted.status, "curve {i}");
            if found.status.is_usable() {
                assert!(found.max_deviation <= 0.3, "curve {i} in {precision:?}: {}", found.max_deviation);
            }
            other_lambda += usize::from(found.smoothing != wanted.smoothing);
        }
        println!("{precision:?}: {other_lambda} of {} curves at another λ", batch.len());
        // Where a deviation is within rounding of the one allowed, f32 may decide for the neighbour
        // on the grid.
        let most = if precision == Precision::F64 { 0 } else { batch.len() / 20 };
        assert!(other_lambda <= most, "{other_lambda} curves at another λ");
    }
}

#[test]
fn closed_curves_that_would_collapse_are_stopped_where_the_cpu_stops_them() {
    let Some(device) = device() else { return };
    let mut rng = seeded(320);
    let batch = batches::walks(2, &(4..=40).collect::<Vec<_>>(), &mut rng).closed(true);
    for target in [
        SmoothingTarget::Lambda(1e-2),
        SmoothingTarget::Lambda(1e6),
        SmoothingTarget::Deviation(0.4.into()),
        SmoothingTarget::Deviation(50.0.into()),
    ] {
        let smoothing = Smoothing { target, ..Smoothing::default() };
        let on = |device: &faircurve::Device| smoothing.fit_splines(&batch, device).unwrap();
        let (splines, reports) = on(&faircurve::Device::cpu());
        for precision in common::precisions(device.as_gpu().unwrap()) {
            let (found, of_device) = on(&device.clone().with_precision(precision));
            let (mut stopped, mut other) = (0, 0);
            for (i, (found_report, report)) in of_device.iter().zip(&reports).enumerate() {
                assert_eq!(found_report.status, report.status, "curve {i}, {target:?}");
                if found_report.message.is_some() && report.message.is_some() {
                    // Both are the CPU's.
                    stopped += 1;
                    assert_eq!(found_report, report);
                    let [found, wanted] = [&found, &splines].map(|splines| {
                        use faircurve::CurveSet;
                        let polylines = splines.polylines(SAMPLING);
                        polylines.points(i).to_vec()
                    });
                    assert_eq!(found, wanted, "curve {i}, {target:?}");
                } else {
                    other += usize::from(found_report.message.is_some() != report.message.is_some());
                }
            }
            println!("{target:?}, {precision:?}: {stopped} of {} stopped", batch.len());
            // Where a size is within rounding of its share, f32 may decide otherwise.
            let most = if precision == Precision::F64 { 0 } else { 1 };
            assert!(other <= most, "{other} curves stopped by one device alone");
            let all = [SmoothingTarget::Lambda(1e6), SmoothingTarget::Deviation(50.0.into())].contains(&target);
            assert!(stopped == batch.len() || !all, "{stopped}");
        }
    }
}

#[test]
fn the_least_curve_within_a_distance_is_the_cpus_and_says_so() {
    let Some(device) = device() else { return };
    let batch = batches::storms();
    let smoothing = Smoothing { target: SmoothingTarget::Tube(0.5.into()), ..Smoothing::default() };
    let (fit, samples) = smoothing.fit_sampled(&batch, SAMPLING, &device).unwrap();
    let (of_cpu, wanted) = smoothing.fit_sampled(&batch, SAMPLING, &faircurve::Device::cpu()).unwrap();
    assert_eq!((fit.device(), samples.coords()), (of_cpu.device(), wanted.coords()));
    for (found, wanted) in fit.reports().iter().zip(of_cpu.reports()) {
        assert_eq!((found.status, found.energy.to_bits()), (wanted.status, wanted.energy.to_bits()));
    }
    assert!(!fit.device().is_gpu, "{}", fit.device());
}
