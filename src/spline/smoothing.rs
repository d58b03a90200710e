//! [`Smoothing`]: cubic smoothing splines.

use super::knots::Parametrisation;
use crate::batch::CurveBatch;
use crate::constraint::Constraint;
use crate::deviation::Deviation;
use crate::device::Work;
use crate::error::{Error, Result, thousands};
use crate::report::CurveReport;

/// What decides how much a curve is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SmoothingTarget {
    /// The factor λ ≥ 0 of the bending energy, the same for every curve. 0 interpolates; larger is
    /// smoother. Its unit is the cube of the unit of t, times the unit of the weights. Parameters
    /// read from dates are in seconds; the program takes λ in hours there.
    Lambda(f64),
    /// The largest distance D > 0 between a data point and the curve's point of the same parameter:
    /// every curve gets the largest λ that keeps it. Smaller is closer.
    ///
    /// That is the least ∫|p″|² among curves of one λ, not among all that keep D: an outlier makes
    /// the whole curve follow closely. [`Tube`](Self::Tube) has the least of all.
    Deviation(Deviation),
    /// The same distance D > 0, kept by the curve of least ∫|p″|² of *all* that keep it.
    Tube(Deviation),
    /// λ chosen by the data of each open curve: generalised cross-validation, as SciPy's
    /// `make_smoothing_spline` does without `lam`. It is right for independent noise of one size, or of
    /// sizes that weights tell.
    CrossValidation,
}

impl SmoothingTarget {
    /// The target with another distance, if it has one.
    pub(super) fn with(self, distance: impl FnOnce(Deviation) -> Deviation) -> Self {
        match self {
            SmoothingTarget::Deviation(own) => SmoothingTarget::Deviation(distance(own)),
            SmoothingTarget::Tube(own) => SmoothingTarget::Tube(distance(own)),
            SmoothingTarget::Lambda(_) | SmoothingTarget::CrossValidation => self,
        }
    }
}

/// Cubic smoothing splines p that minimise Σ w_i |y_i − p(t_i)|² + λ ∫|p″|² dt, natural at the ends
/// of an open curve, periodic for a closed one.
///
/// The weights w are the batch's, or 1. Data points at one parameter are one knot at their weighted
/// mean, with the sum of their weights. This does not change the minimiser. Reported deviations
/// refer to the data points as given.
///
/// **Method.** Reinsch's system (R + λ QᵀW⁻¹Q) γ = Qᵀy for the second derivatives γ at the knots,
/// pentadiagonal (cyclic for closed curves), values p = y − λ W⁻¹Q γ. Every curve is normalised
/// first: parameters to length 1 (T), coordinates to half the size of their bounding box, weights
/// by their largest ω. With s = t/T the bending energy is T⁻³ ∫|p_ss|² ds, so the normalised
/// problem has λ′ = λ/(ω T³). From λ′ = [`LAMBDA_CAP`] on, a curve equals its limit for λ → ∞ to
/// rounding, and that limit is returned: the weighted regression line. Closed curves stop long
/// before. The condition of the system grows as n⁴ below that cap. Curves of some 20,000 knots and
/// more can ask for a λ that 64 bits do not resolve. They are
/// [`NotConverged`](crate::CurveStatus::NotConverged) and say so.
///
/// **A deviation kept.** Normalised λ′ are tried among the numbers 2^(j/512), 0.14 % apart, by
/// bracketing and bisection of j, the same on every device and in every precision: the λ returned
/// keeps the deviation, and the next one breaks it. The largest deviation grows with λ except for
/// rare curves, where the search finds the first λ to break it. If the regression line keeps it,
/// the line is returned, with λ = [`LAMBDA_CAP`]·ωT³. The report gives λ, the deviation reached and
/// the number of solves. A curve with points at one parameter farther than D from their mean is
/// [`NotConverged`](crate::CurveStatus::NotConverged); it interpolates the means.
///
/// **Closed curves do not collapse.** As λ grows, a closed curve shrinks to the weighted mean of
/// its points: Fourier mode k falls as 1/(1 + λ(2πk)⁴/WT³) for n even points of total weight W. The
/// last to vanish is the first mode, an ellipse of size 1/λ. So no curve is smoothed further than
/// to [`LEAST_SHARE`] of its size in any direction, the (weighted) root mean square distance of its
/// points from their mean. This share falls steadily with λ whatever the shape and the direction,
/// unlike areas and lengths of thin, rough or self-intersecting curves. The λ returned is the
/// largest that keeps the deviation *and* the share. A given λ is kept down to
/// [`LEAST_SHARE_OF_LAMBDA`], where a curve is a dot; the report names the λ used. Such a curve is
/// [`Converged`](crate::CurveStatus::Converged) with a message, and [`notes`](Self::notes) counts
/// them.
///
/// **A tube kept.** [`SmoothingTarget::Tube`] seeks min ∫|p″|² dt over all curves with
/// |p(t_i) − y_i| ≤ D, a convex programme. Its minimiser is the smoothing spline whose weights are
/// the forces at the points, 0 where the curve does not touch: around 41 points of a wave of height
/// 5, with noise of 0.15 and one point 2 off, [`SmoothingTarget::Deviation`] of 1 bends 8 to 13
/// times as much, without that point 1.2 to 1.4 times. An interior-point method finds it in linear
/// time. Its certificate is the duality gap, reported as `gradient_norm`: the energy exceeds the
/// least by at most 1e-8 of itself; or, if that is more, by 1e-16 D²/T³, since with 1e-8 D²/T³ a
/// curve is a line to 1e-4 D, or by the energy of rounding errors of its coordinates. `smoothing`
/// is `None`. Weights count for the regression line only, which is returned where it serves. A
/// closed curve that would collapse, to a point or to a line run through twice, is the spline of
/// one λ instead, and its message says so. The CPU fits tubes in 64 bits on every device; the fit
/// says so.
///
/// **Pinned ends.** With `pin_ends` an open curve starts and ends exactly at its first and last
/// data point, bit for bit (their inverse weights are 0), so that curves that meet keep meeting. A
/// closed curve has no ends. [`Constraints::pinned`](crate::Constraints::pinned) pins any other
/// point likewise. As λ grows, a curve with inner pins approaches the interpolating spline of the
/// pins alone, and the arithmetic bounds λ.
///
/// ```
/// use faircurve::{CurveBatch, Device, spline::{SmoothingTarget, Smoothing}};
/// let stairs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [3.0, 2.0]];
/// let batch = CurveBatch::from_slices(&[&stairs[..]])?;
/// let smoothing = Smoothing { target: SmoothingTarget::Deviation(0.5.into()), ..Smoothing::default() };
/// let fit = smoothing.fit(&batch, &Device::cpu())?;
/// let report = &fit.reports()[0];
/// assert!(report.max_deviation <= 0.5 && report.smoothing > Some(0.0));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// What decides how much to smooth. Default: λ = 0, which interpolates.
    pub target: SmoothingTarget,
    /// Whether open curves keep their end points exactly. Default: no.
    pub pin_ends: bool,
    /// How the data points get their parameters. Default: the batch's, else chord length.
    pub parametrisation: Parametrisation,
}

