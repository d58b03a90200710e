//! Smooth connection segments against reference values, limits, and what every segment must be.

use std::f64::consts::{FRAC_PI_2, PI};

use faircurve::Device;
use faircurve::scf::{Cost, Query, Segment, evaluate_segments};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde::Deserialize;

#[derive(Deserialize)]
struct Oracle {
    unit_chord_segments: Vec<Row>,
    regular_polygons_in_unit_circle: Vec<Polygon>,
    both_ends_perpendicular_unit_chord: Vec<Arch>,
}

#[derive(Deserialize)]
struct Row {
    nu: f64,
    start_angle_degrees: f64,
    end_angle_degrees: f64,
    exists: bool,
    cost: Option<f64>,
    force_direction: Option<f64>,
    inflection: Option<bool>,
    start_curvature: Option<f64>,
    end_curvature: Option<f64>,
}

#[derive(Deserialize)]
struct Polygon {
    corners: u32,
    nu: f64,
    total_cost: f64,
}

#[derive(Deserialize)]
struct Arch {
    nu: f64,
    cost: f64,
}

fn oracle() -> Oracle {
    serde_json::from_str(include_str!("../data/scf_segments.json")).unwrap()
}

fn query(exponent: f64, angles: [f64; 2]) -> Query {
    Query { chord: 1.0, angles, exponent }
}

fn evaluate(queries: &[Query]) -> Vec<Option<Cost>> {
    evaluate_segments(queries, &Device::cpu()).unwrap()
}

fn cost(exponent: f64, angles: [f64; 2]) -> f64 {
    evaluate(&[query(exponent, angles)])[0].unwrap().cost
}

#[test]
fn every_reference_segment_is_met_and_those_that_do_not_exist_are_none() {
    let rows = oracle().unit_chord_segments;
    assert_eq!(rows.len(), 114);
    let mut worst = [0.0_f64; 4];
    for row in &rows {
        let angles = [row.start_angle_degrees, row.end_angle_degrees].map(f64::to_radians);
        let case = format!("ν = {}, {angles:?}", row.nu);
        let (segment, evaluated) = (Segment::between(1.0, angles, row.nu), evaluate(&[query(row.nu, angles)])[0]);
        assert_eq!([segment.is_some(), evaluated.is_some()], [row.exists; 2], "{case}");
        let (Some(segment), Some(evaluated)) = (segment, evaluated) else { continue };
        let wanted = row.cost.unwrap();
        let [first, last] = segment.curvatures();
        let errors = [
            (segment.cost() / wanted - 1.0).abs().max((evaluated.cost / wanted - 1.0).abs()),
            (segment.force_direction() - row.force_direction.unwrap()).abs(),
            (first / row.start_curvature.unwrap() - 1.0).abs(),
            (last / row.end_curvature.unwrap() - 1.0).abs(),
        ];
        assert!(errors.iter().all(|&error| error <= 1e-10), "{case}: {errors:?}");
        assert_eq!(segment.has_inflection(), row.inflection.unwrap(), "{case}");
        worst = std::array::from_fn(|k| worst[k].max(errors[k]));
    }
    println!("largest errors of cost, force direction, curvatures: {worst:?}");
}

#[test]
fn regular_polygons_and_half_arches_have_their_constants() {
    for Polygon { corners, nu, total_cost } in oracle().regular_polygons_in_unit_circle {
        let half = PI / f64::from(corners);
        let side = Query { chord: 2.0 * half.sin(), angles: [half, -half], exponent: nu };
        let found = f64::from(corners) * evaluate(&[side])[0].unwrap().cost;
        assert!((found / total_cost - 1.0).abs() <= 1e-12, "{corners} corners, ν = {nu}: {found} {total_cost}");
    }
    for Arch { nu, cost: wanted } in oracle().both_ends_perpendicular_unit_chord {
        let found = cost(nu, [FRAC_PI_2, -FRAC_PI_2]);
        assert!((found / wanted - 1.0).abs() <= 1e-12, "ν = {nu}: {found} {wanted}");
    }
}

