//! The counter of curves that are finished, which progress bars watch.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use faircurve::bezier::{Chain, Complete, Joints};
use faircurve::discrete::{Fair, bending, length};
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Device, Sampling, Stopped};

const SAMPLING: Sampling = Sampling::PerSpan(4);

/// Good curves of many lengths, among them a single point, an empty one and one that is no number.
fn batch() -> CurveBatch {
    let wave = |n: usize| (0..n).map(|k| [k as f64, (k as f64 * 1.3).sin()]).collect::<Vec<_>>();
    let mut curves: Vec<Vec<[f64; 2]>> = (4..40).map(wave).collect();
    curves.extend([vec![[1.0, 1.0]], vec![], vec![[0.0, 0.0], [f64::NAN, 1.0], [2.0, 0.0], [3.0, 0.0]]]);
    let slices: Vec<&[[f64; 2]]> = curves.iter().map(|curve| &curve[..]).collect();
    CurveBatch::from_slices(&slices).unwrap()
}

#[test]
fn every_method_counts_every_curve_once() {
    let batch = batch();
    let fair = || Fair { energy: bending(2.0) + length(), ..Fair::default() };
    let chain = |joints| Chain { degree: 3, joints, ..Chain::default() };
    let smoothing = |target| Smoothing { target, ..Smoothing::default() };
    let count = |what: &str, fit: &dyn Fn(&Device)| {
        let finished = Arc::new(AtomicUsize::new(0));
        fit(&Device::cpu().with_counter(finished.clone()));
        assert_eq!(finished.load(Ordering::Relaxed), batch.len(), "{what}");
    };
    count("natural", &|cpu| drop(Natural::default().fit(&batch, cpu).unwrap()));
    count("smoothing", &|cpu| drop(smoothing(SmoothingTarget::Lambda(0.1)).fit(&batch, cpu).unwrap()));
    count("smoothing, deviation", &|cpu| {
        drop(smoothing(SmoothingTarget::Deviation(0.1.into())).fit(&batch, cpu).unwrap())
    });
    count("smoothing, tube", &|cpu| {
        drop(smoothing(SmoothingTarget::Tube(0.1.into())).fit_sampled(&batch, SAMPLING, cpu).unwrap())
    });
    count("fair", &|cpu| drop(fair().fit(&batch, cpu).unwrap()));
    count("fair, deviation", &|cpu| drop(Fair { deviation: Some(0.1.into()), ..fair() }.fit(&batch, cpu).unwrap()));
    count("fair, corners", &|cpu| drop(Fair { corners: Some(0.5), ..fair() }.fit(&batch, cpu).unwrap()));
    count("scf", &|cpu| drop(Smooth::default().fit(&batch, cpu).unwrap()));
    count("bezier", &|cpu| drop(Complete::default().fit(&batch, cpu).unwrap()));
    count("bezier, chains", &|cpu| drop(chain(Joints::C2).fit(&batch, cpu).unwrap()));
    count("bezier, G1 chains", &|cpu| drop(chain(Joints::G1).fit(&batch, cpu).unwrap()));
}

#[test]
fn a_flag_stops_a_fit_with_its_next_curve() {
    let batch = batch();
    let fair = Fair { energy: bending(2.0) + length(), ..Fair::default() };
    let flag = Arc::new(AtomicBool::new(false));
    let finished = Arc::new(AtomicUsize::new(0));
    let device = Device::cpu().with_counter(finished.clone()).stopped_by(flag.clone());
    fair.fit(&batch, &device).unwrap();
    assert_eq!(finished.swap(0, Ordering::Relaxed), batch.len());
    flag.store(true, Ordering::Relaxed);
    let payload = catch_unwind(AssertUnwindSafe(|| fair.fit(&batch, &device))).unwrap_err();
    assert!(payload.is::<Stopped>() && finished.load(Ordering::Relaxed) < batch.len());
    // Nothing is left of it.
    flag.store(false, Ordering::Relaxed);
    assert_eq!(fair.fit(&batch, &device).unwrap().usable(), fair.fit(&batch, &Device::cpu()).unwrap().usable());
}
