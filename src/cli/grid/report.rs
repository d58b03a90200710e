//! What the report of `faircurve grid` says of every grid.

use faircurve::laplacian::{self, Grids, Subdivided};
use serde_json::{Value, json};

use super::super::words::with_options;

/// Measures surface `i`. Numbers that are not finite become null.
pub fn line(grids: &Grids, surfaces: &Subdivided, i: usize, rounds: u32) -> Value {
    let (fine, report, d) = (surfaces.grids(), &surfaces.reports()[i], grids.dimension());
    let ([rows_in, columns_in], [rows_out, columns_out]) = (grids.shape(i), fine.shape(i));
    let of_usable = |value: &dyn Fn() -> f64| if report.status.is_usable() { value() } else { f64::NAN };
    let mut line = json!({
        "grid": i,
        "status": report.status,
        "rows_in": rows_in,
        "columns_in": columns_in,
        "rows_out": rows_out,
        "columns_out": columns_out,
        // pᵀEp of the control points, and of the surface.
        "energy_in": of_usable(&|| laplacian::energy(d, grids.shape(i), grids.grid(i))),
        "energy": of_usable(&|| laplacian::energy(d, fine.shape(i), fine.grid(i))),
        // Largest |E p_r − Uʳ E p_0|.
        "residual": of_usable(&|| laplacian::residual(d, grids.shape(i), grids.grid(i), fine.grid(i), rounds)),
        "max_deviation": of_usable(&|| max_deviation(grids, fine, i, rounds)),
    });
    if let Some(message) = &report.message {
        line["message"] = json!(with_options(message));
    }
    line
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
