//! The searches of Alon & Bergmann for the slopes through many points.
//!
//! They are named alternatives to Newton's method, and the baselines for comparing it.
//!
//! With a slope α_k at every dot P_k the total cost is S_Σ(α) = Σ_k S_k(α_k, α_{k+1}), the sum over
//! the segments. Both searches use nothing but costs of many segments at once, through
//! [`SegmentCosts`]. [`Segments`] gives such costs.
//!
//! - [`Greedy`] moves one slope at a time by ±Δα, as in section 4 of the paper.
//! - [`GaussianAdaptation`] samples all slopes together.
//!
//! Angles are absolute and in radians, with 0 along x and counter-clockwise positive. Costs are in
//! units of the input. A segment without a minimiser costs ∞, and NaN is read as ∞. Both searches
//! leave such places where they can.

use std::f64::consts::FRAC_PI_2;

use faircurve::{Error, Result};
use glam::DVec2;

mod adaptation;
mod greedy;
mod newton;
mod segments;
#[cfg(test)]
mod synthetic;

pub use adaptation::GaussianAdaptation;
pub use greedy::Greedy;
pub use newton::newton;
pub use segments::Segments;

/// One segment to be evaluated.
///
/// It has a number and the directions of its two end tangents (radians, absolute).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// The segment's number.
    ///
    /// Segment k leads from dot k to dot k + 1, and the last one of a closed curve back to dot 0.
    pub segment: usize,
    /// The directions at its start and its end.
    pub slopes: [f64; 2],
}

/// Costs of many segments at once.
///
/// A segment without a minimiser costs ∞.
pub trait SegmentCosts {
    /// The number of dots.
    fn dots(&self) -> usize;

    /// Whether a last segment leads back to the first dot.
    fn is_closed(&self) -> bool;

    /// Writes the cost of every request into `costs`, which has the same length.
    ///
    /// The same request must always cost the same.
    ///
    /// # Errors
    ///
    /// An error ends the whole search, such as a lost device. A segment without a cost is no error:
    /// it costs ∞.
    fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> Result<()>;

    /// The number of segments: as many as dots if closed, else one fewer.
    ///
    /// There is none where there is only one dot.
    fn segments(&self) -> usize {
        match self.dots() {
            0 | 1 => 0,
            dots if self.is_closed() => dots,
            dots => dots - 1,
        }
    }
}

/// The state of a search at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Moves made by [`Greedy`], or candidates drawn by [`GaussianAdaptation`].
    pub iterations: usize,
    /// Segments evaluated so far.
    pub segment_solves: usize,
    /// The least total cost so far.
    pub cost: f64,
}

/// The slopes at one moment of a search, for a picture of its evolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// The moment.
    pub at: Record,
    /// The direction at every dot.
    pub slopes: Vec<f64>,
}

/// The result of a search, and its history.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best direction at every dot.
    ///
    /// Directions are not reduced to one turn, because a slope may have gone round.
    pub slopes: Vec<f64>,
    /// The total cost there.
    ///
    /// ∞ where no slopes were found with which all segments exist.
    pub cost: f64,
    /// Whether the search ended by itself, and not by its limit.
    pub settled: bool,
    /// Moves made by [`Greedy`], or candidates drawn by [`GaussianAdaptation`].
    pub iterations: usize,
    /// Segments evaluated.
    pub segment_solves: usize,
    /// Segments that the same search evaluates if it keeps nothing from one iteration to the next.
    ///
    /// For [`Greedy`] this is one for every segment and two for every end of it that may move, in
    /// each iteration. [`GaussianAdaptation`] never keeps anything.
    pub textbook_solves: usize,
    /// The costs over time: every iteration up to a few thousand, then every second, every fourth
    /// and so on.
    ///
    /// The first and the last are always included.
    pub history: Vec<Record>,
    /// The slopes at the start, after 1, 2, 4, 8 … iterations, and at the end.
    ///
    /// Where candidates come in batches, slopes are taken just after these iterations.
    pub snapshots: Vec<Snapshot>,
}

