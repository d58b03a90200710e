//! What the report of `faircurve grid` says of the run and of every grid.

use faircurve::laplacian::{self, Grids, Subdivided};
use serde::Serialize;

use super::super::report::Head;
use super::super::words::with_options;

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
pub struct Line {
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
    message: Option<String>,
}

impl Line {
    /// Measures surface `i`.
    pub fn of(grids: &Grids, surfaces: &Subdivided, i: usize, rounds: u32) -> Self {
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
            message: report.message.as_ref().map(with_options),
        }
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
