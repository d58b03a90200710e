//! Operations with one matrix per degree: elevation, reduction, division, evaluation.

use std::collections::{BTreeMap, BTreeSet};

use super::MOST_DEGREE;
use super::exact::{Matrix, binomial, ratio, solve};
use super::gpu::transform_on_gpu;
use super::operator::Operator;
use super::polygons::{Controls, Polygons, in_dimension};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::{self, Operation, take, tasks};
use crate::parallel;
use crate::ragged;
use num_rational::BigRational;
use num_traits::{One, Zero};

/// Raises the degree of all curves by `by`.
///
/// Q = T P with T\[i\]\[j\] = C(d,j) C(by,i−j) / C(d+by,i), the product of `by` elevations Qᵢ =
/// i/(d+1) Pᵢ₋₁ + (1 − i/(d+1)) Pᵢ. End points keep their bits. The others are good to rounding.
///
/// ```
/// use faircurve::{Device, bezier::{Polygons, elevate}};
///
/// let line = Polygons { dimension: 1, coords: &[0.0, 3.0], offsets: &[0, 2] };
/// assert_eq!(elevate(&line, 2, &Device::cpu())?.coords, [0.0, 1.0, 2.0, 3.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - Arrays that do not fit together.
/// - Degrees beyond [`MOST_DEGREE`].
/// - On a GPU the errors of submissions.
///
/// Curves without control points are kept.
pub fn elevate(polygons: &Polygons, by: usize, device: &Device) -> Result<Controls> {
    polygons.check()?;
    if let Some(i) =
        (0..polygons.len()).find(|&i| polygons.count(i) > 0 && (polygons.count(i) - 1).saturating_add(by) > MOST_DEGREE)
    {
        return Err(Error::argument(format!(
            "curve {i} has degree {} and cannot be elevated by {by}: degrees up to {MOST_DEGREE} are possible",
            polygons.count(i) - 1
        )));
    }
    transform(polygons, |degree| elevation_matrix(degree, by), device)
}

/// Lowers the degree of all curves by `by`, keeping end points and minimising ∫|X − Y|² dt.
///
/// Also returns a bound of each curve's distance from the given one: the largest difference of
/// control points after elevation. An elevated curve is recovered to rounding.
///
/// # Errors
/// The errors of [`elevate`], and curves of degree `by` or less.
pub fn reduce(polygons: &Polygons, by: usize, device: &Device) -> Result<(Controls, Vec<f64>)> {
    polygons.check()?;
    let wrong =
        |&i: &usize| polygons.count(i) > 0 && !(by.saturating_add(1)..=MOST_DEGREE).contains(&(polygons.count(i) - 1));
    if let Some(i) = (0..polygons.len()).find(wrong) {
        return Err(Error::argument(format!(
            "curve {i} has degree {} and cannot be reduced by {by}: a curve of degree 1 at least must remain, of one up to {MOST_DEGREE}",
            polygons.count(i) - 1
        )));
    }
    let reduced = transform(polygons, |degree| reduction_matrix(degree, by), device)?;
    let again = transform(&reduced.polygons(), |degree| elevation_matrix(degree, by), device)?;
    let dimension = polygons.dimension;
    let distance = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    let bound = |i: usize| {
        let pairs = polygons.points(i).chunks_exact(dimension).zip(again.points(i).chunks_exact(dimension));
        pairs.map(distance).fold(0.0, f64::max)
    };
    let bounds = (0..polygons.len()).map(bound).collect();
    Ok((reduced, bounds))
}

/// Divides every curve at the parameter t by de Casteljau's algorithm.
///
/// Both parts have parameters from 0 to 1. Any degree is possible.
///
/// # Errors
/// - Arrays that do not fit together.
/// - A t outside 0 … 1.
/// - On a GPU the errors of submissions.
pub fn split(polygons: &Polygons, t: f64, device: &Device) -> Result<[Controls; 2]> {
    polygons.check()?;
    if !(0.0..=1.0).contains(&t) {
        return Err(Error::argument(format!("curves cannot be divided at t = {t}: parameters go from 0 to 1")));
    }
    // Row i of the first part is the start of de Casteljau's column i. Row i of the second part is
    // the end of column d−i.
    let first = |degree: usize| Operator::from_rows(degree + 1, (0..=degree).map(|i| bernstein(i, t)));
    let second = |degree: usize| {
        let row = |i: usize| [vec![0.0; i], bernstein(degree - i, t)].concat();
        Operator::from_rows(degree + 1, (0..=degree).map(row))
    };
    Ok([transform(polygons, first, device)?, transform(polygons, second, device)?])
}

/// Evaluates every curve at the same parameters by de Casteljau's algorithm.
///
/// The result has one point per parameter and curve. Errors are below d/2 roundings of the largest
/// coordinate for parameters from 0 to 1. Any degree is possible.
///
/// # Errors
/// - Arrays that do not fit together.
/// - On a GPU the errors of submissions.
pub fn evaluate(polygons: &Polygons, parameters: &[f64], device: &Device) -> Result<Controls> {
    polygons.check()?;
    let rows = |degree: usize| Operator::from_rows(degree + 1, parameters.iter().map(|&t| bernstein(degree, t)));
    transform(polygons, rows, device)
}

