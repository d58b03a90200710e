//! The exact rule's rounds on the device.

use bytemuck::{Pod, Zeroable};
use rustc_hash::FxHashMap;

use super::kernel;
use super::layout::Layout;
use crate::error::Result;
use crate::gpu::{Buffer, Recording};
use crate::laplacian::exact::lambda;

/// The steps of a round.
pub(super) const ENTRIES: [&str; 4] = ["forward", "sweep", "inverse", "combine"];

/// `ExactParams` of `exact.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ExactParams {
    pub families: u32,
    pub dimension: u32,
}

/// `ExactFamily` of `exact.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ExactFamily {
    pub grids: u32,
    pub rows: u32,
    pub columns: u32,
    pub coarse: u32,
    pub fine: u32,
    pub spectrum: u32,
    pub v: u32,
    pub table: u32,
    pub intervals: u32,
    pub step: u32,
}

/// Numbers of v, or of W, for one coordinate of a grid of old points.
fn half_refined([rows, columns]: [usize; 2]) -> usize {
    rows * (2 * columns - 1)
}

/// Threads of every step, for a grid of old points.
fn threads(dimension: usize) -> [impl Fn([usize; 2]) -> usize; 4] {
    [0, 1, 2, 3].map(|step| {
        move |[rows, columns]: [usize; 2]| {
            dimension
                * match step {
                    0 => rows * ((columns - 1) / 2 + 1),
                    1 => 2 * columns - 1,
                    2 => rows * columns,
                    _ => (2 * rows - 1) * (2 * columns - 1),
                }
        }
    })
}

/// Records all rounds. Each reads one array and writes the next.
pub(super) fn record(recording: &mut Recording, layout: &Layout, stations: &[&Buffer]) -> Result<()> {
    let rounds = (stations.len() - 1) as u32;
    let tables = Tables::new(layout, rounds);
    let numbers = recording.upload_reals(&tables.numbers);
    // The last round has the most of everything.
    let spectrum = recording.storage_reals(layout.offsets(rounds - 1).1);
    let [v, w] = [0, 1].map(|_| recording.storage_reals(layout.numbers(rounds - 1, half_refined).1));
    for (round, pair) in stations.windows(2).enumerate() {
        let round = round as u32;
        let families = recording.upload(&families(layout, &tables, round, rounds));
        let params = recording
            .uniform(&ExactParams { families: layout.families.len() as u32, dimension: layout.dimension as u32 });
        for (entry, threads) in ENTRIES.into_iter().zip(threads(layout.dimension)) {
            let (starts, total) = layout.workgroups(round, threads);
            let buffers = [
                ("params", &params),
                ("families", &families),
                ("starts", &recording.upload(&starts)),
                ("tables", &numbers),
                ("coarse", pair[0]),
                ("spectrum", &spectrum),
                ("v", &v),
                ("w", &w),
                ("fine", pair[1]),
            ];
            recording.dispatch(&kernel("laplacian/exact.wgsl", entry, recording.precision()), total, 1, &buffers)?;
        }
    }
    Ok(())
}

fn families(layout: &Layout, tables: &Tables, round: u32, rounds: u32) -> Vec<ExactFamily> {
    let (coarse, fine) = (layout.offsets(round).0, layout.offsets(round + 1).0);
    let v = layout.numbers(round, half_refined).0;
    let family = |(k, [rows, columns]): (usize, [usize; 2])| {
        let last = (layout.families[k].shape[1] - 1) << rounds;
        ExactFamily {
            grids: layout.families[k].count as u32,
            rows: rows as u32,
            columns: columns as u32,
            coarse: coarse[k] as u32,
            fine: fine[k] as u32,
            // The spectrum of a row has as many numbers as the row has points.
            spectrum: coarse[k] as u32,
            v: v[k] as u32,
            table: tables.first[&last] as u32,
            intervals: last as u32,
            step: 1 << (rounds - 1 - round),
        }
    };
    layout.shapes(round).enumerate().map(family).collect()
}

/// Cosines and eigenvalues for the widths that grids have in the end.
///
/// The widths before it take every second, fourth, … of them.
struct Tables {
    /// The first number for a count of intervals.
    first: FxHashMap<usize, usize>,
    numbers: Vec<f64>,
}

impl Tables {
    fn new(layout: &Layout, rounds: u32) -> Self {
        let mut tables = Tables { first: FxHashMap::default(), numbers: Vec::new() };
        for [_, columns] in layout.shapes(rounds) {
            let intervals = columns - 1;
            let first = tables.numbers.len();
            if *tables.first.entry(intervals).or_insert(first) < first {
                continue;
            }
            let cosine = |k: usize| (std::f64::consts::PI * k as f64 / intervals as f64).cos();
            tables.numbers.extend((0..2 * intervals).map(cosine));
            tables.numbers.extend((0..=intervals).map(|l| lambda(l, intervals / 2)));
        }
        tables
    }
}
