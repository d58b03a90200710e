//! Batches of the samples of fitted curves.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{CurveBatch, Problem};
use crate::constraint::Constraints;
use crate::io::Origin;

impl CurveBatch {
    /// [`sampled`](Self::sampled) from coordinates and parameters curve by curve; `end` is the parameter at which a closed curve that was
    /// fitted meets its first point again.
    pub(crate) fn from_samples(
        dimension: usize,
        samples: Vec<(Vec<f64>, Vec<f64>)>,
        end: impl Fn(usize) -> Option<f64>,
        closed: Vec<bool>,
        problems: BTreeMap<usize, Problem>,
        origin: Arc<Origin>,
    ) -> Self {
        let mut offsets = vec![0];
        samples.iter().for_each(|(_, t)| offsets.push(offsets[offsets.len() - 1] + t.len()));
        let closing = |i: usize| match (end(i), samples[i].1.last()) {
            _ if !closed[i] => f64::NAN,
            (Some(end), Some(last)) => end - last,
            _ => 1.0,
        };
        let spans = closed.contains(&true).then(|| (0..samples.len()).map(closing).collect());
        let (mut coords, mut t) = (Vec::new(), Vec::new());
        for (of_curve, t_of_curve) in samples {
            coords.extend(of_curve);
            t.extend(t_of_curve);
        }
        Self::sampled(dimension, coords, offsets, closed, t, spans, problems, origin)
    }

    /// The samples of fitted curves, which need no check: `problems` are those of curves that were not fitted.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn sampled(
        dimension: usize,
        coords: Vec<f64>,
        offsets: Vec<usize>,
        closed: Vec<bool>,
        parameters: Vec<f64>,
        closing_spans: Option<Vec<f64>>,
        problems: BTreeMap<usize, Problem>,
        origin: Arc<Origin>,
    ) -> Self {
        CurveBatch {
            dimension,
            coords,
            offsets,
            closed,
            parameters: Some(parameters),
            closing_spans,
            weights: None,
            constraints: Constraints::default(),
            problems,
            origin,
        }
    }
}
