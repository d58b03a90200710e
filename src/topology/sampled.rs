//! [`Sampled`]: fitted strokes, sampled.

use std::sync::Arc;

use super::Topology;
use super::map::{Map, report};
use super::samples::{self, Samples};
use crate::curve::Sampling;
use crate::report::Fit;

/// Fitted strokes with their samples: [`Topology::sample`].
pub struct Sampled {
    pub(super) topology: Arc<Topology>,
    pub(super) fit: Fit,
    pub(super) sampling: Sampling,
    /// The decimals to which samples are rounded.
    pub(super) decimals: Option<u8>,
    /// The samples of every arc.
    pub(super) samples: Vec<Samples>,
}

impl Topology {
    /// Samples a fit of the [`strokes`](Self::strokes).
    ///
    /// Shared arcs are sampled once. [`Sampling::Spacing`] divides every arc evenly, and
    /// [`Sampling::Count`] is the number per arc.
    ///
    /// # Panics
    /// If the fit is not of the strokes.
    pub fn sample(self: &Arc<Self>, fit: Fit, sampling: Sampling) -> Sampled {
        assert_eq!(fit.len(), self.strokes.arcs.len(), "a fit of the strokes");
        let samples = samples::sample(self, &fit, sampling);
        Sampled { topology: self.clone(), fit, sampling, decimals: None, samples }
    }
}

impl Sampled {
    /// Rounds the samples to `decimals`, as a file has them, for [`faults`](Self::faults) and
    /// [`mend`](Self::mend).
    pub fn rounded(mut self, decimals: u8) -> Self {
        samples::round(&self.topology, &mut self.samples, decimals);
        self.decimals = Some(decimals);
        self
    }

    /// The fit of the strokes.
    pub fn strokes(&self) -> &Fit {
        &self.fit
    }

    /// The curves of the batch, as by [`Topology::join`], with these samples.
    pub fn join(self) -> Fit {
        let Sampled { topology, fit, sampling, samples, .. } = self;
        let reports = (0..topology.batch.len()).map(|i| report(&topology, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology, fit, sampled: Some((sampling, samples)) }, reports, device)
    }
}
