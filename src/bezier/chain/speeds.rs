//! [`Velocity`]: p′ on both sides of a joint where its direction is continuous.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use glam::DVec3;

use super::joint::AGREES;
use super::layout::{Layout, Trouble, invalid};

/// p′ before and after a joint.
#[derive(Clone, Copy, Debug)]
pub(super) enum Velocity {
    /// Both unknown: e^(−σ) T and e^σ T.
    Turning(DVec3, f64),
    /// Equal and unknown: at the ends of an open chain, and where Newton's method starts.
    Even(DVec3),
    /// Along a known direction of length 1.
    Along(DVec3, [Side; 2]),
}

/// p′ on one side of a joint, along a known direction.
#[derive(Clone, Copy, Debug)]
pub(super) enum Side {
    Known(DVec3),
    /// A speed e^a with unknown a.
    Speed(f64),
}

impl Side {
    fn is_unknown(&self) -> bool {
        matches!(self, Side::Speed(_))
    }
}

/// Derivatives of p′ on both sides, one vector per unknown.
pub(super) type Slopes = [[DVec3; 4]; 2];

impl Velocity {
    /// What is known at a joint, or [`Velocity::Even`] if nothing is. Unknown speeds start from
    /// `speeds`.
    ///
    /// # Errors
    /// Handles or a tangent without a direction, or with different directions.
    pub fn new(layout: &Layout, joint: usize, speeds: [f64; 2]) -> Result<Self, Trouble> {
        let d = layout.degree;
        let around = layout.around(joint);
        let place = layout.joint_place(joint);
        let mut known: [Option<(usize, DVec3)>; 2] = [None; 2];
        for (side, handle, sign) in [(0, d - 1, -1.0), (1, 1, 1.0)] {
            let Some(piece) = around[side] else { continue };
            let handle = layout.place(piece, handle);
            if layout.is_known(handle) {
                let factor = sign * d as f64 / layout.lengths[piece];
                known[side] = Some((handle, factor * (layout.relative(handle) - layout.relative(place))));
            }
        }
        let tangent = layout.tangent(place).map(|tangent| (place, tangent));
        if around.contains(&None) && tangent.is_none() {
            // At an end of the chain no direction is needed.
            let v = known.into_iter().flatten().next();
            return Ok(v.map_or(Velocity::Even(DVec3::ZERO), |(_, v)| Velocity::Along(v, [Side::Known(v); 2])));
        }
        let mut given = tangent.into_iter().chain(known.into_iter().flatten());
        let Some((first, direction)) = given.next() else { return Ok(Velocity::Even(DVec3::ZERO)) };
        let size = direction.length();
        if size == 0.0 {
            let what = "it gives the joint no direction: move it away from the joint, or mark it as unknown (leave a \
             tangent of 0 out)";
            return Err(invalid(first, what));
        }
        for (point, other) in given {
            let (sine, cosine) = (direction.cross(other).length(), direction.dot(other));
            let rounding = 16.0 * f64::EPSILON * layout.largest / layout.lengths[around[0].or(around[1]).unwrap_or(0)];
            if sine > AGREES * cosine.abs() + rounding * size || cosine <= 0.0 {
                let angle = sine.atan2(cosine).to_degrees();
                let what = format!(
                    "the handles and the tangent at the joint at point {place} are not G1: this one turns by \
                     {angle:.3e} degrees; mark it as unknown, mend it, or take free joints"
                );
                return Err(invalid(point, what));
            }
        }
        let side = |side: usize| match (around[side], known[side]) {
            (None, _) => Side::Known(DVec3::ZERO),
            (_, Some((_, v))) => Side::Known(v),
            // The speed of the other side if it is known, as for C1 joints.
            _ => Side::Speed(known[1 - side].map_or(speeds[side], |(_, v)| v.length()).ln()),
        };
        Ok(Velocity::Along(direction / size, [side(0), side(1)]))
    }

