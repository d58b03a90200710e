//! Energies of discrete curves against automatic differentiation, closed forms, and what every
//! energy must be.

use std::f64::consts::{PI, TAU};

use faircurve::discrete::{
    Energy, Evaluate, Evaluation, MOST_EDGES, Want, attachment, bending, length, tautness, tension, torsion, variation,
};
use faircurve::{CurveBatch, CurveStatus, Device};
use glam::{DMat3, DVec3};
use proptest::prelude::*;
use serde_json::Value;

use crate::elastica::elastica;

fn numbers(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(array) => array.iter().flat_map(numbers).collect(),
        None => vec![value.as_f64().unwrap()],
    }
}

/// One curve as a batch.
fn batch(dimension: usize, coords: &[f64], closed: bool) -> CurveBatch {
    let offsets = vec![0, coords.len() / dimension];
    CurveBatch::from_ragged(dimension, coords.to_vec(), offsets).unwrap().closed_each(vec![closed]).unwrap()
}

fn at(energy: &Energy, dimension: usize, coords: &[f64], closed: bool, options: Evaluate) -> Evaluation {
    let options = Evaluate { want: Want::Hessian, ..options };
    let found = energy.evaluate(&batch(dimension, coords, closed), options, &Device::cpu()).unwrap().remove(0);
    assert_eq!(found.problem, None);
    found
}

fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Every number within `tolerance` of the largest wanted, or of `floor` where that is more.
#[track_caller]
fn assert_close(found: &[f64], wanted: &[f64], floor: f64, tolerance: f64, what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    let scale = largest(wanted).max(floor);
    for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        assert!((found - wanted).abs() <= tolerance * scale, "{what}, entry {k}: {found} for {wanted}");
    }
}

/// The six energies of edges, with the exponents of bending that differ in kind.
fn energies() -> Vec<(&'static str, Energy, f64)> {
    vec![
        ("length", length(), 1.0),
        ("tension", tension(), 2.0),
        ("bending_1_5", bending(1.5), -0.5),
        ("bending_2", bending(2.0), -1.0),
        ("bending_3", bending(3.0), -2.0),
        ("variation", variation(), -3.0),
        ("torsion", torsion(), -3.0),
    ]
}

#[test]
fn values_and_gradients_are_those_of_automatic_differentiation() {
    let oracle: Value = serde_json::from_str(include_str!("../data/discrete_energies.json")).unwrap();
    let options = Evaluate { torsion_curvature: oracle["torsion_epsilon"].as_f64(), ..Evaluate::default() };
    let mut compared = 0;
    for (i, case) in oracle["cases"].as_array().unwrap().iter().enumerate() {
        let dimension = case["vertices"][0].as_array().unwrap().len();
        let (vertices, closed) = (numbers(&case["vertices"]), case["closed"].as_bool().unwrap());
        for (name, energy, _) in energies() {
            let Some(value) = case["values"][name].as_f64() else { continue };
            let found = at(&energy, dimension, &vertices, closed, options);
            assert_close(&[found.value], &[value], 0.0, 1e-12, &format!("case {i}, {name}"));
            let gradient = numbers(&case["gradients"][name]);
            assert_close(&found.gradient, &gradient, 0.0, 1e-12, &format!("case {i}, gradient of {name}"));
            compared += 1;
        }
    }
    assert_eq!(compared, 6 * 6 + 6 * 7);
}

