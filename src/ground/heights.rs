//! Heights of curves on a globe.

use crate::batch::CurveBatch;
use crate::error::Result;

/// The heights of a batch of longitudes, latitudes and heights as planar curves (height, 0) over
/// these parameters, without constraints.
///
/// # Errors
/// Parameters that are not finite.
pub(crate) fn heights(batch: &CurveBatch, t: Vec<f64>, closing: Vec<f64>) -> Result<CurveBatch> {
    let coords = batch.coords().chunks_exact(3).flat_map(|point| [point[2], 0.0]).collect();
    let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect::<Vec<_>>();
    let heights = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec())?.closed_as(closed);
    heights.with_parameters(t)?.with_closing_spans(closing)
}
