//! Splines on the GPU: every curve normalised in f64, one submission a chunk that fits and samples, results mapped back.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::knots::Knots;
use super::sample::Sites;
use crate::device::Precision;
use crate::error::{Error, Result};
use crate::gpu::source::{Definitions, definitions};
use crate::gpu::{Downloaded, Gpu, Interrupted, KernelKey, Pending, Recording, pipeline, plan};
use crate::linalg::Real;
use crate::linalg::ring::{
    FLAG_CYCLIC, RingKernel, RowSource, STATUS_SINGULAR, STATUS_SOLVED, Solve, System, real_bytes,
};

/// Threads a workgroup of the sampling kernels.
pub(crate) const GROUP: u32 = 64;

/// Flags of `natural.wgsl` beside [`FLAG_CYCLIC`].
const FLAG_CLAMPED_START: u32 = 2;
const FLAG_CLAMPED_END: u32 = 4;

/// `SampleParams` of `sample.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SampleParams {
    pub count: u32,
    pub per_span: u32,
    pub dimension: u32,
    pub padding: u32,
}

/// How a curve is normalised: y = center + size · y′, and t by its mean span, so that all numbers on the device are
/// of order 1 and f32 loses nothing to an offset or a unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: [f64; 3],
    pub size: f64,
    pub mean_span: f64,
}

impl Frame {
    fn of(knots: &Knots, i: usize) -> Self {
        let t = knots.t(i);
        let mean_span = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        Frame { mean_span, ..Self::of_points(knots.values(i), knots.dimension) }
    }

    /// For points on the integers: every span has length 1. What is not finite spoils no more than on the CPU: it has no
    /// part in the frame.
    pub fn of_points(points: &[f64], d: usize) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points.chunks_exact(d) {
            for c in 0..d {
                if point[c].is_finite() {
                    (low[c], high[c]) = (low[c].min(point[c]), high[c].max(point[c]));
                }
            }
        }
        let mut center = [0.0; 3];
        let mut size = 0.0_f64;
        for c in 0..d {
            if low[c] <= high[c] {
                // Halves, so that nothing overflows.
                center[c] = 0.5 * low[c] + 0.5 * high[c];
                size = size.max(0.5 * high[c] - 0.5 * low[c]);
            }
        }
        Frame { center, size: if size > 0.0 { size } else { 1.0 }, mean_span: 1.0 }
    }

    /// What a normalised second derivative of 1 is in the units of the input.
    fn second_derivative_unit(&self) -> f64 {
        self.size / self.mean_span / self.mean_span
    }

    /// Normalised coordinates in the units of the input.
    pub fn map_back<S: Real>(&self, to: &mut [f64], from: &[S], d: usize) {
        for (to, from) in to.chunks_exact_mut(d).zip(from.chunks_exact(d)) {
            for c in 0..d {
                to[c] = self.center[c] + self.size * from[c].to_f64();
            }
        }
    }
}

/// Derivatives at the ends of clamped curves, in input units.
pub(crate) trait EndDerivatives: Sync {
    /// At the first (`end` 0) or last (1) knot of curve `i`; `None` where the end is natural.
    fn end_derivative(&self, i: usize, end: usize) -> Option<&[f64]>;
}

/// Which samples to take on the device in the submission that fits.
pub(crate) enum Samples<'a> {
    /// None.
    None,
    /// So many a span, and a last one for open curves.
    PerSpan(usize),
    /// At sites of their own.
    At(&'a Sites),
}

/// What comes back from the device.
pub(crate) struct Fitted {
    /// Second derivatives at all knots, in input units.
    pub second: Vec<f64>,
    /// Samples of curve `i` from `offsets[i]` on, knot by knot: coordinates in input units.
    pub samples: Vec<f64>,
    /// Curves whose numbers left the range of the device's floats: the CPU must fit them.
    pub overflowed: Vec<usize>,
    /// Where the device was lost: the curves from this one on were not fitted, and why.
    pub lost: Option<(usize, String)>,
}

/// Where samples of each curve start in [`Fitted::samples`], in points.
pub(crate) fn sample_offsets(knots: &Knots, samples: &Samples<'_>) -> Vec<usize> {
    match samples {
        Samples::None => offsets_of(knots, |_| 0),
        Samples::PerSpan(n) => offsets_of(knots, |i| n * (knots.range(i).len() - 1) + usize::from(!knots.closed[i])),
        Samples::At(sites) => sites.offsets.clone(),
    }
}

