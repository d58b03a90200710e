//! [`Real`]: the two scalars the numerical code is generic over, f64 (the truth) and f32 (the kernels' twin).

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f32` or `f64`, as far as the numerical code needs it.
pub trait Real:
    Copy
    + PartialOrd
    + Send
    + Sync
    + From<f32>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
}

impl Real for f32 {
    const EPSILON: f32 = f32::EPSILON;
}

impl Real for f64 {
    const EPSILON: f64 = f64::EPSILON;
}
