//! Curves of longitudes and latitudes, fitted on their globe.

use std::sync::Arc;

use faircurve::discrete::{Fair, Segments, geodesic_bending, length, tautness};
use faircurve::surface::{Globe, Quadric};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Sampling};
use glam::{DMat3, DVec3};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

fn on(globe: Globe) -> Fair {
    Fair { energy: geodesic_bending(2.0) + tautness(), surface: Some(Arc::new(globe)), ..Fair::default() }
}

fn unit_sphere() -> Globe {
    Globe::sphere(1.0).unwrap()
}

/// Excerpts of storms, one a list of longitudes and latitudes.
fn storms() -> Vec<Vec<Planar>> {
    let mut storms: Vec<(String, Vec<Planar>)> = Vec::new();
    for line in include_str!("../data/storms_excerpt.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [lon, lat] = [fields[2], fields[3]].map(|field| field.parse().unwrap());
        match storms.last_mut() {
            Some((name, points)) if name == fields[0] => points.push([lon, lat]),
            _ => storms.push((fields[0].to_string(), vec![[lon, lat]])),
        }
    }
    storms.into_iter().map(|(_, points)| points).collect()
}

#[test]
fn tracks_turned_by_any_rotation_of_the_globe_are_the_turned_tracks() {
    let seed = 2;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let globe = unit_sphere();
    let space = |point: &Planar| globe.place(point[0], point[1]);
    let mut tried = 0;
    for points in storms().into_iter().filter(|points| points.len() > 3) {
        let fit = fit(&on(globe), &one(&points, false));
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        let own: Vec<Planar> = vertices(&fit, 0, 16);
        // Over the pole with its middle, over the antimeridian, and anywhere.
        let middle = space(&points[points.len() / 2]);
        let over_pole = glam::DQuat::from_rotation_arc(middle, DVec3::Z);
        let to_antimeridian = glam::DQuat::from_rotation_z(std::f64::consts::PI - middle.y.atan2(middle.x));
        let axis = DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let anywhere = glam::DQuat::from_axis_angle(axis.normalize(), rng.random_range(0.0..6.0));
        for turn in [over_pole, to_antimeridian, anywhere].map(DMat3::from_quat) {
            let turned: Vec<Planar> = points.iter().map(|point| globe.angles(turn * space(point))).collect();
            let there = fitted::<2>(&on(globe), &one(&turned, false), 16).0;
            let away = own.iter().zip(&there).map(|(a, b)| (turn * space(a)).distance(space(b))).fold(0.0, f64::max);
            assert!(away < 1e-9, "{points:?}: {away:e}");
            tried += 1;
        }
    }
    assert!(tried >= 12, "{tried}");
}

#[test]
fn longitudes_go_on_over_the_antimeridian_and_past_a_pole() {
    let over = [[170.0, 10.0], [178.0, 15.0], [-174.0, 12.0], [-165.0, 16.0]];
    let polar = [[10.0, 80.0], [30.0, 86.0], [150.0, 87.0], [178.0, 80.0]];
    for (points, most) in [(over, 2.0), (polar, 60.0)] {
        let fit = fit(&on(Globe::WGS84), &one(&points, false));
        let vertices: Vec<Planar> = vertices(&fit, 0, 16);
        for pair in vertices.windows(2) {
            assert!((pair[1][0] - pair[0][0]).abs() < most, "{pair:?}");
        }
        for (k, point) in points.iter().enumerate() {
            let turns = (vertices[16 * k][0] - point[0]) / 360.0;
            assert!((turns - turns.round()).abs() < 1e-15 && vertices[16 * k][1] == point[1]);
        }
    }
    // A ring around the pole ends a turn later than it began.
    let ring: Vec<Planar> = (0..6).map(|k| [60.0 * k as f64, 75.0 + 3.0 * (k % 2) as f64]).collect();
    let fit = fit(&on(unit_sphere()), &one(&ring, true));
    let curve = fit.curve(0);
    let [start, end] = [curve.jet(0, 0.0).point, curve.jet(curve.spans() - 1, 1.0).point];
    assert!((end - start - DVec3::new(360.0, 0.0, 0.0)).length() < 1e-9, "{start} {end}");
}

