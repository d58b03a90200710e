//! The inner product of order 2, 2 w Σ D₂g·D₂h Δa, solved by tridiagonal systems.
//!
//! K is the tridiagonal matrix of order 1, with edge weights 1/Δs. M is the diagonal matrix of the
//! vertices' shares of arc length. Then D₂ = M⁻¹K, and the inner product is w K M⁻¹ K.
//!
//! Pinning vertices leaves two parts:
//!
//! - w K_ff M⁻¹ K_ff, where the rows and columns of pins are deleted in each factor.
//! - D₂ at the pins themselves, for the part normal to the curve. This is the sum over pins p of
//!   u_p u_pᵀ/M_p, where u_p is the column of p in K.
//!
//! The hat function φ_p of pin p falls linearly in arc length to 0 at the next pins. Since
//! K_ff⁻¹u_p = −φ_p, the whole system is solved by
//!
//! ```text
//! y = K_ff⁻¹ g
//! Σ_q P_p G_pq P_q c_q = −P_p Σ_i M_i φ_p(i) y_i      G_pq = Σ_i M_i φ_p(i) φ_q(i),  P_p normal to the curve at p
//! z = K_ff⁻¹ M (y + Σ_p c_p φ_p) / w
//! ```
//!
//! G is tridiagonal in pins. No assembled matrix of condition h⁻⁴ appears, so the same steps work
//! in f32.
//!
//! Where points are attached instead of pinned there are no hats. K is replaced by K + αM, where
//! wα² is the density of the attachment. This product of tridiagonal factors is close to w K M⁻¹ K
//! plus the attachment.

use super::{Pins, Weights, masses, tangent_at};
use crate::discrete::edges::Edges;
use crate::linalg::Scalar;
use crate::linalg::banded::Banded;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

#[derive(Clone, Debug)]
pub(crate) struct Hats<S, const D: usize> {
    stiffness: Banded<S, 1>,
    mass: Vec<S>,
    /// The fraction of the span's arc length that lies before each vertex.
    ///
    /// 0 at pins.
    fraction: Vec<S>,
    inverse_weight: S,
    gram: Gram<S>,
    /// The number of pins of each lane.
    counts: Vec<usize>,
    closed: bool,
    /// 1 where a component of a pin's turn is unknown.
    ///
    /// 0 at the ends of open curves and where a lane has no such pin.
    turning: Vec<S>,
    tangents: Vec<Vector<S, D>>,
    /// The turns c of the pins.
    ///
    /// A closed lane has one more, which repeats its first.
    turns: Vec<Vector<S, D>>,
    unknowns: Vec<Vector<S, 1>>,
}

/// The system of the pins with interleaved coordinates, in blocks of 2 or 3 rows a pin.
#[derive(Clone, Debug)]
enum Gram<S> {
    None,
    Planar(Banded<S, 3>),
    Spatial(Banded<S, 5>),
}

macro_rules! each {
    ($gram:expr, $matrix:ident => $body:expr) => {
        match $gram {
            Gram::None => unreachable!("a system without pins is not solved"),
            Gram::Planar($matrix) => $body,
            Gram::Spatial($matrix) => $body,
        }
    };
}

impl<S: Scalar, const D: usize> Hats<S, D> {
    pub fn new(edges: &Edges<S, D>, pins: &Pins<S>) -> Self {
        let closed = edges.is_closed();
        let vertices = edges.vertices();
        let counts: Vec<usize> = vertices.iter().map(|&n| pins.rows.iter().filter(|&&row| row < n).count()).collect();
        let most = counts.iter().copied().max().unwrap_or(0);
        // The ends of an open curve are free to turn, because no D₂ stands there. The only pin of a
        // closed curve turns freely, because it has nothing to turn against.
        let inner = if closed { counts.iter().all(|&pins| pins > 1) } else { most > 2 };
        let rows: Vec<usize> = counts.iter().map(|pins| pins * D).collect();
        let mut turning = vec![S::ZERO; if inner { most * D } else { 0 }];
        for (row, movable) in turning.iter_mut().enumerate() {
            for (lane, &count) in counts.iter().enumerate() {
                let pin = row / D;
                let held = if closed { pin >= count } else { pin == 0 || pin + 1 >= count };
                movable.set_lane(lane, if held { S::ZERO.lane(0) } else { S::ONE.lane(0) });
            }
        }
        let gram = match (inner, D) {
            (false, _) => Gram::None,
            (true, 2) => Gram::Planar(Banded::new(closed, &rows)),
            (true, _) => Gram::Spatial(Banded::new(closed, &rows)),
        };
        Hats {
            stiffness: Banded::new(closed, &vertices),
            mass: vec![S::ZERO; edges.rows()],
            fraction: vec![S::ZERO; edges.rows()],
            inverse_weight: S::ONE,
            gram,
            counts,
            closed,
            turning,
            tangents: vec![[S::ZERO; D]; most + 1],
            turns: vec![[S::ZERO; D]; most + 1],
            unknowns: vec![[S::ZERO]; most * D],
        }
    }