#[test]
fn hessians_of_sums_and_attachment_are_differences_of_gradients() {
    let energy =
        0.3 * length() + 0.2 * tension() + bending(3.0) + 0.1 * variation() + 0.05 * torsion() + 2.0 * attachment();
    for closed in [false, true] {
        // Eight edges for four spans of a closed curve, six for three of an open one.
        let count = if closed { 8 } else { 7 };
        let turn = |v: usize| TAU * v as f64 / 9.0;
        let vertices: Vec<f64> =
            (0..count).flat_map(|v| [turn(v).cos(), 0.9 * turn(v).sin(), 0.4 * (2.0 * turn(v)).cos()]).collect();
        let data: Vec<f64> = (0..4).flat_map(|k| [k as f64, 1.0 - k as f64, 0.5]).collect();
        let targets = batch(3, &data, closed).with_weights(vec![1.0, 2.0, 0.5, 3.0]).unwrap();
        let options = Evaluate { targets: Some(&targets), torsion_curvature: Some(1e-3), ..Evaluate::default() };
        let found = at(&energy, 3, &vertices, closed, options);
        let step = 1e-4;
        let mut differences = vec![];
        for entry in 0..vertices.len() {
            let moved = |steps: f64| {
                let mut vertices = vertices.clone();
                vertices[entry] += steps * step;
                at(&energy, 3, &vertices, closed, options).gradient
            };
            let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(moved);
            differences.extend((0..a.len()).map(|k| (8.0 * (a[k] - b[k]) - (c[k] - d[k])) / (12.0 * step)));
        }
        // Fourth-order differences: ε/step is 2e-12, step⁴ times fifth derivatives is below 1e-10.
        assert_close(&found.hessian, &differences, 0.0, 1e-9, &format!("closed {closed}"));
    }
}

#[test]
fn attachment_holds_every_nth_vertex() {
    let vertices = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0, 4.0, 0.0];
    let targets = batch(2, &[0.0, 1.0, 2.0, 0.0, 4.0, -2.0], false).with_weights(vec![1.0, 5.0, 3.0]).unwrap();
    let options = Evaluate { targets: Some(&targets), ..Evaluate::default() };
    let found = at(&(0.5 * attachment()), 2, &vertices, false, options);
    assert_eq!(found.value, 0.5 * 0.5 * (1.0 + 3.0 * 4.0));
    assert_eq!(found.gradient, [0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
    let diagonal: Vec<f64> = (0..10).map(|k| found.hessian[11 * k]).collect();
    assert_eq!(diagonal, [0.5, 0.5, 0.0, 0.0, 2.5, 2.5, 0.0, 0.0, 1.5, 1.5]);
    assert_eq!(found.hessian.iter().filter(|h| **h != 0.0).count(), 6);
}

#[test]
fn tautness_is_length_by_the_widths_of_spans_which_are_the_datas_own() {
    // Chords 4, 1 and 2; turns of 90° and of 0°.
    let data = [0.0, 0.0, 4.0, 0.0, 4.0, 1.0, 4.0, 3.0];
    let targets = batch(2, &data, false);
    let options = Evaluate { targets: Some(&targets), ..Evaluate::default() };
    let vertices: [f64; 14] = [0.0, 0.0, 2.0, 0.5, 4.0, 0.0, 4.5, 0.5, 4.0, 1.0, 3.5, 2.0, 4.0, 3.0];
    let edge = |k: usize| (vertices[2 * k + 2] - vertices[2 * k]).hypot(vertices[2 * k + 3] - vertices[2 * k + 1]);
    let span = |k: usize| edge(2 * k) + edge(2 * k + 1);
    // Widths 1·½ (and no less than 4/10), 1·½ and 1·1.
    let wanted = span(0) / 0.25 + span(1) / 0.25 + span(2);
    let found = at(&tautness(), 2, &vertices, false, options);
    assert_close(&[found.value], &[wanted], 0.0, 1e-15, "open");
    let step = 1e-6;
    let differences: Vec<f64> = (0..vertices.len())
        .map(|entry| {
            let moved = |by: f64| {
                let mut vertices = vertices;
                vertices[entry] += by;
                at(&tautness(), 2, &vertices, false, options).value
            };
            (moved(step) - moved(-step)) / (2.0 * step)
        })
        .collect();
    assert_close(&found.gradient, &differences, 0.0, 1e-8, "gradient");
    // A square turns by 90° everywhere. Data that turn back leave a tenth of the chord.
    let square = [0.0, 0.0, 2.0, 0.0, 2.0, 2.0, 0.0, 2.0];
    assert_close(&[at(&tautness(), 2, &square, true, Evaluate::default()).value], &[8.0], 0.0, 1e-15, "square");
    let back = [0.0, 0.0, 2.0, 0.0, 0.0, 1e-9];
    let found = at(&tautness(), 2, &back, false, Evaluate::default()).value;
    assert_close(&[found], &[2.0 * 2.0 / 0.04], 0.0, 1e-9, "there and back");
    // It has the unit of bending.
    let hundred_times = vertices.map(|x| 100.0 * x);
    let wide = batch(2, &data.map(|x| 100.0 * x), false);
    let options = Evaluate { targets: Some(&wide), ..Evaluate::default() };
    let found = at(&tautness(), 2, &hundred_times, false, options);
    assert_close(&[100.0 * found.value], &[wanted], 0.0, 1e-14, "a hundred times as large");
}

fn coordinates(count: usize) -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-0.2..0.2f64, 3 * count)
}

