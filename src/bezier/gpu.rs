//! [`Products`]: small matrices applied to many curves on a GPU. [`polygons`] completes and transforms
//! with it.

mod layout;
mod polygons;
#[cfg(all(test, feature = "gpu"))]
mod tests;

use std::ops::Range;

use super::operator::{BLOCK, Operator};
use super::prepared::NONE;
use super::ready::MOST_DATA;
use crate::error::{Error, Result};
use crate::gpu::plan::{self, LOOP_TURNS};
use crate::gpu::source::definitions;
use crate::gpu::{Downloaded, Gpu, Interrupted, KernelKey, Pending, once, pipeline};
use crate::linalg::{power_of_two, take};
use crate::parallel;
use crate::precision::Precision;
use bytemuck::{Pod, Zeroable};
use layout::{Layout, Results};
pub(super) use polygons::{complete_on_gpu, transform_on_gpu};

/// Threads of a workgroup, which is also its number of curves.
const GROUP: usize = 64;

/// The most numbers of a chunk, data and results together.
///
/// One chunk is packed while the one before is computed.
const MOST_NUMBERS: u64 = 1 << 23;

/// `ApplyParams` of `operator.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct ApplyParams {
    groups: u32,
}

/// `ApplyGroup` of `operator.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct ApplyGroup {
    matrix: u32,
    rows: u32,
    columns: u32,
    points: u32,
    start: u32,
    out: u32,
    curves: u32,
    padding: u32,
}

fn kernel(precision: Precision, dimension: usize) -> KernelKey {
    let definitions = definitions([("GROUP", &GROUP), ("DIMENSION", &dimension)]);
    KernelKey { path: "bezier/operator.wgsl", entry: "apply", precision, definitions }
}

/// Every variant of the kernel.
pub(crate) fn bezier_kernels(precision: Precision) -> Vec<KernelKey> {
    (1..=4).map(|dimension| kernel(precision, dimension)).collect()
}

/// A matrix to be applied.
///
/// The first `points` rows give points. The squares of the others are summed.
#[derive(Clone, Copy)]
struct Product<'a> {
    operator: &'a Operator<f64>,
    points: usize,
}

impl Product<'_> {
    fn has_energy(&self) -> bool {
        self.points < self.operator.rows()
    }

    /// The most rows of a thread. Other threads take the rest.
    fn rows_at_once(&self) -> usize {
        (LOOP_TURNS / (self.operator.columns() + 1)).max(1) * BLOCK
    }

    /// Whether the product is small enough for threads of the device.
    fn is_for_kernel(&self) -> bool {
        self.operator.columns() < LOOP_TURNS && (!self.has_energy() || self.operator.rows() <= self.rows_at_once())
    }
}

/// Products for many curves: the number of each curve's operator, or [`NONE`].
struct Products<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    /// Coordinates of a point.
    dimension: usize,
    operators: Vec<Option<Product<'a>>>,
    numbers: Vec<u32>,
}

/// Collects the data of a curve, a point per column. False if it has none.
type Gather<'a> = dyn Fn(usize, &mut Vec<f64>) -> bool + Sync + 'a;

/// A chunk on the device.
struct UnderWay<'a> {
    pending: Pending<'a>,
    layout: Layout,
    sizes: Vec<f64>,
}

impl<'a> Products<'a> {
    /// Applies all operators.
    ///
    /// `finish` gets the results of a range of curves. Ranges come in order and cover all curves.
    ///
    /// The data of a curve are divided by the power of two at or below the largest of them, which
    /// rounds nothing. A curve whose data are not all finite is not sent.
    fn run(&self, gather: &Gather, finish: &mut dyn FnMut(&Range<usize>, &Results)) -> Result<(), Interrupted> {
        let bytes = self.precision.bytes();
        self.check(bytes)?;
        // Storage, what is downloaded of it, and what is packed at the same time.
        let together = 3 * bytes;
        let limits = self.gpu.limits().with_chunks_of(MOST_NUMBERS * together);
        let numbers =
            self.numbers.iter().map(|&number| self.product(number).map_or(1, |product| self.numbers_of(product)));
        let chunks = plan::chunks(numbers, bytes, together, &limits)?;
        pipeline(
            chunks,
            |chunk| self.start(chunk, gather),
            once(|UnderWay { pending, layout, sizes }| Ok((pending.wait()?, layout, sizes))),
            |chunk, (results, layout, sizes): (Vec<Downloaded>, Layout, Vec<f64>)| {
                finish(chunk, &Results::new(self, &layout, &sizes, &results[0].reals()));
                Ok(())
            },
        )
    }

