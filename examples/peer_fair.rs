//! faircurve's side of the case of fair curves in `benches/peers/compare.sh`: times fits of least
//! bending on the CPU and prints one JSON line in the form that `benches/peers/README.md` lays
//! down. Writes where the fits start, for the peers to start there too, and where they end, for the
//! peers to compute all energies by one function.
//!
//! usage: `peer_fair [--runs 7]`, in the repository, after `fair.py --write-points`

use std::error::Error;
use std::hint::black_box;

use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::{CurveStatus, Device, Sampling, io};
use serde_json::json;

#[path = "../benches/common/peer.rs"]
mod peer;

use peer::{line, times};

/// Segments a span; as in `fair.py`.
const SEGMENTS: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let runs = peer::runs()?;
    let batch = io::read("benches/data/fair-points.npz")?;
    let device = Device::cpu();
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(SEGMENTS), ..Fair::default() };

    let start = Fair { max_iterations: 0, ..fair.clone() }.fit(&batch, &device)?;
    io::write("benches/data/fair-start.npz", &start.polylines(Sampling::PerSpan(SEGMENTS)))?;

    let times = times(runs, batch.len(), || {
        black_box(fair.fit(&batch, &device)?);
        Ok(())
    })?;

    let fit = fair.fit(&batch, &device)?;
    io::write("benches/data/fair-faircurve.npz", &fit.polylines(Sampling::PerSpan(SEGMENTS)))?;
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
    let mut iterations: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let mut line = line("fair 10000x5x2, 16 a span", &times, batch.len(), batch.total_points());
    line["converged"] = json!(converged);
    line["iterations"] = json!([iterations[iterations.len() / 2], iterations[iterations.len() - 1]]);
    println!("{line}");
    Ok(())
}
