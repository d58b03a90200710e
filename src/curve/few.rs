//! Samples within a tolerance: as few as keep a polyline near its curve.

use glam::{DVec2, DVec3};

use super::measure::AnyCurve;
use crate::sort::farthest;

/// The curve is taken for straight between places from which it departs by less than this part of
/// the tolerance.
const FINE: f64 = 1.0 / 16.0;

/// The most places of a piece without halving it, and the most halvings.
const TOGETHER: usize = 4;
const HALVINGS: u32 = 12;

/// A curve with too few samples gets this part of its tolerance, this many times.
const STRICTER: f64 = 0.25;
const TRIALS: i32 = 8;

/// The rounds in which the area that is left is spread. Samples at their tolerance leave more.
const ROUNDS: usize = 4;

/// A side between corners that is this part of the tolerance near to its chord is the chord.
const STRAIGHT: f64 = 0.02;

/// Directions that differ by more than this (radians) make a corner.
const CORNER: f64 = 0.02;

/// Places of each piece where samples that have moved are compared with the curve.
const BETWEEN: usize = 4;

/// A place of a curve.
struct Place {
    span: usize,
    u: f64,
    point: DVec3,
    /// Whether a sample lies here.
    fixed: bool,
}

/// Sites of as few samples as keep the polyline within a tolerance of the curve, and the curve of the
/// polyline. From each site the next one is as far away as possible. There are at least `least`, unless
/// the curve is a line.
pub(super) fn sites(curve: &dyn AnyCurve, tolerance: f64, least: usize) -> Vec<(usize, f64)> {
    let chosen = |trial: i32| chosen(curve, tolerance * STRICTER.powi(trial));
    (0..TRIALS).map(chosen).find(|sites| sites.len() >= least).unwrap_or_default()
}

/// The part of its tolerance to which a curve may become finer, if it has no more samples for it than
/// MANY per span. With 1 the world at 1:10m within 1 km becomes twice as large.
const FINEST: f64 = 0.1;
const MANY: f64 = 0.5;

/// The part of its length that the tolerance of a closed curve is at most. A circle has ten samples
/// then.
const ROUND: f64 = 1.0 / 120.0;

/// Sites within a tolerance, and within less if there are no more than half as many as spans.
pub(super) fn sites_as_many(curve: &dyn AnyCurve, tolerance: f64, least: usize) -> Vec<(usize, f64)> {
    let chord = |span: usize| curve.jet(span, 0.0).point.distance(curve.jet(span, 1.0).point);
    let length: f64 = (0..curve.spans()).map(chord).sum();
    let is_ring = curve.is_closed() && length > 0.0;
    let tolerance = if is_ring { tolerance.min(ROUND * length) } else { tolerance };
    let coarse = sites(curve, tolerance, least);
    let most = MANY * curve.spans() as f64;
    // The number of samples grows as the root of the inverse tolerance.
    let part = (coarse.len() as f64 / most).powi(2);
    if part >= 1.0 { coarse } else { sites(curve, tolerance * part.max(FINEST), least) }
}

fn chosen(curve: &dyn AnyCurve, tolerance: f64) -> Vec<(usize, f64)> {
    let places = places(curve, FINE * tolerance);
    let mut sites = Vec::new();
    let mut from = 0;
    for to in (1..places.len()).filter(|&to| places[to].fixed) {
        let start = from;
        while from < to {
            sites.push((places[from].span, places[from].u));
            let chord = |end: usize| end <= to && is_near(&places[from..=end], (1.0 - FINE) * tolerance);
            let next = farthest(from + 1, chord);
            // One chord from corner to corner has no sample that could keep the area.
            let is_alone = from == start && next == to && !is_near(&places[from..=to], STRAIGHT * tolerance);
            from = if is_alone { (from + to) / 2 } else { next };
        }
    }
    sites.extend(places.last().filter(|_| !curve.is_closed()).map(|end| (end.span, end.u)));
    sites
}

