//! [`Sampling`]: where curves are sampled, and how many samples there may be.

use crate::batch::CurveBatch;
use crate::error::{Error, Result, short};
use crate::memory::{self, number};

/// Where a curve is sampled.
///
/// A closed curve has at least three distinct samples, so that they have an area, unless it is a
/// point.
///
/// An unfitted curve has its data points as samples, except for [`Points`](Self::Points): then its
/// polyline is sampled, a single point is repeated, and coordinates that are not finite give NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Sampling {
    /// N segments of equal parameter length per span between data points.
    ///
    /// K points give N(K−1)+1 samples, a closed curve N·K.
    PerSpan(usize),
    /// This many samples per curve, at equal steps of the parameter. A closed curve does not repeat
    /// its first sample.
    Count(usize),
    /// This many samples per curve, at equal arc lengths. A closed curve does not repeat its first
    /// sample.
    Points(usize),
    /// Samples at equal arc length.
    ///
    /// The spacing is the largest up to this (in the units of the input) that divides the length
    /// evenly. Curves get at most [`MOST_SAMPLES`](Sampling::MOST_SAMPLES). See
    /// [`check`](Sampling::check).
    Spacing(f64),
    /// As few samples as keep every point of the polyline within this distance of the curve, and of
    /// the curve within it of the polyline (units of the samples, > 0).
    ///
    /// Corners are samples, and so are the ends of open curves.
    Tolerance(f64),
    /// As [`Tolerance`](Self::Tolerance), and down to a tenth of it for as long as a curve has no more
    /// samples than half its spans. A closed curve is within 1/120 of its length, so that small ones stay round.
    AsMany(f64),
}

impl Sampling {
    /// The most samples by a spacing, of all curves together.
    ///
    /// In 3-D they take 640 MB with their parameters, and twice that while they are assembled.
    pub const MOST_SAMPLES: usize = 20_000_000;

    /// The largest distance between a curve and its samples, if it is given.
    pub(crate) fn tolerance(self) -> Option<f64> {
        match self {
            Sampling::Tolerance(tolerance) | Sampling::AsMany(tolerance) => Some(tolerance),
            _ => None,
        }
    }

    /// Checks the number of samples before a fit. Fits that sample do so.
    ///
    /// # Errors
    /// - A spacing or a tolerance that is not positive and finite.
    /// - Chords longer than [`MOST_SAMPLES`](Self::MOST_SAMPLES) spacings, over all curves.
    /// - Samples that take more than the free memory, if the system reports it.
    pub fn check(self, batch: &CurveBatch) -> Result<()> {
        self.check_with(batch, 0)
    }

    /// [`check`](Self::check) of samples with `columns` columns.
    pub(crate) fn check_with(self, batch: &CurveBatch, columns: usize) -> Result<()> {
        let bytes = sample_bytes(batch, columns);
        match self {
            Sampling::Spacing(spacing) => check_spacing(batch, spacing, "samples", Self::MOST_SAMPLES, bytes),
            Sampling::PerSpan(n) => memory::check(n as f64 * spans(batch), bytes, &format!("{n} samples a span"), n),
            Sampling::Count(n) | Sampling::Points(n) => {
                memory::check(n as f64 * batch.len() as f64, bytes, &format!("{n} samples a curve"), n)
            }
            Sampling::Tolerance(tolerance) | Sampling::AsMany(tolerance)
                if !(tolerance > 0.0 && tolerance.is_finite()) =>
            {
                Err(Error::argument(format!("the tolerance of samples is {tolerance}; it must be a positive length")))
            }
            Sampling::Tolerance(_) | Sampling::AsMany(_) => Ok(()),
        }
    }
}

/// Bytes per sample: coordinates, the parameter and columns, twice while samples are assembled.
pub(crate) fn sample_bytes(batch: &CurveBatch, columns: usize) -> usize {
    2 * 8 * (batch.dimension() + 1 + columns)
}

/// Number of spans of all curves without a problem.
pub(crate) fn spans(batch: &CurveBatch) -> f64 {
    (0..batch.len()).filter(|&i| batch.problem(i).is_none()).map(|i| batch.spans(i) as f64).sum()
}

/// Refuses a spacing that makes more than `most` items, or more than fit into memory, with `bytes`
/// bytes each.
///
/// Lengths are estimated from below by chords.
pub(crate) fn check_spacing(batch: &CurveBatch, spacing: f64, what: &str, most: usize, bytes: usize) -> Result<()> {
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(Error::argument(format!(
            "the spacing is {spacing}; it must be a positive length in units of the input, such as 0.5"
        )));
    }
    let chords = |i: usize| if batch.problem(i).is_some() { 0.0 } else { batch.chords(i).sum::<f64>() };
    let lengths: Vec<f64> = (0..batch.len()).map(chords).collect();
    // The sum of the quotients, since the sum of the lengths may overflow.
    let count: f64 = lengths.iter().map(|length| length / spacing).sum();
    let Some((most, limit)) = excess(count, bytes, most) else { return Ok(()) };
    let longest = (0..lengths.len()).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
    let (length, name) = (lengths[longest], batch.label(longest));
    let least = lengths.iter().map(|length| length / most).sum::<f64>();
    Err(Error::argument(format!(
        "a spacing of {} makes {} {what} of curve {name}, whose points are {length:.4e} apart one after the other, and \
         {} of all curves, which {limit}: give a spacing of {} or more",
        short(spacing),
        number(length / spacing),
        number(count),
        rounded_up(least)
    )))
}

/// If `count` items exceed `most` or the free memory: the possible number, and the end of the
/// sentence about it.
pub(crate) fn excess(count: f64, bytes: usize, most: usize) -> Option<(f64, String)> {
    let (most, bytes) = (most as f64, bytes as f64);
    let fit = if count * bytes > memory::SMALL_BYTES { memory::most(bytes as usize) } else { f64::INFINITY };
    if count <= fit.min(most) {
        return None;
    }
    let limit = match fit < most {
        true => format!("{} are free", memory::mib(fit * bytes)),
        false => format!("{} of all are possible", number(most)),
    };
    // Less than the free memory, since other programs need some.
    Some((most.min(0.9 * fit), format!("take {} of memory, and {limit}", memory::mib(count * bytes))))
}

/// Rounded up to two digits, for a sentence.
pub(crate) fn rounded_up(x: f64) -> String {
    let unit = 10f64.powi(x.log10().floor() as i32 - 1);
    let digits = (x / unit).ceil();
    format!("{digits}e{}", x.log10().floor() as i32 - 1).parse::<f64>().map_or_else(|_| short(x), short)
}
