//! Shape preservation: finds splines that turn to other sides than their polygons, and refits them.

mod mend;
mod span;
mod start;

use glam::DVec2;

use mend::mend;
use span::{Span, length};
use start::start;

use super::cubic::CubicSplines;
use super::natural::Natural;
use crate::batch::CurveBatch;
use crate::curve::Curve;
use crate::error::{Error, Result};
use crate::parallel;
use crate::report::{CurveReport, LimitReport};
use crate::sides::{self, Asked};
use crate::status::CurveStatus;

/// A constraint is active at a knot if p″ jumps there by more than this part of the largest p″.
///
/// Elsewhere it jumps by at most some 1e-9 of the largest p″.
const HELD: f64 = 1e-6;

/// Jets per span that measure curvature to the wrong side.
const JETS: usize = 32;

/// The refit of a curve whose spline breaks its shape.
enum Refit {
    Found {
        /// p″ at both ends of every span.
        second: Vec<f64>,
        energy: f64,
        iterations: u32,
        decrement: f64,
        converged: bool,
        held: usize,
        /// A point at which two lines of points meet.
        corner: Option<usize>,
    },
    /// No feasible curve was found.
    Infeasible { point: usize, what: String },
}

impl Natural {
    /// Checks that curves of a batch can keep their shape, if that is required.
    pub(super) fn check_shape(&self, batch: &CurveBatch) -> Result<()> {
        if self.shape && batch.dimension() != 2 {
            return Err(Error::argument(
                "natural splines keep the shape of planar curves, and the points have three coordinates: leave z out, or choose \
                 `discrete::Fair`, which keeps the sign of torsion",
            ));
        }
        Ok(())
    }

    /// Refits the splines that break their shape, and completes all reports.
    pub(super) fn keep_shapes(&self, batch: &CurveBatch, splines: &mut CubicSplines, reports: &mut [CurveReport]) {
        let refits = parallel::map(batch.len(), 16, |i| {
            let fitted = !splines.unfitted.contains_key(&i);
            fitted.then(|| self.refit(batch, splines, i)).flatten()
        });
        for (i, refit) in refits.into_iter().enumerate() {
            if splines.unfitted.contains_key(&i) {
                continue;
            }
            let report = &mut reports[i];
            let free = report.energy;
            let mut limits =
                LimitReport { violation: 0.0, active: 0, cost: 0.0, stretch: 1.0, neighbours: 0, touching: 0 };
            match refit {
                None => {}
                Some(Refit::Found { second, energy, iterations, decrement, converged, held, corner }) => {
                    splines.sided.insert(i, second);
                    (report.energy, report.iterations, report.gradient_norm) = (energy, 1 + iterations, decrement);
                    (limits.active, limits.cost) = (held, energy / free - 1.0);
                    if let Some(point) = corner {
                        let what =
                            "two lines of points meet here at an angle, and the curve follows both: it has a corner";
                        report.message = Some(batch.sentence(i, point, what));
                    }
                    if !converged {
                        let what = format!(
                            "after {iterations} iterations no step leads further down: it keeps its shape, and may bend more than it needs to; \
                             remove points that almost coincide"
                        );
                        (report.status, report.message) =
                            (CurveStatus::NotConverged, Some(batch.sentence(i, 0, &what)));
                    }
                }
                Some(Refit::Infeasible { point, what }) => {
                    limits.violation = violation(splines, i);
                    (report.status, report.message) = (CurveStatus::Infeasible, Some(batch.sentence(i, point, &what)));
                }
            }
            limits.stretch = splines.spline(i).length() / batch.chords(i).sum::<f64>();
            report.limits = Some(limits);
        }
    }

