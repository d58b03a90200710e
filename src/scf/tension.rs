//! [`TensionSegment`]: one planar segment under tension, of least ∫(|κ|^ν + λ) ds between two
//! points with given end tangents.
//!
//! # The curves
//!
//! The length is free, ν > 1 and λ > 0. With the tangent's angle ψ from a fixed direction, every
//! stationary curve has the first integral (ν − 1)|κ|^ν = F cos ψ + λ. It is written here as (ν −
//! 1)|κ|^ν = λ − P·T, with the unit tangent T and the pull P = −F on the second end,
//! [`force`](TensionSegment::force). P is the gradient of the cost with respect to that end. As a
//! function of the tangent's angle θ, an arc has the radius of curvature ρ = ((ν − 1)/(λ −
//! P·T))^{1/ν}. Its displacement across P is elementary. Its displacement along P and its length
//! are integrals of ρ, computed by Gauss rules with errors of 1e−12 of the arc's length.
//!
//! * |P| < λ: the curvature is never 0, and the curve turns one way (orbit-like; P = 0 gives the
//!   circle).
//! * |P| > λ: the curvature is 0 where the tangent is at acos(λ/|P|) to the pull. There may be an
//!   inflection.
//! * |P| = λ: the curvature falls to 0 as the tangent approaches the pull. For ν ≤ 2 it never
//!   reaches 0. **For ν > 2 it reaches 0 within a finite length, and a straight piece of any length
//!   fits in** along the pull. Between two arcs that turn the same way or opposite ways, the
//!   minimiser is then exactly straight in its middle, over
//!   [`flat_length`](TensionSegment::flat_length). This is not a rare case: every segment that does
//!   not start and end along its chord has a flat piece once λ·chord^ν is large enough.
//!
//! # Which curve is returned
//!
//! The total turn is b − a with the given angles, in [−π, π] each, so a segment may turn by up to a
//! full turn. Among curves that turn one way only, the problem is convex in ρ(θ). A stationary one
//! is therefore the cheapest, and [`between`](TensionSegment::between) returns it. If there is
//! none, the best of these curves would be straight at an end, and turning beyond that end is
//! cheaper: the curve has one inflection, or a flat piece between opposite arcs, at an angle beyond
//! both end angles. The one of least overshoot that is a local minimum in the overshoot is
//! returned. For λ → 0 this is the tension-free segment if that exists. If it does not, as for
//! (150°, −20°) or (100°, −90°), the curve is a loop whose size is of order λ^{−1/ν} as λ → 0. Most
//! often the loop turns beyond both ends, with two inflections.
//!
//! For most pairs of angles such a loop is a second local minimum besides the segment next to the
//! chord. Under a weak tension the loop is the cheaper one: without a bound on the length, a large
//! figure eight with the same end tangents has an arbitrarily small cost. `between` prefers the
//! segment next to the chord if there is one. [`all_between`](TensionSegment::all_between) returns
//! both, the cheapest first.
//!
//! Not considered are curves with more inflections, those that overshoot on the other side, and
//! those with two inflections in the other order. It is not proved that none of them is cheaper.
//! Minimising polygons of the same total turn from 6000 random starts over 400 random segments
//! found none that is cheaper than the first of `all_between`.

mod evaluate;
mod hessian;
mod quadrature;
mod shape;
mod sites;
mod solve;

#[cfg(test)]
mod tests;

use super::arc::Site;
pub(super) use evaluate::{Near, TensionLaw, TensionSpan};
use quadrature::{Law, Pull};
use shape::{Course, Shape};
use sites::Tables;
use solve::Solver;
use std::f64::consts::PI;

/// The largest distance, in chords, by which a segment's arcs may miss its second point.
const CLOSURE: f64 = 1e-9;

/// An arc that turns one way, or a straight piece.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: f64,
    to: f64,
    /// The angle and the sense in which the law's arguments are counted, and the arguments of both
    /// ends.
    axis: f64,
    sense: f64,
    arguments: [f64; 2],
    /// The arc length and the point at which it starts.
    start: f64,
    point: [f64; 2],
    length: f64,
}

