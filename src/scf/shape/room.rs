//! [`Room`]: the distance of a span's end angles from a curvature of the wrong sign. No twin: few
//! curves need it.
//!
//! A segment that turns by t from an end without curvature to the other end starts at this angle
//! from its chord, odd and analytic in t:
//!
//! ```text
//! C(t) = atan2(J(t), S(t)/q)
//! ```
//!
//! Between end angles a and b with t = a − b, the curvature at the start has the sign of C(t) − a,
//! and at the end the sign of b + C(t), with or without an inflection. Both are to the left if −a
//! and b are at least C(−t), which is q/(1 + q) of the turn for small turns. For ν = 2 neither
//! angle is then more than twice the other.

use std::f64::consts::PI;

use super::super::problem::Ends;
use super::super::universal::Universal;
use crate::sides::Asked;

/// The rounding of directions of tangents and chords, up to π. Angles within it of a bound satisfy
/// the bound.
const ROUNDING: f64 = 16.0 * PI * f64::EPSILON;

/// Turns below this have C″ = 0. C″ is a difference of numbers 1/t times as large, whose rounding
/// exceeds it below √ε of a turn.
const STRAIGHT: f64 = 1e-8;

/// The angle that remains until the curvature at an end changes sign, with derivatives by a and b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// In radians, positive if the constraint is satisfied.
    pub value: f64,
    /// ∂/∂a, ∂/∂b
    pub gradient: [f64; 2],
    /// ∂²/∂a², ∂²/∂a∂b, ∂²/∂b²
    pub hessian: [f64; 3],
}

/// C, C′ and C″ for −π < t < π.
fn bound(curve: &Universal, t: f64) -> [f64; 3] {
    let q = curve.q;
    if t.abs() < STRAIGHT {
        let slope = q / (1.0 + q);
        return [slope * t, slope, 0.0];
    }
    let (sign, t) = (t.signum(), t.abs());
    let (moment, along) = curve.moment_along(t);
    // Everything is divided by S².
    let (r, cotangent) = (along / moment, 1.0 / t.tan());
    let square = 1.0 / (q * q) + r * r;
    let first = 1.0 / q - r * cotangent;
    let [first_slope, square_slope] =
        [cotangent + r * (1.0 + (1.0 - q) * cotangent * cotangent), 2.0 * cotangent / q + 2.0 * r];
    let second = (first_slope * square - first * square_slope) / (square * square);
    [sign * along.atan2(moment / q), first / square, sign * second]
}

/// The rooms at both ends of a span of unit chord, where a side is required; `None` if it turns by
/// π or more.
pub(super) fn rooms(curve: &Universal, ends: Ends, asked: &Asked, [a, b]: [f64; 2]) -> Option<[Option<Room>; 2]> {
    let sided = |end: usize, room: &dyn Fn(f64) -> Room| {
        let side = asked.ends[end];
        (side != 0.0).then(|| room(side))
    };
    let flat = |value: f64, gradient: [f64; 2]| Room { value: value - ROUNDING, gradient, hessian: [0.0; 3] };
    Some(match ends {
        Ends::Straight => [None; 2],
        Ends::FreeStart => [None, sided(1, &|side| flat(side * b, [0.0, side]))],
        Ends::FreeEnd => [sided(0, &|side| flat(-side * a, [-side, 0.0])), None],
        Ends::Directed => {
            let t = a - b;
            if t.is_nan() || t.abs() >= PI {
                return None;
            }
            let [c, slope, bend] = bound(curve, t);
            let start = |side: f64| Room {
                value: side * (c - a) - ROUNDING,
                gradient: [side * (slope - 1.0), -side * slope],
                hessian: [side * bend, -side * bend, side * bend],
            };
            let end = |side: f64| Room {
                value: side * (b + c) - ROUNDING,
                gradient: [side * slope, side * (1.0 - slope)],
                hessian: [side * bend, -side * bend, side * bend],
            };
            [sided(0, &start), sided(1, &end)]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::super::super::arc::Arc;
    use super::*;

    const SIDES: [f64; 3] = [1.0, -1.0, 0.0];

    #[test]
    fn rooms_are_positive_where_the_curvature_at_an_end_of_the_cheapest_segment_has_the_side() {
        let mut seen = [0; 4];
        for exponent in [1.2, 2.0, 3.7, 20.0] {
            let curve = Universal::new(exponent);
            for (i, j) in (0..61).flat_map(|i| (0..61).map(move |j| (i, j))) {
                let [a, b] = [i, j].map(|k| -1.5 + 0.0501 * f64::from(k));
                let Some(arc) = Arc::cheapest(&curve, 1.0, [a, b]) else { continue };
                let asked = Asked { ends: [1.0; 2], ..Asked::default() };
                let rooms = rooms(&curve, Ends::Directed, &asked, [a, b]).unwrap().map(|room| room.unwrap().value);
                for (room, curvature) in rooms.iter().zip(arc.curvatures(&curve)) {
                    assert_eq!(*room > 0.0, curvature > 0.0, "ν {exponent}, angles {a} and {b}: {room}, {curvature}");
                }
                seen[usize::from(rooms[0] > 0.0) + 2 * usize::from(rooms[1] > 0.0)] += 1;
            }
        }
        assert!(seen.iter().all(|&count| count > 300), "{seen:?}");
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let h = 1e-5;
        for exponent in [1.2, 2.0, 20.0] {
            let curve = Universal::new(exponent);
            for angles in [[0.4, -0.3], [-0.4, 0.9], [1e-3, 2e-3], [0.5, 0.5], [0.1, 0.1 + 1e-9], [1.5, -1.2]] {
                for [start, end] in SIDES.map(|side| [side, -side]) {
                    let asked = Asked { ends: [start, end], ..Asked::default() };
                    let at = |a: f64, b: f64| rooms(&curve, Ends::Directed, &asked, [a, b]).unwrap();
                    let [a, b] = angles;
                    let around = [[at(a - h, b), at(a + h, b)], [at(a, b - h), at(a, b + h)]];
                    for (end, room) in at(a, b).into_iter().enumerate() {
                        let Some(room) = room else { continue };
                        for (by, [less, more]) in around.iter().enumerate() {
                            let [less, more] = [less, more].map(|rooms| rooms[end].unwrap());
                            let slope = (more.value - less.value) / (2.0 * h);
                            assert!((slope - room.gradient[by]).abs() < 1e-8, "{angles:?}, ν {exponent}");
                            for with in 0..2 {
                                let bend = (more.gradient[with] - less.gradient[with]) / (2.0 * h);
                                let own = room.hessian[by + with];
                                assert!((bend - own).abs() < 1e-7 * (1.0 + own.abs()), "{angles:?}, ν {exponent}");
                            }
                        }
                    }
                }
            }
        }
    }
}
