//! [`Band`]: curves of least bending within a distance of their whole polygon.

mod area;
mod corners;
mod curves;
mod least;
mod runs;

use std::collections::BTreeMap;

use self::curves::{BandCurve, BandCurves};
use self::least::{Found, Least, widest};
use super::knots::{Coincident, Knots, Parametrisation};
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::curve::Sampling;
use crate::deviation::Deviation;
use crate::device::{Device, Work};
use crate::error::{Error, Result, thousands};
use crate::parallel;
use crate::report::{CurveReport, Fit};
use crate::status::CurveStatus;

/// The curves that a thread fits at a time.
const TOGETHER: usize = 16;

/// Cubic splines of least ∫|p″|² within a distance D of their *whole* data polygon, and the polygon
/// within D of the curve.
///
/// ```text
/// min ∫|p″(s)|² ds  with  |p(s) − q(s)| ≤ D for every s
/// ```
///
/// q is the polygon by arc length. |p − q| ≤ D bounds both Hausdorff distances, and the Fréchet
/// distance. It holds between knots too: p − q is a cubic there, and its Bézier control points are
/// within D. [`CurveReport::max_deviation`] is the largest of them.
///
/// **Long edges** get knots at distances D, 2D, 4D … from the ends of straight runs of the polygon,
/// where the curve may leave the run by D³/s² at the distance s > D, and by 1 % of D at least. So
/// long straight lines stay straight, and a corner is rounded within about 3 D. A run may have
/// vertices within 1 % of D of its chord.
///
/// **Area.** Closed planar curves keep the area of their polygon to 2e-4 of it, so islands do not
/// shrink, or their message says by how much it differs. Sections between pinned points keep what
/// they enclose with their chord, and so do the regions of a map, whose junctions are pinned.
/// Sections of one or two edges cannot, and others whose pins are some D apart may miss it: of 414
/// polygons of the world at 1:110m, D = 0.3°, 32 differ by more than 1e-3, none of them an island.
///
/// **Method.** The alternating direction method of multipliers: smoothing splines of one matrix,
/// factored once, alternate with projections onto the discs of the knots; a pressure on the area is
/// its multiplier. 20 to 100 iterations of one solve each bring the energy within some per cent of
/// the least within 0.95 D.
///
/// A closed curve, or an open one that comes back to its first point, is kept within 0.3 of its mean
/// width 2 A/ℓ, if D is more, and its message says so. The parameter of the result is the batch's,
/// or the arc length of the polygon. On spans with knots of their own it grows by the same step from knot to knot.
///
/// **On the ground.** [`Deviation::Metres`] is in metres, for longitudes and latitudes. Each curve is
/// fitted with its longitudes times the cosine of its latitude nearest to the equator, so it is
/// within D everywhere, and from west to east within less where it is nearer to a pole: within
/// 0.82 D at 35° of latitude, of a curve that reaches the equator. [`CurveReport::max_deviation`] is
/// in metres then.
///
/// Computed by the CPU in f64 on every device.
///
/// ```
/// use faircurve::{CurveBatch, Device, spline::Band};
/// let house = [[0.0, 0.0], [60.0, 0.0], [60.0, 20.0], [0.0, 20.0]];
/// let batch = CurveBatch::from_slices(&[&house[..]])?.closed(true);
/// let fit = Band::within(1.0).fit(&batch, &Device::cpu())?;
/// assert!(fit.reports()[0].max_deviation <= 1.0);
/// // A long side is straight in its middle.
/// let middle = fit.curve(0).jet(0, 0.5).point;
/// assert!(middle.y.abs() < 0.02, "{middle}");
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: S. Boyd, N. Parikh, E. Chu, B. Peleato and J. Eckstein, *Distributed optimization and
/// statistical learning via the alternating direction method of multipliers* (2011). The band, its
/// knots and the pressure are faircurve's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Band {
    /// D > 0, in units of the input or as a part of each curve's size.
    pub distance: Deviation,
    /// Whether open curves keep their end points exactly, and with them the area. Default: yes.
    pub pin_ends: bool,
    /// Whether curves keep their area, as far as they enclose one. Default: yes.
    pub keep_area: bool,
    /// The corners that stay sharp. Default: none.
    pub corners: Corners,
}

