//! [`Surface`]: regular surfaces F(x) = 0 that curves lie in.
//!
//! [`Fair::surface`](crate::discrete::Fair::surface) keeps every vertex of a curve in one. A
//! surface gives F with its derivatives. The unit normal is n = ∇F/|∇F|, and the scale of F does
//! not count.
//!
//! - [`Quadric`]: plane, sphere, spheroid, ellipsoid, cylinder, cone.
//! - [`Torus`].
//! - [`Mesh`]: a smooth surface through the vertices of triangles.
//! - [`Globe`]: a sphere or a spheroid whose points are longitudes and latitudes.
//! - [`HeightField`]: terrain over a grid.
//! - Your own: implement [`Surface`].

mod globe;
mod heights;
mod mesh;
mod named;
mod quadric;
mod torus;

use std::fmt::Debug;
use std::sync::Arc;

use glam::{DMat3, DVec3};

pub use globe::Globe;
pub use heights::HeightField;
pub use mesh::Mesh;
#[cfg(feature = "formats")]
pub(crate) use named::is_named;
pub use named::named;
pub use quadric::Quadric;
pub use torus::Torus;

/// The most Newton steps of a projection.
///
/// Each squares the distance over the radius of curvature. 6 are enough from half a radius.
const MOST_STEPS: usize = 50;

/// Differences of F‴ are taken over this part of the distance from the origin, about ∛ε.
const DIFFERENCE: f64 = 6e-6;

/// A regular surface F(x) = 0 in space.
///
/// F is smooth where ∇F ≠ 0, which must hold near the surface.
///
/// ```
/// use faircurve::surface::{Quadric, Surface};
/// use glam::DVec3;
///
/// let sphere = Quadric::sphere(2.0);
/// assert_eq!(sphere.closest(DVec3::new(0.0, 3.0, 0.0)), Some(DVec3::new(0.0, 2.0, 0.0)));
/// ```
///
/// Your own surface needs a name, F, ∇F and ∇²F:
///
/// ```
/// use faircurve::surface::Surface;
/// use glam::{DMat3, DVec3};
///
/// #[derive(Debug)]
/// struct Bowl;
///
/// impl Surface for Bowl {
///     fn name(&self) -> String {
///         "the bowl z = (x² + y²)/2".into()
///     }
///
///     fn value(&self, x: DVec3) -> f64 {
///         x.z - 0.5 * (x.x * x.x + x.y * x.y)
///     }
///
///     fn gradient(&self, x: DVec3) -> DVec3 {
///         DVec3::new(-x.x, -x.y, 1.0)
///     }
///
///     fn hessian(&self, _: DVec3) -> DMat3 {
///         DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 0.0))
///     }
/// }
///
/// let projection = Bowl.project(DVec3::new(1.0, 0.0, 0.6)).unwrap();
/// assert!(Bowl.value(projection).abs() < 1e-12);
/// ```
pub trait Surface: Debug + Send + Sync {
    /// A name for messages, such as `the sphere of radius 1`.
    fn name(&self) -> String;

    /// F at x, of any scale.
    fn value(&self, x: DVec3) -> f64;

    /// ∇F at x.
    fn gradient(&self, x: DVec3) -> DVec3;

    /// The second derivatives of F at x.
    fn hessian(&self, x: DVec3) -> DMat3;

    /// The derivative of the Hessian at x in a direction.
    ///
    /// By default the central difference of Hessians. Newton's method for curves uses it.
    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        let length = along.length();
        if length == 0.0 {
            return DMat3::ZERO;
        }
        let h = DIFFERENCE * x.length().max(1.0);
        let step = h / length * along;
        (self.hessian(x + step) - self.hessian(x - step)) * (0.5 * length / h)
    }

    /// F, ∇F and ∇²F at x, for surfaces that find them together in less time.
    fn jet(&self, x: DVec3) -> (f64, DVec3, DMat3) {
        (self.value(x), self.gradient(x), self.hessian(x))
    }

    /// Projects x onto the surface by Newton steps along ∇F. `None` if they do not converge.
    ///
    /// It is the closest point to second order in the distance.
    fn project(&self, x: DVec3) -> Option<DVec3> {
        projected(|x| (self.value(x), self.gradient(x)), x, 0.0)
    }

    /// Projects many points, for surfaces that do so together in less time. A point without a
    /// projection becomes NaN.
    fn project_all(&self, points: &mut [DVec3]) {
        for x in points {
            *x = self.project(*x).unwrap_or(DVec3::NAN);
        }
    }

    /// The closest point of the surface, for points near it. `None` if there is none near.
    ///
    /// By default Newton's method on y + μ ∇F(y) = x and F(y) = 0, from the projection.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        let closest = closest_from(self, x, self.project(x)?, 0.0)?;
        self.project(closest)
    }

    /// The surface in local coordinates, and where their origin lies. `None` for surfaces that need
    /// none.
    ///
    /// Far from the origin, such as in metres of a map's grid, coordinates have too few digits.
    fn local(&self) -> Option<(Arc<dyn Surface>, DVec3)> {
        None
    }

    /// F and its derivatives for GPUs with f64. Quadrics need none.
    ///
    /// The [local](Self::local) surface is asked for it, and coordinates are local.
    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        None
    }

    /// What is known of the surface besides F.
    fn kind(&self) -> Kind {
        Kind::General
    }

    /// The point over x and y of a surface z = h(x, y), such as terrain. Planar points are lifted
    /// onto it. `None` for other surfaces.
    fn over(&self, _x: f64, _y: f64) -> Option<DVec3> {
        None
    }

    /// Why the surface is undefined at a point of it, such as `lies beyond the grid`. `None` where
    /// it is defined.
    ///
    /// Curves through such a point are infeasible.
    fn undefined(&self, _x: DVec3) -> Option<String> {
        None
    }
}

