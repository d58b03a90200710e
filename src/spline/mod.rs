//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

mod energy;
pub(crate) mod knots;
mod reinsch;

mod smoother;
mod smoothing;
mod stub;
mod subdivide;
pub mod uniform;

pub use knots::Parametrisation;
pub use smoothing::{Amount, LAMBDA_CAP, Smoothing};
