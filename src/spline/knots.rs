//! [`Knots`]: the distinct knots of every curve of a batch, ready to be fitted on the CPU or on a GPU.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use crate::batch::{CurveBatch, Unfitted, distance};
use crate::error::{Error, Result};
use crate::linalg::{take, tasks};
use crate::parallel;
use crate::ragged;
use crate::report::CurveReport;
use crate::status::CurveStatus;
use crate::words::words;

/// How the data points of a curve get their parameters t.
///
/// Points that follow each other at one parameter become one knot where they are equal, so that
/// repeated points do no harm under chord length. Different points at one parameter cannot be
/// interpolated ([`CurveStatus::Degenerate`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Parametrisation {
    /// The batch's parameters where it has any. Else centripetal for [`Natural`](super::Natural)
    /// splines without given tangents and curvatures, and chord length for those and for
    /// [`Smoothing`](super::Smoothing): the lengths of tangents, and λ, are in its units.
    #[default]
    Auto,
    /// 0, 1, 2, …; a closed curve's last span has length 1 as well.
    Uniform,
    /// Steps of t equal to the distances between points: close to arc length, so p″ is close to
    /// curvature.
    ChordLength,
    /// Steps of t proportional to the square roots of the distances, and in total as long as their polygon, so that
    /// t is a length still. Splines stay nearer to the polygon where
    /// distances are uneven, and cross themselves least: `benches/RESULTS.md` has the table. Source: E. T. Y.
    /// Lee, *Choosing nodes in parametric curve interpolation*, 1989.
    Centripetal,
    /// The batch's parameters; an error where it has none. The closing span of a closed curve is as
    /// long as the batch says; where it says nothing, the closing chord times the mean parameter
    /// length per unit of chord of the other spans.
    Given,
}

words!(Parametrisation, "parametrisation": [
    (Auto, "auto", "The column t where there is one; else centripetal for natural splines, chord for smoothing"),
    (ChordLength, "chord", "Steps as long as the distances of points"),
    (Centripetal, "centripetal", "Steps proportional to the square roots of the distances"),
    (Uniform, "uniform", "Equal steps"),
    (Given, "given", "The column t"),
]);

/// What becomes of different points at one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coincident {
    /// The curve is degenerate: no curve interpolates them.
    Refuse,
    /// One knot at their weighted mean that carries the sum of their weights: for a sum of weighted
    /// squares this changes the objective by a constant only, so the minimiser is the same.
    Average,
}

/// The knots of all curves, flat.
///
/// Curve `i` owns the entries `offsets[i] .. offsets[i + 1]`: none where it cannot be fitted, and
/// otherwise at least two. A closed curve's first knot is repeated as its last entry, one period
/// later, so that the spans of every curve lie between consecutive entries.
#[derive(Clone, Debug)]
pub(crate) struct Knots {
    /// 2 or 3.
    pub dimension: usize,
    /// First entry of every curve, and the number of all entries at the end.
    pub offsets: Vec<usize>,
    /// Parameters, strictly increasing within a curve.
    pub t: Arc<Vec<f64>>,
    /// The points at the knots, `dimension` numbers each.
    pub values: Arc<Vec<f64>>,
    /// The weights at the knots, 1 a data point where the batch has none; only with
    /// [`Coincident::Average`].
    pub weights: Option<Vec<f64>>,
    /// Whether the last entry repeats the first.
    pub closed: Vec<bool>,
    /// For curves whose data points are not one to one with their entries: the entry (counted
    /// within the curve) of every data point, and for a closed curve of its first point again at
    /// the end.
    pub repeats: BTreeMap<usize, Vec<u32>>,
    /// Why curves own no entry.
    pub unfitted: BTreeMap<usize, Unfitted>,
}

impl Knots {
    /// Curve `i` comes out as its polyline: the device was lost before it was fitted.
    pub fn leave_unfitted(&mut self, batch: &CurveBatch, i: usize, why: &str) {
        let message = batch.sentence(i, 0, &format!("it was not fitted: {why}"));
        self.unfitted.entry(i).or_insert(Unfitted { status: CurveStatus::NotConverged, message });
    }

    /// The report of curve `i`, if it is not fitted.
    pub fn report_unfitted(&self, i: usize) -> Option<CurveReport> {
        let Unfitted { status, message } = self.unfitted.get(&i)?;
        Some(CurveReport::unfitted(*status, message.clone()))
    }

