//! Curves over terrain: planes as height fields, hills, and a mountain.

use std::sync::Arc;

use faircurve::discrete::{Energy, Fair, Segments, geodesic_bending, length};
use faircurve::io::surfaces::surface_of;
use faircurve::surface::{HeightField, Quadric, Surface};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Sampling};
use glam::DVec3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::common::*;

fn within(surface: impl Surface + 'static, energy: Energy, segments: usize) -> Fair {
    Fair { energy, surface: Some(Arc::new(surface)), segments: Segments::PerSpan(segments), ..Fair::default() }
}

#[test]
fn curves_in_a_tilted_height_field_are_those_in_its_plane() {
    let (p, q) = (0.4, -0.7);
    let heights = (0..30 * 30).map(|k| p * f64::from(k % 30 - 12) + q * f64::from(k / 30 - 12) + 2.0).collect();
    let field = HeightField::new([30, 30], heights).unwrap().with_origin([-12.0, -12.0]).unwrap();
    let plane = Quadric::plane(DVec3::new(-p, -q, 1.0), 2.0 / (1.0 + p * p + q * q).sqrt());
    let place = |[x, y]: [f64; 2]| [x, y, p * x + q * y + 2.0];
    let points = [[0.5, 0.5], [2.2, 3.9], [4.1, 1.3], [6.6, 4.2], [5.0, 2.0]].map(place);
    for closed in [false, true] {
        let energy = || geodesic_bending(2.0) + 0.1 * length();
        let (own, report) = fitted::<3>(&within(field.clone(), energy(), 16), &one(&points, closed), 16);
        let (wanted, other) = fitted::<3>(&within(plane.clone(), energy(), 16), &one(&points, closed), 16);
        assert_eq!([report.status, other.status], [CurveStatus::Converged; 2], "{report:?} {other:?}");
        let away = apart(&own, &wanted);
        println!("closed {closed}: {away:.1e} apart, {} and {} iterations", report.iterations, other.iterations);
        assert!(away < 1e-9 && (report.energy / other.energy - 1.0).abs() < 1e-12, "{away:e}");
    }
}

#[test]
fn curves_that_leave_the_grid_are_infeasible_and_say_where() {
    let field = HeightField::new([6, 8], vec![0.0; 48]).unwrap();
    let points = [[0.5, 0.5, 0.0], [6.9, 2.0, 0.0], [0.5, 3.5, 0.0]];
    let fair = within(field, geodesic_bending(2.0) + 0.01 * length(), 16);
    let fit = fair.fit(&one(&points, false), &Device::cpu()).unwrap();
    let report = &fit.reports()[0];
    assert_eq!(report.status, CurveStatus::Infeasible, "{report:?}");
    let message = report.message.as_ref().unwrap();
    assert!(
        message.contains("curve 0, point 0: the curve after it lies beyond the grid of x from 0 to 7"),
        "{message}"
    );
    let fit = fair.fit(&one(&[points[0], [7.5, 2.0, 0.0]], false), &Device::cpu()).unwrap();
    let message = fit.reports()[0].message.clone().unwrap();
    assert!(message.contains("curve 0, point 1: it lies beyond the grid"), "{message}");
}

#[test]
fn planar_points_are_those_of_the_terrain_over_them() {
    let heights = (0..20 * 20).map(|k| (0.5 * f64::from(k % 20)).sin() * (0.4 * f64::from(k / 20)).cos()).collect();
    let field = HeightField::new([20, 20], heights).unwrap();
    let flat = [[3.2, 4.1], [8.0, 5.5], [12.7, 10.2], [15.0, 14.0]];
    let points = flat.map(|[x, y]| [x, y, field.height(x, y)]);
    let fair = within(field, geodesic_bending(2.0) + 0.1 * length(), 16);
    let [lifted, given] = [one(&flat, false), one(&points, false)].map(|batch| {
        let fit = fair.fit(&batch, &Device::cpu()).unwrap();
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        fit.polylines(Sampling::PerSpan(4))
    });
    assert_eq!(lifted.dimension(), 3);
    assert_eq!(lifted.points(0), given.points(0));
}

#[test]
fn planar_tangents_are_those_of_the_terrain_over_them() {
    let heights = (0..20 * 20).map(|k| (0.5 * f64::from(k % 20)).sin() * (0.4 * f64::from(k / 20)).cos()).collect();
    let field = HeightField::new([20, 20], heights).unwrap();
    let flat = [[3.2, 4.1], [8.0, 5.5], [12.7, 10.2]];
    let (tangent, h) = ([0.6, 0.8], 1e-6);
    let points = flat.map(|[x, y]| [x, y, field.height(x, y)]);
    let along = |h: f64| field.height(flat[1][0] + h * tangent[0], flat[1][1] + h * tangent[1]);
    let rise = (along(h) - along(-h)) / (2.0 * h);
    let free = f64::NAN;
    let fair = within(field, geodesic_bending(2.0) + 0.1 * length(), 16);
    let planar = (one(&flat, false), vec![free, free, 0.6, 0.8, free, free]);
    let spatial = (one(&points, false), vec![free, free, free, 0.6, 0.8, rise, free, free, free]);
    let [lifted, given, without] = [planar, spatial, (one(&flat, false), vec![free; 6])].map(|(batch, tangents)| {
        let constraints = Constraints { tangents: Some(tangents), ..Constraints::default() };
        let fit = fair.fit(&batch.with_constraints(constraints).unwrap(), &Device::cpu()).unwrap();
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        fit.polylines(Sampling::PerSpan(4)).points(0).to_vec()
    });
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(&lifted, &given) < 1e-7 && apart(&lifted, &without) > 0.01, "{}", apart(&lifted, &given));
}

