//! From the points of a batch to [courses](Course), and from their nodes to splines in space.

use glam::DVec3;

use super::SurfaceSpline;
use super::course::{Course, Ended, Held, Node};
use super::velocities::Velocities;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraints;
use crate::curve::vector;
use crate::device::Device;
use crate::error::Result;
use crate::ground::{between, jet_onto, lost};
use crate::report::{CurveReport, CurveSet};
use crate::spline::cubic::CubicSplines;
use crate::spline::knots::{Knots, Parametrisation};
use crate::spline::natural::Natural;
use crate::status::CurveStatus;

/// A spline that was found: its nodes, and how.
pub(super) struct Found {
    pub nodes: Vec<Node>,
    pub steps: Vec<f64>,
    pub report: CurveReport,
}

/// Where the curves that can be fitted start.
pub(super) struct Starts {
    able: Vec<usize>,
    splines: CubicSplines,
}

impl SurfaceSpline {
    /// Splines in space through the knots, clamped where velocities are given, with points between where the surface turns
    /// much.
    pub(super) fn starts(&self, batch: &CurveBatch, knots: &Knots, velocities: &[Velocities]) -> Result<Starts> {
        let able: Vec<usize> = (0..batch.len()).filter(|i| !knots.unfitted.contains_key(i)).collect();
        let (mut coords, mut t, mut closing, mut offsets) = (Vec::new(), Vec::new(), Vec::new(), vec![0]);
        let mut tangents = Vec::new();
        for &i in &able {
            let (own, places) = (knots.t(i), knots.values(i).as_chunks::<3>().0);
            for k in 0..own.len() - 1 {
                let (from, to) = (DVec3::from_array(places[k]), DVec3::from_array(places[k + 1]));
                let way = between(&*self.surface, from, to);
                let part = (own[k + 1] - own[k]) / (way.len() + 1) as f64;
                for (at, place) in std::iter::once(from).chain(way).enumerate() {
                    coords.extend(place.to_array());
                    t.push(own[k] + at as f64 * part);
                }
            }
            let last = own[own.len() - 1];
            if knots.closed[i] {
                closing.push(last - t[t.len() - 1]);
            } else {
                coords.extend(places[places.len() - 1]);
                t.push(last);
                closing.push(0.0);
            }
            offsets.push(t.len());
            let first = tangents.len();
            tangents.resize(3 * t.len(), f64::NAN);
            for (velocity, at) in velocities[i].iter().zip([first, 3 * t.len() - 3]) {
                if let Some(velocity) = velocity {
                    tangents[at..at + 3].copy_from_slice(&velocity.to_array());
                }
            }
        }
        let splines = natural(coords, offsets, able.iter().map(|&i| knots.closed[i]).collect(), t, closing, tangents)?;
        Ok(Starts { able, splines })
    }

    /// The spline of a curve that can be fitted.
    pub(super) fn find(
        &self,
        batch: &CurveBatch,
        knots: &Knots,
        i: usize,
        starts: &Starts,
        velocities: Velocities,
    ) -> Result<Found, Unfitted> {
        let (t, closed, parts) = (knots.t(i), knots.closed[i], self.parts_a_span());
        let refuse = |status: CurveStatus, k: usize, what: &str| {
            Err(Unfitted { status, message: batch.sentence(i, k.min(batch.count(i) - 1), what) })
        };
        let start = starts.splines.curve(starts.able.binary_search(&i).expect("only what can be fitted has a start"));
        let mut nodes = Vec::with_capacity(parts * t.len());
        let mut steps = Vec::with_capacity(parts * t.len());
        let end = if closed { t.len() - 1 } else { t.len() };
        for k in 0..end {
            let pieces = if k + 1 < t.len() { parts } else { 1 };
            for part in 0..pieces {
                let at = if k + 1 < t.len() { t[k] + (t[k + 1] - t[k]) * part as f64 / parts as f64 } else { t[k] };
                let jet = {
                    let (span, u) = start.locate(at);
                    jet_onto(&*self.surface, start.jet(span, u))
                };
                let place = if part == 0 { vector(&knots.values(i)[3 * k..3 * k + 3]) } else { jet.point };
                nodes.push(Node { place, velocity: jet.first });
                if k + 1 < t.len() {
                    steps.push((t[k + 1] - t[k]) / parts as f64);
                }
            }
        }
        if let Some(row) = nodes.iter().position(|node| !(node.place + node.velocity).is_finite()) {
            return refuse(CurveStatus::Invalid, row / parts, &lost(&*self.surface));
        }
        let mut held = self.held(batch, knots, i, nodes.len());
        for (velocity, row) in velocities.into_iter().zip([0, nodes.len() - 1]) {
            let Some(velocity) = velocity else { continue };
            if held[row] != Held::Pinned {
                let what = "it has a tangent, and smoothing moves it: pin the ends, or leave the tangent out";
                return refuse(CurveStatus::Invalid, row, what);
            }
            (held[row], nodes[row].velocity) = (Held::Clamped, velocity);
        }
        let (surface, origin) = self.surface.local().unwrap_or_else(|| (self.surface.clone(), DVec3::ZERO));
        let (tolerance, max_iterations) = (self.tolerance, self.max_iterations);
        let mut course = Course { surface: &*surface, steps, held, nodes, tolerance, max_iterations };
        let (Ended { status, iterations, norm }, energy) = course.descend_about(origin);
        let mut report = CurveReport { status, iterations, gradient_norm: norm, ..CurveReport::solved(energy) };
        report.smoothing = self.smoothing;
        if status == CurveStatus::NotConverged {
            let what = format!(
                "{iterations} iterations did not lead to a minimum: give points between those that are far apart, or smooth less"
            );
            report.message = Some(batch.sentence(i, 0, &what));
        }
        if !energy.is_finite() {
            return refuse(CurveStatus::Invalid, 0, "its spline leaves the range of the numbers: scale the curve");
        }
        let entries = knots.repeats.get(&i);
        let node_of = |k: usize| parts * entries.map_or(k, |entries| entries[k] as usize) % course.nodes.len();
        let points = batch.points(i).as_chunks::<3>().0;
        let away = |(k, point): (usize, &[f64; 3])| course.nodes[node_of(k)].place.distance((*point).into());
        report.max_deviation = points.iter().enumerate().map(away).fold(0.0, f64::max);
        Ok(Found { nodes: course.nodes, steps: course.steps, report })
    }

