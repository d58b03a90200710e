//! Batched tridiagonal systems on the GPU: partition and cyclic reduction over a ring of lanes.
//!
//! The kernels take rows (excess + left + right) x_i − left x_{i−1} − right x_{i+1} = rhs_i from a
//! [`RowSource`]: arrays of the public solver, or the data of a spline, from which rows are computed on
//! the fly. The number of rows of a system decides which kernel solves it.

mod batch;
mod lanes;
mod long;
mod self_test;

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::gpu::source::Definitions;
use crate::gpu::{Buffer, KernelKey, Recording, plan};
use crate::precision::Precision;

pub use batch::solve_on_gpu;
pub use lanes::{Reduced, Row, eliminate, solve_lanes};
pub use long::solve_long;
pub use self_test::{SelfTest, self_test};

/// The kernel that solves a batch. [`Auto`](Self::Auto) is right for all but tests and benches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RingKernel {
    /// By the number of rows and what the adapter can do.
    #[default]
    Auto,
    /// Eight lanes per system, which exchange by subgroup shuffles, with rows in registers. Up to 256
    /// rows, fewer with several right-hand sides or in f64. Longer systems as by [`Long`](Self::Long).
    Subgroup,
    /// 8, 32 or 128 lanes per system, which exchange through workgroup memory. Up to 4,096 rows, fewer
    /// with several right-hand sides or in f64. Longer systems as by [`Long`](Self::Long).
    Workgroup,
    /// One thread per system, with coefficients in scratch memory.
    Thread,
    /// Three dispatches: reduce, solve the shorter system, substitute.
    Long,
}

/// `Params` of `ring/mod.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of systems (or chunks, in the long kernels).
    pub count: u32,
    /// Right-hand sides of a row in memory.
    pub columns: u32,
    /// The first right-hand side solved for.
    pub column: u32,
    /// Lanes that share a system in `lanes.wgsl`.
    pub lanes: u32,
    /// `kind` of the [`RowSource`].
    pub kind: u32,
}

/// `System` of `ring/mod.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct System {
    /// First row in the arrays.
    pub start: u32,
    /// Number of rows, at least 1.
    pub rows: u32,
    /// [`FLAG_CYCLIC`], `FLAG_REPEATED` and flags of the row source.
    pub flags: u32,
    /// Where the status goes.
    pub index: u32,
}

/// `Chunk` of `long.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Chunk {
    /// Index of its system.
    pub system: u32,
    /// First row, within the system.
    pub begin: u32,
    /// Number of rows.
    pub rows: u32,
    /// The chunk after it.
    pub next: u32,
}

/// The last row is coupled to the first.
pub const FLAG_CYCLIC: u32 = 1;

/// The first unknown stands again after the last.
pub(crate) const FLAG_REPEATED: u32 = 2;

/// Kinds of rows of `given.wgsl`, besides three bands: a network, and splines on the integers.
const ROWS_NETWORK: u32 = 1;
pub(crate) const ROWS_UNIFORM: u32 = 2;

/// Status word of a system that was solved; 0 means that no kernel wrote it.
pub const STATUS_SOLVED: u32 = 1;

/// Status word of a singular system, of which one solution is given.
pub const STATUS_SINGULAR: u32 = 2;

/// The source of a kernel's rows.
pub struct RowSource<'a> {
    /// A shader file that defines `load_row`, `load_rhs` and `store_kept`: its path below `shaders/`.
    pub path: &'static str,
    /// Which of its kinds of rows it gives.
    pub kind: u32,
    /// Its buffers by name.
    pub buffers: Vec<(&'a str, &'a Buffer)>,
}

/// Lanes of a ring. A subgroup holds whole rings of the first. A workgroup holds one of the last.
const RINGS: [u32; 3] = [SUBGROUP_RING, 32, 128];

/// Rows of a lane, which are in registers, unrolled in the kernel's text.
const CHUNKS: [u32; 3] = [8, 16, 32];

/// Lanes of the ring that exchanges by shuffles. A subgroup has at least as many.
const SUBGROUP_RING: u32 = 8;

/// Words that the rows of a lane may take. A row is two numbers and its right-hand sides.
///
/// With 96 of them 128 registers suffice in f32, and two waves share an execution unit. With 192 in
/// f64 compilers run out of registers (benches/RESULTS.md).
const LANE_WORDS: u32 = 96;

/// Without subgroups, each system up to this many rows is solved by one thread. On llvmpipe in f32
/// that is 3.5 times as fast as exchanging through memory at 16 rows, 1.5 times at 64, and about even
/// at 256 (benches/RESULTS.md).
const SHORT_ROWS: u32 = 64;

