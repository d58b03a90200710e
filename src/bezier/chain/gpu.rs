//! The systems of a batch of chains on a GPU, all curves and coordinates at once.

use std::collections::HashMap;

use super::blocks::Row;
use super::layout::{Layout, Trouble};
use super::piece::Piece;
use super::system::{Done, System, rows};
use crate::device::Device;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::block_ring::{BlockBatch, BlockSolutions, MOST_REACH, solve_blocks_on_gpu};
use crate::parallel;
use crate::precision::Precision;

/// The least pivot of a matrix of unit diagonal that f32 can tell from a singular one.
///
/// The CPU solves matrices with a smaller pivot.
const LEAST_PIVOT: f64 = 1e-3;

/// Lanes for each curve, by the joints of the longest curve: (most joints, lanes).
const LANES: [(usize, u32); 2] = [(2_000, 8), (usize::MAX, 64)];

/// The unknowns of a curve, one coordinate after the other.
type Unknowns = Vec<Vec<Row>>;

/// Completes all curves.
pub(super) fn complete<'a>(
    gpu: &Gpu,
    device: &Device,
    layouts: Vec<Result<Layout<'a>, Trouble>>,
    smoothness: usize,
    pieces: &'a HashMap<u32, Piece>,
) -> Result<Vec<Result<Done, Trouble>>> {
    let precision = device.kernel_precision(gpu, true)?;
    let systems: Vec<Result<System, Trouble>> =
        parallel::of(layouts, |layout| System::new(layout?, smoothness, pieces));
    let batch = Batch::new(&systems, rows(smoothness));
    let (mut x, pivots) = batch.solve(gpu, precision, |system| system.rhs.clone())?;
    if precision != Precision::F64 {
        let mut at = x.iter();
        let (more, _) = batch.solve(gpu, precision, |system| system.residual(at.next().expect("one a system")))?;
        let all = x.iter_mut().flatten().flatten().flatten().zip(more.into_iter().flatten().flatten().flatten());
        all.for_each(|(x, more)| *x += more);
    }
    let mut solved = x.into_iter().zip(pivots);
    let with_unknowns: Vec<_> =
        systems.into_iter().map(|system| system.map(|system| (system, solved.next().expect("one a system")))).collect();
    let own = |system: Result<(System, (Unknowns, f64)), Trouble>| {
        let (system, (x, pivot)) = system?;
        if pivot >= LEAST_PIVOT && x.iter().flatten().flatten().all(|x| x.is_finite()) {
            return system.finish(&x, pivot);
        }
        let (x, smallest) = system.solve();
        system.finish(&x, smallest)
    };
    Ok(parallel::of(with_unknowns, own))
}

/// The arrays of all systems. Each coordinate of a curve is a system.
struct Batch<'a, 'b> {
    systems: Vec<&'a System<'b>>,
    /// Rows of a block.
    rows: usize,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    blocks: Vec<f64>,
    movable: Vec<bool>,
    lanes: u32,
}

impl<'a, 'b> Batch<'a, 'b> {
    fn new(systems: &'a [Result<System<'b>, Trouble>], rows: usize) -> Self {
        let systems: Vec<&System> = systems.iter().flatten().collect();
        let mut batch = Batch {
            systems,
            rows,
            offsets: vec![0],
            closed: Vec::new(),
            blocks: Vec::new(),
            movable: Vec::new(),
            lanes: 8,
        };
        let mut longest = 0;
        for system in &batch.systems {
            for _ in 0..system.rhs.len() {
                for blocks in &system.matrix.blocks {
                    for row in blocks.iter().flat_map(|block| &block[..rows]) {
                        batch.blocks.extend_from_slice(&row[..rows]);
                    }
                    batch.blocks.extend(std::iter::repeat_n(0.0, (MOST_REACH - 1) * rows * rows));
                }
                batch.movable.extend_from_slice(&system.matrix.movable);
                batch.offsets.push(batch.movable.len());
                batch.closed.push(system.layout.closed);
            }
            longest = longest.max(system.matrix.movable.len());
        }
        batch.lanes = LANES.iter().find(|(most, _)| longest <= *most).map_or(64, |&(_, lanes)| lanes);
        batch
    }

    /// The unknowns and the smallest pivot of every system.
    fn solve(
        &self,
        gpu: &Gpu,
        precision: Precision,
        mut rhs: impl FnMut(&System) -> Unknowns,
    ) -> Result<(Vec<Unknowns>, Vec<f64>)> {
        let rows = self.rows;
        let mut sides = Vec::with_capacity(self.movable.len() * rows);
        for system in &self.systems {
            for row in rhs(system).iter().flatten() {
                sides.extend_from_slice(&row[..rows]);
            }
        }
        debug_assert_eq!(self.blocks.len(), self.movable.len() * (MOST_REACH + 1) * rows * rows);
        let batch = BlockBatch {
            dimension: rows,
            reach: 1,
            offsets: &self.offsets,
            closed: &self.closed,
            blocks: &self.blocks,
            movable: &self.movable,
        };
        let BlockSolutions { x, pivots } = solve_blocks_on_gpu(gpu, precision, self.lanes, &batch, &sides)?;
        let (mut numbers, mut pivots) = (x.chunks_exact(rows), pivots.into_iter());
        let (mut all, mut smallest) = (Vec::new(), Vec::new());
        for system in &self.systems {
            let mut unknowns = vec![vec![Row::default(); system.matrix.movable.len()]; system.rhs.len()];
            for (to, from) in unknowns.iter_mut().flatten().zip(&mut numbers) {
                to[..rows].copy_from_slice(from);
            }
            all.push(unknowns);
            smallest.push(pivots.by_ref().take(system.rhs.len()).fold(f64::INFINITY, f64::min));
        }
        Ok((all, smallest))
    }
}