/// Bernstein polynomials of a degree at t, by de Casteljau's triangle.
pub(super) fn bernstein(degree: usize, t: f64) -> Vec<f64> {
    let mut values = vec![0.0; degree + 1];
    values[0] = 1.0;
    for d in 1..=degree {
        for i in (1..=d).rev() {
            values[i] = values[i] * (1.0 - t) + values[i - 1] * t;
        }
        values[0] *= 1.0 - t;
    }
    values
}

fn elevation_matrix(degree: usize, by: usize) -> Operator<f64> {
    Operator::from_exact(&exact_elevation(degree, by))
}

/// The matrix T of `by` elevations.
pub(super) fn exact_elevation(degree: usize, by: usize) -> Matrix {
    Matrix::from_fn(degree + by + 1, degree + 1, |i, j| match i.checked_sub(j) {
        Some(rest) => ratio(binomial(degree, j) * binomial(by, rest), binomial(degree + by, i)),
        None => BigRational::zero(),
    })
}

/// Solves the normal equations ∫ Bᵢᵐ (Y − X) dt = 0, m = d − by, exactly.
fn reduction_matrix(degree: usize, by: usize) -> Operator<f64> {
    let m = degree - by;
    let product =
        |i: usize, n: usize, j: usize| ratio(binomial(m, i) * binomial(n, j), binomial(m + n, i + j) * (m + n + 1));
    let ends = [(0, 0), (m, degree)];
    let inner = m - 1;
    let system = Matrix::from_fn(inner, inner + degree + 1, |i, j| match j.checked_sub(inner) {
        None => product(i + 1, m, j + 1),
        Some(j) => {
            let kept = ends.iter().find(|&&(_, of_given)| of_given == j);
            product(i + 1, degree, j) - kept.map_or(BigRational::zero(), |&(own, _)| product(i + 1, m, own))
        }
    });
    let solved = solve(&system, inner).expect("products of independent functions").particular;
    Operator::from_exact(&Matrix::from_fn(m + 1, degree + 1, |i, j| match ends.iter().find(|&&(own, _)| own == i) {
        Some(&(_, of_given)) if of_given == j => BigRational::one(),
        Some(_) => BigRational::zero(),
        None => solved.at(i - 1, j).clone(),
    }))
}

/// Applies the matrix of its degree to every curve. The matrix's rows sum to 1.
fn transform(polygons: &Polygons, matrix: impl Fn(usize) -> Operator<f64> + Sync, device: &Device) -> Result<Controls> {
    let counts: BTreeSet<usize> = (0..polygons.len()).map(|i| polygons.count(i)).filter(|&count| count > 0).collect();
    let counts: BTreeMap<usize, Operator<f64>> =
        parallel::of(counts, |count| (count, matrix(count - 1))).into_iter().collect();
    let made_of = |i: usize| counts.get(&polygons.count(i)).map_or(0, Operator::rows);
    let offsets = ragged::offsets((0..polygons.len()).map(made_of));
    let coords = vec![0.0; offsets[polygons.len()] * polygons.dimension];
    let mut made = Controls { dimension: polygons.dimension, coords, offsets };
    match device.as_gpu() {
        Some(gpu) => {
            let precision = device.kernel_precision(gpu, true)?;
            in_dimension!(polygons.dimension, D => transform_on_gpu::<D>(gpu, precision, polygons, &counts, &mut made)?);
        }
        None => in_dimension!(polygons.dimension, D => run::<D>(polygons, &counts, &mut made)),
    }
    Ok(made)
}

/// Transforms all curves on all threads.
fn run<const D: usize>(polygons: &Polygons, operators: &BTreeMap<usize, Operator<f64>>, made: &mut Controls) {
    let mut coords = &mut made.coords[..];
    let mut parts: Vec<Part<D>> = Vec::new();
    for curves in tasks(polygons.offsets) {
        let points = made.offsets[curves.end] - made.offsets[curves.start];
        parts.push(Part { polygons, operators, coords: take(&mut coords, points * D), curves });
    }
    parallel::of(parts, linalg::run);
}

struct Part<'a, const D: usize> {
    polygons: &'a Polygons<'a>,
    operators: &'a BTreeMap<usize, Operator<f64>>,
    curves: std::ops::Range<usize>,
    coords: &'a mut [f64],
}

impl<const D: usize> Operation for Part<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (mut points, _) = self.coords.as_chunks_mut::<D>();
        for i in self.curves {
            if let Some(operator) = self.operators.get(&self.polygons.count(i)) {
                let own = take(&mut points, operator.rows());
                operator.apply::<D>(self.polygons.points(i).as_chunks().0, |row, point| own[row] = point);
            }
        }
    }
}
