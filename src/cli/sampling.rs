//! Where curves are sampled, and how many points that makes.

use faircurve::{CurveBatch, Error, Result, Sampling};

use super::{positive, thousands};

/// Samples per span by default.
const SAMPLES: usize = 16;

/// More samples a span are a mistyped number.
const MOST_SAMPLES: usize = 1_000_000;

/// Segments a span, as `--samples` gives them.
///
/// # Errors
/// A number below 1 or beyond reason.
pub fn per_span(samples: Option<i64>) -> Result<usize> {
    match samples {
        None => Ok(SAMPLES),
        Some(n) if (1..=MOST_SAMPLES as i64).contains(&n) => Ok(n as usize),
        Some(n) => Err(Error::argument(format!(
            "--samples is {n}; 1 to {} segments a span are possible, such as --samples {SAMPLES}",
            thousands(MOST_SAMPLES)
        ))),
    }
}

/// Where curves are sampled: evenly in the parameter or along the arc.
///
/// # Errors
/// A spacing that is not a positive number, or a number of samples out of range.
pub fn sampling(samples: Option<i64>, spacing: Option<f64>) -> Result<Sampling> {
    match spacing {
        None => Ok(Sampling::PerSpan(per_span(samples)?)),
        Some(spacing) => {
            let why = "it must be a positive length in units of the input, such as --spacing 0.5";
            positive("--spacing", spacing, why).map(Sampling::Spacing)
        }
    }
}

/// Points that are read and written together.
pub fn points(batch: &CurveBatch, sampling: Sampling) -> usize {
    let per_span = match sampling {
        Sampling::PerSpan(n) => n,
        // How many they will be is known only after the fit; this many is usual.
        _ => SAMPLES,
    };
    let spans: usize = (0..batch.len()).map(|i| batch.spans(i)).sum();
    batch.total_points().saturating_add(spans.saturating_mul(per_span))
}

/// The number of samples of curve `i`, where it is known before the fit.
pub fn count_of(batch: &CurveBatch, i: usize, sampling: Sampling) -> Option<usize> {
    match sampling {
        Sampling::PerSpan(n) => Some(batch.spans(i).saturating_mul(n) + usize::from(!batch.is_closed(i))),
        Sampling::Count(n) | Sampling::Points(n) => Some(n),
        _ => None,
    }
}
