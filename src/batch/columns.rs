//! [`Column`]: what points have beside coordinates, parameters, weights and constraints.

use super::{CurveBatch, expect_length};
use crate::error::Result;

/// What every point of a batch has, by a name: a speed, a ship's number, a remark.
///
/// No method asks for it. Samples of a fitted curve have what the data points next to them have:
/// see [`tracks::sample`](crate::tracks::sample).
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name, as in the head of a table.
    pub name: String,
    /// One entry a point.
    pub values: Values,
}

/// The entries of a [`Column`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Quantities. Between data points they are interpolated linearly. NaN stands for a blank.
    Numbers(Vec<f64>),
    /// Texts, also of numbers that are no quantities. Samples have that of the nearest data point.
    Texts(Vec<String>),
}

impl Values {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(texts) => texts.len(),
        }
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries of the points listed.
    fn gather(&self, points: &[usize]) -> Self {
        match self {
            Values::Numbers(numbers) => Values::Numbers(points.iter().map(|&k| numbers[k]).collect()),
            Values::Texts(texts) => Values::Texts(points.iter().map(|&k| texts[k].clone()).collect()),
        }
    }
}

/// The columns of the points listed, in that order.
pub(super) fn gather(columns: &[Column], points: &[usize]) -> Vec<Column> {
    columns.iter().map(|Column { name, values }| Column { name: name.clone(), values: values.gather(points) }).collect()
}

impl CurveBatch {
    /// Gives every point more values, by name.
    ///
    /// # Errors
    /// If a column has not one entry a point.
    pub fn with_columns(mut self, columns: Vec<Column>) -> Result<Self> {
        for column in &columns {
            expect_length(
                &format!("entries of column {}", column.name),
                column.values.len(),
                self.total_points(),
                "point",
            )?;
        }
        self.columns = columns;
        Ok(self)
    }

    /// What every point has beside, by name.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }
}
