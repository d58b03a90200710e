//! [`BandCurves`]: the fitted curves, with knots between their data points.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::batch::{CurveBatch, Origin, Unfitted};
use crate::curve::{Curve, Input, Jet, Sampling, piece_at, samples_at, vector};
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveSet;
use crate::sort;
use glam::DVec3;

/// A cubic spline through all its knots. Every data point is one of them.
#[derive(Clone, Debug)]
pub(super) struct BandCurve {
    pub dimension: usize,
    pub closed: bool,
    /// The arc length of the polygon at every knot. A closed curve has its first knot again at its
    /// end.
    pub t: Vec<f64>,
    pub values: Vec<f64>,
    /// d²p/ds² at every knot.
    pub second: Vec<f64>,
    /// The knot of every data point, and of the first one again if the curve is closed.
    pub rows: Vec<u32>,
    /// The parameter of every data point.
    pub knots: Vec<f64>,
}

impl BandCurve {
    /// The curve with its data points at these of its rows, and with their parameters: the given
    /// ones, or the arc lengths of the polygon.
    pub fn over(mut self, entries: impl Iterator<Item = usize>, given: Option<Vec<f64>>) -> Self {
        self.rows = entries.map(|entry| self.rows[entry]).collect();
        self.knots = given.unwrap_or_else(|| self.rows.iter().map(|&row| self.t[row as usize]).collect());
        self
    }

    /// Divides the first coordinates by a share.
    pub fn stretch(&mut self, share: f64) {
        if share != 1.0 {
            let d = self.dimension;
            self.values.iter_mut().step_by(d).chain(self.second.iter_mut().step_by(d)).for_each(|x| *x /= share);
        }
    }

    /// Gives a data point its own bits.
    pub fn pin(&mut self, k: usize, point: &[f64]) {
        let (d, row) = (self.dimension, self.rows[k] as usize);
        self.values[row * d..(row + 1) * d].copy_from_slice(point);
        if self.closed && row == 0 {
            let last = self.values.len() - d;
            self.values[last..].copy_from_slice(point);
        }
    }

    fn value(&self, row: usize) -> DVec3 {
        vector(&self.values[row * self.dimension..][..self.dimension])
    }

    /// The cubic p + v (a + v (b + v c)) after a knot.
    fn cubic(&self, row: usize) -> [DVec3; 4] {
        let d = self.dimension;
        let h = self.t[row + 1] - self.t[row];
        let [m, n] = [row, row + 1].map(|row| h * h * vector(&self.second[row * d..][..d]));
        let (p, q) = (self.value(row), self.value(row + 1));
        [p, q - p - (2.0 * m + n) / 6.0, 0.5 * m, (n - m) / 6.0]
    }

    /// The knot before a fraction of a span, and the fraction after it. `None` for a span between
    /// repeated points.
    fn piece(&self, span: usize, u: f64) -> Option<(usize, f64)> {
        piece_at([self.rows[span], self.rows[span + 1]], u)
    }
}

impl Curve for &BandCurve {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn pace(&self, span: usize) -> f64 {
        let length = self.knots[span + 1] - self.knots[span];
        if length > 0.0 { length } else { 1.0 }
    }

    fn pieces(&self, span: usize) -> usize {
        (self.rows[span + 1] - self.rows[span]) as usize
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        let [_, a, b, c] = self.cubic(self.rows[span] as usize + piece);
        Some(Motion::of_cubic(a, b, c))
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let Some((row, v)) = self.piece(span, u) else {
            return Jet { point: self.value(self.rows[span] as usize), ..Jet::default() };
        };
        let n = self.pieces(span) as f64 / self.pace(span);
        let [p, a, b, c] = self.cubic(row);
        let point = match v {
            0.0 => p,
            1.0 => self.value(row + 1),
            _ => p + v * (a + v * (b + v * c)),
        };
        Jet {
            point,
            first: n * (a + v * (2.0 * b + 3.0 * v * c)),
            second: n * n * (2.0 * b + 6.0 * v * c),
            third: 6.0 * n * n * n * c,
        }
    }
}

/// The curves of a batch.
pub(super) struct BandCurves {
    dimension: usize,
    closed: Vec<bool>,
    curves: Vec<Option<BandCurve>>,
    /// The points of the curves that were not fitted.
    inputs: BTreeMap<usize, Input>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
}

impl BandCurves {
    pub fn new(batch: &CurveBatch, curves: Vec<Option<BandCurve>>, problems: BTreeMap<usize, Unfitted>) -> Self {
        let inputs = sort::map(problems.keys().map(|&i| (i, Input::of(batch, i))));
        BandCurves {
            dimension: batch.dimension(),
            closed: (0..batch.len()).map(|i| batch.is_closed(i)).collect(),
            curves,
            inputs,
            problems,
            origin: batch.origin().clone(),
        }
    }

    fn sample(&self, i: usize, sampling: Sampling) -> (Vec<f64>, Vec<f64>) {
        match &self.curves[i] {
            Some(curve) => samples_at(&curve, &curve.sites(sampling), None),
            None => self.inputs[&i].sample(self.dimension, self.closed[i], sampling),
        }
    }
}

impl CurveSet for BandCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match &self.curves[i] {
            Some(curve) => Box::new(curve),
            None => Box::new(self.inputs[&i].polygon(self.dimension, self.closed[i])),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let samples = parallel::map(self.closed.len(), 16, |i| self.sample(i, sampling));
        let closing = |i: usize, last: f64| match &self.curves[i] {
            Some(curve) => curve.knots[curve.knots.len() - 1] - last,
            None => self.inputs[&i].closing_after(last),
        };
        let (closed, problems) = (self.closed.clone(), self.problems.clone());
        CurveBatch::from_samples(self.dimension, samples, closing, closed, problems, self.origin.clone())
    }
}
