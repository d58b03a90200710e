//! Batched tridiagonal systems on the GPU: partition and cyclic reduction over a ring of lanes.
//!
//! The kernels work on rows in the form (excess + left + right) x_i − left x_{i−1} − right x_{i+1}
//! = rhs_i, given by a
//! [`RowSource`]: arrays for the public solver, or computed on the fly from the data of a spline. Which kernel serves
//! which system is planned here, by its number of rows.

mod batch;
mod lanes;
mod long;
mod self_test;
mod thread;

use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::gpu::source::Definitions;
use crate::gpu::{Buffer, KernelKey, Recording, plan};
use crate::precision::Precision;

pub use batch::solve_on_gpu;
pub use lanes::{Reduced, Row, eliminate, solve_lanes};
pub use long::solve_long;
pub use self_test::{SelfTest, self_test};
pub use thread::solve_thread;

/// The kernel that solves a batch. [`Auto`](Self::Auto) is right for all but tests and benches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RingKernel {
    /// By the number of rows and what the adapter can do.
    #[default]
    Auto,
    /// Eight lanes a system, exchanging by subgroup shuffles, rows in registers. Up to 256 rows.
    Subgroup,
    /// 8 or 128 lanes a system, exchanging through workgroup memory. Up to 4,096 rows.
    Workgroup,
    /// One thread a system, coefficients in scratch memory.
    Thread,
    /// Three dispatches: reduce, solve what is left, substitute.
    Long,
}

/// `Params` of `ring/mod.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// Number of systems (or chunks, in the long kernels).
    pub count: u32,
    /// Right-hand sides a row has in memory.
    pub columns: u32,
    /// First of those solved for.
    pub column: u32,
}

/// `System` of `ring/mod.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct System {
    /// First row in the arrays.
    pub start: u32,
    /// Number of rows, at least 1.
    pub rows: u32,
    /// Bits the row source understands; [`FLAG_CYCLIC`] among them.
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

/// Status word of a system that was solved; 0 means that no kernel wrote it.
pub const STATUS_SOLVED: u32 = 1;

/// Status word of a singular system, of which one solution is given.
pub const STATUS_SINGULAR: u32 = 2;

/// Where kernels take their rows from: a shader file that defines `load_row`, `load_rhs` and
/// `store`.
pub struct RowSource<'a> {
    /// Path below `shaders/`.
    pub path: &'static str,
    /// Definitions of its own.
    pub definitions: Definitions,
    /// Its buffers by name.
    pub buffers: Vec<(&'a str, &'a Buffer)>,
}

/// Lanes of the small ring, one system a subgroup of at least this size.
const SMALL_RING: u32 = 8;

/// Lanes of the large ring, one system a workgroup.
const LARGE_RING: u32 = 128;

/// Rows a lane holds in registers, by bucket: unrolled in the kernel's text. Two at least, since a
/// system shorter than the ring is spread over the largest power of two of lanes not above its
/// rows.
const SMALL_CHUNKS: [u32; 5] = [2, 4, 8, 16, 32];

/// The same for the large ring.
const LARGE_CHUNKS: [u32; 3] = [8, 16, 32];

/// Systems up to this many rows are solved by one thread each where there are no subgroups: on
/// llvmpipe in f32 that is 3.5 times as fast as exchanging through memory at 16 rows, 1.5 times at
/// 64, and about even at 256 (benches/RESULTS.md).
const SHORT_ROWS: u32 = 64;

/// Above this many rows software adapters take the long kernels, which compile in less than a
/// second, where llvmpipe needs seconds for those with more than 8 rows a lane unrolled in their
/// text (2 s for 16, 7 s for 32, once measured).
const QUICK_ROWS: u32 = 64;

/// Rows a single thread takes at most: it loops over them twice, and llvmpipe ends a thread's
/// loops, without a word, after 65,535 iterations all told.
const THREAD_ROWS: u32 = 16_384;

/// Rows of a chunk of the long kernels, held in a function-scope array of the thread that
/// substitutes.
const LONG_CHUNK: u32 = 32;

/// Threads a workgroup, except where the large ring is one.
const GROUP: u32 = 64;

