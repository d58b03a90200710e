//! Costs of smooth connection functions between two points.

use faircurve::Work;
use faircurve::scf::{Query, evaluate_segments};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::running::{self, Place};

/// How many times as long as a point of a natural spline a segment takes, roughly
/// (benches/RESULTS.md).
const COST: f64 = 20.0;

/// Six numbers a segment: its cost, two first and three second derivatives; NaN where there is no
/// minimiser.
#[pyfunction]
pub fn segments<'py>(
    py: Python<'py>,
    chords: PyReadonlyArray1<'py, f64>,
    angles: PyReadonlyArray1<'py, f64>,
    exponents: PyReadonlyArray1<'py, f64>,
    device: &str,
    precision: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (angles, _) = angles.as_slice()?.as_chunks::<2>();
    let queries: Vec<Query> = std::iter::zip(chords.as_slice()?, exponents.as_slice()?)
        .zip(angles)
        .map(|((&chord, &exponent), &angles)| Query { chord, angles, exponent })
        .collect();
    let size = Work { points: queries.len(), cost: COST, on_host: 0.0 };
    let place = Place::new(device, precision)?;
    let costs = running::run(py, &place, size, |device| evaluate_segments(&queries, device))?;
    let numbers = costs.into_iter().flat_map(|cost| match cost {
        Some(of) => [of.cost, of.gradient[0], of.gradient[1], of.hessian[0], of.hessian[1], of.hessian[2]],
        None => [f64::NAN; 6],
    });
    Ok(numbers.collect::<Vec<f64>>().into_pyarray(py))
}
