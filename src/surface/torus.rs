//! [`Torus`].

use glam::{DMat3, DVec3};

use super::quadric::positive;
use super::{Surface, SurfaceKernel};
use crate::error::{Error, Result};

/// The torus (√(x² + y²) − R)² + z² = r², with its axis along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    /// R, from the axis to the middle of the tube.
    major: f64,
    /// r, of the tube.
    minor: f64,
}

impl Torus {
    /// The torus of these radii, R > r > 0.
    ///
    /// # Errors
    /// Radii that are not positive, or a tube that meets itself.
    pub fn new(major: f64, minor: f64) -> Result<Self> {
        positive("radius R", "torus", major)?;
        positive("radius r", "torus", minor)?;
        if minor >= major {
            return Err(Error::Argument(format!("a torus of R = {major} and r = {minor} meets itself: give R > r")));
        }
        Ok(Torus { major, minor })
    }
}

/// F = ½ ((ρ − R)² + z² − r²)/r with ρ = √(x² + y²).
impl Surface for Torus {
    fn name(&self) -> String {
        format!("the torus of radii {} and {}", self.major, self.minor)
    }

    fn value(&self, x: DVec3) -> f64 {
        let out = x.x.hypot(x.y) - self.major;
        0.5 * (out * out + x.z * x.z - self.minor * self.minor) / self.minor
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        let shrink = 1.0 - self.major / x.x.hypot(x.y);
        DVec3::new(shrink * x.x, shrink * x.y, x.z) / self.minor
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        // (1 − R/ρ) I + (R/ρ) ρ̂ ρ̂ᵀ in the plane of x and y.
        let ratio = self.major / x.x.hypot(x.y);
        let out = DVec3::new(x.x, x.y, 0.0).normalize();
        let outer = DMat3::from_cols(out * out.x, out * out.y, DVec3::ZERO);
        let flat = DMat3::from_diagonal(DVec3::new(1.0 - ratio, 1.0 - ratio, 1.0));
        (flat + ratio * outer) * (1.0 / self.minor)
    }

    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        // d[R/ρ (ρ̂ρ̂ᵀ − I)] = −(R/ρ²) (ρ̂·d)(ρ̂ρ̂ᵀ − I) + (R/ρ)(dρ̂ ρ̂ᵀ + ρ̂ dρ̂ᵀ), dρ̂ = φ̂
        // (φ̂·d)/ρ.
        let distance = x.x.hypot(x.y);
        let out = DVec3::new(x.x, x.y, 0.0) / distance;
        let round = DVec3::new(-out.y, out.x, 0.0);
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        // In the plane I − ρ̂ρ̂ᵀ is φ̂φ̂ᵀ.
        let change = out.dot(along) * outer(round, round) + round.dot(along) * (outer(round, out) + outer(out, round));
        change * (self.major / (distance * distance * self.minor))
    }

    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        Some(self)
    }
}

impl SurfaceKernel for Torus {
    fn text(&self) -> String {
        let text = include_str!("../../shaders/surface/torus.wgsl");
        text.replace("$MAJOR", &format!("{:?}", self.major)).replace("$MINOR", &format!("{:?}", self.minor))
    }
}
