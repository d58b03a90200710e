//! The limit on progress along a direction: a curve does not turn back along it.

// Loops over coordinates by index match the formulas.
#![allow(clippy::needless_range_loop)]

use std::collections::BTreeMap;

use super::penalty::{FIRST_DIRECTION, Quantity};
use super::wgsl::literal;
use super::{Facts, Partials, Window};
use crate::linalg::Scalar;
use crate::sort;

/// The quantity a = n·T, for a direction n.
///
/// β < 0 makes the curve advance along n, β > 0 against n.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Monotone {
    /// n. Its last coordinate is unused in the plane.
    pub direction: [f64; 3],
    /// The index of the direction.
    pub number: usize,
}

impl Facts for Monotone {
    fn degree(&self) -> f64 {
        0.0
    }

    fn definitions(&self, _: f64, _: usize) -> BTreeMap<&'static str, String> {
        let [x, y, z] = self.direction.map(literal);
        sort::map([("X", x), ("Y", y), ("Z", z)])
    }
}

impl Quantity<1> for Monotone {
    #[inline(always)]
    fn kind(&self) -> usize {
        FIRST_DIRECTION + self.number
    }

    /// a and its partial derivatives.
    #[inline(always)]
    fn first<S: Scalar, const D: usize>(&self, window: &Window<S, D, 1>) -> Partials<S, D, 1> {
        let (mut value, mut direction) = (S::ZERO, [S::ZERO; D]);
        for c in 0..D {
            direction[c] = S::of(self.direction[c]);
            value += direction[c] * window.tangent[0][c];
        }
        Partials { value, tangent: [direction], length: [S::ZERO] }
    }
}
