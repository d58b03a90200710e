//! The GPU against the CPU, operation by operation: f64 there, f32 and f64 here, every number of
//! every curve.

use faircurve::spline::{Natural, uniform};
use faircurve::{CurveBatch, CurveStatus, Device, Sampling};

use crate::common;
use crate::common::batches::{self, sizes, walks};
use crate::common::conform::{Outcome, Unit, conform};
use crate::common::{device, seeded, tolerance};

/// Fits and samples, on a GPU in one submission.
fn sampled<'a>(batch: &'a CurveBatch, sampling: Sampling) -> impl Fn(&Device) -> Outcome + 'a {
    move |device| {
        let (fit, samples) = Natural::default().fit_sampled(batch, sampling, device).unwrap();
        match sampling {
            Sampling::Count(_) => Outcome::of_even_samples(&fit, &samples),
            _ => Outcome::of_curves(&samples, fit.reports()),
        }
    }
}

/// Fits on the device, samples on the CPU.
fn fitted(batch: &CurveBatch) -> impl Fn(&Device) -> Outcome + '_ {
    move |device| {
        let fit = Natural::default().fit(batch, device).unwrap();
        Outcome::of_curves(&fit.polylines(Sampling::PerSpan(4)), fit.reports())
    }
}

/// The curves of an operation on the integers.
fn curves<'a>(operation: impl Fn(&Device) -> faircurve::Result<CurveBatch> + 'a) -> impl Fn(&Device) -> Outcome + 'a {
    move |device| Outcome::of_batch(&operation(device).unwrap())
}

#[test]
fn splines_of_every_size_open_and_closed() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(100 + dimension as u64);
        // Every further size is a further kernel in every dimension: the long ones in 2-D only.
        let sizes: Vec<usize> = sizes().into_iter().filter(|&n| dimension == 2 || n <= 64 || n == 257).collect();
        let batch = walks(dimension, &sizes, &mut rng);
        let name = |what: &str| format!("{what}, chord length, {dimension}-D");
        conform(&name("fit"), &device, tolerance::SPLINE, Unit::Size(dimension), fitted(&batch));
        for sampling in [Sampling::PerSpan(16), Sampling::Count(80)] {
            let name = name(&format!("{sampling:?}"));
            conform(&name, &device, tolerance::SPLINE, Unit::Size(dimension), sampled(&batch, sampling));
        }
    }
}

#[test]
fn splines_that_keep_the_shape_of_their_points() {
    let Some(device) = device() else { return };
    let batch = walks(2, &sizes().into_iter().filter(|&n| n <= 257).collect::<Vec<_>>(), &mut seeded(105));
    let natural = Natural { shape: true, ..Natural::default() };
    let mended = |fit: &faircurve::Fit| {
        let held = |report: &&faircurve::CurveReport| report.limits.is_some_and(|limits| limits.active > 0);
        fit.reports().iter().filter(held).count()
    };
    for sampling in [Sampling::PerSpan(16), Sampling::Count(80), Sampling::Points(50)] {
        let of = |device: &Device| {
            let (fit, samples) = natural.fit_sampled(&batch, sampling, device).unwrap();
            assert!(mended(&fit) > 50, "{} curves mended", mended(&fit));
            Outcome::of_curves(&samples, fit.reports())
        };
        conform(&format!("{sampling:?}"), &device, tolerance::SPACING, Unit::Size(2), of);
    }
}

#[test]
fn splines_over_uneven_knots_of_their_own() {
    let Some(device) = device() else { return };
    let mut rng = seeded(110);
    for decades in [1.0, 3.0, 6.0] {
        let batch = batches::with_uneven_knots(walks(2, &sizes(), &mut rng), decades, &mut rng);
        for sampling in [Sampling::PerSpan(16), Sampling::Count(80)] {
            let name = format!("{sampling:?}, spans over {decades} decades");
            conform(&name, &device, tolerance::UNEVEN_SPLINE, Unit::Size(2), sampled(&batch, sampling));
        }
    }
}

#[test]
fn splines_through_points_that_come_close_in_pairs() {
    let Some(device) = device() else { return };
    let mut rng = seeded(120);
    let batch = walks(2, &(1..=70).collect::<Vec<_>>(), &mut rng);
    for left in [1e-2, 1e-4, 1e-6] {
        let batch = batches::with_close_points(&batch, left);
        let name = format!("pairs at {left:e} of their distance");
        conform(&name, &device, tolerance::SPLINE, Unit::Size(2), sampled(&batch, Sampling::PerSpan(8)));
    }
}

