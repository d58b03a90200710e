//! [`Course`]: where a curve lies, and where it lay when it crossed nothing.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;

use crate::batch::CurveBatch;
use crate::discrete::curves::Vertices;
use crate::topology::crossings::Line;

/// The steps from a curve to its reference.
const STEPS: u8 = 8;

/// A curve of a batch.
pub(super) struct Course {
    /// Its vertices, or without any its points.
    pub points: Vec<DVec3>,
    /// As many places that do not cross those of others: at first on the polygon of its points, later on the way from there to the curve.
    pub reference: Vec<DVec3>,
    /// The rows of its data points. A closed curve has one more, the row after its last.
    rows: Vec<u32>,
    closed: bool,
    /// Whether it has vertices of its own.
    pub is_fitted: bool,
}

/// The points of a curve; none where they are not all finite.
pub(super) fn polygon(batch: &CurveBatch, i: usize) -> Vec<DVec3> {
    let points = flat(batch.points(i), batch.dimension());
    if points.iter().all(|point| point.is_finite()) { points } else { vec![] }
}

fn flat(coords: &[f64], dimension: usize) -> Vec<DVec3> {
    coords.chunks_exact(dimension).map(|point| DVec3::new(point[0], point[1], 0.0)).collect()
}

impl Course {
    /// That of curve `i`, whose reference is the polygon of its points.
    pub fn of(batch: &CurveBatch, i: usize, vertices: Option<&Vertices>) -> Self {
        let (closed, polygon) = (batch.is_closed(i), polygon(batch, i));
        let count = polygon.len();
        let Some(Vertices { coords, rows, .. }) = vertices else {
            let rows = (0..(count + usize::from(closed && count > 0)) as u32).collect();
            return Course { points: polygon.clone(), reference: polygon, rows, closed, is_fitted: false };
        };
        let points = flat(coords, batch.dimension());
        let mut reference = points.clone();
        for (k, ends) in rows.windows(2).enumerate() {
            let [from, to] = [ends[0], ends[1]];
            for row in from..to {
                let part = f64::from(row - from) / f64::from(to - from);
                reference[row as usize] = polygon[k].lerp(polygon[(k + 1) % count], part);
            }
        }
        if let (false, Some(last), Some(end)) = (closed, reference.last_mut(), polygon.last()) {
            *last = *end;
        }
        Course { points, reference, rows: rows.clone(), closed, is_fitted: true }
    }

    pub fn line<'a>(&self, points: &'a [DVec3]) -> Line<'a> {
        Line { points, closed: self.closed }
    }

    /// The span of an edge.
    pub fn span(&self, edge: u32) -> usize {
        self.rows.partition_point(|&row| row <= edge).saturating_sub(1)
    }

    /// A span with those before and after it that have edges.
    pub fn beside(&self, span: usize) -> Vec<usize> {
        let count = self.rows.len() - 1;
        let has_edges = |span: &usize| self.rows[*span] < self.rows[*span + 1];
        let round = |k: usize| if self.closed { Some(k % count) } else { (k < count).then_some(k) };
        let after = (1..count).filter_map(|k| round(span + k)).find(has_edges);
        let before = (1..count)
            .filter_map(|k| if self.closed { Some((span + count - k) % count) } else { span.checked_sub(k) })
            .find(has_edges);
        let mut spans: Vec<usize> = before.into_iter().chain([span]).chain(after).collect();
        spans.sort_unstable();
        spans.dedup();
        spans
    }

    /// The vertices of a span, with those of its data points.
    pub fn rows_of(&self, span: usize) -> impl Iterator<Item = usize> + use<> {
        let count = self.points.len();
        (self.rows[span]..=self.rows[span + 1]).map(move |row| row as usize % count)
    }

    /// The edges of a span.
    pub fn edges_of(&self, span: usize) -> Range<usize> {
        self.rows[span] as usize..self.rows[span + 1] as usize
    }

    /// The ends of an edge of the reference.
    pub fn edge(&self, edge: usize) -> [DVec3; 2] {
        [self.reference[edge], self.reference[(edge + 1) % self.reference.len()]]
    }

    /// The shortest way from another segment, which they do not cross, to these spans of the reference: its ends. `None`
    /// where there is no edge.
    pub fn nearest(&self, other: [DVec3; 2], spans: Range<usize>) -> Option<[DVec3; 2]> {
        let edges = self.rows[spans.start] as usize..self.rows[spans.end] as usize;
        // It begins or ends at an end of one of both.
        let ways = edges.flat_map(|edge| {
            let own = self.edge(edge);
            let from = other.map(|end| [end, nearest_of(own, end)]);
            let to = own.map(|end| [nearest_of(other, end), end]);
            from.into_iter().chain(to)
        });
        ways.min_by(|a, b| a[0].distance_squared(a[1]).total_cmp(&b[0].distance_squared(b[1])))
    }

    /// Where its vertices are, drawn towards the reference by the levels of their spans.
    pub fn drawn(&self, levels: &[u8]) -> Vec<DVec3> {
        let mut of_rows = vec![0; self.points.len()];
        for (span, &level) in levels.iter().enumerate() {
            self.rows_of(span).for_each(|row| of_rows[row] = level.max(of_rows[row]));
        }
        let places = self.points.iter().zip(&self.reference).zip(of_rows);
        places
            .map(|((&point, &reference), level)| match level {
                0 => point,
                STEPS => reference,
                level => point.lerp(reference, f64::from(level) / f64::from(STEPS)),
            })
            .collect()
    }

    /// Its length over that of the polygon of its points.
    pub fn stretch(&self, batch: &CurveBatch, i: usize) -> f64 {
        let edges = self.points.len() - usize::from(!self.closed);
        let edge = |k: usize| self.points[k].distance(self.points[(k + 1) % self.points.len()]);
        (0..edges).map(edge).sum::<f64>() / batch.chords(i).sum::<f64>()
    }
}

/// The point of a segment that is nearest to another point.
fn nearest_of([p, q]: [DVec3; 2], from: DVec3) -> DVec3 {
    let (way, square) = (q - p, (q - p).length_squared());
    let part = if square > 0.0 { (from - p).dot(way) / square } else { 0.0 };
    match part {
        ..=0.0 => p,
        1.0.. => q,
        _ => p + part * way,
    }
}

/// How far the spans of curves are drawn towards their references.
#[derive(Default)]
pub(super) struct Levels(BTreeMap<usize, Vec<u8>>);

impl Levels {
    /// Draws a span of curve `i` further, and returns whether it could.
    pub fn raise(&mut self, course: &Course, i: usize, span: usize) -> bool {
        if !course.is_fitted {
            return false;
        }
        let level = &mut self.0.entry(i).or_insert_with(|| vec![0; course.rows.len() - 1])[span];
        let can = *level < STEPS;
        *level += u8::from(can);
        can
    }

    /// Those of a curve.
    pub fn of(&self, i: usize) -> &[u8] {
        self.0.get(&i).map_or(&[], Vec::as_slice)
    }

    /// All curves and spans that are drawn.
    pub fn all(&self) -> Vec<(usize, usize)> {
        let drawn = |(&i, levels): (&usize, &Vec<u8>)| {
            let spans = levels.iter().enumerate().filter(|(_, level)| **level > 0).map(|(span, _)| (i, span));
            spans.collect::<Vec<_>>()
        };
        self.0.iter().flat_map(drawn).collect()
    }
}
