//! Laplacian-spline subdivision of grids.

use faircurve::laplacian::{Reproduces, Rule, SparseRule, Subdivide};
use faircurve::{Grids, Work};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::batch::flat;
use crate::running::{self, Place};

/// Flat values and the shapes of grids, with their statuses.
type Refined<'py> = (Bound<'py, PyArray1<f64>>, Vec<[usize; 2]>, Vec<&'static str>);

#[pyfunction]
#[pyo3(signature = (dimension, shapes, values, rounds, support, linear, device, precision))]
pub fn subdivide<'py>(
    py: Python<'py>,
    dimension: usize,
    shapes: Vec<[usize; 2]>,
    values: PyReadonlyArray1<'py, f64>,
    rounds: u32,
    support: Option<usize>,
    linear: bool,
    device: &str,
    precision: &str,
) -> PyResult<Refined<'py>> {
    let reproduces = if linear { Reproduces::Linear } else { Reproduces::Constants };
    let rule = match support {
        None => Rule::Exact,
        Some(support) => Rule::Sparse(SparseRule::of_support(support, reproduces).map_err(crate::error)?),
    };
    let grids = Grids::new(dimension, shapes, flat(&values)?).map_err(crate::error)?;
    let method = Subdivide { rounds, rule };
    let place = Place::new(device, precision)?;
    let size = Work::splines(grids.total_points() << (2 * rounds.min(8)));
    let done = running::run(py, &place, size, |device| method.fit(&grids, device))?;
    let statuses = done.reports().iter().map(|report| report.status.word()).collect();
    Ok((done.grids().values().to_vec().into_pyarray(py), done.grids().shapes().to_vec(), statuses))
}
