//! Fair curves in a surface: local coordinates, checks of the options, and a check of projected
//! starts.

use glam::DVec3;

use super::fair::Fair;
use super::within::Local;
use crate::batch::CurveBatch;
use crate::curve::vector;
use crate::error::{Error, Result};
use crate::ground;
use crate::linalg::scalar::Vector;
use crate::surface::{Surface, normal};

/// The surface in the coordinates of a problem whose start has these vertices.
pub(super) fn local<const D: usize>(fair: &Fair, vertices: &[Vector<f64, D>], size: f64) -> Option<Local> {
    let surface = fair.surface.clone()?;
    let (surface, own) = surface.local().unwrap_or((surface, DVec3::ZERO));
    let origin = std::array::from_fn(|c| if c < D { vertices[0][c] - own[c] } else { 0.0 });
    Some(Local { surface, origin, size })
}

/// Checks that curves can be fitted in the surface, if there is one.
///
/// # Errors
/// Planar curves. Energies of order 3. Limits and constraints that are not supported in surfaces.
/// Geodesic bending without a surface.
pub(super) fn check_surface(fair: &Fair, batch: &CurveBatch) -> Result<()> {
    let refuse = |why: String| Err(Error::Argument(why));
    let Some(surface) = &fair.surface else {
        return match fair.energy.is_geodesic() {
            true => refuse("geodesic bending is that of curves in a surface: give one, or ask for bending".into()),
            false => Ok(()),
        };
    };
    ground::check(batch, &**surface, fair.off_surface)?;
    let constraints = batch.constraints();
    let what = if fair.energy.order() > 2 {
        "have no variation and no torsion in their energy: ask for geodesic bending"
    } else if !fair.limits.bounds_curvature_alone(batch) || fair.limits.stretch.is_some() {
        "keep no other limits than a largest curvature: leave them out"
    } else if constraints.curvatures.is_some() {
        "keep no curvature vectors yet: leave them out"
    } else {
        return Ok(());
    };
    refuse(format!("curves in {} {what}", surface.name()))
}

/// The index of the vertex after which the projection onto a surface failed: a vertex is NaN, or
/// the normal turns by more than 90° to the next vertex.
pub(super) fn lost_between<const D: usize>(surface: &dyn Surface, vertices: &[Vector<f64, D>]) -> Option<usize> {
    let normals: Vec<DVec3> = vertices.iter().map(|vertex| normal(surface, vector(vertex))).collect();
    let turns_little = |row: usize| normals[row - 1].dot(normals[row]) > 0.0;
    (1..normals.len()).find(|&row| !turns_little(row)).map(|row| row - 1)
}
