//! Piecewise polynomials, for the classes that speak SciPy's words.

use faircurve::Work;
use faircurve::spline::{self, EndCondition, Extrapolate, Knotted};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::batch::offsets;
use crate::fit::Arrays;
use crate::running::{self, Place, at_once};

/// Polynomials, piece by piece.
#[pyclass(frozen, module = "faircurve._core")]
pub struct Piecewise {
    splines: spline::Piecewise,
}

/// A condition: nothing, or the order of a derivative and its values.
type End<'py> = Option<(usize, PyReadonlyArray1<'py, f64>)>;

fn condition<'a>(end: &'a End<'_>) -> PyResult<EndCondition<'a>> {
    match end {
        None => Ok(EndCondition::NotAKnot),
        Some((1, values)) => Ok(EndCondition::First(values.as_slice()?)),
        Some((2, values)) => Ok(EndCondition::Second(values.as_slice()?)),
        Some((order, _)) => Err(PyValueError::new_err(format!(
            "derivatives of order 1 and 2 can be given at ends, not of order {order}"
        ))),
    }
}

fn extrapolation(word: &str) -> Extrapolate {
    match word {
        "periodic" => Extrapolate::Periodic,
        "no" => Extrapolate::No,
        _ => Extrapolate::Yes,
    }
}

#[pymethods]
impl Piecewise {
    #[new]
    #[pyo3(signature = (x, offsets, y, columns, periodic, start, end, device, precision))]
    fn new(
        py: Python<'_>,
        x: PyReadonlyArray1<'_, f64>,
        offsets: PyReadonlyArray1<'_, i64>,
        y: PyReadonlyArray1<'_, f64>,
        columns: usize,
        periodic: bool,
        start: End<'_>,
        end: End<'_>,
        device: &str,
        precision: &str,
    ) -> PyResult<Self> {
        let (x, y, offsets) = (x.as_slice()?, y.as_slice()?, self::offsets(&offsets)?);
        let given = Knotted { x, offsets: &offsets, y, columns, periodic };
        let ends = [condition(&start)?, condition(&end)?];
        let place = Place::new(device, precision)?;
        let splines =
            running::run(py, &place, Work::splines(y.len()), |device| spline::Piecewise::cubic(&given, &ends, device))?;
        Ok(Piecewise { splines })
    }

    /// Coefficients of all spans: `order` rows of `columns` each.
    fn coefficients<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let all = (0..self.splines.len()).flat_map(|i| self.splines.coefficients(i)).copied();
        all.collect::<Vec<f64>>().into_pyarray(py)
    }

    #[getter]
    fn order(&self) -> usize {
        self.splines.order()
    }

    #[getter]
    fn status(&self) -> Vec<&'static str> {
        self.splines.status().iter().map(|status| status.word()).collect()
    }

    #[getter]
    fn messages(&self) -> Vec<Option<String>> {
        (0..self.splines.len()).map(|i| self.splines.message(i).map(String::from)).collect()
    }

    /// Values at parameters, the same for every curve or each curve's own.
    #[pyo3(signature = (x, ends, nu, extrapolate))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        ends: Option<PyReadonlyArray1<'py, i64>>,
        nu: usize,
        extrapolate: &str,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (x, extrapolate) = (x.as_slice()?, extrapolation(extrapolate));
        let ends = ends.as_ref().map(offsets).transpose()?;
        let values = at_once(py, || match &ends {
            None => Ok(self.splines.evaluate_all(x, nu, extrapolate)),
            Some(ends) => self.splines.evaluate(x, ends, nu, extrapolate),
        })?;
        Ok(values.map_err(crate::error)?.into_pyarray(py))
    }

    fn derivative(&self, nu: usize) -> Self {
        Piecewise { splines: self.splines.derivative(nu) }
    }

    fn antiderivative(&self, nu: usize) -> Self {
        Piecewise { splines: self.splines.antiderivative(nu) }
    }

    fn integrate<'py>(
        &self,
        py: Python<'py>,
        a: f64,
        b: f64,
        extrapolate: &str,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let extrapolate = extrapolation(extrapolate);
        Ok(at_once(py, || self.splines.integrate(a, b, extrapolate))?.into_pyarray(py))
    }

    /// Flat places of the value `y`, and offsets for every curve and column.
    fn solve<'py>(&self, py: Python<'py>, y: f64, extrapolate: &str) -> PyResult<Arrays<'py>> {
        let extrapolate = extrapolation(extrapolate);
        let lists = at_once(py, || self.splines.solve(y, extrapolate))?;
        let mut ends = vec![0];
        lists.iter().for_each(|list| ends.push(ends[ends.len() - 1] + list.len() as i64));
        Ok((lists.concat().into_pyarray(py), ends.into_pyarray(py)))
    }
}
