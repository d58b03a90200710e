//! Curvature combs: quills across a curve, as long as the curvature there.

use super::layout::Plane;
use crate::curve::Jet;
use crate::parallel;
use crate::report::Fit;
use glam::{DVec2, DVec3};

/// The length of the quill for the 95 % quantile of |κ|, as a fraction of the larger side of the
/// data, for up to [`ROOMY`] curves.
const QUILL: f64 = 0.04;

/// With more curves than this, quills shrink with the square root of their number.
const ROOMY: f64 = 20.0;

/// The most that a quill may exceed the quantile's. Cusps and kinks would leave the page.
const CLAMP: f64 = 3.0;

/// The quantile of |κ| that sets the scale.
const QUANTILE: f64 = 0.95;

/// The approximate number of quills in a picture. More could not be distinguished.
const MOST_QUILLS: usize = 60_000;

/// The start and the end of each quill of a curve, in the plane of the picture.
///
/// `None` breaks the envelope.
pub(super) type Quills = Vec<Option<(DVec2, DVec2)>>;

/// The combs of a picture.
pub(super) struct Combs {
    /// One comb per curve, empty if the curve was not fitted.
    pub curves: Vec<Quills>,
    /// The 95 % quantile of |κ|, in 1/length.
    pub curvature: f64,
}

impl Combs {
    /// Combs for the usable curves. `size` is the larger side of the data.
    ///
    /// Quills point away from the centre of curvature, so the comb changes sides at an inflection.
    pub fn of(fit: &Fit, plane: &Plane, size: f64, scale: f64) -> Self {
        let spans: usize = (0..fit.len()).map(|i| fit.curve(i).spans()).sum();
        let per_span = (MOST_QUILLS / spans.max(1)).clamp(1, 32);
        let every = spans.div_ceil(MOST_QUILLS).max(1);
        let roots: Vec<Vec<Option<(DVec3, DVec3)>>> = parallel::map(fit.len(), 1, |i| roots(fit, i, per_span, every));
        let mut sizes: Vec<f64> = roots.iter().flatten().flatten().map(|(_, k)| k.length()).collect();
        sizes.retain(|k| k.is_finite() && *k > 0.0);
        let curvature = if sizes.is_empty() {
            0.0
        } else {
            let rank = ((sizes.len() - 1) as f64 * QUANTILE).round() as usize;
            *sizes.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        let quill = QUILL * size * (ROOMY / fit.len() as f64).sqrt().min(1.0);
        let unit = if curvature > 0.0 { scale * quill / curvature } else { 0.0 };
        let longest = CLAMP * quill * scale.max(1.0);
        let drawn = |(point, curvature): (DVec3, DVec3)| {
            let root = plane.project(point)?;
            let quill = plane.vector(-curvature * unit);
            let quill = quill.is_finite().then(|| quill.clamp_length_max(longest))?;
            Some((root, root + quill))
        };
        let curves = parallel::of(roots, |roots| roots.into_iter().map(|root| drawn(root?)).collect());
        Combs { curves, curvature }
    }
}

/// Points of a curve with the curvature vector there, on one span out of `every`.
fn roots(fit: &Fit, i: usize, per_span: usize, every: usize) -> Vec<Option<(DVec3, DVec3)>> {
    let curve = fit.curve(i);
    if !curve.is_fitted() || !fit.reports()[i].status.is_usable() {
        return Vec::new();
    }
    let spans = curve.spans();
    let end = (spans > 0).then(|| (spans - 1, 1.0));
    (0..spans)
        .step_by(every)
        .flat_map(|span| (0..per_span).map(move |k| (span, k as f64 / per_span as f64)))
        .chain(end)
        .map(|(span, u)| {
            let jet = curve.jet(span, u);
            curvature_vector(&jet).map(|k| (jet.point, k))
        })
        .collect()
}

/// (p″ − (p″·T)T) / |p′|², the vector of length |κ| towards the centre of curvature.
///
/// `None` if p′ vanishes.
fn curvature_vector(jet: &Jet) -> Option<DVec3> {
    let tangent = jet.first.try_normalize()?;
    let across = jet.second - tangent * jet.second.dot(tangent);
    Some(across / jet.first.length_squared()).filter(|k| k.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curvature_vector_of_a_circle_points_to_its_centre_with_length_one_over_the_radius() {
        let (radius, angle, speed) = (2.5f64, 0.7f64, 3.0);
        let (sin, cos) = angle.sin_cos();
        let out = DVec3::new(cos, sin, 0.0);
        let first = DVec3::new(-sin, cos, 0.0) * radius * speed;
        // This parametrisation also speeds up. The tangential part must not count.
        let second = -out * radius * speed * speed + first * 4.0;
        let k = curvature_vector(&Jet { point: out * radius, first, second, third: DVec3::ZERO }).unwrap();
        assert!((k + out / radius).length() < 1e-14, "{k}");
        assert_eq!(curvature_vector(&Jet { second, ..Jet::default() }), None);
    }
}
