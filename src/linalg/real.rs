//! [`Real`] for `f32` and `f64`, and how many systems each solves side by side.

use super::lanes;
use super::scalar::Real;
use super::systems::{Part, Scratch};
use crate::status::CurveStatus;

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
            fn solve_part(part: &Part<Self>, x: &mut [Self], status: &mut [CurveStatus], scratch: &mut Scratch<Self>) {
                lanes::solve_part::<Self, $lanes>(part, x, status, scratch)
            }
        }
    };
}

real!(f32, 16);
real!(f64, 8);
