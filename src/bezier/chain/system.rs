//! The joints of a chain as one block tridiagonal system, cyclic if the chain is closed.
//!
//! The matrix sums the quadratic forms of the pieces.

use std::collections::HashMap;

use glam::DVec3;

use super::blocks::{Blocks, MOST_ROWS, Row};
use super::joint::Joint;
use super::layout::{Layout, Trouble};
use super::piece::{Piece, Sized, combined};
use crate::batch::CurveBatch;
use crate::report::CurveReport;
use crate::status::CurveStatus;

/// A curve with its linear system.
///
/// The matrix has a unit diagonal. There is one right-hand side per coordinate.
pub(super) struct System<'a> {
    pub layout: Layout<'a>,
    smoothness: usize,
    joints: Vec<Joint>,
    pieces: Vec<(&'a Piece, Sized)>,
    pub matrix: Blocks,
    pub rhs: Vec<Vec<Row>>,
    /// The factor from an unknown of the scaled matrix to the unknown itself.
    scale: Vec<Row>,
    /// The terms of the diagonal without their signs.
    magnitudes: Vec<Row>,
}

/// A curve completed.
pub(super) struct Done {
    pub coords: Vec<f64>,
    pub energy: f64,
    pub status: CurveStatus,
    /// Iterations of Newton's method. 1 for a direct solve.
    pub iterations: u32,
    /// The gradient of Newton's method at the end.
    pub gradient_norm: f64,
    /// The joint at fault, and its problem.
    pub message: Option<(usize, String)>,
}

impl Done {
    pub fn report(&self, batch: &CurveBatch, i: usize) -> CurveReport {
        CurveReport {
            status: self.status,
            message: self.message.as_ref().map(|(point, what)| batch.sentence(i, *point, what)),
            iterations: self.iterations,
            gradient_norm: self.gradient_norm,
            ..CurveReport::solved(self.energy)
        }
    }
}

/// A sum below this, relative to its terms, counts as 0.
const SINGULAR: f64 = 1e-13;

/// The largest pivot that counts as singular, up to rounding.
///
/// Measured pivots of singular matrices grow with the square of the number of joints, to 1e-9.
/// Pivots of splines with n consecutive unknown joints are about 1/n.
fn singular(joints: usize) -> f64 {
    (SINGULAR * (joints as f64).powi(2)).min(2e-9)
}

/// Rows of a block: the most unknowns of a joint per coordinate.
pub(super) fn rows(smoothness: usize) -> usize {
    smoothness.max(1) + 1
}

impl<'a> System<'a> {
    /// Sets up the system, with the forms of all patterns of inner points in `pieces`.
    ///
    /// # Errors
    /// Contradictory conditions at a joint.
    pub fn new(layout: Layout<'a>, smoothness: usize, pieces: &'a HashMap<u32, Piece>) -> Result<Self, Trouble> {
        let count = layout.joints();
        let joints: Vec<Joint> =
            (0..count).map(|joint| layout.joint(joint, smoothness)).collect::<Result<_, Trouble>>()?;
        let sized = |k: usize| {
            let piece = &pieces[&layout.inner(k, smoothness)];
            (piece, piece.sized(layout.lengths[k]))
        };
        let pieces = (0..layout.pieces).map(sized).collect();
        let movable = joints.iter().map(|joint| joint.free > 0).collect();
        let matrix = Blocks::new(layout.closed, rows(smoothness), movable);
        let rhs = vec![vec![Row::default(); count]; layout.dimension()];
        let (scale, magnitudes) = (vec![[1.0; MOST_ROWS]; count], vec![Row::default(); count]);
        let mut system = System { layout, smoothness, joints, pieces, matrix, rhs, scale, magnitudes };
        for k in 0..system.pieces.len() {
            system.add(k);
        }
        system.normalise();
        Ok(system)
    }

