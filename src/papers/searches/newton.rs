//! Newton's method of [`Smooth`], reported in the form of the searches.

use glam::DVec2;

use super::{Evolution, Outcome, Record, SegmentCosts, Segments, initial_slopes};
use crate::batch::CurveBatch;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::scf::arc::Arc;
use crate::scf::dots::{Dots, Exponents};
use crate::scf::slopes::{SlopesStanding, Until};
use crate::scf::smooth::Smooth;
use crate::scf::stages::{Found, search, search_on_cpu};
use crate::scf::workspace::Workspace;

impl Smooth {
    /// The search of this method for the slopes of one curve, on the CPU.
    ///
    /// It reports what was reached after every iteration and what that took, like
    /// [`Greedy`](super::Greedy) and [`GaussianAdaptation`](super::GaussianAdaptation).
    ///
    /// Every trial of a step evaluates all segments. Where a search fails, the others that are
    /// tried count too. With several [`starts`](Self::starts) the history is that of the first, and
    /// its last record counts all. The ends of an open curve are free, and their slopes are those
    /// that the segments there take.
    ///
    /// ```
    /// use faircurve::scf::Smooth;
    /// use glam::DVec2;
    ///
    /// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.1]].map(DVec2::from);
    /// let found = Smooth { exponent: 4.0, ..Smooth::default() }.trace(&square, true)?;
    /// assert!(found.settled && found.iterations < 10 && found.segment_solves >= 4 * (1 + found.iterations));
    /// assert!(found.history[0].cost > found.cost);
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// Options that make no sense, a tension, the shape of points, dots that are not finite, and neighbours at one place.
    pub fn trace(&self, points: &[DVec2], closed: bool) -> Result<Outcome> {
        let coords: Vec<[f64; 2]> = points.iter().map(|p| p.to_array()).collect();
        let batch = CurveBatch::from_slices(&[&coords[..]])?.closed(closed);
        self.check(&batch)?;
        if self.tension > 0.0 {
            let tension = self.tension;
            return Err(Error::argument(format!(
                "the tension is {tension}; searches are traced without: leave it out, or use `Smooth::fit`"
            )));
        }
        if self.shape {
            return Err(Error::argument(
                "searches are traced without the shape of points: leave `Smooth::shape` out, or use `Smooth::fit`",
            ));
        }
        let segments = Segments::new(points, closed, self.exponent, &Device::cpu())?.segments();
        let exponents = Exponents::of(self.exponent, &batch)?;
        let dots = Dots::of(&batch, 0, &exponents).map_err(|problem| Error::argument(problem.message))?;
        let mut workspace = Workspace::new(exponents.universal.len());
        let mut run = |options: &Smooth, iterations| {
            let until = Until { tolerance: self.tolerance, iterations };
            let found = search(&options.where_to_start(), &[&dots], &exponents, &mut |dots, exponents, directions| {
                Ok(search_on_cpu(dots, exponents, directions, &until, &mut workspace))
            });
            found.map(|mut found| found.remove(0))
        };
        let slopes = |found: &Found| match &found.directions {
            Some(directions) => ended(directions.clone(), &dots, &exponents),
            None => initial_slopes(points, closed),
        };
        let at = |found: &Found, cost: f64| Record {
            iterations: found.iterations as usize,
            segment_solves: found.evaluations as usize * segments,
            cost,
        };

        let mut evolution = Evolution::new();
        let (once, mut least, mut before) = (Smooth { starts: 1, ..*self }, f64::INFINITY, 0);
        // Every iteration starts from the beginning, because there are few.
        for iterations in 0..=self.max_iterations {
            let found = run(&once, iterations)?;
            if found.evaluations == before {
                break;
            }
            before = found.evaluations;
            least = least.min(found.cost);
            evolution.record(at(&found, least), &slopes(&found));
        }
        let found = run(self, self.max_iterations)?;
        let last = at(&found, found.cost);
        Ok(evolution.finish(slopes(&found), last, found.standing == SlopesStanding::Converged, last.segment_solves))
    }
}

