//! Sine, cosine and arctangent by polynomials. They are the same operations in every lane of a
//! vector register and on GPUs, whose own functions are missing or wrong in f64.
//!
//! The polynomials interpolate at Chebyshev nodes. In f64 their error is below rounding (absolute
//! 2e-17 for sine and cosine, relative 2e-18 for the arctangent).

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use crate::linalg::Scalar;

/// sin(x)/x as a polynomial in x², |x| ≤ π/2.
pub(crate) const SINE: [f64; 9] = [
    1.0,
    -0.16666666666666666,
    0.008333333333333186,
    -0.00019841269841208676,
    2.7557319211229606e-06,
    -2.505210689056952e-08,
    1.605894087848656e-10,
    -7.643026557971632e-13,
    2.7215749422983443e-15,
];

/// (cos(x) − 1)/x² as a polynomial in x², |x| ≤ π/2.
pub(crate) const COSINE: [f64; 8] = [
    -0.5,
    0.04166666666666634,
    -0.0013888888888860709,
    2.4801587292446213e-05,
    -2.755731776732053e-07,
    2.0876630867422994e-09,
    -1.1464689885720029e-11,
    4.6276759850181716e-14,
];

/// atan(z)/z as a polynomial in z², |z| ≤ tan(π/8).
pub(crate) const ARCTANGENT: [f64; 12] = [
    1.0,
    -0.3333333333333312,
    0.19999999999940893,
    -0.14285714279250245,
    0.11111110744919658,
    -0.09090896809064027,
    0.07692045330902225,
    -0.06662951813629191,
    0.05846878297330872,
    -0.05035102456601552,
    0.03796525745386593,
    -0.017805397205419446,
];

/// Σ cₖ xᵏ
#[inline(always)]
pub(crate) fn polynomial<S: Scalar, const N: usize>(coefficients: &[f64; N], x: S) -> S {
    let mut sum = S::of(coefficients[N - 1]);
    let mut k = N - 1;
    while k > 0 {
        k -= 1;
        sum = sum * x + S::of(coefficients[k]);
    }
    sum
}

/// sin x and cos x for |x| ≤ π.
#[inline(always)]
pub(crate) fn sine_cosine<S: Scalar>(x: S) -> (S, S) {
    let folds = x.abs() - S::of(FRAC_PI_2);
    let y = folds.if_positive(S::of(PI) - x.abs(), x.abs());
    let square = y * y;
    let sine = y * polynomial(&SINE, square);
    let cosine = S::ONE + square * polynomial(&COSINE, square);
    ((-x).if_positive(-sine, sine), folds.if_positive(-cosine, cosine))
}

/// The angle of the direction (x, y) from the x axis, x ≥ 0, y ≥ 0, not both 0.
#[inline(always)]
pub(crate) fn first_quadrant_angle<S: Scalar>(y: S, x: S) -> S {
    // tan(π/8) = √2 − 1. Between it and its cotangent, the angle is π/4 more than that of (x + y, y
    // − x).
    const TANGENT: f64 = 0.41421356237309515;
    let low = S::of(TANGENT) * x - y;
    let high = S::of(TANGENT) * y - x;
    let numerator = low.if_positive(y, (-high).if_positive(y - x, -x));
    let denominator = low.if_positive(x, (-high).if_positive(y + x, y));
    let offset = low.if_positive(S::ZERO, (-high).if_positive(S::of(FRAC_PI_4), S::of(FRAC_PI_2)));
    let z = numerator / denominator;
    offset + z * polynomial(&ARCTANGENT, z * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_cosine_and_angle_are_those_of_the_standard_library() {
        // 2 ε: one from rounding, and one from π, which is itself rounded.
        let (wide, narrow) = (2.0 * f64::EPSILON, 2.0 * f32::EPSILON);
        for k in -4000..=4000 {
            let x = k as f64 * PI / 4000.0;
            let (sine, cosine) = sine_cosine(x);
            assert!((sine - x.sin()).abs() < wide && (cosine - x.cos()).abs() < wide, "{x}");
            let (sine, cosine) = sine_cosine(x as f32);
            assert!((sine - (x as f32).sin()).abs() < narrow && (cosine - (x as f32).cos()).abs() < narrow, "{x}");
            let tiny = x * 1e-12;
            assert!((sine_cosine(tiny).0 - tiny.sin()).abs() <= 4e-16 * tiny.abs());
        }
        for k in 0..=1000 {
            let (y, x) = (k as f64 * FRAC_PI_2 / 1000.0).sin_cos();
            let angle = first_quadrant_angle(y, x.max(0.0));
            // 3 ε: from the quotient, from π/4, and from their sum.
            assert!((angle - y.atan2(x.max(0.0))).abs() <= 3.0 * f64::EPSILON * angle, "{y} {x}");
            let angle = first_quadrant_angle(y as f32, x.max(0.0) as f32);
            assert!(
                (angle as f64 - y.atan2(x.max(0.0))).abs() <= 3.0 * f64::from(f32::EPSILON) * angle as f64,
                "{y} {x}"
            );
            let tiny = first_quadrant_angle(1e-30 * y, x.max(1e-3));
            assert!((tiny - (1e-30 * y).atan2(x.max(1e-3))).abs() <= 4e-16 * tiny);
        }
    }
}