    /// Adds the form of a piece.
    fn add(&mut self, k: usize) {
        let (a, b) = (k, self.layout.next(k));
        let (piece, sized) = &self.pieces[k];
        let (jet, columns, h) = (self.smoothness + 1, piece.columns(), self.layout.lengths[k]);
        let base = [a, b].map(|joint| self.joints[joint].jet(|_| DVec3::ZERO, h));
        let inner = |j: usize| self.layout.relative(self.layout.place(k, j));
        let data = piece.data([&base[0][..jet], &base[1][..jet]], inner, base[0][0]);
        let slope: Vec<DVec3> = (0..2 * jet).map(|i| combined(&sized.gram[i * columns..][..columns], &data)).collect();
        // The jet at an end as a function of the unknowns.
        let by_unknown = |joint: usize| {
            let own = &self.joints[joint];
            let ratio = h / own.scale;
            let powers = DVec3::new(1.0, ratio, ratio * ratio);
            own.basis[..own.free].iter().map(move |row| row * powers)
        };
        let product = |x: DVec3, from: usize, y: DVec3, to: usize| -> f64 {
            let entries = (0..jet).flat_map(|r| (0..jet).map(move |s| (r, s)));
            entries.map(|(r, s)| x[r] * sized.gram[(from * jet + r) * columns + to * jet + s] * y[s]).sum()
        };
        let magnitude = |x: DVec3, end: usize| -> f64 {
            let entries = (0..jet).flat_map(|r| (0..jet).map(move |s| (r, s)));
            entries.map(|(r, s)| (x[r] * sized.gram[(end * jet + r) * columns + end * jet + s] * x[s]).abs()).sum()
        };
        let (mut own, mut sides) = ([[Row::default(); MOST_ROWS]; 3], [[DVec3::ZERO; MOST_ROWS]; 2]);
        for (block, (from, to)) in own.iter_mut().zip([(0, 0), (1, 1), (0, 1)]) {
            for (i, x) in by_unknown([a, b][from]).enumerate() {
                for (j, y) in by_unknown([a, b][to]).enumerate() {
                    block[i][j] = product(x, from, y, to);
                }
            }
        }
        for (end, side) in sides.iter_mut().enumerate() {
            for (i, x) in by_unknown([a, b][end]).enumerate() {
                self.magnitudes[[a, b][end]][i] += magnitude(x, end);
                for r in 0..jet {
                    side[i] -= x[r] * slope[end * jet + r];
                }
            }
        }
        for (joint, place, block) in [(a, 0, own[0]), (b, 0, own[1]), (a, 1, own[2])] {
            let to = self.matrix.blocks[joint][place].as_flattened_mut();
            for (to, x) in to.iter_mut().zip(block.as_flattened()) {
                *to += x;
            }
        }
        for (joint, side) in [(a, sides[0]), (b, sides[1])] {
            for (c, rhs) in self.rhs.iter_mut().enumerate() {
                for (to, x) in rhs[joint].iter_mut().zip(side) {
                    *to += x[c];
                }
            }
        }
    }

    /// Scales the diagonal to 1, and puts 1 where a joint has fewer unknowns than a block has rows.
    fn normalise(&mut self) {
        let count = self.joints.len();
        for (joint, scale) in self.scale.iter_mut().enumerate() {
            let block = &mut self.matrix.blocks[joint];
            for i in 0..self.joints[joint].free {
                // The only joint of a closed chain is coupled to itself.
                let coupled = if self.layout.closed && count == 1 { 2.0 * block[1][i][i] } else { 0.0 };
                let own = block[0][i][i] + coupled;
                if own > SINGULAR * self.magnitudes[joint][i] {
                    scale[i] = 1.0 / own.sqrt();
                } else {
                    // The rest is rounding: the matrix is singular.
                    block[0][i][i] = -coupled;
                }
            }
        }
        self.matrix.scale(&self.scale);
        for joint in 0..count {
            for i in self.joints[joint].free..self.matrix.rows {
                self.matrix.blocks[joint][0][i][i] = 1.0;
            }
            for rhs in &mut self.rhs {
                for (x, scale) in rhs[joint].iter_mut().zip(self.scale[joint]) {
                    *x *= scale;
                }
            }
        }
    }

