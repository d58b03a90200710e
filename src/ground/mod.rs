//! Curves in surfaces as users give and read them: projection of points, longitudes and latitudes.

mod fit;
mod globe;
mod heights;
mod onto;
mod wide;

pub(crate) use fit::{SurfaceMethod, fit_in_surface};
pub(crate) use heights::heights;
pub(crate) use onto::{check, check_samples, jet_onto, judge_known, lifted, lost};
pub(crate) use wide::{Halved, between};
