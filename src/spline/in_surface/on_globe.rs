//! Splines near points of a globe: smoothing splines in a plane onto which each track is mapped.
//!
//! The globe is mapped conformally onto a sphere, and the sphere by a Mercator projection about the
//! great circle nearest to the track, so that neither poles nor the date line are near. Conformal maps
//! have one scale at a point, in all directions: a distance on the ground is a disc around each point of
//! the plane, with a radius that depends on the point. Accelerations are measured in the plane, whose scale
//! differs by 1 part in 100 at 900 km from the great circle.

use glam::{DMat3, DVec3};
use libm::{asinh, atan2, cosh, hypot, sincos, tanh};
use nalgebra::{Matrix3, SymmetricEigen};

use super::SurfaceSpline;
use super::course::Node;
use super::setup::CourseResult;
use crate::batch::{CurveBatch, Piece, Unfitted};
use crate::curve::vector;
use crate::deviation::Deviation;
use crate::error::Result;
use crate::report::{CurveReport, CurveSet};
use crate::spline::cubic::CubicSplines;
use crate::spline::knots::{Knots, Parametrisation};
use crate::spline::smoothing::{Smoothing, SmoothingTarget};
use crate::status::CurveStatus;
use crate::surface::Globe;

use std::f64::consts::TAU;

/// The largest coordinate across the great circle, where the scale is 1 : 27. Tracks that go farther
/// have no plane.
const WIDEST: f64 = 4.0;

/// A Mercator projection of the unit sphere.
struct Plane {
    /// The middle of the track on its great circle, the direction along it, and its pole.
    axes: DMat3,
}

impl Plane {
    /// About the great circle nearest to some points.
    fn about(points: &[DVec3]) -> Self {
        let square = |p: &DVec3| Matrix3::from_fn(|r, c| p[r] * p[c]);
        let eigen = SymmetricEigen::new(points.iter().map(square).fold(Matrix3::zeros(), |sum, own| sum + own));
        let pole: DVec3 = DVec3::from_array(eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned().into());
        let across = |p: DVec3| (p - pole * pole.dot(p)).normalize_or_zero();
        let middle = across(points.iter().sum());
        let middle = if middle == DVec3::ZERO { across(points[0]) } else { middle };
        Plane { axes: DMat3::from_cols(middle, pole.cross(middle), pole) }
    }

    /// The place of a point of the sphere, on the sheet of `near`.
    fn place(&self, point: DVec3, near: f64) -> [f64; 2] {
        let own = self.axes.transpose() * point;
        let u = atan2(own.y, own.x);
        [u + TAU * ((near - u) / TAU).round(), asinh(own.z / hypot(own.x, own.y))]
    }

    /// The point of the sphere and the velocity there.
    fn point(&self, place: DVec3, rates: DVec3) -> (DVec3, DVec3) {
        let (sin, cos) = sincos(place.x);
        let (sech, tanh) = (1.0 / cosh(place.y), tanh(place.y));
        let (out, along) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let point = out * sech + DVec3::Z * tanh;
        let velocity = along * (sech * rates.x) + (DVec3::Z * sech - out * tanh) * (sech * rates.y);
        (self.axes * point, self.axes * velocity)
    }
}

