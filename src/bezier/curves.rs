//! Chains of Béziers behind the trait [`Curve`].

use std::borrow::Cow;

use super::MOST_DEGREE;
use super::polygons::Controls;
use crate::batch::CurveBatch;
use crate::curve::convert;
use crate::curve::measure::inlined_measures;
use crate::curve::{Curve, Jet, Polygon, Sampling, vector};
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveSet;
use glam::DVec3;

/// Control points of chains of Béziers of any degrees.
///
/// Pieces share their joints. A closed chain does not repeat its first point.
#[derive(Clone, Debug)]
pub(super) struct Chains {
    pub control: CurveBatch,
    /// The degree of each curve's pieces, or `None` for a curve that could not be completed.
    pub degrees: Vec<Option<usize>>,
    /// Parameters of the joints of each curve, or none for 0, 1, 2 ….
    pub knots: Vec<Vec<f64>>,
}

impl Chains {
    /// Number of pieces of curve `i`.
    pub fn pieces(&self, i: usize) -> usize {
        let points = self.control.count(i);
        match (self.degrees[i], self.control.is_closed(i)) {
            (None, _) => 0,
            (Some(0), _) => 1,
            (Some(degree), true) => points / degree,
            (Some(degree), false) => (points - 1) / degree,
        }
    }

    /// The coordinates of the control points of a piece.
    pub fn piece(&self, i: usize, piece: usize) -> impl Iterator<Item = &[f64]> {
        let (points, d, degree) = (self.control.points(i), self.control.dimension(), self.degrees[i].unwrap_or(0));
        let count = points.len() / d;
        (piece * degree..=(piece + 1) * degree).map(move |k| &points[k % count * d..][..d])
    }

    /// All pieces as separate polygons, with repeated joints.
    pub fn separate(&self) -> Controls {
        let mut pieces = Controls { dimension: self.control.dimension(), coords: Vec::new(), offsets: vec![0] };
        for i in 0..self.degrees.len() {
            for piece in 0..self.pieces(i) {
                for point in self.piece(i, piece) {
                    pieces.coords.extend_from_slice(point);
                }
                pieces.offsets.push(pieces.coords.len() / pieces.dimension);
            }
        }
        pieces
    }

    /// Replaces the pieces by pieces of another degree.
    pub fn join(&mut self, pieces: &Controls) {
        let dimension = pieces.dimension;
        let (mut coords, mut offsets) = (Vec::new(), vec![0]);
        let mut next = 0;
        for i in 0..self.degrees.len() {
            let count = self.pieces(i);
            match self.degrees[i] {
                None => coords.extend_from_slice(self.control.points(i)),
                Some(_) => {
                    for piece in next..next + count {
                        let points = pieces.points(piece);
                        let last = piece + 1 == next + count && !self.control.is_closed(i);
                        coords.extend_from_slice(&points[..points.len() - if last { 0 } else { dimension }]);
                    }
                    self.degrees[i] = Some(pieces.polygons().count(next) - 1);
                }
            }
            next += count;
            offsets.push(coords.len() / dimension);
        }
        self.control = self.control.with_points(coords, offsets);
    }

    fn sample(&self, i: usize, sampling: Sampling) -> (Vec<f64>, Vec<f64>) {
        let curve = self.curve(i);
        let knots = curve.knots();
        let mut coords = Vec::new();
        let at = |&(span, u): &(usize, f64)| match span + 1 < knots.len() {
            true => knots[span] + u * (knots[span + 1] - knots[span]),
            false => span as f64,
        };
        let sites = curve.sites(sampling);
        for &(span, u) in &sites {
            coords.extend_from_slice(&curve.jet(span, u).point.to_array()[..self.control.dimension()]);
        }
        (coords, sites.iter().map(at).collect())
    }
}

