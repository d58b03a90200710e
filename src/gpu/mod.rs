//! The GPU: adapters, limits, shader composition, kernels, submissions. Knows wgpu, knows no mathematics.

mod adapter;
mod capture;
mod context;
mod kernel;
mod pipeline;
pub mod plan;
mod record;
pub mod reflect;
pub mod source;
#[cfg(test)]
pub(crate) mod testing;

pub use adapter::{AdapterSummary, adapters};
pub use capture::{CapturedBuffer, CapturedDispatch};
pub use context::Gpu;
pub use kernel::{Kernel, KernelKey};
pub use pipeline::{Interrupted, pipeline};
pub use record::{Downloaded, Pending, Recording};
pub use wgpu::Buffer;
