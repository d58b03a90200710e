//! Twin of `shaders/linalg/ring/long.wgsl`, and its dispatches: systems longer than a workgroup holds.

use super::lanes::{Reduced, Row, eliminate, solve_lanes};
use super::{Chunk, FLAG_CYCLIC, GROUP, LONG_CHUNK, PARTS, Params, RowSource, Solve, System, kernel_key};
use crate::error::Result;
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, KernelKey, Recording};
use crate::linalg::Real;
use crate::precision::Precision;

/// Solves one system: reduces chunks of `chunk` rows to one row each, and solves the shorter system by
/// [`solve_lanes`].
pub fn solve_long<T: Real>(rows: &[Row<T>], chunk: usize, lanes: usize) -> (Vec<T>, bool) {
    let reduced: Vec<Reduced<T>> = rows.chunks(chunk).map(eliminate).collect();
    let count = reduced.len();
    let kept: Vec<Row<T>> = (0..count).map(|j| reduced[j].coupled(&reduced[(j + count - 1) % count])).collect();
    let (unknowns, singular) = solve_lanes(&kept, lanes);
    let mut x = vec![T::ZERO; rows.len()];
    for (j, part) in x.chunks_mut(chunk).enumerate() {
        reduced[j].substitute(unknowns[j], unknowns[(j + 1) % count], part);
    }
    (x, singular)
}

/// Records reduction, solution of the shorter systems (by any kernel, perhaps by this one again) and
/// substitution.
pub(super) fn record(
    solve: &Solve<'_>,
    recording: &mut Recording<'_>,
    source: &RowSource<'_>,
    solution: &Buffer,
    status: &Buffer,
) -> Result<()> {
    let (chunks, shorter) = divide(solve.systems);
    let (count, columns) = (chunks.len(), solve.columns as usize);
    let rows = solve.systems.iter().map(|system| (system.start + system.rows) as usize).max().unwrap_or(0);
    let reduced = recording.storage_reals(5 * count + 2 * rows);
    let reduced_rhs = recording.storage_reals((2 * count + rows) * columns);
    let kept = recording.storage_reals(count * columns);
    let (systems, table) = (recording.upload(solve.systems), recording.upload(&chunks));
    let own = [("systems", &systems), ("chunks", &table), ("reduced", &reduced), ("reduced_rhs", &reduced_rhs)];
    let mut buffers = own.to_vec();
    buffers.extend([("kept_unknowns", &kept), ("solution", solution)]);
    buffers.extend(&source.buffers);

    let dispatch = |recording: &mut Recording<'_>, entry: &'static str, rows: Option<&str>| {
        solve.for_each_column_group(|column, together| {
            let key = key(entry, recording.precision(), rows, together);
            let (columns, kind) = (solve.columns, source.kind);
            let params = recording.uniform(&Params { count: count as u32, columns, column, lanes: 1, kind });
            let mut all = buffers.clone();
            all.push(("params", &params));
            recording.dispatch(&key, count, GROUP as usize, &all)
        })
    };
    dispatch(recording, "reduce", Some(source.path))?;
    let buffers = vec![("parts", &reduced), ("part_rhs", &reduced_rhs)];
    let parts = RowSource { path: PARTS, kind: 0, buffers };
    let next = Solve { systems: &shorter, kernel: super::RingKernel::Auto, ..*solve };
    next.record(recording, &parts, &kept, status)?;
    dispatch(recording, "substitute", None)
}

/// One of the two kernels. Only `reduce` reads rows.
pub(super) fn key(entry: &'static str, precision: Precision, rows: Option<&str>, columns: u32) -> KernelKey {
    let own = definitions([("GROUP", &GROUP)]);
    kernel_key("linalg/ring/long.wgsl", entry, precision, own, rows, columns)
}

/// The chunks of all systems, and the shorter systems made of their kept rows.
fn divide(systems: &[System]) -> (Vec<Chunk>, Vec<System>) {
    let mut chunks = Vec::new();
    let mut shorter = Vec::with_capacity(systems.len());
    for (index, system) in systems.iter().enumerate() {
        let start = chunks.len() as u32;
        let count = system.rows.div_ceil(LONG_CHUNK);
        chunks.extend((0..count).map(|j| Chunk {
            system: index as u32,
            begin: j * LONG_CHUNK,
            rows: LONG_CHUNK.min(system.rows - j * LONG_CHUNK),
            next: start + (j + 1) % count,
        }));
        shorter.push(System { start, rows: count, flags: system.flags & FLAG_CYCLIC, ..*system });
    }
    (chunks, shorter)
}