/// A closed curve or an arc around the origin, far from having equal neighbours.
fn around(shake: &[f64], closed: bool) -> Vec<DVec3> {
    let count = shake.len() / 3;
    let turn = TAU * if closed { 1.0 } else { 0.6 } / count as f64;
    let at = |v: usize| DVec3::new((turn * v as f64).cos(), (turn * v as f64).sin(), 0.4 * (turn * v as f64).cos());
    shake.chunks(3).enumerate().map(|(v, s)| at(v) + turn.min(1.0) * DVec3::from_slice(s)).collect()
}

fn flat(points: &[DVec3]) -> Vec<f64> {
    points.iter().flat_map(DVec3::to_array).collect()
}

fn vectors(coords: &[f64]) -> Vec<DVec3> {
    coords.chunks(3).map(DVec3::from_slice).collect()
}

proptest! {
    #[test]
    fn energies_follow_motions_reversal_scale_and_index(
        shake in (3usize..12).prop_flat_map(coordinates),
        closed: bool,
        angles in [0.0..TAU, 0.0..PI, 0.0..TAU],
        translation in [-3.0..3.0f64, -3.0..3.0, -3.0..3.0],
        factor in 0.01..100.0f64,
        shift in 0usize..12,
    ) {
        let points = around(&shake, closed);
        let count = points.len();
        let rotation = DMat3::from_euler(glam::EulerRot::ZXZ, angles[0], angles[1], angles[2]);
        // Without ε below which torsion loses its meaning: its own size scales.
        let run = |energy: &Energy, points: &[DVec3], size: f64| {
            let options = Evaluate { torsion_curvature: Some(1e-2 / size), ..Evaluate::default() };
            at(energy, 3, &flat(points), closed, options)
        };
        for (name, energy, degree) in energies() {
            let here = run(&energy, &points, 1.0);
            let gradient = vectors(&here.gradient);
            // Coordinates of 5 round by 1e-15, which energies of third order on edges of 0.2
            // multiply by 1e3 … 1e5.
            let close = |found: Evaluation, value: f64, wanted: &[DVec3], what: &str| {
                let what = format!("{name}, {count} vertices, closed {closed}, {what}");
                // A value moves by its gradient times the coordinates' rounding.
                assert_close(&[found.value], &[value], largest(&here.gradient).max(1e-3), 1e-9, &what);
                assert_close(&found.gradient, &flat(wanted), 1e-3, 1e-9, &format!("gradient of {what}"));
            };
            let moved: Vec<_> = points.iter().map(|&p| rotation * p + DVec3::from(translation)).collect();
            let turned: Vec<_> = gradient.iter().map(|&g| rotation * g).collect();
            close(run(&energy, &moved, 1.0), here.value, &turned, "moved");
            let backwards = |list: &[DVec3]| list.iter().rev().copied().collect::<Vec<_>>();
            close(run(&energy, &backwards(&points), 1.0), here.value, &backwards(&gradient), "reversed");
            if closed {
                let shifted = |list: &[DVec3]| (0..count).map(|v| list[(v + shift) % count]).collect::<Vec<_>>();
                close(run(&energy, &shifted(&points), 1.0), here.value, &shifted(&gradient), "shifted");
            }
            let scaled: Vec<_> = points.iter().map(|&p| factor * p).collect();
            let found = run(&energy, &scaled, factor);
            let back = |x: &f64, degree: f64| x * factor.powf(-degree);
            let found = Evaluation {
                value: back(&found.value, degree),
                gradient: found.gradient.iter().map(|g| back(g, degree - 1.0)).collect(),
                ..found
            };
            close(found, here.value, &gradient, "scaled");
        }
    }
}

