//! The directions at the data points of the shortest path of bounded curvature.
//!
//! They are the only unknowns: between two points with given directions the path is a [`Dubins`]
//! path. Its length has many minima, and jumps by a circle where a path has only two pieces.
//! Dynamic programming therefore finds the best combination of directions:
//!
//! 1. from directions all around, and those of chords and of circles through neighbouring points;
//! 2. from these, and those at which paths of two pieces arrive from the best ones so far and from
//!    their neighbours';
//! 3. from the best ones, turned by a step or not, and those at jumps next to them, while steps are
//!    halved down to rounding.
//!
//! Source: M. Frego, P. Bevilacqua, E. Saccon, L. Palopoli and D. Fontanelli, *An iterative dynamic
//! programming approach to the multipoint Markov–Dubins problem*, IEEE Robotics and Automation
//! Letters 5 (2020). Directions at jumps are faircurve's.

use std::f64::consts::{PI, TAU};

use super::dubins::{Dubins, Heading, jumps};
use crate::linalg::scalar::{Vector, dot, subtract};

/// The number of directions all around.
const FIRST: usize = 24;

/// The last step. Lengths are quadratic in the remaining error, and so accurate to rounding.
const LAST: f64 = 1e-9;

/// The tolerance with which paths end at their points, at size 1. Turns are accurate to 1e-12,
/// which suffices for radii up to about 10⁵.
const REACH: f64 = 1e-6;

/// Directions closer than this fraction of a step count as equal.
const ONE: f64 = 1e-3;

/// The most consecutive jumps that are followed.
const DEEP: usize = 3;

/// With fewer directions at one end, combinations are tried without bounds.
const FEW: usize = 12;

/// The relative reduction of lower bounds, for their rounding.
const ROUNDING: f64 = 1e-9;

/// The most rounds per step.
const MOST: u32 = 8;

/// The connection from one point to the next.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    pub chord: Vector<f64, 2>,
    /// The smallest radius; 0 without a bound.
    pub radius: f64,
}

impl Leg {
    /// The directions of the chord, and at both ends of the circles through its ends.
    fn directions(&self) -> impl Iterator<Item = f64> + use<> {
        let [x, y] = self.chord;
        let angle = y.atan2(x);
        // NaN if there is no such circle.
        let half = (x.hypot(y) / (2.0 * self.radius)).asin();
        [0.0, half, -half, PI - half, half - PI].into_iter().map(move |turn| angle + turn).filter(|x| x.is_finite())
    }
}

/// The state of a search along legs, for points with optional given directions.
struct Search<'a> {
    legs: &'a [Leg],
    given: &'a [Option<f64>],
    best: Vec<Heading>,
    length: f64,
    rounds: u32,
}

/// The shortest path along legs, leg by leg, and the number of rounds of dynamic programming.
///
/// `given` holds the given direction of each point. There is one leg fewer than points, or as many
/// for a closed path. `None` if rounding keeps the paths from reaching their points, because radii
/// are too large.
pub fn shortest(legs: &[Leg], given: &[Option<f64>]) -> Option<(Vec<Dubins>, u32)> {
    let mut search = Search { legs, given, best: vec![], length: f64::INFINITY, rounds: 0 };
    let around: Vec<Vec<f64>> = (0..given.len()).map(|k| search.around(k)).collect();
    if !search.take_best_of(&around) {
        return None;
    }
    // If all points are at least four radii apart, lengths do not jump, and the first directions
    // lead to the best path.
    let is_close = legs.iter().any(|leg| dot(leg.chord, leg.chord) < (4.0 * leg.radius).powi(2));
    while is_close && search.rounds < MOST && search.take_best_of(&search.over_jumps(&around)) {}
    let deep = if is_close { DEEP } else { 0 };
    let (mut step, mut since) = (0.5 * TAU / FIRST as f64, 0);
    while step > LAST {
        since += 1;
        if !search.take_best_of(&search.nearby(step, deep)) || since >= MOST {
            (step, since) = (0.5 * step, 0);
        }
    }
    let heading = |k: usize| search.best[k % given.len()];
    let path = |(k, leg): (usize, &Leg)| Dubins::between(leg.chord, [heading(k), heading(k + 1)], leg.radius);
    let paths: Vec<Dubins> = legs.iter().enumerate().map(path).collect();
    let ends = |(path, leg): (&Dubins, &Leg)| {
        let away = subtract(path.place(path.length()).at, leg.chord);
        dot(away, away).sqrt() <= REACH
    };
    paths.iter().zip(legs).all(ends).then_some((paths, search.rounds))
}

