//! [`Real`]: the scalars the solvers are generic over.

use std::fmt::Display;

use super::lanes::{self, Part, Scratch};
use super::scalar::Scalar;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`: f64 is the reference, f32 the twin of a GPU's arithmetic. Sealed.
pub trait Real: sealed::Sealed + Scalar<Number = Self> + Display + PartialEq + PartialOrd {
    /// Not a number.
    const NAN: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The smallest positive number of full precision.
    const SMALLEST_NORMAL: Self;

    /// The nearest number of this type.
    fn from_f64(x: f64) -> Self;
    /// The same number in f64.
    fn to_f64(self) -> f64;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;

    /// Solves a part of a batch, as many systems side by side as suit the type.
    #[doc(hidden)]
    #[allow(private_interfaces)]
    fn solve_part(part: &Part<Self>, x: &mut [Self], status: &mut [crate::CurveStatus], scratch: &mut Scratch<Self>);
}

macro_rules! real {
    ($type:ty, $lanes:literal) => {
        impl Real for $type {
            const NAN: Self = <$type>::NAN;
            const EPSILON: Self = <$type>::EPSILON;
            const SMALLEST_NORMAL: Self = <$type>::MIN_POSITIVE;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $type
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
            #[allow(private_interfaces)]
            fn solve_part(
                part: &Part<Self>,
                x: &mut [Self],
                status: &mut [crate::CurveStatus],
                scratch: &mut Scratch<Self>,
            ) {
                lanes::solve_part::<Self, $lanes>(part, x, status, scratch)
            }
        }
    };
}

real!(f32, 16);
real!(f64, 8);