/// The curve of least ∫(|κ|^ν + λ) ds between two points with given end tangents and free length.
///
/// ```
/// use faircurve::scf::TensionSegment;
///
/// // A turn by more than half a turn has no curve of least ∫κ² ds; a tension makes one.
/// let (a, b) = (100f64.to_radians(), (-90f64).to_radians());
/// let segment = TensionSegment::between(1.0, [a, b], 2.0, 0.5).unwrap();
/// let end = segment.at(segment.length());
/// assert!((end.point[0] - 1.0).abs() < 1e-12 && end.point[1].abs() < 1e-12 && (end.angle - b).abs() < 1e-12);
///
/// // At ν > 2, a long chord is exactly straight in its middle.
/// let long = TensionSegment::between(20.0, [0.5, 0.5], 3.0, 1.0).unwrap();
/// assert!(long.flat_length() > 10.0);
/// assert_eq!(long.at(0.5 * long.length()).curvature, 0.0);
/// ```
#[derive(Clone, Debug)]
pub struct TensionSegment {
    chord: f64,
    /// −1 if the solution is the mirror image of the segment.
    mirror: f64,
    law: Law,
    shape: Shape,
    /// The angles of the ends, mirrored.
    angles: [f64; 2],
    /// The pieces on a chord of 1, mirrored.
    pieces: [Piece; 4],
    length: f64,
    /// Tables for many sites.
    tables: Option<Box<Tables>>,
}

/// The input on a chord of 1, mirrored so that a + b ≤ 0.
struct Frame {
    chord: f64,
    mirror: f64,
    angles: [f64; 2],
    law: Law,
}

impl Frame {
    fn new(chord: f64, angles: [f64; 2], exponent: f64, tension: f64) -> Option<Self> {
        let sound = chord > 0.0
            && chord.is_finite()
            && angles.iter().all(|angle| angle.abs() <= PI)
            && exponent > 1.0
            && exponent.is_finite()
            && tension > 0.0;
        let scaled = tension * chord.powf(exponent);
        if !sound || !scaled.is_normal() {
            return None;
        }
        Some(Self::of(chord, angles, Law::new(exponent, scaled)))
    }

    /// The frame of valid input, with the law's tension on a chord of 1.
    fn of(chord: f64, angles: [f64; 2], law: Law) -> Self {
        let mirror = if angles[0] + angles[1] > 0.0 { -1.0 } else { 1.0 };
        Self { chord, mirror, angles: angles.map(|angle| mirror * angle), law }
    }

    fn solver(&self) -> Solver<'_> {
        let [first, last] = self.angles;
        Solver { law: &self.law, low: first.min(last), high: first.max(last) }
    }

    /// The segment.
    fn solved(&self) -> Option<TensionSegment> {
        let solver = self.solver();
        let found = solver.solve().and_then(|shape| self.segment(shape));
        // Angles of very different sizes leave no brackets for the roots.
        found.or_else(|| self.segment(solver.nearly_straight()?))
    }

    /// The segment of a shape, if its arcs close the chord.
    fn segment(&self, shape: Shape) -> Option<TensionSegment> {
        let Self { chord, mirror, angles: [first, last], ref law } = *self;
        let pieces = TensionSegment::course(shape, first, last);
        let angles = [first, last];
        let mut segment =
            TensionSegment { chord, mirror, law: law.clone(), shape, angles, pieces, length: 0.0, tables: None };
        let end = segment.place();
        let missed = (end[0] - 1.0).hypot(end[1]);
        (missed <= CLOSURE * segment.length.max(1.0)).then_some(segment)
    }
}

impl Piece {
    fn is_straight(&self) -> bool {
        self.arguments[0] == self.arguments[1]
    }
}

