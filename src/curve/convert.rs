//! Conversion of curves to chains of few cubic Béziers, tangent to the curve at every joint.
//!
//! A piece has the curve's points and tangents at both ends. Its two handle lengths are free:
//!
//! - First the handles of the Hermite cubic are tried, which is exact for cubics.
//! - Then the handles of least squared distance across the curve, by the Gauss–Newton method. The
//!   error of a planar piece of length h is then O(h⁶) instead of O(h⁴) (de Boor, Höllig and Sabin,
//!   "High accuracy geometric Hermite interpolation", CAGD 4, 1987).
//! - Otherwise the piece is halved.
//! - If a span takes three pieces or more, the longest possible pieces are tried instead.
//!
//! Distances are geometric: sites of the curve are matched with nearest points of the piece, in
//! order, which bounds the distance in both directions. Between matched points the gap is taken to
//! be a Hermite cubic. If the midpoint disagrees, the gap is bisected, since curvatures may jump.
//!
//! kurbo's `fit_to_bezpath` fits area and moment of planar curves, may drop handles, and measures
//! at 20 points. It guarantees neither tangents nor the tolerance.

use glam::DVec3;

use super::measure::AnyCurve;
use crate::linalg::power_of_two;

/// A cubic Bézier's control points.
type Piece = [DVec3; 4];

/// 2¹² pieces per span suffice for any tolerance above rounding.
const MAX_HALVINGS: u32 = 12;

/// Inner points to which a piece is fitted, and at which its distance is measured.
const PLACES: usize = 7;

/// Steps between neighbouring points at which distances are measured.
const STEPS: u32 = 4;

/// The most bisections between neighbouring points to measure the distance.
const LOOKS: u32 = 6;

/// The least tolerance of Béziers, relative to a curve's largest coordinate. Smaller tolerances are
/// raised to it.
///
/// It is about 5,000 times the rounding of coordinates. The rounding of curves is about 100 times
/// larger than the rounding of coordinates.
pub const LEAST_TOLERANCE: f64 = 1e-12;

/// Curves with coordinates beyond this or below its inverse are scaled, since squares may overflow
/// or underflow.
const MOST_SIZE: f64 = 1e100;

/// Distances below this, relative to the control points, count as 0.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Gauss–Newton steps. Three or four are usual.
const FIT_STEPS: usize = 8;

/// Handles have converged if a step changes them by less than this fraction.
const FIT_PRECISION: f64 = 1e-3;

/// The largest change of a handle in a step, relative to its length.
const MOST_CHANGE: f64 = 0.5;

/// The precision of the longest possible pieces, relative to their length.
const REACH_PRECISION: f64 = 1.0 / 64.0;

/// A curve's Béziers, in order.
///
/// Consecutive pieces share their end point, bit for bit.
pub(crate) fn beziers(curve: &dyn AnyCurve, tolerance: f64) -> Vec<Piece> {
    let largest = (0..curve.spans()).map(|span| curve.jet(span, 0.0).point.abs().max_element()).fold(0.0, f64::max);
    beziers_of_size(curve, largest, tolerance)
}

/// The Béziers of a curve whose coordinates, also inside spans, are at most about `size`.
pub(crate) fn beziers_of_size(curve: &dyn AnyCurve, size: f64, tolerance: f64) -> Vec<Piece> {
    let spans = curve.spans();
    let mut pieces = Vec::with_capacity(spans);
    let is_usual = size == 0.0 || (MOST_SIZE.recip()..MOST_SIZE).contains(&size);
    // An unfitted curve keeps its points, bit for bit.
    let unit = if is_usual || !curve.is_fitted() { 1.0 } else { power_of_two(&[size]) };
    let tolerance = tolerance.max(LEAST_TOLERANCE * size) / unit;
    for span in 0..spans {
        let length = curve.pace(span);
        // The next span's first point, since the last point of a span may be rounded differently.
        let end = match span + 1 {
            next if next < spans => curve.jet(next, 0.0).point,
            _ if curve.is_closed() => curve.jet(0, 0.0).point,
            _ => curve.jet(span, 1.0).point,
        };
        let span = Span { curve, span, length, end: end / unit, unit, tolerance };
        if !curve.is_fitted() {
            pieces.push(span.stretch(0.0, 1.0).hermite());
        } else if length > 0.0 {
            span.convert(&mut pieces);
        }
    }
    for point in pieces.iter_mut().flatten() {
        *point *= unit;
    }
    pieces
}

