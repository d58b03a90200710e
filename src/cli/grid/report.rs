//! The report of `faircurve grid`: a JSON file with one line a grid.

use std::io::{self, Write};

use faircurve::laplacian::{self, Grids, Subdivided};
use rayon::prelude::*;
use serde::Serialize;

use super::super::report::{Head, Seconds};

/// Grids are measured this many at a time.
const CHUNK: usize = 1024;

/// What concerns the whole run.
#[derive(Serialize)]
pub struct GridHead {
    #[serde(flatten)]
    pub head: Head,
    pub rule: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reproduces: Option<&'static str>,
    pub rounds: u32,
}

/// One grid. Numbers that are not finite become null.
#[derive(Serialize)]
struct Line<'a> {
    grid: usize,
    status: &'static str,
    rows_in: usize,
    columns_in: usize,
    rows_out: usize,
    columns_out: usize,
    /// pᵀEp of the control points.
    energy_in: f64,
    /// pᵀEp of the surface.
    energy: f64,
    /// Largest |E p_r − Uʳ E p_0|.
    residual: f64,
    /// Largest distance of a control point from the surface's point in its place.
    max_deviation: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    message: Option<&'a str>,
}

#[derive(Serialize)]
struct Totals {
    grids: usize,
    usable: usize,
    seconds: Seconds,
}

/// Writes the report; surfaces are measured here, in parallel.
pub fn write(
    out: &mut dyn Write,
    head: &GridHead,
    grids: &Grids,
    surfaces: &Subdivided,
    seconds: Seconds,
) -> io::Result<()> {
    // The head is an object: its closing brace makes room for the grids and the totals.
    let text = serde_json::to_string(head)?;
    write!(out, "{},\n\"grids\":[", text.strip_suffix('}').unwrap_or(&text))?;
    for start in (0..grids.len()).step_by(CHUNK) {
        let end = grids.len().min(start + CHUNK);
        let line = |i: usize| serde_json::to_string(&measure(grids, surfaces, i, head.rounds));
        let lines: Vec<String> = (start..end).into_par_iter().map(line).collect::<Result<_, _>>()?;
        for (i, line) in (start..end).zip(lines) {
            let separator = if i == 0 { "\n" } else { ",\n" };
            write!(out, "{separator}{line}")?;
        }
    }
    let totals = Totals { grids: grids.len(), usable: surfaces.usable(), seconds };
    writeln!(out, "\n],\n\"totals\":{}}}", serde_json::to_string(&totals)?)
}

fn measure<'a>(grids: &Grids, surfaces: &'a Subdivided, i: usize, rounds: u32) -> Line<'a> {
    let (fine, report, d) = (surfaces.grids(), &surfaces.reports()[i], grids.dimension());
    let ([rows_in, columns_in], [rows_out, columns_out]) = (grids.shape(i), fine.shape(i));
    let of_usable = |value: &dyn Fn() -> f64| if report.status.is_usable() { value() } else { f64::NAN };
    Line {
        grid: i,
        status: report.status.word(),
        rows_in,
        columns_in,
        rows_out,
        columns_out,
        energy_in: of_usable(&|| laplacian::energy(d, grids.shape(i), grids.grid(i))),
        energy: of_usable(&|| laplacian::energy(d, fine.shape(i), fine.grid(i))),
        residual: of_usable(&|| laplacian::residual(d, grids.shape(i), grids.grid(i), fine.grid(i), rounds)),
        max_deviation: of_usable(&|| max_deviation(grids, fine, i, rounds)),
        message: report.message.as_deref(),
    }
}

/// Largest distance of a control point from the surface's point in its place.
fn max_deviation(grids: &Grids, fine: &Grids, i: usize, rounds: u32) -> f64 {
    let [rows, columns] = grids.shape(i);
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column]));
    let distance = |[row, column]: [usize; 2]| {
        let (from, to) = (grids.point(i, row, column), fine.point(i, row << rounds, column << rounds));
        from.iter().zip(to).map(|(x, y)| y - x).fold(0.0f64, f64::hypot)
    };
    places.map(distance).fold(0.0, f64::max)
}
