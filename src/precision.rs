//! [`Precision`] of the arithmetic on a device.

use crate::words::words;

/// Precision of the arithmetic on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// f64 on the CPU. On a GPU f32 for well-conditioned problems (natural splines), else
    /// (smoothing) f64 if the adapter has it. Where `faircurve doctor` measured f64 at 0.4 of the
    /// rate of f32 or better, the program takes f64 for all.
    #[default]
    Auto,
    /// 32-bit floats.
    F32,
    /// 64-bit floats. An error on a GPU without them.
    F64,
}

words!(Precision, "precision": [
    (Auto, "auto", "f64 on the CPU; on a GPU f32 for natural splines, f64 for smoothing where it has f64, and for all where doctor found f64 fast"),
    (F32, "f32", "32-bit floats"),
    (F64, "f64", "64-bit floats"),
]);

impl Precision {
    /// Bytes per number on a GPU. [`Auto`](Self::Auto) counts as f32.
    pub(crate) fn bytes(self) -> u64 {
        if self == Precision::F64 { 8 } else { 4 }
    }

    /// The machine epsilon.
    pub(crate) fn epsilon(self) -> f64 {
        if self == Precision::F64 { f64::EPSILON } else { f32::EPSILON.into() }
    }
}

/// Numbers in either precision.
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "no GPU, no numbers of it"))]
#[derive(Clone, Copy)]
pub(crate) enum Reals<'a> {
    F64(&'a [f64]),
    F32(&'a [f32]),
}

impl Reals<'_> {
    /// Number i.
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Reals::F64(numbers) => numbers[i],
            Reals::F32(numbers) => f64::from(numbers[i]),
        }
    }
}
