//! Fair curves in surfaces on the GPU are those of the CPU: the same statuses, and curves within 1e-9 (f64) and 2e-5 (f32) of
//! their size. Surfaces without kernels, and curves that nothing holds, are left to the CPU; so are tori and own surfaces in f32.

use std::sync::Arc;

use faircurve::discrete::{Energy, Fair, Limits, Pins, attachment, bending, geodesic_bending, length, tautness};
use faircurve::surface::{Globe, Quadric, Surface, SurfaceKernel, Torus};
use faircurve::{CurveBatch, CurveStatus, Device, DeviceReport, Precision, Sampling};
use glam::{DMat3, DVec3};
use rand::RngExt;
use rand::rngs::StdRng;

use crate::common::{device, precisions, seeded};

/// Walks on the unit sphere of steps of some degrees, which turn by σ at each; every second closed.
pub(crate) fn walks(count: usize, step: f64, sigma: f64, rng: &mut StdRng) -> CurveBatch {
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for i in 0..count {
        let points = 2 + i % 7 + 2 * (i % 2);
        let mut at = DVec3::from_array([(); 3].map(|()| rng.random_range(-1.0..1.0))).normalize();
        let mut ahead = at.any_orthonormal_vector();
        let round = if i % 2 == 1 { std::f64::consts::TAU / points as f64 } else { 0.0 };
        for _ in 0..points {
            coords.extend(at.to_array());
            let turn = round + sigma * (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
            ahead = turn.cos() * ahead + turn.sin() * at.cross(ahead);
            let (sin, cos) = f64::to_radians(step).sin_cos();
            (at, ahead) = (cos * at + sin * ahead, cos * ahead - sin * at);
        }
        offsets.push(coords.len() / 3);
        closed.push(i % 2 == 1);
    }
    CurveBatch::from_ragged(3, coords, offsets).unwrap().closed_each(closed).unwrap()
}

/// The walks moved onto a surface, whose axes are at most so many times the sphere's.
pub(crate) fn onto(surface: &dyn Surface, size: f64, batch: &CurveBatch) -> CurveBatch {
    let points = batch.coords().chunks_exact(3).map(|p| surface.closest(size * DVec3::from_slice(p)).unwrap());
    let coords = points.flat_map(|p| p.to_array()).collect();
    let moved = CurveBatch::from_ragged(3, coords, batch.offsets().to_vec()).unwrap();
    moved.closed_each((0..batch.len()).map(|i| batch.is_closed(i)).collect()).unwrap()
}

fn degrees(globe: Globe, batch: &CurveBatch) -> CurveBatch {
    let angles = batch.coords().chunks_exact(3).flat_map(|p| globe.angles(globe.equatorial * DVec3::from_slice(p)));
    let turned = CurveBatch::from_ragged(2, angles.collect(), batch.offsets().to_vec()).unwrap();
    turned.closed_each((0..batch.len()).map(|i| batch.is_closed(i)).collect()).unwrap()
}

/// A curve is at rest if its gradient is at most 16 tolerances. An H200 left 3.2.
const AT_REST: f64 = 16.0;

/// The largest distance of curves as a part of their size.
fn bound(precision: Precision) -> f64 {
    if precision == Precision::F64 { 1e-9 } else { 2e-5 }
}

/// Fits on both, and asserts statuses and distances.
pub(crate) fn conform(what: &str, fair: &Fair, batch: &CurveBatch, device: &Device) {
    conform_in(&precisions(device.as_gpu().expect("a GPU")), what, fair, batch, device);
}

/// [`conform`] in these precisions alone. What did the work in the last is returned.
pub(crate) fn conform_in(
    precisions: &[Precision],
    what: &str,
    fair: &Fair,
    batch: &CurveBatch,
    device: &Device,
) -> DeviceReport {
    let mut report = None;
    let sampling = Sampling::PerSpan(16);
    let (cpu, wanted) = fair.fit_sampled(batch, sampling, &Device::cpu()).unwrap();
    for &precision in precisions {
        let (gpu, found) = fair.fit_sampled(batch, sampling, &device.clone().with_precision(precision)).unwrap();
        report = Some(gpu.device().clone());
        let mut farthest = 0.0f64;
        for i in 0..batch.len() {
            let (a, b) = (&cpu.reports()[i], &gpu.reports()[i]);
            // A device that contracts may come to rest a little above the tolerance, since projections onto a surface round.
            let rests = b.energy.is_finite() && b.gradient_norm <= AT_REST * fair.tolerance;
            let alike = a.status == b.status
                || rests && [a.status, b.status] == [CurveStatus::Converged, CurveStatus::NotConverged];
            assert!(alike, "{what}, {precision:?}, curve {i}: {a:?} {b:?}");
            let span = |own: &[f64]| own.iter().fold(0.0f64, |most, x| most.max((x - own[0]).abs()));
            let away = wanted.points(i).iter().zip(found.points(i)).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            if a.status == CurveStatus::Converged {
                farthest = farthest.max(away / span(batch.points(i)));
            }
        }
        println!("{what}, {precision:?}: {} of {} converged, apart {farthest:.1e}", cpu.usable(), batch.len());
        assert!(farthest <= bound(precision), "{what}: {farthest:e}");
        assert!(9 * batch.len() <= 10 * cpu.usable(), "{what}: {} converged", cpu.usable());
    }
    report.expect("a precision")
}

pub(crate) fn within(surface: impl Surface + 'static, energy: Energy) -> Fair {
    Fair { energy, surface: Some(Arc::new(surface)), ..Fair::default() }
}

#[test]
fn curves_in_quadrics_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let batch = walks(300, 20.0, 0.2, &mut seeded(61));
    conform("sphere", &within(Quadric::sphere(1.0), geodesic_bending(2.0) + tautness()), &batch, &device);
    let axes = DVec3::new(1.4, 1.2, 1.0);
    let moved = onto(&Quadric::ellipsoid(axes), 1.2, &walks(120, 15.0, 0.2, &mut seeded(62)));
    // Rings of these turn too sharply for f32.
    let moved = moved.select(&(0..120).step_by(2).collect::<Vec<_>>());
    conform("ellipsoid", &within(Quadric::ellipsoid(axes), bending(2.0) + 0.5 * length()), &moved, &device);
    let fair = Fair {
        pins: Pins::Ends,
        ..within(Quadric::sphere(1.0), geodesic_bending(2.0) + length() + 100.0 * attachment())
    };
    let open = batch.select(&(0..300).step_by(2).collect::<Vec<_>>());
    conform("attached on the sphere", &fair, &open, &device);
}

