//! Curves in surfaces: closed geodesics against their exact lengths, elastic curves of a sphere, and tracks that do not
//! know where the poles are. Paths over a mountain.

mod pictures;
mod terrain;

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::sync::Arc;

use faircurve::discrete::{Fair, Pins, Segments, bending, geodesic_bending, length, tautness};
use faircurve::spline::{Natural, SurfaceSpline};
use faircurve::surface::{Globe, Quadric, Surface, Torus};
use faircurve::{CurveBatch, CurveReport, CurveStatus, Device, Result, Sampling};
use glam::{DQuat, DVec3};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::{Experiment, Outcome, Record};

const FILES: [&str; 4] = ["surfaces.txt", "surfaces.csv", "surfaces.svg", "surfaces-terrain.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "surfaces", files: &FILES, run };

const HEAD: &str =
    "Fair curves in surfaces: every vertex lies in F(x) = 0, and Newton's method moves it in its tangent plane.\n\n";

/// Vertices of closed geodesics. The coarser two take the error of h² and of h⁴ away.
const VERTICES: [usize; 3] = [128, 256, 512];

const SEED: u64 = 20_261_126;

/// A closed geodesic, its exact length, and a start near it of the parameter from 0 to 2π.
struct Closed {
    name: &'static str,
    surface: Arc<dyn Surface>,
    length: f64,
    start: Box<dyn Fn(f64) -> DVec3>,
}

fn run() -> Result<Outcome> {
    let mut record = Record::new(HEAD, ["yes", "NO"]);
    let mut csv = String::from("geodesic,vertices,length,exact,iterations\n");
    closed_geodesics(&mut record, &mut csv)?;
    open_geodesics(&mut record)?;
    rough_curves(&mut record)?;
    turned_tracks(&mut record)?;
    let ways = terrain::Ways::new()?;
    ways.compare(&mut record);
    Ok(Outcome { files: vec![record.table, csv, pictures::sheet()?, ways.sheet()?], agrees: record.agrees })
}

/// Closed geodesics with lengths to 25 digits by quadrature.
fn closed() -> Vec<Closed> {
    let ellipsoid = |axes: DVec3, flat: usize, name: &'static str, length: f64| Closed {
        name,
        surface: Arc::new(Quadric::ellipsoid(axes)),
        length,
        start: Box::new(move |s| {
            let mut x = [0.0; 3];
            x[(flat + 1) % 3] = s.cos();
            x[(flat + 2) % 3] = s.sin();
            x[flat] = 0.08 * (3.0 * s).sin() + 0.02;
            DVec3::from_array(x) * axes
        }),
    };
    let torus = |tube: f64, axis: f64, at: f64, name: &'static str, length: f64| Closed {
        name,
        surface: Arc::new(Torus::new(2.0, 1.0).expect("R > r")),
        length,
        start: Box::new(move |s| {
            // What goes round the axis twice stays long near the inner equator.
            let linger = if axis > tube && tube > 0.0 { 0.9 } else { 0.05 };
            let (u, v) = (tube * s + at + linger * s.sin(), axis * s + 0.05 * (3.0 * s).cos());
            let out = 2.0 + u.cos();
            DVec3::new(out * v.cos(), out * v.sin(), u.sin())
        }),
    };
    vec![
        ellipsoid(DVec3::new(3.0, 2.0, 1.0), 2, "ellipsoid 3, 2, 1, the longest ellipse", 15.865439589290589),
        ellipsoid(DVec3::new(3.0, 2.0, 1.0), 0, "ellipsoid 3, 2, 1, the shortest ellipse", 9.688448220547676),
        ellipsoid(DVec3::new(1.3, 1.1, 1.0), 1, "ellipsoid 1.3, 1.1, 1, the ellipse between", 7.256428893994931),
        torus(0.0, 1.0, PI, "torus 2, 1, inner equator, not stable", TAU),
        torus(0.0, 1.0, 0.0, "torus 2, 1, outer equator", 6.0 * PI),
        torus(1.0, 1.0, 0.0, "torus 2, 1, once round both ways", 10.95195137163083),
        torus(2.0, 1.0, 0.0, "torus 2, 1, twice round the tube", 15.879978852697503),
        torus(1.0, 2.0, 0.0, "torus 2, 1, twice round the axis", 17.22866745539088),
    ]
}

/// A closed geodesic of so many vertices.
fn descend(
    surface: &Arc<dyn Surface>,
    start: &dyn Fn(f64) -> DVec3,
    count: usize,
) -> Result<(Vec<DVec3>, CurveReport)> {
    let place = |k: usize| {
        let near = start(TAU * k as f64 / count as f64);
        surface.closest(near).unwrap_or(near).to_array()
    };
    let points: Vec<[f64; 3]> = (0..count).map(place).collect();
    let batch = CurveBatch::from_slices(&[&points[..]])?.closed_each(vec![true])?;
    let fair = Fair {
        energy: geodesic_bending(2.0),
        surface: Some(surface.clone()),
        segments: Segments::PerSpan(1),
        pins: Pins::None,
        ..Fair::default()
    };
    let (fit, vertices) = fair.fit_sampled(&batch, Sampling::PerSpan(1), &Device::cpu())?;
    Ok((vertices.points(0).chunks_exact(3).map(DVec3::from_slice).collect(), fit.reports()[0].clone()))
}

