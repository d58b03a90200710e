//! Cleaning: points of tracks that are no fixes of their thing are dropped, and stops held, before a fit.

use std::collections::BTreeMap;

use glam::DVec3;

use super::outliers::outliers;
use crate::batch::{Column, CurveBatch, Values};
use crate::error::{Error, Result};
use crate::parallel;
use crate::surface::Globe;
use crate::words::words;

/// What becomes of points that have the time of the point before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Duplicates {
    /// All stay.
    #[default]
    Keep,
    /// The first stays.
    First,
    /// The first stays, at the mean of all their places.
    Mean,
    /// They are an error.
    Error,
}

words!(Duplicates, "way with duplicates": [
    (Keep, "keep", "All stay"),
    (First, "first", "The first stays"),
    (Mean, "mean", "The first stays, at the mean of their places"),
    (Error, "error", "They are refused"),
]);

/// A stop: all places within `radius` of the first for `time` or longer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stops {
    /// In metres for longitudes and latitudes, else in units of the points.
    pub radius: f64,
    /// In units of the parameters, seconds for dates.
    pub time: f64,
}

/// What [`clean`] does. By default only points without a time or a place are dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cleaning {
    /// Points of one time.
    pub duplicates: Duplicates,
    /// The largest speed, in metres for longitudes and latitudes, else in units of the points, per unit
    /// of the parameters, a second for dates. Of every track the most points are kept between which it
    /// is not exceeded.
    pub max_speed: Option<f64>,
    /// Whether outliers are dropped: fixes about 5 times as far as noise from where the two fixes before
    /// them lead, from where the two after them lead, and from between their neighbours. Noise is the median
    /// of the least of the three, along the track or next to the fix, whichever is more. Sharp turns stay.
    pub outliers: bool,
    /// All points of a stop move to their mean place.
    pub stops: Option<Stops>,
}

/// Why a point was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Dropped {
    /// It has no time or no place.
    Blank,
    /// It is too far to be reached in time.
    TooFast,
    /// Another point has its time.
    Duplicate,
    /// It is far off the way of its track.
    Outlier,
}

words!(Dropped, "reason": [
    (Blank, "blank", "without a time or a place"),
    (TooFast, "too fast", "too far to be reached in time"),
    (Duplicate, "duplicate", "of a time that another point has"),
    (Outlier, "outlier", "5 times as far as noise from where the points before and after lead"),
]);

/// A cleaned batch.
#[derive(Clone, Debug)]
pub struct Cleaned {
    /// The points that are kept, with all that belongs to them.
    pub batch: CurveBatch,
    /// Why each point of the given batch was dropped, or `None`.
    pub dropped: Vec<Option<Dropped>>,
    /// Number of stops that are held.
    pub stops: usize,
}

/// Drops points that are no fixes of a track, step by step: blanks, points that are too fast,
/// duplicates, outliers, stops.
///
/// Closed curves, and curves without times, stay as they are. Sentences about curves that lost points
/// name no lines.
///
/// # Errors
/// - A speed, a radius or a time that is not positive and finite.
/// - Duplicates that are to be an [error](Duplicates::Error).
pub fn clean(batch: &CurveBatch, cleaning: &Cleaning) -> Result<Cleaned> {
    let Cleaning { duplicates, max_speed, stops, .. } = *cleaning;
    let given = [
        ("largest speed", max_speed),
        ("radius of stops", stops.map(|own| own.radius)),
        ("time of stops", stops.map(|own| own.time)),
    ];
    if let Some((what, value)) = given.into_iter().find(|(_, value)| value.is_some_and(|x| !(x > 0.0 && x.is_finite())))
    {
        return Err(Error::argument(format!(
            "the {what} is {}; it must be a positive number",
            value.unwrap_or(f64::NAN)
        )));
    }
    let tracks = parallel::map(batch.len(), 1, |i| Track::new(batch, i).cleaned(cleaning));
    let (mut coords, mut dropped, mut held) = (batch.coords().to_vec(), Vec::with_capacity(batch.total_points()), 0);
    let d = batch.dimension();
    for (i, track) in tracks.into_iter().enumerate() {
        if let Some(k) = track.why.iter().position(|why| *why == Some(Dropped::Duplicate))
            && duplicates == Duplicates::Error
        {
            let what =
                "its time is that of the point before: sort or mend the points, or keep the first or the mean of them";
            return Err(Error::argument(batch.sentence(i, k, what)));
        }
        for (k, place) in track.moved {
            coords[(batch.offsets()[i] + k) * d..][..d].copy_from_slice(&place);
        }
        dropped.extend(track.why);
        held += track.stops;
    }
    let keep: Vec<bool> = dropped.iter().map(Option::is_none).collect();
    Ok(Cleaned { batch: batch.retained(coords, &keep), dropped, stops: held })
}

