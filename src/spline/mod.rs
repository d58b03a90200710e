//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

mod cubic;
pub(crate) mod knots;
mod natural;

pub use cubic::CubicSplines;
pub use knots::Parametrisation;
pub use natural::{Ends, Natural};