    /// The refit of curve `i`; `None` if its spline keeps its shape.
    fn refit(&self, batch: &CurveBatch, splines: &CubicSplines, i: usize) -> Option<Refit> {
        let spline = splines.spline(i);
        let (entries, closed) = (spline.entries, spline.closed);
        let (points, _) = spline.values.as_chunks::<2>();
        let distinct = points.len() - usize::from(spline.closed);
        let asked = sides::of_spans(&points[..distinct], spline.closed);
        let count = asked.len();
        let chord = |k: usize| DVec2::from(points[k + 1]) - DVec2::from(points[k]);
        // At size 1.
        let size = (0..count).map(|k| length(chord(k))).sum::<f64>() / count as f64;
        let time = (spline.t[count] - spline.t[0]) / count as f64;
        let step = |k: usize| (spline.t[k + 1] - spline.t[k]) / time;
        let chords: Vec<DVec2> = (0..count).map(|k| 1.0 / size * chord(k)).collect();
        let (second, _) = spline.second.as_chunks::<2>();
        let moments = |k: usize| [second[k], second[k + 1]].map(|m| time * (time * DVec2::from(m) / size));
        if (0..count).all(|k| keeps(&asked[k], step(k), chords[k], moments(k))) {
            return None;
        }
        let tangents = self.tangents_of(batch, splines.knots(), i);
        let given = tangents.map(|v| v.map(|v| time / size * DVec2::from_slice(v)));
        let natural =
            |knot: usize| !spline.closed && (knot == 0 && given[0].is_none() || knot == count && given[1].is_none());
        // Two lines of points meet at an angle.
        let is_corner = |knot: usize| {
            let [before, after] = [(knot + count - 1) % count, knot % count];
            let meet = (closed || knot > 0 && knot < count) && asked[before].straight && asked[after].straight;
            meet && !sides::goes_on(chords[before].into(), chords[after].into())
        };
        let span = |k: usize, asked: Asked, ends: &dyn Fn(usize) -> bool| {
            let knot = |knot: usize| (!natural(knot) && !ends(knot)).then_some(knot % distinct);
            Span { h: step(k), chord: chords[k], asked, knots: [knot(k), knot(k + 1)] }
        };
        let spans: Vec<Span> = (0..count).map(|k| span(k, asked[k], &is_corner)).collect();
        // Found here again, so that the result is the same bits whatever device found the spline.
        let unasked: Vec<Span> = (0..count).map(|k| span(k, Asked::default(), &|_| false)).collect();
        let spline = mend(&unasked, start(&unasked, spline.closed, given), 1.0)?.derivatives;
        let free: f64 = unasked.iter().map(|span| bending(span.h, span.moments(&spline))).sum();
        let Some(found) = mend(&spans, start(&spans, closed, given), free) else {
            return Some(infeasible(entries, &spans, &given));
        };
        let mut sided = Vec::with_capacity(4 * count);
        let mut energy = 0.0;
        for (k, span) in spans.iter().enumerate() {
            let moments = span.moments(&found.derivatives);
            energy += bending(step(k), moments);
            sided.extend(moments.iter().flat_map(|m| m.to_array()).map(|m| m * size / time / time));
        }
        // The p″ of straight curves is rounding.
        let rounding = HELD * size / time / time;
        let largest = sided.iter().fold(rounding, |most, m| most.max(m.abs()));
        let jumps = |k: &usize| {
            let (end, start) = (4 * ((k + count - 1) % count) + 2, 4 * (k % count));
            (0..2).any(|c| (sided[end + c] - sided[start + c]).abs() > HELD * largest)
        };
        let held = (usize::from(!closed)..count).filter(jumps).count();
        Some(Refit::Found {
            second: sided,
            energy: energy * (size / time) * (size / time) / time,
            iterations: found.iterations,
            decrement: found.decrement,
            converged: found.converged,
            held,
            corner: (0..count).find(|&knot| is_corner(knot)).map(|knot| point_of(entries, knot)),
        })
    }
}

/// Whether a span of p″ = `moments` at its ends has the required sides, all at size 1.
fn keeps(asked: &Asked, h: f64, chord: DVec2, [m, n]: [DVec2; 2]) -> bool {
    let Asked { ends: [start, end], within, straight } = *asked;
    // The outer legs of the Bézier polygon.
    let bent = |m: DVec2, n: DVec2, share: f64| share * h * h / 18.0 * (2.0 * m + n);
    let third = 1.0 / 3.0 * chord;
    let [a, b] = [third + bent(m, n, -1.0), third + bent(n, m, 1.0)];
    if straight {
        let square = chord.dot(chord);
        let in_line = [a, b].iter().all(|leg| leg.perp_dot(chord).abs() <= sides::STRAIGHT * square);
        let (first, last) = (a.dot(chord), b.dot(chord));
        let middle = square - first - last;
        return in_line && first >= 0.0 && last >= 0.0 && middle >= -(first * last).sqrt();
    }
    let (first, last) = (start * a.perp_dot(m), end * b.perp_dot(n));
    // f and l of `mend` are these times h²/6.
    let root = h * h / 3.0 * (first * last).max(0.0).sqrt();
    first >= 0.0 && last >= 0.0 && (within == 0.0 || within * a.perp_dot(b) >= -root)
}

