//! [`Joint`]: the jets that remain possible at a joint, given what is known there.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use super::piece::{Vector, plus};

/// A condition on a jet: Σ coefficients\[r\] x_r = value, with x_r = scaleʳ p⁽ʳ⁾.
pub(super) struct Condition {
    pub coefficients: [f64; 3],
    pub value: Vector,
    /// The control point that the condition comes from.
    pub point: usize,
}

/// The jet x = base + Σ yⱼ basisⱼ, y unknown.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// The length of t that makes derivatives as large as points.
    pub scale: f64,
    pub base: [Vector; 3],
    /// Orthonormal, one row for each unknown.
    pub basis: [[f64; 3]; 3],
    pub free: usize,
}

/// A row within this of a combination of others says the same as they do.
const DEPENDENT: f64 = 1e-10;

/// How far handles, tangent and joint may differ, relative to their distances, and still agree.
pub(super) const AGREES: f64 = 1e-9;

impl Joint {
    /// The jets that remain under the conditions on orders 0 to q.
    ///
    /// `largest` is the largest coordinate, whose rounding conditions may differ by.
    ///
    /// # Errors
    /// The control point that contradicts those before it, and by how much.
    pub fn new(smoothness: usize, scale: f64, conditions: &[Condition], largest: f64) -> Result<Self, (usize, f64)> {
        let mut found: Vec<([f64; 3], Vector)> = Vec::new();
        let first = conditions.first().map_or([0.0; 3], |condition| condition.value);
        let spread = conditions
            .iter()
            .map(|own| own.coefficients[0])
            .zip(conditions)
            .fold(0.0, |spread: f64, (c, own)| spread.max(length(plus(own.value, -c, first))));
        for Condition { coefficients, value, point } in conditions {
            let norm = dot(*coefficients, *coefficients).sqrt();
            let (mut row, mut value) = (coefficients.map(|x| x / norm), value.map(|x| x / norm));
            // A second pass removes what rounding left.
            for (other, of_other) in found.iter().chain(&found) {
                let part = dot(row, *other);
                (row, value) = (plus(row, -part, *other), plus(value, -part, *of_other));
            }
            let left = dot(row, row).sqrt();
            if left > DEPENDENT && found.len() <= smoothness {
                found.push((row.map(|x| x / left), value.map(|x| x / left)));
            } else if length(value) * norm > AGREES * spread + 16.0 * f64::EPSILON * largest {
                return Err((*point, length(value) * norm));
            }
        }
        let mut base = [[0.0; 3]; 3];
        for (row, value) in &found {
            for r in 0..=smoothness {
                base[r] = plus(base[r], row[r], *value);
            }
        }
        let mut rows: Vec<[f64; 3]> = found.iter().map(|(row, _)| *row).collect();
        let (mut basis, mut free) = ([[0.0; 3]; 3], 0);
        while rows.len() <= smoothness {
            // The unit vector that is farthest from all so far.
            let units = (0..=smoothness).map(|r| {
                let mut unit = [0.0; 3];
                unit[r] = 1.0;
                rows.iter().chain(&rows).fold(unit, |unit, row| plus(unit, -dot(unit, *row), *row))
            });
            let unit = units
                .fold([0.0; 3], |best, unit| if dot(unit, unit) > 1.000001 * dot(best, best) { unit } else { best });
            let size = length(unit);
            basis[free] = unit.map(|x| x / size);
            rows.push(basis[free]);
            free += 1;
        }
        Ok(Joint { scale, base, basis, free })
    }

    /// p, h p′, h² p″ for the unknowns y (a vector each).
    pub fn jet(&self, unknowns: impl Fn(usize) -> Vector, h: f64) -> [Vector; 3] {
        let mut jet = self.base;
        for j in 0..self.free {
            let y = unknowns(j);
            for r in 0..3 {
                jet[r] = plus(jet[r], self.basis[j][r], y);
            }
        }
        let ratio = h / self.scale;
        [jet[0], jet[1].map(|x| ratio * x), jet[2].map(|x| ratio * ratio * x)]
    }
}

/// a · b
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// |a|
pub(super) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}
