//! [`Quadric`]: surfaces of second degree.

// Loops over coordinates and lanes by index stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use glam::{DMat3, DVec3};

use super::{Kind, Surface};
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::linalg::{Lanes, Operation, Scalar, with_wide_registers};

/// The surface ½ xᵀA x + b·x + c = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadric {
    /// A, symmetric.
    pub matrix: DMat3,
    /// b
    pub linear: DVec3,
    /// c
    pub constant: f64,
    /// A name for messages.
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
        Self::round(radius, format!("the sphere of radius {radius}"))
    }

    /// The sphere with a name.
    pub(super) fn round(radius: f64, name: String) -> Self {
        Self::centred(DVec3::splat(1.0 / radius), -0.5 * radius, name)
    }

    /// The spheroid of these semi-axes, with its axis along z.
    pub fn spheroid(equatorial: f64, polar: f64) -> Self {
        let name = format!("the spheroid of semi-axes {equatorial} and {polar}");
        Self::axial(DVec3::new(equatorial, equatorial, polar), name)
    }

    /// The ellipsoid (x/a)² + (y/b)² + (z/c)² = 1.
    pub fn ellipsoid(semi_axes: DVec3) -> Self {
        let [a, b, c] = semi_axes.to_array();
        Self::axial(semi_axes, format!("the ellipsoid of semi-axes {a}, {b} and {c}"))
    }

    /// The ellipsoid with a name.
    pub(super) fn axial(semi_axes: DVec3, name: String) -> Self {
        // Times the square of the largest, so that A is of the order of 1.
        let scale = semi_axes.max_element();
        let matrix = (scale / semi_axes) * (scale / semi_axes);
        Self::centred(matrix, -0.5 * scale * scale, name)
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

    fn project(&self, x: DVec3) -> Option<DVec3> {
        let projection = DVec3::from_array(Wide::<f64>::of(self).project(x.to_array()));
        projection.is_finite().then_some(projection)
    }

    /// As [`project`](Surface::project), several at a time.
    fn project_all(&self, points: &mut [DVec3]) {
        if let Err(ProjectAll { quadric, points }) = with_wide_registers(ProjectAll { quadric: self, points }) {
            for x in points {
                *x = quadric.project(*x).unwrap_or(DVec3::NAN);
            }
        }
    }

    fn kind(&self) -> Kind {
        Kind::Quadric(self.clone())
    }
}

/// A quadric for several points at a time.
struct Wide<S> {
    matrix: [Vector<S, 3>; 3],
    linear: Vector<S, 3>,
    constant: S,
}

impl<S: Scalar> Wide<S> {
    #[inline(always)]
    fn of(quadric: &Quadric) -> Self {
        let mut wide = Wide { matrix: [[S::ZERO; 3]; 3], linear: [S::ZERO; 3], constant: S::of(quadric.constant) };
        for a in 0..3 {
            wide.linear[a] = S::of(quadric.linear[a]);
            for b in 0..3 {
                wide.matrix[a][b] = S::of(quadric.matrix.col(b)[a]);
            }
        }
        wide
    }

    /// A x
    #[inline(always)]
    fn bent(&self, x: Vector<S, 3>) -> Vector<S, 3> {
        [dot(self.matrix[0], x), dot(self.matrix[1], x), dot(self.matrix[2], x)]
    }

    /// F at x, where its gradient is A x + b.
    #[inline(always)]
    fn value(&self, x: Vector<S, 3>, gradient: Vector<S, 3>) -> S {
        S::of(0.5) * dot(x, add(gradient, self.linear)) + self.constant
    }

    /// The root of ½ a t² + s t + F = 0 along ∇F, and one Newton step against its rounding.
    #[inline(always)]
    fn project(&self, x: Vector<S, 3>) -> Vector<S, 3> {
        let gradient = add(self.bent(x), self.linear);
        let (square, value, bent) = (dot(gradient, gradient), self.value(x, gradient), self.bent(gradient));
        let root = (square * square - S::of(2.0) * dot(gradient, bent) * value).sqrt();
        let way = S::of(2.0) * value / (square + root);
        let (near, gradient) = (subtract(x, scale(way, gradient)), subtract(gradient, scale(way, bent)));
        subtract(near, scale(self.value(near, gradient) / dot(gradient, gradient), gradient))
    }
}

/// Projects points, as many at a time as an AVX2 register holds.
struct ProjectAll<'a> {
    quadric: &'a Quadric,
    points: &'a mut [DVec3],
}

impl Operation for ProjectAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let wide = Wide::<Lanes<f64, 4>>::of(self.quadric);
        for points in self.points.chunks_mut(4) {
            let mut x = [Lanes::ZERO; 3];
            for lane in 0..4 {
                let point = points[lane.min(points.len() - 1)];
                for c in 0..3 {
                    x[c].set_lane(lane, point[c]);
                }
            }
            let projections = wide.project(x);
            for lane in 0..points.len() {
                points[lane] = DVec3::from_array(projections.map(|x| x.lane(lane)));
            }
        }
    }
}
