//! Fair curves are the curves that their energies say they are.

use std::f64::consts::{PI, TAU};

use faircurve::discrete::{
    Energy, Evaluate, Fair, Pins, Segments, Solver, TORSION_CURVATURE, attachment, bending, length, tension, torsion,
    variation,
};
use faircurve::{CurveBatch, CurveStatus, Device, Sampling};

use crate::common::*;
use crate::elastica::elastica;

fn of(energy: Energy) -> Fair {
    Fair { energy, ..Fair::default() }
}

fn default_energy() -> Energy {
    bending(2.0) + 0.1 * length()
}

const S: [Planar; 5] = [[0.0, 0.0], [1.0, 0.8], [2.0, 0.1], [3.2, -0.5], [4.0, 0.3]];

/// `n` points of a circle about (3, −2).
fn circle(n: usize, radius: f64) -> Vec<Planar> {
    let at = |k: usize| TAU * k as f64 / n as f64;
    (0..n).map(|k| [3.0 + radius * at(k).cos(), radius * at(k).sin() - 2.0]).collect()
}

fn helix(t: f64) -> Spatial {
    [t.cos(), t.sin(), 0.3 * t]
}

fn trefoil(t: f64) -> Spatial {
    [t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin()]
}

#[test]
fn a_helix_through_points_of_a_helix() {
    let points: Vec<Spatial> = (0..13).map(|k| helix(TAU * k as f64 / 6.0)).collect();
    let fine: Vec<Spatial> = (0..=12 * 64).map(|k| helix(TAU * k as f64 / (6.0 * 64.0))).collect();
    for energy in [bending(2.0) + 0.5 * length(), variation() + 0.5 * length(), variation() + torsion() + length()] {
        let fair = of(energy);
        let (curve, report) = fitted::<3>(&fair, &one(&points, false), 16);
        let smooth = energy_of(&fair.energy, &fine, false);
        println!("{}: {} of the helix's {smooth}, {} iterations", fair.energy, report.energy, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{}: {report:?}", fair.energy);
        // The best curve is below the helix, but not by much: its ends are free to straighten.
        assert!(report.energy < smooth && report.energy > 0.8 * smooth, "{} {smooth}", report.energy);
        let ratio = length_of(&curve, false) / length_of(&fine, false);
        assert!((0.98..1.02).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_trefoil_through_points_of_a_trefoil() {
    let points: Vec<Spatial> = (0..18).map(|k| trefoil(TAU * k as f64 / 18.0)).collect();
    let fine: Vec<Spatial> = (0..18 * 64).map(|k| trefoil(TAU * k as f64 / (18.0 * 64.0))).collect();
    for energy in [bending(2.0) + 0.5 * length(), variation() + 0.5 * length(), variation() + torsion() + length()] {
        let fair = of(energy);
        let (curve, report) = fitted::<3>(&fair, &one(&points, true), 16);
        let smooth = energy_of(&fair.energy, &fine, true);
        println!("{}: {} of the trefoil's {smooth}, {} iterations", fair.energy, report.energy, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{}: {report:?}", fair.energy);
        // A polygon's energy is that of its curve to h², here a few per mille.
        assert!(report.energy < 1.01 * smooth && report.energy > 0.9 * smooth, "{} {smooth}", report.energy);
        let ratio = length_of(&curve, true) / length_of(&fine, true);
        assert!((0.99..1.01).contains(&ratio), "{ratio}");
    }
}

#[test]
fn variation_finds_circles_again() {
    for (points, radius) in [(6, 2.5), (3, 1.0), (17, 0.3)] {
        let (vertices, report) = fitted::<2>(&of(variation()), &one(&circle(points, radius), true), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{points}: {report:?}");
        let away = |v: &Planar| (norm(minus(*v, [3.0, -2.0])) - radius).abs();
        let worst = vertices.iter().map(away).fold(0.0, f64::max);
        // All vertices lie on the circle itself: its polygon of equal edges has no variation.
        assert!(worst <= 1e-6 * radius, "{points} points: {worst:e}");
        assert!(report.energy <= 1e-12 / radius.powi(3), "{}", report.energy);
    }
}

#[test]
fn bending_through_points_of_a_circle_costs_no_more_than_the_circle() {
    let fair = of(bending(2.0));
    let (_, report) = fitted::<2>(&fair, &one(&circle(6, 2.5), true), 64);
    println!("{} of {}", report.energy, TAU / 2.5);
    let fair = Fair { segments: Segments::PerSpan(64), ..fair };
    let (_, fine) = fitted::<2>(&fair, &one(&circle(6, 2.5), true), 64);
    assert_eq!((report.status, fine.status), (CurveStatus::Converged, CurveStatus::Converged), "{report:?} {fine:?}");
    assert!((fine.energy - TAU / 2.5).abs() <= 1e-3 * TAU / 2.5, "{}", fine.energy);
}

#[test]
fn energies_are_in_units_of_the_input() {
    let (_, report) = fitted::<2>(&of(bending(2.0) + 0.1 * length()), &one(&S, false), 16);
    for c in [1e-9, 1e-3, 42.0, 1e9] {
        let scaled = S.map(|p| p.map(|x| c * x));
        // Bending is of degree −1, so that lengths count 1/c² as much.
        let fair = of(bending(2.0) + 0.1 / (c * c) * length());
        let (_, scaled) = fitted::<2>(&fair, &one(&scaled, false), 16);
        assert_eq!(scaled.status, CurveStatus::Converged, "{c:e}: {scaled:?}");
        assert!((scaled.energy * c / report.energy - 1.0).abs() <= 1e-9, "{c:e}: {scaled:?} {report:?}");
    }
}

#[test]
fn moved_turned_and_reversed_points_have_the_curve_moved_turned_and_reversed() {
    let fair = of(default_energy());
    let (sin, cos) = 0.7_f64.sin_cos();
    let (wanted, _) = fitted::<2>(&fair, &one(&S, false), 16);
    let size = 4.0;
    let same = |name: &str, found: Vec<Planar>, wanted: Vec<Planar>| {
        let away = apart(&found, &wanted);
        println!("{name}: {away:e}");
        assert!(away <= 1e-6 * size, "{name}: {away:e}");
    };
    let moved = S.map(|[x, y]| [x + 1e6, y - 1e6]);
    let (found, _) = fitted::<2>(&fair, &one(&moved, false), 16);
    same("moved", found, wanted.iter().map(|[x, y]| [x + 1e6, y - 1e6]).collect());
    let turn = |[x, y]: Planar| [cos * x - sin * y, sin * x + cos * y];
    let (found, _) = fitted::<2>(&fair, &one(&S.map(turn), false), 16);
    same("turned", found, wanted.iter().copied().map(turn).collect());
    let mut reversed = S;
    reversed.reverse();
    let (mut found, _) = fitted::<2>(&fair, &one(&reversed, false), 16);
    found.reverse();
    same("reversed", found, wanted);
    let oval: Vec<Planar> = S.iter().copied().chain([[3.0, 2.5], [0.5, 2.0]]).collect();
    let (wanted, report) = fitted::<2>(&fair, &one(&oval, true), 16);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let mut shifted = oval.clone();
    shifted.rotate_left(3);
    let (mut found, _) = fitted::<2>(&fair, &one(&shifted, true), 16);
    found.rotate_right(3 * 16);
    same("shifted", found, wanted);
}

#[test]
fn the_energy_reported_is_that_of_the_vertices() {
    let space: Vec<Spatial> = (0..7).map(|k| helix(k as f64)).collect();
    let check = |energy: Energy, batch: &CurveBatch| {
        let fair = Fair { energy, pins: Pins::All, ..Fair::default() };
        let fit = fair.fit(batch, &Device::cpu()).unwrap();
        let vertices = fit.polylines(Sampling::PerSpan(16));
        let diagonal: f64 = (0..batch.dimension())
            .map(|c| {
                let all = || batch.points(0).iter().skip(c).step_by(batch.dimension()).copied();
                all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
            })
            .map(|x| x * x)
            .sum::<f64>()
            .sqrt();
        let options = Evaluate { torsion_curvature: Some(TORSION_CURVATURE / diagonal), ..Evaluate::default() };
        let found = fair.energy.evaluate(&vertices, options, &Device::cpu()).unwrap()[0].value;
        let reported = fit.reports()[0].energy;
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{}: {:?}", fair.energy, fit.reports()[0]);
        assert!((found / reported - 1.0).abs() <= 1e-10, "{}: {found} {reported}", fair.energy);
    };
    for energy in [default_energy(), bending(3.0) + length(), length() + 2.0 * tension(), variation() + tension()] {
        check(energy.clone(), &one(&S, false));
        check(energy.clone(), &one(&circle(5, 3.0), true));
        check(energy, &one(&space, false));
    }
    check(variation() + 0.5 * torsion() + length(), &one(&space, false));
}

#[test]
fn energies_approach_that_of_the_smooth_curve_by_h_squared() {
    for energy in [bending(2.0) + 0.5 * length(), variation() + 0.5 * length()] {
        let at = |n: usize| {
            let fair = Fair { segments: Segments::PerSpan(n), ..of(energy.clone()) };
            let (_, report) = fitted::<2>(&fair, &one(&S, false), n);
            assert_eq!(report.status, CurveStatus::Converged, "{energy}, {n}: {report:?}");
            report.energy
        };
        // Order 3 has condition h⁻⁶: finer curves reach the tolerance no more.
        let energies = if energy.order() == 3 { [4, 8, 16, 32] } else { [8, 16, 32, 64] }.map(at);
        let steps: Vec<f64> = energies.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let ratios: Vec<f64> = steps.windows(2).map(|pair| pair[0] / pair[1]).collect();
        println!("{energy}: {energies:?}, {ratios:?}");
        // Ends and data points leave errors of higher order on the way.
        assert!(ratios.iter().all(|ratio| (3.0..5.5).contains(ratio)), "{energy}: {ratios:?}");
    }
}

#[test]
fn both_solvers_lead_to_the_same_curve() {
    let by = |solver: Solver| {
        let fair = Fair { solver, max_iterations: 5000, ..of(bending(2.0) + length()) };
        let (vertices, report) = fitted::<2>(&fair, &one(&S, false), 16);
        println!("{solver:?}: {} iterations", report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{solver:?}: {report:?}");
        vertices
    };
    let away = apart(&by(Solver::Sobolev), &by(Solver::Newton));
    assert!(away <= 1e-6 * 4.0, "{away:e}");
}

#[test]
fn an_energy_of_ones_own_gives_the_curve_of_the_same_energy_built_in() {
    for closed in [false, true] {
        let points = if closed { circle(5, 2.0) } else { S.to_vec() };
        let (built_in, report) = fitted::<2>(&of(bending(2.0) + 0.1 * length()), &one(&points, closed), 16);
        let own = of(elastica() + 0.1 * length());
        let (vertices, own) = fitted::<2>(&own, &one(&points, closed), 16);
        assert_eq!((report.status, own.status), (CurveStatus::Converged, CurveStatus::Converged));
        assert!((own.energy / report.energy - 1.0).abs() <= 1e-12, "{} {}", own.energy, report.energy);
        assert!(apart(&vertices, &built_in) <= 1e-6 * 4.0);
    }
}

#[test]
fn hundreds_of_gentle_curves_converge_in_about_ten_iterations() {
    let fit = fit(&of(default_energy()), &gentle(500, 5, 0.05, 11));
    let mut iterations: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    println!("median {}, most {}", iterations[250], iterations[499]);
    assert_eq!(fit.usable(), 500);
    assert!(iterations[250] <= 15 && iterations[499] <= 40, "{} {}", iterations[250], iterations[499]);
}

#[test]
fn spans_of_very_different_lengths_cost_no_more_iterations() {
    // Each span has its own scale; a regularisation of one strength for all would be soft in short ones.
    let points = [[0.0, 0.0], [0.05, 0.01], [0.1, 0.0], [1.0, 0.2], [1.02, 0.21], [3.0, 0.0], [3.1, -0.03], [4.0, 0.1]];
    let (_, report) = fitted::<2>(&of(bending(2.0) + length()), &one(&points, false), 16);
    println!("{} iterations", report.iterations);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!(report.iterations <= 40, "{report:?}");
}

#[test]
fn attached_curves_come_nearer_to_their_points_as_the_weight_grows() {
    for (closed, pins) in [(false, Pins::Ends), (false, Pins::None), (true, Pins::None), (true, Pins::Ends)] {
        let points =
            if closed { vec![[0.0, 0.0], [2.0, -0.2], [2.5, 1.5], [1.0, 1.2], [-0.3, 2.0]] } else { S.to_vec() };
        let (through, _) = fitted::<2>(&of(bending(2.0) + length()), &one(&points, closed), 16);
        let mut before = f64::INFINITY;
        for weight in [10.0, 100.0, 1e3, 1e4] {
            let energy = bending(2.0) + length() + weight * attachment();
            let fair = Fair { pins, max_iterations: 5000, ..of(energy) };
            let (vertices, report) = fitted::<2>(&fair, &one(&points, closed), 16);
            let case = format!("closed {closed}, {pins:?}, weight {weight}");
            println!("{case}: {} iterations, deviation {}", report.iterations, report.max_deviation);
            assert_eq!(report.status, CurveStatus::Converged, "{case}: {report:?}");
            assert!(report.max_deviation < before, "{case}: {report:?}");
            before = report.max_deviation;
            if pins == Pins::Ends && !closed {
                assert_eq!((vertices[0], vertices[64]), (S[0], S[4]), "{case}");
            }
            if weight == 1e4 {
                assert!(apart(&vertices, &through) <= 1e-2, "{case}: {}", apart(&vertices, &through));
            }
        }
        assert!(before <= 1e-3);
    }
}

#[test]
fn weights_of_points_draw_the_curve_to_them() {
    let fair = Fair { pins: Pins::Ends, ..of(bending(2.0) + length() + attachment()) };
    let (equal, _) = fitted::<2>(&fair, &one(&S, false), 16);
    let heavy = one(&S, false).with_weights(vec![1.0, 100.0, 1.0, 1.0, 1.0]).unwrap();
    let (drawn, report) = fitted::<2>(&fair, &heavy, 16);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let away = |vertices: &[Planar]| norm(minus(vertices[16], S[1]));
    assert!(away(&drawn) < 0.1 * away(&equal), "{} {}", away(&drawn), away(&equal));
}

#[test]
fn half_a_circle_is_bent_as_the_elastica_between_tangents_is() {
    // Variation with the tangents and the points of a half circle has the half circle as its only
    // minimiser of energy 0.
    let points: Vec<Planar> =
        (0..4).map(|k| [(PI * f64::from(k) / 3.0).cos(), (PI * f64::from(k) / 3.0).sin()]).collect();
    let (vertices, report) = fitted::<2>(&of(variation()), &one(&points, false), 16);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    assert!(vertices.iter().all(|&v| (norm(v) - 1.0).abs() <= 1e-6));
}

#[test]
fn the_speed_is_that_of_the_points_by_the_fraction_of_a_span_whatever_the_parameter() {
    let batch = CurveBatch::from_slices(&[&S[..]]).unwrap();
    let timed = batch.clone().with_parameters(vec![0.0, 2.0, 2.5, 7.0, 8.0]).unwrap();
    for batch in [batch, timed] {
        let fit = of(default_energy()).fit(&batch, &Device::cpu()).unwrap();
        let curve = fit.curve(0);
        for span in 0..4 {
            let (u, step) = (0.37, 1e-6);
            let [before, after] = [u - step, u + step].map(|u| curve.jet(span, u).point);
            let wanted = (after - before).length() / (2.0 * step);
            let found = curve.speed(span, u);
            assert!((found - wanted).abs() < 1e-6 * wanted, "span {span}: {found}, {wanted}");
        }
    }
}
