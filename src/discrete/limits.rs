//! [`Limits`]: inequalities that fair curves keep.

use crate::batch::CurveBatch;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, dot, subtract};

/// A turn of the data's polygon of less than this sine is none.
const STRAIGHT: f64 = 1e-9;

/// Limits that a fair curve keeps at every vertex, besides passing through its points.
///
/// [`Fair::limits`](super::Fair::limits) says how they are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// The largest curvature κ > 0, in 1/length. `None`, the default, bounds none.
    ///
    /// At every vertex |T′ − T|/Δa ≤ κ, for the unit tangents T, T′ of the edges beside it and their mean length Δa.
    /// A regular polygon in a circle of radius R has 1/R there. The column `kmax` of
    /// [`Constraints::largest_curvatures`](crate::Constraints::largest_curvatures) bounds single spans; the smaller
    /// bound holds.
    pub curvature: Option<f64>,
    /// Whether planar curves turn only to the side to which the polygon of their points turns.
    ///
    /// At a data point that is the side of the turn there. Between two points that turn to one side it is that side,
    /// and between an end and its neighbour that of the neighbour. A span between turns to different sides may turn to
    /// both. Points in a line, of a turn below 1e-9, ask for nothing.
    pub shape: bool,
}

impl Limits {
    /// Whether there is nothing to keep in a batch.
    pub(super) fn is_empty(&self, batch: &CurveBatch) -> bool {
        self.curvature.is_none() && !self.shape && batch.constraints().largest_curvatures.is_none()
    }

    /// Checks that the limits make sense.
    ///
    /// # Errors
    /// A curvature that is not positive and finite. Sides of spatial curves.
    pub(super) fn check(&self, dimension: usize) -> Result<()> {
        if let Some(curvature) = self.curvature.filter(|curvature| !(*curvature > 0.0 && curvature.is_finite())) {
            return Err(Error::argument(format!(
                "the largest curvature is {curvature}; it must be positive and finite, in 1/length: a radius R has 1/R"
            )));
        }
        if self.shape && dimension > 2 {
            return Err(Error::argument(
                "curves in space turn to no side: the shape of planar points alone can be kept",
            ));
        }
        Ok(())
    }

    /// The first point of curve `i` whose largest curvature is none, with what is wrong with it.
    pub(super) fn problem(&self, batch: &CurveBatch, i: usize) -> Option<(usize, String)> {
        let column = &batch.constraints().largest_curvatures.as_ref()?[batch.offsets()[i]..batch.offsets()[i + 1]];
        let point = column.iter().position(|bound| *bound <= 0.0)?;
        let bound = column[point];
        Some((
            point,
            format!("its largest curvature is {bound}; give a positive number in 1/length, or leave it empty"),
        ))
    }

    /// The slopes β of the fences of |K| and of the signed curvature at every vertex of a curve at size 1.
    ///
    /// They are 0 where there is no limit. `rows` are the vertices of the data points, at the end of a closed curve the
    /// first once more. A kind that limits nothing is empty.
    pub(super) fn slopes<const D: usize>(
        &self,
        batch: &CurveBatch,
        i: usize,
        rows: &[u32],
        vertices: usize,
        size: f64,
    ) -> [Vec<f64>; 2] {
        let closed = batch.is_closed(i);
        let spans: Vec<Span> = spans(rows, vertices, batch.count(i), closed);
        let curb = match self.bounds(batch, i, &spans) {
            Some(bounds) => over_vertices(&spans, vertices, closed, &bounds, |a, b| a.max(b), |k| 1.0 / (k * size)),
            None => vec![],
        };
        let side = if self.shape && D == 2 { sides(batch, i, &spans, vertices, size) } else { vec![] };
        [curb, side].map(|slopes| if slopes.iter().any(|slope| *slope != 0.0) { slopes } else { vec![] })
    }