#[test]
fn tracks_of_the_globe_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let batch = degrees(Globe::WGS84, &walks(200, 3.0, 0.3, &mut seeded(63)));
    let fair = within(Globe::WGS84, geodesic_bending(2.0) + tautness());
    let (cpu, wanted) = fair.fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu()).unwrap();
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        let on = device.clone().with_precision(precision);
        let (gpu, found) = fair.fit_sampled(&batch, Sampling::PerSpan(16), &on).unwrap();
        let place = |p: &[f64]| Globe::WGS84.place(p[0], p[1]);
        let mut farthest = 0.0f64;
        for i in 0..batch.len() {
            let start = place(batch.points(i));
            let reach = batch.points(i).chunks_exact(2).map(|p| place(p).distance(start)).fold(0.0, f64::max);
            let pairs = wanted.points(i).chunks_exact(2).zip(found.points(i).chunks_exact(2));
            let away = pairs.map(|(a, b)| place(a).distance(place(b))).fold(0.0, f64::max);
            farthest = farthest.max(away / reach);
        }
        println!("{precision:?}: {farthest:.1e} of their size, {} usable", gpu.usable());
        assert_eq!((cpu.usable(), gpu.usable()), (200, 200));
        assert!(farthest <= bound(precision), "{farthest:e}");
    }
}

/// An own surface: the ripples z = ¼ sin x cos y, with the text of its kernels or without.
#[derive(Debug)]
struct Ripples {
    has_text: bool,
}

impl Surface for Ripples {
    fn name(&self) -> String {
        "the ripples".into()
    }

    fn value(&self, x: DVec3) -> f64 {
        x.z - 0.25 * x.x.sin() * x.y.cos()
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        DVec3::new(-0.25 * x.x.cos() * x.y.cos(), 0.25 * x.x.sin() * x.y.sin(), 1.0)
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        let (bend, twist) = (0.25 * x.x.sin() * x.y.cos(), 0.25 * x.x.cos() * x.y.sin());
        DMat3::from_cols(DVec3::new(bend, twist, 0.0), DVec3::new(twist, bend, 0.0), DVec3::ZERO)
    }

    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        let (by_x, by_y) = (0.25 * x.x.cos() * x.y.cos(), -0.25 * x.x.sin() * x.y.sin());
        let bend = by_x * along.x + by_y * along.y;
        let twist = by_y * along.x + by_x * along.y;
        DMat3::from_cols(DVec3::new(bend, twist, 0.0), DVec3::new(twist, bend, 0.0), DVec3::ZERO)
    }

    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        if self.has_text { Some(self) } else { None }
    }
}

