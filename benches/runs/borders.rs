//! Borders as cubic Béziers: how many pieces, how near the curve, how many bytes.
//!
//! ```sh
//! cargo run --release --example borders              # the table
//! cargo run --release --example borders -- drawings  # and the SVGs, into a folder that exists
//! ```
//!
//! Each curve is drawn twice: as Béziers within a tenth of a pixel of a drawing 2,000 pixels wide,
//! and as a polyline of 16 segments a span.

#[path = "../../tests/common/distance.rs"]
mod distance;

use std::path::Path;

use faircurve::io::{self, WriteOptions};
use faircurve::{
    CurveBatch, Device, Fit, Result, Sampling,
    discrete::{Fair, bending, length},
    scf::Smooth,
    spline::Natural,
};
use rayon::prelude::*;

/// Of the larger side.
const TOLERANCE: f64 = 0.1 / 2000.0;

fn main() -> Result<()> {
    let folder = std::env::args().nth(1);
    let scratch = tempfile::tempdir().expect("a folder for the drawings");
    let place = folder.as_deref().map_or(scratch.path(), Path::new);
    println!(
        "{:8} {:8} {:>8} {:>8} {:>10} {:>12} {:>12} {:>12}",
        "borders", "method", "spans", "pieces", "deviation", "SVG Béziers", "exact", "polylines"
    );
    for (name, file) in [("110m", "countries-110m.geojson"), ("50m", "countries-50m.geojson.gz")] {
        let batch = io::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data").join(file))?;
        let tolerance = TOLERANCE * size(&batch);
        let cpu = Device::cpu();
        let fits = [
            ("natural", Natural::default().fit(&batch, &cpu)?),
            // Bending alone has no minimum on borders as rough as these.
            ("fair", Fair { energy: bending(2.0) + length(), ..Fair::default() }.fit(&batch, &cpu)?),
            ("scf", Smooth::default().fit(&batch, &cpu)?),
        ];
        for (method, fit) in fits {
            // A hundredth is left to the rounding of the SVG's numbers.
            let beziers = fit.beziers(0.99 * tolerance);
            let write = |kind: &str, batch: &CurveBatch, beziers: bool, rounding: Option<f64>| -> Result<u64> {
                let path = place.join(format!("{name}-{method}-{kind}.svg"));
                io::write_with(
                    &path,
                    batch,
                    &WriteOptions { beziers, rounding, overwrite: true, ..WriteOptions::default() },
                )?;
                Ok(std::fs::metadata(path).map_or(0, |file| file.len()))
            };
            let bytes = [
                write("beziers", &beziers, true, Some(0.01 * tolerance))?,
                write("exact", &beziers, true, None)?,
                write("polylines", &fit.polylines(Sampling::PerSpan(16)), false, None)?,
            ];
            let (spans, pieces, deviation) = measure(&fit, tolerance);
            println!(
                "{name:8} {method:8} {spans:8} {pieces:8} {:>9.3}T {:12} {:12} {:12}",
                deviation / tolerance,
                bytes[0],
                bytes[1],
                bytes[2]
            );
        }
    }
    println!("T = {TOLERANCE} of the size; deviations up to 0.8 T are not told apart.");
    Ok(())
}

/// Spans and pieces of the fitted curves, and the largest distance between curves and pieces, both
/// ways. (of every tenth curve where there are thousands).
fn measure(fit: &Fit, tolerance: f64) -> (usize, usize, f64) {
    let every = if fit.len() > 1000 { 10 } else { 1 };
    let one = |i: usize| {
        let curve = fit.curve(i);
        if !curve.is_fitted() {
            return (0, 0, 0.0);
        }
        let pieces = curve.beziers(0.99 * tolerance);
        let deviation =
            if i.is_multiple_of(every) { distance::deviation(&*curve, &pieces, 24, 0.8 * tolerance) } else { 0.0 };
        (curve.spans(), pieces.len(), deviation)
    };
    let add = |a: (usize, usize, f64), b: (usize, usize, f64)| (a.0 + b.0, a.1 + b.1, a.2.max(b.2));
    (0..fit.len()).into_par_iter().map(one).reduce(|| (0, 0, 0.0), add)
}

/// The larger side of all points.
fn size(batch: &CurveBatch) -> f64 {
    let side = |axis: usize| {
        let values = batch.coords().iter().skip(axis).step_by(batch.dimension());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
        high - low
    };
    side(0).max(side(1))
}
