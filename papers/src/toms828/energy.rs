//! φ of a graph on a mesh, its gradient, its Hessian and the metric of the descent.
//!
//! Each row couples five mesh points.
//!
//! With q = 1 + y′², a = y″ q^{−5/2} and b = (5/4) H y′ y″ a / q at the inner mesh points (0
//! elsewhere):
//!
//! ```text
//! g_i  = (2/H) (a_{i−1} − 2 a_i + a_{i+1} − b_{i−1} + b_{i+1})
//! Dh_i = (q h″_i − y′ y″ h′_i) q^{−7/4}
//! ```
//!
//! D is the operator of the paper's metric ⟨u, v⟩ = Σ (Du)_i (Dv)_i, frozen at the current curve.

use crate::banded::Banded;

/// y′ and y″ at the inner mesh points.
pub(super) struct Differences {
    pub first: Vec<f64>,
    pub second: Vec<f64>,
}

impl Differences {
    pub fn of(y: &[f64], width: f64) -> Self {
        Differences {
            first: y.windows(3).map(|y| (y[2] - y[0]) / (2.0 * width)).collect(),
            second: y.windows(3).map(|y| (y[0] - 2.0 * y[1] + y[2]) / (width * width)).collect(),
        }
    }

    /// φ.
    pub fn energy(&self, width: f64) -> f64 {
        let at = |(first, second): (&f64, &f64)| density(*first, *second);
        width * self.first.iter().zip(&self.second).map(at).sum::<f64>()
    }

    /// φ of the curve less `step` times the curve with the differences `direction`.
    pub fn energy_along(&self, direction: &Differences, step: f64, width: f64) -> f64 {
        let here = self.first.iter().zip(&self.second);
        let along = direction.first.iter().zip(&direction.second);
        let at = |((y1, y2), (p1, p2)): ((&f64, &f64), (&f64, &f64))| density(y1 - step * p1, y2 - step * p2);
        width * here.zip(along).map(at).sum::<f64>()
    }

    /// ∂φ/∂y at all mesh points.
    ///
    /// 0 at data points.
    pub fn gradient(&self, width: f64, data: &[usize]) -> Vec<f64> {
        let mut gradient = vec![0.0; self.first.len() + 2];
        for (k, (&y1, &y2)) in self.first.iter().zip(&self.second).enumerate() {
            let q = 1.0 + y1 * y1;
            let a = y2 / (q * q * q.sqrt());
            let b = 1.25 * width * y1 * y2 * a / q;
            gradient[k] += 2.0 / width * (a + b);
            gradient[k + 1] -= 4.0 / width * a;
            gradient[k + 2] += 2.0 / width * (a - b);
        }
        data.iter().for_each(|&k| gradient[k] = 0.0);
        gradient
    }

    /// The matrix DᵀD.
    pub fn metric(&self, width: f64) -> Banded {
        let mut bands = Banded::new(self.first.len() + 2, 2);
        for (k, row) in self.operator(width).enumerate() {
            add(&mut bands, k, 1.0, &row, &row);
        }
        bands
    }

    /// ⟨p, p⟩ = |Dp|².
    pub fn metric_of(&self, width: f64, p: &[f64]) -> f64 {
        let dp = |(row, p): ([f64; 3], &[f64])| row[0] * p[0] + row[1] * p[1] + row[2] * p[2];
        self.operator(width).zip(p.windows(3)).map(dp).map(|x| x * x).sum()
    }

    /// The matrix of second derivatives of φ.
    pub fn hessian(&self, width: f64) -> Banded {
        let mut bands = Banded::new(self.first.len() + 2, 2);
        let square = 1.0 / (width * width);
        let first = [-0.5 / width, 0.0, 0.5 / width];
        let second = [square, -2.0 * square, square];
        for (k, (&y1, &y2)) in self.first.iter().zip(&self.second).enumerate() {
            let q = 1.0 + y1 * y1;
            let power = width / (q * q * q.sqrt());
            add(&mut bands, k, 2.0 * power, &second, &second);
            let mixed = -10.0 * y1 * y2 * power / q;
            add(&mut bands, k, mixed, &first, &second);
            add(&mut bands, k, mixed, &second, &first);
            add(&mut bands, k, 5.0 * y2 * y2 * power / q * (7.0 * y1 * y1 / q - 1.0), &first, &first);
        }
        bands
    }

    /// The rows of D, as the factors of h_{i−1}, h_i and h_{i+1}.
    fn operator(&self, width: f64) -> impl Iterator<Item = [f64; 3]> {
        self.first.iter().zip(&self.second).map(move |(&y1, &y2)| {
            let q = 1.0 + y1 * y1;
            let scale = 1.0 / (q * q.sqrt() * q.sqrt().sqrt());
            let (bend, slope) = (scale * q / (width * width), scale * y1 * y2 / (2.0 * width));
            [bend + slope, -2.0 * bend, bend - slope]
        })
    }
}

