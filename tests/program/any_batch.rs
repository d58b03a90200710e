//! No batch, however small or extreme, is a panic: every curve gets a status, what is not usable a
//! sentence, and what is usable is made of numbers.

use std::panic::{AssertUnwindSafe, catch_unwind};

use faircurve::Deviation::{OfSize, Units};
use faircurve::bezier::{self, Chain, Complete, EndTangents, Joints, PieceLengths, Simplify};
use faircurve::discrete::{
    Energy, Fair, Pins, Segments, Solver, attachment, bending, length, tension, torsion, variation,
};
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::topology::{Options, Topology};
use faircurve::{Constraints, CurveBatch, CurveReport, CurveStatus, Device, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Sizes whose squares, or cubes, leave the range of the numbers, and sizes that do not.
const SIZES: [f64; 9] = [1.0, 1.0, 1.0, 1e3, 1e-6, 1e150, 1e-150, 1e300, 5e-324];

fn pick<T: Clone>(rng: &mut StdRng, all: &[T]) -> T {
    all[rng.random_range(0..all.len())].clone()
}

/// Up to five curves of up to six points: random ones, some repeated, some on a line that turns
/// back, some no number.
fn batch(rng: &mut StdRng, constrained: bool) -> CurveBatch {
    let dimension = rng.random_range(2..4);
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for _ in 0..rng.random_range(1..6) {
        let (count, size, kind) = (rng.random_range(0..7), pick(rng, &SIZES), rng.random_range(0..5));
        let mut points: Vec<Vec<f64>> = Vec::new();
        for k in 0..count {
            let mut point: Vec<f64> = (0..dimension).map(|_| size * rng.random_range(-1.0..1.0)).collect();
            match kind {
                0 if k > 0 && rng.random_range(0..2) == 0 => point = points[rng.random_range(0..k)].clone(),
                1 => point = vec![size * f64::from(rng.random_range(0..3)); dimension],
                2 if rng.random_range(0..6) == 0 => point[0] = pick(rng, &[f64::NAN, f64::INFINITY, 1e308, -1e308]),
                _ => {}
            }
            points.push(point);
        }
        offsets.push(offsets[offsets.len() - 1] + points.len());
        coords.extend(points.concat());
        closed.push(rng.random_range(0..2) == 0);
    }
    let batch = CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap();
    // A closed curve that repeats its first point has lost it.
    let total = batch.total_points();
    let mut vectors = |share: usize| -> Option<Vec<f64>> {
        (constrained && rng.random_range(0..4) == 0).then(|| {
            let vector = |_| match rng.random_range(0..10) < share {
                true => (0..dimension).map(|_| rng.random_range(-1.0..1.0)).collect(),
                false => vec![f64::NAN; dimension],
            };
            (0..total).flat_map(vector).collect()
        })
    };
    let (tangents, curvatures) = (vectors(4), vectors(1));
    let pinned =
        (constrained && rng.random_range(0..4) == 0).then(|| (0..total).map(|_| rng.random_range(0..3) == 0).collect());
    let constraints = Constraints { tangents, curvatures, pinned, ..Constraints::default() };
    batch.with_constraints(constraints).unwrap()
}

/// Asserts that `fit` returns, and what it returns: reports and, of every curve, samples.
fn holds(seed: u64, what: &str, fit: impl FnOnce() -> Option<(Vec<CurveReport>, CurveBatch)>) {
    let Ok(found) = catch_unwind(AssertUnwindSafe(fit)) else { panic!("seed {seed}: {what} panicked") };
    let Some((reports, samples)) = found else { return };
    assert_eq!(reports.len(), samples.len(), "seed {seed}: {what}");
    for (i, report) in reports.iter().enumerate() {
        if report.status.is_usable() {
            assert!(samples.points(i).iter().all(|x| x.is_finite()), "seed {seed}: {what}: {i} {report:?}");
        } else {
            assert!(report.message.is_some(), "seed {seed}: {what}: {i} {report:?}");
        }
    }
}

fn energy(rng: &mut StdRng) -> Energy {
    let mut energy = pick(rng, &[bending(2.0), bending(1.0), bending(1.2), bending(3.0), bending(8.0), variation()]);
    for more in [length(), tension(), torsion(), variation(), attachment()] {
        if rng.random_range(0..5) == 0 {
            energy = energy + pick(rng, &[1e-3, 1.0, 1e3]) * more;
        }
    }
    match rng.random_range(0..8) {
        0 => length(),
        1 => tension(),
        _ => energy,
    }
}

/// Curves among the few points of a grid, so that they share many, and some that are none.
fn map(rng: &mut StdRng) -> CurveBatch {
    let size = pick(rng, &SIZES);
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for _ in 0..rng.random_range(1..8) {
        let count = rng.random_range(0..9);
        for _ in 0..2 * count {
            let x = size * f64::from(rng.random_range(-2..3));
            coords.push(if rng.random_range(0..60) == 0 { f64::NAN } else { x });
        }
        offsets.push(coords.len() / 2);
        closed.push(rng.random_range(0..3) > 0);
    }
    CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap()
}

#[test]
fn maps_of_any_batch_have_a_status_each_and_share_what_they_shared() {
    for seed in 0..500 {
        let rng = &mut StdRng::seed_from_u64(seed);
        let batch = if seed % 4 == 0 { batch(rng, false) } else { map(rng) };
        let options = Options {
            snap: pick(rng, &[0.0, 0.0, 1e-9, 0.1, 10.0]),
            straight: pick(rng, &[0.0, 0.5, 3.0]),
            geographic: rng.random_range(0..3) == 0,
            ..Options::default()
        };
        let smoothing = pick(
            rng,
            &[
                None,
                Some(SmoothingTarget::Lambda(0.1)),
                Some(SmoothingTarget::Deviation(OfSize(0.3))),
                Some(SmoothingTarget::Tube(0.3.into())),
            ],
        );
        let sampling = pick(rng, &[Sampling::PerSpan(3), Sampling::Count(4), Sampling::Spacing(0.4)]);
        let mends = rng.random_range(0..2) == 0;
        holds(seed, &format!("{options:?} {smoothing:?} {sampling:?} {mends}"), || {
            let topology = Topology::new(&batch, &options).ok()?;
            let strokes = topology.strokes();
            sampling.check(&batch).ok()?;
            let fit = match smoothing {
                None => Natural::default().fit(strokes, &Device::cpu()).ok()?,
                Some(target) => {
                    let pin_ends = seed % 3 > 0;
                    Smoothing { target, pin_ends, ..Smoothing::default() }.fit(strokes, &Device::cpu()).ok()?
                }
            };
            let mut sampled = topology.sample(fit, sampling);
            if mends {
                let before = sampled.faults().crossings.len();
                let (tight, mended) = sampled.mend(0.5);
                assert_eq!(mended.before, before, "seed {seed}");
                sampled = tight;
            }
            let strokes = sampled.strokes().clone();
            let fit = sampled.join();
            let samples = fit.polylines(sampling);
            // What was looked at for crossings is what is written, to the bit.
            let again = topology.join(strokes).polylines(sampling);
            let bits = |batch: &CurveBatch| batch.coords().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&samples), bits(&again), "seed {seed}");
            assert!((0..batch.len()).all(|i| samples.is_closed(i) == batch.is_closed(i)), "seed {seed}");
            fit.beziers(1e-3);
            for (curve, report) in &fit {
                let measured = [curve.length(), curve.max_curvature()];
                assert!(!report.status.is_usable() || measured.iter().all(|x| *x >= 0.0), "seed {seed}: {measured:?}");
            }
            Some((fit.reports().to_vec(), samples))
        });
    }
}

