//! Projection of points, splines and samples onto a surface.

use glam::{DMat3, DVec3};

use super::globe::in_space;
use crate::batch::{CurveBatch, Unfitted};
use crate::bounds::Bounds;
use crate::constraint::Constraints;
use crate::curve::{Jet, Sampling, vector};
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::CurveReport;
use crate::status::CurveStatus;
use crate::surface::Surface;

/// By default points lie off their surface by at most this part of their curve's size.
const NEAR: f64 = 1e-3;

/// Points moved by less than this part of their curve's size were on the surface to rounding.
const ROUNDING: f64 = 1e-9;

/// Lifts a planar batch onto a surface z = h(x, y), with its tangents. `None` if the surface is
/// [no such surface](Surface::over), or the batch is spatial or has curvatures.
pub(crate) fn lifted(batch: &CurveBatch, surface: &dyn Surface) -> Option<CurveBatch> {
    let constraints = batch.constraints();
    if batch.dimension() != 2 || constraints.curvatures.is_some() {
        return None;
    }
    surface.over(0.0, 0.0)?;
    let over = |point: &[f64]| surface.over(point[0], point[1]).unwrap_or(DVec3::NAN);
    let points = || batch.coords().chunks_exact(2);
    // ∇F·v = 0
    let rising = |(point, tangent): (&[f64], &[f64])| {
        let gradient = surface.gradient(over(point));
        let [x, y] = [tangent[0], tangent[1]];
        [x, y, -(gradient.x * x + gradient.y * y) / gradient.z]
    };
    let tangents = |tangents: &Vec<f64>| points().zip(tangents.chunks_exact(2)).flat_map(rising).collect();
    let constraints = Constraints { tangents: constraints.tangents.as_ref().map(tangents), ..constraints.clone() };
    let lifted = batch.moved(3, points().flat_map(|point| over(point).to_array()).collect(), Vec::new());
    Some(lifted.with_constraints(constraints).expect("a tangent of three coordinates a point"))
}

/// Checks that curves of a batch can lie in a surface, and the largest distance of their points.
///
/// # Errors
/// Invalid quadrics. Planar curves, except on a globe. An invalid distance.
pub(crate) fn check(batch: &CurveBatch, surface: &dyn Surface, off: Option<f64>) -> Result<()> {
    if let Some(quadric) = surface.kind().quadric() {
        quadric.check()?;
    }
    if surface.kind().globe().is_none() && batch.dimension() == 2 {
        return Err(Error::Argument(format!(
            "curves in {} have points of three coordinates, and these have two",
            surface.name()
        )));
    }
    match off {
        Some(most) if most.is_nan() || most < 0.0 => Err(Error::Argument(format!(
            "points may lie {most} off the surface: give a distance of at least 0 in units of the input"
        ))),
        _ => Ok(()),
    }
}

/// Checks, before the fit, that samples with this many columns fit into memory. Spacings are
/// lengths in the surface.
///
/// # Errors
/// See [`Sampling::check`].
pub(crate) fn check_samples(
    sampling: Sampling,
    batch: &CurveBatch,
    surface: Option<&dyn Surface>,
    columns: usize,
) -> Result<()> {
    match surface.and_then(|surface| surface.kind().globe()) {
        Some(globe) => sampling.check_with(&in_space(globe, batch), columns),
        None => sampling.check_with(batch, columns),
    }
}

/// The sentence for a start that leaves the surface after a point.
pub(crate) fn lost(surface: &dyn Surface) -> String {
    format!(
        "the way to the next point passes a place of which {} has no one point that is nearest, such as its middle: give \
         points between",
        surface.name()
    )
}

/// A batch whose points have been moved onto a surface.
pub(crate) struct Moved {
    pub batch: CurveBatch,
    /// The point of each curve that was moved farthest, and its distance.
    moves: Vec<(usize, f64)>,
}

impl Moved {
    /// Moves all points onto the surface. Curves of points farther from it than `off` have a
    /// problem; without a distance that is a thousandth of their size.
    pub fn onto(batch: &CurveBatch, surface: &dyn Surface, off: Option<f64>) -> Self {
        let moved = parallel::map(batch.len(), 16, |i| curve_onto(batch, i, surface, off));
        let (mut coords, mut moves, mut problems) = (batch.coords().to_vec(), Vec::new(), Vec::new());
        for (i, moved) in moved.into_iter().enumerate() {
            match moved {
                Ok((own, most)) => {
                    coords[3 * batch.offsets()[i]..3 * batch.offsets()[i + 1]].copy_from_slice(&own);
                    moves.push(most);
                }
                Err(problem) => {
                    moves.push((0, 0.0));
                    problems.push((i, problem));
                }
            }
        }
        Moved { batch: batch.moved(3, coords, problems), moves }
    }

