//! Cleaning of tracks before they are fitted.

use std::path::{Path, PathBuf};

use clap::Args;
use faircurve::io::{self, WriteOptions};
use faircurve::tracks::{self, Cleaned, Cleaning, Dropped, Duplicates, Stops};
use faircurve::{CurveBatch, Error, Result};

use super::count;
use super::lengths::{self, Length, Speed};
use super::track::time;
use super::words::one_of;

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Cleaning of tracks")]
pub struct CleanArgs {
    /// Drops points that cannot be reached at V from the others, such as 60kn, 100km/h or 30m/s
    ///
    /// The most points are kept between which V is not exceeded. Where others among them take turns with these,
    /// as of two ships of one name, they become a track called NAME.2. A number is in units of the input per
    /// unit of t: metres for longitudes and latitudes, seconds for dates.
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    max_speed: Option<Speed>,
    /// What becomes of points of a track that have the time of another [default: keep]
    #[arg(long, value_name = "HOW", value_parser = one_of(Duplicates::WORDS))]
    duplicates: Option<Duplicates>,
    /// Drops outliers: points 5 times as far as noise from where the points before and after lead
    ///
    /// A point at a sharp turn stays: it lies where the two before it, or the two after it, lead.
    #[arg(long)]
    robust: bool,
    /// Holds stops, at one place, such as 200m,10min: all within R of their first point for DT or longer
    ///
    /// For longitudes and latitudes R is in metres without a unit, too.
    #[arg(long, value_name = "R,DT")]
    stops: Option<String>,
    /// Writes the points that cleaning drops, with a column why
    #[arg(long, value_name = "FILE")]
    dropped: Option<PathBuf>,
}

impl CleanArgs {
    /// The file for dropped points.
    pub fn file(&self) -> Option<&Path> {
        self.dropped.as_deref()
    }

    /// The cleaned tracks and the dropped points, if cleaning was asked for, with what is to be said.
    pub fn clean(&self, batch: CurveBatch) -> Result<(CurveBatch, Option<CurveBatch>, Vec<String>)> {
        if self.max_speed.is_none() && self.duplicates.is_none() && self.stops.is_none() && !self.robust {
            return match &self.dropped {
                Some(file) => Err(Error::argument(format!(
                    "--dropped {} is for points that cleaning drops: add --max-speed, --duplicates, --robust or --stops",
                    file.display()
                ))),
                None => Ok((batch, None, vec![])),
            };
        }
        if !batch.is_empty() && !batch.has_parameters() {
            return Err(Error::argument(
                "tracks are cleaned by their times, and the points have none: give a column t",
            ));
        }
        let cleaning = Cleaning {
            duplicates: self.duplicates.unwrap_or_default(),
            max_speed: self.max_speed.map(|speed| speed.in_units_of("--max-speed", &batch)).transpose()?,
            outliers: self.robust,
            stops: self.stops.as_deref().map(|stops| self::stops(stops, &batch)).transpose()?,
        };
        let given = batch.len();
        let batch = cleaning.max_speed.map_or(batch.clone(), |most| tracks::separate(&batch, most));
        let cleaned = tracks::clean(&batch, &cleaning)?;
        let mut notes = notes(&batch, &cleaned);
        if batch.len() > given {
            let second =
                (0..batch.len()).find(|&i| batch.name(i).ends_with(".2")).map_or(String::new(), |i| batch.label(i));
            let what = format!(
                "{} of several things of one name, too far apart for one: such as {second}",
                count(batch.len() - given, "more track")
            );
            notes.insert(0, what);
        }
        let dropped = cleaned.dropped_points(&batch)?;
        Ok((cleaned.batch, Some(dropped), notes))
    }

    /// Writes the dropped points, if a file for them is given.
    pub fn write(&self, dropped: &CurveBatch, overwrite: bool) -> Result<()> {
        match &self.dropped {
            Some(file) => io::write_with(file, dropped, &WriteOptions { overwrite, ..WriteOptions::default() }),
            None => Ok(()),
        }
    }
}

/// A radius and a time.
fn stops(text: &str, batch: &CurveBatch) -> Result<Stops> {
    let wrong = |why: &str| Error::argument(format!("--stops is {text}; {why}"));
    let (radius, dt) = text.split_once(',').ok_or_else(|| wrong("give a radius and a time, such as 200m,10min"))?;
    let mut radius = radius.parse::<Length>()?;
    lengths::in_units_of(batch, batch.is_geographic(), false, "--stops", &mut radius.0)?;
    Ok(Stops { radius: radius.number(), time: time("--stops", dt.trim(), batch)? })
}

/// What is to be said of a cleaned batch.
fn notes(batch: &CurveBatch, cleaned: &Cleaned) -> Vec<String> {
    let mut notes = Vec::new();
    for (_, why, meaning) in Dropped::WORDS {
        let has_why = |dropped: &Option<Dropped>| *dropped == Some(*why);
        let Some(first) = cleaned.dropped.iter().position(has_why) else { continue };
        let i = batch.offsets().partition_point(|&offset| offset <= first) - 1;
        let place = batch.sentence(i, first - batch.offsets()[i], "");
        let n = cleaned.dropped.iter().filter(|dropped| has_why(dropped)).count();
        let (is, such) = if n == 1 { ("is", "") } else { ("are", "such as ") };
        notes.push(format!("{} {is} dropped, {meaning}: {such}{}", count(n, "point"), place.trim_end_matches(": ")));
    }
    let (is, n) = (if cleaned.stops == 1 { "is" } else { "are" }, cleaned.stops);
    notes.extend((n > 0).then(|| format!("{} {is} held at one place", count(n, "stop"))));
    notes
}
