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
use super::setup::{Ready, set_up_on, set_up_pieces};
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

/// How a curve is drawn anew that crosses itself where its points do not: whether with twice the edges, from which
/// start, and what is said of it.
///
/// Within an edge no curve can turn, however taut it is. From circles or from the polygon a curve may turn to the other
/// side at a sharp point.
const REMEDIES: [(bool, u32, &str); 4] = [
    (true, 0, "has twice the edges"),
    (false, 1, "turns another way"),
    (false, 2, "turns another way"),
    (true, 2, "turns another way, with twice the edges"),
];

/// A minimum is lower than another if it is so by this part.
///
/// The same one has an energy that differs by some 1e-6, since the gauge is that of the start.
const LOWER: f64 = 1e-4;

/// Curves that have been descended, with their problems.
pub(super) struct Descended<const D: usize> {
    pub ready: Vec<Result<Ready<D>, Unfitted>>,
    /// Where the curves ended that are ready, in their order.
    pub outcomes: Vec<Outcome<D>>,
    /// The spans of each that were drawn tauter, and what crosses yet.
    pub untangled: Untangled,
    /// What each does otherwise because it crossed itself, in words; mostly none.
    pub remedies: Vec<&'static str>,
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
        let remedies = vec![""; outcomes.len()];
        Ok(Descended { ready, outcomes, untangled, remedies, gains: Vec::new(), device: did })
    }

    /// Draws curves anew that cross where their points do not, in the ways of [`REMEDIES`], until they do not.
    ///
    /// `curves` are the numbers of those that are ready.
    fn redraw(
        &mut self,
        fair: &Fair,
        batch: &CurveBatch,
        kept: &[[bool; 2]],
        curves: &[usize],
        device: &Device,
    ) -> Result<()> {
        let own = |k: usize| self.ready[curves[k]].as_ref().expect("what crosses was ready");
        let mut left: Vec<usize> =
            self.untangled.left.iter().copied().filter(|&k| !own(k).tangled(&self.outcomes[k]).is_empty()).collect();
        for (finer, start, remedy) in REMEDIES {
            let segments = match fair.segments {
                Segments::PerSpan(n) if finer => Segments::PerSpan(2 * n),
                Segments::Spacing(spacing) if finer => Segments::Spacing(0.5 * spacing),
                asked => asked,
            };
            let fair = Fair { segments, ..fair.clone() };
            let ready: Vec<_> = left.iter().map(|&k| set_up_at(&fair, batch, curves[k], kept, start)).collect();
            let (able, unable): (Vec<_>, Vec<_>) = left.into_iter().zip(ready).partition(|(_, ready)| ready.is_ok());
            left = unable.into_iter().map(|(k, _)| k).collect();
            let (able, ready): (Vec<usize>, Vec<_>) = able.into_iter().unzip();
            if able.is_empty() {
                continue;
            }
            let found = Self::new(&fair, ready, device, &|_| {})?;
            let found = found.ready.into_iter().flatten().zip(found.outcomes).zip(found.untangled.tauter);
            for (k, ((ready, mut outcome), tauter)) in able.into_iter().zip(found) {
                outcome.iterations += self.outcomes[k].iterations;
                if outcome.standing == Standing::Converged && ready.tangled(&outcome).is_empty() {
                    self.ready[curves[k]] = Ok(ready);
                    (self.outcomes[k], self.untangled.tauter[k], self.remedies[k]) = (outcome, tauter, remedy);
                } else {
                    self.outcomes[k].iterations = outcome.iterations;
                    left.push(k);
                }
            }
        }
        Ok(())
    }

    /// What is worth a sentence about curve k of those that are ready, with the span that it is about.
    pub fn message(&self, k: usize) -> Option<(usize, String)> {
        let (tauter, remedy) = (&self.untangled.tauter[k], self.remedies[k]);
        match (tauter.first(), remedy) {
            (None, "") => None,
            (None, remedy) => Some((0, format!("it crossed itself where its points do not: now it {remedy}"))),
            (Some(&first), "") => Some((first, message(tauter))),
            (Some(&first), remedy) => Some((first, format!("{}, and {remedy}", message(tauter)))),
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
        best.redraw(fair, batch, kept, &curves, device)?;
        if fair.starts > 1 {
            best.gains = vec![0.0; curves.len()];
        }
        for start in 1..fair.starts {
            let ready = parallel::map(curves.len(), 16, |k| set_up_at::<D>(fair, batch, curves[k], kept, start));
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
                (self.outcomes[k], self.untangled.tauter[k], self.remedies[k]) = (outcome, tauter, "");
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

/// Brings a curve of a batch to vertices on one of its starts: 0 is the spline.
fn set_up_at<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    kept: &[[bool; 2]],
    start: u32,
) -> Result<Ready<D>, Unfitted> {
    let kept = kept.get(i).copied().unwrap_or_default();
    if start > 0 {
        return set_up_on(fair, batch, i, kept, &Hermite::start::<D>(batch, i, start, fair.seed));
    }
    let spline = set_up_pieces(fair, &batch.select(&[i]), &[kept]).map(|mut ready| ready.remove(0));
    spline.expect("the batch had splines before")
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
