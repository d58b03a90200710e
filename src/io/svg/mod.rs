//! SVG: vertices of paths, or their control points, in; paths, also of cubic Béziers, out.

mod chain;
mod limits;
mod path;
mod read;
mod transform;
mod write;

pub(super) use read::read;
pub(super) use write::write;
