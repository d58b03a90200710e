//! [`Constraints`] at data points.
//!
//! This file destructures [`Constraints`] by name, so that a new constraint does not compile until
//! all code handles it.

use crate::error::{Error, Result};

/// Constraints of a batch, one entry per data point.
///
/// Vectors are stored flat, `dimension` numbers per point. NaN in the first component leaves a
/// point free. Methods refuse constraints that they do not support.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constraints {
    /// Tangents (columns `tx ty tz`).
    ///
    /// For splines a tangent is the derivative dp/dt at an end. With chord-length parameters a unit
    /// vector is the natural choice. On a globe tangents of splines are degrees of longitude and
    /// latitude per unit of the parameter, and tangents of fair curves point to the east and north.
    pub tangents: Option<Vec<f64>>,
    /// Curvature vectors (columns `kx ky kz`), in 1/length.
    ///
    /// Fair curves support them at points with a tangent, if their energy has variation or torsion.
    pub curvatures: Option<Vec<f64>>,
    /// The exponent of the span that starts at the point (column `nu`).
    pub exponents: Option<Vec<f64>>,
    /// Whether a Bézier control point is given (column `known`).
    pub known: Option<Vec<bool>>,
    /// Whether the curve passes exactly through the point, whatever the method (column `pinned`).
    pub pinned: Option<Vec<bool>>,
    /// The largest curvature of the span that starts at the point, in 1/length (column `kmax`).
    ///
    /// NaN is no bound. At a data point the smaller bound of the adjacent spans applies.
    pub largest_curvatures: Option<Vec<f64>>,
    /// The half-width of the corridor around the chord that starts at the point, in units of the
    /// input (column `corridor`). NaN leaves the span free.
    pub corridors: Option<Vec<f64>>,
    /// The widths of the corridor to the left and to the right of each point, two numbers per point, in
    /// units of the input (columns `corridor_left` and `corridor_right`).
    ///
    /// They are measured along the bisector of the turn at the point. Between two points the borders are
    /// straight. NaN leaves the spans at the point free.
    pub widths: Option<Vec<f64>>,
}

/// A kind of [`Constraints`], for [`CurveBatch::allows`](crate::CurveBatch::allows).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Constraint {
    /// [`Constraints::tangents`]
    Tangents,
    /// [`Constraints::curvatures`]
    Curvatures,
    /// [`Constraints::exponents`]
    Exponents,
    /// [`Constraints::known`]
    Known,
    /// [`Constraints::pinned`]
    Pinned,
    /// [`Constraints::largest_curvatures`]
    LargestCurvatures,
    /// [`Constraints::corridors`]
    Corridors,
    /// [`Constraints::widths`]
    Widths,
}

impl Constraint {
    /// The constraint's name, and its columns in files.
    fn words(self) -> &'static str {
        match self {
            Constraint::Tangents => "tangents (columns tx ty tz)",
            Constraint::Curvatures => "curvature vectors (columns kx ky kz)",
            Constraint::Exponents => "exponents of spans (column nu)",
            Constraint::Known => "known control points (column known)",
            Constraint::Pinned => "pinned points (column pinned)",
            Constraint::LargestCurvatures => "largest curvatures (column kmax)",
            Constraint::Corridors => "corridors (column corridor)",
            Constraint::Widths => "widths of corridors (columns corridor_left corridor_right)",
        }
    }
}

impl Constraints {
    /// Whether there are no constraints.
    pub fn is_empty(&self) -> bool {
        self.given().next().is_none()
    }

    /// The constraints that are given.
    fn given(&self) -> impl Iterator<Item = Constraint> + use<> {
        let Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors, widths } =
            self;
        let all = [
            (Constraint::Tangents, tangents.is_some()),
            (Constraint::Curvatures, curvatures.is_some()),
            (Constraint::Exponents, exponents.is_some()),
            (Constraint::Known, known.is_some()),
            (Constraint::Pinned, pinned.is_some()),
            (Constraint::LargestCurvatures, largest_curvatures.is_some()),
            (Constraint::Corridors, corridors.is_some()),
            (Constraint::Widths, widths.is_some()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(constraint, _)| constraint)
    }

    /// Refuses constraints other than the known ones.
    ///
    /// See [`CurveBatch::allows`](crate::CurveBatch::allows).
    pub(crate) fn expect_only(&self, known: &[Constraint], method: &str) -> Result<()> {
        let unknown: Vec<&str> = self.given().filter(|given| !known.contains(given)).map(Constraint::words).collect();
        if unknown.is_empty() {
            return Ok(());
        }
        Err(Error::argument(format!(
            "{method} know no {}: leave these columns out, or choose a method that knows them",
            unknown.join(", and no ")
        )))
    }

