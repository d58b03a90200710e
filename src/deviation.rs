//! [`Deviation`]: the largest distance between data points and their curve.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::error::{Error, Result, quoted};

/// The largest distance between a data point and the curve.
///
/// Parsed from a number, `0.2`, a percentage of the curve's size, `2%`, or a length with a unit: `50m`,
/// `2km`, `1nmi`, `1mi`, `6ft`, `0.5mm`, `1cm`, `1in`, `2pt` or `2px`.
///
/// ```
/// use faircurve::Deviation;
/// assert_eq!("2%".parse::<Deviation>()?, Deviation::OfSize(0.02));
/// assert_eq!(Deviation::from(0.2), Deviation::Units(0.2));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Deviation {
    /// In units of the coordinates, the same for every curve.
    Units(f64),
    /// As a fraction of each curve's size, the diagonal of the box around its points.
    OfSize(f64),
    /// In metres: on the ground for longitudes and latitudes, else by the
    /// [unit](CurveBatch::metres) of the coordinates. Of the methods only
    /// [`Band`](crate::spline::Band) takes it.
    Metres(f64),
}

/// The most metres of a degree of latitude, and over the cosine of the latitude of one of longitude,
/// on the ellipsoid of WGS84: where it is flattest, at the poles.
const METRES: f64 = 111_694.0;

/// An inch in metres, and a pixel of CSS, which is the unit of SVG.
const INCH: f64 = 0.0254;
pub(crate) const PIXEL: f64 = INCH / 96.0;

/// Units of lengths, in metres.
const LENGTHS: [(&str, f64); 10] = [
    ("km", 1e3),
    ("nmi", 1852.0),
    ("mi", 1609.344),
    ("m", 1.0),
    ("ft", 12.0 * INCH),
    ("in", INCH),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("pt", INCH / 72.0),
    ("px", PIXEL),
];

impl Deviation {
    /// The distance in units of the coordinates for curve `i` of a batch, or for metres in degrees of
    /// latitude if the unit of the coordinates is not known.
    #[must_use]
    pub fn of(self, batch: &CurveBatch, i: usize) -> f64 {
        match self {
            Deviation::Units(distance) => distance,
            Deviation::OfSize(share) => share * Bounds::<3>::of_flat(batch.points(i), batch.dimension()).diagonal(),
            Deviation::Metres(metres) => metres / batch.metres().unwrap_or(METRES),
        }
    }

    /// This distance less another one of the same kind. `None` for two kinds.
    #[must_use]
    pub fn less(self, other: Deviation) -> Option<Deviation> {
        match (self, other) {
            (Deviation::Units(a), Deviation::Units(b)) => Some(Deviation::Units(tidy(a - b))),
            (Deviation::OfSize(a), Deviation::OfSize(b)) => Some(Deviation::OfSize(tidy(a - b))),
            (Deviation::Metres(a), Deviation::Metres(b)) => Some(Deviation::Metres(tidy(a - b))),
            _ => None,
        }
    }

    /// A part or a multiple of this distance.
    #[must_use]
    pub fn times(self, factor: f64) -> Deviation {
        match self {
            Deviation::Units(a) => Deviation::Units(tidy(factor * a)),
            Deviation::OfSize(a) => Deviation::OfSize(tidy(factor * a)),
            Deviation::Metres(a) => Deviation::Metres(tidy(factor * a)),
        }
    }

    /// Its number, whatever the unit.
    #[doc(hidden)]
    #[must_use]
    pub fn number(self) -> f64 {
        let (Deviation::Units(number) | Deviation::OfSize(number) | Deviation::Metres(number)) = self;
        number
    }

