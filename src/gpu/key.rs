//! [`KernelKey`]: a kernel before it is compiled.

use super::source::{Definitions, compose};
use crate::precision::Precision;

/// What identifies a kernel: a shader file, an entry point, a precision, and its definitions.
#[derive(Clone, Debug)]
pub struct KernelKey {
    /// Path below `shaders/`.
    pub path: &'static str,
    /// Entry point.
    pub entry: &'static str,
    /// f32 or f64.
    pub precision: Precision,
    /// Text definitions.
    pub definitions: Definitions,
}

impl KernelKey {
    /// A name that tells the kernel from every other.
    pub fn name(&self) -> String {
        let definitions: Vec<String> = self.definitions.iter().map(|(name, value)| format!("{name}={value}")).collect();
        format!("{}:{} {:?} {}", self.path, self.entry, self.precision, definitions.join(" "))
    }

    /// The composed WGSL.
    pub fn wgsl(&self) -> String {
        compose(self.path, self.precision, &self.definitions)
    }
}