/// Offsets of arrays with so many entries for every curve that has knots.
pub(super) fn offsets_of(knots: &Knots, count: impl Fn(usize) -> usize) -> Vec<usize> {
    let mut offsets = Vec::with_capacity(knots.len() + 1);
    offsets.push(0);
    for i in 0..knots.len() {
        let own = if knots.range(i).is_empty() { 0 } else { count(i) };
        offsets.push(offsets[i] + own);
    }
    offsets
}

/// Fits (and samples) all curves.
///
/// # Errors
/// Those of submissions; [`Error::Limit`] for a curve larger than the device's largest array.
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
        second: vec![0.0; knots.t.len() * d],
        samples: vec![0.0; offsets[knots.len()] * d],
        overflowed: Vec::new(),
        lost: None,
    };
    let chunks = chunks(gpu, precision, knots, samples)?;
    let job = Job { gpu, precision, knots, ends, samples, sample_offsets: &offsets };
    let done = pipeline(
        chunks,
        |curves| match precision {
            Precision::F64 => job.record::<f64>(curves)?.submit(),
            _ => job.record::<f32>(curves)?.submit(),
        },
        Pending::wait,
        |curves, results| match precision {
            Precision::F64 => job.unpack::<f64>(curves, &results, &mut fitted),
            _ => job.unpack::<f32>(curves, &results, &mut fitted),
        },
    );
    match done {
        Ok(()) => Ok(fitted),
        // What was finished is kept; what was not is said curve by curve.
        Err(Interrupted { error: error @ (Error::DeviceLost(_) | Error::Timeout { .. }), finished })
            if finished > 0 =>
        {
            fitted.lost = Some((finished, error.to_string()));
            Ok(fitted)
        }
        Err(interrupted) => Err(interrupted.error),
    }
}

/// Samples splines that are fitted already.
///
/// # Errors
/// As [`fit`].
pub(crate) fn sample(
    gpu: &Gpu,
    precision: Precision,
    knots: &Knots,
    second: &[f64],
    samples: &Samples<'_>,
) -> Result<Vec<f64>> {
    let d = knots.dimension;
    let offsets = sample_offsets(knots, samples);
    let mut out = vec![0.0; offsets[knots.len()] * d];
    let chunks = chunks(gpu, precision, knots, samples)?;
    let job = Job { gpu, precision, knots, ends: &NaturalEnds, samples, sample_offsets: &offsets };
    pipeline(
        chunks,
        |curves| match precision {
            Precision::F64 => job.record_samples_of::<f64>(curves, second)?.submit(),
            _ => job.record_samples_of::<f32>(curves, second)?.submit(),
        },
        Pending::wait,
        |curves, results| {
            for i in job.fitted_curves(curves) {
                match precision {
                    Precision::F64 => job.unpack_samples::<f64>(curves, i, results.first(), &mut out),
                    _ => job.unpack_samples::<f32>(curves, i, results.first(), &mut out),
                }
            }
            Ok(())
        },
    )?;
    Ok(out)
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
    let (d, real) = (knots.dimension, real_bytes(precision));
    // The largest array holds either the points or the samples; of both there is a copy to be read.
    let per_knot = match samples {
        Samples::PerSpan(n) => *n,
        _ => 1,
    };
    let points = (0..knots.len()).map(|i| match samples {
        Samples::At(sites) => knots.range(i).len().max(sites.offsets[i + 1] - sites.offsets[i]),
        _ => knots.range(i).len(),
    });
    let largest = real * (d * per_knot) as u64;
    plan::chunks(points, largest, real * (2 + 3 * d) as u64 + 2 * largest, gpu.limits())
}

struct Job<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    knots: &'a Knots,
    ends: &'a dyn EndDerivatives,
    samples: &'a Samples<'a>,
    sample_offsets: &'a [usize],
}

impl<'a> Job<'a> {
    fn fitted_curves(&self, curves: &Range<usize>) -> impl Iterator<Item = usize> {
        curves.clone().filter(|&i| !self.knots.range(i).is_empty())
    }

    /// Spans and edges (a point's step to the next) of a chunk, normalised. Edges, not points, since a spline through
    /// two points close to each other hangs on their difference, and f32 would lose it.
    fn pack<S: Real>(&self, curves: &Range<usize>) -> (Vec<S>, Vec<S>) {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let entries = knots.offsets[curves.end] - first;
        let mut spans = vec![S::ZERO; entries];
        let mut edges = vec![S::ZERO; entries * d];
        for i in self.fitted_curves(curves) {
            let frame = Frame::of(knots, i);
            let range = knots.offsets[i] - first..knots.offsets[i + 1] - first;
            for (span, pair) in spans[range.clone()].iter_mut().zip(knots.t(i).windows(2)) {
                *span = S::from_f64((pair[1] - pair[0]) / frame.mean_span);
            }
            let (here, next) = (knots.values(i), &knots.values(i)[d..]);
            for (edge, (from, to)) in edges[range.start * d..].iter_mut().zip(here.iter().zip(next)) {
                *edge = S::from_f64((to - from) / frame.size);
            }
        }
        (spans, edges)
    }