    /// The knots of every curve of a batch.
    ///
    /// # Errors
    /// [`Parametrisation::Given`] for a batch without parameters.
    pub fn new(batch: &CurveBatch, parametrisation: Parametrisation, coincident: Coincident) -> Result<Self> {
        let has_parameters = batch.has_parameters();
        if parametrisation == Parametrisation::Given && !has_parameters && !batch.is_empty() {
            return Err(Error::argument(
                "the given parametrisation needs a parameter for every point, but the batch has none: \
                 add a column t, or choose chord length",
            ));
        }
        // A curve without parameters beside others that have them is fitted as it is alone.
        let constraints = batch.constraints();
        let in_lengths = coincident == Coincident::Average
            || constraints.tangents.is_some()
            || constraints.curvatures.is_some()
            || !has_parameters;
        let rule = |i: usize| match parametrisation {
            Parametrisation::Auto if batch.parameters(i).is_some() => Parametrisation::Given,
            Parametrisation::Auto if in_lengths => Parametrisation::ChordLength,
            Parametrisation::Auto => Parametrisation::Centripetal,
            other => other,
        };
        if coincident == Coincident::Refuse
            && let Some(knots) = Self::one_a_point(batch, &rule)
        {
            return Ok(knots);
        }
        let d = batch.dimension();
        let closed: Vec<bool> = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
        // Room for every data point; curves that need less are moved together afterwards, which is
        // rare.
        let room = |i: usize| if batch.count(i) > 0 { batch.count(i) + usize::from(closed[i]) } else { 0 };
        let offsets = ragged::offsets((0..batch.len()).map(room));
        let total = offsets[batch.len()];
        let average = coincident == Coincident::Average;
        let mut t = vec![0.0; total];
        let mut values = vec![0.0; total * d];
        let mut weights = vec![0.0; if average { total } else { 0 }];
        let (mut t_rest, mut values_rest, mut weights_rest) = (&mut t[..], &mut values[..], &mut weights[..]);
        let mut work = Vec::new();
        for curves in tasks(&offsets) {
            let room = offsets[curves.end] - offsets[curves.start];
            work.push((
                curves,
                take(&mut t_rest, room),
                take(&mut values_rest, room * d),
                take(&mut weights_rest, if average { room } else { 0 }),
            ));
        }
        let exceptions = parallel::of(work, |(curves, mut t, mut values, mut weights)| {
            let mut exceptions = Vec::<Exception>::new();
            for i in curves {
                let room = offsets[i + 1] - offsets[i];
                let slots = Slots {
                    t: take(&mut t, room),
                    values: take(&mut values, room * d),
                    weights: average.then(|| take(&mut weights, room)),
                };
                match slots.fill(batch, i, rule(i)) {
                    Ok(None) => {}
                    Ok(Some(merged)) => exceptions.push((i, Ok(merged))),
                    Err(problem) => exceptions.push((i, Err(problem))),
                }
            }
            exceptions
        });
        let mut knots = Knots {
            dimension: d,
            offsets,
            t: Arc::new(t),
            values: Arc::new(values),
            weights: average.then_some(weights),
            closed,
            repeats: BTreeMap::new(),
            unfitted: BTreeMap::new(),
        };
        knots.compact(exceptions.into_iter().flatten().collect());
        Ok(knots)
    }

    /// The knots of open curves that have one a point, which most have: arrays of the batch are
    /// shared then, not copied.
    fn one_a_point(batch: &CurveBatch, rule: &(dyn Fn(usize) -> Parametrisation + Sync)) -> Option<Self> {
        let is_open = |i: usize| !batch.is_closed(i) && batch.count(i) > 1 && batch.problem(i).is_none();
        if !(0..batch.len()).all(is_open) {
            return None;
        }
        let offsets = batch.offsets();
        let is_given = |i: usize| rule(i) == Parametrisation::Given && batch.parameters(i).is_some();
        let t = match batch.shared_parameters() {
            Some(given) if (0..batch.len()).all(is_given) => given.clone(),
            _ => {
                let mut t = vec![0.0; batch.total_points()];
                parallel::parts(&mut t, offsets, |i, t| {
                    // What is wrong with a curve does not increase, and is said where curves are copied.
                    let _ = parameters(t, batch, i, rule(i));
                });
                Arc::new(t)
            }
        };
        let good = parallel::map(batch.len(), 1024, |i| increase(&t[offsets[i]..offsets[i + 1]]));
        good.into_iter().all(|good| good).then(|| Knots {
            dimension: batch.dimension(),
            offsets: offsets.to_vec(),
            t,
            values: batch.shared_coords().clone(),
            weights: None,
            closed: vec![false; batch.len()],
            repeats: BTreeMap::new(),
            unfitted: BTreeMap::new(),
        })
    }

