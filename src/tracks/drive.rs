//! [`drive`]: the fastest drive along curves within limits of speed and acceleration.

use super::jerk::Profile;
use super::{Quantity, carried};
use crate::batch::{Column, CurveBatch, Values};
use crate::curve::{Curve, Sampling};
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::Fit;

/// Parts of each step between samples in which the profile is sought.
const PARTS: usize = 8;

/// What a vehicle can do, in units of the curves and a unit of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// The largest speed.
    pub speed: f64,
    /// The largest acceleration across, v² times the curvature.
    pub lateral: f64,
    /// The largest acceleration along the curve.
    pub accelerate: f64,
    /// The largest deceleration along the curve.
    pub brake: f64,
    /// The largest rate of change of the acceleration along the curve. `None` sets no bound.
    pub jerk: Option<f64>,
}

impl Vehicle {
    /// Checks that all limits are positive numbers.
    pub(crate) fn check(&self) -> Result<()> {
        let Vehicle { speed, lateral, accelerate, brake, jerk } = *self;
        let limits = [
            ("speed", speed),
            ("acceleration across", lateral),
            ("acceleration along", accelerate),
            ("deceleration", brake),
            ("jerk", jerk.unwrap_or(1.0)),
        ];
        match limits.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
            Some((what, value)) => {
                Err(Error::argument(format!("the largest {what} is {value}; it must be a positive number")))
            }
            None => Ok(()),
        }
    }
}

/// Samples of fitted curves with the times of the fastest drive along them: the parameters.
///
/// Columns follow: `v`, the speed; `a_long`, the acceleration from each sample to the next, and at the
/// last one that before; `a_lat`, v² times the curvature, positive to the left in the plane. The drive
/// begins at time 0. Open curves begin and end at rest, closed ones go on. Data points whose entry in the
/// column `stop` is not 0 or blank are stops, and samples, too. Where the column `max_speed` of a data point is a number, the
/// span from it to the next one is driven no faster.
///
/// The profile is piecewise of constant acceleration, in 8 parts between samples: a forward and a
/// backward pass over the largest v² that the curvature at their ends allows. Of all such profiles it is the
/// fastest. With a limit of jerk the acceleration changes from part to part by at most the jerk times the time
/// between their middles, and from 0 next to rests. The time is then a local minimum, to 1e-7 of it. On a
/// globe lengths are those on the ground.
///
/// # Errors
/// - A limit that is not positive and finite. A `max_speed` that is 0 or less, or no number.
/// - The errors of [`Sampling::check`].
pub fn drive(batch: &CurveBatch, fit: &Fit, sampling: Sampling, vehicle: &Vehicle) -> Result<CurveBatch> {
    vehicle.check()?;
    sampling.check_with(batch, COLUMNS.len())?;
    let column = |name: &str| batch.columns().iter().find(|column| column.name == name);
    let [stops, speeds] = ALONG_DRIVES.map(column);
    let speeds = speeds.map(|column| largest_speeds(batch, column)).transpose()?;
    let drives = parallel::map(batch.len(), 1, |i| {
        let curve = fit.curve(i);
        let own = batch.offsets()[i]..batch.offsets()[i + 1];
        let stops = (0..own.len()).filter(|k| stops.is_some_and(|stops| is_stop(stops, own.start + k)));
        let speeds = speeds.as_ref().map_or(&[][..], |speeds| &speeds[own.clone()]);
        Drive::new(&*curve, sampling, batch.is_geographic(), &stops.collect::<Vec<_>>(), speeds, vehicle)
    });
    let dimension = if fit.is_empty() { batch.dimension() } else { fit.curve(0).dimension() };
    let (mut points, mut columns, mut ends) = (Vec::new(), vec![Vec::new(); COLUMNS.len()], Vec::new());
    let mut along = carried::empty(batch);
    for (i, drive) in drives.into_iter().enumerate() {
        for (column, own) in columns.iter_mut().zip(&drive.columns) {
            column.extend_from_slice(own);
        }
        let given = batch.given_knots(i);
        let knots = given.map_or_else(|| fit.curve(i).knots().to_vec(), Vec::from);
        carried::push(batch, i, &knots, &drive.sites, &mut along);
        ends.push(drive.end);
        points.push((drive.coords, drive.t));
    }
    let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
    let (problems, origin) = (batch.problems().clone(), batch.origin().clone());
    let columns = COLUMNS.iter().zip(columns);
    let columns = columns.map(|(name, own)| Column { name: name.to_string(), values: Values::Numbers(own) });
    let columns = along.into_iter().chain(columns);
    let batch = CurveBatch::from_samples(dimension, points, |i, last| ends[i] - last, closed, problems, origin);
    batch.with_columns(columns.collect())
}