#[test]
fn fair_curves_of_any_batch_have_a_status_each() {
    for seed in 0..1500 {
        let rng = &mut StdRng::seed_from_u64(seed);
        let batch = batch(rng, true);
        let segments = rng.random_range(1..5);
        let fair = Fair {
            energy: energy(rng),
            segments: Segments::PerSpan(segments),
            pins: pick(rng, &[Pins::All, Pins::All, Pins::Ends, Pins::None]),
            deviation: pick(
                rng,
                &[
                    None,
                    None,
                    Some(Units(0.1)),
                    Some(Units(10.0)),
                    Some(Units(1e-150)),
                    Some(Units(1e150)),
                    Some(OfSize(0.02)),
                    Some(OfSize(1e-20)),
                ],
            ),
            corners: pick(rng, &[None, None, Some(0.5), Some(2.0)]),
            solver: pick(rng, &[Solver::Newton, Solver::Newton, Solver::Sobolev]),
            tolerance: pick(rng, &[1e-8, 1e-3]),
            max_iterations: rng.random_range(0..30),
            ..Fair::default()
        };
        holds(seed, &format!("{fair:?}"), || {
            let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(segments), &Device::cpu()).ok()?;
            Some((fit.reports().to_vec(), samples))
        });
    }
}

#[test]
fn smooth_connections_of_any_batch_have_a_status_each() {
    for seed in 0..400 {
        let rng = &mut StdRng::seed_from_u64(seed);
        let batch = batch(rng, false);
        let smooth = Smooth { exponent: pick(rng, &[1.1, 2.0, 5.0]), max_iterations: 20, ..Smooth::default() };
        holds(seed, &format!("{smooth:?}"), || {
            let (fit, samples) = smooth.fit_sampled(&batch, Sampling::PerSpan(3), &Device::cpu()).ok()?;
            Some((fit.reports().to_vec(), samples))
        });
    }
}

