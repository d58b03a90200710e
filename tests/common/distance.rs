//! How far a curve and its Béziers are apart, both ways, measured from points to nearest points:
//! nothing of it is shared with the conversion.

use faircurve::Curve;
use glam::DVec3;

/// A cubic Bézier at v, by Bernstein's polynomials.
pub fn point(p: &[DVec3; 4], v: f64) -> DVec3 {
    let w = 1.0 - v;
    p[0] * (w * w * w) + p[1] * (3.0 * w * w * v) + p[2] * (3.0 * w * v * v) + p[3] * (v * v * v)
}

/// The largest distance from points to a path at(0 … 1): to the nearest of `count` + 1 samples, and
/// from there, and from all that are nearer than their neighbours, to the nearest point by golden
/// section. Distances up to `floor` are not looked at.
fn directed(points: &[DVec3], at: &dyn Fn(f64) -> DVec3, count: usize, floor: f64) -> f64 {
    let samples: Vec<DVec3> = (0..=count).map(|k| at(k as f64 / count as f64)).collect();
    let refined = |p: DVec3, k: usize| {
        let (mut a, mut b) = (k.saturating_sub(1) as f64 / count as f64, (k + 1).min(count) as f64 / count as f64);
        for _ in 0..40 {
            let (c, d) = (a + 0.381966 * (b - a), b - 0.381966 * (b - a));
            if at(c).distance_squared(p) < at(d).distance_squared(p) { b = d } else { a = c }
        }
        at(0.5 * (a + b)).distance(p).min(samples[k].distance(p))
    };
    let mut worst = floor;
    for &p in points {
        let near: Vec<f64> = samples.iter().map(|q| q.distance(p)).collect();
        let least =
            |k: usize| (k == 0 || near[k] <= near[k - 1]) && near.get(k + 1).is_none_or(|after| near[k] <= *after);
        let nearest = (0..=count).min_by(|&a, &b| near[a].total_cmp(&near[b])).unwrap_or(0);
        if near[nearest] > worst && refined(p, nearest) > worst {
            // Where a path comes near itself, the nearest sample need not be beside the nearest
            // point.
            let all = (0..=count).filter(|&k| least(k)).map(|k| refined(p, k));
            worst = worst.max(all.fold(f64::INFINITY, f64::min));
        }
    }
    worst
}

/// The pieces of every span of a curve; spans between repeated points have none.
pub fn by_span<'a>(curve: &dyn Curve, pieces: &'a [[DVec3; 4]]) -> Vec<&'a [[DVec3; 4]]> {
    let (mut spans, mut rest) = (Vec::new(), pieces);
    for span in 0..curve.spans() {
        let end = curve.jet(span, 1.0).point;
        let moves = (0..=8).any(|k| curve.jet(span, f64::from(k) / 8.0).point != end);
        let joint = |piece: &[DVec3; 4]| piece[3].distance(end) <= 1e-14 * (end.length() + piece[0].length());
        let count = if moves { 1 + rest.iter().position(joint).expect("a joint at every data point") } else { 0 };
        let (own, after) = rest.split_at(count);
        spans.push(own);
        rest = after;
    }
    assert!(rest.is_empty(), "{} pieces beyond the last data point", rest.len());
    spans
}

/// The largest distance between a curve and its Béziers, measured at `count` places a span and
/// more; `floor` where it is less.
pub fn deviation(curve: &dyn Curve, pieces: &[[DVec3; 4]], count: usize, floor: f64) -> f64 {
    let mut worst = floor;
    for (span, own) in by_span(curve, pieces).into_iter().enumerate().filter(|(_, own)| !own.is_empty()) {
        let chain = |t: f64| {
            let place = t * own.len() as f64;
            let k = (place as usize).min(own.len() - 1);
            point(&own[k], place - k as f64)
        };
        let fitted = |u: f64| curve.jet(span, u).point;
        let steps = count.max(16 * own.len());
        let samples =
            |at: &dyn Fn(f64) -> DVec3| -> Vec<DVec3> { (0..=steps).map(|k| at(k as f64 / steps as f64)).collect() };
        worst = directed(&samples(&fitted), &chain, steps, worst);
        worst = directed(&samples(&chain), &fitted, steps, worst);
    }
    worst
}
