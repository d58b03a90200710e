//! [`Universal`]: the universal curve of an exponent ν. Every smooth connection function is a piece
//! of it.
//!
//! |κ|^ν = c cos ψ, with the angle ψ of the tangent from the direction of the force. Let t = π/2 − |ψ| from one
//! inflection (t = 0) to the most curved point (π/2), and let it increase from there to the next
//! inflection (π). In units in which c = 1,
//!
//! ```text
//! q = 1 − 1/ν            moment S(t) = sin^q t
//! along the force J(t) = ∫₀ᵗ sin^q      across it S/q      length L(t) = ∫₀ᵗ sin^{q−1}
//! ```
//!
//! Near t = 0 these are t^q, t^{q+1} and t^q times smooth functions of t², analytic for |t| < π.
//! Polynomials of 14 coefficients on [0, π/2] represent them to rounding, and t^q is the only
//! power. Beyond π/2 everything is symmetric.

use std::f64::consts::{FRAC_PI_2, PI};

use super::trig::polynomial;
use crate::linalg::Scalar;

/// The coefficients of a polynomial of the universal curve. The nearest singularity of the
/// functions is at t = π, so their Chebyshev coefficients in t² on [0, (π/2)²] decrease as (7 +
/// √48)⁻ᵏ. 14 suffice for 1e-16.
pub(crate) const TERMS: usize = 14;

/// The terms of the power series at 0, which decrease as 4⁻ᵏ at t = π/2.
const SERIES: usize = 30;

/// The pairs of terms in the series of small differences. The last is (1/8)^{2·7} of the first,
/// times binomial coefficients below 1e-3.
pub(crate) const DIFFERENCES: usize = 7;

/// The coefficients of a difference's series in total.
pub(crate) const DIFFERENCE_TERMS: usize = DIFFERENCES * (DIFFERENCES + 1) / 2;

/// 2/(π/2)²: the argument of polynomials is 2 t²/(π/2)² − 1.
const TO_UNIT: f64 = 0.8105694691387022;

/// The universal curve of an exponent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Universal {
    /// ν
    pub exponent: f64,
    /// q = 1 − 1/ν
    pub q: f64,
    /// J(π/2)
    pub half: f64,
    /// L(π/2)
    pub half_length: f64,
    /// S(t)/t^q, a polynomial in 2 t²/(π/2)² − 1.
    pub moment: [f64; TERMS],
    /// J(t)/t^{q+1}, likewise.
    pub along: [f64; TERMS],
    /// L(t)/t^q, likewise.
    pub length: [f64; TERMS],
    /// cₖⱼ/(2k + 1)!, row by row, of (sin^q)^{(2k)} = sin^q Σⱼ cₖⱼ sin^{−2j}: see [`Differences`].
    pub differences: [f64; DIFFERENCE_TERMS],
    /// The same for L, with q − 1 instead of q.
    pub length_differences: [f64; DIFFERENCE_TERMS],
}

impl Universal {
    /// The universal curve of ν > 1.
    pub fn new(exponent: f64) -> Self {
        let q = 1.0 - 1.0 / exponent;
        let moment = power_of_sinc(q);
        let along = integral(&moment, q + 1.0);
        let length = integral(&power_of_sinc(q - 1.0), q);
        let at_half = |series: &[f64; SERIES], power: f64| FRAC_PI_2.powf(power) * sum(series, FRAC_PI_2);
        Universal {
            exponent,
            q,
            half: at_half(&along, q + 1.0),
            half_length: at_half(&length, q),
            moment: economise(&moment),
            along: economise(&along),
            length: economise(&length),
            differences: differences(q),
            length_differences: differences(q - 1.0),
        }
    }

    /// The numbers of the block in `universal.wgsl`.
    pub fn packed(&self) -> Vec<f64> {
        let powers = [self.exponent, self.q, 1.0 / self.q, self.half];
        [&powers[..], &self.moment, &self.along, &self.differences].concat()
    }

