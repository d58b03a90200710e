//! The compiled half of the Python package: arrays in, fits, arrays out. The package's Python files
//! know what people bring; this knows flat arrays and offsets alone.

// Functions have the arguments of Python's.
#![allow(clippy::too_many_arguments)]

mod batch;
mod beziers;
mod fit;
mod grids;
mod linalg;
mod methods;
mod running;
mod segments;
mod splines;
mod surfaces;

use std::ffi::OsString;

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// An error of the library as Python's: its sentence, and the class that Python's users expect.
fn error(error: faircurve::Error) -> PyErr {
    use faircurve::Error as E;
    let sentence = error.to_string();
    match error {
        E::Argument(_) | E::Batch(_) | E::Parse { .. } | E::Limit { .. } => PyValueError::new_err(sentence),
        E::Read { .. } | E::Write { .. } | E::Stream { .. } | E::Exists { .. } => PyOSError::new_err(sentence),
        _ => PyRuntimeError::new_err(sentence),
    }
}

/// Runs the program with these arguments, its name first; its exit status.
#[pyfunction]
fn run(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| faircurve::cli::run(arguments))
}

#[pymodule(gil_used = true)]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<splines::Piecewise>()?;
    module.add_class::<surfaces::Surface>()?;
    for function in [
        wrap_pyfunction!(run, module)?,
        wrap_pyfunction!(running::adapters, module)?,
        wrap_pyfunction!(running::num_threads, module)?,
        wrap_pyfunction!(running::set_num_threads, module)?,
        wrap_pyfunction!(running::watch, module)?,
        wrap_pyfunction!(methods::natural, module)?,
        wrap_pyfunction!(methods::smoothing, module)?,
        wrap_pyfunction!(methods::in_surface, module)?,
        wrap_pyfunction!(methods::fair, module)?,
        wrap_pyfunction!(methods::smooth, module)?,
        wrap_pyfunction!(beziers::complete, module)?,
        wrap_pyfunction!(beziers::chain, module)?,
        wrap_pyfunction!(beziers::simplify, module)?,
        wrap_pyfunction!(beziers::elevate, module)?,
        wrap_pyfunction!(beziers::reduce, module)?,
        wrap_pyfunction!(grids::subdivide, module)?,
        wrap_pyfunction!(linalg::solve_tridiagonal, module)?,
        wrap_pyfunction!(segments::segments, module)?,
    ] {
        module.add_function(function)?;
    }
    Ok(())
}
