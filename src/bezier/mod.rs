//! Bézier curves.

pub(crate) mod convert;