/// Angles all over the square, and near zero.
fn random_queries(count: usize, rng: &mut StdRng) -> Vec<Query> {
    let one = |_| {
        let size = if rng.random_bool(0.5) { 2.0 } else { 10.0_f64.powf(-rng.random_range(0.0..3.0)) };
        let angles = [(); 2].map(|_| rng.random_range(-size..size));
        Query {
            chord: 10.0_f64.powf(rng.random_range(-1.0..1.0)),
            angles,
            exponent: [1.2, 1.5, 2.0, 3.0, 4.0, 8.0, 20.0][rng.random_range(0..7)],
        }
    };
    (0..count).map(one).collect()
}

/// d/dx by differences of fourth order, from values at −2, −1, 1, 2 steps.
fn slope([a, b, c, d]: [f64; 4], step: f64) -> f64 {
    (a - 8.0 * b + 8.0 * c - d) / (12.0 * step)
}

#[test]
fn gradients_and_hessians_are_derivatives() {
    const AWAY: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
    const STEPS: [f64; 2] = [1e-3, 5e-4];
    let mut rng = StdRng::seed_from_u64(1);
    let queries = random_queries(4000, &mut rng);
    let size = |query: &Query| query.angles[0].abs().max(query.angles[1].abs());
    // By query, by end, by step.
    let mut near = Vec::new();
    for query in &queries {
        for (end, step) in [(0, STEPS[0]), (0, STEPS[1]), (1, STEPS[0]), (1, STEPS[1])] {
            for away in AWAY {
                let mut angles = query.angles;
                angles[end] = (angles[end] + away * step * size(query)).clamp(-PI, PI);
                near.push(Query { angles, ..*query });
            }
        }
    }
    let (at, near) = (evaluate(&queries), evaluate(&near));
    let (mut tested, mut worst) = ([0; 2], [0.0_f64; 2]);
    for (i, query) in queries.iter().enumerate() {
        let around = &near[16 * i..16 * i + 16];
        let (Some(at), true) = (at[i], around.iter().all(Option::is_some)) else { continue };
        let differences = |end: usize, value: &dyn Fn(&Cost) -> f64| {
            [0, 1].map(|finer| {
                let first = 8 * end + 4 * finer;
                let values: [f64; 4] = std::array::from_fn(|k| value(&around[first + k].unwrap()));
                slope(values, STEPS[finer] * size(query))
            })
        };
        let largest = at.gradient[0].abs().max(at.gradient[1].abs());
        let stiffest = at.hessian.iter().fold(0.0_f64, |most, h| most.max(h.abs()));
        // Where two steps differ, at the edges of what exists and where inflections come and go,
        // differences are no derivatives.
        let mut compare = |kind: usize, [coarse, fine]: [f64; 2], value: f64, unit: f64| {
            if (coarse - fine).abs() <= 1e-7 * unit {
                tested[kind] += 1;
                let error = (fine - value).abs() / unit;
                worst[kind] = worst[kind].max(error);
                assert!(error <= 5e-8, "{query:?}: {error:.1e}");
            }
        };
        for end in 0..2 {
            compare(0, differences(end, &|c| c.cost), at.gradient[end], largest);
            for other in 0..2 {
                compare(1, differences(end, &|c| c.gradient[other]), at.hessian[end + other], stiffest);
            }
        }
        let moments = Segment::between(query.chord, query.angles, query.exponent).unwrap().moments();
        let of_moments = [-1.0, 1.0].iter().zip(moments).map(|(sign, m)| sign * query.exponent * m);
        assert!(of_moments.zip(at.gradient).all(|(m, g)| (m - g).abs() <= 1e-11 * largest), "{query:?}");
    }
    println!("{tested:?} derivatives tested, largest errors {worst:?}");
    assert!(tested[0] > 6500 && tested[1] > 12_000, "{tested:?}");
}

