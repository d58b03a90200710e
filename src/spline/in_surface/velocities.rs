//! Velocities given at the ends of splines.

use glam::DVec3;

use super::SurfaceSpline;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::vector;
use crate::spline::ends::end_tangents;
use crate::spline::knots::Knots;
use crate::status::CurveStatus;
use crate::surface::normal;

/// A tangent is perpendicular to the surface if a smaller share of it lies along the surface.
/// Points are on the surface to the same share of a curve's size.
const ACROSS: f64 = 1e-9;

/// The velocities given at the first and the last knot, in the tangent planes there.
pub(super) type Velocities = [Option<DVec3>; 2];

/// The batch with a problem for every curve that has a tangent which is not finite. `None` where
/// none has one.
pub(super) fn bounded(batch: &CurveBatch) -> Option<CurveBatch> {
    batch.constraints().tangents.as_ref()?;
    let of = |i: usize| {
        let unbounded = |k: usize| batch.tangent(i, k).filter(|tangent| tangent.iter().any(|x| !x.is_finite()));
        let (k, tangent) = (0..batch.count(i)).find_map(|k| Some((k, unbounded(k)?)))?;
        let what = format!("its tangent is {tangent:?}: give finite numbers, or leave it out");
        Some((i, refused(batch.sentence(i, k, &what))))
    };
    let problems: Vec<_> = (0..batch.len()).filter(|&i| batch.problem(i).is_none()).filter_map(of).collect();
    (!problems.is_empty()).then(|| batch.moved(batch.dimension(), batch.coords().to_vec(), problems))
}

fn refused(message: String) -> Unfitted {
    Unfitted { status: CurveStatus::Invalid, message }
}

impl SurfaceSpline {
    /// The velocities at the ends of all curves. Curves with invalid ones become unfitted.
    pub(super) fn velocities(&self, batch: &CurveBatch, knots: &mut Knots) -> Vec<Velocities> {
        let mut velocities = vec![[None; 2]; batch.len()];
        for (i, velocities) in velocities.iter_mut().enumerate() {
            if knots.unfitted.contains_key(&i) {
                continue;
            }
            match self.velocities_of(batch, knots, i) {
                Ok(found) => *velocities = found,
                Err(message) => drop(knots.unfitted.insert(i, refused(message))),
            }
        }
        velocities
    }

    fn velocities_of(&self, batch: &CurveBatch, knots: &Knots, i: usize) -> Result<Velocities, String> {
        let mut velocities = [None; 2];
        let places = knots.values(i);
        let last = batch.count(i) - 1;
        let ends = [(0, &places[..3]), (last, &places[places.len() - 3..])];
        for (end, tangent) in end_tangents(self.ends, batch, knots, i)?.into_iter().enumerate() {
            let Some(given) = tangent.map(vector) else { continue };
            let (k, place) = ends[end];
            let normal = normal(&*self.surface, vector(place));
            let along = given - given.dot(normal) * normal;
            if along.length() <= ACROSS * given.length() && given != DVec3::ZERO {
                let what = format!(
                    "its tangent {:?} stands across {}: give one along it, or leave it out",
                    given.to_array(),
                    self.surface.name()
                );
                return Err(batch.sentence(i, k, &what));
            }
            velocities[end] = Some(along);
        }
        Ok(velocities)
    }
}
