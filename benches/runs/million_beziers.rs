//! A million Bézier curves, cubics to decics with unknown control points, completed in one call on
//! the CPU and on the GPU.
//!
//!     cargo run --release --example million_beziers [CURVES]
//!
//! Prints times, and how far the GPU's points (in units of half the curve's largest extent) and
//! energies (in units of themselves) are from the CPU's.

use std::time::Instant;

use faircurve::bezier::{Energy, Given, Polygons, Solved, complete};
use faircurve::{Device, Precision};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Different patterns of known points.
const PATTERNS: usize = 64;

fn main() -> faircurve::Result<()> {
    let curves = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1_000_000);
    let mut random = StdRng::seed_from_u64(6);
    let patterns: Vec<Vec<bool>> = (0..PATTERNS).map(|slot| pattern(3 + slot % 8, &mut random)).collect();
    let known: Vec<bool> = (0..curves).flat_map(|i| patterns[i % PATTERNS].iter().copied()).collect();
    let mut offsets = vec![0];
    (0..curves).for_each(|i| offsets.push(offsets[i] + patterns[i % PATTERNS].len()));
    let coords: Vec<f64> = (0..2 * known.len()).map(|_| random.random_range(-1.0..1.0)).collect();
    let polygons = Polygons { dimension: 2, coords: &coords, offsets: &offsets };
    let given = Given { known: Some(&known), ..Given::default() };
    let run = |device: &Device| -> faircurve::Result<Solved> {
        let start = Instant::now();
        let solved = complete(&polygons, &given, &Energy::bending(), device)?;
        println!(
            "{}, {}: {curves} curves in {:.3} s",
            device.name(),
            device.precision().word(),
            start.elapsed().as_secs_f64()
        );
        Ok(solved)
    };
    let wanted = run(&Device::cpu())?;
    let gpu = Device::gpu(0)?;
    let has_f64 = gpu.as_gpu().is_some_and(|gpu| gpu.summary().has_f64);
    for precision in [Precision::F32, Precision::F64].into_iter().take(if has_f64 { 2 } else { 1 }) {
        let device = gpu.clone().with_precision(precision);
        // The first call compiles the kernel.
        let few = Polygons { coords: &coords[..2 * offsets[1]], offsets: &offsets[..2], ..polygons };
        complete(&few, &Given { known: Some(&known[..offsets[1]]), ..given }, &Energy::bending(), &device)?;
        let found = run(&device)?;
        let apart = |i: usize| {
            let own = 2 * offsets[i]..2 * offsets[i + 1];
            let (a, b) = (&found.coords[own.clone()], &wanted.coords[own]);
            let largest = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            largest / half_extent(b)
        };
        let points = (0..curves).map(apart).fold(0.0, f64::max);
        let energies = found.energies.iter().zip(&wanted.energies).map(|(a, b)| (a - b).abs() / b.max(1e-9));
        println!("  points differ by {points:.1e} at most, energies by {:.1e}", energies.fold(0.0, f64::max));
    }
    Ok(())
}

/// Two known points at least.
fn pattern(degree: usize, random: &mut StdRng) -> Vec<bool> {
    loop {
        let known: Vec<bool> = (0..=degree).map(|_| random.random_bool(0.5)).collect();
        if known.iter().filter(|known| **known).count() >= 2 {
            return known;
        }
    }
}

fn half_extent(points: &[f64]) -> f64 {
    let axis = |c: usize| points.iter().skip(c).step_by(2).copied();
    let of = |c: usize| axis(c).fold(f64::NEG_INFINITY, f64::max) - axis(c).fold(f64::INFINITY, f64::min);
    0.5 * of(0).max(of(1))
}