/// y″² (1 + y′²)^{−5/2}: the squared curvature times ds/dt.
fn density(first: f64, second: f64) -> f64 {
    let q = 1.0 + first * first;
    second * second / (q * q * q.sqrt())
}

/// Adds the lower half of weight · v uᵀ at the rows k … k + 2.
fn add(bands: &mut Banded, k: usize, weight: f64, u: &[f64; 3], v: &[f64; 3]) {
    for (i, j) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
        bands[(k + j, k + i)] += weight * u[i] * v[j];
    }
}

/// The solution with the rows and columns of the data points zeroed but for their diagonal.
///
/// `None` if the matrix is not positive definite. `rhs` is 0 at data points, and so is the solution.
pub(super) fn solve_free(mut matrix: Banded, data: &[usize], mut rhs: Vec<f64>) -> Option<Vec<f64>> {
    let last = matrix.rows() - 1;
    for &k in data {
        // The value there does not matter, but it must be positive. A Hessian may have it negative.
        matrix[(k, k)] = matrix[(k, k)].abs().max(f64::MIN_POSITIVE);
        for other in (k.saturating_sub(2)..=(k + 2).min(last)).filter(|&other| other != k) {
            matrix[(k.max(other), k.min(other))] = 0.0;
        }
    }
    if matrix.factor() > 0.0 {
        matrix.solve(&mut rhs);
        return rhs.iter().all(|x| x.is_finite()).then_some(rhs);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: f64 = 0.25;

    fn wave(k: usize) -> f64 {
        (0.7 * k as f64).sin() + 0.1 * k as f64
    }

    fn graph() -> Vec<f64> {
        (0..13).map(wave).collect()
    }

    fn phi(y: &[f64]) -> f64 {
        Differences::of(y, WIDTH).energy(WIDTH)
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_energy() {
        let y = graph();
        let gradient = Differences::of(&y, WIDTH).gradient(WIDTH, &[]);
        for k in 0..y.len() {
            let moved = |by: f64| {
                let mut y = y.clone();
                y[k] += by;
                phi(&y)
            };
            // Central differences of fourth order have an error of about h⁴ φ⁗ ~ 1e-10, and
            // rounding of about ε φ/h ~ 1e-11.
            let h = 1e-3;
            let difference = (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
            assert!((gradient[k] - difference).abs() < 1e-7 * phi(&y), "{k}: {} {difference}", gradient[k]);
        }
    }

    #[test]
    fn the_hessian_is_the_derivative_of_the_gradient() {
        let y = graph();
        let hessian = Differences::of(&y, WIDTH).hessian(WIDTH);
        let scale = (0..y.len()).fold(0.0f64, |most, k| most.max(hessian[(k, k)].abs()));
        for k in 0..y.len() {
            let moved = |by: f64| {
                let mut y = y.clone();
                y[k] += by;
                Differences::of(&y, WIDTH).gradient(WIDTH, &[])
            };
            let h = 1e-4;
            let (ahead, back) = (moved(h), moved(-h));
            for i in 0..y.len() {
                let difference = (ahead[i] - back[i]) / (2.0 * h);
                let entry = if i.abs_diff(k) < 3 { hessian[(i.max(k), i.min(k))] } else { 0.0 };
                assert!((entry - difference).abs() < 1e-5 * scale, "{i} {k}: {entry} {difference}");
            }
        }
    }

    #[test]
    fn a_sobolev_gradient_satisfies_its_system_and_leaves_data_points_alone() {
        let (y, data) = (graph(), [0, 5, 12]);
        let here = Differences::of(&y, WIDTH);
        let gradient = here.gradient(WIDTH, &data);
        let sobolev = solve_free(here.metric(WIDTH), &data, gradient.clone()).unwrap();
        assert!(data.iter().all(|&k| sobolev[k] == 0.0));
        // ⟨sobolev, e_k⟩ by polarisation, for every free k.
        let norm = |p: &[f64]| here.metric_of(WIDTH, p);
        for k in (0..13).filter(|k| !data.contains(k)) {
            let [mut ahead, mut back] = [sobolev.clone(), sobolev.clone()];
            (ahead[k], back[k]) = (ahead[k] + 1.0, back[k] - 1.0);
            let product = (norm(&ahead) - norm(&back)) / 4.0;
            assert!((product - gradient[k]).abs() < 1e-10 * norm(&ahead), "{k}: {product} {}", gradient[k]);
        }
    }
}