    /// The largest curvature in every span, infinite where it is not bounded; none if no span's is.
    fn bounds(&self, batch: &CurveBatch, i: usize, spans: &[Span]) -> Option<Vec<f64>> {
        let column = batch.constraints().largest_curvatures.as_ref();
        if self.curvature.is_none() && column.is_none() {
            return None;
        }
        let of_column = |point: usize| column.map_or(f64::NAN, |column| column[batch.offsets()[i] + point]);
        // `min` passes over NaN, which stands for a blank.
        let bound = |span: &Span| f64::INFINITY.min(of_column(span.point)).min(self.curvature.unwrap_or(f64::INFINITY));
        Some(spans.iter().map(bound).collect())
    }
}

/// A span that has edges: those from a row to another, the second not below the first.
struct Span {
    /// The number of the data point that it begins at, and of the one that it ends at.
    point: usize,
    next: usize,
    rows: [usize; 2],
}

fn spans(rows: &[u32], vertices: usize, points: usize, closed: bool) -> Vec<Span> {
    let span = |k: usize| Span { point: k, next: (k + 1) % points, rows: [rows[k] as usize, rows[k + 1] as usize] };
    let mut spans: Vec<Span> = (0..rows.len() - 1).map(span).filter(|span| span.rows[0] < span.rows[1]).collect();
    debug_assert!(!closed || spans.last().is_none_or(|span| span.rows[1] == vertices));
    // Points that coincide share a vertex: the first of them stands for all.
    for k in 1..spans.len() {
        spans[k - 1].next = spans[k].point;
    }
    if let (true, Some(first)) = (closed, spans.first().map(|span| span.point))
        && let Some(last) = spans.last_mut()
    {
        last.next = first;
    }
    spans
}

/// A slope for every vertex between two edges, from the values of the spans. At a data point it is that of both values.
fn over_vertices(
    spans: &[Span],
    vertices: usize,
    closed: bool,
    of_span: &[f64],
    both: impl Fn(f64, f64) -> f64,
    slope: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let of_span: Vec<f64> = of_span.iter().map(|value| slope(*value)).collect();
    let mut slopes = vec![0.0; vertices];
    for (k, span) in spans.iter().enumerate() {
        slopes[span.rows[0] + 1..span.rows[1]].fill(of_span[k]);
        if k > 0 || closed {
            slopes[span.rows[0]] = both(of_span[if k > 0 { k - 1 } else { spans.len() - 1 }], of_span[k]);
        }
    }
    slopes
}

/// −σℓ at every vertex, with σ the side to turn to, 1 to the left and −1 to the right, and ℓ the mean chord at size 1.
fn sides(batch: &CurveBatch, i: usize, spans: &[Span], vertices: usize, size: f64) -> Vec<f64> {
    let (points, closed) = (batch.points(i).as_chunks::<2>().0, batch.is_closed(i));
    let chords: Vec<Vector<f64, 2>> =
        spans.iter().map(|span| subtract(points[span.next], points[span.point])).collect();
    let lengths: Vec<f64> = chords.iter().map(|chord| dot(*chord, *chord).sqrt()).collect();
    let side = |before: usize, after: usize| {
        let ([a, b], [c, d]) = (chords[before], chords[after]);
        let sine = (a * d - b * c) / (lengths[before] * lengths[after]);
        if sine.abs() < STRAIGHT { 0.0 } else { sine.signum() }
    };
    // Of the start of every span; an end of an open curve has none.
    let start = |k: usize| match k {
        0 if closed => Some(side(spans.len() - 1, 0)),
        0 => None,
        k if k < spans.len() => Some(side(k - 1, k)),
        _ if closed => Some(side(spans.len() - 1, 0)),
        _ => None,
    };
    let scale = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64 / size;
    let mut slopes = vec![0.0; vertices];
    for (k, span) in spans.iter().enumerate() {
        let within = match [start(k), start(k + 1)] {
            [Some(a), Some(b)] if a == b => a,
            [Some(_), Some(_)] => 0.0,
            [a, b] => a.or(b).unwrap_or(0.0),
        };
        slopes[span.rows[0] + 1..span.rows[1]].fill(-scale * within);
        slopes[span.rows[0]] = -scale * start(k).unwrap_or(0.0);
    }
    slopes
}
