//! Arc length of smooth spans, and its inverse: Gauss–Legendre quadrature with halving, then safeguarded Newton steps.

use crate::curve::Curve;

/// Nodes and weights of the 8-point Gauss–Legendre rule on (−1, 1), positive half (Abramowitz & Stegun, table 25.4).
const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Relative change at which halving a span stops. The rule is of order 16, so the halves are far closer than this.
const TOLERANCE: f64 = 1e-9;

/// At a cusp the speed is only |u|: halving gains a factor of four a level, and 16 levels reach rounding.
const MAX_HALVINGS: u32 = 16;

fn gauss(speed: &dyn Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * GAUSS_8
        .iter()
        .map(|(node, weight)| weight * (speed(middle - half * node) + speed(middle + half * node)))
        .sum::<f64>()
}

fn adaptive(speed: &dyn Fn(f64) -> f64, (from, to): (f64, f64), whole: f64, scale: f64, halvings: u32) -> f64 {
    let middle = 0.5 * (from + to);
    let (left, right) = (gauss(speed, from, middle), gauss(speed, middle, to));
    // NaN ends the recursion too: no comparison with it is true.
    let refine = (left + right - whole).abs() > TOLERANCE * scale;
    if halvings == 0 || !refine {
        return left + right;
    }
    adaptive(speed, (from, middle), left, scale, halvings - 1)
        + adaptive(speed, (middle, to), right, scale, halvings - 1)
}

/// ∫ speed(u) du over the fractions `from … to` of a span.
fn partial_length(speed: &dyn Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let whole = gauss(speed, from, to);
    adaptive(speed, (from, to), whole, whole, MAX_HALVINGS)
}

/// Length of a span from |dp/du| at its fractions 0 … 1.
pub fn span_length(speed: &dyn Fn(f64) -> f64) -> f64 {
    partial_length(speed, 0.0, 1.0)
}

/// The fraction of a span of length `length` at which `target` of it has been covered.
pub fn fraction_at(speed: &dyn Fn(f64) -> f64, length: f64, target: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let mut u = target / length;
    for _ in 0..60 {
        let excess = partial_length(speed, 0.0, u) - target;
        if excess.abs() <= TOLERANCE * length {
            break;
        }
        if excess > 0.0 {
            high = u
        } else {
            low = u
        }
        let newton = u - excess / speed(u);
        // Newton where it stays inside the bracket, bisection where it does not (near a cusp).
        u = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    u
}

/// Sites at equal arc length along a curve: the largest spacing not above `spacing` that divides the length evenly.
pub(crate) fn even_sites<C: Curve + ?Sized>(curve: &C, spacing: f64) -> Vec<(usize, f64)> {
    let lengths: Vec<f64> = (0..curve.spans()).map(|span| span_length(&|u| curve.speed(span, u))).collect();
    let mut sites = Vec::new();
    for (span, target) in even_targets(&lengths, spacing, curve.is_closed()) {
        let u = fraction_at(&|u| curve.speed(span, u), lengths[span], target);
        sites.push((span, u));
    }
    sites
}

/// The most samples by spacing a single curve may ask for: more is a spacing in the wrong unit, not a wish.
pub const MAX_SAMPLES: f64 = 1e8;

/// For every sample its span and the length to cover inside it, from the lengths of all spans.
pub(crate) fn even_targets(lengths: &[f64], spacing: f64, closed: bool) -> Vec<(usize, f64)> {
    let total: f64 = lengths.iter().sum();
    let Some(last) = lengths.iter().rposition(|&length| length > 0.0) else {
        return vec![(0, 0.0); usize::from(!lengths.is_empty())];
    };
    let steps = (total / spacing * (1.0 - TOLERANCE)).ceil().clamp(1.0, MAX_SAMPLES);
    let step = total / steps;
    let mut targets = Vec::with_capacity(steps as usize + 1);
    let (mut span, mut covered) = (0, 0.0);
    for k in 0..steps as usize {
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
