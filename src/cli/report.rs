//! The report: a JSON file with one line a curve.

use std::io::{self, Write};

use faircurve::{CurveBatch, CurveReport, Device, Fit};
use rayon::prelude::*;
use serde::Serialize;

use super::device::{self, Description};
use super::progress::Progress;

/// Curves are measured this many at a time.
const CHUNK: usize = 4096;

/// What concerns the whole run.
#[derive(Debug, Serialize)]
pub struct Head {
    pub faircurve: &'static str,
    pub method: &'static str,
    pub device: Description,
    pub precision: &'static str,
}

impl Head {
    /// Of a run of this method on this device; `work` is what its result says of the device that did the work.
    pub fn of(method: &'static str, device: &Device, work: &str) -> Self {
        Head {
            faircurve: env!("CARGO_PKG_VERSION"),
            method,
            device: device::describe(device),
            precision: device::precision_word(work),
        }
    }
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub fit: f64,
    pub write: f64,
}

#[derive(Debug, Serialize)]
struct Totals {
    curves: usize,
    usable: usize,
    seconds: Seconds,
}

/// One curve. Numbers that are not finite become null.
#[derive(Debug, Serialize)]
struct Line<'a> {
    curve: &'a str,
    status: &'static str,
    points_in: usize,
    points_out: usize,
    energy: f64,
    length: f64,
    iterations: u32,
    gradient_norm: f64,
    max_curvature: f64,
    max_deviation: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    smoothing: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<&'a str>,
}

/// Writes the report; lengths and curvatures are measured here, in parallel.
pub fn write(
    out: &mut dyn Write,
    head: &Head,
    batch: &CurveBatch,
    fit: &Fit,
    points_out: &[usize],
    seconds: Seconds,
    progress: &Progress,
) -> io::Result<()> {
    // The head is an object: its closing brace makes room for the curves and the totals.
    let head = serde_json::to_string(head)?;
    write!(out, "{},\n\"curves\":[", head.strip_suffix('}').unwrap_or(&head))?;
    for start in (0..fit.len()).step_by(CHUNK) {
        let end = fit.len().min(start + CHUNK);
        let lines: Vec<String> =
            (start..end).into_par_iter().map(|i| line(batch, fit, i, points_out[i])).collect::<Result<_, _>>()?;
        for (i, line) in (start..end).zip(lines) {
            let separator = if i == 0 { "\n" } else { ",\n" };
            write!(out, "{separator}{line}")?;
        }
        progress.advance(end - start);
    }
    let totals = Totals { curves: fit.len(), usable: fit.usable(), seconds };
    writeln!(out, "\n],\n\"totals\":{}}}", serde_json::to_string(&totals)?)
}

fn line(batch: &CurveBatch, fit: &Fit, i: usize, points_out: usize) -> serde_json::Result<String> {
    let curve = fit.curve(i);
    let CurveReport { status, message, energy, iterations, gradient_norm, smoothing, max_deviation } =
        &fit.reports()[i];
    serde_json::to_string(&Line {
        curve: &batch.name(i),
        status: status.word(),
        points_in: batch.count(i),
        points_out,
        energy: *energy,
        length: curve.length(),
        iterations: *iterations,
        gradient_norm: *gradient_norm,
        max_curvature: curve.max_curvature(),
        max_deviation: *max_deviation,
        smoothing: *smoothing,
        message: message.as_deref(),
    })
}
