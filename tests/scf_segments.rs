//! Smooth connection segments against reference values, against segments made by quadrature, and against what every segment must be.

#[path = "common/universal.rs"]
mod universal;

use std::f64::consts::{FRAC_PI_2, PI};

use faircurve::Device;
use faircurve::scf::{Cost, Query, Segment, evaluate_segments};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use serde::Deserialize;
use universal::{Known, Reference, gauss};

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
    serde_json::from_str(include_str!("data/scf_segments.json")).unwrap()
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

/// Where on the universal curve a piece is, from every corner of the possible.
fn random_piece(rng: &mut StdRng) -> [f64; 2] {
    let [u, v] = [(); 2].map(|_| rng.random_range(0.0..PI));
    let small = 10.0_f64.powf(-rng.random_range(0.0..4.0));
    match rng.random_range(0..6) {
        0 => [u.min(v), u.max(v)],
        1 => [-u, v],
        // Nearly flat.
        2 => [small * u.min(v), small * u.max(v)],
        3 => [-small * u, small * v],
        // Nearly circular.
        4 => [u, u + small * (PI - u)],
        // With nearly everything between two inflections.
        _ => [small * u, PI - 0.1 * small * v],
    }
}

/// A segment that is known, laid over a chord, maybe mirrored and reversed.
struct Made {
    known: Known,
    chord: f64,
    angles: [f64; 2],
    force: f64,
    /// |κ|^ν sgn κ at both ends, 1 at most.
    bends: [f64; 2],
}

impl Made {
    fn random(reference: &Reference, rng: &mut StdRng) -> Option<Self> {
        let t = random_piece(rng);
        // Nothing is left of an interval that rounding closes.
        if t[1] - t[0] < 1e-5 || t[1] >= PI {
            return None;
        }
        let known = reference.piece(t);
        let mirrored = if rng.random_bool(0.5) { -1.0 } else { 1.0 };
        let reversed = rng.random_bool(0.5);
        let (mut angles, mut bends) = (known.angles.map(|x| mirrored * x), t.map(|t| mirrored * reference.bend(t)));
        if reversed {
            angles.reverse();
            bends = [-bends[1], -bends[0]];
        }
        let chord = 10.0_f64.powf(rng.random_range(-2.0..2.0));
        Some(Made { known, chord, angles, force: mirrored * known.force, bends })
    }
}

/// Rounding of the end angles: of their sums of numbers up to π, and of the chord's direction, since displacements are differences:
/// of J, which is T₁ at most, and of moments over q.
fn angle_rounding(reference: &Reference, known: &Known) -> f64 {
    let moment = known.t.iter().map(|t| t.abs().sin().powf(reference.q)).fold(0.0, f64::max);
    (16.0 + 4.0 * (moment / reference.q + known.t[1]) / known.chord()) * f64::EPSILON
}

/// Near a fold, where two segments with an inflection meet, T moves with the root of what the angles move.
const FOLD: f64 = 1e-6;

/// Differences of cost, force direction and ends from those made, in units of what rounding may do.
fn differences(reference: &Reference, made: &Made, segment: &Segment) -> [f64; 3] {
    let Made { known, chord, .. } = made;
    let nu = reference.nu;
    let unit = known.chord();
    let of_angles = angle_rounding(reference, known);
    // A power ν of some roundings.
    let rounding = (64.0 + 16.0 * nu) * f64::EPSILON;
    let wanted = reference.cost(known, *chord);
    // The derivatives of the cost in the angles are ν times the moments, of the unit chord D^{ν−1} sin^q: through folds, too.
    let moments: f64 = known.t.iter().map(|t| t.abs().sin().powf(reference.q)).sum();
    let of_cost = rounding + of_angles * nu * moments / known.along;
    let most = if known.t[0] < 0.0 { FOLD } else { f64::INFINITY };
    let moved = reference.sensitivity(known, of_angles).map(|moved| moved.min(most));
    let of_force = of_angles + moved[0].min(moved[1]);
    // ln D by T₀ and T₁.
    let stretch: f64 = known
        .t
        .iter()
        .zip(moved)
        .map(|(t, moved)| {
            let (sine, cosine) = t.abs().sin_cos();
            let along = known.along * sine.powf(reference.q);
            (along.abs() + (known.across * cosine * sine.powf(reference.q - 1.0)).abs()) / (unit * unit) * moved
        })
        .sum();
    let order = if made.bends[0].abs() == known.t[0].abs().sin() { [0, 1] } else { [1, 0] };
    let curvatures = segment.curvatures();
    let of_ends = (0..2).map(|end| {
        let bend = (curvatures[end].abs() * chord / unit).powf(nu) * curvatures[end].signum();
        let t = known.t[order[end]];
        let allowed = moved[order[end]] + (rounding + 2.0 * nu * stretch) * t.abs().sin();
        (bend - made.bends[end]).abs() / allowed
    });
    [
        // Powers of 100 leave the range of numbers.
        if wanted < 1e-290 { 0.0 } else { (segment.cost() / wanted - 1.0).abs() / of_cost },
        (segment.force_direction() - made.force).abs() / of_force,
        of_ends.fold(0.0, f64::max),
    ]
}

