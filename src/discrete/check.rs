//! Checks of the options of [`Fair`], each alone and in combination.

use std::f64::consts::PI;

use super::fair::{Fair, Pins, Segments, VERTEX_BYTES};
use super::onto::check_surface;
use super::{deviation, restarts, shortest};
use crate::batch::CurveBatch;
use crate::constraint::Constraint;
use crate::curve::{check_spacing, spans};
use crate::error::{Error, Result};
use crate::memory;

/// Checks that the options are valid for a batch.
///
/// # Errors
/// The errors of [`fit`](Fair::fit) that do not depend on the device.
pub(super) fn check(fair: &Fair, batch: &CurveBatch) -> Result<()> {
    let refuse = |why: String| Err(Error::argument(why));
    fair.energy.check()?;
    if fair.energy.order() == 0 {
        return refuse(
            "the energy has no fairness in it: give bending, variation, length or tension a positive weight".into(),
        );
    }
    if !(fair.tolerance > 0.0 && fair.tolerance.is_finite()) {
        return refuse(format!("the tolerance is {}; it must be a positive number, such as 1e-8", fair.tolerance));
    }
    match fair.segments {
        Segments::PerSpan(0) => return refuse("0 segments a span: at least 1 is needed, such as 16".into()),
        Segments::PerSpan(n) => {
            let (vertices, bytes) = (n as f64 * spans(batch), VERTEX_BYTES * batch.dimension());
            memory::check(vertices, bytes, &format!("{n} segments a span"), n)?;
        }
        Segments::Spacing(spacing) => {
            let bytes = VERTEX_BYTES * batch.dimension();
            check_spacing(batch, spacing, "vertices", Segments::MOST_VERTICES, bytes)?;
        }
    }
    if let Some(allowed) = fair.deviation {
        deviation::check(fair, allowed)?;
    }
    check_surface(fair, batch)?;
    fair.limits.check(batch.dimension())?;
    if shortest::is_asked_for(fair, batch) {
        shortest::check(fair, batch)?;
    }
    if fair.limits.shape && batch.dimension() == 3 && fair.energy.order() < 3 {
        return refuse(format!(
            "the shape of curves in space is the sign of their torsion, which {} does not hold: give an energy with variation or torsion",
            fair.energy
        ));
    }
    if !(1..=restarts::MOST).contains(&fair.starts) {
        return refuse(format!(
            "{} starts: each is a descent of its own, and from 1 to {} are possible, such as 20",
            fair.starts,
            restarts::MOST
        ));
    }
    if let (2.., Some(allowed)) = (fair.starts, fair.deviation) {
        return refuse(format!(
            "{} starts and a deviation of {allowed}: a curve near its points starts from its smoothing spline alone; leave one of both out",
            fair.starts
        ));
    }
    if let Some(angle) = fair.corners.filter(|angle| !(0.0..=PI).contains(angle)) {
        return refuse(format!("the angle of corners is {angle}; angles from 0 to π are possible, such as 1.05 (60°)"));
    }
    let attached = fair.energy.attachment_weight() > 0.0 || fair.deviation.is_some();
    // On a surface a closed curve need not shrink to a point.
    if fair.pins != Pins::All && !attached && fair.surface.is_none() {
        return refuse(
            "points that are not pinned need an attachment, or the curve would not know of them: add attachment \
             to the energy, or pin all points"
                .into(),
        );
    }
    if fair.pins == Pins::All && attached && fair.deviation.is_none() {
        return refuse(
            "the energy attaches the curve to points that are all pinned: pin the ends only, or none, or leave \
             the attachment out"
                .into(),
        );
    }
    let known = [
        Constraint::Tangents,
        Constraint::Curvatures,
        Constraint::Pinned,
        Constraint::LargestCurvatures,
        Constraint::Corridors,
        Constraint::Widths,
    ];
    if batch.dimension() == 3 && batch.constraints().widths.is_some() {
        let what =
            "curves in space have no left and no right: leave the widths of corridors out, or give a column corridor";
        return refuse(what.into());
    }
    batch.allows(&known, "fair curves")
}
