//! Batches of block-banded systems on a GPU, with one dispatch per chunk.

#[cfg(all(test, feature = "gpu"))]
mod tests;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::lanes::RING_NO_PIVOT;
use super::{MOST_REACH, eliminated_numbers, scratch_numbers, shared_numbers};
use crate::error::{Error, Result};
use crate::gpu::plan::{self, LOOP_TURNS};
use crate::gpu::source::definitions;
use crate::gpu::{Gpu, KernelKey, Pending, Recording, once, pipeline};
use crate::linalg::Real;
use crate::precision::Precision;

/// `BlockParams` of `lanes.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct BlockParams {
    count: u32,
    lanes: u32,
}

/// `BlockCurve` of `lanes.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct BlockCurve {
    start: u32,
    vertices: u32,
    closed: u32,
    scratch: u32,
}

/// Lanes of a curve. 8 suit curves of up to some hundred vertices.
pub const BLOCK_LANES: [u32; 2] = [8, 64];

/// Threads of a workgroup: a whole wave of the widest hardware.
const GROUP: u32 = 64;

/// The most vertices of a chunk. A vertex takes a loop iteration for its factor, one for each kept
/// vertex, and one for the substitution.
const MOST_CHUNK: usize = LOOP_TURNS / (MOST_REACH + 2);

/// Systems of a batch of curves, vertex after vertex.
#[derive(Clone, Copy, Debug)]
pub struct BlockBatch<'a, T> {
    /// Coordinates of a vertex, 2 or 3.
    pub dimension: usize,
    /// Half-bandwidth in vertices, 1 to 3.
    pub reach: usize,
    /// The first vertex of every curve, then the number of vertices.
    pub offsets: &'a [usize],
    /// Whether each curve is closed.
    pub closed: &'a [bool],
    /// The blocks of every vertex with itself and the next three (see
    /// [`BlockSystem`](super::BlockSystem)), row after row.
    pub blocks: &'a [T],
    /// Whether the unknown of each vertex is free, not held at 0.
    pub movable: &'a [bool],
}

/// The solutions of a batch.
#[derive(Clone, Debug)]
pub struct BlockSolutions<T> {
    /// The unknowns, vertex after vertex.
    pub x: Vec<T>,
    /// The smallest pivot of each curve. If it is not positive, the matrix is not positive definite,
    /// and its unknowns have no meaning. 1e30 for a curve without vertices.
    pub pivots: Vec<T>,
}

/// Solves a batch with `lanes` lanes per curve, one of [`BLOCK_LANES`], in f32 or f64. Converts the
/// arrays if necessary.
///
/// # Errors
/// - [`Error::Argument`] for another number of lanes, and for a closed curve of fewer vertices than
///   `reach`.
/// - [`Error::Limit`] for a curve larger than the device's largest array, or too long for its lanes.
/// - Errors of compiling the kernel and of submissions.
pub fn solve_blocks_on_gpu<T: Real>(
    gpu: &Gpu,
    precision: Precision,
    lanes: u32,
    systems: &BlockBatch<'_, T>,
    rhs: &[T],
) -> Result<BlockSolutions<T>> {
    systems.check(lanes)?;
    let (d, reach) = (systems.dimension, systems.reach);
    // A short curve takes the scratch memory of all lanes.
    let counts = (0..systems.closed.len()).map(|i| match systems.count(i) {
        0 => 0,
        count => count.max(lanes as usize * reach),
    });
    let scratch = eliminated_numbers(reach, d) + shared_numbers(reach, d);
    let largest = scratch.max((MOST_REACH + 1) * d * d) as u64 * precision.bytes();
    let chunks = plan::chunks(counts, largest, 2 * largest, gpu.limits())?;
    let mut solutions =
        BlockSolutions { x: vec![T::ZERO; rhs.len()], pivots: vec![T::from_f64(RING_NO_PIVOT); systems.closed.len()] };
    let run = BlockRun { lanes, systems, rhs };
    pipeline(
        chunks,
        |curves| run.record(gpu.record(precision), curves)?.submit(),
        once(Pending::wait),
        |curves, results| {
            run.unpack(curves, &results[0].reals(), &results[1].reals(), &mut solutions);
            Ok(())
        },
    )?;
    Ok(solutions)
}

