//! Bounds of the loop turns of `shaders/discrete/descent.wgsl`, and the ticks that fit into a
//! dispatch.

use super::{DescentTask, GROUP, Run, reach};
use crate::gpu::plan::LOOP_TURNS;
use crate::linalg::block_ring::ring_of;
use crate::surface::SurfaceKernel;

/// Evaluations of the surface's WGSL code per vertex and tick: a projection of some steps, the
/// frames of the trial and of the curve, and a third derivative. A projection may take more. A
/// thread that runs out of loop turns reports it.
const CALLS: usize = 6;

/// Vertices next to a lane's chunk whose frames the lane also computes.
const HALO: usize = 8;

impl<const D: usize> Run<'_, D> {
    /// The most loop turns of one tick of a curve.
    pub(super) fn turns(&self, lanes: usize, i: usize) -> usize {
        let (order, problem) = (reach(self.plan), self.problems[i]);
        let rows = problem.vertices();
        let of_vertex = match &problem.surface {
            None => 0,
            Some(local) if local.surface.kind().quadric().is_some() => 1,
            Some(local) => CALLS * (1 + local.surface.kernel().map_or(0, SurfaceKernel::loop_iterations)),
        };
        let chunk = if lanes > 1 { rows.div_ceil(ring_of(rows, order, lanes)) } else { rows };
        loop_turns(order, lanes, rows) + (chunk + HALO) * of_vertex
    }
}

/// The most loop turns of one tick: an accepted step plus a restart in another lane of the same
/// subgroup.
///
/// It counts the loops over rows in the kernel's code, and some turns for the windows.
pub(in crate::discrete) fn loop_turns(order: usize, lanes: usize, rows: usize) -> usize {
    if lanes > 1 {
        // The base; the blocks and the vertices before the chunk; the ring, four times; the step
        // and its length; sums and edges. Each lane also sums the results of the other lanes and of
        // the workgroup.
        let chunk = rows.div_ceil(ring_of(rows, order, lanes));
        return 12 * (chunk + 4) + 8 * lanes + GROUP;
    }
    // The base (once), the sweep, the step, and the forward and backward solve.
    5 * (rows + 8)
}

/// The ticks of the listed curves.
///
/// All threads of a workgroup get the same number, because their loops run together.
pub(super) fn tasks(slots: &[u32], turns: &[usize], most_ticks: u32) -> Vec<DescentTask> {
    let mut tasks = Vec::with_capacity(slots.len());
    for group in slots.chunks(GROUP) {
        let longest = group.iter().map(|&slot| turns[slot as usize]).max().unwrap_or(1);
        let ticks = ((LOOP_TURNS / longest) as u32).clamp(1, most_ticks);
        tasks.extend(group.iter().map(|&slot| DescentTask { slot, ticks }));
    }
    tasks
}