    /// The operator of a number, if the kernel can apply it.
    fn product(&self, number: u32) -> Option<Product<'a>> {
        self.operators.get(number as usize).copied().flatten().filter(Product::is_for_kernel)
    }

    /// Numbers of a curve: data and results.
    fn numbers_of(&self, product: Product) -> usize {
        product.operator.columns() * self.dimension + self.results_of(product)
    }

    /// Numbers in the results of a curve.
    ///
    /// They are its points, in f32 a magnitude per thread, the sum of its energy and, in f32, the
    /// magnitude of that sum.
    fn results_of(&self, product: Product) -> usize {
        let magnitude = self.magnitudes();
        let threads = product.points.div_ceil(product.rows_at_once()).max(1);
        product.points * self.dimension + threads * magnitude + usize::from(product.has_energy()) * (1 + magnitude)
    }

    /// 1 if there are magnitudes, else 0.
    ///
    /// In f64 there are none: no better precision could use them.
    fn magnitudes(&self) -> usize {
        usize::from(self.precision != Precision::F64)
    }

    /// Whether the device can hold all operators at once.
    fn check(&self, bytes: u64) -> Result<()> {
        let blocks: usize = self.operators.iter().flatten().map(|product| product.operator.blocks().len()).sum();
        let (asked, allowed) = ((blocks * BLOCK) as u64 * bytes, self.gpu.limits().array_bytes());
        if asked > allowed {
            let what = format!("{} matrices of Bézier curves", self.operators.iter().flatten().count());
            let remedy = "divide the batch, or use the CPU".into();
            return Err(Error::Limit { what, asked, allowed, remedy });
        }
        Ok(())
    }

    fn start(&self, chunk: &Range<usize>, gather: &Gather) -> Result<UnderWay<'a>> {
        let layout = Layout::new(self, chunk);
        let mut sizes = vec![f64::NAN; layout.members.len()];
        let data = self.pack(&layout, &mut sizes, gather);
        let mut operators: Vec<[f64; BLOCK]> = Vec::new();
        let mut groups = Vec::new();
        let mut last = None;
        for tile in &layout.tiles {
            let product = self.product(tile.number).expect("tiles are made of such");
            let columns = product.operator.columns();
            if last.replace(tile.number) != Some(tile.number) {
                operators.extend_from_slice(product.operator.blocks());
            }
            let first = operators.len() - product.operator.blocks().len();
            let at_once = product.rows_at_once();
            // A product without rows has one thread too. It says that all is 0.
            for (k, row) in (0..product.operator.rows().max(1)).step_by(at_once).enumerate() {
                let points = product.points.saturating_sub(row).min(at_once);
                groups.push(ApplyGroup {
                    matrix: (first + row / BLOCK * columns) as u32,
                    rows: (product.operator.rows() - row).min(at_once) as u32,
                    columns: columns as u32,
                    points: points as u32,
                    start: tile.start as u32,
                    out: (tile.out + (row * self.dimension + k * self.magnitudes()) * tile.curves) as u32,
                    curves: tile.curves as u32,
                    padding: 0,
                });
            }
        }
        if operators.is_empty() {
            operators.push([0.0; BLOCK]);
        }
        let mut recording = self.gpu.record(self.precision);
        let found = recording.storage_reals(layout.results);
        let params = recording.uniform(&ApplyParams { groups: groups.len() as u32 });
        let buffers = [
            ("params", &params),
            ("groups", &recording.upload(&groups)),
            ("matrices", &recording.upload_reals(operators.as_flattened())),
            ("data", &recording.upload_reals(&data)),
            ("found", &found),
        ];
        recording.dispatch(&kernel(self.precision, self.dimension), groups.len(), 1, &buffers)?;
        recording.download(&found);
        Ok(UnderWay { pending: recording.submit()?, layout, sizes })
    }

    /// The data of all curves, tile by tile, and their sizes: NaN where a curve is not sent.
    fn pack(&self, layout: &Layout, sizes: &mut [f64], gather: &Gather) -> Vec<f64> {
        let mut data = vec![0.0; layout.data];
        let (mut left, mut sizes_left) = (&mut data[..], sizes);
        let parts: Vec<_> = layout
            .tiles
            .iter()
            .map(|tile| {
                let columns = self.product(tile.number).expect("tiles are made of such").operator.columns();
                (tile, take(&mut left, columns * self.dimension * tile.curves), take(&mut sizes_left, tile.curves))
            })
            .collect();
        parallel::of(parts, |(tile, data, sizes)| {
            let mut own = Vec::with_capacity(MOST_DATA * self.dimension);
            for (lane, size) in sizes.iter_mut().enumerate() {
                let i = layout.members[tile.first + lane] as usize;
                if gather(i, &mut own) && own.iter().all(|x| x.is_finite()) {
                    *size = power_of_two(&own);
                    for (number, x) in own.iter().enumerate() {
                        data[number * tile.curves + lane] = x / *size;
                    }
                }
            }
        });
        data
    }
}
