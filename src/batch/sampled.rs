//! Batches of the samples of fitted curves.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{CurveBatch, Unfitted};
use crate::batch::Origin;
use crate::ragged;

impl CurveBatch {
    /// [`sampled`](Self::sampled) from the coordinates and parameters of each curve.
    ///
    /// `closing` is the parameter length from the last sample of a closed curve, at the given
    /// parameter, to its first.
    pub(crate) fn from_samples(
        dimension: usize,
        samples: Vec<(Vec<f64>, Vec<f64>)>,
        closing: impl Fn(usize, f64) -> f64,
        closed: Vec<bool>,
        problems: BTreeMap<usize, Unfitted>,
        origin: Arc<Origin>,
    ) -> Self {
        let offsets = ragged::offsets(samples.iter().map(|(_, t)| t.len()));
        let span = |i: usize| match samples[i].1.last() {
            Some(&last) if closed[i] => closing(i, last),
            _ => f64::NAN,
        };
        let spans = closed.contains(&true).then(|| (0..samples.len()).map(span).collect());
        let count = *offsets.last().expect("offsets begin with 0");
        let (mut coords, mut t) = (Vec::with_capacity(count * dimension), Vec::with_capacity(count));
        for (of_curve, t_of_curve) in samples {
            coords.extend(of_curve);
            t.extend(t_of_curve);
        }
        Self::sampled(dimension, coords, offsets, closed, t, spans, problems, origin)
    }

    /// [`from_samples`](Self::from_samples) with the closedness, problems and provenance of
    /// `batch`.
    pub(crate) fn samples_of(
        batch: &CurveBatch,
        dimension: usize,
        samples: Vec<(Vec<f64>, Vec<f64>)>,
        closing: impl Fn(usize, f64) -> f64,
    ) -> Self {
        let (problems, origin) = (batch.problems.clone(), batch.origin.clone());
        Self::from_samples(dimension, samples, closing, batch.closed.clone(), problems, origin)
    }

    /// Takes over the problems of a batch of the same curves.
    pub(crate) fn with_problems_of(self, other: &CurveBatch) -> Self {
        CurveBatch { problems: other.problems.clone(), ..self }
    }

    /// Samples of fitted curves, without checks. `problems` belong to curves that were not fitted.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn sampled(
        dimension: usize,
        coords: Vec<f64>,
        offsets: Vec<usize>,
        closed: Vec<bool>,
        parameters: Vec<f64>,
        closing_spans: Option<Vec<f64>>,
        problems: BTreeMap<usize, Unfitted>,
        origin: Arc<Origin>,
    ) -> Self {
        let parameters = Some(Arc::new(parameters));
        CurveBatch { parameters, closing_spans, problems, ..Self::bare(dimension, coords, offsets, closed, origin) }
    }
}
