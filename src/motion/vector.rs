//! [`Vector`]: the operations on vectors that curvature needs, in the plane and in space.

use std::ops::{Add, Div, Mul};

use glam::{DVec2, DVec3};

/// A vector of the plane or of space.
pub(crate) trait Vector:
    Copy + Add<Output = Self> + Mul<f64, Output = Self> + Div<f64, Output = Self> + Send + Sync
{
    /// The cross product of two vectors: a number in the plane, a vector in space.
    type Turn: Copy + Add<Output = Self::Turn> + Mul<f64, Output = Self::Turn>;

    /// Drops z in the plane.
    fn of(vector: DVec3) -> Self;
    fn dot(self, other: Self) -> f64;
    fn cross(self, other: Self) -> Self::Turn;
    /// The scalar product of two cross products.
    fn product(a: Self::Turn, b: Self::Turn) -> f64;
    /// Largest coordinate.
    fn largest(self) -> f64;
}

impl Vector for DVec2 {
    type Turn = f64;

    #[inline(always)]
    fn of(vector: DVec3) -> Self {
        vector.truncate()
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }

    #[inline(always)]
    fn cross(self, other: Self) -> f64 {
        self.perp_dot(other)
    }

    #[inline(always)]
    fn product(a: f64, b: f64) -> f64 {
        a * b
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.abs().max_element()
    }
}

impl Vector for DVec3 {
    type Turn = DVec3;

    #[inline(always)]
    fn of(vector: DVec3) -> Self {
        vector
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        self.dot(other)
    }

    #[inline(always)]
    fn cross(self, other: Self) -> DVec3 {
        self.cross(other)
    }

    #[inline(always)]
    fn product(a: DVec3, b: DVec3) -> f64 {
        a.dot(b)
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.abs().max_element()
    }
}
