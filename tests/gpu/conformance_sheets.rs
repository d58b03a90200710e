//! Fair curves in terrain and in triangle meshes on the GPU are those of the CPU: the same statuses, and curves within 1e-9 of
//! their size. Their kernels read tables, and are in f64 alone.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use faircurve::discrete::{Energy, Fair, Pins, Segments, attachment, bending, geodesic_bending, tautness};
use faircurve::gpu::plan::Limits;
use faircurve::io::surfaces::surface_of;
use faircurve::surface::{HeightField, Mesh, Surface};
use faircurve::{CurveBatch, CurveStatus, Device, Precision, Sampling};
use glam::DVec3;
use rand::RngExt;
use rand::rngs::StdRng;

use crate::common::{device, gpu, precisions, seeded};
use crate::conformance_surfaces::{conform_in, onto, walks};
use crate::meshes::{Raw, icosphere, torus};

/// The device in f64. Nothing if it has none.
fn in_f64() -> Option<Device> {
    let device = device()?;
    precisions(device.as_gpu()?).contains(&Precision::F64).then(|| device.with_precision(Precision::F64))
}

/// [`conform_in`] in f64, with all curves on the device itself.
fn conform(what: &str, fair: &Fair, batch: &CurveBatch, device: &Device) {
    let report = conform_in(&[Precision::F64], what, fair, batch, device);
    assert!(report.is_gpu && report.finished_on_cpu == 0, "{what}: {report:?}");
}