#[test]
fn costs_scale_with_the_chord_and_do_not_know_left_from_right_nor_start_from_end() {
    let mut rng = StdRng::seed_from_u64(2);
    let queries = random_queries(20_000, &mut rng);
    let with = |change: &dyn Fn(&Query) -> Query| evaluate(&queries.iter().map(change).collect::<Vec<_>>());
    let at = with(&|q| *q);
    let unit = with(&|q| Query { chord: 1.0, ..*q });
    let mirrored = with(&|q| Query { angles: q.angles.map(|x| -x), ..*q });
    let reversed = with(&|q| Query { angles: [q.angles[1], q.angles[0]], ..*q });
    let mut exist = 0;
    for (i, query) in queries.iter().enumerate() {
        assert!([&unit, &mirrored, &reversed].iter().all(|all| all[i].is_some() == at[i].is_some()), "{query:?}");
        let Some(at) = at[i] else { continue };
        let [unit, mirrored, reversed] = [unit[i], mirrored[i], reversed[i]].map(Option::unwrap);
        exist += 1;
        let factor = query.chord.powf(1.0 - query.exponent);
        assert!((at.cost / (factor * unit.cost) - 1.0).abs() <= 4.0 * f64::EPSILON, "{query:?}");
        assert!(
            (0..3)
                .all(|k| (at.hessian[k] - factor * unit.hessian[k]).abs() <= 4.0 * f64::EPSILON * at.hessian[k].abs())
        );
        let [a, b] = at.gradient;
        let [aa, ab, bb] = at.hessian;
        assert_eq!(mirrored, Cost { gradient: [-a, -b], ..at }, "{query:?}");
        assert_eq!(reversed, Cost { gradient: [b, a], hessian: [bb, ab, aa], ..at }, "{query:?}");
    }
    println!("{exist} of {} exist", queries.len());
    assert!(exist > 10_000);
}

/// The angles and the cost of κ = |m|^{1/(ν−1)} sgn m, m linear over the unit interval: the
/// small-angle limit.
fn small_angle_limit(nu: f64, [m0, m1]: [f64; 2]) -> ([f64; 2], f64) {
    let (p, step) = (1.0 / (nu - 1.0), m1 - m0);
    let signed = |m: f64, power: f64| m.signum() * m.abs().powf(power);
    let turning = (m1.abs().powf(p + 1.0) - m0.abs().powf(p + 1.0)) / ((p + 1.0) * step);
    let cost = (signed(m1, p + 2.0) - signed(m0, p + 2.0)) / ((p + 2.0) * step);
    // b = ∫ x κ dx, a = b − ∫ κ dx
    let b = (cost - m0 * turning) / step;
    ([b - turning, b], cost)
}

#[test]
fn tiny_angles_tend_to_the_small_angle_limit_and_keep_their_digits() {
    for nu in [1.2, 1.5, 2.0, 3.0, 4.0, 20.0] {
        for ends in [[1.0, 0.2], [1.0, 0.0], [-0.3, 1.0], [1.0, -1.0], [0.7, -1.0], [-0.1, -1.0]] {
            let (angles, wanted) = small_angle_limit(nu, ends);
            // cost/λ^ν is an even function of λ.
            let scaled = |lambda: f64| cost(nu, angles.map(|x| lambda * x)) / lambda.powf(nu);
            for lambda in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
                let error = (scaled(lambda) / wanted - 1.0).abs();
                assert!(error <= 10.0 * nu * lambda * lambda + 2e-12, "ν = {nu}, {ends:?}, {lambda:e}: {error:.1e}");
            }
            // Without the square, at angles where it counts.
            let error = ((4.0 * scaled(5e-4) - scaled(1e-3)) / (3.0 * wanted) - 1.0).abs();
            assert!(error <= 1e-11, "ν = {nu}, {ends:?}: {error:.1e}");
            let found = evaluate(&[query(nu, angles.map(|x| 1e-9 * x))])[0].unwrap();
            for (gradient, moment) in found.gradient.iter().zip([-ends[0], ends[1]]) {
                let error = (gradient / (nu * 1e-9_f64.powf(nu - 1.0)) - moment).abs();
                assert!(error <= 1e-11, "ν = {nu}, {ends:?}: {error:.1e}");
            }
        }
    }
    assert_eq!(cost(2.0, [0.0, 0.0]), 0.0);
}

