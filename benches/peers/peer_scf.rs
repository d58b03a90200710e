//! faircurve's side of the case of smooth connection functions in `benches/peers/compare.sh`: times
//! segments with derivatives, and fits of curves of 10 points, on the CPU, and prints one JSON line
//! each in the form that `benches/peers/README.md` lays down. Writes the costs, for the peer to
//! compare with its own.
//!
//! usage: `peer_scf [--runs 7]`, in the repository, after `scf.py --write-input`

use std::error::Error;
use std::hint::black_box;

use faircurve::scf::{Query, Smooth, evaluate_segments};
use faircurve::{CurveStatus, Device, io};
use serde_json::json;

#[path = "../common/npz.rs"]
mod npz;
#[path = "../common/peer.rs"]
mod peer;

use peer::{line, times};

fn main() -> Result<(), Box<dyn Error>> {
    let runs = peer::runs()?;
    let device = Device::cpu();

    let array = |name: &str| npz::array("benches/data/scf-segments.npz", name).map(|(_, values)| values);
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

    let costs = reports.iter().map(|report| report.energy).collect();
    npz::write("benches/data/scf-faircurve.npz", &[("cost", vec![reports.len()], costs)])
}

/// The cases' names, as in `scf.py`.
const SEGMENTS: &str = "scf segments, nu 2";
const CURVES: &str = "scf 10000x10x2, nu 2";
