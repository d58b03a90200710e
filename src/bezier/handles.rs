//! Directions of handles, and how they turn at a joint.

use glam::DVec3;

use crate::error::{Error, Result};

/// Handles shorter than this part of a piece have no direction.
pub(super) const VANISHING: f64 = 1e-9;

/// The direction in which a piece leaves the first of its control points: that of the first other one
/// which is not there too.
///
/// Not a number if any is not.
pub(super) fn leaving(points: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let Some(start) = points.clone().next() else { return DVec3::ZERO };
    let steps = points.map(|point| point - start);
    let size = steps.clone().map(|step| step.abs().max_element()).fold(0.0, f64::max);
    let is_long = |step: &DVec3| step.abs().max_element() > VANISHING * size || step.is_nan();
    steps.clone().find(is_long).unwrap_or(DVec3::ZERO).normalize_or_zero()
}

/// By how much the direction turns at a joint (radians), from the control points of the piece before
/// it and of that after it, both from the joint on. 0 where a piece is a point.
pub(super) fn turn(before: impl Iterator<Item = DVec3> + Clone, after: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let (before, after) = (-leaving(before), leaving(after));
    if before == DVec3::ZERO || after == DVec3::ZERO {
        return 0.0;
    }
    // As precise near 0 and π as between.
    2.0 * (after - before).length().atan2((after + before).length())
}

/// Checks the angle of a turn that makes a corner.
pub(super) fn check_corners(angle: f64) -> Result<()> {
    match (0.0..=std::f64::consts::PI).contains(&angle) {
        true => Ok(()),
        false => Err(Error::argument(format!("the angle of corners is {angle} radians; it is from 0 to π"))),
    }
}