#[test]
fn the_default_torsion_curvature_follows_the_size() {
    let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.001, 0.0, 3.0, 0.001, 0.001, 4.0, 0.0, 0.002];
    let value = |factor: f64| {
        let scaled: Vec<f64> = points.iter().map(|x| factor * x).collect();
        at(&torsion(), 3, &scaled, false, Evaluate::default()).value * factor.powi(3)
    };
    let size = (16.0f64 + 1e-6 + 4e-6).sqrt();
    let stated = Evaluate { torsion_curvature: Some(1e-3 / size), ..Evaluate::default() };
    assert_close(&[value(1.0)], &[at(&torsion(), 3, &points, false, stated).value], 0.0, 1e-14, "of the size");
    assert_close(&[value(1e-4), value(1e5)], &[value(1.0); 2], 0.0, 1e-12, "scaled");
}

#[test]
fn circles_cost_no_variation_and_are_critical() {
    for count in [3, 4, 5, 6, 7, 12, 60] {
        let angle = |v: usize| TAU * v as f64 / count as f64;
        let circle: Vec<f64> =
            (0..count).flat_map(|v| [3.0 + 2.0 * angle(v).cos(), 1.0 + 2.0 * angle(v).sin()]).collect();
        let found = at(&variation(), 2, &circle, true, Evaluate::default());
        // Coordinates up to 5 round edges by 4 ε, tangents by that over the edge, and K′ − K by 4
        // tangents over the edge. The gradient takes 2/Δs of it, twice the factors 2/Δs of tangents
        // in curvature vectors, and 2/Δs of edges in tangents.
        let edge = 4.0 * (PI / count as f64).sin();
        let jump = 16.0 * f64::EPSILON / edge.powi(2);
        assert!(found.value <= count as f64 * jump * jump / edge, "{count}: {}", found.value);
        assert!(largest(&found.gradient) <= 16.0 * jump / edge.powi(3), "{count}: {:?}", found.gradient);
        // It can fail: an ellipse is not critical.
        let ellipse: Vec<f64> = circle.chunks(2).flat_map(|p| [p[0], 1.1 * p[1]]).collect();
        assert!(count == 4 || largest(&at(&variation(), 2, &ellipse, true, Evaluate::default()).gradient) > 1e-3);
    }
}

#[test]
fn energies_of_a_helix_tend_to_curvature_and_torsion_in_second_order() {
    let (radius, pitch, turns) = (1.0f64, 0.4f64, 2.0);
    let speed = radius.hypot(pitch);
    let (curvature, twist) = (radius / speed.powi(2), pitch / speed.powi(2));
    let options = Evaluate { torsion_curvature: Some(1e-9), ..Evaluate::default() };
    let product = (curvature * twist).powi(2);
    // Of how many edges' length the terms are: those of two edges stand at m − 1 vertices, those of
    // three on m − 2 edges.
    let cases = [
        ("length", length(), 1.0, 0),
        ("bending", bending(2.0), curvature.powi(2), 1),
        ("bending, exponent 3", bending(3.0), curvature.powi(3), 1),
        ("variation", variation(), product, 2),
        ("torsion", torsion(), product, 2),
    ];
    for (name, energy, density, missing) in cases {
        let error = |m: usize| {
            let t = |v: usize| turns * TAU * v as f64 / m as f64;
            let helix: Vec<f64> =
                (0..=m).flat_map(|v| [radius * t(v).cos(), radius * t(v).sin(), pitch * t(v)]).collect();
            let wanted = density * turns * TAU * speed * (m - missing) as f64 / m as f64;
            at(&energy, 3, &helix, false, options).value / wanted - 1.0
        };
        let errors = [100, 200, 400].map(error);
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((ratio - 4.0).abs() < 0.05, "{name}: {errors:?}");
        }
        assert!(errors[2].abs() < 1e-3, "{name}: {errors:?}");
    }
}