/// The slopes that the search starts from, in radians in (−π, π].
///
/// At every dot it is the direction of the line between its two neighbours. At the ends of an open
/// curve it is that of the line to the only neighbour.
///
/// α_k = atan2(y_{k+1} − y_{k−1}, x_{k+1} − x_{k−1}).
///
/// Step 1 of the paper prints the differences the other way round, which points backwards along the
/// curve. This is the direction in which it is drawn.
///
/// Where both neighbours are one point the line has no direction, because the curve turns back
/// there. The slope is then that of the chord, a quarter turn to the left. Two closed dots thus
/// give an oval drawn counter-clockwise. A dot without distinct neighbours gets 0.
pub fn initial_slopes(points: &[DVec2], closed: bool) -> Vec<f64> {
    let dots = points.len();
    let slope = |k: usize| {
        let inner = closed || (k > 0 && k + 1 < dots);
        let before = if k > 0 || closed { points[(k + dots - 1) % dots] } else { points[k] };
        let after = if k + 1 < dots || closed { points[(k + 1) % dots] } else { points[k] };
        let line = after - before;
        match line == DVec2::ZERO {
            true if inner && points[k] != before => {
                let chord = (points[k] - before).to_angle() + FRAC_PI_2;
                if chord > std::f64::consts::PI { chord - std::f64::consts::TAU } else { chord }
            }
            _ => line.y.atan2(line.x),
        }
    };
    (0..dots).map(slope).collect()
}

/// The total cost of some slopes, in one request.
///
/// # Errors
///
/// Those of [`SegmentCosts::costs`].
///
/// # Panics
///
/// If there is not one slope a dot.
pub fn total_cost(costs: &mut dyn SegmentCosts, slopes: &[f64]) -> Result<f64> {
    assert_eq!(slopes.len(), costs.dots(), "one slope a dot");
    let requests = requests_of(slopes, costs.segments());
    let mut found = vec![0.0; requests.len()];
    evaluate(costs, &requests, &mut found)?;
    Ok(found.iter().sum())
}

/// The requests for all segments with these slopes.
fn requests_of(slopes: &[f64], segments: usize) -> Vec<Request> {
    let ends = |segment| [slopes[segment], slopes[(segment + 1) % slopes.len()]];
    (0..segments).map(|segment| Request { segment, slopes: ends(segment) }).collect()
}

/// Writes costs with NaN read as ∞.
///
/// Without requests there is no call.
fn evaluate(costs: &mut dyn SegmentCosts, requests: &[Request], found: &mut [f64]) -> Result<()> {
    if !requests.is_empty() {
        costs.costs(requests, found)?;
    }
    found.iter_mut().filter(|cost| cost.is_nan()).for_each(|cost| *cost = f64::INFINITY);
    Ok(())
}

/// Refuses slopes and flags that do not match the dots.
fn check(dots: usize, start: &[f64], fixed: &[bool]) -> Result<()> {
    if start.len() != dots || fixed.len() != dots {
        return Err(Error::argument(format!(
            "a search over {dots} dots was given {} slopes and {} flags: give one of each a dot",
            start.len(),
            fixed.len()
        )));
    }
    match start.iter().position(|slope| !slope.is_finite()) {
        Some(k) => Err(Error::argument(format!(
            "the slope at dot {k} is {}: give a finite angle in radians, such as those of initial_slopes",
            start[k]
        ))),
        None => Ok(()),
    }
}

/// Records history and snapshots in bounded memory.
struct Evolution {
    history: Vec<Record>,
    snapshots: Vec<Snapshot>,
    /// The number of records seen.
    ///
    /// Every `stride`-th of them is kept.
    seen: usize,
    stride: usize,
    /// The iteration at which the next snapshot is due.
    next: usize,
}

/// The longest history kept.
///
/// When it is reached every second record is dropped.
const HISTORY: usize = 4096;

impl Evolution {
    fn new() -> Self {
        Evolution { history: Vec::new(), snapshots: Vec::new(), seen: 0, stride: 1, next: 0 }
    }

