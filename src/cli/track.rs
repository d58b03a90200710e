//! Tracks: what travels along, gaps, and samples at times.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use faircurve::ground::check_samples;
use faircurve::io::{self, Carried, Format};
use faircurve::surface::Surface;
use faircurve::tracks::{self, At, Easing, Quantity};
use faircurve::{Column, CurveBatch, Error, Fit, Result, Sampling, Values};
use jiff::{Span, SpanRelativeTo, Unit};

use super::count;
use super::given::Given;
use super::lengths::Speed;
use super::sampling::count_of;
use super::words::one_of;

#[derive(Args, Clone, Debug)]
pub struct TrackArgs {
    #[command(flatten)]
    given: Given,
    /// Other columns of a CSV file that travel along: all, or names
    ///
    /// Numbers are interpolated. COG, course, heading, and what has :angle after its name are
    /// angles in degrees, which go the short way round. What has :smooth at its end is interpolated
    /// by monotone cubics in place of lines, as in scale:smooth,turn:angle:smooth. Texts, and what has
    /// :nearest after its name, have the value of the nearest point. Values that are equal in all rows
    /// of a curve stay as they are.
    #[arg(long, value_name = "all|COLUMN,...", help_heading = "Tracks")]
    carry: Option<Carried>,
    /// Cuts tracks where times are more than DT apart
    ///
    /// DT is a number in units of t, or a time such as 10min, 2h or 1d where t holds dates.
    #[arg(long, value_name = "DT", allow_negative_numbers = true, help_heading = "Tracks")]
    gap: Option<String>,
    /// Samples at every multiple of DT within the times of each curve, such as 1h
    #[arg(long, value_name = "DT", allow_negative_numbers = true, conflicts_with_all = ["samples", "spacing", "points", "at"], help_heading = "Tracks")]
    every: Option<String>,
    /// Samples at the times of a file: a column t, and a column curve for times of single curves
    #[arg(long, value_name = "FILE", conflicts_with_all = ["samples", "spacing", "points"], help_heading = "Tracks")]
    at: Option<PathBuf>,
    /// A column that says how the curve passes from each point to the next, with --every or --at
    ///
    /// Its words come from CSS: linear, ease, ease-in, ease-out, ease-in-out,
    /// cubic-bezier(x1 y1 x2 y2), and hold, which waits for the next point. Columns are eased, too. It
    /// is not written.
    #[arg(long, value_name = "COLUMN", help_heading = "Tracks")]
    ease: Option<String>,
    /// N samples of each curve at equal arc lengths
    #[arg(long, value_name = "N", conflicts_with_all = ["samples", "spacing"], help_heading = "Output")]
    points: Option<usize>,
    /// Writes more columns, into CSV, NPZ and TRK
    #[arg(long, value_name = "QUANTITY,...", value_delimiter = ',', value_parser = one_of(Quantity::WORDS), help_heading = "Output")]
    write: Vec<Quantity>,
    /// The unit of --write speed, where lengths are in metres and times are dates
    #[arg(long, value_name = "UNIT", value_parser = ["km/h", "kn", "mph", "m/s"], help_heading = "Output")]
    units: Option<String>,
}

/// Where curves are sampled, as far as that is known before they are read.
enum Places {
    Along(Sampling),
    Every(f64),
    Times(Vec<Vec<f64>>),
}

/// What is written of tracks, and where.
pub struct Samples<'a> {
    places: Places,
    quantities: &'a [Quantity],
    easings: Vec<Easing>,
    /// What speeds are divided by.
    speed_unit: f64,
}

impl TrackArgs {
    /// The columns that travel along.
    pub fn carried(&self) -> Result<Carried> {
        let carry = self.carry.clone().unwrap_or_default();
        match &self.ease {
            Some(column) => Ok(format!("{column}:nearest").parse::<Carried>()?.and(carry)),
            None => Ok(carry),
        }
    }

