//! [`Surface`]: regular surfaces F(x) = 0 that curves lie in.
//!
//! [`Fair::surface`](crate::discrete::Fair::surface) keeps every vertex of a curve in one. What a surface says of itself
//! is F with its derivatives. The unit normal is n = ∇F/|∇F|, and the scale of F does not count.
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

/// Steps that lead to a foot from wherever the curve's descent has gone.
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
pub trait Surface: Debug + Send + Sync {
    /// What it is, for messages, such as `the sphere of radius 1`.
    fn name(&self) -> String;

    /// F at x, of any scale.
    fn value(&self, x: DVec3) -> f64;

    /// ∇F at x.
    fn gradient(&self, x: DVec3) -> DVec3;

    /// The second derivatives of F at x.
    fn hessian(&self, x: DVec3) -> DMat3;

    /// The derivative of the Hessian at x in a direction.
    ///
    /// By default the central difference of Hessians. Newton's method takes it where curves bend in the surface.
    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        let length = along.length();
        if length == 0.0 {
            return DMat3::ZERO;
        }
        let h = DIFFERENCE * x.length().max(1.0);
        let step = h / length * along;
        (self.hessian(x + step) - self.hessian(x - step)) * (0.5 * length / h)
    }

    /// F, ∇F and the second derivatives at x at once, for surfaces that find them together in less time.
    fn jet(&self, x: DVec3) -> (f64, DVec3, DMat3) {
        (self.value(x), self.gradient(x), self.hessian(x))
    }

    /// A point of the surface near x: where the way along ∇F ends. `None` if it leads nowhere.
    ///
    /// It is the closest point to second order in the distance.
    fn foot(&self, x: DVec3) -> Option<DVec3> {
        below(self, x, 0.0)
    }

    /// The feet of many points at once, for surfaces that find them together in less time. A point that has none becomes NaN.
    fn feet(&self, points: &mut [DVec3]) {
        points.iter_mut().for_each(|x| *x = self.foot(*x).unwrap_or(DVec3::NAN));
    }

    /// The closest point of the surface, for points near it. `None` if there is none near.
    ///
    /// By default Newton's method on y + μ ∇F(y) = x and F(y) = 0, from the foot.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        let closest = straight_below(self, x, self.foot(x)?, 0.0)?;
        self.foot(closest)
    }

    /// The surface in coordinates of its own, and where their origin lies. `None` for surfaces that need none.
    ///
    /// Far from the origin, such as in metres of a map's grid, the digits of a coordinate are no longer those of the surface.
    fn local(&self) -> Option<(Arc<dyn Surface>, DVec3)> {
        None
    }

    /// F and its derivatives in WGSL, if curves in the surface are to run on GPUs with f64. Quadrics have no need of it.
    ///
    /// The functions are `surface_value(x: vector) -> real`, `surface_gradient(x: vector) -> vector`,
    /// `surface_hessian(x: vector) -> matrix` and `surface_third(x: vector, along: vector) -> matrix`, as those of this trait. They use
    /// the aliases `real`, `vector` and `matrix`, and may call `outer(a, b)`, the matrix a bᵀ, and `diagonal(a)`, a times the unit
    /// matrix. Everything else that the text defines needs a name of its own, such as `surface_radius`.
    ///
    /// Where this trait's defaults are not used, the text has these functions too:
    ///
    /// - `surface_jet(x: vector) -> SurfaceJet` for [`jet`](Self::jet). The members of `SurfaceJet` are `value: real`,
    ///   `gradient: vector` and `hessian: matrix`.
    /// - `surface_foot(x: vector) -> vector` for [`foot`](Self::foot). Where there is none it returns `surface_nowhere(x)`, and the
    ///   step that led there is refused. Where the text cannot tell it returns `surface_left(x)`, and the whole curve is left to
    ///   the CPU.
    ///
    /// The [local](Self::local) surface is asked for the text, and coordinates are its own. The text reads the numbers of
    /// [`wgsl_table`](Self::wgsl_table) as `surface_table[k]`.
    fn wgsl(&self) -> Option<String> {
        None
    }

    /// The numbers that the [text](Self::wgsl) reads, for surfaces of more numbers than a text should hold.
    ///
    /// They are one array for all curves, of type `array<real>`. Whole numbers up to 2⁵³ are exact. It takes the ninth storage
    /// binding of a kernel. Devices that have only eight, or no room for it in one binding, leave the curves to the CPU.
    fn wgsl_table(&self) -> Vec<f64> {
        vec![]
    }

    /// How often loops turn in one call of a function of the [text](Self::wgsl), and in one step of its foot, at the most.
    ///
    /// Drivers of software end the loops of a thread after 65,535 turns in all. Curves that may need as many at once, and
    /// those whose loops were ended, are left to the CPU.
    fn wgsl_turns(&self) -> usize {
        0
    }

    /// The surface as a quadric, if it is one. Curves in quadrics are the fastest.
    fn quadric(&self) -> Option<Quadric> {
        None
    }

    /// The point of the surface over x and y, where planar points name one, as on terrain. `None` for other surfaces.
    fn over(&self, _x: f64, _y: f64) -> Option<DVec3> {
        None
    }

    /// The globe that the surface is, if its points are longitudes and latitudes.
    fn globe(&self) -> Option<Globe> {
        None
    }

    /// Why the surface is not known at a point of it, such as `lies beyond the grid`. `None` where it is known.
    ///
    /// Curves that end at such a point are not taken as fitted.
    fn unknown(&self, _x: DVec3) -> Option<String> {
        None
    }
}

/// Where the way along ∇F from a point ends. F is computed to rounding of the point and of a size.
fn below(surface: &(impl Surface + ?Sized), x: DVec3, size: f64) -> Option<DVec3> {
    way_down(|x| (surface.value(x), surface.gradient(x)), x, size)
}

/// [`below`], of F and ∇F at a point.
fn way_down(slope: impl Fn(DVec3) -> (f64, DVec3), x: DVec3, size: f64) -> Option<DVec3> {
    let mut foot = x;
    for _ in 0..MOST_STEPS {
        let (value, gradient) = slope(foot);
        let step = -value / gradient.length_squared() * gradient;
        if !step.is_finite() {
            return None;
        }
        foot += step;
        if step.length() <= 4.0 * f64::EPSILON * foot.abs().max_element().max(size) {
            return Some(foot);
        }
    }
    None
}

/// Newton's method on y + μ ∇F(y) = x and F(y) = 0, from a point of the surface, to rounding of the points and of a size.
fn straight_below(surface: &(impl Surface + ?Sized), x: DVec3, start: DVec3, size: f64) -> Option<DVec3> {
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
