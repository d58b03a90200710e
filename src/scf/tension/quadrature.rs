//! Lengths and displacements of arcs under a pull, by Gauss rules on panels graded towards the
//! integrand's singularities.
//!
//! The radius of curvature ρ = ((ν − 1)/f)^{1/ν} is singular where f = λ − P·T is zero: at an
//! inflection as u^{−1/ν}, and on the critical circle |P| = λ as χ^{−2/ν}. A panel that begins
//! there uses the Gauss–Jacobi rule of that weight. Every other panel is so short that the nearest
//! singularity, real or complex, lies on or outside the Bernstein ellipse of radius 2.85, for which
//! 16 points leave an error of 2.85^{−32} = 3e−15. Panels grow by a factor of 4 away from a
//! singularity, so scales down to 1e−300 take only hundreds of panels.

use std::sync::{Arc, LazyLock};

const POINTS: usize = 16;

/// The length of the ellipse's major axis, in half panels: 2.85 + 1/2.85.
const ELLIPSE: f64 = 3.2;

/// Nodes on (0, 1), and weights that include the reciprocal of the rule's weight function.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule([(f64, f64); POINTS]);

/// A rule's node for an integrand: the sine and cosine of its angle x, ρ dx, and f.
struct Node {
    sine: f64,
    cosine: f64,
    radius: f64,
    excess: f64,
}

/// Integrals over an arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrals<const N: usize> {
    /// The length, and the displacement along and across the axis.
    pub arc: [f64; 3],
    /// The derivatives of the displacement.
    pub changes: [f64; N],
}

static LEGENDRE: LazyLock<Rule> = LazyLock::new(|| Rule::for_weight(0.0));

/// The Jacobi polynomial P_n^{(0, β)} at z, the one of degree n − 1, and the derivative of the
/// first.
fn jacobi(beta: f64, z: f64) -> [f64; 3] {
    let (mut before, mut value) = (1.0, 0.5 * (z * (beta + 2.0) - beta));
    for degree in 2..=POINTS {
        let k = degree as f64;
        let sum = 2.0 * k + beta;
        let linear = (sum - 1.0) * (sum * (sum - 2.0) * z - beta * beta);
        let next =
            (linear * value - 2.0 * (k - 1.0) * (k + beta - 1.0) * sum * before) / (2.0 * k * (k + beta) * (sum - 2.0));
        (before, value) = (value, next);
    }
    let n = POINTS as f64;
    let sum = 2.0 * n + beta;
    let derivative = (n * (-beta - sum * z) * value + 2.0 * n * (n + beta) * before) / (sum * (1.0 - z * z));
    [value, before, derivative]
}

impl Rule {
    pub(super) fn nodes(&self) -> impl Iterator<Item = (f64, f64)> {
        self.0.into_iter()
    }

    /// The Gauss–Jacobi rule of the weight x^β on (0, 1), β > −1.
    pub(super) fn for_weight(beta: f64) -> Self {
        let n = POINTS as f64;
        let mut roots = [0.0; POINTS];
        let mut rule = [(0.0, 0.0); POINTS];
        for index in 0..POINTS {
            let mut z = (std::f64::consts::PI * (index as f64 + 0.75) / (n + 0.5 * (beta + 1.0))).cos();
            // Known roots are divided out, so that no two starts end in the same root.
            for _ in 0..100 {
                let [value, _, derivative] = jacobi(beta, z);
                let found: f64 = roots[..index].iter().map(|root| 1.0 / (z - root)).sum();
                let step = value / (derivative - value * found);
                z -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            roots[index] = z;
            let [_, before, derivative] = jacobi(beta, z);
            let weight = (2.0 * n + beta) / (2.0 * n * (n + beta) * derivative * before);
            let node = 0.5 * (1.0 + z);
            rule[index] = (node, weight * node.powf(-beta));
        }
        Self(rule)
    }
}

/// The pull |P| on both ends, compared with the tension λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pull {
    /// |P| = λ(1 − ε): the curvature is never 0.
    Below(f64),
    /// |P| = λ: the curvature is 0 along the pull.
    Critical,
    /// |P|² = λ² + t²: inflections where the tangent is at acos(λ/|P|) to the pull.
    Above(f64),
}

