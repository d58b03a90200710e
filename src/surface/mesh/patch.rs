//! [`Patch`]: a mesh's surface near one of its vertices.

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};

use super::jet::{Jet, both, outer};

/// Unknowns of a fit: 2 slopes, 3 curvatures, 4 of third order.
const MOST: usize = 9;

/// Unknowns with the least number of points for them.
const UNKNOWNS: [[usize; 2]; 2] = [[9, 12], [5, 6]];

/// Points at a distance d count by 1/(NEAR + d²/r²). From 0.02 to 1 errors differ little.
const NEAR: f64 = 0.1;

/// Pivots below this part of their diagonal are of singular systems.
const SINGULAR: f64 = 1e-8;

/// F = r φ(s) with s = (x − p)/r, and its weight (1 − |s|²)⁴ where |s| < 1.
///
/// φ = g·s + ½ sᵀS s + ⅙ (a u³ + 3 b u²v + 3 c uv² + d v³), where u and v are along the tangent
/// plane.
#[derive(Clone, Debug)]
pub struct Patch {
    /// p
    pub place: DVec3,
    /// r
    pub reach: f64,
    /// g, a unit vector.
    pub normal: DVec3,
    bend: DMat3,
    axes: [DVec3; 2],
    cubic: [f64; 4],
}

impl Patch {
    /// The plane of a normal.
    pub fn flat(place: DVec3, reach: f64, normal: DVec3) -> Self {
        Patch { place, reach, normal, bend: DMat3::ZERO, axes: [DVec3::ZERO; 2], cubic: [0.0; 4] }
    }

    /// Least squares through points around.
    ///
    /// Heights z over the plane of the normal are −z = b·(u, v) + ½ (k u² + 2 l uv + m v² + ½ (k +
    /// m) z²) + cubic terms. The term of z² makes every sphere a solution.
    pub fn fitted(self, around: &[DVec3]) -> Self {
        // The second time over the plane of the normal that the first has found.
        let fit = |patch: &Self| {
            UNKNOWNS
                .into_iter()
                .find_map(|[unknowns, least]| (around.len() >= least).then(|| patch.fit(around, unknowns))?)
        };
        let Some(first) = fit(&self) else { return self };
        fit(&first).unwrap_or(self)
    }

    fn fit(&self, around: &[DVec3], unknowns: usize) -> Option<Self> {
        let n = self.normal;
        let (e, f) = n.any_orthonormal_pair();
        let mut normal = [[0.0; MOST]; MOST];
        let mut right = [0.0; MOST];
        for &x in around {
            let s = (x - self.place) / self.reach;
            let (u, v, z) = (s.dot(e), s.dot(f), s.dot(n));
            let row = [
                u,
                v,
                0.5 * (u * u + 0.5 * z * z),
                u * v,
                0.5 * (v * v + 0.5 * z * z),
                u * u * u / 6.0,
                0.5 * u * u * v,
                0.5 * u * v * v,
                v * v * v / 6.0,
            ];
            let weight = 1.0 / (NEAR + s.length_squared());
            for i in 0..unknowns {
                right[i] -= weight * row[i] * z;
                for j in 0..=i {
                    normal[i][j] += weight * row[i] * row[j];
                }
            }
        }
        let x = solved(&normal, &right, unknowns)?;
        let gradient = n + x[0] * e + x[1] * f;
        let unit = 1.0 / gradient.length();
        let mean = 0.5 * (x[2] + x[4]);
        let bend = x[2] * outer(e, e) + x[3] * both(e, f) + x[4] * outer(f, f) + mean * outer(n, n);
        let patch = Patch {
            normal: gradient * unit,
            bend: bend * unit,
            axes: [e, f],
            cubic: [5, 6, 7, 8].map(|k| x[k] * unit),
            ..*self
        };
        (patch.normal.is_finite() && patch.bend.is_finite() && patch.normal.dot(n) > 0.5).then_some(patch)
    }

    /// How many numbers kernels get.
    pub const NUMBERS: usize = 23;

    /// p, r, g, the columns of S from the diagonal on, u and v, and the cubic.
    pub fn numbers(&self) -> Vec<f64> {
        let [first, second, third] = self.bend.to_cols_array_2d();
        let [e, f] = self.axes.map(|axis| axis.to_array());
        let (place, normal) = (self.place.to_array(), self.normal.to_array());
        [&place[..], &[self.reach], &normal, &first, &second[1..], &third[2..], &e, &f, &self.cubic].concat()
    }

    /// The weight and F at a point, with derivatives up to an order. `None` beyond the reach.
    pub fn jets<const ORDER: u8>(&self, x: DVec3, along: DVec3) -> Option<(Jet, Jet)> {
        let scale = 1.0 / self.reach;
        let s = (x - self.place) * scale;
        let rest = 1.0 - s.length_squared();
        // Not where the reach is 0.
        if rest.is_nan() || rest <= 0.0 {
            return None;
        }
        let bent = self.bend * s;
        let [u, v] = self.axes.map(|axis| axis.dot(s));
        let [a, b, c, d] = self.cubic;
        // Half of the second derivatives along s.
        let [uu, uv, vv] = [a * u + b * v, b * u + c * v, c * u + d * v];
        let [by_u, by_v] = [0.5 * (uu * u + uv * v), 0.5 * (uv * u + vv * v)];
        let square = rest * rest;
        let mut weight = Jet { value: square * square, ..Jet::ZERO };
        let value = self.normal.dot(s) + 0.5 * s.dot(bent) + (by_u * u + by_v * v) / 3.0;
        let mut own = Jet { value: self.reach * value, ..Jet::ZERO };
        if ORDER == 0 {
            return Some((weight, own));
        }
        let [e, f] = self.axes;
        weight.gradient = -8.0 * square * rest * scale * s;
        own.gradient = self.normal + bent + by_u * e + by_v * f;
        if ORDER == 1 {
            return Some((weight, own));
        }
        let form = |uu: f64, uv: f64, vv: f64| uu * outer(e, e) + uv * both(e, f) + vv * outer(f, f);
        let ss = outer(s, s);
        weight.hessian = (48.0 * square * ss - 8.0 * square * rest * DMat3::IDENTITY) * (scale * scale);
        own.hessian = (self.bend + form(uu, uv, vv)) * scale;
        if ORDER == 2 {
            return Some((weight, own));
        }
        let along = along * scale;
        let on = s.dot(along);
        let turn = both(s, along) + on * DMat3::IDENTITY;
        weight.third = (-192.0 * rest * on * ss + 48.0 * square * turn) * (scale * scale);
        let [u, v] = self.axes.map(|axis| axis.dot(along));
        own.third = form(a * u + b * v, b * u + c * v, c * u + d * v) * scale;
        Some((weight, own))
    }
}

/// A x = b by Cholesky's method, from the lower triangle of A, whose diagonal is scaled to 1.
///
/// `None` if A is singular.
fn solved(a: &[[f64; MOST]; MOST], b: &[f64; MOST], count: usize) -> Option<[f64; MOST]> {
    let scales = DVector::from_fn(count, |i, _| 1.0 / a[i][i].sqrt());
    let scaled = DMatrix::from_fn(count, count, |i, j| a[i.max(j)][i.min(j)] * scales[i] * scales[j]);
    let cholesky = scaled.cholesky()?;
    if cholesky.l_dirty().diagonal().iter().any(|root| root * root <= SINGULAR) {
        return None;
    }
    let x = cholesky.solve(&DVector::from_fn(count, |i, _| b[i] * scales[i])).component_mul(&scales);
    Some(std::array::from_fn(|i| if i < count { x[i] } else { 0.0 }))
}
