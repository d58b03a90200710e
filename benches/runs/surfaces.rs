//! What a fair curve in a surface costs beside the same curve in space and in the plane: 10,000 tracks of 5 points on the sphere,
//! steps of 5°, turns of σ 0.2, 64 edges, on the CPU. Prints the time a curve, that of one iteration alone, and that of every
//! further one.
//!
//! usage: `surfaces [RUNS]`: the best of so many runs, 15 if not said

use std::sync::Arc;
use std::time::Instant;

use faircurve::discrete::{Energy, Fair, bending, geodesic_bending, length};
use faircurve::surface::{Quadric, Surface};
use faircurve::{CurveBatch, Device, Result};
use glam::DVec3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

const SEED: u64 = 1;
const CURVES: usize = 10_000;
const POINTS: usize = 5;
const STEP: f64 = 5.0;
const SIGMA: f64 = 0.2;

/// Nearly a normal number: the sum of twelve even ones.
fn normal(rng: &mut StdRng) -> f64 {
    (0..12).map(|_| rng.random_range(-0.5..0.5)).sum()
}

/// Tracks on the sphere, and those of the same turns in the plane.
fn tracks() -> Result<(CurveBatch, CurveBatch)> {
    let mut rng = StdRng::seed_from_u64(SEED);
    let step = STEP.to_radians();
    let (mut coords, mut flat) = (Vec::new(), Vec::new());
    for _ in 0..CURVES {
        let mut at = DVec3::from_array([(); 3].map(|()| normal(&mut rng))).normalize();
        let mut ahead = at.any_orthonormal_vector();
        let (mut place, mut angle) = ([0.0, 0.0], 0.0f64);
        for _ in 0..POINTS {
            coords.extend(at.to_array());
            flat.extend(place);
            let turn = SIGMA * normal(&mut rng);
            ahead = turn.cos() * ahead + turn.sin() * at.cross(ahead);
            (at, ahead) = (step.cos() * at + step.sin() * ahead, step.cos() * ahead - step.sin() * at);
            angle += turn;
            place = [place[0] + step * angle.cos(), place[1] + step * angle.sin()];
        }
    }
    let offsets: Vec<usize> = (0..=CURVES).map(|i| POINTS * i).collect();
    Ok((CurveBatch::from_ragged(3, coords, offsets.clone())?, CurveBatch::from_ragged(2, flat, offsets)?))
}

/// Microseconds a curve, and iterations in the mean.
fn time(fair: &Fair, batch: &CurveBatch, runs: usize) -> Result<(f64, f64)> {
    let (mut best, mut iterations) = (f64::INFINITY, 0.0);
    for _ in 0..runs {
        let start = Instant::now();
        let fit = fair.fit(batch, &Device::cpu())?;
        best = best.min(start.elapsed().as_secs_f64());
        iterations = fit.reports().iter().map(|report| f64::from(report.iterations)).sum::<f64>() / CURVES as f64;
    }
    Ok((best / CURVES as f64 * 1e6, iterations))
}

fn main() -> Result<()> {
    let runs = std::env::args().nth(1).and_then(|runs| runs.parse().ok()).unwrap_or(15);
    let (tracks, flat) = tracks()?;
    let taut = |energy: Energy| energy + 0.1 / STEP.to_radians().powi(2) * length();
    // Not named a sphere, whose points would be longitudes and latitudes.
    let surface = || Some(Arc::new(Quadric::ellipsoid(DVec3::ONE)) as Arc<dyn Surface>);
    let kinds = [
        ("in the sphere, geodesic bending", geodesic_bending(2.0), surface(), &tracks),
        ("in the sphere, bending", bending(2.0), surface(), &tracks),
        ("in space", bending(2.0), None, &tracks),
        ("in the plane", bending(2.0), None, &flat),
    ];
    for (what, energy, surface, batch) in kinds {
        let fair = Fair { energy: taut(energy), surface, ..Fair::default() };
        let (whole, iterations) = time(&fair, batch, runs)?;
        let (one, _) = time(&Fair { max_iterations: 1, ..fair }, batch, runs)?;
        let further = (whole - one) / (iterations - 1.0);
        println!(
            "{what}: {whole:.1} µs a curve, {iterations:.2} iterations; one alone {one:.1} µs, each further {further:.1} µs"
        );
    }
    Ok(())
}
