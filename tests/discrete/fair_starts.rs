//! Further starts find cheaper minima, and never dearer ones.

use faircurve::discrete::{Fair, Limits, Pins, attachment, bending, length, tautness, variation};
use faircurve::{Constraints, CurveBatch, CurveStatus, Deviation, Device, Fit, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

/// Points at unit steps whose other coordinates are even between ±`height`.
fn rough<const D: usize>(curves: usize, height: f64, seed: u64) -> Vec<Vec<[f64; D]>> {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let mut point =
        |k: usize| std::array::from_fn(|c| if c == 0 { k as f64 } else { rng.random_range(-height..height) });
    (0..curves).map(|_| (0..7).map(&mut point).collect()).collect()
}

fn batch<const D: usize>(curves: &[Vec<[f64; D]>], closed: bool) -> CurveBatch
where
    [f64; D]: faircurve::Point,
{
    CurveBatch::from_slices(&curves.iter().map(|curve| &curve[..]).collect::<Vec<_>>()).unwrap().closed(closed)
}

fn searched(starts: u32) -> Fair {
    Fair { energy: bending(2.0) + 0.1 * length(), starts, ..Fair::default() }
}

fn descended(fair: &Fair, batch: &CurveBatch) -> Fit {
    fair.fit(batch, &Device::cpu()).unwrap()
}

fn improves<const D: usize>(closed: bool, least: usize)
where
    [f64; D]: faircurve::Point,
{
    let batch = batch(&rough::<D>(60, 2.0, 81 + D as u64), closed);
    let [once, often] = [1, 12].map(|starts| descended(&searched(starts), &batch));
    let mut cheaper = 0;
    for (i, (first, best)) in once.reports().iter().zip(often.reports()).enumerate() {
        assert_eq!(first.gain, None);
        let gain = best.gain.unwrap();
        if first.status != CurveStatus::Converged {
            continue;
        }
        assert_eq!(best.status, CurveStatus::Converged, "{i}: {best:?}");
        assert!(best.iterations > first.iterations, "{i}: {first:?} {best:?}");
        // What a gain says is what the energies say.
        let saved = 1.0 - best.energy / first.energy;
        assert!(gain >= 0.0 && (gain - saved).abs() <= 1e-12, "{i}: {gain} {saved}");
        cheaper += usize::from(gain > 0.01);
    }
    println!("{D}-D, closed {closed}: {cheaper} of 60 cheaper by more than 1 %");
    assert!(cheaper >= least, "{cheaper}");
}

#[test]
fn further_starts_never_cost_energy_and_find_cheaper_curves_through_rough_points() {
    improves::<2>(false, 30);
    improves::<2>(true, 20);
    improves::<3>(false, 10);
}

#[test]
fn a_curve_has_the_same_bits_alone_and_in_any_order() {
    let curves = rough::<2>(9, 2.0, 91);
    let fair = searched(6);
    let all = fair.fit_sampled(&batch(&curves, false), Sampling::PerSpan(16), &Device::cpu()).unwrap().1;
    let backwards: Vec<_> = curves.iter().rev().cloned().collect();
    let turned = fair.fit_sampled(&batch(&backwards, false), Sampling::PerSpan(16), &Device::cpu()).unwrap().1;
    for (i, curve) in curves.iter().enumerate() {
        let alone = batch(std::slice::from_ref(curve), false);
        let alone = fair.fit_sampled(&alone, Sampling::PerSpan(16), &Device::cpu()).unwrap().1;
        assert_eq!(all.points(i), alone.points(0), "{i}");
        assert_eq!(all.points(i), turned.points(curves.len() - 1 - i), "{i}");
    }
    let other = Fair { seed: 1, ..fair.clone() };
    let energies =
        |fair: &Fair| descended(fair, &batch(&curves, false)).reports().iter().map(|r| r.energy).sum::<f64>();
    assert_ne!(energies(&fair), energies(&other), "another seed, other starts");
}

#[test]
fn a_curve_has_the_same_bits_alone_and_in_a_crowd() {
    // As many that others take their places in the lanes of a thread.
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let energies = [bending(2.0) + tautness(), bending(3.0) + length(), variation() + length(), length()];
    for (energy, count) in energies.into_iter().zip([200, 120, 80, 80]) {
        for closed in [false, true] {
            let what = format!("{energy}, closed {closed}");
            let fair = Fair { energy: energy.clone(), ..Fair::default() };
            let curves = rough::<2>(count, 1.0, 93);
            let fit = || fair.fit_sampled(&batch(&curves, closed), Sampling::PerSpan(16), &Device::cpu()).unwrap();
            let ((fit, samples), many_threads) = (one_thread.install(fit), fit().1);
            assert_eq!(samples.coords(), many_threads.coords(), "{what}");
            for (i, curve) in curves.iter().enumerate() {
                let alone = batch(std::slice::from_ref(curve), closed);
                let (own, alone) = fair.fit_sampled(&alone, Sampling::PerSpan(16), &Device::cpu()).unwrap();
                assert_eq!(samples.points(i), alone.points(0), "{what}, {i}");
                assert_eq!(fit.reports()[i].iterations, own.reports()[0].iterations, "{what}, {i}");
            }
        }
    }
}

#[test]
fn every_start_keeps_the_points_the_tangents_and_the_corners() {
    let curves = rough::<2>(4, 2.0, 92);
    let mut tangents = vec![f64::NAN; 4 * 7 * 2];
    (0..4).for_each(|i| tangents[(i * 7 + 3) * 2..][..2].copy_from_slice(&[0.6, 0.8]));
    let constraints = Constraints { tangents: Some(tangents), ..Constraints::default() };
    let batch = batch(&curves, false).with_constraints(constraints).unwrap();
    let fair = Fair { corners: Some(2.0), ..searched(8) };
    let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu()).unwrap();
    for (i, curve) in curves.iter().enumerate() {
        let report = &fit.reports()[i];
        assert!(report.status.is_usable() && report.gain.is_some(), "{report:?}");
        let vertices = samples.points(i).as_chunks::<2>().0;
        curve.iter().enumerate().for_each(|(k, point)| assert_eq!(vertices[16 * k], *point));
        let tangent = fit.curve(i).jet(3, 0.0).first.normalize();
        assert!((tangent.x - 0.6).abs() < 1e-12 && (tangent.y - 0.8).abs() < 1e-12, "{i}: {tangent}");
    }
}

