//! The methods: each a function of a batch and of options that Python's classes hold.

use faircurve::discrete::{Energy, Expression, Fair, Limits, MOST_EDGES, Obstacle, Region, Segments};
use faircurve::scf::{Smooth, Start};
use faircurve::spline::{Band, Corners, Ends, Natural, Parametrisation, Smoothing, SmoothingTarget, SurfaceSpline};
use faircurve::topology::{self, Topology};
use faircurve::{CurveBatch, Deviation, Device, Work};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::batch::Batch;
use crate::fit::Fit;
use crate::running::{self, Place};
use crate::surfaces::Surface;

/// The value of a word.
fn word<T: Copy>(what: &str, given: &str, words: &[(&str, T)]) -> PyResult<T> {
    words.iter().find(|(word, _)| *word == given).map(|(_, value)| *value).ok_or_else(|| {
        let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        PyValueError::new_err(format!("{what} is \"{given}\"; {} are possible", known.join(", ")))
    })
}

fn parametrisation(given: &str) -> PyResult<Parametrisation> {
    given.parse().map_err(|error: faircurve::Error| PyValueError::new_err(error.to_string()))
}

fn ends(given: &str) -> PyResult<Ends> {
    word("ends", given, &[("auto", Ends::Auto), ("natural", Ends::Natural), ("clamped", Ends::Clamped)])
}

/// [`fitted`] by a method of the library.
macro_rules! fitted {
    ($py:ident, $batch:ident, $device:ident, $precision:ident, $method:ident) => {{
        let place = Place::new($device, $precision)?;
        fitted($py, $batch, place, |points| $method.work(points), |batch, device| $method.fit(batch, device))
    }};
}

fn fitted(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    place: Place,
    work: impl FnOnce(usize) -> Work,
    fit: impl Fn(&CurveBatch, &Device) -> faircurve::Result<faircurve::Fit> + Send + Sync,
) -> PyResult<Fit> {
    let curves = &batch.get().batch;
    let place = place.counting(curves.len());
    let topology = batch.get().topology.then(|| Topology::new(curves, &topology::Options::of(curves)));
    let Some(topology) = topology.transpose().map_err(crate::error)? else {
        let fit = running::run(py, &place, work(curves.total_points()), |device| fit(curves, device))?;
        return Ok(Fit { fit, batch: batch.clone().unbind(), shared: None });
    };
    let mut shared = None;
    let joined = running::run(py, &place, work(curves.total_points()), |device| {
        let strokes = fit(topology.strokes(), device)?;
        // Where a stroke through junctions has no fit, its arcs have.
        let (topology, strokes) = match topology.divide(&strokes) {
            None => (topology.clone(), strokes),
            Some(divided) => {
                let arcs = fit(divided.arcs(), device)?;
                divided.with(strokes, arcs)
            }
        };
        let joined = topology.join(strokes.clone());
        shared = Some((topology, strokes));
        Ok(joined)
    })?;
    Ok(Fit { fit: joined, batch: batch.clone().unbind(), shared })
}

#[pyfunction]
pub fn natural(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    ends: &str,
    parametrisation: &str,
    preserve_shape: bool,
    device: &str,
    precision: &str,
) -> PyResult<Fit> {
    let method = Natural {
        ends: self::ends(ends)?,
        parametrisation: self::parametrisation(parametrisation)?,
        shape: preserve_shape,
    };
    fitted!(py, batch, device, precision, method)
}

/// Natural splines in a surface, or with λ smoothing ones.
#[pyfunction]
#[pyo3(signature = (batch, surface, off_surface, ends, smoothing, pin_ends, parametrisation, device, precision))]
pub fn in_surface(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    surface: &Bound<'_, Surface>,
    off_surface: Option<f64>,
    ends: &str,
    smoothing: Option<(&str, &str)>,
    pin_ends: bool,
    parametrisation: &str,
    device: &str,
    precision: &str,
) -> PyResult<Fit> {
    let method = SurfaceSpline {
        off_surface,
        ends: self::ends(ends)?,
        smoothing: smoothing.map(|(amount, value)| target(amount, value)).transpose()?,
        pin_ends,
        parametrisation: self::parametrisation(parametrisation)?,
        ..SurfaceSpline::new(surface.get().shared())
    };
    fitted!(py, batch, device, precision, method)
}

/// A λ or a distance, for all curves or for each.
#[derive(FromPyObject)]
pub enum Value {
    All(String),
    Each(Vec<f64>),
}

/// How much is smoothed: λ, "gcv" for one by cross-validation, or a distance.
fn target(amount: &str, value: &str) -> PyResult<SmoothingTarget> {
    let distance = || value.parse::<Deviation>().map_err(crate::error);
    Ok(match (amount, value) {
        ("lam", "gcv") => SmoothingTarget::CrossValidation,
        ("lam", _) => SmoothingTarget::Lambda(value.parse()?),
        ("deviation", _) => SmoothingTarget::Deviation(distance()?),
        _ => SmoothingTarget::Tube(distance()?),
    })
}

