//! Bézier curves: completion, degrees, simplification.

use faircurve::bezier::{Chain, Complete, Completed, Energy, Polygons, Simplify};
use faircurve::{CurveBatch, Device, Work};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::batch::{Batch, offsets, rows};
use crate::fit::{Arrays, arrays, columns};
use crate::running::{self, Place};

/// Control points, and the columns of the report.
type Made<'py> = (Arrays<'py>, Bound<'py, PyDict>);

fn made<'py>(
    batch: &Bound<'py, Batch>,
    device: &str,
    precision: &str,
    fit: impl FnOnce(&CurveBatch, &Device) -> faircurve::Result<Completed> + Send,
) -> PyResult<Made<'py>> {
    let py = batch.py();
    let curves = &batch.get().batch;
    let size = Work::splines(curves.total_points());
    let completed = running::run(py, &Place::new(device, precision)?, size, |device| fit(curves, device))?;
    Ok((arrays(py, completed.control_points().clone()), columns(py, completed.reports())?))
}

/// Weights of ∫|X′|², ∫|X″|² and ∫|X‴|².
fn energy(weights: [f64; 3]) -> Energy {
    Energy { weights }
}

#[pyfunction]
pub fn complete<'py>(
    batch: &Bound<'py, Batch>,
    weights: [f64; 3],
    tangents: &str,
    device: &str,
    precision: &str,
) -> PyResult<Made<'py>> {
    let method = Complete { energy: energy(weights), tangents: tangents.parse().map_err(crate::error)? };
    made(batch, device, precision, |batch, device| method.fit(batch, device))
}

#[pyfunction]
#[pyo3(signature = (batch, degree, joints, lengths, weights, corners, device, precision))]
pub fn chain<'py>(
    batch: &Bound<'py, Batch>,
    degree: usize,
    joints: &str,
    lengths: &str,
    weights: [f64; 3],
    corners: Option<f64>,
    device: &str,
    precision: &str,
) -> PyResult<Made<'py>> {
    let method = Chain {
        degree,
        joints: joints.parse().map_err(crate::error)?,
        lengths: lengths.parse().map_err(crate::error)?,
        energy: energy(weights),
        corners: corners.map(f64::to_radians),
    };
    made(batch, device, precision, |batch, device| method.fit(batch, device))
}

#[pyfunction]
pub fn simplify<'py>(batch: &Bound<'py, Batch>, tolerance: f64, corners: f64, extremes: bool) -> PyResult<Made<'py>> {
    let method = Simplify { tolerance, corners: corners.to_radians(), extremes };
    made(batch, "cpu", "auto", |batch, device| method.fit(batch, device))
}

/// Control points of other degrees.
fn polygon(py: Python<'_>, controls: faircurve::bezier::Controls) -> Arrays<'_> {
    let offsets: Vec<i64> = controls.offsets.iter().map(|&offset| offset as i64).collect();
    (controls.coords.into_pyarray(py), offsets.into_pyarray(py))
}

#[pyfunction]
pub fn elevate<'py>(
    py: Python<'py>,
    coords: PyReadonlyArray2<'py, f64>,
    offsets: PyReadonlyArray1<'py, i64>,
    by: usize,
    device: &str,
    precision: &str,
) -> PyResult<Arrays<'py>> {
    let (dimension, coords, offsets) = (coords.shape()[1], rows(&coords)?, self::offsets(&offsets)?);
    let polygons = Polygons { dimension, coords: &coords, offsets: &offsets };
    let size = Work::splines(coords.len());
    let place = Place::new(device, precision)?;
    let raised = running::run(py, &place, size, |device| faircurve::bezier::elevate(&polygons, by, device))?;
    Ok(polygon(py, raised))
}

#[pyfunction]
pub fn reduce<'py>(
    py: Python<'py>,
    coords: PyReadonlyArray2<'py, f64>,
    offsets: PyReadonlyArray1<'py, i64>,
    by: usize,
    device: &str,
    precision: &str,
) -> PyResult<(Arrays<'py>, Bound<'py, PyArray1<f64>>)> {
    let (dimension, coords, offsets) = (coords.shape()[1], rows(&coords)?, self::offsets(&offsets)?);
    let polygons = Polygons { dimension, coords: &coords, offsets: &offsets };
    let size = Work::splines(coords.len());
    let place = Place::new(device, precision)?;
    let (reduced, errors) = running::run(py, &place, size, |device| faircurve::bezier::reduce(&polygons, by, device))?;
    Ok((polygon(py, reduced), errors.into_pyarray(py)))
}
