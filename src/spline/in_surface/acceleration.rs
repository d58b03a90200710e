//! The energy of a cubic piece in a surface: ½ ∫ |P x″|² dt, where P x″ is the part of x″ in the
//! tangent plane.
//!
//! A piece has the positions x, x′ and the velocities v, v′ at its ends, h apart in time. Its cubic
//! has a linear second derivative, from a to a′:
//!
//! ```text
//! a = (6(x′ − x)/h − 4v − 2v′)/h,  a′ = (−6(x′ − x)/h + 2v + 4v′)/h,  (a + a′)/2 = (v′ − v)/h
//! ```
//!
//! Simpson's rule gives the integral, exactly in a plane.

// Loops over unknowns by index match the formulas.
#![allow(clippy::needless_range_loop)]

use glam::{DMat3, DVec3};

use crate::surface::Surface;

/// The unknowns of a piece: position and velocity at both ends.
pub(super) const UNKNOWNS: usize = 4;

/// A node of Simpson's rule: how it, and the second derivative there, depend on the
/// [unknowns](UNKNOWNS).
struct Site {
    /// The weight in the integral.
    weight: f64,
    place: [f64; UNKNOWNS],
    second: [f64; UNKNOWNS],
}

/// The sites of a piece of this length.
fn sites(h: f64) -> [Site; 3] {
    let (one, square) = (1.0 / h, 1.0 / (h * h));
    [
        Site {
            weight: h / 6.0,
            place: [1.0, 0.0, 0.0, 0.0],
            second: [-6.0 * square, -4.0 * one, 6.0 * square, -2.0 * one],
        },
        Site { weight: 2.0 * h / 3.0, place: [0.5, h / 8.0, 0.5, -h / 8.0], second: [0.0, -one, 0.0, one] },
        Site {
            weight: h / 6.0,
            place: [0.0, 0.0, 1.0, 0.0],
            second: [6.0 * square, 2.0 * one, -6.0 * square, 4.0 * one],
        },
    ]
}

/// The second derivatives of a flat piece by the unknowns, the same for every coordinate.
pub(super) fn flat(h: f64) -> [[f64; UNKNOWNS]; UNKNOWNS] {
    let mut flat = [[0.0; UNKNOWNS]; UNKNOWNS];
    for site in sites(h) {
        for (row, a) in flat.iter_mut().zip(site.second) {
            row.iter_mut().zip(site.second).for_each(|(x, b)| *x += site.weight * a * b);
        }
    }
    flat
}

/// n, W = ∇²F/|∇F| and |∇F| at a place.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub normal: DVec3,
    pub shape: DMat3,
    length: f64,
}

impl Frame {
    pub fn at(surface: &dyn Surface, place: DVec3) -> Self {
        let (_, gradient, hessian) = surface.jet(place);
        let length = gradient.length();
        Frame { normal: gradient / length, shape: hessian * (1.0 / length), length }
    }

    /// The part of a vector in the tangent plane.
    pub fn tangential(&self, v: DVec3) -> DVec3 {
        v - v.dot(self.normal) * self.normal
    }

    /// The derivative of ∇²F along a vector, over |∇F|.
    fn third(&self, surface: &dyn Surface, place: DVec3, along: DVec3) -> DMat3 {
        surface.third(place, along) * (1.0 / self.length)
    }

    /// ∇²(n·b) at the place, for a tangent vector b: ∇³F[b]/|∇F| − k wᵀ − w kᵀ with k = W b and w =
    /// W n.
    pub fn turning(&self, surface: &dyn Surface, place: DVec3, b: DVec3) -> DMat3 {
        let (k, w) = (self.shape * b, self.shape * self.normal);
        self.third(surface, place, b) - outer(k, w) - outer(w, k)
    }
}

/// a bᵀ
pub(super) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The energy of a piece and its derivatives by the unknowns.
pub(super) fn gradient(surface: &dyn Surface, unknowns: &[DVec3; UNKNOWNS], h: f64) -> (f64, [DVec3; UNKNOWNS]) {
    let (mut value, mut by) = (0.0, [DVec3::ZERO; UNKNOWNS]);
    for site in sites(h) {
        let (y, a) = (combine(&site.place, unknowns), combine(&site.second, unknowns));
        let frame = Frame::at(surface, y);
        // ½ (|a|² − q²) with q = n·a: ∇q = W b, b = a − q n.
        let q = frame.normal.dot(a);
        let b = a - q * frame.normal;
        let k = frame.shape * b;
        value += 0.5 * site.weight * b.length_squared();
        for j in 0..UNKNOWNS {
            by[j] += site.weight * (site.second[j] * b - site.place[j] * q * k);
        }
    }
    (value, by)
}

