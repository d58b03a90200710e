//! Samples of a curve: how many there are at least, their sites, and their coordinates.

use super::measure::AnyCurve;
use super::{Curve, Sampling, even, few};

/// See [`Curve::least`](super::Curve::least).
pub(super) fn least(curve: &dyn AnyCurve, sampling: Sampling) -> usize {
    // Four or more samples per span suffice.
    if !curve.is_closed() || matches!(sampling, Sampling::PerSpan(4..)) {
        return 0;
    }
    let ends_differ = |span: &usize| curve.jet(*span, 0.0).point != curve.jet(*span, 1.0).point;
    let long = (0..curve.spans()).filter(ends_differ).take(4).count();
    let all: usize = match long {
        // A point has no area.
        0 => return 0,
        1 | 2 => 4,
        _ => 3,
    };
    match sampling {
        Sampling::PerSpan(_) => all.div_ceil(long),
        // Spans between equal points may take up parameters, so samples within the other spans are
        // needed.
        Sampling::Count(_) if all > 3 => 2 * curve.spans(),
        _ => all,
    }
}

/// See [`Curve::sites`](super::Curve::sites).
pub(super) fn sites(curve: &dyn AnyCurve, sampling: Sampling) -> Vec<(usize, f64)> {
    let spans = curve.spans();
    let end = (!curve.is_closed() && spans > 0).then(|| (spans - 1, 1.0));
    match sampling {
        Sampling::PerSpan(n) => {
            let n = n.max(curve.least(sampling));
            (0..spans).flat_map(|span| (0..n).map(move |k| (span, k as f64 / n as f64))).chain(end).collect()
        }
        Sampling::Count(n) => {
            let (from, to) = curve.domain();
            let n = n.max(curve.least(sampling));
            let steps = if curve.is_closed() { n } else { n.saturating_sub(1) }.max(1) as f64;
            (0..n).map(|k| curve.locate(from + (to - from) * (k as f64 / steps))).collect()
        }
        Sampling::Points(n) => even::sites(curve, n.max(curve.least(sampling))),
        Sampling::Spacing(spacing) => even::even_sites(curve, spacing),
        Sampling::Tolerance(tolerance) | Sampling::AsMany(tolerance) => {
            let least = curve.least(sampling);
            let few = match sampling {
                Sampling::AsMany(_) => few::sites_as_many(curve, tolerance, least),
                _ => few::sites(curve, tolerance, least),
            };
            if few.is_empty() { sites(curve, Sampling::PerSpan(least)) } else { few }
        }
    }
}

/// Coordinates and parameters of a curve at sites. `taken` has the coordinates if they are known.
pub(crate) fn samples_at(curve: &impl Curve, sites: &[(usize, f64)], taken: Option<&[f64]>) -> (Vec<f64>, Vec<f64>) {
    let (d, knots) = (curve.dimension(), curve.knots());
    let mut coords = Vec::with_capacity(sites.len() * d);
    coords.extend_from_slice(taken.unwrap_or_default());
    let mut t = Vec::with_capacity(sites.len());
    for &(span, u) in sites {
        if taken.is_none() {
            coords.extend_from_slice(&curve.jet(span, u).point.to_array()[..d]);
        }
        let (from, to) = (knots[span], knots[span + 1]);
        t.push((from + u * (to - from)).min(to));
    }
    (coords, t)
}
