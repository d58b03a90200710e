//! [`Subdivide`]: the method, on batches of grids.

use super::Grids;
use crate::device::Device;
use crate::error::Result;
use crate::report::CurveStatus;

/// How new points come about.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Rule {
    /// The equations E₂ₙSp = UEₙp are solved: all points count.
    #[default]
    Exact,
}

/// Laplacian subdivision: every round puts a point between any two neighbours, and one in the middle of any four.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivide {
    /// How new points come about.
    pub rule: Rule,
    /// How often.
    pub rounds: u32,
}

/// What became of one grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GridReport {
    /// [`Converged`](CurveStatus::Converged): subdivided; `Degenerate`: without points; `Invalid`: a value is NaN or infinite, or a result overflows.
    pub status: CurveStatus,
    /// Why, where the status needs a word: names the grid, the place, the value and the remedy.
    pub message: Option<String>,
}

/// Subdivided grids and one report each, in the order they came in.
#[derive(Clone, Debug)]
pub struct Subdivided {
    grids: Grids,
    reports: Vec<GridReport>,
    device: String,
}

impl Subdivide {
    /// Subdivides all grids. One that cannot be subdivided has the same shape as if it could, and NaN in all its places.
    ///
    /// # Errors
    /// What concerns the whole run: more points than there is memory for, a device that fails.
    pub fn fit(&self, grids: &Grids, device: &Device) -> Result<Subdivided> {
        let _ = (grids, device);
        todo!()
    }
}

impl Subdivided {
    /// The subdivided grids: (rows − 1) · 2^rounds + 1 rows, and columns likewise.
    pub fn grids(&self) -> &Grids {
        &self.grids
    }

    /// One report a grid.
    pub fn reports(&self) -> &[GridReport] {
        &self.reports
    }

    /// Which device did the work, and in which precision.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// Number of grids whose status is usable.
    pub fn usable(&self) -> usize {
        self.reports.iter().filter(|report| report.status.is_usable()).count()
    }
}