/// One span of a curve.
struct Span<'a> {
    curve: &'a dyn AnyCurve,
    span: usize,
    /// The parameter length: [`Curve::pace`](super::Curve::pace).
    length: f64,
    /// The last point. Like all distances and tolerances it is in `unit`s.
    end: DVec3,
    unit: f64,
    tolerance: f64,
}

impl Span<'_> {
    fn convert(&self, pieces: &mut Vec<Piece>) {
        let before = pieces.len();
        let keeps = self.halve((0.0, 1.0), MAX_HALVINGS, pieces);
        let count = pieces.len() - before;
        // Two pieces are needed where one is not enough.
        if keeps
            && count > 2
            && let Some(fewer) = self.reach(count - 1)
        {
            pieces.truncate(before);
            pieces.extend(fewer);
        }
    }

    /// Halves until one piece is enough. Returns whether the tolerance was reached everywhere.
    fn halve(&self, (from, to): (f64, f64), halvings: u32, pieces: &mut Vec<Piece>) -> bool {
        let stretch = self.stretch(from, to);
        match self.piece(&stretch) {
            // A span between repeated points has no piece.
            Some([a, b, c, d]) if a == b && b == c && c == d => true,
            Some(piece) => {
                pieces.push(piece);
                true
            }
            None if halvings == 0 => {
                pieces.push(stretch.hermite());
                false
            }
            None => {
                let middle = 0.5 * (from + to);
                let keeps = self.halve((from, middle), halvings - 1, pieces);
                self.halve((middle, to), halvings - 1, pieces) && keeps
            }
        }
    }

    /// The longest possible pieces. `None` if `most` are not enough.
    fn reach(&self, most: usize) -> Option<Vec<Piece>> {
        let mut pieces = Vec::with_capacity(most);
        let (mut from, mut step) = (0.0, 1.0 / most as f64);
        while from < 1.0 {
            if pieces.len() == most {
                return None;
            }
            let (mut low, mut high, mut found) = (from, None, None);
            while low < 1.0 {
                let to: f64 = high.map_or(low + step, |high| 0.5 * (low + high));
                // A very small rest is included, unless that is known to fail.
                let to = if high.is_none() && to > 1.0 - REACH_PRECISION * step { 1.0 } else { to };
                match self.piece(&self.stretch(from, to)) {
                    Some(piece) => (low, found, step) = (to, Some(piece), 0.5 * (to - from)),
                    None if to - from < f64::from(MAX_HALVINGS).exp2().recip() => return None,
                    None => high = Some(to),
                }
                if high.is_some_and(|high| high - low <= REACH_PRECISION * (low - from)) {
                    break;
                }
            }
            pieces.push(found?);
            (from, step) = (low, low - from);
        }
        Some(pieces)
    }

    fn stretch(&self, from: f64, to: f64) -> Stretch {
        let at = |u: f64| {
            let jet = self.curve.jet(self.span, u);
            (if u == 1.0 { self.end } else { jet.point / self.unit }, jet.first / self.unit)
        };
        Stretch { from, to, ends: [at(from), at(to)], third: self.length * (to - from) / 3.0 }
    }

    /// One piece for a stretch of the span, if one is enough.
    fn piece(&self, stretch: &Stretch) -> Option<Piece> {
        let sites = std::array::from_fn(|k| self.site(stretch, fraction(k)));
        let hermite = stretch.hermite();
        let size = hermite.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let rounding = ROUNDING * size;
        let even = std::array::from_fn(fraction);
        // A piece that is not finite cannot be improved.
        if !(0..PLACES).any(|k| (sites[k].point - point(&hermite, even[k])).length() > rounding) {
            return Some(hermite);
        }
        let tolerance = self.tolerance.max(rounding);
        let places = matched(&hermite, &sites, &even);
        if self.keeps(stretch, &hermite, &sites, &places, tolerance) {
            return Some(hermite);
        }
        let starts = stretch.handles()?;
        starts.into_iter().find_map(|handles| {
            let (fitted, places) = stretch.fitted(&sites, places, handles)?;
            self.keeps(stretch, &fitted, &sites, &places, tolerance).then_some(fitted)
        })
    }

    fn site(&self, stretch: &Stretch, fraction: f64) -> Site {
        let width = stretch.to - stretch.from;
        let jet = self.curve.jet(self.span, stretch.from + fraction * width);
        Site { point: jet.point / self.unit, first: jet.first / self.unit * (width * self.length) }
    }

    /// Whether a piece is within a tolerance of the stretch.
    fn keeps(
        &self,
        stretch: &Stretch,
        piece: &Piece,
        sites: &[Site; PLACES],
        places: &[f64; PLACES],
        tolerance: f64,
    ) -> bool {
        // A piece ends where the curve does, with its tangent.
        let end = |u| Gap { u, v: u, off: DVec3::ZERO, slope: DVec3::ZERO, forward: true };
        let gap = |k: usize| match k {
            0 => end(0.0),
            _ if k > PLACES => end(1.0),
            _ => Gap::of(piece, &sites[k - 1], fraction(k - 1), places[k - 1]),
        };
        let gaps: [Gap; PLACES + 2] = std::array::from_fn(gap);
        gaps.windows(2).all(|pair| largest(&pair[0], &pair[1]) <= tolerance)
            && gaps.windows(2).all(|pair| self.keeps_between(stretch, piece, [&pair[0], &pair[1]], tolerance, LOOKS))
    }

    /// Whether a piece is within a tolerance between two gaps. Bisects if the gap halfway is not as
    /// expected.
    fn keeps_between(&self, stretch: &Stretch, piece: &Piece, [a, b]: [&Gap; 2], tolerance: f64, looks: u32) -> bool {
        let u = 0.5 * (a.u + b.u);
        let site = self.site(stretch, u);
        let v = nearest(piece, site.point, 0.5 * (a.v + b.v), a.v).min(b.v);
        let middle = Gap::of(piece, &site, u, v);
        let (gap, width) = (between(a, b), b.v - a.v);
        let part = if width > 0.0 { (v - a.v) / width } else { 0.5 };
        let turn = width * middle.slope - derivative(&gap, part);
        let surprise = (middle.off - point(&gap, part)).length() + turn.length() / 8.0;
        let largest = largest(a, &middle).max(largest(&middle, b));
        // A curve that reverses along its tangent shows no gap across it, so it is bisected.
        let forward = a.forward && middle.forward && b.forward;
        // If the curvature jumps between a and b, bisection leaves 0.47 of the error. Otherwise it
        // leaves 1/16.
        let enough = if looks == LOOKS { 0.5 * tolerance } else { tolerance };
        (forward && largest + 0.5 * surprise <= enough)
            || largest <= tolerance
                && looks > 0
                && self.keeps_between(stretch, piece, [a, &middle], tolerance, looks - 1)
                && self.keeps_between(stretch, piece, [&middle, b], tolerance, looks - 1)
    }
}

