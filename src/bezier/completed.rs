//! [`Completed`]: control points found, and what can be done with them.

use super::MOST_DEGREE;
use super::curves::Chains;
use super::linear::{elevate, reduce};
use super::polygons::Controls;
use crate::batch::CurveBatch;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;

/// Chains of Béziers, one a curve of the batch, with a report each.
///
/// A curve that could not be completed is what came in.
#[derive(Clone, Debug)]
pub struct Completed {
    pub(super) chains: Chains,
    pub(super) reports: Vec<CurveReport>,
    pub(super) device: DeviceReport,
}

impl Completed {
    /// Control points, with the names, order and closedness of the input.
    ///
    /// Pieces share their joints. A closed chain does not repeat its first point.
    pub fn control_points(&self) -> &CurveBatch {
        &self.chains.control
    }

    /// One report a curve. The energy is that of its control points, in the units of the input.
    pub fn reports(&self) -> &[CurveReport] {
        &self.reports
    }

    /// The degree of the pieces of curve `i`, or `None` for a curve that could not be completed.
    pub fn degree(&self, i: usize) -> Option<usize> {
        self.chains.degrees[i]
    }

    /// Which device did the work, and in which precision.
    pub fn device(&self) -> &DeviceReport {
        &self.device
    }

    /// The curves behind the trait [`Curve`](crate::Curve).
    pub fn into_fit(self) -> Fit {
        Fit::new(self.chains, self.reports, self.device)
    }

    /// The same curves with pieces of a degree higher by `by` ([`elevate()`]).
    ///
    /// Curves that would pass [`MOST_DEGREE`] stay as they are and become `invalid`.
    ///
    /// # Errors
    /// On a GPU the errors of submissions.
    pub fn elevate(mut self, by: usize, device: &Device) -> Result<Completed> {
        self.refuse(|degree| {
            (degree.saturating_add(by) > MOST_DEGREE).then(|| {
                format!("degree {degree} cannot be elevated by {by}: degrees up to {MOST_DEGREE} are possible")
            })
        });
        let raised = elevate(&self.chains.separate().polygons(), by, device)?;
        self.chains.join(&raised);
        Ok(self)
    }

    /// Curves of a degree lower by `by` near these ([`reduce()`]).
    ///
    /// Pieces keep their ends, but joints of a chain lose their smoothness. The reports' deviations
    /// are bounds of the change. Pieces of degree `by` or less stay as they are, and the curve
    /// becomes `invalid`.
    ///
    /// # Errors
    /// On a GPU the errors of submissions.
    pub fn reduce(mut self, by: usize, device: &Device) -> Result<Completed> {
        self.refuse(|degree| {
            (degree <= by).then(|| format!("degree {degree} cannot be reduced by {by}: degree 1 at least must remain"))
        });
        let (reduced, bounds) = reduce(&self.chains.separate().polygons(), by, device)?;
        let mut bounds = bounds.into_iter();
        for i in 0..self.reports.len() {
            let own = bounds.by_ref().take(self.chains.pieces(i));
            self.reports[i].max_deviation += own.fold(0.0, f64::max);
        }
        self.chains.join(&reduced);
        Ok(self)
    }

    /// Marks a curve as invalid if `sentence` says what is wrong with its degree.
    fn refuse(&mut self, sentence: impl Fn(usize) -> Option<String>) {
        for i in 0..self.reports.len() {
            if let Some(what) = self.chains.degrees[i].and_then(&sentence) {
                let message = self.chains.control.sentence(i, 0, &what);
                self.chains.control.refuse_as(i, CurveStatus::Invalid, message.clone());
                self.reports[i] = CurveReport::unfitted(CurveStatus::Invalid, message);
                self.chains.degrees[i] = None;
            }
        }
    }
}

impl Chains {
    /// Every piece as a polygon of its own, joints repeated.
    fn separate(&self) -> Controls {
        let mut pieces = Controls { dimension: self.control.dimension(), coords: Vec::new(), offsets: vec![0] };
        for i in 0..self.degrees.len() {
            for piece in 0..self.pieces(i) {
                self.piece(i, piece).for_each(|point| pieces.coords.extend_from_slice(point));
                pieces.offsets.push(pieces.coords.len() / pieces.dimension);
            }
        }
        pieces
    }

    /// Replaces the pieces by pieces of another degree.
    fn join(&mut self, pieces: &Controls) {
        let dimension = pieces.dimension;
        let (mut coords, mut offsets) = (Vec::new(), vec![0]);
        let mut next = 0;
        for i in 0..self.degrees.len() {
            let count = self.pieces(i);
            match self.degrees[i] {
                None => coords.extend_from_slice(self.control.points(i)),
                Some(_) => {
                    for piece in next..next + count {
                        let points = pieces.points(piece);
                        let last = piece + 1 == next + count && !self.control.is_closed(i);
                        coords.extend_from_slice(&points[..points.len() - if last { 0 } else { dimension }]);
                    }
                    self.degrees[i] = Some(pieces.polygons().count(next) - 1);
                }
            }
            next += count;
            offsets.push(coords.len() / dimension);
        }
        self.control = self.control.with_points(coords, offsets);
    }
}