    /// What holds the nodes of a curve.
    fn held(&self, batch: &CurveBatch, knots: &Knots, i: usize, count: usize) -> Vec<Held> {
        let parts = self.parts_a_span();
        let mut held = vec![Held::Free; count];
        let places = knots.values(i).as_chunks::<3>().0;
        let Some(lambda) = self.smoothing.filter(|lambda| *lambda > 0.0) else {
            held.iter_mut().step_by(parts).for_each(|held| *held = Held::Pinned);
            return held;
        };
        let weights = knots.weights.as_ref().map(|weights| &weights[knots.range(i)]);
        for (k, held) in held.iter_mut().step_by(parts).enumerate() {
            let weight = weights.map_or(1.0, |weights| weights[k]) / lambda;
            *held = Held::Spring { weight, target: places[k].into() };
        }
        let entries = knots.repeats.get(&i);
        for k in (0..batch.count(i)).filter(|&k| batch.is_pinned(i, k)) {
            held[parts * entries.map_or(k, |entries| entries[k] as usize) % count] = Held::Pinned;
        }
        if self.pin_ends && !knots.closed[i] {
            (held[0], held[count - 1]) = (Held::Pinned, Held::Pinned);
        }
        held
    }

    /// Cubic splines through the nodes of all that were found, clamped at the ends.
    pub(super) fn laid(&self, knots: &Knots, found: &[Result<Found, Unfitted>]) -> Result<CubicSplines> {
        let (mut coords, mut t, mut closing, mut offsets) = (Vec::new(), Vec::new(), Vec::new(), vec![0]);
        let (mut closed, mut tangents) = (Vec::new(), Vec::new());
        for (i, found) in found.iter().enumerate() {
            let Ok(Found { nodes, steps, .. }) = found else { continue };
            let is_closed = knots.closed[i];
            let (own, parts) = (knots.t(i), self.parts_a_span());
            for (row, node) in nodes.iter().enumerate() {
                coords.extend(node.place.to_array());
                let is_end = !is_closed && (row == 0 || row + 1 == nodes.len());
                tangents.extend(if is_end { node.velocity.to_array() } else { [f64::NAN; 3] });
                let (k, part) = (row / parts, row % parts);
                t.push(if part == 0 { own[k] } else { own[k] + part as f64 * steps[row] });
            }
            closing.push(if is_closed { own[own.len() - 1] - t[t.len() - 1] } else { 0.0 });
            closed.push(is_closed);
            offsets.push(t.len());
        }
        natural(coords, offsets, closed, t, closing, tangents)
    }
}

/// Natural splines in space, clamped where there are tangents.
fn natural(
    coords: Vec<f64>,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    t: Vec<f64>,
    closing: Vec<f64>,
    tangents: Vec<f64>,
) -> Result<CubicSplines> {
    let batch = CurveBatch::from_ragged(3, coords, offsets)?.closed_each(closed)?;
    let batch = batch.with_parameters(t)?.with_closing_spans(closing)?;
    let batch = batch.with_constraints(Constraints { tangents: Some(tangents), ..Constraints::default() })?;
    let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
    Ok(natural.fit_splines(&batch, &Device::cpu())?.0)
}
