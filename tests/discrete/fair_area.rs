//! Curves enclose the area of their points.

use std::f64::consts::{FRAC_PI_6, PI, TAU};

use faircurve::discrete::{Energy, Fair, Limits, bending, length, tautness};
use faircurve::{CurveBatch, CurveStatus};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

const SEGMENTS: usize = 16;

/// Islands of 6 to 40 points, of which every third is an open part of a coast.
fn islands(seed: u64) -> CurveBatch {
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let (mut coords, mut offsets, mut closed) = (vec![], vec![0], vec![]);
    for i in 0..40 {
        let (points, size) = ([6, 9, 15, 40][i % 4], rng.random_range(0.3..3.0));
        for k in 0..if i % 3 == 2 { points / 2 } else { points } {
            let turn = TAU * k as f64 / points as f64;
            let r = size * rng.random_range(0.7..1.3);
            coords.extend([r * turn.cos(), 0.8 * r * turn.sin()]);
        }
        offsets.push(coords.len() / 2);
        closed.push(i % 3 != 2);
    }
    CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap()
}

fn area(points: &[Planar]) -> f64 {
    let cross = |k: usize| {
        let ([x, y], [v, w]) = (points[k], points[(k + 1) % points.len()]);
        x * w - y * v
    };
    0.5 * (0..points.len()).map(cross).sum::<f64>()
}

fn keeping(energy: Energy) -> Fair {
    Fair { energy, limits: Limits { area: true, ..Limits::default() }, ..Fair::default() }
}

#[test]
fn curves_keep_the_area_of_their_points() {
    let batch = islands(71);
    let corners = Some(60f64.to_radians());
    for (deviation, corners, converge) in
        [(None, None, 40), (Some(0.05), None, 40), (Some(0.2), None, 38), (Some(0.1), corners, 40)]
    {
        let fair = Fair {
            deviation: deviation.map(Into::into),
            corners,
            ..keeping(bending(2.0) + 0.1 * length() + tautness())
        };
        let free = Fair { limits: Limits::default(), ..fair.clone() };
        let [kept, free] = [&fair, &free].map(|fair| fit(fair, &batch));
        let mut converged = 0;
        for (i, report) in kept.reports().iter().enumerate() {
            let wanted = area(batch.points(i).as_chunks::<2>().0);
            let [own, without] = [&kept, &free].map(|fit| area(&vertices(fit, i, SEGMENTS)) / wanted - 1.0);
            if report.status == CurveStatus::Converged {
                converged += 1;
                assert!(own.abs() <= 2e-6, "curve {i}, {deviation:?}: {own:e} where it was {without:e}");
                let least = free.reports()[i].energy;
                // Within a deviation tautness also depends on which vertices belong to the points.
                assert!(
                    deviation.is_some() || report.energy >= least * (1.0 - 1e-9),
                    "curve {i}: {} {least}",
                    report.energy
                );
            }
        }
        println!("deviation {deviation:?}, corners {corners:?}: {converged} of {}", batch.len());
        assert!(converged >= converge, "{deviation:?}: {converged}");
    }
}

#[test]
fn a_circle_near_its_points_is_as_large_as_they_are() {
    let points: Vec<Planar> =
        (0..12).map(|k| FRAC_PI_6 * f64::from(k)).map(|t| [2.0 * t.cos(), 2.0 * t.sin()]).collect();
    let batch = one(&points, true);
    let fair = Fair { deviation: Some(0.3.into()), ..keeping(bending(2.0) + length()) };
    let (kept, report) = fitted::<2>(&fair, &batch, SEGMENTS);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!((area(&kept) / area(&points) - 1.0).abs() <= 2e-6);
    // The roundest of all.
    let radius = (area(&points) / PI).sqrt();
    let off = kept.iter().map(|&v| (norm(v) - radius).abs()).fold(0.0, f64::max);
    assert!(off < 1e-3, "{off:e}");
    let (free, _) = fitted::<2>(&Fair { limits: Limits::default(), ..fair }, &batch, SEGMENTS);
    assert!(area(&free) < 0.8 * area(&points));
}

#[test]
fn curves_that_have_their_area_anyway_keep_their_bits() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    // An S has as much on one side of its chord as on the other.
    let wave = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, -1.0], [4.0, 0.0]];
    let fair = keeping(bending(2.0) + 0.1 * length());
    let free = Fair { limits: Limits::default(), ..fair.clone() };
    let [kept, plain] = [&fair, &free].map(|fair| fitted::<2>(fair, &one(&wave, false), SEGMENTS));
    assert_eq!(kept.0, plain.0);
    assert_eq!(kept.1.limits.unwrap().cost, 0.0);
    // A square has not, whose curve bulges.
    let [kept, plain] = [&fair, &free].map(|fair| fitted::<2>(fair, &one(&square, true), SEGMENTS));
    assert!(area(&plain.0) > 1.3 && (area(&kept.0) - 1.0).abs() <= 2e-6, "{} {}", area(&plain.0), area(&kept.0));
}

#[test]
fn areas_of_curves_in_space_are_refused() {
    let points = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 0.0, 1.0]];
    let error = keeping(bending(2.0)).fit(&one(&points, false), &faircurve::Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("curves in space enclose no area"), "{error}");
}