impl<T> BlockBatch<'_, T> {
    fn count(&self, i: usize) -> usize {
        self.offsets[i + 1] - self.offsets[i]
    }

    fn check(&self, lanes: u32) -> Result<()> {
        if !BLOCK_LANES.contains(&lanes) {
            return Err(Error::Argument(format!("{lanes} lanes a curve: take one of {BLOCK_LANES:?}")));
        }
        for i in 0..self.closed.len() {
            let (count, reach) = (self.count(i), self.reach);
            if self.closed[i] && count > 0 && count < reach {
                return Err(Error::Argument(format!(
                    "closed curve {i} has {count} vertices, and each is coupled with the next {reach}: fold the blocks"
                )));
            }
            let most = MOST_CHUNK * lanes as usize;
            if count > most {
                return Err(Error::Limit {
                    what: format!("curve {i} with {count} vertices and {lanes} lanes"),
                    asked: count as u64,
                    allowed: most as u64,
                    remedy: "take more lanes, or the CPU".into(),
                });
            }
        }
        Ok(())
    }
}

struct BlockRun<'a, T> {
    lanes: u32,
    systems: &'a BlockBatch<'a, T>,
    rhs: &'a [T],
}

impl<T: Real> BlockRun<'_, T> {
    fn vertices(&self, curves: &Range<usize>) -> Range<usize> {
        self.systems.offsets[curves.start]..self.systems.offsets[curves.end]
    }

    /// Curves of a chunk that have vertices.
    fn solved(&self, curves: &Range<usize>) -> impl Iterator<Item = usize> {
        let systems = self.systems;
        curves.clone().filter(move |&i| systems.count(i) > 0)
    }

    fn record<'g>(&self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<Recording<'g>> {
        let (systems, vertices) = (self.systems, self.vertices(curves));
        let (d, reach) = (systems.dimension, systems.reach);
        let mut scratch = 0;
        let table: Vec<BlockCurve> = self
            .solved(curves)
            .map(|i| {
                let (start, count) = (systems.offsets[i] - vertices.start, systems.count(i));
                let closed = systems.closed[i].into();
                let row = BlockCurve { start: start as u32, vertices: count as u32, closed, scratch };
                scratch += scratch_numbers(count, reach, d, self.lanes as usize) as u32;
                row
            })
            .collect();
        let mut up = |numbers: &[T], width: usize| {
            let own = &numbers[vertices.start * width..vertices.end * width];
            recording.upload_reals(&own.iter().map(|x| x.to_f64()).collect::<Vec<f64>>())
        };
        let blocks = up(systems.blocks, (MOST_REACH + 1) * d * d);
        let rhs = up(self.rhs, d);
        let movable: Vec<u32> = systems.movable[vertices.clone()].iter().map(|&moves| moves.into()).collect();
        let movable = recording.upload(&movable);
        let solution = recording.storage_reals(vertices.len() * d);
        let pivots = recording.storage_reals(table.len());
        let scratch = recording.storage_reals(scratch as usize);
        let params = recording.uniform(&BlockParams { count: table.len() as u32, lanes: self.lanes });
        let key = kernel_key(recording.precision(), d, reach);
        let curves = recording.upload(&table);
        let buffers = [
            ("params", &params),
            ("curves", &curves),
            ("blocks", &blocks),
            ("right_hand_sides", &rhs),
            ("movable", &movable),
            ("solution", &solution),
            ("pivots", &pivots),
            ("ring_scratch", &scratch),
        ];
        recording.dispatch(&key, table.len(), (GROUP / self.lanes) as usize, &buffers)?;
        recording.download(&solution);
        recording.download(&pivots);
        Ok(recording)
    }

    fn unpack(&self, curves: &Range<usize>, x: &[f64], pivots: &[f64], out: &mut BlockSolutions<T>) {
        let (d, vertices) = (self.systems.dimension, self.vertices(curves));
        let to = &mut out.x[vertices.start * d..vertices.end * d];
        to.iter_mut().zip(x).for_each(|(to, &x)| *to = T::from_f64(x));
        for (i, &pivot) in self.solved(curves).zip(pivots) {
            out.pivots[i] = T::from_f64(pivot);
        }
    }
}

fn kernel_key(precision: Precision, dimension: usize, reach: usize) -> KernelKey {
    let definitions = definitions([("DIM", &dimension), ("REACH", &reach), ("GROUP", &GROUP)]);
    KernelKey { path: "linalg/block_ring/lanes.wgsl", entry: "solve", precision, definitions }
}

/// Every variant of the kernel.
pub fn block_ring_kernels(precision: Precision) -> Vec<KernelKey> {
    let variants = [2, 3].into_iter().flat_map(|d| (1..=MOST_REACH).map(move |reach| (d, reach)));
    variants.map(|(d, reach)| kernel_key(precision, d, reach)).collect()
}
