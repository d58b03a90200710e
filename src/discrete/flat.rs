//! Fits curves in space whose points lie in a plane within that plane, if the energy contains
//! variation.
//!
//! The planar curve of least variation is stationary in space too, but seldom a minimum there.
//! Where the curve turns sharply a little torsion reduces the energy, and Newton's method in space
//! strays into loops, the more so the finer the edges are. Planar data do not justify this.

use glam::DVec3;

use super::curves::{EvenVertices, Fitted, Vertices};
use super::energy::Functional;
use super::fair::Fair;
use super::tally::Tally;
use crate::Constraints;
use crate::batch::CurveBatch;
use crate::curve::vector;
use crate::error::Result;

/// Points are coplanar up to 16 roundings of their largest coordinate, and vectors up to 16
/// roundings of their length.
const ROUNDINGS: f64 = 16.0;

/// Points are collinear within this fraction of their extent.
const LINE: f64 = 1e-9;

/// A plane with two orthonormal directions in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    origin: DVec3,
    axes: [DVec3; 2],
}

impl Plane {
    /// The plane of points and vectors. `None` if they are not coplanar, or if the points are
    /// collinear.
    fn of(points: &[DVec3], vectors: &[DVec3]) -> Option<Self> {
        let far = |from: &dyn Fn(DVec3) -> f64| points.iter().copied().max_by(|a, b| from(*a).total_cmp(&from(*b)));
        let first = *points.first()?;
        let second = far(&|point| point.distance_squared(first))?;
        let along = (second - first).try_normalize()?;
        let away = |point: DVec3| point - first - (point - first).dot(along) * along;
        let third = far(&|point| away(point).length_squared())?;
        if away(third).length() <= LINE * first.distance(second) {
            return None;
        }
        let level = (0..3).find(|&c| points.iter().all(|point| point[c] == first[c]));
        let plane = match level {
            // The plane uses two of the three coordinates, without rounding.
            Some(c) => {
                Plane { origin: DVec3::AXES[c] * first[c], axes: [DVec3::AXES[(c + 1) % 3], DVec3::AXES[(c + 2) % 3]] }
            }
            None => Plane { origin: first, axes: [along, away(third).normalize()] },
        };
        let normal = plane.axes[0].cross(plane.axes[1]);
        let largest = points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
        let is_near = |x: f64, size: f64| x.abs() <= ROUNDINGS * f64::EPSILON * size;
        let lie = points.iter().all(|&point| is_near((point - plane.origin).dot(normal), largest));
        (lie && vectors.iter().all(|vector| is_near(vector.dot(normal), vector.length()))).then_some(plane)
    }

    /// The components of a vector in the plane.
    fn part(&self, vector: DVec3) -> [f64; 2] {
        self.axes.map(|axis| vector.dot(axis))
    }

    fn project(&self, point: DVec3) -> [f64; 2] {
        self.part(point - self.origin)
    }

    fn lift(&self, [x, y]: [f64; 2]) -> DVec3 {
        x * self.axes[0] + y * self.axes[1]
    }
}

/// The planes of the planar curves of a batch; all `None` if the options do not call for them.
pub(super) fn planes(fair: &Fair, batch: &CurveBatch) -> Vec<Option<Plane>> {
    let varies = |(weight, own): &(f64, Functional)| *weight > 0.0 && matches!(own, Functional::Variation(_));
    let none = || vec![None; batch.len()];
    if batch.dimension() < 3
        || fair.surface.is_some()
        || !fair.limits.is_empty(batch)
        || !fair.energy.terms().iter().any(varies)
    {
        return none();
    }
    let constraints = batch.constraints();
    let plane = |i: usize| {
        let points: Vec<DVec3> = batch.points(i).chunks_exact(3).map(vector).collect();
        let own = 3 * batch.offsets()[i]..3 * batch.offsets()[i + 1];
        let columns = [&constraints.tangents, &constraints.curvatures].into_iter().flatten();
        let vectors = columns.flat_map(|column| column[own.clone()].chunks_exact(3).map(vector));
        let given: Vec<DVec3> = vectors.filter(|vector| !vector.x.is_nan()).collect();
        let is_good = batch.problem(i).is_none() && points.iter().chain(&given).all(|x| x.is_finite());
        if is_good { Plane::of(&points, &given) } else { None }
    };
    (0..batch.len()).map(plane).collect()
}

