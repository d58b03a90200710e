//! [`Levels`]: how tight every span is, and how close to the data every point.

use std::ops::Range;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::Topology;
use super::tight::Tightened;
use crate::curve::{Curve, Jet, vector};
use crate::report::Fit;

/// The tightness of a span and the closeness of a point to the data.
struct Level {
    /// The factor of a span's handles.
    handles: f64,
    /// The fraction of its distance that a point returns to the data.
    back: f64,
    /// Displacements are averaged over this number of neighbours on both sides, which removes
    /// noise.
    neighbours: usize,
}

/// All levels, from the fit to the chord between data points.
///
/// The first levels double, so that nothing is tightened more than twice as much as its crossing
/// requires. Points follow means over fewer and fewer neighbours, so that steps in the data return
/// last. With means, two contour lines of pixels turn by 1.2 times as much as before, without means
/// by 4 times.
const LEVELS: [Level; 10] = [
    Level { handles: 1.0, back: 0.0, neighbours: 0 },
    Level { handles: 0.9375, back: 0.0625, neighbours: 16 },
    Level { handles: 0.875, back: 0.125, neighbours: 16 },
    Level { handles: 0.75, back: 0.25, neighbours: 16 },
    Level { handles: 0.625, back: 0.5, neighbours: 16 },
    Level { handles: 0.5, back: 1.0, neighbours: 16 },
    Level { handles: 0.375, back: 1.0, neighbours: 8 },
    Level { handles: 0.25, back: 1.0, neighbours: 4 },
    Level { handles: 0.125, back: 1.0, neighbours: 1 },
    Level { handles: 0.0, back: 1.0, neighbours: 0 },
];

/// The tightest level.
const TIGHTEST: u8 = (LEVELS.len() - 1) as u8;

/// The level of points falls by one over this number of points away from a span.
const FADING: f64 = 8.0;

/// Cubics that are steeper than this at an end overshoot (Fritsch and Carlson 1980).
const STEEPEST: f64 = 3.0;

/// How tight the spans and points of every stroke are.
pub(super) struct Levels<'a> {
    topology: &'a Topology,
    fit: &'a Fit,
    /// The strokes with a level above 0.
    strokes: FxHashMap<u32, Stroke>,
}

/// A stroke and its levels.
struct Stroke {
    closed: bool,
    /// The level of every span.
    spans: Vec<u8>,
    /// The level of every point, fractional in between.
    points: Vec<f64>,
    fitted: Vec<DVec3>,
    /// The displacement from every fitted point to the data.
    back: Vec<DVec3>,
    /// Its part across the curve.
    across: Vec<DVec3>,
    /// Its largest length.
    farthest: f64,
}

impl Stroke {
    fn new(curve: &dyn Curve, data: impl Iterator<Item = DVec3>) -> Self {
        let (spans, closed) = (curve.spans(), curve.is_closed());
        let last = (!closed).then(|| curve.jet(spans - 1, 1.0));
        let jets: Vec<Jet> = (0..spans).map(|k| curve.jet(k, 0.0)).chain(last).collect();
        let back: Vec<DVec3> = data.zip(&jets).map(|(data, jet)| data - jet.point).collect();
        let across = back.iter().zip(&jets).map(|(&back, jet)| {
            let along = jet.first / jet.first.abs().max_element();
            if along.is_finite() { back.reject_from(along) } else { back }
        });
        let (across, fitted) = (across.collect(), jets.iter().map(|jet| jet.point).collect::<Vec<_>>());
        let farthest = back.iter().map(|&back| length(back)).fold(0.0, f64::max);
        Stroke { closed, spans: vec![0; spans], points: vec![0.0; jets.len()], fitted, back, across, farthest }
    }

    /// The point `away` points after point `k`, if it exists.
    fn beside(&self, k: usize, away: isize) -> Option<usize> {
        let (n, at) = (self.points.len() as isize, k as isize + away);
        if self.closed { Some(at.rem_euclid(n) as usize) } else { (0..n).contains(&at).then_some(at as usize) }
    }

    /// The displacement of every point, such that none is farther from the data than the fit is at
    /// most.
    fn ways(&self) -> Vec<DVec3> {
        let way = |k: usize| {
            let level = self.points[k];
            let at = |level: f64| {
                let level = &LEVELS[level as usize];
                if level.back == 0.0 { DVec3::ZERO } else { self.mean(k, level.neighbours) * level.back }
            };
            let way = at(level.floor()).lerp(at(level.ceil()), level.fract());
            let left = self.back[k] - way;
            let distance = length(left);
            if distance > self.farthest { self.back[k] - left * (self.farthest / distance) } else { way }
        };
        (0..self.points.len()).map(way).collect()
    }

    /// The derivative of the displacements at point `k`, 0 at points that the fit did not move. Between
    /// points that lie very unevenly it is at most STEEPEST of the smaller of both slopes, so that no
    /// span overshoots.
    fn slope(&self, curve: &dyn Curve, ways: &[DVec3], k: usize) -> DVec3 {
        let neighbours = (self.beside(k, -1), self.beside(k, 1));
        match neighbours {
            (Some(before), Some(after)) if self.back[k] != DVec3::ZERO => {
                let (h, i) = (curve.pace(before), curve.pace(k));
                let [left, right] = [(ways[k] - ways[before]) / h, (ways[after] - ways[k]) / i];
                let most = STEEPEST * left.length().min(right.length());
                ((left * i + right * h) / (h + i)).clamp_length_max(most)
            }
            _ => DVec3::ZERO,
        }
    }