    /// Says in the reports which curves were moved.
    pub fn say(&self, reports: &mut [CurveReport], surface: &dyn Surface) {
        for (i, (report, &(k, most))) in reports.iter_mut().zip(&self.moves).enumerate() {
            if most > 0.0 && report.message.is_none() {
                let what = format!("it and others were moved onto {}, by up to {most:.3e}", surface.name());
                report.message = Some(self.batch.sentence(i, k, &what));
            }
        }
    }
}

fn curve_onto(
    batch: &CurveBatch,
    i: usize,
    surface: &dyn Surface,
    off: Option<f64>,
) -> Result<(Vec<f64>, (usize, f64)), Unfitted> {
    let points = batch.points(i);
    if batch.problem(i).is_some() || points.is_empty() {
        return Ok((points.to_vec(), (0, 0.0)));
    }
    let size = Bounds::of(points.as_chunks::<3>().0.iter().copied()).diagonal();
    let near = off.unwrap_or(NEAR * size);
    let (mut moved, mut most) = (Vec::with_capacity(points.len()), (0, 0.0));
    for (k, point) in points.chunks_exact(3).map(vector).enumerate() {
        let refuse = |what: String| Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &what) };
        // A place over which the surface has no point.
        if let Some(why) = surface.undefined(point).filter(|_| point.is_nan()) {
            return Err(refuse(format!("it {why}: move it, or leave it out")));
        }
        let Some(closest) = surface.closest(point) else {
            return Err(refuse(format!("{} has no point closest to it: move it", surface.name())));
        };
        let away = closest.distance(point);
        if !(away <= near || away <= ROUNDING * point.length()) {
            return Err(refuse(format!(
                "it lies {away:.4e} off {}, and {near:.4e} is allowed: move it onto the surface, or allow more",
                surface.name()
            )));
        }
        if away > most.1 {
            most = (k, away);
        }
        if let Some(why) = surface.undefined(closest) {
            return Err(refuse(format!("it {why}: move it, or leave it out")));
        }
        moved.extend(closest.to_array());
    }
    Ok((moved, if most.1 > ROUNDING * size { most } else { (0, 0.0) }))
}

/// Reports curves as infeasible that go where their surface is undefined.
///
/// `vertices` gives the vertices of a fitted curve, and the rows of its data points.
pub(crate) fn judge_known(
    surface: &dyn Surface,
    batch: &CurveBatch,
    vertices: &dyn Fn(usize) -> Option<(Vec<DVec3>, Vec<u32>)>,
    reports: &mut [CurveReport],
) {
    for (i, report) in reports.iter_mut().enumerate() {
        let Some((places, rows)) = vertices(i) else { continue };
        let lost = places.iter().enumerate().find_map(|(row, x)| Some((row, surface.undefined(*x)?)));
        if let Some((row, why)) = lost {
            let after = rows.partition_point(|&own| own as usize <= row).saturating_sub(1);
            let what =
                format!("the curve after it {why}: put points between, which keep it where the surface is known");
            report.status = CurveStatus::Infeasible;
            report.message = Some(batch.sentence(i, after.min(batch.count(i) - 1), &what));
        }
    }
}

/// A point with its derivatives, moved onto a surface.
///
/// The projection y of x = y + d n moves by (I + d S)⁻¹ P x′ with the shape operator S = P W P.
/// Higher derivatives stay as they are.
pub(crate) fn jet_onto(surface: &dyn Surface, jet: Jet) -> Jet {
    let point = surface.project(jet.point).unwrap_or(DVec3::NAN);
    let gradient = surface.gradient(point);
    let (normal, length) = (gradient.normalize(), gradient.length());
    let tangential = |v: DVec3| v - v.dot(normal) * normal;
    let away = (jet.point - point).dot(normal) / length;
    let shape = surface.hessian(point) * away;
    let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| e + tangential(shape * tangential(e)));
    let spread = DMat3::from_cols(columns[0], columns[1], columns[2]);
    Jet { point, first: spread.inverse() * tangential(jet.first), ..jet }
}
