//! [`Precision`] of the arithmetic.

use crate::words::words;

/// Precision of the arithmetic on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// f64 on the CPU. On a GPU f32 where the problem is well conditioned (natural splines), else
    /// (smoothing) f64 if the adapter has it.
    #[default]
    Auto,
    /// 32-bit floats.
    F32,
    /// 64-bit floats; an error on a GPU that has none.
    F64,
}

words!(Precision, "precision": [
    (Auto, "auto", "f64 on the CPU; on a GPU f32 for natural splines, f64 for smoothing where it has f64"),
    (F32, "f32", "32-bit floats"),
    (F64, "f64", "64-bit floats"),
]);

impl Precision {
    /// Bytes of a number on a GPU, where [`Auto`](Self::Auto) is f32.
    pub(crate) fn bytes(self) -> u64 {
        if self == Precision::F64 { 8 } else { 4 }
    }

    /// What separates 1 from the next number there.
    pub(crate) fn epsilon(self) -> f64 {
        if self == Precision::F64 { f64::EPSILON } else { f32::EPSILON.into() }
    }
}
