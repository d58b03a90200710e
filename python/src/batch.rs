//! [`Batch`]: flat arrays as a batch of curves.

use faircurve::{Constraints, CurveBatch};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A batch of curves.
#[pyclass(frozen, module = "faircurve._core")]
pub struct Batch {
    pub batch: CurveBatch,
    /// Whether borders that curves share are fitted once.
    pub topology: bool,
}

/// A flat array as the library takes it.
pub fn flat(array: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
    Ok(array.as_slice()?.to_vec())
}

/// Rows one after the other.
pub fn rows(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<f64>> {
    Ok(array.as_slice()?.to_vec())
}

/// Offsets as the library takes them.
pub fn offsets(array: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<usize>> {
    let offset = |&offset: &i64| {
        usize::try_from(offset)
            .map_err(|_| PyValueError::new_err(format!("an offset is {offset}; offsets are 0 or more")))
    };
    array.as_slice()?.iter().map(offset).collect()
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (coords, offsets, *, closed=None, t=None, weights=None, tangents=None, curvatures=None, exponents=None, known=None, pinned=None, largest_curvatures=None, corridors=None, widths=None, auto_closed=false, topology=false, degrees=false, metres=None))]
    fn new(
        coords: PyReadonlyArray2<'_, f64>,
        offsets: PyReadonlyArray1<'_, i64>,
        closed: Option<Vec<bool>>,
        t: Option<PyReadonlyArray1<'_, f64>>,
        weights: Option<PyReadonlyArray1<'_, f64>>,
        tangents: Option<PyReadonlyArray2<'_, f64>>,
        curvatures: Option<PyReadonlyArray2<'_, f64>>,
        exponents: Option<PyReadonlyArray1<'_, f64>>,
        known: Option<Vec<bool>>,
        pinned: Option<Vec<bool>>,
        largest_curvatures: Option<PyReadonlyArray1<'_, f64>>,
        corridors: Option<PyReadonlyArray1<'_, f64>>,
        widths: Option<PyReadonlyArray2<'_, f64>>,
        auto_closed: bool,
        topology: bool,
        degrees: bool,
        metres: Option<f64>,
    ) -> PyResult<Self> {
        let dimension = coords.shape()[1];
        let batch = CurveBatch::from_ragged(dimension, rows(&coords)?, self::offsets(&offsets)?);
        let mut batch = batch.map_err(crate::error)?;
        if let Some(t) = &t {
            batch = batch.with_parameters(flat(t)?).map_err(crate::error)?;
        }
        if let Some(weights) = &weights {
            batch = batch.with_weights(flat(weights)?).map_err(crate::error)?;
        }
        let constraints = Constraints {
            tangents: tangents.as_ref().map(rows).transpose()?,
            curvatures: curvatures.as_ref().map(rows).transpose()?,
            exponents: exponents.as_ref().map(flat).transpose()?,
            known,
            pinned,
            largest_curvatures: largest_curvatures.as_ref().map(flat).transpose()?,
            corridors: corridors.as_ref().map(flat).transpose()?,
            widths: widths.as_ref().map(rows).transpose()?,
        };
        if !constraints.is_empty() {
            batch = batch.with_constraints(constraints).map_err(crate::error)?;
        }
        batch = match closed {
            Some(closed) => batch.closed_each(closed).map_err(crate::error)?,
            None if auto_closed => batch.closed_auto(),
            None => batch,
        };
        if degrees {
            batch = batch.in_degrees();
        }
        if let Some(metres) = metres {
            batch = batch.in_metres(metres).map_err(crate::error)?;
        }
        Ok(Batch { batch, topology })
    }

    fn __len__(&self) -> usize {
        self.batch.len()
    }

    /// Which curves are closed.
    #[getter]
    fn closed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, (0..self.batch.len()).map(|i| self.batch.is_closed(i)))
    }
}