#[pyfunction]
#[pyo3(signature = (batch, amount, value, corners, pin_ends, parametrisation, device, precision))]
pub fn smoothing(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    amount: &str,
    value: Value,
    corners: &str,
    pin_ends: bool,
    parametrisation: &str,
    device: &str,
    precision: &str,
) -> PyResult<Fit> {
    let parametrised = || self::parametrisation(parametrisation);
    let target = match (amount, &value) {
        ("within", Value::All(value)) => {
            let distance = value.parse::<Deviation>().map_err(crate::error)?;
            if !["auto", "chord"].contains(&parametrisation) {
                let message =
                    format!("parametrisation is {parametrisation:?}; within goes by arc length: leave it out");
                return Err(PyValueError::new_err(message));
            }
            let mut method = Band::within(distance);
            method.pin_ends = pin_ends;
            method.corners = match corners {
                "none" => Corners::Rounded,
                "auto" => Corners::Auto,
                "straight" => Corners::Straight,
                degrees => Corners::Above(degrees.parse::<f64>()?.to_radians()),
            };
            return fitted!(py, batch, device, precision, method);
        }
        (_, Value::All(value)) => target(amount, value)?,
        (_, Value::Each(values)) => {
            let targets =
                values.iter().map(|value| target(amount, &value.to_string())).collect::<PyResult<Vec<_>>>()?;
            let method = Smoothing {
                target: targets.first().copied().unwrap_or(SmoothingTarget::Lambda(0.0)),
                pin_ends,
                parametrisation: parametrised()?,
            };
            let place = Place::new(device, precision)?;
            let fit = |batch: &CurveBatch, device: &Device| method.fit_each(batch, &targets, device);
            return fitted(py, batch, place, |points| method.work(points), fit);
        }
    };
    let method = Smoothing { target, pin_ends, parametrisation: parametrised()? };
    fitted!(py, batch, device, precision, method)
}

/// The exponent or the formula of an energy.
#[derive(FromPyObject)]
pub enum Detail {
    Exponent(f64),
    /// The edges, the degree and the steps of a custom energy.
    Formula(usize, f64, Vec<Step>),
}

/// An operation, its number, and the steps that it takes.
type Step = (String, f64, Vec<usize>);

/// A custom energy, whose steps are recorded once more.
fn custom(name: &str, edges: usize, degree: f64, steps: &[Step]) -> PyResult<Energy> {
    let is_known = |(at, (kind, number, operands)): (usize, &Step)| {
        let count = match kind.as_str() {
            "number" => Some(0),
            "x" | "y" | "z" | "length" if *number >= 0.0 && *number < edges as f64 => Some(0),
            "sqrt" | "power" => Some(1),
            "add" | "subtract" | "multiply" | "divide" => Some(2),
            "if_positive" => Some(3),
            _ => None,
        };
        count == Some(operands.len()) && operands.iter().all(|&operand| operand < at)
    };
    if !(1..=MOST_EDGES).contains(&edges) {
        return Err(PyValueError::new_err(format!(
            "a term of the energy {name} is of {edges} edges; 1 to {MOST_EDGES} are possible"
        )));
    }
    if steps.is_empty() || !steps.iter().enumerate().all(is_known) {
        return Err(PyValueError::new_err(format!("the formula of {name} is not one that custom() recorded")));
    }
    Ok(Energy::custom(name, edges, degree, |t, s| {
        let mut found: Vec<Expression<'_>> = Vec::with_capacity(steps.len());
        for (kind, number, operands) in steps {
            let (edge, of) = (*number as usize, |k: usize| found[operands[k]]);
            found.push(match kind.as_str() {
                "x" => t[edge].x,
                "y" => t[edge].y,
                "z" => t[edge].z,
                "length" => s[edge],
                "sqrt" => of(0).sqrt(),
                "power" => of(0).powf(*number),
                "add" => of(0) + of(1),
                "subtract" => of(0) - of(1),
                "multiply" => of(0) * of(1),
                "divide" => of(0) / of(1),
                "if_positive" => of(0).if_positive(of(1), of(2)),
                _ => s[0].number(*number),
            });
        }
        found[steps.len() - 1]
    }))
}

/// The weighted sum of terms: names, weights and exponents or formulas.
fn energy(terms: Vec<(String, f64, Detail)>) -> PyResult<Energy> {
    let mut sum = Energy::default();
    for (name, weight, detail) in terms {
        let named = match &detail {
            Detail::Exponent(_) => Energy::named(&name),
            Detail::Formula(edges, degree, steps) => Some(custom(&name, *edges, *degree, steps)?),
        };
        let Some(energy) = named else {
            let known = Energy::NAMES.join(", ");
            return Err(PyValueError::new_err(format!("there is no energy \"{name}\": {known} are possible")));
        };
        if !(weight >= 0.0 && weight.is_finite()) {
            let sentence = format!("the weight of {name} is {weight}; weights are 0 or positive numbers");
            return Err(PyValueError::new_err(sentence));
        }
        if weight > 0.0 {
            let energy = match detail {
                Detail::Exponent(exponent) if name.ends_with("bending") => energy.with_exponent(exponent),
                _ => energy,
            };
            sum = sum + weight * energy;
        }
    }
    Ok(sum)
}

