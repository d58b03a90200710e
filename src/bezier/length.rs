//! Arc lengths of many Bézier curves.

use super::polygons::Polygons;
use crate::arclength;
use crate::error::Result;
use crate::parallel;

/// The arc length of every curve, to 1e-9 of the length of its control polygon or better.
///
/// Curves are measured by Gauss–Legendre quadrature with halving ([`arclength`]). The length is NaN
/// if a coordinate is, and 0 without control points.
///
/// ```
/// use faircurve::bezier::{Polygons, lengths};
///
/// // A parabola, and a line in four dimensions.
/// let parabola = Polygons { dimension: 2, coords: &[0.0, 0.0, 0.5, 0.0, 1.0, 1.0], offsets: &[0, 3] };
/// let exact = 5f64.sqrt() / 2.0 + 2f64.asinh() / 4.0;
/// assert!((lengths(&parabola)?[0] - exact).abs() < 1e-9);
/// assert_eq!(lengths(&Polygons { dimension: 4, coords: &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], offsets: &[0, 2] })?, [2.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// If the arrays do not fit together.
pub fn lengths(polygons: &Polygons) -> Result<Vec<f64>> {
    polygons.check()?;
    let length = |i: usize| match polygons.dimension {
        1 => length::<1>(polygons.points(i)),
        2 => length::<2>(polygons.points(i)),
        3 => length::<3>(polygons.points(i)),
        _ => length::<4>(polygons.points(i)),
    };
    Ok(parallel::map(polygons.len(), 64, length))
}

/// ∫|X′| dt. X′ is the Bézier curve of the control points d ΔP.
fn length<const D: usize>(coords: &[f64]) -> f64 {
    let points = coords.as_chunks::<D>().0;
    let degree = points.len().saturating_sub(1) as f64;
    let steps: Vec<[f64; D]> =
        points.windows(2).map(|pair| std::array::from_fn(|c| degree * (pair[1][c] - pair[0][c]))).collect();
    if steps.is_empty() {
        // 0, or NaN where a coordinate is.
        return points.iter().flatten().map(|x| x * 0.0).sum();
    }
    arclength::span_length(|t| value(&steps, t).iter().map(|x| x * x).sum::<f64>().sqrt())
}

/// The point at t of a Bézier curve: Bernstein's sum by Horner's scheme in t / (1 − t) (Farin,
/// *Curves and Surfaces for CAGD*, section 5.8).
fn value<const D: usize>(points: &[[f64; D]], t: f64) -> [f64; D] {
    let (degree, mut factor, mut sum) = (points.len() - 1, 1.0, [0.0; D]);
    for (k, point) in points.iter().enumerate() {
        if k > 0 {
            factor *= t * (degree + 1 - k) as f64 / k as f64;
        }
        sum = std::array::from_fn(|c| (1.0 - t) * sum[c] + factor * point[c]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bezier::elevate;
    use crate::device::Device;

    #[test]
    fn cubics_and_what_they_are_raised_to_have_one_length_with_a_cusp_too() {
        // A loop, a cusp, a straight line travelled back and forth.
        for coords in [
            [0.0, 0.0, 3.0, 2.0, -2.0, 2.0, 1.0, 0.0],
            [0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0],
            [0.0, 0.0, 3.0, 3.0, -2.0, -2.0, 1.0, 1.0],
        ] {
            let cubic = Polygons { dimension: 2, coords: &coords, offsets: &[0, 4] };
            let raised = elevate(&cubic, 2, &Device::cpu()).unwrap();
            let (a, b) = (lengths(&cubic).unwrap()[0], lengths(&raised.polygons()).unwrap()[0]);
            assert!((a - b).abs() < 2e-8 * a, "{a} {b}");
        }
    }

    #[test]
    fn what_has_no_length_has_none_and_nan_stays_with_its_curve() {
        let coords = [1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, f64::NAN, 1.0, 0.0, 0.0, 3.0, 4.0];
        let polygons = Polygons { dimension: 2, coords: &coords, offsets: &[0, 0, 1, 3, 5, 7] };
        let found = lengths(&polygons).unwrap();
        assert_eq!((found[0], found[1], found[2], found[4]), (0.0, 0.0, 0.0, 5.0));
        assert!(found[3].is_nan());
    }
}
