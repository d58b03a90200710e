//! [`Dubins`]: the shortest planar path of bounded curvature from one pose to another.
//!
//! It consists of a turn, a line and a turn, or of three turns of which the middle one is longer
//! than half a circle. All turns are as tight as the bound allows:
//!
//! ```text
//! LSL  RSR  LSR  RSL  LRL  RLR
//! ```
//!
//! The centre of a turn to the side σ lies at f + σ r n(θ), with the normal n(θ) to the left. Let v
//! lead from the first centre to the last, with d = |v|. A line between circles of the sides σ and
//! σ′ has the length p = √(d² − c²) with c = (σ − σ′) r, and the angle ∠v + atan2(c, p). The middle
//! one of three turns is π + 2 acos(d/4r).
//!
//! Source: L. E. Dubins, *On curves of minimal length with a constraint on average curvature, and
//! with prescribed initial and terminal positions and tangents*, American Journal of Mathematics 79
//! (1957).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

/// A turn within this distance of a full circle is the rounding of 0.
const ROUNDING: f64 = 1e-12;

/// A direction, given by its angle.
#[derive(Clone, Copy, Debug)]
pub struct Heading {
    pub angle: f64,
    tangent: Vector<f64, 2>,
}

impl Heading {
    pub fn new(angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Heading { angle, tangent: [cosine, sine] }
    }

    /// The normal to the left.
    fn normal(&self) -> Vector<f64, 2> {
        let [x, y] = self.tangent;
        [-y, x]
    }
}

/// A path of three pieces, each a turn or a line.
#[derive(Clone, Copy, Debug)]
pub struct Dubins {
    /// The side of each piece: 1 for left, −1 for right, 0 for a line.
    sides: [f64; 3],
    /// The length of each piece.
    lengths: [f64; 3],
    radius: f64,
    start: Heading,
}

impl Dubins {
    /// The shortest path along a chord, with these directions at its ends.
    ///
    /// A radius of 0 stands for no bound. The path is then the chord.
    pub fn between(chord: Vector<f64, 2>, [from, to]: [Heading; 2], radius: f64) -> Self {
        if radius == 0.0 {
            let start = Heading::new(chord[1].atan2(chord[0]));
            return Dubins { sides: [0.0; 3], lengths: [0.0, dot(chord, chord).sqrt(), 0.0], radius, start };
        }
        let mut best = Dubins { sides: [0.0; 3], lengths: [f64::INFINITY; 3], radius, start: from };
        for [first, last] in [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]] {
            let between = subtract(scale(last * radius, to.normal()), scale(first * radius, from.normal()));
            let v = add(chord, between);
            let (square, across) = (dot(v, v), (first - last) * radius);
            let angle = v[1].atan2(v[0]);
            // Turns on the same circle need no line.
            let is_one_turn = first == last && square <= (ROUNDING * radius).powi(2);
            if is_one_turn {
                best.improve([first, 0.0, last], [radius * turn(first * (to.angle - from.angle)), 0.0, 0.0]);
                continue;
            }
            let line = (square - across * across).sqrt();
            // NaN if the circles overlap.
            if line < best.length() {
                let along = angle + across.atan2(line);
                let turns = [turn(first * (along - from.angle)), turn(last * (to.angle - along))];
                best.improve([first, 0.0, last], [radius * turns[0], line, radius * turns[1]]);
            }
            let cosine = square.sqrt() / (4.0 * radius);
            if first == last && cosine < 1.0 {
                let half = cosine.acos();
                let [after, before] = [half, PI - half].map(|part| angle + first * (part + FRAC_PI_2));
                let turns = [turn(first * (after - from.angle)), PI + 2.0 * half, turn(first * (to.angle - before))];
                best.improve([first, -first, first], turns.map(|turn| radius * turn));
            }
        }
        best
    }

    /// Takes another path if it is shorter.
    fn improve(&mut self, sides: [f64; 3], lengths: [f64; 3]) {
        let other = Dubins { sides, lengths, ..*self };
        if other.length() < self.length() {
            *self = other;
        }
    }

    pub fn length(&self) -> f64 {
        self.lengths.iter().sum()
    }

    /// The pose at a length from the start and relative to it, with the curvature there.
    pub fn place(&self, length: f64) -> Place {
        let (mut at, mut heading, mut turns, mut left) = ([0.0; 2], self.start, 0.0, length);
        for (k, (&side, &own)) in self.sides.iter().zip(&self.lengths).enumerate().filter(|(_, (_, own))| **own > 0.0) {
            let part = if k < 2 { left.min(own) } else { left };
            turns = side;
            if side == 0.0 {
                at = add(at, scale(part, heading.tangent));
            } else {
                // The direction of a circle's chord halves the turn. Differences of normals would
                // lose digits for short chords.
                let turn = part / self.radius;
                let along = Heading::new(heading.angle + 0.5 * side * turn);
                at = add(at, scale(2.0 * self.radius * (0.5 * turn).sin(), along.tangent));
                heading = Heading::new(heading.angle + side * turn);
            }
            left -= part;
            if left <= 0.0 {
                break;
            }
        }
        let bend = if turns == 0.0 { [0.0; 2] } else { scale(turns / self.radius, heading.normal()) };
        Place { at, tangent: heading.tangent, bend, turns: turns != 0.0 }
    }
}

/// A pose on a path.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub at: Vector<f64, 2>,
    pub tangent: Vector<f64, 2>,
    /// The curvature vector.
    pub bend: Vector<f64, 2>,
    pub turns: bool,
}

/// The end directions of the paths along a chord that have only two pieces, a turn and a line or
/// two turns, for this start direction.
///
/// The length of the shortest path jumps by a circle across these directions.
pub fn jumps(chord: Vector<f64, 2>, from: Heading, radius: f64) -> impl Iterator<Item = f64> {
    [1.0, -1.0].into_iter().flat_map(move |side| {
        let v = subtract(chord, scale(side * radius, from.normal()));
        let (distance, angle) = (dot(v, v).sqrt(), v[1].atan2(v[0]));
        let line = angle + (side * radius).atan2((distance * distance - radius * radius).sqrt());
        // The centre of the second circle has the distance 2r from the first one, and r from the
        // end.
        let half = ((3.0 * radius * radius + distance * distance) / (4.0 * radius * distance)).acos();
        let second = move |half: f64| {
            let (sine, cosine) = (angle + half).sin_cos();
            let [x, y] = subtract(v, [2.0 * radius * cosine, 2.0 * radius * sine]);
            (-side * x).atan2(side * y)
        };
        [line, second(half), second(-half)].into_iter().filter(|angle| angle.is_finite())
    })
}

/// The equivalent angle from 0 to 2π.
fn turn(angle: f64) -> f64 {
    let turn = angle - TAU * (angle / TAU).floor();
    if turn >= TAU - ROUNDING { 0.0 } else { turn }
}