#[test]
fn hard_and_impossible_curves_have_the_status_that_they_have_with_one_start() {
    let lists: [&[Planar]; 6] = [
        &[[1.0, 1.0]],
        &[[0.0, 0.0], [2.0, 1.0]],
        &[[0.0, 0.0], [0.0, 0.0], [2.0, 1.0], [2.0, 1.0], [3.0, 0.0], [3.0, 0.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]],
        &[[0.0, 0.0], [f64::NAN, 1.0], [1.0, 1.0]],
        &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]],
    ];
    for closed in [false, true] {
        let batch = CurveBatch::from_slices(&lists).unwrap().closed(closed);
        for energy in [bending(2.0) + length(), variation() + length(), bending(2.0) + length() + attachment()] {
            let pins = if energy.to_string().contains("attachment") { Pins::Ends } else { Pins::All };
            let of = |starts: u32| descended(&Fair { energy: energy.clone(), pins, starts, ..Fair::default() }, &batch);
            let (once, often) = (of(1), of(5));
            for (i, (first, best)) in once.reports().iter().zip(often.reports()).enumerate() {
                let better = first.status == CurveStatus::NotConverged && best.status == CurveStatus::Converged;
                assert!(first.status == best.status || better, "{energy}, {i}: {first:?} {best:?}");
            }
        }
    }
}

#[test]
fn notes_count_what_was_found_and_what_makes_no_sense_is_refused() {
    let curves = batch(&rough::<2>(40, 2.0, 93), false);
    let fair = searched(8);
    let fit = descended(&fair, &curves);
    let notes = fair.notes(fit.reports());
    let [loops, note] = &notes[..] else { panic!("{notes:?}") };
    assert!(loops.contains("have loops"), "{loops}");
    let found = fit.reports().iter().filter(|report| report.gain > Some(0.0)).count();
    assert!(note.starts_with(&format!("8 starts: {found} of 40 curves found a cheaper minimum, by ")), "{note}");
    let once = searched(1).notes(descended(&searched(1), &curves).reports());
    assert!(once.iter().all(|note| note.contains("have loops")), "{once:?}");
    let straight = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]][..]]).unwrap();
    let notes = fair.notes(descended(&fair, &straight).reports());
    assert_eq!(notes, ["8 starts: none of 1 curves found a cheaper minimum"]);

    let refused = |fair: Fair| fair.fit(&curves, &Device::cpu()).err().unwrap().to_string();
    let range = "starts: each is a descent of its own, and from 1 to 1000 are possible, such as 20";
    assert_eq!(refused(searched(0)), format!("0 {range}"));
    assert_eq!(refused(searched(1001)), format!("1001 {range}"));
    assert_eq!(
        refused(Fair { deviation: Some(Deviation::OfSize(0.02)), ..searched(3) }),
        "3 starts and a deviation of 2%: a curve near its points starts from its smoothing spline alone; leave one of both out"
    );
}

#[test]
fn further_starts_never_break_limits_or_cost_energy() {
    let rising = Limits { monotone: vec![[0.0, 1.0, 0.0]], ..Limits::default() };
    let wide = Limits { curvature: Some(1.0), ..Limits::default() };
    let one = [[0.0, 0.2], [1.2, 1.1], [2.4, -1.3], [3.6, -0.3]];
    let other = [[0.0, 1.0], [0.7, -0.2], [2.3, 1.6], [3.5, 0.2]];
    let given = CurveBatch::from_slices(&[&one[..], &other[..]]).unwrap();
    let energy = bending(2.0) + 0.3 * length();
    for (limits, batch) in [(rising.clone(), &given), (rising, &batch(&rough::<2>(30, 1.0, 5), false)), (wide, &given)]
    {
        let of = |starts: u32| {
            let fair = Fair { energy: energy.clone(), limits: limits.clone(), starts, ..Fair::default() };
            descended(&fair, batch)
        };
        let [once, often] = [1, 12].map(of);
        let mut found = 0;
        for (first, best) in once.reports().iter().zip(often.reports()) {
            assert_eq!(best.status == CurveStatus::Converged, best.limits.unwrap().violation == 0.0, "{best:?}");
            found += usize::from(first.status != best.status);
            if first.status == CurveStatus::Converged {
                assert_eq!(best.status, CurveStatus::Converged, "{first:?} {best:?}");
                assert!(best.energy <= first.energy, "{first:?} {best:?}");
            }
        }
        println!("{found} of {} keep their limits from another start", batch.len());
    }
}
