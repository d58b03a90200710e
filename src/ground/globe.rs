//! Curves of longitudes and latitudes: fitted in space on their globe, and brought back.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use crate::batch::{CurveBatch, Origin, Unfitted};
use crate::curve::{Curve, Input, Jet, Sampling, samples_at};
use crate::motion::Motion;
use crate::parallel;
use crate::report::{CurveReport, CurveSet, Fit};
use crate::sort;
use crate::status::CurveStatus;
use crate::surface::Globe;

const TURN: f64 = 360.0;

/// Results within this many degrees of a data point are that point.
const SAME: f64 = 1e-9;

/// The places in space of longitudes and latitudes. Curves of latitudes beyond the poles have a
/// problem.
pub(crate) fn in_space(globe: Globe, batch: &CurveBatch) -> CurveBatch {
    let mut coords = Vec::with_capacity(3 * batch.total_points());
    let mut problems = Vec::new();
    for i in 0..batch.len() {
        let points: Vec<&[f64]> = batch.points(i).chunks_exact(batch.dimension()).collect();
        if let Some(k) = points.iter().position(|point| point[1].abs() > 90.0)
            && batch.problem(i).is_none()
        {
            let what = format!(
                "its latitude is {}: give degrees from -90 to 90, with the longitude before the latitude",
                points[k][1]
            );
            problems.push((i, Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &what) }));
        }
        coords.extend(points.iter().flat_map(|point| globe.place(point[0], point[1]).to_array()));
    }
    batch.moved(3, coords, problems)
}

/// Curves in space, seen as longitudes and latitudes.
pub(crate) struct GlobeCurves {
    curves: Box<dyn CurveSet>,
    /// Curves whose x is the height, if points have heights.
    heights: Option<Fit>,
    globe: Globe,
    closed: Vec<bool>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
    /// Longitudes and latitudes of the data points, and the offsets of the curves.
    given: (Vec<[f64; 2]>, Vec<usize>),
    unfitted: BTreeMap<usize, Input>,
}

impl GlobeCurves {
    /// The curves of a batch of longitudes and latitudes, fitted in space, with their reports.
    pub fn new(
        globe: Globe,
        batch: &CurveBatch,
        curves: Box<dyn CurveSet>,
        heights: Option<Fit>,
        reports: &[CurveReport],
    ) -> Self {
        let lost: Vec<usize> = (0..batch.len()).filter(|&i| !curves.curve(i).is_fitted()).collect();
        let problem = |&i: &usize| {
            let message = reports[i].message.clone().unwrap_or_default();
            (i, Unfitted { status: reports[i].status, message })
        };
        let degrees = batch.coords().chunks_exact(batch.dimension()).map(|point| [point[0], point[1]]);
        GlobeCurves {
            heights,
            globe,
            closed: (0..batch.len()).map(|i| batch.is_closed(i)).collect(),
            problems: sort::map(lost.iter().map(problem)),
            origin: batch.origin().clone(),
            given: (degrees.collect(), batch.offsets().to_vec()),
            unfitted: sort::map(lost.iter().map(|&i| (i, Input::of(batch, i)))),
            curves,
        }
    }

    /// 2 or 3.
    fn dimension(&self) -> usize {
        2 + usize::from(self.heights.is_some())
    }

    fn fitted(&self, i: usize) -> GlobeCurve<'_> {
        let (points, offsets) = &self.given;
        let points = &points[offsets[i]..offsets[i + 1]];
        GlobeCurve::new(self.curves.curve(i), self.heights.as_ref().map(|fit| fit.curve(i)), self.globe, points)
    }
}

impl CurveSet for GlobeCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.unfitted.get(&i) {
            Some(input) => Box::new(input.polygon(self.dimension(), self.closed[i])),
            None => Box::new(self.fitted(i)),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let sample = |i: usize| match self.unfitted.get(&i) {
            Some(input) => input.sample(self.dimension(), self.closed[i], sampling),
            None => {
                let curve = self.fitted(i);
                samples_at(&curve, &curve.sites(sampling), None)
            }
        };
        let samples = parallel::map(self.closed.len(), 16, sample);
        let dimension = self.dimension();
        let origin = self.origin(dimension, &samples);
        let closing = |i: usize, last: f64| match self.unfitted.get(&i) {
            Some(input) => input.closing_after(last),
            None => self.curves.curve(i).knots().last().map_or(0.0, |end| end - last),
        };
        let (closed, problems) = (self.closed.clone(), self.problems.clone());
        CurveBatch::from_samples(dimension, samples, closing, closed, problems, origin)
    }
}

impl GlobeCurves {
    /// The origin of the input, with curves that now go past ±180° among those that do.
    fn origin(&self, dimension: usize, samples: &[(Vec<f64>, Vec<f64>)]) -> Arc<Origin> {
        let origin = &self.origin;
        let passes = |coords: &[f64]| coords.iter().step_by(dimension).any(|longitude| longitude.abs() > 0.5 * TURN);
        let known = |i: &usize| origin.unwrapped.binary_search(i).is_ok();
        let more: Vec<usize> = (0..samples.len()).filter(|i| !known(i) && passes(&samples[*i].0)).collect();
        if more.is_empty() {
            return origin.clone();
        }
        let mut unwrapped: Vec<usize> = origin.unwrapped.iter().copied().chain(more).collect();
        unwrapped.sort_unstable();
        Arc::new(Origin { unwrapped, ..Origin::clone(origin) })
    }
}

/// A curve in space, seen as longitudes and latitudes in degrees, and heights. Lengths are measured
/// on the ground, with the rise of heights, and curvatures in space, of the curve on the ground.
struct GlobeCurve<'a> {
    curve: Box<dyn Curve + 'a>,
    height: Option<Box<dyn Curve + 'a>>,
    globe: Globe,
    /// Longitude and latitude at both ends of every piece of every span, without a jump from one to
    /// the next.
    ends: Vec<Vec<[f64; 2]>>,
}

