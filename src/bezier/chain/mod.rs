//! [`Chain`]: composite Béziers of least energy.
//!
//! ```text
//! Layout (lengths, what is known) ─► Joint (free jets) ─┐
//! Piece (form of a pattern, exact) ─────────────────────┴► System: block tridiagonal ─► control points
//!                                    G1: Newton's method ─► the same systems, again and again
//! ```

mod blocks;
mod corners;
mod gpu;
mod joint;
mod layout;
mod newton;
mod piece;
mod speeds;
mod system;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};

use self::corners::Corners;
use self::layout::{Layout, Trouble};
use self::piece::Piece;
use self::system::{Done, System};
use super::MOST_DEGREE;
use super::completed::Completed;
use super::curves::Chains;
use super::energy::Energy;
use super::handles::check_corners;
use super::single::check_constraints;
use crate::batch::CurveBatch;
use crate::device::{Device, DeviceReport};
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::CurveReport;
use crate::words::words;

/// How the pieces of a chain meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Joints {
    /// Pieces share their joints and nothing more.
    Free,
    /// p′ is continuous. Needs degree 3 or more.
    #[default]
    C1,
    /// p′ and p″ are continuous. Needs degree 5 or more.
    ///
    /// Degrees 3 and 4 are possible for bending alone, if nothing between joints is known but the
    /// outermost handles of an open chain. The chain is then the cubic spline.
    C2,
    /// The direction of p′ is continuous. The speeds |p′| on both sides are free and positive.
    ///
    /// Needs degree 3 or more, all joints known, and a weight of ∫|p′|² or ∫|p″|².
    G1,
}

words!(Joints, "kind of joint": [
    (Free, "free", "Pieces only meet"),
    (C1, "c1", "Equal first derivatives"),
    (C2, "c2", "Equal first and second derivatives"),
    (G1, "g1", "Equal directions"),
]);

/// How long the pieces of a chain are, in the parameter t.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PieceLengths {
    /// The distance of a piece's ends.
    ///
    /// A curve with an unknown joint, or with a piece whose ends coincide, takes
    /// [`Equal`](Self::Equal).
    #[default]
    Chords,
    /// 1 each.
    Equal,
}

words!(PieceLengths, "length of pieces": [
    (Chords, "chords", "The distance of a piece's ends"),
    (Equal, "equal", "1 each"),
]);

/// Completes composite Béziers, each curve of the batch one chain.
///
/// A chain has n pieces of degree d that share their joints. It has d n + 1 control points. A
/// closed chain has d n, as it does not repeat its first joint. Unknown control points
/// ([`Constraints::known`](crate::Constraints)) are those of least energy. If the batch does not
/// say which are known, all are. The energy is
///
/// ```text
/// Σ_k ∫₀^{h_k} Σ_r weight_r |p⁽ʳ⁾|² dt,   r = 1, 2, 3
/// ```
///
/// over the whole chain. A piece has the length h_k in the parameter t ([`PieceLengths`]). The
/// knots of a curve are the sums of these lengths. Pieces meet as [`Joints`] says. Derivatives are
/// with respect to t.
///
/// Known points keep their bits. If they contradict the joints by more than 1e-9 of their
/// distances, the curve is `invalid`, with a sentence.
///
/// With cubics, bending, C2 joints (C1 gives the same) and all joints known, the chain is the
/// natural cubic spline, [`spline::Natural`](crate::spline::Natural), periodic if closed.
///
/// Tangents (columns `tx ty tz`) may stand at joints: derivatives p′ = dp/dt for C1 and C2,
/// directions for G1. Parameters and weights mean nothing here.
///
/// **Method.** Points that depend on one piece alone are eliminated in exact rationals, once for
/// each pattern. What remains are the jets (p, p′, p″) of joints. Their system is block
/// tridiagonal, and cyclic for closed chains. One matrix serves all coordinates and is solved
/// directly. On a GPU one dispatch solves all curves and coordinates of a chunk, in f32 (refined
/// once, residuals in f64) unless the device is asked for f64.
///
/// **G1 joints.** The energy is then not quadratic. Newton's method finds directions and speeds. It
/// starts from the chain with C1 joints, lowers its energy, and ends at a local minimum. It runs on
/// the CPU, whatever the device.
///
/// - A handle known on one side of a joint, or a tangent, is the direction there.
/// - If the energy falls while a speed goes to 0, the curve is `no_minimiser`. That happens where
///   the data turn by some 90 degrees or more at a joint.
/// - After 200 iterations the curve is `not_converged`, and the best one reached.
///
/// Too few known points leave a curve `degenerate`. If only points between known joints are
/// undetermined (∫|p‴|² with free joints), they are those of least Σ|P|², and the curve is
/// `not_unique`.
///
/// **Accuracy.** On the CPU control points are good to about 1e-14 of the chain's size if one order
/// has a weight. Mixed orders lose digits with the degree above 2q + 1, where q is 0 for free
/// joints, 1 for C1 and G1, and 2 for C2. They are good to 1e-13 up to degree 8, and to 1e-11 at
/// degree 20. GPUs are within 1e-12 of that in f64, and within 1e-9 in f32 (4e-12 measured). The
/// CPU solves what f32 cannot tell from singular. Many unknown joints in a row cost digits, as in
/// any stiff beam: n of them a factor of about n⁴ at worst.
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
    /// The degree of every piece. 3 by default.
    pub degree: usize,
    /// How pieces meet. C1 by default.
    pub joints: Joints,
    /// The energy that is made least. ∫|p″|² dt by default.
    pub energy: Energy,
    /// How long pieces are. Chords by default.
    pub lengths: PieceLengths,
    /// Joints where the control points given turn by more than this angle are corners (radians, 0 to
    /// π). The parts between them are chains of their own.
    ///
    /// The directions are those from a joint to the next control points given, known or not. A corner
    /// stays where it is. A joint with a tangent is none. By default there are no corners.
    pub corners: Option<f64>,
}

impl Default for Chain {
    fn default() -> Self {
        Chain { degree: 3, joints: Joints::C1, energy: Energy::bending(), lengths: PieceLengths::Chords, corners: None }
    }
}

impl Chain {
    /// Completes a batch. Each curve has a status. A curve that cannot be completed stays as it is.
    ///
    /// # Errors
    /// - A degree, or an energy, with which no chain has such joints.
    /// - An energy that weighs nothing.
    /// - An angle of no corner.
    /// - Exponents or curvature vectors in the batch. They have no meaning here.
    /// - On a GPU the errors of submissions.
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
            layouts.iter().map(|layout| layout.as_ref().map_or(Vec::new(), Layout::knots)).collect();
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
        let layout = Layout::new(batch, i, self)?;
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
        let mut coords = Vec::with_capacity(batch.coords().len());
        let (mut reports, mut degrees) = (Vec::new(), Vec::new());
        for (i, outcome) in outcomes.into_iter().enumerate() {
            match outcome {
                Ok(done) => {
                    coords.extend_from_slice(&done.coords);
                    degrees.push(Some(self.degree));
                    reports.push(done.report(batch, i));
                }
                Err((status, point, what)) => {
                    coords.extend_from_slice(batch.points(i));
                    degrees.push(None);
                    let message = match batch.problem(i) {
                        Some(problem) => problem.message.clone(),
                        None => batch.sentence(i, point, &what),
                    };
                    reports.push(CurveReport::unfitted(status, message));
                }
            }
        }
        let control = batch.with_points(coords, batch.offsets().to_vec());
        Completed { chains: Chains::new(control, degrees, Some(knots), &reports), reports, device }
    }
}
