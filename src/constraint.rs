//! Constraints as data: what a curve must meet at its data points, beside passing through (or near) them.

/// Constraints of a whole batch, one entry a data point, in the order of the batch's points.
///
/// Vectors are stored flat, `dimension` numbers a point; a NaN in the first component means "free". A method that
/// cannot honour a constraint refuses it with a sentence; none is ever ignored.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constraints {
    /// Tangents (columns `tx ty tz`). For the splines the derivative dp/dt at an end, in units of length per unit
    /// of the parameter, so with chord-length parameters a unit vector is the natural choice.
    pub tangents: Option<Vec<f64>>,
    /// Curvature vectors (columns `kx ky kz`), in 1/length.
    pub curvatures: Option<Vec<f64>>,
    /// Exponent of the span that starts at the point (column `nu`).
    pub exponents: Option<Vec<f64>>,
    /// Whether a Bézier control point is given (column `known`).
    pub known: Option<Vec<bool>>,
}

impl Constraints {
    /// Whether nothing at all is constrained.
    pub fn is_empty(&self) -> bool {
        self.tangents.is_none() && self.curvatures.is_none() && self.exponents.is_none() && self.known.is_none()
    }

    /// Keeps only the points for which `keep` is true.
    pub(crate) fn retain(&mut self, dimension: usize, keep: &[bool]) {
        retain_rows(&mut self.tangents, dimension, keep);
        retain_rows(&mut self.curvatures, dimension, keep);
        retain_rows(&mut self.exponents, 1, keep);
        retain_rows(&mut self.known, 1, keep);
    }
}

/// Keeps the rows (of `width` entries) whose flag is set.
pub(crate) fn retain_rows<T>(column: &mut Option<Vec<T>>, width: usize, keep: &[bool]) {
    if let Some(values) = column {
        let mut entry = 0;
        values.retain(|_| {
            entry += 1;
            keep[(entry - 1) / width]
        });
    }
}
