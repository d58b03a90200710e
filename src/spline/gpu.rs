//! Splines on the GPU. A submission per chunk of curves fits and samples. `packing` packs and unpacks
//! the numbers.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::ROW_SOURCE;
use super::knots::{Coincident, Knots, Parametrisation};
pub(crate) use super::packing::{EndDerivatives, Fitted, Samples};
use super::packing::{Frame, SplineRun, coordinates, frames_of};
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, Gpu, KernelKey, Pending, Recording, kept, once, pipeline, plan};
use crate::linalg::ring::{RingKernel, RowSource, Solve};
use crate::numbers::Numbers;
use crate::precision::Precision;
use crate::ragged;

/// Threads of a workgroup of the sampling kernels.
pub(crate) const GROUP: usize = 64;

/// `SampleParams` of `sample.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SampleParams {
    pub count: u32,
    pub each: u32,
    pub dimension: u32,
}

/// Where samples of each curve start in [`Fitted::samples`], in points.
pub(crate) fn sample_offsets(knots: &Knots, samples: &Samples<'_>) -> Vec<usize> {
    match samples {
        Samples::None => offsets_of(knots, |_| 0),
        Samples::PerSpan(n) => offsets_of(knots, |i| n * (knots.range(i).len() - 1) + usize::from(!knots.closed[i])),
        Samples::Evenly(sites) => offsets_of(knots, |_| sites.n),
        Samples::At(sites) => sites.offsets.clone(),
    }
}

/// Offsets of arrays with `count(i)` entries for every curve that has knots.
pub(super) fn offsets_of(knots: &Knots, count: impl Fn(usize) -> usize) -> Vec<usize> {
    ragged::offsets((0..knots.len()).map(|i| if knots.range(i).is_empty() { 0 } else { count(i) }))
}

/// Fits (and samples) all curves.
///
/// # Errors
/// Errors of submissions. [`Error::Limit`] for a curve larger than the device's largest array.
pub(crate) fn fit(
    gpu: &Gpu,
    precision: Precision,
    knots: &Knots,
    ends: &dyn EndDerivatives,
    samples: &Samples<'_>,
) -> Result<Fitted> {
    let d = knots.dimension;
    let offsets = sample_offsets(knots, samples);
    let mut fitted = Fitted {
        second: Numbers::room(knots.t.len() * d),
        samples: Numbers::room(offsets[knots.len()] * d),
        overflowed: Vec::new(),
        lost: None,
    };
    let chunks = chunks(gpu, precision, knots, samples)?;
    let run = SplineRun { knots, frames: &frames_of(knots), ends, samples, sample_offsets: &offsets };
    let done = pipeline(
        chunks,
        |curves| run.record(gpu.record(precision), curves)?.submit(),
        once(Pending::wait),
        |curves, results| match precision {
            Precision::F64 => run.unpack::<f64>(curves, &results, &mut fitted),
            _ => run.unpack::<f32>(curves, &results, &mut fitted),
        },
    );
    fitted.lost = kept(done)?;
    if let Some(lost) = &fitted.lost {
        // Kept pages hold another fit's numbers where nothing was written.
        fitted.second[knots.offsets[lost.finished] * d..].fill(0.0);
    }
    Ok(fitted)
}

/// Samples fitted splines.
///
/// # Errors
/// As [`fit`].
pub(crate) fn sample(
    gpu: &Gpu,
    precision: Precision,
    knots: &Knots,
    second: &[f64],
    samples: &Samples<'_>,
) -> Result<Numbers> {
    let d = knots.dimension;
    let offsets = sample_offsets(knots, samples);
    let mut out = Numbers::room(offsets[knots.len()] * d);
    let chunks = chunks(gpu, precision, knots, samples)?;
    let run = SplineRun { knots, frames: &frames_of(knots), ends: &NaturalEnds, samples, sample_offsets: &offsets };
    pipeline(
        chunks,
        |curves| run.record_samples_of(gpu.record(precision), curves, second)?.submit(),
        once(Pending::wait),
        |curves, results| {
            if let Some(samples) = results.first() {
                match precision {
                    Precision::F64 => run.unpack_samples::<f64>(curves, samples.as_slice(), &mut out),
                    _ => run.unpack_samples::<f32>(curves, samples.as_slice(), &mut out),
                }
            }
            Ok(())
        },
    )?;
    Ok(out)
}

/// Natural and periodic splines over chord length that stay on the device.
pub(crate) struct ResidentSplines {
    pub knots: Knots,
    frames: Vec<Frame>,
}

impl ResidentSplines {
    /// The splines of a batch, where each curve is divided by its size.
    ///
    /// # Errors
    /// None: chord lengths need no parameters of the batch.
    pub fn of(batch: &CurveBatch, sizes: &[f64]) -> Result<Self> {
        let knots = Knots::new(batch, Parametrisation::ChordLength, Coincident::Refuse)?;
        let mut frames = frames_of(&knots);
        frames.iter_mut().zip(sizes).for_each(|(frame, &size)| frame.size = size);
        Ok(ResidentSplines { knots, frames })
    }

    /// Fits a chunk: the lengths of spans, the edges of the data polygon and the second derivatives
    /// at knots, as `sample.wgsl` has them.
    ///
    /// # Errors
    /// Errors of [`Recording::dispatch`].
    pub fn record(&self, recording: &mut Recording<'_>, curves: &Range<usize>) -> Result<[Buffer; 3]> {
        let (samples, ends) = (&Samples::None, &NaturalEnds);
        let run = SplineRun { knots: &self.knots, frames: &self.frames, ends, samples, sample_offsets: &[] };
        Ok(run.record_fit(recording, curves)?.0)
    }
}

