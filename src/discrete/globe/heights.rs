//! Heights of curves on a globe: natural splines over the arc length on the ground.

use super::FairCurves;
use crate::batch::CurveBatch;
use crate::curve::Curve;
use crate::device::Device;
use crate::error::Result;
use crate::report::{CurveSet, Fit};
use crate::spline::{Natural, Parametrisation};

/// The heights of a batch; `None` where its points have none.
pub(super) struct Heights(Option<Fit>);

/// The height along one curve.
pub(super) struct Height<'a>(Option<Box<dyn Curve + 'a>>);

impl Heights {
    /// Splines through the third coordinates of a batch, whose curves on the ground are these.
    pub fn new(batch: &CurveBatch, curves: &FairCurves) -> Result<Self> {
        if batch.dimension() == 2 {
            return Ok(Heights(None));
        }
        let (mut t, mut closing) = (Vec::with_capacity(batch.total_points()), Vec::with_capacity(batch.len()));
        for i in 0..batch.len() {
            let curve = curves.curve(i);
            let mut along = 0.0;
            for k in 0..batch.count(i) {
                t.push(along);
                along += if k < curve.spans() { curve.span_length(k) } else { 0.0 };
            }
            closing.push(along - t.last().copied().unwrap_or(0.0));
        }
        let coords = batch.coords().chunks_exact(3).flat_map(|point| [point[2], 0.0]).collect();
        let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect::<Vec<_>>();
        let heights = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec())?.closed_each(closed)?;
        let heights = heights.with_parameters(t)?.with_closing_spans(closing)?;
        let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
        Ok(Heights(Some(natural.fit(&heights, &Device::cpu())?)))
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
