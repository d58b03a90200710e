//! [`subdivide`]: many grids, all rounds, on a GPU.
//!
//! Both rules keep constants. So a grid is sent relative to the middle of its extent, coordinate by
//! coordinate, and divided by the power of two at or below the largest difference, in f64. Results are
//! good to 2e-6 of half their largest extent in f32, and to 1e-12 in f64.
//!
//! The host computes some grids in f64 instead:
//!
//! - Grids of one row or column, whose new points are means of two.
//! - Grids that do not fit into the device's arrays.
//! - Grids whose sums are too long for a thread of the device. There the host's fast transforms win
//!   in any case.

mod exact;
mod layout;
mod sparse;
#[cfg(all(test, feature = "gpu"))]
mod tests;

use std::borrow::Cow;
use std::ops::Range;

use layout::Layout;
use sparse::Weights;

use super::refine::{Refiner, is_line, refined};
use super::{GridReport, Grids, Rule};
use crate::error::Result;
use crate::gpu::plan::{self, LOOP_TURNS};
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, Downloaded, Gpu, KernelKey, Lost, Pending, kept, once, pipeline};
use crate::linalg::{power_of_two, take, tasks};
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;
use crate::status::CurveStatus;

/// Threads of a workgroup.
const GROUP: usize = 64;

/// The most new values of a chunk. One chunk is packed while the one before is computed.
const MOST_NUMBERS: u64 = 1 << 23;

/// The most products of the cosine transforms of a submission.
///
/// They take seconds on software adapters, far less than the time limit of a submission.
const MOST_PRODUCTS: f64 = (1u64 << 31) as f64;

/// Every kernel of this module.
pub(crate) fn laplacian_kernels(precision: Precision) -> Vec<KernelKey> {
    let exact = exact::ENTRIES.map(|entry| kernel("laplacian/exact.wgsl", entry, precision));
    [kernel("laplacian/sparse.wgsl", sparse::ENTRY, precision)].into_iter().chain(exact).collect()
}

fn kernel(path: &'static str, entry: &'static str, precision: Precision) -> KernelKey {
    KernelKey { path, entry, precision, definitions: definitions([("GROUP", &GROUP)]) }
}

/// Subdivides the grids whose report is usable. Fills the others with NaN.
///
/// # Errors
/// Errors of compiling the kernel and of submissions.
pub(super) fn subdivide(
    rule: &Rule,
    rounds: u32,
    grids: &Grids,
    gpu: &Gpu,
    precision: Precision,
    values: &mut [f64],
    reports: &mut [GridReport],
) -> Result<()> {
    let lost = Subdivision::new(rule, rounds, grids, gpu, precision, reports).run(rule, values)?;
    if let Some(Lost { finished, why }) = lost {
        for (i, report) in reports.iter_mut().enumerate().skip(finished).filter(|(_, report)| report.status.is_usable())
        {
            let message = format!("{}: it was not subdivided: {why}", grids.place(i));
            *report = GridReport { status: CurveStatus::NotConverged, message: Some(message) };
        }
    }
    Ok(())
}

/// The subdivision of many grids.
struct Subdivision<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    grids: &'a Grids,
    reports: &'a [GridReport],
    rounds: u32,
    rule: Prepared,
    /// Which grids the device gets.
    sent: Vec<bool>,
}

/// A rule as the kernels need it.
enum Prepared {
    Exact,
    Sparse(Weights),
}

/// A chunk on the device.
struct UnderWay<'a> {
    /// `None` if no grid of the chunk is sent.
    pending: Option<Pending<'a>>,
    layout: Layout,
    frames: Vec<f64>,
}

impl<'a> Subdivision<'a> {
    fn new(
        rule: &Rule,
        rounds: u32,
        grids: &'a Grids,
        gpu: &'a Gpu,
        precision: Precision,
        reports: &'a [GridReport],
    ) -> Self {
        let prepared = match rule {
            Rule::Exact => Prepared::Exact,
            Rule::Sparse(rule) => Prepared::Sparse(Weights::new(rule)),
        };
        let mut subdivision = Subdivision { gpu, precision, grids, reports, rounds, rule: prepared, sent: Vec::new() };
        subdivision.sent =
            (0..grids.len()).map(|i| reports[i].status.is_usable() && subdivision.takes(grids.shape(i))).collect();
        if let (Prepared::Sparse(weights), Rule::Sparse(rule)) = (&mut subdivision.rule, rule) {
            let shapes = (0..grids.len()).filter(|&i| subdivision.sent[i]).map(|i| grids.shape(i));
            weights.add(rule, shapes, rounds);
            if weights.len() as u64 * precision.bytes() > gpu.limits().array_bytes() {
                subdivision.sent.fill(false);
            }
        }
        subdivision
    }