/// Walks in a plane from within a box, of steps of a length, which turn by σ at each; every third is a ring.
fn planar(count: usize, [low, high]: [[f64; 2]; 2], step: f64, sigma: f64, rng: &mut StdRng) -> CurveBatch {
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for i in 0..count {
        let is_ring = i % 3 == 2;
        let points = [5, 5, 5, 2, 3, 8][i % 6];
        let mut at = [0, 1].map(|axis| rng.random_range(low[axis]..high[axis]));
        let mut ahead = rng.random_range(0.0..TAU);
        for _ in 0..points {
            coords.extend(at);
            let round = if is_ring { TAU / points as f64 } else { 0.0 };
            ahead += round + sigma * (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
            at = [at[0] + step * ahead.cos(), at[1] + step * ahead.sin()];
        }
        offsets.push(coords.len() / 2);
        closed.push(is_ring);
    }
    CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(closed).unwrap()
}

/// Hills and valleys with slopes up to about 1, rows from north to south.
fn hills() -> HeightField {
    let (rows, columns) = (40, 50);
    let at = |k: usize| [25.0 * (k % columns) as f64, -20.0 * (k / columns) as f64];
    let height =
        |[x, y]: [f64; 2]| 40.0 * (x / 60.0).sin() * (y / 75.0).cos() + 0.2 * x + 15.0 * (x * y / 9000.0).cos();
    let heights = (0..rows * columns).map(|k| height(at(k))).collect();
    let field = HeightField::new([rows, columns], heights).unwrap().with_spacing([25.0, -20.0]).unwrap();
    field.with_origin([-600.0, 400.0]).unwrap()
}

fn mesh((vertices, triangles): &Raw) -> Mesh {
    Mesh::new(vertices, triangles).unwrap()
}

fn on(surface: &Arc<dyn Surface>, energy: Energy) -> Fair {
    Fair { energy, surface: Some(Arc::clone(surface)), segments: Segments::PerSpan(8), ..Fair::default() }
}

#[test]
fn curves_in_terrain_end_where_the_cpu_ends() {
    let Some(device) = in_f64() else { return };
    let field: Arc<dyn Surface> = Arc::new(hills());
    let batch = planar(120, [[-400.0, -200.0], [400.0, 200.0]], 45.0, 0.3, &mut seeded(71));
    conform("hills", &on(&field, geodesic_bending(2.0) + tautness()), &batch, &device);
    let fair = on(&field, geodesic_bending(2.0) + bending(2.0) + tautness());
    conform("hills, bending in space", &fair, &batch, &device);
    let open = batch.select(&(0..120).filter(|i| i % 3 != 2).collect::<Vec<_>>());
    let attached = Fair { pins: Pins::Ends, ..on(&field, geodesic_bending(2.0) + tautness() + 1e-2 * attachment()) };
    conform("attached to hills", &attached, &open, &device);
    let mountain = surface_of("grid:examples/data/mountain.csv,30,-30,0,1770").unwrap();
    let batch = planar(60, [[400.0, 400.0], [2000.0, 1400.0]], 60.0, 0.3, &mut seeded(72));
    conform("the mountain", &on(&mountain, geodesic_bending(2.0) + tautness()), &batch, &device);
}

#[test]
fn curves_in_meshes_end_where_the_cpu_ends() {
    let Some(device) = in_f64() else { return };
    let globe: Arc<dyn Surface> = Arc::new(mesh(&icosphere(2, DVec3::ONE)));
    let batch = walks(40, 15.0, 0.2, &mut seeded(73));
    conform("icosphere", &on(&globe, geodesic_bending(2.0) + tautness()), &batch, &device);
    let ring: Arc<dyn Surface> = Arc::new(mesh(&torus(20, [0.0, TAU], 0.2)));
    let over = onto(&*ring, 1.5, &walks(40, 6.0, 0.2, &mut seeded(75)));
    conform("torus", &on(&ring, geodesic_bending(2.0) + tautness()), &over, &device);
}

/// The curves that converge on the CPU.
fn good(fair: &Fair, batch: &CurveBatch, least: usize) -> CurveBatch {
    let fit = fair.fit(batch, &Device::cpu()).unwrap();
    let good: Vec<usize> = (0..batch.len()).filter(|&i| fit.reports()[i].status == CurveStatus::Converged).collect();
    assert!(good.len() >= least, "{} of {}", good.len(), batch.len());
    batch.select(&good)
}

/// Fits good curves alone and among bad ones, whose statuses are those of the CPU, and asserts that all bits of the good ones
/// are the same. The bad ones that converge are within 1e-9 of the CPU's.
fn bad_among_good(what: &str, fair: &Fair, good: &CurveBatch, bad: &CurveBatch, device: &Device) {
    let of = |batch: &CurveBatch, i: usize| (batch.points(i).to_vec(), batch.is_closed(i));
    let all: Vec<_> = (0..good.len()).map(|i| of(good, i)).chain((0..bad.len()).map(|i| of(bad, i))).collect();
    // Bad ones stand between good ones.
    let mut places: Vec<usize> = (0..all.len()).collect();
    places.sort_by_key(|&k| if k < good.len() { (3 * k, 0) } else { (4 * (k - good.len()), 1) });
    let coords = places.iter().flat_map(|&k| all[k].0.iter().copied()).collect();
    let dimension = good.dimension();
    let ends = places.iter().scan(0, |end, &k| {
        *end += all[k].0.len() / dimension;
        Some(*end)
    });
    let mixed = CurveBatch::from_ragged(dimension, coords, [0].into_iter().chain(ends).collect()).unwrap();
    let mixed = mixed.closed_each(places.iter().map(|&k| all[k].1).collect()).unwrap();
    let sampling = Sampling::PerSpan(8);
    let (cpu, wanted) = fair.fit_sampled(&mixed, sampling, &Device::cpu()).unwrap();
    let (gpu, found) = fair.fit_sampled(&mixed, sampling, device).unwrap();
    let (reports_alone, alone) = fair.fit_sampled(good, sampling, device).unwrap();
    println!("{what}: {} of {} left to the CPU", gpu.device().finished_on_cpu, mixed.len());
    let mut farthest = 0.0f64;
    for (i, &k) in places.iter().enumerate() {
        let (a, b) = (&cpu.reports()[i], &gpu.reports()[i]);
        assert_eq!((a.status, &a.message), (b.status, &b.message), "{what}, curve {i}: {a:?} {b:?}");
        if k < good.len() {
            let own = &reports_alone.reports()[k];
            assert_eq!(
                (b.status, own.status),
                (CurveStatus::Converged, CurveStatus::Converged),
                "{k}: {:?}",
                own.message
            );
            let bits = |points: &[f64]| points.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(found.points(i)), bits(alone.points(k)), "{what}, curve {i}");
        }
        let points = wanted.points(i);
        let span = points.iter().fold(0.0f64, |most, x| most.max((x - points[0]).abs()));
        let away = points.iter().zip(found.points(i)).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
        if a.status == CurveStatus::Converged {
            farthest = farthest.max(away / span);
        }
    }
    let bad: Vec<_> = places.iter().zip(cpu.reports()).filter(|(k, _)| **k >= good.len()).collect();
    println!(
        "{what}: bad ones are {:?}, apart {farthest:.1e}",
        bad.iter().map(|(_, own)| own.status).collect::<Vec<_>>()
    );
    assert!(bad.iter().any(|(_, report)| report.status != CurveStatus::Converged), "{what}: none is bad");
    assert!(farthest <= 1e-9, "{what}: {farthest:e}");
}

