//! Further starts: curves through the points whose tangents are not those of the spline.
//!
//! A descent ends at the minimum below its start. From other starts it may find other minima, of which
//! the cheapest is kept.

use glam::DVec3;
use rand::rngs::ChaCha12Rng;
use rand::{RngExt, SeedableRng};

use super::fair::{Fair, Segments};
use super::lane::Standing;
use super::problem::Outcome;
use super::setup::{Ready, set_up_at, set_up_pieces};
use super::untangle::{Untangled, message, untangle};
use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, vector};
use crate::device::{Device, DeviceReport};
use crate::error::{Result, thousands};
use crate::motion::Motion;
use crate::parallel;
use crate::report::CurveReport;

/// Starts at most. What a thousand do not find, more will not.
pub(super) const MOST: u32 = 1_000;

/// Tangents of the polygon rounded, in chords.
const ROUNDED: f64 = 0.2;

/// The largest number by which a component of a unit tangent is moved at random.
///
/// Of 60 rough curves in bending and 0.1 of length eleven such starts find 39 cheaper ones, and none with 1 and tangents
/// as long as chords: descents come back from there.
const SPREAD: f64 = 3.0;

/// Tangents at random, in chords.
const LONG: f64 = 2.0;

/// A minimum is lower than another if it is so by this part. The tolerance of descents leaves less.
const LOWER: f64 = 1e-6;

/// Curves that have been descended, with their problems.
pub(super) struct Descended<const D: usize> {
    pub ready: Vec<Result<Ready<D>, Unfitted>>,
    /// Where the curves ended that are ready, in their order.
    pub outcomes: Vec<Outcome<D>>,
    /// The spans of each that were drawn tauter, and what crosses yet.
    pub untangled: Untangled,
    /// Whether each has twice the edges, because it crossed itself with those asked for.
    pub finer: Vec<bool>,
    /// The part of the energy that further starts have saved, for each; empty without further starts.
    pub gains: Vec<f64>,
    pub device: DeviceReport,
}

impl<const D: usize> Descended<D> {
    /// Descends curves, and [untangles](untangle) them.
    fn new(
        fair: &Fair,
        mut ready: Vec<Result<Ready<D>, Unfitted>>,
        device: &Device,
        ended: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        let (mut outcomes, did) = fair.descend(&mut ready, device, &|k, _| ended(k))?;
        let untangled = untangle(fair, &mut ready, &mut outcomes, device)?;
        let finer = vec![false; outcomes.len()];
        Ok(Descended { ready, outcomes, untangled, finer, gains: Vec::new(), device: did })
    }

    /// Gives curves twice the edges that cross where their points do not, and do not then.
    ///
    /// Within an edge a curve cannot turn, however taut it is. `curves` are the numbers of those that are ready.
    fn refine(
        &mut self,
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        curves: &[usize],
        device: &Device,
    ) -> Result<()> {
        let own = |k: usize| self.ready[curves[k]].as_ref().expect("what crosses was ready");
        let left: Vec<usize> =
            self.untangled.left.iter().copied().filter(|&k| !own(k).tangled(&self.outcomes[k]).is_empty()).collect();
        if left.is_empty() {
            return Ok(());
        }
        let segments = match fair.segments {
            Segments::PerSpan(n) => Segments::PerSpan(2 * n),
            Segments::Spacing(spacing) => Segments::Spacing(0.5 * spacing),
        };
        let fair = Fair { segments, ..fair.clone() };
        let numbers: Vec<usize> = left.iter().map(|&k| curves[k]).collect();
        let kept: Vec<[bool; 2]> = numbers.iter().filter_map(|&i| kept.get(i)).copied().collect();
        let ready = set_up_pieces::<D>(&fair, &batch.select(&numbers), &kept)?;
        let able: Vec<usize> =
            left.into_iter().zip(&ready).filter(|(_, ready)| ready.is_ok()).map(|(k, _)| k).collect();
        let finer = Self::new(&fair, ready, device, &|_| {})?;
        let found = finer.ready.into_iter().flatten().zip(finer.outcomes).zip(finer.untangled.tauter);
        for (k, ((ready, mut outcome), tauter)) in able.into_iter().zip(found) {
            outcome.iterations += self.outcomes[k].iterations;
            if outcome.standing == Standing::Converged && ready.tangled(&outcome).is_empty() {
                self.ready[curves[k]] = Ok(ready);
                (self.outcomes[k], self.untangled.tauter[k], self.finer[k]) = (outcome, tauter, true);
            } else {
                self.outcomes[k].iterations = outcome.iterations;
            }
        }
        Ok(())
    }

    /// What is worth a sentence about curve k of those that are ready, with the span that it is about.
    pub fn message(&self, k: usize) -> Option<(usize, String)> {
        let tauter = &self.untangled.tauter[k];
        match (tauter.first(), self.finer[k]) {
            (None, false) => None,
            (None, true) => Some((0, "it crossed itself where its points do not: it has twice the edges".into())),
            (Some(&first), finer) => {
                let edges = if finer { ", and has twice the edges" } else { "" };
                Some((first, message(tauter) + edges))
            }
        }
    }

