//! [`Course`]: the position of a curve, and a reference position in which it crossed nothing.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;

use crate::batch::CurveBatch;
use crate::discrete::curves::Vertices;
use crate::discrete::limits::{Obstacle, way_round};
use crate::topology::crossings::Line;

/// The number of steps from a curve to its reference.
const STEPS: u8 = 8;

/// A curve of a batch, with its reference.
pub(super) struct Course {
    /// Its vertices. An unfitted curve has its data points instead.
    pub points: Vec<DVec3>,
    /// As many positions, which do not cross the references of others. At first they lie on the
    /// data polygon, later between it and the curve.
    pub reference: Vec<DVec3>,
    /// The vertex indices of its data points. A closed curve has one more, one past its last
    /// vertex.
    rows: Vec<u32>,
    closed: bool,
    /// Whether it has vertices.
    pub is_fitted: bool,
}

/// The data points of a curve; empty if any is not finite.
pub(super) fn polygon(batch: &CurveBatch, i: usize) -> Vec<DVec3> {
    let points = flat(batch.points(i), batch.dimension());
    if points.iter().all(|point| point.is_finite()) { points } else { vec![] }
}

/// The corners of the shortest ways around obstacles, by the spans of a curve that have any.
pub(super) type WaysRound = BTreeMap<usize, Vec<DVec3>>;

/// The ways of curve `i` around the obstacles that it stays out of.
pub(super) fn ways_round(batch: &CurveBatch, i: usize, obstacles: &[Obstacle]) -> WaysRound {
    let own: Vec<&Obstacle> = obstacles.iter().filter(|obstacle| obstacle.is_for(&batch.name(i))).collect();
    let points = if own.is_empty() { vec![] } else { polygon(batch, i) };
    let spans = (points.len() + usize::from(batch.is_closed(i))).saturating_sub(1);
    let way = |k: usize| {
        let ends = [k, (k + 1) % points.len()].map(|k| points[k].truncate());
        let corners = way_round(ends[0], ends[1], &own).filter(|corners| !corners.is_empty())?;
        Some((k, corners.into_iter().map(|corner| corner.extend(0.0)).collect()))
    };
    (0..spans).filter_map(way).collect()
}

/// Places the vertices of a span, from its first on, at equal distances along a way to `end`. Each corner of
/// the way is a vertex if there are enough.
fn place(vertices: &mut [DVec3], way: &[DVec3], end: DVec3) {
    let count = vertices.len();
    if way.len() > count {
        return place(vertices, &way[..1], end);
    }
    let leg = |k: usize| [way[k], way.get(k + 1).copied().unwrap_or(end)];
    let length = |k: usize| leg(k)[0].distance(leg(k)[1]);
    let whole: f64 = (0..way.len()).map(length).sum();
    let (mut row, mut before) = (0, 0.0);
    for k in 0..way.len() {
        before += length(k);
        let after = way.len() - 1 - k;
        let next = (count as f64 * before / whole.max(f64::MIN_POSITIVE)).round() as usize;
        let next = if after == 0 { count } else { next.clamp(row + 1, count - after) };
        let [from, to] = leg(k);
        for (step, vertex) in vertices[row..next].iter_mut().enumerate() {
            *vertex = from.lerp(to, step as f64 / (next - row) as f64);
        }
        row = next;
    }
}

fn flat(coords: &[f64], dimension: usize) -> Vec<DVec3> {
    coords.chunks_exact(dimension).map(|point| DVec3::new(point[0], point[1], 0.0)).collect()
}