/// The second derivatives of the energy of a piece by the unknowns.
pub(super) fn hessian(surface: &dyn Surface, unknowns: &[DVec3; UNKNOWNS], h: f64) -> [[DMat3; UNKNOWNS]; UNKNOWNS] {
    let mut hessian = [[DMat3::ZERO; UNKNOWNS]; UNKNOWNS];
    for site in sites(h) {
        let (y, a) = (combine(&site.place, unknowns), combine(&site.second, unknowns));
        let frame = Frame::at(surface, y);
        let (n, shape) = (frame.normal, frame.shape);
        let q = n.dot(a);
        let b = a - q * n;
        let (k, w) = (shape * b, shape * n);
        let by_second = DMat3::IDENTITY - outer(n, n);
        // ∂b/∂y = −(n kᵀ + q P W)
        let mixed = -(outer(n, k) + q * (shape - outer(n, w)));
        let curved = frame.turning(surface, y, b) - q * (shape * shape - outer(w, w));
        let by_place = -(outer(k, k) + q * curved);
        for i in 0..UNKNOWNS {
            for j in 0..UNKNOWNS {
                let [pi, pj, si, sj] = [site.place[i], site.place[j], site.second[i], site.second[j]];
                hessian[i][j] += site.weight
                    * (pi * pj * by_place + si * sj * by_second + si * pj * mixed + pi * sj * mixed.transpose());
            }
        }
    }
    hessian
}

fn combine(factors: &[f64; UNKNOWNS], unknowns: &[DVec3; UNKNOWNS]) -> DVec3 {
    factors.iter().zip(unknowns).map(|(factor, unknown)| *factor * *unknown).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Quadric, Torus};

    #[test]
    fn derivatives_are_those_of_differences() {
        let surfaces: [Box<dyn Surface>; 2] =
            [Box::new(Quadric::ellipsoid(DVec3::new(3.0, 2.0, 1.0))), Box::new(Torus::new(2.0, 1.0).unwrap())];
        for surface in surfaces {
            let at = DVec3::new;
            let own = [at(1.9, 1.4, 0.5), at(0.3, -0.5, 0.2), at(2.2, 1.1, 0.3), at(0.6, 0.1, -0.4)];
            let (h, step) = (0.7, 1e-5);
            let (_, by) = gradient(&*surface, &own, h);
            let second = hessian(&*surface, &own, h);
            let size = by.iter().map(|by| by.length()).fold(0.0, f64::max);
            for j in 0..UNKNOWNS {
                for c in 0..3 {
                    let moved = |sign: f64| {
                        let mut moved = own;
                        moved[j][c] += sign * step;
                        gradient(&*surface, &moved, h)
                    };
                    let ((above, after), (below, before)) = (moved(1.0), moved(-1.0));
                    assert!(((above - below) / (2.0 * step) - by[j][c]).abs() < 1e-8 * size, "{j} {c}");
                    for i in 0..UNKNOWNS {
                        let slope = (after[i] - before[i]) / (2.0 * step);
                        let error = (slope - second[i][j].col(c)).length();
                        assert!(error < 1e-7 * size, "{i} {j} {c}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn in_a_plane_the_energy_of_a_cubic_is_exact() {
        let plane = Quadric::plane(DVec3::Z, 0.0);
        // x = t³, y = t² − t: x″ = 6t, y″ = 2.
        let h = 1.5;
        let own = [
            DVec3::ZERO,
            DVec3::new(0.0, -1.0, 0.0),
            DVec3::new(h * h * h, h * h - h, 0.0),
            DVec3::new(3.0 * h * h, 2.0 * h - 1.0, 0.0),
        ];
        let (energy, _) = gradient(&plane, &own, h);
        assert!((energy - (6.0 * h * h * h + 2.0 * h)).abs() < 1e-13 * energy);
    }
}
