//! [`Quantity`]: quantities of a curve at its samples.

use glam::DVec3;

use crate::arclength;
use crate::batch::{Column, Values};
use crate::curve::{Curve, Jet};
use crate::surface::Globe;
use crate::words::words;

/// The sphere of the Earth's mean radius, for longitudes and latitudes that were not fitted on a
/// globe. Lengths are within 0.6 % of lengths on the ellipsoid.
const EARTH: Globe = Globe { equatorial: Globe::EARTH, polar: Globe::EARTH };

/// A quantity of a curve at its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Quantity {
    /// The unit tangent, in columns `tangent_x`, `tangent_y` and in space `tangent_z`: to the east,
    /// to the north and up for longitudes and latitudes. 0 where the derivative vanishes.
    Tangent,
    /// The curvature (1/length), in the plane positive where the curve turns left. For longitudes
    /// and latitudes the geodesic curvature in the unit of [`Quantity::Arclength`], without
    /// heights.
    Curvature,
    /// The length of the curve from its first point, in the unit of the points. For longitudes and
    /// latitudes on their [globe](Curve::globe), or in metres on a sphere of the Earth's mean
    /// radius. Heights are in the same unit.
    Arclength,
    /// [`Quantity::Arclength`] per unit of time (a second for dates). At points with equal times it
    /// is the speed on arrival, and NaN between them.
    Speed,
    /// The direction in degrees from north (the y axis) to the right, from 0 up to 360.
    ///
    /// For longitudes and latitudes it is the course over ground.
    Heading,
    /// The rate of [`Quantity::Speed`]: positive where the curve gets faster. From differences, to 1e-7 of
    /// its size.
    Acceleration,
    /// The rate of the direction, in degrees per unit of time (a second for dates), positive to the right:
    /// −[`Quantity::Curvature`] times [`Quantity::Speed`].
    TurnRate,
    /// The time between the two data points around a sample, and 0 at data points: samples with a large one
    /// are interpolated across a gap.
    Gap,
}

words!(Quantity, "quantity": [
    (Tangent, "tangent", "Unit tangents: tangent_x, tangent_y, tangent_z; east, north and up for longitudes and latitudes"),
    (Curvature, "curvature", "Curvature (1/length), positive to the left in the plane; for longitudes and latitudes that within the ground, 0 along a great circle, in 1/metre or the unit of their --surface"),
    (Arclength, "arclength", "Length of the curve up to here; metres for longitudes and latitudes, or the unit of their --surface"),
    (Speed, "speed", "Arc length in a unit of time; in a second where times are dates"),
    (Heading, "heading", "Degrees from north (y) to the right, the course for longitudes and latitudes"),
    (Acceleration, "acceleration", "How fast the speed grows, in a unit of time"),
    (TurnRate, "turn_rate", "Degrees in a unit of time, positive to the right"),
    (Gap, "gap", "Time between the two points around a sample, 0 at points"),
]);

/// The fraction of a span between speeds whose difference is an acceleration.
const STEP: f64 = 1e-4;

impl Quantity {
    /// Whether it needs times.
    pub(super) fn is_timed(self) -> bool {
        matches!(self, Quantity::Speed | Quantity::Acceleration | Quantity::TurnRate | Quantity::Gap)
    }

    /// The columns of a quantity.
    pub(super) fn columns(self, dimension: usize) -> Vec<Column> {
        let names: &[&str] = match self {
            Quantity::Tangent => &["tangent_x", "tangent_y", "tangent_z"][..dimension],
            Quantity::Curvature => &["curvature"],
            Quantity::Arclength => &["arclength"],
            Quantity::Speed => &["speed"],
            Quantity::Heading => &["heading"],
            Quantity::Acceleration => &["acceleration"],
            Quantity::TurnRate => &["turn_rate"],
            Quantity::Gap => &["gap"],
        };
        names.iter().map(|&name| Column { name: name.into(), values: Values::Numbers(vec![]) }).collect()
    }

