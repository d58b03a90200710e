//! A toy limit on the slope of edges, for tests only.
//!
//! It follows the recipe in CONTRIBUTING.md.

use super::penalty::Quantity;
use super::{Facts, LIMIT_KINDS, Partials, Window};
use crate::linalg::Scalar;

/// The quantity T_y = sin α, for a slope angle α.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ToyLimit;

impl Facts for ToyLimit {
    fn degree(&self) -> f64 {
        0.0
    }
}

impl Quantity<1> for ToyLimit {
    fn kind(&self) -> usize {
        LIMIT_KINDS - 1
    }

    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        let mut up = [S::ZERO; D];
        up[1] = S::ONE;
        Partials { value: window.tangent[0][1], tangent: [up], length: [S::ZERO] }
    }
}
