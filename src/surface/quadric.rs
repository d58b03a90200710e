//! [`Quadric`]: surfaces of second degree.

use glam::{DMat3, DVec3};

use super::Surface;
use crate::error::{Error, Result};

/// The surface ½ xᵀA x + b·x + c = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadric {
    /// A, symmetric.
    pub matrix: DMat3,
    /// b
    pub linear: DVec3,
    /// c
    pub constant: f64,
    /// What it is, for messages.
    pub name: String,
}

/// Checks a size of a surface.
pub(super) fn positive(what: &str, of: &str, x: f64) -> Result<()> {
    if x > 0.0 && x.is_finite() {
        return Ok(());
    }
    Err(Error::Argument(format!("the {what} of the {of} is {x}: give a positive, finite number")))
}

impl Quadric {
    fn centred(matrix: DVec3, constant: f64, name: String) -> Self {
        Quadric { matrix: DMat3::from_diagonal(matrix), linear: DVec3::ZERO, constant, name }
    }

    /// The plane n·x = d, for the unit vector n along `normal`.
    pub fn plane(normal: DVec3, offset: f64) -> Self {
        let linear = normal.normalize();
        Quadric { matrix: DMat3::ZERO, linear, constant: -offset, name: format!("the plane of normal {normal}") }
    }

    /// The sphere |x| = R.
    pub fn sphere(radius: f64) -> Self {
        Self::centred(DVec3::splat(1.0 / radius), -0.5 * radius, format!("the sphere of radius {radius}"))
    }

    /// The spheroid of these semi-axes, with its axis along z.
    pub fn spheroid(equatorial: f64, polar: f64) -> Self {
        Quadric {
            name: format!("the spheroid of semi-axes {equatorial} and {polar}"),
            ..Self::ellipsoid(DVec3::new(equatorial, equatorial, polar))
        }
    }

    /// The ellipsoid (x/a)² + (y/b)² + (z/c)² = 1.
    pub fn ellipsoid(semi_axes: DVec3) -> Self {
        // Times the square of the largest, so that A is of the order of 1.
        let scale = semi_axes.max_element();
        let matrix = (scale / semi_axes) * (scale / semi_axes);
        let [a, b, c] = semi_axes.to_array();
        Self::centred(matrix, -0.5 * scale * scale, format!("the ellipsoid of semi-axes {a}, {b} and {c}"))
    }

    /// The cylinder x² + y² = R².
    pub fn cylinder(radius: f64) -> Self {
        let matrix = DVec3::new(1.0, 1.0, 0.0) / radius;
        Self::centred(matrix, -0.5 * radius, format!("the cylinder of radius {radius}"))
    }

    /// The cone √(x² + y²) = |z| tan α, of both sides of its apex at the origin.
    ///
    /// The apex is a singular point: no curve can pass through it.
    pub fn cone(half_angle: f64) -> Self {
        let slope = half_angle.tan();
        Self::centred(DVec3::new(1.0, 1.0, -slope * slope), 0.0, format!("the cone of half angle {half_angle}"))
    }

    /// Checks that it is a surface.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn check(&self) -> Result<()> {
        let is_finite = self.matrix.is_finite() && self.linear.is_finite() && self.constant.is_finite();
        let is_empty = self.matrix == DMat3::ZERO && self.linear == DVec3::ZERO;
        if is_finite && !is_empty {
            return Ok(());
        }
        Err(Error::Argument(format!("{} is no surface: its sizes must be positive and finite", self.name)))
    }
}

impl Surface for Quadric {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn value(&self, x: DVec3) -> f64 {
        x.dot(0.5 * (self.matrix * x) + self.linear) + self.constant
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        self.matrix * x + self.linear
    }

    fn hessian(&self, _: DVec3) -> DMat3 {
        self.matrix
    }

    fn third(&self, _: DVec3, _: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    /// The root of ½ a t² + s t + F = 0 on the way along ∇F, and one step of Newton's method against its rounding.
    fn foot(&self, x: DVec3) -> Option<DVec3> {
        let gradient = self.gradient(x);
        let (square, value) = (gradient.length_squared(), self.value(x));
        let root = (square * square - 2.0 * gradient.dot(self.matrix * gradient) * value).sqrt();
        let near = x - (2.0 * value / (square + root)) * gradient;
        let gradient = self.gradient(near);
        let foot = near - self.value(near) / gradient.length_squared() * gradient;
        foot.is_finite().then_some(foot)
    }

    fn quadric(&self) -> Option<Quadric> {
        Some(self.clone())
    }
}
