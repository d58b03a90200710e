//! [`Fit`]: fitted curves, asked for numbers by the batch.

use std::sync::Arc;

use faircurve::picture::Picture;
use faircurve::topology::Topology;
use faircurve::{Curve, CurveBatch, Sampling};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::batch::{Batch, flat, offsets};
use crate::running::at_once;

/// Fitted curves.
#[pyclass(frozen, module = "faircurve._core")]
pub struct Fit {
    pub fit: faircurve::Fit,
    pub batch: Py<Batch>,
    /// What the curves share, and the fit of its strokes.
    pub shared: Option<(Arc<Topology>, faircurve::Fit)>,
}

/// The share of its area that a ring keeps where borders are drawn tighter, as of the command.
const KEEP_AREA: f64 = 0.5;

/// Flat numbers of curves, and offsets: coordinates, parameters, places.
pub type Arrays<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<i64>>);

/// A batch as arrays, whose memory they take over.
pub fn arrays(py: Python<'_>, batch: CurveBatch) -> Arrays<'_> {
    let (coords, offsets) = batch.into_ragged();
    let offsets: Vec<i64> = offsets.into_iter().map(|offset| offset as i64).collect();
    (coords.into_pyarray(py), offsets.into_pyarray(py))
}

/// Reports as a dictionary of columns.
pub fn columns<'py>(py: Python<'py>, reports: &[faircurve::CurveReport]) -> PyResult<Bound<'py, PyDict>> {
    let report = PyDict::new(py);
    report.set_item("status", reports.iter().map(|report| report.status.word()).collect::<Vec<_>>())?;
    report.set_item("message", reports.iter().map(|report| report.message.as_deref()).collect::<Vec<_>>())?;
    let numbers =
        |of: &dyn Fn(&faircurve::CurveReport) -> f64| reports.iter().map(of).collect::<Vec<f64>>().into_pyarray(py);
    report.set_item("energy", numbers(&|report| report.energy))?;
    report
        .set_item("iterations", reports.iter().map(|report| report.iterations).collect::<Vec<_>>().into_pyarray(py))?;
    report.set_item("gradient_norm", numbers(&|report| report.gradient_norm))?;
    report.set_item("max_deviation", numbers(&|report| report.max_deviation))?;
    report.set_item("smoothing", numbers(&|report| report.smoothing.unwrap_or(f64::NAN)))?;
    report.set_item("gain", numbers(&|report| report.gain.unwrap_or(f64::NAN)))?;
    report.set_item("loops", numbers(&|report| report.loops.unwrap_or(f64::NAN)))?;
    if reports.iter().any(|report| report.limits.is_some()) {
        let of = |of: fn(faircurve::LimitReport) -> f64| numbers(&|report| report.limits.map_or(f64::NAN, of));
        report.set_item("violation", of(|limits| limits.violation))?;
        report.set_item("active", of(|limits| limits.active as f64))?;
        report.set_item("cost", of(|limits| limits.cost))?;
        report.set_item("stretch", of(|limits| limits.stretch))?;
        report.set_item("neighbours", of(|limits| limits.neighbours as f64))?;
        report.set_item("touching", of(|limits| limits.touching as f64))?;
    }
    Ok(report)
}

/// What is asked of a curve at a parameter.
#[derive(Clone, Copy)]
enum At {
    /// Derivative of this order.
    Derivative(usize),
    Curvature,
}