    /// The values at sites along a curve, column after column. `times` are the parameters of its
    /// points.
    pub(super) fn of(
        self,
        curve: &dyn Curve,
        sites: &[(usize, f64)],
        times: Option<&[f64]>,
        is_geographic: bool,
    ) -> Vec<Vec<f64>> {
        let globe = curve.globe().or(is_geographic.then_some(EARTH));
        let jets = || sites.iter().map(|&(span, u)| curve.jet(span, u));
        // Of the span of a site that takes time, at the fraction there, with its time.
        let timed = |value: &dyn Fn(usize, f64, f64) -> f64| {
            let of = |site: &(usize, f64)| {
                let (t, (span, u)) = times.and_then(|t| Some((t, with_time(curve, t, *site)?)))?;
                Some(value(span, u, t[span + 1] - t[span]))
            };
            vec![sites.iter().map(|site| of(site).unwrap_or(f64::NAN)).collect::<Vec<f64>>()]
        };
        let curvature = |jet: Jet| match globe {
            Some(globe) => globe.curvature(jet.point, jet.first, jet.second),
            None => jet.curvature(curve.dimension()),
        };
        if !curve.is_fitted() {
            return vec![vec![f64::NAN; sites.len()]; self.columns(curve.dimension()).len()];
        }
        match self {
            Quantity::Tangent => {
                let motion = |jet: Jet| globe.map_or(jet.first, |globe| globe.motion(jet.point, jet.first));
                let tangents: Vec<DVec3> = jets().map(|jet| motion(jet).normalize_or_zero()).collect();
                (0..curve.dimension()).map(|axis| tangents.iter().map(|t| t[axis]).collect()).collect()
            }
            Quantity::Curvature => vec![jets().map(curvature).collect()],
            Quantity::Arclength => vec![lengths(curve, sites, globe)],
            Quantity::Speed => timed(&|span, u, time| speed(curve, span, u, globe) / time),
            Quantity::Acceleration => timed(&|span, u, time| {
                let [from, to] = [(u - STEP).max(0.0), (u + STEP).min(1.0)];
                let change = speed(curve, span, to, globe) - speed(curve, span, from, globe);
                change / ((to - from) * time * time)
            }),
            Quantity::TurnRate => timed(&|span, u, time| {
                -(curvature(curve.jet(span, u)) * speed(curve, span, u, globe) / time).to_degrees()
            }),
            Quantity::Gap => timed(&|_, u, time| if u == 0.0 || u == 1.0 { 0.0 } else { time }),
            Quantity::Heading => {
                let heading = |point: DVec3, first: DVec3| {
                    let motion = globe.map_or(first, |globe| globe.motion(point, first));
                    let degrees = libm::atan2(motion.x, motion.y).to_degrees();
                    // Rounding must not give 360.
                    if degrees < 0.0 { (degrees + 360.0) % 360.0 } else { degrees + 0.0 }
                };
                vec![jets().map(|jet| heading(jet.point, jet.first)).collect()]
            }
        }
    }
}

/// The same point of a curve in a span of positive duration, if there is one: the end of a previous
/// span, or the start of a later one.
fn with_time(curve: &dyn Curve, times: &[f64], (mut span, mut u): (usize, f64)) -> Option<(usize, f64)> {
    let takes_time = |span: usize| times[span + 1] > times[span];
    let (from, is_point) = (span, |span: usize| curve.span_length(span) == 0.0);
    while !takes_time(span) && span > 0 && (u == 0.0 || is_point(span)) {
        (span, u) = (span - 1, 1.0);
    }
    if !takes_time(span) {
        span = from;
        while !takes_time(span) && span + 1 < curve.spans() && is_point(span) {
            (span, u) = (span + 1, 0.0);
        }
    }
    takes_time(span).then_some((span, u))
}

/// The speed along a span (length per unit of `u`), on the ground for longitudes and latitudes.
fn speed(curve: &dyn Curve, span: usize, u: f64, globe: Option<Globe>) -> f64 {
    let Some(globe) = globe.filter(|_| curve.globe().is_none()) else { return curve.speed(span, u) };
    let jet = curve.jet(span, u);
    globe.motion(jet.point, jet.first).length() * curve.pace(span)
}

/// The lengths from the first point of a curve to sites along it.
fn lengths(curve: &dyn Curve, sites: &[(usize, f64)], globe: Option<Globe>) -> Vec<f64> {
    let (mut before, mut length) = ((0, 0.0), 0.0);
    let mut lengths = Vec::with_capacity(sites.len());
    for &(span, u) in sites {
        while before.0 < span {
            length += between(curve, before.0, before.1, 1.0, globe);
            before = (before.0 + 1, 0.0);
        }
        length += between(curve, span, before.1, u, globe);
        before = (span, u.max(before.1));
        lengths.push(length);
    }
    lengths
}

/// The length of a span between two fractions, summed over smooth pieces.
fn between(curve: &dyn Curve, span: usize, from: f64, to: f64, globe: Option<Globe>) -> f64 {
    if to <= from || curve.pieces(span) == 0 {
        return 0.0;
    }
    if (from, to) == (0.0, 1.0) && globe.is_none() {
        return curve.span_length(span);
    }
    let pieces = curve.pieces(span) as f64;
    let inside = ((from * pieces).floor() as usize + 1)..(to * pieces).ceil() as usize;
    let ends = inside.map(|k| k as f64 / pieces).chain([to]);
    let mut from = from;
    ends.map(|end| {
        let (start, part) = (from, end - from);
        from = end;
        part * arclength::span_length(|v| speed(curve, span, start + v * part, globe))
    })
    .sum()
}
