//! Block-banded symmetric positive definite systems, open and cyclic, by partition and cyclic
//! reduction over a ring of lanes.
//!
//! The systems are those of Newton's method for discrete curves: D × D blocks, a vertex being
//! coupled with the next `reach` (2 for bending, 3 for variation). Lanes share a curve. Each keeps
//! the first `reach` vertices of its chunk and eliminates the others one after the other, by a
//! Cholesky factorisation that carries along what couples them with the kept ones; kept vertices
//! and those of the next chunk separate the chunk from all others, so that the kept ones form a
//! cyclic block tridiagonal system of blocks of `reach` vertices. That is reduced by log₂ P steps
//! of cyclic reduction, each of which eliminates every second lane left; then they substitute back,
//! in the opposite order, and every lane its chunk.
//!
//! It is one Cholesky factorisation of the matrix with its rows in another order, and as stable:
//! the residual is one of rounding, whatever the condition. Eliminating every row from its
//! neighbours' would spare the way back, but leaves the unknowns with errors that have nothing to
//! do with each other, which a stiff direction multiplies by the condition.
//!
//! A ring makes open (the last chunk is coupled with nothing) and closed curves the same code.
//! Chunks may be of any length from `reach` vertices on, so that nothing is padded; a ring of one
//! lane is the factorisation with a border. On short closed curves the next chunk is the own one:
//! several blocks then share a place, and add up there.
//!
//! Each pivot is one of a Schur complement: positive wherever the matrix is positive definite, so
//! that nothing is pivoted, and the smallest says whether it was. Source: Golub and Van Loan,
//! Matrix Computations, 4th ed., 4.3 and 4.5.4.

mod dense;
mod gpu;
mod lanes;
#[cfg(test)]
mod tests;

pub use dense::Block;
pub use gpu::{BLOCK_LANES, BlockBatch, BlockSolutions, block_ring_kernels, solve_blocks_on_gpu};
pub use lanes::{BlockSolution, solve_blocks};

use super::Scalar;

/// A vertex is coupled with so many of those after it at most.
pub const MOST_REACH: usize = 3;

/// A block-banded symmetric system of one curve.
#[derive(Clone, Copy, Debug)]
pub struct BlockSystem<'a, S: Scalar, const D: usize> {
    /// Whether the vertices after the last are the first again; then there are `reach` vertices at
    /// least.
    pub closed: bool,
    /// Half-bandwidth in vertices, 1 to 3.
    pub reach: usize,
    /// `blocks[v][k]`, k ≤ `reach`: rows of vertex v, columns of vertex v + k; those below the
    /// diagonal are their transposes. On closed curves of up to 2 `reach` vertices several blocks
    /// share a place, or stand on the diagonal for k > 0 (there with their transposes): they add
    /// up. Blocks beyond the end of an open curve are not read.
    pub blocks: &'a [[Block<S, D>; MOST_REACH + 1]],
    /// Where false, the unknown is held at 0: row and column are the unit ones.
    pub movable: &'a [bool],
}

/// Lanes that share a curve, a power of two: each has `reach` vertices at least.
pub fn ring_of(vertices: usize, reach: usize, lanes: usize) -> usize {
    1 << lanes.min(vertices / reach).max(1).ilog2()
}

/// Numbers of scratch memory that a curve takes in the kernel, the same number of all lanes side by
/// side, of those too that its ring leaves idle: an eliminated vertex keeps its factor, 2 `reach`
/// blocks and a right-hand side, and a lane what others must know of it and its row.
pub fn scratch_numbers(vertices: usize, reach: usize, dimension: usize, lanes: usize) -> usize {
    let ring = ring_of(vertices, reach, lanes);
    let eliminated = vertices.max(reach).div_ceil(ring) - reach;
    lanes * (shared_numbers(reach, dimension) + eliminated * eliminated_numbers(reach, dimension))
}

/// Numbers of an eliminated vertex.
fn eliminated_numbers(reach: usize, dimension: usize) -> usize {
    (2 * reach + 1) * dimension * dimension + dimension
}

/// Numbers that a lane shares, and those of its row of the ring.
///
/// It shares the symmetric blocks of two neighbours, the block across, two right-hand sides and the
/// smallest pivot. Its row is a symmetric block, `reach` factors, the blocks of two sides and a
/// right-hand side.
fn shared_numbers(reach: usize, dimension: usize) -> usize {
    let (half, whole) = (reach * (reach + 1) / 2, reach * reach);
    let blocks = 2 * half + whole + half + reach + 2 * whole;
    blocks * dimension * dimension + 3 * reach * dimension + 1
}