impl TensionSegment {
    /// The segment over a chord of length `chord_length`, for end tangents at `angles` from the
    /// chord (in radians, positive to the left), ν = `exponent` and λ = `tension`.
    ///
    /// `None` for invalid input: a chord that is not positive, angles outside [−π, π], ν ≤ 1, λ ≤
    /// 0, or a number that is not finite. Also `None` if the roots are beyond f64: λ·chord^ν under-
    /// or overflows, or the middle of a segment with ν ≤ 2 is straighter than 1e−300, for ν = 2
    /// from about chord·√λ = 700 on. Of 20,000 random segments (ν in 1.2 … 20, λ·chord^ν in 1e−3 …
    /// 1e3) two have no solution, both with weak tensions and ν < 1.35. A few symmetric pairs (a,
    /// a) of large angles have none either, for ν ≤ 1.5 and λ·chord^ν ≤ 1e−3.
    pub fn between(chord_length: f64, angles: [f64; 2], exponent: f64, tension: f64) -> Option<Self> {
        Frame::new(chord_length, angles, exponent, tension)?.solved()
    }

    /// The known stationary segments, the cheapest first: the segment of
    /// [`between`](Self::between), and the large loop with an inflection beyond either end, if
    /// there is one. The loop is cheaper under a weak tension. Empty if `between` is `None`.
    pub fn all_between(chord_length: f64, angles: [f64; 2], exponent: f64, tension: f64) -> Vec<Self> {
        let Some(frame) = Frame::new(chord_length, angles, exponent, tension) else { return Vec::new() };
        let mut segments: Vec<Self> =
            frame.solver().all().into_iter().filter_map(|shape| frame.segment(shape)).collect();
        segments.sort_by(|one, other| one.cost().total_cmp(&other.cost()));
        segments
    }

    /// The pieces, without their lengths.
    fn course(shape: Shape, first: f64, last: f64) -> [Piece; 4] {
        let Shape { pull, axis, course, ends: [low, high], .. } = shape;
        let sense = if let Pull::Above(_) = pull { -1.0 } else { 1.0 };
        let piece = |[from, to]: [f64; 2], arguments, axis, sense| Piece {
            from,
            to,
            axis,
            sense,
            arguments,
            start: 0.0,
            point: [0.0; 2],
            length: 0.0,
        };
        let near = |angles, arguments| piece(angles, arguments, axis, sense);
        let [at_first, at_last] = if first <= last { [low, high] } else { [high, low] };
        let nothing = near([last; 2], [at_last; 2]);
        match course {
            Course::Direct => [near([first, last], [at_first, at_last]), nothing, nothing, nothing],
            Course::Through(middle) => [
                near([first, middle], [at_first, 0.0]),
                near([middle; 2], [0.0; 2]),
                near([middle, last], [0.0, at_last]),
                nothing,
            ],
            Course::Around(lowest) => {
                // Each half has its own inflection as origin, where its argument is exactly 0.
                let far = |angles, arguments| piece(angles, arguments, lowest, 1.0);
                let (middle, half) = (0.5 * (lowest + axis), 0.5 * (axis - lowest));
                if first <= last {
                    [
                        far([first, lowest], [low, 0.0]),
                        far([lowest, middle], [0.0, half]),
                        near([middle, axis], [half, 0.0]),
                        near([axis, last], [0.0, high]),
                    ]
                } else {
                    [
                        near([first, axis], [high, 0.0]),
                        near([axis, middle], [0.0, half]),
                        far([middle, lowest], [half, 0.0]),
                        far([lowest, last], [0.0, low]),
                    ]
                }
            }
        }
    }

    /// Sets the lengths and starts of the pieces, and returns the end of the last.
    fn place(&mut self) -> [f64; 2] {
        let (mut start, mut point) = (0.0, [0.0; 2]);
        for index in 0..self.pieces.len() {
            let piece = &mut self.pieces[index];
            (piece.start, piece.point) = (start, point);
            let piece = *piece;
            let [length, x, y] = if index == 1 && piece.is_straight() {
                let (sine, cosine) = piece.from.sin_cos();
                [1.0, cosine, sine].map(|part| part * self.shape.flat)
            } else {
                self.arc(piece, piece.arguments[0], piece.arguments[1])
            };
            self.pieces[index].length = length;
            start += length;
            point = [point[0] + x, point[1] + y];
        }
        self.length = start;
        point
    }