#[test]
fn splines_sampled_at_equal_arc_lengths() {
    let Some(device) = device() else { return };
    let batch = walks(2, &(1..=40).chain([257]).collect::<Vec<_>>(), &mut seeded(130));
    conform("spacing", &device, tolerance::SPACING, Unit::Size(2), sampled(&batch, Sampling::Spacing(0.2371)));
}

#[test]
fn splines_clamped_at_either_end_or_both() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(140);
        let walks = walks(dimension, &(1..=64).collect::<Vec<_>>(), &mut rng);
        let batch = batches::with_clamped_ends(walks, &mut rng);
        for sampling in [Sampling::PerSpan(8), Sampling::Count(33)] {
            let name = format!("clamped, {dimension}-D, {sampling:?}");
            conform(&name, &device, tolerance::SPLINE, Unit::Size(dimension), sampled(&batch, sampling));
        }
    }
}

#[test]
fn splines_of_nasty_curves_beside_each_other() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let batch = batches::nasty(dimension);
        for sampling in [Sampling::PerSpan(1), Sampling::PerSpan(16), Sampling::Count(80)] {
            let name = format!("nasty curves, {dimension}-D, {sampling:?}");
            conform(&name, &device, tolerance::SPLINE, Unit::Size(dimension), sampled(&batch, sampling));
        }
    }
    let batch = batches::nasty_parameters();
    for sampling in [Sampling::PerSpan(16), Sampling::Count(80)] {
        let name = format!("nasty parameters, {sampling:?}");
        conform(&name, &device, tolerance::UNEVEN_SPLINE, Unit::Size(2), sampled(&batch, sampling));
    }
}

#[test]
fn a_batch_without_curves_and_curves_without_points() {
    let Some(device) = device() else { return };
    for offsets in [vec![0], vec![0, 0, 0]] {
        let batch = CurveBatch::from_ragged(2, vec![], offsets).unwrap();
        for sampling in [Sampling::PerSpan(3), Sampling::Count(9), Sampling::Spacing(0.1)] {
            conform("nothing", &device, tolerance::SPLINE, Unit::Size(2), sampled(&batch, sampling));
        }
        conform("nothing", &device, tolerance::UNIFORM, Unit::Size(2), curves(|d| uniform::coefficients(&batch, d)));
        conform("nothing", &device, tolerance::UNIFORM, Unit::Size(2), curves(|d| uniform::subdivide(&batch, 3, d)));
        let energies = |d: &Device| Outcome::of_numbers(uniform::exact_energies(&batch, d).unwrap());
        conform("nothing", &device, tolerance::DIFFERENCES, Unit::Largest, energies);
    }
}

#[test]
fn energies_of_fitted_splines() {
    let Some(device) = device() else { return };
    let batch = walks(2, &sizes(), &mut seeded(150));
    let energies = |device: &Device| {
        let fit = Natural::default().fit(&batch, device).unwrap();
        Outcome::of_numbers(fit.reports().iter().map(|report| report.energy).collect())
    };
    conform("energies", &device, tolerance::ENERGY, Unit::Value, energies);
}

#[test]
fn real_tracks_and_outlines() {
    let Some(device) = device() else { return };
    for (name, batch) in [("storms", batches::storms()), ("countries", batches::countries())] {
        for sampling in [Sampling::PerSpan(16), Sampling::Count(80)] {
            let name = format!("{name}, {sampling:?}");
            conform(&name, &device, tolerance::SPLINE, Unit::Size(2), sampled(&batch, sampling));
        }
    }
}

#[test]
fn data_points_among_the_samples_keep_their_bits() {
    let Some(device) = device() else { return };
    for batch in [batches::storms(), batches::countries(), batches::nasty(2), batches::nasty_parameters()] {
        for device in [Device::cpu(), device.clone()] {
            for n in [1, 3] {
                let (_, samples) = Natural::default().fit_sampled(&batch, Sampling::PerSpan(n), &device).unwrap();
                for i in 0..batch.len() {
                    let fitted = samples.problem(i).is_none();
                    // Closed curves of few spans are divided further, into three samples at least.
                    let (closed, spans) = (batch.is_closed(i), batch.spans(i).max(1));
                    let divided = samples.count(i).saturating_sub(usize::from(!closed)) / spans;
                    assert!(!fitted || divided == n || (closed && n * spans < 4), "{divided} samples a span");
                    let step = if fitted { divided } else { 1 };
                    for (k, point) in batch.points(i).chunks_exact(2).enumerate() {
                        let found = &samples.points(i)[2 * step * k..][..2];
                        let bits = |point: &[f64]| [point[0].to_bits(), point[1].to_bits()];
                        assert_eq!(bits(found), bits(point), "curve {:?}, point {k}, {}", batch.name(i), device.name());
                    }
                }
            }
        }
    }
}