    /// Samples along the curve, where --points asks for them.
    pub fn sampling(&self) -> Result<Option<Sampling>> {
        match self.points {
            None => Ok(None),
            Some(n) if n >= 2 => Ok(Some(Sampling::Points(n))),
            Some(n) => Err(Error::argument(format!("--points is {n}; a curve has two ends: give 2 or more"))),
        }
    }

    /// Checks what can be checked before anything is read. `beziers` are written, or this format.
    pub fn check(&self, beziers: bool, format: Option<Format>) -> Result<()> {
        if let Some(option) = self.given().filter(|_| beziers) {
            return Err(Error::argument(format!("--as bezier writes the curves themselves: leave {option} out")));
        }
        match format {
            Some(format) if !self.write.is_empty() && !format.has_columns() => {
                let with = Format::ALL.iter().filter(|format| format.has_columns()).map(|format| format.title());
                let (title, with) = (format.title(), with.collect::<Vec<_>>().join(", "));
                Err(Error::argument(format!("--write makes columns, and {title} has none: write {with}")))
            }
            _ => Ok(()),
        }
    }

    /// The first option that asks for something of samples, but for columns of whole curves.
    pub fn given_for(&self, batch: &CurveBatch) -> Option<String> {
        let is_of_curves = |option: &String| option == "--carry" && batch.has_constant_columns();
        self.given.of::<Self>().into_iter().find(|option| option != "--gap" && !is_of_curves(option))
    }

    /// The first option that asks for something of samples.
    pub fn given(&self) -> Option<String> {
        self.given.of::<Self>().into_iter().find(|option| option != "--gap")
    }

    /// Cuts tracks where they pause, if that is asked for.
    pub fn split(&self, batch: CurveBatch) -> Result<CurveBatch> {
        match &self.gap {
            None => Ok(batch),
            Some(gap) => tracks::split(&batch, time("--gap", gap, &batch)?),
        }
    }

    /// The easing of every point, or none, and the curves without their column.
    pub fn easings(&self, batch: CurveBatch) -> Result<(CurveBatch, Vec<Easing>)> {
        let Some(name) = &self.ease else { return Ok((batch, vec![])) };
        if self.every.is_none() && self.at.is_none() {
            return Err(Error::argument("--ease is of times between points: add --every DT or --at FILE"));
        }
        let (own, others): (Vec<_>, Vec<_>) =
            batch.columns().iter().cloned().partition(|column: &Column| column.name == *name);
        let Some(Values::Texts(words)) = own.first().map(|column| &column.values) else {
            return Err(Error::argument(format!("--ease is {name}, and the points have no such column of words")));
        };
        let mut easings = Vec::with_capacity(words.len());
        for i in 0..batch.len() {
            for (k, word) in words[batch.offsets()[i]..batch.offsets()[i + 1]].iter().enumerate() {
                easings.push(word.parse().map_err(|error| {
                    Error::argument(format!("column {name}: {}", batch.sentence(i, k, &format!("{error}"))))
                })?);
            }
        }
        Ok((batch.with_columns(others)?, easings))
    }

    /// What is to be sampled where, if more is asked for than points along the curve.
    pub fn samples(&self, batch: &CurveBatch, sampling: Sampling, easings: Vec<Easing>) -> Result<Option<Samples<'_>>> {
        let places = match (&self.every, &self.at) {
            (Some(every), _) => Places::Every(time("--every", every, batch)?),
            (_, Some(path)) => Places::Times(io::read_times(path)?.of(batch)?),
            _ if self.write.is_empty() && batch.columns().is_empty() => return Ok(None),
            _ => Places::Along(sampling),
        };
        let unit = self.units.as_ref().map(|unit| Speed::from_str(&format!("1{unit}"))?.in_units_of("--units", batch));
        Ok(Some(Samples { places, quantities: &self.write, easings, speed_unit: unit.transpose()?.unwrap_or(1.0) }))
    }
}