#[test]
fn places_and_derivatives_between_vertices_are_those_of_one_curve_on_the_globe() {
    let points = [[-30.0, 40.0], [-10.0, 55.0], [20.0, 50.0], [40.0, 62.0]];
    let fit = fit(&on(Globe::WGS84), &one(&points, false));
    let curve = fit.curve(0);
    let h = 1e-5;
    for (span, u) in [(0, 0.33), (1, 0.51), (2, 0.87)] {
        let [less, here, more] = [u - h, u, u + h].map(|u| curve.jet(span, u));
        let first = (more.point - less.point) / (2.0 * h);
        // Derivatives are those of the cubic in space, which leaves the globe by h⁴.
        assert!((first - here.first).length() < 1e-4 * first.length(), "{first} {}", here.first);
    }
    // Metres, and not degrees.
    let spheric: f64 = points
        .windows(2)
        .map(|pair| {
            let [a, b] = [0, 1].map(|k| Globe::WGS84.place(pair[k][0], pair[k][1]));
            a.distance(b)
        })
        .sum();
    assert!((1.0..1.1).contains(&(curve.length() / spheric)), "{}", curve.length());
    let spaced = fit.polylines(Sampling::Spacing(100_000.0));
    assert!(spaced.count(0) > 50, "{}", spaced.count(0));
}

#[test]
fn heights_are_splines_over_the_ground_and_change_nothing_on_it() {
    let points = [[8.0, 46.5, 570.0], [8.1, 46.6, 1900.0], [8.3, 46.55, 2400.0], [8.4, 46.7, 1400.0]];
    let flat = points.map(|[x, y, _]| [x, y]);
    for closed in [false, true] {
        let (own, ground) =
            (fit(&on(Globe::WGS84), &one(&points, closed)), fit(&on(Globe::WGS84), &one(&flat, closed)));
        let (lifted, below): (Vec<Spatial>, Vec<Planar>) = (vertices(&own, 0, 16), vertices(&ground, 0, 16));
        assert!(lifted.iter().zip(&below).all(|([x, y, _], b)| [*x, *y] == *b));
        assert!(points.iter().enumerate().all(|(k, point)| lifted[16 * k] == *point), "{lifted:?}");
        let (curve, below) = (own.curve(0), ground.curve(0));
        // Slope and bend of the height by the arc length on the ground go on from span to span.
        for span in 1..3 {
            let [before, after] = [curve.jet(span - 1, 1.0), curve.jet(span, 0.0)];
            let [l, m] = [below.span_length(span - 1), below.span_length(span)];
            assert!((before.first.z / l - after.first.z / m).abs() < 1e-9 * after.first.z.abs() / m + 1e-12);
            assert!((before.second.z / (l * l) - after.second.z / (m * m)).abs() < 1e-12);
        }
    }
}