/// What is known of a surface besides F.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Kind {
    /// Nothing.
    General,
    /// F is of second degree. Curves in quadrics are the fastest.
    Quadric(Quadric),
    /// The points are longitudes and latitudes.
    Globe(Globe),
}

impl Kind {
    /// The quadric, also of a globe.
    pub fn quadric(self) -> Option<Quadric> {
        match self {
            Kind::Quadric(quadric) => Some(quadric),
            Kind::Globe(globe) => Some(globe.surface()),
            Kind::General => None,
        }
    }

    /// The globe.
    pub fn globe(self) -> Option<Globe> {
        if let Kind::Globe(globe) = self { Some(globe) } else { None }
    }
}

/// F and its derivatives in WGSL: what curves in a [`Surface`] need to run on GPUs with f64.
pub trait SurfaceKernel {
    /// The text.
    ///
    /// Its functions are `surface_value(x: vector) -> real`, `surface_gradient(x: vector) ->
    /// vector`, `surface_hessian(x: vector) -> matrix` and `surface_third(x: vector, along: vector)
    /// -> matrix`, as in [`Surface`]. They use the aliases `real`, `vector` and `matrix`, and may
    /// call `outer(a, b)`, the matrix a bᵀ, and `diagonal(a)`, a times the unit matrix. All other
    /// names that the text defines begin with `surface_`, such as `surface_radius`.
    ///
    /// If the surface does not use the defaults of its trait, the text has these functions too:
    ///
    /// - `surface_jet(x: vector) -> SurfaceJet` for [`jet`](Surface::jet). The members of
    ///   `SurfaceJet` are `value: real`, `gradient: vector` and `hessian: matrix`.
    /// - `surface_project(x: vector) -> vector` for [`project`](Surface::project). If there is no
    ///   projection it returns `surface_nowhere(x)`, and the step that led there is refused. If the
    ///   text cannot tell it returns `surface_left(x)`, and the CPU fits the whole curve.
    ///
    /// The text reads the numbers of the [`table`](Self::table) as `surface_table[k]`.
    fn text(&self) -> String;

    /// Numbers for the text, if there are more than a text should hold.
    ///
    /// They are one array for all curves, of type `array<real>`. Whole numbers up to 2⁵³ are exact.
    /// It takes the ninth storage binding of a kernel. Devices that have only eight, or no room for
    /// it in one binding, leave the curves to the CPU.
    fn table(&self) -> Vec<f64> {
        vec![]
    }

    /// The most loop iterations in one call of a function of the text, and in one step of its
    /// projection.
    ///
    /// Software drivers end the loops of a thread after 65,535 iterations in all. The CPU fits
    /// curves that may need as many, and those whose loops were ended.
    fn loop_iterations(&self) -> usize {
        0
    }
}

/// Projects x by Newton steps along ∇F, to rounding of the point and of a size. `slope` gives F and
/// ∇F.
fn projected(slope: impl Fn(DVec3) -> (f64, DVec3), x: DVec3, size: f64) -> Option<DVec3> {
    let mut x = x;
    for _ in 0..MOST_STEPS {
        let (value, gradient) = slope(x);
        let step = -value / gradient.length_squared() * gradient;
        if !step.is_finite() {
            return None;
        }
        x += step;
        if step.length() <= 4.0 * f64::EPSILON * x.abs().max_element().max(size) {
            return Some(x);
        }
    }
    None
}

/// Newton's method on y + μ ∇F(y) = x and F(y) = 0, from a point of the surface, to rounding of the
/// points and of a size.
fn closest_from(surface: &(impl Surface + ?Sized), x: DVec3, start: DVec3, size: f64) -> Option<DVec3> {
    let mut y = start;
    let gradient = surface.gradient(y);
    let mut mu = (x - y).dot(gradient) / gradient.length_squared();
    for _ in 0..MOST_STEPS {
        // (I + μH) dy + ∇F dμ = x − y − μ∇F, ∇F·dy = −F, by elimination of dy.
        let gradient = surface.gradient(y);
        let inverse = (DMat3::IDENTITY + mu * surface.hessian(y)).inverse();
        let (rest, across) = (inverse * (x - y - mu * gradient), inverse * gradient);
        let change = (surface.value(y) + gradient.dot(rest)) / gradient.dot(across);
        let step = rest - change * across;
        if !step.is_finite() {
            return None;
        }
        (y, mu) = (y + step, mu + change);
        if step.length() <= 4.0 * f64::EPSILON * x.abs().max_element().max(y.abs().max_element()).max(size) {
            return Some(y);
        }
    }
    None
}

/// ∇F/|∇F|
pub(crate) fn normal(surface: &dyn Surface, x: DVec3) -> DVec3 {
    surface.gradient(x).normalize()
}

#[cfg(test)]
mod tests;