    /// Whether the device computes grids of this shape.
    fn takes(&self, shape: [usize; 2]) -> bool {
        if is_line(shape) || self.rounds == 0 {
            return false;
        }
        // No array has more numbers than the new values.
        let fits = self.values(shape) as u64 <= self.gpu.limits().array_bytes() / self.precision.bytes();
        let is_short = match &self.rule {
            Prepared::Exact => {
                let [rows, columns] = self.shape_after(shape, self.rounds);
                // Sums are of half as many terms, twice, in blocks of eight. Places in tables,
                // multiplied, stay below 2³² too.
                (rows.max(columns) / 8).saturating_mul(9) <= LOOP_TURNS && self.products(shape) <= MOST_PRODUCTS
            }
            Prepared::Sparse(weights) => weights.turns(self.grids.dimension()) <= LOOP_TURNS,
        };
        fits && is_short
    }

    fn shape_after(&self, shape: [usize; 2], rounds: u32) -> [usize; 2] {
        refined(shape, rounds).expect("the last shapes have fitted into memory")
    }

    /// New values of a grid.
    fn values(&self, shape: [usize; 2]) -> usize {
        let [rows, columns] = self.shape_after(shape, self.rounds);
        rows * columns * self.grids.dimension()
    }

    /// Approximate number of products of a grid's transforms.
    fn products(&self, shape: [usize; 2]) -> f64 {
        match self.rule {
            Prepared::Sparse(_) => 0.0,
            Prepared::Exact => {
                let [rows, columns] = self.shape_after(shape, self.rounds - 1).map(|points| points as f64);
                // Each round has eight times as many as the one before.
                8.0 / 7.0 * 2.5 * rows * columns * columns * self.grids.dimension() as f64
            }
        }
    }

    fn run(&self, rule: &Rule, values: &mut [f64]) -> Result<Option<Lost>> {
        let of_host: Vec<[usize; 2]> =
            (0..self.grids.len()).filter(|&i| !self.sent[i]).map(|i| self.grids.shape(i)).collect();
        let refiner = Refiner::<f64>::new(rule, &of_host, self.rounds);
        let mut left = values;
        let done = pipeline(
            self.chunks()?,
            |chunk| self.start(chunk),
            once(|UnderWay { pending, layout, frames }| Ok((pending.map(Pending::wait).transpose()?, layout, frames))),
            |chunk, (found, layout, frames): (Option<Vec<Downloaded>>, Layout, Vec<f64>)| {
                let found = found.as_ref().map_or(Cow::default(), |found| found[0].reals());
                self.finish(chunk, &found, &layout, &frames, &refiner, &mut left);
                Ok(())
            },
        );
        left.fill(f64::NAN);
        kept(done)
    }

    fn chunks(&self) -> Result<Vec<Range<usize>>> {
        // Old and new values, and what is downloaded and packed. The exact rule has spectra, v, W
        // and tables too, each smaller than the new values.
        let arrays = if let Prepared::Exact = self.rule { 7 } else { 4 };
        let together = arrays * self.precision.bytes();
        let limits = self.gpu.limits().with_chunks_of(MOST_NUMBERS * together);
        let values = (0..self.grids.len()).map(|i| if self.sent[i] { self.values(self.grids.shape(i)) } else { 1 });
        let products = |i: usize| if self.sent[i] { self.products(self.grids.shape(i)) } else { 0.0 };
        let chunks = plan::chunks(values, self.precision.bytes(), together, &limits)?;
        Ok(chunks.into_iter().flat_map(|chunk| divided(chunk, products)).collect())
    }