impl SurfaceKernel for Ripples {
    fn text(&self) -> String {
        let text = "
            // The sine and the cosine in f64, which WGSL's own lack: by halves until the series is exact.
            fn surface_wave(t: real) -> vec2<real> {
                let h = t / real(1024);
                let q = h * h;
                var s = h * (real(1) - q / real(6) * (real(1) - q / real(20)));
                // 1 − cos
                var c = real(0.5) * q * (real(1) - q / real(12) * (real(1) - q / real(30)));
                for (var k = 0u; k < 10u; k++) {
                    let twice = real(2) * s * (real(1) - c);
                    c = real(2) * s * s;
                    s = twice;
                }
                return vec2<real>(s, real(1) - c);
            }
            fn surface_value(x: vector) -> real {
                return x.z - real(0.25) * surface_wave(x.x).x * surface_wave(x.y).y;
            }
            fn surface_gradient(x: vector) -> vector {
                let u = surface_wave(x.x);
                let v = surface_wave(x.y);
                return vector(real(-0.25) * u.y * v.y, real(0.25) * u.x * v.x, real(1));
            }
            fn surface_bends(bend: real, twist: real) -> matrix {
                return matrix(vector(bend, twist, real(0)), vector(twist, bend, real(0)), vector());
            }
            fn surface_hessian(x: vector) -> matrix {
                let u = surface_wave(x.x);
                let v = surface_wave(x.y);
                return surface_bends(real(0.25) * u.x * v.y, real(0.25) * u.y * v.x);
            }
            fn surface_third(x: vector, along: vector) -> matrix {
                let u = surface_wave(x.x);
                let v = surface_wave(x.y);
                let by_x = real(0.25) * u.y * v.y;
                let by_y = real(-0.25) * u.x * v.x;
                return surface_bends(by_x * along.x + by_y * along.y, by_y * along.x + by_x * along.y);
            }";
        text.into()
    }
}

#[test]
fn curves_in_a_torus_and_in_an_own_surface_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let torus = Torus::new(2.0, 0.6).unwrap();
    let near = onto(&torus, 2.5, &walks(60, 4.0, 0.2, &mut seeded(64)));
    conform("torus", &within(torus, geodesic_bending(2.0) + length()), &near, &device);
    for has_text in [true, false] {
        let ripples = Ripples { has_text };
        let over = walks(60, 25.0, 0.2, &mut seeded(65));
        let flat = over.coords().chunks_exact(3).map(|p| 2.0 * DVec3::from_slice(p));
        let coords = flat.flat_map(|p| ripples.closest(DVec3::new(p.x, p.y, 0.0)).unwrap().to_array()).collect();
        let over = CurveBatch::from_ragged(3, coords, over.offsets().to_vec()).unwrap();
        let fair = within(ripples, geodesic_bending(2.0) + bending(2.0) + length());
        conform(if has_text { "ripples" } else { "ripples without a text" }, &fair, &over, &device);
        let on = device.clone().with_precision(Precision::F64);
        if precisions(device.as_gpu().unwrap()).contains(&Precision::F64) {
            assert_eq!(fair.fit(&over, &on).unwrap().device().is_gpu, has_text);
        }
    }
}

#[test]
fn a_largest_geodesic_curvature_is_kept_as_on_the_cpu() {
    let Some(device) = device() else { return };
    // In f32 such curves are the CPU's.
    let f64_alone: Vec<_> = precisions(device.as_gpu().unwrap()).into_iter().filter(|p| *p == Precision::F64).collect();
    let torus = Torus::new(2.0, 0.6).unwrap();
    let on_sphere = walks(160, 20.0, 0.2, &mut seeded(66));
    let on_torus = onto(&torus, 2.5, &walks(160, 4.0, 0.2, &mut seeded(67)));
    let sphere = within(Quadric::sphere(1.0), geodesic_bending(2.0) + tautness());
    let torus = within(torus, geodesic_bending(2.0) + length());
    for (what, fair, batch, bound) in [("sphere", sphere, on_sphere, 1.5), ("torus", torus, on_torus, 10.0)] {
        let open = batch.select(&(0..160).step_by(2).collect::<Vec<_>>());
        let fair = Fair { limits: Limits { curvature: Some(bound), ..Limits::default() }, ..fair };
        let fit = fair.fit(&open, &Device::cpu()).unwrap();
        let held = fit.reports().iter().filter(|report| report.limits.is_some_and(|limits| limits.active > 0)).count();
        println!("{what}: {held} of {} are held", open.len());
        assert!(held >= 4, "{what}");
        if !f64_alone.is_empty() {
            let did = conform_in(&f64_alone, what, &fair, &open, &device);
            assert!(did.is_gpu && did.finished_on_cpu == 0, "{what}: {did:?}");
        }
    }
}

#[test]
fn curves_that_nothing_holds_are_the_cpus() {
    let Some(device) = device() else { return };
    let ring: Vec<[f64; 3]> =
        (0..24).map(|k| 0.26 * k as f64).map(|s| [s.cos(), s.sin(), 0.1 * (2.0 * s).sin()]).collect();
    let loose = CurveBatch::from_slices(&[&ring[..]]).unwrap().closed_each(vec![true]).unwrap();
    let loose = onto(&Quadric::sphere(1.0), 1.0, &loose);
    let fair = Fair { pins: Pins::None, ..within(Quadric::sphere(1.0), geodesic_bending(2.0)) };
    // Where it ends on the sphere depends on when it does, and f32 ends sooner.
    let f64_alone: Vec<_> = precisions(device.as_gpu().unwrap()).into_iter().filter(|p| *p == Precision::F64).collect();
    conform_in(&f64_alone, "a loose ring", &fair, &loose, &device);
}