/// How often two things of one name take turns before they count as two.
const TURNS: usize = 10;

/// Parts tracks of several things that bear one name, such as two ships of one number.
///
/// Of each track the most points between which `max_speed` is not exceeded are one thing. Where the most of
/// the others take turns with it at least 10 times, and are not all at one place, they are another, and so
/// on. The parts of a track `a` are called `a.1`, `a.2` and so on. The speed has the unit of
/// [`Cleaning::max_speed`].
pub fn separate(batch: &CurveBatch, max_speed: f64) -> CurveBatch {
    let things = parallel::map(batch.len(), 1, |i| Track::new(batch, i).things(max_speed));
    let (mut points, mut parts) = (Vec::new(), Vec::new());
    for (i, things) in things.iter().enumerate() {
        let mut from = 0;
        for own in things {
            points.extend(own.iter().map(|k| batch.offsets()[i] + k));
            parts.push((i, from..from + own.len()));
            from += own.len();
        }
    }
    if parts.len() == batch.len() { batch.clone() } else { batch.reordered(&points).parted(&parts) }
}

impl Cleaned {
    /// The dropped points of the given batch, with a column `why`. Curves that lost none have no points.
    pub fn dropped_points(&self, given: &CurveBatch) -> Result<CurveBatch> {
        let why = |dropped: &Option<Dropped>| dropped.map(|own| own.word().to_string()).unwrap_or_default();
        let mut columns = given.columns().to_vec();
        let values = Values::Texts(self.dropped.iter().map(why).collect());
        columns.push(Column { name: "why".into(), values });
        let keep: Vec<bool> = self.dropped.iter().map(Option::is_some).collect();
        Ok(given.clone().with_columns(columns)?.retained(given.coords().to_vec(), &keep))
    }
}

/// A track while it is cleaned.
struct Track<'a> {
    batch: &'a CurveBatch,
    i: usize,
    /// Why points were dropped.
    why: Vec<Option<Dropped>>,
    /// Points that were moved, and where to.
    moved: BTreeMap<usize, Vec<f64>>,
    stops: usize,
}

impl<'a> Track<'a> {
    fn new(batch: &'a CurveBatch, i: usize) -> Self {
        Track { batch, i, why: vec![None; batch.count(i)], moved: BTreeMap::new(), stops: 0 }
    }

    fn cleaned(mut self, cleaning: &Cleaning) -> Self {
        let Some(t) = self.batch.parameters(self.i).filter(|_| !self.batch.is_closed(self.i)) else { return self };
        for (k, &time) in t.iter().enumerate() {
            if !time.is_finite() || self.place(k).iter().any(|x| !x.is_finite()) {
                self.why[k] = Some(Dropped::Blank);
            }
        }
        if let Some(most) = cleaning.max_speed {
            self.drop_fast(t, most);
        }
        if cleaning.duplicates != Duplicates::Keep {
            self.drop_duplicates(t, cleaning.duplicates);
        }
        if cleaning.outliers {
            self.drop_outliers(t);
        }
        if let Some(stops) = cleaning.stops {
            self.hold_stops(t, stops);
        }
        self
    }

