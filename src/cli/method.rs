//! The methods and their options, checked before any work is done.

use clap::{Args, ValueEnum};
use faircurve::spline::{Amount, Natural, Smoothing};
use faircurve::{CurveBatch, Device, Error, Fit, Result, Sampling};

/// Samples a span where nothing else is asked for.
const SAMPLES: usize = 16;

/// More samples a span are a mistyped number.
const MOST_SAMPLES: usize = 1_000_000;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum MethodName {
    /// Cubic splines through every point, with no curvature at the ends
    Natural,
    /// Smoothing splines near the points: --smoothing or --deviation says how near
    Smoothing,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Pin {
    /// The first and the last point of open curves stay where they are
    Ends,
    /// Every point may move
    None,
}

/// What is fitted.
#[derive(Args, Debug)]
pub struct MethodArgs {
    /// How curves are fitted
    #[arg(long, value_enum, default_value_t = MethodName::Natural)]
    pub method: MethodName,
    /// Segments a span between data points: K points give N(K−1)+1 points, a closed curve N·K [default: 16]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub samples: Option<i64>,
    /// Which points of open curves smoothing leaves in place [default: ends]
    #[arg(long, value_enum)]
    pin: Option<Pin>,
    /// Smoothing parameter λ ≥ 0: larger is smoother, 0 goes through every point
    #[arg(long, value_name = "λ", conflicts_with = "deviation", allow_negative_numbers = true)]
    smoothing: Option<f64>,
    /// Smooth each curve as far as no point moves more than this, in units of the input
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    deviation: Option<f64>,
}

/// A method with its options.
#[derive(Debug)]
pub enum Method {
    Natural(Natural),
    Smoothing(Smoothing),
}

impl MethodArgs {
    /// The word of the command line.
    pub fn word(&self) -> &'static str {
        match self.method {
            MethodName::Natural => "natural",
            MethodName::Smoothing => "smoothing",
        }
    }

    /// What a caption calls it.
    pub fn title(&self) -> String {
        match (self.method, self.smoothing, self.deviation) {
            (MethodName::Natural, ..) => "natural cubic splines".into(),
            (_, Some(lambda), _) => format!("smoothing splines, λ = {lambda}"),
            (_, _, Some(deviation)) => format!("smoothing splines, deviation ≤ {deviation}"),
            _ => "smoothing splines".into(),
        }
    }

    /// Segments a span.
    ///
    /// # Errors
    /// A number below 1 or beyond reason.
    pub fn per_span(&self) -> Result<usize> {
        match self.samples {
            None => Ok(SAMPLES),
            Some(n) if (1..=MOST_SAMPLES as i64).contains(&n) => Ok(n as usize),
            Some(n) => Err(Error::argument(format!(
                "--samples is {n}; 1 to {MOST_SAMPLES} segments a span are possible, such as --samples {SAMPLES}"
            ))),
        }
    }

    /// The method asked for.
    ///
    /// # Errors
    /// Options that belong to another method, are missing, or are out of range.
    pub fn method(&self) -> Result<Method> {
        match self.method {
            MethodName::Natural => {
                let given = [("--smoothing", self.smoothing), ("--deviation", self.deviation)];
                if let Some((option, Some(value))) = given.into_iter().find(|(_, value)| value.is_some()) {
                    return Err(Error::argument(format!(
                        "{option} {value} belongs to --method smoothing; natural splines go through every point"
                    )));
                }
                if self.pin == Some(Pin::None) {
                    let why = "--pin none belongs to --method smoothing; natural splines go through every point";
                    return Err(Error::argument(why));
                }
                Ok(Method::Natural(Natural::default()))
            }
            MethodName::Smoothing => {
                let amount = match (self.smoothing, self.deviation) {
                    (Some(lambda), _) if lambda >= 0.0 && lambda.is_finite() => Amount::Lambda(lambda),
                    (Some(lambda), _) => {
                        return Err(Error::argument(format!(
                            "--smoothing is {lambda}; λ must be 0 or a positive number, such as --smoothing 0.1"
                        )));
                    }
                    (_, Some(deviation)) if deviation > 0.0 && deviation.is_finite() => Amount::Deviation(deviation),
                    (_, Some(deviation)) => {
                        return Err(Error::argument(format!(
                            "--deviation is {deviation}; it must be a positive number, such as --deviation 0.01"
                        )));
                    }
                    (None, None) => {
                        return Err(Error::argument(
                            "--method smoothing needs to know how far: give --smoothing λ (such as --smoothing 0.1) \
                             or --deviation D (such as --deviation 0.01, in units of the input)",
                        ));
                    }
                };
                let pin_ends = self.pin != Some(Pin::None);
                Ok(Method::Smoothing(Smoothing { amount, pin_ends, ..Smoothing::default() }))
            }
        }
    }
}

impl Method {
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        match self {
            Method::Natural(natural) => natural.fit(batch, device),
            Method::Smoothing(smoothing) => smoothing.fit(batch, device),
        }
    }

    /// Fits and samples on the device.
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        match self {
            Method::Natural(natural) => natural.fit_sampled(batch, sampling, device),
            Method::Smoothing(smoothing) => smoothing.fit_sampled(batch, sampling, device),
        }
    }
}

/// Where curves are sampled: evenly in the parameter or along the arc.
///
/// # Errors
/// A spacing that is not a positive number, or a number of samples out of range.
pub fn sampling(method: &MethodArgs, spacing: Option<f64>) -> Result<Sampling> {
    match spacing {
        None => Ok(Sampling::PerSpan(method.per_span()?)),
        Some(spacing) if spacing > 0.0 && spacing.is_finite() => Ok(Sampling::Spacing(spacing)),
        Some(spacing) => Err(Error::argument(format!(
            "--spacing is {spacing}; it must be a positive length in units of the input, such as --spacing 0.5"
        ))),
    }
}
