//! Curves as chains of cubic Béziers, in few pieces.
//!
//! The chain is within a tolerance of the curve, and tangent to it at every joint.
//!
//! A piece leads from one place of a curve to another. It has the curve's points and tangents at
//! both. The lengths of its two handles are free. A piece is found in these steps:
//!
//! - At first the handles are those of Hermite's cubic, a third of the derivatives. This is exact
//!   where the curve is a cubic.
//! - If that strays too far, the handles are those of least squared distance. Gauss' and Newton's
//!   method find them, with the distances taken across the curve. A planar piece of length h then
//!   strays by O(h⁶) in place of O(h⁴) (de Boor, Höllig and Sabin, "High accuracy geometric Hermite
//!   interpolation", CAGD 4, 1987).
//! - If that strays too, the piece is halved.
//! - If a span came to three pieces or more, pieces as long as possible are tried instead.
//!
//! Distances are geometric. Places of the curve are matched with places of the piece, in order,
//! nearest to nearest. So no point of either is farther from the other than matched points are.
//! Between matched points the gap is taken to be Hermite's cubic. If halfway it is not, the gap is
//! measured more closely: curves have kinks in their curvature, fair curves one a vertex.
//!
//! kurbo's `fit_to_bezpath` fits area and moment of planar curves. It leaves out handles where that
//! suits it, and measures from the curve at 20 places. So neither tangents nor tolerance are
//! certain.

use glam::DVec3;

use super::measure::AnyCurve;
use crate::linalg::power_of_two;

/// A cubic Bézier's control points.
type Piece = [DVec3; 4];

/// 2¹² pieces a span are more than any tolerance above rounding asks for.
const MAX_HALVINGS: u32 = 12;

/// Places between a piece's ends to which it is fitted.
///
/// Distances and their slopes are measured there. A fitted piece crosses the curve twice.
const PLACES: usize = 7;

/// Steps from one place to the next at which distances are measured.
const STEPS: u32 = 4;

/// The most times that the distance of two places is halved to measure in between.
const LOOKS: u32 = 6;

/// The least tolerance of Béziers, as a part of a curve's largest coordinate.
///
/// It is some thousand times the rounding of coordinates. The rounding of curves is some hundred
/// times that of coordinates. A smaller tolerance is raised to this one.
pub const LEAST_TOLERANCE: f64 = 1e-12;

/// Squares of coordinates beyond this, or below its inverse, may overflow or vanish.
///
/// Such curves are converted in units of their own.
const MOST_SIZE: f64 = 1e100;

/// Distances below this many units of rounding of the control points count as 0.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Steps of Gauss' and Newton's method. Handles are good after three or four.
const FIT_STEPS: usize = 8;

/// Handles have converged when a step changes them by less than this part.
///
/// Distances then change by far less than their size.
const FIT_PRECISION: f64 = 1e-3;

/// The most that one step may change a handle, as a part of its length.
///
/// Beyond that it extrapolates.
const MOST_CHANGE: f64 = 0.5;

/// The longest possible pieces are found to this part of their length.
const REACH_PRECISION: f64 = 1.0 / 64.0;

/// A curve's Béziers, in order.
///
/// Each starts at the point, bit for bit, at which the one before it ends.
pub(crate) fn beziers(curve: &dyn AnyCurve, tolerance: f64) -> Vec<Piece> {
    let largest = (0..curve.spans()).map(|span| curve.jet(span, 0.0).point.abs().max_element()).fold(0.0, f64::max);
    beziers_of_size(curve, largest, tolerance)
}

/// The Béziers of a curve whose coordinates are up to about this size, also inside its spans.
pub(crate) fn beziers_of_size(curve: &dyn AnyCurve, size: f64, tolerance: f64) -> Vec<Piece> {
    let spans = curve.spans();
    let mut pieces = Vec::with_capacity(spans);
    let is_usual = size == 0.0 || (MOST_SIZE.recip()..MOST_SIZE).contains(&size);
    // A curve that was not fitted keeps its points, bit for bit.
    let unit = if is_usual || !curve.is_fitted() { 1.0 } else { power_of_two(&[size]) };
    let tolerance = tolerance.max(LEAST_TOLERANCE * size) / unit;
    for span in 0..spans {
        let length = curve.pace(span);
        // The next span's first point, since some curves compute the last one of a span with a
        // rounding.
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
    pieces.iter_mut().flatten().for_each(|point| *point *= unit);
    pieces
}

/// One span of a curve.
struct Span<'a> {
    curve: &'a dyn AnyCurve,
    span: usize,
    /// The length of the parameter, or what stands for it: [`Curve::pace`](super::Curve::pace).
    length: f64,
    /// The last point, in `unit`s, as all distances and tolerances are.
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

    /// Halves until one piece is enough. Returns whether that was reached everywhere.
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

    /// The longest possible pieces, one after the other. `None` if `most` are not enough.
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
                // A very small rest is taken along, unless that is known to be too much.
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

    /// Whether a piece keeps within a tolerance of the stretch.
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

    /// Whether a piece keeps within a tolerance between two places.
    ///
    /// If the gap halfway is not as expected, it is measured more closely.
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
        // A curve that runs on and comes back along its tangent shows no gap across. There matched
        // places are measured closely.
        let forward = a.forward && middle.forward && b.forward;
        // Where the curvature jumps, anywhere between a and b, halving leaves less than half of the
        // error (0.47 times). Elsewhere it leaves a sixteenth.
        let enough = if looks == LOOKS { 0.5 * tolerance } else { tolerance };
        (forward && largest + 0.5 * surprise <= enough)
            || largest <= tolerance
                && looks > 0
                && self.keeps_between(stretch, piece, [a, &middle], tolerance, looks - 1)
                && self.keeps_between(stretch, piece, [&middle, b], tolerance, looks - 1)
    }
}

