//! [`Knots`]: the distinct knots of every curve of a batch.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use crate::batch::{CurveBatch, Unfitted, distance};
use crate::error::{Error, Result};
use crate::linalg::tasks;
use crate::numbers::Numbers;
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
    /// Steps of t proportional to the square roots of the distances, scaled to the length of the
    /// polygon. Splines stay nearer to the polygon where distances are uneven, and cross themselves
    /// least: `benches/RESULTS.md` has the table. Source: E. T. Y. Lee, *Choosing nodes in
    /// parametric curve interpolation*, 1989.
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

/// The treatment of different points at one parameter.
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
    pub values: Arc<Numbers>,
    /// The weights at the knots, 1 a data point where the batch has none; only with
    /// [`Coincident::Average`].
    pub weights: Option<Vec<f64>>,
    /// Whether the last entry repeats the first.
    pub closed: Vec<bool>,
    /// For curves whose data points are not one to one with their entries: the entry (counted
    /// within the curve) of every data point, and for a closed curve of its first point again at
    /// the end.
    pub repeats: BTreeMap<usize, Vec<u32>>,
    /// The radius of every data point within which a curve near it goes, in units of the distance asked
    /// for: by default 1.
    pub radii: Option<Vec<f64>>,
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
        // Lengths of tangents, and λ, are in units of a parameter that is a length.
        let constraints = batch.constraints();
        let in_lengths =
            coincident == Coincident::Average || constraints.tangents.is_some() || constraints.curvatures.is_some();
        let rule = |i: usize| match parametrisation {
            Parametrisation::Auto if batch.parameters(i).is_some() => Parametrisation::Given,
            Parametrisation::Auto if in_lengths => Parametrisation::ChordLength,
            Parametrisation::Auto => Parametrisation::Centripetal,
            other => other,
        };
        let averages = coincident == Coincident::Average;
        if let Some(knots) = Self::shared(batch, averages, &rule) {
            return Ok(knots);
        }
        let runs = parallel::of(tasks(batch.offsets()), |curves| {
            let mut run = Run::new(batch, averages);
            for i in curves {
                run.add(i, rule(i));
            }
            run
        });
        let mut knots = Knots {
            dimension: batch.dimension(),
            offsets: ragged::offsets(runs.iter().flat_map(|run| run.counts.iter().copied())),
            t: Arc::default(),
            values: Arc::default(),
            weights: averages.then(Vec::new),
            closed: (0..batch.len()).map(|i| batch.is_closed(i)).collect(),
            repeats: BTreeMap::new(),
            radii: None,
            unfitted: BTreeMap::new(),
        };
        let total = knots.offsets[batch.len()];
        let (mut t, mut values) = (Vec::with_capacity(total), Vec::with_capacity(total * knots.dimension));
        for run in runs {
            t.extend(run.t);
            values.extend(run.values);
            knots.weights.iter_mut().for_each(|weights| weights.extend_from_slice(&run.weights));
            knots.repeats.extend(run.repeats);
            knots.unfitted.extend(run.unfitted);
        }
        (knots.t, knots.values) = (Arc::new(t), Arc::new(values.into()));
        Ok(knots)
    }

    /// The knots of a batch of open curves whose parameters all increase, as most do: it shares the
    /// arrays of the batch. `None` for other batches.
    fn shared(batch: &CurveBatch, averages: bool, rule: &(dyn Fn(usize) -> Parametrisation + Sync)) -> Option<Self> {
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
                    // The parameters of invalid curves do not increase, and `Run` reports them.
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
            weights: averages.then(|| {
                let mut weights = vec![1.0; batch.total_points()];
                for i in 0..batch.len() {
                    if let Some(own) = batch.weights(i) {
                        weights[offsets[i]..offsets[i + 1]].copy_from_slice(own);
                    }
                }
                weights
            }),
            closed: vec![false; batch.len()],
            repeats: BTreeMap::new(),
            radii: None,
            unfitted: BTreeMap::new(),
        })
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.closed.len()
    }

    /// The entries of curve `i`.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }

    /// The entry, counted within curve `i`, of data point `k`. Point `n` of a closed curve is its
    /// first one again.
    pub fn entry(&self, i: usize, k: usize) -> usize {
        self.repeats.get(&i).map_or(k, |entries| entries[k] as usize)
    }

    /// The parameters of the data points of curve `i`, and of a closed curve's first point again.
    pub fn parameters(&self, i: usize) -> Cow<'_, [f64]> {
        let t = self.t(i);
        match self.repeats.get(&i) {
            Some(entries) => entries.iter().map(|&entry| t[entry as usize]).collect(),
            None => Cow::Borrowed(t),
        }
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

/// The knots of curves that follow each other.
struct Run<'a> {
    batch: &'a CurveBatch,
    /// Whether points at one parameter are averaged.
    averages: bool,
    /// The number of entries of every curve.
    counts: Vec<usize>,
    t: Vec<f64>,
    values: Vec<f64>,
    /// Empty unless points are averaged.
    weights: Vec<f64>,
    repeats: Vec<(usize, Vec<u32>)>,
    unfitted: Vec<(usize, Unfitted)>,
}