/// Fills in the slopes of free ends, which are NaN.
fn ended(mut directions: Vec<f64>, dots: &Dots, exponents: &Exponents) -> Vec<f64> {
    let last = directions.len() - 1;
    // The segment at the last dot is taken from its other end, and mirrored.
    for (dot, inner, segment, sign) in [(0, 1, 0, 1.0), (last, last - 1, last - 1, -1.0)] {
        if directions[dot].is_nan() {
            let chord = dots.chords.directions[segment];
            let curve = &exponents.universal[dots.curves[segment] as usize];
            let turn = match directions[inner] {
                free if free.is_nan() => 0.0,
                inner => {
                    let angle = sign * crate::scf::start::wrap(inner - chord);
                    let arc = Arc::free(curve, dots.chords.lengths[segment], angle);
                    arc.map_or(f64::NAN, |arc| arc.at(curve, 0.0).0.angle)
                }
            };
            directions[dot] = chord + sign * turn;
        }
    }
    directions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::papers::searches::{Greedy, total_cost};

    const ZIGZAG: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.4], [2.1, 0.1], [3.0, 0.5], [3.9, 0.3]];
    const RING: [[f64; 2]; 5] = [[0.0, 0.0], [1.1, -0.2], [1.8, 0.8], [0.9, 1.7], [-0.3, 1.0]];

    fn dots(closed: bool) -> [[f64; 2]; 5] {
        if closed { RING } else { ZIGZAG }
    }

    #[test]
    fn a_trace_ends_where_the_fit_does_and_its_slopes_cost_that_much() {
        for (exponent, closed, starts) in [(2.0, false, 1), (4.0, true, 1), (20.0, false, 3)] {
            let points = dots(closed).map(DVec2::from);
            let options = Smooth { exponent, starts, ..Smooth::default() };
            let found = options.trace(&points, closed).unwrap();
            let batch = CurveBatch::from_slices(&[&dots(closed)[..]]).unwrap().closed(closed);
            let fit = options.fit(&batch, &Device::cpu()).unwrap();
            assert_eq!(found.cost, fit.reports()[0].energy);
            assert_eq!(found.iterations, fit.reports()[0].iterations as usize);
            assert!(found.settled && found.segment_solves >= starts as usize * 4 * 2, "{exponent} {closed}: {found:?}");
            let mut segments = Segments::new(&points, closed, exponent, &Device::cpu()).unwrap();
            let cost = total_cost(&mut segments, &found.slopes).unwrap();
            assert!((cost / found.cost - 1.0).abs() < 1e-12, "{cost} {}", found.cost);
            assert!(found.history.windows(2).all(|pair| pair[1].cost <= pair[0].cost));
        }
    }

    #[test]
    fn the_greedy_search_finds_no_less_and_nearly_as_little() {
        for closed in [false, true] {
            let points = dots(closed).map(DVec2::from);
            let newton = Smooth::default().trace(&points, closed).unwrap();
            let mut segments = Segments::new(&points, closed, 2.0, &Device::cpu()).unwrap();
            let greedy = Greedy { smallest_step: Some(1e-5), ..Greedy::default() };
            let found = greedy.search(&mut segments, &initial_slopes(&points, closed), &[false; 5]).unwrap();
            let excess = found.cost / newton.cost - 1.0;
            assert!(newton.settled && (-1e-12..1e-8).contains(&excess), "{excess:.1e}");
        }
    }

    #[test]
    fn two_dots_give_the_chord_and_dots_at_one_place_are_refused() {
        let found = Smooth::default().trace(&[DVec2::ZERO, DVec2::ONE], false).unwrap();
        assert_eq!((found.cost, found.slopes), (0.0, vec![std::f64::consts::FRAC_PI_4; 2]));
        let refused = Smooth::default().trace(&[DVec2::ZERO, DVec2::ZERO, DVec2::X], false).unwrap_err().to_string();
        assert_eq!(refused, "dots 0 and 1 are 0 apart: give finite points, each away from the one before");
    }
}
