//! Block-banded symmetric positive definite systems, open and cyclic, by partition and cyclic
//! reduction over a ring of lanes.
//!
//! Newton's method for discrete curves has such systems: D × D blocks that couple a vertex with the
//! next `reach` (2 for bending, 3 for variation). Lanes share a curve. Each keeps the first `reach`
//! vertices of its chunk and eliminates the others by a Cholesky factorisation, which carries along
//! the blocks that couple them with the kept ones. The kept vertices of two chunks separate the chunk
//! between them from all others. So they form a cyclic block tridiagonal system of blocks of `reach`
//! vertices. It is reduced by log₂ P steps of cyclic reduction, each of which eliminates every second
//! remaining lane. Lanes then substitute back in the opposite order, and each lane in its chunk.
//!
//! This is a Cholesky factorisation of the matrix with its rows in another order, and as stable: the
//! residual is due to rounding alone, whatever the condition. Eliminating every row from its
//! neighbours' rows would save the substitution, but errors of the unknowns would be independent, and
//! a stiff direction multiplies such errors by the condition.
//!
//! Open curves (whose last chunk is coupled with nothing) and closed curves run the same code. Chunks
//! have any length from `reach` vertices on, without padding. A ring of one lane is the factorisation
//! with a border. On short closed curves a chunk is its own next chunk: several blocks then share a
//! position, and are summed.
//!
//! Each pivot is a pivot of a Schur complement, and positive if the matrix is positive definite. So
//! rows are not exchanged, and the smallest pivot tells whether the matrix was positive definite.
//! Source: Golub and Van Loan, Matrix Computations, 4th ed., 4.3 and 4.5.4.

mod dense;
mod gpu;
mod lanes;
#[cfg(test)]
mod tests;

pub use dense::Block;
pub use gpu::{BLOCK_LANES, BlockBatch, BlockSolutions, block_ring_kernels, solve_blocks_on_gpu};
pub use lanes::{BlockSolution, solve_blocks};

use super::Scalar;

/// The most vertices after it that a vertex is coupled with.
pub const MOST_REACH: usize = 3;

/// A block-banded symmetric system of one curve.
#[derive(Clone, Copy, Debug)]
pub struct BlockSystem<'a, S: Scalar, const D: usize> {
    /// Whether the first vertex follows the last. Then there are at least `reach` vertices.
    pub closed: bool,
    /// Half-bandwidth in vertices, 1 to 3.
    pub reach: usize,
    /// `blocks[v][k]`, k ≤ `reach`: rows of vertex v, columns of vertex v + k. Blocks below the
    /// diagonal are their transposes. On closed curves of up to 2 `reach` vertices several blocks
    /// share a position, or are on the diagonal for k > 0 (with their transposes), and are summed.
    /// Blocks beyond the end of an open curve are not read.
    pub blocks: &'a [[Block<S, D>; MOST_REACH + 1]],
    /// Where false, the unknown is held at 0: row and column are the unit ones.
    pub movable: &'a [bool],
}

/// Lanes that share a curve, a power of two. Each has at least `reach` vertices.
pub fn ring_of(vertices: usize, reach: usize, lanes: usize) -> usize {
    1 << lanes.min(vertices / reach).max(1).ilog2()
}

/// Numbers of scratch memory of a curve in the kernel.
///
/// All lanes have the same number, idle lanes too, side by side. It holds the factor, 2 `reach` blocks
/// and a right-hand side of each eliminated vertex, and the blocks that the lane shares.
pub fn scratch_numbers(vertices: usize, reach: usize, dimension: usize, lanes: usize) -> usize {
    let ring = ring_of(vertices, reach, lanes);
    let eliminated = vertices.max(reach).div_ceil(ring) - reach;
    lanes * (shared_numbers(reach, dimension) + eliminated * eliminated_numbers(reach, dimension))
}

/// Numbers of an eliminated vertex.
fn eliminated_numbers(reach: usize, dimension: usize) -> usize {
    (2 * reach + 1) * dimension * dimension + dimension
}

/// Numbers that a lane shares, and numbers of its row of the ring.
///
/// It shares the symmetric blocks of two neighbours, the block across, two right-hand sides and the
/// smallest pivot. Its row is a symmetric block, `reach` factors, the blocks of two sides and a
/// right-hand side.
fn shared_numbers(reach: usize, dimension: usize) -> usize {
    let (half, whole) = (reach * (reach + 1) / 2, reach * reach);
    let blocks = 2 * half + whole + half + reach + 2 * whole;
    blocks * dimension * dimension + 3 * reach * dimension + 1
}
