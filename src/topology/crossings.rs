//! Crossings of sampled arcs.
//!
//! Runs of consecutive segments are sorted into the cells of a grid by their boxes. Runs whose
//! boxes meet are compared segment by segment with exact predicates, in n log n steps for evenly
//! sampled curves.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};
use rustc_hash::FxHashSet;

/// Segments of a run.
const RUN: usize = 16;

/// Cells along a side of the grid, at most.
const MOST_ROWS: u32 = 1 << 20;

/// A run whose box covers more cells than this is compared with all others.
const MOST_CELLS: u64 = 4096;

/// A segment: the index of its arc, and its index there.
pub(crate) type Place = (u32, u32);

/// The samples of an arc as a polyline in the plane.
pub(crate) struct Line<'a> {
    pub points: &'a [DVec3],
    pub closed: bool,
}

impl Line<'_> {
    fn segments(&self) -> usize {
        (self.points.len() + usize::from(self.closed)).saturating_sub(1)
    }

    fn point(&self, k: usize) -> DVec2 {
        let k = if k == self.points.len() { 0 } else { k };
        self.points[k].truncate()
    }

    fn segment(&self, k: usize) -> [DVec2; 2] {
        [self.point(k), self.point(k + 1)]
    }
}

/// Consecutive segments of an arc.
struct Run {
    arc: u32,
    first: u32,
    count: u32,
    low: DVec2,
    high: DVec2,
}

/// Pairs of segments that cross, touch or overlap, one of them of an arc that is `new`.
///
/// Neighbours and arcs that meet at an end do not count.
pub(crate) fn crossings(lines: &[Line], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
    let runs = runs(lines);
    let is_new: Vec<bool> = runs.iter().map(|run| new(run.arc)).collect();
    let mut found = Vec::new();
    for (run, _) in runs.iter().zip(&is_new).filter(|(_, new)| **new) {
        within(lines, run, &mut found);
    }
    for [a, b] in meeting(&runs, &is_new, |_, _| true) {
        between(lines, &runs[a as usize], &runs[b as usize], |a, b| may_meet(lines, a, b), &mut found);
    }
    distinct(found)
}

/// Pairs of segments of arcs of different groups that have a point in common, be it a common end,
/// one of them of an arc that is `new`. The lower arc comes first.
pub(crate) fn contacts(lines: &[Line], groups: &[usize], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
    let runs = runs(lines);
    let is_new: Vec<bool> = runs.iter().map(|run| new(run.arc)).collect();
    let group = |run: usize| groups[runs[run].arc as usize];
    let mut found = Vec::new();
    for [a, b] in meeting(&runs, &is_new, |a, b| group(a) != group(b)) {
        between(lines, &runs[a as usize], &runs[b as usize], |_, _| false, &mut found);
    }
    distinct(found)
}