    fn start(&self, chunk: &Range<usize>) -> Result<UnderWay<'a>> {
        let layout = Layout::new(self.grids, chunk, &self.sent);
        let mut frames = vec![0.0; layout.members.len() * (self.grids.dimension() + 1)];
        if layout.members.is_empty() {
            return Ok(UnderWay { pending: None, layout, frames });
        }
        let given = self.pack(&layout, &mut frames);
        let mut recording = self.gpu.record(self.precision);
        let numbers = |rounds: u32| layout.offsets(rounds).1;
        // The next round reads what one round makes. Two arrays take turns. The larger one is for
        // the last round and every second one before it.
        let last = recording.storage_reals(numbers(self.rounds));
        let before = recording.storage_reals(if self.rounds > 1 { numbers(self.rounds - 1) } else { 0 });
        let given = recording.upload_reals(&given);
        let stations: Vec<&Buffer> = [&given]
            .into_iter()
            .chain((1..=self.rounds).map(|round| if (self.rounds - round).is_multiple_of(2) { &last } else { &before }))
            .collect();
        match &self.rule {
            Prepared::Exact => exact::record(&mut recording, &layout, &stations)?,
            Prepared::Sparse(weights) => weights.record(&mut recording, &layout, &stations)?,
        }
        recording.download(&last);
        Ok(UnderWay { pending: Some(recording.submit()?), layout, frames })
    }

    /// The values of all grids in their frames.
    ///
    /// A frame is the middle of every coordinate, and a size.
    fn pack(&self, layout: &Layout, frames: &mut [f64]) -> Vec<f64> {
        let dimension = self.grids.dimension();
        let mut given = vec![0.0; layout.offsets(0).1];
        let mut left = &mut given[..];
        let parts: Vec<_> = layout
            .members
            .iter()
            .zip(frames.chunks_exact_mut(dimension + 1))
            .map(|(&i, frame)| (self.grids.grid(i), frame, take(&mut left, self.grids.grid(i).len())))
            .collect();
        parallel::of(parts, |(own, frame, given)| {
            let (size, middle) = frame.split_last_mut().expect("the size is always there");
            *size = frame_of(own, middle);
            for (given, own) in given.chunks_exact_mut(dimension).zip(own.chunks_exact(dimension)) {
                for c in 0..dimension {
                    given[c] = (own[c] - middle[c]) / *size;
                }
            }
        });
        given
    }

    /// Puts the values of a chunk's grids in their places, at the beginning of what is left to
    /// fill.
    fn finish(
        &self,
        chunk: &Range<usize>,
        found: &[f64],
        layout: &Layout,
        frames: &[f64],
        refiner: &Refiner<f64>,
        left: &mut &mut [f64],
    ) {
        let dimension = self.grids.dimension();
        let places = layout.places(self.rounds);
        let offsets = ragged::offsets(chunk.clone().map(|i| self.values(self.grids.shape(i))));
        let parts: Vec<_> = tasks(&offsets)
            .into_iter()
            .map(|task| (task.clone(), take(left, offsets[task.end] - offsets[task.start])))
            .collect();
        parallel::of(parts, |(task, mut values)| {
            for k in task {
                let i = chunk.start + k;
                let fine = take(&mut values, offsets[k + 1] - offsets[k]);
                if let Some((member, start)) = places[k] {
                    let frame = &frames[member * (dimension + 1)..][..dimension + 1];
                    let (size, middle) = frame.split_last().expect("the size is always there");
                    let found = &found[start..start + fine.len()];
                    for (fine, found) in fine.chunks_exact_mut(dimension).zip(found.chunks_exact(dimension)) {
                        for c in 0..dimension {
                            fine[c] = middle[c] + size * found[c];
                        }
                    }
                } else if self.reports[i].status.is_usable() {
                    refiner.refine(dimension, self.grids.shape(i), self.grids.grid(i), fine);
                } else {
                    fine.fill(f64::NAN);
                }
            }
        });
    }
}

/// The middle of each coordinate's extent, and the power of two at or below the largest distance
/// from it.
fn frame_of(values: &[f64], middle: &mut [f64]) -> f64 {
    let dimension = middle.len();
    let mut half = 0.0f64;
    for (c, middle) in middle.iter_mut().enumerate() {
        let axis = || values.iter().skip(c).step_by(dimension);
        let low = axis().fold(f64::INFINITY, |low, x| low.min(*x));
        let high = axis().fold(f64::NEG_INFINITY, |high, x| high.max(*x));
        // Halves first, since the sum may overflow.
        *middle = 0.5 * low + 0.5 * high;
        half = half.max(high - *middle).max(*middle - low);
    }
    power_of_two(&[half])
}

/// Divides a chunk if its products are too many.
fn divided(chunk: Range<usize>, products: impl Fn(usize) -> f64) -> Vec<Range<usize>> {
    let (mut parts, mut start, mut held) = (Vec::new(), chunk.start, 0.0);
    for i in chunk.clone() {
        if i > start && held + products(i) > MOST_PRODUCTS {
            parts.push(start..i);
            (start, held) = (i, 0.0);
        }
        held += products(i);
    }
    parts.push(start..chunk.end);
    parts
}
