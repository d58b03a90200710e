//! The sides to which curves turn, by the signs of curvature at dense samples.

use faircurve::Fit;

/// Samples a span.
const DENSE: usize = 100;

type Planar = [f64; 2];

/// The side to which the polygon turns at every point, 0 where it is straight; ends of open curves have none.
pub fn turns(points: &[Planar], closed: bool) -> Vec<Option<f64>> {
    let n = points.len();
    let unit = |from: Planar, to: Planar| {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
    };
    let turn = |k: usize| {
        if !closed && (k == 0 || k + 1 == n) {
            return None;
        }
        let (before, after) = (unit(points[(k + n - 1) % n], points[k]), unit(points[k], points[(k + 1) % n]));
        let sine = before[0] * after[1] - before[1] * after[0];
        Some(if sine.abs() < 1e-9 { 0.0 } else { sine.signum() })
    };
    (0..n).map(turn).collect()
}

/// How often a curve breaks the shape of its points, by the signs of curvature at dense samples: spans that turn to the
/// other side, points that do, and spans of one inflection that have more.
///
/// Curvature times the mean chord of `least` or less is none.
pub fn breaks(fit: &Fit, i: usize, points: &[Planar], closed: bool, least: f64) -> usize {
    let (curve, turns, n) = (fit.curve(i), turns(points, closed), points.len());
    let spans = if closed { n } else { n - 1 };
    let chord = |k: usize| (points[(k + 1) % n][0] - points[k][0]).hypot(points[(k + 1) % n][1] - points[k][1]);
    let mean = (0..spans).map(chord).sum::<f64>() / spans as f64;
    let mut count = 0;
    // A span between repeated points is one itself.
    for span in (0..spans).filter(|&span| curve.span_length(span) > 0.0) {
        let side = |u: f64| {
            let jet = curve.jet(span, u);
            let bent = jet.first.cross(jet.second).z / jet.first.length().powi(3) * mean;
            assert!(bent.is_finite(), "curve {i}, span {span}: curvature {bent} at {u}");
            if bent.abs() <= least { 0.0 } else { bent.signum() }
        };
        let ends = [turns[span], turns[(span + 1) % n]];
        for (end, u) in ends.iter().zip([0.0, 1.0]) {
            count += usize::from(end.is_some_and(|end| side(u) * end < 0.0));
        }
        let within: Vec<f64> = (0..=DENSE).map(|k| side(k as f64 / DENSE as f64)).filter(|side| *side != 0.0).collect();
        let wanted = match ends {
            [Some(a), Some(b)] if a == b => a,
            [Some(a), None] | [None, Some(a)] => a,
            [Some(a), Some(b)] if a * b < 0.0 => {
                let changes = within.windows(2).filter(|pair| pair[0] != pair[1]).count();
                count += usize::from(changes > 1);
                continue;
            }
            _ => continue,
        };
        count += usize::from(wanted != 0.0 && within.iter().any(|side| *side != wanted));
    }
    count
}