impl Course {
    /// The course of curve `i`, whose reference is its data polygon with its ways around obstacles.
    pub fn of(batch: &CurveBatch, i: usize, vertices: Option<&Vertices>, ways: &WaysRound) -> Self {
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
            let corners = ways.get(&k).map_or(&[][..], Vec::as_slice);
            let way: Vec<DVec3> = [polygon[k]].into_iter().chain(corners.iter().copied()).collect();
            place(&mut reference[from as usize..to as usize], &way, polygon[(k + 1) % count]);
        }
        if let (false, Some(last), Some(end)) = (closed, reference.last_mut(), polygon.last()) {
            *last = *end;
        }
        Course { points, reference, rows: rows.clone(), closed, is_fitted: true }
    }

    /// An obstacle, which stays where it is.
    pub fn of_obstacle(obstacle: &Obstacle) -> Self {
        let points = flat(obstacle.corners.as_flattened(), 2);
        let rows = (0..=points.len() as u32).collect();
        Course { reference: points.clone(), points, rows, closed: true, is_fitted: false }
    }

    pub fn line<'a>(&self, points: &'a [DVec3]) -> Line<'a> {
        Line { points, closed: self.closed }
    }

    /// The span that contains an edge.
    pub fn span(&self, edge: u32) -> usize {
        self.rows.partition_point(|&row| row <= edge).saturating_sub(1)
    }

    /// A span and the nearest spans before and after it that have edges.
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

    /// The vertices of a span, including its data points.
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

    /// The ends of the shortest connection from another segment to these spans of the reference,
    /// which it does not cross. `None` if there is no edge.
    pub fn nearest(&self, other: [DVec3; 2], spans: Range<usize>) -> Option<[DVec3; 2]> {
        let edges = self.rows[spans.start] as usize..self.rows[spans.end] as usize;
        // It begins or ends at an endpoint of one of the two segments.
        let ways = edges.flat_map(|edge| {
            let own = self.edge(edge);
            let from = other.map(|end| [end, nearest_of(own, end)]);
            let to = own.map(|end| [nearest_of(other, end), end]);
            from.into_iter().chain(to)
        });
        ways.min_by(|a, b| a[0].distance_squared(a[1]).total_cmp(&b[0].distance_squared(b[1])))
    }

    /// The positions of its vertices, moved towards the reference by the levels of their spans.
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

    /// Its length divided by the length of its data polygon.
    pub fn stretch(&self, batch: &CurveBatch, i: usize) -> f64 {
        let edges = self.points.len() - usize::from(!self.closed);
        let edge = |k: usize| self.points[k].distance(self.points[(k + 1) % self.points.len()]);
        (0..edges).map(edge).sum::<f64>() / batch.chords(i).sum::<f64>()
    }
}

/// The point of a segment nearest to another point.
fn nearest_of([p, q]: [DVec3; 2], from: DVec3) -> DVec3 {
    let (way, square) = (q - p, (q - p).length_squared());
    let part = if square > 0.0 { (from - p).dot(way) / square } else { 0.0 };
    match part {
        ..=0.0 => p,
        1.0.. => q,
        _ => p + part * way,
    }
}

/// How far the spans of curves have moved towards their references, in steps.
#[derive(Default)]
pub(super) struct Levels(BTreeMap<usize, Vec<u8>>);

impl Levels {
    /// Moves a span of curve `i` one step further. Returns whether that was possible.
    pub fn raise(&mut self, course: &Course, i: usize, span: usize) -> bool {
        if !course.is_fitted {
            return false;
        }
        let level = &mut self.0.entry(i).or_insert_with(|| vec![0; course.rows.len() - 1])[span];
        let can = *level < STEPS;
        *level += u8::from(can);
        can
    }

    /// The levels of a curve.
    pub fn of(&self, i: usize) -> &[u8] {
        self.0.get(&i).map_or(&[], Vec::as_slice)
    }

    /// All curves and spans that have moved.
    pub fn all(&self) -> Vec<(usize, usize)> {
        let drawn = |(&i, levels): (&usize, &Vec<u8>)| {
            let spans = levels.iter().enumerate().filter(|(_, level)| **level > 0).map(|(span, _)| (i, span));
            spans.collect::<Vec<_>>()
        };
        self.0.iter().flat_map(drawn).collect()
    }
}