    /// Records an iteration.
    ///
    /// It must be called once before the first iteration, and after every one.
    fn record(&mut self, at: Record, slopes: &[f64]) {
        if self.seen.is_multiple_of(self.stride) {
            self.history.push(at);
        }
        self.seen += 1;
        if self.history.len() == HISTORY {
            let mut index = 0;
            self.history.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
        if at.iterations >= self.next {
            self.snapshots.push(Snapshot { at, slopes: slopes.to_vec() });
            self.next = (at.iterations + 1).next_power_of_two();
        }
    }

    /// The outcome, with the last state at the end of history and snapshots.
    fn finish(mut self, slopes: Vec<f64>, last: Record, settled: bool, textbook_solves: usize) -> Outcome {
        match self.history.last_mut() {
            Some(record) if record.iterations == last.iterations => *record = last,
            _ => self.history.push(last),
        }
        match self.snapshots.last_mut() {
            Some(snapshot) if snapshot.at.iterations == last.iterations => snapshot.at = last,
            _ => self.snapshots.push(Snapshot { at: last, slopes: slopes.clone() }),
        }
        Outcome {
            slopes,
            cost: last.cost,
            settled,
            iterations: last.iterations,
            segment_solves: last.segment_solves,
            textbook_solves,
            history: self.history,
            snapshots: self.snapshots,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_4, PI};

    use super::*;

    fn dots(coords: &[[f64; 2]]) -> Vec<DVec2> {
        coords.iter().copied().map(DVec2::from).collect()
    }

    #[test]
    fn initial_slopes_point_along_the_curve() {
        let line = dots(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 1.0]]);
        let slopes = initial_slopes(&line, false);
        assert_eq!(slopes, [0.0, 0.0, 0.5f64.atan(), FRAC_PI_4]);
        // The slopes are the tangents of the square's circumcircle, counter-clockwise.
        let square = dots(&[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]);
        let wanted = [FRAC_PI_2, PI, -FRAC_PI_2, 0.0];
        assert!(initial_slopes(&square, true).iter().zip(wanted).all(|(slope, wanted)| (slope - wanted).abs() < 1e-15));
    }

    #[test]
    fn initial_slopes_exist_where_neighbours_coincide() {
        let there_and_back = dots(&[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]);
        assert_eq!(initial_slopes(&there_and_back, false), [0.0, FRAC_PI_2, PI]);
        let two = initial_slopes(&dots(&[[0.0, 0.0], [0.0, 2.0]]), true);
        assert!((two[0] - 0.0).abs() < 1e-15 && (two[1] - PI).abs() < 1e-15, "{two:?}");
        assert_eq!(initial_slopes(&dots(&[[3.0, 4.0]]), true), [0.0]);
        assert_eq!(initial_slopes(&dots(&[[3.0, 4.0]]), false), [0.0]);
        assert!(initial_slopes(&[], true).is_empty());
    }

    #[test]
    fn a_history_is_bounded_even_and_holds_both_ends() {
        let mut evolution = Evolution::new();
        let at = |iterations| Record { iterations, segment_solves: 6 * iterations, cost: -(iterations as f64) };
        (0..100_001).for_each(|i| evolution.record(at(i), &[i as f64]));
        let outcome = evolution.finish(vec![1.0], at(100_000), true, 0);
        assert!(outcome.history.len() <= HISTORY && outcome.history.len() > HISTORY / 4);
        assert_eq!([outcome.history[0], *outcome.history.last().unwrap()], [at(0), at(100_000)]);
        let steps: Vec<usize> =
            outcome.history.windows(2).map(|pair| pair[1].iterations - pair[0].iterations).collect();
        assert!(steps[..steps.len() - 1].iter().all(|&step| step == steps[0]));
        let moments: Vec<usize> = outcome.snapshots.iter().map(|snapshot| snapshot.at.iterations).collect();
        assert_eq!(moments[..5], [0, 1, 2, 4, 8]);
        assert_eq!(moments[moments.len() - 2..], [65_536, 100_000]);
    }

    #[test]
    fn slopes_that_do_not_fit_are_refused_with_a_sentence() {
        let refused = |start: &[f64], fixed: &[bool]| check(3, start, fixed).unwrap_err().to_string();
        assert_eq!(
            refused(&[0.0; 2], &[false; 3]),
            "a search over 3 dots was given 2 slopes and 3 flags: give one of each a dot"
        );
        assert_eq!(
            refused(&[0.0, f64::NAN, 0.0], &[false; 3]),
            "the slope at dot 1 is NaN: give a finite angle in radians, such as those of initial_slopes"
        );
    }
}
