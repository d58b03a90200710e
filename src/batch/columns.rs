//! [`Column`]: additional values of points.

use super::{CurveBatch, expect_length};
use crate::error::Result;

/// An additional value per point of a batch: a speed, a ship's number, a remark.
///
/// Methods ignore columns. [`tracks::sample`](crate::tracks::sample) interpolates them.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name, as in a table's header.
    pub name: String,
    /// One entry per point.
    pub values: Values,
}

/// The entries of a [`Column`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Quantities, interpolated linearly between data points. NaN stands for a blank.
    Numbers(Vec<f64>),
    /// Angles in degrees, interpolated the short way round: from 0 to 360, or from −180 to 180 if
    /// one of the two is negative. Values beyond ±360 are not angles, and samples take the nearest.
    Angles(Vec<f64>),
    /// Texts, including numbers that are not quantities. Samples take the nearest data point's.
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

    /// Whether there are no entries.
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

    /// Appends the interpolation of two entries of a column of this kind.
    pub(crate) fn push_between(&mut self, of: &Values, [a, b]: [usize; 2], u: f64) {
        let between = |entries: &[f64], inner: fn(f64, f64, f64) -> f64| match u {
            0.0 => entries[a],
            1.0 => entries[b],
            _ => inner(entries[a], entries[b], u),
        };
        match (self, of) {
            // Equal numbers keep their bits.
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

/// Interpolates angles the short way round. Beyond ±360 it returns the nearer one.
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
    /// Sets the columns.
    ///
    /// # Errors
    /// If a column does not have one entry per point.
    pub fn with_columns(mut self, columns: Vec<Column>) -> Result<Self> {
        for column in &columns {
            let what = format!("entries of column {}", column.name);
            expect_length(&what, column.values.len(), self.total_points(), "point")?;
        }
        self.columns = columns;
        Ok(self)
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }
}
