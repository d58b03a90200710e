//! Wide spans of a surface: points are inserted before a spline is fitted in space.
//!
//! A spline in space cuts through a sphere between points that are far apart, and projections from
//! near the centre diverge. Halved chords with projected middles follow great circles instead.

use glam::DVec3;

use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, vector};
use crate::motion::Motion;
use crate::parallel;
use crate::ragged;
use crate::surface::{Surface, normal};

/// Normals turn by at most this angle, in radians, along a span without inserted points.
const WIDE: f64 = std::f64::consts::FRAC_PI_4;

/// A batch with points inserted in wide spans, and the number of parts of each span.
pub(crate) struct Halved {
    pub batch: CurveBatch,
    parts: Vec<Vec<usize>>,
}

impl Halved {
    /// Halves wide spans until none is wide. `None` if no span is wide.
    pub fn of(batch: &CurveBatch, surface: &dyn Surface) -> Option<Self> {
        let has_wide = |i: usize| {
            let normals: Vec<DVec3> = batch.points(i).chunks_exact(3).map(|p| normal(surface, vector(p))).collect();
            (0..batch.spans(i)).any(|k| is_wide(normals[k], normals[(k + 1) % normals.len()]))
        };
        if !parallel::map(batch.len(), 256, has_wide).contains(&true) {
            return None;
        }
        let (mut coords, mut parts) = (Vec::new(), Vec::with_capacity(batch.len()));
        let mut counts = Vec::with_capacity(batch.len());
        for i in 0..batch.len() {
            let points: Vec<DVec3> = batch.points(i).chunks_exact(3).map(vector).collect();
            let (before, mut own) = (coords.len(), Vec::with_capacity(batch.spans(i)));
            for (k, from) in points.iter().enumerate() {
                coords.extend(from.to_array());
                if k < batch.spans(i) {
                    let way = between(surface, *from, points[(k + 1) % points.len()]);
                    own.push(way.len() + 1);
                    coords.extend(way.iter().flat_map(|x| x.to_array()));
                }
            }
            counts.push((coords.len() - before) / 3);
            parts.push(own);
        }
        Some(Halved { batch: batch.with_points(coords, ragged::offsets(counts)), parts })
    }

    /// A curve through the points of curve `i`, with the spans of the original batch.
    pub fn joined<'a>(&self, i: usize, curve: Box<dyn Curve + 'a>) -> Box<dyn Curve + 'a> {
        let mut first = 0;
        let spans = self.parts[i].iter().map(|&parts| {
            first += parts;
            [first - parts, parts]
        });
        let spans: Vec<[usize; 2]> = spans.collect();
        let knots = (0..=spans.len()).map(|k| k as f64).collect();
        Box::new(Joined { curve, spans, knots })
    }
}

/// Whether unit normals turn by more than [`WIDE`].
fn is_wide(from: DVec3, to: DVec3) -> bool {
    from.dot(to) < WIDE.cos()
}

/// Points of the surface between two, by halving. Empty if the normal turns little, or if a
/// projection fails.
pub(crate) fn between(surface: &dyn Surface, from: DVec3, to: DVec3) -> Vec<DVec3> {
    let normals = [from, to].map(|x| normal(surface, x));
    if !is_wide(normals[0], normals[1]) {
        return Vec::new();
    }
    let halvings = (normals[0].angle_between(normals[1]) / WIDE).log2().ceil().clamp(1.0, 2.0);
    let mut way = vec![from, to];
    for _ in 0..halvings as u32 {
        let mut finer = vec![from];
        for pair in way.windows(2) {
            let Some(middle) = surface.project(0.5 * (pair[0] + pair[1])) else { return Vec::new() };
            finer.extend([middle, pair[1]]);
        }
        way = finer;
    }
    way[1..way.len() - 1].to_vec()
}

/// A curve with some spans joined: the first of each, and how many.
struct Joined<'a> {
    curve: Box<dyn Curve + 'a>,
    spans: Vec<[usize; 2]>,
    knots: Vec<f64>,
}

impl Curve for Joined<'_> {
    fn dimension(&self) -> usize {
        self.curve.dimension()
    }

    fn is_closed(&self) -> bool {
        self.curve.is_closed()
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        let [first, parts] = self.spans[span];
        if parts == 1 { self.curve.motion(first, piece) } else { None }
    }

    /// The point and the first derivative only.
    fn jet(&self, span: usize, u: f64) -> Jet {
        let [first, parts] = self.spans[span];
        let place = u * parts as f64;
        let part = (place.floor().max(0.0) as usize).min(parts - 1);
        let jet = self.curve.jet(first + part, place - part as f64);
        let pace = parts as f64 * self.curve.pace(first + part);
        Jet { point: jet.point, first: pace * jet.first, ..Jet::default() }
    }
}
