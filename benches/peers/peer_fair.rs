//! faircurve's side of the case of fair curves in `benches/peers/compare.sh`: times fits of least
//! bending on the CPU, or with `FAIRCURVE_DEVICE=f64` (or `f32`) on the first GPU, and prints one JSON line
//! in the form that `benches/peers/README.md` lays down. Writes where the fits start, for the peers to start there too,
//! and where they end, for the peers to compute all energies by one function. `FAIRCURVE_DATA` is the folder of these
//! files, `benches/data` if it is not set.
//!
//! usage: `peer_fair [--runs 7]`, in the repository, after `fair.py --write-points`

use std::error::Error;
use std::hint::black_box;

use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::io::{self, WriteOptions};
use faircurve::{CurveStatus, Device, Precision, Sampling};
use serde_json::json;

#[path = "../common/peer.rs"]
mod peer;

use peer::{line, times};

/// Segments a span; as in `fair.py`.
const SEGMENTS: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let runs = peer::runs()?;
    let folder = std::env::var("FAIRCURVE_DATA").unwrap_or_else(|_| "benches/data".into());
    let batch = io::read(format!("{folder}/fair-points.npz"))?;
    let device = match std::env::var("FAIRCURVE_DEVICE").ok().as_deref() {
        None | Some("cpu") => Device::cpu(),
        Some("f32") => Device::gpu(0)?.with_precision(Precision::F32),
        Some("f64") => Device::gpu(0)?.with_precision(Precision::F64),
        Some(other) => return Err(format!("FAIRCURVE_DEVICE is {other}, not cpu, f32 or f64").into()),
    };
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(SEGMENTS), ..Fair::default() };

    let start = Fair { max_iterations: 0, ..fair.clone() }.fit(&batch, &device)?;
    let replaced = WriteOptions { overwrite: true, ..WriteOptions::default() };
    io::write_with(format!("{folder}/fair-start.npz"), &start.polylines(Sampling::PerSpan(SEGMENTS)), &replaced)?;

    let times = times(runs, batch.len(), || {
        black_box(fair.fit(&batch, &device)?);
        Ok(())
    })?;

    let kernel_seconds = || device.as_gpu().map(|gpu| gpu.take_kernel_seconds());
    kernel_seconds();
    let fit = fair.fit(&batch, &device)?;
    io::write_with(format!("{folder}/fair-faircurve.npz"), &fit.polylines(Sampling::PerSpan(SEGMENTS)), &replaced)?;
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
    let mut iterations: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let mut line = line("fair 10000x5x2, 16 a span", &times, batch.len(), batch.total_points());
    line["converged"] = json!(converged);
    line["device"] = json!(fit.device().to_string());
    line["kernel_us_per_curve"] = json!(kernel_seconds().map(|seconds| 1e6 * seconds / batch.len() as f64));
    line["iterations"] = json!([iterations[iterations.len() / 2], iterations[iterations.len() - 1]]);
    println!("{line}");
    Ok(())
}