/// The columns of a batch that [`drive`] reads: rests, and the largest speeds of spans.
#[doc(hidden)]
pub const ALONG_DRIVES: [&str; 2] = ["stop", "max_speed"];

const COLUMNS: [&str; 3] = ["v", "a_long", "a_lat"];

/// Whether a point is a stop.
fn is_stop(column: &Column, point: usize) -> bool {
    match &column.values {
        Values::Texts(texts) => !["", "0"].contains(&texts[point].trim()),
        values => values.numbers().is_some_and(|numbers| numbers[point].abs() > 0.0),
    }
}

/// The largest speed of every point's span, infinite without one.
fn largest_speeds(batch: &CurveBatch, column: &Column) -> Result<Vec<f64>> {
    let number = |k: usize| match &column.values {
        Values::Texts(texts) if texts[k].trim().is_empty() => Some(f64::INFINITY),
        Values::Texts(texts) => texts[k].trim().parse().ok(),
        values => values.numbers().map(|numbers| if numbers[k].is_nan() { f64::INFINITY } else { numbers[k] }),
    };
    let speed = |k: usize| match number(k).filter(|speed| *speed > 0.0) {
        Some(speed) => Ok(speed),
        None => {
            let i = batch.offsets().partition_point(|&first| first <= k) - 1;
            let what = "its max_speed is no positive number: mend it, or leave it empty";
            Err(Error::argument(batch.sentence(i, k - batch.offsets()[i], what)))
        }
    };
    (0..batch.total_points()).map(speed).collect()
}

/// The drive along one curve.
struct Drive {
    sites: Vec<(usize, f64)>,
    coords: Vec<f64>,
    t: Vec<f64>,
    end: f64,
    columns: [Vec<f64>; 3],
}

impl Drive {
    fn new(
        curve: &dyn Curve,
        sampling: Sampling,
        geographic: bool,
        stops: &[usize],
        speeds: &[f64],
        vehicle: &Vehicle,
    ) -> Self {
        let mut sites = curve.sites(sampling);
        let is_driven = curve.is_fitted() && sites.len() > 1;
        let place = |&(span, u): &(usize, f64)| span as f64 + u;
        for &stop in stops.iter().filter(|_| is_driven) {
            let at = sites.partition_point(|site| place(site) < stop as f64);
            let is_between = sites.get(at).map_or(curve.is_closed(), |site| place(site) > stop as f64);
            if at > 0 && is_between {
                sites.insert(at, (stop, 0.0));
            }
        }
        let point = |&(span, u): &(usize, f64)| curve.jet(span, u).point.to_array().into_iter().take(curve.dimension());
        let coords = sites.iter().flat_map(point).collect();
        let n = sites.len();
        if !is_driven {
            let t = (0..n).map(|k| k as f64).collect();
            return Drive { sites, coords, t, end: n as f64, columns: std::array::from_fn(|_| vec![f64::NAN; n]) };
        }
        // Sites in order: samples, and parts between them.
        let end = (curve.spans() - 1, 1.0);
        let mut marks: Vec<f64> = sites.iter().chain(curve.is_closed().then_some(&end)).map(place).collect();
        marks.dedup();
        let site = |place: f64| if place < end.0 as f64 + 1.0 { (place as usize, place.fract()) } else { end };
        let parts = |pair: &[f64]| -> [f64; PARTS] {
            std::array::from_fn(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / PARTS as f64)
        };
        let places: Vec<f64> = marks.windows(2).flat_map(parts).chain(marks.last().copied()).collect();
        let samples: Vec<usize> = sites.iter().map(|site| places.partition_point(|own| *own < place(site))).collect();
        let fine: Vec<(usize, f64)> = places.into_iter().map(site).collect();
        let rests = |&(span, u): &(usize, f64)| {
            let is_end = !curve.is_closed() && ((span, u) == (0, 0.0) || (span, u) == end);
            is_end || u == 0.0 && stops.contains(&span) || u == 1.0 && stops.contains(&(span + 1))
        };
        let lengths = Quantity::Arclength.of(curve, &fine, None, geographic).remove(0);
        let curvatures = Quantity::Curvature.of(curve, &fine, None, geographic).remove(0);
        let most = |k: usize| {
            let across = vehicle.lateral / curvatures[k].abs();
            if rests(&fine[k]) || across.is_nan() {
                return 0.0;
            }
            // At a point the speeds of both spans hold.
            let (span, u) = fine[k];
            let before = if u > 0.0 { span } else { span.checked_sub(1).unwrap_or(end.0) };
            let speed =
                [before, span].iter().filter_map(|span| speeds.get(*span)).fold(vehicle.speed, |a, b| a.min(*b));
            across.min(speed * speed)
        };
        let most: Vec<f64> = (0..fine.len()).map(most).collect();
        let squares = squares(&lengths, most, curve.is_closed(), vehicle);
        // Between two sites the acceleration is constant.
        let mut times = vec![0.0];
        for k in 1..fine.len() {
            let (step, sum) = (lengths[k] - lengths[k - 1], squares[k].sqrt() + squares[k - 1].sqrt());
            times.push(times[k - 1] + if step > 0.0 { 2.0 * step / sum } else { 0.0 });
        }
        let along = |k: usize| {
            let (from, to) = if k + 1 < fine.len() { (k, k + 1) } else { (k - 1, k) };
            let step = lengths[to] - lengths[from];
            if step > 0.0 { (squares[to] - squares[from]) / (2.0 * step) } else { 0.0 }
        };
        let at = |value: &dyn Fn(usize) -> f64| samples.iter().map(|&k| value(k)).collect::<Vec<f64>>();
        let columns = [at(&|k| squares[k].sqrt()), at(&along), at(&|k| lateral(squares[k], curvatures[k]))];
        let (t, end) = (at(&|k| times[k]), times[times.len() - 1]);
        Drive { sites, coords, t, end, columns }
    }
}

