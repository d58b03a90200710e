//! [`Real`]: the scalars the solvers are generic over.

use std::fmt::{Debug, Display};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::lanes::{self, Part, Scratch};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`: f64 is the reference, f32 the twin of a GPU's arithmetic. Sealed.
pub trait Real:
    sealed::Sealed
    + Copy
    + Send
    + Sync
    + Debug
    + Display
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// Not a number.
    const NAN: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The smallest positive number of full precision. What decays below it counts as 0: arithmetic
    /// with smaller numbers is a hundred times slower on many processors.
    const SMALLEST_NORMAL: Self;

    /// The nearest number of this type.
    fn from_f64(x: f64) -> Self;
    /// The same number in f64.
    fn to_f64(self) -> f64;
    /// |x|
    fn abs(self) -> Self;
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
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
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
            fn abs(self) -> Self {
                self.abs()
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
