//! Real roots of piecewise polynomials.

use super::{Extrapolate, Piecewise};
use crate::parallel;

/// A value below this share of the sum of its terms is rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

impl Piecewise {
    /// The places where every curve has the value `y`, ascending: a list for each curve and column.
    ///
    /// A span on which the curve is `y` all along gives its first knot, and NaN after it. Outside
    /// the knots are looked for with [`Extrapolate::Yes`] alone.
    pub fn solve(&self, y: f64, extrapolate: Extrapolate) -> Vec<Vec<f64>> {
        let d = self.columns;
        parallel::map(self.len() * d, 16, |k| self.solve_column(k / d, k % d, y, extrapolate))
    }

    fn solve_column(&self, i: usize, column: usize, y: f64, extrapolate: Extrapolate) -> Vec<f64> {
        let (d, order, knots, c) = (self.columns, self.order, self.knots(i), self.coefficients(i));
        let mut all: Vec<f64> = Vec::new();
        let spans = knots.len().saturating_sub(1);
        for span in 0..spans {
            let mut own: Vec<f64> = (0..order).map(|m| c[(span * order + m) * d + column]).collect();
            own[order - 1] -= y;
            if own.iter().any(|c| !c.is_finite()) {
                return vec![];
            }
            let beyond = extrapolate == Extrapolate::Yes;
            let from = if beyond && span == 0 { f64::NEG_INFINITY } else { 0.0 };
            let to = if beyond && span + 1 == spans { f64::INFINITY } else { knots[span + 1] - knots[span] };
            if own.iter().all(|&c| c == 0.0) {
                all.extend([knots[span], f64::NAN]);
                continue;
            }
            for z in between(&own, from, to) {
                let x = knots[span] + z;
                // A root at a knot belongs to the spans on both sides.
                let near =
                    |last: f64| (x - last).abs() <= ROUNDING * x.abs().max(last.abs()).max(knots[spans] - knots[0]);
                if !all.last().is_some_and(|&last| near(last)) {
                    all.push(x);
                }
            }
        }
        all
    }
}

/// The roots of a polynomial (highest power first) between two places, ascending.
///
/// Between its stationary places a polynomial is monotone: the roots of its derivative part the
/// interval, and each part has a root or none.
fn between(c: &[f64], from: f64, to: f64) -> Vec<f64> {
    let leading = c.iter().position(|&c| c != 0.0).unwrap_or(c.len());
    let c = &c[leading..];
    if c.len() < 2 {
        return vec![];
    }
    // All roots lie within this of 0 (Cauchy).
    let bound = 1.0 + c[1..].iter().map(|lower| (lower / c[0]).abs()).fold(0.0, f64::max);
    let (from, to) = (from.max(-bound), to.min(bound));
    if from > to {
        return vec![];
    }
    let degree = c.len() - 1;
    let derivative: Vec<f64> = (0..degree).map(|m| c[m] * (degree - m) as f64).collect();
    let mut places = vec![from];
    places.extend(between(&derivative, from, to));
    places.push(to);
    let is_zero = |z: f64| value(c, z).abs() <= ROUNDING * c.iter().fold(0.0, |sum, c| sum * z.abs() + c.abs());
    let mut roots: Vec<f64> = Vec::new();
    let mut add = |z: f64| {
        if roots.last() != Some(&z) {
            roots.push(z);
        }
    };
    for (k, pair) in places.windows(2).enumerate() {
        let &[a, b] = pair else { unreachable!("windows of two") };
        let (at_a, at_b) = (is_zero(a), is_zero(b));
        if at_a {
            add(a);
        }
        if !at_a && !at_b && (value(c, a) < 0.0) != (value(c, b) < 0.0) {
            add(bisected(c, a, b));
        }
        if at_b && k + 2 == places.len() {
            add(b);
        }
    }
    roots
}

fn value(c: &[f64], z: f64) -> f64 {
    c.iter().fold(0.0, |sum, c| sum * z + c)
}

/// The root in an interval at whose ends the signs differ: Newton's steps where they stay inside,
/// else halves.
fn bisected(c: &[f64], mut a: f64, mut b: f64) -> f64 {
    let below_at_a = value(c, a) < 0.0;
    let mut z = 0.5 * (a + b);
    // Halves alone take 60 steps or so; Newton's are a handful.
    for _ in 0..200 {
        let (mut f, mut slope) = (0.0, 0.0);
        for c in c {
            slope = slope * z + f;
            f = f * z + c;
        }
        if f == 0.0 {
            return z;
        }
        if (f < 0.0) == below_at_a {
            a = z
        } else {
            b = z
        }
        let newton = z - f / slope;
        let next = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
        if (next - z).abs() <= 0.5 * f64::EPSILON * next.abs() {
            return next;
        }
        z = next;
    }
    z
}
