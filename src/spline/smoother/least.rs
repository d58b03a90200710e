//! The curve of least bending within a distance of its points: to the normalised programme and
//! back.

use super::{Slot, Smoother, keeps, unsolvable};
use crate::curve::vector;
use crate::report::CurveReport;
use crate::sort;
use crate::spline::tube::{Disc, GAP, Tube};

/// Roundings of the largest coordinate that a distance has to be larger than: closer than that is
/// on the points.
const ROUNDINGS: f64 = 1024.0;

impl Smoother {
    /// The curve of least bending within `allowed` of every point.
    pub(super) fn least(&mut self, slot: &mut Slot, allowed: f64) -> CurveReport {
        let closed = self.problem.closed;
        if !closed && self.solve_line() {
            let deviation = self.deviation(slot).0;
            if keeps(deviation, allowed) {
                return CurveReport { smoothing: None, ..self.keep(slot, 0.0, deviation) };
            }
        }
        if !self.solve(0.0) {
            return unsolvable(slot, &self.data);
        }
        let found = self.deviation(slot);
        let through = CurveReport { smoothing: None, ..self.keep(slot, 0.0, found.0) };
        if !keeps(found.0, allowed) {
            return Self::apart(slot, found, allowed, through);
        }
        let rounding = f64::EPSILON * self.data.iter().fold(0.0, |largest: f64, y| largest.max(y.abs()));
        if allowed <= ROUNDINGS * rounding {
            return through;
        }
        // So that rounding to coordinates breaks nothing.
        let distance = (allowed - 4.0 * rounding) * (1.0 - 16.0 * f64::EPSILON);
        let Some(report) = self.within(slot, distance) else {
            let what = format!("the least curve within {allowed} overflows: the curve goes through its points");
            return slot.not_converged(0, &what, through);
        };
        if self.stands() {
            return report;
        }
        // The least curve is a point, or flat: the best of one λ keeps more of the shape than
        // smaller distances do.
        self.problem.prepare();
        let report = self.search(slot, allowed);
        self.stopped(slot, &format!("the least curve within {allowed}"), report)
    }

    /// The same, of the normalised problem. `None` where the arithmetic overflows.
    fn within(&mut self, slot: &mut Slot, distance: f64) -> Option<CurveReport> {
        let (d, radius) = (self.problem.dimension, distance / self.size);
        let count = self.problem.count;
        let held: Vec<bool> = self.problem.inverse_weights.iter().map(|&inverse| inverse == 0.0).collect();
        let centres: Vec<f64> = self.problem.data.iter().map(|y| y / radius).collect();
        let points = slot.batch.points(slot.curve).chunks_exact(d).enumerate();
        let mut discs: Vec<Disc> = points
            .map(|(k, point)| {
                let (knot, radius) = (slot.knots.entry(slot.curve, k) % count, slot.radius(k));
                let offset = (vector(&self.data[knot * d..][..d]) - vector(point)) / (distance * radius);
                Disc { knot, offset, scale: 1.0 / radius }
            })
            .filter(|disc| !held[disc.knot])
            .collect();
        sort::by(&mut discs, |a, b| a.knot.cmp(&b.knot));
        let closed = self.problem.closed;
        let spans = &self.problem.spans;
        let least = Tube { dimension: d, closed, held: &held, spans, centres: &centres, discs: &discs }.least();
        // The spline through the values found.
        let data = self.problem.data.clone();
        for (y, u) in self.problem.data.iter_mut().zip(&least.moved) {
            *y += radius * u;
        }
        self.problem.prepare();
        let solved = self.problem.solve(0.0);
        self.problem.data = data;
        for (x, u) in self.problem.correction.iter_mut().zip(&least.moved) {
            *x = -radius * u;
        }
        if !self.finish_solve() || !solved {
            return None;
        }
        let deviation = self.deviation(slot).0;
        let mut report = self.keep(slot, 0.0, deviation);
        (report.smoothing, report.iterations, report.gradient_norm) = (None, least.iterations, least.gap);
        if !least.converged {
            let what = format!(
                "after {} iterations its energy may exceed the least by {:.1e} of it, where {GAP:.0e} is allowed: \
                 rounding leaves no more for {count} knots as unevenly spaced as these and a distance of {distance}",
                least.iterations, least.gap
            );
            report = slot.not_converged(0, &what, report);
        }
        Some(report)
    }
}