/// Right-hand sides solved for together: a WGSL vector.
const MAX_COLUMNS_TOGETHER: u32 = 4;

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
    /// Records the dispatches that solve all systems: `solution` takes columns numbers a row,
    /// `status` a word a system.
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
                Variant::Long => long::record(&solve, recording, source, solution, status)?,
                _ => solve.record_bucket(recording, *variant, source, solution, status)?,
            }
        }
        Ok(())
    }

    /// The variants in use, by increasing number of rows they take.
    fn variants(&self, recording: &Recording<'_>) -> Vec<Variant> {
        let small = |subgroup| SMALL_CHUNKS.map(|q| Variant::Lanes { lanes: SMALL_RING, q, subgroup });
        let large = LARGE_CHUNKS.map(|q| Variant::Lanes { lanes: LARGE_RING, q, subgroup: false });
        match self.kernel {
            RingKernel::Thread => vec![Variant::Thread { most_rows: THREAD_ROWS }, Variant::Long],
            RingKernel::Long => vec![Variant::Long],
            RingKernel::Workgroup => small(false).into_iter().chain(large).chain([Variant::Long]).collect(),
            RingKernel::Subgroup => small(true).into_iter().chain([Variant::Long]).collect(),
            RingKernel::Auto => {
                let adapter = recording.gpu().summary();
                let alone = (!adapter.has_subgroups).then_some(Variant::Thread { most_rows: SHORT_ROWS });
                let unrolled = small(adapter.has_subgroups).into_iter().chain(large);
                let quick = unrolled.filter(|variant| !adapter.is_software() || variant.most_rows() <= QUICK_ROWS);
                alone.into_iter().chain(quick).chain([Variant::Long]).collect()
            }
        }
    }

    fn record_bucket(
        &self,
        recording: &mut Recording<'_>,
        variant: Variant,
        source: &RowSource<'_>,
        solution: &Buffer,
        status: &Buffer,
    ) -> Result<()> {
        let systems = recording.upload(self.systems);
        let mut buffers = vec![("systems", &systems), ("solution", solution), ("status", status)];
        let scratch = matches!(variant, Variant::Thread { .. }).then(|| {
            let end = self.systems.iter().map(|system| system.start + system.rows).max().unwrap_or(0);
            recording.storage_reals(2 * end as usize)
        });
        buffers.extend(scratch.as_ref().map(|scratch| ("scratch", scratch)));
        buffers.extend(&source.buffers);
        self.for_each_column_group(|column, together| {
            let (path, definitions, per_group) = variant.kernel();
            let key = kernel_key(path, "solve", recording.precision(), definitions, source, together);
            let count = self.systems.len();
            let params = recording.uniform(&Params { count: count as u32, columns: self.columns, column });
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

#[derive(Clone, Copy, Debug)]
enum Variant {
    Lanes { lanes: u32, q: u32, subgroup: bool },
    Thread { most_rows: u32 },
    Long,
}

impl Variant {
    /// Path, definitions, and systems a workgroup, of the kernel that solves in one dispatch.
    fn kernel(self) -> (&'static str, Definitions, usize) {
        let Variant::Lanes { lanes, q, subgroup } = self else {
            return ("linalg/ring/thread.wgsl", crate::gpu::source::definitions([("GROUP", &GROUP)]), GROUP as usize);
        };
        let group = GROUP.max(lanes);
        let mut definitions = crate::gpu::source::definitions([("LANES", &lanes), ("Q", &q), ("GROUP", &group)]);
        if subgroup {
            definitions.insert("SUBGROUP".into(), "1".into());
        }
        ("linalg/ring/lanes.wgsl", definitions, (group / lanes) as usize)
    }

    fn most_rows(self) -> u32 {
        match self {
            Variant::Lanes { lanes, q, .. } => lanes * q,
            Variant::Thread { most_rows } => most_rows,
            Variant::Long => u32::MAX,
        }
    }
}

/// A kernel of this room, with the row source's file and definitions and the number of right-hand
/// sides.
fn kernel_key(
    path: &'static str,
    entry: &'static str,
    precision: Precision,
    mut definitions: Definitions,
    source: &RowSource<'_>,
    columns: u32,
) -> KernelKey {
    definitions.extend(source.definitions.clone());
    definitions.insert("ROWS".into(), source.path.into());
    definitions.insert("R".into(), columns.to_string());
    if columns == 1 {
        definitions.insert("R1".into(), "1".into());
    }
    KernelKey { path, entry, precision, definitions }
}

/// The row sources of this room.
pub fn row_sources() -> Vec<(&'static str, Definitions)> {
    let network = crate::gpu::source::definitions([("NETWORK", &1)]);
    vec![
        ("linalg/ring/given.wgsl", Definitions::new()),
        ("linalg/ring/given.wgsl", network),
        ("linalg/ring/parts.wgsl", Definitions::new()),
    ]
}

/// Every ring kernel in every form, for one row source.
pub fn kernels(precision: Precision, rows: &'static str, definitions: &Definitions) -> Vec<KernelKey> {
    let source = RowSource { path: rows, definitions: definitions.clone(), buffers: Vec::new() };
    let small = [false, true]
        .into_iter()
        .flat_map(|subgroup| SMALL_CHUNKS.map(|q| Variant::Lanes { lanes: SMALL_RING, q, subgroup }));
    let large = LARGE_CHUNKS.map(|q| Variant::Lanes { lanes: LARGE_RING, q, subgroup: false });
    let mut keys = Vec::new();
    for columns in 1..=MAX_COLUMNS_TOGETHER {
        for variant in small.clone().chain(large).chain([Variant::Thread { most_rows: THREAD_ROWS }]) {
            let (path, own, _) = variant.kernel();
            keys.push(kernel_key(path, "solve", precision, own, &source, columns));
        }
        for entry in ["reduce", "substitute"] {
            keys.push(long::key(entry, precision, &source, columns));
        }
    }
    keys
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::reflect::assert_layout;

    #[test]
    fn structs_shared_with_the_kernels_have_their_layout() {
        let key = long::key(
            "reduce",
            Precision::F32,
            &RowSource { path: "linalg/ring/given.wgsl", definitions: Definitions::new(), buffers: vec![] },
            1,
        );
        assert_layout!(key, Params { count, columns, column });
        assert_layout!(key, System { start, rows, flags, index });
        assert_layout!(key, Chunk { system, begin, rows, next });
    }
}