impl CurveSet for Chains {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.degrees[i] {
            Some(degree) => {
                let knots = match self.knots[i].is_empty() {
                    false => Cow::Borrowed(&self.knots[i][..]),
                    true => (0..=self.pieces(i)).map(|k| k as f64).collect(),
                };
                Box::new(Chain { chains: self, i, degree, knots })
            }
            None => {
                let (dimension, closed) = (self.control.dimension(), self.control.is_closed(i));
                Box::new(Polygon::new(self.control.points(i), dimension, closed))
            }
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let samples = parallel::map(self.control.len(), 64, |i| self.sample(i, sampling));
        let closing = |i: usize, last: f64| self.degrees[i].map_or(1.0, |_| self.curve(i).domain().1 - last);
        CurveBatch::samples_of(&self.control, self.control.dimension(), samples, closing)
    }
}

struct Chain<'a> {
    chains: &'a Chains,
    i: usize,
    degree: usize,
    knots: Cow<'a, [f64]>,
}

impl Curve for Chain<'_> {
    fn dimension(&self) -> usize {
        self.chains.control.dimension()
    }

    fn is_closed(&self) -> bool {
        self.chains.control.is_closed(self.i)
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn spans(&self) -> usize {
        self.chains.pieces(self.i)
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let mut points = [DVec3::ZERO; MOST_DEGREE + 1];
        for (point, coords) in points.iter_mut().zip(self.chains.piece(self.i, span)) {
            *point = vector(coords);
        }
        de_casteljau(&mut points[..=self.degree], u, self.pace(span))
    }

    fn motion(&self, span: usize, _: usize) -> Option<Motion> {
        (self.degree <= 3).then(|| Motion::of_bezier(self.cubic(span)))
    }

    fn beziers(&self, tolerance: f64) -> Vec<[DVec3; 4]> {
        if self.degree > 3 {
            // Inner control points may be far larger than the ends.
            let controls = (0..self.spans()).flat_map(|piece| self.chains.piece(self.i, piece).flatten());
            let largest = controls.fold(0.0, |largest: f64, x| largest.max(x.abs()));
            return convert::beziers_of_size(&self, largest, tolerance);
        }
        (0..self.spans()).map(|piece| self.cubic(piece)).collect()
    }

    inlined_measures!();
}

impl Chain<'_> {
    /// A piece of degree 3 or less as a cubic.
    fn cubic(&self, piece: usize) -> [DVec3; 4] {
        let mut points = [DVec3::ZERO; 4];
        for (point, coords) in points.iter_mut().zip(self.chains.piece(self.i, piece)) {
            *point = vector(coords);
        }
        let [a, b, c, _] = points;
        match self.degree {
            0 => [a; 4],
            1 => [a, a.lerp(b, 1.0 / 3.0), b.lerp(a, 1.0 / 3.0), b],
            2 => [a, a.lerp(b, 2.0 / 3.0), c.lerp(b, 2.0 / 3.0), c],
            _ => points,
        }
    }
}

/// Point and derivatives of a Bézier curve at the fraction `u` of a span of this length.
///
/// The control points are overwritten. The derivatives are X⁽ʳ⁾ = d!/(d−r)! Δʳ of the r + 1 points
/// that are left in a column of the triangle.
fn de_casteljau(points: &mut [DVec3], u: f64, length: f64) -> Jet {
    let degree = points.len() - 1;
    let mut jet = Jet::default();
    for left in (0..=degree).rev() {
        // left + 1 points are left.
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| points[k.min(degree)]);
        let falling = |r: usize| (0..r).map(|k| (degree - k) as f64).product::<f64>() / length.powi(r as i32);
        match left {
            3 => jet.third = falling(3) * (d - 3.0 * c + 3.0 * b - a),
            2 => jet.second = falling(2) * (c - 2.0 * b + a),
            1 => jet.first = falling(1) * (b - a),
            _ => {}
        }
        for k in 0..left {
            // The ends keep their bits.
            points[k] = if u == 1.0 { points[k + 1] } else { points[k].lerp(points[k + 1], u) };
        }
    }
    jet.point = points[0];
    jet
}