    /// t^q
    #[inline(always)]
    pub fn power<S: Scalar>(&self, t: S) -> S {
        if self.q == 0.5 { t.sqrt() } else { t.powf(self.q) }
    }

    /// t^{1/q}
    #[inline(always)]
    pub fn root<S: Scalar>(&self, t: S) -> S {
        if self.q == 0.5 { t * t } else { t.powf(1.0 / self.q) }
    }

    /// S(t) and J(t) for 0 ≤ t ≤ π.
    #[inline(always)]
    pub fn moment_along<S: Scalar>(&self, t: S) -> (S, S) {
        let (moment, along, _) = self.moment_along_power(t);
        (moment, along)
    }

    /// S(t) and J(t) for 0 ≤ t ≤ π, and t^q for t ≤ π/2.
    #[inline(always)]
    pub fn moment_along_power<S: Scalar>(&self, t: S) -> (S, S, S) {
        let folds = t - S::of(FRAC_PI_2);
        let near = folds.if_positive(S::of(PI) - t, t).max(S::ZERO);
        let x = near * near * S::of(TO_UNIT) - S::ONE;
        let power = self.power(near);
        let along = near * power * polynomial(&self.along, x);
        (power * polynomial(&self.moment, x), folds.if_positive(S::of(2.0 * self.half) - along, along), power)
    }

    /// L(t) for 0 ≤ t ≤ π.
    pub fn length_at(&self, t: f64) -> f64 {
        let near = if t > FRAC_PI_2 { PI - t } else { t }.max(0.0);
        let x = near * near * TO_UNIT - 1.0;
        let length = self.power(near) * polynomial(&self.length, x);
        if t > FRAC_PI_2 { 2.0 * self.half_length - length } else { length }
    }
}

/// Differences of J and S between m − h and m + h, for h small compared with the distance to the
/// inflections. They come from Taylor series at m, since differences of the values would lose
/// digits. P and Q are of order 1:
///
/// ```text
/// J(m+h) − J(m−h) = 2h sin^q m · P,    (S(m+h) − S(m−h))/q = 2h sin^q m cot m · Q
/// P = Σₖ h²ᵏ/(2k+1)! Σⱼ cₖⱼ sin^{−2j} m,    Q likewise with cₖⱼ (q − 2j)/q
/// ```
///
/// Q − P, which determines the direction of the chord, is computed without the difference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Differences<S> {
    /// P
    pub along: S,
    /// Q − P
    pub excess: S,
    /// d(Q − P)/dm, P′ = dP/dm
    pub slopes: [S; 2],
}

impl Universal {
    /// The series at m, for given 1/sin² m, cot m and h.
    #[inline(always)]
    pub fn difference_series<S: Scalar>(&self, inverse_square: S, cotangent: S, h: S) -> Differences<S> {
        let step = h * h;
        let x = inverse_square;
        let (mut p, mut u, mut p_slope, mut u_slope) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
        let mut k = DIFFERENCES;
        let mut at = DIFFERENCE_TERMS;
        while k > 0 {
            k -= 1;
            // Horner's scheme in x for row k, with k + 1 coefficients.
            let (mut row, mut row_u, mut row_slope, mut row_u_slope) = (S::ZERO, S::ZERO, S::ZERO, S::ZERO);
            let mut j = k + 1;
            while j > 0 {
                j -= 1;
                at -= 1;
                let c = self.differences[at];
                let share = -2.0 * j as f64 / self.q;
                row = row * x + S::of(c);
                row_u = row_u * x + S::of(c * share);
                row_slope = row_slope * x + S::of(c * j as f64);
                row_u_slope = row_u_slope * x + S::of(c * share * j as f64);
            }
            p = p * step + row;
            u = u * step + row_u;
            p_slope = p_slope * step + row_slope;
            u_slope = u_slope * step + row_u_slope;
        }
        // d(xʲ)/dm = −2j xʲ cot m
        let factor = S::of(-2.0) * cotangent;
        Differences { along: p, excess: u, slopes: [factor * u_slope, factor * p_slope] }
    }
}

