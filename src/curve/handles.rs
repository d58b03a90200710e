//! Directions of handles, and how they turn at a joint.

use glam::DVec3;

use crate::error::{Error, Result};

/// Handles shorter than this fraction of their piece have no direction.
pub(crate) const VANISHING: f64 = 1e-9;

/// The direction in which a piece leaves its first control point: towards the next distinct one.
///
/// NaN if a control point is.
pub(crate) fn leaving(points: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let Some(start) = points.clone().next() else { return DVec3::ZERO };
    let steps = points.map(|point| point - start);
    let size = steps.clone().map(|step| step.abs().max_element()).fold(0.0, f64::max);
    let is_long = |step: &DVec3| step.abs().max_element() > VANISHING * size || step.is_nan();
    steps.clone().find(is_long).unwrap_or(DVec3::ZERO).normalize_or_zero()
}

/// The turning angle at a joint (radians), from the control points of the pieces before and after
/// it, both listed from the joint on. 0 if a piece is a point.
pub(crate) fn turn(before: impl Iterator<Item = DVec3> + Clone, after: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let (before, after) = (-leaving(before), leaving(after));
    if before == DVec3::ZERO || after == DVec3::ZERO {
        return 0.0;
    }
    // Precise near 0 and π too.
    2.0 * libm::atan2((after - before).length(), (after + before).length())
}

/// Checks the turning angle that makes a corner.
pub(crate) fn check_corners(angle: f64) -> Result<()> {
    match (0.0..=std::f64::consts::PI).contains(&angle) {
        true => Ok(()),
        false => Err(Error::argument(format!("the angle of corners is {angle} radians; it is from 0 to π"))),
    }
}
