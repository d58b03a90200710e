//! The systems of a batch of chains on a GPU, all curves and coordinates at once.

use super::layout::{Layout, Trouble};
use super::piece::Piece;
use super::system::{Done, System};
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
type Unknowns<const N: usize> = Vec<Vec<[f64; N]>>;

/// Completes all curves.
pub(super) fn complete<'a, const N: usize>(
    gpu: &Gpu,
    device: &Device,
    layouts: Vec<Result<Layout<'a>, Trouble>>,
    smoothness: usize,
    piece: impl Fn(u32) -> &'a Piece + Sync,
) -> Result<Vec<Result<Done, Trouble>>> {
    let precision = device.kernel_precision(gpu, true)?;
    let systems: Vec<Result<System<N>, Trouble>> =
        parallel::of(layouts, |layout| System::new(layout?, smoothness, &piece));
    let batch = Batch::new(&systems);
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
    let own = |system: Result<(System<N>, (Unknowns<N>, f64)), Trouble>| {
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
struct Batch<'a, 'b, const N: usize> {
    systems: Vec<&'a System<'b, N>>,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    blocks: Vec<f64>,
    movable: Vec<bool>,
    lanes: u32,
}

impl<'a, 'b, const N: usize> Batch<'a, 'b, N> {
    fn new(systems: &'a [Result<System<'b, N>, Trouble>]) -> Self {
        let systems: Vec<&System<N>> = systems.iter().flatten().collect();
        let mut batch =
            Batch { systems, offsets: vec![0], closed: Vec::new(), blocks: Vec::new(), movable: Vec::new(), lanes: 8 };
        let mut longest = 0;
        for system in &batch.systems {
            for _ in 0..system.rhs.len() {
                batch.blocks.extend_from_slice(system.blocks.as_flattened().as_flattened().as_flattened());
                batch.movable.extend_from_slice(&system.movable);
                batch.offsets.push(batch.movable.len());
                batch.closed.push(system.layout.closed);
            }
            longest = longest.max(system.movable.len());
        }
        batch.lanes = LANES.iter().find(|(most, _)| longest <= *most).map_or(64, |&(_, lanes)| lanes);
        batch
    }

    /// The unknowns and the smallest pivot of every system.
    fn solve(
        &self,
        gpu: &Gpu,
        precision: Precision,
        mut rhs: impl FnMut(&System<N>) -> Unknowns<N>,
    ) -> Result<(Vec<Unknowns<N>>, Vec<f64>)> {
        let mut sides = Vec::with_capacity(self.movable.len() * N);
        for system in &self.systems {
            rhs(system).iter().for_each(|rhs| sides.extend_from_slice(rhs.as_flattened()));
        }
        debug_assert_eq!(self.blocks.len(), self.movable.len() * (MOST_REACH + 1) * N * N);
        let batch = BlockBatch {
            dimension: N,
            reach: 1,
            offsets: &self.offsets,
            closed: &self.closed,
            blocks: &self.blocks,
            movable: &self.movable,
        };
        let BlockSolutions { x, pivots } = solve_blocks_on_gpu(gpu, precision, self.lanes, &batch, &sides)?;
        let (mut vectors, mut pivots) = (x.as_chunks::<N>().0, pivots.into_iter());
        let mut own = |system: &&System<N>| {
            let dimension = system.rhs.len();
            let unknowns: Unknowns<N> = (0..dimension)
                .map(|_| {
                    let (head, tail) = vectors.split_at(system.movable.len());
                    vectors = tail;
                    head.to_vec()
                })
                .collect();
            let smallest = pivots.by_ref().take(dimension).fold(f64::INFINITY, f64::min);
            (unknowns, smallest)
        };
        Ok(self.systems.iter().map(&mut own).unzip())
    }
}