fn length_of(vertices: &[DVec3]) -> f64 {
    (0..vertices.len()).map(|k| vertices[k].distance(vertices[(k + 1) % vertices.len()])).sum()
}

fn closed_geodesics(record: &mut Record, csv: &mut String) -> Result<()> {
    record.line("Closed geodesics, from starts that wobble: geodesic bending without a pinned point.");
    record.line(format_args!(
        "{:<46}{:>14}{:>12}{:>12}{:>12}",
        "geodesic", "exact length", "(L−L∞)n²/L", "error", "iterations"
    ));
    let mut worst: f64 = 0.0;
    for Closed { name, surface, length, start } in closed() {
        let (mut lengths, mut iterations) = ([0.0; 3], 0);
        for (own, count) in lengths.iter_mut().zip(VERTICES) {
            let (vertices, report) = descend(&surface, &*start, count)?;
            *own = if report.status == CurveStatus::Converged { length_of(&vertices) } else { f64::NAN };
            iterations = report.iterations;
            let _ = writeln!(csv, "\"{name}\",{count},{own},{length},{iterations}");
        }
        let extrapolated = (64.0 * lengths[2] - 20.0 * lengths[1] + lengths[0]) / 45.0;
        let error = (extrapolated / length - 1.0).abs();
        let order = (lengths[2] / length - 1.0) * (VERTICES[2] as f64).powi(2);
        record.line(format_args!("{name:<46}{length:>14.9}{order:>12.3}{error:>12.1e}{iterations:>12}"));
        worst = worst.max(if error.is_nan() { f64::INFINITY } else { error });
    }
    record.check("every length, extrapolated, is exact to 1e-7", worst < 1e-7);
    record.line("");
    Ok(())
}

fn open_geodesics(record: &mut Record) -> Result<()> {
    record.line("Geodesics of the ellipsoid of WGS84 between two points, 64 edges: length against the exact one.");
    let pairs = [
        ([0.0, -17.283910198178476], [64.1108957457017, 54.559607275915054], 9992612.219302055),
        ([0.0, -58.61067317249115], [26.529546092866386, 44.23220270432588], 11658694.790226322),
    ];
    for (from, to, exact) in pairs {
        let points = [from, to];
        let fair = Fair {
            energy: geodesic_bending(2.0),
            surface: Some(Arc::new(Globe::WGS84)),
            segments: Segments::PerSpan(64),
            ..Fair::default()
        };
        let fit = fair.fit(&CurveBatch::from_slices(&[&points[..]])?, &Device::cpu())?;
        let found = fit.curve(0).length();
        record.line(format_args!(
            "{:>14.3} m, off by {:.1e} of it after {} iterations",
            exact,
            found / exact - 1.0,
            fit.reports()[0].iterations
        ));
        record.check("the length is exact to 1e-7", (found / exact - 1.0).abs() < 1e-7);
    }
    record.line("");
    Ok(())
}

/// Points of steps of so many degrees on the unit sphere, that turn by σ radians at each.
fn rough(step: f64, sigma: f64, random: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let any = |random: &mut ChaCha8Rng| DVec3::from_array([(); 3].map(|()| random.random_range(-1.0..1.0)));
    let mut at = any(random).normalize();
    let mut ahead = at.any_orthonormal_vector();
    let mut points = vec![at.to_array()];
    for _ in 1..5 {
        // Twelve uniform numbers less 6 have a standard deviation of 1.
        let turn = sigma * ((0..12).map(|_| random.random_range(0.0..1.0)).sum::<f64>() - 6.0);
        ahead = turn.cos() * ahead + turn.sin() * at.cross(ahead);
        let (sin, cos) = f64::to_radians(step).sin_cos();
        (at, ahead) = (cos * at + sin * ahead, cos * ahead - sin * at);
        points.push(at.to_array());
    }
    points
}

fn rough_curves(record: &mut Record) -> Result<()> {
    record.line("200 curves through 5 points of the sphere, 16 edges a span: iterations, at the median and at most.");
    record.line(format_args!("{:<28}{:>16}{:>16}{:>16}", "geodesic bending +", "steps of 5°", "30°", "60°"));
    let mut converged = 0;
    for (weight, sigma) in [(0.1, 0.2), (0.1, 0.6), (1.0, 0.2), (1.0, 0.6)] {
        let mut cells = String::new();
        for step in [5.0, 30.0, 60.0] {
            let mut random = ChaCha8Rng::seed_from_u64(SEED);
            let curves: Vec<Vec<[f64; 3]>> = (0..200).map(|_| rough(step, sigma, &mut random)).collect();
            let slices: Vec<&[[f64; 3]]> = curves.iter().map(|points| &points[..]).collect();
            let energy = geodesic_bending(2.0) + weight / f64::to_radians(step).powi(2) * length();
            let fair = Fair { energy, surface: Some(Arc::new(Quadric::sphere(1.0))), ..Fair::default() };
            let fit = fair.fit(&CurveBatch::from_slices(&slices)?, &Device::cpu())?;
            let mut found: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
            found.sort_unstable();
            converged += fit.usable();
            let _ = write!(cells, "{:>16}", format!("{}, {}", found[100], found[199]));
        }
        record.line(format_args!("{:<28}{cells}", format!("{weight} length, σ {sigma}")));
    }
    record.check("all of 2,400 curves converge", converged == 2_400);
    record.line("");
    Ok(())
}