impl Default for Smoothing {
    fn default() -> Self {
        Smoothing { target: SmoothingTarget::Lambda(0.0), pin_ends: false, parametrisation: Parametrisation::Auto }
    }
}

/// The normalised λ′ from which on a curve is its limit for λ → ∞ to rounding: for n knots the two
/// differ by n/λ′ of the curve's size at most.
pub const LAMBDA_CAP: f64 = 1e20;

/// The least share of its size that a closed curve keeps in every direction: the root mean square
/// distance of its points from their mean, relative to the data's.
///
/// Islands at 0.7 of their size have half of their area and still look like themselves on a map.
/// At half of their size they look lost.
pub const LEAST_SHARE: f64 = 0.7;

/// The least share under a given λ: a hundredth of the size is a dot. Larger curves get the λ
/// given.
pub const LEAST_SHARE_OF_LAMBDA: f64 = 0.01;

impl Smoothing {
    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`](crate::Device::choose).
    pub fn work(&self, points: usize) -> Work {
        // Only the CPU has tubes.
        let on_host = match self.target {
            SmoothingTarget::Lambda(_) => 0.0,
            SmoothingTarget::Deviation(_) => 0.2,
            SmoothingTarget::Tube(_) | SmoothingTarget::CrossValidation => 1.0,
        };
        Work { points, cost: 10.0, on_host }
    }

    /// Sentences about the usable curves of a fit with these options: how many closed curves were
    /// smoothed no further than to their share of their size. They alone have a message.
    pub fn notes(&self, reports: &[CurveReport]) -> Vec<String> {
        let stopped = |report: &&CurveReport| report.status.is_usable() && report.message.is_some();
        let count = reports.iter().filter(stopped).count();
        if count == 0 {
            return Vec::new();
        }
        let (curves, their) = if count == 1 { ("closed curve is", "its") } else { ("closed curves are", "their") };
        let small = match self.target {
            SmoothingTarget::Lambda(lambda) => format!("small for λ = {lambda}"),
            SmoothingTarget::Deviation(deviation) | SmoothingTarget::Tube(deviation) => {
                format!("small for a deviation of {deviation}")
            }
            SmoothingTarget::CrossValidation => "small for the λ chosen".to_string(),
        };
        let count = thousands(count);
        vec![format!("{count} {curves} {small}: smoothed no further than to {} of {their} size", self.least_share())]
    }

    /// The share of its size that a closed curve keeps.
    pub(super) fn least_share(&self) -> f64 {
        if matches!(self.target, SmoothingTarget::Lambda(_)) { LEAST_SHARE_OF_LAMBDA } else { LEAST_SHARE }
    }

    pub(super) fn check(&self, batch: &CurveBatch) -> Result<()> {
        match self.target {
            SmoothingTarget::Lambda(lambda) if !(lambda >= 0.0 && lambda.is_finite()) => Err(Error::argument(format!(
                "the smoothing factor λ is {lambda}; it must be finite and at least 0, where 0 interpolates: \
                 give another, or a deviation"
            ))),
            SmoothingTarget::Deviation(deviation) | SmoothingTarget::Tube(deviation) => {
                deviation.check("to interpolate, give λ = 0 instead")
            }
            SmoothingTarget::Lambda(_) | SmoothingTarget::CrossValidation => Ok(()),
        }?;
        batch.allows(&[Constraint::Pinned], "smoothing splines")
    }
}

/// The options of a curve by its number.
pub(super) type OfCurve<'a> = &'a (dyn Fn(usize) -> Smoothing + Sync);
