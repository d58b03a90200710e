//! Divides a start curve into edges of about equal arc length, span by span.

use glam::DVec3;

use super::fair::Segments;
use crate::curve::{Curve, vector};
use crate::linalg::scalar::{Vector, add, dot, scale};
use crate::motion::Motion;
use crate::surface::Surface;

/// On a quadric the length of a span is measured by one chord per this many edges, and by at least
/// [`LEAST_CHORDS`] chords.
///
/// Normals turn little along a span (see `ground::wide`), and the regularisation evens out the
/// rest. Every projection costs time. Other surfaces, such as terrain, may have hills within a
/// span.
const EDGES_A_CHORD: usize = 4;
const LEAST_CHORDS: usize = 4;

/// The vertices at equal arc length along each span, and the vertex index of every data point.
///
/// With a surface the span is measured on the surface, and the vertices are projected onto it. The
/// regularisation evens out the rest.
pub(super) fn divide<const D: usize>(
    curve: &dyn Curve,
    points: &[Vector<f64, D>],
    segments: Segments,
    interpolates: bool,
    surface: Option<&dyn Surface>,
) -> (Vec<Vector<f64, D>>, Vec<u32>) {
    let expected = if let Segments::PerSpan(n) = segments { n } else { 0 };
    let mut vertices = Vec::with_capacity(expected * curve.spans() + 1);
    let mut rows = Vec::with_capacity(points.len() + 1);
    let (mut arc, mut feet) = (Vec::with_capacity(expected + 1), Vec::new());
    let is_quadric = surface.is_some_and(|surface| surface.kind().quadric().is_some());
    for span in 0..curve.spans() {
        let (from, to) = (points[span], points[(span + 1) % points.len()]);
        rows.push(vertices.len() as u32);
        if from == to {
            continue;
        }
        let way = Along::new(curve, span);
        let along = Moved { way, surface, is_quadric };
        // Uses the data points themselves, without the rounding of a spline.
        vertices.push(if interpolates { from } else { along.place(0.0) });
        let n = match segments {
            Segments::PerSpan(n) => n,
            // The check of all options bounded the number of vertices by chords. This bounds
            // splines that swing far out.
            Segments::Spacing(spacing) => {
                (curve.span_length(span) / spacing).ceil().clamp(1.0, Segments::MOST_VERTICES as f64) as usize
            }
        };
        along.measure(n, &mut arc, &mut feet);
        let first = vertices.len();
        equal_fractions(&arc, |u| vertices.push(along.way.place(u)));
        along.move_onto(&mut vertices[first..], &mut feet);
    }
    rows.push(vertices.len() as u32);
    if !curve.is_closed() {
        let end = || Moved { way: Along::new(curve, curve.spans() - 1), surface, is_quadric }.place(1.0);
        vertices.push(if interpolates { points[points.len() - 1] } else { end() });
    }
    (vertices, rows)
}

/// Positions and speeds along a span, by its fraction u.
enum Along<'a, const D: usize> {
    /// p + u (v₀ + u (v₁/2 + u v₂/3))
    Cubic { start: Vector<f64, D>, velocity: [Vector<f64, D>; 3] },
    /// Any other curve.
    Other { curve: &'a dyn Curve, span: usize },
}

impl<'a, const D: usize> Along<'a, D> {
    fn new(curve: &'a dyn Curve, span: usize) -> Self {
        let motion = if curve.pieces(span) == 1 { curve.motion(span, 0) } else { None };
        match motion {
            Some(Motion { velocity, .. }) => Along::Cubic {
                start: components(curve.jet(span, 0.0).point.to_array()),
                velocity: velocity.map(|v| components(v.to_array())),
            },
            None => Along::Other { curve, span },
        }
    }

    fn place(&self, u: f64) -> Vector<f64, D> {
        match self {
            Along::Cubic { start, velocity: [a, b, c] } => {
                let inner = add(scale(0.5, *b), scale(u / 3.0, *c));
                add(*start, scale(u, add(*a, scale(u, inner))))
            }
            Along::Other { curve, span } => components(curve.jet(*span, u).point.to_array()),
        }
    }

