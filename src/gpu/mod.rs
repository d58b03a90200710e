//! The GPU: adapters, limits, shader composition, kernels, submissions. Knows wgpu, knows no mathematics.

mod adapter;
mod capture;
mod context;
mod kernel;
mod pipeline;
pub mod plan;
mod record;
pub mod reflect;
mod rounds;
pub mod source;
#[cfg(test)]
pub(crate) mod testing;

pub use adapter::{AdapterSummary, adapters};
pub use capture::{CapturedBuffer, CapturedDispatch};
pub use context::Gpu;
pub use kernel::KernelKey;
pub use pipeline::{Interrupted, pipeline};
pub(crate) use pipeline::{Lost, kept, unwritten};
pub use record::{Downloaded, Pending, Recording};
pub(crate) use rounds::Rounds;
pub use wgpu::Buffer;
