//! [`Blocks`]: block tridiagonal matrices of small blocks, cyclic for closed chains.

// Index loops read as the formulas do.
#![allow(clippy::needless_range_loop)]

use crate::linalg::block_ring::{BlockSystem, MOST_REACH, solve_blocks};

/// The most rows of a block: G1 joints in space.
pub(super) const MOST_ROWS: usize = 4;

/// A number per row of a block. Numbers beyond the last row are unused.
pub(super) type Row = [f64; MOST_ROWS];

/// A symmetric matrix with a row of blocks per joint.
pub(super) struct Blocks {
    pub closed: bool,
    /// Rows of a block.
    pub rows: usize,
    /// The diagonal block of each joint, and its coupling with the next.
    pub blocks: Vec<[[Row; MOST_ROWS]; 2]>,
    /// Whether a joint moves. Other rows of blocks are rows of the identity.
    pub movable: Vec<bool>,
}

impl Blocks {
    /// The zero matrix.
    pub fn new(closed: bool, rows: usize, movable: Vec<bool>) -> Self {
        Blocks { closed, rows, blocks: vec![[[[0.0; MOST_ROWS]; MOST_ROWS]; 2]; movable.len()], movable }
    }

    /// Multiplies rows and columns by factors.
    pub fn scale(&mut self, factors: &[Row]) {
        let count = self.blocks.len();
        for (joint, [own, coupling]) in self.blocks.iter_mut().enumerate() {
            let (left, right) = (factors[joint], factors[(joint + 1) % count]);
            for i in 0..self.rows {
                for j in 0..self.rows {
                    own[i][j] *= left[i] * left[j];
                    coupling[i][j] *= left[i] * right[j];
                }
            }
        }
    }

    /// Solves with `damping` added to the diagonal. Returns the unknowns of each right-hand side,
    /// and the smallest pivot.
    pub fn solve(&self, sides: &[Vec<Row>], damping: f64) -> (Vec<Vec<Row>>, f64) {
        match self.rows {
            2 => self.solve_rows::<2>(sides, damping),
            3 => self.solve_rows::<3>(sides, damping),
            _ => self.solve_rows::<4>(sides, damping),
        }
    }

    fn solve_rows<const N: usize>(&self, sides: &[Vec<Row>], damping: f64) -> (Vec<Vec<Row>>, f64) {
        let mut blocks = vec![[[[0.0; N]; N]; MOST_REACH + 1]; self.blocks.len()];
        for (to, from) in blocks.iter_mut().zip(&self.blocks) {
            for i in 0..N {
                for j in 0..N {
                    to[0][i][j] = from[0][i][j];
                    to[1][i][j] = from[1][i][j];
                }
                to[0][i][i] += damping;
            }
        }
        let system = BlockSystem { closed: self.closed, reach: 1, blocks: &blocks, movable: &self.movable };
        let (mut unknowns, mut smallest) = (Vec::with_capacity(sides.len()), f64::INFINITY);
        let mut rhs = vec![[0.0; N]; blocks.len()];
        for side in sides {
            for (to, from) in rhs.iter_mut().zip(side) {
                to.copy_from_slice(&from[..N]);
            }
            let solution = solve_blocks(&system, &rhs, 1);
            let mut x = vec![[0.0; MOST_ROWS]; blocks.len()];
            for (to, from) in x.iter_mut().zip(&solution.x) {
                to[..N].copy_from_slice(from);
            }
            unknowns.push(x);
            smallest = smallest.min(solution.smallest);
        }
        (unknowns, smallest)
    }
}
