//! Twin of `shaders/linalg/block_ring/lanes.wgsl`: one system by partition and cyclic reduction
//! over a ring of lanes.

// Loops by number read as the formulas do.
#![allow(clippy::needless_range_loop)]

use super::dense::{
    Block, cholesky, over_vector, subtract_applied, subtract_product, subtract_transposed, sum, transpose, under,
    under_vector, unit, zero,
};
use super::{BlockSystem, MOST_REACH, ring_of};
use crate::linalg::Scalar;
use crate::linalg::scalar::{Vector, add};

/// Stands for the pivot of a matrix without rows.
pub(super) const RING_NO_PIVOT: f64 = 1e30;

/// Blocks by the kept vertices of two chunks, or of one; the first `reach` rows and columns are
/// used, and of symmetric ones the upper half.
type Blocks<S, const D: usize> = [[Block<S, D>; MOST_REACH]; MOST_REACH];

/// Vectors of the kept vertices.
type Vectors<S, const D: usize> = [Vector<S, D>; MOST_REACH];

/// The solution of a system.
#[derive(Clone, Debug)]
pub struct BlockSolution<S, const D: usize> {
    /// The unknowns. If the smallest pivot is not positive, they have no meaning, but are finite unless
    /// they overflow.
    pub x: Vec<Vector<S, D>>,
    /// The smallest pivot, positive if and only if the matrix is positive definite, up to rounding. A
    /// pivot that is not finite counts as 0.
    pub smallest: S,
}

/// A vertex eliminated: x = C⁻ᵀ (rhs − Σ after_j x_{v+1+j} − Σ kept_a x_{begin+a}).
struct Eliminated<S, const D: usize> {
    factor: Block<S, D>,
    after: [Block<S, D>; MOST_REACH],
    kept: [Block<S, D>; MOST_REACH],
    rhs: Vector<S, D>,
}

/// What a lane shares about the kept vertices on both sides of its eliminated ones, `low` and `high`:
/// terms of their blocks and right-hand sides, and the block that couples them now, with rows of
/// `high`.
struct Shares<S, const D: usize> {
    low: Blocks<S, D>,
    low_rhs: Vectors<S, D>,
    high: Blocks<S, D>,
    high_rhs: Vectors<S, D>,
    across: Blocks<S, D>,
}

impl<S: Scalar, const D: usize> Shares<S, D> {
    fn new() -> Self {
        let (blocks, vectors) = ([[zero(); MOST_REACH]; MOST_REACH], [[S::ZERO; D]; MOST_REACH]);
        Shares { low: blocks, low_rhs: vectors, high: blocks, high_rhs: vectors, across: blocks }
    }
}

/// A row of the ring: `left` and `right` couple the kept vertices (rows) with the neighbours' kept
/// vertices. Once factored, C⁻¹ times all of them, and the diagonal blocks of C.
struct Kept<S, const D: usize> {
    own: Blocks<S, D>,
    left: Blocks<S, D>,
    right: Blocks<S, D>,
    rhs: Vectors<S, D>,
    factors: [Block<S, D>; MOST_REACH],
}