/// v² κ, 0 at rest.
fn lateral(square: f64, curvature: f64) -> f64 {
    if square == 0.0 { 0.0 } else { square * curvature }
}

/// v² at every site: the largest that all limits allow, no more than `most`.
fn squares(lengths: &[f64], most: Vec<f64>, closed: bool, vehicle: &Vehicle) -> Vec<f64> {
    let n = lengths.len();
    let mut squares = most.clone();
    // A closed curve's last site is its first: later rounds know what comes before and after.
    for _ in 0..if closed { 3 } else { 1 } {
        if closed {
            let both = squares[0].min(squares[n - 1]);
            (squares[0], squares[n - 1]) = (both, both);
        }
        for k in 1..n {
            let reached = squares[k - 1] + 2.0 * vehicle.accelerate * (lengths[k] - lengths[k - 1]);
            squares[k] = squares[k].min(reached);
        }
        for k in (1..n).rev() {
            let stopped = squares[k] + 2.0 * vehicle.brake * (lengths[k] - lengths[k - 1]);
            squares[k - 1] = squares[k - 1].min(stopped);
        }
    }
    let Some(jerk) = vehicle.jerk else { return squares };
    // Sites at one place are one, and a closed curve's last site is its first.
    let least = f64::EPSILON * lengths[n - 1];
    let mut own = vec![0; n];
    let (mut steps, mut slowest) = (Vec::new(), vec![most[0]]);
    for k in 1..n {
        let step = lengths[k] - lengths[k - 1];
        if step > least {
            steps.push(step);
            slowest.push(f64::INFINITY);
        }
        own[k] = steps.len();
        slowest[own[k]] = slowest[own[k]].min(most[k]);
    }
    if closed && let Some(last) = slowest.pop_if(|_| !steps.is_empty()) {
        slowest[0] = slowest[0].min(last);
    }
    let count = slowest.len();
    let mut start = vec![f64::INFINITY; count];
    own.iter().zip(&squares).for_each(|(at, square)| start[at % count] = square.min(start[at % count]));
    let fastest = Profile { steps: &steps, most: &slowest, accelerate: vehicle.accelerate, brake: vehicle.brake, jerk }
        .fastest(&start);
    own.iter().map(|at| fastest[at % count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Device;
    use crate::spline::Natural;

    const VEHICLE: Vehicle = Vehicle { speed: 10.0, lateral: 3.0, accelerate: 2.0, brake: 4.0, jerk: None };

    fn driven(points: &[[f64; 2]], closed: bool, stop: Option<&[&str]>, vehicle: &Vehicle, n: usize) -> CurveBatch {
        let mut batch = CurveBatch::from_slices(&[points]).unwrap().closed(closed);
        if let Some(words) = stop {
            let values = Values::Texts(words.iter().map(|word| word.to_string()).collect());
            batch = batch.with_columns(vec![Column { name: "stop".into(), values }]).unwrap();
        }
        let fit = Natural::default().fit(&batch, &Device::cpu()).unwrap();
        drive(&batch, &fit, Sampling::PerSpan(n), vehicle).unwrap()
    }

    fn column<'a>(batch: &'a CurveBatch, name: &str) -> &'a [f64] {
        let column = batch.columns().iter().find(|column| column.name == name).unwrap();
        column.values.numbers().unwrap()
    }

    #[test]
    fn a_straight_line_is_driven_as_fast_as_can_be() {
        // 25 to 10 m/s in 5 s, 12.5 back to rest in 2.5 s, and 62.5 between in 6.25 s.
        let long = driven(&[[0.0, 0.0], [50.0, 0.0], [100.0, 0.0]], false, None, &VEHICLE, 64);
        let t = long.parameters(0).unwrap();
        // Parts that begin at one limit and end at another are a 20th of a second slower.
        assert!((t[t.len() - 1] - 13.75).abs() < 0.01, "{}", t[t.len() - 1]);
        assert_eq!((column(&long, "v")[0], column(&long, "v")[t.len() - 1]), (0.0, 0.0));
        // √(2 L/a · …): 2 m/s² over 2/3 of 6 m, 4 m/s² over the rest.
        let short = driven(&[[0.0, 0.0], [6.0, 0.0]], false, None, &VEHICLE, 300);
        let t = short.parameters(0).unwrap();
        assert!((t[t.len() - 1] - 3.0).abs() < 1e-3, "{}", t[t.len() - 1]);
        // A stop in the middle is two drives.
        let points = [[0.0, 0.0], [6.0, 0.0], [12.0, 0.0]];
        let stopped = driven(&points, false, Some(&["", "1", "0"]), &VEHICLE, 300);
        let t = stopped.parameters(0).unwrap();
        assert!((t[t.len() - 1] - 6.0).abs() < 2e-3 && column(&stopped, "v")[300] == 0.0, "{}", t[t.len() - 1]);
        assert_eq!(stopped.columns()[0].name, "stop", "columns travel along");
    }

    #[test]
    fn a_line_within_a_jerk_is_driven_in_seven_parts() {
        // The acceleration rises to 2 in 2 s and falls in as many. To v it takes v/2 + 2 s and half as many times v
        // metres: 7 s to 10 m/s, and 3 s at that, or up to 2 √21 − 2 m/s.
        let vehicle = Vehicle { accelerate: 2.0, brake: 2.0, jerk: Some(1.0), ..VEHICLE };
        for (length, time) in [(100.0, 17.0), (40.0, 2.0 * 21.0_f64.sqrt() + 2.0)] {
            let line = driven(&[[0.0, 0.0], [length, 0.0]], false, None, &vehicle, 100);
            let t = line.parameters(0).unwrap();
            let [v, along] = ["v", "a_long"].map(|name| column(&line, name));
            assert!((t[100] / time - 1.0).abs() < 1e-3, "{} {time}", t[100]);
            assert!(v.iter().all(|v| *v <= 10.0) && (v[0], v[100]) == (0.0, 0.0));
            assert!(along.iter().all(|a| a.abs() <= 2.0));
            for k in 1..100 {
                let change = (along[k] - along[k - 1]).abs();
                assert!(change <= 1.05 * (t[k] - t[k - 1]), "{k}: {change} {}", t[k] - t[k - 1]);
            }
        }
    }

    #[test]
    fn a_circle_is_driven_at_one_speed_and_without_an_end() {
        let points: Vec<[f64; 2]> = (0..64)
            .map(|k| f64::from(k) * std::f64::consts::TAU / 64.0)
            .map(|a| [5.0 * a.cos(), 5.0 * a.sin()])
            .collect();
        for (speed, jerk, wanted) in [(10.0, None, 15.0_f64.sqrt()), (2.0, None, 2.0), (2.0, Some(1.0), 2.0)] {
            let round = driven(&points, true, None, &Vehicle { speed, jerk, ..VEHICLE }, 4);
            assert!(column(&round, "v").iter().all(|v| (v / wanted - 1.0).abs() < 1e-3), "{:?}", column(&round, "v"));
            let t = round.parameters(0).unwrap();
            let end = t[t.len() - 1] + round.closing_length(0, t);
            assert!((end * wanted / (10.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{end}");
        }
    }

    #[test]
    fn no_sample_breaks_a_limit_and_some_limit_holds_everywhere() {
        let points: Vec<[f64; 2]> =
            (0..20_i32).map(|k| [3.0 * f64::from(k), f64::from(k * k * 7 % 11) * 0.6]).collect();
        for closed in [false, true] {
            let path = driven(&points, closed, None, &VEHICLE, 16);
            let [v, along, across] = ["v", "a_long", "a_lat"].map(|name| column(&path, name));
            let near = |x: f64, limit: f64| x > limit * (1.0 - 1e-6);
            let mut at_limits = 0;
            for k in 0..v.len() {
                assert!(v[k] <= 10.0 + 1e-9 && across[k].abs() <= 3.0 + 1e-9, "{k}");
                assert!((-4.0 - 1e-9..=2.0 + 1e-9).contains(&along[k]), "{k}: {}", along[k]);
                let held =
                    near(v[k], 10.0) || near(across[k].abs(), 3.0) || near(along[k], 2.0) || near(-along[k], 4.0);
                at_limits += usize::from(held);
            }
            assert!(at_limits * 10 > 9 * v.len(), "{at_limits} of {}", v.len());
            assert!(closed || (v[0], v[v.len() - 1]) == (0.0, 0.0));
            let t = path.parameters(0).unwrap();
            assert!(t[0] == 0.0 && t.is_sorted());
        }
    }
}