/// The exponent, and the tension on a chord of 1.
#[derive(Clone, Debug)]
pub(super) struct Law {
    pub nu: f64,
    /// 1 − 1/ν.
    pub q: f64,
    /// (ν − 1)^{1/ν}.
    pub factor: f64,
    pub tension: f64,
    rules: Arc<Rules>,
}

/// The rules for the weights at an inflection and on the critical circle.
#[derive(Debug)]
struct Rules {
    inflection: Rule,
    flat: Rule,
}

impl Law {
    pub(super) fn new(nu: f64, tension: f64) -> Self {
        // For ν ≤ 2 no finite arc reaches the critical direction, and the second rule is unused.
        let flat = if nu > 2.0 { -2.0 / nu } else { 0.0 };
        Self {
            nu,
            q: 1.0 - 1.0 / nu,
            factor: (nu - 1.0).powf(1.0 / nu),
            tension,
            rules: Arc::new(Rules { inflection: Rule::for_weight(-1.0 / nu), flat: Rule::for_weight(flat) }),
        }
    }

    /// The exponent and the rules in the kernel's block: see `quadrature.wgsl`.
    pub(super) fn packed(&self) -> Vec<f64> {
        let rules = [&*LEGENDRE, &self.rules.inflection, &self.rules.flat];
        let nodes = rules.into_iter().flat_map(Rule::nodes).flat_map(|(node, weight)| [node, weight]);
        [self.nu, self.q, 1.0 / self.q, 1.0 / self.nu].into_iter().chain(nodes).collect()
    }

    /// The same exponent under another tension.
    pub(super) fn under(&self, tension: f64) -> Self {
        Self { tension, ..self.clone() }
    }

    /// |P|.
    pub(super) fn strength(&self, pull: Pull) -> f64 {
        match pull {
            Pull::Below(gap) => self.tension * (1.0 - gap),
            Pull::Critical => self.tension,
            Pull::Above(t) => self.tension.hypot(t),
        }
    }

    /// The angle of an inflection from the pull; 0 without an inflection.
    pub(super) fn opening(&self, pull: Pull) -> f64 {
        if let Pull::Above(t) = pull { t.atan2(self.tension) } else { 0.0 }
    }

    /// f = λ − P·T without cancellation, at the angle `x` from the pull, or above the tension, from
    /// the inflection.
    pub(super) fn excess(&self, pull: Pull, x: f64) -> f64 {
        self.excess_at_half(pull, (0.5 * x).sin_cos())
    }

    /// f from the sine and the cosine of x/2.
    fn excess_at_half(&self, pull: Pull, (sine, cosine): (f64, f64)) -> f64 {
        match pull {
            Pull::Below(gap) => self.tension * (gap + 2.0 * (1.0 - gap) * sine * sine),
            Pull::Critical => 2.0 * self.tension * sine * sine,
            Pull::Above(t) => (2.0 * sine.abs() * (self.tension * sine.abs() + t * cosine * sine.signum())).max(0.0),
        }
    }

    /// |κ| at the angle `x` of [`excess`](Self::excess).
    pub(super) fn curvature(&self, pull: Pull, x: f64) -> f64 {
        self.bent(self.excess(pull, x))
    }

    /// |κ| for this f.
    fn bent(&self, excess: f64) -> f64 {
        (excess / (self.nu - 1.0)).powf(1.0 / self.nu)
    }

    /// ∫ρ, ∫ρ cos x and ∫ρ sin x over `from … to` (from ≤ to), with x as in
    /// [`excess`](Self::excess).
    pub(super) fn arc(&self, pull: Pull, from: f64, to: f64) -> [f64; 3] {
        self.integrals(pull, from, to, |_| []).arc
    }

    /// The integrals of [`arc`](Self::arc) over 0 … `to` above the tension, with |P|² = λ² + t²,
    /// and t ∂/∂t of the displacement.
    ///
    /// t ∂ρ/∂t = −ρ t sin x/(νf) is no more singular at the inflection than ρ.
    pub(super) fn growth(&self, t: f64, to: f64) -> Integrals<2> {
        self.integrals(Pull::Above(t), 0.0, to, |Node { sine, cosine, radius, excess }| {
            let change = radius * t * sine / (self.nu * excess);
            [-(change * cosine), -(change * sine)]
        })
    }