#[test]
fn straight_lines_cost_nothing_that_bends() {
    let line: Vec<f64> = [0.0, 1.0, 2.5, 3.0, 4.75].iter().flat_map(|x| [*x, 2.0 * x, -*x]).collect();
    for energy in [bending(2.0), bending(3.0), variation(), torsion()] {
        let found = at(&energy, 3, &line, false, Evaluate::default());
        assert!(found.value.abs() < 1e-30 && largest(&found.gradient) < 1e-13, "{energy}: {found:?}");
        assert!(found.hessian.iter().all(|h| h.is_finite()), "{energy}");
    }
}

#[test]
fn an_energy_of_a_users_own_is_as_good_as_a_built_in_one() {
    let shake: Vec<f64> = (0..27).map(|k| 0.2 * (7.3 * k as f64).sin()).collect();
    for closed in [false, true] {
        let points = flat(&around(&shake, closed));
        let planar: Vec<f64> = points.chunks(3).flat_map(|p| [p[0], p[1]]).collect();
        for (dimension, points) in [(3, &points), (2, &planar)] {
            let run = |energy: Energy| at(&(0.7 * energy + length()), dimension, points, closed, Evaluate::default());
            let (found, wanted) = (run(elastica()), run(bending(2.0)));
            assert_close(&[found.value], &[wanted.value], 0.0, 1e-14, "value");
            assert_close(&found.gradient, &wanted.gradient, 0.0, 1e-14, "gradient");
            assert_close(&found.hessian, &wanted.hessian, 0.0, 1e-14, "Hessian");
        }
    }
}

#[test]
fn curves_too_short_for_an_energy_have_none_of_it() {
    let points = [[0.0, 0.0], [3.0, 4.0], [6.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..0], &points[..1], &points[..2], &points[..3]]).unwrap();
    for (energy, wanted) in [
        (length(), [0.0, 0.0, 5.0, 10.0]),
        (tension(), [0.0, 0.0, 12.5, 50.0]),
        (bending(2.0), [0.0, 0.0, 0.0, 2.56 / 5.0]),
        (variation(), [0.0; 4]),
        (torsion(), [0.0; 4]),
    ] {
        let found =
            energy.evaluate(&batch, Evaluate { want: Want::Hessian, ..Evaluate::default() }, &Device::cpu()).unwrap();
        for (i, found) in found.iter().enumerate() {
            assert_eq!(found.problem, None);
            assert_close(&[found.value], &[wanted[i]], 0.0, 1e-15, &format!("{energy} of {i} vertices"));
            assert_eq!((found.gradient.len(), found.hessian.len()), (2 * i, 4 * i * i));
            assert!(wanted[i] > 0.0 || found.gradient.iter().chain(&found.hessian).all(|x| *x == 0.0));
        }
    }
    let nothing = CurveBatch::from_slices(&[&points[..0]]).unwrap().closed(true);
    assert_eq!(variation().evaluate(&nothing, Evaluate::default(), &Device::cpu()).unwrap()[0].value, 0.0);
}

