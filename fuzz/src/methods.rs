//! Every method on arbitrary small batches, and what is promised of whatever comes out.

use std::sync::Arc;

use arbitrary::{Result, Unstructured};
use faircurve::bezier::{Chain, Complete};
use faircurve::discrete::{
    Fair, Limits, Pins, Region, Segments, attachment, bending, geodesic_bending, length, tension, torsion, variation,
};
use faircurve::scf::Smooth;
use faircurve::spline::{Ends, Natural, Smoothing, SmoothingTarget, SurfaceSpline};
use faircurve::surface::{Globe, Quadric, Surface, Torus};
use faircurve::{CurveBatch, CurveStatus, Deviation, Device, Fit, Sampling};

use super::batches::batch;
use super::numbers::option;

/// A batch and a method out of the bytes, fitted on the CPU.
pub fn methods(data: &[u8]) {
    let _ = run(&mut Unstructured::new(data));
}

fn run(bytes: &mut Unstructured) -> Result<()> {
    let kind = bytes.int_in_range(0..=6)?;
    let method = method(bytes, kind)?;
    let sampling = match bytes.arbitrary()? {
        true => Sampling::PerSpan(bytes.int_in_range(1..=5)?),
        false => Sampling::Count(bytes.int_in_range(0..=20)?),
    };
    let spacing = option(bytes, &[0.5, 2.0, 1e3])?;
    let tolerance = option(bytes, &[1e-2, 1e-4])?;
    let Some(batch) = batch(bytes)? else { return Ok(()) };
    show(&(sampling, &batch));
    let Ok((fit, samples)) = method(&batch, sampling) else { return Ok(()) };
    check(&batch, &fit, &samples, sampling);
    // Millions of samples are allowed, and take seconds.
    let length: f64 = fit.iter().map(|(curve, _)| curve.length()).sum();
    if (0.0..1e5).contains(&(length / spacing)) && spacing.is_finite() {
        let spacing = Sampling::Spacing(spacing);
        check(&batch, &fit, &fit.polylines(spacing), spacing);
    }
    if tolerance.is_finite() && tolerance > 0.0 {
        let chains = fit.beziers(tolerance.max(1e-6));
        assert_eq!(chains.len(), batch.len());
    }
    check_alone(&batch, &fit, &samples, |part| method(part, sampling).ok());
    Ok(())
}

/// Prints what is about to be fitted where FAIRCURVE_FUZZ_SHOW is set, to see what an input that
/// broke something holds.
fn show(what: &dyn std::fmt::Debug) {
    if std::env::var_os("FAIRCURVE_FUZZ_SHOW").is_some() {
        eprintln!("{what:?}");
    }
}

type Fitted = faircurve::Result<(Fit, CurveBatch)>;

type Method = Box<dyn Fn(&CurveBatch, Sampling) -> Fitted>;

