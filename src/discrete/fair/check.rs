//! What [`Fair`] refuses: options that make no sense, alone or together.

use std::f64::consts::PI;

use super::{Fair, Pins, Segments, VERTEX_BYTES};
use crate::batch::CurveBatch;
use crate::constraint::Constraint;
use crate::curve::{check_spacing, spans};
use crate::discrete::{descended, deviation};
use crate::error::{Error, Result};
use crate::memory;

impl Fair {
    /// Checks that the options make sense for a batch.
    ///
    /// # Errors
    /// Those of [`fit`](Fair::fit), but for those of devices.
    pub(super) fn check(&self, batch: &CurveBatch) -> Result<()> {
        let refuse = |why: String| Err(Error::argument(why));
        self.energy.check()?;
        if self.energy.order() == 0 {
            return refuse(
                "the energy has no fairness in it: give bending, variation, length or tension a positive weight".into(),
            );
        }
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return refuse(format!("the tolerance is {}; it must be a positive number, such as 1e-8", self.tolerance));
        }
        match self.segments {
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
        if let Some(allowed) = self.deviation {
            deviation::check(self, allowed)?;
        }
        self.check_surface(batch)?;
        self.limits.check(batch.dimension())?;
        if self.asks_for_shortest(batch) {
            self.check_shortest(batch)?;
        }
        if self.limits.shape && batch.dimension() == 3 && self.energy.order() < 3 {
            return refuse(format!(
                "the shape of curves in space is the sign of their torsion, which {} does not hold: give an energy with variation or torsion",
                self.energy
            ));
        }
        if !(1..=descended::MOST).contains(&self.starts) {
            return refuse(format!(
                "{} starts: each is a descent of its own, and from 1 to {} are possible, such as 20",
                self.starts,
                descended::MOST
            ));
        }
        if let (2.., Some(allowed)) = (self.starts, self.deviation) {
            return refuse(format!(
                "{} starts and a deviation of {allowed}: a curve near its points starts from its smoothing spline alone; leave one of both out",
                self.starts
            ));
        }
        if let Some(angle) = self.corners.filter(|angle| !(0.0..=PI).contains(angle)) {
            return refuse(format!(
                "the angle of corners is {angle}; angles from 0 to π are possible, such as 1.05 (60°)"
            ));
        }
        let attached = self.energy.attachment_weight() > 0.0 || self.deviation.is_some();
        // In a surface a closed curve need not shrink to a point.
        if self.pins != Pins::All && !attached && self.surface.is_none() {
            return refuse(
                "points that are not pinned need an attachment, or the curve would not know of them: add attachment \
                 to the energy, or pin all points"
                    .into(),
            );
        }
        if self.pins == Pins::All && attached && self.deviation.is_none() {
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
        ];
        batch.allows(&known, "fair curves")
    }
}