/// h/3 (m·m + m·n + n·n)
fn bending(h: f64, [m, n]: [DVec2; 2]) -> f64 {
    h / 3.0 * (m.dot(m) + m.dot(n) + n.dot(n))
}

/// The largest curvature to the wrong side, in units of 1 over the mean chord.
fn violation(splines: &CubicSplines, i: usize) -> f64 {
    let spline = splines.spline(i);
    let (points, _) = spline.values.as_chunks::<2>();
    let asked = sides::of_spans(&points[..points.len() - usize::from(spline.closed)], spline.closed);
    let chords: f64 = points.windows(2).map(|pair| length(DVec2::from(pair[1]) - DVec2::from(pair[0]))).sum();
    let mean = chords / asked.len() as f64;
    let mut worst = 0.0f64;
    for (k, asked) in asked.iter().enumerate() {
        for jet in 0..=JETS {
            let side = match jet {
                0 => asked.ends[0],
                JETS => asked.ends[1],
                _ => asked.within,
            };
            let jet = spline.jet_at(k, jet as f64 / JETS as f64);
            let speed = jet.first.length();
            let curvature = jet.first.cross(jet.second).z / (speed * speed * speed);
            let broken = if asked.straight { curvature.abs() } else { -side * curvature };
            worst = worst.max(broken * mean);
        }
    }
    worst
}

/// Which given tangent leaves no curve, and which would.
fn infeasible(entries: Option<&[u32]>, spans: &[Span], given: &[Option<DVec2>; 2]) -> Refit {
    let last = spans.len() - 1;
    let point_of = |knot: usize| point_of(entries, knot);
    // Seen from each end, so that the tangent begins the curve.
    let views = [(0, 0, 1.min(last), 1.0), (last + 1, last, last.saturating_sub(1), -1.0)];
    for ((knot, own, next, sign), v) in views.into_iter().zip(given) {
        let Some(v) = v else { continue };
        if spans[own].asked.straight {
            if spans[own].is_along(*v) && v.dot(spans[own].chord) > 0.0 {
                continue;
            }
            let what = "no spline with its tangent keeps its shape: the points lie in a line here, and the tangent leads off it; turn \
                        the tangent along the line, or leave it out";
            return Refit::Infeasible { point: point_of(knot), what: what.into() };
        }
        let side = sign * spans[own].asked.within;
        let leg = spans[own].h / 3.0 * *v;
        let (chord, beyond) = (spans[own].chord, spans[next].chord);
        if side * leg.perp_dot(chord) <= sides::STRAIGHT * length(leg) * length(chord) {
            let [turn, other] = if spans[own].asked.within > 0.0 { ["left", "right"] } else { ["right", "left"] };
            let bound = if sign > 0.0 {
                format!("turns {turn} from here, and must set out to the {other} of the next point")
            } else {
                format!(
                    "turns {turn} up to here, and must arrive heading to the {turn} of the way from the point before"
                )
            };
            let what = format!(
                "no spline with its tangent keeps its shape: the curve {bound}; turn the tangent, or leave it out"
            );
            return Refit::Infeasible { point: point_of(knot), what };
        }
        let reach = side * leg.perp_dot(beyond);
        let most = side * chord.perp_dot(beyond) / reach;
        if reach > 0.0 && most <= 1.0 {
            let what = format!(
                "no spline with its tangent keeps its shape: the tangent leads too far; divide it by more than {:.3}, or leave it out",
                1.0 / most
            );
            return Refit::Infeasible { point: point_of(knot), what };
        }
    }
    let what = "no spline with its tangents keeps its shape: shorten them, or leave one out";
    Refit::Infeasible { point: 0, what: what.into() }
}

/// The first data point at a knot.
fn point_of(entries: Option<&[u32]>, knot: usize) -> usize {
    match entries {
        Some(entries) => entries.iter().position(|&entry| entry as usize == knot).unwrap_or(0),
        None => knot,
    }
}