/// The limits of fair curves, by the names of `Fair`'s fields. Regions are a vector and a number each.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Limited {
    max_curvature: Option<f64>,
    max_curvature_rate: Option<f64>,
    max_climb: Option<f64>,
    preserve_shape: bool,
    monotone: Vec<[f64; 3]>,
    corridor: Option<f64>,
    half_spaces: Vec<([f64; 3], f64)>,
    keep_in: Vec<([f64; 3], f64)>,
    keep_out: Vec<([f64; 3], f64)>,
    /// Corners, and the curve that stays out of them, or all.
    obstacles: Vec<(Vec<[f64; 2]>, Option<usize>)>,
    clearance: Option<f64>,
    max_stretch: Option<f64>,
    preserve_area: bool,
    no_crossing: bool,
}

impl Limited {
    fn limits(self) -> Limits {
        let half_spaces = self.half_spaces.into_iter().map(|(normal, offset)| Region::HalfSpace { normal, offset });
        let inside = self.keep_in.into_iter().map(|(center, radius)| Region::Inside { center, radius });
        let outside = self.keep_out.into_iter().map(|(center, radius)| Region::Outside { center, radius });
        let obstacle = |(k, (corners, curve)): (usize, (Vec<[f64; 2]>, Option<usize>))| Obstacle {
            corners,
            name: k.to_string(),
            curve: curve.map(|i| i.to_string()),
        };
        let limits = Limits {
            curvature: self.max_curvature,
            curvature_rate: self.max_curvature_rate,
            climb: self.max_climb,
            shape: self.preserve_shape,
            monotone: self.monotone,
            corridor: self.corridor,
            regions: half_spaces.chain(inside).chain(outside).collect(),
            stretch: self.max_stretch,
            area: self.preserve_area,
            no_crossing: self.no_crossing,
            obstacles: self.obstacles.into_iter().enumerate().map(obstacle).collect(),
        };
        match self.clearance {
            Some(clearance) => limits.with_clearance(clearance),
            None => limits,
        }
    }
}

#[pyfunction]
#[pyo3(signature = (batch, terms, per_span, spacing, pins, deviation, limits, surface, off_surface, corners, solver, tolerance, max_iterations, starts, seed, device, precision))]
pub fn fair(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    terms: Vec<(String, f64, Detail)>,
    per_span: usize,
    spacing: Option<f64>,
    pins: &str,
    deviation: Option<Value>,
    limits: Limited,
    surface: Option<&Bound<'_, Surface>>,
    off_surface: Option<f64>,
    corners: Option<f64>,
    solver: &str,
    tolerance: f64,
    max_iterations: u32,
    starts: u32,
    seed: u64,
    device: &str,
    precision: &str,
) -> PyResult<Fit> {
    let (all, each) = match deviation {
        None => (None, None),
        Some(Value::All(deviation)) => (Some(deviation.parse().map_err(crate::error)?), None),
        Some(Value::Each(deviations)) => (None, Some(deviations.into_iter().map(Deviation::Units).collect::<Vec<_>>())),
    };
    let method = Fair {
        energy: energy(terms)?,
        segments: spacing.map_or(Segments::PerSpan(per_span), Segments::Spacing),
        pins: pins.parse().map_err(crate::error)?,
        deviation: all,
        limits: limits.limits(),
        surface: surface.map(|surface| surface.get().shared()),
        off_surface,
        corners: corners.map(f64::to_radians),
        solver: solver.parse().map_err(crate::error)?,
        tolerance,
        max_iterations,
        starts,
        seed,
    };
    let place = Place::new(device, precision)?;
    let fit = |batch: &CurveBatch, device: &Device| match &each {
        Some(each) => method.fit_each(batch, each, device),
        None => method.fit(batch, device),
    };
    fitted(py, batch, place, |points| method.work(points), fit)
}

#[pyfunction]
#[pyo3(signature = (batch, exponent, tension, preserve_shape, start, starts, seed, tolerance, max_iterations, device, precision))]
pub fn smooth(
    py: Python<'_>,
    batch: &Bound<'_, Batch>,
    exponent: f64,
    tension: f64,
    preserve_shape: bool,
    start: &str,
    starts: u32,
    seed: u64,
    tolerance: f64,
    max_iterations: u32,
    device: &str,
    precision: &str,
) -> PyResult<Fit> {
    let words = [("circle", Start::Circle), ("bisector", Start::Bisector), ("neighbours", Start::Neighbours)];
    let start = word("start", start, &words)?;
    let method = Smooth { exponent, tension, shape: preserve_shape, start, starts, seed, tolerance, max_iterations };
    fitted!(py, batch, device, precision, method)
}
