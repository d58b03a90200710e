//! Subdivision on a GPU.

use super::{GridReport, Grids, Subdivide};
use crate::device::Precision;
use crate::error::Result;
use crate::gpu::Gpu;

/// Subdivides the grids whose report is usable; fills the places of the others with NaN.
pub(super) fn subdivide(
    _method: &Subdivide,
    _grids: &Grids,
    _gpu: &Gpu,
    _precision: Precision,
    _values: &mut [f64],
    _reports: &[GridReport],
) -> Result<()> {
    todo!()
}
