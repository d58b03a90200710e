//! faircurve's side of `benches/peers/compare.sh`: times natural splines, fitted and sampled, on the CPU, and prints
//! one JSON line a case in the form that `benches/peers/README.md` lays down.
//!
//! usage: `peer_natural [--runs 7]`, in the repository, after `benches/data.sh hanzi` and `natural.py --write-random`

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use faircurve::{CurveBatch, Device, Sampling, io, spline::Natural};
use serde_json::json;

/// Name of the case, its file, and how each curve is sampled; names as in `natural.py`.
const CASES: [(&str, &str, Sampling); 2] = [
    ("random 20000x10x2, 80 samples", "benches/data/random.npz", Sampling::Count(80)),
    ("hanzi strokes, 8 a span", "benches/data/hanzi.npz", Sampling::PerSpan(8)),
];

/// The load average of the last minute, where the system tells.
fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

/// Microseconds a curve, fastest first. One run comes before those that count.
fn time(batch: &CurveBatch, sampling: Sampling, runs: usize) -> faircurve::Result<Vec<f64>> {
    let device = Device::cpu();
    let mut times = Vec::with_capacity(runs);
    for run in 0..=runs {
        let start = Instant::now();
        let fit = Natural::default().fit(batch, &device)?;
        black_box(fit.polylines(sampling));
        drop(black_box(fit));
        if run > 0 {
            times.push(1e6 * start.elapsed().as_secs_f64() / batch.len() as f64);
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => 7,
        ["--runs", number] => number.parse().ok().filter(|&runs: &usize| runs > 0).ok_or("--runs wants 1 or more")?,
        _ => return Err("usage: peer_natural [--runs N]".into()),
    };
    for (case, file, sampling) in CASES {
        let batch = io::read(file)?;
        let times = time(&batch, sampling, runs)?;
        // The mean of the middle two where their number is even, as Python's statistics.median.
        let median = (times[(runs - 1) / 2] + times[runs / 2]) / 2.0;
        let line = json!({
            "case": case,
            "peer": "faircurve",
            "versions": {"faircurve": env!("CARGO_PKG_VERSION")},
            "threads": rayon::current_num_threads(),
            "curves": batch.len(),
            "points": batch.total_points(),
            "us_per_curve": median,
            "timed_curves": batch.len(),
            "runs": runs,
            "spread": [times[0], times[runs - 1]],
            "load": load(),
        });
        println!("{line}");
    }
    Ok(())
}
