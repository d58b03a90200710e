//! The way of points, starts and samples onto a surface.

mod wide;

use glam::{DMat3, DVec3};
pub(super) use wide::Halved;

use super::fair::Fair;
use super::within::Local;
use crate::batch::{CurveBatch, Unfitted};
use crate::bounds::Bounds;
use crate::curve::{Jet, vector};
use crate::error::{Error, Result};
use crate::linalg::scalar::Vector;
use crate::parallel;
use crate::report::CurveReport;
use crate::status::CurveStatus;
use crate::surface::{Surface, normal};

/// Points lie off their surface by at most this part of their curve's size where nothing else is asked for.
const NEAR: f64 = 1e-3;

/// Points moved by less than this part of their curve's size were as good as on the surface.
const ROUNDING: f64 = 1e-9;

/// Newton's steps to a foot within a plane: from half a radius away 5 lead there.
pub(super) const WITHIN_STEPS: usize = 6;

/// A batch whose points have been moved onto a surface.
pub(super) struct Moved {
    pub batch: CurveBatch,
    /// The largest distance that a point of each curve was moved, with its number.
    moves: Vec<(usize, f64)>,
}

impl Fair {
    /// The surface in the coordinates of a problem whose start has these vertices.
    pub(super) fn local<const D: usize>(&self, vertices: &[Vector<f64, D>], size: f64) -> Option<Local> {
        let surface = self.surface.clone()?;
        let origin = std::array::from_fn(|c| if c < D { vertices[0][c] } else { 0.0 });
        Some(Local { surface, origin, size })
    }

    /// Moves all points onto the surface. Curves of points too far from it have a problem.
    pub(super) fn onto(&self, batch: &CurveBatch, surface: &dyn Surface) -> Moved {
        let moved = parallel::map(batch.len(), 16, |i| self.curve_onto(batch, i, surface));
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

    fn curve_onto(
        &self,
        batch: &CurveBatch,
        i: usize,
        surface: &dyn Surface,
    ) -> std::result::Result<(Vec<f64>, (usize, f64)), Unfitted> {
        let points = batch.points(i);
        if batch.problem(i).is_some() || points.is_empty() {
            return Ok((points.to_vec(), (0, 0.0)));
        }
        let size = Bounds::of(points.as_chunks::<3>().0.iter().copied()).diagonal();
        let near = self.off_surface.unwrap_or(NEAR * size);
        let (mut moved, mut most) = (Vec::with_capacity(points.len()), (0, 0.0));
        for (k, point) in points.chunks_exact(3).map(vector).enumerate() {
            let refuse = |what: String| Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &what) };
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
            moved.extend(closest.to_array());
        }
        Ok((moved, if most.1 > ROUNDING * size { most } else { (0, 0.0) }))
    }

    /// Checks that curves can be fitted in the surface, if there is one.
    ///
    /// # Errors
    /// Planar curves. Energies of order 3. What is not kept in surfaces. Geodesic bending without a surface.
    pub(super) fn check_surface(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::Argument(why));
        let Some(surface) = &self.surface else {
            return match self.energy.is_geodesic() {
                true => refuse("geodesic bending is that of curves in a surface: give one, or ask for bending".into()),
                false => Ok(()),
            };
        };
        if let Some(quadric) = surface.quadric() {
            quadric.check()?;
        }
        let constraints = batch.constraints();
        let is_planar = batch.dimension() == 2;
        let what = if surface.globe().is_none() && is_planar {
            return refuse(format!(
                "curves in {} have points of three coordinates, and these have two",
                surface.name()
            ));
        } else if self.energy.order() > 2 {
            "have no variation and no torsion in their energy: ask for geodesic bending"
        } else if !self.limits.is_empty(batch) {
            "keep no limits yet: leave them out"
        } else if constraints.curvatures.is_some() {
            "keep no curvature vectors yet: leave them out"
        } else {
            return match self.off_surface {
                Some(most) if most.is_nan() || most < 0.0 => refuse(format!(
                    "points may lie {most} off the surface: give a distance of at least 0 in units of the input"
                )),
                _ => Ok(()),
            };
        };
        refuse(format!("curves in {} {what}", surface.name()))
    }
}

impl Moved {
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

/// The vertex after which a curve moved onto a surface is lost: one that is no number, or from which the normal turns by more
/// than 90° to the next.
pub(super) fn lost_between<const D: usize>(surface: &dyn Surface, vertices: &[Vector<f64, D>]) -> Option<usize> {
    let normals: Vec<DVec3> = vertices.iter().map(|vertex| normal(surface, vector(vertex))).collect();
    let turns_little = |row: usize| normals[row - 1].dot(normals[row]) > 0.0;
    (1..normals.len()).find(|&row| !turns_little(row)).map(|row| row - 1)
}

/// The point of a surface where the way along ∇F within a plane ends, for the vector across the plane.
pub(super) fn foot_within<const D: usize>(
    surface: &dyn Surface,
    x: Vector<f64, D>,
    across: Vector<f64, D>,
) -> Vector<f64, D> {
    let (mut foot, across) = (vector(&x), vector(&across));
    for _ in 0..WITHIN_STEPS {
        let gradient = surface.gradient(foot);
        let way = gradient - gradient.dot(across) * across;
        foot -= surface.value(foot) / way.length_squared() * way;
    }
    std::array::from_fn(|c| foot[c])
}

/// A point with its derivatives, moved onto a surface.
///
/// The foot y of x = y + d n moves by (I + d S)⁻¹ P x′ with the shape operator S = P W P. Higher derivatives are left.
pub(super) fn jet_onto(surface: &dyn Surface, jet: Jet) -> Jet {
    let point = surface.foot(jet.point).unwrap_or(DVec3::NAN);
    let gradient = surface.gradient(point);
    let (normal, length) = (gradient.normalize(), gradient.length());
    let tangential = |v: DVec3| v - v.dot(normal) * normal;
    let away = (jet.point - point).dot(normal) / length;
    let shape = surface.hessian(point) * away;
    let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| e + tangential(shape * tangential(e)));
    let spread = DMat3::from_cols(columns[0], columns[1], columns[2]);
    Jet { point, first: spread.inverse() * tangential(jet.first), ..jet }
}
