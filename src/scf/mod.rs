//! Smooth connection functions: the curves of least ∫|κ|^ν ds through given points, exactly, after A. Alon and
//! S. Bergmann, *Connecting points by smooth connection functions defines shapes in the smoothest possible way*.

mod evaluation;
mod gpu;
mod queries;
mod root;
mod setup;
mod slopes;
mod trig;
mod universal;

pub(crate) use gpu::scf_kernels;
pub use queries::{Cost, Query, evaluate_segments};
pub use setup::Start;
