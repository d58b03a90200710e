//! SVG: vertices of paths in; paths, also of cubic Béziers, out.

mod read;
mod transform;
mod write;

pub(super) use read::read;
pub(super) use write::write;