impl Search<'_> {
    fn around(&self, k: usize) -> Vec<f64> {
        let (count, closed) = (self.legs.len(), self.legs.len() == self.given.len());
        let before = (k > 0 || closed).then(|| (k + count - 1) % count);
        let beside = before.into_iter().chain((k < count).then_some(k)).flat_map(|k| self.legs[k].directions());
        (0..FIRST).map(|n| TAU * n as f64 / FIRST as f64).chain(beside).collect()
    }

    /// The directions at jumps from the best ones and from directions at jumps from these, with the
    /// best ones and those `around`.
    fn over_jumps(&self, around: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let best: Vec<Vec<f64>> = self.best.iter().map(|heading| vec![heading.angle]).collect();
        let mut all = self.at_jumps(&best);
        all.iter_mut().zip(best).for_each(|(all, best)| all.extend(best));
        let mut all = self.at_jumps(&self.choices(&all));
        all.iter_mut().zip(around).for_each(|(all, around)| all.extend(around));
        all
    }

    /// The best directions, turned by a step or not, and those at jumps at most two steps away.
    ///
    /// If a path lies on jumps, each direction there determines the next. Up to `deep` of them are
    /// followed.
    fn nearby(&self, step: f64, deep: usize) -> Vec<Vec<f64>> {
        let turned = |heading: &Heading| vec![heading.angle, heading.angle - step, heading.angle + step];
        let mut all: Vec<Vec<f64>> = self.best.iter().map(turned).collect();
        for _ in 0..deep {
            let more = self.at_jumps(&self.choices(&all));
            for ((own, best), more) in all.iter_mut().zip(&self.best).zip(more) {
                for angle in more {
                    let is_near = wrapped(angle - best.angle).abs() <= 2.0 * step;
                    if is_near && own.iter().all(|own| wrapped(angle - own).abs() > ONE * step) {
                        own.push(angle);
                    }
                }
            }
        }
        all
    }

    /// The directions at every point at which paths of two pieces arrive, for these directions at
    /// its neighbours.
    fn at_jumps(&self, from: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let points = from.len();
        let mut found = vec![vec![]; points];
        for (k, leg) in self.legs.iter().enumerate().filter(|(_, leg)| leg.radius > 0.0) {
            let next = (k + 1) % points;
            for &angle in &from[k] {
                found[next].extend(jumps(leg.chord, Heading::new(angle), leg.radius));
            }
            for &angle in &from[next] {
                // Backwards along the path.
                let back = Heading::new(angle + PI);
                found[k].extend(jumps(leg.chord.map(|x| -x), back, leg.radius).map(|angle| angle + PI));
            }
        }
        found
    }

    /// The choices at every point: its given direction, or these.
    fn choices(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |(all, given): (&Vec<f64>, &Option<f64>)| given.map_or_else(|| all.clone(), |given| vec![given]);
        all.iter().zip(self.given).map(of).collect()
    }

    /// Stores the best combination of these directions if it is shorter than the best so far.
    /// Returns whether it is.
    fn take_best_of(&mut self, all: &[Vec<f64>]) -> bool {
        self.rounds += 1;
        let choices: Vec<Vec<Heading>> =
            self.choices(all).into_iter().map(|own| own.into_iter().map(Heading::new).collect()).collect();
        let found = best_of(self.legs, &choices, self.length * (1.0 - 4.0 * f64::EPSILON));
        if let Some((best, length)) = found {
            (self.best, self.length) = (best, length);
            return true;
        }
        false
    }
}

