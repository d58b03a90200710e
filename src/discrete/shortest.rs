//! The shortest curves of bounded curvature: length as the only energy, subject to a largest
//! curvature.
//!
//! Such a curve is straight or turns at the bound everywhere, so there is no second derivative to
//! descend along. It is a chain of [`Dubins`] paths, whose only unknowns are the directions at the
//! data points. The host finds them in f64, on every device.

mod dubins;
mod headings;

use dubins::{Dubins, Place};
use glam::DVec3;
use headings::{Leg, shortest};

use super::curves::{EvenVertices, FairCurves, Fitted, Tangents, Vertices};
use super::energy::{Functional, length};
use super::fair::{Fair, Segments};
use super::limits::{Limits, Span};
use super::setup::{PreparedCurve, SplineStarts};
use super::starts::set_up_at;
use super::tally::Tally;
use crate::batch::{CurveBatch, Unfitted};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, add, scale};
use crate::parallel;
use crate::precision::Precision;
use crate::report::{CurveReport, LimitReport};
use crate::status::CurveStatus;

/// Whether the options ask for the shortest curves of bounded curvature.
pub(super) fn is_asked_for(fair: &Fair, batch: &CurveBatch) -> bool {
    fair.energy.order() == 1 && !fair.limits.is_empty(batch)
}

/// Checks that these options have a shortest curve of bounded curvature.
///
/// # Errors
/// An energy other than length, limits of other kinds, curves in space.
pub(super) fn check(fair: &Fair, batch: &CurveBatch) -> Result<()> {
    let mut terms = fair.energy.terms().iter().filter(|(weight, _)| *weight > 0.0);
    let is_length = terms.all(|(_, functional)| matches!(functional, Functional::Length(_)));
    let what = if !is_length || fair.deviation.is_some() {
        "are polygons, which have corners"
    } else if batch.dimension() == 3 {
        "with a largest curvature are known in the plane alone"
    } else if !fair.limits.bounds_curvature_alone(batch) {
        "keep a largest curvature and a largest stretch, and no other limit"
    } else if batch.constraints().curvatures.is_some() {
        "turn as tightly as they may or not at all, and keep no curvature vectors"
    } else {
        return Ok(());
    };
    let ask = "limits ask for an energy that holds bending or variation";
    Err(Error::argument(format!("curves of least {} {what}: {ask}", fair.energy)))
}

/// Finds the shortest curves of bounded curvature.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    kept: &[[bool; 2]],
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Fitted> {
    let starts = SplineStarts::new(fair, batch)?;
    let found = parallel::map(batch.len(), 1, |i| {
        let ready = starts.prepare::<D>(i, kept.get(i).copied().unwrap_or_default(), None);
        let found = ready.and_then(|ready| fit_one(fair, batch, i, &ready));
        tally.finished(i);
        match found {
            Ok((report, vertices)) => (report, Some(vertices)),
            Err(Unfitted { status, message }) => (CurveReport::unfitted(status, message), None),
        }
    });
    let (reports, curves): (_, Vec<_>) = found.into_iter().unzip();
    let mut device = device.report_of(Precision::F64);
    if device.is_gpu {
        device.finished_on_cpu = curves.iter().flatten().count();
    }
    Ok(Fitted { curves, even: EvenVertices::default(), reports, device })
}