    /// Solves on this thread. Returns the unknowns of each coordinate, and the smallest pivot.
    pub fn solve(&self) -> (Vec<Vec<Row>>, f64) {
        if !self.matrix.movable.contains(&true) {
            return (self.rhs.clone(), 1.0);
        }
        self.matrix.solve(&self.rhs, 0.0)
    }

    /// The residuals of the right-hand sides.
    pub fn residual(&self, x: &[Vec<Row>]) -> Vec<Vec<Row>> {
        let (count, rows) = (self.joints.len(), self.matrix.rows);
        let residual = |(rhs, x): (&Vec<Row>, &Vec<Row>)| {
            let mut left = rhs.clone();
            for (joint, block) in self.matrix.blocks.iter().enumerate() {
                let next = (joint + 1) % count;
                for (i, j) in (0..rows).flat_map(|i| (0..rows).map(move |j| (i, j))) {
                    left[joint][i] -= block[0][i][j] * x[joint][j];
                    if joint + 1 < count || self.layout.closed {
                        left[joint][i] -= block[1][i][j] * x[next][j];
                        left[next][j] -= block[1][i][j] * x[joint][i];
                    }
                }
            }
            left
        };
        self.rhs.iter().zip(x).map(residual).collect()
    }

    /// The control points for these unknowns.
    ///
    /// # Errors
    /// A singular matrix, or numbers that overflow.
    pub fn finish(&self, x: &[Vec<Row>], smallest: f64) -> Result<Done, Trouble> {
        if smallest.is_nan() || smallest <= singular(self.joints.len()) {
            return Err(self.undetermined());
        }
        let unknown = |joint: usize, i: usize| {
            let mut value = DVec3::ZERO;
            for (c, x) in x.iter().enumerate() {
                value[c] = x[joint][i] * self.scale[joint][i];
            }
            value
        };
        let mut coords = self.layout.coords();
        let mut energy = 0.0;
        for (k, (piece, sized)) in self.pieces.iter().enumerate() {
            let ends = [k, self.layout.next(k)];
            let jets = ends.map(|joint| self.joints[joint].jet(|i| unknown(joint, i), self.layout.lengths[k]));
            let jets = jets.each_ref().map(|jet| &jet[..=self.smoothness]);
            energy += finish_piece(&self.layout, k, piece, sized, jets, &mut coords);
        }
        let unique = self.pieces.iter().all(|(piece, _)| piece.is_unique);
        let status = if unique { CurveStatus::Converged } else { CurveStatus::NotUnique };
        done(coords, energy, status)
    }

    fn undetermined(&self) -> Trouble {
        let joint = self.joints.iter().position(|joint| joint.free > 0).unwrap_or(0);
        let known =
            (0..self.layout.coords().len() / self.layout.dimension()).filter(|&k| self.layout.is_known(k)).count();
        let what = format!(
            "the energy does not determine the chain from {known} known control points: give more of them, or a \
             tangent, or let the energy weigh a lower order"
        );
        (CurveStatus::Degenerate, self.layout.joint_place(joint), what)
    }
}

/// Writes the points of a piece from the jets at its ends (with respect to u). Returns its energy.
pub(super) fn finish_piece(
    layout: &Layout,
    k: usize,
    piece: &Piece,
    sized: &Sized,
    jets: [&[DVec3]; 2],
    coords: &mut [f64],
) -> f64 {
    let origin = jets[0][0];
    let data = piece.data(jets, |j| layout.relative(layout.place(k, j)), origin);
    let absolute = layout.origin + origin;
    layout.put(coords, layout.place(k, 0), absolute);
    layout.put(coords, layout.place(k, layout.degree), layout.origin + jets[1][0]);
    piece.make(sized, &data, absolute, |j, point| layout.put(coords, layout.place(k, j), point))
}

/// A curve completed, if its numbers are finite.
pub(super) fn done(coords: Vec<f64>, energy: f64, status: CurveStatus) -> Result<Done, Trouble> {
    if coords.iter().all(|x| x.is_finite()) && energy.is_finite() {
        return Ok(Done { coords, energy, status, iterations: 1, gradient_norm: 0.0, message: None });
    }
    Err((CurveStatus::Invalid, 0, "the completed control points overflow: give more, or smaller, numbers".into()))
}
