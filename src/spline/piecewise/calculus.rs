//! Values, derivatives and integrals of piecewise polynomials.

use super::{Extrapolate, Piecewise};
use crate::error::{Error, Result};
use crate::parallel;

impl Piecewise {
    /// Derivatives of order `nu` at parameters: curve `i` at `x[ends[i] .. ends[i + 1]]`, a row of
    /// columns each.
    ///
    /// # Errors
    /// Ends that do not fit.
    pub fn evaluate(&self, x: &[f64], ends: &[usize], nu: usize, extrapolate: Extrapolate) -> Result<Vec<f64>> {
        let good = ends.len() == self.len() + 1 && ends.windows(2).all(|pair| pair[0] <= pair[1]);
        if !good || ends[self.len()] > x.len() {
            let curves = self.len();
            return Err(Error::argument(format!("{} ends of parameters do not fit {curves} curves", ends.len())));
        }
        let d = self.columns;
        let mut values = vec![0.0; (ends[self.len()] - ends[0]) * d];
        let rows: Vec<usize> = ends.iter().map(|end| end * d).collect();
        parallel::parts(&mut values, &rows, |i, values| {
            self.evaluate_curve(i, &x[ends[i]..ends[i + 1]], nu, extrapolate, values);
        });
        Ok(values)
    }

    /// As [`evaluate`](Self::evaluate), with the same parameters for every curve.
    pub fn evaluate_all(&self, x: &[f64], nu: usize, extrapolate: Extrapolate) -> Vec<f64> {
        let size = x.len() * self.columns;
        let mut values = vec![0.0; self.len() * size];
        let rows: Vec<usize> = (0..=self.len()).map(|i| i * size).collect();
        parallel::parts(&mut values, &rows, |i, values| self.evaluate_curve(i, x, nu, extrapolate, values));
        values
    }

    fn evaluate_curve(&self, i: usize, x: &[f64], nu: usize, extrapolate: Extrapolate, values: &mut [f64]) {
        let (knots, c) = (self.knots(i), self.coefficients(i));
        if nu == 0 {
            return at_columns(knots, c, self.order, self.columns, x, extrapolate, values);
        }
        let (terms, d) = (self.order.saturating_sub(nu), self.columns);
        if terms == 0 {
            let zero =
                |x: f64| place(knots, x, extrapolate, 0).map_or(f64::NAN, |(span, _)| 0.0 * c[span * self.order * d]);
            return values.chunks_exact_mut(d).zip(x).for_each(|(to, &x)| to.fill(zero(x)));
        }
        // The coefficients of the derivative.
        let mut scaled = Vec::with_capacity(c.len() / self.order * terms);
        for span in c.chunks_exact(self.order * d) {
            for (m, row) in span.chunks_exact(d).enumerate().take(terms) {
                let factor: f64 = (0..nu).map(|k| (self.order - 1 - m - k) as f64).product();
                scaled.extend(row.iter().map(|c| factor * c));
            }
        }
        at_columns(knots, &scaled, terms, d, x, extrapolate, values);
    }

    /// The derivatives of order `nu`, as polynomials.
    pub fn derivative(&self, nu: usize) -> Self {
        (0..nu).fold(self.clone(), |of, _| of.differentiated())
    }

    fn differentiated(self) -> Self {
        let (d, order) = (self.columns, self.order);
        if order == 1 {
            let c = self.c.iter().map(|c| 0.0 * c).collect();
            return Piecewise { c, ..self };
        }
        let row = |(m, row): (usize, &[f64])| {
            let power = (order - 1 - m) as f64;
            row.iter().map(|c| power * c).collect::<Vec<f64>>()
        };
        let spans = self.c.chunks_exact(order * d);
        let c = spans.flat_map(|span| span[..(order - 1) * d].chunks_exact(d).enumerate().flat_map(row)).collect();
        Piecewise { c, order: order - 1, ..self }
    }

    /// The integrals of order `nu` from the first knot on, as polynomials.
    pub fn antiderivative(&self, nu: usize) -> Self {
        (0..nu).fold(self.clone(), |of, _| of.integrated())
    }

    fn integrated(self) -> Self {
        let (d, order) = (self.columns, self.order);
        let size = (order + 1) * d;
        let mut c = vec![0.0; self.spans[self.len()] * size];
        let ends: Vec<usize> = self.spans.iter().map(|span| span * size).collect();
        parallel::parts(&mut c, &ends, |i, c| {
            let (knots, own) = (self.knots(i), self.coefficients(i));
            let mut before = vec![0.0; d];
            for (k, (to, from)) in c.chunks_exact_mut(size).zip(own.chunks_exact(order * d)).enumerate() {
                for (m, row) in from.chunks_exact(d).enumerate() {
                    for column in 0..d {
                        to[m * d + column] = row[column] / (order - m) as f64;
                    }
                }
                to[order * d..].copy_from_slice(&before);
                let h = knots[k + 1] - knots[k];
                for (column, before) in before.iter_mut().enumerate() {
                    *before = (0..=order).fold(0.0, |sum, m| sum * h + to[m * d + column]);
                }
            }
        });
        Piecewise { c, order: order + 1, ..self }
    }