/// Above this many rows software adapters take the long kernels, which compile in less than a second.
/// llvmpipe needs 2 s for 16 rows per lane, unrolled in the kernel's text, and 7 s for 32, once
/// measured.
const QUICK_ROWS: u32 = 64;

/// The most rows of a single thread. It loops over them twice, and llvmpipe silently ends a thread's
/// loops after 65,535 iterations in all.
const THREAD_ROWS: u32 = 16_384;

/// Rows of a chunk of the long kernels.
const LONG_CHUNK: u32 = 32;

/// Threads of a workgroup.
const GROUP: u32 = 64;

/// Threads of a workgroup that exchanges through its memory: the largest ring.
const EXCHANGING_GROUP: u32 = RINGS[2];

/// Right-hand sides solved for together: coordinates of a point.
const MAX_COLUMNS_TOGETHER: u32 = 3;

/// The systems of a batch, and what a recording needs to solve them.
pub struct Solve<'a> {
    /// The systems; ranges of the arrays, at least one row each.
    pub systems: &'a [System],
    /// Right-hand sides a row.
    pub columns: u32,
    /// Which kernel.
    pub kernel: RingKernel,
}

impl Solve<'_> {
    /// Records the dispatches that solve all systems.
    ///
    /// `solution` takes `columns` numbers per row, and `status` a word per system.
    pub fn record(
        &self,
        recording: &mut Recording<'_>,
        source: &RowSource<'_>,
        solution: &Buffer,
        status: &Buffer,
    ) -> Result<()> {
        let rows: Vec<usize> = self.systems.iter().map(|system| system.rows as usize).collect();
        let variants = self.variants(recording);
        let bounds: Vec<usize> = variants.iter().map(|variant| variant.most_rows() as usize).collect();
        let (order, ranges) = plan::buckets(&rows, &bounds);
        let sorted: Vec<System> = order.iter().map(|&i| self.systems[i as usize]).collect();
        for (variant, range) in variants.iter().zip(ranges).filter(|(_, range)| !range.is_empty()) {
            let solve = Solve { systems: &sorted[range], ..*self };
            match variant {
                KernelVariant::Long => long::record(&solve, recording, source, solution, status)?,
                _ => solve.record_bucket(recording, *variant, source, solution, status)?,
            }
        }
        Ok(())
    }

    /// The variants in use, by increasing number of rows they take.
    fn variants(&self, recording: &Recording<'_>) -> Vec<KernelVariant> {
        let together = self.columns.min(MAX_COLUMNS_TOGETHER);
        let rings = |subgroup| rings(recording.precision(), together, subgroup).into_iter();
        match self.kernel {
            RingKernel::Thread => vec![KernelVariant::Thread { most_rows: THREAD_ROWS }, KernelVariant::Long],
            RingKernel::Long => vec![KernelVariant::Long],
            RingKernel::Workgroup => rings(false).chain([KernelVariant::Long]).collect(),
            RingKernel::Subgroup => {
                let shuffled = |variant: &KernelVariant| matches!(variant, KernelVariant::Lanes { subgroup: true, .. });
                rings(true).filter(shuffled).chain([KernelVariant::Long]).collect()
            }
            RingKernel::Auto => {
                let adapter = recording.gpu().summary();
                let alone = (!adapter.has_subgroups).then_some(KernelVariant::Thread { most_rows: SHORT_ROWS });
                let quick = rings(adapter.has_subgroups)
                    .filter(|variant| !adapter.is_software() || variant.most_rows() <= QUICK_ROWS);
                alone.into_iter().chain(quick).chain([KernelVariant::Long]).collect()
            }
        }
    }

    fn record_bucket(
        &self,
        recording: &mut Recording<'_>,
        variant: KernelVariant,
        source: &RowSource<'_>,
        solution: &Buffer,
        status: &Buffer,
    ) -> Result<()> {
        let systems = recording.upload(self.systems);
        let mut buffers = vec![("systems", &systems), ("solution", solution), ("status", status)];
        let scratch = matches!(variant, KernelVariant::Thread { .. }).then(|| {
            let end = self.systems.iter().map(|system| system.start + system.rows).max().unwrap_or(0);
            recording.storage_reals(2 * end as usize)
        });
        buffers.extend(scratch.as_ref().map(|scratch| ("scratch", scratch)));
        buffers.extend(&source.buffers);
        self.for_each_column_group(|column, together| {
            let (path, definitions, per_group) = variant.kernel();
            let key = kernel_key(path, "solve", recording.precision(), definitions, Some(source.path), together);
            let (count, columns, kind) = (self.systems.len(), self.columns, source.kind);
            let params = Params { count: count as u32, columns, column, lanes: variant.lanes(), kind };
            let params = recording.uniform(&params);
            let mut all = buffers.clone();
            all.push(("params", &params));
            recording.dispatch(&key, count, per_group, &all)
        })
    }

    fn for_each_column_group(&self, mut each: impl FnMut(u32, u32) -> Result<()>) -> Result<()> {
        (0..self.columns)
            .step_by(MAX_COLUMNS_TOGETHER as usize)
            .try_for_each(|column| each(column, MAX_COLUMNS_TOGETHER.min(self.columns - column)))
    }
}

