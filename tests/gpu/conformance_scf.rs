//! Smooth-connection segments on the GPU: reference values, and the CPU's costs, derivatives and
//! refusals.

use std::f64::consts::PI;

use faircurve::scf::{Cost, Query, Smooth, evaluate_segments};
use faircurve::{Device, Precision, Sampling};
use rand::RngExt;
use serde_json::Value;

use crate::common;
use crate::common::{device, epsilon, precisions, seeded};
use crate::rough::Family;

const EXPONENTS: [f64; 9] = [1.05, 1.3, 1.5, 2.0, 2.7, 3.0, 4.0, 8.0, 20.0];

/// Roundings of a cost, for ν = 1: those of an angle, of a power, of the polynomials, of the sums,
/// about a dozen. They change the chord D of the piece, which enters as D^{ν−1}: ν times as many.
const COST: f64 = 24.0;

/// Roundings of a moment D^{ν−1} S: to those of the cost comes what the root itself is good to. It
/// is found where the chord's direction is that of the force to ½ ε of the angles, or after a last
/// step of √ε/10 of itself or less, which leaves its square. Vulkan allows 2.5 roundings for a division and 3 for a root
/// in f32, where lavapipe makes half of one: an H200 needs 168.
const MOMENT: f64 = 200.0;

fn query(exponent: f64, a: f64, b: f64) -> Query {
    Query { chord: 1.0, angles: [a, b], exponent }
}

/// The GPU, in every precision that it has.
fn devices() -> Option<Vec<(Device, Precision)>> {
    let device = device()?;
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    Some(precisions.into_iter().map(|precision| (device.clone().with_precision(precision), precision)).collect())
}

fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |largest, x| largest.max(x.abs()))
}

/// Differences of costs, first and second derivatives, in units of the cost, and of the largest
/// derivative.
fn differences(found: &Cost, wanted: &Cost) -> [f64; 3] {
    let difference = |a: &[f64], b: &[f64]| {
        let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| if a == b { 0.0 } else { a - b }).collect();
        assert!(apart.iter().all(|x| x.is_finite()), "{found:?} for {wanted:?}");
        if largest(&apart) == 0.0 { 0.0 } else { largest(&apart) / largest(b) }
    };
    [
        difference(&[found.cost], &[wanted.cost]),
        difference(&found.gradient, &wanted.gradient),
        difference(&found.hessian, &wanted.hessian),
    ]
}

/// Compares costs and moments with the CPU's; `roundings` is those of second derivatives, which are
/// told by the caller.
fn compare(what: &str, queries: &[Query], devices: &[(Device, Precision)], second: impl Fn(&Query) -> f64) {
    let wanted = evaluate_segments(queries, &Device::cpu()).unwrap();
    for (device, precision) in devices {
        let found = evaluate_segments(queries, device).unwrap();
        assert_eq!(found.len(), wanted.len());
        let mut worst = [0.0_f64; 3];
        for ((query, found), wanted) in queries.iter().zip(&found).zip(&wanted) {
            assert_eq!(found.is_some(), wanted.is_some(), "{query:?} in {precision:?}");
            let (Some(found), Some(wanted)) = (found, wanted) else { continue };
            let used = differences(found, wanted);
            let unit = query.exponent * epsilon(*precision);
            let bounds = [COST * unit, MOMENT * unit, second(query) * unit];
            for k in 0..3 {
                worst[k] = worst[k].max(used[k] / bounds[k]);
                assert!(
                    used[k] <= bounds[k],
                    "{what}, {query:?} in {precision:?}: {used:?} for {bounds:?}, {found:?} {wanted:?}"
                );
            }
        }
        println!("{what}, {}: {:.0?} % of the tolerances", precision.word(), worst.map(|used| 100.0 * used));
    }
}