/// A point of a curve.
struct Site {
    point: DVec3,
    /// The derivative with respect to the fraction of the stretch.
    first: DVec3,
}

/// The gap between a curve and a piece at matched points.
struct Gap {
    /// The fraction of the curve's stretch.
    u: f64,
    /// The fraction of the piece.
    v: f64,
    off: DVec3,
    /// The derivative of `off` by v. The derivative by u would jump where the curve's speed does.
    slope: DVec3,
    /// Whether the curve runs in the direction of the piece.
    forward: bool,
}

impl Gap {
    fn of(piece: &Piece, site: &Site, u: f64, v: f64) -> Self {
        let tangent = derivative(piece, v).normalize_or_zero();
        // The matched point moves along with the curve. The rest is across.
        let along = site.first.dot(tangent);
        let across = site.first - tangent * along;
        let slope = if along > 0.0 { across * (derivative(piece, v).length() / along) } else { across };
        Gap { u, v, off: site.point - point(piece, v), slope, forward: along > 0.0 }
    }
}

/// The gap between two gaps, as a Hermite cubic.
fn between(a: &Gap, b: &Gap) -> Piece {
    let third = (b.v - a.v) / 3.0;
    [a.off, a.off + a.slope * third, b.off - b.slope * third, b.off]
}

/// The largest gap between two gaps, inclusive.
fn largest(a: &Gap, b: &Gap) -> f64 {
    let gap = between(a, b);
    let inside = (1..STEPS).map(|j| point(&gap, f64::from(j) / f64::from(STEPS)).length());
    inside.fold(a.off.length().max(b.off.length()), f64::max)
}

/// A part of a span, with the points and derivatives at its ends.
struct Stretch {
    from: f64,
    to: f64,
    ends: [(DVec3, DVec3); 2],
    /// A third of its length in the parameter.
    third: f64,
}

impl Stretch {
    /// Hermite's cubic.
    fn hermite(&self) -> Piece {
        let [(a, first), (b, last)] = self.ends;
        [a, a + first * self.third, b - last * self.third, b]
    }