/// Fits planar curves in their planes, and all others in space.
pub(super) fn fit(
    batch: &CurveBatch,
    planes: &[Option<Plane>],
    tally: &Tally<'_>,
    in_plane: impl Fn(&CurveBatch, &Tally<'_>) -> Result<Fitted>,
    in_space: impl Fn(&CurveBatch, &Tally<'_>) -> Result<Fitted>,
) -> Result<Fitted> {
    let (lying, others): (Vec<usize>, Vec<usize>) = (0..batch.len()).partition(|&i| planes[i].is_some());
    let flat = in_planes(&batch.emptied(&others), planes);
    let planar = in_plane(&flat, &tally.of_some(&|i| planes[i].is_some()))?.owned(&flat);
    let spatial = match others.is_empty() {
        true => None,
        false => {
            let counts = |i: usize| planes[i].is_none();
            let tally = tally.of_some(&counts);
            let spatial = batch.emptied(&lying);
            Some(in_space(&spatial, &tally)?.owned(&spatial))
        }
    };
    let device = spatial.as_ref().map_or(&planar, |spatial| spatial).device.clone();
    let lifted = |(plane, i): (&Plane, usize), curve: Vertices| {
        let points: Vec<DVec3> = batch.points(i).chunks_exact(3).map(vector).collect();
        let place = |x: [f64; 2], point: Option<DVec3>| match point {
            Some(point) if plane.project(point) == x => point,
            _ => plane.origin + plane.lift(x),
        };
        curve.lifted(&points, &place, &|vector| plane.lift([vector.x, vector.y]))
    };
    let mut spatial = spatial.map(|spatial| spatial.curves.into_iter().zip(spatial.reports));
    let all = planar.curves.into_iter().zip(planar.reports).enumerate().map(|(i, (curve, report))| {
        let other = spatial.as_mut().and_then(Iterator::next);
        match &planes[i] {
            Some(plane) => (curve.map(|curve| lifted((plane, i), curve)), report),
            None => other.expect("what lies in no plane is fitted in space"),
        }
    });
    let (curves, reports) = all.unzip();
    Ok(Fitted { curves, even: EvenVertices::default(), reports, device })
}

/// The batch with its planar curves in the coordinates of their planes.
fn in_planes(batch: &CurveBatch, planes: &[Option<Plane>]) -> CurveBatch {
    let constraints = batch.constraints();
    let each = |coords: &[f64], part: &dyn Fn(&Plane, DVec3) -> [f64; 2]| -> Vec<f64> {
        let of_curve = |i: usize| {
            let plane = planes[i].as_ref();
            let own = &coords[3 * batch.offsets()[i]..3 * batch.offsets()[i + 1]];
            own.chunks_exact(3)
                .flat_map(move |x| plane.map_or([f64::NAN; 2], |plane| part(plane, vector(x))))
                .collect::<Vec<f64>>()
        };
        (0..batch.len()).flat_map(of_curve).collect()
    };
    let vectors = |column: &Option<Vec<f64>>| column.as_ref().map(|column| each(column, &|plane, v| plane.part(v)));
    let [tangents, curvatures] = [&constraints.tangents, &constraints.curvatures].map(vectors);
    let bare = Constraints { tangents: None, curvatures: None, ..constraints.clone() };
    let flat = batch.clone().with_constraints(bare).expect("fewer constraints");
    let flat = flat.moved(2, each(batch.coords(), &|plane, x| plane.project(x)), vec![]);
    flat.with_constraints(Constraints { tangents, curvatures, ..constraints.clone() })
        .expect("vectors of two coordinates a point")
}
