//! Closed curves, which drop a repeated last point.

use std::sync::Arc;

use super::Parameters;
use super::{CurveBatch, columns, expect_length};
use crate::constraint::{gather_rows, retain_rows, rows_of};
use crate::error::Result;

impl CurveBatch {
    /// Marks all curves as closed, or all as open.
    ///
    /// A closed curve whose last point repeats its first loses the last.
    pub fn closed(self, closed: bool) -> Self {
        let flags = vec![closed; self.len()];
        self.closed_each(flags).expect("one flag per curve")
    }

    /// Marks curves of at least three points as closed if their last point equals their first.
    ///
    /// The repeated point is dropped.
    pub fn closed_auto(self) -> Self {
        let flags = (0..self.len()).map(|i| self.count(i) > 2 && self.repeats_first(i)).collect();
        self.closed_each(flags).expect("one flag per curve")
    }

    /// Marks each curve as closed or open.
    ///
    /// A closed curve whose last point repeats its first loses the last. The parameter of the
    /// dropped point gives the parameter length of the closing span.
    ///
    /// # Errors
    /// If the number of flags is not the number of curves.
    pub fn closed_each(mut self, closed: Vec<bool>) -> Result<Self> {
        expect_length("closed flags", closed.len(), self.len(), "curve")?;
        let repeated: Vec<usize> =
            (0..self.len()).filter(|&i| closed[i] && self.count(i) > 1 && self.repeats_first(i)).collect();
        self.closed = closed;
        if !repeated.is_empty() {
            self.drop_last_points(&repeated);
        }
        Ok(self)
    }

    /// The same curves, closed where these are. Points stay, also where the last equals the first: in other
    /// coordinates they may be two.
    pub(crate) fn closed_as(mut self, closed: Vec<bool>) -> Self {
        debug_assert_eq!(closed.len(), self.len());
        self.closed = closed;
        self
    }

    /// Distances between consecutive points of curve `i`, including the closing chord of a closed
    /// curve.
    pub(crate) fn chords(&self, i: usize) -> impl Iterator<Item = f64> {
        let (n, d, points) = (self.count(i), self.dimension, self.points(i));
        let point = move |k: usize| &points[k % n * d..][..d];
        (0..self.spans(i)).map(move |k| distance(point(k), point(k + 1)))
    }

    /// The parameter length of the closing span of curve `i`.
    ///
    /// It is the given one, if there is one, and 0 if the last point equals the first. Otherwise it
    /// is the closing chord times the other spans' mean parameter length per unit of chord.
    pub(crate) fn closing_length(&self, i: usize, parameters: &[f64]) -> f64 {
        let chords: Vec<f64> = self.chords(i).collect();
        match (self.closing_span(i), chords.split_last()) {
            (Some(length), _) => length,
            (None, Some((&closing, others))) if closing > 0.0 => {
                let all: f64 = others.iter().sum();
                closing * ((parameters[parameters.len() - 1] - parameters[0]) / all)
            }
            _ => 0.0,
        }
    }

    /// The parameters of the points of curve `i`, or their numbers; a closed curve's first point comes
    /// again at the end.
    #[cfg(feature = "formats")]
    pub(crate) fn times_with_end(&self, i: usize) -> Vec<f64> {
        let (count, closed) = (self.count(i), self.is_closed(i));
        match self.parameters(i) {
            Some(t) => {
                let end = t.last().filter(|_| closed).map(|last| last + self.closing_length(i, t));
                t.iter().copied().chain(end).collect()
            }
            None => (0..count + usize::from(closed && count > 0)).map(|k| k as f64).collect(),
        }
    }

    /// The given parameters of curve `i`, with the end of a closed curve. `None` if there are none,
    /// or all are equal.
    pub(crate) fn given_knots(&self, i: usize) -> Option<Vec<f64>> {
        let given = self.parameters(i).filter(|given| !given.is_empty() && self.problem(i).is_none())?;
        let mut knots = given.to_vec();
        if self.is_closed(i) {
            let closing = self.closing_length(i, given);
            knots.push(given[given.len() - 1] + if closing > 0.0 && closing.is_finite() { closing } else { 0.0 });
        }
        (knots[0] < knots[knots.len() - 1]).then_some(knots)
    }

