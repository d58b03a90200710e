//! Curves in surfaces: exact elastica and geodesics, and what no rotation may change.

use std::sync::Arc;

use faircurve::discrete::{Energy, Fair, Limits, Pins, Segments, bending, geodesic_bending, length};
use faircurve::surface::{Globe, Quadric, Surface, Torus};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device};
use glam::{DMat3, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

use crate::common::*;

fn within(surface: impl Surface + 'static, energy: Energy, segments: usize) -> Fair {
    Fair { energy, surface: Some(Arc::new(surface)), segments: Segments::PerSpan(segments), ..Fair::default() }
}

/// Points of the unit sphere.
fn on_sphere(angles: &[[f64; 2]]) -> Vec<Spatial> {
    let globe = Globe::sphere(1.0).unwrap();
    angles.iter().map(|&[lat, lon]| globe.place(lon, lat).to_array()).collect()
}

/// Points of steps of about this many degrees on the unit sphere, that turn by σ radians at each.
fn rough(count: usize, step: f64, sigma: f64, rng: &mut StdRng) -> Vec<Spatial> {
    let mut at = DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
    at = at.normalize();
    let mut ahead = at.any_orthonormal_vector();
    let normal = |rng: &mut StdRng| (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0;
    let mut points = vec![at.to_array()];
    for _ in 1..count {
        let turn = sigma * normal(rng);
        ahead = turn.cos() * ahead + turn.sin() * at.cross(ahead);
        let (sin, cos) = step.to_radians().sin_cos();
        (at, ahead) = (cos * at + sin * ahead, cos * ahead - sin * at);
        points.push(at.to_array());
    }
    points
}

#[test]
fn elastic_curves_through_points_of_a_sphere_are_the_exact_ones_to_h_squared() {
    let oracle: Value = serde_json::from_str(include_str!("../data/sphere_elastica.json")).unwrap();
    let cases = oracle["cases"].as_array().unwrap();
    assert!(cases.len() >= 3);
    for case in cases {
        let angles: Vec<[f64; 2]> = serde_json::from_value(case["lat_lon_degrees"].clone()).unwrap();
        let (weight, exact) = (case["length_weight"].as_f64().unwrap(), case["energy"].as_f64().unwrap());
        let points = on_sphere(&angles);
        let mut energies = Vec::new();
        for segments in [8, 16, 32, 64] {
            let energy = geodesic_bending(2.0) + weight * length();
            let fair = within(Quadric::sphere(1.0), energy, segments);
            let (vertices, report) = fitted::<3>(&fair, &one(&points, false), segments);
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            assert!(vertices.iter().all(|v| (norm(*v) - 1.0).abs() < 1e-15));
            println!(
                "{} {segments}: {} iterations, error {:.3e}",
                case["name"],
                report.iterations,
                report.energy - exact
            );
            energies.push(report.energy);
        }
        for pair in energies.windows(2) {
            let [coarse, fine] = [pair[0], pair[1]].map(|energy| energy - exact);
            assert!((coarse / fine - 4.0).abs() < 0.2, "{coarse} {fine}");
        }
        // (64 E₆₄ − 20 E₃₂ + E₁₆)/45 removes h² and h⁴.
        let [e16, e32, e64] = [energies[1], energies[2], energies[3]];
        let richardson = (64.0 * e64 - 20.0 * e32 + e16) / 45.0;
        assert!((richardson - exact).abs() < 1e-6 * exact, "{richardson} {exact}");
    }
}

/// A rotation about a random axis, and the same in f64 of every point.
fn rotation(rng: &mut StdRng) -> DMat3 {
    let axis = DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
    DMat3::from_axis_angle(axis.normalize(), rng.random_range(0.0..6.0))
}

#[test]
fn rotated_points_of_a_sphere_give_the_rotated_curve() {
    let seed = 22;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let fair = within(Quadric::sphere(1.0), geodesic_bending(2.0) + 0.1 * length(), 16);
    for (step, sigma) in [(5.0, 0.2), (5.0, 0.6), (30.0, 0.2), (60.0, 0.6)] {
        for _ in 0..20 {
            let points = rough(5, step, sigma, &mut rng);
            let turn = rotation(&mut rng);
            let turned = |points: &[Spatial]| -> Vec<Spatial> {
                points.iter().map(|p| (turn * DVec3::from_array(*p)).to_array()).collect()
            };
            let (own, report) = fitted::<3>(&fair, &one(&points, false), 16);
            let (other, _) = fitted::<3>(&fair, &one(&turned(&points), false), 16);
            if report.status == CurveStatus::Converged {
                let away = apart(&turned(&own), &other);
                assert!(away < 1e-9, "steps of {step}°, σ {sigma}: {away:e}");
            }
        }
    }
}

/// Iterations of curves through rough points, sorted, of those that converge.
fn iterations(energy: &Energy, step: f64, sigma: f64, count: usize) -> Vec<u32> {
    let mut rng = StdRng::seed_from_u64(7);
    let curves: Vec<Vec<Spatial>> = (0..count).map(|_| rough(5, step, sigma, &mut rng)).collect();
    let slices: Vec<&[Spatial]> = curves.iter().map(|points| &points[..]).collect();
    let batch = CurveBatch::from_slices(&slices).unwrap();
    let fit = within(Quadric::sphere(1.0), energy.clone(), 16).fit(&batch, &Device::cpu()).unwrap();
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged);
    let mut found: Vec<u32> = converged.map(|report| report.iterations).collect();
    found.sort();
    found
}

#[test]
fn gentle_curves_take_three_iterations_and_rough_ones_ten() {
    for (step, sigma, weight) in [
        (5.0, 0.2, 0.1),
        (30.0, 0.2, 0.1),
        (60.0, 0.2, 0.1),
        (5.0, 0.6, 0.1),
        (5.0, 0.6, 1.0),
        (60.0, 0.6, 0.1),
        (60.0, 0.6, 1.0),
    ] {
        // Weights of length are per squared step.
        let found = iterations(
            &(geodesic_bending(2.0) + weight / f64::powi(f64::to_radians(step), 2) * length()),
            step,
            sigma,
            200,
        );
        let median = found[found.len() / 2];
        println!(
            "steps of {step}°, σ {sigma}, length {weight}: {} of 200, {median} iterations, at most {}",
            found.len(),
            found[found.len() - 1]
        );
        assert_eq!(found.len(), 200, "all converge");
        assert!(median <= if sigma < 0.3 { 3 } else { 10 }, "{median}");
    }
}

/// The reduced latitude of a great circle of this greatest one, at an arc from the equator.
fn wave_of_latitude(most: f64, arc: f64) -> f64 {
    (most.sin() * arc.sin()).asin()
}

/// The longitude of a geodesic of a spheroid of this b/a, at the arc of its great circle:
/// ∫ √(1 − e² cos²β) cos β₀/cos²β dσ.
fn longitude(most: f64, flattening: f64, arc: f64) -> f64 {
    let squared = 1.0 - flattening * flattening;
    let rate = |arc: f64| {
        let cosine = 1.0 - (most.sin() * arc.sin()).powi(2);
        (1.0 - squared * cosine).sqrt() * most.cos() / cosine
    };
    let steps = 400;
    let step = arc / steps as f64;
    (0..steps).map(|k| step * rate((k as f64 + 0.5) * step)).sum()
}

#[test]
fn closed_geodesics_of_every_kind_have_their_exact_lengths() {
    let oracle: Value = serde_json::from_str(include_str!("../data/closed_geodesics.json")).unwrap();
    let number = |x: &Value| x.as_str().map_or_else(|| x.as_f64().unwrap(), |text| text.parse().unwrap());
    for case in oracle["cases"].as_array().unwrap() {
        let (kind, exact) = (case["geodesic"].as_str().unwrap(), case.get("length").map_or(f64::NAN, number));
        let axes = || case["semi_axes"].as_array().unwrap().iter().map(number).collect::<Vec<f64>>();
        let counts: Vec<f64> = kind.split(|c: char| !c.is_ascii_digit()).filter_map(|part| part.parse().ok()).collect();
        // The start of parameter s, from 0 to 2π, wobbling by a part of its size.
        type Start = Box<dyn Fn(f64) -> DVec3>;
        let (surface, start): (Arc<dyn Surface>, Start) = match case["surface"].as_str().unwrap() {
            "ellipsoid" => {
                let own = DVec3::from_slice(&axes());
                let flat = if kind.contains("z=0") {
                    2
                } else if kind.contains("y=0") {
                    1
                } else {
                    0
                };
                let round = move |s: f64| {
                    let mut x = [0.0; 3];
                    x[(flat + 1) % 3] = s.cos();
                    x[(flat + 2) % 3] = s.sin();
                    x[flat] = 0.08 * (3.0 * s).sin() + 0.02;
                    DVec3::from_array(x) * own
                };
                (Arc::new(Quadric::ellipsoid(own)), Box::new(round))
            }
            "torus" => {
                let (big, small) = (number(&case["R"]), number(&case["r"]));
                let (tube, axis, at) = match kind {
                    "inner equator" => (0.0, 1.0, std::f64::consts::PI),
                    "outer equator" => (0.0, 1.0, 0.0),
                    _ => (counts[0], counts[1], 0.0),
                };
                // What goes round the axis twice stays long near the inner equator.
                let linger = if axis > tube && tube > 0.0 { 0.9 } else { 0.05 };
                let round = move |s: f64| {
                    let (u, v) = (tube * s + at + linger * s.sin(), axis * s + 0.05 * (3.0 * s).cos());
                    let out = big + small * u.cos();
                    DVec3::new(out * v.cos(), out * v.sin(), small * u.sin())
                };
                (Arc::new(Torus::new(big, small).unwrap()), Box::new(round))
            }
            "spheroid" => {
                let [a, b] = ["equatorial", "polar"].map(|word| number(&case[word]));
                let most = number(&case["greatest_reduced_latitude"]);
                let (waves, turns) = (counts[0], counts[1]);
                let round = move |s: f64| {
                    let (lat, lon) = (0.97 * wave_of_latitude(most, waves * s), longitude(most, b / a, waves * s));
                    let lon =
                        lon * turns / waves / longitude(most, b / a, std::f64::consts::TAU) * std::f64::consts::TAU;
                    let lon = lon + 0.03 * (2.0 * s).sin();
                    DVec3::new(a * lat.cos() * lon.cos(), a * lat.cos() * lon.sin(), b * lat.sin())
                };
                (Arc::new(Quadric::spheroid(a, b)), Box::new(round))
            }
            _ => continue,
        };
        let mut lengths = Vec::new();
        for count in [128, 256, 512] {
            let points: Vec<Spatial> = (0..count)
                .map(|k| surface.closest(start(std::f64::consts::TAU * k as f64 / count as f64)).unwrap().to_array())
                .collect();
            let energy = geodesic_bending(2.0);
            let fair = Fair {
                energy,
                surface: Some(surface.clone()),
                segments: Segments::PerSpan(1),
                pins: Pins::None,
                ..Fair::default()
            };
            let (vertices, report) = fitted::<3>(&fair, &one(&points, true), 1);
            let length = length_of(&vertices, true);
            println!(
                "{} {kind}, {count} vertices: {:?}, {} iterations, E {:.2e}, (L_n − L)/L n² = {:.3}",
                surface.name(),
                report.status,
                report.iterations,
                report.energy,
                (length / exact - 1.0) * (count as f64).powi(2)
            );
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            lengths.push(length);
        }
        let richardson = (64.0 * lengths[2] - 20.0 * lengths[1] + lengths[0]) / 45.0;
        assert!((richardson / exact - 1.0).abs() < 1e-7, "{kind}: {richardson} {exact}");
    }
}

#[test]
fn geodesics_between_points_of_wgs84_have_their_exact_lengths() {
    let oracle: Value = serde_json::from_str(include_str!("../data/closed_geodesics.json")).unwrap();
    let cases = oracle["cases"].as_array().unwrap().iter().filter(|case| case["surface"] == "WGS84");
    let number = |x: &Value| x.as_str().unwrap().parse::<f64>().unwrap();
    let mut seen = 0;
    for case in cases {
        let place = |end: &str| {
            Globe::WGS84.place(number(&case[format!("{end}_lon")]), number(&case[format!("{end}_lat")])).to_array()
        };
        let exact = number(&case["length_m"]);
        let lengths = [32, 64].map(|segments| {
            let fair = within(Globe::WGS84.surface(), geodesic_bending(2.0), segments);
            let (vertices, report) = fitted::<3>(&fair, &one(&[place("from"), place("to")], false), segments);
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            println!("{segments} segments: {} iterations, E {:e}", report.iterations, report.energy);
            length_of(&vertices, false)
        });
        let richardson = (4.0 * lengths[1] - lengths[0]) / 3.0;
        println!("off by {:.2e} and {:.2e}", lengths[1] / exact - 1.0, richardson / exact - 1.0);
        assert!((richardson / exact - 1.0).abs() < 1e-7);
        seen += 1;
    }
    assert!(seen >= 2);
}

#[test]
fn points_far_apart_are_joined_by_great_circles() {
    for degrees in [100.0, 170.0, 179.0, 179.9] {
        let points = on_sphere(&[[20.0, 0.0], [-20.0, 0.0]]);
        let turn = DMat3::from_axis_angle(DVec3::from_array(points[1]), f64::to_radians(degrees));
        let from = DVec3::from_array(points[1]).any_orthonormal_vector();
        let ends = [from.to_array(), (turn * from).to_array()];
        let fit = fit(&within(Quadric::sphere(1.0), geodesic_bending(2.0), 64), &one(&ends, false));
        let report = &fit.reports()[0];
        assert_eq!(report.status, CurveStatus::Converged, "{degrees}: {report:?}");
        let length = fit.curve(0).length();
        assert!((length / f64::to_radians(degrees) - 1.0).abs() < 1e-7, "{degrees}: {length}");
    }
    // Rough, and from point to point a third of the way around.
    let found = iterations(&(geodesic_bending(2.0) + length()), 120.0, 0.4, 100);
    println!("steps of 120°: {} of 100 converge, {} iterations at the median", found.len(), found[found.len() / 2]);
    assert!(found.len() >= 98);
}

#[test]
fn tangents_in_surfaces_are_met_at_ends_and_within() {
    let surfaces: [(Arc<dyn Surface>, f64); 3] = [
        (Arc::new(Quadric::sphere(1.0)), 1.0),
        (Arc::new(Quadric::cone(0.6)), 1.2),
        (Arc::new(Torus::new(2.0, 1.0).unwrap()), 1.1),
    ];
    for (surface, height) in surfaces {
        for closed in [false, true] {
            // Around the axis, up and down.
            let place = |k: usize| {
                let (sin, cos) = (1.2566 * k as f64).sin_cos();
                DVec3::new(0.8 * cos, 0.8 * sin, height + 0.1 * (k % 2) as f64)
            };
            let points: Vec<Spatial> = (0..5).map(|k| surface.closest(place(k)).unwrap().to_array()).collect();
            let normal = |k: usize| surface.gradient(DVec3::from_array(points[k])).normalize();
            // Directions 20 degrees from the way to the next point, and none at two points.
            let tangents = (0..5).flat_map(|k| {
                let next = if k == 4 && !closed { place(5).to_array() } else { points[(k + 1) % 5] };
                let turned = DMat3::from_axis_angle(normal(k), 0.35) * DVec3::from_array(minus(next, points[k]));
                if k == 1 || k == 3 { [f64::NAN; 3] } else { turned.to_array() }
            });
            let tangents: Vec<f64> = tangents.collect();
            let constraints = Constraints { tangents: Some(tangents.clone()), ..Constraints::default() };
            let batch = one(&points, closed).with_constraints(constraints).unwrap();
            let fair =
                Fair { energy: geodesic_bending(2.0) + length(), surface: Some(surface.clone()), ..Fair::default() };
            let fit = fit(&fair, &batch);
            let (vertices, report) = (vertices::<3>(&fit, 0, 16), &fit.reports()[0]);
            assert_eq!(report.status, CurveStatus::Converged, "{} {closed}: {report:?}", surface.name());
            let free = fair.fit(&one(&points, closed), &Device::cpu()).unwrap().reports()[0].clone();
            println!(
                "{}, closed {closed}: {} iterations, {} without tangents",
                surface.name(),
                report.iterations,
                free.iterations
            );
            assert!(report.iterations <= 15, "few more than without tangents");
            let curve = fit.curve(0);
            for k in [0, 2, 4] {
                let asked = DVec3::from_slice(&tangents[3 * k..3 * k + 3]);
                let asked = (asked - asked.dot(normal(k)) * normal(k)).normalize();
                let before = if k > 0 { Some(k - 1) } else { closed.then_some(4) };
                let sides = before.map(|span| (span, 1.0)).into_iter().chain((k < curve.spans()).then_some((k, 0.0)));
                for (span, u) in sides {
                    let away = (curve.jet(span, u).first.normalize() - asked).length();
                    assert!(away < 1e-13, "{} at {k}: {away:e}", surface.name());
                }
            }
            assert!(vertices.iter().all(|v| surface.value(DVec3::from_array(*v)).abs() < 1e-14));
            assert!(report.energy > free.energy, "what is asked for costs energy");
        }
    }
}

#[test]
fn in_a_plane_a_largest_geodesic_curvature_is_that_of_planar_curves() {
    let points = [[0.0, 0.0], [1.0, 0.9], [2.0, -0.4], [3.0, 0.7], [4.0, 0.1]];
    let limits = Limits { curvature: Some(2.0), ..Limits::default() };
    let planar = Fair { energy: bending(2.0) + 0.1 * length(), limits: limits.clone(), ..Fair::default() };
    let (flat, wanted) = fitted::<2>(&planar, &one(&points, false), 16);
    let plane = Quadric::plane(DVec3::new(2.0, -1.0, 2.0), 1.0);
    let (p, q) = (DVec3::new(1.0, 2.0, 0.0).normalize(), DVec3::new(-4.0, 2.0, 5.0).normalize());
    let lifted = points.map(|[x, y]| (DVec3::new(2.0, -1.0, 2.0) / 9.0 * 3.0 + x * p + y * q).to_array());
    let fair = Fair { energy: geodesic_bending(2.0) + 0.1 * length(), surface: Some(Arc::new(plane)), ..planar };
    let (found, report) = fitted::<3>(&fair, &one(&lifted, false), 16);
    assert_eq!([report.status, wanted.status], [CurveStatus::Converged; 2], "{report:?} {wanted:?}");
    let (own, other) = (report.limits.unwrap(), wanted.limits.unwrap());
    println!("{} iterations in the plane, {} flat", report.iterations, wanted.iterations);
    assert!(own.active > 0 && own.active == other.active, "{own:?} {other:?}");
    assert!((report.energy / wanted.energy - 1.0).abs() < 1e-6, "{} {}", report.energy, wanted.energy);
    let from = DVec3::from_array(lifted[0]);
    for (a, b) in found.iter().zip(&flat) {
        let a = DVec3::from_array(*a) - from;
        assert!((a.dot(p) - b[0]).abs().max((a.dot(q) - b[1]).abs()) < 1e-5);
    }
}

#[test]
fn a_largest_geodesic_curvature_is_kept_on_spheres_and_tori_or_said_to_be_broken() {
    let geodesic = |surface: &dyn Surface, v: &[Spatial]| {
        let turn = |triple: &[Spatial]| {
            let [a, b, c] = [triple[0], triple[1], triple[2]].map(DVec3::from_array);
            let n = surface.gradient(b).normalize();
            let turn = (c - b).normalize() - (b - a).normalize();
            2.0 * (turn - turn.dot(n) * n).length() / ((c - b).length() + (b - a).length())
        };
        v.windows(3).map(turn).fold(0.0, f64::max)
    };
    let sphere: Arc<dyn Surface> = Arc::new(Quadric::sphere(1.0));
    let torus: Arc<dyn Surface> = Arc::new(Torus::new(2.0, 1.0).unwrap());
    for (surface, size) in [(sphere, 1.0), (torus, 3.0)] {
        let place = |[u, v]: [f64; 2]| {
            let x = size * DVec3::new(v.cos() * u.cos(), v.cos() * u.sin(), v.sin());
            surface.closest(x).unwrap().to_array()
        };
        let points = [[0.0, 0.0], [0.25, 0.3], [0.5, -0.1], [0.75, 0.25], [1.0, 0.0]].map(place);
        let free =
            Fair { energy: geodesic_bending(2.0) + 0.1 * length(), surface: Some(surface.clone()), ..Fair::default() };
        let (vertices, _) = fitted::<3>(&free, &one(&points, false), 16);
        let most = geodesic(&*surface, &vertices);
        let bound = 0.9 * most;
        let limits = Limits { curvature: Some(bound), ..Limits::default() };
        let (vertices, report) = fitted::<3>(&Fair { limits, ..free.clone() }, &one(&points, false), 16);
        let kept = report.limits.unwrap();
        println!("{}: {most} → {bound}, {} held, {} iterations", surface.name(), kept.active, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!(geodesic(&*surface, &vertices) <= bound * (1.0 + 1e-9) && kept.active > 0 && kept.cost > 0.0);
        let limits = Limits { curvature: Some(0.05 * most), ..Limits::default() };
        let report = Fair { limits, ..free }.fit(&one(&points, false), &Device::cpu()).unwrap().reports()[0].clone();
        assert_eq!(report.status, CurveStatus::Infeasible, "{report:?}");
        assert!(report.message.as_ref().unwrap().contains("geodesic curvature"), "{report:?}");
    }
}

#[test]
fn a_way_over_the_apex_of_a_cone_gets_a_sentence_and_leaves_its_neighbours_bits() {
    let cone: Arc<dyn Surface> = Arc::new(Quadric::cone(0.5));
    let at = |angle: f64, z: f64| [0.5f64.tan() * z * angle.cos(), 0.5f64.tan() * z * angle.sin(), z];
    let over = [at(0.0, 1.0), at(std::f64::consts::PI, 1.0)];
    let beside = [at(0.0, 1.0), at(1.0, 1.3), at(2.0, 0.9)];
    let fair = Fair { energy: geodesic_bending(2.0) + 0.1 * length(), surface: Some(cone), ..Fair::default() };
    let batch = CurveBatch::from_slices(&[&over[..], &beside[..]]).unwrap();
    let fit = fair.fit(&batch, &Device::cpu()).unwrap();
    let report = &fit.reports()[0];
    assert_eq!(report.status, CurveStatus::Invalid, "{report:?}");
    assert!(report.message.as_ref().unwrap().contains("give points between"), "{report:?}");
    assert_eq!(fit.reports()[1].status, CurveStatus::Converged);
    let alone: Vec<Spatial> = fitted(&fair, &one(&beside, false), 16).0;
    assert_eq!(vertices::<3>(&fit, 1, 16), alone);
}
