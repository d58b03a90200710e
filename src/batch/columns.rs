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
///
/// Between data points [`tracks::sample`](crate::tracks::sample) interpolates numbers and angles, in
/// proportion to the time or smoothly: by monotone cubics in the time (Fritsch and Butland, SIAM J.
/// Sci. Stat. Comput. 5, 1984), which are C¹ and lie between the entries of two points.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Quantities, interpolated linearly. NaN stands for a blank.
    Numbers(Vec<f64>),
    /// Quantities, interpolated smoothly.
    Smooth(Vec<f64>),
    /// Angles in degrees, interpolated the short way round: from 0 to 360, or from −180 to 180 if
    /// one of the two is negative. Values beyond ±360 are not angles, and samples take the nearest.
    Angles(Vec<f64>),
    /// Angles in degrees, interpolated the short way round and smoothly.
    SmoothAngles(Vec<f64>),
    /// Texts, including numbers that are not quantities. Samples take the nearest data point's.
    Texts(Vec<String>),
}

impl Values {
    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Values::Texts(texts) => texts.len(),
            _ => self.numbers().map_or(0, <[f64]>::len),
        }
    }

    /// Whether there are no entries.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers or angles. `None` for texts.
    pub fn numbers(&self) -> Option<&[f64]> {
        match self {
            Values::Numbers(own) | Values::Smooth(own) | Values::Angles(own) | Values::SmoothAngles(own) => Some(own),
            Values::Texts(_) => None,
        }
    }

    pub(crate) fn numbers_mut(&mut self) -> Option<&mut Vec<f64>> {
        match self {
            Values::Numbers(own) | Values::Smooth(own) | Values::Angles(own) | Values::SmoothAngles(own) => Some(own),
            Values::Texts(_) => None,
        }
    }

    /// Whether they are angles in degrees.
    pub(crate) fn are_angles(&self) -> bool {
        matches!(self, Values::Angles(_) | Values::SmoothAngles(_))
    }

    /// The same kind, with the entries of the points listed.
    pub(crate) fn gather(&self, points: &[usize]) -> Self {
        let of = |numbers: &[f64]| points.iter().map(|&k| numbers[k]).collect();
        match self {
            Values::Numbers(numbers) => Values::Numbers(of(numbers)),
            Values::Smooth(numbers) => Values::Smooth(of(numbers)),
            Values::Angles(angles) => Values::Angles(of(angles)),
            Values::SmoothAngles(angles) => Values::SmoothAngles(of(angles)),
            Values::Texts(texts) => Values::Texts(points.iter().map(|&k| texts[k].clone()).collect()),
        }
    }

    /// Appends the linear interpolation of two entries of a column of this kind.
    pub(crate) fn push_between(&mut self, of: &Values, ends: [usize; 2], u: f64) {
        let nearest = ends[usize::from(u >= 0.5)];
        match (self, of) {
            (Values::Texts(out), Values::Texts(texts)) => out.push(texts[nearest].clone()),
            (out, of) => out.numbers_mut().expect("a column of a kind stays of that kind").push(of.between(ends, u)),
        }
    }

    /// The linear interpolation of two numbers or angles. NaN for texts.
    pub(crate) fn between(&self, [a, b]: [usize; 2], u: f64) -> f64 {
        let Some(all) = self.numbers() else { return f64::NAN };
        match u {
            0.0 => all[a],
            1.0 => all[b],
            _ if self.are_angles() => match way_round(all[a], all[b]) {
                Some(way) => turned(all[a], all[b], u * way),
                None => all[if u < 0.5 { a } else { b }],
            },
            // Equal numbers keep their bits.
            _ => all[a] + (all[b] - all[a]) * u,
        }
    }
}

/// Half a turn, and a whole one, in degrees.
const HALF_TURN: f64 = 180.0;
const TURN: f64 = 360.0;

/// The short way from an angle to another, in degrees. `None` beyond ±360, where they are none.
pub(crate) fn way_round(a: f64, b: f64) -> Option<f64> {
    (a.abs() <= TURN && b.abs() <= TURN).then(|| HALF_TURN - (HALF_TURN - (b - a)).rem_euclid(TURN))
}

/// The angle that is `step` away from `a` on the way to `b`, in their range.
pub(crate) fn turned(a: f64, b: f64, step: f64) -> f64 {
    let low = if a < 0.0 || b < 0.0 { -HALF_TURN } else { 0.0 };
    low + (a + step - low).rem_euclid(TURN)
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

    /// Whether every column has one value along each curve.
    #[cfg(feature = "cli")]
    pub(crate) fn has_constant_columns(&self) -> bool {
        let is_same = |values: &Values, a: usize, b: usize| match values {
            Values::Texts(texts) => texts[a] == texts[b],
            values => values.numbers().is_some_and(|numbers| numbers[a].to_bits() == numbers[b].to_bits()),
        };
        self.columns.iter().all(|column| {
            self.offsets.windows(2).all(|ends| (ends[0]..ends[1]).all(|k| is_same(&column.values, ends[0], k)))
        })
    }

    /// The columns for other points of the same curves, each with the values of its curve's first point.
    #[cfg(feature = "cli")]
    pub(crate) fn columns_of_curves(&self, others: &CurveBatch) -> Vec<Column> {
        let of_curve = |i: usize| std::iter::repeat_n(self.offsets[i], others.count(i));
        gather(&self.columns, &(0..self.len()).flat_map(of_curve).collect::<Vec<_>>())
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }
}
