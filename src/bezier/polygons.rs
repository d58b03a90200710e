//! [`Polygons`]: ragged batches of control polygons, what is given of them, and the completed ones.

use super::refusal::Refusal;
use crate::error::{Error, Result};
use crate::status::CurveStatus;

/// Control polygons of many Bézier curves of any degrees, borrowed.
///
/// Curve i has the control points `offsets[i] .. offsets[i + 1]`.
#[derive(Clone, Copy, Debug)]
pub struct Polygons<'a> {
    /// Coordinates of a point, 1 to 4.
    pub dimension: usize,
    /// Point after point.
    pub coords: &'a [f64],
    /// First point of every curve, and the number of all points at the end.
    pub offsets: &'a [usize],
}

/// Control polygons or points of curves, owned. [`Polygons`] is the borrowed form.
#[derive(Clone, Debug, PartialEq)]
pub struct Controls {
    /// Coordinates of a point.
    pub dimension: usize,
    /// Point after point.
    pub coords: Vec<f64>,
    /// First point of every curve, and the number of all points at the end.
    pub offsets: Vec<usize>,
}

impl Controls {
    /// The same, borrowed.
    pub fn polygons(&self) -> Polygons<'_> {
        Polygons { dimension: self.dimension, coords: &self.coords, offsets: &self.offsets }
    }

    /// The coordinates of curve `i`.
    pub fn points(&self, i: usize) -> &[f64] {
        &self.coords[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }
}

/// What is given of the curves. By default all control points are given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given<'a> {
    /// Whether each control point is known. The coordinates of the others are not read.
    pub known: Option<&'a [bool]>,
    /// Derivatives at the ends: X⁽ʳ⁾(0) at \[0\]\[r−1\] and X⁽ʳ⁾(1) at \[1\]\[r−1\].
    ///
    /// Each has one vector per curve. A vector whose first component is NaN is free.
    pub derivatives: [[Option<&'a [f64]>; 3]; 2],
    /// Whether first derivatives are directions only. Their lengths then minimise the energy.
    pub directions: bool,
}

/// Completed control polygons.
#[derive(Clone, Debug)]
pub struct Solved {
    /// All control points, in the order of the given ones.
    ///
    /// Known points keep their bits. Refused curves keep all their points.
    pub coords: Vec<f64>,
    /// The energy of every curve, summed over coordinates. NaN for refused curves.
    pub energies: Vec<f64>,
    /// [`CurveStatus::Converged`], [`CurveStatus::NotUnique`], or the status of the refusal.
    pub statuses: Vec<CurveStatus>,
    /// The refused curves in order, and why.
    pub refusals: Vec<(usize, Refusal)>,
}

impl Polygons<'_> {
    /// Number of curves.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no curve at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The coordinates of curve `i`.
    pub fn points(&self, i: usize) -> &[f64] {
        &self.coords[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }

    /// Number of control points of curve `i`.
    pub fn count(&self, i: usize) -> usize {
        self.offsets[i + 1] - self.offsets[i]
    }

    pub(super) fn check(&self) -> Result<()> {
        let (dimension, points) = (self.dimension, self.coords.len() / self.dimension.max(1));
        if !(1..=4).contains(&dimension) {
            return Err(Error::Batch(format!("control points have {dimension} coordinates; 1 to 4 are possible")));
        }
        if points * dimension != self.coords.len() {
            let length = self.coords.len();
            return Err(Error::Batch(format!("{length} coordinates are no whole number of {dimension}-D points")));
        }
        let increase = self.offsets.windows(2).all(|pair| pair[0] <= pair[1]);
        if self.offsets.first() != Some(&0) || self.offsets.last() != Some(&points) || !increase {
            return Err(Error::Batch(format!(
                "the offsets of {points} control points must begin with 0, never decrease, and end with {points}"
            )));
        }
        Ok(())
    }
}

impl Given<'_> {
    pub(super) fn check(&self, polygons: &Polygons) -> Result<()> {
        let points = polygons.offsets[polygons.len()];
        if let Some(known) = self.known.filter(|known| known.len() != points) {
            return Err(Error::Batch(format!("{} known flags for {points} points: give one per point", known.len())));
        }
        let wanted = polygons.len() * polygons.dimension;
        for column in self.derivatives.iter().flatten().flatten() {
            if column.len() != wanted {
                let found = column.len();
                let message = format!("{found} numbers for {wanted} of derivatives: give one vector per curve");
                return Err(Error::Batch(message));
            }
        }
        Ok(())
    }
}

/// Evaluates an expression with the constant `D`, the number of coordinates.
macro_rules! in_dimension {
    ($dimension:expr, $D:ident => $value:expr) => {
        match $dimension {
            1 => {
                const $D: usize = 1;
                $value
            }
            2 => {
                const $D: usize = 2;
                $value
            }
            3 => {
                const $D: usize = 3;
                $value
            }
            _ => {
                const $D: usize = 4;
                $value
            }
        }
    };
}

pub(super) use in_dimension;
