//! Batched tridiagonal systems.

use faircurve::Work;
use faircurve::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::batch::offsets;
use crate::running::{self, Place};

/// Solutions, and a status for each system.
#[pyfunction]
pub fn solve_tridiagonal<'py>(
    py: Python<'py>,
    lower: PyReadonlyArray1<'py, f64>,
    diagonal: PyReadonlyArray1<'py, f64>,
    upper: PyReadonlyArray1<'py, f64>,
    rhs: PyReadonlyArray1<'py, f64>,
    columns: usize,
    system_offsets: PyReadonlyArray1<'py, i64>,
    cyclic: bool,
    device: &str,
    precision: &str,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Vec<&'static str>)> {
    let offsets = offsets(&system_offsets)?;
    let systems = TridiagonalBatch {
        matrix: Matrix::Bands { lower: lower.as_slice()?, diagonal: diagonal.as_slice()?, upper: upper.as_slice()? },
        offsets: &offsets,
        cyclic: if cyclic { Cyclic::All } else { Cyclic::None },
    };
    let rhs = rhs.as_slice()?;
    let size = Work::splines(rhs.len());
    let place = Place::new(device, precision)?;
    let solved = running::run(py, &place, size, |device| solve_tridiagonal_batch(&systems, rhs, columns, device))?;
    let statuses = solved.status.iter().map(|status| status.word()).collect();
    Ok((solved.x.into_pyarray(py), statuses))
}