/// A place of a curve.
struct Site {
    point: DVec3,
    /// The derivative with respect to the fraction of the stretch.
    first: DVec3,
}

/// The gap between a curve and a piece at matched places.
struct Gap {
    /// The fraction of the curve's stretch.
    u: f64,
    /// The fraction of the piece.
    v: f64,
    off: DVec3,
    /// The derivative of `off` by v.
    ///
    /// The derivative by u would jump where the curve's parameter changes its speed.
    slope: DVec3,
    /// Whether the curve runs in the direction of the piece.
    forward: bool,
}

impl Gap {
    fn of(piece: &Piece, site: &Site, u: f64, v: f64) -> Self {
        let tangent = derivative(piece, v).normalize_or_zero();
        // The matched place moves along with the curve. What is left goes across.
        let along = site.first.dot(tangent);
        let across = site.first - tangent * along;
        let slope = if along > 0.0 { across * (derivative(piece, v).length() / along) } else { across };
        Gap { u, v, off: site.point - point(piece, v), slope, forward: along > 0.0 }
    }
}

/// The gap from one place to the next: Hermite's cubic, as a Bézier.
fn between(a: &Gap, b: &Gap) -> Piece {
    let third = (b.v - a.v) / 3.0;
    [a.off, a.off + a.slope * third, b.off - b.slope * third, b.off]
}

/// The largest gap from one place to the next, with their ends.
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

    /// Two pairs of handles to start from, or `None` if a derivative vanishes and there is no
    /// tangent.
    ///
    /// The first are those of a circle's arc with the same turn, whatever the curve's parameter.
    /// The second are Hermite's. On an arc one handle may grow and the other shrink with little
    /// change. So a search from uneven handles of Hermite's often goes astray.
    fn handles(&self) -> Option<[[f64; 2]; 2]> {
        let [(a, first), (b, last)] = self.ends;
        let (start, end) = (first.try_normalize()?, last.try_normalize()?);
        // cos of half the turn
        let half = (0.5 * (1.0 + start.dot(end))).max(0.0).sqrt();
        let arc = 2.0 / 3.0 * a.distance(b) / (1.0 + half);
        Some([[arc; 2], [first.length() * self.third, last.length() * self.third]])
    }

    /// The piece with handles of least squared distances from these sites of the curve.
    ///
    /// Comes with the places matched with the sites.
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

/// The fraction of place k.
fn fraction(k: usize) -> f64 {
    (k + 1) as f64 / (PLACES + 1) as f64
}

/// Places of a piece nearest to sites of the curve, in order, searched from `near`.
fn matched(piece: &Piece, sites: &[Site; PLACES], near: &[f64; PLACES]) -> [f64; PLACES] {
    let mut low = 0.0;
    std::array::from_fn(|k| {
        low = nearest(piece, sites[k].point, near[k], low);
        low
    })
}

/// The place of a piece nearest to a point, not below `low`.
///
/// It is found by two steps of Newton's method from `v`.
fn nearest(piece: &Piece, p: DVec3, mut v: f64, low: f64) -> f64 {
    for _ in 0..2 {
        let (off, first) = (point(piece, v) - p, derivative(piece, v));
        let square = first.length_squared();
        let slope = square + off.dot(second_derivative(piece, v));
        // Far from the piece the slope may be that of a place of largest distance.
        let slope = if slope > 0.5 * square { slope } else { square };
        if slope > 0.0 {
            v = (v - off.dot(first) / slope).clamp(low, 1.0);
        }
    }
    v.max(low)
}

/// Bernstein's polynomials.
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
