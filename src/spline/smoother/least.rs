//! The curve of least bending within a distance of its points: to the normalised programme and back.

use super::{Smoother, Target, keeps, unsolvable};
use crate::report::CurveReport;
use crate::sort;
use crate::spline::tube::{Disc, GAP, Tube};
use crate::status::CurveStatus;

/// Roundings of the largest coordinate that a distance has to be larger than: closer than that is
/// on the points.
const ROUNDINGS: f64 = 1024.0;

impl Smoother {
    /// The curve of least bending within `allowed` of every point.
    pub(super) fn least(&mut self, target: &mut Target, allowed: f64) -> CurveReport {
        let closed = self.problem.closed;
        if !closed && self.solve_line() {
            let deviation = self.deviation(target).0;
            if keeps(deviation, allowed) {
                return CurveReport { smoothing: None, ..self.keep(target, 0.0, deviation) };
            }
        }
        if !self.solve(0.0) {
            return unsolvable(target, &self.data);
        }
        let found = self.deviation(target);
        let through = CurveReport { smoothing: None, ..self.keep(target, 0.0, found.0) };
        if !keeps(found.0, allowed) {
            return self.apart(target, found, allowed, through);
        }
        let rounding = f64::EPSILON * self.data.iter().fold(0.0, |largest: f64, y| largest.max(y.abs()));
        if allowed <= ROUNDINGS * rounding {
            return through;
        }
        // So that rounding to coordinates breaks nothing.
        let distance = (allowed - 4.0 * rounding) * (1.0 - 16.0 * f64::EPSILON);
        let Some(report) = self.within(target, distance) else {
            let what = format!("the least curve within {allowed} overflows: the curve goes through its points");
            let message = Some(target.batch.sentence(target.curve, 0, &what));
            return CurveReport { status: CurveStatus::NotConverged, message, ..through };
        };
        if self.stands() {
            return report;
        }
        // The least curve is a point, or flat: the best of one λ keeps more of the shape than
        // smaller distances do.
        self.problem.prepare();
        let report = self.search(target, allowed);
        self.stopped(target, &format!("the least curve within {allowed}"), report)
    }

    /// The same, of the normalised problem. `None` where the arithmetic overflows.
    fn within(&mut self, target: &mut Target, distance: f64) -> Option<CurveReport> {
        let (d, radius) = (self.problem.dimension, distance / self.size);
        let count = self.problem.count;
        let held: Vec<bool> = self.problem.inverse_weights.iter().map(|&inverse| inverse == 0.0).collect();
        let centres: Vec<f64> = self.problem.data.iter().map(|y| y / radius).collect();
        let entries = target.knots.repeats.get(&target.curve);
        let points = target.batch.points(target.curve).chunks_exact(d).enumerate();
        let mut discs: Vec<Disc> = points
            .map(|(k, point)| {
                let knot = entries.map_or(k, |entries| entries[k] as usize % count);
                let offset = |c: usize| if c < d { (self.data[knot * d + c] - point[c]) / distance } else { 0.0 };
                Disc { knot, offset: std::array::from_fn(offset) }
            })
            .filter(|disc| !held[disc.knot])
            .collect();
        sort::by(&mut discs, |a, b| a.knot.cmp(&b.knot));
        let closed = self.problem.closed;
        let spans = &self.problem.spans;
        let least = Tube { dimension: d, closed, held: &held, spans, centres: &centres, discs: &discs }.least();
        // The spline through the values found.
        let data = self.problem.data.clone();
        self.problem.data.iter_mut().zip(&least.moved).for_each(|(y, u)| *y += radius * u);
        self.problem.prepare();
        let solved = self.problem.solve(0.0);
        self.problem.data = data;
        self.problem.correction.iter_mut().zip(&least.moved).for_each(|(x, u)| *x = -radius * u);
        if !self.finish_solve() || !solved {
            return None;
        }
        let deviation = self.deviation(target).0;
        let mut report = self.keep(target, 0.0, deviation);
        (report.smoothing, report.iterations, report.gradient_norm) = (None, least.iterations, least.gap);
        if !least.converged {
            let what = format!(
                "after {} iterations its energy may exceed the least by {:.1e} of it, where {GAP:.0e} is allowed: \
                 rounding leaves no more for {count} knots as unevenly spaced as these and a distance of {distance}",
                least.iterations, least.gap
            );
            report.status = CurveStatus::NotConverged;
            report.message = Some(target.batch.sentence(target.curve, 0, &what));
        }
        Some(report)
    }
}
