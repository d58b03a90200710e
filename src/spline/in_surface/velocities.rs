//! Velocities that are given at the ends of splines.

use glam::DVec3;

use super::SurfaceSpline;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraints;
use crate::curve::vector;
use crate::error::Result;
use crate::spline::ends::end_tangents;
use crate::spline::knots::Knots;
use crate::status::CurveStatus;
use crate::surface::{Globe, normal};

/// Vectors with a smaller part of them along the surface stand across it, but for rounding: points are on the surface to as much
/// of a curve's size.
const ACROSS: f64 = 1e-9;

/// The velocities given at the first and the last knot, in the tangent planes there.
pub(super) type Velocities = [Option<DVec3>; 2];

/// A batch of longitudes and latitudes in space, with its rates in degrees as velocities.
pub(super) fn with_velocities(spatial: CurveBatch, globe: Globe, batch: &CurveBatch) -> Result<CurveBatch> {
    let Some(tangents) = &batch.constraints().tangents else { return Ok(spatial) };
    let d = batch.dimension();
    let of = |(point, rate): (&[f64], &[f64])| globe.velocity([point[0], point[1]], [rate[0], rate[1]]).to_array();
    let velocities = batch.coords().chunks_exact(d).zip(tangents.chunks_exact(d)).flat_map(of).collect();
    spatial.with_constraints(Constraints { tangents: Some(velocities), ..batch.constraints().clone() })
}

/// The batch with a problem for every curve that has a tangent which is not finite. `None` where none has one.
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
    /// The velocities at the ends of all curves. Curves that cannot have theirs are not fitted.
    pub(super) fn velocities(&self, batch: &CurveBatch, knots: &mut Knots) -> Vec<Velocities> {
        let found: Vec<Result<Velocities, String>> = (0..batch.len())
            .map(|i| if knots.unfitted.contains_key(&i) { Ok([None; 2]) } else { self.velocities_of(batch, knots, i) })
            .collect();
        let mut velocities = Vec::with_capacity(found.len());
        for (i, found) in found.into_iter().enumerate() {
            velocities.push(found.unwrap_or_else(|message| {
                knots.unfitted.insert(i, refused(message));
                [None; 2]
            }));
        }
        velocities
    }

    fn velocities_of(&self, batch: &CurveBatch, knots: &Knots, i: usize) -> Result<Velocities, String> {
        let mut velocities = [None; 2];
        let places = knots.values(i);
        let last = batch.count(i) - 1;
        let ends = [(0, &places[..3]), (last, &places[places.len() - 3..])];
        for ((velocity, tangent), (k, place)) in
            velocities.iter_mut().zip(end_tangents(self.ends, batch, knots, i)?).zip(ends)
        {
            let Some(given) = tangent.map(vector) else { continue };
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
            *velocity = Some(along);
        }
        Ok(velocities)
    }
}
