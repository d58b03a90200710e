//! [`fit_in_surface`]: fits of every method in every kind of surface.

use std::sync::Arc;

use glam::DVec3;

use super::globe::{GlobeCurves, in_space};
use super::onto::Moved;
use crate::batch::CurveBatch;
use crate::constraint::Constraints;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::surface::{Globe, Surface};

/// A method whose curves lie in a surface.
pub(crate) trait SurfaceMethod {
    type Curves: CurveSet + 'static;

    /// Fits curves whose points are on the surface. Unfitted curves come out as their points in
    /// `given`.
    fn fit_in_space(
        &self,
        surface: &Arc<dyn Surface>,
        batch: &CurveBatch,
        given: &CurveBatch,
        device: &Device,
    ) -> Result<(Self::Curves, Vec<CurveReport>, DeviceReport)>;

    /// A tangent at a longitude and a latitude, as a vector in space.
    fn tangent_in_space(globe: Globe, point: [f64; 2], tangent: [f64; 2]) -> DVec3;

    /// Curves through the heights of a batch, over the parameters of its curves.
    fn fit_heights(&self, batch: &CurveBatch, curves: &Self::Curves) -> Result<Fit>;
}

/// Fits curves in a surface. Their points are moved onto it if they are no farther than `off`.
pub(crate) fn fit_in_surface<M: SurfaceMethod>(
    method: &M,
    surface: &Arc<dyn Surface>,
    off: Option<f64>,
    batch: &CurveBatch,
    device: &Device,
) -> Result<Fit> {
    let Some(globe) = surface.kind().globe() else {
        let moved = Moved::onto(batch, &**surface, off);
        let (curves, mut reports, did) = method.fit_in_space(surface, &moved.batch, batch, device)?;
        moved.say(&mut reports, &**surface);
        return Ok(Fit::new(curves, reports, did));
    };
    let (mut spatial, d) = (in_space(globe, batch), batch.dimension());
    if let Some(tangents) = &batch.constraints().tangents {
        let mut in_space = Vec::with_capacity(3 * batch.total_points());
        for (point, tangent) in batch.coords().chunks_exact(d).zip(tangents.chunks_exact(d)) {
            let [point, tangent] = [point, tangent].map(|x| [x[0], x[1]]);
            in_space.extend(M::tangent_in_space(globe, point, tangent).to_array());
        }
        spatial = spatial.with_constraints(Constraints { tangents: Some(in_space), ..batch.constraints().clone() })?;
    }
    let surface: Arc<dyn Surface> = Arc::new(globe.surface());
    let (curves, reports, did) = method.fit_in_space(&surface, &spatial, &spatial, device)?;
    let heights = if d == 3 { Some(method.fit_heights(batch, &curves)?) } else { None };
    let curves = GlobeCurves::new(globe, batch, Box::new(curves), heights, &reports);
    Ok(Fit::new(curves, reports, did))
}
