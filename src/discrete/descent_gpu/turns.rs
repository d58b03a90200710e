//! How often loops of `shaders/discrete/descent.wgsl` turn, and the ticks that fit into a dispatch.

use super::{DescentTask, GROUP, Run, Way};
use crate::gpu::plan::LOOP_TURNS;
use crate::linalg::block_ring::ring_of;
use crate::surface::SurfaceKernel;

/// Calls of the text of a surface for a vertex in one tick: a foot of some steps, the frames of the trial and of the curve, and
/// a third derivative. A foot may take more; a thread whose loops were ended says so.
const CALLS: usize = 6;

/// Vertices before and behind a lane's own whose frames it finds too.
const HALO: usize = 8;

impl<const D: usize> Run<'_, D> {
    /// The most loop turns of one tick of a curve.
    pub(super) fn turns(&self, way: Way, i: usize) -> usize {
        let (order, problem) = (self.plan.order, self.problems[i]);
        let rows = problem.vertices();
        let of_vertex = match &problem.surface {
            None => 0,
            Some(local) if local.surface.kind().quadric().is_some() => 1,
            Some(local) => CALLS * (1 + local.surface.kernel().map_or(0, SurfaceKernel::loop_iterations)),
        };
        let chunk = match way {
            Way::Newton(lanes) if lanes > 1 => rows.div_ceil(ring_of(rows, order, lanes)),
            _ => rows,
        };
        loop_turns(order, way, rows, problem.pinned.len()) + (chunk + HALO) * of_vertex
    }
}

/// The most loop turns of one tick.
///
/// This is an accepted step plus a restart in another lane of the same subgroup. It counts the
/// loops over the rows in the kernel's text, some turns for the windows, and the loops over the
/// pins.
pub(super) fn loop_turns(order: usize, way: Way, rows: usize, pins: usize) -> usize {
    let lanes = way.lanes();
    if lanes > 1 {
        // The base; the blocks and the chunk's vertices before; the ring, four times; the step and
        // its length; sums and edges. A lane adds up what the other lanes found, and the workgroup.
        let chunk = rows.div_ceil(ring_of(rows, order, lanes));
        return 12 * (chunk + 4) + 8 * lanes + GROUP;
    }
    // The base (once), the sweep, the step, two directions or Newton's system there and back. Then, without Newton's, the inner
    // product.
    match way {
        Way::Newton(_) => 5 * (rows + 8),
        Way::Gradients => (5 + [1, 3, 9][order]) * (rows + 8) + if order == 2 { 4 * pins } else { 0 },
    }
}

/// The ticks of the listed curves.
///
/// All threads of a workgroup have the same number, because their loops run together.
pub(super) fn tasks(slots: &[u32], turns: &[usize], most_ticks: u32) -> Vec<DescentTask> {
    let mut tasks = Vec::with_capacity(slots.len());
    for group in slots.chunks(GROUP) {
        let longest = group.iter().map(|&slot| turns[slot as usize]).max().unwrap_or(1);
        let ticks = ((LOOP_TURNS / longest) as u32).clamp(1, most_ticks);
        tasks.extend(group.iter().map(|&slot| DescentTask { slot, ticks }));
    }
    tasks
}