/// Batches for the operations on the integers.
fn on_the_integers() -> Vec<(String, CurveBatch)> {
    let mut batches = vec![("walks, 2-D".into(), walks(2, &sizes(), &mut seeded(160)))];
    batches.push(("walks, 3-D".into(), walks(3, &(1..=32).collect::<Vec<_>>(), &mut seeded(161))));
    batches.extend([2, 3].map(|dimension| (format!("nasty curves, {dimension}-D"), batches::nasty(dimension))));
    batches.push(("countries".into(), batches::countries()));
    batches
}

#[test]
fn coefficients_and_values_on_the_integers() {
    let Some(device) = device() else { return };
    for (name, batch) in on_the_integers() {
        let unit = Unit::Size(batch.dimension());
        let of = |what: &str| format!("{what}, {name}");
        conform(&of("coefficients"), &device, tolerance::UNIFORM, unit, curves(|d| uniform::coefficients(&batch, d)));
        conform(&of("values"), &device, tolerance::UNIFORM, unit, curves(|d| uniform::interpolated(&batch, d)));
        for rounds in [0, 1, 4] {
            let what = of(&format!("{rounds} rounds"));
            conform(&what, &device, tolerance::UNIFORM, unit, curves(|d| uniform::subdivide(&batch, rounds, d)));
        }
    }
}

#[test]
fn energies_and_products_on_the_integers() {
    let Some(device) = device() else { return };
    for (name, batch) in on_the_integers() {
        let other = uniform::coefficients(&batch, &Device::cpu()).unwrap();
        // Of n second differences of points of size s, each rounded by ε s: 2 √(n E) s + n s², s
        // the larger of two.
        let size = |batch: &CurveBatch, i: usize| {
            let d = batch.dimension();
            let spread = |c: usize| {
                let axis = || batch.points(i).iter().skip(c).step_by(d);
                axis().fold(f64::NEG_INFINITY, |m, x| m.max(*x)) - axis().fold(f64::INFINITY, |m, x| m.min(*x))
            };
            (0..d).map(spread).fold(0.0, f64::max) / 2.0
        };
        let units = |energies: &dyn Fn(&Device) -> Vec<f64>| -> Vec<f64> {
            let of_cpu = energies(&Device::cpu());
            let unit = |(i, energy): (usize, &f64)| {
                let (n, s) = (batch.count(i) as f64, size(&batch, i).max(size(&other, i)));
                energy.abs() + (n * energy.abs()).sqrt() * s + n * s * s
            };
            of_cpu.iter().enumerate().map(unit).collect()
        };
        type Energies<'a> = &'a dyn Fn(&Device) -> Vec<f64>;
        let (discrete, exact, product): (Energies, Energies, Energies) = (
            &|d| uniform::discrete_energies(&batch, 0, d).unwrap(),
            &|d| uniform::exact_energies(&batch, d).unwrap(),
            &|d| uniform::inner_products(&batch, &other, d).unwrap(),
        );
        for (what, energies) in [("discrete energies", discrete), ("energies", exact), ("products", product)] {
            let units = units(energies);
            let what = format!("{what}, {name}");
            conform(&what, &device, tolerance::DIFFERENCES, Unit::Each(&units), |d| Outcome::of_numbers(energies(d)));
        }
    }
}

#[test]
fn the_comparison_finds_what_it_is_for() {
    let wanted = Outcome { offsets: vec![0, 2, 4], ..Outcome::of_numbers(vec![1.0, 2.0, -3.0, 4.0]) };
    let wanted = Outcome { status: vec![CurveStatus::Converged; 2], ..wanted };
    let finds = |change: fn(&mut Outcome)| {
        let mut found = wanted.clone();
        change(&mut found);
        let compare = || {
            let unit = Unit::Size(1);
            common::conform::compare("changed", &found, &wanted, tolerance::SPLINE, f64::from(f32::EPSILON), unit);
        };
        std::panic::catch_unwind(compare).is_err()
    };
    assert!(!finds(|_| {}));
    assert!(!finds(|found| found.values[3] += 1e-6));
    assert!(finds(|found| found.values[3] += 1e-5));
    // The first curve is seven times smaller.
    assert!(finds(|found| found.values[1] += 1e-6));
    assert!(finds(|found| found.values[0] = f64::NAN));
    assert!(finds(|found| found.values[2] = f64::NEG_INFINITY));
    assert!(finds(|found| found.status[1] = CurveStatus::NotUnique));
    assert!(finds(|found| found.offsets[1] = 1));
    assert!(finds(|found| found.offsets.truncate(2)));
}
