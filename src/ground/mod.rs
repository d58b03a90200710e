//! Curves in surfaces as people give and read them: points moved onto the surface, longitudes and latitudes there and back.

mod globe;
mod heights;
mod onto;
mod wide;

pub(crate) use globe::{GlobeCurves, in_space};
pub(crate) use heights::Heights;
pub(crate) use onto::{Moved, check, check_samples, jet_onto, judge_known, lifted, lost};
pub(crate) use wide::{Halved, between};