/// A track of longitudes and latitudes.
const TRACK: [[f64; 2]; 6] = [[-12.0, 2.0], [-6.0, 9.0], [1.0, 7.0], [6.0, -1.0], [13.0, -2.0], [18.0, 6.0]];

/// The globe turned so that the middle of the track lies at a place.
fn turn_to(longitude: f64, latitude: f64) -> DQuat {
    let globe = unit();
    let [from, to] = [globe.place(2.0, 4.0), globe.place(longitude, latitude)];
    DQuat::from_rotation_arc(from, to)
}

fn unit() -> Globe {
    Globe { equatorial: 1.0, polar: 1.0 }
}

/// Longitudes go on past the date line.
fn turned(points: &[[f64; 2]], turn: DQuat) -> Vec<[f64; 2]> {
    let mut before = None;
    let one = |[longitude, latitude]: &[f64; 2]| {
        let [own, latitude] = unit().angles(turn * unit().place(*longitude, *latitude));
        let turns: f64 = before.map_or(0.0, |before: f64| ((before - own) / 360.0).round());
        let longitude = own + 360.0 * turns;
        before = Some(longitude);
        [longitude, latitude]
    };
    points.iter().map(one).collect()
}

/// The hours of the track.
const HOURS: [f64; 6] = [0.0, 6.0, 12.0, 18.0, 30.0, 36.0];

/// The natural spline of a track over its hours, on the globe or on the flat sheet, as places on the globe.
fn timed(points: &[[f64; 2]], on_globe: bool) -> Result<Vec<DVec3>> {
    let batch = CurveBatch::from_slices(&[points])?.with_parameters(HOURS.to_vec())?;
    let (sampling, device) = (Sampling::PerSpan(16), Device::cpu());
    let (_, samples) = match on_globe {
        true => SurfaceSpline::new(Arc::new(unit())).fit_sampled(&batch, sampling, &device)?,
        false => Natural::default().fit_sampled(&batch, sampling, &device)?,
    };
    Ok(samples.points(0).chunks_exact(2).map(|p| unit().place(p[0], p[1])).collect())
}

/// The curve of a track, on the globe or on the flat sheet of longitudes and latitudes, as places on the globe.
fn curve(points: &[[f64; 2]], on_globe: bool) -> Result<Vec<DVec3>> {
    let surface: Option<Arc<dyn Surface>> = if on_globe { Some(Arc::new(unit())) } else { None };
    let bends = if on_globe { geodesic_bending(2.0) } else { bending(2.0) };
    let fair = Fair { energy: bends + tautness(), surface, ..Fair::default() };
    let batch = CurveBatch::from_slices(&[points])?;
    let (_, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(16), &Device::cpu())?;
    Ok(samples.points(0).chunks_exact(2).map(|p| unit().place(p[0], p[1])).collect())
}

/// The curve of a track, on the globe or not.
type Way = fn(&[[f64; 2]], bool) -> Result<Vec<DVec3>>;

fn turned_tracks(record: &mut Record) -> Result<()> {
    record.line("A track turned with the globe, against the turned track, in degrees of arc.");
    record.line(format_args!(
        "{:<28}{:>16}{:>16}{:>16}{:>16}",
        "its middle is moved to", "on the globe", "on a flat sheet", "in time: globe", "flat sheet"
    ));
    let places = [("latitude 60°", 0.0, 60.0), ("the north pole", 0.0, 90.0), ("the date line", 180.0, 4.0)];
    let mut worst: f64 = 0.0;
    for (name, longitude, latitude) in places {
        let turn = turn_to(longitude, latitude);
        let mut found = [0.0; 4];
        let ways: [(Way, bool); 4] = [(curve, true), (curve, false), (timed, true), (timed, false)];
        for (away, (of, on_globe)) in found.iter_mut().zip(ways) {
            let (own, there) = (of(&TRACK, on_globe)?, of(&turned(&TRACK, turn), on_globe)?);
            let apart = own.iter().zip(&there).map(|(a, b)| (0.5 * (turn * *a).distance(*b)).asin());
            *away = 2.0 * apart.fold(0.0, f64::max).to_degrees();
        }
        worst = worst.max(found[0]).max(found[2]);
        let [globe, flat, timed, timed_flat] = found;
        record.line(format_args!("{name:<28}{globe:>16.1e}{flat:>16.1e}{timed:>16.1e}{timed_flat:>16.1e}"));
    }
    record.check("on the globe it is the same to 1e-9 degrees", worst < 1e-9);
    record.line("");
    Ok(())
}
