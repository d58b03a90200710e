//! [`Piecewise`]: polynomials piece by piece, and the cubic splines that are such: any number of
//! values per knot, any conditions at the ends.
//!
//! The splines solve a tridiagonal system for their first derivatives (de Boor, *A Practical Guide
//! to Splines*, chapter IV), as `scipy.interpolate.CubicSpline` does: the same equations, and the
//! same local powers after them.

mod assembly;
mod calculus;
mod roots;

use super::ends::EndCondition;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch};
use crate::parallel;
use crate::ragged;
use crate::status::CurveStatus;
use assembly::System;

/// Values on knots: curve `i` has the rows `offsets[i] .. offsets[i + 1]`.
#[derive(Clone, Copy, Debug)]
pub struct Knotted<'a> {
    /// The knots, strictly increasing along each curve.
    pub x: &'a [f64],
    /// Where curves begin and end.
    pub offsets: &'a [usize],
    /// The values at the knots, row by row.
    pub y: &'a [f64],
    /// Number of values per knot.
    pub columns: usize,
    /// Whether all curves are periodic: the last value is the first one again.
    pub periodic: bool,
}

impl Knotted<'_> {
    fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    fn check(&self) -> Result<()> {
        let Knotted { x, offsets, y, columns, .. } = *self;
        let increasing = offsets.first() == Some(&0) && offsets.windows(2).all(|pair| pair[0] <= pair[1]);
        if !increasing || offsets[offsets.len() - 1] != x.len() {
            return Err(Error::argument(format!("offsets must begin with 0, not decrease, and end with {}", x.len())));
        }
        if columns == 0 || y.len() != x.len() * columns {
            let wanted = x.len() * columns;
            return Err(Error::argument(format!(
                "{} values for {} knots of {columns}: {wanted} are needed",
                y.len(),
                x.len()
            )));
        }
        Ok(())
    }

    /// Why a curve has no spline.
    fn problem(&self, i: usize) -> Option<String> {
        let (rows, d) = (self.offsets[i]..self.offsets[i + 1], self.columns);
        let (x, y) = (&self.x[rows.clone()], &self.y[rows.start * d..rows.end * d]);
        if x.len() < 2 {
            return Some(format!("curve {i} has {} knots: a spline needs two", x.len()));
        }
        if let Some(k) = x.iter().position(|x| !x.is_finite()) {
            return Some(format!("curve {i}: knot {k} is {}, not a number", x[k]));
        }
        if let Some(k) = x.windows(2).position(|pair| pair[0] >= pair[1]) {
            return Some(format!("curve {i}: knot {} is {} after {}: knots must increase", k + 1, x[k + 1], x[k]));
        }
        if let Some(k) = y.iter().position(|y| !y.is_finite()) {
            return Some(format!("curve {i}: the value at knot {} is {}, not a number", k / d, y[k]));
        }
        let last = &y[y.len() - d..];
        let differ = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-15 + 1e-15 * b.abs();
        (self.periodic && y.iter().zip(last).any(differ))
            .then(|| format!("curve {i} is periodic, but its last value is not its first"))
    }
}

/// How values outside the knots are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Extrapolate {
    /// By the first and the last piece.
    #[default]
    Yes,
    /// They are NaN.
    No,
    /// The curve is continued periodically.
    Periodic,
}

