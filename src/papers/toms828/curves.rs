//! Fitted graphs as [`Curve`]s: natural cubic splines through their mesh points.

use std::collections::BTreeMap;

use super::GraphTrace;
use super::mesh::natural_second_derivatives;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::{Curve, Input, Jet, Sampling};
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveSet;
use glam::DVec3;

/// The natural cubic spline through the mesh points of a graph.
///
/// It is p(t) = (t, y(t)), with a span from data point to data point.
pub(super) struct GraphCurve {
    width: f64,
    /// The mesh point of every data point.
    data: Vec<usize>,
    /// The t of every data point.
    knots: Vec<f64>,
    y: Vec<f64>,
    /// y″ at the mesh points.
    second: Vec<f64>,
}

impl GraphCurve {
    pub fn new(trace: &GraphTrace) -> Self {
        let (width, y) = (trace.width, trace.ordinates.clone());
        GraphCurve {
            width,
            knots: trace.data.iter().map(|&k| trace.start + k as f64 * width).collect(),
            data: trace.data.clone(),
            second: natural_second_derivatives(&vec![width; y.len() - 1], &y),
            y,
        }
    }
}

impl Curve for &GraphCurve {
    fn dimension(&self) -> usize {
        2
    }

    fn is_closed(&self) -> bool {
        false
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn pieces(&self, span: usize) -> usize {
        self.data[span + 1] - self.data[span]
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        let (k, h) = (self.data[span] + piece, self.width);
        let (y0, y1, m0, m1) = (self.y[k], self.y[k + 1], h * h * self.second[k], h * h * self.second[k + 1]);
        let slope = y1 - y0 - (2.0 * m0 + m1) / 6.0;
        let along = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        Some(Motion::of_cubic(along(h, slope), along(0.0, 0.5 * m0), along(0.0, (m1 - m0) / 6.0)))
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let (from, to) = (self.data[span], self.data[span + 1]);
        let place = u * (to - from) as f64;
        let cell = (place.floor().max(0.0) as usize).min(to - from - 1);
        let (k, b, h) = (from + cell, place - cell as f64, self.width);
        let a = 1.0 - b;
        let (y0, y1, m0, m1) = (self.y[k], self.y[k + 1], self.second[k], self.second[k + 1]);
        let t = if u == 1.0 { self.knots[span + 1] } else { self.knots[span] + place * h };
        let bend = ((a * a * a - a) * m0 + (b * b * b - b) * m1) * (h * h / 6.0);
        let slope = (y1 - y0) / h + ((3.0 * b * b - 1.0) * m1 - (3.0 * a * a - 1.0) * m0) * (h / 6.0);
        Jet {
            point: DVec3::new(t, a * y0 + b * y1 + bend, 0.0),
            first: DVec3::new(1.0, slope, 0.0),
            second: DVec3::new(0.0, a * m0 + b * m1, 0.0),
            third: DVec3::new(0.0, (m1 - m0) / h, 0.0),
        }
    }
}

/// The graphs of a batch.
pub(super) struct GraphCurves {
    pub batch: CurveBatch,
    /// The fitted graph.
    ///
    /// `None` where the curve comes out as its input polyline.
    pub curves: Vec<Option<GraphCurve>>,
    pub problems: BTreeMap<usize, Unfitted>,
    /// The curves that come out as their input.
    pub inputs: BTreeMap<usize, Input>,
}

impl CurveSet for GraphCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match &self.curves[i] {
            Some(curve) => Box::new(curve),
            None => Box::new(self.inputs[&i].polygon(self.batch.dimension(), self.batch.is_closed(i))),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let d = self.batch.dimension();
        let sample = |i: usize| -> (Vec<f64>, Vec<f64>) {
            let curve = self.curve(i);
            if !curve.is_fitted() {
                let input = &self.inputs[&i];
                return (input.coords.clone(), input.t.clone());
            }
            let points = curve.sites(sampling).into_iter().map(|(span, u)| curve.jet(span, u).point);
            points.map(|p| ([p.x, p.y], p.x)).fold(
                Default::default(),
                |(mut coords, mut t): (Vec<_>, Vec<_>), (p, x)| {
                    coords.extend(p);
                    t.push(x);
                    (coords, t)
                },
            )
        };
        let samples: Vec<_> = parallel::map(self.batch.len(), 1, sample);
        let (mut coords, mut t, mut offsets) = (Vec::new(), Vec::new(), vec![0]);
        for (of_curve, t_of_curve) in samples {
            coords.extend(of_curve);
            t.extend(t_of_curve);
            offsets.push(t.len());
        }
        let closed: Vec<bool> = (0..self.batch.len()).map(|i| self.batch.is_closed(i)).collect();
        // A closed curve is no graph and comes out as its input.
        let closing = |i: usize| self.inputs.get(&i).map_or(f64::NAN, |input| input.closing);
        let closing = closed.contains(&true).then(|| (0..closed.len()).map(closing).collect());
        let origin = self.batch.origin().clone();
        CurveBatch::sampled(d, coords, offsets, closed, t, closing, self.problems.clone(), origin)
    }
}
