//! Smooth connection functions: the exact curves of least ∫|κ|^ν ds through given points, after A.
//! Alon and S. Bergmann, *Connecting points by smooth connection functions defines shapes in the
//! smoothest possible way*.
//!
//! Between two points with given tangents the minimiser satisfies |κ|^ν = c cos ψ, with the angle ψ
//! of the tangent from the direction of a force. Every [`Segment`] is therefore a piece of one
//! universal curve per ν, determined by one scalar root. The cost, its gradient and its Hessian by
//! the two end angles are closed expressions of that root. [`Smooth`] sums them over a curve and
//! finds the directions at the points by Newton's method. The gradient is the jump of the bending
//! moment, and the Hessian is tridiagonal (cyclic for closed curves). [`exponent`] finds the ν
//! whose curve comes closest to a given shape.
//!
//! | file | holds |
//! |---|---|
//! | `universal` | the universal curve of an exponent: moment, displacement, length as polynomials |
//! | `root` | the chord condition, which determines the piece that joins two points |
//! | `evaluation` | cost, gradient and Hessian of a segment |
//! | `problem`, `slopes`, `workspace` | Newton's method on the tangent angles of many curves |
//! | `family` | the two families of segments: plain, and under tension |
//! | `arc`, `segment`, `curves` | positions along segments |
//! | `tension` | segments of least ∫(\|κ\|^ν + λ) ds |
//! | `taut` | curves of such segments |
//! | `shape` | curves that keep the shape of their points |
//! | `dots`, `start`, `stages`, `smooth` | from points to problems and back |

mod arc;
mod curves;
mod dots;
mod evaluation;
pub mod exponent;
mod family;
mod gpu;
mod problem;
mod queries;
mod root;
mod segment;
mod shape;
mod slopes;
mod smooth;
mod stages;
mod start;
mod taut;
mod tension;
#[doc(hidden)]
pub mod trace;
mod trig;
mod universal;
mod workspace;

pub(crate) use gpu::scf_kernels;
pub use segment::Segment;
pub use smooth::Smooth;
pub use start::Start;
// For tests, the experiments and the Python package.
#[doc(hidden)]
pub use arc::Site;
#[doc(hidden)]
pub use queries::{Cost, Query, evaluate_segments};
#[doc(hidden)]
pub use tension::TensionSegment;