    /// Two pairs of initial handles, or `None` if a derivative vanishes.
    ///
    /// The first are the handles of a circular arc with the same turn, the second Hermite's. On an
    /// arc one handle may grow as the other shrinks with little change of the distance, so
    /// Hermite's handles, which may be uneven, often fail.
    fn handles(&self) -> Option<[[f64; 2]; 2]> {
        let [(a, first), (b, last)] = self.ends;
        let (start, end) = (first.try_normalize()?, last.try_normalize()?);
        // cos of half the turn
        let half = (0.5 * (1.0 + start.dot(end))).max(0.0).sqrt();
        let arc = 2.0 / 3.0 * a.distance(b) / (1.0 + half);
        Some([[arc; 2], [first.length() * self.third, last.length() * self.third]])
    }

    /// The piece with handles of least squared distances from sites of the curve, and the matched
    /// points.
    fn fitted(
        &self,
        sites: &[Site; PLACES],
        places: [f64; PLACES],
        mut handles: [f64; 2],
    ) -> Option<(Piece, [f64; PLACES])> {
        let [(a, first), (b, last)] = self.ends;
        let (start, end) = (first.try_normalize()?, last.try_normalize()?);
        let with = |[alpha, beta]: [f64; 2]| [a, a + start * alpha, b - end * beta, b];
        // If a piece ends where it starts, an arc has no length.
        if handles.iter().any(|&handle| handle <= 0.0) {
            return None;
        }
        let mut places = matched(&with(handles), sites, &places);
        for _ in 0..FIT_STEPS {
            let piece = with(handles);
            let (mut aa, mut ab, mut bb, mut ar, mut br) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (&v, site) in places.iter().zip(sites) {
                let tangent = derivative(&piece, v).normalize_or_zero();
                let across = |x: DVec3| x - tangent * x.dot(tangent);
                let [_, alpha, beta, _] = weights(v);
                let (alpha, beta) = (across(start) * alpha, across(-end) * beta);
                let off = across(site.point - point(&piece, v));
                (aa, ab, bb) = (aa + alpha.dot(alpha), ab + alpha.dot(beta), bb + beta.dot(beta));
                (ar, br) = (ar + alpha.dot(off), br + beta.dot(off));
            }
            let damping = 1e-10 * (aa + bb);
            (aa, bb) = (aa + damping, bb + damping);
            let determinant = aa * bb - ab * ab;
            let step = [(bb * ar - ab * br) / determinant, (aa * br - ab * ar) / determinant];
            if !step.iter().all(|x| x.is_finite()) {
                return None;
            }
            let most = (0..2).map(|k| step[k].abs() / handles[k]).fold(0.0, f64::max);
            let shorter = if most > MOST_CHANGE { MOST_CHANGE / most } else { 1.0 };
            handles = [handles[0] + shorter * step[0], handles[1] + shorter * step[1]];
            places = matched(&with(handles), sites, &places);
            if most <= FIT_PRECISION {
                break;
            }
        }
        Some((with(handles), places))
    }
}

/// The fraction of inner point k.
fn fraction(k: usize) -> f64 {
    (k + 1) as f64 / (PLACES + 1) as f64
}

/// Points of a piece nearest to sites of the curve, in order, searched from `near`.
fn matched(piece: &Piece, sites: &[Site; PLACES], near: &[f64; PLACES]) -> [f64; PLACES] {
    let mut low = 0.0;
    std::array::from_fn(|k| {
        low = nearest(piece, sites[k].point, near[k], low);
        low
    })
}

/// The fraction of a piece nearest to a point, not below `low`, by two Newton steps from `v`.
fn nearest(piece: &Piece, p: DVec3, mut v: f64, low: f64) -> f64 {
    for _ in 0..2 {
        let (off, first) = (point(piece, v) - p, derivative(piece, v));
        let square = first.length_squared();
        let slope = square + off.dot(second_derivative(piece, v));
        // Far from the piece, `v` may be near a point of largest distance.
        let slope = if slope > 0.5 * square { slope } else { square };
        if slope > 0.0 {
            v = (v - off.dot(first) / slope).clamp(low, 1.0);
        }
    }
    v.max(low)
}

/// The Bernstein polynomials.
fn weights(v: f64) -> [f64; 4] {
    let w = 1.0 - v;
    [w * w * w, 3.0 * w * w * v, 3.0 * w * v * v, v * v * v]
}

fn point(piece: &Piece, v: f64) -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|i| piece[i].lerp(piece[i + 1], v));
    a.lerp(b, v).lerp(b.lerp(c, v), v)
}

fn derivative(piece: &Piece, v: f64) -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|i| piece[i + 1] - piece[i]);
    3.0 * a.lerp(b, v).lerp(b.lerp(c, v), v)
}

fn second_derivative(piece: &Piece, v: f64) -> DVec3 {
    let [a, b] = [0, 1].map(|i| piece[i] - 2.0 * piece[i + 1] + piece[i + 2]);
    6.0 * a.lerp(b, v)
}
