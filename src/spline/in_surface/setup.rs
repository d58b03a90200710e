//! From the points of a batch to [courses](Course), and from their nodes to splines in space.

use glam::DVec3;

use super::SurfaceSpline;
use super::course::{Course, DescentEnd, Node, NodeCondition};
use super::velocities::Velocities;
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraints;
use crate::curve::{Curve, vector};
use crate::device::Device;
use crate::error::Result;
use crate::ground::{between, jet_onto, lost};
use crate::ragged;
use crate::report::{CurveReport, CurveSet};
use crate::spline::cubic::CubicSplines;
use crate::spline::knots::{Knots, Parametrisation};
use crate::spline::natural::Natural;
use crate::status::CurveStatus;

/// A fitted spline: its nodes, and how it was found.
pub(super) struct CourseResult {
    pub nodes: Vec<Node>,
    pub steps: Vec<f64>,
    pub report: CurveReport,
}

/// The points of curves in space, with their parameters.
#[derive(Default)]
struct Points {
    coords: Vec<f64>,
    t: Vec<f64>,
    tangents: Vec<f64>,
    counts: Vec<usize>,
    closed: Vec<bool>,
    closing: Vec<f64>,
}

impl Points {
    fn push(&mut self, t: f64, place: DVec3) {
        self.coords.extend(place.to_array());
        self.t.push(t);
    }

    /// Ends a curve, of all points pushed since the last one. A closed curve has a span that leads
    /// back to its first point.
    fn end(&mut self, closing: Option<f64>, velocities: Velocities) {
        let first = self.tangents.len();
        self.tangents.resize(self.coords.len(), f64::NAN);
        for (velocity, at) in velocities.into_iter().zip([first, self.coords.len().saturating_sub(3)]) {
            if let Some(velocity) = velocity {
                self.tangents[at..at + 3].copy_from_slice(&velocity.to_array());
            }
        }
        self.counts.push((self.coords.len() - first) / 3);
        self.closed.push(closing.is_some());
        self.closing.push(closing.unwrap_or(0.0));
    }

    /// Natural splines through the points, clamped at ends with a velocity.
    fn splines(self) -> Result<CubicSplines> {
        let batch = CurveBatch::from_ragged(3, self.coords, ragged::offsets(self.counts))?.closed_as(self.closed);
        let batch = batch.with_parameters(self.t)?.with_closing_spans(self.closing)?;
        let tangents = Some(self.tangents);
        let batch = batch.with_constraints(Constraints { tangents, ..Constraints::default() })?;
        let natural = Natural { parametrisation: Parametrisation::Given, ..Natural::default() };
        Ok(natural.fit_splines(&batch, &Device::cpu())?.0)
    }
}

impl SurfaceSpline {
    /// Splines in space through the knots, clamped where velocities are given, with points between
    /// where the surface turns much. Curves that cannot be fitted have none.
    pub(super) fn starts(&self, knots: &Knots, velocities: &[Velocities]) -> Result<CubicSplines> {
        let mut points = Points::default();
        for (i, velocities) in velocities.iter().enumerate() {
            let (own, places) = (knots.t(i), knots.values(i).as_chunks::<3>().0);
            let [.., last] = *own else {
                points.end(None, [None; 2]);
                continue;
            };
            for k in 0..own.len() - 1 {
                let (from, to) = (DVec3::from_array(places[k]), DVec3::from_array(places[k + 1]));
                let way = between(&*self.surface, from, to);
                let part = (own[k + 1] - own[k]) / (way.len() + 1) as f64;
                for (at, place) in std::iter::once(from).chain(way).enumerate() {
                    points.push(own[k] + at as f64 * part, place);
                }
            }
            let closing = knots.closed[i].then(|| last - points.t[points.t.len() - 1]);
            if closing.is_none() {
                points.push(last, places[places.len() - 1].into());
            }
            points.end(closing, *velocities);
        }
        points.splines()
    }