    /// The systems of a chunk, and the normalised derivatives at its clamped ends (empty where no end is clamped).
    fn systems<S: Real>(&self, curves: &Range<usize>) -> (Vec<System>, Vec<S>) {
        let (knots, d) = (self.knots, self.knots.dimension);
        let mut end_derivatives = Vec::new();
        let mut systems = Vec::with_capacity(curves.len());
        for i in self.fitted_curves(curves) {
            let frame = Frame::of(knots, i);
            let mut flags = if knots.closed[i] { FLAG_CYCLIC } else { 0 };
            for (end, flag) in [FLAG_CLAMPED_START, FLAG_CLAMPED_END].into_iter().enumerate() {
                if let Some(derivative) = self.ends.end_derivative(i, end) {
                    flags |= flag;
                    end_derivatives.resize(2 * d * curves.len(), S::ZERO);
                    let to = &mut end_derivatives[(2 * (i - curves.start) + end) * d..][..d];
                    let scaled = derivative.iter().map(|v| S::from_f64(v * (frame.mean_span / frame.size)));
                    to.iter_mut().zip(scaled).for_each(|(to, v)| *to = v);
                }
            }
            systems.push(System {
                start: (knots.offsets[i] - knots.offsets[curves.start]) as u32,
                rows: (knots.range(i).len() - usize::from(knots.closed[i])) as u32,
                flags,
                index: (i - curves.start) as u32,
            });
        }
        (systems, end_derivatives)
    }

