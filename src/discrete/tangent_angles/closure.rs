//! Closure constraints: every span leads from its first point to its last, h Σ (cos θ, sin θ) = P′
//! − P.

use super::shape::{Curve, Shape};
use crate::linalg::skyline::Skyline;

/// A gap below this fraction of the polygon's length counts as closed.
///
/// Sums over some thousand edges have less rounding.
const CLOSED: f64 = 1e-12;

/// The most corrections per retraction.
const MOST_CORRECTIONS: usize = 20;

/// Gaps must shrink by this factor with the existing factorisation. Otherwise corrections are
/// Newton steps.
const SHRINKS: f64 = 0.5;

/// The factor by which a gap may grow before the retraction fails.
const OPENS: f64 = 10.0;

impl Shape {
    /// The gap between the end of every span and its last point.
    pub fn gaps<'a>(&'a self, curve: &'a Curve) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.spans.iter().enumerate().map(|(k, _)| {
            let [x, y] = self.reach(curve, k);
            [x - self.chords[k][0], y - self.chords[k][1]]
        })
    }

    /// The vector from the first point of span k to the end of its edges.
    fn reach(&self, curve: &Curve, k: usize) -> [f64; 2] {
        let angles = &curve.angles[self.spans[k].clone()];
        let (x, y) = angles.iter().fold((0.0, 0.0), |(x, y), angle| (x + angle.cos(), y + angle.sin()));
        let h = curve.sizes[k].exp();
        [h * x, h * y]
    }

    /// Adds the derivatives of all closures to a matrix, and their second derivatives times the
    /// multipliers.
    pub fn add_closures(&self, curve: &Curve, multipliers: &[[f64; 2]], matrix: &mut Skyline) {
        for (k, edges) in self.spans.iter().enumerate() {
            let (h, [m, n]) = (curve.sizes[k].exp(), multipliers[k]);
            let (length, [along_x, along_y]) = (self.row_of_length(edges.start), self.rows_of_closure(k));
            for j in edges.clone() {
                let (row, x, y) = (self.row(j), h * curve.angles[j].cos(), h * curve.angles[j].sin());
                matrix.add(along_x, row, -y);
                matrix.add(along_y, row, x);
                matrix.add(row, row, -(m * x + n * y));
                matrix.add(length, row, n * x - m * y);
            }
            let [x, y] = self.reach(curve, k);
            matrix.add(along_x, length, x);
            matrix.add(along_y, length, y);
            matrix.add(length, length, m * x + n * y);
        }
    }

    /// Closes all spans again after a step. Returns whether this succeeded.
    ///
    /// Corrections are least in the norm of the step's factorised system, whose derivatives belong
    /// to the previous curve. If they do not halve the gaps, each span is corrected by Newton's
    /// method with a bump.
    pub fn retract(&self, factors: &Skyline, curve: &mut Curve) -> bool {
        let (tolerance, mut last, mut frozen) = (CLOSED * self.chord(), f64::INFINITY, true);
        let mut x = vec![0.0; self.rows()];
        for _ in 0..MOST_CORRECTIONS {
            let gaps: Vec<[f64; 2]> = self.gaps(curve).collect();
            // Unlike `f64::max` this keeps a NaN gap.
            let wider = |widest: f64, gap: &f64| if gap.is_nan() || gap.abs() > widest { gap.abs() } else { widest };
            let widest = gaps.as_flattened().iter().fold(0.0, wider);
            if widest <= tolerance {
                return true;
            }
            if !widest.is_finite() || widest > OPENS * last {
                return false;
            }
            frozen &= widest <= SHRINKS * last;
            last = widest;
            if frozen {
                x.fill(0.0);
                for (k, gap) in gaps.iter().enumerate() {
                    let [row, other] = self.rows_of_closure(k);
                    (x[row], x[other]) = (-gap[0], -gap[1]);
                }
                factors.solve(&mut x);
                *curve = curve.moved(self, 1.0, &x);
            } else {
                gaps.iter().enumerate().for_each(|(k, gap)| self.close(k, *gap, curve));
            }
        }
        false
    }

    /// One Newton step towards the closure of span k.
    ///
    /// It is the least one in a norm in which angles have the weight 1/(16 x² (1 − x)²), with x
    /// from 0 to 1 along the span, and the logarithm of the length has the number of edges as its
    /// weight. The bump leaves both ends of the span unchanged.
    fn close(&self, k: usize, gap: [f64; 2], curve: &mut Curve) {
        let (edges, h, reach) = (self.spans[k].clone(), curve.sizes[k].exp(), self.reach(curve, k));
        let count = edges.len() as f64;
        let bump = |j: usize| {
            let x = (j as f64 + 0.5) / count;
            (4.0 * x * (1.0 - x)).powi(2)
        };
        let angles = &mut curve.angles[edges];
        let mut gram = [reach[0] * reach[0] / count, reach[0] * reach[1] / count, reach[1] * reach[1] / count];
        for (j, angle) in angles.iter().enumerate() {
            let (x, y) = (-h * angle.sin(), h * angle.cos());
            gram[0] += bump(j) * x * x;
            gram[1] += bump(j) * x * y;
            gram[2] += bump(j) * y * y;
        }
        let determinant = gram[0] * gram[2] - gram[1] * gram[1];
        let a = -(gram[2] * gap[0] - gram[1] * gap[1]) / determinant;
        let b = -(gram[0] * gap[1] - gram[1] * gap[0]) / determinant;
        for (j, angle) in angles.iter_mut().enumerate() {
            *angle += bump(j) * h * (b * angle.cos() - a * angle.sin());
        }
        curve.sizes[k] += (a * reach[0] + b * reach[1]) / count;
    }
}