/// Places along a curve, dense enough that chords between neighbours are within a tolerance of it.
fn places(curve: &dyn AnyCurve, tolerance: f64) -> Vec<Place> {
    let spans = curve.spans();
    let mut places = Vec::new();
    for span in 0..spans {
        let pieces = curve.pieces(span);
        let mut fixed = span == 0 || curve.is_fixed(span);
        for piece in 0..pieces {
            let [from, to] = [piece, piece + 1].map(|k| k as f64 / pieces as f64);
            divide(curve, (span, from, to), tolerance, HALVINGS, &mut |u| {
                places.push(Place { span, u, point: curve.jet(span, u).point, fixed });
                fixed = false;
            });
        }
    }
    if spans > 0 {
        let (span, u) = (spans - 1, 1.0);
        places.push(Place { span, u, point: curve.jet(span, u).point, fixed: true });
    }
    places
}

/// Calls `each` for places inside a part of a span, the first one included and the last one not.
fn divide(
    curve: &dyn AnyCurve,
    (span, from, to): (usize, f64, f64),
    tolerance: f64,
    halvings: u32,
    each: &mut impl FnMut(f64),
) {
    let width = to - from;
    // A chord of a curve with |p″| ≤ m is within m h²/8 of it.
    let bend = |part: f64| curve.jet(span, from + part * width).second.length();
    let most = 2.0 * bend(0.25).max(bend(0.75)) * (curve.pace(span) * width).powi(2);
    let steps = (most / (8.0 * tolerance)).sqrt().ceil().max(1.0);
    if steps > TOGETHER as f64 && halvings > 0 {
        let middle = 0.5 * (from + to);
        divide(curve, (span, from, middle), tolerance, halvings - 1, each);
        divide(curve, (span, middle, to), tolerance, halvings - 1, each);
        return;
    }
    let steps = steps.min(TOGETHER as f64);
    for k in 0..steps as usize {
        each(from + width * (k as f64 / steps));
    }
}

/// Whether places are near the chord from the first to the last, and in order along it.
fn is_near(places: &[Place], tolerance: f64) -> bool {
    let [first, inner @ .., last] = places else { return true };
    let chord = last.point - first.point;
    let length = chord.length();
    let direction = if length > 0.0 { chord / length } else { DVec3::ZERO };
    let mut along = 0.0;
    inner.iter().all(|place| {
        let own = place.point - first.point;
        let before = along;
        along = own.dot(direction);
        let across = own - direction * along;
        along >= before && along <= length && across.length_squared() <= tolerance * tolerance
    })
}

/// Whether the direction jumps at the start of a span.
pub(super) fn is_corner(curve: &dyn AnyCurve, span: usize) -> bool {
    let before = match span {
        0 if curve.is_closed() => curve.spans() - 1,
        0 => return true,
        _ => span - 1,
    };
    let [a, b] = [curve.jet(before, 1.0), curve.jet(span, 0.0)].map(|jet| jet.first.normalize_or_zero());
    a.dot(b) < libm::cos(CORNER) && a != DVec3::ZERO && b != DVec3::ZERO
}