fn distinct(mut pairs: Vec<[Place; 2]>) -> Vec<[Place; 2]> {
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Points within `tolerance` of the interior of a segment: the segment, the fraction along it, and
/// the point.
pub(crate) fn points_on_segments(lines: &[Line], tolerance: f64) -> Vec<(Place, f64, Place)> {
    let mut runs = runs(lines);
    for run in &mut runs {
        (run.low, run.high) = (run.low - tolerance, run.high + tolerance);
    }
    let mut found = Vec::new();
    for run in &runs {
        on_run(lines, run, run, tolerance, &mut found);
    }
    for [a, b] in meeting(&runs, &vec![true; runs.len()], |_, _| true) {
        on_run(lines, &runs[a as usize], &runs[b as usize], tolerance, &mut found);
        on_run(lines, &runs[b as usize], &runs[a as usize], tolerance, &mut found);
    }
    found
}

/// Points of a run `b` on segments of a run `a`.
fn on_run(lines: &[Line], a: &Run, b: &Run, tolerance: f64, found: &mut Vec<(Place, f64, Place)>) {
    let (of_a, of_b) = (lines[a.arc as usize].points, lines[b.arc as usize].points);
    let points: Vec<(u32, DVec3)> = (b.first..=b.first + b.count)
        .map(|k| k % of_b.len() as u32)
        .map(|k| (k, of_b[k as usize]))
        .filter(|(_, point)| a.low.cmple(point.truncate()).all() && point.truncate().cmple(a.high).all())
        .collect();
    if points.is_empty() {
        return;
    }
    for segment in a.first..a.first + a.count {
        let (p, q) = (of_a[segment as usize], of_a[(segment as usize + 1) % of_a.len()]);
        let (low, high, along) = (p.min(q) - tolerance, p.max(q) + tolerance, q - p);
        for &(k, point) in points.iter().filter(|(_, x)| low.cmple(*x).all() && x.cmple(high).all()) {
            let t = (point - p).dot(along) / along.length_squared();
            if t > 0.0 && t < 1.0 && point.distance(p + along * t) <= tolerance {
                found.push(((a.arc, segment), t, (b.arc, k)));
            }
        }
    }
}

fn runs(lines: &[Line]) -> Vec<Run> {
    let mut runs = Vec::new();
    for (arc, line) in lines.iter().enumerate() {
        let segments = line.segments();
        for first in (0..segments).step_by(RUN) {
            let count = RUN.min(segments - first);
            let points = (first..=first + count).map(|k| line.point(k));
            let (low, high) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
            runs.push(Run { arc: arc as u32, first: first as u32, count: count as u32, low, high });
        }
    }
    runs
}

/// Pairs of runs that `is_asked` accepts, whose boxes meet and of which one is new.
fn meeting(runs: &[Run], is_new: &[bool], is_asked: impl Fn(usize, usize) -> bool) -> Vec<[u32; 2]> {
    let boxed =
        runs.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), run| (l.min(run.low), h.max(run.high)));
    // Differences of halves do not overflow.
    let half = |low: DVec2, high: DVec2| (0.5 * high - 0.5 * low).max_element();
    // Twice the mean size of a box: a run lies in one to four cells, mostly.
    let mean = runs.iter().map(|run| half(run.low, run.high) / runs.len() as f64).sum::<f64>();
    let cell = (2.0 * mean).max(half(boxed.0, boxed.1) / f64::from(MOST_ROWS)).max(f64::MIN_POSITIVE);
    let number = |x: f64, low: f64| ((0.5 * x - 0.5 * low) / cell) as u64;
    // New runs come first. Other runs are only entered into cells of new ones.
    let (mut places, mut large, mut cells) = (Vec::new(), Vec::new(), FxHashSet::default());
    let of = |new: bool| runs.iter().enumerate().filter(move |(k, _)| is_new[*k] == new);
    for (k, run) in of(true).chain(of(false)) {
        let [from, to] = [run.low, run.high].map(|p| [number(p.x, boxed.0.x), number(p.y, boxed.0.y)]);
        if (to[0] - from[0] + 1) * (to[1] - from[1] + 1) > MOST_CELLS {
            large.push(k as u32);
            continue;
        }
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                let cell = x << 32 | y;
                if is_new[k] {
                    cells.insert(cell);
                }
                if is_new[k] || cells.contains(&cell) {
                    places.push((cell, k as u32));
                }
            }
        }
    }
    places.sort_unstable();
    let meet = |a: u32, b: u32| {
        let is_asked = (is_new[a as usize] || is_new[b as usize]) && is_asked(a as usize, b as usize);
        let (a, b) = (&runs[a as usize], &runs[b as usize]);
        is_asked && a.low.cmple(b.high).all() && b.low.cmple(a.high).all()
    };
    let mut pairs = Vec::new();
    for in_cell in places.chunk_by(|a, b| a.0 == b.0) {
        for (k, &(_, b)) in in_cell.iter().enumerate() {
            pairs.extend(in_cell[..k].iter().map(|&(_, a)| [a.min(b), a.max(b)]).filter(|&[a, b]| meet(a, b)));
        }
    }
    for &a in &large {
        pairs.extend((0..runs.len() as u32).filter(|&b| a != b && meet(a, b)).map(|b| [a.min(b), a.max(b)]));
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Crossings within a run.
fn within(lines: &[Line], run: &Run, found: &mut Vec<[Place; 2]>) {
    let line = &lines[run.arc as usize];
    let [first, last] = [run.first as usize, (run.first + run.count - 1) as usize];
    let along = line.segment(last)[1] - line.segment(first)[0];
    // A monotone run does not cross itself.
    if (first..=last).all(|k| {
        let [p, q] = line.segment(k);
        (q - p).dot(along) > 0.0
    }) {
        return;
    }
    for b in first..=last {
        for a in first..b {
            if cross(line.segment(a), line.segment(b), may_meet(lines, (run.arc, a as u32), (run.arc, b as u32))) {
                found.push([(run.arc, a as u32), (run.arc, b as u32)]);
            }
        }
    }
}

/// Crossings of two runs.
fn between(lines: &[Line], a: &Run, b: &Run, may_meet: impl Fn(Place, Place) -> bool, found: &mut Vec<[Place; 2]>) {
    // Only segments that reach into both boxes can meet.
    let (low, high) = (a.low.max(b.low), a.high.min(b.high));
    let reaching = |run: &Run| {
        let (line, first) = (&lines[run.arc as usize], run.first as usize);
        (first..first + run.count as usize)
            .map(move |k| (k as u32, line.segment(k)))
            .filter(move |(_, [p, q])| p.min(*q).cmple(high).all() && low.cmple(p.max(*q)).all())
    };
    // The segments of b in an array: most pairs are neighbours, and each would allocate.
    let (mut of_b, mut count) = ([(0, [DVec2::ZERO; 2]); RUN], 0);
    for segment in reaching(b) {
        of_b[count] = segment;
        count += 1;
    }
    for (k, p) in reaching(a) {
        for &(j, q) in &of_b[..count] {
            if cross(p, q, may_meet((a.arc, k), (b.arc, j))) {
                let places = [(a.arc, k), (b.arc, j)];
                found.push(if places[0] <= places[1] { places } else { [places[1], places[0]] });
            }
        }
    }
}

/// Whether two segments may have a common end: neighbours, and the ends of open arcs.
fn may_meet(lines: &[Line], a: Place, b: Place) -> bool {
    let (line, segments) = (&lines[a.0 as usize], lines[a.0 as usize].segments() as u32);
    let away = a.1.abs_diff(b.1);
    let neighbours = a.0 == b.0 && (away == 1 || (line.closed && away + 1 == segments));
    let is_end = |(arc, k): Place| {
        let line = &lines[arc as usize];
        !line.closed && (k == 0 || k as usize + 1 == line.segments())
    };
    neighbours || (is_end(a) && is_end(b))
}

/// Whether a line from `a` to `b` to `c` reverses at `b`.
pub(crate) fn turns_back(a: DVec2, b: DVec2, c: DVec2) -> bool {
    cross([a, b], [b, c], true)
}

/// Whether two segments have a point in common.
pub(crate) fn meet(p: [DVec2; 2], q: [DVec2; 2]) -> bool {
    cross(p, q, false)
}

/// Whether two segments have a point in common, other than a common end if `may_meet`.
fn cross([a, b]: [DVec2; 2], [c, d]: [DVec2; 2], may_meet: bool) -> bool {
    if a == b || c == d || !(a.min(b).cmple(c.max(d)).all() && c.min(d).cmple(a.max(b)).all()) {
        return false;
    }
    let side = |a: DVec2, b: DVec2, p: DVec2| {
        let coord = |p: DVec2| Coord { x: p.x, y: p.y };
        let side = orient2d(coord(a), coord(b), coord(p));
        i8::from(side > 0.0) - i8::from(side < 0.0)
    };
    let on_one_line = |from: DVec2, p: DVec2, q: DVec2| side(from, p, q) == 0 && (p - from).dot(q - from) > 0.0;
    // Segments with a common end overlap or share nothing else.
    if !may_meet && (a == c || a == d || b == c || b == d) {
        return true;
    }
    match (a == c, a == d, b == c, b == d) {
        (true, _, _, true) | (_, true, true, _) => return true,
        (true, ..) => return on_one_line(a, b, d),
        (_, true, ..) => return on_one_line(a, b, c),
        (_, _, true, _) => return on_one_line(b, a, d),
        (.., true) => return on_one_line(b, a, c),
        _ => {}
    }
    // Since the boxes meet, this holds for collinear segments too.
    side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(x: [f64; 4]) -> [DVec2; 2] {
        [DVec2::new(x[0], x[1]), DVec2::new(x[2], x[3])]
    }

    #[test]
    fn segments_cross_touch_and_overlap_and_may_share_an_end() {
        let crossed = |p: [f64; 4], q: [f64; 4]| cross(segment(p), segment(q), true);
        let base = [0.0, 0.0, 2.0, 0.0];
        assert!(crossed(base, [1.0, -1.0, 1.0, 1.0]), "crossing");
        assert!(crossed(base, [1.0, 0.0, 1.0, 1.0]), "touching inside");
        assert!(crossed(base, [1.0, 0.0, 3.0, 0.0]) && crossed(base, base), "on one line");
        assert!(!crossed(base, [3.0, 0.0, 4.0, 0.0]), "on one line, apart");
        assert!(!crossed(base, [2.0, 0.0, 3.0, 1.0]) && !crossed(base, [2.0, 0.0, 4.0, 0.0]), "a common end");
        assert!(cross(segment(base), segment([2.0, 0.0, 3.0, 1.0]), false), "no neighbours");
        assert!(crossed(base, [2.0, 0.0, 1.0, 0.0]), "back on itself");
        assert!(!crossed(base, [1.0, f64::EPSILON, 1.0, 1.0]), "next to it");
    }

    #[test]
    fn arcs_that_share_an_end_are_in_contact_and_do_not_cross() {
        let [a, b] = [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [2.0, 1.0]]]
            .map(|ends| ends.map(|[x, y]: [f64; 2]| DVec3::new(x, y, 0.0)));
        let lines = [&a, &b].map(|points| Line { points, closed: false });
        assert!(crossings(&lines, |_| true).is_empty());
        assert_eq!(contacts(&lines, &[0, 1], |_| true), [[(0, 0), (1, 0)]]);
        assert!(contacts(&lines, &[0, 0], |_| true).is_empty(), "of one group");
    }

    /// Random polylines: the grid finds what comparing every pair finds.
    #[test]
    fn no_crossing_is_missed_and_none_is_made_up() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for step in [0.002, 0.02, 0.3] {
            let mut paths = Vec::new();
            for _ in 0..12 {
                let mut at = DVec2::new(random(), random());
                let path = |_| {
                    at += DVec2::new(random() - 0.5, random() - 0.5) * step;
                    at
                };
                paths.push((0..100).map(path).map(|point: DVec2| point.extend(0.0)).collect::<Vec<_>>());
            }
            let lines: Vec<Line> =
                paths.iter().enumerate().map(|(k, points)| Line { points, closed: k % 3 == 0 }).collect();
            let mut all = Vec::new();
            let places: Vec<Place> =
                (0..12).flat_map(|arc| (0..lines[arc].segments()).map(move |k| (arc as u32, k as u32))).collect();
            for (k, &b) in places.iter().enumerate() {
                let segment = |(arc, k): Place| lines[arc as usize].segment(k as usize);
                let crossed = |&&a: &&Place| cross(segment(a), segment(b), may_meet(&lines, a, b));
                all.extend(places[..k].iter().filter(crossed).map(|&a| [a, b]));
            }
            all.sort_unstable();
            assert_eq!(crossings(&lines, |_| true), all, "steps of {step}");
            assert!(all.len() > 10, "{} crossings", all.len());
            all.retain(|[a, b]| a.0 % 5 == 0 || b.0 % 5 == 0);
            assert_eq!(crossings(&lines, |arc| arc % 5 == 0), all, "those of some arcs");
            let groups: Vec<usize> = (0..12).map(|arc| arc / 2).collect();
            all.retain(|[a, b]| groups[a.0 as usize] != groups[b.0 as usize]);
            assert_eq!(contacts(&lines, &groups, |arc| arc % 5 == 0), all, "those of different groups");
        }
    }
}