fn fit_one<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    ready: &PreparedCurve<D>,
) -> std::result::Result<(CurveReport, Vertices), Unfitted> {
    let points = batch.points(i).as_chunks::<D>().0;
    let spans = fair.limits.spans_of(batch, i, &ready.rows);
    let leg = |(span, bound): &(Span, f64)| {
        let [from, to] = [span.point, span.next].map(|k| points[k]);
        let chord = std::array::from_fn(|c| (to[c] - from[c]) / ready.size);
        Leg { chord, radius: 1.0 / (bound * ready.size) }
    };
    let legs: Vec<Leg> = spans.iter().map(leg).collect();
    let starts = spans.iter().map(|(span, _)| span.rows[0]);
    let end = (!batch.is_closed(i)).then(|| ready.vertices.len() - 1);
    let given: Vec<Option<f64>> = starts.chain(end).map(|row| direction(batch, i, ready, row)).collect();
    let Some((paths, rounds)) = shortest(&legs, &given) else {
        let what = "the shortest curve of bounded curvature leaves the range of the numbers, since its circles are too large for \
                    its points: allow a larger curvature";
        return Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, 0, what) });
    };
    let length = ready.size * paths.iter().map(Dubins::length).sum::<f64>();
    let chords: f64 = batch.chords(i).sum();
    let (vertices, active) = laid(fair, batch, i, ready, &paths);
    let energy = fair.energy.terms().iter().map(|(weight, _)| weight * length).sum();
    let stretch = length / chords;
    let violation = fair.limits.stretch.map_or(0.0, |most| (stretch / most - 1.0).max(0.0));
    let mut report = CurveReport {
        iterations: rounds,
        limits: Some(LimitReport { violation, active, cost: stretch - 1.0, stretch, neighbours: 0, touching: 0 }),
        ..CurveReport::solved(energy)
    };
    if violation > 0.0 {
        let what = format!(
            "the shortest curve of bounded curvature through its points is {stretch:.6} times as long as their polygon: \
             allow a stretch of {:.6}, or a larger curvature",
            stretch * (1.0 + 1e-6)
        );
        (report.status, report.message) = (CurveStatus::Infeasible, Some(batch.sentence(i, 0, &what)));
    }
    Ok((report, vertices))
}

/// The vertices along paths, equally spaced in every span, and the number of vertices within turns.
fn laid<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    ready: &PreparedCurve<D>,
    paths: &[Dubins],
) -> (Vertices, usize) {
    let points = batch.points(i).as_chunks::<D>().0;
    let (mut coords, mut rows, mut frames, mut active) = (Vec::new(), Vec::new(), Vec::new(), 0);
    let spatial = |[x, y]: Vector<f64, 2>| DVec3::new(x, y, 0.0);
    let frame = |place: &Place| (spatial(place.tangent), spatial(place.bend) / ready.size);
    let mut own = paths.iter();
    for (k, ends) in ready.rows.windows(2).enumerate() {
        rows.push(frames.len() as u32);
        if ends[0] == ends[1] {
            continue;
        }
        let path = own.next().expect("a path for every span that has edges");
        let length = path.length();
        let edges = match fair.segments {
            Segments::PerSpan(n) => n,
            Segments::Spacing(spacing) => {
                (length * ready.size / spacing).ceil().clamp(1.0, Segments::MOST_VERTICES as f64) as usize
            }
        };
        for n in 0..edges {
            let place = path.place(length * n as f64 / edges as f64);
            let at: Vector<f64, D> = std::array::from_fn(|c| place.at[c]);
            coords.extend(add(points[k], scale(ready.size, at)));
            frames.push(frame(&place));
            active += usize::from(n > 0 && place.turns);
        }
    }
    rows.push(frames.len() as u32);
    if let (false, Some(last)) = (batch.is_closed(i), paths.last()) {
        coords.extend(points[points.len() - 1]);
        frames.push(frame(&last.place(last.length())));
    }
    (Vertices { coords, rows, tangents: Tangents { frames, ..Tangents::default() }.boxed() }, active)
}

/// The shortest curve with the largest curvature through the points of curve `i`, as a start.
pub(super) fn start<const D: usize>(fair: &Fair, batch: &CurveBatch, i: usize, kept: [bool; 2]) -> Option<FairCurves> {
    let limits = Limits { curvature: fair.limits.curvature, ..Limits::default() };
    let shortest = Fair { energy: length(), limits, ..fair.clone() };
    let ready = set_up_at::<D>(&shortest, batch, i, kept, 0).ok()?;
    let (_, vertices) = fit_one(&shortest, batch, i, &ready).ok()?;
    Some(FairCurves::new(&batch.select(&[i]), vec![Some(vertices)], Default::default(), Default::default()))
}

/// The angle of the given tangent at a vertex.
fn direction<const D: usize>(batch: &CurveBatch, i: usize, ready: &PreparedCurve<D>, row: usize) -> Option<f64> {
    let tangents = batch.constraints().tangents.as_ref()?;
    let tangent = |k: usize| &tangents[(batch.offsets()[i] + k) * D..][..D];
    let is_here = |k: &usize| ready.rows[*k] as usize % ready.vertices.len() == row;
    let given = (0..batch.count(i)).filter(is_here).map(tangent).find(|tangent| !tangent[0].is_nan());
    given.map(|tangent| tangent[1].atan2(tangent[0]))
}
