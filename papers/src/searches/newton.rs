//! The search of [`Smooth`] itself, with its history.

use faircurve::scf::{Smooth, trace::Traced};
use faircurve::{CurveBatch, Device, Error, Result};
use glam::DVec2;

use super::{Evolution, Outcome, Record, SegmentCosts, Segments, initial_slopes};

/// The search of a method for the slopes of one curve, on the CPU.
///
/// It reports what was reached after every iteration and what that took, like
/// [`Greedy`](super::Greedy) and [`GaussianAdaptation`](super::GaussianAdaptation).
///
/// Every trial of a step evaluates all segments. If a search fails, the others that are tried count
/// too. With several [`starts`](Smooth::starts) the history is the first search's, and its last
/// record counts all. The ends of an open curve are free, and their slopes are those that the
/// segments there take.
///
/// ```
/// use faircurve::scf::Smooth;
/// use faircurve_papers::searches::newton;
/// use glam::DVec2;
///
/// let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.1]].map(DVec2::from);
/// let found = newton(&Smooth { exponent: 4.0, ..Smooth::default() }, &square, true)?;
/// assert!(found.settled && found.iterations < 10 && found.segment_solves >= 4 * (1 + found.iterations));
/// assert!(found.history[0].cost > found.cost);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
///
/// Options that make no sense, a tension, the shape of points, dots that are not finite, and
/// neighbours at one place.
pub fn newton(smooth: &Smooth, points: &[DVec2], closed: bool) -> Result<Outcome> {
    let coords: Vec<[f64; 2]> = points.iter().map(|p| p.to_array()).collect();
    let batch = CurveBatch::from_slices(&[&coords[..]])?.closed(closed);
    let refuse = |what: &str| Err(Error::argument(format!("searches are traced without {what}: use `Smooth::fit`")));
    if smooth.tension > 0.0 {
        return refuse("a tension");
    }
    if smooth.shape {
        return refuse("the shape of points");
    }
    let segments = Segments::new(points, closed, smooth.exponent, &Device::cpu())?.segments();
    let slopes = |found: &Traced| found.slopes.clone().unwrap_or_else(|| initial_slopes(points, closed));
    let at = |found: &Traced, cost: f64| Record {
        iterations: found.iterations as usize,
        segment_solves: found.evaluations as usize * segments,
        cost,
    };
    let mut evolution = Evolution::new();
    let (mut least, mut before) = (f64::INFINITY, 0);
    // Every iteration starts from the beginning, because there are few.
    for max_iterations in 0..=smooth.max_iterations {
        let found = Smooth { starts: 1, max_iterations, ..*smooth }.traced(&batch)?;
        if found.evaluations == before {
            break;
        }
        before = found.evaluations;
        least = least.min(found.cost);
        evolution.record(at(&found, least), &slopes(&found));
    }
    let found = smooth.traced(&batch)?;
    let last = at(&found, found.cost);
    Ok(evolution.finish(slopes(&found), last, found.converged, last.segment_solves))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::searches::{Greedy, total_cost};

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
            let found = newton(&options, &points, closed).unwrap();
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
            let newton = newton(&Smooth::default(), &points, closed).unwrap();
            let mut segments = Segments::new(&points, closed, 2.0, &Device::cpu()).unwrap();
            let greedy = Greedy { smallest_step: Some(1e-5), ..Greedy::default() };
            let found = greedy.search(&mut segments, &initial_slopes(&points, closed), &[false; 5]).unwrap();
            let excess = found.cost / newton.cost - 1.0;
            assert!(newton.settled && (-1e-12..1e-8).contains(&excess), "{excess:.1e}");
        }
    }

    #[test]
    fn two_dots_give_the_chord_and_dots_at_one_place_are_refused() {
        let found = newton(&Smooth::default(), &[DVec2::ZERO, DVec2::ONE], false).unwrap();
        assert_eq!((found.cost, found.slopes), (0.0, vec![std::f64::consts::FRAC_PI_4; 2]));
        let refused = newton(&Smooth::default(), &[DVec2::ZERO, DVec2::ZERO, DVec2::X], false).unwrap_err().to_string();
        assert_eq!(refused, "dots 0 and 1 are 0 apart: give finite points, each away from the one before");
    }

    #[test]
    fn tension_and_the_shape_of_points_are_refused() {
        let points = dots(false).map(DVec2::from);
        let refused = |smooth: Smooth| newton(&smooth, &points, false).unwrap_err().to_string();
        let tense = refused(Smooth { tension: 0.5, ..Smooth::default() });
        assert_eq!(tense, "searches are traced without a tension: use `Smooth::fit`");
        let shaped = refused(Smooth { shape: true, ..Smooth::default() });
        assert_eq!(shaped, "searches are traced without the shape of points: use `Smooth::fit`");
    }
}
