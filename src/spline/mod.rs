//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

mod energy;
mod fitted;
pub(crate) mod knots;
mod reinsch;

mod smoother;
mod smoothing;
mod subdivide;
pub mod uniform;

pub use knots::Parametrisation;
pub use smoothing::{Amount, LAMBDA_CAP, Smoothing};