fn method(bytes: &mut Unstructured, kind: u8) -> Result<Method> {
    let cpu = Device::cpu();
    Ok(match kind {
        0 => {
            let natural = Natural { shape: bytes.arbitrary()?, ..Natural::default() };
            // Only planar curves keep their shape.
            let of = move |batch: &CurveBatch| Natural { shape: natural.shape && batch.dimension() == 2, ..natural };
            Box::new(move |batch, sampling| of(batch).fit_sampled(batch, sampling, &cpu))
        }
        1 => {
            let target = match bytes.int_in_range(0..=2)? {
                0 => SmoothingTarget::Lambda(option(bytes, &[0.0, 0.1, 1e3])?),
                1 => SmoothingTarget::Deviation(distance(bytes)?),
                _ => SmoothingTarget::Tube(distance(bytes)?),
            };
            let smoothing = Smoothing { target, pin_ends: bytes.arbitrary()?, ..Smoothing::default() };
            show(&smoothing);
            Box::new(move |batch, sampling| smoothing.fit_sampled(batch, sampling, &cpu))
        }
        2 => {
            let fair = fair(bytes)?;
            show(&fair);
            Box::new(move |batch, sampling| fair.fit_sampled(batch, sampling, &cpu))
        }
        3 => {
            let smooth = Smooth {
                exponent: option(bytes, &[2.0, 1.5, 4.0])?,
                starts: bytes.int_in_range(1..=2)?,
                max_iterations: 20,
                shape: bytes.arbitrary()?,
                ..Smooth::default()
            };
            show(&smooth);
            Box::new(move |batch, sampling| smooth.fit_sampled(batch, sampling, &cpu))
        }
        4 => {
            let complete = Complete::default();
            Box::new(move |batch, sampling| {
                let fit = complete.fit(batch, &cpu)?.into_fit();
                let samples = fit.polylines(sampling);
                Ok((fit, samples))
            })
        }
        5 => {
            let surface = surface(bytes)?.unwrap_or_else(|| Arc::new(Torus::new(3.0, 1.0).expect("R > r")));
            let spline = SurfaceSpline {
                smoothing: match bytes.int_in_range(0..=4)? {
                    0 => None,
                    1 => Some(SmoothingTarget::CrossValidation),
                    2 => Some(SmoothingTarget::Tube(option(bytes, &[1e-3, 0.1, 1e3])?.into())),
                    3 => Some(SmoothingTarget::Deviation(option(bytes, &[1e-3, 0.1, 1e3])?.into())),
                    _ => Some(SmoothingTarget::Lambda(option(bytes, &[0.0, 0.1, 1e3])?)),
                },
                off_surface: Some(f64::INFINITY),
                pin_ends: bytes.arbitrary()?,
                parts: bytes.int_in_range(1..=4)?,
                max_iterations: 20,
                ends: *bytes.choose(&[Ends::Auto, Ends::Natural, Ends::Clamped])?,
                ..SurfaceSpline::new(surface)
            };
            show(&spline);
            Box::new(move |batch, sampling| spline.fit_sampled(batch, sampling, &cpu))
        }
        _ => {
            let chain = Chain { degree: bytes.int_in_range(1..=5)?, ..Chain::default() };
            show(&chain);
            Box::new(move |batch, sampling| {
                let fit = chain.fit(batch, &cpu)?.into_fit();
                let samples = fit.polylines(sampling);
                Ok((fit, samples))
            })
        }
    })
}

fn distance(bytes: &mut Unstructured) -> Result<Deviation> {
    Ok(match bytes.ratio(1, 2)? {
        true => Deviation::OfSize(option(bytes, &[0.02, 1.0])?),
        false => Deviation::Units(option(bytes, &[0.01, 0.5, 1e3])?),
    })
}

fn fair(bytes: &mut Unstructured) -> Result<Fair> {
    let main = match bytes.int_in_range(0..=3)? {
        0 => bending(option(bytes, &[2.0, 1.5, 3.0])?),
        1 => variation() + bending(2.0),
        2 => torsion() + bending(2.0),
        _ => tension(),
    };
    let deviation = if bytes.ratio(1, 3)? { Some(distance(bytes)?) } else { None };
    let attached = deviation.is_none() && bytes.ratio(1, 5)?;
    let mut energy = main + option(bytes, &[0.0, 0.1, 1.0])? * length();
    if attached {
        energy = energy + option(bytes, &[0.1, 10.0])? * attachment();
    }
    let is_limited = energy.order() > 1 && bytes.ratio(1, 4)?;
    let curvature = if is_limited { Some(option(bytes, &[0.5, 1e-3, 1e3])?) } else { None };
    let mut limits = Limits { curvature, ..Limits::default() };
    limits.curvature_rate = if is_limited && bytes.ratio(1, 6)? { Some(option(bytes, &[1.0, 1e-3])?) } else { None };
    if is_limited && bytes.ratio(1, 2)? {
        let ways: [[f64; 3]; 2] = [[1.0, 0.5, 0.0], [-0.5, 1.0, 0.0]];
        limits.monotone = ways[..bytes.int_in_range(0..=2)?].to_vec();
        limits.corridor = if bytes.ratio(1, 3)? { Some(option(bytes, &[0.1, 1e-3, 1e3])?) } else { None };
        limits.no_crossing = bytes.ratio(1, 3)?;
        limits.stretch = if bytes.ratio(1, 3)? { Some(option(bytes, &[1.2, 1.0 + 1e-9])?) } else { None };
        let [x, y, radius] = [(); 3].map(|()| option(bytes, &[0.0, 1.0, 5.0]));
        let (center, radius) = ([x?, y?, 0.0], radius?);
        match bytes.int_in_range(0..=3)? {
            0 => limits.regions.push(Region::Outside { center, radius }),
            1 => limits.regions.push(Region::Inside { center, radius }),
            2 => limits.regions.push(Region::HalfSpace { normal: center, offset: radius }),
            _ => {}
        }
    }
    let surface = surface(bytes)?;
    if surface.is_some() && bytes.ratio(1, 2)? {
        energy = energy + geodesic_bending(2.0);
    }
    Ok(Fair {
        energy,
        deviation,
        limits,
        off_surface: surface.is_some().then_some(f64::INFINITY),
        surface,
        starts: if deviation.is_none() && bytes.ratio(1, 4)? { 4 } else { 1 },
        pins: if attached || deviation.is_some() { Pins::Ends } else { Pins::All },
        segments: match bytes.ratio(3, 4)? {
            true => Segments::PerSpan(bytes.int_in_range(1..=6)?),
            false => Segments::Spacing(option(bytes, &[1.0, 5.0])?),
        },
        corners: if bytes.ratio(1, 5)? { Some(option(bytes, &[1.0])?) } else { None },
        max_iterations: 20,
        ..Fair::default()
    })
}

