//! [`Joint`]: the jets that remain possible at a joint, given what is known there.

use glam::DVec3;

/// A condition on a jet: Σ coefficients\[r\] x_r = value, with x_r = scaleʳ p⁽ʳ⁾.
pub(super) struct Condition {
    pub coefficients: DVec3,
    pub value: DVec3,
    /// The control point that the condition comes from.
    pub point: usize,
}

/// The jet x = base + Σ yⱼ basisⱼ with unknown y.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// The length of t that makes derivatives as large as points.
    pub scale: f64,
    pub base: [DVec3; 3],
    /// Orthonormal, one row per unknown.
    pub basis: [DVec3; 3],
    pub free: usize,
}

/// A row closer than this to a combination of other rows depends on them.
const DEPENDENT: f64 = 1e-10;

/// The relative difference within which handles, tangent and joint agree.
pub(super) const AGREES: f64 = 1e-9;

impl Joint {
    /// The jets that remain under the conditions on orders 0 to q.
    ///
    /// `largest` is the largest coordinate. Conditions may differ by its rounding.
    ///
    /// # Errors
    /// The control point that contradicts the ones before it, and by how much.
    pub fn new(smoothness: usize, scale: f64, conditions: &[Condition], largest: f64) -> Result<Self, (usize, f64)> {
        let first = conditions.first().map_or(DVec3::ZERO, |condition| condition.value);
        let distance = |condition: &Condition| (condition.value - condition.coefficients.x * first).length();
        let spread = conditions.iter().map(distance).fold(0.0, f64::max);
        let mut rows: Vec<DVec3> = Vec::new();
        let mut values: Vec<DVec3> = Vec::new();
        for &Condition { coefficients, value, point } in conditions {
            let norm = coefficients.length();
            let (mut row, mut value) = (coefficients / norm, value / norm);
            // The second pass removes the rounding of the first.
            for k in (0..rows.len()).chain(0..rows.len()) {
                let part = row.dot(rows[k]);
                row -= part * rows[k];
                value -= part * values[k];
            }
            let left = row.length();
            if left > DEPENDENT && rows.len() <= smoothness {
                rows.push(row / left);
                values.push(value / left);
            } else if value.length() * norm > AGREES * spread + 16.0 * f64::EPSILON * largest {
                return Err((point, value.length() * norm));
            }
        }
        let mut base = [DVec3::ZERO; 3];
        for (row, &value) in rows.iter().zip(&values) {
            for r in 0..=smoothness {
                base[r] += row[r] * value;
            }
        }
        let (mut basis, mut free) = ([DVec3::ZERO; 3], 0);
        while rows.len() <= smoothness {
            let unit = farthest_axis(smoothness, &rows);
            basis[free] = unit / unit.length();
            rows.push(basis[free]);
            free += 1;
        }
        Ok(Joint { scale, base, basis, free })
    }

    /// p, h p′, h² p″ for the unknowns y, one vector each.
    pub fn jet(&self, unknowns: impl Fn(usize) -> DVec3, h: f64) -> [DVec3; 3] {
        let mut jet = self.base;
        for j in 0..self.free {
            let y = unknowns(j);
            for (r, derivative) in jet.iter_mut().enumerate() {
                *derivative += self.basis[j][r] * y;
            }
        }
        let ratio = h / self.scale;
        [jet[0], ratio * jet[1], ratio * ratio * jet[2]]
    }
}

/// The axis with the largest part across all rows, as that part.
fn farthest_axis(smoothness: usize, rows: &[DVec3]) -> DVec3 {
    let mut farthest = DVec3::ZERO;
    for axis in &DVec3::AXES[..=smoothness] {
        let mut across = *axis;
        for &row in rows.iter().chain(rows) {
            across -= across.dot(row) * row;
        }
        if across.length_squared() > 1.000001 * farthest.length_squared() {
            farthest = across;
        }
    }
    farthest
}