/// Solves one system with up to `lanes` lanes, a power of two: see the module.
pub fn solve_blocks<S: Scalar, const D: usize>(
    system: &BlockSystem<'_, S, D>,
    rhs: &[Vector<S, D>],
    lanes: usize,
) -> BlockSolution<S, D> {
    let (n, reach) = (system.blocks.len(), system.reach);
    let ring = ring_of(n, reach, lanes);
    // An open curve of fewer vertices than are kept is continued by vertices that stand still.
    let from = |lane: usize| lane * n.max(reach) / ring;
    let mut smallest = S::of(RING_NO_PIVOT);
    let mut eliminated = Vec::with_capacity(ring);
    let mut shares = Vec::with_capacity(ring);
    for lane in 0..ring {
        let chunk = Chunk { system, rhs, begin: from(lane), end: from(lane + 1) };
        let (steps, share) = chunk.eliminate(&mut smallest);
        eliminated.push(steps);
        shares.push(share);
    }

    let neighbours = |lane: usize, step: usize| ((lane + ring - step % ring) % ring, (lane + step) % ring);
    let mut kept: Vec<Kept<S, D>> = (0..ring)
        .map(|lane| {
            let (own, left) = (&shares[lane], &shares[neighbours(lane, 1).0]);
            Kept {
                own: add_upper(&own.low, &left.high, reach),
                left: left.across,
                right: transposed(&own.across, reach),
                rhs: add_vectors(&own.low_rhs, &left.high_rhs, reach),
                factors: [zero(); MOST_REACH],
            }
        })
        .collect();
    let mut step = 1;
    while step < ring {
        for lane in (step..ring).step_by(2 * step) {
            kept[lane].factor(reach, &mut smallest);
            shares[lane] = kept[lane].shares(reach);
        }
        for lane in (0..ring).step_by(2 * step) {
            let (left, right) = neighbours(lane, step);
            let (row, left, right) = (&mut kept[lane], &shares[left], &shares[right]);
            row.own = add_upper(&add_upper(&row.own, &left.high, reach), &right.low, reach);
            row.rhs = add_vectors(&add_vectors(&row.rhs, &left.high_rhs, reach), &right.low_rhs, reach);
            row.left = left.across;
            row.right = transposed(&right.across, reach);
        }
        step *= 2;
    }

    // Both neighbours of the last row are the row itself.
    let last = &mut kept[0];
    last.own = add_upper(&add_upper(&last.own, &last.left, reach), &last.right, reach);
    (last.left, last.right) = ([[zero(); MOST_REACH]; MOST_REACH], [[zero(); MOST_REACH]; MOST_REACH]);
    last.factor(reach, &mut smallest);
    let nothing = [[S::ZERO; D]; MOST_REACH];
    let mut unknowns = vec![nothing; ring];
    unknowns[0] = kept[0].unknowns(reach, &nothing, &nothing);
    while step > 1 {
        step /= 2;
        for lane in (step..ring).step_by(2 * step) {
            let (left, right) = neighbours(lane, step);
            unknowns[lane] = kept[lane].unknowns(reach, &unknowns[left], &unknowns[right]);
        }
    }
    let mut x = vec![[S::ZERO; D]; n];
    for lane in 0..ring {
        substitute(&eliminated[lane], reach, from(lane), &unknowns[lane], &unknowns[(lane + 1) % ring], &mut x);
    }
    BlockSolution { x, smallest }
}

/// A chunk of consecutive vertices of a system. To it belong the blocks of its vertices with
/// themselves and those after.
struct Chunk<'a, S: Scalar, const D: usize> {
    system: &'a BlockSystem<'a, S, D>,
    rhs: &'a [Vector<S, D>],
    begin: usize,
    end: usize,
}