    /// The integrals of [`arc`](Self::arc), and the derivatives of the displacement by the pull,
    /// below the tension: ∫ρ T Tᵀ/(νf), along and along, along and across, across and across.
    pub(super) fn compliance(&self, pull: Pull, from: f64, to: f64) -> Integrals<3> {
        self.integrals(pull, from, to, |Node { sine, cosine, radius, excess }| {
            let change = radius / (self.nu * excess);
            [change * cosine * cosine, change * cosine * sine, change * sine * sine]
        })
    }

    fn integrals<const N: usize>(
        &self,
        pull: Pull,
        from: f64,
        to: f64,
        changes: impl Fn(&Node) -> [f64; N],
    ) -> Integrals<N> {
        let ahead = |from: f64, to: f64| {
            let mut sums = Integrals { arc: [0.0; 3], changes: [0.0; N] };
            self.panels(pull, from, to, |node| {
                sums.arc[0] += node.radius;
                sums.arc[1] += node.radius * node.cosine;
                sums.arc[2] += node.radius * node.sine;
                for (sum, change) in sums.changes.iter_mut().zip(changes(&node)) {
                    *sum += change;
                }
            });
            sums
        };
        if from >= 0.0 {
            return ahead(from, to);
        }
        // Before the axis the arc is a mirror image.
        let mut left = ahead((-to).max(0.0), -from);
        left.arc[2] = -left.arc[2];
        // The entry of across and along is odd.
        if let Some(odd) = left.changes.get_mut(1) {
            *odd = -*odd;
        }
        if to <= 0.0 {
            return left;
        }
        let right = ahead(0.0, to);
        Integrals {
            arc: std::array::from_fn(|k| left.arc[k] + right.arc[k]),
            changes: std::array::from_fn(|k| left.changes[k] + right.changes[k]),
        }
    }

    /// Visits the nodes of the rules over `from … to`, 0 ≤ from.
    fn panels(&self, pull: Pull, from: f64, to: f64, mut visit: impl FnMut(Node)) {
        let turn = std::f64::consts::TAU;
        // The real and imaginary parts of the zeros of f.
        let singular = match pull {
            Pull::Below(gap) => {
                // Since tanh ≤ 1, never above the true distance 2 artanh √(ε/(2 − ε)).
                let height = 2.0 * (gap / (2.0 - gap)).sqrt();
                [(0.0, height), (turn, height), (turn, height)]
            }
            Pull::Critical => [(0.0, 0.0), (turn, 0.0), (turn, 0.0)],
            Pull::Above(_) => {
                let opening = self.opening(pull);
                [(0.0, 0.0), (-2.0 * opening, 0.0), (turn - 2.0 * opening, 0.0)]
            }
        };
        let mut start = from;
        while start < to {
            let mut rule = &*LEGENDRE;
            let mut length = to - start;
            for (real, imaginary) in singular {
                let offset = real - start;
                let distance = offset.hypot(imaginary);
                if distance == 0.0 {
                    rule = if matches!(pull, Pull::Critical) { &self.rules.flat } else { &self.rules.inflection };
                } else {
                    // The ellipse with foci at the panel's ends passes through the singularity.
                    let longest = (ELLIPSE * distance - 2.0 * offset) / (0.25 * ELLIPSE * ELLIPSE - 1.0);
                    length = length.min(longest);
                }
            }
            let end = if start + length >= to { to } else { start + length };
            if end <= start {
                // A singularity at `to` itself: panels have shrunk to nothing.
                break;
            }
            length = end - start;
            for (node, weight) in rule.0 {
                let (sine, cosine) = (0.5 * (start + length * node)).sin_cos();
                let excess = self.excess_at_half(pull, (sine, cosine));
                visit(Node {
                    sine: 2.0 * sine * cosine,
                    cosine: (cosine - sine) * (cosine + sine),
                    radius: length * weight / self.bent(excess),
                    excess,
                });
            }
            start = end;
        }
    }
}
