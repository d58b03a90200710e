//! [`corners`]: the vertices at which a polygon has a corner at the scale of D.
//!
//! Around a corner two straight legs explain the polygon better than one parabola does:
//!
//! ```text
//! p(s) ≈ a + b s + c |s|     against     p(s) ≈ a + b s + c s²,     |s| ≤ L
//! ```
//!
//! A parabola explains the bend of a circle better, whatever its radius. Noise explains neither. All
//! lengths are in units of D here. Of 10,890 corners of `benches/corners.py`, in shapes, glyphs, noise
//! and staircases, 161 are missed, and 110 are invented. Most of both are in glyphs of 30 and 60 D.

use std::array::from_fn;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::LazyLock;

use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::sort;
use crate::spline::band::runs::ends_of_runs;

/// The lengths L of a leg, and the least gains: by how much the root mean square distance from two legs
/// is less than from a parabola. Noise of D/2 gains up to 0.14, 0.18 and 0.24. With a leg of 10 crests
/// of waves with the radius 6 would be corners.
const LEGS: [f64; 3] = [3.0, 5.0, 8.0];
const GAINS: [f64; 3] = [0.17, 0.19, 0.20];

/// The least quotient of both distances. 1 invents half as many corners more on staircases, and 1.25
/// misses twice as many.
const RATIO: f64 = 1.12;

/// The least turn of a corner, between a regular polygon of 10 edges and one of 11. With 28° twice as
/// many corners of round curves are invented.
const TURN: f64 = 35.0 / 360.0 * TAU;

/// The distance of a surveyed line from its chord. With 0.01 two of Utah's corners are lost at 10 km.
const SURVEYED: f64 = 0.1;

/// Samples of a leg. With 8 staircases of round curves have twice as many corners.
const SAMPLES: usize = 12;

/// The distance of candidates.
const STEP: f64 = 0.25;

/// Corners are this part of a leg apart.
const APART: f64 = 0.6;

/// Arc lengths are measured on a moving average of the polygon with this half-width. Noise makes the
/// polygon longer than its average. If it is LONGER times as long, the half-width grows by the quotient,
/// at most ROUNDS times.
const AVERAGED: f64 = 1.5;
const ROUNDS: usize = 3;
const LONGER: f64 = 2.5;

/// Where the polygon has little noise less gain is enough, down to this part. The noise is the distance
/// from two parabolic legs, at most NOISIEST, and its mean within NEAR is compared with NOISY. Edges of
/// these lengths are too sparse to tell noise.
const LEAST: f64 = 0.45;
const NOISIEST: f64 = 0.06;
const NOISY: f64 = 0.04;
const NEAR: f64 = 10.0;
const SPARSE: Range<f64> = 1.2..3.5;

/// A candidate is round if the parabola of its first legs is nearer by this much: without noise, and
/// with noise.
const ROUND: [f64; 2] = [0.03, 0.1];

/// The samples of both legs.
const ALL: usize = 2 * SAMPLES + 1;

/// Functions of u = s/L at the samples, orthonormal: 1, u, |u|, u², u² beside |u|, and u|u|.
static BASIS: LazyLock<[[f64; ALL]; 6]> = LazyLock::new(|| {
    let at = |f: fn(f64) -> f64| from_fn(|j| f((j as f64 - SAMPLES as f64) / SAMPLES as f64));
    let [one, linear, bent, square, odd] =
        [|_| 1.0, |u: f64| u, f64::abs, |u: f64| u * u, |u: f64| u * u.abs()].map(at);
    let one = apart(one, &[]);
    let (linear, bent) = (apart(linear, &[one]), apart(bent, &[one]));
    [one, linear, bent, apart(square, &[one]), apart(square, &[one, bent]), apart(odd, &[linear])]
});

/// A unit vector: the part of one that is orthogonal to others.
fn apart(mut own: [f64; ALL], others: &[[f64; ALL]]) -> [f64; ALL] {
    for other in others {
        own = subtract(own, scale(dot(own, *other), *other));
    }
    scale(1.0 / dot(own, own).sqrt(), own)
}

