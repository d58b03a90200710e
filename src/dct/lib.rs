//! Cosine transforms of rustdct, for numbers that are known.
//!
//! rustdct and rustfft are generic: who names a number compiles them for it. That was a sixth of faircurve's
//! code, compiled again after every change of a room. Here it is compiled once.

use std::sync::Arc;

use rustdct::rustfft::Length;
pub use rustdct::{Dct1, DctNum};
use rustdct::{DctPlanner, RequiredScratch};

/// Numbers that can be transformed.
pub trait Transformed: DctNum {
    /// What plans transforms, and shares their tables.
    fn planner() -> Box<dyn Planner<Self>>;
}

/// Plans transforms.
pub trait Planner<T> {
    /// The cosine transform of type 1 of `length` numbers, two at least.
    fn dct1(&mut self, length: usize) -> Arc<dyn Dct1<T>>;
}

impl Transformed for f64 {
    fn planner() -> Box<dyn Planner<Self>> {
        Box::new(DctPlanner::<f64>::new())
    }
}

impl Planner<f64> for DctPlanner<f64> {
    fn dct1(&mut self, length: usize) -> Arc<dyn Dct1<f64>> {
        self.plan_dct1(length)
    }
}

/// Only tests transform in f32. A second copy of rustfft is not worth that, so what goes in and comes out is rounded.
impl Transformed for f32 {
    fn planner() -> Box<dyn Planner<Self>> {
        Box::new(DctPlanner::<f64>::new())
    }
}

impl Planner<f32> for DctPlanner<f64> {
    fn dct1(&mut self, length: usize) -> Arc<dyn Dct1<f32>> {
        Arc::new(Rounded(self.plan_dct1(length)))
    }
}

/// A transform in f64 of numbers in f32.
struct Rounded(Arc<dyn Dct1<f64>>);

impl Length for Rounded {
    fn len(&self) -> usize {
        self.0.len()
    }
}

impl RequiredScratch for Rounded {
    fn get_scratch_len(&self) -> usize {
        0
    }
}

impl Dct1<f32> for Rounded {
    fn process_dct1_with_scratch(&self, buffer: &mut [f32], _: &mut [f32]) {
        let mut numbers: Vec<f64> = buffer.iter().map(|&x| x.into()).collect();
        self.0.process_dct1(&mut numbers);
        for (to, x) in buffer.iter_mut().zip(numbers) {
            *to = x as f32;
        }
    }
}
