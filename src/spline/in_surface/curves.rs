//! [`SurfaceCurves`]: splines through nodes in space, moved onto their surface.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::batch::{CurveBatch, Origin, Unfitted};
use crate::curve::measure::BySpeed;
use crate::curve::{Curve, Input, Jet, Sampling};
use crate::ground::jet_onto;
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveSet;
use crate::sort;
use crate::spline::cubic::CubicSplines;
use crate::spline::knots::Knots;
use crate::surface::Surface;

/// The curves of a batch, through nodes of which every span has as many parts.
pub(super) struct SurfaceCurves {
    /// Those that were fitted, in their order, through all their nodes.
    splines: CubicSplines,
    /// The number of every curve among the splines.
    numbers: Vec<Option<usize>>,
    /// The first node of every data span, and the last of all.
    rows: Vec<Vec<usize>>,
    /// The parameters of the data points, and of a closed curve's first again.
    knots: Vec<Vec<f64>>,
    closed: Vec<bool>,
    unfitted: BTreeMap<usize, Input>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
    surface: Arc<dyn Surface>,
}

impl SurfaceCurves {
    /// The curves of a batch, from splines through the nodes of all that were fitted.
    pub fn new(
        given: &CurveBatch,
        knots: &Knots,
        splines: CubicSplines,
        parts: usize,
        problems: BTreeMap<usize, Unfitted>,
        surface: Arc<dyn Surface>,
    ) -> Self {
        let (mut next, mut numbers, mut rows, mut parameters) = (0, Vec::new(), Vec::new(), Vec::new());
        for i in 0..given.len() {
            let is_fitted = !problems.contains_key(&i);
            numbers.push(is_fitted.then_some(next));
            next += usize::from(is_fitted);
            let t = knots.t(i);
            let entries: Vec<usize> = match knots.repeats.get(&i) {
                Some(entries) => entries.iter().map(|&entry| entry as usize).collect(),
                None => (0..t.len()).collect(),
            };
            parameters.push(if is_fitted { entries.iter().map(|&entry| t[entry]).collect() } else { Vec::new() });
            rows.push(entries.iter().map(|&entry| parts * entry).collect());
        }
        SurfaceCurves {
            splines,
            numbers,
            rows,
            knots: parameters,
            closed: (0..given.len()).map(|i| given.is_closed(i)).collect(),
            unfitted: sort::map(problems.keys().map(|&i| (i, Input::of(given, i)))),
            problems,
            origin: given.origin().clone(),
            surface,
        }
    }

    /// The nodes of the data points of a curve.
    pub fn rows(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.rows[i].iter().copied()
    }

    fn fitted(&self, i: usize) -> Option<SurfaceCurve<'_>> {
        Some(SurfaceCurve {
            curve: self.splines.curve(self.numbers[i]?),
            rows: &self.rows[i],
            knots: &self.knots[i],
            surface: &*self.surface,
        })
    }
}

impl CurveSet for SurfaceCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.fitted(i) {
            Some(curve) => Box::new(curve),
            None => Box::new(self.unfitted[&i].polygon(3, self.closed[i])),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let sample = |i: usize| match self.fitted(i) {
            None => self.unfitted[&i].sample(3, self.closed[i], sampling),
            Some(curve) => {
                let sites = curve.sites(sampling);
                let t = |&(span, u): &(usize, f64)| {
                    let (from, to) = (curve.knots[span], curve.knots[span + 1]);
                    (from + u * (to - from)).min(to)
                };
                let coords = sites.iter().flat_map(|&(span, u)| curve.jet(span, u).point.to_array()).collect();
                (coords, sites.iter().map(t).collect())
            }
        };
        let samples: Vec<(Vec<f64>, Vec<f64>)> = parallel::map(self.closed.len(), 16, sample);
        let closing = |i: usize, last: f64| match self.unfitted.get(&i) {
            Some(input) => input.closing_after(last),
            None => self.knots[i][self.knots[i].len() - 1] - last,
        };
        let (closed, problems) = (self.closed.clone(), self.problems.clone());
        CurveBatch::from_samples(3, samples, closing, closed, problems, self.origin.clone())
    }
}

/// One spline.
struct SurfaceCurve<'a> {
    /// The spline in space through all nodes.
    curve: Box<dyn Curve + 'a>,
    rows: &'a [usize],
    knots: &'a [f64],
    surface: &'a dyn Surface,
}

impl Curve for SurfaceCurve<'_> {
    fn dimension(&self) -> usize {
        3
    }

    fn is_closed(&self) -> bool {
        self.curve.is_closed()
    }

    fn knots(&self) -> &[f64] {
        self.knots
    }

    fn pace(&self, span: usize) -> f64 {
        self.knots[span + 1] - self.knots[span]
    }

    fn pieces(&self, span: usize) -> usize {
        self.rows[span + 1] - self.rows[span]
    }

    /// That of the spline in space, which is in the surface to h⁴. Curvatures are its own.
    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        self.curve.motion(self.rows[span] + piece, 0)
    }

    /// A span without length, between repeated points, is all at its data point.
    fn jet(&self, span: usize, u: f64) -> Jet {
        let (first, pieces) = (self.rows[span], self.pieces(span));
        let (part, v) = match pieces {
            0 if first < self.curve.spans() => (first, 0.0),
            0 => (first - 1, 1.0),
            _ => {
                let place = u * pieces as f64;
                let part = (place.floor().max(0.0) as usize).min(pieces - 1);
                (first + part, place - part as f64)
            }
        };
        let jet = self.curve.jet(part, v);
        // Nodes are in the surface, and keep their bits.
        let is_node = v == 0.0 || v == 1.0;
        let moved = jet_onto(self.surface, jet);
        if is_node { Jet { point: jet.point, ..moved } } else { moved }
    }

    fn length(&self) -> f64 {
        BySpeed(self).length()
    }

    fn span_length(&self, span: usize) -> f64 {
        BySpeed(self).span_length(span)
    }

    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        BySpeed(self).fraction_at(span, length, target)
    }
}
