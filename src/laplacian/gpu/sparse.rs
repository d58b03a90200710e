//! [`Weights`]: the stencils of a sparse rule on the device, and its rounds.

use bytemuck::{Pod, Zeroable};
use rustc_hash::FxHashMap;

use super::layout::Layout;
use super::{kernel, refined};
use crate::error::Result;
use crate::gpu::{Buffer, Recording};
use crate::laplacian::SparseRule;
use crate::laplacian::stencil::{Axis, Stencils};

pub(super) const ENTRY: &str = "subdivide";

/// `SparseParams` of `sparse.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SparseParams {
    pub families: u32,
    pub dimension: u32,
    pub radius: u32,
}

/// `SparseFamily` of `sparse.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SparseFamily {
    pub grids: u32,
    pub rows: u32,
    pub columns: u32,
    pub coarse: u32,
    pub fine: u32,
    pub stencils: u32,
    pub lines: u32,
    pub row_border: u32,
    pub column_border: u32,
}

/// The stencils of all pairs of axes that a run's grids have.
pub(super) struct Weights {
    radius: usize,
    /// The fewest intervals with which an axis has two separate borders.
    least: usize,
    /// The first weight of each pair.
    first: FxHashMap<[Axis; 2], usize>,
    weights: Vec<f64>,
}

impl Weights {
    pub fn new(rule: &SparseRule) -> Self {
        let (radius, least) = (rule.radius(), rule.least_intervals());
        Weights { radius, least, first: FxHashMap::default(), weights: Vec::new() }
    }

    /// Adds the stencils that grids of these shapes need in some rounds.
    pub fn add(&mut self, rule: &SparseRule, shapes: impl Iterator<Item = [usize; 2]>, rounds: u32) {
        for shape in shapes {
            for round in 0..rounds {
                let axes = self.axes(refined(shape, round).expect("the last shapes have fitted into memory"));
                let first = self.weights.len();
                if let std::collections::hash_map::Entry::Vacant(entry) = self.first.entry(axes) {
                    entry.insert(first);
                    self.weights.extend_from_slice(Stencils::<f64>::new(rule, axes).weights());
                }
            }
        }
    }

    /// Number of all weights.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// The most iterations of a thread's loops, for `dimension` values per point.
    ///
    /// The search for the thread's family counts too.
    pub fn turns(&self, dimension: usize) -> usize {
        dimension.saturating_mul(1 + (self.radius + 1) * (self.radius + 2)).saturating_add(32)
    }

    fn axes(&self, shape: [usize; 2]) -> [Axis; 2] {
        shape.map(|points| Axis::of(points - 1, self.least))
    }

    /// Records all rounds. Each reads one array and writes the next.
    pub fn record(&self, recording: &mut Recording, layout: &Layout, stations: &[&Buffer]) -> Result<()> {
        let weights = recording.upload_reals(&self.weights);
        let kernel = kernel("laplacian/sparse.wgsl", ENTRY, recording.precision());
        for (round, pair) in stations.windows(2).enumerate() {
            let round = round as u32;
            let families = self.families(layout, round);
            let params = SparseParams {
                families: families.len() as u32,
                dimension: layout.dimension as u32,
                radius: self.radius as u32,
            };
            let (starts, total) = layout.workgroups(round + 1, |[rows, columns]| rows * columns);
            let buffers = [
                ("params", &recording.uniform(&params)),
                ("families", &recording.upload(&families)),
                ("starts", &recording.upload(&starts)),
                ("weights", &weights),
                ("coarse", pair[0]),
                ("fine", pair[1]),
            ];
            recording.dispatch(&kernel, total, 1, &buffers)?;
        }
        Ok(())
    }

    fn families(&self, layout: &Layout, round: u32) -> Vec<SparseFamily> {
        let (coarse, fine) = (layout.offsets(round).0, layout.offsets(round + 1).0);
        // If every row is a line, no row is beyond the border.
        let border = |axis: Axis| match axis {
            Axis::Short(_) => u32::MAX,
            Axis::Long(border) => border as u32,
        };
        let family = |(k, shape @ [rows, columns]): (usize, [usize; 2])| {
            let axes = self.axes(shape);
            SparseFamily {
                grids: layout.families[k].count as u32,
                rows: rows as u32,
                columns: columns as u32,
                coarse: coarse[k] as u32,
                fine: fine[k] as u32,
                stencils: self.first[&axes] as u32,
                lines: axes[1].lines() as u32,
                row_border: border(axes[0]),
                column_border: border(axes[1]),
            }
        };
        layout.shapes(round).enumerate().map(family).collect()
    }
}
