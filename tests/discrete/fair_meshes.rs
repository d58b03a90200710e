//! Curves in meshes beside those in the surfaces that the meshes stand for.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use faircurve::CurveStatus;
use faircurve::discrete::{Fair, Pins, Segments, geodesic_bending, length};
use faircurve::surface::{Mesh, Quadric, Surface, Torus};
use glam::DVec3;

use crate::common::*;
use crate::meshes::{Raw, icosphere, torus};

fn mesh((vertices, triangles): &Raw) -> Arc<dyn Surface> {
    Arc::new(Mesh::new(vertices, triangles).unwrap())
}

fn within(surface: &Arc<dyn Surface>) -> Fair {
    Fair {
        energy: geodesic_bending(2.0) + 0.1 * length(),
        surface: Some(surface.clone()),
        segments: Segments::PerSpan(16),
        off_surface: Some(0.02),
        ..Fair::default()
    }
}

/// A curve to and fro on the ellipsoid of these semi-axes.
fn wave(axes: DVec3, count: usize) -> Vec<Spatial> {
    let point = |k: usize| {
        let (lon, lat) = (0.35 * k as f64, 0.5 * (1.7 * k as f64).sin());
        axes * DVec3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin())
    };
    (0..count).map(|k| point(k).to_array()).collect()
}

#[test]
fn curves_in_meshed_spheres_are_those_in_the_sphere_after_as_many_iterations() {
    let exact: Arc<dyn Surface> = Arc::new(Quadric::sphere(1.0));
    let meshed = mesh(&icosphere(3, DVec3::ONE));
    for count in [3, 5, 8] {
        let batch = one(&wave(DVec3::ONE, count), false);
        let [(wanted, own), (found, other)] =
            [&exact, &meshed].map(|surface| fitted::<3>(&within(surface), &batch, 16));
        println!("{count} points: {} iterations, in the mesh {}", own.iterations, other.iterations);
        assert_eq!((own.status, other.status), (CurveStatus::Converged, CurveStatus::Converged), "{other:?}");
        assert!(own.iterations.abs_diff(other.iterations) <= 1);
        assert!((other.energy / own.energy - 1.0).abs() < 1e-12 && apart(&wanted, &found) < 1e-9);
    }
}

#[test]
fn points_far_apart_are_joined_over_fine_meshes() {
    let surface = mesh(&icosphere(4, DVec3::ONE));
    for degrees in [60.0, 100.0, 150.0, 179.0] {
        let angle = f64::to_radians(degrees);
        let ends = [DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 1.0, 0.0)];
        let ends = [ends[0].to_array(), (angle.cos() * ends[0] + angle.sin() * ends[1]).to_array()];
        let fair = Fair { energy: geodesic_bending(2.0), ..within(&surface) };
        let fit = fit(&fair, &one(&ends, false));
        let report = &fit.reports()[0];
        println!("{degrees}°: {:?}, {} iterations", report.status, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        assert!((fit.curve(0).length() / angle - 1.0).abs() < 1e-5, "{}", fit.curve(0).length() / angle - 1.0);
    }
}

#[test]
fn energies_and_lengths_in_meshes_are_of_nearly_fourth_order_in_their_edges() {
    let axes = DVec3::new(1.5, 1.2, 1.0);
    let batch = one(&wave(axes, 6), false);
    let (wanted, exact) = fitted::<3>(&within(&(Arc::new(Quadric::ellipsoid(axes)) as Arc<dyn Surface>)), &batch, 16);
    println!("exact: E {:.6}, {} iterations", exact.energy, exact.iterations);
    let mut errors = Vec::new();
    for times in [2, 3, 4] {
        let (found, report) = fitted::<3>(&within(&mesh(&icosphere(times, axes))), &batch, 16);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        let [energy, long] =
            [report.energy / exact.energy - 1.0, length_of(&found, false) / length_of(&wanted, false) - 1.0];
        println!(
            "divided {times} times: {} iterations, E off by {energy:.2e}, length by {long:.2e}, vertices by {:.2e}",
            report.iterations,
            apart(&found, &wanted)
        );
        assert!(report.iterations <= exact.iterations + 2);
        errors.push([energy.abs(), long.abs(), apart(&found, &wanted)]);
    }
    for (k, what) in ["energy", "length", "vertices"].into_iter().enumerate() {
        let order = (errors[0][k] / errors[2][k]).log2() / 2.0;
        println!("{what}: order {order:.2}");
        assert!(order > 3.3, "{what}: {order}");
    }
}

