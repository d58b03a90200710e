//! Lengths and speeds with units, once the curves are known.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use faircurve::{CurveBatch, Deviation, Error, Result};

/// A length in units of the input, or in a unit such as mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length(pub Deviation);

impl Length {
    /// Its number, whatever the unit.
    pub fn number(self) -> f64 {
        self.0.number()
    }
}

impl FromStr for Length {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.parse() {
            Ok(Deviation::OfSize(_)) | Err(_) => Err(Error::argument(format!(
                "'{text}' is no length: give a number in units of the input, or a length such as 5mm"
            ))),
            Ok(length) => Ok(Length(length)),
        }
    }
}

impl Display for Length {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Takes a length in metres for one in units of the curves, in which the lengths of a globe are metres.
/// Returns what is to be said of it.
///
/// # Errors
/// Curves whose unit is not known, and longitudes and latitudes on no globe. Where `on_ground`, the method
/// knows what to do with lengths on the ground.
pub fn in_units_of(
    batch: &CurveBatch,
    on_globe: bool,
    on_ground: bool,
    option: &str,
    length: &mut Deviation,
) -> Result<Option<String>> {
    let given = *length;
    let Deviation::Metres(_) = given else { return Ok(None) };
    let unit = if on_globe { Some(1.0) } else { batch.metres() };
    match unit {
        Some(unit) => {
            *length = Deviation::Units(given.times(1.0 / unit).number());
            Ok(Some(format!("{option} {given} is {length} in units of the input")))
        }
        None if batch.is_geographic() && on_ground => Ok(None),
        None if batch.is_geographic() => Err(Error::argument(format!(
            "{option} {given} is a length on the ground, and longitudes and latitudes are in degrees: give degrees, {:.2e} of \
             latitude, or --surface wgs84, with which lengths are in metres",
            length.of(batch, 0)
        ))),
        None => Err(Error::argument(format!(
            "{option} is {given}, and the file does not say the unit of its coordinates: give a number in that unit"
        ))),
    }
}

/// Units of speeds, in metres per second.
const SPEEDS: [(&str, f64); 4] =
    [("km/h", 1.0 / 3.6), ("kn", 1852.0 / 3600.0), ("mph", 1609.344 / 3600.0), ("m/s", 1.0)];

/// A speed: a number in units of the input, or in metres per second.
#[derive(Clone, Copy, Debug)]
pub struct Speed {
    number: f64,
    is_metric: bool,
}

impl FromStr for Speed {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let of = |(unit, metric): &(&str, f64)| Some(text.strip_suffix(unit)?.trim().parse::<f64>().ok()? * metric);
        if let Some(number) = SPEEDS.iter().find_map(of) {
            return Ok(Speed { number, is_metric: true });
        }
        let number = text.parse().map_err(|_| {
            Error::argument(format!("'{text}' is no speed: give one such as 60kn, 100km/h or 30m/s, or a number"))
        })?;
        Ok(Speed { number, is_metric: false })
    }
}

impl Speed {
    /// The speed in units of a batch.
    pub fn in_units_of(self, option: &str, batch: &CurveBatch) -> Result<f64> {
        if !self.is_metric {
            return Ok(self.number);
        }
        let metre = if batch.is_geographic() { Some(1.0) } else { batch.metres() };
        match metre {
            Some(metre) if batch.has_dates() => Ok(self.number / metre),
            Some(_) => Err(Error::argument(format!(
                "{option} has a unit, and times are numbers and no dates: speeds are in metres by their unit"
            ))),
            None => Err(Error::argument(format!(
                "{option} has a unit, and the file does not say the unit of its coordinates: give a number in that unit"
            ))),
        }
    }
}