    fn place(&self, k: usize) -> &[f64] {
        let d = self.batch.dimension();
        match self.moved.get(&k) {
            Some(place) => place,
            None => &self.batch.points(self.i)[k * d..(k + 1) * d],
        }
    }

    fn kept(&self) -> Vec<usize> {
        (0..self.why.len()).filter(|&k| self.why[k].is_none()).collect()
    }

    /// A point in space: on the ellipsoid for longitudes and latitudes.
    fn in_space(&self, k: usize) -> DVec3 {
        match *self.place(k) {
            [x, y, ..] if self.batch.is_geographic() => Globe::WGS84.place(x, y),
            [x, y, z] => DVec3::new(x, y, z),
            [x, y, ..] => DVec3::new(x, y, 0.0),
            _ => DVec3::ZERO,
        }
    }

    /// The distance between two points, on the ground for longitudes and latitudes.
    fn distance(&self, a: usize, b: usize) -> f64 {
        self.in_space(a).distance(self.in_space(b))
    }

    /// The mean place of some points.
    fn mean(&self, points: &[usize]) -> Vec<f64> {
        let first = self.place(points[0]).to_vec();
        let part = 1.0 / points.len() as f64;
        // About the first, whose digits they share.
        let offset = |axis: usize| points.iter().map(|&k| self.place(k)[axis] - first[axis]).sum::<f64>() * part;
        (0..first.len()).map(|axis| first[axis] + offset(axis)).collect()
    }

    fn drop_duplicates(&mut self, t: &[f64], duplicates: Duplicates) {
        for group in self.kept().chunk_by(|&a, &b| t[a] == t[b]).filter(|group| group.len() > 1) {
            if duplicates == Duplicates::Mean {
                self.moved.insert(group[0], self.mean(group));
            }
            group[1..].iter().for_each(|&k| self.why[k] = Some(Dropped::Duplicate));
        }
    }

    /// Keeps the most points of which no two are too far apart for the time between them. If every step is
    /// slow enough every pair is, so this is a longest chain. Points of one time may be as far apart as the
    /// shortest time between others allows.
    fn drop_fast(&mut self, t: &[f64], most: f64) {
        let kept = self.kept();
        let chain = self.longest_chain(t, most, &kept);
        kept.iter().zip(chain).filter(|(_, own)| !own).for_each(|(&k, _)| self.why[k] = Some(Dropped::TooFast));
    }

    /// Which of these points are in it.
    fn longest_chain(&self, t: &[f64], most: f64, kept: &[usize]) -> Vec<bool> {
        let steps = kept.windows(2).map(|pair| t[pair[1]] - t[pair[0]]).filter(|step| *step > 0.0);
        let shortest = steps.fold(f64::INFINITY, f64::min);
        let follows = |a: usize, b: usize| {
            let time = t[kept[b]] - t[kept[a]];
            self.distance(kept[a], kept[b]) <= most * if time > 0.0 { time } else { shortest }
        };
        // The length of the longest chain up to each point, its point before, and the longest of all so far.
        let (mut length, mut before, mut longest) = (vec![1_u32; kept.len()], vec![usize::MAX; kept.len()], Vec::new());
        for b in 0..kept.len() {
            for a in (0..b).rev() {
                if length[b] > longest[a] {
                    break;
                }
                if length[a] >= length[b] && follows(a, b) {
                    (length[b], before[b]) = (length[a] + 1, a);
                }
            }
            longest.push(longest.last().copied().unwrap_or(0).max(length[b]));
        }
        let mut chain = vec![false; kept.len()];
        let mut at = (0..kept.len()).rev().max_by_key(|&k| length[k]);
        while let Some(k) = at {
            chain[k] = true;
            at = Some(before[k]).filter(|&k| k != usize::MAX);
        }
        chain
    }

