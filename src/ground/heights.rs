//! Heights of curves on a globe, as curves of their own.

use crate::batch::CurveBatch;
use crate::curve::Curve;
use crate::error::Result;
use crate::report::Fit;

/// The heights of a batch; `None` where its points have none.
pub(crate) struct Heights(Option<Fit>);

/// The height along one curve.
pub(crate) struct Height<'a>(Option<Box<dyn Curve + 'a>>);

impl Heights {
    /// Curves whose x is the height; `None` where points have none.
    pub fn new(heights: Option<Fit>) -> Self {
        Heights(heights)
    }

    /// The heights of a batch of longitudes, latitudes and heights as planar curves, over these parameters, without constraints.
    ///
    /// # Errors
    /// Parameters that are none.
    pub fn batch(batch: &CurveBatch, t: Vec<f64>, closing: Vec<f64>) -> Result<CurveBatch> {
        let coords = batch.coords().chunks_exact(3).flat_map(|point| [point[2], 0.0]).collect();
        let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect::<Vec<_>>();
        let heights = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec())?.closed_each(closed)?;
        heights.with_parameters(t)?.with_closing_spans(closing)
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        if self.0.is_some() { 3 } else { 2 }
    }

    /// Those of curve `i`.
    pub fn of(&self, i: usize) -> Height<'_> {
        Height(self.0.as_ref().map(|fit| fit.curve(i)))
    }
}

impl Height<'_> {
    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        if self.0.is_some() { 3 } else { 2 }
    }

    /// The height at the fraction of a span, and its first two derivatives by that fraction; 0 without heights.
    pub fn at(&self, span: usize, u: f64) -> [f64; 3] {
        let Some(curve) = &self.0 else { return [0.0; 3] };
        let (jet, length) = (curve.jet(span, u), curve.pace(span));
        [jet.point.x, length * jet.first.x, length * length * jet.second.x]
    }
}
