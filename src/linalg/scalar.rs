//! [`Scalar`]: the number type of the mathematics of curves. It is a number, or a vector register with
//! a number in each lane. [`Real`]: the type of one number.

use std::fmt::{Debug, Display};
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use super::systems::{Part, Scratch};
use super::wide::{Operation, apart, in_wide_registers};
use crate::status::CurveStatus;

/// A number, or [`Lanes`] of numbers that undergo the same operations.
///
/// Every operation rounds each lane like a single number. So a curve's bits do not depend on the
/// curves in the other lanes.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// The number type of a lane.
    type Number: Real;
    /// Numbers side by side.
    const LANES: usize;
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;

    /// The same number in every lane, rounded to its type.
    fn of(x: f64) -> Self;
    /// The number in a lane.
    fn lane(&self, lane: usize) -> Self::Number;
    /// Replaces the number in a lane.
    fn set_lane(&mut self, lane: usize, x: Self::Number);
    /// √x
    fn sqrt(self) -> Self;
    /// |x|
    fn abs(self) -> Self;
    /// The larger of two, lane by lane; `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// x^exponent for x ≥ 0.
    fn powf(self, exponent: f64) -> Self;
    /// `yes` where this is > 0, else (0, negative, NaN) `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;
    /// Runs an operation on such numbers, with the registers that hold them.
    fn run<Op: Operation>(operation: Op) -> Op::Output;
}

macro_rules! scalar {
    ($type:ty) => {
        impl Scalar for $type {
            type Number = $type;
            const LANES: usize = 1;
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $type
            }
            #[inline(always)]
            fn lane(&self, _: usize) -> $type {
                *self
            }
            #[inline(always)]
            fn set_lane(&mut self, _: usize, x: $type) {
                *self = x;
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$type>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$type>::abs(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn powf(self, exponent: f64) -> Self {
                <$type>::powf(self, exponent as $type)
            }
            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                if self > 0.0 { yes } else { no }
            }
            fn run<Op: Operation>(operation: Op) -> Op::Output {
                apart(operation)
            }
        }
    };
}

scalar!(f32);
scalar!(f64);

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
    fn solve_part(part: &Part<Self>, x: &mut [Self], status: &mut [CurveStatus], scratch: &mut Scratch<Self>);
}

/// L numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<T, const L: usize>(pub [T; L]);

impl<T: Real, const L: usize> Default for Lanes<T, L> {
    #[inline(always)]
    fn default() -> Self {
        Lanes([T::ZERO; L])
    }
}

// Loops as plain as can be: iterators and ranges in every operation make descents take minutes to
// compile.
macro_rules! operator {
    ($trait:ident $method:ident $assign_trait:ident $assign_method:ident) => {
        impl<T: Real, const L: usize> $trait for Lanes<T, L> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                let mut j = 0;
                while j < L {
                    self.0[j] = self.0[j].$method(other.0[j]);
                    j += 1;
                }
                self
            }
        }

        impl<T: Real, const L: usize> $assign_trait for Lanes<T, L> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                let mut j = 0;
                while j < L {
                    self.0[j] = self.0[j].$method(other.0[j]);
                    j += 1;
                }
            }
        }
    };
}

operator!(Add add AddAssign add_assign);
operator!(Sub sub SubAssign sub_assign);
operator!(Mul mul MulAssign mul_assign);

impl<T: Real, const L: usize> Div for Lanes<T, L> {
    type Output = Self;
    #[inline(always)]
    fn div(mut self, other: Self) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = self.0[j] / other.0[j];
            j += 1;
        }
        self
    }
}

impl<T: Real, const L: usize> Neg for Lanes<T, L> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = -self.0[j];
            j += 1;
        }
        self
    }
}

impl<T: Real, const L: usize> Scalar for Lanes<T, L> {
    type Number = T;
    const LANES: usize = L;
    const ZERO: Self = Lanes([T::ZERO; L]);
    const ONE: Self = Lanes([T::ONE; L]);

    #[inline(always)]
    fn of(x: f64) -> Self {
        Lanes([T::of(x); L])
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> T {
        self.0[lane]
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, x: T) {
        self.0[lane] = x;
    }
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = self.0[j].sqrt();
            j += 1;
        }
        self
    }
    #[inline(always)]
    fn abs(mut self) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = self.0[j].abs();
            j += 1;
        }
        self
    }
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = self.0[j].max(other.0[j]);
            j += 1;
        }
        self
    }
    #[inline(always)]
    fn powf(mut self, exponent: f64) -> Self {
        let mut j = 0;
        while j < L {
            self.0[j] = self.0[j].powf(exponent);
            j += 1;
        }
        self
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        let mut out = no;
        let mut j = 0;
        while j < L {
            out.0[j] = self.0[j].if_positive(yes.0[j], no.0[j]);
            j += 1;
        }
        out
    }
    fn run<Op: Operation>(operation: Op) -> Op::Output {
        in_wide_registers(operation)
    }
}

/// A number of a lane.
#[inline(always)]
pub fn number<S: Scalar>(x: f64) -> S::Number {
    <S::Number as Scalar>::of(x)
}

/// A vector of D components.
pub type Vector<S, const D: usize> = [S; D];

/// a·b
#[inline(always)]
pub fn dot<S: Scalar, const D: usize>(a: Vector<S, D>, b: Vector<S, D>) -> S {
    let mut sum = a[0] * b[0];
    let mut c = 1;
    while c < D {
        sum += a[c] * b[c];
        c += 1;
    }
    sum
}

/// a + b
#[inline(always)]
pub fn add<S: Scalar, const D: usize>(mut a: Vector<S, D>, b: Vector<S, D>) -> Vector<S, D> {
    let mut c = 0;
    while c < D {
        a[c] += b[c];
        c += 1;
    }
    a
}

/// a − b
#[inline(always)]
pub fn subtract<S: Scalar, const D: usize>(mut a: Vector<S, D>, b: Vector<S, D>) -> Vector<S, D> {
    let mut c = 0;
    while c < D {
        a[c] -= b[c];
        c += 1;
    }
    a
}

/// x·a
#[inline(always)]
pub fn scale<S: Scalar, const D: usize>(x: S, mut a: Vector<S, D>) -> Vector<S, D> {
    let mut c = 0;
    while c < D {
        a[c] *= x;
        c += 1;
    }
    a
}