impl<'a> GlobeCurve<'a> {
    fn new(curve: Box<dyn Curve + 'a>, height: Option<Box<dyn Curve + 'a>>, globe: Globe, points: &[[f64; 2]]) -> Self {
        let mut before = points[0][0];
        let mut ends = Vec::with_capacity(curve.spans());
        for span in 0..curve.spans() {
            let pieces = curve.pieces(span).max(1);
            let mut of_span = Vec::with_capacity(pieces + 1);
            for piece in 0..=pieces {
                let [longitude, latitude] = globe.angles(curve.jet(span, piece as f64 / pieces as f64).point);
                let mut own = [nearest(longitude, latitude, before), latitude];
                if piece == 0 || piece == pieces {
                    let [given, latitude] = points[(span + piece / pieces) % points.len()];
                    let given = given + TURN * ((own[0] - given) / TURN).round();
                    let away = (given - own[0]).abs() * libm::cos(latitude.to_radians());
                    if away.max((latitude - own[1]).abs()) < SAME {
                        own = [given, latitude];
                    }
                }
                before = own[0];
                of_span.push(own);
            }
            ends.push(of_span);
        }
        GlobeCurve { curve, height, globe, ends }
    }

    /// The height at the fraction of a span, and its first two derivatives by that fraction. 0
    /// without heights.
    fn height_at(&self, span: usize, u: f64) -> [f64; 3] {
        let Some(curve) = &self.height else { return [0.0; 3] };
        let (jet, length) = (curve.jet(span, u), curve.pace(span));
        [jet.point.x, length * jet.first.x, length * length * jet.second.x]
    }

    /// The piece at the fraction of a span, and the fraction of the piece.
    fn locate_piece(&self, span: usize, u: f64) -> (usize, f64) {
        let pieces = self.ends[span].len() - 1;
        let place = u * pieces as f64;
        let piece = (place.floor().max(0.0) as usize).min(pieces - 1);
        (piece, place - piece as f64)
    }

    fn angles(&self, point: DVec3, span: usize, piece: usize, v: f64) -> [f64; 2] {
        let [longitude, latitude] = self.globe.angles(point);
        let [from, to] = [self.ends[span][piece][0], self.ends[span][piece + 1][0]];
        [nearest(longitude, latitude, from + v * (to - from)), latitude]
    }
}

/// The longitude, plus whole turns, that is nearest to another. At a pole it is the other.
fn nearest(longitude: f64, latitude: f64, other: f64) -> f64 {
    if latitude.abs() == 90.0 { other } else { longitude + TURN * ((other - longitude) / TURN).round() }
}

impl Curve for GlobeCurve<'_> {
    fn globe(&self) -> Option<Globe> {
        Some(self.globe)
    }

    fn dimension(&self) -> usize {
        2 + usize::from(self.height.is_some())
    }

    fn is_closed(&self) -> bool {
        self.curve.is_closed()
    }

    fn knots(&self) -> &[f64] {
        self.curve.knots()
    }

    fn pace(&self, span: usize) -> f64 {
        self.curve.pace(span)
    }

    fn pieces(&self, span: usize) -> usize {
        self.curve.pieces(span)
    }

    fn motion(&self, _: usize, _: usize) -> Option<Motion> {
        None
    }

    fn speed(&self, span: usize, u: f64) -> f64 {
        libm::hypot(self.curve.speed(span, u), self.height_at(span, u)[1])
    }

    fn max_curvature(&self) -> f64 {
        self.curve.max_curvature()
    }

    /// λ = atan2(y, x), φ = atan2(a²z, b²ρ), ρ² = x² + y², with their derivatives by the chain
    /// rule. The third is 0, and so are all at a pole, which has no longitude.
    fn jet(&self, span: usize, u: f64) -> Jet {
        let (piece, v) = self.locate_piece(span, u);
        let jet = self.curve.jet(span, u);
        let [longitude, latitude] = match v {
            0.0 => self.ends[span][piece],
            1.0 => self.ends[span][piece + 1],
            _ => self.angles(jet.point, span, piece, v),
        };
        let ratio = self.globe.equatorial / self.globe.polar;
        let k = ratio * ratio;
        let (p, d, dd) = (jet.point, jet.first, jet.second);
        let square = p.x * p.x + p.y * p.y;
        let [height, rise, bend] = self.height_at(span, u);
        let pace = self.curve.pace(span);
        let heights = [rise / pace, bend / (pace * pace)];
        let point = DVec3::new(longitude, latitude, height);
        if square == 0.0 {
            return Jet { point, ..Jet::default() };
        }
        let out = square.sqrt();
        let turn = p.x * d.y - p.y * d.x;
        let growth = p.x * d.x + p.y * d.y;
        let turn_change = p.x * dd.y - p.y * dd.x;
        let longitudes = [turn / square, turn_change / square - 2.0 * turn * growth / (square * square)];
        let out_first = growth / out;
        let out_second = (d.x * d.x + d.y * d.y + p.x * dd.x + p.y * dd.y - out_first * out_first) / out;
        let rise = k * (out * d.z - p.z * out_first);
        let rise_change = k * (out * dd.z - p.z * out_second);
        let whole = square + k * k * p.z * p.z;
        let whole_change = 2.0 * (growth + k * k * p.z * d.z);
        let latitudes = [rise / whole, rise_change / whole - rise * whole_change / (whole * whole)];
        let of =
            |order: usize| DVec3::new(longitudes[order].to_degrees(), latitudes[order].to_degrees(), heights[order]);
        Jet { point, first: of(0), second: of(1), third: DVec3::ZERO }
    }
}
