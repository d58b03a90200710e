//! [`SurfaceSpline`]: natural, clamped, periodic and smoothing splines in a surface.

mod acceleration;
mod course;
mod curves;
mod on_globe;
mod setup;
mod velocities;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use self::curves::SurfaceCurves;
use self::velocities::bounded;
use super::ends::Ends;
use super::knots::{Coincident, Knots, Parametrisation};
use super::natural::Natural;
use super::smoothing::{Smoothing, SmoothingTarget};
use crate::batch::CurveBatch;
use crate::constraint::{Constraint, Constraints};
use crate::curve::Sampling;
use crate::deviation::Deviation;
use crate::device::{Device, DeviceReport, Work};
use crate::error::{Error, Result};
use crate::ground::{self, SurfaceMethod, check_samples, fit_in_surface, judge_known, lifted};
use crate::parallel;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::surface::{Globe, Surface};

/// Splines in a surface: the curves x(t) in it through the points at their parameters with the
/// least
///
/// ```text
/// ∫ |P x″|² dt,
/// ```
///
/// where P x″, the part of x″ in the tangent plane, is the covariant acceleration. In a plane they
/// are [`Natural`](super::Natural) splines with the same ends. In a sphere they are Riemannian
/// cubics. The parameter is kept: if it is a time, the motion along the track is smooth too.
/// Splines are C² in it.
///
/// With a λ of [`smoothing`](Self::smoothing) they minimise Σ w_i |p_i − x(t_i)|² + λ ∫ |P x″|² dt, as
/// [`Smoothing`](super::Smoothing) does in space. Distances are straight, not along the surface.
///
/// With a distance, or a λ chosen by the data, curves on a [`Globe`] are fitted as by
/// [`Smoothing`](super::Smoothing) in a plane. The globe is mapped conformally onto it, about the great
/// circle nearest to the track, and every point gets its own radius, so that distances on the ground are
/// kept exactly. The energy is measured in the plane.
///
/// Natural ends have no covariant acceleration. An end with a tangent is clamped: the tangent is x′
/// there, in units of the input per unit of t. Only its part along the surface counts. In a globe
/// it holds degrees of longitude and latitude per unit of t, and a change of longitude at a pole is
/// no motion. Planar tangents over a [`HeightField`](crate::surface::HeightField) rise with the
/// terrain. Smoothing keeps tangents at end points that are pinned.
///
/// Curves are in space. Curves in a [`Globe`] have longitudes and latitudes in degrees. A third
/// coordinate is a height: splines of the same kind over the same parameters go through the
/// heights.
///
/// # Accuracy
///
/// The unknowns are positions and velocities at [`parts`](Self::parts) nodes per span, with cubics
/// between them. The error falls as h⁴, for parts of length h. In a plane it is 0. On a sphere with
/// points 30° apart, 4 parts per span leave 3e-5 of the radius, and 8 parts 2e-6. Accelerations
/// converge as h²: 8 parts leave 2e-3. Newton's method takes about 4 iterations, and some more if
/// velocities at ends are many times those between points. Clamped ends have their velocities to
/// rounding.
///
/// The result is the cubic spline through the nodes, projected onto the surface.
///
/// # Examples
///
/// ```
/// use std::sync::Arc;
/// use faircurve::{CurveBatch, Device, Sampling, spline::SurfaceSpline, surface::Globe};
///
/// // Over the date line, an hour apart.
/// let track = [[170.0, 10.0], [178.0, 14.0], [-172.0, 15.0], [-165.0, 20.0]];
/// let batch = CurveBatch::from_slices(&[&track[..]])?.with_parameters(vec![0.0, 1.0, 2.0, 3.0])?;
/// let fit = SurfaceSpline::new(Arc::new(Globe::WGS84)).fit(&batch, &Device::cpu())?;
/// let middle = fit.curve(0).point(1.5);
/// assert!((middle.x - 183.1).abs() < 0.01 && (middle.y - 14.44).abs() < 0.01);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: L. Noakes, G. Heinzinger and B. Paden, *Cubic splines on curved spaces*, IMA Journal of
/// Mathematical Control and Information 6 (1989), for the functional. The discretisation is
/// faircurve's.
#[derive(Clone, Debug)]
pub struct SurfaceSpline {
    /// The surface that curves lie in.
    pub surface: Arc<dyn Surface>,
    /// The largest distance of a data point from the surface, in units of the input. `None`, the
    /// default, is a thousandth of the curve's size. Nearer points are moved onto it.
    pub off_surface: Option<f64>,
    /// How much is smoothed. `None`, the default, and λ = 0 interpolate. Distances are in metres for
    /// [`Deviation::Metres`](crate::Deviation::Metres), and else in the unit of the globe.
    pub smoothing: Option<SmoothingTarget>,
    /// How much heights are smoothed. `None`, the default, smooths them by the λ of
    /// [`smoothing`](Self::smoothing), and goes through them with a distance.
    pub heights: Option<SmoothingTarget>,
    /// Whether smoothed open curves keep their end points. No by default.
    pub pin_ends: bool,
    /// Conditions at the ends of open curves; by default clamped where a tangent is given, else
    /// natural.
    pub ends: Ends,
    /// Parameters of the points.
    pub parametrisation: Parametrisation,
    /// Parts per span. 4 by default; 1 counts as 2.
    pub parts: usize,
    /// Convergence: the last step's share of the root of the energy. 1e-8 by default.
    pub tolerance: f64,
    /// The most iterations. 100 by default.
    pub max_iterations: u32,
}

