//! [`Subdivide`]: the method, on batches of grids.

use super::refine::{Refiner, refined};
use super::report::GridReport;
use super::{Grids, Rule};
use crate::device::{Device, DeviceReport};
use crate::error::{Error, Result};
use crate::linalg::{take, tasks};
use crate::parallel;
use crate::ragged;
use crate::status::CurveStatus;

/// Results are checked for overflow if a value exceeds this. No rule amplifies values by 1e20.
const SAFE: f64 = 1e280;

/// Laplacian subdivision of grids.
///
/// Every round puts a point between any two neighbours, and one in the middle of any four.
///
/// ```
/// use faircurve::{Device, laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide}};
///
/// // A 3 × 3 grid with a peak in the middle.
/// let grids = Grids::uniform(1, [3, 3], vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])?;
/// let rule = Rule::Sparse(SparseRule::of_support(5, Reproduces::Constants)?);
/// let fine = Subdivide { rule, rounds: 3 }.fit(&grids, &Device::cpu())?;
/// assert_eq!(fine.grids().shape(0), [17, 17]);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivide {
    /// How new points are made.
    pub rule: Rule,
    /// Number of rounds.
    pub rounds: u32,
}

/// Subdivided grids with one report each, in order.
#[derive(Clone, Debug)]
pub struct Subdivided {
    grids: Grids,
    reports: Vec<GridReport>,
    device: DeviceReport,
}

impl Subdivide {
    /// Subdivides all grids.
    ///
    /// A grid that cannot be subdivided becomes a grid of NaN. Its neighbours are not affected. In
    /// a grid of one row or column, new points are midpoints.
    ///
    /// On a GPU results are good to 2e-6 of half their largest extent in f32 and to 1e-12 in f64. A
    /// grid's bits depend on nothing but the grid. The host computes grids of one row or column,
    /// grids that exceed the device's arrays, and, by the exact rule, grids of millions of new
    /// points.
    ///
    /// # Errors
    /// More points than memory, or a device that fails.
    pub fn fit(&self, grids: &Grids, device: &Device) -> Result<Subdivided> {
        let shapes = self.shapes(grids)?;
        let mut values = self.room(grids.dimension(), &shapes)?;
        let mut reports: Vec<GridReport> = parallel::map(grids.len(), 1, |i| grids.report(i));
        match device.as_gpu() {
            Some(gpu) => {
                let precision = device.kernel_precision(gpu, true)?;
                super::gpu::subdivide(&self.rule, self.rounds, grids, gpu, precision, &mut values, &mut reports)?;
            }
            None => self.on_cpu(grids, &shapes, &mut values, &reports),
        }
        let fine = Grids::new(grids.dimension(), shapes, values)?.with_file(grids.file().map(Into::into));
        let mut subdivided = Subdivided { grids: fine, reports, device: device.report(true)? };
        for i in 0..grids.len() {
            subdivided.check(i, grids);
        }
        Ok(subdivided)
    }

    /// The shapes of the subdivided grids.
    fn shapes(&self, grids: &Grids) -> Result<Vec<[usize; 2]>> {
        let shape = |i: usize| {
            let shape @ [rows, columns] = grids.shape(i);
            refined(shape, self.rounds).ok_or_else(|| {
                Error::argument(format!(
                    "{} rounds of a grid of {rows} × {columns} points make more points than there are numbers for: fewer rounds do",
                    self.rounds
                ))
            })
        };
        (0..grids.len()).map(shape).collect()
    }

    /// Allocates memory for all values.
    fn room(&self, dimension: usize, shapes: &[[usize; 2]]) -> Result<Vec<f64>> {
        let count = shapes.iter().try_fold(0usize, |sum, [rows, columns]| {
            sum.checked_add(rows.checked_mul(*columns)?.checked_mul(dimension)?)
        });
        // `try_reserve_exact` first, since an allocation that fails ends the program. Zeroed memory
        // is first written by the threads that compute.
        match count.filter(|&count| Vec::<f64>::new().try_reserve_exact(count).is_ok()) {
            Some(count) => Ok(vec![0.0; count]),
            None => {
                let points: f64 = shapes.iter().map(|[rows, columns]| *rows as f64 * *columns as f64).sum();
                Err(Error::argument(format!(
                    "{} rounds make {points:.3e} points, for which there is no memory: fewer rounds, or fewer grids at a time, do",
                    self.rounds
                )))
            }
        }
    }

    fn on_cpu(&self, grids: &Grids, shapes: &[[usize; 2]], values: &mut [f64], reports: &[GridReport]) {
        let dimension = grids.dimension();
        let refiner = Refiner::<f64>::new(&self.rule, grids.shapes(), self.rounds);
        let offsets = ragged::offsets(shapes.iter().map(|[rows, columns]| rows * columns * dimension));
        let mut left = values;
        let tasks: Vec<_> = tasks(&offsets)
            .into_iter()
            .map(|task| (task.clone(), take(&mut left, offsets[task.end] - offsets[task.start])))
            .collect();
        parallel::of(tasks, |(task, mut values)| {
            for i in task {
                let fine = take(&mut values, offsets[i + 1] - offsets[i]);
                match reports[i].status.is_usable() {
                    true => refiner.refine(dimension, grids.shape(i), grids.grid(i), fine),
                    false => fine.fill(f64::NAN),
                }
            }
        });
    }
}

impl Subdivided {
    /// The subdivided grids: (rows − 1) · 2^rounds + 1 rows, and columns likewise.
    pub fn grids(&self) -> &Grids {
        &self.grids
    }

    /// One report per grid.
    pub fn reports(&self) -> &[GridReport] {
        &self.reports
    }

    /// Which device did the work, and in which precision.
    pub fn device(&self) -> &DeviceReport {
        &self.device
    }

    /// Number of grids whose status is usable.
    pub fn usable(&self) -> usize {
        self.reports.iter().filter(|report| report.status.is_usable()).count()
    }

    /// Marks a grid as invalid if it has overflowed.
    fn check(&mut self, i: usize, given: &Grids) {
        let is_large = given.grid(i).iter().any(|x| x.abs() > SAFE);
        if self.reports[i].status.is_usable() && is_large && self.grids.grid(i).iter().any(|x| !x.is_finite()) {
            self.grids.grid_mut(i).fill(f64::NAN);
            let message = format!("{}: sums of its values overflow: give smaller numbers", given.place(i));
            self.reports[i] = GridReport { status: CurveStatus::Invalid, message: Some(message) };
        }
    }
}
