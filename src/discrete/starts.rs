//! Further starts: curves through the data points whose tangents differ from the spline's.

use glam::DVec3;
use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};

use super::fair::Fair;
use super::setup::{PreparedCurve, set_up_on, set_up_on_spline};
use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, vector};
use crate::motion::Motion;

/// The length of tangents of the rounded polygon, in chords.
const ROUNDED: f64 = 0.2;

/// The largest random change of a component of a unit tangent.
///
/// For 60 rough curves with bending and 0.1 of length, eleven such starts find 39 cheaper ones.
/// With 1 and tangents as long as chords they find none: descents return from there.
const SPREAD: f64 = 3.0;

/// The length of random tangents, in chords.
const LONG: f64 = 2.0;

/// Prepares a curve of a batch on one of its starts. Start 0 is the spline.
pub(super) fn set_up_at<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    kept: [bool; 2],
    start: u32,
) -> Result<PreparedCurve<D>, Unfitted> {
    if start > 0 {
        return set_up_on(fair, batch, i, kept, &Hermite::start::<D>(batch, i, start, fair.seed));
    }
    set_up_on_spline(fair, batch, i, kept)
}

/// Cubics through points with given tangents.
struct Hermite {
    dimension: usize,
    closed: bool,
    points: Vec<DVec3>,
    /// The unit tangent at each point.
    tangents: Vec<DVec3>,
    /// The length of the derivatives with respect to the fraction of a span, in chords.
    length: f64,
    knots: Vec<f64>,
}

impl Hermite {
    /// Start number `start` of curve `i`, from 1.
    ///
    /// Start 1 has the tangents of circles through neighbouring points. Start 2 has short ones and
    /// is the rounded polygon. The others have long random tangents. Given tangents stay.
    fn start<const D: usize>(batch: &CurveBatch, i: usize, start: u32, seed: u64) -> Self {
        let (closed, count) = (batch.is_closed(i), batch.count(i));
        let points: Vec<DVec3> = batch.points(i).chunks_exact(D).map(vector).collect();
        let mut tangents = circles(&points, closed);
        if start > 2 {
            let mut random = ChaCha12Rng::seed_from_u64(seed.wrapping_add(u64::from(start)));
            for tangent in &mut tangents {
                let moved: [f64; D] = std::array::from_fn(|_| random.random_range(-SPREAD..=SPREAD));
                *tangent = (*tangent + vector(&moved)).normalize_or(*tangent);
            }
        }
        for (k, tangent) in tangents.iter_mut().enumerate() {
            *tangent = batch.tangent(i, k).map_or(*tangent, |given| vector(given).normalize_or(*tangent));
        }
        let knots = (0..count + usize::from(closed)).map(|k| k as f64).collect();
        let length = [1.0, ROUNDED, LONG][(start as usize - 1).min(2)];
        Hermite { dimension: D, closed, points, tangents, length, knots }
    }

    /// p + u (a + u (b + u c))
    fn cubic(&self, span: usize) -> [DVec3; 4] {
        let next = (span + 1) % self.points.len();
        let (p, chord) = (self.points[span], self.points[next] - self.points[span]);
        let length = self.length * chord.length();
        let (a, z) = (length * self.tangents[span], length * self.tangents[next]);
        [p, a, 3.0 * chord - 2.0 * a - z, a + z - 2.0 * chord]
    }
}

impl Curve for Hermite {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn motion(&self, span: usize, _: usize) -> Option<Motion> {
        let [_, a, b, c] = self.cubic(span);
        Some(Motion::of_cubic(a, b, c))
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let [p, a, b, c] = self.cubic(span);
        Jet {
            point: p + u * (a + u * (b + u * c)),
            first: a + u * (2.0 * b + 3.0 * u * c),
            second: 2.0 * b + 6.0 * u * c,
            third: 6.0 * c,
        }
    }
}

/// The unit tangents of the circles through every point and its neighbours.
///
/// Inversion at a point maps its circle to a line. The tangent is therefore a/|a|² + b/|b|², with
/// the chords a and b before and after the point. At an end of an open curve it is the tangent of
/// the next point's circle.
fn circles(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    let count = points.len();
    // Chords between repeated points have no direction. The nearest chord with a direction is used.
    let chord = |k: usize, step: usize| {
        let mut to = (0..count).map(|away| points[(k + away * step) % count] - points[k]);
        to.find(|chord| *chord != DVec3::ZERO).unwrap_or(DVec3::X)
    };
    let inner = |k: usize| {
        let (a, b) = (-chord(k, count - 1), chord(k, 1));
        (a / a.length_squared() + b / b.length_squared()).normalize_or(b.normalize())
    };
    let mut tangents: Vec<DVec3> = (0..count).map(inner).collect();
    if !closed && count > 1 {
        for (end, beside) in [(0, 1), (count - 1, count - 2)] {
            let along = chord(end, if end == 0 { 1 } else { count - 1 }).normalize();
            let there = if count == 2 { chord(0, 1).normalize() } else { tangents[beside] };
            // A chord of a circle has the same angle to the tangents at both ends.
            tangents[end] = 2.0 * along.dot(there) * along - there;
        }
    }
    tangents
}
