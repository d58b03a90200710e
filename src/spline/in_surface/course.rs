//! [`Course`]: one spline in a surface, by Newton's method on positions and velocities.
//!
//! The unknowns of a node are a step s in its tangent plane and a change t of its velocity there:
//!
//! ```text
//! x ← R(x + B s),  v ← P(v + B t) at the new place
//! ```
//!
//! B holds two unit vectors orthogonal to the normal n, R projects onto the surface, and P onto the
//! tangent plane. To second order
//!
//! ```text
//! x ← x + B s − ½ n κ(s, s)
//! v ← v + B t − n (v·W B s) − n κ(s, t) − ½ n N(s, s) − P W B s (v·W B s)
//! ```
//!
//! with κ(s, t) = (B s)·W B t and N the second derivative of n·v along the step. So Newton's
//! systems are exact.

use glam::{DMat3, DVec3};

use super::acceleration::{Frame, UNKNOWNS, flat, gradient, hessian, outer};
use crate::damping::{Damping, Trial, Verdict};
use crate::linalg::skyline::Skyline;
use crate::ragged;
use crate::status::CurveStatus;
use crate::surface::Surface;

/// The last step promises less than this many units of rounding of the energy.
const ROUNDING: f64 = 4.0;

/// Unknowns per node: two of its position, two of its velocity.
const OWN: usize = 4;

/// A node of the spline.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    pub place: DVec3,
    pub velocity: DVec3,
}

/// The condition on a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NodeCondition {
    /// Nothing.
    Free,
    /// It stays where it is.
    Pinned,
    /// It stays where it is, with its velocity.
    Clamped,
    /// ½ weight |x − target|²
    Spring { weight: f64, target: DVec3 },
}

/// One spline: its pieces, its nodes and their conditions.
pub(super) struct Course<'a> {
    pub surface: &'a dyn Surface,
    /// The time along every piece. A closed spline's last piece leads back to node 0.
    pub steps: Vec<f64>,
    pub held: Vec<NodeCondition>,
    pub nodes: Vec<Node>,
    /// Convergence: √(gᵀH⁻¹g) over the root of the energy.
    pub tolerance: f64,
    pub max_iterations: u32,
}

/// How a descent ended.
pub(super) struct DescentEnd {
    pub status: CurveStatus,
    pub iterations: u32,
    /// √(gᵀH⁻¹g)
    pub norm: f64,
}

/// Derivatives by places and velocities of all nodes, and the energy.
struct Evaluated {
    energy: f64,
    by: Vec<[DVec3; 2]>,
}

/// The directions in which the unknowns of a node move its position and its velocity.
type Directions = [[DVec3; 2]; OWN];

