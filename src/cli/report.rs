//! The report: a JSON file with one line per curve, or per grid.

use std::io::{self, Write};

use faircurve::{CurveBatch, DeviceReport, Fit, LimitReport};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::device::Description;
use super::progress::Progress;
use super::words::with_options;

/// Lines are made in chunks of this many.
const CHUNK: usize = 1024;

/// What concerns the whole run: a run of this method, whose work this device did.
pub fn head(method: &str, device: &DeviceReport) -> Value {
    json!({
        "faircurve": env!("CARGO_PKG_VERSION"),
        "method": method,
        "device": Description::of(device),
        "precision": device.precision.word(),
    })
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub fit: f64,
    pub write: f64,
}

/// The last entry of the report.
pub fn totals(what: &str, [usable, all]: [usize; 2], seconds: Seconds) -> Value {
    json!({(format!("{what}s")): all, "usable": usable, "seconds": seconds})
}

/// Writes head, lines and totals. Lines are made here, in parallel: lengths and curvatures are
/// measured for them.
pub fn write(
    out: &mut dyn Write,
    head: &Value,
    what: &str,
    all: usize,
    line: impl Fn(usize) -> Value + Sync,
    totals: &Value,
    progress: &Progress,
) -> io::Result<()> {
    // The head is an object: its closing brace makes room for the lines and the totals.
    let head = head.to_string();
    write!(out, "{},\n\"{what}s\":[", head.strip_suffix('}').unwrap_or(&head))?;
    for start in (0..all).step_by(CHUNK) {
        let end = all.min(start + CHUNK);
        let lines: Vec<String> = (start..end).into_par_iter().map(|i| line(i).to_string()).collect();
        for (i, line) in (start..end).zip(lines) {
            let separator = if i == 0 { "\n" } else { ",\n" };
            write!(out, "{separator}{line}")?;
        }
        progress.advance(end - start);
    }
    writeln!(out, "\n],\n\"totals\":{totals}}}")
}

/// All lines, as [`write`] writes them.
pub fn lines(all: usize, line: impl Fn(usize) -> Value + Sync, progress: &Progress) -> Vec<Value> {
    let made = |i: usize| {
        let made = line(i);
        progress.advance(1);
        made
    };
    (0..all).into_par_iter().map(made).collect()
}

/// Curve `i`, of which `points_out` points were written. Numbers that are not finite become null.
pub fn line(batch: &CurveBatch, fit: &Fit, i: usize, points_out: usize, lambda_unit: f64) -> Value {
    let (curve, report) = (fit.curve(i), &fit.reports()[i]);
    let mut line = json!({
        "curve": batch.name(i),
        "status": report.status,
        "points_in": batch.count(i),
        "points_out": points_out,
        "energy": report.energy,
        "length": curve.length(),
        "iterations": report.iterations,
        "gradient_norm": report.gradient_norm,
        "max_curvature": curve.max_curvature(),
        "max_deviation": report.max_deviation,
    });
    let mut add = |name: &str, value: Option<Value>| value.into_iter().for_each(|value| line[name] = value);
    add("smoothing", report.smoothing.map(|lambda| json!(lambda / lambda_unit)));
    add("gain", report.gain.map(|gain| json!(gain)));
    add("loops", report.loops.map(|loops| json!(loops)));
    add("limits", report.limits.map(limits));
    add("message", report.message.as_ref().map(|message| json!(with_options(message))));
    line
}

/// How a curve keeps its limits.
fn limits(kept: LimitReport) -> Value {
    let LimitReport { violation, active, cost, stretch, neighbours, touching, .. } = kept;
    json!({
        "violation": violation,
        "active": active,
        "cost": cost,
        "stretch": stretch,
        "neighbours": neighbours,
        "touching": touching,
    })
}
