//! Fair curves of longitudes and latitudes.

use std::sync::Arc;

use super::curves::FairCurves;
use super::fair::Fair;
use crate::Constraints;
use crate::batch::CurveBatch;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::ground::{GlobeCurves, Heights, in_space};
use crate::report::{CurveReport, CurveSet, Fit};
use crate::spline::{Natural, Parametrisation};
use crate::surface::{Globe, Surface};

/// Fits curves of longitudes and latitudes, by a fit of curves in space.
pub(super) fn fit(
    fair: &Fair,
    globe: Globe,
    batch: &CurveBatch,
    fit: impl Fn(&Fair, &CurveBatch) -> Result<(FairCurves, Vec<CurveReport>, DeviceReport)>,
) -> Result<Fit> {
    let mut spatial = in_space(globe, batch);
    if let Some(tangents) = &batch.constraints().tangents {
        let tangents = Some(on_ground(globe, batch, tangents));
        spatial = spatial.with_constraints(Constraints { tangents, ..batch.constraints().clone() })?;
    }
    let surface: Arc<dyn Surface> = Arc::new(globe.surface());
    let within = Fair { surface: Some(surface.clone()), ..fair.clone() };
    let (mut curves, reports, did) = fit(&within, &spatial)?;
    curves.lie_in(&spatial, &surface);
    let heights = Heights::new(heights(batch, &curves)?);
    Ok(Fit::new(GlobeCurves::new(globe, batch, Box::new(curves), heights, &reports), reports, did))
}

/// The directions in space of tangents to the east and to the north.
fn on_ground(globe: Globe, batch: &CurveBatch, tangents: &[f64]) -> Vec<f64> {
    let d = batch.dimension();
    let of = |(point, tangent): (&[f64], &[f64])| {
        let [east, north] = globe.compass(point[0], point[1]);
        (tangent[0] * east + tangent[1] * north).to_array()
    };
    batch.coords().chunks_exact(d).zip(tangents.chunks_exact(d)).flat_map(of).collect()
}

/// Natural splines through the heights of a batch, over the arc length on the ground; `None` where points have none.
fn heights(batch: &CurveBatch, curves: &FairCurves) -> Result<Option<Fit>> {
    if batch.dimension() == 2 {
        return Ok(None);
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
    let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
    natural.fit(&Heights::batch(batch, t, closing)?, &Device::cpu()).map(Some)
}
