//! [`Velocity`]: p′ on both sides of a joint at which its direction is continuous.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use super::joint::{AGREES, length};
use super::layout::{Layout, Trouble, invalid};
use super::piece::{Vector, plus};

/// p′ before and after a joint.
#[derive(Clone, Copy, Debug)]
pub(super) enum Velocity {
    /// Both unknown: e^(−σ) T and e^σ T.
    Turning(Vector, f64),
    /// The same on both sides, unknown: at the ends of an open chain, and where Newton's method
    /// starts.
    Even(Vector),
    /// Along a known direction of length 1.
    Along(Vector, [Side; 2]),
}

/// p′ on one side of a joint, along a known direction.
#[derive(Clone, Copy, Debug)]
pub(super) enum Side {
    Known(Vector),
    /// A speed e^a with a unknown.
    Speed(f64),
}

/// Derivatives of p′ on both sides, one vector for each unknown.
pub(super) type Slopes = [[Vector; 4]; 2];

impl Velocity {
    /// What is known at a joint; where nothing is, [`Velocity::Even`]. `speed` is what unknown
    /// speeds start from.
    ///
    /// # Errors
    /// Handles, or a tangent, that have no direction or not the same.
    pub fn new(layout: &Layout, joint: usize, speeds: [f64; 2]) -> Result<Self, Trouble> {
        let d = layout.degree;
        let around = layout.around(joint);
        let place = layout.joint_place(joint);
        let mut known: [Option<(usize, Vector)>; 2] = [None; 2];
        for (side, handle, sign) in [(0, d - 1, -1.0), (1, 1, 1.0)] {
            let Some(piece) = around[side] else { continue };
            let handle = layout.place(piece, handle);
            if layout.is_known(handle) {
                let factor = sign * d as f64 / layout.lengths[piece];
                known[side] =
                    Some((handle, plus(layout.relative(handle), -1.0, layout.relative(place)).map(|x| factor * x)));
            }
        }
        let tangent = layout.tangent(place).map(|tangent| (place, tangent));
        let is_end = around.contains(&None);
        if is_end && tangent.is_none() {
            // At an end of the chain no direction is needed.
            let v = known.into_iter().flatten().next();
            return Ok(v.map_or(Velocity::Even([0.0; 3]), |(_, v)| Velocity::Along(v, [Side::Known(v); 2])));
        }
        let mut given = tangent.into_iter().chain(known.into_iter().flatten());
        let Some((first, direction)) = given.next() else { return Ok(Velocity::Even([0.0; 3])) };
        if length(direction) == 0.0 {
            let what = "it gives the joint no direction: move it away from the joint, or mark it as unknown (leave a \
             tangent of 0 out)";
            return Err(invalid(first, what));
        }
        for (point, other) in given {
            let (sine, cosine) = Layout::turn(direction, other);
            let rounding = 16.0 * f64::EPSILON * layout.largest / layout.lengths[around[0].or(around[1]).unwrap_or(0)];
            if sine > AGREES * cosine.abs() + rounding * length(direction) || cosine <= 0.0 {
                let angle = sine.atan2(cosine).to_degrees();
                let what = format!(
                    "the handles and the tangent at the joint at point {place} are not G1: this one turns by \
                     {angle:.3e} degrees; mark it as \
                     unknown, mend it, or take free joints"
                );
                return Err(invalid(point, what));
            }
        }
        let size = length(direction);
        let speed = |side: usize| match known[side] {
            Some((_, v)) => Side::Known(v),
            // The speed of the other side if it is known, as for joints C1.
            None => Side::Speed(known[1 - side].map_or(speeds[side], |(_, v)| length(v)).ln()),
        };
        let mut sides = [speed(0), speed(1)];
        for side in 0..2 {
            if around[side].is_none() {
                sides[side] = Side::Known([0.0; 3]);
            }
        }
        Ok(Velocity::Along(direction.map(|x| x / size), sides))
    }

    /// p′ on both sides.
    pub fn vectors(&self) -> [Vector; 2] {
        match *self {
            Velocity::Turning(t, sigma) => [t.map(|x| (-sigma).exp() * x), t.map(|x| sigma.exp() * x)],
            Velocity::Even(v) => [v, v],
            Velocity::Along(direction, sides) => sides.map(|side| match side {
                Side::Known(v) => v,
                Side::Speed(a) => direction.map(|x| a.exp() * x),
            }),
        }
    }

