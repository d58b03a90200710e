//! SVG: reads the curves of a drawing, or their control points, and writes the drawing again with
//! other paths; draws curves that come from elsewhere, also as cubic Béziers.

mod chain;
mod document;
mod limits;
mod path;
mod read;
mod shape;
mod transform;
mod write;

pub(super) use read::read;
pub(super) use write::write;