    /// ∫ from `a` to `b` of every curve, a row of columns each.
    pub fn integrate(&self, a: f64, b: f64, extrapolate: Extrapolate) -> Vec<f64> {
        let d = self.columns;
        let rows = parallel::map(self.len(), 64, |i| self.integrate_curve(i, a, b, extrapolate));
        debug_assert!(rows.iter().all(|row| row.len() == d));
        rows.concat()
    }

    fn integrate_curve(&self, i: usize, a: f64, b: f64, extrapolate: Extrapolate) -> Vec<f64> {
        let (d, knots) = (self.columns, self.knots(i));
        let (from, to, sign) = if a <= b { (a, b, 1.0) } else { (b, a, -1.0) };
        let nan = || vec![f64::NAN; d];
        let (Some(&first), Some(&last)) = (knots.first(), knots.last()) else { return nan() };
        if knots.len() < 2 || !(from.is_finite() && to.is_finite()) {
            return nan();
        }
        let mut sum = vec![0.0; d];
        match extrapolate {
            Extrapolate::No if from < first || to > last => return nan(),
            Extrapolate::Periodic => {
                let period = last - first;
                let whole = ((to - from) / period).floor();
                if whole > 0.0 {
                    self.add_between(i, first, last, whole, &mut sum);
                }
                // The rest, moved into the first period.
                let start = first + (from - first).rem_euclid(period);
                let end = start + ((to - from) - whole * period);
                self.add_between(i, start, end.min(last), 1.0, &mut sum);
                if end > last {
                    self.add_between(i, first, first + (end - last), 1.0, &mut sum);
                }
            }
            _ => self.add_between(i, from, to, 1.0, &mut sum),
        }
        sum.iter_mut().for_each(|x| *x *= sign);
        sum
    }

    /// Adds `weight` times the integral, span by span; the first and the last span go on for ever.
    fn add_between(&self, i: usize, from: f64, to: f64, weight: f64, sum: &mut [f64]) {
        let (d, order, knots, c) = (self.columns, self.order, self.knots(i), self.coefficients(i));
        let last = knots.len() - 2;
        let begin = knots[1..=last].partition_point(|&knot| knot <= from);
        for span in begin..=last {
            let low = if span == begin { from } else { knots[span] };
            let high = if span == last { to } else { to.min(knots[span + 1]) };
            if low >= high {
                break;
            }
            let c = &c[span * order * d..(span + 1) * order * d];
            for (column, sum) in sum.iter_mut().enumerate() {
                let primitive =
                    |z: f64| (0..order).fold(0.0, |at, m| at * z + c[m * d + column] / (order - m) as f64) * z;
                *sum += weight * (primitive(high - knots[span]) - primitive(low - knots[span]));
            }
        }
    }
}

/// The values of polynomials at parameters, by the number of columns.
fn at_columns(
    knots: &[f64],
    c: &[f64],
    order: usize,
    d: usize,
    x: &[f64],
    extrapolate: Extrapolate,
    values: &mut [f64],
) {
    match d {
        1 => at::<1>(knots, c, order, x, extrapolate, values),
        2 => at::<2>(knots, c, order, x, extrapolate, values),
        3 => at::<3>(knots, c, order, x, extrapolate, values),
        _ => {
            let mut near = 0;
            for (to, &x) in values.chunks_exact_mut(d).zip(x) {
                let Some((span, z)) = place(knots, x, extrapolate, near) else {
                    to.fill(f64::NAN);
                    continue;
                };
                near = span;
                let c = &c[span * order * d..(span + 1) * order * d];
                for (column, to) in to.iter_mut().enumerate() {
                    *to = (0..order).fold(0.0, |sum, m| sum * z + c[m * d + column]);
                }
            }
        }
    }
}

fn at<const D: usize>(knots: &[f64], c: &[f64], order: usize, x: &[f64], extrapolate: Extrapolate, values: &mut [f64]) {
    let (rows, mut near) = (c.as_chunks::<D>().0, 0);
    for (to, &x) in values.as_chunks_mut::<D>().0.iter_mut().zip(x) {
        let Some((span, z)) = place(knots, x, extrapolate, near) else {
            *to = [f64::NAN; D];
            continue;
        };
        near = span;
        let mut sum = [0.0; D];
        for row in &rows[span * order..(span + 1) * order] {
            for (sum, c) in sum.iter_mut().zip(row) {
                *sum = *sum * z + c;
            }
        }
        *to = sum;
    }
}

/// The span of a parameter, and its distance from the span's first knot. The span `near` and the
/// next one are tried first.
fn place(knots: &[f64], x: f64, extrapolate: Extrapolate, near: usize) -> Option<(usize, f64)> {
    let (first, last) = (*knots.first()?, *knots.last()?);
    if knots.len() < 2 || x.is_nan() {
        return None;
    }
    let x = match extrapolate {
        Extrapolate::Yes => x,
        Extrapolate::No if x < first || x > last => return None,
        Extrapolate::No => x,
        Extrapolate::Periodic => first + (x - first).rem_euclid(last - first),
    };
    let holds = |span: &usize| knots[*span] <= x && knots.get(span + 1).is_some_and(|&next| x < next);
    let near = [near, near + 1].into_iter().find(|span| *span + 1 < knots.len() && holds(span));
    let span = near.unwrap_or_else(|| knots[1..knots.len() - 1].partition_point(|&knot| knot <= x));
    Some((span, x - knots[span]))
}