/// The coefficients of (sin t / t)^p in t², by J. C. P. Miller's recurrence for powers of series.
fn power_of_sinc(p: f64) -> [f64; SERIES] {
    let mut sinc = [1.0; SERIES];
    for k in 1..SERIES {
        sinc[k] = -sinc[k - 1] / ((2 * k) as f64 * (2 * k + 1) as f64);
    }
    let mut power = [1.0; SERIES];
    for k in 1..SERIES {
        let terms = (1..=k).map(|j| ((p + 1.0) * j as f64 - k as f64) * sinc[j] * power[k - j]);
        power[k] = terms.sum::<f64>() / k as f64;
    }
    power
}

/// ∫₀ᵗ s^{power − 1} f(s²) ds = t^power g(t²): the coefficients of g from those of f.
fn integral(series: &[f64; SERIES], power: f64) -> [f64; SERIES] {
    std::array::from_fn(|k| series[k] / (power + 2.0 * k as f64))
}

/// A series in t².
fn sum(series: &[f64; SERIES], t: f64) -> f64 {
    polynomial(series, t * t)
}

/// The polynomial in x = 2 t²/(π/2)² − 1 that interpolates a series at the Chebyshev nodes.
fn economise(series: &[f64; SERIES]) -> [f64; TERMS] {
    let node = |i: usize| (PI * (i as f64 + 0.5) / TERMS as f64).cos();
    let value = |i: usize| polynomial(series, FRAC_PI_2 * FRAC_PI_2 * 0.5 * (1.0 + node(i)));
    let values: [f64; TERMS] = std::array::from_fn(value);
    // Chebyshev coefficients, converted to powers by Tₖ₊₁ = 2x Tₖ − Tₖ₋₁.
    let mut coefficients = [0.0; TERMS];
    let (mut before, mut now) = ([0.0; TERMS], [0.0; TERMS]);
    now[0] = 1.0;
    for k in 0..TERMS {
        let angle = |i: usize| (k as f64 * PI * (i as f64 + 0.5) / TERMS as f64).cos();
        let chebyshev = (0..TERMS).map(|i| values[i] * angle(i)).sum::<f64>() * 2.0 / TERMS as f64;
        let weight = if k == 0 { 0.5 * chebyshev } else { chebyshev };
        for (sum, c) in coefficients.iter_mut().zip(&now) {
            *sum += weight * c;
        }
        let twice = if k == 0 { 1.0 } else { 2.0 };
        let mut next = [0.0; TERMS];
        for j in 0..TERMS {
            next[j] = twice * if j > 0 { now[j - 1] } else { 0.0 } - if k > 0 { before[j] } else { 0.0 };
        }
        (before, now) = (now, next);
    }
    coefficients
}

/// cₖⱼ/(2k + 1)!, from (sin^p)″ = p (p − 1) sin^{p−2} − p² sin^p.
fn differences(q: f64) -> [f64; DIFFERENCE_TERMS] {
    let mut all = [0.0; DIFFERENCE_TERMS];
    let mut row = [0.0; DIFFERENCES + 1];
    row[0] = 1.0;
    let (mut at, mut factorial) = (0, 1.0);
    for k in 0..DIFFERENCES {
        for c in &row[..=k] {
            all[at] = c / factorial;
            at += 1;
        }
        let mut next = [0.0; DIFFERENCES + 1];
        for (j, c) in row.iter().enumerate().take(k + 1) {
            let p = q - 2.0 * j as f64;
            next[j] -= p * p * c;
            next[j + 1] += p * (p - 1.0) * c;
        }
        row = next;
        factorial *= ((2 * k + 2) * (2 * k + 3)) as f64;
    }
    all
}
