//! Completion of many control polygons at once.

use super::energy::Energy;
use super::gpu::complete_on_gpu;
use super::polygons::{Given, Polygons, Solved, in_dimension};
use super::prepared::PreparedBatch;
use super::ready::{MOST_DATA, Outcome};
use crate::device::Device;
use crate::error::Result;
use crate::linalg::{Operation, run, take, tasks};
use crate::parallel;
use crate::status::CurveStatus;

/// Completes control polygons of any degrees and patterns in one call, in 1 to 4 dimensions.
///
/// The unknown points of a curve are U = W G, where G is what is given. W is computed once per
/// degree and pattern, in exact rationals.
///
/// **Accuracy.** On the CPU control points are good to about 1e-15 of the largest Σ|W||G|, whatever
/// the degree. On a GPU in f32, points are good to 2e-6 of half the curve's largest extent, and
/// energies to a relative error of 8e-6. The CPU recomputes in f64 the curves that f32 cannot hold
/// to that.
///
/// ```
/// use faircurve::{Device, bezier::{Energy, Given, Polygons, complete}};
///
/// // A cubic without its third control point.
/// let polygons = Polygons { dimension: 2, coords: &[0.0, 0.0, 1.0, 2.0, f64::NAN, f64::NAN, 3.0, 0.0], offsets: &[0, 4] };
/// let given = Given { known: Some(&[true, true, false, true]), ..Given::default() };
/// let solved = complete(&polygons, &given, &Energy::bending(), &Device::cpu())?;
/// assert_eq!(solved.coords[4..6], [2.0, 1.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - Arrays that do not fit together.
/// - An energy without a positive weight.
/// - On a GPU, errors of submissions.
///
/// A curve that cannot be completed is [refused](Solved::refusals) and affects no other.
pub fn complete(polygons: &Polygons, given: &Given, energy: &Energy, device: &Device) -> Result<Solved> {
    polygons.check()?;
    given.check(polygons)?;
    energy.check()?;
    let batch = PreparedBatch::new(polygons, given, energy);
    let mut solved = Solved {
        coords: polygons.coords.to_vec(),
        energies: vec![f64::NAN; polygons.len()],
        statuses: vec![CurveStatus::Invalid; polygons.len()],
        refusals: Vec::new(),
    };
    let outcomes = match device.as_gpu() {
        Some(gpu) => {
            let precision = device.kernel_precision(gpu, true)?;
            in_dimension!(polygons.dimension, D => complete_on_gpu::<D>(gpu, precision, &batch, &mut solved)?)
        }
        None => in_dimension!(polygons.dimension, D => run_on_cpu::<D>(&batch, &mut solved)),
    };
    for (i, outcome) in outcomes.into_iter().enumerate() {
        match outcome {
            Ok(status) => solved.statuses[i] = status,
            Err(refusal) => {
                solved.statuses[i] = refusal.status();
                solved.energies[i] = f64::NAN;
                let own = polygons.offsets[i] * polygons.dimension..polygons.offsets[i + 1] * polygons.dimension;
                solved.coords[own.clone()].copy_from_slice(&polygons.coords[own]);
                solved.refusals.push((i, refusal));
            }
        }
    }
    Ok(solved)
}

/// Completes all curves on all threads.
fn run_on_cpu<const D: usize>(batch: &PreparedBatch, solved: &mut Solved) -> Vec<Outcome> {
    let offsets = batch.polygons.offsets;
    let (mut coords, mut energies) = (&mut solved.coords[..], &mut solved.energies[..]);
    let mut parts: Vec<Part<D>> = Vec::new();
    for curves in tasks(offsets) {
        parts.push(Part {
            batch,
            coords: take(&mut coords, (offsets[curves.end] - offsets[curves.start]) * D),
            energies: take(&mut energies, curves.len()),
            curves,
        });
    }
    parallel::of(parts, run).concat()
}

/// Consecutive curves.
struct Part<'a, const D: usize> {
    batch: &'a PreparedBatch<'a>,
    curves: std::ops::Range<usize>,
    coords: &'a mut [f64],
    energies: &'a mut [f64],
}

impl<const D: usize> Operation for Part<'_, D> {
    type Output = Vec<Outcome>;

    #[inline(always)]
    fn run(self) -> Vec<Outcome> {
        let Part { batch, curves, coords, energies } = self;
        let (mut points, _) = coords.as_chunks_mut::<D>();
        let mut data = Vec::with_capacity(MOST_DATA * D);
        let mut outcomes = Vec::with_capacity(curves.len());
        for (i, energy) in curves.zip(energies) {
            let own = take(&mut points, batch.polygons.count(i));
            outcomes.push(batch.ready(i).and_then(|ready| {
                let origin = batch.gather(i, ready, &mut data)?;
                *energy = ready.complete(data.as_chunks().0, &origin, |place, point| own[place] = point);
                ready.status(own.as_flattened(), *energy)
            }));
        }
        outcomes
    }
}