impl<'a> Run<'a> {
    fn new(batch: &'a CurveBatch, averages: bool) -> Self {
        let (counts, repeats, unfitted) = (Vec::new(), Vec::new(), Vec::new());
        Run { batch, averages, counts, t: Vec::new(), values: Vec::new(), weights: Vec::new(), repeats, unfitted }
    }

    /// Appends the knots of curve `i`, or the reason that it has none.
    fn add(&mut self, i: usize, rule: Parametrisation) {
        let first = self.t.len();
        if let Err(problem) = self.append(i, rule) {
            self.t.truncate(first);
            self.values.truncate(first * self.batch.dimension());
            self.weights.truncate(first);
            self.unfitted.push((i, problem));
        }
        self.counts.push(self.t.len() - first);
    }

    fn append(&mut self, i: usize, rule: Parametrisation) -> Result<(), Unfitted> {
        let batch = self.batch;
        if let Some(problem) = batch.problem(i) {
            return Err(problem.clone());
        }
        let (points, n, d) = (batch.points(i), batch.count(i), batch.dimension());
        if n == 0 {
            return self.degenerate(i, 0, "the curve has no point; it needs two distinct ones: add them, or remove it");
        }
        let (first, again) = (self.t.len(), usize::from(batch.is_closed(i)));
        self.t.resize(first + n + again, 0.0);
        parameters(&mut self.t[first..], batch, i, rule)?;
        let mut merged = None;
        if increase(&self.t[first..]) {
            self.values.extend_from_slice(points);
            self.values.extend_from_slice(&points[..again * d]);
            if self.averages {
                let weights = batch.weights(i);
                self.weights.extend((0..n + again).map(|k| weights.map_or(1.0, |weights| weights[k % n])));
            }
        } else {
            merged = Some(self.merge(i, first)?);
        }
        if self.t.len() - first - again < 2 {
            let what = if n == 1 {
                "the curve has this point only; it needs two distinct ones: add one, or remove the curve"
            } else {
                "all points of the curve are one and the same; it needs two distinct ones: remove the curve"
            };
            return self.degenerate(i, 0, what);
        }
        self.repeats.extend(merged.map(|entries| (i, entries)));
        Ok(())
    }

    /// The weight of data point `k`.
    fn weight(&self, i: usize, k: usize) -> f64 {
        self.batch.weights(i).map_or(1.0, |weights| weights[k])
    }

    fn degenerate(&self, i: usize, k: usize, what: &str) -> Result<(), Unfitted> {
        Err(Unfitted { status: CurveStatus::Degenerate, message: self.batch.sentence(i, k, what) })
    }

    /// Makes one knot of the data points at each parameter, and returns the entry of every data
    /// point. The entries of the curve begin at `first`.
    fn merge(&mut self, i: usize, first: usize) -> Result<Vec<u32>, Unfitted> {
        let (n, d, points) = (self.batch.count(i), self.batch.dimension(), self.batch.points(i));
        let mut entries = Vec::with_capacity(self.t.len() - first);
        let mut last = first;
        for k in 0..self.t.len() - first {
            let is_new = k == 0 || self.t[first + k] > self.t[last];
            last += usize::from(is_new && k > 0);
            self.t[last] = self.t[first + k];
            entries.push((last - first) as u32);
            if is_new {
                // A closed curve's first knot is its last entry again.
                let (point, weight) = match k {
                    k if k < n => (points[k * d..(k + 1) * d].to_vec(), self.weight(i, k)),
                    _ => (self.knot(first).to_vec(), self.knot_weight(first)),
                };
                self.values.extend(point);
                self.weights.extend(self.averages.then_some(weight));
            } else if k < n {
                self.absorb(i, k, last, &points[k * d..(k + 1) * d], self.weight(i, k))?;
            } else if last > first {
                // The last points are at the parameter of the first one.
                let point = self.knot(last).to_vec();
                self.absorb(i, n - 1, first, &point, self.knot_weight(last))?;
                self.values.copy_within(first * d..(first + 1) * d, last * d);
                if self.averages {
                    self.weights[last] = self.weights[first];
                }
            }
        }
        self.t.truncate(last + 1);
        Ok(entries)
    }

    /// The point at a knot.
    fn knot(&self, knot: usize) -> &[f64] {
        let d = self.batch.dimension();
        &self.values[knot * d..(knot + 1) * d]
    }

    fn knot_weight(&self, knot: usize) -> f64 {
        if self.averages { self.weights[knot] } else { 1.0 }
    }

    /// Takes data point `k` of curve `i`, or the mean of several up to it, into a knot at the same
    /// parameter.
    fn absorb(&mut self, i: usize, k: usize, knot: usize, point: &[f64], weight: f64) -> Result<(), Unfitted> {
        if self.averages {
            self.weights[knot] += weight;
            let share = weight / self.weights[knot];
            for (c, x) in point.iter().enumerate() {
                // This form leaves the bits alone where the points are equal.
                let value = &mut self.values[knot * point.len() + c];
                *value += share * (x - *value);
            }
        } else if self.knot(knot) != point {
            let what = format!(
                "a different point stands at the same parameter {}: remove one of them, or use `spline::Smoothing`, which averages them",
                self.t[knot]
            );
            return self.degenerate(i, k, &what);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