impl Fit {
    /// Numbers of all curves, in parallel.
    fn each<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&dyn Curve) -> f64 + Send + Sync,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let all =
            at_once(py, || (0..self.fit.len()).into_par_iter().map(|i| of(&*self.fit.curve(i))).collect::<Vec<f64>>())?;
        Ok(all.into_pyarray(py))
    }

    fn sampling(&self, how: &str, value: f64) -> PyResult<Sampling> {
        let sampling = match how {
            "count" => Sampling::Count(value as usize),
            "per_span" => Sampling::PerSpan(value as usize),
            "points" => Sampling::Points(value as usize),
            "tolerance" => Sampling::Tolerance(value),
            _ => Sampling::Spacing(value),
        };
        sampling.check(&self.batch.get().batch).map_err(crate::error)?;
        Ok(sampling)
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        match &self.shared {
            // Borders that cross are drawn tighter.
            Some((topology, strokes)) => {
                topology.sample(strokes.clone(), sampling).mend(KEEP_AREA).0.join().polylines(sampling)
            }
            None => self.fit.polylines(sampling),
        }
    }

    /// The values at parameters: the same for every curve, or each curve's own.
    fn at<'py>(
        &self,
        py: Python<'py>,
        u: &PyReadonlyArray1<'py, f64>,
        u_offsets: Option<PyReadonlyArray1<'py, i64>>,
        at: At,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let curves = self.fit.len();
        let u = u.as_slice()?;
        let ends = match &u_offsets {
            Some(given) => offsets(given)?,
            None => (0..=curves).map(|i| i * u.len()).collect(),
        };
        let shared = u_offsets.is_none();
        let good = ends.len() == curves + 1 && ends.windows(2).all(|pair| pair[0] <= pair[1]) && ends[0] == 0;
        if !good || (!shared && ends[curves] != u.len()) {
            let sentence =
                format!("parameters must be one list for all curves, or one for each of the {curves} curves");
            return Err(PyValueError::new_err(sentence));
        }
        let width = match at {
            At::Derivative(_) => self.dimension(),
            At::Curvature => 1,
        };
        let values = at_once(py, || {
            let mut values = vec![0.0; ends[curves] * width];
            let mut parts: Vec<&mut [f64]> = Vec::with_capacity(curves);
            let mut rest = &mut values[..];
            for pair in ends.windows(2) {
                let (part, behind) = rest.split_at_mut((pair[1] - pair[0]) * width);
                parts.push(part);
                rest = behind;
            }
            parts.into_par_iter().enumerate().for_each(|(i, part)| {
                let curve = self.fit.curve(i);
                let own = if shared { u } else { &u[ends[i]..ends[i + 1]] };
                for (to, &u) in part.chunks_exact_mut(width).zip(own) {
                    let (span, fraction) = curve.locate(u);
                    let jet = || curve.jet(span, fraction);
                    match at {
                        _ if u.is_nan() => to.fill(f64::NAN),
                        At::Derivative(0) => to.copy_from_slice(&jet().point.to_array()[..width]),
                        At::Derivative(1) => to.copy_from_slice(&jet().first.to_array()[..width]),
                        At::Derivative(2) => to.copy_from_slice(&jet().second.to_array()[..width]),
                        At::Derivative(3) => to.copy_from_slice(&jet().third.to_array()[..width]),
                        At::Derivative(_) => to.fill(0.0),
                        At::Curvature => to[0] = jet().curvature(curve.dimension()),
                    }
                }
            });
            values
        })?;
        Ok(values.into_pyarray(py))
    }
}

#[pymethods]
impl Fit {
    fn __len__(&self) -> usize {
        self.fit.len()
    }

    /// The coordinates of a point of the curves. Those over terrain have one more than planar points.
    #[getter]
    fn dimension(&self) -> usize {
        if self.fit.is_empty() { self.batch.get().batch.dimension() } else { self.fit.curve(0).dimension() }
    }

    #[getter]
    fn batch(&self, py: Python<'_>) -> Py<Batch> {
        self.batch.clone_ref(py)
    }