/// Moves samples of a planar curve to its sides, so that the polyline encloses the area that the curve
/// does, as far as both stay within the tolerance. Corners and the ends of open curves stay.
pub(crate) fn keep_area(curve: &dyn AnyCurve, sites: &[(usize, f64)], points: &mut [DVec3], tolerance: f64) {
    let (n, closed) = (sites.len(), curve.is_closed());
    if n < 3 {
        return;
    }
    let segments = if closed { n } else { n - 1 };
    let end = |k: usize| if k + 1 < n { sites[k + 1] } else { (curve.spans() - 1, 1.0) };
    let gaps: Vec<f64> = (0..segments).map(|k| area_between(curve, sites[k], end(k))).collect();
    let offsets: Vec<Vec<(f64, DVec2)>> = (0..segments).map(|k| offsets(curve, sites[k], end(k))).collect();
    // Whether the curve is near a segment whose ends have moved.
    let is_near = |k: usize, moves: &[DVec2]| {
        let [a, b] = [moves[k], moves[(k + 1) % n]];
        offsets[k].iter().all(|&(s, offset)| (offset - a.lerp(b, s)).length_squared() <= tolerance * tolerance)
    };
    let stays = |k: usize| !closed && (k == 0 || k + 1 == n) || sites[k].1 == 0.0 && curve.is_fixed(sites[k].0);
    let is_fixed: Vec<bool> = (0..n).map(stays).collect();
    let free: Vec<usize> = (0..n).filter(|&k| !is_fixed[k]).collect();
    // The part of a segment's area that each of its free ends makes up for.
    let share = |k: usize| if is_fixed[k] || is_fixed[(k + 1) % n] { gaps[k] } else { 0.5 * gaps[k] };
    let places: Vec<DVec2> = points.iter().map(|point| point.truncate()).collect();
    // A move by d adds d × across to the area.
    let across = |k: usize| 0.5 * (places[(k + 1) % n] - places[(k + n - 1) % n]);
    let widths: f64 = free.iter().map(|&k| across(k).length()).sum();
    let mut moves = vec![DVec2::ZERO; n];
    let enclosed = |moves: &[DVec2]| -> f64 {
        let at = |k: usize| places[k % n] - places[0] + moves[k % n];
        (0..segments).map(|k| 0.5 * at(k).perp_dot(at(k + 1))).sum()
    };
    let wanted = enclosed(&moves) + gaps.iter().sum::<f64>();
    for round in 0..=ROUNDS {
        let missing = wanted - enclosed(&moves);
        let before = moves.clone();
        for &k in &free {
            let across = across(k);
            // At first each sample makes up for its own segments. Then all make up evenly for what is
            // left: products of moves, and segments between fixed samples.
            let area = match round {
                0 => share((k + n - 1) % n) + share(k),
                _ => missing * across.length() / widths,
            };
            if across != DVec2::ZERO {
                let moved = moves[k] + DVec2::new(across.y, -across.x) * (area / across.length_squared());
                moves[k] = moved.clamp_length_max(tolerance);
            }
        }
        // Ends of segments that have left the curve go half of the way back, and at last all of it.
        for trial in 0.. {
            let ends = |k: usize| [k, (k + 1) % n];
            let is_far = |&k: &usize| ends(k).iter().any(|&end| moves[end] != before[end]) && !is_near(k, &moves);
            let far: Vec<usize> = (0..segments).filter(is_far).collect();
            if far.is_empty() {
                break;
            }
            for end in far.into_iter().flat_map(ends) {
                moves[end] = if trial < TRIALS { 0.5 * (before[end] + moves[end]) } else { before[end] };
            }
        }
    }
    for (point, own) in points.iter_mut().zip(moves) {
        *point += own.extend(0.0);
    }
}

/// The signed area between a curve and its chord from one site to another, by a cubic on every half of
/// a piece.
fn area_between(curve: &dyn AnyCurve, from: (usize, f64), to: (usize, f64)) -> f64 {
    let start = curve.jet(from.0, from.1).point;
    let mut area = 0.0;
    for span in from.0..=to.0 {
        let halves = 2 * curve.pieces(span);
        let (first, last) = (if span == from.0 { from.1 } else { 0.0 }, if span == to.0 { to.1 } else { 1.0 });
        for half in 0..halves {
            let [own, end] = [half, half + 1].map(|k| (k as f64 / halves as f64).clamp(first, last));
            if own >= end {
                continue;
            }
            let step = curve.pace(span) * (end - own) / 3.0;
            let [a, d] = [curve.jet(span, own), curve.jet(span, end)];
            let [p, b, c, q] =
                [a.point, a.point + a.first * step, d.point - d.first * step, d.point].map(|p| (p - start).truncate());
            area += 0.5 * p.perp_dot(q);
            area += 0.15 * (b - p).perp_dot(c - p) + 0.15 * (b - p).perp_dot(q - p) + 0.3 * (c - p).perp_dot(q - p);
        }
    }
    area
}

/// The offsets of a curve from its chord from one site to another, each with the fraction of the chord.
fn offsets(curve: &dyn AnyCurve, from: (usize, f64), to: (usize, f64)) -> Vec<(f64, DVec2)> {
    let [start, end] = [from, to].map(|(span, u)| curve.jet(span, u).point.truncate());
    let chord = end - start;
    let mut offsets = Vec::new();
    for span in from.0..=to.0 {
        let (first, last) = (if span == from.0 { from.1 } else { 0.0 }, if span == to.0 { to.1 } else { 1.0 });
        let steps = BETWEEN * curve.pieces(span);
        for step in 1..=steps {
            let u = first + (last - first) * (step as f64 / steps as f64);
            let own = curve.jet(span, u).point.truncate() - start;
            let s = (own.dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
            offsets.push((s, own - chord * s));
        }
    }
    offsets
}
