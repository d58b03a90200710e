//! SVG: reads vertices of paths or their control points, writes paths, also of cubic Béziers.

mod chain;
mod limits;
mod path;
mod read;
mod transform;
mod write;

pub(super) use read::read;
pub(super) use write::write;