#[test]
fn beziers_of_any_batch_have_a_status_each() {
    for seed in 0..600 {
        let rng = &mut StdRng::seed_from_u64(seed);
        let batch = batch(rng, true);
        let known = (0..batch.total_points()).map(|_| rng.random_range(0..3) > 0).collect();
        let given = Constraints { known: Some(known), curvatures: None, ..batch.constraints().clone() };
        let batch = if seed % 2 == 0 { batch.with_constraints(given).unwrap() } else { batch };
        let energy = bezier::Energy::of_order(rng.random_range(1..4));
        let complete = Complete { energy, tangents: pick(rng, &[EndTangents::Derivatives, EndTangents::Directions]) };
        let chain = Chain {
            degree: rng.random_range(1..6),
            joints: pick(rng, &[Joints::Free, Joints::C1, Joints::C2, Joints::G1]),
            energy,
            lengths: pick(rng, &[PieceLengths::Chords, PieceLengths::Equal]),
            corners: [None, Some(0.5)][rng.random_range(0..2)],
        };
        let flat = |completed: bezier::Completed| (completed.reports().to_vec(), completed.control_points().clone());
        holds(seed, &format!("{complete:?}"), || Some(flat(complete.fit(&batch, &Device::cpu()).ok()?)));
        let simplify = Simplify { tolerance: 10f64.powi(rng.random_range(-6..2)), ..Simplify::default() };
        holds(seed, &format!("{simplify:?}"), || Some(flat(simplify.fit(&batch, &Device::cpu()).ok()?)));
        holds(seed, &format!("{chain:?}"), || Some(flat(chain.fit(&batch, &Device::cpu()).ok()?)));
    }
}

#[test]
fn samples_and_segments_that_no_memory_holds_are_refused_before_anything_is_made() {
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]][..]]).unwrap();
    let (cpu, many) = (Device::cpu(), 100_000_000_000_000);
    let fair = |segments: usize| Fair { segments: Segments::PerSpan(segments), ..Fair::default() };
    for sampling in [Sampling::PerSpan(many), Sampling::Count(2 * many)] {
        for refused in [
            Natural::default().fit_sampled(&batch, sampling, &cpu).err(),
            Smoothing::default().fit_sampled(&batch, sampling, &cpu).err(),
            fair(4).fit_sampled(&batch, sampling, &cpu).err(),
            Smooth::default().fit_sampled(&batch, sampling, &cpu).err(),
        ] {
            let sentence = refused.expect("a refusal").to_string();
            assert!(
                sentence.contains(" make 2.0e14 of all curves, which take 9.2e9 MiB of memory, but "),
                "{sentence}"
            );
            assert!(
                sentence.contains(" MiB are free: ask for ")
                    && sentence.ends_with(" or fewer, or give the curves in smaller batches"),
                "{sentence}"
            );
        }
    }
    let sentence = fair(many).fit(&batch, &cpu).expect_err("a refusal").to_string();
    assert!(sentence.starts_with("100000000000000 segments a span make 2.0e14 of all curves"), "{sentence}");
}

#[test]
fn short_closed_curves_in_energies_of_every_order_have_a_status() {
    let points = [[0.0, 0.0], [1.0, 0.2], [0.6, 1.0], [0.1, 0.7]];
    for count in 1..=4 {
        for segments in 1..=3 {
            for energy in [length(), bending(2.0), variation(), variation() + length()] {
                let batch = CurveBatch::from_slices(&[&points[..count]]).unwrap().closed(true);
                let fair = Fair { energy, segments: Segments::PerSpan(segments), ..Fair::default() };
                let fit = fair.fit(&batch, &Device::cpu()).unwrap();
                let report = &fit.reports()[0];
                assert!(report.status.is_usable() || report.message.is_some(), "{count} {segments}: {report:?}");
            }
        }
    }
}

#[test]
fn an_empty_closed_bezier_curve_is_degenerate_whatever_is_known() {
    for known in [None, Some(vec![])] {
        let batch = CurveBatch::from_ragged(3, vec![], vec![0, 0]).unwrap().closed(true);
        let batch = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap();
        let completed = Complete::default().fit(&batch, &Device::cpu()).unwrap();
        assert_eq!(completed.reports()[0].status, CurveStatus::Degenerate);
    }
}