    /// Whether the last point of curve `i` repeats the first. Unknown points do not count.
    pub(crate) fn repeats_first(&self, i: usize) -> bool {
        let (points, d) = (self.points(i), self.dimension);
        let equal = points.len() > d && points[..d] == points[points.len() - d..];
        equal && self.is_known(i, 0) && self.is_known(i, self.count(i) - 1)
    }

    fn drop_last_points(&mut self, curves: &[usize]) {
        if self.parameters.is_some() {
            let mut spans = self.closing_spans.take().unwrap_or_else(|| vec![f64::NAN; self.len()]);
            for &i in curves {
                if let Some([.., before, last]) = self.parameters(i) {
                    spans[i] = last - before;
                }
            }
            self.closing_spans = Some(spans);
        }
        let mut keep = vec![true; self.total_points()];
        for &i in curves {
            keep[self.offsets[i + 1] - 1] = false;
        }
        self.retain_points(&keep);
    }

    fn retain_points(&mut self, keep: &[bool]) {
        retain_rows(Some(Arc::make_mut(&mut self.coords).as_vec()), self.dimension, keep);
        let mut parameters = self.parameters.take().map(Parameters::into_vec);
        retain_rows(parameters.as_mut(), 1, keep);
        self.parameters = parameters.map(Parameters::from);
        retain_rows(self.weights.as_mut(), 1, keep);
        self.constraints.retain(self.dimension, keep);
        if !self.columns.is_empty() {
            let kept: Vec<usize> = (0..keep.len()).filter(|&k| keep[k]).collect();
            self.columns = columns::gather(&self.columns, &kept);
        }
        let (mut end, mut lost) = (0, 0);
        for offset in &mut self.offsets {
            lost += keep[end..*offset].iter().filter(|keep| !**keep).count();
            (end, *offset) = (*offset, *offset - lost);
        }
    }

    /// The points of each curve in another order, with all that belongs to them.
    pub(crate) fn reordered(&self, points: &[usize]) -> CurveBatch {
        let mut batch = CurveBatch {
            coords: Arc::new(rows_of(&self.coords, self.dimension, points).into()),
            parameters: self.parameters.as_ref().map(|own| rows_of(own.get(), 1, points).into()),
            weights: gather_rows(&self.weights, 1, points),
            constraints: self.constraints.gather(self.dimension, points),
            columns: columns::gather(&self.columns, points),
            ..self.clone()
        };
        let moved = |i: usize| (self.offsets[i]..self.offsets[i + 1]).any(|k| points[k] != k);
        let moved: Vec<usize> = (0..self.len()).filter(|&i| moved(i)).collect();
        if let Some(lines) = &mut Arc::make_mut(&mut batch.origin).first_lines {
            moved.iter().for_each(|&i| lines[i] = None);
        }
        batch
    }

    /// The points that are kept, of these coordinates, with all that belongs to them. Problems are looked
    /// for again, and lines of a file are no longer known for curves that lost points.
    pub(crate) fn retained(&self, coords: Vec<f64>, keep: &[bool]) -> CurveBatch {
        let mut batch = CurveBatch { coords: Arc::new(coords.into()), ..self.clone() };
        for i in (0..self.len()).filter(|&i| keep[self.offsets[i]..self.offsets[i + 1]].contains(&false)) {
            batch.problems.remove(&i);
            if let Some(lines) = &mut Arc::make_mut(&mut batch.origin).first_lines {
                lines[i] = None;
            }
        }
        batch.retain_points(keep);
        batch.check_again();
        batch
    }
}

/// Distance between two points without intermediate overflow or underflow.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let (mut largest, mut sum) = (0.0_f64, 0.0);
    for (a, b) in a.iter().zip(b) {
        let step = (b - a).abs();
        largest = largest.max(step);
        sum += step * step;
    }
    // Sums of three squares of such numbers are normal.
    if (1e-140..1e150).contains(&largest) {
        return sum.sqrt();
    }
    if largest == 0.0 || largest.is_infinite() {
        return largest;
    }
    let scaled: f64 = a.iter().zip(b).map(|(a, b)| ((b - a) / largest).powi(2)).sum();
    largest * scaled.sqrt()
}
