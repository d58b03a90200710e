//! The searches of Alon & Bergmann for the slopes through many points: named alternatives to
//! Newton's method, and the baselines it is compared with.
//!
//! With a slope α_k at every dot P_k the total cost is S_Σ(α) = Σ_k S_k(α_k, α_{k+1}), the sum over
//! the segments. Both searches see nothing but costs, many segments at once, through
//! [`SegmentCosts`], such as those of [`Segments`]: [`Greedy`] moves one slope at a time by ±Δα, as
//! in section 4 of the paper; [`GaussianAdaptation`] samples all slopes together.
//!
//! Angles are in radians and absolute (0: along x, counter-clockwise), costs in the units of the
//! input. A segment without a minimiser costs ∞ (NaN is read as ∞); both searches leave such places
//! where they can.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use crate::error::{Error, Result};

mod adaptation;
mod greedy;
mod newton;
mod segments;
#[cfg(test)]
mod synthetic;

pub use adaptation::GaussianAdaptation;
pub use greedy::Greedy;
pub use segments::Segments;

/// One segment to be evaluated: which, and the directions of its two end tangents (radians,
/// absolute).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Segment k leads from dot k to dot k + 1; the last one of a closed curve back to dot 0.
    pub segment: usize,
    /// The directions at its start and at its end.
    pub slopes: [f64; 2],
}

/// Costs of segments, many at once; ∞ where there is no minimiser.
pub trait SegmentCosts {
    /// Number of dots.
    fn dots(&self) -> usize;

    /// Whether a last segment leads back to the first dot.
    fn is_closed(&self) -> bool;

    /// Writes the cost of every request into `costs`, which is as long; the same request must cost
    /// the same every time.
    ///
    /// # Errors
    ///
    /// What ends the whole search, such as a lost device. A segment that has no cost is no error:
    /// it costs ∞.
    fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> Result<()>;

    /// Number of segments: as many as dots if closed, else one fewer; none where there is only one
    /// dot.
    fn segments(&self) -> usize {
        match self.dots() {
            0 | 1 => 0,
            dots if self.is_closed() => dots,
            dots => dots - 1,
        }
    }
}

/// Where a search stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Moves made ([`Greedy`]), or candidates drawn ([`GaussianAdaptation`]).
    pub iterations: usize,
    /// Segments evaluated up to here.
    pub segment_solves: usize,
    /// The least total cost up to here.
    pub cost: f64,
}

/// The slopes at one moment of a search, for a picture of the evolution.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// When.
    pub at: Record,
    /// The direction at every dot.
    pub slopes: Vec<f64>,
}

/// What a search found, and how it went.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best direction at every dot. They are not reduced to one turn: a slope may have gone
    /// round.
    pub slopes: Vec<f64>,
    /// The total cost there; ∞ where no slopes were found with which all segments exist.
    pub cost: f64,
    /// Whether the search ended by itself; if not, its limit came first.
    pub settled: bool,
    /// Moves made ([`Greedy`]), or candidates drawn ([`GaussianAdaptation`]).
    pub iterations: usize,
    /// Segments evaluated.
    pub segment_solves: usize,
    /// Segments that the same search evaluates where nothing is kept from one iteration to the
    /// next: for [`Greedy`] one for every segment and two for every end of it that may move, each
    /// time; [`GaussianAdaptation`] keeps nothing anyway.
    pub textbook_solves: usize,
    /// The costs over time: every iteration up to a few thousand, then every second, every fourth
    /// and so on. The first and the last are always there.
    pub history: Vec<Record>,
    /// The slopes at the start, after (or just after, where candidates come in batches) 1, 2, 4, 8
    /// … iterations, and at the end.
    pub snapshots: Vec<Snapshot>,
}

/// The slopes that the search starts from: at every dot the direction of the line between its two
/// neighbours, at the ends of an open curve that of the line to the only one,
///
/// α_k = atan2(y_{k+1} − y_{k−1}, x_{k+1} − x_{k−1}).
///
/// Step 1 of the paper prints the differences the other way round, which points backwards along the
/// curve; this is the direction in which it is drawn. Where both neighbours are one point the line
/// has no direction: the curve turns back there, and the slope is that of the chord, a quarter turn
/// to the left (two dots, closed: an oval drawn counter-clockwise). A dot without distinct
/// neighbours gets 0. Radians, in (−π, π].
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

/// The total cost of some slopes, by one request.
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

/// All segments with these slopes.
fn requests_of(slopes: &[f64], segments: usize) -> Vec<Request> {
    let ends = |segment| [slopes[segment], slopes[(segment + 1) % slopes.len()]];
    (0..segments).map(|segment| Request { segment, slopes: ends(segment) }).collect()
}

/// Costs, with NaN read as ∞. No request, no call.
fn evaluate(costs: &mut dyn SegmentCosts, requests: &[Request], found: &mut [f64]) -> Result<()> {
    if !requests.is_empty() {
        costs.costs(requests, found)?;
    }
    found.iter_mut().filter(|cost| cost.is_nan()).for_each(|cost| *cost = f64::INFINITY);
    Ok(())
}

/// Refuses slopes and flags that do not fit the dots.
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
    /// Records seen; of these every `stride`-th is kept.
    seen: usize,
    stride: usize,
    /// When the next snapshot is due.
    next: usize,
}

/// The longest history kept; where it is reached, every second record goes.
const HISTORY: usize = 4096;

impl Evolution {
    fn new() -> Self {
        Evolution { history: Vec::new(), snapshots: Vec::new(), seen: 0, stride: 1, next: 0 }
    }

    /// To be called after every iteration, and once before the first.
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
        // Counter-clockwise round a square: tangents of its circumcircle.
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
