//! Fair curves and geodesics, from their options.

use faircurve::discrete::{Energy, Fair, Pins, Segments, bending, geodesic_bending, tautness};
use faircurve::{Error, Result};

use super::{Degrees, KeptCorners, MethodArgs, positive};
use crate::cli::sampling::per_span;

impl MethodArgs {
    /// The turn of corners, in radians.
    fn angle_of_corners(&self) -> Result<Option<f64>> {
        match self.corners {
            None => Ok(None),
            Some(KeptCorners::Above(Degrees(angle))) => Ok(Some(angle.to_radians())),
            Some(KeptCorners::Auto | KeptCorners::Straight) => Err(Error::argument(
                "--corners auto and straight go with --within; for fair curves give an angle, such as 45deg",
            )),
        }
    }

    /// The energy of fair curves.
    pub(super) fn energy(&self) -> Energy {
        match (&self.energy, self.exponent) {
            (Some(weights), exponent) => weights.energy(exponent.unwrap_or(2.0)),
            (None, None) if self.surface.is_given() => geodesic_bending(2.0) + tautness(),
            (None, None) => Fair::default().energy,
            (None, Some(exponent)) if self.surface.is_given() => geodesic_bending(exponent),
            (None, Some(exponent)) => bending(exponent),
        }
    }

    pub(super) fn fair(&self, spacing: Option<f64>) -> Result<Fair> {
        if let Some(lambda) = self.smoothing {
            return Err(Error::argument(format!(
                "--smoothing {lambda} belongs to --method smoothing; fair curves near their points take --deviation D"
            )));
        }
        let deviation = self.deviation.map(|deviation| positive("--deviation", deviation)).transpose()?;
        if let (Some(exponent), Some(weights)) = (self.exponent, &self.energy)
            && !weights.has("bending")
            && !weights.has("geodesic_bending")
        {
            return Err(Error::argument(format!(
                "--exponent {exponent} is that of bending, which --energy does not name: add bending=1, or leave it out"
            )));
        }
        let attached = self.energy.as_ref().is_some_and(|weights| weights.has("attachment"));
        if let Some(deviation) = deviation.filter(|_| attached) {
            return Err(Error::argument(format!(
                "--deviation {deviation} keeps the curve near its points, and so does the attachment of --energy: leave one of both out"
            )));
        }
        let pins = match self.pin {
            Some(Pins::None) => Pins::None,
            _ if attached || deviation.is_some() => Pins::Ends,
            _ => Pins::All,
        };
        let defaults = Fair::default();
        Ok(Fair {
            energy: self.energy(),
            segments: match spacing {
                Some(spacing) => Segments::Spacing(spacing),
                None => Segments::PerSpan(per_span(self.samples)?),
            },
            pins,
            deviation,
            limits: self.limits.limits()?,
            surface: self.surface.surface()?,
            off_surface: self.surface.off_surface(),
            corners: self.angle_of_corners()?,
            solver: self.solver.unwrap_or(defaults.solver),
            tolerance: self.convergence.unwrap_or(defaults.tolerance),
            max_iterations: self.max_iterations.unwrap_or(defaults.max_iterations),
            starts: self.starts.unwrap_or(defaults.starts),
            ..defaults
        })
    }

    /// Geodesics from point to point.
    pub(super) fn geodesic(&self, spacing: Option<f64>) -> Result<Fair> {
        self.refuse_distance("geodesics")?;
        if !self.surface.is_given() {
            return Err(Error::argument("--method geodesic needs a surface: give --surface, such as --surface wgs84"));
        }
        Ok(Fair { energy: geodesic_bending(2.0), pins: Pins::Ends, corners: Some(0.0), ..self.fair(spacing)? })
    }
}
