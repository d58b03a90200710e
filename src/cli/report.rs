//! The report: a JSON file with one line a curve, or a grid.

use std::borrow::Cow;
use std::io::{self, Write};

use faircurve::{CurveBatch, CurveReport, DeviceReport, Fit, LimitReport};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::device::Description;
use super::progress::Progress;
use super::words::with_options;

/// Lines are made this many at a time.
const CHUNK: usize = 1024;

/// What concerns the whole run.
#[derive(Debug, Serialize)]
pub struct Head {
    pub faircurve: &'static str,
    pub method: &'static str,
    pub device: Description,
    pub precision: &'static str,
}

impl Head {
    /// Of a run of this method, whose work this device did.
    pub fn of(method: &'static str, device: &DeviceReport) -> Self {
        Head {
            faircurve: env!("CARGO_PKG_VERSION"),
            method,
            device: Description::of(device),
            precision: device.precision.word(),
        }
    }
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub fit: f64,
    pub write: f64,
}

/// What is said in the end.
pub fn totals(what: &str, [usable, all]: [usize; 2], seconds: Seconds) -> Value {
    json!({(format!("{what}s")): all, "usable": usable, "seconds": seconds})
}

/// Writes head, lines and totals. Lines are made here, in parallel: lengths and curvatures are
/// measured for them.
pub fn write<L: Serialize>(
    out: &mut dyn Write,
    head: &impl Serialize,
    what: &str,
    all: usize,
    line: impl Fn(usize) -> L + Sync,
    totals: &Value,
    progress: &Progress,
) -> io::Result<()> {
    // The head is an object: its closing brace makes room for the lines and the totals.
    let head = serde_json::to_string(head)?;
    write!(out, "{},\n\"{what}s\":[", head.strip_suffix('}').unwrap_or(&head))?;
    for start in (0..all).step_by(CHUNK) {
        let end = all.min(start + CHUNK);
        let lines: Vec<String> =
            (start..end).into_par_iter().map(|i| serde_json::to_string(&line(i))).collect::<Result<_, _>>()?;
        for (i, line) in (start..end).zip(lines) {
            let separator = if i == 0 { "\n" } else { ",\n" };
            write!(out, "{separator}{line}")?;
        }
        progress.advance(end - start);
    }
    writeln!(out, "\n],\n\"totals\":{totals}}}")
}

/// All lines, made as those of [`write`] are.
pub fn lines<L: Serialize>(
    all: usize,
    line: impl Fn(usize) -> L + Sync,
    progress: &Progress,
) -> io::Result<Vec<Value>> {
    let made = |i: usize| {
        let made = serde_json::to_value(line(i));
        progress.advance(1);
        made
    };
    Ok((0..all).into_par_iter().map(made).collect::<Result<_, _>>()?)
}

/// One curve. Numbers that are not finite become null.
#[derive(Debug, Serialize)]
pub struct Line<'a> {
    curve: Cow<'a, str>,
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
    gain: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    loops: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    limits: Option<KeptLimits>,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<String>,
}

/// How a curve keeps its limits.
#[derive(Debug, Serialize)]
struct KeptLimits {
    violation: f64,
    active: usize,
    cost: f64,
    stretch: f64,
    neighbours: usize,
    touching: usize,
}

impl KeptLimits {
    fn of(limits: LimitReport) -> Self {
        let LimitReport { violation, active, cost, stretch, neighbours, touching, .. } = limits;
        KeptLimits { violation, active, cost, stretch, neighbours, touching }
    }
}

impl<'a> Line<'a> {
    /// With λ in this unit of it.
    pub fn with_lambda_in(self, unit: f64) -> Self {
        Line { smoothing: self.smoothing.map(|lambda| lambda / unit), ..self }
    }

    /// Of curve `i`, of which so many points were written.
    pub fn of(batch: &'a CurveBatch, fit: &Fit, i: usize, points_out: usize) -> Self {
        let curve = fit.curve(i);
        let CurveReport {
            status,
            message,
            energy,
            iterations,
            gradient_norm,
            smoothing,
            gain,
            loops,
            limits,
            max_deviation,
            ..
        } = &fit.reports()[i];
        Line {
            curve: batch.name(i),
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
            gain: *gain,
            loops: *loops,
            limits: limits.map(KeptLimits::of),
            message: message.as_ref().map(with_options),
        }
    }
}