    /// Moves the curves together where some use less than their room.
    fn compact(&mut self, exceptions: Vec<Exception>) {
        let Some(first) = exceptions.first().map(|(i, _)| *i) else { return };
        let mut exceptions = exceptions.into_iter().peekable();
        let (d, mut end) = (self.dimension, self.offsets[first]);
        let (t, values) = (Arc::make_mut(&mut self.t), Arc::make_mut(&mut self.values));
        let mut from = end;
        for i in first..self.closed.len() {
            let next = self.offsets[i + 1];
            let count = match exceptions.next_if(|(curve, _)| *curve == i) {
                Some((_, Ok((count, entries)))) => {
                    self.repeats.insert(i, entries);
                    count
                }
                Some((_, Err(problem))) => {
                    self.unfitted.insert(i, problem);
                    0
                }
                None => next - from,
            };
            t.copy_within(from..from + count, end);
            values.copy_within(from * d..(from + count) * d, end * d);
            if let Some(weights) = &mut self.weights {
                weights.copy_within(from..from + count, end);
            }
            end += count;
            self.offsets[i + 1] = end;
            from = next;
        }
        t.truncate(end);
        values.truncate(end * d);
        if let Some(weights) = &mut self.weights {
            weights.truncate(end);
        }
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.closed.len()
    }

    /// The entries of curve `i`.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }

    /// The parameters of curve `i`'s entries.
    pub fn t(&self, i: usize) -> &[f64] {
        &self.t[self.range(i)]
    }

    /// The points at curve `i`'s entries.
    pub fn values(&self, i: usize) -> &[f64] {
        &self.values[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }
}

/// Writes the parameter of every data point and, for a closed curve, of its end.
fn parameters(t: &mut [f64], batch: &CurveBatch, i: usize, rule: Parametrisation) -> Result<(), Unfitted> {
    let (n, d, points) = (batch.count(i), batch.dimension(), batch.points(i));
    let invalid = |k: usize, what: &str| Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, what) };
    let point = |k: usize| &points[k * d..(k + 1) * d];
    let chord = |k: usize| distance(point(k), point(if k + 1 == n { 0 } else { k + 1 }));
    let entries = t.len();
    match (rule, batch.parameters(i)) {
        (Parametrisation::Given, None) => {
            let what = "the given parametrisation needs a parameter for every point, and the curve has none: \
                        add them, or choose another parametrisation";
            return Err(invalid(0, what));
        }
        (Parametrisation::Given | Parametrisation::Auto, Some(given)) => {
            t[..n].copy_from_slice(given);
            if entries > n {
                let length = match batch.closing_span(i) {
                    Some(length) if length >= 0.0 && length.is_finite() => length,
                    Some(length) => {
                        let what = format!(
                            "the parameter length of the span that closes the curve is {length}; it must be positive and finite"
                        );
                        return Err(invalid(n - 1, &what));
                    }
                    None => batch.closing_length(i, given),
                };
                t[n] = given[n - 1] + length;
            }
        }
        (Parametrisation::Uniform, _) => {
            t.iter_mut().enumerate().for_each(|(k, t)| *t = k as f64);
        }
        _ => {
            t[0] = 0.0;
            let mut length = 0.0;
            for k in 0..entries - 1 {
                let step = chord(k);
                length += step;
                t[k + 1] = t[k] + if rule == Parametrisation::Centripetal { step.sqrt() } else { step };
            }
            if rule == Parametrisation::Centripetal && length > 0.0 && length.is_finite() {
                let total = t[entries - 1];
                t.iter_mut().for_each(|t| *t = length * (*t / total));
            }
        }
    }
    let length = t[entries - 1] - t[0];
    if !length.is_finite() {
        let what = format!(
            "the parameter length of the curve is {length}; it must stay below 1.8e308: divide the numbers by a common factor"
        );
        return Err(invalid(0, &what));
    }
    Ok(())
}

/// Whether they increase strictly, over a length that is a number.
fn increase(t: &[f64]) -> bool {
    t.windows(2).fold(true, |so_far, pair| so_far & (pair[0] < pair[1])) && (t[t.len() - 1] - t[0]).is_finite()
}

/// How many entries a curve with merged points is left with, and the entry of every data point.
type Merged = (usize, Vec<u32>);

/// A curve that does not use all its room.
type Exception = (usize, Result<Merged, Unfitted>);

