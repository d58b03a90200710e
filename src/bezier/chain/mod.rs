//! [`Chain`]: composite Béziers of least energy.
//!
//! ```text
//! Layout (lengths, what is known) ─► Joint (free jets) ─┐
//! Piece (form of a pattern, exact) ─────────────────────┴► System: block tridiagonal ─► control points
//!                                    G1: Newton's method ─► the same systems, repeatedly
//! ```

mod blocks;
mod corners;
mod gpu;
mod joint;
mod layout;
mod newton;
mod options;
mod piece;
mod speeds;
mod system;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};

use self::corners::Corners;
use self::layout::{Layout, Trouble};
pub use self::options::{Joints, PieceLengths};
use self::piece::Piece;
use self::system::{Done, System};
use super::MOST_DEGREE;
use super::completed::{Assembly, Completed};
use super::energy::Energy;
use super::single::check_constraints;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::handles::check_corners;
use crate::device::{Device, DeviceReport};
use crate::error::{Error, Result};
use crate::parallel;

/// Completes composite Béziers, each curve of the batch one chain.
///
/// A chain of n pieces of degree d has d n + 1 control points, or d n if it is closed. Unknown
/// control points ([`Constraints::known`](crate::Constraints)) minimise
///
/// ```text
/// Σ_k ∫₀^{h_k} Σ_r weight_r |p⁽ʳ⁾|² dt,   r = 1, 2, 3
/// ```
///
/// where h_k is the length of piece k ([`PieceLengths`]). Pieces meet as [`Joints`] says. By
/// default all points are known.
///
/// Known points keep their bits. A curve whose known points contradict the joints by more than 1e-9
/// of their distances is `invalid`. Tangents (columns `tx ty tz`) at joints are derivatives p′ =
/// dp/dt for C1 and C2, and directions for G1. Parameters and weights are ignored.
///
/// The system is block tridiagonal and solved directly, except for G1 joints, where Newton's method
/// finds a local minimum on the CPU. `docs/methods.md` describes the method, and
/// `docs/jobs/beziers.md` the degenerate cases.
///
/// **Accuracy.** On the CPU control points are good to about 1e-14 of the chain's size if one order
/// has a weight. With mixed orders they are good to 1e-13 up to degree 8 and to 1e-11 at degree 20.
/// GPUs are within 1e-12 of the CPU in f64, and within 1e-9 in f32 (4e-12 measured). A row of n
/// unknown joints costs a factor of about n⁴ at worst.
///
/// ```
/// use faircurve::bezier::{Chain, Joints};
/// use faircurve::{Constraints, CurveBatch, Device};
///
/// // Two cubics through three points, all handles unknown.
/// let points = [[0.0, 0.0], [0.0; 2], [0.0; 2], [1.0, 1.0], [0.0; 2], [0.0; 2], [2.0, 0.0]];
/// let known = (0..7).map(|k| k % 3 == 0).collect();
/// let batch = CurveBatch::from_slices(&[&points[..]])?
///     .with_constraints(Constraints { known: Some(known), ..Constraints::default() })?;
/// let chain = Chain { joints: Joints::C2, ..Chain::default() };
/// let completed = chain.fit(&batch, &Device::cpu())?;
/// let points = completed.control_points().points(0);
/// assert!((points[4] - 2.0 / 3.0).abs() < 1e-15 && (points[5] - 1.0).abs() < 1e-15);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// The degree of the pieces. 3 by default.
    pub degree: usize,
    /// How pieces meet. C1 by default.
    pub joints: Joints,
    /// The energy to minimise. ∫|p″|² dt by default.
    pub energy: Energy,
    /// Lengths of the pieces. Chords by default.
    pub lengths: PieceLengths,
    /// Joints where the control polygon turns by more than this angle (radians, 0 to π) are
    /// corners. The parts between them are completed as separate chains.
    ///
    /// The polygon includes unknown control points. Corners do not move. A joint with a tangent is
    /// not a corner. By default there are no corners.
    pub corners: Option<f64>,
}

impl Default for Chain {
    fn default() -> Self {
        Chain { degree: 3, joints: Joints::C1, energy: Energy::bending(), lengths: PieceLengths::Chords, corners: None }
    }
}