impl Course<'_> {
    /// The nodes at the ends of a piece.
    fn ends(&self, piece: usize) -> [usize; 2] {
        [piece, (piece + 1) % self.nodes.len()]
    }

    fn unknowns(&self, nodes: &[Node], piece: usize) -> [DVec3; UNKNOWNS] {
        let [from, to] = self.ends(piece).map(|end| nodes[end]);
        [from.place, from.velocity, to.place, to.velocity]
    }

    fn is_closed(&self) -> bool {
        self.steps.len() == self.nodes.len()
    }

    /// ∫ |P x″|² dt
    fn energy(&self) -> f64 {
        let energy = |piece: usize| gradient(self.surface, &self.unknowns(&self.nodes, piece), self.steps[piece]).0;
        2.0 * (0..self.steps.len()).map(energy).sum::<f64>()
    }

    fn evaluate(&self, nodes: &[Node]) -> Evaluated {
        let (mut energy, mut by) = (0.0, vec![[DVec3::ZERO; 2]; nodes.len()]);
        for (piece, &h) in self.steps.iter().enumerate() {
            let (own, derivatives) = gradient(self.surface, &self.unknowns(nodes, piece), h);
            energy += own;
            for (j, derivative) in derivatives.into_iter().enumerate() {
                by[self.ends(piece)[j / 2]][j % 2] += derivative;
            }
        }
        for ((held, node), by) in self.held.iter().zip(nodes).zip(&mut by) {
            if let NodeCondition::Spring { weight, target } = held {
                energy += 0.5 * weight * node.place.distance_squared(*target);
                by[0] += *weight * (node.place - *target);
            }
        }
        Evaluated { energy, by }
    }

    /// Rounding of an energy, to a factor: x″ is known to ε of itself, and of positions over h².
    fn rounding(&self, energy: f64) -> f64 {
        let far = self.nodes.iter().map(|node| node.place.length()).fold(0.0, f64::max);
        let of_piece = |(piece, &h): (usize, &f64)| {
            let [from, v, to, w] = self.unknowns(&self.nodes, piece);
            let second = (v.distance(w) + (6.0 * (to - from) / h - 3.0 * (v + w)).length()) / h;
            h * (second + 6.0 * far / (h * h)).powi(2)
        };
        let square = self.steps.iter().enumerate().map(of_piece).sum::<f64>() * f64::EPSILON * f64::EPSILON;
        ROUNDING * ((2.0 * energy * square).sqrt() + square)
    }

    /// The first unknown of every node, and how many there are.
    fn firsts(&self) -> Vec<usize> {
        ragged::offsets((0..self.held.len()).map(|node| self.free(node).len()))
    }

    /// A matrix of zeros in which every node is coupled to the one before it, and the last of a
    /// closed spline to the first.
    fn matrix(&self, firsts: &[usize]) -> Skyline {
        let last = self.nodes.len() - 1;
        let mut rows = Vec::with_capacity(firsts[last + 1]);
        for node in 0..=last {
            let first = if node == last && self.is_closed() { 0 } else { firsts[node.saturating_sub(1)] };
            rows.resize(firsts[node + 1], first);
        }
        Skyline::new(rows)
    }

    /// [Descends](Self::descend) about an origin, which the surface's coordinates have, and returns
    /// the energy too. Nodes that stay keep all digits.
    pub fn descend_about(&mut self, origin: DVec3) -> (DescentEnd, f64) {
        let given = self.nodes.clone();
        self.move_by(-origin);
        let found = (self.descend(), self.energy());
        self.move_by(origin);
        for (node, (held, given)) in self.nodes.iter_mut().zip(self.held.iter().zip(given)) {
            if matches!(held, NodeCondition::Pinned | NodeCondition::Clamped) {
                node.place = given.place;
            }
        }
        found
    }

    fn move_by(&mut self, way: DVec3) {
        for node in &mut self.nodes {
            node.place += way;
        }
        for held in &mut self.held {
            if let NodeCondition::Spring { target, .. } = held {
                *target += way;
            }
        }
    }

    /// Descends to the spline of least energy near.
    fn descend(&mut self) -> DescentEnd {
        let firsts = self.firsts();
        let mut matrix = self.matrix(&firsts);
        let mut damping = Damping::<f64>::new();
        let mut evaluated = self.evaluate(&self.nodes);
        let mut ended = DescentEnd { status: CurveStatus::NotConverged, iterations: 0, norm: f64::NAN };
        while evaluated.energy.is_finite() {
            let frames: Vec<Frame> = self.nodes.iter().map(|node| Frame::at(self.surface, node.place)).collect();
            let directions: Vec<Directions> =
                frames.iter().zip(&self.nodes).map(|(frame, node)| directions(frame, node.velocity)).collect();
            let slopes = self.reduced(&directions, &evaluated);
            let accepted = loop {
                self.assemble(&mut matrix, &firsts, &frames, &directions, &evaluated, damping.lambda);
                if matrix.factor() != Some(0) {
                    if damping.stiffen() {
                        continue;
                    }
                    return ended;
                }
                let mut step: Vec<f64> = slopes.iter().map(|slope| -slope).collect();
                matrix.solve(&mut step);
                let slope: f64 = slopes.iter().zip(&step).map(|(g, p)| g * p).sum();
                if damping.lambda == 0.0 {
                    ended.norm = (-slope).max(0.0).sqrt();
                    let least = self.tolerance * self.tolerance * evaluated.energy + self.rounding(evaluated.energy);
                    if -slope <= least {
                        return DescentEnd { status: CurveStatus::Converged, ..ended };
                    }
                }
                if ended.iterations == self.max_iterations {
                    return ended;
                }
                let moved = self.moved(&firsts, &directions, &step);
                let there = self.evaluate(&moved);
                let along = self.reduced(&directions, &there);
                let slope_there = along.iter().zip(&step).map(|(g, p)| g * p).sum();
                let energies = [evaluated.energy, there.energy];
                let trial = Trial { smallest: 1.0, slopes: [slope, slope_there], energies, alpha: 1.0 };
                match damping.judge(&trial) {
                    Verdict::Accept => break Some((moved, there)),
                    Verdict::Again => {}
                    Verdict::Fail => break None,
                }
            };
            let Some((moved, there)) = accepted else { return ended };
            (self.nodes, evaluated) = (moved, there);
            ended.iterations += 1;
        }
        ended
    }

    /// The free unknowns of a node, by their index among its [directions](Directions).
    fn free(&self, node: usize) -> std::ops::Range<usize> {
        match self.held[node] {
            NodeCondition::Clamped => OWN..OWN,
            NodeCondition::Pinned => 2..OWN,
            NodeCondition::Free | NodeCondition::Spring { .. } => 0..OWN,
        }
    }

    /// Derivatives by the unknowns.
    fn reduced(&self, directions: &[Directions], evaluated: &Evaluated) -> Vec<f64> {
        let mut reduced = Vec::with_capacity(OWN * directions.len());
        for (node, (directions, [place, velocity])) in directions.iter().zip(&evaluated.by).enumerate() {
            reduced.extend(self.free(node).map(|k| directions[k][0].dot(*place) + directions[k][1].dot(*velocity)));
        }
        reduced
    }

    /// The nodes after a step of the unknowns.
    fn moved(&self, firsts: &[usize], directions: &[Directions], step: &[f64]) -> Vec<Node> {
        let mut moved = self.nodes.clone();
        for (node, own) in moved.iter_mut().enumerate() {
            if self.held[node] == NodeCondition::Clamped {
                continue;
            }
            for (k, step) in self.free(node).zip(&step[firsts[node]..]) {
                // Without the terms along the normal, which the projection brings.
                if k < 2 {
                    own.place += *step * directions[node][k][0];
                } else {
                    own.velocity += *step * directions[node][k][1];
                }
            }
            if self.held[node] != NodeCondition::Pinned {
                // A place without a projection is NaN, and the trial is refused.
                own.place = self.surface.project(own.place).unwrap_or(DVec3::NAN);
            }
            own.velocity = Frame::at(self.surface, own.place).tangential(own.velocity);
        }
        moved
    }

    /// H + λ L at the nodes, with Newton's matrix H and the matrix L of a flat spline.
    fn assemble(
        &self,
        matrix: &mut Skyline,
        firsts: &[usize],
        frames: &[Frame],
        directions: &[Directions],
        evaluated: &Evaluated,
        lambda: f64,
    ) {
        matrix.clear();
        for (piece, &h) in self.steps.iter().enumerate() {
            let mut second = hessian(self.surface, &self.unknowns(&self.nodes, piece), h);
            if lambda > 0.0 {
                for (blocks, flat) in second.iter_mut().zip(flat(h)) {
                    blocks.iter_mut().zip(flat).for_each(|(block, x)| *block += lambda * x * DMat3::IDENTITY);
                }
            }
            let ends = self.ends(piece);
            for (i, j) in [(0, 0), (1, 0), (1, 1)] {
                for (row, k) in self.free(ends[i]).enumerate() {
                    // The derivative along this direction, by place and velocity of the other end.
                    let mut along = [DVec3::ZERO; 2];
                    for (c, along) in along.iter_mut().enumerate() {
                        for r in 0..2 {
                            *along += second[2 * j + c][2 * i + r] * directions[ends[i]][k][r];
                        }
                    }
                    for (column, l) in self.free(ends[j]).enumerate() {
                        if i == j && column > row {
                            continue;
                        }
                        let [place, velocity] = directions[ends[j]][l];
                        let x = along[0].dot(place) + along[1].dot(velocity);
                        matrix.add(firsts[ends[i]] + row, firsts[ends[j]] + column, x);
                    }
                }
            }
        }
        for (node, frame) in frames.iter().enumerate() {
            if self.free(node).start > 0 {
                continue;
            }
            let by_steps = self.bend(node, frame, evaluated.by[node], lambda);
            let (first, directions) = (firsts[node], &directions[node]);
            let pull = evaluated.by[node][1].dot(frame.normal);
            for a in 0..2 {
                for b in 0..=a {
                    matrix.add(first + a, first + b, directions[a][0].dot(by_steps * directions[b][0]));
                }
                for b in 0..2 {
                    let bent = directions[a][0].dot(frame.shape * directions[2 + b][1]);
                    matrix.add(first + 2 + b, first + a, -pull * bent);
                }
            }
        }
    }

    /// The second derivatives by a node's place that the curvature of the surface brings, and its
    /// spring.
    fn bend(&self, node: usize, frame: &Frame, [by_place, by_velocity]: [DVec3; 2], lambda: f64) -> DMat3 {
        let Node { place, velocity } = self.nodes[node];
        let shape = frame.shape;
        let (push, pull) = (by_place.dot(frame.normal), by_velocity.dot(frame.normal));
        // k = W v, and N as a matrix.
        let k = shape * velocity;
        let turning = frame.turning(self.surface, place, velocity) - shape * (shape * frame.normal).dot(velocity);
        let across = shape * frame.tangential(by_velocity);
        let mut by_steps = shape * -push - turning * pull - outer(across, k) - outer(k, across);
        if let NodeCondition::Spring { weight, .. } = self.held[node] {
            by_steps += (1.0 + lambda) * weight * DMat3::IDENTITY;
        }
        by_steps
    }
}

/// The first-order moves of a node of this velocity by its unknowns.
fn directions(frame: &Frame, velocity: DVec3) -> Directions {
    let (first, second) = frame.normal.any_orthonormal_pair();
    let turned = |along: DVec3| -frame.normal * velocity.dot(frame.shape * along);
    [[first, turned(first)], [second, turned(second)], [DVec3::ZERO, first], [DVec3::ZERO, second]]
}