    /// Fits a curve from its start.
    pub(super) fn find(
        &self,
        batch: &CurveBatch,
        knots: &Knots,
        i: usize,
        starts: &CubicSplines,
        velocities: Velocities,
    ) -> Result<CourseResult, Unfitted> {
        let parts = self.parts_per_span();
        let refuse = |status: CurveStatus, k: usize, what: &str| {
            Err(Unfitted { status, message: batch.sentence(i, k.min(batch.count(i) - 1), what) })
        };
        let (mut nodes, steps) = self.nodes(knots, i, &*starts.curve(i));
        if let Some(row) = nodes.iter().position(|node| !(node.place + node.velocity).is_finite()) {
            return refuse(CurveStatus::Invalid, row / parts, &lost(&*self.surface));
        }
        let mut held = self.held(batch, knots, i, nodes.len());
        for (velocity, row) in velocities.into_iter().zip([0, nodes.len() - 1]) {
            let Some(velocity) = velocity else { continue };
            if held[row] != NodeCondition::Pinned {
                let what = "it has a tangent, and smoothing moves it: pin the ends, or leave the tangent out";
                return refuse(CurveStatus::Invalid, row, what);
            }
            (held[row], nodes[row].velocity) = (NodeCondition::Clamped, velocity);
        }
        let (surface, origin) = self.surface.local().unwrap_or_else(|| (self.surface.clone(), DVec3::ZERO));
        let (tolerance, max_iterations) = (self.tolerance, self.max_iterations);
        let mut course = Course { surface: &*surface, steps, held, nodes, tolerance, max_iterations };
        let (DescentEnd { status, iterations, norm }, energy) = course.descend_about(origin);
        let mut report = CurveReport { status, iterations, gradient_norm: norm, ..CurveReport::solved(energy) };
        report.smoothing = self.lambda();
        if status == CurveStatus::NotConverged {
            let what = format!(
                "{iterations} iterations did not lead to a minimum: give points between those that are far apart, or smooth less"
            );
            report.message = Some(batch.sentence(i, 0, &what));
        }
        if !energy.is_finite() {
            return refuse(CurveStatus::Invalid, 0, "its spline leaves the range of the numbers: scale the curve");
        }
        for (k, point) in batch.points(i).chunks_exact(3).map(vector).enumerate() {
            let node = course.nodes[parts * knots.entry(i, k) % course.nodes.len()];
            report.max_deviation = report.max_deviation.max(node.place.distance(point));
        }
        Ok(CourseResult { nodes: course.nodes, steps: course.steps, report })
    }

    /// The nodes of a curve at the parts of its spans, and the times between them.
    pub(super) fn nodes_at(&self, knots: &Knots, i: usize, node: impl Fn(f64) -> Node) -> (Vec<Node>, Vec<f64>) {
        let (t, parts) = (knots.t(i), self.parts_per_span());
        let (mut nodes, mut steps) = (Vec::with_capacity(parts * t.len()), Vec::with_capacity(parts * t.len()));
        for k in 0..t.len() - 1 {
            for part in 0..parts {
                nodes.push(node(t[k] + (t[k + 1] - t[k]) * part as f64 / parts as f64));
                steps.push((t[k + 1] - t[k]) / parts as f64);
            }
        }
        if !knots.closed[i] {
            nodes.push(node(t[t.len() - 1]));
        }
        (nodes, steps)
    }

    /// The nodes of a curve on its start, and the times between them.
    fn nodes(&self, knots: &Knots, i: usize, start: &dyn Curve) -> (Vec<Node>, Vec<f64>) {
        let parts = self.parts_per_span();
        let (mut nodes, steps) = self.nodes_at(knots, i, |at| {
            let (span, u) = start.locate(at);
            let jet = jet_onto(&*self.surface, start.jet(span, u));
            Node { place: jet.point, velocity: jet.first }
        });
        // Data points keep their bits.
        for (node, place) in nodes.iter_mut().step_by(parts).zip(knots.values(i).chunks_exact(3)) {
            node.place = vector(place);
        }
        (nodes, steps)
    }

    /// The conditions on the nodes of a curve.
    fn held(&self, batch: &CurveBatch, knots: &Knots, i: usize, count: usize) -> Vec<NodeCondition> {
        let parts = self.parts_per_span();
        let mut held = vec![NodeCondition::Free; count];
        let places = knots.values(i).as_chunks::<3>().0;
        let Some(lambda) = self.lambda() else {
            held.iter_mut().step_by(parts).for_each(|held| *held = NodeCondition::Pinned);
            return held;
        };
        let weights = knots.weights.as_ref().map(|weights| &weights[knots.range(i)]);
        for (k, held) in held.iter_mut().step_by(parts).enumerate() {
            let weight = weights.map_or(1.0, |weights| weights[k]) / lambda;
            *held = NodeCondition::Spring { weight, target: places[k].into() };
        }
        for k in (0..batch.count(i)).filter(|&k| batch.is_pinned(i, k)) {
            held[parts * knots.entry(i, k) % count] = NodeCondition::Pinned;
        }
        if self.pin_ends && !knots.closed[i] {
            (held[0], held[count - 1]) = (NodeCondition::Pinned, NodeCondition::Pinned);
        }
        held
    }

    /// Cubic splines through the nodes of all that were found, clamped at the ends.
    pub(super) fn laid(&self, knots: &Knots, found: &[Result<CourseResult, Unfitted>]) -> Result<CubicSplines> {
        let mut points = Points::default();
        for (i, found) in found.iter().enumerate() {
            let Ok(CourseResult { nodes, steps, .. }) = found else {
                points.end(None, [None; 2]);
                continue;
            };
            let (own, parts) = (knots.t(i), self.parts_per_span());
            for (row, node) in nodes.iter().enumerate() {
                let (k, part) = (row / parts, row % parts);
                points.push(if part == 0 { own[k] } else { own[k] + part as f64 * steps[row] }, node.place);
            }
            match knots.closed[i] {
                true => points.end(Some(own[own.len() - 1] - points.t[points.t.len() - 1]), [None; 2]),
                false => points.end(None, [nodes[0], nodes[nodes.len() - 1]].map(|node| Some(node.velocity))),
            }
        }
        points.splines()
    }
}
