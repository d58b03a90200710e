//! The units of what is asked for, once the curves are known: λ where times are dates, and
//! distances of longitudes and latitudes.

use std::fmt::Display;

use faircurve::spline::{Parametrisation, SmoothingTarget};
use faircurve::{CurveBatch, Deviation, Error, Result};

use super::{Method, MethodArgs};
use crate::cli::count;

/// Dates are seconds, and λ of theirs counts hours: it is in the cube of the unit of time.
const HOUR: f64 = 3600.0;

/// Metres of a degree on the Earth, along a meridian.
const DEGREE: f64 = 111_195.0;

impl Method {
    /// The unit of λ in the cubed unit of the parameters.
    pub fn lambda_unit(&self, batch: &CurveBatch) -> f64 {
        let parametrisation = match self {
            Method::Smoothing(smoothing) => smoothing.parametrisation,
            Method::InSurface(spline) => spline.parametrisation,
            _ => return 1.0,
        };
        let is_time = matches!(parametrisation, Parametrisation::Auto | Parametrisation::Given);
        if is_time && batch.has_dates() { HOUR.powi(3) } else { 1.0 }
    }

    /// The method for these curves, with what is to be said of it.
    pub fn for_times_of(mut self, batch: &CurveBatch) -> (Self, Option<String>) {
        let unit = self.lambda_unit(batch);
        let lambda = match &mut self {
            Method::Smoothing(smoothing) => Some(&mut smoothing.target),
            Method::InSurface(spline) => spline.smoothing.as_mut(),
            _ => None,
        };
        let lambda = lambda.and_then(|target| match target {
            SmoothingTarget::Lambda(lambda) => Some(lambda),
            _ => None,
        });
        let note = lambda.filter(|lambda| unit != 1.0 && **lambda > 0.0).map(|lambda| {
            let hours = *lambda;
            *lambda *= unit;
            format!("--smoothing {hours} counts hours, since times are dates: {lambda:e} in seconds")
        });
        (self, note)
    }
}

impl MethodArgs {
    /// Notes of distances that are in degrees, or larger than curves. `spacing` is the spacing of
    /// samples.
    ///
    /// # Errors
    /// A distance in degrees that is larger than all curves, if none is closed.
    pub fn distances(&self, batch: &CurveBatch, spacing: Option<f64>) -> Result<Vec<String>> {
        let units = |deviation: Option<Deviation>| match deviation {
            Some(Deviation::Units(distance)) => Some(distance),
            _ => None,
        };
        let near = [("--deviation", self.deviation), ("--tube", self.tube), ("--within", self.within)]
            .map(|(option, distance)| (option, units(distance)));
        let in_degrees = batch.is_geographic() && !self.surface.is_given();
        let mut notes = Vec::new();
        if in_degrees {
            for (option, distance) in
                near.into_iter().chain([("--corridor", self.limits.corridor()), ("--spacing", spacing)])
            {
                notes.extend(distance.map(|distance| {
                    let ground = on_the_ground(distance);
                    let remedy = if option == "--within" { "" } else { ": with --surface wgs84 it is in metres" };
                    format!("{option} {distance} is in degrees, up to {ground} on the ground{remedy}")
                }));
            }
        }
        let unit = if self.surface.is_globe() { DEGREE } else { 1.0 };
        let Some((option, distance)) = near.into_iter().find_map(|(option, distance)| Some((option, distance?))) else {
            return Ok(notes);
        };
        let size = |i: usize| unit * Deviation::OfSize(1.0).of(batch, i);
        let curves: Vec<usize> = (0..batch.len()).filter(|&i| batch.problem(i).is_none() && size(i) > 0.0).collect();
        let small: Vec<usize> = curves.iter().copied().filter(|&i| size(i) < distance).collect();
        let Some(largest) = small.iter().copied().max_by(|&i, &j| size(i).total_cmp(&size(j))) else {
            return Ok(notes);
        };
        let (name, across) = (batch.name(largest), short(size(largest)));
        if in_degrees && small.len() == curves.len() && !curves.iter().any(|&i| batch.is_closed(i)) {
            return Err(Error::argument(format!(
                "{option} {distance} is in degrees, as longitudes and latitudes are, up to {} on the ground, and no curve is as large: \
                 {name}, the largest, measures {across} degrees; for metres give --surface wgs84 --deviation {distance}, or a \
                 part of each curve's size, such as {option} 2%",
                on_the_ground(distance)
            )));
        }
        let (are, which) = if small.len() == 1 { ("is", ",") } else { ("are", ", the largest of them") };
        let (smaller, all) = (count(small.len(), "curve"), curves.len());
        notes.push(format!(
            "{smaller} of {all} {are} smaller than {option} {distance}{which} {name} of size {across}: little may be left of what they do"
        ));
        Ok(notes)
    }
}

/// Degrees in metres or kilometres.
fn on_the_ground(degrees: f64) -> impl Display {
    let metres = degrees * DEGREE;
    if metres < 1000.0 { format!("{} m", short(metres)) } else { format!("{} km", short(metres / 1000.0)) }
}

/// Three digits.
fn short(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
