//! Smooth connection functions: the curves of least ∫|κ|^ν ds through given points, exactly, after A. Alon and
//! S. Bergmann, *Connecting points by smooth connection functions defines shapes in the smoothest possible way*.

mod arc;
mod curves;
mod dots;
mod evaluation;
mod gpu;
mod queries;
mod root;
pub mod search;
mod segment;
mod slopes;
mod smooth;
mod stages;
mod start;
mod trig;
mod universal;

pub use arc::Site;
pub(crate) use gpu::scf_kernels;
pub use queries::{Cost, Query, evaluate_segments};
pub use segment::Segment;
pub use smooth::Smooth;
pub use start::Start;
