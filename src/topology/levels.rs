//! [`Levels`]: how tight every span is drawn, and how near to the data every point is.

use std::ops::Range;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::Topology;
use super::tight::Tightened;
use crate::curve::vector;
use crate::report::Fit;

/// The lengths of handles at every level, as parts of a third of the chord; 0 is a straight span.
const HANDLES: [f64; 8] = [1.0, 1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125, 0.0];

/// How far points stay from the data at every level, as parts of what the fit moved them.
const MOVED: [f64; 8] = [1.0, 0.75, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0];

/// From point to point away from a span the level of points falls by so much.
const FADING: u8 = 2;

/// The tightest level.
const TIGHTEST: u8 = (HANDLES.len() - 1) as u8;

/// How tight the spans and points of every stroke are.
pub(super) struct Levels<'a> {
    topology: &'a Topology,
    fit: &'a Fit,
    /// The levels of every stroke that has any: of its spans and of its points.
    strokes: FxHashMap<u32, (Vec<u8>, Vec<u8>)>,
}

impl<'a> Levels<'a> {
    pub fn new(topology: &'a Topology, fit: &'a Fit) -> Self {
        Levels { topology, fit, strokes: FxHashMap::default() }
    }

    /// Draws a span of a stroke tighter, with its points. False where it is as tight as can be.
    pub fn tighten(&mut self, stroke: u32, span: usize) -> bool {
        let closed = self.topology.strokes().is_closed(stroke as usize);
        let Some((spans, points)) = self.of(stroke) else { return false };
        if spans[span] == TIGHTEST {
            return false;
        }
        spans[span] += 1;
        let (level, count) = (spans[span], points.len());
        let mut at_least = |k: usize, level: u8| points[k % count] = points[k % count].max(level);
        // The points beyond follow a little, so that there is no step.
        for away in 0..count.div_ceil(2) {
            let Some(level) = level.checked_sub(FADING * away as u8).filter(|&level| level > 0) else { break };
            let (before, after) = (span.checked_sub(away), span + 1 + away);
            match (before, closed) {
                (Some(k), _) => at_least(k, level),
                (None, true) => at_least(span + count - away, level),
                (None, false) => {}
            }
            if closed || after < count {
                at_least(after, level);
            }
        }
        true
    }

    /// Brings the points of some spans of a stroke nearer to the data, and then draws the spans
    /// tighter. False where they are as tight as can be.
    pub fn bring_back(&mut self, stroke: u32, range: Range<usize>) -> bool {
        let Some((spans, points)) = self.of(stroke) else { return false };
        let raise = |level: &mut u8| {
            let changed = *level < TIGHTEST;
            *level += u8::from(changed);
            changed
        };
        let count = points.len();
        let nearer = (range.start..=range.end).map(|k| raise(&mut points[k % count])).filter(|&raised| raised).count();
        nearer > 0 || spans[range].iter_mut().map(raise).filter(|&raised| raised).count() > 0
    }

    /// The levels of a stroke, unless it was not fitted.
    fn of(&mut self, stroke: u32) -> Option<(&mut Vec<u8>, &mut Vec<u8>)> {
        let batch = self.topology.strokes();
        let s = stroke as usize;
        if !self.fit.curve(s).is_fitted() {
            return None;
        }
        let (spans, points) =
            self.strokes.entry(stroke).or_insert_with(|| (vec![0; batch.spans(s)], vec![0; batch.count(s)]));
        Some((spans, points))
    }

    /// The strokes as they were fitted.
    pub fn fit(&self) -> &'a Fit {
        self.fit
    }

    /// Number of spans that are tighter than they were fitted.
    pub fn tightened(&self) -> usize {
        self.strokes.values().flat_map(|(spans, _)| spans).filter(|&&level| level > 0).count()
    }

    /// The tightened spans of a stroke.
    pub fn cubics(&self, stroke: u32) -> FxHashMap<u32, [DVec3; 4]> {
        let Some((spans, points)) = self.strokes.get(&stroke) else { return FxHashMap::default() };
        let (curve, batch, s) = (self.fit.curve(stroke as usize), self.topology.strokes(), stroke as usize);
        let count = points.len();
        let place = |k: usize| {
            let fitted = if k == spans.len() { curve.jet(k - 1, 1.0) } else { curve.jet(k, 0.0) };
            let d = batch.dimension();
            let data = vector(&batch.points(s)[k % count * d..][..d]);
            let direction = scaled(fitted.first).0.normalize_or_zero();
            (data + (fitted.point - data) * MOVED[points[k % count] as usize], direction)
        };
        let is_moved = |k: usize| points[k % count] > 0;
        let mut cubics = FxHashMap::default();
        for span in (0..spans.len()).filter(|&k| spans[k] > 0 || is_moved(k) || is_moved(k + 1)) {
            let ((p, u), (q, v)) = (place(span), place(span + 1));
            let chord = q - p;
            let (unit, size) = scaled(chord);
            let length = size * unit.length();
            let handle = |direction: DVec3| match HANDLES[spans[span] as usize] * f64::from(direction != DVec3::ZERO) {
                0.0 => chord / 3.0,
                part => direction * (part * length / 3.0),
            };
            cubics.insert(span as u32, [p, p + handle(u), q - handle(v), q]);
        }
        cubics
    }

    /// The strokes as they are now, with the largest distance of a point from the data.
    pub fn finish(self) -> Fit {
        let mut reports = self.fit.reports().to_vec();
        let batch = self.topology.strokes();
        let mut cubics = FxHashMap::default();
        for (&stroke, (_, points)) in &self.strokes {
            let s = stroke as usize;
            cubics.insert(stroke, self.cubics(stroke));
            let curve = self.fit.curve(s);
            let data = batch.points(s).chunks_exact(batch.dimension()).map(vector);
            let distance = |(k, data): (usize, DVec3)| {
                let fitted = if k == curve.spans() { curve.jet(k - 1, 1.0) } else { curve.jet(k, 0.0) };
                (fitted.point - data).length() * MOVED[points[k] as usize]
            };
            reports[s].max_deviation = data.enumerate().map(distance).fold(0.0, f64::max);
        }
        let device = self.fit.device().clone();
        Fit::new(Tightened { fit: self.fit.clone(), cubics, batch: batch.clone() }, reports, device)
    }
}

/// A vector whose largest component is 1, and its size: squares of both stay in range.
fn scaled(vector: DVec3) -> (DVec3, f64) {
    let size = vector.abs().max_element();
    if size > 0.0 { (vector / size, size) } else { (DVec3::ZERO, 0.0) }
}