#[test]
fn a_bad_curve_has_a_sentence_and_spoils_no_other() {
    let good = [[0.0, 0.0], [1.0, 0.5], [2.0, 0.0], [3.0, 1.0]];
    let twice = [[0.0, 0.0], [1.0, 0.5], [1.0, 0.5], [3.0, 1.0]];
    let ring = [[0.0, 0.0], [1.0, 0.5]];
    let unknown = [[0.0, 0.0], [f64::NAN, 0.5], [1.0, 1.0]];
    let curves = [&good[..], &twice[..], &good[..], &ring[..], &unknown[..]];
    let batch = CurveBatch::from_slices(&curves).unwrap().closed_each(vec![false, false, false, true, false]).unwrap();
    let energy = bending(1.5) + variation();
    let found =
        energy.evaluate(&batch, Evaluate { want: Want::Hessian, ..Evaluate::default() }, &Device::cpu()).unwrap();
    let alone = energy
        .evaluate(&batch.select(&[0]), Evaluate { want: Want::Hessian, ..Evaluate::default() }, &Device::cpu())
        .unwrap();
    assert_eq!((&found[0], &found[2]), (&alone[0], &alone[0]));
    assert!(alone[0].problem.is_none() && alone[0].value.is_finite());
    let wanted = [
        (
            1,
            CurveStatus::Degenerate,
            "curve 1, point 1: the edge to the next vertex has length 0e0, and so no tangent: remove one of two equal \
             neighbours, or scale the curve to a size near 1",
        ),
        (
            3,
            CurveStatus::Degenerate,
            "curve 3, point 0: a closed curve of 2 vertices has no energy: give 3 at least, or mark it as open",
        ),
        (
            4,
            CurveStatus::Invalid,
            "curve 4, point 1: x is NaN; every coordinate must be a finite number: mend or remove the point",
        ),
    ];
    for (i, status, message) in wanted {
        let problem = found[i].problem.as_ref().unwrap();
        assert_eq!((problem.status, problem.message.as_str()), (status, message));
        assert!(found[i].value.is_nan() && found[i].gradient.iter().chain(&found[i].hessian).all(|x| x.is_nan()));
        assert_eq!(
            (found[i].gradient.len(), found[i].hessian.len()),
            (curves[i].len() * 2, curves[i].len().pow(2) * 4)
        );
    }
}

#[test]
fn targets_that_do_not_go_with_a_curve_are_its_problem() {
    let vertices = batch(2, &[0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 1.0], false);
    let targets = batch(2, &[0.0, 0.0, 1.0, 0.0, 2.0, 1.0], false);
    let found = attachment()
        .evaluate(&vertices, Evaluate { targets: Some(&targets), ..Evaluate::default() }, &Device::cpu())
        .unwrap();
    assert_eq!(
        found[0].problem.as_ref().unwrap().message,
        "curve 0, point 0: an open curve of 3 edges cannot be attached to the data points of an open one of 2 spans: \
         give both open or both closed, with a whole number of edges a span"
    );
}

#[test]
fn arguments_that_make_no_sense_are_named() {
    let curve = batch(2, &[0.0, 0.0, 1.0, 0.0, 2.0, 1.0], false);
    let solid = batch(3, &[0.0; 3], false);
    let edges = MOST_EDGES + 1;
    let too_many = format!("a term of the energy too_many is of {edges} edges; 1 to {MOST_EDGES} are possible");
    let plain = Evaluate::default();
    let cases = [
        (bending(0.5), plain, "the exponent of bending is 0.5: give a finite number of at least 1"),
        (-1.0 * length(), plain, "the weight of length is -1: give a finite number of at least 0"),
        (f64::INFINITY * torsion(), plain, "the weight of torsion is inf: give a finite number of at least 0"),
        (Energy::custom("too_many", edges, 0.0, |_, s| s[0]), plain, &too_many),
        (attachment(), plain, "attachment without data points: give them as targets"),
        (
            attachment(),
            Evaluate { targets: Some(&solid), ..plain },
            "targets of 1 3-D curves for 1 2-D curves: give a target curve for every curve",
        ),
        (
            torsion(),
            Evaluate { torsion_curvature: Some(0.0), ..plain },
            "the torsion curvature is 0: give a positive, finite number in 1/length",
        ),
    ];
    for (energy, options, sentence) in cases {
        assert_eq!(energy.evaluate(&curve, options, &Device::cpu()).unwrap_err().to_string(), sentence);
    }
}
