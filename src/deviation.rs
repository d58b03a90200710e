//! [`Deviation`]: the largest distance between data points and their curve.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::error::{Error, Result, quoted};

/// The largest distance between a data point and the curve.
///
/// Parsed from a number, `0.2`, a percentage of the curve's size, `2%`, or a length on the ground,
/// `50m`, `2km` or `1nmi`.
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
    /// In metres on the ground, for longitudes and latitudes. Of the methods only
    /// [`Band`](crate::spline::Band) takes it.
    Ground(f64),
}

/// The most metres of a degree of latitude, and over the cosine of the latitude of one of longitude,
/// on the ellipsoid of WGS84: where it is flattest, at the poles.
const METRES: f64 = 111_694.0;

/// Units of lengths on the ground, in metres.
const LENGTHS: [(&str, f64); 3] = [("km", 1e3), ("nmi", 1852.0), ("m", 1.0)];

impl Deviation {
    /// The distance in units of the coordinates for curve `i` of a batch. One on the ground is in
    /// degrees of latitude.
    #[must_use]
    pub fn of(self, batch: &CurveBatch, i: usize) -> f64 {
        match self {
            Deviation::Units(distance) => distance,
            Deviation::OfSize(share) => share * Bounds::<3>::of_flat(batch.points(i), batch.dimension()).diagonal(),
            Deviation::Ground(metres) => metres / METRES,
        }
    }

    /// This distance less another one of the same kind. `None` for two kinds.
    #[must_use]
    pub fn less(self, other: Deviation) -> Option<Deviation> {
        match (self, other) {
            (Deviation::Units(a), Deviation::Units(b)) => Some(Deviation::Units(tidy(a - b))),
            (Deviation::OfSize(a), Deviation::OfSize(b)) => Some(Deviation::OfSize(tidy(a - b))),
            (Deviation::Ground(a), Deviation::Ground(b)) => Some(Deviation::Ground(tidy(a - b))),
            _ => None,
        }
    }

    /// A part or a multiple of this distance.
    #[must_use]
    pub fn times(self, factor: f64) -> Deviation {
        match self {
            Deviation::Units(a) => Deviation::Units(tidy(factor * a)),
            Deviation::OfSize(a) => Deviation::OfSize(tidy(factor * a)),
            Deviation::Ground(a) => Deviation::Ground(tidy(factor * a)),
        }
    }

    /// Its number, whatever the unit.
    #[doc(hidden)]
    #[must_use]
    pub fn number(self) -> f64 {
        let (Deviation::Units(number) | Deviation::OfSize(number) | Deviation::Ground(number)) = self;
        number
    }

    /// Checks that it is a distance in units of the input, or a part of a curve's size.
    ///
    /// # Errors
    /// A number that is not positive or not finite. `remedy` ends the sentence.
    pub(crate) fn check(self, remedy: &str) -> Result<()> {
        let number = self.number();
        if matches!(self, Deviation::Ground(_)) {
            return Err(Error::argument(format!(
                "{self} is a length on the ground, which a band takes alone: give a number in units of the input, or \
                 within={self}"
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
        let on_ground = LENGTHS.iter().find_map(|(unit, metres)| {
            let number = text.trim().strip_suffix(unit)?.parse::<f64>().ok()?;
            Some(Deviation::Ground(number * metres))
        });
        if let Some(on_ground) = on_ground {
            return Ok(on_ground);
        }
        match text.trim().strip_suffix('%') {
            Some(percent) => number(percent).map(|percent| Deviation::OfSize(percent / 100.0)),
            None => number(text).map(Deviation::Units),
        }
        .map_err(|_| {
            Error::argument(format!(
                "{} is no deviation: give a distance in units of the input, such as 0.01, or a part of each curve's size, such as 2%, or \
                 for --within and longitudes and latitudes a length on the ground, such as 2km",
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
            Deviation::Ground(metres) if metres.abs() >= 1e3 => write!(f, "{}km", metres / 1e3),
            Deviation::Ground(metres) => write!(f, "{metres}m"),
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
            ("50m", Deviation::Ground(50.0)),
            ("2.5km", Deviation::Ground(2500.0)),
        ] {
            assert_eq!((text.parse::<Deviation>().unwrap(), deviation.to_string()), (deviation, text.to_string()));
        }
        assert_eq!("1nmi".parse::<Deviation>().unwrap(), Deviation::Ground(1852.0));
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
