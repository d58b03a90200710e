//! The segments between the dots of a curve, as what the searches see of them.

use std::f64::consts::PI;

use glam::DVec2;

use super::{Request, SegmentCosts};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::scf::queries::{Query, evaluate_segments};
use crate::scf::start::{Chords, wrap};

/// Costs of the smooth connection segments between the dots of one curve, all of one exponent: what plugs [`Greedy`](super::Greedy) and
/// [`GaussianAdaptation`](super::GaussianAdaptation) to [`evaluate_segments`], a request of many segments to one call.
///
/// The slopes at the ends of an open curve are unknowns like the others; where they are best the curve starts and ends straight.
///
/// ```
/// use faircurve::Device;
/// use faircurve::scf::search::{Greedy, Segments, initial_slopes};
/// use glam::DVec2;
///
/// let dots = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]].map(DVec2::from);
/// let mut segments = Segments::new(&dots, false, 4.0, &Device::cpu())?;
/// let greedy = Greedy { step: 0.1, smallest_step: Some(1e-4), ..Greedy::default() };
/// let outcome = greedy.search(&mut segments, &initial_slopes(&dots, false), &[false; 4])?;
/// // Newton's method finds 4.763872659.
/// assert!(outcome.cost > 4.763872659 && outcome.cost < 4.76388);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Segments {
    chords: Chords,
    dots: usize,
    closed: bool,
    exponent: f64,
    device: Device,
}

impl Segments {
    /// The segments of ν = `exponent` between these dots, and from the last to the first where `closed`.
    ///
    /// # Errors
    /// [`Error::Argument`] where there are fewer than two dots, two that follow each other are equal or not finite, or the exponent is not
    /// above 1.
    pub fn new(dots: &[DVec2], closed: bool, exponent: f64, device: &Device) -> Result<Self> {
        if dots.len() < 2 {
            return Err(Error::argument(format!(
                "a search for slopes was given {} dots: at least two are needed",
                dots.len()
            )));
        }
        if !(exponent > 1.0 && exponent.is_finite()) {
            return Err(Error::argument(format!("the exponent is {exponent}; it must be above 1, such as 2")));
        }
        let points: Vec<[f64; 2]> = dots.iter().map(|dot| dot.to_array()).collect();
        let chords = Chords::of(&points, closed);
        if let Some(k) = chords.lengths.iter().position(|length| !(*length > 0.0 && length.is_finite())) {
            return Err(Error::argument(format!(
                "the dot after dot {k} is {} away; neighbours must be distinct and finite: leave repeated dots out",
                chords.lengths[k]
            )));
        }
        Ok(Segments { chords, dots: dots.len(), closed, exponent, device: device.clone() })
    }
}

impl SegmentCosts for Segments {
    fn dots(&self) -> usize {
        self.dots
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn costs(&mut self, requests: &[Request], costs: &mut [f64]) -> Result<()> {
        let query = |request: &Request| {
            let k = request.segment;
            // Half a turn, reduced, may round beyond it.
            let angle = |slope: f64| wrap(slope - self.chords.directions[k]).clamp(-PI, PI);
            Query { chord: self.chords.lengths[k], angles: request.slopes.map(angle), exponent: self.exponent }
        };
        let queries: Vec<Query> = requests.iter().map(query).collect();
        let found = evaluate_segments(&queries, &self.device)?;
        for (cost, found) in costs.iter_mut().zip(found) {
            *cost = found.map_or(f64::INFINITY, |found| found.cost);
        }
        Ok(())
    }
}