impl Chain {
    /// Completes a batch. A curve that cannot be completed keeps its control points.
    ///
    /// # Errors
    /// - A degree or an energy for which such joints are impossible.
    /// - An energy without a positive weight.
    /// - An angle of corners outside 0 … π.
    /// - Constraints other than tangents and known points.
    /// - On a GPU, errors of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Completed> {
        check_constraints(batch)?;
        self.energy.check()?;
        self.check()?;
        let Some(angle) = self.corners else { return self.complete(batch, device) };
        check_corners(angle)?;
        let corners = Corners::cut(batch, self.degree, angle)?;
        Ok(corners.join(batch, self.complete(&corners.batch, device)?))
    }

    /// Completes chains without corners.
    fn complete(&self, batch: &CurveBatch, device: &Device) -> Result<Completed> {
        let layouts: Vec<Result<Layout, Trouble>> = parallel::map(batch.len(), 1, |i| self.layout(batch, i));
        let smoothness = self.smoothness();
        let inner = |layout: &Layout| (0..layout.pieces).map(|k| layout.inner(k, smoothness)).collect::<Vec<u32>>();
        let used: BTreeSet<u32> = parallel::of(layouts.iter().flatten(), inner).concat().into_iter().collect();
        let new = |known: u32| (known, Piece::new(self.degree, smoothness, known, &self.energy));
        let pieces: HashMap<u32, Piece> = parallel::of(used, new).into_iter().collect();
        let knots: Vec<Vec<f64>> =
            layouts.iter().map(|layout| layout.as_ref().map_or_else(|_| Vec::new(), Layout::knots)).collect();
        let outcomes = match (self.joints, device.as_gpu()) {
            (Joints::G1, _) => parallel::of(layouts, |layout| {
                let outcome = layout.and_then(|layout| newton::complete(layout, &pieces));
                device.finished(1);
                outcome
            }),
            (_, Some(gpu)) => gpu::complete(gpu, device, layouts, smoothness, &pieces)?,
            (_, None) => parallel::of(layouts, |layout| {
                let system = System::new(layout?, smoothness, &pieces)?;
                let (x, smallest) = system.solve();
                system.finish(&x, smallest)
            }),
        };
        let iterated = self.joints == Joints::G1;
        if !iterated {
            device.finished(batch.len());
        }
        let described = if iterated { Device::cpu().report(true)? } else { device.report(true)? };
        Ok(self.completed(batch, outcomes, knots, described))
    }

    /// q: jets of joints have derivatives up to this order.
    fn smoothness(&self) -> usize {
        match self.joints {
            Joints::Free => 0,
            Joints::C2 if self.degree >= 5 => 2,
            _ => 1,
        }
    }

    fn check(&self) -> Result<()> {
        let degree = self.degree;
        let bending_alone = self.energy.weights[0] == 0.0 && self.energy.weights[2] == 0.0;
        if !(1..=MOST_DEGREE).contains(&degree) {
            return Err(Error::argument(format!(
                "the degree of the pieces of a chain is {degree}; 1 to {MOST_DEGREE} are possible"
            )));
        }
        match self.joints {
            Joints::C1 | Joints::G1 if degree < 3 => Err(Error::argument(format!(
                "pieces of degree {degree} have no freedom for joints {:?}: give degree 3 or more, or take free joints",
                self.joints
            ))),
            Joints::C2 if degree < 3 || (degree < 5 && !bending_alone) => Err(Error::argument(format!(
                "pieces of degree {degree} have no freedom for C2 joints with this energy: give degree 5 or more (3 \
                 and 4 serve for bending alone), \
                 or take C1 joints"
            ))),
            Joints::G1 if self.energy.order() == Some(3) => Err(Error::argument(
                "∫|p‴|² alone does not determine speeds at G1 joints: weigh ∫|p″|² too (bending), or take C1 joints",
            )),
            _ => Ok(()),
        }
    }

    fn layout<'a>(&self, batch: &'a CurveBatch, i: usize) -> Result<Layout<'a>, Trouble> {
        if let Some(problem) = batch.problem(i) {
            return Err((problem.status, 0, String::new()));
        }
        let layout = Layout::new(batch, i, self.degree, self.joints, self.lengths)?;
        if self.joints == Joints::C2 && self.degree < 5 {
            layout.check_second()?;
        }
        Ok(layout)
    }

    fn completed(
        &self,
        batch: &CurveBatch,
        outcomes: Vec<Result<Done, Trouble>>,
        knots: Vec<Vec<f64>>,
        device: DeviceReport,
    ) -> Completed {
        let mut assembly = Assembly::new(batch);
        for (i, (outcome, knots)) in outcomes.into_iter().zip(knots).enumerate() {
            match outcome {
                Ok(done) => assembly.push(&done.coords, self.degree, knots, done.report(batch, i)),
                Err((status, point, what)) => assembly.push_unfitted(match batch.problem(i) {
                    Some(problem) => problem.clone(),
                    None => Unfitted { status, message: batch.sentence(i, point, &what) },
                }),
            }
        }
        assembly.finish(device)
    }
}
