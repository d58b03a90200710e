//! [`Precision`] of the arithmetic.

/// Precision of the arithmetic on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Precision {
    /// f64 on the CPU. On a GPU f32 where the problem is well conditioned (natural splines), else (smoothing) f64 if the
    /// adapter has it.
    #[default]
    Auto,
    /// 32-bit floats.
    F32,
    /// 64-bit floats; an error on a GPU that has none.
    F64,
}

impl Precision {
    /// `auto`, `f32` or `f64`.
    pub fn word(self) -> &'static str {
        match self {
            Precision::Auto => "auto",
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }
}