impl<S: Scalar, const D: usize> Chunk<'_, S, D> {
    fn block(&self, v: usize, k: usize) -> Block<S, D> {
        if v < self.end { self.system.block(v, k) } else { zero() }
    }

    fn held(&self, v: usize) -> Vector<S, D> {
        if v < self.end { self.system.held(v, self.rhs) } else { [S::ZERO; D] }
    }

    /// Eliminates the vertices begin + reach … end − 1, one after the other: what `low`, the
    /// chunk's first vertices, and `high`, the next chunk's, are left with.
    ///
    /// A first pass factors them. Then a pass for each of the first vertices couples it with them.
    fn eliminate(&self, smallest: &mut S) -> (Vec<Eliminated<S, D>>, Shares<S, D>) {
        let mut out = Shares::new();
        let mut steps = self.factor(&mut out, smallest);
        (0..self.system.reach).for_each(|a| self.couple(a, &mut steps, &mut out));
        (steps, out)
    }

    fn factor(&self, out: &mut Shares<S, D>, smallest: &mut S) -> Vec<Eliminated<S, D>> {
        let reach = self.system.reach;
        let first = self.begin + reach;
        // The next vertices, whose last row and column are those of the vertex about to enter.
        let mut window = [[zero(); MOST_REACH + 1]; MOST_REACH + 1];
        let mut window_rhs = [[S::ZERO; D]; MOST_REACH + 1];
        for a in 0..reach {
            for b in a..reach {
                window[a][b] = self.block(first + a, b - a);
            }
            window_rhs[a] = self.held(first + a);
        }
        let mut steps = Vec::with_capacity(self.end - first);
        for v in first..self.end {
            for i in 0..=reach {
                window[i][reach] = self.block(v + i, reach - i);
            }
            window_rhs[reach] = self.held(v + reach);

            let factor = cholesky(&window[0][0], smallest);
            let r = under_vector(&factor, &window_rhs[0]);
            let mut after = [zero(); MOST_REACH];
            for a in 0..reach {
                after[a] = under(&factor, &window[0][a + 1]);
            }
            // The window moves on by a vertex.
            for i in 0..reach {
                for j in i..reach {
                    window[i][j] = window[i + 1][j + 1];
                    subtract_product(&mut window[i][j], &after[i], &after[j]);
                }
                window_rhs[i] = window_rhs[i + 1];
                subtract_transposed(&mut window_rhs[i], &after[i], &r);
            }
            steps.push(Eliminated { factor, after, kept: [zero(); MOST_REACH], rhs: r });
        }
        for a in 0..reach {
            out.high[a][a..reach].copy_from_slice(&window[a][a..reach]);
            out.high_rhs[a] = window_rhs[a];
        }
        steps
    }

    /// What couples the chunk's vertex number a with those that were eliminated: of its row, `low`
    /// is what the first vertices are left with, and `across` what couples it with the next chunk's.
    fn couple(&self, a: usize, steps: &mut [Eliminated<S, D>], out: &mut Shares<S, D>) {
        let reach = self.system.reach;
        let own = self.begin + a;
        // Rows of the next vertices.
        let mut coupled = [zero(); MOST_REACH + 1];
        for i in 0..=a {
            coupled[i] = transpose(&self.block(own, reach + i - a));
            out.low[i][a] = self.block(self.begin + i, a - i);
        }
        out.low_rhs[a] = self.held(own);
        for step in steps {
            step.kept[a] = under(&step.factor, &coupled[0]);
            for i in 0..=a {
                subtract_product(&mut out.low[i][a], &step.kept[i], &step.kept[a]);
            }
            subtract_transposed(&mut out.low_rhs[a], &step.kept[a], &step.rhs);
            for i in 0..reach {
                coupled[i] = coupled[i + 1];
                subtract_product(&mut coupled[i], &step.after[i], &step.kept[a]);
            }
        }
        for i in 0..reach {
            out.across[i][a] = coupled[i];
        }
    }
}

impl<S: Scalar, const D: usize> Kept<S, D> {
    /// Factors the own block, C Cᵀ, row after row, and applies C⁻¹ to the rest of the row.
    fn factor(&mut self, reach: usize, smallest: &mut S) {
        for i in 0..reach {
            for p in 0..i {
                let above = self.own[p];
                for j in i..reach {
                    subtract_product(&mut self.own[i][j], &above[i], &above[j]);
                }
                for b in 0..reach {
                    let (left, right) = (self.left[p][b], self.right[p][b]);
                    subtract_product(&mut self.left[i][b], &above[i], &left);
                    subtract_product(&mut self.right[i][b], &above[i], &right);
                }
                let before = self.rhs[p];
                subtract_transposed(&mut self.rhs[i], &above[i], &before);
            }
            let factor = cholesky(&self.own[i][i], smallest);
            for j in i + 1..reach {
                self.own[i][j] = under(&factor, &self.own[i][j]);
            }
            for b in 0..reach {
                self.left[i][b] = under(&factor, &self.left[i][b]);
                self.right[i][b] = under(&factor, &self.right[i][b]);
            }
            self.rhs[i] = under_vector(&factor, &self.rhs[i]);
            self.factors[i] = factor;
        }
    }