    fn speed(&self, u: f64) -> f64 {
        match self {
            Along::Cubic { velocity: [a, b, c], .. } => {
                let v = add(*a, scale(u, add(*b, scale(u, *c))));
                dot(v, v).sqrt()
            }
            Along::Other { curve, span } => curve.speed(*span, u),
        }
    }

    /// The arc lengths from the start of the span to the ends of n equal steps of the parameter.
    ///
    /// Simpson's rule with one panel per step resolves the speed as finely as the curve itself.
    fn measure(&self, n: usize, arc: &mut Vec<f64>) {
        let panel = 1.0 / n as f64;
        arc.clear();
        arc.push(0.0);
        let (mut length, mut before) = (0.0, self.speed(0.0));
        for k in 0..n {
            let after = self.speed((k + 1) as f64 * panel);
            length += panel / 6.0 * (before + 4.0 * self.speed((k as f64 + 0.5) * panel) + after);
            arc.push(length);
            before = after;
        }
    }
}

/// A span, projected onto a surface if there is one.
struct Moved<'a, const D: usize> {
    way: Along<'a, D>,
    surface: Option<&'a dyn Surface>,
    is_quadric: bool,
}

impl<const D: usize> Moved<'_, D> {
    /// A position. NaN if the surface has no point near it.
    fn place(&self, u: f64) -> Vector<f64, D> {
        let place = self.way.place(u);
        match self.surface {
            Some(surface) => components(surface.project(vector(&place)).unwrap_or(DVec3::NAN).to_array()),
            None => place,
        }
    }

    /// Projects positions of the span onto the surface, if there is one. `feet` is a buffer.
    fn move_onto(&self, places: &mut [Vector<f64, D>], feet: &mut Vec<DVec3>) {
        let Some(surface) = self.surface else { return };
        feet.clear();
        feet.extend(places.iter().map(|place| vector(place)));
        surface.project_all(feet);
        places.iter_mut().zip(feet).for_each(|(place, foot)| *place = components(foot.to_array()));
    }

    /// The arc lengths from the start of the span to the ends of n equal steps of the parameter.
    ///
    /// On a surface, each arc length is scaled by the ratio of the projected chord to the chord.
    fn measure(&self, n: usize, arc: &mut Vec<f64>, feet: &mut Vec<DVec3>) {
        self.way.measure(n, arc);
        let Some(surface) = self.surface else { return };
        let chords = if self.is_quadric { n.min(LEAST_CHORDS.max(n / EDGES_A_CHORD)) } else { n };
        let end = |chord: usize| chord * n / chords;
        let place = |chord: usize| vector(&self.way.place(end(chord) as f64 / n as f64));
        feet.clear();
        feet.extend((0..=chords).map(place));
        surface.project_all(feet);
        let (mut before, mut length) = (0.0, 0.0);
        for chord in 0..chords {
            let own = place(chord).distance(place(chord + 1));
            let stretch = if own > 0.0 { feet[chord].distance(feet[chord + 1]) / own } else { 1.0 };
            for arc in &mut arc[end(chord) + 1..=end(chord + 1)] {
                length += stretch * (*arc - before);
                before = *arc;
                *arc = length;
            }
        }
    }
}

/// The first D components of a vector.
pub(super) fn components<const D: usize>(v: [f64; 3]) -> Vector<f64, D> {
    let mut own = [0.0; D];
    own.copy_from_slice(&v[..D]);
    own
}

/// The fractions that divide a span into pieces of about equal length.
///
/// There are as many pieces as steps in `arc`, the [arc lengths](Along::measure) at their ends.
fn equal_fractions(arc: &[f64], mut at: impl FnMut(f64)) {
    let n = arc.len() - 1;
    let panel = 1.0 / n as f64;
    let mut k = 0;
    for piece in 1..n {
        let target = arc[n] * piece as f64 * panel;
        while k + 1 < n && arc[k + 1] < target {
            k += 1;
        }
        let width = arc[k + 1] - arc[k];
        let part = if width > 0.0 { (target - arc[k]) / width } else { 0.5 };
        at((k as f64 + part) * panel);
    }
}