    /// Number of unknowns, in so many dimensions.
    pub fn unknowns(&self, dimension: usize) -> usize {
        match self {
            Velocity::Turning(..) => dimension + 1,
            Velocity::Even(_) => dimension,
            Velocity::Along(_, sides) => sides.iter().filter(|side| matches!(side, Side::Speed(_))).count(),
        }
    }

    /// Whether the unknown has no unit: σ, or a logarithm of a speed.
    pub fn is_ratio(&self, unknown: usize, dimension: usize) -> bool {
        match self {
            Velocity::Turning(..) => unknown == dimension,
            Velocity::Even(_) => false,
            Velocity::Along(..) => true,
        }
    }

    pub fn slopes(&self, dimension: usize) -> Slopes {
        let mut slopes = [[[0.0; 3]; 4]; 2];
        let [before, after] = self.vectors();
        match *self {
            Velocity::Turning(_, sigma) => {
                for c in 0..dimension {
                    slopes[0][c][c] = (-sigma).exp();
                    slopes[1][c][c] = sigma.exp();
                }
                slopes[0][dimension] = before.map(|x| -x);
                slopes[1][dimension] = after;
            }
            Velocity::Even(_) => (0..dimension).for_each(|c| {
                slopes[0][c][c] = 1.0;
                slopes[1][c][c] = 1.0;
            }),
            Velocity::Along(_, sides) => {
                let mut next = 0;
                for (side, v) in [before, after].into_iter().enumerate() {
                    if let Side::Speed(_) = sides[side] {
                        slopes[side][next] = v;
                        next += 1;
                    }
                }
            }
        }
        slopes
    }

    /// Second derivatives of p′ on both sides times these vectors. Rows and columns are unknowns.
    pub fn curvatures(&self, forces: [Vector; 2], dimension: usize) -> [[f64; 4]; 4] {
        let mut out = [[0.0; 4]; 4];
        let dots = |v: [Vector; 2]| [0, 1].map(|side| super::joint::dot(forces[side], v[side]));
        match *self {
            Velocity::Turning(_, sigma) => {
                for c in 0..dimension {
                    let x = sigma.exp() * forces[1][c] - (-sigma).exp() * forces[0][c];
                    (out[c][dimension], out[dimension][c]) = (x, x);
                }
                out[dimension][dimension] = dots(self.vectors()).iter().sum();
            }
            Velocity::Even(_) => {}
            Velocity::Along(_, sides) => {
                let mut next = 0;
                for (side, product) in dots(self.vectors()).into_iter().enumerate() {
                    if let Side::Speed(_) = sides[side] {
                        out[next][next] = product;
                        next += 1;
                    }
                }
            }
        }
        out
    }

    /// The velocity after a step.
    pub fn moved(&self, step: &[f64], factor: f64, dimension: usize) -> Self {
        let add = |v: Vector| std::array::from_fn(|c| if c < dimension { v[c] + factor * step[c] } else { 0.0 });
        match *self {
            Velocity::Turning(t, sigma) => Velocity::Turning(add(t), sigma + factor * step[dimension]),
            Velocity::Even(v) => Velocity::Even(add(v)),
            Velocity::Along(direction, sides) => {
                let mut steps = step.iter();
                let mut next = || steps.next().map_or(0.0, |x| factor * x);
                Velocity::Along(
                    direction,
                    sides.map(|side| match side {
                        Side::Speed(a) => Side::Speed(a + next()),
                        known => known,
                    }),
                )
            }
        }
    }

    /// The least of the speeds that are unknown and must stay positive.
    pub fn slowest(&self) -> Option<f64> {
        let [before, after] = self.vectors().map(length);
        match self {
            Velocity::Turning(..) => Some(before.min(after)),
            Velocity::Even(_) => None,
            Velocity::Along(_, sides) => {
                let unknown = [before, after].into_iter().zip(sides).filter(|(_, side)| matches!(side, Side::Speed(_)));
                unknown.map(|(speed, _)| speed).reduce(f64::min)
            }
        }
    }
}
