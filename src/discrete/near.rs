//! Where searches for a deviation start: at smoothing splines, which keep it and are gentle already.
//!
//! The natural spline goes through every point, however sharply points turn: descents from there
//! may swing out into large loops instead of letting go of the points. The smoothing spline is on
//! the right side of that from the start, and its λ says about which weight of an attachment the
//! deviation needs.

use std::collections::BTreeMap;

use super::curves::Vertices;
use super::energy::Energy;
use super::fair::{Fair, Pins};
use super::setup::Ready;
use crate::Constraints;
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::curve::Curve;
use crate::device::Device;
use crate::error::Result;
use crate::report::{CurveReport, CurveSet};
use crate::spline::{Amount, CubicSplines, Parametrisation, Smoothing};
use crate::status::CurveStatus;

/// Splines of open curves stray from their points by at most this part of the diagonal of their
/// box: one that is allowed all of it may be a point.
const OF_DIAGONAL: f64 = 0.25;

/// Of closed curves, this part of area over length: a circle keeps three quarters of its radius, a
/// sliver half its width.
const OF_WIDTH: f64 = 0.5;

/// Closed curves that enclose nothing, such as an eight, stray by this part of their diagonal.
const LEAST_OF_DIAGONAL: f64 = 0.01;

/// The smoothing splines of a batch.
pub(super) struct Near {
    splines: Vec<CubicSplines>,
    /// Of every curve, in which splines and where there.
    places: Vec<Option<(usize, usize, Spread)>>,
}

/// What a spline says of the weight.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    /// Its λ; 0 where there is no spline.
    pub lambda: f64,
    /// How often the deviation allowed was halved for it.
    pub halvings: i32,
}

impl Near {
    /// The splines that keep the deviation, or halves of it where a curve is so small that it might
    /// vanish.
    pub fn new<const D: usize>(pins: Pins, allowed: f64, batch: &CurveBatch) -> Result<Self> {
        let free = batch.clone().with_constraints(Constraints::default())?;
        let mut groups: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
        for i in 0..batch.len() {
            let most = reach::<D>(batch, i);
            let halvings = (allowed / most).log2().ceil().max(0.0);
            // Where that is no number a curve is not to be fitted at all, or is too extreme for it.
            if halvings < f64::from(MOST_HALVINGS) {
                groups.entry(halvings as i32).or_default().push(i);
            }
        }
        let mut near = Near { splines: Vec::new(), places: vec![None; batch.len()] };
        for (halvings, curves) in groups {
            let smoothing = Smoothing {
                amount: Amount::Deviation(allowed * f64::from(-halvings).exp2()),
                pin_ends: pins != Pins::None,
                parametrisation: Parametrisation::ChordLength,
            };
            let (splines, reports) = smoothing.fit_splines(&free.select(&curves), &Device::cpu())?;
            for (k, (&i, report)) in curves.iter().zip(&reports).enumerate() {
                let lambda = report.smoothing.filter(|_| report.status == CurveStatus::Converged);
                near.places[i] = lambda.map(|lambda| (near.splines.len(), k, Spread { lambda, halvings }));
            }
            near.splines.push(splines);
        }
        Ok(near)
    }

    /// The spline of curve `i`, if it has one.
    pub fn curve(&self, i: usize) -> Option<Box<dyn Curve + '_>> {
        let (group, k, _) = self.places[i]?;
        Some(self.splines[group].curve(k))
    }

    /// What it says of the weight.
    pub fn spread(&self, i: usize) -> Spread {
        self.places[i].map_or(Spread::default(), |(.., spread)| spread)
    }
}

impl<const D: usize> Ready<D> {
    /// The report of a curve that is the spline it would have started from.
    pub fn left_as_it_is(
        self,
        attached: &Fair,
        batch: &CurveBatch,
        i: usize,
        allowed: f64,
        iterations: u32,
    ) -> (CurveReport, Option<Vertices>) {
        let what = format!(
            "no weight of the attachment leads to a minimum that keeps the deviation of {allowed} and has no loops, after {iterations} iterations: the \
             curve is the spline they started from, which keeps it; {}",
            remedy(&attached.energy)
        );
        let report = CurveReport {
            status: CurveStatus::NotConverged,
            message: Some(batch.sentence(i, 0, &what)),
            energy: self.problem.energy_of_base(&attached.energy) * self.energy_unit,
            iterations,
            gradient_norm: f64::NAN,
            smoothing: None,
            max_deviation: self.deviation(batch.points(i).as_chunks::<D>().0),
        };
        let coords = self.vertices.into_iter().flatten().collect();
        (report, Some(Vertices { coords, rows: self.rows, corners: vec![] }))
    }
}

/// What helps a curve whose minimum near its points is not to be had, the best first. Of the 594
/// borders of countries-110m at a deviation of 0.2 so many have one: with bending alone 466, with a
/// length of weight 0.1, 1 and 10 beside it 473, 518 and 571, with corners of 60° all.
pub(super) fn remedy(energy: &Energy) -> &'static str {
    match energy.bounds_length() {
        true => "keep its corners, such as those of 60° and more, or weigh length more",
        false => "keep its corners, such as those of 60° and more, or add length to the energy",
    }
}

/// Halvings of the deviation at most; a curve that needs more is lost in its rounding beside it.
const MOST_HALVINGS: i32 = 52;

/// How far the spline of a curve may stray without vanishing.
fn reach<const D: usize>(batch: &CurveBatch, i: usize) -> f64 {
    let points = batch.points(i).as_chunks::<D>().0;
    let diagonal = Bounds::of(points.iter().copied()).sides().into_iter().fold(0.0, f64::hypot);
    if !batch.is_closed(i) {
        return OF_DIAGONAL * diagonal;
    }
    // ½ Σ p × q, from the first point on, by its components.
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