    #[inline(always)]
    pub fn freeze(&mut self, edges: &Edges<S, D>, pins: &Pins<S>, weights: &Weights<S>) -> S {
        self.inverse_weight = S::ONE / weights.highest;
        masses(edges, &mut self.mass);
        self.stiffness.clear();
        for j in 0..edges.most() {
            self.stiffness.add(j, edges.exists(j) * edges.inverse[j], [S::ONE, -S::ONE]);
        }
        if weights.attached {
            let (mut attached, mut length) = (S::ZERO, S::ZERO);
            for row in 0..edges.rows() {
                attached += weights.vertices[row];
                length += self.mass[row];
            }
            let alpha = (attached / (length * weights.highest)).sqrt();
            for row in 0..edges.rows() {
                self.stiffness.add_diagonal(row, alpha * self.mass[row]);
            }
        }
        let smallest = self.stiffness.factor(&pins.movable);
        if !matches!(self.gram, Gram::None) {
            let of_pins = self.freeze_pins(edges, pins);
            return -((-smallest).max(-of_pins));
        }
        smallest
    }

    /// The rows of the vertices strictly between pin k and the next.
    fn span(&self, pins: &Pins<S>, k: usize, rows: usize) -> std::ops::Range<usize> {
        pins.rows[k] + 1..pins.rows.get(k + 1).copied().unwrap_or(rows)
    }

    #[inline(always)]
    fn freeze_pins(&mut self, edges: &Edges<S, D>, pins: &Pins<S>) -> S {
        each!(&mut self.gram, matrix => matrix.clear());
        let count = pins.rows.len();
        for k in 0..count {
            self.tangents[k] = tangent_at(edges, pins.rows[k]);
        }
        self.tangents[count] = self.tangents[0];
        // The part of the next pin's own entry that comes from the span before it.
        let mut before = S::ZERO;
        for k in 0..count {
            let span = self.span(pins, k, edges.most());
            let mut length = S::ZERO;
            for j in pins.rows[k]..span.end {
                self.fraction[j] = length;
                length += edges.exists(j) * edges.length[j];
            }
            // A lane may have no such span.
            let inverse = length.if_positive(S::ONE / length, S::ZERO);
            self.fraction[pins.rows[k]] = S::ZERO;
            let (mut here, mut both, mut next) = (self.mass[pins.rows[k]], S::ZERO, S::ZERO);
            for i in span {
                let theta = self.fraction[i] * inverse;
                let rest = S::ONE - theta;
                self.fraction[i] = theta;
                here += self.mass[i] * rest * rest;
                both += self.mass[i] * rest * theta;
                next += self.mass[i] * theta * theta;
            }
            // On a closed lane whose last pin this is, the part belongs to its first pin.
            let (mut exists, mut wrapped, mut after) = (S::ZERO, S::ZERO, self.tangents[k + 1]);
            for (lane, &own) in self.counts.iter().enumerate() {
                exists.set_lane(lane, if k < own { S::ONE.lane(0) } else { S::ZERO.lane(0) });
                if self.closed && k + 1 == own {
                    wrapped.set_lane(lane, next.lane(lane));
                    next.set_lane(lane, S::ZERO.lane(0));
                    (0..D).for_each(|c| after[c].set_lane(lane, self.tangents[0][c].lane(lane)));
                }
            }
            self.add_pin(k, exists * (before + here), exists, self.tangents[k]);
            self.add_pin(0, wrapped, S::ZERO, self.tangents[0]);
            if self.closed || k + 1 < count {
                self.add_coupling(k, both, self.tangents[k], after);
            }
            before = next;
        }
        each!(&mut self.gram, matrix => matrix.factor(&self.turning))
    }