/// The room of one curve in the flat arrays.
struct Slots<'a> {
    t: &'a mut [f64],
    values: &'a mut [f64],
    weights: Option<&'a mut [f64]>,
}

impl Slots<'_> {
    /// Writes the knots of curve `i`; where data points were merged, says how many entries are left
    /// and which entry every data point belongs to.
    fn fill(mut self, batch: &CurveBatch, i: usize, rule: Parametrisation) -> Result<Option<Merged>, Unfitted> {
        if let Some(problem) = batch.problem(i) {
            return Err(problem.clone());
        }
        let points = batch.points(i);
        let degenerate =
            |k: usize, what: &str| Unfitted { status: CurveStatus::Degenerate, message: batch.sentence(i, k, what) };
        if points.is_empty() {
            return Err(degenerate(0, "the curve has no point; it needs two distinct ones: add them, or remove it"));
        }
        parameters(self.t, batch, i, rule)?;
        let (n, entries, d) = (batch.count(i), self.t.len(), batch.dimension());
        let merged = if increase(self.t) {
            self.values[..points.len()].copy_from_slice(points);
            self.values.copy_within(0..(entries - n) * d, points.len());
            if let Some(weights) = &mut self.weights {
                match batch.weights(i) {
                    Some(given) => weights[..n].copy_from_slice(given),
                    None => weights[..n].fill(1.0),
                }
                weights.copy_within(0..entries - n, n);
            }
            None
        } else {
            Some(self.merge(batch, i)?)
        };
        let count = merged.as_ref().map_or(entries, |(count, _)| *count);
        if count - (entries - n) < 2 {
            let what = if n == 1 {
                "the curve has this point only; it needs two distinct ones: add one, or remove the curve"
            } else {
                "all points of the curve are one and the same; it needs two distinct ones: remove the curve"
            };
            return Err(degenerate(0, what));
        }
        Ok(merged)
    }

    /// Makes one knot of the data points at each parameter.
    fn merge(&mut self, batch: &CurveBatch, i: usize) -> Result<Merged, Unfitted> {
        let (n, d, points) = (batch.count(i), batch.dimension(), batch.points(i));
        let weight = |k: usize| batch.weights(i).map_or(1.0, |weights| weights[k]);
        let mut at = Vec::with_capacity(self.t.len());
        let mut last = 0;
        self.values[..d].copy_from_slice(&points[..d]);
        if let Some(weights) = &mut self.weights {
            weights[0] = weight(0);
        }
        at.push(0);
        for k in 1..self.t.len() {
            let new = self.t[k] > self.t[last];
            last += usize::from(new);
            self.t[last] = self.t[k];
            at.push(last as u32);
            if k == n {
                // The first point again.
                if !new {
                    let point: Vec<f64> = self.values[last * d..(last + 1) * d].to_vec();
                    let weight = self.weights.as_ref().map_or(1.0, |weights| weights[last]);
                    if last > 0 {
                        self.absorb(batch, (i, n - 1), 0, &point, weight)?;
                    }
                }
                self.values.copy_within(..d, last * d);
                if let Some(weights) = &mut self.weights {
                    weights[last] = weights[0];
                }
            } else if new {
                self.values[last * d..(last + 1) * d].copy_from_slice(&points[k * d..(k + 1) * d]);
                if let Some(weights) = &mut self.weights {
                    weights[last] = weight(k);
                }
            } else {
                self.absorb(batch, (i, k), last, &points[k * d..(k + 1) * d], weight(k))?;
            }
        }
        Ok((last + 1, at))
    }

    /// Takes data point `k` of curve `i`, or the mean of several up to it, into a knot at the same
    /// parameter.
    fn absorb(
        &mut self,
        batch: &CurveBatch,
        (i, k): (usize, usize),
        knot: usize,
        point: &[f64],
        weight: f64,
    ) -> Result<(), Unfitted> {
        let d = point.len();
        let value = &mut self.values[knot * d..(knot + 1) * d];
        match &mut self.weights {
            Some(weights) => {
                weights[knot] += weight;
                let share = weight / weights[knot];
                // This form leaves the bits alone where the points are equal.
                value.iter_mut().zip(point).for_each(|(value, x)| *value += share * (x - *value));
                Ok(())
            }
            None if value == point => Ok(()),
            None => {
                let what = format!(
                    "a different point stands at the same parameter {}: remove one of them, or use `spline::Smoothing`, which averages them",
                    self.t[knot]
                );
                Err(Unfitted { status: CurveStatus::Degenerate, message: batch.sentence(i, k, &what) })
            }
        }
    }
}

#[cfg(test)]
mod tests;
