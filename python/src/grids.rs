//! Laplacian-spline subdivision of grids.

use faircurve::laplacian::{Rule, Subdivide};
use faircurve::{Grids, Work};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::batch::flat;
use crate::running::{self, Place};

/// Flat values and the shapes of grids, with their statuses.
type Refined<'py> = (Bound<'py, PyArray1<f64>>, Vec<[usize; 2]>, Vec<&'static str>);

#[pyfunction]
pub fn subdivide<'py>(
    py: Python<'py>,
    dimension: usize,
    shapes: Vec<[usize; 2]>,
    values: PyReadonlyArray1<'py, f64>,
    rounds: u32,
    rule: &str,
    device: &str,
    precision: &str,
) -> PyResult<Refined<'py>> {
    if rule != "exact" {
        return Err(PyValueError::new_err(format!("rule is \"{rule}\"; exact is possible")));
    }
    let grids = Grids::new(dimension, shapes, flat(&values)?).map_err(crate::error)?;
    let method = Subdivide { rounds, rule: Rule::Exact };
    let place = Place::new(device, precision)?;
    let size = Work::splines(grids.total_points() << (2 * rounds.min(8)));
    let done = running::run(py, &place, size, |device| method.fit(&grids, device))?;
    let statuses = done.reports().iter().map(|report| report.status.word()).collect();
    Ok((done.grids().values().to_vec().into_pyarray(py), done.grids().shapes().to_vec(), statuses))
}