    /// What its neighbours are left with once this row, factored, is eliminated.
    fn shares(&self, reach: usize) -> Shares<S, D> {
        let mut out = Shares::new();
        for a in 0..reach {
            for i in 0..reach {
                for b in 0..reach {
                    if b >= a {
                        subtract_product(&mut out.low[a][b], &self.left[i][a], &self.left[i][b]);
                        subtract_product(&mut out.high[a][b], &self.right[i][a], &self.right[i][b]);
                    }
                    subtract_product(&mut out.across[a][b], &self.right[i][a], &self.left[i][b]);
                }
                subtract_transposed(&mut out.low_rhs[a], &self.left[i][a], &self.rhs[i]);
                subtract_transposed(&mut out.high_rhs[a], &self.right[i][a], &self.rhs[i]);
            }
        }
        out
    }

    /// The kept unknowns of an eliminated row, from the unknowns of its neighbours at that time.
    fn unknowns(&self, reach: usize, left: &Vectors<S, D>, right: &Vectors<S, D>) -> Vectors<S, D> {
        let mut x = self.rhs;
        for i in (0..reach).rev() {
            for b in 0..reach {
                subtract_applied(&mut x[i], &self.left[i][b], &left[b]);
                subtract_applied(&mut x[i], &self.right[i][b], &right[b]);
            }
            x[i] = over_vector(&self.factors[i], &x[i]);
            let own = x[i];
            for p in 0..i {
                subtract_applied(&mut x[p], &self.own[p][i], &own);
            }
        }
        x
    }
}

/// Substitutes back, from the chunk's kept unknowns and the next chunk's.
fn substitute<S: Scalar, const D: usize>(
    steps: &[Eliminated<S, D>],
    reach: usize,
    begin: usize,
    kept: &Vectors<S, D>,
    next: &Vectors<S, D>,
    x: &mut [Vector<S, D>],
) {
    let mut after = *next;
    for (i, step) in steps.iter().enumerate().rev() {
        let mut own = step.rhs;
        for a in 0..reach {
            subtract_applied(&mut own, &step.after[a], &after[a]);
            subtract_applied(&mut own, &step.kept[a], &kept[a]);
        }
        own = over_vector(&step.factor, &own);
        for a in (1..reach).rev() {
            after[a] = after[a - 1];
        }
        after[0] = own;
        x[begin + reach + i] = own;
    }
    let count = reach.min(x.len());
    x[begin..begin + count].copy_from_slice(&kept[..count]);
}

impl<S: Scalar, const D: usize> BlockSystem<'_, S, D> {
    /// The block of vertices v and v + k, by unwrapped numbers, where vertices that are held are
    /// decoupled.
    fn block(&self, v: usize, k: usize) -> Block<S, D> {
        let n = self.blocks.len();
        let other = if self.closed && v + k >= n { v + k - n } else { v + k };
        let moves = |v: usize| v < n && self.movable[v];
        match moves(v) && moves(other) {
            true => self.blocks[v][k],
            false if k == 0 => unit(),
            false => zero(),
        }
    }

    /// A right-hand side, 0 where the vertex is held.
    fn held(&self, v: usize, rhs: &[Vector<S, D>]) -> Vector<S, D> {
        if v < rhs.len() && self.movable[v] { rhs[v] } else { [S::ZERO; D] }
    }
}

fn add_upper<S: Scalar, const D: usize>(a: &Blocks<S, D>, b: &Blocks<S, D>, reach: usize) -> Blocks<S, D> {
    let mut out = *a;
    for i in 0..reach {
        for j in i..reach {
            out[i][j] = sum(&a[i][j], &b[i][j]);
        }
    }
    out
}

fn add_vectors<S: Scalar, const D: usize>(a: &Vectors<S, D>, b: &Vectors<S, D>, reach: usize) -> Vectors<S, D> {
    let mut out = *a;
    for i in 0..reach {
        out[i] = add(a[i], b[i]);
    }
    out
}

fn transposed<S: Scalar, const D: usize>(a: &Blocks<S, D>, reach: usize) -> Blocks<S, D> {
    let mut out = [[zero(); MOST_REACH]; MOST_REACH];
    for i in 0..reach {
        for j in 0..reach {
            out[i][j] = transpose(&a[j][i]);
        }
    }
    out
}