impl Samples<'_> {
    /// What is to be said of times that several places of a curve have.
    pub fn note(&self, batch: &CurveBatch) -> Option<String> {
        if matches!(self.places, Places::Along(_)) && !self.quantities.contains(&Quantity::Speed) {
            return None;
        }
        let d = batch.dimension();
        let repeated = |i: usize| {
            let (t, points) = (batch.parameters(i)?, batch.points(i));
            let differ = |k: usize| points[(k - 1) * d..k * d] != points[k * d..(k + 1) * d];
            (1..t.len()).find(|&k| batch.problem(i).is_none() && t[k] == t[k - 1] && differ(k)).map(|k| (i, k))
        };
        let all: Vec<_> = (0..batch.len()).filter_map(repeated).collect();
        let (i, k) = *all.first()?;
        let curves = if all.len() == 1 { "1 curve has".into() } else { format!("{} curves have", all.len()) };
        let place = batch.sentence(i, k, "its time is that of the point before");
        Some(format!("{curves} several places at one time, of which a sample at that time has one: {place}"))
    }

    /// The number of samples of curve `i`, where it is known before the fit.
    pub fn count(&self, batch: &CurveBatch, i: usize) -> Option<usize> {
        match self.at() {
            At::Along(sampling) => count_of(batch, i, sampling),
            at => {
                let t = batch.parameters(i)?;
                let end = t.last()? + batch.closing_span(i).unwrap_or(0.0);
                tracks::times(batch, i, &at, [t[0], end]).map(|times| times.len())
            }
        }
    }

    /// Checks, before the fit, that the samples can be had. Spacings are lengths in the surface.
    pub fn check(&self, batch: &CurveBatch, surface: Option<&dyn Surface>) -> Result<()> {
        tracks::check(batch, &self.at(), self.quantities)?;
        match self.at() {
            At::Along(sampling) => check_samples(sampling, batch, surface, tracks::columns_out(batch, self.quantities)),
            _ => Ok(()),
        }
    }

    /// What is worth a line about curves without times where samples at times are asked for.
    pub fn note_of_untimed(&self, batch: &CurveBatch) -> Option<String> {
        let untimed: Vec<usize> = match self.places {
            Places::Along(_) => vec![],
            _ => (0..batch.len()).filter(|&i| batch.parameters(i).is_none()).collect(),
        };
        let first = batch.label(*untimed.first()?);
        let have = format!("{} {}", count(untimed.len(), "curve"), if untimed.len() == 1 { "has" } else { "have" });
        Some(format!("{have} no times, such as {first}: points stay as they are"))
    }

    /// The samples of a fit.
    pub fn of(&self, batch: &CurveBatch, fit: &Fit) -> Result<CurveBatch> {
        let samples = tracks::sample_eased(batch, fit, &self.at(), self.quantities, &self.easings)?;
        let mut columns = samples.columns().to_vec();
        for column in &mut columns[batch.columns().len()..] {
            if let Values::Numbers(speeds) = &mut column.values
                && column.name.ends_with("speed")
            {
                speeds.iter_mut().for_each(|speed| *speed /= self.speed_unit);
            }
        }
        samples.with_columns(columns)
    }

    fn at(&self) -> At<'_> {
        match &self.places {
            Places::Along(sampling) => At::Along(*sampling),
            Places::Every(step) => At::Every(*step),
            Places::Times(times) => At::Times(times),
        }
    }
}

/// A length of time: a number in units of t, or with units where t holds dates.
pub fn time(option: &str, text: &str, batch: &CurveBatch) -> Result<f64> {
    let wrong = |why: &str| Error::argument(format!("{option} is {text}; {why}"));
    let positive = |t: f64| match t > 0.0 && t.is_finite() {
        true => Ok(t),
        false => Err(wrong("a length of time must be positive, such as 1h")),
    };
    if let Ok(number) = text.parse() {
        return positive(number);
    }
    let span: Span =
        text.parse().map_err(|_| wrong("it must be a number or a time such as 90s, 10min, 1h30min or 1d"))?;
    if !batch.has_dates() {
        return Err(wrong("the times of the curves are numbers and no dates: give a number in their units"));
    }
    let seconds = span.total((Unit::Second, SpanRelativeTo::days_are_24_hours()));
    positive(seconds.map_err(|_| wrong("months and years differ in length: give days"))?)
}
