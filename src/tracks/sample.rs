//! Samples of fitted curves with columns and quantities.

use std::borrow::Cow;

use super::{Easing, Quantity, carried};
use crate::batch::{CurveBatch, Values};
use crate::curve::{Curve, Sampling, excess, rounded_up, sample_bytes};
use crate::error::{Error, Result, short};
use crate::memory::number;
use crate::parallel;
use crate::report::Fit;

/// Where curves are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum At<'a> {
    /// By a [`Sampling`].
    Along(Sampling),
    /// At every multiple of this time (> 0) within the times of each curve.
    ///
    /// If times are dates, days begin at midnight of their zone.
    Every(f64),
    /// At these times within the times of each curve: one list per curve, in any order.
    Times(&'a [Vec<f64>]),
}

/// Samples of fitted curves, with their times.
///
/// - Samples at times are open curves.
/// - The parameter of a sample is its time. Within a span, time is proportional to the method's
///   parameter, such as arc length.
/// - The batch's [columns](CurveBatch::columns) are interpolated as their [`Values`] say: numbers in
///   proportion to the time, angles the short way round, texts by the nearer data point.
/// - The columns of `quantities` follow, called `curve_speed` and so on if the batch has such a
///   column. They are NaN for unfitted curves.
/// - An unfitted curve has its data points as samples, and so has a curve without parameters if
///   samples are at times.
///
/// `fit` is a fit of `batch`.
///
/// # Errors
/// - Times or speeds for a batch without parameters.
/// - A step that is not positive and finite.
/// - A number of lists other than the number of curves.
/// - More samples than [`Sampling::MOST_SAMPLES`], and the errors of [`Sampling::check`].
pub fn sample(batch: &CurveBatch, fit: &Fit, at: &At, quantities: &[Quantity]) -> Result<CurveBatch> {
    sample_eased(batch, fit, at, quantities, &[])
}

/// Samples of fitted curves at times, as by [`sample`], with spans that are passed as `easings` say: one
/// per point, for the span after it. Columns are eased too, and speeds include the easing.
///
/// # Errors
/// - Those of [`sample`].
/// - A number of easings other than 0 and the number of points.
/// - Easings for samples that are not at times, or with [`Quantity::Acceleration`].
pub fn sample_eased(
    batch: &CurveBatch,
    fit: &Fit,
    at: &At,
    quantities: &[Quantity],
    easings: &[Easing],
) -> Result<CurveBatch> {
    check(batch, at, quantities)?;
    let (given, points) = (easings.len(), batch.total_points());
    if given > 0 && given != points {
        return Err(Error::argument(format!("there are {given} easings for {points} points: give one per point")));
    }
    if given > 0 && matches!(at, At::Along(_)) {
        return Err(Error::argument("easings are of time: ask for samples at times"));
    }
    if given > 0 && quantities.contains(&Quantity::Acceleration) {
        return Err(Error::argument("accelerations are of curves that are not eased: leave them out, or the easings"));
    }
    let samples = parallel::map(batch.len(), 1, |i| of_curve(batch, &*fit.curve(i), i, at, quantities, easings));
    let mut columns = carried::empty(batch);
    // Planar points gain heights on a terrain.
    let dimension = if fit.is_empty() { batch.dimension() } else { fit.curve(0).dimension() };
    for mut column in quantities.iter().flat_map(|quantity| quantity.columns(dimension)) {
        if columns.iter().any(|carried| carried.name == column.name) {
            column.name = format!("curve_{}", column.name);
        }
        columns.push(column);
    }
    let closed = (0..batch.len()).map(|i| batch.is_closed(i) && !samples[i].at_times).collect();
    let (mut points, mut ends) = (Vec::with_capacity(samples.len()), Vec::new());
    for (i, of_curve) in samples.into_iter().enumerate() {
        carried::push(batch, i, &of_curve.knots, &of_curve.sites, &mut columns);
        for (column, values) in columns[batch.columns().len()..].iter_mut().zip(&of_curve.quantities) {
            match &mut column.values {
                Values::Numbers(numbers) => numbers.extend(values),
                _ => unreachable!("quantities are numbers"),
            }
        }
        ends.push(of_curve.knots.last().copied().unwrap_or(0.0));
        points.push((of_curve.coords, of_curve.t));
    }
    let closing = |i: usize, last: f64| ends[i] - last;
    let origin = batch.origin().clone();
    let problems = batch.problems().clone();
    CurveBatch::from_samples(dimension, points, closing, closed, problems, origin).with_columns(columns)
}

pub(crate) fn check(batch: &CurveBatch, at: &At, quantities: &[Quantity]) -> Result<()> {
    let timed = batch.is_empty() || batch.has_parameters();
    let untimed = |what: &str| {
        Error::argument(format!("{what} needs times, and the points have none: give them parameters, a column t"))
    };
    if let Some(quantity) = quantities.iter().find(|quantity| quantity.is_timed() && !timed) {
        return Err(untimed(&format!("the {}", quantity.word().replace('_', " "))));
    }
    match at {
        At::Along(sampling) => sampling.check_with(batch, columns_out(batch, quantities)),
        At::Every(_) | At::Times(_) if !timed => Err(untimed("a sample at a time")),
        At::Every(step) if !(*step > 0.0 && step.is_finite()) => {
            Err(Error::argument(format!("the time between samples is {step}; it must be a positive number")))
        }
        At::Every(step) => {
            let length = |i: usize| batch.given_knots(i).map_or(0.0, |t| t[t.len() - 1] - t[0]);
            let samples: f64 = (0..batch.len()).map(|i| length(i) / step).sum();
            let bytes = sample_bytes(batch, columns_out(batch, quantities));
            let Some((most, limit)) = excess(samples, bytes, Sampling::MOST_SAMPLES) else { return Ok(()) };
            let unit = if batch.has_dates() { " s" } else { "" };
            Err(Error::argument(format!(
                "a sample every {}{unit} makes {} of all curves, which {limit}: give {}{unit} or more",
                short(*step),
                number(samples),
                rounded_up(step * samples / most)
            )))
        }
        At::Times(times) if times.len() != batch.len() => {
            let (lists, curves) = (times.len(), batch.len());
            Err(Error::argument(format!("there are {lists} lists of times for {curves} curves: give one per curve")))
        }
        At::Times(_) => Ok(()),
    }
}

