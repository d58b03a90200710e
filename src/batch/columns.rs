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
    /// Angles in degrees. Between data points they go the short way round, from 0 up to 360, or from −180 to 180 where one of
    /// both is negative. What is beyond ±360 is no angle, and samples have that of the nearest data point.
    Angles(Vec<f64>),
    /// Texts, also of numbers that are no quantities. Samples have that of the nearest data point.
    Texts(Vec<String>),
}

impl Values {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(numbers) | Values::Angles(numbers) => numbers.len(),
            Values::Texts(texts) => texts.len(),
        }
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The same kind, without entries.
    pub(crate) fn emptied(&self) -> Self {
        match self {
            Values::Numbers(_) => Values::Numbers(vec![]),
            Values::Angles(_) => Values::Angles(vec![]),
            Values::Texts(_) => Values::Texts(vec![]),
        }
    }

    /// Appends what is between two entries of a column of this kind, at a part of the way from one to the other.
    pub(crate) fn push_between(&mut self, of: &Values, [a, b]: [usize; 2], u: f64) {
        let between = |entries: &[f64], inner: fn(f64, f64, f64) -> f64| match u {
            0.0 => entries[a],
            1.0 => entries[b],
            _ => inner(entries[a], entries[b], u),
        };
        match (self, of) {
            // Equal numbers stay what they are.
            (Values::Numbers(out), Values::Numbers(all)) => out.push(between(all, |a, b, u| a + (b - a) * u)),
            (Values::Angles(out), Values::Angles(all)) => out.push(between(all, turned)),
            (Values::Texts(out), Values::Texts(texts)) => out.push(texts[if u < 0.5 { a } else { b }].clone()),
            _ => unreachable!("a column of a kind stays of that kind"),
        }
    }

    /// The entries of the points listed.
    fn gather(&self, points: &[usize]) -> Self {
        match self {
            Values::Numbers(numbers) => Values::Numbers(points.iter().map(|&k| numbers[k]).collect()),
            Values::Angles(angles) => Values::Angles(points.iter().map(|&k| angles[k]).collect()),
            Values::Texts(texts) => Values::Texts(points.iter().map(|&k| texts[k].clone()).collect()),
        }
    }
}

/// Half a turn, and a whole one, in degrees.
const HALF_TURN: f64 = 180.0;
const TURN: f64 = 360.0;

/// The angle at a part of the short way from one to another. Where one is no angle it is the nearer of both.
fn turned(a: f64, b: f64, u: f64) -> f64 {
    if a.abs() > TURN || b.abs() > TURN {
        return if u < 0.5 { a } else { b };
    }
    let way = HALF_TURN - (HALF_TURN - (b - a)).rem_euclid(TURN);
    let low = if a < 0.0 || b < 0.0 { -HALF_TURN } else { 0.0 };
    low + (a + u * way - low).rem_euclid(TURN)
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
