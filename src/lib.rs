//! faircurve: fair curves by the thousand.
#![warn(missing_docs)]

pub mod arclength;
mod batch;
mod catalogue;
mod constraint;
mod curve;
mod device;
mod error;
pub mod gpu;
pub mod io;
pub mod linalg;
pub mod picture;
mod report;
pub mod spline;

pub use batch::{CurveBatch, Point, Problem};
pub use catalogue::kernels;
pub use constraint::Constraints;
pub use curve::{Curve, Jet, Sampling};
pub use device::{Choice, Device, GPU_PAYS_ABOVE, Precision};
pub use error::{Error, Result};
pub use report::{CurveReport, CurveSet, CurveStatus, Fit};
