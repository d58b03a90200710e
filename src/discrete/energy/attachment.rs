//! Attachment to data: ½ Σ w |f − p|².

use super::{Energy, Facts, Functional};

/// ½ Σ w |f − p|² over the data points p of weight w (1 where the batch has none), f the vertex
/// that belongs to p, in units of length². For noisy data: data points are then attached, no longer
/// fixed.
///
/// Unlike the other energies it depends on vertices, not on edges; its gradient is w (f − p), its
/// Hessian w.
pub fn attachment() -> Energy {
    Energy::of(Functional::Attachment)
}

/// It depends on no edge, and so has no term: see [`attachment`].
pub(super) struct Attachment;

impl Facts for Attachment {
    fn degree(&self) -> f64 {
        2.0
    }
}
