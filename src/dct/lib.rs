//! Cosine transforms of rustdct, in f64 and f32.
//!
//! rustdct and rustfft are generic: who names a number compiles them for it. That was a sixth of faircurve's
//! code, compiled again after every change of a room. Here it is compiled once.

use std::sync::Arc;

pub use rustdct::{Dct1, DctNum};

/// Numbers that can be transformed.
pub trait Transformed: DctNum {
    /// A planner, which shares tables between transforms.
    fn planner() -> Box<dyn Planner<Self>>;
}

/// Plans transforms.
pub trait Planner<T> {
    /// The cosine transform of type 1 of `length` numbers, two at least.
    fn dct1(&mut self, length: usize) -> Arc<dyn Dct1<T>>;
}

macro_rules! transformed {
    ($($number:ty),*) => {$(
        impl Transformed for $number {
            fn planner() -> Box<dyn Planner<Self>> {
                Box::new(rustdct::DctPlanner::<$number>::new())
            }
        }

        impl Planner<$number> for rustdct::DctPlanner<$number> {
            fn dct1(&mut self, length: usize) -> Arc<dyn Dct1<$number>> {
                self.plan_dct1(length)
            }
        }
    )*};
}

// Only tests transform in f32. Without a feature for it, tests and programs share one build.
transformed!(f64, f32);