#[test]
fn closed_geodesics_of_meshed_tori_are_as_long_as_those_of_the_torus() {
    // 12 parts are too coarse for the hole: patches reach across it.
    for (name, radius, exact, all) in [("inner", 0.5, PI, [24, 48]), ("outer", 1.5, 3.0 * PI, [12, 48])] {
        let mut errors = Vec::new();
        for parts in all {
            let surface = mesh(&torus(parts, [0.0, TAU], 0.25));
            let [found, wanted] =
                [surface, Arc::new(Torus::new(1.0, 0.5).unwrap()) as Arc<dyn Surface>].map(|surface| {
                    let point = |k: usize| {
                        let around = TAU * k as f64 / 128.0;
                        let (sin, cos) = around.sin_cos();
                        let near = DVec3::new(radius * cos, radius * sin, 0.05 * (3.0 * around).sin() + 0.02);
                        surface.closest(near).unwrap().to_array()
                    };
                    let fair = Fair {
                        energy: geodesic_bending(2.0),
                        surface: Some(surface.clone()),
                        segments: Segments::PerSpan(1),
                        pins: Pins::None,
                        ..Fair::default()
                    };
                    let (vertices, report) =
                        fitted::<3>(&fair, &one(&(0..128).map(point).collect::<Vec<_>>(), true), 1);
                    println!(
                        "{name}, {parts} parts: {:?}, {} iterations, E {:.1e}",
                        report.status, report.iterations, report.energy
                    );
                    assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
                    length_of(&vertices, true)
                });
            println!("{name}, {parts} parts: length off by {:.2e}", (found - wanted) / exact);
            assert!((wanted / exact - 1.0).abs() < 2e-4, "polygons of 128 sides");
            errors.push(((found - wanted) / exact).abs());
        }
        let order = (errors[0] / errors[1]).log2() / ((all[1] / all[0]) as f64).log2();
        println!("{name}: order {order:.2}");
        assert!(order > 3.0, "{order}");
    }
}

#[test]
fn curves_far_from_a_hole_are_fitted_and_the_hole_is_not_known() {
    let exact: Arc<dyn Surface> = Arc::new(Torus::new(1.0, 0.5).unwrap());
    let (vertices, mut triangles) = torus(32, [0.0, TAU], 0.25);
    // A hole around the outermost point (1.5, 0, 0).
    triangles.retain(|t| t.iter().all(|&i| DVec3::from_array(vertices[i]).distance(DVec3::X * 1.5) > 0.35));
    let surface = mesh(&(vertices, triangles));
    let on = |around: f64, tube: f64| {
        let out = 1.0 + 0.5 * tube.cos();
        DVec3::new(out * around.cos(), out * around.sin(), 0.5 * tube.sin())
    };
    let points: Vec<Spatial> = (0..5).map(|k| on(1.5 + 0.4 * k as f64, (2.0 * k as f64).sin()).to_array()).collect();
    let [found, wanted] = [&surface, &exact].map(|surface| fitted::<3>(&within(surface), &one(&points, false), 16));
    assert_eq!(found.1.status, CurveStatus::Converged, "{:?}", found.1);
    assert!(apart(&found.0, &wanted.0) < 1e-3 && (found.1.energy / wanted.1.energy - 1.0).abs() < 1e-2);
    assert!(found.0.iter().all(|v| surface.undefined(DVec3::from_array(*v)).is_none()));
    for over in [on(0.0, 0.0), on(0.1, 0.1), on(0.0, -0.4)] {
        let why = surface.undefined(over);
        assert_eq!(why.as_deref(), Some("lies beyond the mesh, at a hole or its rim"), "{over}");
    }
}

/// The cube of side 1 around 0, in so many cells a side.
fn cube(cells: usize) -> Raw {
    let (mut places, mut triangles) = (Vec::new(), Vec::new());
    let rows = cells + 1;
    let number = |k: usize| k as f64 / cells as f64 - 0.5;
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let first = places.len();
            for k in 0..rows * rows {
                let mut place = [side; 3];
                place[(axis + 1) % 3] = number(k % rows);
                place[(axis + 2) % 3] = number(k / rows);
                places.push(place);
            }
            for k in 0..cells * cells {
                let a = first + k / cells * rows + k % cells;
                triangles.extend([[a, a + 1, a + rows + 1], [a, a + rows + 1, a + rows]]);
            }
        }
    }
    (places, triangles)
}

#[test]
fn geodesics_over_a_crease_come_near_to_those_over_its_unfolding_with_the_edges() {
    // Over the edge between z = ½ and x = ½, that unfolds to a plane.
    let ends = [[0.1, -0.2, 0.5], [0.5, 0.2, 0.1]];
    let exact = f64::hypot(0.8, 0.4);
    let off = [8, 16].map(|cells| {
        let surface = mesh(&cube(cells));
        let fair = Fair { energy: geodesic_bending(2.0), segments: Segments::PerSpan(64), ..within(&surface) };
        let (vertices, report) = fitted::<3>(&fair, &one(&ends, false), 64);
        let off = length_of(&vertices, false) / exact - 1.0;
        println!("{cells} cells: {:?}, {} iterations, length off by {off:.2e}", report.status, report.iterations);
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        off.abs()
    });
    assert!(off[0] < 0.02 && off[1] < 0.6 * off[0], "{off:?}");
}
