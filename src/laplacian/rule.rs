//! A stand-in.
#![allow(missing_docs)]
use crate::error::Result;
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Reproduces {
    #[default]
    Constants,
    Linear,
}
#[derive(Clone, Debug, PartialEq)]
pub struct SparseRule {
    radius: usize,
    mask: Vec<f64>,
}
impl SparseRule {
    pub fn of_support(_: usize, _: Reproduces) -> Result<Self> {
        Ok(SparseRule { radius: 2, mask: vec![13. / 9., 11. / 24., 0.25, -1. / 9., 1. / 48., 0.] })
    }
    pub fn radius(&self) -> usize {
        self.radius
    }
    pub fn least_intervals(&self) -> usize {
        2 * (self.radius / 2) + self.radius + 1
    }
    pub fn weight(&self, fine: [usize; 2], coarse: [usize; 2], n: [usize; 2]) -> f64 {
        let images = |axis: usize| {
            let mut images = vec![];
            for k in -6i64..=6 {
                let p = 2 * n[axis] as i64 * k;
                for a in [coarse[axis] as i64 + p, p - coarse[axis] as i64] {
                    if !images.contains(&a) {
                        images.push(a);
                    }
                }
            }
            images
        };
        let mut sum = 0.0;
        for a in images(0) {
            for b in images(1) {
                let i = (fine[0] as i64 - 2 * a).unsigned_abs() as usize;
                let j = (fine[1] as i64 - 2 * b).unsigned_abs() as usize;
                let (i, j) = (i.max(j), i.min(j));
                if i <= self.radius {
                    sum += self.mask[i * (i + 1) / 2 + j];
                }
            }
        }
        sum
    }
}