/// No end is clamped.
pub(crate) struct NaturalEnds;

impl EndDerivatives for NaturalEnds {
    fn end_derivative(&self, _: usize, _: usize) -> Option<&[f64]> {
        None
    }
}

/// Chunks of curves whose arrays fit the device.
fn chunks(gpu: &Gpu, precision: Precision, knots: &Knots, samples: &Samples<'_>) -> Result<Vec<Range<usize>>> {
    let (d, real) = (knots.dimension, precision.bytes());
    // The largest array holds either the points or the samples; of both there is a copy to be read.
    let per_knot = match samples {
        Samples::PerSpan(n) => *n,
        _ => 1,
    };
    let points = (0..knots.len()).map(|i| match samples {
        Samples::At(sites) => knots.range(i).len().max(sites.offsets[i + 1] - sites.offsets[i]),
        Samples::Evenly(sites) if !knots.range(i).is_empty() => knots.range(i).len().max(sites.n),
        _ => knots.range(i).len(),
    });
    let largest = real * (d * per_knot) as u64;
    plan::chunks(points, largest, real * (2 + 3 * d) as u64 + 2 * largest, gpu.limits())
}

impl SplineRun<'_> {
    fn record<'g>(&self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<Recording<'g>> {
        let ([spans, edges, second], status) = self.record_fit(&mut recording, curves)?;
        recording.download(&second);
        recording.download(&status);
        self.record_samples(&mut recording, curves, [&spans, &edges, &second])?;
        Ok(recording)
    }

    /// Fits: the spans, the edges and the second derivatives of a chunk, and the statuses of its
    /// curves.
    fn record_fit(&self, recording: &mut Recording<'_>, curves: &Range<usize>) -> Result<([Buffer; 3], Buffer)> {
        let [spans, edges] = self.pack(recording, curves);
        let (systems, end_derivatives) = self.systems(curves);
        let second = recording.storage_reals(self.entries(curves) * self.knots.dimension);
        let end_derivatives = recording.upload_reals(&end_derivatives);
        let status = recording.storage(4 * curves.len() as u64);
        let buffers = vec![("spans", &spans), ("edges", &edges), ("end_derivatives", &end_derivatives)];
        let source = RowSource { path: ROW_SOURCE, kind: 0, buffers };
        let solve = Solve { systems: &systems, columns: self.knots.dimension as u32, kernel: RingKernel::Auto };
        solve.record(recording, &source, &second, &status)?;
        Ok(([spans, edges, second], status))
    }

    fn record_samples_of<'g>(
        &self,
        mut recording: Recording<'g>,
        curves: &Range<usize>,
        second: &[f64],
    ) -> Result<Recording<'g>> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let [spans, edges] = self.pack(&mut recording, curves);
        let ends = coordinates(&knots.offsets[curves.start..=curves.end], d);
        let second = recording.upload_parts(&ends, |k, to| {
            let scale = self.frames[curves.start + k].second_derivative_unit();
            to.iter_mut().zip(&second[ends[k]..]).for_each(|(to, m)| *to = m / scale);
        });
        self.record_samples(&mut recording, curves, [&spans, &edges, &second])?;
        Ok(recording)
    }

    fn record_samples(
        &self,
        recording: &mut Recording<'_>,
        curves: &Range<usize>,
        [spans, edges, second]: [&Buffer; 3],
    ) -> Result<()> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let (mut site_knots, mut starts) = (Vec::new(), Vec::new());
        let (entry, count, each, site_fractions) = match self.samples {
            Samples::None => return Ok(()),
            Samples::PerSpan(n) => ("per_span", n * self.entries(curves), *n, recording.upload_reals(&[])),
            Samples::Evenly(sites) => {
                site_knots.extend_from_slice(&sites.first[first..knots.offsets[curves.end]]);
                starts.extend(self.fitted_curves(curves).map(|i| (knots.offsets[i] - first) as u32));
                starts.push(self.entries(curves) as u32);
                let ends = coordinates(&knots.offsets[curves.start..=curves.end], 2);
                let fractions = recording.upload_parts(&ends, |k, to| sites.fractions(knots, curves.start + k, to));
                ("evenly", sites.n * (starts.len() - 1), sites.n, fractions)
            }
            Samples::At(sites) => {
                let range = sites.offsets[curves.start]..sites.offsets[curves.end];
                for i in curves.clone() {
                    let base = (knots.offsets[i] - first) as u32;
                    site_knots.extend(sites.knots[sites.offsets[i]..sites.offsets[i + 1]].iter().map(|k| base + k));
                }
                ("at_sites", range.len(), 1, recording.upload_reals(&sites.fractions[range]))
            }
        };
        let definitions = definitions([("GROUP", &GROUP)]);
        let key = KernelKey { path: "spline/sample.wgsl", entry, precision: recording.precision(), definitions };
        let params = SampleParams { count: count as u32, each: each as u32, dimension: d as u32 };
        let samples = recording.storage_reals(count * d);
        let buffers = [
            ("params", &recording.uniform(&params)),
            ("spans", spans),
            ("edges", edges),
            ("second", second),
            ("samples", &samples),
            ("site_knots", &recording.upload(&site_knots)),
            ("site_fractions", &site_fractions),
            ("curves", &recording.upload(&starts)),
        ];
        recording.dispatch(&key, count, GROUP, &buffers)?;
        recording.download(&samples);
        Ok(())
    }
}
