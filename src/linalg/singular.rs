//! The systems the fast path gives up on: singular networks, and numbers that are not finite.

use super::scalar::Real;
use super::systems::{Matrix, Part};
use crate::status::CurveStatus;

/// Solves system `i` into `x` (all its columns), after the fast path met a number that is not
/// finite.
///
/// Weights of 0 divide a network into components. One without any excess fixes its solution up to a
/// constant only, and has one only if its right-hand side sums to 0: then the solution of mean 0 is
/// returned.
pub(super) fn solve<T: Real>(part: &Part<T>, i: usize, x: &mut [T]) -> CurveStatus {
    let status = match part.systems.matrix {
        Matrix::Bands { .. } => CurveStatus::Invalid,
        Matrix::Network { excess, weights } => {
            let rows = part.systems.offsets[i]..part.systems.offsets[i + 1];
            let in_f64 = |numbers: &[T]| numbers.iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
            let rhs = in_f64(&part.rhs[rows.start * part.columns..rows.end * part.columns]);
            let mut network = Components {
                excess: in_f64(&excess[rows.clone()]),
                weights: in_f64(&weights[rows]),
                columns: part.columns,
                precision: T::EPSILON.to_f64(),
            };
            if !part.systems.cyclic.contains(i) {
                network.weights[0] = 0.0;
            }
            network.solve(&rhs, x)
        }
    };
    if status == CurveStatus::Invalid || x.iter().any(|x| !x.is_finite()) {
        x.fill(T::NAN);
        return CurveStatus::Invalid;
    }
    status
}

/// A network in f64; the weight of an edge that is not there is 0.
struct Components {
    excess: Vec<f64>,
    weights: Vec<f64>,
    columns: usize,
    precision: f64,
}

impl Components {
    fn solve<T: Real>(&self, rhs: &[f64], x: &mut [T]) -> CurveStatus {
        let n = self.excess.len();
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        if !finite(&self.excess) || !finite(&self.weights) || !finite(rhs) {
            return CurveStatus::Invalid;
        }
        // Row by row from a missing edge on, the network is a row of paths. The edge of a single
        // row to itself does nothing.
        let cut = if n == 1 { Some(0) } else { self.weights.iter().position(|&w| w == 0.0) };
        let order: Vec<usize> = (0..n).map(|k| (cut.unwrap_or(0) + k) % n).collect();
        let mut status = CurveStatus::Converged;
        let mut from = 0;
        while from < n {
            let to = (from + 1..n).find(|&k| self.weights[order[k]] == 0.0).unwrap_or(n);
            let rows = &order[from..to];
            let free = rows.iter().all(|&row| self.excess[row] == 0.0);
            for column in 0..self.columns {
                let d: Vec<f64> = rows.iter().map(|&row| rhs[row * self.columns + column]).collect();
                let solution = match (free, cut) {
                    (true, Some(_)) => self.balance(rows, &d, false),
                    (true, None) => self.balance(rows, &d, true),
                    (false, Some(_)) => Some(self.path(rows, &d)),
                    // Neither singular nor cut: what was not finite before would not be now.
                    (false, None) => None,
                };
                let Some(solution) = solution else { return CurveStatus::Invalid };
                for (&row, value) in rows.iter().zip(solution) {
                    x[row * self.columns + column] = T::from_f64(value);
                }
            }
            if free {
                status = CurveStatus::NotUnique;
            }
            from = to;
        }
        status
    }

    /// The solution of mean 0 of a component without excess, from the flow along its edges; none
    /// where more flows in than out.
    fn balance(&self, rows: &[usize], d: &[f64], ring: bool) -> Option<Vec<f64>> {
        let n = rows.len();
        let size: f64 = d.iter().map(|d| d.abs()).sum();
        if d.iter().sum::<f64>().abs() > n as f64 * self.precision * size {
            return None;
        }
        // Flow into row k over edge k; without a ring there is none into row 0.
        let mut flow = vec![0.0; n];
        for k in 1..n {
            flow[k] = flow[k - 1] + d[k - 1];
        }
        if ring {
            // The potential comes back to itself around the ring.
            let around: f64 = rows.iter().zip(&flow).map(|(&row, flow)| flow / self.weights[row]).sum();
            let resistance: f64 = rows.iter().map(|&row| 1.0 / self.weights[row]).sum();
            flow.iter_mut().for_each(|flow| *flow -= around / resistance);
        }
        let mut x = vec![0.0; n];
        for k in 1..n {
            x[k] = x[k - 1] - flow[k] / self.weights[rows[k]];
        }
        let mean = x.iter().sum::<f64>() / n as f64;
        x.iter_mut().for_each(|x| *x -= mean);
        Some(x)
    }

    /// The solution of a path that has some excess, by star-mesh elimination.
    fn path(&self, rows: &[usize], d: &[f64]) -> Vec<f64> {
        let n = rows.len();
        let (mut ga, mut x) = (vec![0.0; n], vec![0.0; n]);
        let (mut excess, mut flow) = (0.0, 0.0);
        for k in 0..n {
            let next = if k + 1 < n { self.weights[rows[k + 1]] } else { 0.0 };
            let (e, d) = (self.excess[rows[k]] + excess, d[k] + flow);
            ga[k] = next / (e + next);
            x[k] = d / (e + next);
            (excess, flow) = (ga[k] * e, ga[k] * d);
        }
        for k in (0..n - 1).rev() {
            x[k] += ga[k] * x[k + 1];
        }
        x
    }
}