#[test]
fn reference_segments_have_their_costs_and_end_curvatures_or_no_minimiser() {
    let Some(devices) = devices() else { return };
    let data: Value = serde_json::from_str(include_str!("../data/scf_segments.json")).unwrap();
    let rows = data["unit_chord_segments"].as_array().unwrap();
    let number = |row: &Value, name: &str| row[name].as_f64().unwrap();
    let angle = |row: &Value, name: &str| number(row, name).to_radians();
    let queries: Vec<Query> = rows
        .iter()
        .map(|row| query(number(row, "nu"), angle(row, "start_angle_degrees"), angle(row, "end_angle_degrees")))
        .collect();
    assert!(rows.len() > 100 && rows.iter().any(|row| row["exists"] == false));
    for (device, precision) in &devices {
        let relative = if *precision == Precision::F64 { 1e-9 } else { 2e-5 };
        let found = evaluate_segments(&queries, device).unwrap();
        for (row, found) in rows.iter().zip(found) {
            assert_eq!(found.is_some(), row["exists"].as_bool().unwrap(), "{row} in {precision:?}");
            let Some(found) = found else { continue };
            let (nu, cost) = (number(row, "nu"), number(row, "cost"));
            assert!((found.cost - cost).abs() <= relative * cost, "{row} in {precision:?}: {found:?}");
            let moment = |curvature: f64| nu * curvature.abs().powf(nu - 1.0) * curvature.signum();
            let moments = ["start_curvature", "end_curvature"].map(|name| moment(number(row, name)));
            let own = [-found.gradient[0], found.gradient[1]];
            for (own, moment) in own.iter().zip(moments) {
                assert!((own - moment).abs() <= relative * largest(&moments), "{row} in {precision:?}: {found:?}");
            }
        }
    }
}

#[test]
fn random_segments_of_any_exponent_have_the_costs_and_derivatives_of_the_cpu() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(500);
    let mut angle = || random.random_range(-1.9..1.9);
    // Exponents alternate: all go in one dispatch.
    let queries: Vec<Query> = (0..2000).map(|i| query(EXPONENTS[i % 9], angle(), angle())).collect();
    // What almost cancels of a nearly straight segment's second derivatives is that of the turning
    // twice.
    compare("random", &queries, &devices, |query| {
        let turning = (query.angles[0] - query.angles[1]).abs();
        400.0 / turning.min(1.0).powi(2)
    });
}

#[test]
fn tiny_angles_keep_their_digits() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(501);
    for scale in [1e-3, 1e-4, 1e-6, 1e-9] {
        let mut angle = || scale * random.random_range(-2.0..2.0);
        let queries: Vec<Query> = (0..600).map(|i| query(EXPONENTS[i % 9], angle(), angle())).collect();
        compare(&format!("angles of {scale:e}"), &queries, &devices, |_| f64::INFINITY);
    }
}

#[test]
fn segments_near_where_minimisers_end_are_found_or_refused_as_by_the_cpu() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(502);
    let mut queries = Vec::new();
    for i in 0..400 {
        // a − b = π is where all end; with an inflection they end before.
        let short = 10_f64.powf(random.random_range(-2.5..-0.5));
        let a = random.random_range(0.4..2.7);
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        queries.push(query(EXPONENTS[i % 9], sign * a, sign * (a - PI + short)));
        queries.push(query(EXPONENTS[i % 9], sign * a, sign * (a - PI - short)));
    }
    let wanted = evaluate_segments(&queries, &Device::cpu()).unwrap();
    assert!(wanted.iter().filter(|cost| cost.is_some()).count() > 50);
    for (device, precision) in &devices {
        let found = evaluate_segments(&queries, device).unwrap();
        for ((query, found), wanted) in queries.iter().zip(&found).zip(&wanted) {
            assert_eq!(found.is_some(), wanted.is_some(), "{query:?} in {precision:?}");
            let (Some(found), Some(wanted)) = (found, wanted) else { continue };
            let used = differences(found, wanted)[0];
            // The chord's square root and the force's direction have no derivative at the end
            // itself: √short from it digits are lost.
            let bound = 1e3 * query.exponent * epsilon(*precision);
            assert!(used <= bound, "{query:?} in {precision:?}: {found:?} for {wanted:?}");
        }
    }
}