    /// Keeps only the points for which `keep` is true.
    pub(crate) fn retain(&mut self, dimension: usize, keep: &[bool]) {
        let Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors, widths } =
            self;
        retain_rows(tangents.as_mut(), dimension, keep);
        retain_rows(curvatures.as_mut(), dimension, keep);
        retain_rows(exponents.as_mut(), 1, keep);
        retain_rows(known.as_mut(), 1, keep);
        retain_rows(pinned.as_mut(), 1, keep);
        retain_rows(largest_curvatures.as_mut(), 1, keep);
        retain_rows(corridors.as_mut(), 1, keep);
        retain_rows(widths.as_mut(), 2, keep);
    }

    /// The constraints of the points listed, in that order.
    pub(crate) fn gather(&self, dimension: usize, points: &[usize]) -> Self {
        let Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors, widths } =
            self;
        Constraints {
            tangents: gather_rows(tangents, dimension, points),
            curvatures: gather_rows(curvatures, dimension, points),
            exponents: gather_rows(exponents, 1, points),
            known: gather_rows(known, 1, points),
            pinned: gather_rows(pinned, 1, points),
            largest_curvatures: gather_rows(largest_curvatures, 1, points),
            corridors: gather_rows(corridors, 1, points),
            widths: gather_rows(widths, 2, points),
        }
    }
}

/// The rows (of `width` entries) of the points listed.
pub(crate) fn gather_rows<T: Copy>(column: &Option<Vec<T>>, width: usize, points: &[usize]) -> Option<Vec<T>> {
    Some(rows_of(column.as_ref()?, width, points))
}

/// The rows (of `width` entries) of these points.
pub(crate) fn rows_of<T: Copy>(column: &[T], width: usize, points: &[usize]) -> Vec<T> {
    points.iter().flat_map(|&point| &column[point * width..(point + 1) * width]).copied().collect()
}

/// Keeps the rows (of `width` entries) whose flag is set.
pub(crate) fn retain_rows<T>(column: Option<&mut Vec<T>>, width: usize, keep: &[bool]) {
    if let Some(values) = column {
        let mut entry = 0;
        values.retain(|_| {
            entry += 1;
            keep[(entry - 1) / width]
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Constraints {
        Constraints {
            tangents: Some((0..6).map(f64::from).collect()),
            curvatures: Some((0..6).map(|k| 10.0 + f64::from(k)).collect()),
            exponents: Some(vec![1.0, 2.0, 3.0]),
            known: Some(vec![true, false, true]),
            pinned: Some(vec![false, false, true]),
            largest_curvatures: Some(vec![4.0, 5.0, 6.0]),
            corridors: Some(vec![7.0, 8.0, 9.0]),
            widths: Some((0..6).map(|k| 20.0 + f64::from(k)).collect()),
        }
    }

    #[test]
    fn points_take_every_column_along() {
        let gathered = all().gather(2, &[2, 0]);
        assert_eq!(gathered.tangents, Some(vec![4.0, 5.0, 0.0, 1.0]));
        assert_eq!(gathered.curvatures, Some(vec![14.0, 15.0, 10.0, 11.0]));
        assert_eq!((gathered.exponents, gathered.known), (Some(vec![3.0, 1.0]), Some(vec![true, true])));
        assert_eq!((gathered.pinned, gathered.largest_curvatures), (Some(vec![true, false]), Some(vec![6.0, 4.0])));
        assert_eq!((gathered.corridors, gathered.widths), (Some(vec![9.0, 7.0]), Some(vec![24.0, 25.0, 20.0, 21.0])));
    }

    #[test]
    fn what_a_method_does_not_know_is_refused_in_one_sentence() {
        use Constraint::{Corridors, Curvatures, Exponents, Known, LargestCurvatures, Pinned, Tangents, Widths};
        let refused = |known: &[Constraint]| all().expect_only(known, "curves of a kind").unwrap_err().to_string();
        assert_eq!(
            refused(&[Tangents, Curvatures, Exponents, Pinned, LargestCurvatures, Corridors, Widths]),
            "curves of a kind know no known control points (column known): leave these columns out, or choose a method that knows them"
        );
        assert_eq!(
            refused(&[Curvatures, Known, Pinned, LargestCurvatures, Corridors, Widths]),
            "curves of a kind know no tangents (columns tx ty tz), and no exponents of spans (column nu): leave these columns out, \
             or choose a method that knows them"
        );
        all()
            .expect_only(
                &[Tangents, Curvatures, Exponents, Known, Pinned, LargestCurvatures, Corridors, Widths],
                "curves of a kind",
            )
            .unwrap();
        Constraints::default().expect_only(&[], "curves of a kind").unwrap();
    }
}