#[test]
fn tangents_point_east_and_north() {
    let points = [[-179.0, 60.0], [170.0, 70.0], [100.0, 80.0]];
    let tangents = vec![-1.0, 0.0, f64::NAN, f64::NAN, 1.0, 2.0];
    let constraints = Constraints { tangents: Some(tangents), ..Constraints::default() };
    let batch = one(&points, false).with_constraints(constraints).unwrap();
    let (vertices, report) = fitted::<2>(&on(Globe::WGS84), &batch, 8192);
    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
    let place = |p: Planar| Globe::WGS84.place(p[0], p[1]);
    // At its start it goes due west, and at its end it comes in from the south-south-west.
    let first = place(vertices[1]) - place(vertices[0]);
    let [east, north] = Globe::WGS84.compass(points[0][0], points[0][1]);
    let [along, across] = [first.dot(east), first.dot(north)].map(|x| x / first.length());
    // A step of 1/8192 of a span turns by half a thousandth at most.
    assert!(across.abs() < 5e-4 && along < 0.0, "{along} {across:e}");
    let last = place(vertices[16384]) - place(vertices[16383]);
    let [east, north] = Globe::WGS84.compass(points[2][0], points[2][1]);
    let [along, across] = [last.dot(east), last.dot(north)].map(|x| x / last.length());
    assert!((across - 2.0 / 5f64.sqrt()).abs() < 5e-4 && along > 0.0, "{along} {across}");
    let energy = |n: usize| {
        let fair = Fair { segments: Segments::PerSpan(n), ..on(Globe::WGS84) };
        fit(&fair, &batch).reports()[0].energy
    };
    let [a, b, c, d] = [16, 32, 64, 128].map(energy);
    let ratios = [(b - a) / (c - b), (c - b) / (d - c)];
    assert!(ratios.iter().all(|ratio| (3.5..4.6).contains(ratio)), "of second order: {ratios:?}");
}

#[test]
fn what_cannot_be_fitted_on_a_globe_has_a_sentence() {
    let points: [&[Planar]; 4] = [
        &[[0.0, 0.0], [10.0, 95.0], [20.0, 10.0]],
        &[[0.0, 0.0], [180.0, 0.0]],
        &[[0.0, 0.0], [10.0, f64::NAN], [20.0, 10.0]],
        &[[0.0, 0.0], [10.0, 5.0], [20.0, 10.0]],
    ];
    let batch = CurveBatch::from_slices(&points).unwrap();
    let fit = fit(&on(unit_sphere()), &batch);
    let [beyond, antipodal, broken, good] = [0, 1, 2, 3].map(|i| &fit.reports()[i]);
    assert!(beyond.message.as_ref().unwrap().contains("curve 0, point 1: its latitude is 95"), "{beyond:?}");
    assert!(antipodal.message.as_ref().unwrap().contains("no one point that is nearest"), "{antipodal:?}");
    assert_eq!(
        (antipodal.status, broken.status, good.status),
        (CurveStatus::Invalid, CurveStatus::Invalid, CurveStatus::Converged)
    );
    // Neighbours keep their bits, and what is not fitted is its points.
    let alone: Vec<Planar> = fitted::<2>(&on(unit_sphere()), &one(points[3], false), 16).0;
    assert_eq!(vertices::<2>(&fit, 3, 16), alone);
    assert_eq!(vertices::<2>(&fit, 0, 16), points[0]);
    let sphere = Fair { surface: Some(Arc::new(Quadric::sphere(1.0))), ..on(unit_sphere()) };
    let error = sphere.fit(&batch, &Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("points of three coordinates"), "{error}");
    let free = Fair { energy: geodesic_bending(2.0) + length(), ..Fair::default() };
    let error = free.fit(&batch, &Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("give one, or ask for bending"), "{error}");
}

#[test]
fn a_wide_neighbour_changes_no_bit() {
    let (near, wide) = ([[0.0, 10.0], [3.0, 12.0], [6.0, 9.0]], [[0.0, 0.0], [100.0, 20.0], [170.0, -10.0]]);
    let none = vec![f64::NAN; 6];
    let of = |batch: CurveBatch, tangents: Vec<f64>| {
        batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() }).unwrap()
    };
    let mut tangents = none.clone();
    tangents[..2].copy_from_slice(&[0.2, 1.0]);
    let alone = fit(&on(unit_sphere()), &of(one(&near, false), tangents.clone()));
    let both = CurveBatch::from_slices(&[&near[..], &wide]).unwrap();
    let beside = fit(&on(unit_sphere()), &of(both, [tangents, none].concat()));
    assert_eq!(vertices::<2>(&alone, 0, 16), vertices::<2>(&beside, 0, 16));
}