/// The equivalent angle from −π to π.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// Lower bounds of the length of a leg: for every start direction with any end direction, and for
/// every end direction.
///
/// The shortest path with a free end direction has two pieces.
fn bounds(leg: &Leg, [starts, ends]: [&[Heading]; 2]) -> [Vec<f64>; 2] {
    // Computing a few lengths is as fast as computing bounds.
    if leg.radius == 0.0 || starts.len().min(ends.len()) < FEW {
        let chord = dot(leg.chord, leg.chord).sqrt();
        return [vec![chord; starts.len()], vec![chord; ends.len()]];
    }
    let least = |chord: Vector<f64, 2>, from: Heading| {
        let to = jumps(chord, from, leg.radius).map(Heading::new);
        let length = to.map(|to| Dubins::between(chord, [from, to], leg.radius).length()).fold(f64::INFINITY, f64::min);
        (1.0 - ROUNDING) * length
    };
    let back = |end: &Heading| least(leg.chord.map(|x| -x), Heading::new(end.angle + PI));
    [starts.iter().map(|&start| least(leg.chord, start)).collect(), ends.iter().map(back).collect()]
}

/// The best combination of directions, one per point, and its length, if that is less than `most`.
fn best_of(legs: &[Leg], choices: &[Vec<Heading>], most: f64) -> Option<(Vec<Heading>, f64)> {
    let points = choices.len();
    let closed = legs.len() == points;
    let ends = |k: usize| [&choices[k][..], &choices[(k + 1) % points][..]];
    let bounds: Vec<[Vec<f64>; 2]> = legs.iter().enumerate().map(|(k, leg)| bounds(leg, ends(k))).collect();
    let chords: Vec<f64> = legs.iter().map(|leg| dot(leg.chord, leg.chord).sqrt()).collect();
    // Cached lengths, by the directions at both ends of a leg.
    let mut known: Vec<Vec<f64>> =
        (0..legs.len()).map(|k| vec![f64::NAN; ends(k).map(<[_]>::len).iter().product()]).collect();
    let mut found: Option<(Vec<usize>, f64)> = None;
    let mut most = most;
    // A closed path returns with its start direction.
    for start in 0..if closed { choices[0].len() } else { 1 } {
        // The shortest paths to every direction at a point, in increasing order of length.
        let first = if closed { start..start + 1 } else { 0..choices[0].len() };
        let mut ways: Vec<(usize, f64)> = first.map(|k| (k, 0.0)).collect();
        let mut from: Vec<Vec<usize>> = Vec::with_capacity(legs.len());
        let mut rest: f64 = chords.iter().sum();
        for (k, leg) in legs.iter().enumerate() {
            let [starts, ends] = ends(k);
            let [by_start, by_end] = &bounds[k];
            rest -= chords[k];
            // A lower bound of the remaining length after an end with this direction.
            let behind = |n: usize| bounds.get(k + 1).map_or(0.0, |[by_start, _]| by_start[n] + rest - chords[k + 1]);
            let mut by = vec![usize::MAX; ends.len()];
            let mut next = Vec::with_capacity(ends.len());
            for (n, &to) in ends.iter().enumerate() {
                let mut least = most - behind(n);
                for &(start, so_far) in &ways {
                    if so_far + by_end[n] >= least {
                        break;
                    }
                    if so_far + by_start[start] >= least {
                        continue;
                    }
                    let own = &mut known[k][start * ends.len() + n];
                    if own.is_nan() {
                        *own = Dubins::between(leg.chord, [starts[start], to], leg.radius).length();
                    }
                    if so_far + *own < least {
                        (least, by[n]) = (so_far + *own, start);
                    }
                }
                if by[n] != usize::MAX {
                    next.push((n, least));
                }
            }
            from.push(by);
            next.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            ways = next;
        }
        let end = ways.into_iter().find(|(k, _)| !closed || *k == start);
        if let Some((mut at, length)) = end {
            let mut best = vec![0; points];
            for k in (0..legs.len()).rev() {
                best[(k + 1) % points] = at;
                at = from[k][at];
            }
            best[0] = at;
            most = length;
            found = Some((best, length));
        }
    }
    found.map(|(best, length)| (choices.iter().zip(best).map(|(own, k)| own[k]).collect(), length))
}
