//! Smooth connection functions: the curves of least ∫|κ|^ν ds through given points, exactly, after A. Alon and
//! S. Bergmann, *Connecting points by smooth connection functions defines shapes in the smoothest possible way*.

pub mod tension;

pub use tension::{Site, TensionSegment};
