//! [`SurfaceSpline`]: natural, clamped, periodic and smoothing splines in a surface.

mod acceleration;
mod course;
mod curves;
mod setup;
mod velocities;

use std::sync::Arc;

use self::curves::SurfaceCurves;
use self::setup::Found;
use self::velocities::{bounded, with_velocities};
use super::ends::Ends;
use super::knots::{Coincident, Knots, Parametrisation};
use super::natural::Natural;
use super::smoothing::{Amount, Smoothing};
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::{Constraint, Constraints};
use crate::curve::Sampling;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::ground::{self, GlobeCurves, Heights, Moved, check_samples, in_space, judge_known, lifted};
use crate::parallel;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::sort;
use crate::surface::{Globe, Surface};

/// Splines in a surface: of all curves x(t) in it that go through the points at their parameters, those of the least
///
/// ```text
/// ∫ |P x″|² dt,
/// ```
///
/// where P x″, the part of x″ in the tangent plane, is the covariant acceleration. In a plane they are
/// [`Natural`](super::Natural) splines with the same ends. In a sphere they are Riemannian cubics. The parameter is kept:
/// where it is a time, the motion along the track is smooth too. Splines are C² in it.
///
/// With [`smoothing`](Self::smoothing) they make Σ w_i |p_i − x(t_i)|² + λ ∫ |P x″|² dt least, as
/// [`Smoothing`](super::Smoothing) does in space. Distances are straight, not along the surface.
///
/// Natural ends have no covariant acceleration. Where an end has a tangent it is clamped: the tangent is x′ there, in units of
/// the input per unit of t, of which the part along the surface counts. In a globe it holds degrees of longitude and of
/// latitude per unit of t, and a change of longitude at a pole is no motion. Planar tangents over a
/// [`HeightField`](crate::surface::HeightField) rise with the terrain. Smoothing meets tangents at end points that stay.
///
/// Curves are in space. Those in a [`Globe`] are of longitudes and latitudes in degrees. A third coordinate is a height:
/// splines of the same kind over the same parameters go through the heights.
///
/// # Accuracy
///
/// The unknowns are places and velocities at [`parts`](Self::parts) nodes a span, and cubics between them. The error falls as
/// h⁴, for parts of length h. In a plane it is 0. On a sphere with points 30°
/// apart, 4 parts a span leave 3e-5 of the radius, and 8 parts 2e-6. Accelerations are right to h²: 8 parts, 2e-3.
/// Newton's method is exact and takes about 4 iterations, and some more where velocities at ends are many times those between
/// points. Clamped ends have their velocities to rounding.
///
/// The result is the cubic spline through the nodes, moved onto the surface.
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
/// Source: L. Noakes, G. Heinzinger and B. Paden, *Cubic splines on curved spaces*, IMA Journal of Mathematical Control and
/// Information 6 (1989), for the functional. Places and velocities as unknowns in an embedded surface, and the derivatives, are
/// faircurve's.
#[derive(Clone, Debug)]
pub struct SurfaceSpline {
    /// The surface that curves lie in.
    pub surface: Arc<dyn Surface>,
    /// The largest distance of a data point from the surface, in units of the input; `None`, the default, is a thousandth of
    /// the curve's size. Nearer points are moved onto it.
    pub off_surface: Option<f64>,
    /// λ ≥ 0 of smoothing, in the unit of t³ times that of the weights. `None`, the default, and 0 go through the points.
    pub smoothing: Option<f64>,
    /// Whether open curves keep their end points where they are smoothed. No by default.
    pub pin_ends: bool,
    /// What holds at the ends of open curves; by default clamped where a tangent is given, else natural.
    pub ends: Ends,
    /// Parameters of the points. By default those of the batch; else centripetal ones, or with smoothing or tangents chord
    /// lengths.
    pub parametrisation: Parametrisation,
    /// Parts of every span, at whose ends the spline has its unknowns. 4 by default; 1 counts as 2.
    pub parts: usize,
    /// When a curve has converged: the last step's share of the root of the energy. 1e-8 by default.
    pub tolerance: f64,
    /// The most iterations. 100 by default.
    pub max_iterations: u32,
}

impl SurfaceSpline {
    /// Splines through points in this surface.
    pub fn new(surface: Arc<dyn Surface>) -> Self {
        SurfaceSpline {
            surface,
            off_surface: None,
            smoothing: None,
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
    /// λ, parts or a tolerance that make no sense. Constraints other than pinned points and tangents. Planar curves where the
    /// surface is no globe and no height field. Parameters asked for but absent. Tangents of smoothed curves with heights.
    ///
    /// A curve is refused, with a status and a sentence, for tangents elsewhere than at the ends of an open curve, that are not
    /// finite, or that stand across the surface.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        if let Some(bounded) = bounded(batch) {
            return self.fit(&bounded, device);
        }
        if let Some(lifted) = lifted(batch, &*self.surface) {
            return self.fit(&lifted, device);
        }
        self.check(batch)?;
        let fit = match self.surface.globe() {
            Some(globe) => self.fit_on_globe(globe, batch),
            None => {
                let moved = Moved::onto(batch, &*self.surface, self.off_surface);
                let (curves, mut reports) = self.fit_in_space(&moved.batch, batch)?;
                moved.say(&mut reports, &*self.surface);
                Ok(Fit::new(curves, reports, Device::cpu().report(true)?))
            }
        };
        device.finished(batch.len());
        fit
    }

