//! [`Near`]: the smoothing splines from which curves within a deviation start.
//!
//! The natural spline interpolates every point, however sharply the points turn. Descents from
//! there may swing out into large loops instead of leaving the points. The smoothing spline has
//! left them from the start. It keeps the deviation and is smooth.

use super::curves::Vertices;
use super::energy::Energy;
use super::fair::{Fair, Pins};
use super::setup::PreparedCurve;
use super::verdict::deviation;
use crate::Constraints;
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::curve::Curve;
use crate::device::Device;
use crate::error::Result;
use crate::report::{CurveReport, CurveSet};
use crate::spline::{CubicSplines, Parametrisation, Smoothing, SmoothingTarget};
use crate::status::CurveStatus;

/// The largest deviation of the spline of an open curve, as a fraction of the diagonal of its
/// bounding box.
///
/// A spline that may deviate by the whole diagonal may shrink to a point.
const OF_DIAGONAL: f64 = 0.25;

/// The largest deviation of the spline of a closed curve, as a fraction of area over length.
///
/// A circle keeps about three quarters of its radius, and a sliver half of its width. With 0.5
/// another border of countries-110m does not converge at a deviation of 0.2. With 0.45 the energy
/// of a four-leaf clover is 4 % higher.
const OF_WIDTH: f64 = 0.47;

/// The least bound for closed curves, which applies if they enclose no area, such as a figure
/// eight. It is a fraction of the diagonal.
const LEAST_OF_DIAGONAL: f64 = 0.01;

/// The smoothing splines of a batch.
pub(super) struct Near {
    splines: Option<CubicSplines>,
    /// The index of each curve's spline.
    places: Vec<Option<usize>>,
    /// The deviation that each curve may use.
    allowed: Vec<f64>,
}

impl Near {
    /// The splines with the requested deviation, or with the largest at which the curve does not
    /// vanish.
    pub fn new<const D: usize>(pins: Pins, asked: &[f64], batch: &CurveBatch) -> Result<Self> {
        let pinned = batch.constraints().pinned.clone();
        let free = batch.clone().with_constraints(Constraints { pinned, ..Constraints::default() })?;
        let reaches: Vec<f64> = (0..batch.len()).map(|i| reach::<D>(batch, i)).collect();
        // A curve that cannot be fitted has a bound of 0 or NaN.
        let has_spline = |&i: &usize| {
            let distance = asked[i].min(reaches[i]);
            distance > 0.0 && distance.is_finite() && asked[i] / reaches[i] < MOST_TIMES
        };
        let places: Vec<usize> = (0..batch.len()).filter(has_spline).collect();
        let within = |k: usize| Smoothing {
            target: SmoothingTarget::Deviation(asked[places[k]].min(reaches[places[k]]).into()),
            pin_ends: pins != Pins::None,
            parametrisation: Parametrisation::ChordLength,
        };
        let mut near = Near { splines: None, places: vec![None; batch.len()], allowed: asked.to_vec() };
        if !places.is_empty() {
            let (splines, reports) = within(0).fit_by(&free.select(&places), &Device::cpu(), &within)?;
            for (k, (&i, report)) in places.iter().zip(&reports).enumerate() {
                near.places[i] = (report.status == CurveStatus::Converged).then_some(k);
                near.allowed[i] = asked[i].min(reaches[i]);
            }
            near.splines = Some(splines);
        }
        Ok(near)
    }

    /// The spline of curve `i`, if it has one.
    pub fn curve(&self, i: usize) -> Option<Box<dyn Curve + '_>> {
        Some(self.splines.as_ref()?.curve(self.places[i]?))
    }

    /// The deviation that curve `i` may use without vanishing.
    pub fn allowed(&self, i: usize) -> f64 {
        self.allowed[i]
    }
}

/// The report and the vertices of a curve that is left as the spline from which it would have
/// started.
pub(super) fn left_as_it_is<const D: usize>(
    ready: PreparedCurve<D>,
    attached: &Fair,
    batch: &CurveBatch,
    i: usize,
    allowed: f64,
    iterations: u32,
) -> (CurveReport, Option<Vertices>) {
    let what = format!(
        "{iterations} iterations did not lead to a minimum that keeps the deviation of {allowed} and has no loops: the \
         curve is the spline that they started from, which keeps it; {}",
        remedy(&attached.energy)
    );
    let report = CurveReport {
        status: CurveStatus::NotConverged,
        message: Some(batch.sentence(i, 0, &what)),
        energy: ready.problem.energy_of_base(&attached.energy) * ready.energy_unit,
        iterations,
        gradient_norm: f64::NAN,
        max_deviation: deviation(&ready.vertices, &ready.rows, batch.points(i).as_chunks::<D>().0),
        ..CurveReport::default()
    };
    let coords = ready.vertices.into_iter().flatten().collect();
    (report, Some(Vertices { coords, rows: ready.rows, tangents: None }))
}

/// The remedy for a curve without a minimum near its points.
///
/// Of the 594 borders of countries-110m at a deviation of 0.2 this many have a minimum:
///
/// - 466 with bending alone
/// - 473, 518 and 571 with length of weight 0.1, 1 and 10 added
/// - all with corners of 60°
pub(super) fn remedy(energy: &Energy) -> &'static str {
    match energy.bounds_length() {
        true => "keep its corners, such as those of 60° and more, or weigh length more",
        false => "keep its corners, such as those of 60° and more, or add length to the energy",
    }
}

/// The largest deviation relative to the curve's own bound.
///
/// If the ratio is larger, the curve is as small as the rounding of the deviation.
const MOST_TIMES: f64 = 1.0 / f64::EPSILON;

/// How far the spline of a curve may deviate without vanishing.
fn reach<const D: usize>(batch: &CurveBatch, i: usize) -> f64 {
    let points = batch.points(i).as_chunks::<D>().0;
    let diagonal = Bounds::of(points.iter().copied()).sides().into_iter().fold(0.0, f64::hypot);
    if !batch.is_closed(i) {
        return OF_DIAGONAL * diagonal;
    }
    // The components of ½ Σ p × q, with positions relative to the first point.
    let mut area = [[0.0; D]; D];
    let mut length = 0.0;
    for k in 0..points.len() {
        let [p, q] = [points[k], points[(k + 1) % points.len()]].map(|p| p.map(|x| x / diagonal));
        let first = points[0].map(|x| x / diagonal);
        length += (0..D).map(|c| q[c] - p[c]).fold(0.0, f64::hypot);
        for a in 0..D {
            for b in 0..a {
                area[a][b] += 0.5 * ((p[a] - first[a]) * (q[b] - first[b]) - (p[b] - first[b]) * (q[a] - first[a]));
            }
        }
    }
    let area = area.as_flattened().iter().fold(0.0f64, |sum, x| sum.hypot(*x));
    diagonal * (OF_WIDTH * area / length).max(LEAST_OF_DIAGONAL)
}
