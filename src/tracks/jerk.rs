//! The fastest speeds within a limit of jerk, by an interior-point method.
//!
//! The unknowns are w = v² at the sites along a curve. Between two sites at the distance h the acceleration
//! a = (w′ − w)/2h is constant and takes the time τ = 2h/(√w + √w′).
//!
//! ```text
//! min Σ τ  subject to  w ≤ W,  −b ≤ a ≤ a₊,  |a′ − a| ≤ J (τ + τ′)/2
//! ```
//!
//! τ is convex in w, so only the last limit is not convex. A linearised τ is smaller, so such a limit is
//! stricter than its own, and Newton's steps leave out its curvature, as the convex–concave procedure does.
//! From any feasible profile they lead to a local minimum.
//!
//! Sources: D. Verscheure et al., *Time-optimal path tracking for robots: a convex optimization approach*
//! (IEEE TAC 2009); A. L. Yuille and A. Rangarajan, *The concave–convex procedure* (2003).

use crate::linalg::banded::Banded;

/// The first profile uses this fraction of the room that its limits leave.
const ROOM: f64 = 0.9;

/// The factor from one barrier to the next.
const NEXT_BARRIER: f64 = 0.1;

/// The gap to the minimum, as a fraction of the time, at which the barrier is low enough.
const GAP: f64 = 1e-7;

/// Newton's steps with one barrier, and halvings of one of them.
const STEPS: usize = 60;
const HALVINGS: usize = 50;

/// Squares of speeds at sites, of which the edge k is between the sites k and k + 1.
pub(super) struct Profile<'a> {
    /// h of every edge. A closed curve has one for every site.
    pub steps: &'a [f64],
    /// W at every site. It is 0 at rests, and the ends of an open curve are rests.
    pub most: &'a [f64],
    /// a₊ and b
    pub accelerate: f64,
    pub brake: f64,
    /// J
    pub jerk: f64,
}

/// A limit g ≥ 0 by up to three sites.
struct Bound {
    first: usize,
    value: f64,
    slope: [f64; 3],
}

/// The drive between two sites.
struct Edge {
    /// τ
    time: f64,
    /// ∂τ/∂w and ∂τ/∂w′, 0 at rests.
    rates: [f64; 2],
    /// ∂²τ/∂w², ∂²τ/∂w∂w′ and ∂²τ/∂w′²
    bends: [f64; 3],
    /// a
    acceleration: f64,
    /// −∂a/∂w = ∂a/∂w′
    slope: f64,
}

impl Edge {
    fn new(h: f64, [a, b]: [f64; 2]) -> Self {
        let roots = [a, b].map(f64::sqrt);
        let sum = roots[0] + roots[1];
        let [p, q] = roots.map(|root| if root > 0.0 { 1.0 / root } else { 0.0 });
        let (part, slope) = (h / (sum * sum), 0.5 / h);
        let bend = |p: f64| part * p * p * (0.5 * p + 1.0 / sum);
        Edge {
            time: 2.0 * h / sum,
            rates: [-part * p, -part * q],
            bends: [bend(p), part * p * q / sum, bend(q)],
            acceleration: slope * (b - a),
            slope,
        }
    }
}

