//! [`Course`]: one spline in a surface, by Newton's method on places and velocities.
//!
//! The unknowns of a node are a step s in its tangent plane and a change t of its velocity there:
//!
//! ```text
//! x ← R(x + B s),  v ← P(v + B t) at the new place
//! ```
//!
//! B holds two unit vectors across the normal n, R goes to the foot, and P to the tangent plane. To second order
//!
//! ```text
//! x ← x + B s − ½ n κ(s, s)
//! v ← v + B t − n (v·W B s) − n κ(s, t) − ½ n N(s, s) − P W B s (v·W B s)
//! ```
//!
//! with κ(s, t) = (B s)·W B t and N the second derivative of n·v along the way. Newton's systems are exact therefore.

use glam::{DMat3, DVec3};

use super::acceleration::{Frame, UNKNOWNS, flat, gradient, hessian, outer};
use crate::damping::{Damping, Trial, Verdict};
use crate::linalg::skyline::Skyline;
use crate::status::CurveStatus;
use crate::surface::Surface;

/// A step that promises less than this many units of rounding of the energy is the last.
const ROUNDING: f64 = 4.0;

/// Unknowns a node: two of its place, two of its velocity.
const OWN: usize = 4;

/// A node of the spline.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    pub place: DVec3,
    pub velocity: DVec3,
}

/// What a node is held by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Held {
    /// Nothing.
    Free,
    /// It stays where it is.
    Pinned,
    /// It stays where it is, with its velocity.
    Clamped,
    /// ½ weight |x − target|²
    Spring { weight: f64, target: DVec3 },
}

/// One spline: its pieces, and what holds its nodes.
pub(super) struct Course<'a> {
    pub surface: &'a dyn Surface,
    /// The time along every piece. That of a closed spline's last piece leads back to node 0.
    pub steps: Vec<f64>,
    pub held: Vec<Held>,
    pub nodes: Vec<Node>,
    /// When it has converged: √(gᵀH⁻¹g) over the root of the energy.
    pub tolerance: f64,
    pub max_iterations: u32,
}

