//! Attachment to data: ½ Σ w |f − p|².

use super::{Energy, Facts, Functional};

/// The attachment ½ Σ w |f − p|² over the data points p, in units of length².
///
/// The vertex that belongs to p is f. The weight w is 1 where the batch has no weights. Use it for
/// noisy data: data points are then attached, no longer fixed.
///
/// Unlike the other energies it depends on vertices, not on edges. Its gradient is w (f − p), and
/// its Hessian w.
pub fn attachment() -> Energy {
    Energy::of(Functional::Attachment)
}

/// The attachment.
///
/// It depends on no edge and so has no term: see [`attachment`].
pub(super) struct Attachment;

impl Facts for Attachment {
    fn degree(&self) -> f64 {
        2.0
    }
}
