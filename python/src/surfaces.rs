//! [`Surface`]: what curves lie in, made once for all fits.

use std::sync::Arc;

use faircurve::io::surfaces::surface_of;
use faircurve::surface::{self, HeightField, Mesh};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::batch::rows;
use crate::running::at_once;

/// A surface.
#[pyclass(frozen, module = "faircurve._core")]
pub struct Surface {
    surface: Arc<dyn surface::Surface>,
}

impl Surface {
    /// The surface that the library takes.
    pub fn shared(&self) -> Arc<dyn surface::Surface> {
        self.surface.clone()
    }

    fn made(
        py: Python<'_>,
        make: impl FnOnce() -> faircurve::Result<Arc<dyn surface::Surface>> + Send,
    ) -> PyResult<Self> {
        Ok(Surface { surface: at_once(py, make)?.map_err(crate::error)? })
    }
}

#[pymethods]
impl Surface {
    /// The surface of a word and its sizes, or of a file.
    #[staticmethod]
    fn named(py: Python<'_>, text: &str) -> PyResult<Self> {
        Surface::made(py, || surface_of(text))
    }

    /// Terrain over a grid: rows of heights.
    #[staticmethod]
    fn height_field(
        py: Python<'_>,
        heights: PyReadonlyArray2<'_, f64>,
        spacing: [f64; 2],
        origin: [f64; 2],
    ) -> PyResult<Self> {
        let (shape, heights) = ([heights.shape()[0], heights.shape()[1]], rows(&heights)?);
        Surface::made(py, || {
            Ok(Arc::new(HeightField::new(shape, heights)?.with_spacing(spacing)?.with_origin(origin)?))
        })
    }

    /// The smooth surface of triangles: rows of coordinates, and rows of three numbers of vertices.
    #[staticmethod]
    fn mesh(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Self> {
        let vertices = rows(&vertices)?;
        let of = |(k, &vertex): (usize, &i64)| {
            usize::try_from(vertex).map_err(|_| {
                let sentence = format!("triangle {} has vertex {vertex}: vertices are counted from 0", k / 3);
                PyValueError::new_err(sentence)
            })
        };
        let corners: Vec<usize> = triangles.as_slice()?.iter().enumerate().map(of).collect::<PyResult<_>>()?;
        Surface::made(py, || Ok(Arc::new(Mesh::new(vertices.as_chunks::<3>().0, corners.as_chunks::<3>().0)?)))
    }

    /// What it is, for messages.
    #[getter]
    fn name(&self) -> String {
        self.surface.name()
    }

    /// The heights over rows of x and y. NaN where the surface has none.
    fn heights<'py>(&self, py: Python<'py>, places: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let places = rows(&places)?;
        let height = |&[x, y]: &[f64; 2]| self.surface.over(x, y).map_or(f64::NAN, |point| point.z);
        let heights: Vec<f64> = at_once(py, || places.as_chunks::<2>().0.par_iter().map(height).collect())?;
        Ok(heights.into_pyarray(py))
    }

    /// The closest point to each of some. NaN where there is none.
    fn closest<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = rows(&points)?;
        let closest =
            |&point: &[f64; 3]| self.surface.closest(point.into()).map_or([f64::NAN; 3], |point| point.to_array());
        let closest: Vec<[f64; 3]> = at_once(py, || points.as_chunks::<3>().0.par_iter().map(closest).collect())?;
        let shape = [closest.len(), 3];
        closest.into_flattened().into_pyarray(py).reshape(shape)
    }
}