impl SurfaceSpline {
    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`].
    pub fn work(&self, points: usize) -> Work {
        Work { points, cost: 10.0, on_host: 1.0 }
    }

    /// Splines through points in this surface.
    pub fn new(surface: Arc<dyn Surface>) -> Self {
        SurfaceSpline {
            surface,
            off_surface: None,
            smoothing: None,
            heights: None,
            pin_ends: false,
            ends: Ends::Auto,
            parametrisation: Parametrisation::Auto,
            parts: 4,
            tolerance: 1e-8,
            max_iterations: 100,
        }
    }

    /// Fits every curve of the batch, on all threads of the CPU in f64, on every device.
    ///
    /// The energy reported is ∫|P x″|² dt.
    ///
    /// # Errors
    /// An invalid λ, number of parts or tolerance. Constraints other than pinned points and
    /// tangents. Planar curves, unless the surface is a globe or a height field.
    /// [`Parametrisation::Given`] without parameters. Tangents of smoothed curves with heights.
    ///
    /// A curve is refused, with a status and a sentence, if it has a tangent that is not at an end
    /// of an open curve, not finite, or perpendicular to the surface.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        let bounded = bounded(batch);
        let batch = bounded.as_ref().unwrap_or(batch);
        let lifted = lifted(batch, &*self.surface);
        let batch = lifted.as_ref().unwrap_or(batch);
        self.check(batch)?;
        let fit = fit_in_surface(self, &self.surface, self.off_surface, batch, device);
        device.finished(batch.len());
        fit
    }

    /// Fits every curve and samples it.
    ///
    /// # Errors
    /// As [`fit`](Self::fit) and [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        check_samples(sampling, batch, Some(&*self.surface), 0)?;
        let fit = self.fit(batch, device)?;
        let polylines = fit.polylines(sampling);
        Ok((fit, polylines))
    }

    fn check(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::Argument(why));
        let on_globe = self.surface.kind().globe().is_some();
        for target in [self.smoothing, self.heights].into_iter().flatten() {
            match target {
                SmoothingTarget::Lambda(lambda) if !(lambda >= 0.0 && lambda.is_finite()) => {
                    return refuse(format!(
                        "the smoothing factor λ is {lambda}; it must be finite and at least 0: give another"
                    ));
                }
                SmoothingTarget::Deviation(own) | SmoothingTarget::Tube(own)
                    if !(own.number() > 0.0 && own.number().is_finite()) =>
                {
                    return refuse(format!("the distance is {own}; it must be positive and finite: give another"));
                }
                _ => {}
            }
        }
        if self.is_near() && !on_globe {
            return refuse(
                "splines within a distance, or with a λ chosen by their data, lie on a globe, and this surface is none: give λ"
                    .into(),
            );
        }
        if self.parts == 0 {
            return refuse("a spline of 0 parts a span has no unknowns: give 1 at least".into());
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return refuse(format!("the tolerance is {}: give a positive number, such as 1e-8", self.tolerance));
        }
        ground::check(batch, &*self.surface, self.off_surface)?;
        batch.allows(&[Constraint::Pinned, Constraint::Tangents], "splines in a surface")?;
        if self.is_near() && batch.constraints().tangents.is_some() {
            return refuse("splines within a distance of their points meet no tangents: leave the tangents out".into());
        }
        let has_heights = on_globe && batch.dimension() == 3;
        if has_heights && self.lambda().is_some() && batch.constraints().tangents.is_some() {
            return refuse(
                "smoothing splines of heights have natural ends, and meet no tangents: leave the tangents out, or the heights"
                    .into(),
            );
        }
        Ok(())
    }

    /// Fits curves whose points are on the surface. Unfitted curves come out as their points in
    /// `given`.
    fn fit_points(
        &self,
        globe: Option<Globe>,
        batch: &CurveBatch,
        given: &CurveBatch,
    ) -> Result<(SurfaceCurves, Vec<CurveReport>)> {
        let coincident =
            if self.lambda().is_some() || self.is_near() { Coincident::Average } else { Coincident::Refuse };
        let mut knots = Knots::new(batch, self.parametrisation, coincident)?;
        let near = globe.filter(|_| self.is_near());
        let velocities = self.velocities(batch, &mut knots);
        let starts = if near.is_none() { Some(self.starts(&knots, &velocities)?) } else { None };
        let found = parallel::map(batch.len(), 1, |i| match (knots.unfitted.get(&i), near, &starts) {
            (Some(problem), ..) => Err(problem.clone()),
            (_, _, Some(starts)) => self.find(batch, &knots, i, starts, velocities[i]),
            (_, Some(globe), _) => self.near_on(globe, batch, &knots, i),
            _ => unreachable!("a spline starts, or is near its points"),
        });
        let (mut reports, mut problems) = (Vec::with_capacity(batch.len()), BTreeMap::new());
        for (i, found) in found.iter().enumerate() {
            reports.push(match found {
                Ok(found) => found.report.clone(),
                Err(problem) => {
                    problems.insert(i, problem.clone());
                    CurveReport::unfitted(problem.status, problem.message.clone())
                }
            });
        }
        let splines = self.laid(&knots, &found)?;
        let parts = self.parts_per_span();
        let curves = SurfaceCurves::new(given, knots, splines, parts, problems, self.surface.clone());
        let vertices = |i: usize| {
            let nodes = found[i].as_ref().ok()?.nodes.iter().map(|node| node.place).collect();
            Some((nodes, curves.rows(i).map(|row| row as u32).collect()))
        };
        judge_known(&*self.surface, batch, &vertices, &mut reports);
        Ok((curves, reports))
    }

    /// λ of smoothing splines. `None` for splines through the points.
    fn lambda(&self) -> Option<f64> {
        match self.smoothing {
            Some(SmoothingTarget::Lambda(lambda)) if lambda > 0.0 => Some(lambda),
            _ => None,
        }
    }

    /// Whether curves are within a distance of their points, or as near as their data say.
    fn is_near(&self) -> bool {
        !matches!(self.smoothing, None | Some(SmoothingTarget::Lambda(_)))
    }

    fn parts_per_span(&self) -> usize {
        // A closed curve of two points has four nodes at least.
        self.parts.max(2)
    }
}

impl SurfaceMethod for SurfaceSpline {
    type Curves = SurfaceCurves;

    fn fit_in_space(
        &self,
        surface: &Arc<dyn Surface>,
        batch: &CurveBatch,
        given: &CurveBatch,
        _: &Device,
    ) -> Result<(SurfaceCurves, Vec<CurveReport>, DeviceReport)> {
        let within = SurfaceSpline { surface: surface.clone(), ..self.clone() };
        let (curves, reports) = within.fit_points(self.surface.kind().globe(), batch, given)?;
        Ok((curves, reports, Device::cpu().report(true)?))
    }

    fn tangent_in_space(globe: Globe, point: [f64; 2], rates: [f64; 2]) -> DVec3 {
        globe.velocity(point, rates)
    }

    fn fit_heights(&self, batch: &CurveBatch, curves: &SurfaceCurves) -> Result<Fit> {
        let (mut t, mut closing) = (Vec::with_capacity(batch.total_points()), Vec::with_capacity(batch.len()));
        for i in 0..batch.len() {
            let (curve, count) = (curves.curve(i), batch.count(i));
            let knots = curve.knots();
            t.extend_from_slice(&knots[..count]);
            closing.push(if knots.len() > count { knots[count] - knots[count - 1] } else { 0.0 });
        }
        let heights = ground::heights(batch, t, closing)?;
        let (parametrisation, pin_ends) = (Parametrisation::Given, self.pin_ends);
        // Heights are in metres where lengths are.
        let in_units = |own: Deviation| match own {
            Deviation::Metres(metres) => Deviation::Units(metres),
            other => other,
        };
        let target = self.heights.map(|target| target.with(in_units));
        if let Some(target) = target.or(self.lambda().map(SmoothingTarget::Lambda)) {
            let smoothing = Smoothing { target, pin_ends, parametrisation };
            return smoothing.fit(&heights, &Device::cpu());
        }
        let rise = |tangent: &[f64]| [if tangent[0].is_nan() { f64::NAN } else { tangent[2] }, 0.0];
        let tangents = batch.constraints().tangents.as_ref();
        let tangents = tangents.map(|tangents| tangents.chunks_exact(3).flat_map(rise).collect());
        let heights = heights.with_constraints(Constraints { tangents, ..Constraints::default() })?;
        Natural { ends: self.ends, parametrisation, shape: false }.fit(&heights, &Device::cpu())
    }
}