#[test]
fn curves_at_and_beyond_the_edge_of_terrain_change_no_others() {
    let Some(device) = in_f64() else { return };
    let field: Arc<dyn Surface> = Arc::new(hills());
    let fair = on(&field, geodesic_bending(2.0) + tautness());
    let good = good(&fair, &planar(30, [[-400.0, -200.0], [400.0, 200.0]], 45.0, 0.3, &mut seeded(76)), 25);
    // The grid is x from −600 to 625 and y from −380 to 400.
    let bad: [&[[f64; 2]]; 5] = [
        // Along the edge, to a corner.
        &[[-600.0, 100.0], [-600.0, 200.0], [-600.0, 400.0]],
        // Through the edge within a span.
        &[[-570.0, 100.0], [-598.0, 120.0], [-598.0, 140.0], [-570.0, 160.0]],
        // Beyond.
        &[[-580.0, -300.0], [-630.0, -270.0], [-660.0, -200.0]],
        &[[1e7, -300.0], [1e7 + 50.0, -250.0], [1e7, -200.0]],
        // Back and forth.
        &[[-200.0, -100.0], [-160.0, -100.0], [-200.0, -100.0], [-160.0, -99.5]],
    ];
    let bad = CurveBatch::from_slices(&bad).unwrap();
    bad_among_good("hills", &fair, &good, &bad, &device);
}

#[test]
fn curves_at_and_beyond_the_rim_of_a_mesh_change_no_others() {
    let Some(device) = in_f64() else { return };
    let half: Arc<dyn Surface> = Arc::new(mesh(&torus(20, [0.0, PI], 0.2)));
    let fair = on(&half, geodesic_bending(2.0) + tautness());
    let place = |around: f64, tube: f64| {
        let out = 1.0 + 0.5 * tube.cos();
        let place = DVec3::new(out * around.cos(), out * around.sin(), 0.5 * tube.sin());
        half.closest(place).unwrap().to_array()
    };
    let mut rng = seeded(77);
    let mut walk = |from: f64| {
        let tube = rng.random_range(0.0..TAU);
        (0..5).map(|k| place(from + 0.15 * k as f64, tube + rng.random_range(-0.3..0.3))).collect::<Vec<_>>()
    };
    let all: Vec<_> = (0..12).map(|k| walk(0.4 + 0.14 * k as f64)).collect();
    let all = CurveBatch::from_slices(&all.iter().map(|own| &own[..]).collect::<Vec<_>>()).unwrap();
    let good = good(&fair, &all, 10);
    let bad = [
        // Along the rim and in the rim.
        (0..5).map(|k| place(0.02, 0.3 * k as f64)).collect::<Vec<_>>(),
        (0..5).map(|k| place(0.0, 0.3 * k as f64)).collect(),
        // Over it.
        (0..5).map(|k| place(0.2 - 0.06 * k as f64, 0.1 * k as f64)).collect(),
        // Through it within a span.
        vec![place(0.4, 0.0), place(0.0, 0.4), place(0.0, 1.2), place(0.4, 1.6)],
        // Through the hole of the torus, along chords that leave it.
        vec![place(0.3, PI), place(1.5, 0.0), place(2.8, PI)],
    ];
    let bad = CurveBatch::from_slices(&bad.iter().map(|own| &own[..]).collect::<Vec<_>>()).unwrap();
    bad_among_good("half a torus", &fair, &good, &bad, &device);
}

#[test]
fn lanes_that_share_a_curve_in_terrain_and_in_a_mesh_end_where_the_cpu_ends() {
    let (Some(_), Some(gpu)) = (in_f64(), gpu()) else { return };
    let device = Device::from_gpu(gpu.with_lanes(8).with_poisoned_arrays()).with_precision(Precision::F64);
    let field: Arc<dyn Surface> = Arc::new(hills());
    let batch = planar(30, [[-400.0, -200.0], [400.0, 200.0]], 45.0, 0.3, &mut seeded(71));
    conform("hills", &on(&field, geodesic_bending(2.0) + tautness()), &batch, &device);
    let globe: Arc<dyn Surface> = Arc::new(mesh(&icosphere(2, DVec3::ONE)));
    let batch = walks(20, 15.0, 0.2, &mut seeded(73));
    conform("icosphere", &on(&globe, geodesic_bending(2.0) + tautness()), &batch, &device);
}

#[test]
fn devices_of_eight_storage_bindings_or_small_ones_leave_tables_to_the_cpu() {
    let (Some(_), Some(device)) = (in_f64(), gpu()) else { return };
    let field: Arc<dyn Surface> = Arc::new(hills());
    let batch = planar(6, [[-400.0, -200.0], [400.0, 200.0]], 45.0, 0.3, &mut seeded(78));
    let fair = on(&field, geodesic_bending(2.0) + tautness());
    let limits = *device.limits();
    let device = device.with_limits(Limits { storage_bindings: 8, ..limits });
    let eight = Device::from_gpu(device).with_precision(Precision::F64);
    assert!(!fair.fit(&batch, &eight).unwrap().device().is_gpu);
    // 8 bytes of 4 numbers a node are 64,000 and more.
    let Some(device) = gpu() else { return };
    let device = device.with_limits(Limits { binding_bytes: 64_000, ..limits });
    let small = Device::from_gpu(device).with_precision(Precision::F64);
    assert_eq!(fair.fit(&batch, &small).unwrap().device().finished_on_cpu, batch.len());
}