fn surface(bytes: &mut Unstructured) -> Result<Option<Arc<dyn Surface>>> {
    Ok(match bytes.int_in_range(0..=9)? {
        0 => Some(Arc::new(Globe::WGS84)),
        1 => Some(Arc::new(Quadric::sphere(option(bytes, &[1.0, 5.0])?))),
        _ => None,
    })
}

fn bits(x: &[f64]) -> Vec<u64> {
    x.iter().map(|x| x.to_bits()).collect()
}

fn is_unfitted(status: CurveStatus) -> bool {
    matches!(status, CurveStatus::Degenerate | CurveStatus::Invalid)
}

fn check(batch: &CurveBatch, fit: &Fit, samples: &CurveBatch, sampling: Sampling) {
    assert_eq!((fit.len(), samples.len()), (batch.len(), batch.len()), "curves");
    for (i, (curve, report)) in fit.iter().enumerate() {
        let word = report.status.word();
        assert_eq!(samples.is_closed(i), batch.is_closed(i), "whether curve {i} is closed");
        if is_unfitted(report.status) {
            assert_eq!(bits(samples.points(i)), bits(batch.points(i)), "curve {i}, {word}, comes out as its input");
            assert!(report.message.is_some(), "curve {i}, {word}, says why");
            continue;
        }
        assert!(curve.length() >= 0.0, "curve {i}, {word}: length {}", curve.length());
        if report.status == CurveStatus::Converged {
            assert!(samples.points(i).iter().all(|x| x.is_finite()), "curve {i}, {word}: {:?}", samples.points(i));
            assert!(!report.energy.is_nan(), "curve {i}, {word}: energy {}", report.energy);
            if let (Sampling::PerSpan(n), true) = (sampling, curve.is_fitted()) {
                let least = if curve.is_closed() { 3 } else { 2 };
                assert!(samples.count(i) >= (n * curve.spans()).min(least), "curve {i}: {} samples", samples.count(i));
            }
        }
    }
}

/// A curve alone comes out as in company, bit for bit.
fn check_alone(
    batch: &CurveBatch,
    fit: &Fit,
    samples: &CurveBatch,
    again: impl Fn(&CurveBatch) -> Option<(Fit, CurveBatch)>,
) {
    for i in 0..batch.len().min(2) {
        let Some((alone, sample)) = again(&batch.select(&[i])) else { continue };
        assert_eq!(alone.reports()[0].status, fit.reports()[i].status, "status of curve {i} alone");
        assert_eq!(bits(sample.points(0)), bits(samples.points(i)), "points of curve {i} alone");
    }
}
