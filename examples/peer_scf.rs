//! faircurve's side of the case of smooth connection functions in `benches/peers/compare.sh`: times segments with derivatives, and
//! fits of curves of 10 points, on the CPU, and prints one JSON line each in the form that `benches/peers/README.md` lays down.
//! Writes the costs, for the peer to compare with its own.
//!
//! usage: `peer_scf [--runs 7]`, in the repository, after `scf.py --write-input`

use std::error::Error;
use std::fs::File;
use std::hint::black_box;
use std::time::Instant;

use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::{CurveStatus, Device, io};
use npyz::npz::{NpzArchive, NpzWriter};
use npyz::{DType, TypeStr, WriterBuilder};
use serde_json::{Value, json};

/// The load average of the last minute, where the system tells.
fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

/// Microseconds an item of `count`, sorted; one run comes before those that count.
fn times(
    runs: usize,
    count: usize,
    mut work: impl FnMut() -> Result<(), Box<dyn Error>>,
) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut times = Vec::with_capacity(runs);
    for run in 0..=runs {
        let start = Instant::now();
        work()?;
        if run > 0 {
            times.push(1e6 * start.elapsed().as_secs_f64() / count as f64);
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}

fn line(case: &str, times: &[f64], curves: usize, points: usize) -> Value {
    let runs = times.len();
    json!({
        "case": case,
        "peer": "faircurve",
        "versions": {"faircurve": env!("CARGO_PKG_VERSION")},
        "threads": rayon::current_num_threads(),
        "curves": curves,
        "points": points,
        // The mean of the middle two where their number is even, as Python's statistics.median.
        "us_per_curve": (times[(runs - 1) / 2] + times[runs / 2]) / 2.0,
        "timed_curves": curves,
        "runs": runs,
        "spread": [times[0], times[runs - 1]],
        "load": load(),
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => 7,
        ["--runs", number] => number.parse().ok().filter(|&runs: &usize| runs > 0).ok_or("--runs wants 1 or more")?,
        _ => return Err("usage: peer_scf [--runs N]".into()),
    };
    let device = Device::cpu();

    let mut archive = NpzArchive::open("benches/data/scf-segments.npz")?;
    let mut array = |name: &str| -> Result<Vec<f64>, Box<dyn Error>> {
        Ok(archive.by_name(name)?.ok_or_else(|| format!("no array {name}"))?.into_vec()?)
    };
    let (start, end) = (array("start")?, array("end")?);
    let query = |(&a, &b): (&f64, &f64)| Query { chord: 1.0, angles: [a, b], exponent: 2.0 };
    // The peer times a few thousand; these are too few to time here.
    let few: Vec<Query> = start.iter().zip(&end).map(query).collect();
    let queries: Vec<Query> = few.iter().copied().cycle().take(1_000_000.max(few.len())).collect();
    let segments = times(runs, queries.len(), || {
        black_box(evaluate_segments(&queries, &device)?);
        Ok(())
    })?;
    println!("{}", line(SEGMENTS, &segments, queries.len(), 2 * queries.len()));

    let batch = io::read("benches/data/scf-points.npz")?;
    let smooth = Smooth::default();
    let fits = times(runs, batch.len(), || {
        black_box(smooth.fit(&batch, &device)?);
        Ok(())
    })?;
    let fit = smooth.fit(&batch, &device)?;
    let reports = fit.reports();
    let converged = reports.iter().filter(|report| report.status == CurveStatus::Converged).count();
    let mut iterations: Vec<u32> = reports.iter().map(|report| report.iterations).collect();
    iterations.sort_unstable();
    let mut curves = line(CURVES, &fits, batch.len(), batch.total_points());
    curves["converged"] = json!(converged);
    curves["iterations"] = json!([iterations[iterations.len() / 2], iterations[iterations.len() - 1]]);
    println!("{curves}");

    let mut out = NpzWriter::new(File::create("benches/data/scf-faircurve.npz")?);
    let kind: TypeStr = "<f8".parse()?;
    let costs = out.array("cost", Default::default())?;
    let mut costs = costs.dtype(DType::Plain(kind)).shape(&[reports.len() as u64]).begin_nd()?;
    costs.extend(reports.iter().map(|report| report.energy))?;
    costs.finish()?;
    Ok(())
}

/// The cases' names, as in `scf.py`.
const SEGMENTS: &str = "scf segments, nu 2";
const CURVES: &str = "scf 10000x10x2, nu 2";
