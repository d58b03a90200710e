//! [`Grids`]: a ragged batch of rectangular grids.

use crate::error::{Error, Result};

/// Rectangular grids of control points.
///
/// Grids may have any sizes. All have the same number of values per point: heights (1), points of
/// the plane (2), of space (3), …
///
/// Values are flat: grid by grid, row by row, point by point. A grid of one row is a list of
/// points. A grid may have no points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grids {
    dimension: usize,
    shapes: Vec<[usize; 2]>,
    offsets: Vec<usize>,
    values: Vec<f64>,
    file: Option<String>,
}

impl Grids {
    /// Makes grids of these shapes (rows and columns), with `dimension` values per point.
    ///
    /// # Errors
    /// [`Error::Batch`] if the number of values does not match the shapes.
    pub fn new(dimension: usize, shapes: Vec<[usize; 2]>, values: Vec<f64>) -> Result<Self> {
        if dimension == 0 {
            return Err(Error::Batch("points of grids have 0 values; 1 is the least: heights".into()));
        }
        let mut offsets = vec![0];
        for &[rows, columns] in &shapes {
            let next = rows
                .checked_mul(columns)
                .and_then(|points| points.checked_add(offsets[offsets.len() - 1]))
                .filter(|points| points.checked_mul(dimension).is_some());
            offsets.push(
                next.ok_or_else(|| Error::Batch(format!("a grid of {rows} × {columns} points is beyond all memory")))?,
            );
        }
        let wanted = offsets[shapes.len()] * dimension;
        match values.len() == wanted {
            true => Ok(Grids { dimension, shapes, offsets, values, file: None }),
            false => Err(Error::Batch(format!(
                "{} values for grids that have {} points of {dimension}: give {wanted}",
                values.len(),
                offsets[shapes.len()]
            ))),
        }
    }

    /// Makes grids of one shape. Their number follows from the number of values.
    ///
    /// # Errors
    /// [`Error::Batch`] if the values are not a whole number of grids.
    pub fn uniform(dimension: usize, shape: [usize; 2], values: Vec<f64>) -> Result<Self> {
        let one = shape[0].saturating_mul(shape[1]).saturating_mul(dimension).max(1);
        Self::new(dimension, vec![shape; values.len() / one], values)
    }

    #[doc(hidden)]
    /// Sets the name of the grids' file, for messages.
    pub fn with_file(mut self, file: Option<String>) -> Self {
        self.file = file;
        self
    }

    /// Number of grids.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether there are no grids.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Number of values per point.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Rows and columns of grid `i`.
    pub fn shape(&self, i: usize) -> [usize; 2] {
        self.shapes[i]
    }

    /// Rows and columns of all grids.
    pub fn shapes(&self) -> &[[usize; 2]] {
        &self.shapes
    }

    /// The values of grid `i`, row by row.
    pub fn grid(&self, i: usize) -> &[f64] {
        &self.values[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }

    pub(crate) fn grid_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }

    /// The values of the point in this row and column of grid `i`.
    pub fn point(&self, i: usize, row: usize, column: usize) -> &[f64] {
        let start = (row * self.shapes[i][1] + column) * self.dimension;
        &self.grid(i)[start..start + self.dimension]
    }

    /// The values of all grids.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Number of points of all grids.
    pub fn total_points(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    #[doc(hidden)]
    /// The name of the grids' file.
    pub fn file(&self) -> Option<&str> {
        self.file.as_deref()
    }
}
