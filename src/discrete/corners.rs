//! Corners: cuts curves where the data polygon turns sharply.
//!
//! The pieces are fitted as separate curves and then joined.

use super::curves::{EvenVertices, Fitted, Tangents, Vertices};
use crate::batch::{CurveBatch, Piece};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::report::CurveReport;

/// A turn counts as a corner if it exceeds the angle by more than this, in radians.
///
/// Otherwise rounding would create corners where the data turn by exactly the angle.
const ROUNDING: f64 = 1e-9;

/// A batch whose curves are cut at their corners.
pub(super) struct Corners {
    /// The pieces, in the order of the curves.
    pub batch: CurveBatch,
    /// For every piece, whether its first and its last point are corners. Corners are pinned.
    pub kept: Vec<[bool; 2]>,
    pieces: Vec<Piece>,
}

impl Corners {
    /// Cuts every curve where its data polygon turns by more than `angle` (radians). Curves for
    /// which `is_whole` holds are not cut.
    pub fn cut<const D: usize>(batch: &CurveBatch, angle: f64, is_whole: &dyn Fn(usize) -> bool) -> Self {
        let (mut pieces, mut kept) = (Vec::new(), Vec::new());
        for curve in 0..batch.len() {
            let (count, closed) = (batch.count(curve), batch.is_closed(curve));
            let is_whole = batch.problem(curve).is_some() || is_whole(curve);
            let corners = if !is_whole { corners::<D>(batch, curve, angle) } else { vec![] };
            let whole = Piece { curve, first: 0, count, closed };
            let Some((&first, &last)) = corners.first().zip(corners.last()) else {
                pieces.push(whole);
                kept.push([false; 2]);
                continue;
            };
            let between = |from: usize, to: usize| Piece { first: from, count: to - from + 1, closed: false, ..whole };
            if !closed {
                pieces.push(between(0, first));
                kept.push([false, true]);
            }
            for pair in corners.windows(2) {
                pieces.push(between(pair[0], pair[1]));
                kept.push([true; 2]);
            }
            pieces.push(between(last, if closed { first + count } else { count - 1 }));
            kept.push([true, closed]);
        }
        Corners { batch: batch.cut(pieces.clone()), kept, pieces }
    }

    /// The curve of every piece.
    pub fn curves(&self) -> Vec<usize> {
        self.pieces.iter().map(|piece| piece.curve).collect()
    }

    /// Joins the fitted pieces.
    ///
    /// A curve is unfitted if any of its pieces is.
    pub fn join(&self, batch: &CurveBatch, pieces: Fitted) -> Fitted {
        let (mut curves, mut reports) = (Vec::with_capacity(batch.len()), Vec::with_capacity(batch.len()));
        let pieces = pieces.owned(&self.batch);
        let mut fitted = pieces.curves.into_iter().zip(pieces.reports);
        for of_curve in self.pieces.chunk_by(|a, b| a.curve == b.curve) {
            let i = of_curve[0].curve;
            let (parts, of_parts): (Vec<_>, Vec<_>) = fitted.by_ref().take(of_curve.len()).unzip();
            let parts: Option<Vec<Vertices>> = parts.into_iter().collect();
            let report = CurveReport::joined(of_parts);
            reports.push(match parts {
                Some(_) => report,
                None => CurveReport::unfitted(report.status, report.message.unwrap_or_default()),
            });
            curves.push(parts.map(|parts| joined_vertices(of_curve, parts, batch.is_closed(i), batch.dimension())));
        }
        Fitted { curves, even: EvenVertices::default(), reports, device: pieces.device }
    }
}

/// The data points at which a curve turns by more than `angle`.
///
/// Of repeated points the last one counts. A point with a given tangent is not a corner.
fn corners<const D: usize>(batch: &CurveBatch, i: usize, angle: f64) -> Vec<usize> {
    let (points, closed) = (batch.points(i).as_chunks::<D>().0, batch.is_closed(i));
    let count = points.len();
    let moves_on = |&k: &usize| (!closed && k + 1 == count) || points[k] != points[(k + 1) % count];
    let distinct: Vec<usize> = (0..count).filter(moves_on).collect();
    let all = distinct.len();
    if all < 2 {
        return vec![];
    }
    let inner = if closed { 0..all } else { 1..all - 1 };
    let is_corner = |&j: &usize| {
        let (before, here, after) = (distinct[(j + all - 1) % all], distinct[j], distinct[(j + 1) % all]);
        let repeated = (here + count - before) % count;
        let is_free = (0..repeated.max(1)).all(|k| batch.tangent(i, (here + count - k) % count).is_none());
        let (from, to) = (subtract(points[here], points[before]), subtract(points[after], points[here]));
        is_free && turn(from, to) > angle + ROUNDING
    };
    inner.filter(is_corner).map(|j| distinct[j]).collect()
}

/// The angle between two vectors, accurate also near 0 and π.
fn turn<const D: usize>(from: Vector<f64, D>, to: Vector<f64, D>) -> f64 {
    let unit = |v: Vector<f64, D>| {
        // Scaling the largest component to 1 first keeps squares from overflow and underflow.
        let largest = v.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        let v = v.map(|x| x / largest);
        scale(1.0 / dot(v, v).sqrt(), v)
    };
    let (from, to) = (unit(from), unit(to));
    let (apart, along) = (subtract(to, from), add(to, from));
    2.0 * dot(apart, apart).sqrt().atan2(dot(along, along).sqrt())
}

/// Joins the pieces of one curve.
///
/// Each corner becomes one vertex. The vertices of a closed curve begin at its first data point.
fn joined_vertices(pieces: &[Piece], mut parts: Vec<Vertices>, closed: bool, dimension: usize) -> Vertices {
    if parts.len() == 1 && !closed || pieces[0].closed {
        return parts.swap_remove(0);
    }
    let (mut coords, mut rows, mut corners, mut given) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for part in &parts {
        // The last vertex of a piece is the first of the next one. On a closed curve the last piece
        // ends at the very first vertex.
        let start = (coords.len() / dimension) as u32;
        corners.push(start);
        coords.extend_from_slice(&part.coords[..part.coords.len() - dimension]);
        rows.extend(part.rows[..part.rows.len() - 1].iter().map(|row| start + row));
        given.extend(part.tangents().given.iter().map(|own| own.after(start)));
    }
    let count = (coords.len() / dimension) as u32;
    rows.push(count);
    let Some(last) = parts.pop().filter(|_| !closed) else {
        // The joined points begin at the first corner. Point 0 of the curve has the index `at`
        // among them.
        let points = rows.len() - 1;
        let at = (points - pieces[0].first) % points;
        let first = rows[at];
        let round = |row: u32| if row < first { row + count - first } else { row - first };
        let mut turned: Vec<u32> = rows[at..points].iter().map(|row| row - first).collect();
        turned.extend(rows[..at].iter().map(|row| row + count - first));
        turned.push(count);
        coords.rotate_left(first as usize * dimension);
        let mut corners: Vec<u32> = corners.into_iter().map(round).collect();
        corners.sort_unstable();
        given.iter_mut().for_each(|own| own.row = round(own.row));
        given.sort_unstable_by_key(|own| own.row);
        let tangents = Tangents { corners, given, ..Tangents::default() }.boxed();
        return Vertices { coords, rows: turned, tangents };
    };
    coords.extend_from_slice(&last.coords[last.coords.len() - dimension..]);
    corners.remove(0);
    Vertices { coords, rows, tangents: Tangents { corners, given, ..Tangents::default() }.boxed() }
}