impl SurfaceSpline {
    /// The spline within a distance of the points of curve `i`.
    pub(super) fn near_on(
        &self,
        globe: Globe,
        batch: &CurveBatch,
        knots: &Knots,
        i: usize,
    ) -> Result<CourseResult, Unfitted> {
        let refuse = |status: CurveStatus, what: &str| Err(Unfitted { status, message: batch.sentence(i, 0, what) });
        let given: Vec<DVec3> = batch.points(i).chunks_exact(3).map(vector).collect();
        let (points, scales): (Vec<DVec3>, Vec<f64>) = given.iter().map(|&place| globe.onto_sphere(place)).unzip();
        let plane = Plane::about(&points);
        let mut places: Vec<[f64; 2]> = Vec::with_capacity(points.len());
        for &point in &points {
            places.push(plane.place(point, places.last().map_or(0.0, |last| last[0])));
        }
        let closed = knots.closed[i];
        let goes_round = closed && (places[places.len() - 1][0] - places[0][0]).abs() > 0.5 * TAU;
        if goes_round || places.iter().any(|place| place[1].abs() > WIDEST) {
            let what = "it goes round the globe, and no plane holds all of it: give it in parts, or ask for a λ";
            return refuse(CurveStatus::Invalid, what);
        }
        // In metres, but for the scale.
        let unit = scales.iter().sum::<f64>() / scales.len() as f64;
        let (target, distance) = self.near_distance(batch, i);
        let radius = |(place, scale): (&[f64; 2], &f64)| {
            // The scale grows towards the great circle: the largest one in the disc. That of the
            // ellipsoid changes by less than the square of its eccentricity in a radian.
            let nearest = (place[1].abs() - distance / scale * cosh(place[1]) * 1.01).max(0.0);
            let flattening = 1.0 - (globe.eccentricity().abs() * distance / scale).min(0.5);
            flattening * unit / scale * cosh(nearest)
        };
        let radii: Vec<f64> = places.iter().zip(&scales).map(radius).collect();
        let coords = places.iter().flat_map(|place| place.map(|x| x * unit)).collect();
        let found = self.in_plane(batch, knots, i, coords, target, radii);
        let (splines, mut report) = match found {
            Ok(found) => found,
            Err(error) => return refuse(CurveStatus::Invalid, &error.to_string()),
        };
        if !report.status.is_usable() && report.status != CurveStatus::NotConverged {
            return Err(Unfitted { status: report.status, message: report.message.unwrap_or_default() });
        }
        let curve = splines.curve(0);
        let (mut nodes, steps) = self.nodes_at(knots, i, |at| {
            let (span, u) = curve.locate(at);
            let jet = curve.jet(span, u);
            let (point, velocity) = plane.point(jet.point / unit, jet.first / unit);
            let (place, velocity) = globe.place_of(point, velocity);
            Node { place, velocity }
        });
        report.max_deviation = 0.0;
        for (k, &point) in given.iter().enumerate() {
            let row = self.parts_per_span() * knots.entry(i, k) % nodes.len();
            let is_end = self.pin_ends && !closed && (k == 0 || k + 1 == given.len());
            if is_end || batch.is_pinned(i, k) {
                nodes[row].place = point;
            }
            report.max_deviation = report.max_deviation.max(nodes[row].place.distance(point));
        }
        if report.status.is_usable() && distance > 0.0 && report.max_deviation > distance {
            let what = format!("its plane is too wide for {distance}: it is {} from a point", report.max_deviation);
            (report.status, report.message) = (CurveStatus::NotConverged, Some(batch.sentence(i, 0, &what)));
        }
        Ok(CourseResult { nodes, steps, report })
    }

    /// The target in metres, and its distance: 0 if it has none.
    fn near_distance(&self, batch: &CurveBatch, i: usize) -> (SmoothingTarget, f64) {
        let mut distance = 0.0;
        let target = self.smoothing.expect("a curve near its points has a target").with(|own| {
            distance = match own {
                Deviation::Metres(metres) => metres,
                other => other.of(batch, i),
            };
            distance.into()
        });
        (target, distance)
    }

    /// The smoothing spline of a curve in the plane.
    fn in_plane(
        &self,
        batch: &CurveBatch,
        knots: &Knots,
        i: usize,
        coords: Vec<f64>,
        target: SmoothingTarget,
        radii: Vec<f64>,
    ) -> Result<(CubicSplines, CurveReport)> {
        let (t, count, closed) = (knots.t(i), batch.count(i), knots.closed[i]);
        let parameters: Vec<f64> = (0..count).map(|k| t[knots.entry(i, k) % t.len()]).collect();
        let closing = if closed { t[t.len() - 1] - parameters[count - 1] } else { 0.0 };
        // Sentences about a piece name the points of the whole.
        let piece = batch.cut(vec![Piece { curve: i, first: 0, count, closed }]);
        let mut plane =
            piece.moved(2, coords, vec![]).with_parameters(parameters)?.with_closing_spans(vec![closing])?;
        if target == SmoothingTarget::CrossValidation {
            // Noise is the same everywhere on the ground.
            let weight = |(k, radius): (usize, &f64)| batch.weights(i).map_or(1.0, |own| own[k]) / (radius * radius);
            plane = plane.with_weights(radii.iter().enumerate().map(weight).collect())?;
        }
        let smoothing = Smoothing { target, pin_ends: self.pin_ends, parametrisation: Parametrisation::Given };
        let (splines, mut reports) = smoothing.fit_with_radii(&plane, radii)?;
        Ok((splines, reports.remove(0)))
    }
}
