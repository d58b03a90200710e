//! An energy of a user's own that is known already.

use faircurve::discrete::{Custom, MOST_EDGES};
use glam::{DMat3, DVec3};

/// Σ ‖T₁ − T₀‖² 2/(s₀ + s₁), which is bending of exponent 2, as a user would write it.
#[derive(Debug)]
pub struct Elastica;

impl Custom for Elastica {
    fn name(&self) -> &str {
        "elastica"
    }

    fn edges(&self) -> usize {
        2
    }

    fn degree(&self) -> f64 {
        -1.0
    }

    fn value(&self, t: &[DVec3], s: &[f64]) -> f64 {
        (t[1] - t[0]).length_squared() * 2.0 / (s[0] + s[1])
    }

    fn gradient(&self, t: &[DVec3], s: &[f64], by_tangent: &mut [DVec3], by_length: &mut [f64]) {
        let (d, r) = (t[1] - t[0], 2.0 / (s[0] + s[1]));
        (by_tangent[0], by_tangent[1]) = (-2.0 * r * d, 2.0 * r * d);
        by_length[..2].fill(-0.5 * r * r * d.length_squared());
    }

    fn hessian(
        &self,
        t: &[DVec3],
        s: &[f64],
        by_tangents: &mut [[DMat3; MOST_EDGES]; MOST_EDGES],
        mixed: &mut [[DVec3; MOST_EDGES]; MOST_EDGES],
        by_lengths: &mut [[f64; MOST_EDGES]; MOST_EDGES],
    ) {
        let (d, r) = (t[1] - t[0], 2.0 / (s[0] + s[1]));
        for j in 0..2 {
            for k in 0..2 {
                by_tangents[j][k] = if j == k { 2.0 * r } else { -2.0 * r } * DMat3::IDENTITY;
                mixed[j][k] = if j == 0 { r * r * d } else { -r * r * d };
                by_lengths[j][k] = 0.5 * r * r * r * d.length_squared();
            }
        }
    }

    fn wgsl(&self) -> Option<String> {
        let text = "
            fn elastica_value(w: Window) -> real {
                let d = w.t1 - w.t0;
                return dot(d, d) * real(2) / (w.s0 + w.s1);
            }

            fn elastica_gradient(w: Window) -> Partials {
                let d = w.t1 - w.t0;
                let r = real(2) / (w.s0 + w.s1);
                var p = Partials();
                p.value = r * dot(d, d);
                p.t1 = (real(2) * r) * d;
                p.t0 = -p.t1;
                p.s0 = real(-0.5) * r * p.value;
                p.s1 = p.s0;
                return p;
            }

            fn elastica_hessian(w: Window) -> SecondPartials {
                let d = w.t1 - w.t0;
                let r = real(2) / (w.s0 + w.s1);
                var h = SecondPartials();
                h.t00 = diagonal(real(2) * r);
                h.t11 = h.t00;
                h.t01 = diagonal(real(-2) * r);
                h.m00 = (r * r) * d;
                h.m01 = h.m00;
                h.m10 = -h.m00;
                h.m11 = h.m10;
                h.s00 = real(0.5) * r * r * r * dot(d, d);
                h.s01 = h.s00;
                h.s11 = h.s00;
                return h;
            }";
        Some(text.to_string())
    }
}