    /// The mean displacement around point `k`, with triangular weights.
    ///
    /// The mean ends at ends and at points that the fit did not move. Small rings are not averaged,
    /// since the mean would not restore their size.
    fn mean(&self, k: usize, neighbours: usize) -> DVec3 {
        let most = if self.closed { neighbours.min(self.points.len() / 16) } else { neighbours };
        if most == 0 || self.back[k] == DVec3::ZERO {
            return self.back[k];
        }
        let (mut sums, mut sum) = (self.across[k], self.across[k]);
        // A triangle is the sum of boxes.
        let mut count = 1;
        for away in 1..=most as isize {
            let (Some(before), Some(after)) = (self.beside(k, -away), self.beside(k, away)) else { break };
            sum += self.across[before] + self.across[after];
            sums += sum;
            count += 2 * away + 1;
            if self.back[before] == DVec3::ZERO || self.back[after] == DVec3::ZERO {
                break;
            }
        }
        sums / count as f64
    }
}

impl<'a> Levels<'a> {
    pub fn new(topology: &'a Topology, fit: &'a Fit) -> Self {
        Levels { topology, fit, strokes: FxHashMap::default() }
    }

    /// Tightens a span of a stroke with its points. Returns false at the tightest level.
    pub fn tighten(&mut self, stroke: u32, span: usize) -> bool {
        let Some(stroke) = self.of(stroke).filter(|stroke| stroke.spans[span] < TIGHTEST) else { return false };
        stroke.spans[span] += 1;
        let level = stroke.spans[span];
        // Points beyond follow, so that there is no step.
        for away in 0..stroke.points.len() as isize {
            let level = f64::from(level) - away as f64 / FADING;
            if level <= 0.0 {
                break;
            }
            for k in [stroke.beside(span, -away), stroke.beside(span, away + 1)].into_iter().flatten() {
                stroke.points[k] = stroke.points[k].max(level);
            }
        }
        true
    }

    /// Brings the points of some spans closer to the data, and then tightens the spans. Returns
    /// false at the tightest level.
    pub fn bring_back(&mut self, stroke: u32, range: Range<usize>) -> bool {
        let Some(Stroke { spans, points, .. }) = self.of(stroke) else { return false };
        let (count, mut changed) = (points.len(), false);
        for k in range.start..=range.end {
            let level = &mut points[k % count];
            changed |= *level < f64::from(TIGHTEST);
            *level = (*level + 2.0).min(f64::from(TIGHTEST));
        }
        if !changed {
            for level in spans[range].iter_mut().filter(|level| **level < TIGHTEST) {
                (*level, changed) = (*level + 1, true);
            }
        }
        changed
    }

    /// The levels of a stroke, unless it was not fitted.
    fn of(&mut self, stroke: u32) -> Option<&mut Stroke> {
        let (batch, s) = (self.topology.strokes(), stroke as usize);
        let curve = self.fit.curve(s);
        let data = || batch.points(s).chunks_exact(batch.dimension()).map(vector);
        curve.is_fitted().then(|| self.strokes.entry(stroke).or_insert_with(|| Stroke::new(&*curve, data())))
    }

    /// The fit of the strokes.
    pub fn fit(&self) -> &'a Fit {
        self.fit
    }

    /// Number of tightened spans.
    pub fn tightened(&self) -> usize {
        self.strokes.values().flat_map(|stroke| &stroke.spans).filter(|&&level| level > 0).count()
    }

    /// The tightened spans of a stroke.
    pub fn cubics(&self, stroke: u32) -> FxHashMap<u32, [DVec3; 4]> {
        let mut cubics = FxHashMap::default();
        let Some(of) = self.strokes.get(&stroke) else { return cubics };
        let curve = self.fit.curve(stroke as usize);
        let ways = of.ways();
        for span in 0..of.spans.len() {
            let ends = [span, (span + 1) % of.points.len()];
            let slopes = ends.map(|k| of.slope(&*curve, &ways, k));
            // A span with unmoved ends keeps its bits.
            if of.spans[span] == 0 && ends.iter().all(|&k| ways[k] == DVec3::ZERO) && slopes == [DVec3::ZERO; 2] {
                continue;
            }
            let [p, q] = ends.map(|k| of.fitted[k] + ways[k]);
            // Handles shrink with their chord.
            let chord = length(of.fitted[ends[1]] - of.fitted[ends[0]]);
            let nearer = if chord > 0.0 { (length(q - p) / chord).min(1.0) } else { 1.0 };
            let part = LEVELS[of.spans[span] as usize].handles * nearer * curve.pace(span) / 3.0;
            // At a corner each side has another direction.
            let [u, v] = match part > 0.0 {
                true => [0, 1].map(|end| (curve.jet(span, end as f64).first + slopes[end]) * part),
                false => [(q - p) / 3.0; 2],
            };
            cubics.insert(span as u32, [p, p + u, q - v, q]);
        }
        cubics
    }

    /// The strokes at their levels, with the largest distance of a point from the data.
    pub fn finish(self) -> Fit {
        let mut reports = self.fit.reports().to_vec();
        let mut cubics = FxHashMap::default();
        for (&number, stroke) in &self.strokes {
            cubics.insert(number, self.cubics(number));
            let distances = stroke.back.iter().zip(stroke.ways()).map(|(&back, way)| length(back - way));
            reports[number as usize].max_deviation = distances.fold(0.0, f64::max);
        }
        let (device, batch) = (self.fit.device().clone(), self.topology.strokes().clone());
        Fit::new(Tightened { fit: self.fit.clone(), cubics, batch }, reports, device)
    }
}

/// The length of a vector whose square may overflow.
fn length(vector: DVec3) -> f64 {
    let size = vector.abs().max_element();
    if size > 0.0 { size * (vector / size).length() } else { 0.0 }
}