    /// The points of each thing that bears the name of the track, and all others with the first.
    fn things(&self, most: f64) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..self.why.len()).collect();
        let Some(t) = self.batch.parameters(self.i).filter(|_| !self.batch.is_closed(self.i)) else { return vec![all] };
        let is_fix = |k: &usize| t[*k].is_finite() && self.place(*k).iter().all(|x| x.is_finite());
        let mut rest: Vec<usize> = all.into_iter().filter(is_fix).collect();
        let mut thing = vec![0; self.why.len()];
        let mut others = 0;
        let mut first = vec![false; self.why.len()];
        while rest.len() >= TURNS {
            let mut chain = self.longest_chain(t, most, &rest).into_iter();
            let own: Vec<usize> = rest.extract_if(.., |_| chain.next() == Some(true)).collect();
            if !first.contains(&true) {
                own.iter().for_each(|&k| first[k] = true);
                continue;
            }
            let turns = own.windows(2).filter(|pair| first[pair[0]..pair[1]].contains(&true)).count();
            if turns < TURNS {
                break;
            }
            // A receiver without a fix has one place, to the last digit.
            if own.iter().any(|&k| self.place(k) != self.place(own[0])) {
                others += 1;
                own.iter().for_each(|&k| thing[k] = others);
            }
        }
        (0..=others).map(|number| (0..thing.len()).filter(|&k| thing[k] == number).collect()).collect()
    }

    fn drop_outliers(&mut self, t: &[f64]) {
        let kept = self.kept();
        let places: Vec<DVec3> = kept.iter().map(|&k| self.in_space(k)).collect();
        let times: Vec<f64> = kept.iter().map(|&k| t[k]).collect();
        let far = outliers(&places, &times);
        kept.iter().zip(far).filter(|(_, far)| *far).for_each(|(&k, _)| self.why[k] = Some(Dropped::Outlier));
    }

    /// Holds the places of stops.
    fn hold_stops(&mut self, t: &[f64], stops: Stops) {
        let kept = self.kept();
        let mut first = 0;
        while first < kept.len() {
            let near = kept[first..].iter().take_while(|&&k| self.distance(kept[first], k) <= stops.radius).count();
            let stop = &kept[first..first + near];
            let [begin, .., end] = *stop else {
                first += 1;
                continue;
            };
            if t[end] - t[begin] < stops.time {
                first += 1;
                continue;
            }
            let place = self.mean(stop);
            self.moved.extend(stop.iter().map(|&k| (k, place.clone())));
            self.stops += 1;
            first += near;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::batch::distance;

    fn track(points: &[[f64; 2]], t: &[f64]) -> CurveBatch {
        CurveBatch::from_slices(&[points]).unwrap().with_parameters(t.to_vec()).unwrap()
    }

    fn kept(cleaned: &Cleaned) -> Vec<usize> {
        (0..cleaned.dropped.len()).filter(|&k| cleaned.dropped[k].is_none()).collect()
    }

    #[test]
    fn the_most_points_are_kept_that_a_speed_allows() {
        let seed = 4;
        println!("seed {seed}");
        let mut rng = StdRng::seed_from_u64(seed);
        for round in 0..200 {
            let n = 10;
            let t: Vec<f64> = (0..n).map(|k| f64::from(k) + rng.random_range(0.0..0.5)).collect();
            let wild = if round % 2 == 0 { 0.3 } else { 0.7 };
            let place = |k: i32, rng: &mut StdRng| match rng.random_bool(wild) {
                true => [rng.random_range(-20.0..20.0), rng.random_range(-3.0..3.0)],
                false => [f64::from(k), 0.0],
            };
            let points: Vec<[f64; 2]> = (0..n).map(|k| place(k, &mut rng)).collect();
            let slow = |a: usize, b: usize| distance(&points[a], &points[b]) <= 2.5 * (t[b] - t[a]);
            let is_chain = |set: &usize| {
                let own: Vec<usize> = (0..n as usize).filter(|k| set >> k & 1 == 1).collect();
                own.iter().enumerate().all(|(at, &a)| own[at + 1..].iter().all(|&b| slow(a, b)))
            };
            let most = (1..1_usize << n).filter(is_chain).map(usize::count_ones).max().unwrap();
            let cleaning = Cleaning { max_speed: Some(2.5), ..Cleaning::default() };
            let cleaned = clean(&track(&points, &t), &cleaning).unwrap();
            let own = kept(&cleaned);
            assert!(own.windows(2).all(|pair| slow(pair[0], pair[1])), "{own:?}");
            assert_eq!(own.len(), most as usize, "{points:?}");
            assert!(own.iter().enumerate().all(|(at, &k)| cleaned.batch.points(0)[2 * at..][..2] == points[k]));
        }
    }

    #[test]
    fn duplicates_and_blanks_go_as_they_are_told_to() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.5, 3.0], [f64::NAN, 1.0], [3.0, 0.0], [9.0, 9.0]];
        let batch = track(&points, &[0.0, 1.0, 1.0, 2.0, 3.0, f64::NAN]);
        assert!(batch.problem(0).is_some());
        let of = |duplicates: Duplicates| clean(&batch, &Cleaning { duplicates, ..Cleaning::default() });
        let first = of(Duplicates::First).unwrap();
        assert!(first.batch.problem(0).is_none());
        assert_eq!((kept(&first), first.batch.parameters(0)), (vec![0, 1, 4], Some(&[0.0, 1.0, 3.0][..])));
        assert_eq!(of(Duplicates::Mean).unwrap().batch.points(0), [0.0, 0.0, 1.25, 1.5, 3.0, 0.0]);
        assert_eq!(kept(&of(Duplicates::Keep).unwrap()), [0, 1, 2, 4]);
        let error = of(Duplicates::Error).unwrap_err().to_string();
        assert!(error.contains("curve 0, point 2: its time is that of the point before"), "{error}");
        let dropped = first.dropped_points(&batch).unwrap();
        assert_eq!(dropped.parameters(0).map(|t| t[..2].to_vec()), Some(vec![1.0, 2.0]));
        let Values::Texts(why) = &dropped.columns()[0].values else { panic!("words") };
        assert_eq!(why, &["duplicate", "blank", "blank"]);
    }

    #[test]
    fn stops_are_held_at_their_mean_place_for_their_time() {
        let mut points: Vec<[f64; 2]> = (0..5).map(|k| [f64::from(k), 0.0]).collect();
        points.extend([[5.0, 0.0], [5.2, 0.1], [4.9, -0.1], [5.1, 0.0], [5.3, 0.5]]);
        points.extend((6..10).map(|k| [f64::from(k), 0.0]));
        let t: Vec<f64> = (0..points.len()).map(|k| k as f64).collect();
        let stops = |radius: f64, time: f64| Cleaning { stops: Some(Stops { radius, time }), ..Cleaning::default() };
        let cleaned = clean(&track(&points, &t), &stops(0.7, 3.0)).unwrap();
        assert_eq!((cleaned.stops, kept(&cleaned)), (1, (0..14).collect()));
        let held = cleaned.batch.points(0)[10..20].as_chunks::<2>().0;
        let is_held = |place: &[f64; 2]| (place[0] - 5.1).abs() < 1e-12 && (place[1] - 0.1).abs() < 1e-12;
        assert!(held.iter().all(|place| is_held(place) && *place == held[0]), "{held:?}");
        assert_eq!(clean(&track(&points, &t), &stops(0.7, 5.0)).unwrap().stops, 0);
        assert!(clean(&track(&points, &t), &stops(0.0, 5.0)).unwrap_err().to_string().contains("radius of stops is 0"));
    }
}
