//! `faircurve doctor`: what this machine offers, and whether it computes correctly.

use clap::Args;
use faircurve::spline::Natural;
use faircurve::{CurveBatch, Device, Precision, Result, Sampling};

use super::compare::{self, Outcome};
use super::{count, device};

#[derive(Args, Debug)]
pub struct DoctorArgs {}

pub fn run(_: &DoctorArgs) -> Result<bool> {
    println!("faircurve {} ({}, {})", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS);
    println!("CPU      {}", device::cpu_name());
    println!("         {}, {}", count(device::threads(), "thread"), device::simd());
    let sound = self_test(&Device::cpu(), "CPU")?;
    println!("GPU      none used: this version computes on the CPU only");
    Ok(sound)
}

/// Fits curves of many lengths on a device and compares them with the CPU in f64.
fn self_test(device: &Device, name: &str) -> Result<bool> {
    let batch = spirals()?;
    let natural = Natural::default();
    let reference =
        compare::fit(&batch, Sampling::PerSpan(8), &Device::cpu().with_precision(Precision::F64), |b, d| {
            natural.fit(b, d)
        })?;
    let mut sound = true;
    for precision in [Precision::F32, Precision::F64] {
        let run = compare::fit(&batch, Sampling::PerSpan(8), &device.clone().with_precision(precision), |b, d| {
            natural.fit(b, d)
        })?;
        let Outcome { worst, bound, pass, .. } = compare::judge(&batch, &reference, &run, precision);
        let result = if pass { "passed" } else { "FAILED" };
        println!(
            "         self-test {name} {}: largest difference {worst:.1e} of {bound:.0e} allowed, {result}",
            compare::word(precision)
        );
        sound &= pass;
    }
    Ok(sound)
}

/// Open and closed spirals of 3 to 200 points: every length a kernel may treat in its own way.
fn spirals() -> Result<CurveBatch> {
    let spiral = |n: usize| -> Vec<[f64; 2]> {
        let radius = |k: usize| 1.0 + 0.5 * (k as f64 * 0.7).sin();
        (0..n).map(|k| (k, (k as f64 * 0.4).sin_cos())).map(|(k, (s, c))| [radius(k) * c, radius(k) * s]).collect()
    };
    let curves: Vec<_> = (3..=200).map(spiral).collect();
    let slices: Vec<&[[f64; 2]]> = curves.iter().map(|curve| &curve[..]).collect();
    CurveBatch::from_slices(&slices)?.closed_each((0..curves.len()).map(|k| k % 2 == 1).collect())
}