#[test]
fn a_million_segments_made_by_quadrature_are_found_again() {
    const EXPONENTS: u64 = 2000;
    const EACH: usize = 500;
    let of_exponent = |number: u64| {
        let mut rng = StdRng::seed_from_u64(number);
        let nu = match number {
            0 => 1.01,
            1 => 2.0,
            2 => 100.0,
            _ => 1.05 * (60.0_f64 / 1.05).powf(rng.random_range(0.0..1.0)),
        };
        let reference = Reference::new(nu);
        let (mut lost, mut folds, mut made_of_all, mut cheapest) = (Vec::new(), 0, 0, 0);
        let mut worst = [0.0_f64; 3];
        while made_of_all < EACH {
            let Some(made) = Made::random(&reference, &mut rng) else { continue };
            made_of_all += 1;
            let all = Segment::stationary(made.chord, made.angles, nu);
            let each: Vec<[f64; 3]> = all.iter().map(|segment| differences(&reference, &made, segment)).collect();
            let largest = |d: &[f64; 3]| d.iter().copied().fold(0.0, f64::max);
            let nearest = (0..each.len()).min_by(|&i, &j| largest(&each[i]).total_cmp(&largest(&each[j])));
            match nearest {
                Some(k) if largest(&each[k]) <= 1.0 => {
                    worst = std::array::from_fn(|i| worst[i].max(each[k][i]));
                    cheapest += usize::from(k == 0);
                    assert!(all[0].cost() <= all[k].cost() * (1.0 + 1e-9), "ν = {nu}: {:?}", made.known);
                }
                // Rounding may part a curve from the edge of what exists.
                None if reference
                    .sensitivity(&made.known, angle_rounding(&reference, &made.known))
                    .iter()
                    .any(|&moved| moved > FOLD) =>
                {
                    folds += 1
                }
                _ => lost.push(format!(
                    "ν = {nu}: {:?} over {:?} among {} with {:?}",
                    made.known,
                    made.angles,
                    all.len(),
                    nearest.map(|k| each[k])
                )),
            }
        }
        (lost, folds, cheapest, worst)
    };
    let all: Vec<_> = (0..EXPONENTS).into_par_iter().map(of_exponent).collect();
    let lost: Vec<&String> = all.iter().flat_map(|(lost, ..)| lost).collect();
    let folds: usize = all.iter().map(|(_, folds, ..)| folds).sum();
    let cheapest: usize = all.iter().map(|(_, _, cheapest, _)| cheapest).sum();
    let worst = all.iter().fold([0.0_f64; 3], |worst, one| std::array::from_fn(|k| worst[k].max(one.3[k])));
    println!(
        "{} lost, {folds} at folds, {cheapest} the cheapest of their angles; differences {worst:.2?} of those allowed",
        lost.len()
    );
    lost.iter().take(60).for_each(|lost| println!("{lost}"));
    assert!(lost.is_empty(), "{} lost", lost.len());
    assert!(folds <= 10, "{folds} at folds");
    assert!(cheapest > 500_000, "{cheapest}");
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

#[test]
fn gradients_and_hessians_are_derivatives() {
    let mut rng = StdRng::seed_from_u64(1);
    let queries = random_queries(4000, &mut rng);
    // Differences of fourth order, over a thousandth of the angles.
    let weights = [(-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0)];
    let step = |query: &Query| 3e-4 * query.angles[0].abs().max(query.angles[1].abs());
    let moved = |query: &Query, end: usize, steps: f64| {
        let mut angles = query.angles;
        angles[end] += steps * step(query);
        Query { angles, ..*query }
    };
    let near: Vec<Query> =
        queries.iter().flat_map(|q| (0..2).flat_map(move |end| weights.map(|(s, _)| moved(q, end, s)))).collect();
    let (at, near) = (evaluate(&queries), evaluate(&near));
    let (mut tested, mut worst) = (0, [0.0_f64; 2]);
    for (i, query) in queries.iter().enumerate() {
        let around = &near[8 * i..8 * i + 8];
        let (Some(at), true) = (at[i], around.iter().all(Option::is_some)) else { continue };
        // Where an inflection enters or leaves, and beside a fold, derivatives of higher order are infinite.
        let segment = Segment::between(query.chord, query.angles, query.exponent).unwrap();
        let [first, last] = segment.moments().map(f64::abs);
        let rough = at.hessian.iter().fold(0.0_f64, |most, h| most.max(h.abs())) * step(query).powi(2)
            > 1e-4 * at.cost * query.exponent.powi(2);
        let turning = (query.angles[0] - query.angles[1]).abs();
        if first.min(last) < 0.1 * first.max(last) || rough || turning > 2.8 {
            continue;
        }
        tested += 1;
        let difference = |end: usize, value: &dyn Fn(&Cost) -> f64| {
            let terms = weights.iter().zip(&around[4 * end..]).map(|((_, w), cost)| w * value(&cost.unwrap()));
            terms.sum::<f64>() / step(query)
        };
        let size = at.gradient[0].abs().max(at.gradient[1].abs());
        let stiffness = at.hessian.iter().fold(0.0_f64, |most, h| most.max(h.abs()));
        for end in 0..2 {
            let error = (difference(end, &|c| c.cost) - at.gradient[end]).abs() / size;
            worst[0] = worst[0].max(error);
            assert!(error <= 1e-8, "{query:?}: {error:.1e}");
            for other in 0..2 {
                let error = (difference(end, &|c| c.gradient[other]) - at.hessian[end + other]).abs() / stiffness;
                worst[1] = worst[1].max(error);
                assert!(error <= 1e-7, "{query:?}: {error:.1e}");
            }
        }
        let of_moments = [-1.0, 1.0].iter().zip(segment.moments()).map(|(sign, m)| sign * query.exponent * m);
        assert!(of_moments.zip(at.gradient).all(|(m, g)| (m - g).abs() <= 1e-12 * size), "{query:?}");
    }
    println!("{tested} tested, largest errors {worst:?}");
    assert!(tested > 1500, "{tested}");
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

/// The angles and the cost of κ = |m|^{1/(ν−1)} sgn m, m linear over the unit interval: the small-angle limit.
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
        // An arc of a circle turns as evenly as can be, and is beaten by less and less in the largest curvature.
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

/// Segments of every kind: with and without inflections, flat, steep.
fn samples() -> Vec<Segment> {
    let angles = [
        [0.5, -0.7],
        [0.5, -0.5],
        [0.7, 0.4],
        [-0.3, -0.3],
        [0.0, 1.0],
        [1.2, -1.1],
        [0.02, -0.01],
        [0.02, 0.015],
        [1e-5, 2e-5],
        [-0.9, 0.1],
    ];
    let exponents = [1.2, 1.5, 2.0, 3.0, 4.0, 20.0];
    exponents.iter().flat_map(|&nu| angles.map(|angles| Segment::between(2.5, angles, nu).unwrap())).collect()
}

fn apart(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

#[test]
fn points_at_arc_lengths_have_the_tangents_and_curvatures_that_lead_there() {
    let rule = gauss(0.0);
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        let case = format!("ν = {nu}, cost {}", segment.cost());
        assert_eq!(segment.at(-1.0), segment.at(0.0));
        assert_eq!(segment.at(2.0 * length), segment.at(length));
        assert!(
            apart(segment.at(0.0).point, [0.0, 0.0]) == 0.0 && apart(segment.at(length).point, [2.5, 0.0]) <= 1e-14,
            "{case}"
        );
        let ends = [segment.at(0.0).curvature, segment.at(length).curvature];
        assert!((0..2).all(|k| (ends[k] - segment.curvatures()[k]).abs() <= 1e-12 * ends[k].abs()), "{case}");
        const PANELS: usize = 128;
        let step = length / PANELS as f64;
        let (mut point, mut cost) = ([0.0; 2], 0.0);
        let mut last = segment.at(0.0);
        let most = (0..=64)
            .map(|k| segment.at(length * f64::from(k) / 64.0))
            .map(|site| site.curvature.abs())
            .fold(0.0, f64::max);
        for panel in 0..PANELS {
            let mut turning = 0.0;
            for &[x, weight] in &rule {
                let site = segment.at((panel as f64 + x) * step);
                let (sine, cosine) = site.angle.sin_cos();
                point = [point[0] + weight * step * cosine, point[1] + weight * step * sine];
                turning += weight * step * site.curvature;
                cost += weight * step * site.curvature.abs().powf(nu);
            }
            let site = segment.at((panel + 1) as f64 * step);
            assert!(apart(site.point, point) <= 1e-9 * length, "{case}, panel {panel}: {:?} {point:?}", site.point);
            // Across an inflection the curvature is a root.
            let allowed = if site.curvature * last.curvature > 0.0 { 1e-9 } else { 0.1 };
            assert!(
                (site.angle - last.angle - turning).abs() <= allowed * most * step,
                "{case}, panel {panel}: {} {turning}",
                site.angle - last.angle
            );
            last = site;
        }
        assert!((cost / segment.cost() - 1.0).abs() <= 1e-6, "{case}: {cost}");
    }
}

#[test]
fn the_curvature_to_the_power_nu_is_a_component_of_the_tangent() {
    for segment in samples() {
        let (nu, length, force) = (segment.exponent(), segment.length(), segment.force_direction());
        let sites: Vec<_> = (0..=100).map(|k| segment.at(length * f64::from(k) / 100.0)).collect();
        // The size from the site of the largest component.
        let component = |k: usize| (sites[k].angle - force).cos();
        let most = (0..sites.len()).max_by(|&i, &j| component(i).total_cmp(&component(j))).unwrap();
        let c = sites[most].curvature.abs().powf(nu) / component(most);
        for (k, site) in sites.iter().enumerate() {
            let error = (site.curvature.abs().powf(nu) - c * component(k)).abs();
            // Components good to the rounding of angles about π/2.
            assert!(
                error <= c * (1e-11 * component(most) + 4.0 * f64::EPSILON),
                "ν = {nu}, {k}: {error:.1e} of {c:.1e}"
            );
        }
        let inflected = sites.windows(2).any(|pair| pair[0].curvature * pair[1].curvature < 0.0);
        assert_eq!(inflected, segment.has_inflection(), "ν = {nu}");
    }
}

#[test]
fn sites_of_an_angle_are_all_there_are() {
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        let sites: Vec<_> = (0..=200).map(|k| segment.at(length * f64::from(k) / 200.0)).collect();
        for site in sites.iter().skip(1).take(199) {
            let all = segment.at_angle(site.angle);
            let crossings = sites
                .windows(2)
                .filter(|pair| (pair[0].angle - site.angle) * (pair[1].angle - site.angle) < 0.0)
                .count();
            let touching = sites.iter().filter(|other| other.angle == site.angle).count();
            assert!(all.len() >= crossings.max(1) && all.len() <= 2, "ν = {nu}: {} {crossings} {touching}", all.len());
            assert!(all.iter().all(|found| (found.angle - site.angle).abs() <= 4.0 * f64::EPSILON * PI), "ν = {nu}");
            let nearest = all.iter().map(|found| apart(found.point, site.point)).fold(f64::INFINITY, f64::min);
            let allowed = 1e-12 * length + 16.0 * f64::EPSILON / site.curvature.abs();
            assert!(nearest <= allowed, "ν = {nu}: {nearest:.1e} from {site:?}");
        }
        let (least, most) = sites.iter().fold((PI, -PI), |(l, m), site| (site.angle.min(l), site.angle.max(m)));
        let beyond = [least - 0.1, most + 0.1 + 0.01 * (most - least)];
        assert!(beyond.iter().all(|&angle| segment.at_angle(angle).is_empty()), "ν = {nu}");
    }
}

/// Distance from a point to the nearest edge of a polyline.
fn distance(point: [f64; 2], polyline: &[[f64; 2]]) -> f64 {
    let edge = |pair: &[[f64; 2]]| {
        let (e, p) =
            ([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]], [point[0] - pair[0][0], point[1] - pair[0][1]]);
        let t = ((p[0] * e[0] + p[1] * e[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
        apart(p, e.map(|x| t * x))
    };
    polyline.windows(2).map(edge).fold(f64::INFINITY, f64::min)
}

#[test]
fn polylines_and_beziers_keep_within_their_tolerance() {
    for segment in samples() {
        let (nu, length) = (segment.exponent(), segment.length());
        const FINE: usize = 4000;
        let fine: Vec<[f64; 2]> = (0..=FINE).map(|k| segment.at(length * k as f64 / FINE as f64).point).collect();
        let most = (0..=FINE).map(|k| segment.at(length * k as f64 / FINE as f64).curvature.abs()).fold(0.0, f64::max);
        // How far the samples' own polyline may be.
        let own = most * (length / FINE as f64).powi(2) / 8.0;
        for tolerance in [1e-2, 1e-4] {
            let polyline = segment.polyline(tolerance);
            assert_eq!(polyline[0], [0.0, 0.0]);
            assert!(apart(polyline[polyline.len() - 1], [2.5, 0.0]) <= 1e-14);
            let worst = fine.iter().step_by(7).map(|&p| distance(p, &polyline)).fold(0.0, f64::max);
            assert!(worst <= tolerance, "ν = {nu}, {tolerance}: {worst}");
            let pieces = segment.beziers(tolerance);
            assert_eq!(pieces[0][0], [0.0, 0.0]);
            assert!(apart(pieces[pieces.len() - 1][3], [2.5, 0.0]) <= 1e-14);
            let direction = |from: [f64; 2], to: [f64; 2]| (to[1] - from[1]).atan2(to[0] - from[0]);
            for pair in pieces.windows(2) {
                assert_eq!(pair[0][3], pair[1][0]);
                let turn = direction(pair[0][2], pair[0][3]) - direction(pair[1][0], pair[1][1]);
                assert!(turn.abs() <= 1e-10, "ν = {nu}: {turn:.1e}");
            }
            let ends = [
                direction(pieces[0][0], pieces[0][1]),
                direction(pieces[pieces.len() - 1][2], pieces[pieces.len() - 1][3]),
            ];
            let wanted = [segment.at(0.0).angle, segment.at(length).angle];
            assert!((0..2).all(|k| (ends[k] - wanted[k]).abs() <= 1e-10), "ν = {nu}: {ends:?} {wanted:?}");
            let mut worst = 0.0_f64;
            for [p0, p1, p2, p3] in &pieces {
                for k in 0..=10 {
                    let (u, v) = (0.1 * f64::from(k), 1.0 - 0.1 * f64::from(k));
                    let weights = [v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u];
                    let point = [0, 1]
                        .map(|c| weights[0] * p0[c] + weights[1] * p1[c] + weights[2] * p2[c] + weights[3] * p3[c]);
                    worst = worst.max(distance(point, &fine));
                }
            }
            assert!(worst <= tolerance + own, "ν = {nu}, {tolerance}: {worst}");
        }
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
