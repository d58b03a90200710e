//! Batches of the samples of fitted curves.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{CurveBatch, Origin, Parameters, Unfitted};
use crate::numbers::Numbers;
use crate::parallel;
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
        let mut samples = samples;
        let offsets = ragged::offsets(samples.iter().map(|(_, t)| t.len()));
        let first_coords = ragged::offsets(samples.iter().map(|(coords, _)| coords.len()));
        let span = |i: usize| match samples[i].1.last() {
            Some(&last) if closed[i] => closing(i, last),
            _ => f64::NAN,
        };
        let spans = closed.contains(&true).then(|| (0..samples.len()).map(span).collect());
        let n = samples.len();
        let (mut coords, mut t) = (Numbers::room(first_coords[n]), vec![0.0; offsets[n]]);
        parallel::parts(&mut coords, &first_coords, |i, coords| coords.copy_from_slice(&samples[i].0));
        parallel::parts(&mut t, &offsets, |i, t| t.copy_from_slice(&samples[i].1));
        parallel::each(&mut samples, |own| *own = Default::default());
        Self::sampled(dimension, coords, offsets, closed, t.into(), spans, problems, origin)
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
        coords: Numbers,
        offsets: Vec<usize>,
        closed: Vec<bool>,
        parameters: Parameters,
        closing_spans: Option<Vec<f64>>,
        problems: BTreeMap<usize, Unfitted>,
        origin: Arc<Origin>,
    ) -> Self {
        let parameters = Some(parameters);
        CurveBatch { parameters, closing_spans, problems, ..Self::bare(dimension, coords, offsets, closed, origin) }
    }
}