/// Hills of 1,470 by 1,170 m, from west to east and from north to south.
fn hills() -> HeightField {
    let wave = |x: f64, y: f64| 150.0 * (x / 210.0).sin() * (y / 260.0).cos() + 500.0;
    let heights = (0..40 * 50).map(|k| wave(30.0 * f64::from(k % 50), -30.0 * f64::from(k / 50)));
    HeightField::new([40, 50], heights.collect()).unwrap().with_spacing([30.0, -30.0]).unwrap()
}

#[test]
fn terrain_at_the_coordinates_of_a_map_is_that_about_the_origin() {
    // An easting and a northing in metres, whose last digits are 1e-9 m.
    let [east, north] = [412_345.678, 5_654_321.987];
    let mut rng = StdRng::seed_from_u64(14);
    let field = hills();
    let (far, mut flat) = (field.clone().with_origin([east, north]).unwrap(), Vec::new());
    for _ in 0..60 {
        let mut place = |k: usize| {
            let (x, y) = (150.0 + 280.0 * k as f64, rng.random_range(-900.0..-250.0));
            [x + rng.random_range(-80.0..80.0), y]
        };
        flat.push((0..5).map(&mut place).collect::<Vec<[f64; 2]>>());
    }
    let batch = |by: [f64; 2]| {
        let moved = flat.iter().map(|curve| curve.iter().map(|[x, y]| [x + by[0], y + by[1]]).collect::<Vec<_>>());
        let moved: Vec<Vec<[f64; 2]>> = moved.collect();
        CurveBatch::from_slices(&moved.iter().map(|curve| &curve[..]).collect::<Vec<_>>()).unwrap()
    };
    let fit = |field: HeightField, by: [f64; 2]| {
        let fair = within(field, geodesic_bending(2.0) + 1e-5 * length(), 16);
        fair.fit_sampled(&batch(by), Sampling::PerSpan(16), &Device::cpu()).unwrap()
    };
    let ((near, own), (moved, other)) = (fit(field, [0.0; 2]), fit(far, [east, north]));
    let mut most = 0.0f64;
    for i in 0..near.len() {
        let [a, b] = [&near, &moved].map(|fit| (fit.reports()[i].status, fit.reports()[i].iterations));
        assert_eq!(a, b, "curve {i}");
        for (p, q) in own.points(i).chunks_exact(3).zip(other.points(i).chunks_exact(3)) {
            most = most.max((p[0] + east - q[0]).hypot(p[1] + north - q[1]).hypot(p[2] - q[2]));
        }
    }
    println!("{most:.1e} m apart");
    assert!(most < 1e-6, "{most:e}");
}

#[test]
fn curves_over_hills_lie_in_them_and_take_few_iterations() {
    let seed = 12;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let hills = hills();
    let mut iterations = Vec::new();
    for _ in 0..100 {
        let mut place = |k: usize| {
            let (x, y) = (150.0 + 280.0 * k as f64 + rng.random_range(-80.0..80.0), rng.random_range(-900.0..-250.0));
            [x, y, hills.height(x, y)]
        };
        let points: Vec<Spatial> = (0..5).map(&mut place).collect();
        let fair = within(hills.clone(), geodesic_bending(2.0) + 1e-5 * length(), 16);
        let (vertices, report) = fitted::<3>(&fair, &one(&points, false), 16);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!(vertices.iter().all(|v| hills.value(DVec3::from_array(*v)).abs() < 1e-11));
        iterations.push(report.iterations);
    }
    iterations.sort();
    println!("{} iterations at the median, {} at most", iterations[50], iterations[99]);
    assert!(iterations[50] <= 10, "{iterations:?}");
}

#[test]
fn curves_over_a_mountain_converge_between_points_a_kilometre_apart() {
    let seed = 31;
    println!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    let mountain = surface_of("grid:examples/data/mountain.csv,74.5,-92.5").unwrap();
    let (mut converged, mut iterations) = (0, Vec::new());
    for weight in [1e-6, 1e-5] {
        let curves: Vec<Vec<Spatial>> = (0..50)
            .map(|_| {
                let place = |k: usize| {
                    let (x, y) = (600.0 + 950.0 * k as f64, rng.random_range(-4000.0..-1500.0));
                    let above = DVec3::new(x, y, 0.0);
                    [x, y, -mountain.value(above)]
                };
                (0..6).map(place).collect()
            })
            .collect();
        let slices: Vec<&[Spatial]> = curves.iter().map(|points| &points[..]).collect();
        let batch = faircurve::CurveBatch::from_slices(&slices).unwrap();
        let energy = geodesic_bending(2.0) + weight * length();
        let fair = Fair { energy, surface: Some(mountain.clone()), segments: Segments::PerSpan(16), ..Fair::default() };
        let fit = fit(&fair, &batch);
        for (i, report) in fit.reports().iter().enumerate() {
            println!("{weight} {i}: {:?} after {} {:?}", report.status, report.iterations, report.message);
            converged += usize::from(report.status == CurveStatus::Converged);
            iterations.push(report.iterations);
            let vertices = fit.polylines(Sampling::PerSpan(16));
            let off = vertices.points(i).chunks_exact(3).map(|v| mountain.value(DVec3::from_slice(v)).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-10, "{off:e}");
        }
    }
    iterations.sort();
    println!(
        "{converged} of 100 converge, after {} iterations at the median and {} at most",
        iterations[50], iterations[99]
    );
    assert!(converged >= 98);
}