/// The corners of a polygon that its curve keeps sharp. Between them it is smooth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Corners {
    /// None: every corner is rounded within D.
    #[default]
    Rounded,
    /// Those at the scale of D: vertices around which two straight legs of 3, 5 or 8 D explain the
    /// polygon better than one parabola does, and turn by more than 35°.
    ///
    /// Noise of up to D/2, and staircases of pixels of up to D, have no corners of their own, and hide
    /// few. A curve that is round at the scale of D has none.
    Auto,
    /// Those between straight lines: vertices that turn by more than 35° between runs of at least 8 D
    /// within 0.1 D of their chords, as surveyed borders have them. Coasts have none, unless their
    /// edges are as long.
    Straight,
    /// Vertices at which the polygon turns by more than this angle (radians).
    Above(f64),
}

impl Band {
    /// The curves within a distance of their polygons.
    pub fn within(distance: impl Into<Deviation>) -> Self {
        Band { distance: distance.into(), pin_ends: true, keep_area: true, corners: Corners::Rounded }
    }

    /// The work of a batch with this number of points, read and written together, for
    /// [`Device::choose`].
    pub fn work(&self, points: usize) -> Work {
        Work { points, cost: 20.0, on_host: 1.0 }
    }

    /// Sentences about the usable curves of a fit with these options: how many closed curves are
    /// kept within less, and how many have another area. They alone have a message.
    pub fn notes(&self, reports: &[CurveReport]) -> Vec<String> {
        let is_kept = |report: &&CurveReport| report.status.is_usable() && report.message.is_some();
        let named = |what: &str| {
            let is_named = |own: &&CurveReport| own.message.iter().any(|own| own.contains(what));
            reports.iter().filter(is_kept).filter(is_named).count()
        };
        let told = [
            ("is smaller", format!("closed and small for {}, and kept within 0.3 of the mean width", self.distance)),
            ("its area differs", "not of the area of the points".to_string()),
        ];
        let told = told.into_iter().map(|(what, are)| (named(what), are)).filter(|(n, _)| *n > 0);
        let sentence =
            |(n, are)| if n == 1 { format!("1 curve is {are}") } else { format!("{} curves are {are}", thousands(n)) };
        told.map(sentence).collect()
    }

