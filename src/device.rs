//! [`Device`]: the CPU or a GPU, the precision, and how `auto` chooses.

/// Precision of the arithmetic on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f64 on the CPU. On a GPU f32 where the problem is well conditioned, else f64 if the adapter has it.
    #[default]
    Auto,
    /// 32-bit floats.
    F32,
    /// 64-bit floats; an error on a GPU that has none.
    F64,
}

/// What does the work.
#[derive(Clone, Debug)]
pub struct Device {
    precision: Precision,
}

impl Device {
    /// All threads of the CPU.
    pub fn cpu() -> Self {
        Device { precision: Precision::Auto }
    }

    /// The same device with another precision.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// The precision asked for.
    pub fn precision(&self) -> Precision {
        self.precision
    }
}