    /// Checks that it is a distance in units of the input, or a part of a curve's size.
    ///
    /// # Errors
    /// A number that is not positive or not finite. `remedy` ends the sentence.
    pub(crate) fn check(self, remedy: &str) -> Result<()> {
        let number = self.number();
        if matches!(self, Deviation::Metres(_)) {
            return Err(Error::argument(format!(
                "{self} is a length in metres, which a band takes alone: give a number in units of the input, or within={self}"
            )));
        }
        if number > 0.0 && number.is_finite() {
            return Ok(());
        }
        Err(Error::argument(format!(
            "the largest deviation allowed is {self}; it must be positive and finite: {remedy}"
        )))
    }
}

/// A distance that was computed, with 12 digits: 0.3 − 0.075 is 0.225.
fn tidy(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

impl From<f64> for Deviation {
    fn from(distance: f64) -> Self {
        Deviation::Units(distance)
    }
}

impl FromStr for Deviation {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let number = |text: &str| text.trim().parse::<f64>();
        let metres = LENGTHS.iter().find_map(|(unit, metres)| {
            let number = text.trim().strip_suffix(unit)?.parse::<f64>().ok()?;
            Some(Deviation::Metres(number * metres))
        });
        if let Some(metres) = metres {
            return Ok(metres);
        }
        match text.trim().strip_suffix('%') {
            Some(percent) => number(percent).map(|percent| Deviation::OfSize(percent / 100.0)),
            None => number(text).map(Deviation::Units),
        }
        .map_err(|_| {
            Error::argument(format!(
                "{} is no deviation: give a distance in units of the input, such as 0.01, or a part of each curve's size, such as 2%, or \
                 a length such as 2km or 0.5mm",
                quoted(text)
            ))
        })
    }
}

impl Display for Deviation {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Deviation::Units(distance) => distance.fmt(f),
            // 0.07 is 7.000000000000001 hundredths.
            Deviation::Metres(metres) if metres.abs() >= 1e3 => write!(f, "{}km", metres / 1e3),
            Deviation::Metres(metres) if metres.abs() < 0.1 => write!(f, "{}mm", (1e9 * metres).round() / 1e6),
            Deviation::Metres(metres) => write!(f, "{metres}m"),
            Deviation::OfSize(share) => write!(f, "{}%", (100.0 * share * 1e12).round() / 1e12),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_read_from_what_they_show() {
        for (text, deviation) in [
            ("0.2", Deviation::Units(0.2)),
            ("2%", Deviation::OfSize(0.02)),
            ("7%", Deviation::OfSize(0.07)),
            ("0.5%", Deviation::OfSize(0.005)),
            ("-1", Deviation::Units(-1.0)),
            ("50m", Deviation::Metres(50.0)),
            ("2.5km", Deviation::Metres(2500.0)),
        ] {
            assert_eq!((text.parse::<Deviation>().unwrap(), deviation.to_string()), (deviation, text.to_string()));
        }
        assert_eq!("1nmi".parse::<Deviation>().unwrap(), Deviation::Metres(1852.0));
        for text in ["", "%", "two", "2 m", "m", "2%%"] {
            let error = text.parse::<Deviation>().unwrap_err().to_string();
            assert!(error.contains("is no deviation") && error.contains("such as 2%"), "{error}");
        }
    }

    #[test]
    fn parts_of_a_distance_and_what_is_left_have_few_digits() {
        let (within, tolerance) = (Deviation::Units(0.3), Deviation::Units(0.3).times(0.25));
        assert_eq!(within.less(tolerance).unwrap().to_string(), "0.225");
        assert_eq!(within.less(Deviation::OfSize(0.01)), None);
    }

    #[test]
    fn a_part_of_the_size_is_one_of_the_diagonal_of_each_curve() {
        let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [3.0, 4.0]][..], &[[5.0, 0.0], [5.0, 20.0]]]).unwrap();
        let of = |deviation: Deviation| [0, 1].map(|i| deviation.of(&batch, i));
        assert_eq!(of(Deviation::OfSize(0.02)), [0.02 * 5.0, 0.02 * 20.0]);
        assert_eq!(of(Deviation::Units(0.02)), [0.02; 2]);
    }
}
