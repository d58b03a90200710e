//! Samples at equal arc length.

use super::Sampling;
use super::measure::AnyCurve;

/// Sites at equal arc length along a curve.
///
/// The spacing is the largest one not above `spacing` that divides the length evenly.
pub(super) fn even_sites(curve: &dyn AnyCurve, spacing: f64) -> Vec<(usize, f64)> {
    let lengths: Vec<f64> = (0..curve.spans()).map(|span| curve.span_length(span)).collect();
    let mut sites = Vec::new();
    for (span, target) in even_targets(&lengths, spacing, curve.is_closed(), curve.least(Sampling::Spacing(spacing))) {
        sites.push((span, curve.fraction_at(span, lengths[span], target)));
    }
    sites
}

/// `count` sites at equal arc lengths, from the first point of the curve to the last.
pub(super) fn sites(curve: &dyn AnyCurve, count: usize) -> Vec<(usize, f64)> {
    let lengths: Vec<f64> = (0..curve.spans()).map(|span| curve.span_length(span)).collect();
    let steps = if curve.is_closed() { count } else { count.saturating_sub(1) };
    let targets = targets(&lengths, steps, curve.is_closed());
    if targets.is_empty() {
        // A curve that is a point is repeated.
        return vec![(0, 0.0); count];
    }
    targets.into_iter().map(|(span, target)| (span, curve.fraction_at(span, lengths[span], target))).collect()
}

/// The relative error within which a spacing divides a length evenly.
const EVEN: f64 = 1e-9;

/// The span and the length inside it of every sample, from the lengths of all spans. At least
/// `least` samples.
fn even_targets(lengths: &[f64], spacing: f64, closed: bool, least: usize) -> Vec<(usize, f64)> {
    let total: f64 = lengths.iter().sum();
    if total == 0.0 {
        return vec![(0, 0.0); if lengths.is_empty() { 0 } else { least.max(1) }];
    }
    let most = Sampling::MOST_SAMPLES as f64;
    let steps = (total / spacing * (1.0 - EVEN)).ceil().clamp(least.max(1) as f64, most);
    targets(lengths, steps as usize, closed)
}

/// The span and the length inside it at the ends of equal steps.
fn targets(lengths: &[f64], steps: usize, closed: bool) -> Vec<(usize, f64)> {
    let Some(last) = lengths.iter().rposition(|&length| length > 0.0) else { return vec![] };
    let step = lengths.iter().sum::<f64>() / steps as f64;
    let mut targets = Vec::with_capacity(steps + 1);
    let (mut span, mut covered) = (0, 0.0);
    for k in 0..steps {
        let target = k as f64 * step;
        while span < last && target - covered >= lengths[span] {
            covered += lengths[span];
            span += 1;
        }
        targets.push((span, (target - covered).clamp(0.0, lengths[span])));
    }
    if !closed {
        targets.push((last, lengths[last]));
    }
    targets
}
