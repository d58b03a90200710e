//! The directions at the points of the shortest path of bounded curvature.
//!
//! They are the unknowns: between two points with their directions the path is a [`Dubins`] path. Its length has many
//! minima, and jumps by a circle where it comes to have two pieces alone. So dynamic programming finds the best of all
//! combinations:
//!
//! 1. of directions all around, and those of chords and of the circles through neighbouring points;
//! 2. of these and of those in which paths of two pieces come from the best ones so far and their neighbours';
//! 3. of the best ones turned by a step or not, and those at jumps beside them, with steps halved to rounding.
//!
//! Source: M. Frego, P. Bevilacqua, E. Saccon, L. Palopoli and D. Fontanelli, *An iterative dynamic programming approach
//! to the multipoint Markov–Dubins problem*, IEEE Robotics and Automation Letters 5 (2020). Directions at jumps are
//! faircurve's.

use std::f64::consts::{PI, TAU};

use super::dubins::{Dubins, Heading, jumps};
use crate::linalg::scalar::{Vector, dot, subtract};

/// Directions all around.
const FIRST: usize = 24;

/// The last step. Lengths are quadratic in what is left, and so known to rounding.
const LAST: f64 = 1e-9;

/// Paths end within this of their points, at size 1. Turns are known to 1e-12, so that they do for radii up to some 10⁵.
const REACH: f64 = 1e-6;

/// Directions within this part of a step are one.
const ONE: f64 = 1e-3;

/// The most directions along jumps that follow from each other.
const DEEP: usize = 3;

/// Fewer directions than this at one end are tried without bounds.
const FEW: usize = 12;

/// Bounds of lengths are smaller by this part than computed.
const ROUNDING: f64 = 1e-9;

/// The most rounds with one step.
const MOST: u32 = 8;

/// From one point to the next.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    pub chord: Vector<f64, 2>,
    /// The smallest radius, 0 where there is none.
    pub radius: f64,
}

impl Leg {
    /// The directions at both ends of the chord itself, and of the circles through both ends.
    fn directions(&self) -> impl Iterator<Item = f64> + use<> {
        let [x, y] = self.chord;
        let angle = y.atan2(x);
        // It is no number where there is no such circle.
        let half = (x.hypot(y) / (2.0 * self.radius)).asin();
        [0.0, half, -half, PI - half, half - PI].into_iter().map(move |turn| angle + turn).filter(|x| x.is_finite())
    }
}

/// Legs through points, some of which have a direction of their own.
struct Search<'a> {
    legs: &'a [Leg],
    given: &'a [Option<f64>],
    best: Vec<Heading>,
    length: f64,
    rounds: u32,
}

/// The shortest path along legs, leg by leg, and how many times combinations of directions were compared.
///
/// `given` has the direction at every point that has one of its own. There is a leg fewer than points, or as many for a
/// closed path. `None` where rounding does not let paths end at their points: radii are too large for the numbers.
pub fn shortest(legs: &[Leg], given: &[Option<f64>]) -> Option<(Vec<Dubins>, u32)> {
    let mut search = Search { legs, given, best: vec![], length: f64::INFINITY, rounds: 0 };
    let around: Vec<Vec<f64>> = (0..given.len()).map(|k| search.around(k)).collect();
    if !search.take_best_of(&around) {
        return None;
    }
    // Lengths do not jump if all points are at least four radii apart, and the first directions lead to the best path.
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

    /// The directions to which the best ones, and those that these lead to, lead over jumps, besides those `around`.
    fn over_jumps(&self, around: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let best: Vec<Vec<f64>> = self.best.iter().map(|heading| vec![heading.angle]).collect();
        let mut all = self.at_jumps(&best);
        all.iter_mut().zip(best).for_each(|(all, best)| all.extend(best));
        let mut all = self.at_jumps(&self.choices(&all));
        all.iter_mut().zip(around).for_each(|(all, around)| all.extend(around));
        all
    }

    /// The best directions turned by a step or not, and those at jumps that are no more than two steps from them.
    ///
    /// Where a path lies along jumps, directions follow from each other: `deep` of them.
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

    /// The directions at every point in which paths of two pieces come from directions at its neighbours.
    fn at_jumps(&self, from: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let points = from.len();
        let mut found = vec![vec![]; points];
        for (k, leg) in self.legs.iter().enumerate().filter(|(_, leg)| leg.radius > 0.0) {
            let next = (k + 1) % points;
            for &angle in &from[k] {
                found[next].extend(jumps(leg.chord, Heading::new(angle), leg.radius));
            }
            for &angle in &from[next] {
                // Back along the path.
                let back = Heading::new(angle + PI);
                found[k].extend(jumps(leg.chord.map(|x| -x), back, leg.radius).map(|angle| angle + PI));
            }
        }
        found
    }

    /// What may be chosen at every point: the direction given, or these.
    fn choices(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |(all, given): (&Vec<f64>, &Option<f64>)| given.map_or_else(|| all.clone(), |given| vec![given]);
        all.iter().zip(self.given).map(of).collect()
    }

    /// Takes the best combination of these directions if it is shorter than the best so far. Says whether it is.
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

/// The angle from −π to π that is equal to this one.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// The least lengths of a leg with every direction at its start and any at its end, and with every direction at its end.
///
/// The shortest path to an end of any direction has two pieces.
fn bounds(leg: &Leg, [starts, ends]: [&[Heading]; 2]) -> [Vec<f64>; 2] {
    // Few lengths are computed as soon as bounds.
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

/// The best combination of directions, one for every point, and its length, if it is shorter than `most`.
fn best_of(legs: &[Leg], choices: &[Vec<Heading>], most: f64) -> Option<(Vec<Heading>, f64)> {
    let points = choices.len();
    let closed = legs.len() == points;
    let ends = |k: usize| [&choices[k][..], &choices[(k + 1) % points][..]];
    let bounds: Vec<[Vec<f64>; 2]> = legs.iter().enumerate().map(|(k, leg)| bounds(leg, ends(k))).collect();
    let chords: Vec<f64> = legs.iter().map(|leg| dot(leg.chord, leg.chord).sqrt()).collect();
    // Lengths that were computed, by the directions at both ends of a leg.
    let mut known: Vec<Vec<f64>> =
        (0..legs.len()).map(|k| vec![f64::NAN; ends(k).map(<[_]>::len).iter().product()]).collect();
    let mut found: Option<(Vec<usize>, f64)> = None;
    let mut most = most;
    // A closed path comes back with the direction that it started with.
    for start in 0..if closed { choices[0].len() } else { 1 } {
        // The shortest ways to every direction at a point, the shortest first.
        let first = if closed { start..start + 1 } else { 0..choices[0].len() };
        let mut ways: Vec<(usize, f64)> = first.map(|k| (k, 0.0)).collect();
        let mut from: Vec<Vec<usize>> = Vec::with_capacity(legs.len());
        let mut rest: f64 = chords.iter().sum();
        for (k, leg) in legs.iter().enumerate() {
            let [starts, ends] = ends(k);
            let [by_start, by_end] = &bounds[k];
            rest -= chords[k];
            // What is left behind an end of this direction is at least so long.
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