impl Profile<'_> {
    fn is_closed(&self) -> bool {
        self.steps.len() == self.most.len()
    }

    fn edges(&self, w: &[f64]) -> Vec<Edge> {
        let edge = |(k, h): (usize, &f64)| Edge::new(*h, [w[k], w[(k + 1) % w.len()]]);
        self.steps.iter().enumerate().map(edge).collect()
    }

    /// The pairs of edges between which the acceleration changes: those at every site on the way, and at a rest
    /// each of both by itself, since a vehicle at rest can wait.
    fn changes(&self) -> impl Iterator<Item = [Option<usize>; 2]> {
        let (sites, edges) = (self.most.len(), self.steps.len());
        (0..sites).flat_map(move |k| {
            let before = if self.is_closed() { Some((k + edges - 1) % edges) } else { k.checked_sub(1) };
            let after = Some(k).filter(|k| *k < edges);
            match self.most[k] > 0.0 {
                true => [[before, after], [None; 2]],
                false => [[before, None], [after, None]],
            }
        })
    }

    /// The limits, with derivatives.
    fn bounds(&self, w: &[f64], edges: &[Edge], mut visit: impl FnMut(Bound)) {
        let half = 0.5 * self.jerk;
        for (k, (own, most)) in w.iter().zip(self.most).enumerate().filter(|(_, (_, most))| **most > 0.0) {
            visit(Bound { first: k, value: most - own, slope: [-1.0, 0.0, 0.0] });
        }
        for (k, edge) in edges.iter().enumerate() {
            let slope = edge.slope;
            let value = self.accelerate - edge.acceleration;
            visit(Bound { first: k, value, slope: [slope, -slope, 0.0] });
            let value = self.brake + edge.acceleration;
            visit(Bound { first: k, value, slope: [-slope, slope, 0.0] });
        }
        for pair in self.changes() {
            let Some(first) = pair[0].or(pair[1]) else { continue };
            for sign in [1.0, -1.0] {
                let mut bound = Bound { first, value: 0.0, slope: [0.0; 3] };
                for (at, (edge, sign)) in
                    pair.into_iter().zip([-sign, sign]).filter_map(|(edge, sign)| Some((edge?, sign))).enumerate()
                {
                    let edge = &edges[edge];
                    bound.value += half * edge.time - sign * edge.acceleration;
                    bound.slope[at] += half * edge.rates[0] + sign * edge.slope;
                    bound.slope[at + 1] += half * edge.rates[1] - sign * edge.slope;
                }
                visit(bound);
            }
        }
    }

    /// Σ τ − μ Σ ln g; infinite outside.
    fn merit(&self, w: &[f64], barrier: f64) -> f64 {
        let edges = self.edges(w);
        let mut merit: f64 = edges.iter().map(|edge| edge.time).sum();
        self.bounds(w, &edges, |bound| {
            merit -= if bound.value > 0.0 { barrier * bound.value.ln() } else { f64::NEG_INFINITY };
        });
        merit
    }

    /// A profile with room to all limits: a slower one, at which accelerations are ε and times 1/√ε of these.
    fn start(&self, w: &[f64]) -> Vec<f64> {
        let edges = self.edges(w);
        let mut scale = 1.0f64;
        for pair in self.changes() {
            let (mut time, mut change) = (0.0, 0.0);
            for (edge, sign) in pair.into_iter().zip([-1.0, 1.0]).filter_map(|(edge, sign)| Some((&edges[edge?], sign)))
            {
                time += 0.5 * edge.time;
                change += sign * edge.acceleration;
            }
            if change != 0.0 {
                scale = scale.min((self.jerk * time / change.abs()).powf(2.0 / 3.0));
            }
        }
        w.iter().map(|own| ROOM * scale * own).collect()
    }

    /// Newton's step and −(its slope) of the merit.
    fn step(&self, w: &[f64], barrier: f64, movable: &[f64]) -> (Vec<f64>, f64) {
        let (n, edges) = (w.len(), self.edges(w));
        let mut matrix = Banded::<f64, 2>::new(self.is_closed(), &[n]);
        let mut gradient = vec![0.0; n];
        self.bounds(w, &edges, |bound| {
            for (k, slope) in bound.slope.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
                gradient[(bound.first + k) % n] -= barrier * slope / bound.value;
            }
            let weight = barrier / (bound.value * bound.value);
            matrix.add(bound.first, weight, bound.slope);
        });
        for (k, edge) in edges.iter().enumerate() {
            gradient[k] += edge.rates[0];
            gradient[(k + 1) % n] += edge.rates[1];
            matrix.add_diagonal(k, edge.bends[0]);
            matrix.add_entry(k + 1, k, edge.bends[1]);
            matrix.add_diagonal(k + 1, edge.bends[2]);
        }
        matrix.factor(movable);
        let mut step: Vec<[f64; 1]> = gradient.iter().zip(movable).map(|(own, movable)| [-own * movable]).collect();
        matrix.solve(&mut step);
        let step = step.as_flattened().to_vec();
        let fall = -gradient.iter().zip(&step).map(|(own, step)| own * step).sum::<f64>();
        (step, fall)
    }

    /// w of the fastest profile, from a profile that keeps all limits except the jerk.
    pub fn fastest(&self, w: &[f64]) -> Vec<f64> {
        let movable: Vec<f64> = self.most.iter().map(|most| f64::from(*most > 0.0)).collect();
        let mut w = self.start(w);
        let time = |w: &[f64]| self.edges(w).iter().map(|edge| edge.time).sum::<f64>();
        let count = 3.0 * self.most.len() as f64 + 2.0 * self.steps.len() as f64;
        let mut barrier = time(&w) / count;
        while barrier * count > GAP * time(&w) {
            for _ in 0..STEPS {
                let (step, fall) = self.step(&w, barrier, &movable);
                // NaN, too, ends a barrier.
                if fall.is_nan() || fall <= 1e-2 * barrier {
                    break;
                }
                let merit = self.merit(&w, barrier);
                let next = (0..HALVINGS).map(|k| 0.5f64.powi(k as i32)).find_map(|part| {
                    let next: Vec<f64> = w.iter().zip(&step).map(|(own, step)| own + part * step).collect();
                    let is_inside = next.iter().zip(&movable).all(|(own, movable)| *own > 0.0 || *movable == 0.0);
                    (is_inside && self.merit(&next, barrier) <= merit - 1e-4 * part * fall).then_some(next)
                });
                let Some(next) = next else { break };
                w = next;
            }
            barrier *= NEXT_BARRIER;
        }
        w
    }
}
