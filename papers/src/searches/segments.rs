//! [`Segments`]: the costs of smooth connection functions, for the searches.

use std::f64::consts::{PI, TAU};

use faircurve::scf::{Query, evaluate_segments, trace::UnitCosts};
use faircurve::{Device, Error, Result};
use glam::DVec2;

use super::{Request, SegmentCosts};

/// The segments between dots: smooth connection functions of one exponent ν.
///
/// Each costs ∫|κ|^ν ds in units of the input. The slopes at the ends of an open curve are unknowns
/// like all others. Where they are best, the curve ends without curvature.
///
/// ```
/// use faircurve::{CurveBatch, Device, scf};
/// use faircurve_papers::searches::{Greedy, Segments, initial_slopes};
/// use glam::DVec2;
///
/// let dots = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
/// let points = dots.map(DVec2::from);
/// let mut segments = Segments::new(&points, false, 4.0, &Device::cpu())?;
/// let greedy = Greedy { smallest_step: Some(1e-6), ..Greedy::default() };
/// let found = greedy.search(&mut segments, &initial_slopes(&points, false), &[false; 4])?;
/// // Newton's method finds the same curve.
/// let batch = CurveBatch::from_slices(&[&dots[..]])?;
/// let newton = scf::Smooth { exponent: 4.0, ..scf::Smooth::default() }.fit(&batch, &Device::cpu())?;
/// assert!((found.cost / newton.reports()[0].energy - 1.0).abs() < 1e-9);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Segments {
    closed: bool,
    dots: usize,
    device: Device,
    exponent: f64,
    unit: UnitCosts,
    /// The length, the direction and length^{1−ν} of every chord.
    chords: Vec<[f64; 3]>,
}

impl Segments {
    /// The segments between these dots, for an exponent ν above 1.
    ///
    /// A closed curve has one more, from the last dot back to the first.
    ///
    /// # Errors
    ///
    /// [`Error::Argument`] for an exponent that is not above 1, fewer than two dots, dots that are
    /// not finite, and neighbours at one place.
    pub fn new(points: &[DVec2], closed: bool, exponent: f64, device: &Device) -> Result<Self> {
        if !(exponent > 1.0 && exponent.is_finite()) {
            return Err(Error::argument(format!("the exponent is {exponent}; it must be above 1, such as 2")));
        }
        let dots = points.len();
        if dots < 2 {
            return Err(Error::argument(format!("a search for slopes was given {dots} dots: at least two are needed")));
        }
        let count = if closed { dots } else { dots - 1 };
        let chord = |k: usize| {
            let after = (k + 1) % dots;
            let chord = points[after] - points[k];
            let (length, weight) = (chord.length(), chord.length().powf(1.0 - exponent));
            match length > 0.0 && length.is_finite() && weight.is_finite() {
                true => Ok([length, chord.y.atan2(chord.x), weight]),
                false => Err(Error::argument(format!(
                    "dots {k} and {after} are {length} apart: give finite points, each away from the one before"
                ))),
            }
        };
        Ok(Segments {
            closed,
            dots,
            device: device.clone(),
            exponent,
            unit: UnitCosts::new(exponent),
            chords: (0..count).map(chord).collect::<Result<_>>()?,
        })
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
        let angles = |&Request { segment, slopes }: &Request| slopes.map(|slope| wrap(slope - self.chords[segment][1]));
        if self.device.as_gpu().is_some() {
            let query = |request: &Request| {
                let chord = self.chords[request.segment][0];
                Query { chord, angles: angles(request), exponent: self.exponent }
            };
            let queries: Vec<Query> = requests.iter().map(query).collect();
            for (cost, found) in costs.iter_mut().zip(evaluate_segments(&queries, &self.device)?) {
                *cost = found.map_or(f64::INFINITY, |found| found.cost);
            }
            return Ok(());
        }
        // A greedy search requests six segments at a time, which is less work than a universal
        // curve.
        let angles: Vec<[f64; 2]> = requests.iter().map(angles).collect();
        for ((cost, found), request) in costs.iter_mut().zip(self.unit.of(&angles)).zip(requests) {
            let is_finite = request.slopes.iter().all(|slope| slope.is_finite());
            *cost = if is_finite { self.chords[request.segment][2] * found } else { f64::INFINITY };
        }
        Ok(())
    }
}

/// An angle, from −π to π.
fn wrap(angle: f64) -> f64 {
    (angle - TAU * (angle / TAU).round()).clamp(-PI, PI)
}

#[cfg(test)]
mod tests {
    use faircurve::scf::Segment;

    use super::*;
    use crate::searches::{initial_slopes, total_cost};

    #[test]
    fn costs_are_those_of_the_segments_whatever_the_turns_of_their_slopes() {
        let points = [DVec2::ZERO, DVec2::new(1.0, 0.5), DVec2::new(1.5, 2.0), DVec2::new(-0.5, 1.0)];
        for (exponent, closed) in [(2.0, true), (4.0, false), (1.5, true)] {
            let mut segments = Segments::new(&points, closed, exponent, &Device::cpu()).unwrap();
            let mut slopes = initial_slopes(&points, closed);
            let costs: Vec<f64> = (0..segments.segments())
                .map(|k| {
                    let chord = points[(k + 1) % 4] - points[k];
                    let angles = [slopes[k], slopes[(k + 1) % 4]].map(|slope| wrap(slope - chord.to_angle()));
                    Segment::between(chord.length(), angles, exponent).expect("it turns little").cost()
                })
                .collect();
            let wanted: f64 = costs.iter().sum();
            slopes[1] += std::f64::consts::TAU;
            let found = total_cost(&mut segments, &slopes).unwrap();
            assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
        }
    }

    #[test]
    fn a_segment_without_minimiser_costs_infinity_and_spoils_no_other() {
        let points = [DVec2::ZERO, DVec2::X, 2.0 * DVec2::X];
        let mut segments = Segments::new(&points, false, 2.0, &Device::cpu()).unwrap();
        let requests = [[1.7, -1.7], [1.5, -1.4], [f64::NAN, 0.0]];
        let requests = requests.map(|slopes| Request { segment: 1, slopes });
        let mut costs = [0.0; 3];
        segments.costs(&requests, &mut costs).unwrap();
        let wanted = Segment::between(1.0, [1.5, -1.4], 2.0).expect("it turns by less than half a turn").cost();
        assert!((costs[1] / wanted - 1.0).abs() < 1e-12, "{costs:?} {wanted}");
        assert_eq!([costs[0], costs[2]], [f64::INFINITY; 2]);
    }

    #[test]
    fn dots_and_exponents_that_make_no_segments_are_refused_with_a_sentence() {
        let refused = |points: &[DVec2], exponent: f64| {
            Segments::new(points, true, exponent, &Device::cpu()).unwrap_err().to_string()
        };
        assert_eq!(refused(&[DVec2::ZERO, DVec2::X], 1.0), "the exponent is 1; it must be above 1, such as 2");
        assert_eq!(
            refused(&[DVec2::ZERO, DVec2::X, DVec2::X], 2.0),
            "dots 1 and 2 are 0 apart: give finite points, each away from the one before"
        );
        assert!(refused(&[DVec2::ZERO, DVec2::NAN], 2.0).starts_with("dots 0 and 1 are NaN apart"));
        assert_eq!(refused(&[DVec2::ZERO], 2.0), "a search for slopes was given 1 dots: at least two are needed");
    }
}