/// How two legs and a parabola explain a polygon around one of its points.
struct Explained {
    /// The root of the difference of mean squares, negative if the parabola is nearer.
    gain: f64,
    ratio: f64,
    turn: f64,
    /// The root mean square distance from two parabolic legs.
    noise: f64,
}

/// A polygon, by an arc length that noise does not lengthen.
struct Polygon<'a, const D: usize> {
    /// A closed one has its first point again at the end.
    points: &'a [Vector<f64, D>],
    s: Vec<f64>,
    closed: bool,
}

/// The corners among the vertices of a polygon, in increasing order. A closed polygon has its first
/// point again at the end.
pub(super) fn corners<const D: usize>(points: &[Vector<f64, D>], closed: bool) -> Vec<usize> {
    let polygon = Polygon::new(points, closed);
    let candidates = polygon.candidates();
    let mut round = vec![false; candidates.len()];
    let (mut found, mut noises): (Vec<usize>, Vec<f64>) = (vec![], vec![]);
    for (stage, (leg, least)) in LEGS.into_iter().zip(GAINS).enumerate() {
        if polygon.length() < polygon.least(leg) {
            break;
        }
        let own: Vec<Explained> = candidates.iter().map(|&k| polygon.explained(polygon.s[k], leg)).collect();
        if stage == 0 {
            noises = polygon.noises(&candidates, &own);
        }
        let is_corner = |k: &usize| {
            let Explained { gain, ratio, turn, .. } = own[*k];
            gain > least * noises[*k] && ratio > RATIO && turn > TURN && !round[*k]
        };
        let corners: Vec<usize> = (0..candidates.len()).filter(is_corner).collect();
        let order = sort::order(corners.len(), &|a, b| own[corners[b]].gain.total_cmp(&own[corners[a]].gain));
        let mut taken = vec![false; candidates.len()];
        for &corner in &found {
            polygon.take(&candidates, corner, APART * leg, &mut taken);
        }
        for k in order.into_iter().map(|at| corners[at]) {
            if !taken[k] {
                let corner = polygon.best_near(candidates[k], leg);
                polygon.take(&candidates, corner, APART * leg, &mut taken);
                found.push(corner);
            }
        }
        for (k, round) in round.iter_mut().enumerate() {
            let noise = (noises[k] - LEAST) / (1.0 - LEAST);
            let most = if stage == 0 { ROUND[0] + (ROUND[1] - ROUND[0]) * noise } else { 0.0 };
            *round |= own[k].gain <= -most;
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// The vertices at which a polygon turns by more than an angle.
pub(super) fn sharper<const D: usize>(points: &[Vector<f64, D>], closed: bool, angle: f64) -> Vec<usize> {
    let last = points.len() - 1;
    let turn = |k: &usize| {
        let before = if *k == 0 { last - 1 } else { k - 1 };
        angle_between(subtract(points[*k], points[before]), subtract(points[k + 1], points[*k]))
    };
    (usize::from(!closed)..last).filter(|k| turn(k) > angle).collect()
}

/// The vertices at which a polygon turns between straight runs as long as the longest leg. `t` are its
/// arc lengths.
pub(super) fn between_runs<const D: usize>(points: &[Vector<f64, D>], t: &[f64], closed: bool) -> Vec<usize> {
    let mut ends = ends_of_runs(points, SURVEYED);
    if closed {
        // The last run ends where the first begins.
        ends.push(ends[1] + points.len() - 1);
    }
    let last = points.len() - 1;
    let at = |k: usize| t[k % last] + if k >= last { t[last] } else { 0.0 };
    let is_long = |from: usize, to: usize| at(to) - at(from) >= LEGS[LEGS.len() - 1];
    let sharp = sharper(points, closed, TURN);
    let between = ends.windows(3).filter(|ends| is_long(ends[0], ends[1]) && is_long(ends[1], ends[2]));
    between.map(|ends| ends[1] % last).filter(|k| sharp.binary_search(k).is_ok()).collect()
}

fn angle_between<const D: usize>(a: Vector<f64, D>, b: Vector<f64, D>) -> f64 {
    libm::acos((dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()).clamp(-1.0, 1.0))
}

impl<'a, const D: usize> Polygon<'a, D> {
    fn new(points: &'a [Vector<f64, D>], closed: bool) -> Self {
        let raw = lengths(points.iter().copied());
        let total = raw[raw.len() - 1];
        // The integral of the polygon up to each vertex.
        let mut sums = vec![[0.0; D]];
        for k in 1..points.len() {
            let middle = scale(0.5 * (raw[k] - raw[k - 1]), add(points[k - 1], points[k]));
            sums.push(add(sums[k - 1], middle));
        }
        let integral = |x: f64| {
            let turns = if closed { (x / total).floor() } else { 0.0 };
            let own = x - turns * total;
            let k = raw.partition_point(|&s| s <= own).clamp(1, points.len() - 1) - 1;
            let (on, length) = (own - raw[k], raw[k + 1] - raw[k]);
            let part = if length > 0.0 { (on / length).clamp(0.0, 1.0) } else { 0.0 };
            let mean = add(points[k], scale(0.5 * part, subtract(points[k + 1], points[k])));
            add(scale(turns, sums[sums.len() - 1]), add(sums[k], scale(on, mean)))
        };
        let mut width = AVERAGED;
        let mut s = raw.clone();
        for _ in 0..ROUNDS {
            let averaged = |&at: &f64| {
                let room = if closed { f64::INFINITY } else { at.min(total - at) };
                let half = width.min(total / 6.0).min(room).max(1e-9 * total);
                let (from, to) =
                    if closed { (at - half, at + half) } else { ((at - half).max(0.0), (at + half).min(total)) };
                scale(1.0 / (to - from), subtract(integral(to), integral(from)))
            };
            s = lengths(raw.iter().map(averaged));
            let own = s[s.len() - 1];
            if total < LONGER * own || own == 0.0 {
                break;
            }
            width = AVERAGED * total / own;
        }
        Polygon { points, s, closed }
    }

    fn length(&self) -> f64 {
        self.s[self.s.len() - 1]
    }

    /// The least length of a polygon with corners of this leg.
    fn least(&self, leg: f64) -> f64 {
        if self.closed { 2.2 * leg } else { 2.0 * leg }
    }

    /// The vertices that may be corners: one per step, and no ends.
    fn candidates(&self) -> Vec<usize> {
        let inner = usize::from(!self.closed)..self.points.len() - 1;
        let bin = |k: usize| (self.s[k] / STEP).floor();
        inner.clone().filter(|&k| k == inner.start || bin(k) != bin(k - 1)).collect()
    }

    /// The point at an arc length from the vertex `k`, or before it. An open polygon goes on beyond its
    /// ends, reflected there.
    fn point(&self, x: f64, k: &mut usize) -> Vector<f64, D> {
        let (length, last) = (self.length(), self.points.len() - 1);
        let inside = match self.closed {
            true => x.rem_euclid(length),
            false if x < 0.0 => -x,
            false if x > length => 2.0 * length - x,
            false => x,
        };
        if self.s[*k] > inside {
            *k = self.s.partition_point(|&s| s <= inside).saturating_sub(1);
        }
        while *k + 2 <= last && self.s[*k + 1] <= inside {
            *k += 1;
        }
        let (from, to) = (self.s[*k], self.s[*k + 1]);
        let part = if to > from { ((inside - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        let point = add(self.points[*k], scale(part, subtract(self.points[*k + 1], self.points[*k])));
        match self.closed {
            false if x < 0.0 => subtract(scale(2.0, self.points[0]), point),
            false if x > length => subtract(scale(2.0, self.points[last]), point),
            _ => point,
        }
    }

    fn explained(&self, s: f64, leg: f64) -> Explained {
        let start = s - leg;
        let mut k = self.s.partition_point(|&s| s <= start).saturating_sub(1).min(self.points.len() - 2);
        let samples: [Vector<f64, D>; ALL] =
            from_fn(|j| self.point(s + leg * (j as f64 - SAMPLES as f64) / SAMPLES as f64, &mut k));
        let middle = samples[SAMPLES];
        let mut parts = [[0.0; D]; 6];
        let mut total = 0.0;
        for (j, sample) in samples.into_iter().enumerate() {
            let own = subtract(sample, middle);
            total += dot(own, own);
            for (part, basis) in parts.iter_mut().zip(BASIS.iter()) {
                *part = add(*part, scale(basis[j], own));
            }
        }
        let [one, linear, bent, square, more, odd] = parts.map(|part| dot(part, part));
        let left = total - one - linear;
        let n = ALL as f64;
        let [legs, parabola] = [left - bent, left - square].map(|x| x.max(0.0) / n);
        // b L and c L of the two legs: u and |u| grow by 1 from the middle to the end.
        let [b, c] = [1, 2].map(|k| scale(BASIS[k][ALL - 1] - BASIS[k][SAMPLES], parts[k]));
        Explained {
            gain: ((bent - square).abs() / n).sqrt().copysign(bent - square),
            ratio: (parabola / (legs + 1e-4)).sqrt(),
            turn: angle_between(subtract(b, c), add(b, c)),
            noise: ((left - bent - more - odd).max(0.0) / n).sqrt(),
        }
    }

    /// The noise around every candidate, as a factor of the least gains.
    fn noises(&self, candidates: &[usize], explained: &[Explained]) -> Vec<f64> {
        let last = self.points.len() - 1;
        let is_sparse = |k: usize| {
            let edge = subtract(self.points[k + 1], self.points[k]);
            SPARSE.contains(&dot(edge, edge).sqrt())
        };
        let own = |(&k, explained): (&usize, &Explained)| {
            let before = if k == 0 { last - 1 } else { k - 1 };
            if is_sparse(k) || is_sparse(before) { NOISIEST } else { explained.noise.min(NOISIEST) }
        };
        let mut sums = vec![0.0];
        for noise in candidates.iter().zip(explained).map(own) {
            sums.push(sums[sums.len() - 1] + noise);
        }
        let n = candidates.len();
        // The sum over candidates before an arc length, which may be beyond the ends of a closed polygon.
        let before = |x: f64| {
            let turns = if self.closed { (x / self.length()).floor() } else { 0.0 };
            let k = candidates.partition_point(|&k| self.s[k] <= x - turns * self.length());
            (turns * sums[n] + sums[k], turns * n as f64 + k as f64)
        };
        let near = if self.closed { NEAR.min(0.5 * self.length()) } else { NEAR };
        let mean = |&k: &usize| {
            let [(from, first), (to, last)] = [before(self.s[k] - near), before(self.s[k] + near)];
            ((to - from) / (last - first).max(1.0) / NOISY).clamp(LEAST, 1.0)
        };
        candidates.iter().map(mean).collect()
    }

    /// Takes the candidates near a corner.
    fn take(&self, candidates: &[usize], corner: usize, near: f64, taken: &mut [bool]) {
        let turns = if self.closed { -1..=1 } else { 0..=0 };
        for at in turns.map(|turn| self.s[corner] + f64::from(turn) * self.length()) {
            let from = candidates.partition_point(|&k| self.s[k] <= at - near);
            let to = candidates.partition_point(|&k| self.s[k] < at + near);
            taken[from..to.max(from)].fill(true);
        }
    }

    /// The vertex near a candidate with the largest gain.
    fn best_near(&self, candidate: usize, leg: f64) -> usize {
        let inner = usize::from(!self.closed)..self.points.len() - 1;
        let at = self.s[candidate];
        let from = self.s.partition_point(|&s| s < at - STEP).max(inner.start);
        let to = self.s.partition_point(|&s| s <= at + STEP).min(inner.end);
        let gain = |k: &usize| self.explained(self.s[*k], leg).gain;
        (from..to).max_by(|a, b| gain(a).total_cmp(&gain(b))).unwrap_or(candidate)
    }
}

/// The arc length of a polyline at each of its points.
fn lengths<const D: usize>(points: impl Iterator<Item = Vector<f64, D>>) -> Vec<f64> {
    let (mut lengths, mut last) = (Vec::new(), None);
    for point in points {
        let edge = last.map_or([0.0; D], |last| subtract(point, last));
        lengths.push(lengths.last().copied().unwrap_or(0.0) + dot(edge, edge).sqrt());
        last = Some(point);
    }
    lengths
}