/// The rings that solve for `columns` right-hand sides together, by increasing number of rows.
///
/// Each takes more rows than the one before it.
fn rings(precision: Precision, columns: u32, has_subgroups: bool) -> Vec<KernelVariant> {
    let words = precision.bytes() as u32 / 4;
    let mut rings: Vec<KernelVariant> = Vec::new();
    for lanes in RINGS {
        for q in CHUNKS.into_iter().filter(|&q| q * (2 + columns) * words <= LANE_WORDS) {
            if rings.last().is_none_or(|last| last.most_rows() < lanes * q) {
                rings.push(KernelVariant::Lanes { lanes, q, subgroup: has_subgroups && lanes == SUBGROUP_RING });
            }
        }
    }
    rings
}

/// A kernel for systems up to a number of rows.
#[derive(Clone, Copy, Debug)]
enum KernelVariant {
    Lanes { lanes: u32, q: u32, subgroup: bool },
    Thread { most_rows: u32 },
    Long,
}

impl KernelVariant {
    /// Path and definitions of the kernel that solves in one dispatch, and its systems per workgroup.
    fn kernel(self) -> (&'static str, Definitions, usize) {
        let KernelVariant::Lanes { lanes, q, subgroup } = self else {
            return ("linalg/ring/thread.wgsl", crate::gpu::source::definitions([("GROUP", &GROUP)]), GROUP as usize);
        };
        let group = if subgroup { GROUP } else { EXCHANGING_GROUP };
        let mut definitions = crate::gpu::source::definitions([("Q", &q), ("GROUP", &group)]);
        if subgroup {
            definitions.insert("SUBGROUP".into(), "1".into());
        }
        ("linalg/ring/lanes.wgsl", definitions, (group / lanes) as usize)
    }

    /// Lanes that share a system.
    fn lanes(self) -> u32 {
        if let KernelVariant::Lanes { lanes, .. } = self { lanes } else { 1 }
    }

    fn most_rows(self) -> u32 {
        match self {
            KernelVariant::Lanes { lanes, q, .. } => lanes * q,
            KernelVariant::Thread { most_rows } => most_rows,
            KernelVariant::Long => u32::MAX,
        }
    }
}

/// A kernel of this room for this number of right-hand sides, and for rows of a source if it reads any.
fn kernel_key(
    path: &'static str,
    entry: &'static str,
    precision: Precision,
    mut definitions: Definitions,
    rows: Option<&str>,
    columns: u32,
) -> KernelKey {
    definitions.extend(rows.map(|path| ("ROWS".into(), path.into())));
    definitions.insert("R".into(), columns.to_string());
    KernelKey { path, entry, precision, definitions }
}

/// The row sources of this room: arrays, and kept rows of the long kernels.
pub(crate) const GIVEN: &str = "linalg/ring/given.wgsl";
const PARTS: &str = "linalg/ring/parts.wgsl";

/// Every variant of the ring kernels for rows of this room and of another source.
pub fn kernels(precision: Precision, other: &str) -> Vec<KernelKey> {
    let mut keys = BTreeMap::new();
    let mut add = |key: KernelKey| keys.insert(key.name(), key);
    for columns in 1..=MAX_COLUMNS_TOGETHER {
        add(long::key("substitute", precision, None, columns));
        for rows in [GIVEN, PARTS, other].map(Some) {
            add(long::key("reduce", precision, rows, columns));
            let rings = [false, true].into_iter().flat_map(|has_subgroups| rings(precision, columns, has_subgroups));
            for variant in rings.chain([KernelVariant::Thread { most_rows: THREAD_ROWS }]) {
                let (path, definitions, _) = variant.kernel();
                add(kernel_key(path, "solve", precision, definitions, rows, columns));
            }
        }
    }
    keys.into_values().collect()
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::reflect::assert_layout;

    #[test]
    fn structs_shared_with_the_kernels_have_their_layout() {
        let key = long::key("reduce", Precision::F32, Some(GIVEN), 1);
        assert_layout!(key, Params { count, columns, column, lanes, kind });
        assert_layout!(key, System { start, rows, flags, index });
        assert_layout!(key, Chunk { system, begin, rows, next });
    }
}