    /// Adds P G_pp + T Tᵀ.
    ///
    /// The second term keeps the matrix positive along the curve, where nothing turns.
    #[inline(never)]
    fn add_pin(&mut self, k: usize, own: S, along: S, tangent: Vector<S, D>) {
        each!(&mut self.gram, matrix => {
            for c in 0..D {
                for d in 0..c {
                    matrix.add_entry(k * D + c, k * D + d, (along - own) * tangent[c] * tangent[d]);
                }
                matrix.add_diagonal(k * D + c, own + (along - own) * tangent[c] * tangent[c]);
            }
        })
    }

    /// P_k G P_{k+1}
    #[inline(never)]
    fn add_coupling(&mut self, k: usize, both: S, here: Vector<S, D>, next: Vector<S, D>) {
        let mut cosine = S::ZERO;
        (0..D).for_each(|c| cosine += here[c] * next[c]);
        each!(&mut self.gram, matrix => {
            for c in 0..D {
                for d in 0..D {
                    let identity = if c == d { S::ONE } else { S::ZERO };
                    // Component d is of this pin, and component c of the next.
                    let product = identity - here[d] * here[c] - next[d] * next[c] + here[d] * cosine * next[c];
                    matrix.add_entry((k + 1) * D + c, k * D + d, both * product);
                }
            }
        })
    }

    #[inline(always)]
    pub fn solve(&mut self, pins: &Pins<S>, z: &mut [Vector<S, D>]) {
        self.stiffness.solve(z);
        if !matches!(self.gram, Gram::None) {
            self.turn_at_pins(pins, z);
        }
        for (row, z) in z.iter_mut().enumerate() {
            *z = scale(self.inverse_weight * pins.movable[row] * self.mass[row], *z);
        }
        self.stiffness.solve(z);
    }

    /// Adds Σ c_p φ_p.
    #[inline(always)]
    fn turn_at_pins(&mut self, pins: &Pins<S>, y: &mut [Vector<S, D>]) {
        let last = y.len() - 1;
        self.turns.fill([S::ZERO; D]);
        for k in 0..pins.rows.len() {
            let (mut here, mut next) = ([S::ZERO; D], [S::ZERO; D]);
            for i in self.span(pins, k, last) {
                let weighted = scale(self.mass[i], y[i]);
                let toward = scale(self.fraction[i], weighted);
                next = add(next, toward);
                here = add(here, subtract(weighted, toward));
            }
            self.turns[k] = subtract(self.turns[k], here);
            self.turns[k + 1] = subtract(self.turns[k + 1], next);
        }
        self.solve_turns();
        for k in 0..pins.rows.len() {
            let (here, next) = (self.turns[k], self.turns[k + 1]);
            for i in self.span(pins, k, last) {
                let turn = add(here, scale(self.fraction[i], subtract(next, here)));
                y[i] = add(y[i], turn);
            }
        }
    }

    /// Computes the turns from the integrals over the hats.
    #[inline(never)]
    fn solve_turns(&mut self) {
        if self.closed {
            for (lane, &count) in self.counts.iter().enumerate() {
                for c in 0..D {
                    let sum = self.turns[0][c].lane(lane) + self.turns[count][c].lane(lane);
                    self.turns[0][c].set_lane(lane, sum);
                }
            }
        }
        for (k, unknowns) in self.unknowns.chunks_exact_mut(D).enumerate() {
            let (tangent, turn) = (self.tangents[k], self.turns[k]);
            let across = subtract(turn, scale(dot(tangent, turn), tangent));
            (0..D).for_each(|c| unknowns[c] = [self.turning[k * D + c] * across[c]]);
        }
        each!(&self.gram, matrix => matrix.solve(&mut self.unknowns));
        for (k, unknowns) in self.unknowns.chunks_exact(D).enumerate() {
            (0..D).for_each(|c| self.turns[k][c] = unknowns[c][0]);
        }
        if self.closed {
            for (lane, &count) in self.counts.iter().enumerate() {
                for c in 0..D {
                    let first = self.turns[0][c].lane(lane);
                    self.turns[count][c].set_lane(lane, first);
                }
            }
        }
    }
}
