//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

pub(crate) mod knots;

pub use knots::Parametrisation;