    /// Fits every curve and samples it.
    ///
    /// # Errors
    /// Those of [`fit`](Self::fit) and of [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        check_samples(sampling, batch, Some(&*self.surface), 0)?;
        let fit = self.fit(batch, device)?;
        let polylines = fit.polylines(sampling);
        Ok((fit, polylines))
    }

    fn check(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::Argument(why));
        if let Some(lambda) = self.smoothing
            && !(lambda >= 0.0 && lambda.is_finite())
        {
            return refuse(format!(
                "the smoothing factor λ is {lambda}; it must be finite and at least 0: give another"
            ));
        }
        if self.parts == 0 {
            return refuse("a spline of 0 parts a span has no unknowns: give 1 at least".into());
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return refuse(format!("the tolerance is {}: give a positive number, such as 1e-8", self.tolerance));
        }
        ground::check(batch, &*self.surface, self.off_surface)?;
        batch.allows(&[Constraint::Pinned, Constraint::Tangents], "splines in a surface")?;
        let has_heights = self.surface.globe().is_some() && batch.dimension() == 3;
        if has_heights && self.smooths() && batch.constraints().tangents.is_some() {
            return refuse(
                "smoothing splines of heights have natural ends, and meet no tangents: leave the tangents out, or the heights"
                    .into(),
            );
        }
        Ok(())
    }

    /// Fits curves of longitudes and latitudes.
    fn fit_on_globe(&self, globe: Globe, batch: &CurveBatch) -> Result<Fit> {
        let spatial = with_velocities(in_space(globe, batch), globe, batch)?;
        let within = SurfaceSpline { surface: Arc::new(globe.surface()), ..self.clone() };
        let (curves, reports) = within.fit_in_space(&spatial, &spatial)?;
        let heights = Heights::new(self.heights(batch, &curves)?);
        let curves = GlobeCurves::new(globe, batch, Box::new(curves), heights, &reports);
        Ok(Fit::new(curves, reports, Device::cpu().report(true)?))
    }

    /// Splines through the heights of a batch, over the parameters of its curves; `None` where points have none.
    fn heights(&self, batch: &CurveBatch, curves: &SurfaceCurves) -> Result<Option<Fit>> {
        if batch.dimension() == 2 {
            return Ok(None);
        }
        let (mut t, mut closing) = (Vec::with_capacity(batch.total_points()), Vec::with_capacity(batch.len()));
        for i in 0..batch.len() {
            let (curve, count) = (curves.curve(i), batch.count(i));
            let knots = curve.knots();
            t.extend_from_slice(&knots[..count]);
            closing.push(if knots.len() > count { knots[count] - knots[count - 1] } else { 0.0 });
        }
        let heights = Heights::batch(batch, t, closing)?;
        let (parametrisation, pin_ends) = (Parametrisation::Given, self.pin_ends);
        let fit = match self.smoothing.filter(|_| self.smooths()) {
            Some(lambda) => {
                Smoothing { amount: Amount::Lambda(lambda), pin_ends, parametrisation }.fit(&heights, &Device::cpu())
            }
            None => {
                let rise = |tangent: &[f64]| [if tangent[0].is_nan() { f64::NAN } else { tangent[2] }, 0.0];
                let tangents = batch.constraints().tangents.as_ref();
                let tangents = tangents.map(|tangents| tangents.chunks_exact(3).flat_map(rise).collect());
                let heights = heights.with_constraints(Constraints { tangents, ..Constraints::default() })?;
                Natural { ends: self.ends, parametrisation, shape: false }.fit(&heights, &Device::cpu())
            }
        };
        fit.map(Some)
    }

    /// Fits curves whose points are on the surface. What is not fitted comes out as its points in `given`.
    fn fit_in_space(&self, batch: &CurveBatch, given: &CurveBatch) -> Result<(SurfaceCurves, Vec<CurveReport>)> {
        let in_lengths = self.smooths() || batch.constraints().tangents.is_some();
        let rule = match self.parametrisation {
            Parametrisation::Auto if !in_lengths && !batch.has_parameters() => Parametrisation::Centripetal,
            rule => rule,
        };
        let coincident = if self.smooths() { Coincident::Average } else { Coincident::Refuse };
        let mut knots = Knots::new(batch, rule, coincident)?;
        let velocities = self.velocities(batch, &mut knots);
        let starts = self.starts(batch, &knots, &velocities)?;
        let found = parallel::map(batch.len(), 1, |i| match knots.unfitted.get(&i) {
            Some(problem) => Err(problem.clone()),
            None => self.find(batch, &knots, i, &starts, velocities[i]),
        });
        let report = |found: &Result<Found, Unfitted>| match found {
            Ok(found) => found.report.clone(),
            Err(problem) => CurveReport::unfitted(problem.status, problem.message.clone()),
        };
        let mut reports: Vec<CurveReport> = found.iter().map(report).collect();
        let splines = self.laid(&knots, &found)?;
        let problems = found.iter().enumerate().filter_map(|(i, found)| Some((i, found.as_ref().err()?.clone())));
        let problems = sort::map(problems);
        let curves = SurfaceCurves::new(given, &knots, splines, self.parts_a_span(), problems, self.surface.clone());
        let vertices = |i: usize| {
            let nodes = found[i].as_ref().ok()?.nodes.iter().map(|node| node.place).collect();
            Some((nodes, curves.rows(i).map(|row| row as u32).collect()))
        };
        judge_known(&*self.surface, batch, &vertices, &mut reports);
        Ok((curves, reports))
    }

    /// Whether points need not be met.
    fn smooths(&self) -> bool {
        self.smoothing.is_some_and(|lambda| lambda > 0.0)
    }

    fn parts_a_span(&self) -> usize {
        // A closed curve of two points has four nodes at least.
        self.parts.max(2)
    }
}
