//! faircurve's side of the case of fair curves in `benches/peers/compare.sh`: times fits of least bending on the CPU and prints
//! one JSON line in the form that `benches/peers/README.md` lays down. Writes where the fits start, for the peers to start
//! there too, and where they end, for the peers to compute all energies by one function.
//!
//! usage: `peer_fair [--runs 7]`, in the repository, after `fair.py --write-points`

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::{CurveStatus, Device, Sampling, io};
use serde_json::json;

/// Segments a span; as in `fair.py`.
const SEGMENTS: usize = 16;

/// The load average of the last minute, where the system tells.
fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => 7,
        ["--runs", number] => number.parse().ok().filter(|&runs: &usize| runs > 0).ok_or("--runs wants 1 or more")?,
        _ => return Err("usage: peer_fair [--runs N]".into()),
    };
    let batch = io::read("benches/data/fair-points.npz")?;
    let device = Device::cpu();
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(SEGMENTS), ..Fair::default() };

    let start = Fair { max_iterations: 0, ..fair.clone() }.fit(&batch, &device)?;
    io::write("benches/data/fair-start.npz", &start.polylines(Sampling::PerSpan(SEGMENTS)))?;

    // One run comes before those that count.
    let mut times = Vec::with_capacity(runs);
    for run in 0..=runs {
        let start = Instant::now();
        black_box(fair.fit(&batch, &device)?);
        if run > 0 {
            times.push(1e6 * start.elapsed().as_secs_f64() / batch.len() as f64);
        }
    }
    times.sort_by(f64::total_cmp);

    let fit = fair.fit(&batch, &device)?;
    io::write("benches/data/fair-faircurve.npz", &fit.polylines(Sampling::PerSpan(SEGMENTS)))?;
    let converged = fit.reports().iter().filter(|report| report.status == CurveStatus::Converged).count();
    let mut iterations: Vec<u32> = fit.reports().iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let line = json!({
        "case": "fair 10000x5x2, 16 a span",
        "peer": "faircurve",
        "versions": {"faircurve": env!("CARGO_PKG_VERSION")},
        "threads": rayon::current_num_threads(),
        "curves": batch.len(),
        "points": batch.total_points(),
        // The mean of the middle two where their number is even, as Python's statistics.median.
        "us_per_curve": (times[(runs - 1) / 2] + times[runs / 2]) / 2.0,
        "timed_curves": batch.len(),
        "runs": runs,
        "spread": [times[0], times[runs - 1]],
        "load": load(),
        "converged": converged,
        "iterations": [iterations[iterations.len() / 2], iterations[iterations.len() - 1]],
    });
    println!("{line}");
    Ok(())
}