    /// Descends curves from the spline and from `fair.starts` − 1 other starts.
    ///
    /// `ended` is called for every curve that is ready, by its number among those.
    pub fn best(
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        ready: Vec<Result<Ready<D>, Unfitted>>,
        device: &Device,
        ended: &(dyn Fn(usize) + Sync),
    ) -> Result<Self> {
        let curves: Vec<usize> = (0..ready.len()).filter(|&i| ready[i].is_ok()).collect();
        let at_last = |start: u32, k: usize| {
            if start + 1 == fair.starts {
                ended(k);
            }
        };
        let mut best = Self::new(fair, ready, device, &|k| at_last(0, k))?;
        best.refine(fair, batch, kept, &curves, device)?;
        if fair.starts > 1 {
            best.gains = vec![0.0; curves.len()];
        }
        for start in 1..fair.starts {
            let ready = parallel::map(curves.len(), 16, |k| {
                let i = curves[k];
                set_up_at::<D>(fair, batch, i, kept, &Hermite::start::<D>(batch, i, start, fair.seed))
            });
            let able: Vec<usize> = (0..curves.len()).filter(|&k| ready[k].is_ok()).collect();
            let unable = (0..curves.len()).filter(|k| able.binary_search(k).is_err());
            unable.for_each(|k| at_last(start, k));
            best.take_cheaper(&curves, &able, Self::new(fair, ready, device, &|k| at_last(start, able[k]))?);
        }
        Ok(best)
    }

    /// Replaces what another descent has found cheaper.
    ///
    /// Its curves are these of the numbers `curves`, of which it was able to descend `able`.
    fn take_cheaper(&mut self, curves: &[usize], able: &[usize], other: Self) {
        let others = other.outcomes.into_iter().zip(other.untangled.tauter);
        for ((&k, ready), (outcome, tauter)) in able.iter().zip(other.ready.into_iter().flatten()).zip(others) {
            let own = self.ready[curves[k]].as_mut().expect("only what was ready has other starts");
            let iterations = self.outcomes[k].iterations + outcome.iterations;
            let [before, after] = [self.outcomes[k].energy * own.energy_unit, outcome.energy * ready.energy_unit];
            let converged = [&self.outcomes[k], &outcome].map(|outcome| outcome.standing == Standing::Converged);
            let is_cheaper = match converged {
                [true, true] => {
                    after < (1.0 - LOWER) * before
                        && (D > 2 || ready.tangled(&outcome).len() <= own.tangled(&self.outcomes[k]).len())
                }
                [first, second] => second && !first,
            };
            if is_cheaper {
                self.gains[k] = if converged[0] { 1.0 - after / before * (1.0 - self.gains[k]) } else { 0.0 };
                *own = ready;
                (self.outcomes[k], self.untangled.tauter[k], self.finer[k]) = (outcome, tauter, false);
            }
            self.outcomes[k].iterations = iterations;
        }
    }
}

impl Fair {
    /// Sentences about usable curves, for people who fit many: how many curves were found cheaper from further
    /// starts, and by how much. The reports are those of a fit with these options.
    pub fn notes(&self, reports: &[CurveReport]) -> Vec<String> {
        let tried = reports.iter().filter(|report| report.gain.is_some()).count();
        let gains = reports.iter().filter(|report| report.status.is_usable()).filter_map(|report| report.gain);
        let mut gains: Vec<f64> = gains.filter(|gain| *gain > 0.0).collect();
        gains.sort_by(f64::total_cmp);
        if tried == 0 {
            return Vec::new();
        }
        let found = match gains.last() {
            None => format!("none of {} curves found a cheaper minimum", thousands(tried)),
            Some(most) => format!(
                "{} of {} curves found a cheaper minimum, by {:.2} % at the median and {:.2} % at most",
                thousands(gains.len()),
                thousands(tried),
                100.0 * gains[gains.len() / 2],
                100.0 * most
            ),
        };
        vec![format!("{} starts: {found}", self.starts)]
    }
}

/// Cubics through points with given tangents.
struct Hermite {
    dimension: usize,
    closed: bool,
    points: Vec<DVec3>,
    /// A unit vector a point.
    tangents: Vec<DVec3>,
    /// The length of tangents by the fraction of a span, in chords.
    length: f64,
    knots: Vec<f64>,
}

impl Hermite {
    /// The start of curve `i` with this number, from 1.
    ///
    /// 1 has the tangents of circles through neighbouring points, 2 short ones, which is the polygon rounded, and the
    /// others have long tangents at random. Given tangents stay.
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

/// Unit tangents of the circles through every point and its neighbours.
///
/// Inversion about a point makes a line of its circle: the tangent is a/|a|² + b/|b|² for the chords a
/// and b before and after it. At the ends of open curves it is that of the next point's circle.
fn circles(points: &[DVec3], closed: bool) -> Vec<DVec3> {
    let count = points.len();
    // Chords between repeated points have no direction. A point takes the nearest that has one.
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
            // A circle's chord has the same angle to the tangents at both its ends.
            tangents[end] = 2.0 * along.dot(there) * along - there;
        }
    }
    tangents
}