    /// p′ on both sides.
    pub fn vectors(&self) -> [DVec3; 2] {
        match *self {
            Velocity::Turning(t, sigma) => [(-sigma).exp() * t, sigma.exp() * t],
            Velocity::Even(v) => [v, v],
            Velocity::Along(direction, sides) => sides.map(|side| match side {
                Side::Known(v) => v,
                Side::Speed(a) => a.exp() * direction,
            }),
        }
    }

    /// Number of unknowns.
    pub fn unknowns(&self, dimension: usize) -> usize {
        match self {
            Velocity::Turning(..) => dimension + 1,
            Velocity::Even(_) => dimension,
            Velocity::Along(_, sides) => sides.iter().filter(|side| side.is_unknown()).count(),
        }
    }

    /// Whether the unknown has no unit: σ, or the logarithm of a speed.
    pub fn is_ratio(&self, unknown: usize, dimension: usize) -> bool {
        match self {
            Velocity::Turning(..) => unknown == dimension,
            Velocity::Even(_) => false,
            Velocity::Along(..) => true,
        }
    }

    /// Derivatives of p′ with respect to the unknowns.
    pub fn slopes(&self, dimension: usize) -> Slopes {
        let mut slopes = [[DVec3::ZERO; 4]; 2];
        let vectors = self.vectors();
        match *self {
            Velocity::Turning(_, sigma) => {
                for c in 0..dimension {
                    slopes[0][c][c] = (-sigma).exp();
                    slopes[1][c][c] = sigma.exp();
                }
                slopes[0][dimension] = -vectors[0];
                slopes[1][dimension] = vectors[1];
            }
            Velocity::Even(_) => {
                for c in 0..dimension {
                    slopes[0][c][c] = 1.0;
                    slopes[1][c][c] = 1.0;
                }
            }
            Velocity::Along(_, sides) => {
                for (next, side) in (0..2).filter(|&side| sides[side].is_unknown()).enumerate() {
                    slopes[side][next] = vectors[side];
                }
            }
        }
        slopes
    }

    /// Second derivatives of p′ on both sides times these vectors. Rows and columns are unknowns.
    pub fn curvatures(&self, forces: [DVec3; 2], dimension: usize) -> [[f64; 4]; 4] {
        let mut out = [[0.0; 4]; 4];
        let vectors = self.vectors();
        let products = [forces[0].dot(vectors[0]), forces[1].dot(vectors[1])];
        match *self {
            Velocity::Turning(_, sigma) => {
                for c in 0..dimension {
                    let x = sigma.exp() * forces[1][c] - (-sigma).exp() * forces[0][c];
                    (out[c][dimension], out[dimension][c]) = (x, x);
                }
                out[dimension][dimension] = products[0] + products[1];
            }
            Velocity::Even(_) => {}
            Velocity::Along(_, sides) => {
                for (next, side) in (0..2).filter(|&side| sides[side].is_unknown()).enumerate() {
                    out[next][next] = products[side];
                }
            }
        }
        out
    }

    /// The velocity after a step.
    pub fn moved(&self, step: &[f64], factor: f64, dimension: usize) -> Self {
        let add = |mut v: DVec3| {
            for c in 0..dimension {
                v[c] += factor * step[c];
            }
            v
        };
        match *self {
            Velocity::Turning(t, sigma) => Velocity::Turning(add(t), sigma + factor * step[dimension]),
            Velocity::Even(v) => Velocity::Even(add(v)),
            Velocity::Along(direction, mut sides) => {
                let unknown = sides.iter_mut().filter(|side| side.is_unknown());
                for (side, x) in unknown.zip(step) {
                    if let Side::Speed(a) = side {
                        *a += factor * x;
                    }
                }
                Velocity::Along(direction, sides)
            }
        }
    }

    /// The least of the unknown speeds that must stay positive.
    pub fn slowest(&self) -> Option<f64> {
        let speeds = self.vectors().map(DVec3::length);
        match self {
            Velocity::Turning(..) => Some(speeds[0].min(speeds[1])),
            Velocity::Even(_) => None,
            Velocity::Along(_, sides) => {
                (0..2).filter(|&side| sides[side].is_unknown()).map(|side| speeds[side]).reduce(f64::min)
            }
        }
    }
}