/// How a descent ended.
pub(super) struct Ended {
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

/// The directions in which the unknowns of a node move its place and its velocity.
type Directions = [[DVec3; 2]; OWN];

/// The numbering of the unknowns.
struct Numbers {
    /// The first number of every node, and how many there are.
    first: Vec<usize>,
    count: usize,
}

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
            if let Held::Spring { weight, target } = held {
                energy += 0.5 * weight * node.place.distance_squared(*target);
                by[0] += *weight * (node.place - *target);
            }
        }
        Evaluated { energy, by }
    }

    /// What rounding leaves of an energy, to a factor: x″ is known to ε of itself, and to that of places over h².
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

    fn numbers(&self) -> Numbers {
        let mut count = 0;
        let first = (0..self.held.len()).map(|node| {
            let first = count;
            count += self.free(node).len();
            first
        });
        Numbers { first: first.collect(), count }
    }

    /// A matrix of zeros in which every node is coupled to the one before it, and the last of a closed spline to the first.
    fn matrix(&self, numbers: &Numbers) -> Skyline {
        let last = self.nodes.len() - 1;
        let first = |row: usize| {
            let node = numbers.first.partition_point(|&first| first <= row) - 1;
            if node == last && self.is_closed() { 0 } else { numbers.first[node.saturating_sub(1)] }
        };
        Skyline::new((0..numbers.count).map(first).collect())
    }

    /// [Descends](Self::descend) about an origin, which the surface's coordinates have, and returns the energy too. Nodes that
    /// stay keep all digits.
    pub fn descend_about(&mut self, origin: DVec3) -> (Ended, f64) {
        let given = self.nodes.clone();
        self.move_by(-origin);
        let found = (self.descend(), self.energy());
        self.move_by(origin);
        for (node, (held, given)) in self.nodes.iter_mut().zip(self.held.iter().zip(given)) {
            if matches!(held, Held::Pinned | Held::Clamped) {
                node.place = given.place;
            }
        }
        found
    }

    fn move_by(&mut self, way: DVec3) {
        self.nodes.iter_mut().for_each(|node| node.place += way);
        for held in &mut self.held {
            if let Held::Spring { target, .. } = held {
                *target += way;
            }
        }
    }

    /// Descends to the spline of least energy near.
    fn descend(&mut self) -> Ended {
        let numbers = self.numbers();
        let mut matrix = self.matrix(&numbers);
        let mut damping = Damping::<f64>::new();
        let mut evaluated = self.evaluate(&self.nodes);
        let mut ended = Ended { status: CurveStatus::NotConverged, iterations: 0, norm: f64::NAN };
        while evaluated.energy.is_finite() {
            let frames: Vec<Frame> = self.nodes.iter().map(|node| Frame::at(self.surface, node.place)).collect();
            let directions: Vec<Directions> =
                frames.iter().zip(&self.nodes).map(|(frame, node)| directions(frame, node.velocity)).collect();
            let slopes = self.reduced(&numbers, &directions, &evaluated);
            let accepted = loop {
                self.assemble(&mut matrix, &numbers, &frames, &directions, &evaluated, damping.lambda);
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
                        return Ended { status: CurveStatus::Converged, ..ended };
                    }
                }
                if ended.iterations == self.max_iterations {
                    return ended;
                }
                let moved = self.moved(&numbers, &directions, &step);
                let there = self.evaluate(&moved);
                let along = self.reduced(&numbers, &directions, &there);
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

    /// The unknowns of a node that are free, by their place among its [directions](Directions).
    fn free(&self, node: usize) -> std::ops::Range<usize> {
        match self.held[node] {
            Held::Clamped => OWN..OWN,
            Held::Pinned => 2..OWN,
            Held::Free | Held::Spring { .. } => 0..OWN,
        }
    }

    /// Derivatives by the unknowns.
    fn reduced(&self, numbers: &Numbers, directions: &[Directions], evaluated: &Evaluated) -> Vec<f64> {
        let mut reduced = Vec::with_capacity(numbers.count);
        for (node, (directions, [place, velocity])) in directions.iter().zip(&evaluated.by).enumerate() {
            reduced.extend(self.free(node).map(|k| directions[k][0].dot(*place) + directions[k][1].dot(*velocity)));
        }
        reduced
    }

    /// The nodes after a step of the unknowns.
    fn moved(&self, numbers: &Numbers, directions: &[Directions], step: &[f64]) -> Vec<Node> {
        let moved = |(node, own): (usize, &Node)| {
            if self.held[node] == Held::Clamped {
                return *own;
            }
            let mut node_moved = *own;
            for (k, step) in self.free(node).zip(&step[numbers.first[node]..]) {
                // Without the terms along the normal, which the way back to the surface brings.
                if k < 2 {
                    node_moved.place += *step * directions[node][k][0];
                } else {
                    node_moved.velocity += *step * directions[node][k][1];
                }
            }
            if self.held[node] != Held::Pinned {
                // A place that has no foot is no number, and the trial is refused.
                node_moved.place = self.surface.foot(node_moved.place).unwrap_or(DVec3::NAN);
            }
            node_moved.velocity = Frame::at(self.surface, node_moved.place).tangential(node_moved.velocity);
            node_moved
        };
        self.nodes.iter().enumerate().map(moved).collect()
    }

    /// H + λ L at the nodes, with Newton's matrix H and that of a flat spline L.
    fn assemble(
        &self,
        matrix: &mut Skyline,
        numbers: &Numbers,
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
                        matrix.add(numbers.first[ends[i]] + row, numbers.first[ends[j]] + column, x);
                    }
                }
            }
        }
        for (node, frame) in frames.iter().enumerate() {
            self.bend(matrix, numbers.first[node], node, frame, &directions[node], evaluated.by[node], lambda);
        }
    }

    /// Adds what the curvature of the surface brings at a node, and what its spring does.
    #[allow(clippy::too_many_arguments)]
    fn bend(
        &self,
        matrix: &mut Skyline,
        first: usize,
        node: usize,
        frame: &Frame,
        directions: &Directions,
        [by_place, by_velocity]: [DVec3; 2],
        lambda: f64,
    ) {
        if matches!(self.held[node], Held::Pinned | Held::Clamped) {
            return;
        }
        let Node { place, velocity } = self.nodes[node];
        let shape = frame.shape;
        let (push, pull) = (by_place.dot(frame.normal), by_velocity.dot(frame.normal));
        // k = W v, and N as a matrix.
        let k = shape * velocity;
        let turning = frame.turning(self.surface, place, velocity) - shape * (shape * frame.normal).dot(velocity);
        let across = shape * frame.tangential(by_velocity);
        let mut by_steps = shape * -push - turning * pull - outer(across, k) - outer(k, across);
        if let Held::Spring { weight, .. } = self.held[node] {
            by_steps += (1.0 + lambda) * weight * DMat3::IDENTITY;
        }
        for a in 0..2 {
            for b in 0..=a {
                matrix.add(first + a, first + b, directions[a][0].dot(by_steps * directions[b][0]));
            }
            for b in 0..2 {
                let bent = directions[a][0].dot(shape * directions[2 + b][1]);
                matrix.add(first + 2 + b, first + a, -pull * bent);
            }
        }
    }
}

/// How the unknowns of a node of this velocity move it, to first order.
fn directions(frame: &Frame, velocity: DVec3) -> Directions {
    let (first, second) = frame.normal.any_orthonormal_pair();
    let turned = |along: DVec3| -frame.normal * velocity.dot(frame.shape * along);
    [[first, turned(first)], [second, turned(second)], [DVec3::ZERO, first], [DVec3::ZERO, second]]
}