/// The number of columns of samples.
pub(crate) fn columns_out(batch: &CurveBatch, quantities: &[Quantity]) -> usize {
    let own: usize = quantities.iter().map(|quantity| quantity.columns(batch.dimension()).len()).sum();
    own + batch.columns().len()
}

/// The samples of a curve.
struct Samples {
    sites: Vec<(usize, f64)>,
    coords: Vec<f64>,
    t: Vec<f64>,
    /// The parameters of the points, and the one at which the curve ends.
    knots: Vec<f64>,
    quantities: Vec<Vec<f64>>,
    /// Whether the samples are at given times.
    at_times: bool,
}

fn of_curve(
    batch: &CurveBatch,
    curve: &dyn Curve,
    i: usize,
    at: &At,
    quantities: &[Quantity],
    easings: &[Easing],
) -> Samples {
    let given = batch.given_knots(i);
    let knots = given.as_deref().map_or_else(|| Cow::Borrowed(curve.knots()), Cow::Borrowed);
    let time = |(span, u): (usize, f64)| match (knots.get(span), knots.get(span + 1)) {
        // Parameters of unfitted points may be NaN.
        (Some(from), Some(to)) if u != 0.0 && curve.is_fitted() => (from + u * (to - from)).min(*to),
        (Some(from), Some(to)) if u != 0.0 => from + u * (to - from),
        (Some(from), _) => *from,
        _ => 0.0,
    };
    let end = knots.last().copied().unwrap_or(0.0);
    let all = || curve.sites(Sampling::PerSpan(1));
    let is_timed = curve.is_fitted() && batch.parameters(i).is_some();
    let times = if is_timed { times(batch, i, at, [knots[0], end]) } else { None };
    let mut sites: Vec<(usize, f64)> = match (at, &times) {
        (_, Some(times)) => times.iter().map(|&t| site(&knots, t)).collect(),
        (At::Along(sampling), None) => curve.sites(*sampling),
        _ => all(),
    };
    let at_times = times.is_some();
    let mut rates = vec![1.0; sites.len()];
    if at_times && !easings.is_empty() {
        for ((span, u), rate) in sites.iter_mut().zip(&mut rates) {
            [*u, *rate] = easings[batch.offsets()[i] + *span].with_rate(*u);
        }
    }
    let t = match times {
        Some(times) => times,
        None => sites.iter().map(|&site| time(site)).collect(),
    };
    let point = |&(span, u): &(usize, f64)| curve.jet(span, u).point.to_array().into_iter().take(curve.dimension());
    let coords = sites.iter().flat_map(point).collect();
    let geographic = batch.is_geographic();
    let of = |&quantity: &Quantity| {
        let mut columns = quantity.of(curve, &sites, given.as_deref(), geographic);
        if matches!(quantity, Quantity::Speed | Quantity::TurnRate) {
            columns.iter_mut().flatten().zip(&rates).for_each(|(own, rate)| *own *= rate);
        }
        columns
    };
    let quantities = quantities.iter().flat_map(of).collect();
    Samples { sites, coords, t, knots: knots.into_owned(), quantities, at_times }
}

/// The times of samples of curve `i` within its times.
pub(crate) fn times(batch: &CurveBatch, i: usize, at: &At, [from, to]: [f64; 2]) -> Option<Vec<f64>> {
    match at {
        At::Along(_) => None,
        At::Every(step) => {
            Some(multiples(from, to, *step, batch.origin().clock(i).map_or(0.0, |clock| clock.offset())))
        }
        At::Times(times) => Some(times[i].iter().copied().filter(|&t| from <= t && t <= to).collect()),
    }
}

/// The multiples of a step between two times, offset by `offset` seconds from UTC.
fn multiples(from: f64, to: f64, step: f64, offset: f64) -> Vec<f64> {
    let first = ((from + offset) / step).ceil();
    let last = ((to + offset) / step).floor();
    let count = if last >= first { (last - first) as usize + 1 } else { 0 };
    (0..count).map(|k| ((first + k as f64) * step - offset).clamp(from, to)).collect()
}

/// The span of a time, and the fraction there. For the last time it is the end of the last span of
/// positive length.
fn site(knots: &[f64], t: f64) -> (usize, f64) {
    let last = knots.partition_point(|&knot| knot < knots[knots.len() - 1]).saturating_sub(1);
    let span = knots.partition_point(|&knot| knot <= t).saturating_sub(1).min(last);
    let length = knots[span + 1] - knots[span];
    (span, if length > 0.0 { ((t - knots[span]) / length).clamp(0.0, 1.0) } else { 0.0 })
}
