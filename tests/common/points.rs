//! One curve at a time.

use faircurve::{Constraints, CurveBatch};

pub type Planar = [f64; 2];

/// One curve.
pub fn one<const D: usize>(points: &[[f64; D]], closed: bool) -> CurveBatch {
    CurveBatch::from_ragged(D, points.as_flattened().to_vec(), vec![0, points.len()]).unwrap().closed(closed)
}

/// One curve with tangents and curvature vectors at some of its points.
pub fn constrained<const D: usize>(
    points: &[[f64; D]],
    closed: bool,
    tangents: &[(usize, [f64; D])],
    curvatures: &[(usize, [f64; D])],
) -> CurveBatch {
    let column = |given: &[(usize, [f64; D])]| {
        let mut column = vec![[f64::NAN; D]; points.len()];
        given.iter().for_each(|&(k, vector)| column[k] = vector);
        (!given.is_empty()).then(|| column.as_flattened().to_vec())
    };
    let constraints =
        Constraints { tangents: column(tangents), curvatures: column(curvatures), ..Constraints::default() };
    one(points, closed).with_constraints(constraints).unwrap()
}