    #[cfg(test)]
    fn place_again(&self) -> [f64; 2] {
        self.clone().place()
    }

    /// The length and displacement of an arc between two of the law's arguments, on a chord of 1.
    fn arc(&self, piece: Piece, from: f64, to: f64) -> [f64; 3] {
        let [length, along, across] = self.law.arc(self.shape.pull, from.min(to), from.max(to));
        let across = piece.sense * across;
        let (sine, cosine) = piece.axis.sin_cos();
        [length, along * cosine - across * sine, along * sine + across * cosine]
    }

    fn pull(&self) -> [f64; 2] {
        let strength = self.law.strength(self.shape.pull);
        let direction = self.shape.axis + self.law.opening(self.shape.pull);
        [strength * direction.cos(), strength * direction.sin()]
    }

    /// ∫(|κ|^ν + λ) ds = (νλ·length − P·chord)/(ν − 1), by the first integral.
    pub fn cost(&self) -> f64 {
        let Law { nu, tension, .. } = self.law;
        (nu * tension * self.length - self.pull()[0]) / (nu - 1.0) * self.chord.powf(1.0 - nu)
    }

    /// The length of the chord.
    pub(crate) fn chord(&self) -> f64 {
        self.chord
    }

    /// The arc length.
    pub fn length(&self) -> f64 {
        self.chord * self.length
    }

    /// The first and the last curved piece, if there is any.
    fn ends(&self) -> Option<[Piece; 2]> {
        let mut turning = self.pieces.iter().filter(|piece| !piece.is_straight());
        let first = *turning.next()?;
        Some([first, *turning.next_back().unwrap_or(&first)])
    }

    /// The curvatures at both ends, positive to the left.
    pub fn curvatures(&self) -> [f64; 2] {
        let Some([first, last]) = self.ends() else { return [0.0; 2] };
        [(first, first.arguments[0]), (last, last.arguments[1])].map(|(piece, argument)| {
            let curvature = self.law.curvature(self.shape.pull, argument);
            self.mirror * curvature.copysign(piece.to - piece.from) / self.chord
        })
    }

    /// The moments |κ|^(ν−1) sgn κ at both ends: ∂cost/∂a = −ν·M₀ and ∂cost/∂b = ν·M₁.
    pub fn moments(&self) -> [f64; 2] {
        self.curvatures().map(|curvature| curvature.abs().powf(self.law.nu - 1.0).copysign(curvature))
    }

    /// The pull P on the second end: the gradient of the cost with respect to the second point, for
    /// fixed tangents. The first integral is (ν − 1)|κ|^ν = λ − P·T.
    pub fn force(&self) -> [f64; 2] {
        let [x, y] = self.pull();
        let scale = self.chord.powf(-self.law.nu);
        [scale * x, self.mirror * scale * y]
    }

    /// Whether the curvature changes sign, at a point or across a straight piece.
    pub fn has_inflection(&self) -> bool {
        let mut turning = self.pieces.iter().filter(|piece| !piece.is_straight()).map(|piece| piece.to > piece.from);
        let first = turning.next();
        turning.any(|left| Some(left) != first)
    }

    /// The length of the exactly straight piece; 0 without one. For ν ≤ 2 only a straight
    /// segment has one.
    pub fn flat_length(&self) -> f64 {
        self.chord * self.shape.flat
    }

    /// The point, tangent and curvature at an arc length from the first point, clamped to 0 …
    /// [`length`](Self::length). Newton's method on the arc's length takes some microseconds to
    /// reach rounding.
    pub fn at(&self, arc_length: f64) -> Site {
        self.place_of(arc_length).0
    }
}
