//! Repair of crossing curves, span by span.
//!
//! A tightened span becomes a cubic with the curve's directions at both ends and shorter handles,
//! so the direction stays continuous. Points that the fit moved return towards the data with it. At
//! the last level a span is the chord between its data points, so only crossings of the data
//! remain.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use super::Topology;
use super::crossings::Place;
use super::faults::Crossing;
use super::levels::Levels;
use super::nesting::{Misplaced, Nesting};
use super::sampled::Sampled;
use super::samples::{self, Samples};
use crate::curve::Sampling;
use crate::report::Fit;

/// The most decimals of a number.
const MOST_DECIMALS: u8 = 15;

/// The result of a repair.
#[derive(Clone, Debug, Default)]
pub struct Mended {
    /// Number of crossings before.
    pub before: usize,
    /// The remaining crossings: of the data, or by [rounding](Sampled::rounded).
    pub left: Vec<Crossing>,
    /// Number of samples left out where [rounding](Sampled::rounded) folds a border back on itself.
    pub left_out: usize,
    /// Rings that still have too little area, because of rounding.
    pub lost: Vec<usize>,
    /// The number of decimals without faults by rounding. `None` if all remaining faults are in the
    /// data.
    pub decimals: Option<u8>,
    /// Number of tightened spans.
    pub tightened: usize,
    /// Number of rings that had lost too much of their area.
    pub kept: usize,
    /// Number of curves that were on the wrong side of others.
    pub misplaced: usize,
    /// The curves that still are, because of rounding.
    pub astray: Vec<usize>,
}

impl Sampled {
    /// Tightens strokes where their samples cross, where a ring has less than `keep_area` of its
    /// area, and where a curve is on the wrong side of a ring.
    ///
    /// Crossing spans become cubics with the same directions at their ends and shorter handles.
    /// Points that the fit moved return towards the data, step by step. At the last step a span is
    /// its chord, so only crossings of the data remain.
    pub fn mend(self, keep_area: f64) -> (Sampled, Mended) {
        let Sampled { topology, fit, sampling, decimals, mut samples } = self;
        let (fit, mended) = topology.mend(fit, (sampling, decimals), keep_area, &mut samples);
        (Sampled { topology, fit, sampling, decimals, samples }, mended)
    }
}

impl Topology {
    fn mend(
        &self,
        fit: Fit,
        written: (Sampling, Option<u8>),
        keep_area: f64,
        samples: &mut [Samples],
    ) -> (Fit, Mended) {
        let mut levels = Levels::new(self, &fit);
        let mut crossing = self.places(samples, |_| true);
        let rings: Vec<usize> = (0..self.batch.len()).filter(|&i| self.is_ring(i)).collect();
        let mut shrunken: Vec<usize> =
            rings.iter().copied().filter(|&i| self.is_shrunken(i, samples, keep_area)).collect();
        let nesting = Nesting::new(self, &self.data());
        let mut misplaced = nesting.misplaced(samples);
        let mut mended = Mended {
            misplaced: nesting.curves(&misplaced).len(),
            before: self.named(samples, crossing.clone()).len(),
            kept: shrunken.len(),
            ..Mended::default()
        };
        if written.1.is_some() {
            for (arc, of_arc) in samples.iter_mut().enumerate().filter(|(arc, _)| !self.arcs.kept[*arc]) {
                mended.left_out += of_arc.leave_out(self.arcs.closed[arc]);
            }
            crossing = self.places(samples, |_| true);
        }
        loop {
            // Each span once, however many of its segments cross.
            let crossed = crossing.iter().flatten().flat_map(|&place| self.spans_of(samples, place));
            let crossed: BTreeSet<(u32, usize)> = crossed.collect();
            let tightened = crossed.into_iter().filter(|&(stroke, span)| levels.tighten(stroke, span));
            let mut changed: Vec<u32> = tightened.map(|(stroke, _)| stroke).collect();
            for way in shrunken.iter().flat_map(|&i| &self.arcs.uses[i]) {
                let (place, spans) = (self.strokes.places[way.arc as usize], self.arcs.spans(way.arc as usize));
                let first = place.first as usize;
                changed.extend(levels.bring_back(place.stroke, first..first + spans).then_some(place.stroke));
            }
            for misplaced in &misplaced {
                changed.extend(self.part_from_ring(&mut levels, samples, &nesting, misplaced));
            }
            if changed.is_empty() {
                break;
            }
            changed.sort_unstable();
            changed.dedup();
            samples::sample_again(self, &levels, &changed, written, samples);
            let is_new = |arc: u32| changed.binary_search(&self.strokes.places[arc as usize].stroke).is_ok();
            crossing.retain(|[a, b]| !is_new(a.0) && !is_new(b.0));
            crossing.extend(self.places(samples, is_new));
            shrunken.retain(|&i| self.is_shrunken(i, samples, keep_area));
            misplaced = nesting.misplaced(samples);
        }
        mended.tightened = levels.tightened();
        mended.left = self.named(samples, crossing);
        mended.lost = shrunken;
        mended.astray = nesting.curves(&misplaced);
        let left = mended.left.len() + mended.lost.len() + mended.astray.len();
        if let (Some(decimals), true) = (written.1, left > 0) {
            let all: Vec<u32> = (0..self.strokes().len() as u32).collect();
            let mut left_with = |decimals: Option<u8>| {
                samples::sample_again(self, &levels, &all, (written.0, decimals), samples);
                let crossing = self.named(samples, self.places(samples, |_| true));
                let shrunken = rings.iter().filter(|&&i| self.is_shrunken(i, samples, keep_area)).count();
                crossing.len() + shrunken + nesting.curves(&nesting.misplaced(samples)).len()
            };
            let of_data = left_with(None);
            if left > of_data {
                mended.decimals = (decimals + 1..MOST_DECIMALS).find(|&more| left_with(Some(more)) <= of_data);
            }
            left_with(Some(decimals));
        }
        (levels.finish(), mended)
    }

