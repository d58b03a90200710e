//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

mod cubic;
mod energy;
pub(crate) mod knots;
mod natural;
mod reinsch;
mod smoother;
mod smoothing;
mod subdivide;
pub mod uniform;

pub use cubic::CubicSplines;
pub use knots::Parametrisation;
pub use natural::{Ends, Natural};
pub use smoothing::{Amount, LAMBDA_CAP, Smoothing};
