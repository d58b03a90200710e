//! [`SurfaceCurves`]: splines through nodes in space, moved onto their surface.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::batch::{CurveBatch, Origin, Unfitted};
use crate::curve::measure::BySpeed;
use crate::curve::{Curve, Input, Jet, Sampling, samples_at};
use crate::ground::jet_onto;
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveSet;
use crate::sort;
use crate::spline::cubic::CubicSplines;
use crate::spline::knots::Knots;
use crate::surface::Surface;

/// The curves of a batch, through nodes of which every span has as many parts.
pub(crate) struct SurfaceCurves {
    /// Splines in space through all nodes.
    splines: CubicSplines,
    /// The knots of the data points.
    knots: Knots,
    /// Parts per span.
    parts: usize,
    unfitted: BTreeMap<usize, Input>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
    surface: Arc<dyn Surface>,
}

impl SurfaceCurves {
    /// The curves of a batch, from splines through their nodes.
    pub fn new(
        given: &CurveBatch,
        knots: Knots,
        splines: CubicSplines,
        parts: usize,
        problems: BTreeMap<usize, Unfitted>,
        surface: Arc<dyn Surface>,
    ) -> Self {
        let unfitted = sort::map(problems.keys().map(|&i| (i, Input::of(given, i))));
        SurfaceCurves { splines, knots, parts, unfitted, problems, origin: given.origin().clone(), surface }
    }

    /// The nodes of the data points of a curve, and of a closed curve's first point again.
    pub fn rows(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.knots.parameters(i).len()).map(move |k| self.row(i, k))
    }

    /// The node of data point `k`.
    fn row(&self, i: usize, k: usize) -> usize {
        self.parts * self.knots.entry(i, k)
    }

    fn fitted(&self, i: usize) -> Option<SurfaceCurve<'_>> {
        let is_fitted = !self.unfitted.contains_key(&i);
        is_fitted.then(|| SurfaceCurve { curve: self.splines.curve(i), set: self, i, knots: self.knots.parameters(i) })
    }
}

impl CurveSet for SurfaceCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.fitted(i) {
            Some(curve) => Box::new(curve),
            None => Box::new(self.unfitted[&i].polygon(3, self.knots.closed[i])),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let closed = &self.knots.closed;
        let samples = parallel::map(closed.len(), 16, |i| match self.fitted(i) {
            Some(curve) => samples_at(&curve, &curve.sites(sampling), None),
            None => self.unfitted[&i].sample(3, closed[i], sampling),
        });
        let closing = |i: usize, last: f64| match self.unfitted.get(&i) {
            Some(input) => input.closing_after(last),
            None => self.knots.t(i)[self.knots.t(i).len() - 1] - last,
        };
        CurveBatch::from_samples(3, samples, closing, closed.clone(), self.problems.clone(), self.origin.clone())
    }
}

/// One spline.
struct SurfaceCurve<'a> {
    /// The spline in space through all nodes.
    curve: Box<dyn Curve + 'a>,
    set: &'a SurfaceCurves,
    i: usize,
    /// The parameters of the data points.
    knots: Cow<'a, [f64]>,
}

impl Curve for SurfaceCurve<'_> {
    fn dimension(&self) -> usize {
        3
    }

    fn is_closed(&self) -> bool {
        self.curve.is_closed()
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn pieces(&self, span: usize) -> usize {
        self.set.row(self.i, span + 1) - self.set.row(self.i, span)
    }

    /// The motion of the spline in space, which is in the surface to h⁴. Curvatures are taken from
    /// it.
    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        self.curve.motion(self.set.row(self.i, span) + piece, 0)
    }

    /// A span without length, between repeated points, is all at its data point.
    fn jet(&self, span: usize, u: f64) -> Jet {
        let (first, pieces) = (self.set.row(self.i, span), self.pieces(span));
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
        let moved = jet_onto(&*self.set.surface, jet);
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