    /// Brings back a misplaced part, and the nearby spans of the ring. Returns the changed strokes.
    fn part_from_ring(
        &self,
        levels: &mut Levels,
        samples: &[Samples],
        nesting: &Nesting,
        misplaced: &Misplaced,
    ) -> Vec<u32> {
        let boxed = |points: &mut dyn Iterator<Item = DVec2>| {
            points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
        };
        let data = |arc: usize, k: usize| {
            let stops = &self.arcs.stops[arc];
            let stop = stops[k % stops.len()];
            DVec3::from_array(self.vertices.position(stop.vertex, stop.turn)).truncate()
        };
        let (mut changed, mut part) = (Vec::new(), (DVec2::INFINITY, DVec2::NEG_INFINITY));
        for arc in nesting.arcs(misplaced.part) {
            let (place, spans) = (self.strokes.places[arc], self.arcs.spans(arc));
            let given = (0..=spans).map(|k| data(arc, k));
            let (low, high) = boxed(&mut given.chain(samples[arc].points.iter().map(|point| point.truncate())));
            part = (part.0.min(low), part.1.max(high));
            let range = place.first as usize..place.first as usize + spans;
            changed.extend(levels.bring_back(place.stroke, range).then_some(place.stroke));
        }
        // On the way from the data to the samples, each point of a segment stays in the box of both.
        for way in &self.arcs.uses[misplaced.ring as usize] {
            let arc = way.arc as usize;
            let (place, spans, of_arc) = (self.strokes.places[arc], self.arcs.spans(arc), &samples[arc]);
            let along = |span: usize| place.first as usize + if place.reversed { spans - span } else { span };
            let n = of_arc.points.len();
            for k in 0..n - usize::from(!self.arcs.closed[arc]) {
                let to = of_arc.t.get(k + 1).map_or(spans, |t| t.ceil() as usize);
                let segment = of_arc.t[k] as usize..to.min(spans);
                let fitted = [k, (k + 1) % n].map(|k| of_arc.points[k].truncate());
                let given = (segment.start..=segment.end).map(|k| data(arc, k));
                let (low, high) = boxed(&mut given.chain(fitted));
                if low.cmple(part.1).all() && part.0.cmple(high).all() {
                    let ends = [along(segment.start), along(segment.end)];
                    let range = ends[0].min(ends[1])..ends[0].max(ends[1]);
                    changed.extend(levels.bring_back(place.stroke, range).then_some(place.stroke));
                }
            }
        }
        changed
    }

    /// The spans of strokes that hold a segment of an arc's samples.
    fn spans_of(&self, samples: &[Samples], (arc, segment): Place) -> impl Iterator<Item = (u32, usize)> + use<> {
        let (place, spans) = (self.strokes.places[arc as usize], self.arcs.spans(arc as usize));
        let t = &samples[arc as usize].t;
        let (from, to) = (t[segment as usize], t.get(segment as usize + 1).copied().unwrap_or(spans as f64));
        let along = move |span: usize| if place.reversed { spans - 1 - span } else { span };
        (from.floor() as usize..(to.ceil() as usize).min(spans))
            .map(move |span| (place.stroke, place.first as usize + along(span)))
    }

    /// Whether a ring's samples enclose less than `keep_area` of its points' area, or the
    /// orientation is reversed.
    fn is_shrunken(&self, i: usize, samples: &[Samples], keep_area: f64) -> bool {
        let points = self.batch.points(i).chunks_exact(self.batch.dimension());
        let (mut data, mut now) = (Area::default(), Area::default());
        for point in points {
            data.add(DVec2::from_slice(&point[..2]));
        }
        samples::samples_along(self, samples, i, |point, _| now.add(point.truncate()));
        data.get() != 0.0 && now.get() * data.get().signum() < keep_area * data.get().abs()
    }
}

/// The signed area of a polygon, positive if it is oriented to the left.
#[derive(Default)]
struct Area {
    first: Option<DVec2>,
    /// Relative to the first point.
    last: DVec2,
    twice: f64,
}

impl Area {
    fn add(&mut self, point: DVec2) {
        let next = point - *self.first.get_or_insert(point);
        self.twice += self.last.perp_dot(next);
        self.last = next;
    }

    fn get(&self) -> f64 {
        0.5 * self.twice
    }
}