#[test]
fn straight_segments_cost_nothing_and_resist_as_on_the_cpu() {
    let Some(devices) = devices() else { return };
    let queries: Vec<Query> = EXPONENTS.iter().map(|&exponent| query(exponent, 0.0, -0.0)).collect();
    let wanted = evaluate_segments(&queries, &Device::cpu()).unwrap();
    for (device, precision) in &devices {
        assert_eq!(evaluate_segments(&queries, device).unwrap(), wanted, "{precision:?}");
    }
    assert_eq!(wanted[3].unwrap().hessian, [8.0, 4.0, 8.0]);
}

#[test]
fn mirrored_and_reversed_segments_have_the_same_numbers() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(503);
    let pairs: Vec<[f64; 2]> = (0..90).map(|_| [0; 2].map(|_| random.random_range(-1.5..1.5))).collect();
    let turned = |turn: fn([f64; 2]) -> [f64; 2]| -> Vec<Query> {
        let angles = pairs.iter().map(|&pair| turn(pair));
        angles.enumerate().map(|(i, [a, b])| Query { chord: 3.0, ..query(EXPONENTS[i % 9], a, b) }).collect()
    };
    for (device, _) in &devices {
        let found = evaluate_segments(&turned(|pair| pair), device).unwrap();
        let mirrored = evaluate_segments(&turned(|[a, b]| [-a, -b]), device).unwrap();
        let reversed = evaluate_segments(&turned(|[a, b]| [b, a]), device).unwrap();
        for ((found, mirrored), reversed) in found.iter().zip(mirrored).zip(reversed) {
            assert_eq!(mirrored.map(|own| own.cost), found.map(|own| own.cost));
            assert_eq!(mirrored.map(|own| own.gradient.map(|x| -x)), found.map(|own| own.gradient));
            assert_eq!(reversed.map(|own| own.cost), found.map(|own| own.cost));
            assert_eq!(reversed.map(|own| [own.gradient[1], own.gradient[0]]), found.map(|own| own.gradient));
        }
    }
}

#[test]
fn a_segment_has_the_same_bits_whatever_its_neighbours_and_chunk() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(504);
    let mut angle = || random.random_range(-1.5..1.5);
    let queries: Vec<Query> = (0..300).map(|i| query(EXPONENTS[i % 9], angle(), angle())).collect();
    for (device, precision) in &devices {
        let together = evaluate_segments(&queries, device).unwrap();
        let alone = evaluate_segments(&queries[100..101], device).unwrap();
        assert_eq!(together[100], alone[0], "{precision:?}");
        let gpu = common::gpu().expect("there was one");
        let limits = faircurve::gpu::plan::Limits { chunk_bytes: 10_000, ..*gpu.limits() };
        let small = Device::from_gpu(gpu.with_limits(limits)).with_precision(*precision);
        assert_eq!(evaluate_segments(&queries, &small).unwrap(), together, "{precision:?}");
    }
}

#[test]
fn curves_that_a_side_holds_have_the_same_bits_on_every_device() {
    let Some(devices) = devices() else { return };
    let batch = Family { dimension: 2, closed: false, points: 5, sigma: 0.3 }.batch(60, 41);
    let smooth = Smooth { shape: true, ..Smooth::default() };
    let fitted = |device: &Device| smooth.fit_sampled(&batch, Sampling::PerSpan(8), device).unwrap();
    let (cpu, points) = fitted(&Device::cpu());
    for (device, precision) in devices {
        let (gpu, found) = fitted(&device);
        let mut held = 0;
        for (i, (a, b)) in cpu.reports().iter().zip(gpu.reports()).enumerate() {
            assert_eq!(a.status, b.status, "{precision:?}, curve {i}: {a:?} {b:?}");
            if a.limits.is_some_and(|limits| limits.active > 0) {
                assert_eq!(points.points(i), found.points(i), "{precision:?}, curve {i}");
                held += 1;
            }
        }
        println!("{precision:?}: {held} held, {} finished on the CPU", gpu.device().finished_on_cpu);
        assert!(held >= 5 && gpu.device().finished_on_cpu >= held, "{held} held");
    }
}
