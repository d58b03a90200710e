//! The GPU: adapters, limits, shader composition, kernels, submissions.
//!
//! This module knows wgpu and no mathematics. wgpu's types appear in one place, for host programs
//! that share a device: [`Gpu::from_wgpu`] and [`Gpu::wgpu_device`]. That place follows wgpu's
//! releases. Nothing else does.
//!
//! Without the feature `gpu` there is no adapter, and no [`Gpu`] can be made.

#[cfg(not(feature = "gpu"))]
mod absent;
#[cfg(feature = "gpu")]
mod adapter;
#[cfg(feature = "gpu")]
mod capture;
#[cfg(feature = "gpu")]
mod context;
#[cfg(feature = "gpu")]
mod kernel;
mod key;
#[cfg(feature = "gpu")]
mod pending;
mod pipeline;
#[doc(hidden)]
pub mod plan;
#[cfg(feature = "gpu")]
mod pool;
#[cfg(feature = "gpu")]
mod record;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub mod reflect;
mod rounds;
#[cfg(feature = "gpu")]
mod silence;
#[doc(hidden)]
pub mod source;
mod summary;
#[cfg(all(test, feature = "gpu"))]
pub(crate) mod testing;

#[cfg(not(feature = "gpu"))]
pub use absent::{Gpu, adapters};
#[cfg(feature = "gpu")]
pub use adapter::adapters;
#[cfg(feature = "gpu")]
pub use context::{Gpu, Traffic};
pub(crate) use pipeline::{Lost, kept, unwritten};
pub(crate) use rounds::Rounds;
pub use summary::AdapterSummary;

// For tests of the kernels, the program and Python. Versions do not promise these names.
#[cfg(not(feature = "gpu"))]
#[doc(hidden)]
pub use absent::{Buffer, Downloaded, Pending, Recording, silently};
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use capture::{CapturedBuffer, CapturedDispatch};
#[doc(hidden)]
pub use key::KernelKey;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use pending::{Downloaded, Pending};
#[doc(hidden)]
pub use pipeline::{Interrupted, Step, once, pipeline};
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use pool::Buffer;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use record::Recording;
#[cfg(feature = "gpu")]
#[doc(hidden)]
pub use silence::silently;