    /// What did the work, in words.
    #[getter]
    fn device(&self) -> String {
        self.fit.device().to_string()
    }

    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns(py, self.fit.reports())
    }

    /// Samples: "count", "per_span", "points", "spacing" or "tolerance". With `out` they are written there.
    #[pyo3(signature = (how, value, out=None))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        how: &str,
        value: f64,
        out: Option<Bound<'py, PyArray1<f64>>>,
    ) -> PyResult<Arrays<'py>> {
        let sampling = self.sampling(how, value)?;
        let polylines = || self.polylines(sampling);
        let offsets = if self.shared.is_none() { self.fit.sample_offsets(sampling) } else { None };
        let samples = match (&offsets, &out) {
            (None, None) => return Ok(arrays(py, at_once(py, polylines)?)),
            (None, Some(_)) => Some(at_once(py, polylines)?),
            (Some(_), _) => None,
        };
        let offsets = offsets.unwrap_or_else(|| samples.iter().flat_map(|own| own.offsets()).copied().collect());
        let total = offsets.last().copied().unwrap_or(0) * self.dimension();
        let coords = match out {
            Some(out) => out,
            // NumPy asks for large pages, which take far less time to write to for the first time.
            None => py.import("numpy")?.call_method1("empty", (total,))?.cast_into::<PyArray1<f64>>()?,
        };
        let mut writable = coords.try_readwrite()?;
        let numbers = writable.as_slice_mut()?;
        if numbers.len() != total {
            let (found, d) = (numbers.len(), self.dimension());
            let message = format!("out has {found} numbers; {} samples have {total}, {d} each", total / d);
            return Err(PyValueError::new_err(message));
        }
        match samples {
            Some(samples) => numbers.copy_from_slice(samples.coords()),
            None => at_once(py, || self.fit.sample_into(sampling, numbers))?,
        }
        drop(writable);
        let offsets: Vec<i64> = offsets.into_iter().map(|offset| offset as i64).collect();
        Ok((coords, offsets.into_pyarray(py)))
    }

    /// The parameters of the same samples.
    fn sample_parameters<'py>(&self, py: Python<'py>, how: &str, value: f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let sampling = self.sampling(how, value)?;
        let samples = at_once(py, || self.polylines(sampling))?;
        let t = (0..samples.len()).flat_map(|i| samples.parameters(i).unwrap_or_default()).copied();
        Ok(t.collect::<Vec<f64>>().into_pyarray(py))
    }

    /// Derivatives of order `nu` at parameters.
    #[pyo3(signature = (u, u_offsets, nu))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        u_offsets: Option<PyReadonlyArray1<'py, i64>>,
        nu: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.at(py, &u, u_offsets, At::Derivative(nu))
    }

    /// Curvatures at parameters.
    #[pyo3(signature = (u, u_offsets))]
    fn curvature<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        u_offsets: Option<PyReadonlyArray1<'py, i64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.at(py, &u, u_offsets, At::Curvature)
    }

    fn lengths<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.each(py, |curve| curve.length())
    }

    fn max_curvatures<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.each(py, |curve| curve.max_curvature())
    }

    /// The parameters of all knots, and offsets.
    fn knots<'py>(&self, py: Python<'py>) -> PyResult<Arrays<'py>> {
        let (mut all, mut ends) = (Vec::new(), vec![0]);
        for (curve, _) in &self.fit {
            all.extend_from_slice(curve.knots());
            ends.push(all.len() as i64);
        }
        Ok((all.into_pyarray(py), ends.into_pyarray(py)))
    }

    /// Control points of cubic Béziers: the points of every chain, 3 a piece and one more.
    fn beziers<'py>(&self, py: Python<'py>, tolerances: PyReadonlyArray1<'py, f64>) -> PyResult<Arrays<'py>> {
        let tolerances = flat(&tolerances)?;
        if tolerances.len() != self.fit.len() {
            return Err(PyValueError::new_err("a tolerance for each curve is needed"));
        }
        let chains = at_once(py, || self.fit.beziers_each(|i| tolerances[i]))?;
        Ok(arrays(py, chains))
    }

    /// Some of the curves.
    fn select(&self, py: Python<'_>, numbers: Vec<usize>) -> PyResult<Fit> {
        if let Some(number) = numbers.iter().find(|&&number| number >= self.fit.len()) {
            return Err(PyIndexError::new_err(format!("there is no curve {number} of {}", self.fit.len())));
        }
        let batch = Batch { batch: self.batch.get().batch.select(&numbers), topology: false };
        Ok(Fit { fit: self.fit.select(&numbers), batch: Py::new(py, batch)?, shared: None })
    }

    fn svg(&self, py: Python<'_>, width: f64, points: bool) -> PyResult<String> {
        let picture = Picture { width, points, ..Picture::default() };
        at_once(py, || picture.draw(&self.batch.get().batch, &self.fit))
    }
}
