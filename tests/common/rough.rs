//! Random points to be passed through by fair curves, gentle and rough, from a seed.

use faircurve::CurveBatch;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Curves of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// 2 or 3
    pub dimension: usize,
    pub closed: bool,
    /// Data points of a curve.
    pub points: usize,
    /// Open curves: standard deviation of the heights over points at unit steps. Closed ones: of
    /// the radius about a circle of radius 1, and of the height.
    pub sigma: f64,
}

impl Family {
    pub fn batch(&self, curves: usize, seed: u64) -> CurveBatch {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut normal = || {
            let (u, v): (f64, f64) = (rng.random_range(f64::MIN_POSITIVE..1.0), rng.random_range(0.0..1.0));
            self.sigma * (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        };
        let mut coords = Vec::with_capacity(curves * self.points * self.dimension);
        for k in (0..curves).flat_map(|_| 0..self.points) {
            let angle = std::f64::consts::TAU * k as f64 / self.points as f64;
            if self.closed {
                let radius = 1.0 + normal();
                coords.extend([radius * angle.cos(), radius * angle.sin()]);
            } else {
                coords.extend([k as f64, normal()]);
            }
            coords.extend((2..self.dimension).map(|_| normal()));
        }
        let offsets = (0..=curves).map(|i| i * self.points).collect();
        CurveBatch::from_ragged(self.dimension, coords, offsets).unwrap().closed(self.closed)
    }
}

impl std::fmt::Display for Family {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Family { dimension, closed, points, sigma } = self;
        write!(f, "{dimension}-D {}, {points} points, σ {sigma}", if *closed { "closed" } else { "open" })
    }
}
