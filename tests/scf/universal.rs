//! Smooth connection segments made from their own curvature, by Gaussian quadrature: what solving
//! for them must give back.
//!
//! |κ|^ν = cos ψ, ψ = π/2 − |T|: with q = 1 − 1/ν the curve moves by sin^q|T| dT along the direction ψ = 0 (that of the force) and by
//! cos T sin^{q−1}|T| dT across it, and bends right where T > 0, left where T < 0.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{DMatrix, SymmetricEigen};

/// Nodes: singularities at a distance of 1.5 half intervals leave 2.6^{−2·24}, those of sin t/t at
/// π much less.
const NODES: usize = 24;

/// The universal curve of ν.
pub struct Reference {
    pub nu: f64,
    pub q: f64,
    /// ∫₀¹ x^q f(x) dx
    jacobi: Vec<[f64; 2]>,
    /// ∫₀¹ f(x) dx
    legendre: Vec<[f64; 2]>,
}

/// Nodes and weights of ∫₀¹ x^β f(x) dx, by the eigenvalues of the Jacobi matrix (Golub and Welsch).
pub fn gauss(beta: f64) -> Vec<[f64; 2]> {
    let mut matrix = DMatrix::zeros(NODES, NODES);
    matrix[(0, 0)] = beta / (beta + 2.0);
    for k in 1..NODES {
        let n = k as f64;
        let sum = 2.0 * n + beta;
        matrix[(k, k)] = beta * beta / (sum * (sum + 2.0));
        // For k = 1 and β = 0 the general formula is 0/0 no more, k + β cancelling.
        let square = 4.0 * n * n * (n + beta) * (n + beta) / (sum * sum * (sum + 1.0) * (sum - 1.0));
        matrix[(k, k - 1)] = square.sqrt();
        matrix[(k - 1, k)] = square.sqrt();
    }
    let eigen = SymmetricEigen::new(matrix);
    let node = |i: usize| {
        let first = eigen.eigenvectors[(0, i)];
        [0.5 * (1.0 + eigen.eigenvalues[i]), first * first / (beta + 1.0)]
    };
    (0..NODES).map(node).collect()
}

/// What is known of a piece [T₀, T₁].
#[derive(Clone, Copy, Debug)]
pub struct Known {
    pub t: [f64; 2],
    /// Displacements along and across the force.
    pub along: f64,
    pub across: f64,
    /// End angles from the chord, and the force's direction.
    pub angles: [f64; 2],
    pub force: f64,
}

impl Reference {
    pub fn new(nu: f64) -> Self {
        let q = 1.0 - 1.0 / nu;
        Reference { nu, q, jacobi: gauss(q), legendre: gauss(0.0) }
    }

    /// J(t) = ∫₀ᵗ sin^q for 0 ≤ t ≤ π.
    fn along(&self, t: f64) -> f64 {
        let near = |t: f64| {
            let sinc = |x: f64| if x == 0.0 { 1.0 } else { x.sin() / x };
            t.powf(self.q + 1.0) * self.jacobi.iter().map(|&[x, w]| w * sinc(t * x).powf(self.q)).sum::<f64>()
        };
        if t > FRAC_PI_2 { 2.0 * near(FRAC_PI_2) - near(PI - t) } else { near(t) }
    }

    fn moment(&self, t: f64) -> f64 {
        t.signum() * t.abs().sin().max(0.0).powf(self.q)
    }

    /// The piece of the universal curve from T₀ to T₁.
    pub fn piece(&self, t: [f64; 2]) -> Known {
        let (middle, half) = (0.5 * (t[0] + t[1]).abs(), 0.5 * (t[1] - t[0]));
        let (along, across) = if t[0] * t[1] > 0.0 && 1.5 * half < middle.min(PI - middle) {
            // Differences would lose digits.
            let sum = |f: &dyn Fn(f64) -> f64| {
                let at = |x: f64| (t[0] + 2.0 * half * x).abs();
                2.0 * half * self.legendre.iter().map(|&[x, w]| w * f(at(x))).sum::<f64>()
            };
            (sum(&|t| t.sin().powf(self.q)), sum(&|t| t.cos() * t.sin().powf(self.q - 1.0)))
        } else {
            let along = t.map(|t| t.signum() * self.along(t.abs()));
            let across = t.map(|t| self.moment(t) / self.q);
            (along[1] - along[0], across[1] - across[0])
        };
        let force = -across.atan2(along);
        Known { t, along, across, angles: t.map(|t| FRAC_PI_2 - t.abs() + force), force }
    }

    /// Cost over a chord of length d.
    pub fn cost(&self, known: &Known, chord: f64) -> f64 {
        (known.chord() / chord).powf(self.nu - 1.0) * known.along
    }

    /// |κ|^ν sgn κ at T, in units in which it is 1 at most.
    pub fn bend(&self, t: f64) -> f64 {
        -t.signum() * t.abs().sin()
    }

    /// How much T₀ and T₁ change at most with a change δ of the end angles, to first order.
    pub fn sensitivity(&self, known: &Known, delta: f64) -> [f64; 2] {
        let square = known.chord().powi(2);
        let [early, late] = known.t.map(|t| {
            let (sine, cosine) = t.abs().sin_cos();
            let (along, across) = (sine.powf(self.q), cosine * sine.powf(self.q - 1.0));
            (known.along * across - known.across * along) / square
        });
        // φ by T₀ and T₁.
        let [early, late] = [early, -late];
        let [[a, b], [c, d]] = [[early - known.t[0].signum(), late], [early, late - known.t[1].signum()]];
        let determinant = (a * d - b * c).abs();
        [(b.abs() + d.abs()) / determinant * delta, (a.abs() + c.abs()) / determinant * delta]
    }
}

impl Known {
    /// D
    pub fn chord(&self) -> f64 {
        self.along.hypot(self.across)
    }
}