    /// Fits every curve of the batch.
    ///
    /// The statuses are `converged`; `not_converged` if no curve within D was found, and the result
    /// is the nearest one; `degenerate` and `invalid` if the curve cannot be fitted.
    ///
    /// # Errors
    /// A distance that is not positive and finite. Weights. Constraints other than pinned points.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        match self.distance {
            Deviation::Metres(metres) if !(metres > 0.0 && metres.is_finite()) => {
                return Err(Error::argument(format!(
                    "the distance is {}; it must be positive and finite",
                    self.distance
                )));
            }
            Deviation::Metres(_) if !batch.is_geographic() && batch.metres().is_none() => {
                return Err(Error::argument(format!(
                    "{} is a length in metres, and the unit of the points is not known: give a number in that unit",
                    self.distance
                )));
            }
            Deviation::Metres(_) => {}
            distance => distance.check("to interpolate, take natural splines instead")?,
        }
        batch.allows(&[Constraint::Pinned], "curves within a band")?;
        if (0..batch.len()).any(|i| batch.weights(i).is_some()) {
            return Err(Error::argument(
                "curves within a band have no weights: every point counts as much; leave them out",
            ));
        }
        let shares: Vec<f64> = (0..batch.len()).map(|i| self.share(batch, i)).collect();
        let scaled = batch.with_points(scaled(batch, &shares), batch.offsets().to_vec());
        let knots = Knots::new(&scaled, Parametrisation::ChordLength, Coincident::Refuse)?;
        let found = parallel::map_with(batch.len(), TOGETHER, Least::default, |least, i| {
            let found = self.fit_one(least, batch, &knots, (i, shares[i]));
            device.finished(1);
            found
        });
        let mut problems = BTreeMap::new();
        let (mut curves, mut reports) = (Vec::with_capacity(found.len()), Vec::with_capacity(found.len()));
        for (i, (report, curve)) in found.into_iter().enumerate() {
            if curve.is_none() {
                let message = report.message.clone().unwrap_or_default();
                problems.insert(i, Unfitted { status: report.status, message });
            }
            reports.push(report);
            curves.push(curve);
        }
        Ok(Fit::new(BandCurves::new(batch, curves, problems), reports, device.on_cpu().report(false)?))
    }

    /// Fits every curve and samples it.
    ///
    /// # Errors
    /// As [`fit`](Self::fit) and [`Sampling::check`].
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        sampling.check(batch)?;
        let fit = self.fit(batch, device)?;
        let samples = fit.polylines(sampling);
        Ok((fit, samples))
    }

    fn fit_one(
        &self,
        least: &mut Least,
        batch: &CurveBatch,
        knots: &Knots,
        (i, share): (usize, f64),
    ) -> (CurveReport, Option<BandCurve>) {
        if let Some(report) = knots.report_unfitted(i) {
            return (report, None);
        }
        let closed = knots.closed[i];
        let asked = self.distance.of(batch, i);
        let (values, d) = (knots.values(i), knots.dimension);
        // A curve may come back to its first point without being closed there.
        let is_loop = closed || values[..d] == values[values.len() - d..];
        let most = if is_loop { widest(values, d) } else { f64::INFINITY };
        // A loop without area has no width.
        let distance = if most > 0.0 { asked.min(most) } else { asked };
        let last = batch.count(i) - 1;
        let is_end = |k: usize| self.pin_ends && !closed && (k == 0 || k == last);
        let pinned: Vec<usize> =
            (0..=last).filter(|&k| is_end(k) || batch.is_pinned(i, k)).map(|k| knots.entry(i, k)).collect();
        least.load(knots, i, [distance, asked], &pinned, self.corners);
        let Some(Found { curve, energy, farthest, excess, iterations }) = least.find(self.keep_area) else {
            let what = "its spline leaves the range of the numbers: scale the curve, to a size nearer to 1";
            return (CurveReport::unfitted(CurveStatus::Invalid, batch.sentence(i, 0, what)), None);
        };
        // In metres, if the distance is.
        let unit = if let Deviation::Metres(metres) = self.distance { metres / asked } else { 1.0 };
        let [allowed, found] = [distance, farthest].map(|x| x * unit);
        let mut report = CurveReport { iterations, max_deviation: found, ..CurveReport::solved(energy) };
        if distance < asked {
            let what = format!(
                "it is smaller than a distance of {}: it is kept within {allowed}, 0.3 of its mean width",
                self.distance
            );
            report.message = Some(batch.sentence(i, 0, &what));
        }
        if let Some(excess) = excess {
            let what = format!("its area differs by {:.2} %: no curve within {allowed} came nearer", 100.0 * excess);
            report.message = Some(batch.sentence(i, 0, &what));
        }
        if farthest > distance {
            let what = format!(
                "after {iterations} iterations it is {found} from its polygon, where {allowed} is allowed: allow more, or pin \
                 fewer points"
            );
            report.status = CurveStatus::NotConverged;
            report.message = Some(batch.sentence(i, 0, &what));
        }
        let entries = (0..batch.count(i) + usize::from(closed)).map(|k| knots.entry(i, k));
        let mut curve = curve.over(entries, batch.given_knots(i));
        curve.stretch(share);
        // Pinned points keep their bits.
        let (d, is_pinned) = (knots.dimension, |k: &usize| is_end(*k) || batch.is_pinned(i, *k));
        (0..=last).filter(is_pinned).for_each(|k| curve.pin(k, &batch.points(i)[k * d..(k + 1) * d]));
        (report, Some(curve))
    }

    /// The factor of the first coordinates of curve `i`: on the ground the largest cosine of its
    /// latitudes, else 1.
    fn share(&self, batch: &CurveBatch, i: usize) -> f64 {
        if !matches!(self.distance, Deviation::Metres(_)) || !batch.is_geographic() {
            return 1.0;
        }
        let latitudes = batch.points(i).iter().skip(1).step_by(batch.dimension());
        latitudes.map(|latitude| libm::cos(latitude.to_radians())).fold(1e-6, f64::max)
    }
}

/// The coordinates of a batch with the first one of every point times the share of its curve.
fn scaled(batch: &CurveBatch, shares: &[f64]) -> Vec<f64> {
    let (d, mut coords) = (batch.dimension(), batch.coords().to_vec());
    for (i, share) in shares.iter().enumerate().filter(|(_, share)| **share != 1.0) {
        let own = &mut coords[batch.offsets()[i] * d..batch.offsets()[i + 1] * d];
        own.iter_mut().step_by(d).for_each(|x| *x *= share);
    }
    coords
}