/// Polynomials, piece by piece, one curve each, such as cubic splines by any conditions at the
/// ends.
///
/// ```
/// use faircurve::Device;
/// use faircurve::spline::{EndCondition, Extrapolate, Knotted, Piecewise};
///
/// // The cubes of 0, 1, 2 and 3: the spline without knots next to the ends is x³.
/// let (x, y) = (&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 8.0, 27.0]);
/// let cubes = Knotted { x, offsets: &[0, 4], y, columns: 1, periodic: false };
/// let splines = Piecewise::cubic(&cubes, &[EndCondition::NotAKnot; 2], &Device::cpu())?;
/// assert!((splines.evaluate_all(&[1.5], 0, Extrapolate::No)[0] - 3.375).abs() < 1e-14);
/// assert!((splines.integrate(0.0, 2.0, Extrapolate::No)[0] - 4.0).abs() < 1e-14);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// A span has the values Σ c\[m\] (x − x\[k\])^(order − 1 − m) from x\[k\] on.
#[derive(Clone, Debug)]
pub struct Piecewise {
    x: Vec<f64>,
    offsets: Vec<usize>,
    columns: usize,
    order: usize,
    /// Where the spans of every curve begin among all: one fewer than its knots.
    spans: Vec<usize>,
    /// For every span `order` rows of `columns` coefficients, highest powers first.
    c: Vec<f64>,
    status: Vec<CurveStatus>,
    messages: Vec<Option<String>>,
}

impl Piecewise {
    /// Cubic splines through values. Periodic ones have no ends.
    ///
    /// With two knots and no condition at an end, the spline is straight there; with three and none
    /// at both, it is a parabola. A curve that has no spline has a status, a message, and
    /// coefficients that are NaN.
    ///
    /// # Errors
    /// Arrays whose lengths do not fit; as [`solve_tridiagonal_batch`].
    pub fn cubic(given: &Knotted, ends: &[EndCondition; 2], device: &Device) -> Result<Self> {
        given.check()?;
        let (curves, d) = (given.len(), given.columns);
        for end in ends {
            if let EndCondition::First(values) | EndCondition::Second(values) = end
                && values.len() != curves * d
            {
                let sentence = format!("{} values of derivatives for {curves} curves of {d}", values.len());
                return Err(Error::argument(sentence));
            }
        }
        let messages = parallel::map(curves, 1024, |i| given.problem(i));
        let system = System::new(given, ends, |i| messages[i].is_none());
        let solved = solve_tridiagonal_batch(
            &TridiagonalBatch {
                matrix: Matrix::Bands { lower: &system.lower, diagonal: &system.diagonal, upper: &system.upper },
                offsets: &system.offsets,
                cyclic: if given.periodic { Cyclic::All } else { Cyclic::None },
            },
            &system.rhs,
            d,
            device,
        )?;
        let offsets = given.offsets;
        let spans = ragged::offsets(offsets.windows(2).map(|pair| (pair[1] - pair[0]).saturating_sub(1)));
        let mut c = vec![0.0; spans[curves] * 4 * d];
        let ends: Vec<usize> = spans.iter().map(|span| span * 4 * d).collect();
        parallel::parts(&mut c, &ends, |i, c| {
            if messages[i].is_some() {
                return c.fill(f64::NAN);
            }
            let slopes = &solved.x[system.offsets[i] * d..system.offsets[i + 1] * d];
            assembly::coefficients(given, i, slopes, c);
        });
        let status = |message: &Option<String>| match message {
            None => CurveStatus::Converged,
            Some(_) => CurveStatus::Invalid,
        };
        let status = messages.iter().map(status).collect();
        let (x, offsets) = (given.x.to_vec(), offsets.to_vec());
        Ok(Piecewise { x, offsets, columns: d, order: 4, spans, c, status, messages })
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there is no curve.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of coefficients per span: the degree and one more.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Number of values per knot.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The knots of a curve.
    pub fn knots(&self, i: usize) -> &[f64] {
        &self.x[self.offsets[i]..self.offsets[i + 1]]
    }

    /// The coefficients of a curve: for every span `order` rows of `columns`, highest powers first.
    pub fn coefficients(&self, i: usize) -> &[f64] {
        let size = self.order * self.columns;
        &self.c[self.spans[i] * size..self.spans[i + 1] * size]
    }

    /// The status of every curve.
    pub fn status(&self) -> &[CurveStatus] {
        &self.status
    }

    /// Why a curve has no spline.
    pub fn message(&self, i: usize) -> Option<&str> {
        self.messages[i].as_deref()
    }
}