    fn record<S: Real + Pod>(&self, curves: &Range<usize>) -> Result<Recording<'a>> {
        let (spans, edges) = self.pack::<S>(curves);
        let (systems, end_derivatives) = self.systems::<S>(curves);
        let mut recording = self.gpu.record();
        let second = recording.storage(edges.len() as u64 * real_bytes(self.precision));
        let spans = recording.upload(&spans);
        let edges = recording.upload(&edges);
        let end_derivatives = recording.upload(&end_derivatives);
        let status = recording.storage(4 * curves.len() as u64);
        let buffers = vec![("spans", &spans), ("edges", &edges), ("end_derivatives", &end_derivatives)];
        let source = RowSource { path: "spline/natural.wgsl", definitions: Definitions::new(), buffers };
        let columns = self.knots.dimension as u32;
        let solve = Solve { systems: &systems, columns, precision: self.precision, kernel: RingKernel::Auto };
        solve.record(&mut recording, &source, &second, &status)?;
        recording.download(&second);
        recording.download(&status);
        self.record_samples::<S>(&mut recording, curves, [&spans, &edges, &second])?;
        Ok(recording)
    }

    fn record_samples_of<S: Real + Pod>(&self, curves: &Range<usize>, second: &[f64]) -> Result<Recording<'a>> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let (spans, edges) = self.pack::<S>(curves);
        let mut normalised = Vec::with_capacity(edges.len());
        for i in self.fitted_curves(curves) {
            let scale = Frame::of(knots, i).second_derivative_unit();
            let of_curve = &second[knots.offsets[i] * d..knots.offsets[i + 1] * d];
            normalised.extend(of_curve.iter().map(|m| S::from_f64(m / scale)));
        }
        let mut recording = self.gpu.record();
        let buffers = [&spans, &edges, &normalised].map(|array| recording.upload(array));
        self.record_samples::<S>(&mut recording, curves, [&buffers[0], &buffers[1], &buffers[2]])?;
        Ok(recording)
    }

    fn record_samples<S: Real + Pod>(
        &self,
        recording: &mut Recording<'_>,
        curves: &Range<usize>,
        [spans, edges, second]: [&wgpu::Buffer; 3],
    ) -> Result<()> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let (entry, count, per_span, site_knots, site_fractions) = match self.samples {
            Samples::None => return Ok(()),
            Samples::PerSpan(n) => ("per_span", n * (knots.offsets[curves.end] - first), *n, vec![], vec![]),
            Samples::At(sites) => {
                let range = sites.offsets[curves.start]..sites.offsets[curves.end];
                let mut site_knots = Vec::with_capacity(range.len());
                for i in curves.clone() {
                    let base = (knots.offsets[i] - first) as u32;
                    site_knots.extend(sites.knots[sites.offsets[i]..sites.offsets[i + 1]].iter().map(|k| base + k));
                }
                let fractions: Vec<S> = sites.fractions[range.clone()].iter().map(|&u| S::from_f64(u)).collect();
                ("at_sites", range.len(), 1, site_knots, fractions)
            }
        };
        let definitions = definitions([("GROUP", &GROUP)]);
        let key = KernelKey { path: "spline/sample.wgsl", entry, precision: self.precision, definitions };
        let kernel = self.gpu.kernel(&key)?;
        let (count32, per_span) = (count as u32, per_span as u32);
        let params = recording.uniform(&SampleParams { count: count32, per_span, dimension: d as u32, padding: 0 });
        let samples = recording.storage((count * d) as u64 * real_bytes(self.precision));
        let (site_knots, site_fractions) = (recording.upload(&site_knots), recording.upload(&site_fractions));
        let groups = plan::workgroups(count, GROUP as usize, self.gpu.limits())?;
        recording.dispatch(
            &kernel,
            groups,
            &[
                ("params", &params),
                ("spans", spans),
                ("edges", edges),
                ("second", second),
                ("samples", &samples),
                ("site_knots", &site_knots),
                ("site_fractions", &site_fractions),
            ],
        )?;
        recording.download(&samples);
        Ok(())
    }

    fn unpack<S: Real + Pod>(&self, curves: &Range<usize>, results: &[Downloaded], out: &mut Fitted) -> Result<()> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let (second, status) = (results[0].as_slice::<S>(), results[1].as_slice::<u32>());
        for i in self.fitted_curves(curves) {
            let word = status[i - curves.start];
            if word != STATUS_SOLVED && word != STATUS_SINGULAR {
                let message = format!("curve {i} has the status word {word}: no kernel wrote it");
                return Err(Error::Kernel { kernel: "spline/natural".into(), message });
            }
            let frame = Frame::of(knots, i);
            let scale = frame.second_derivative_unit();
            let range = knots.offsets[i] * d..knots.offsets[i + 1] * d;
            let part = &second[range.start - first * d..range.end - first * d];
            let mut finite = true;
            for (to, from) in out.second[range].iter_mut().zip(part) {
                *to = from.to_f64() * scale;
                finite &= to.is_finite();
            }
            if !finite {
                out.overflowed.push(i);
                out.samples[self.sample_offsets[i] * d..self.sample_offsets[i + 1] * d].fill(f64::NAN);
                continue;
            }
            self.unpack_samples::<S>(curves, i, results.get(2), &mut out.samples);
        }
        Ok(())
    }

    /// The samples of one curve, from those of its chunk, in input units.
    fn unpack_samples<S: Real + Pod>(
        &self,
        curves: &Range<usize>,
        i: usize,
        results: Option<&Downloaded>,
        out: &mut [f64],
    ) {
        let Some(results) = results else { return };
        let (knots, d) = (self.knots, self.knots.dimension);
        let results = results.as_slice::<S>();
        let frame = Frame::of(knots, i);
        let to = &mut out[self.sample_offsets[i] * d..self.sample_offsets[i + 1] * d];
        // The device says how far each sample is from the point at the knot before it; the points keep their bits.
        let place = |to: &mut [f64], point: &[f64], from: &[S]| {
            for ((to, point), from) in to.iter_mut().zip(point).zip(from) {
                *to = point + frame.size * from.to_f64();
            }
        };
        match self.samples {
            Samples::None => {}
            Samples::PerSpan(n) => {
                let own = &results[(knots.offsets[i] - knots.offsets[curves.start]) * n * d..];
                let spans = to.chunks_mut(n * d).zip(own.chunks(n * d)).zip(knots.values(i).chunks_exact(d));
                for ((to, from), point) in spans {
                    let (at_knot, after) = to.split_at_mut(d);
                    at_knot.copy_from_slice(point);
                    after
                        .chunks_exact_mut(d)
                        .zip(from[d..].chunks_exact(d))
                        .for_each(|(to, from)| place(to, point, from));
                }
            }
            Samples::At(sites) => {
                let range = sites.offsets[i]..sites.offsets[i + 1];
                let own = &results[(range.start - sites.offsets[curves.start]) * d..];
                let at = sites.knots[range.clone()].iter().zip(&sites.fractions[range]);
                for ((to, from), (&knot, &u)) in to.chunks_exact_mut(d).zip(own.chunks_exact(d)).zip(at) {
                    let point = |knot: usize| &knots.values(i)[knot * d..(knot + 1) * d];
                    match u {
                        0.0 => to.copy_from_slice(point(knot as usize)),
                        1.0 => to.copy_from_slice(point(knot as usize + 1)),
                        _ => place(to, point(knot as usize), from),
                    }
                }
            }
        }
    }
}
