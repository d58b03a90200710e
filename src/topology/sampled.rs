//! [`Sampled`]: fitted strokes, sampled.

use std::sync::Arc;

use super::Topology;
use super::map::{Map, report};
use super::samples::{self, Samples};
use crate::curve::Sampling;
use crate::report::Fit;

/// Fitted strokes with their samples: [`Topology::sample`]. What curves share is sampled once.
pub struct Sampled {
    pub(super) topology: Arc<Topology>,
    pub(super) fit: Fit,
    pub(super) sampling: Sampling,
    /// The samples are rounded to this number of decimals.
    pub(super) decimals: Option<u8>,
    /// Of every arc.
    pub(super) samples: Vec<Samples>,
}

impl Topology {
    /// Samples a fit of the [`strokes`](Self::strokes).
    ///
    /// Samples are taken between junctions: [`Sampling::Spacing`] divides every arc evenly, and
    /// [`Sampling::Count`] is a count for every arc. A ring of one arc is sampled as ever.
    ///
    /// # Panics
    /// If the fit is of something else.
    pub fn sample(self: &Arc<Self>, fit: Fit, sampling: Sampling) -> Sampled {
        assert_eq!(fit.len(), self.strokes.arcs.len(), "a fit of the strokes");
        let samples = samples::sample(self, &fit, sampling);
        Sampled { topology: self.clone(), fit, sampling, decimals: None, samples }
    }
}

impl Sampled {
    /// The same with samples rounded to `decimals`, as a file will have them: [`faults`](Self::faults) and
    /// [`mend`](Self::mend) refer to what is written then.
    pub fn rounded(mut self, decimals: u8) -> Self {
        self.samples.iter_mut().for_each(|of_arc| of_arc.round(decimals));
        self.decimals = Some(decimals);
        self
    }

    /// The fit of the strokes.
    pub fn strokes(&self) -> &Fit {
        &self.fit
    }

    /// The curves of the batch, as of [`Topology::join`], whose samples by this sampling are known.
    pub fn join(self) -> Fit {
        let Sampled { topology, fit, sampling, samples, .. } = self;
        let reports = (0..topology.batch.len()).map(|i| report(&topology, &fit, i)).collect();
        let device = fit.device().clone();
        Fit::new(Map { topology, fit, sampled: Some((sampling, samples)) }, reports, device)
    }
}