#[test]
fn exponents_near_1_turn_at_the_ends_and_large_ones_spread_the_turn() {
    for angles in [[0.5_f64, -0.7], [0.6, 0.3], [1.2, -1.1], [0.2, -0.9]] {
        // ∫|κ| of the chord with a corner at either end.
        let corners = angles[0].abs() + angles[1].abs();
        let errors = [1.3, 1.1, 1.03, 1.01].map(|nu| (cost(nu, angles) / corners - 1.0).abs());
        println!("{angles:?}: {errors:.4?}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]) && errors[3] < 0.05, "{angles:?}: {errors:?}");
    }
    for half in [0.1, 0.5, 1.0, 1.4_f64] {
        // An arc of a circle turns as evenly as can be, and is beaten by less and less in the
        // largest curvature.
        let circle = 2.0 * half.sin();
        let ratios = [2.0, 4.0, 20.0, 100.0].map(|nu| {
            let found = cost(nu, [half, -half]);
            assert!(found <= circle.powf(nu) * half / half.sin(), "ν = {nu}, {half}: {found}");
            found.powf(1.0 / nu) / circle
        });
        println!("{half}: {ratios:.6?}");
        assert!((ratios[3] - 1.0).abs() < 0.01 && (ratios[3] - 1.0).abs() < (ratios[0] - 1.0).abs());
    }
}

#[test]
fn what_makes_no_sense_is_none_or_refused_with_a_sentence() {
    let refused = |query: Query| {
        evaluate_segments(&[self::query(2.0, [0.1, 0.2]), query], &Device::cpu()).unwrap_err().to_string()
    };
    let good = query(2.0, [0.1, 0.2]);
    for (chord, said) in [(0.0, "0"), (-1.0, "-1"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        assert_eq!(
            refused(Query { chord, ..good }),
            format!("segment 1: the chord is {said} long; it must be a positive number")
        );
        assert!(Segment::between(chord, [0.1, 0.2], 2.0).is_none());
    }
    for (exponent, said) in [(1.0, "1"), (0.5, "0.5"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        assert_eq!(
            refused(Query { exponent, ..good }),
            format!("segment 1: the exponent is {said}; it must be above 1, such as 2")
        );
        assert!(Segment::between(1.0, [0.1, 0.2], exponent).is_none());
    }
    for (angle, said) in [(3.2, "3.2"), (-4.0, "-4"), (f64::NAN, "NaN")] {
        let sentence =
            format!("segment 1: an end tangent is at {said} radians from the chord; angles from −π to π are possible");
        assert_eq!(refused(Query { angles: [0.1, angle], ..good }), sentence);
        assert!(
            Segment::between(1.0, [0.1, angle], 2.0).is_none()
                && Segment::stationary(1.0, [angle, 0.1], 2.0).is_empty()
        );
    }
    // Half a turn and more has no minimiser, for any exponent.
    for exponent in [1.01, 1.5, 2.0, 20.0, 100.0] {
        for angles in [[FRAC_PI_2, -FRAC_PI_2 - 1e-9], [PI, -PI], [3.0, -0.2], [-2.0, 1.5], [PI, 0.0]] {
            assert!(evaluate(&[query(exponent, angles)])[0].is_none(), "ν = {exponent}, {angles:?}");
        }
    }
    assert!(evaluate(&[]).is_empty());
}
