//! Packing and unpacking of splines: normalised in f64, in the kernels' layout, and mapped back.

use std::ops::Range;

use super::knots::Knots;
use super::sample::{EvenSites, Sites, Steps};
use crate::bounds::Bounds;
use crate::error::Result;
use crate::gpu::{Buffer, Downloaded, Lost, Recording, unwritten};
use crate::linalg::Real;
use crate::linalg::ring::{FLAG_CYCLIC, FLAG_REPEATED, STATUS_SINGULAR, STATUS_SOLVED, System};
use crate::numbers::Numbers;
use crate::parallel;

/// Frames that a thread makes together.
const FRAMES_TOGETHER: usize = 256;

/// Flags of `natural.wgsl`. All systems share the lower ones.
const FLAG_CLAMPED_START: u32 = 4;
const FLAG_CLAMPED_END: u32 = 8;

/// The normalisation of a curve: y = center + size · y′, and t divided by its mean span. So all numbers
/// on the device are of order 1, and f32 loses nothing to an offset or a unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: [f64; 3],
    pub size: f64,
    pub mean_span: f64,
}

/// The frame of every curve. The frame of a curve without knots is never used.
pub(super) fn frames_of(knots: &Knots) -> Vec<Frame> {
    let none = Frame { center: [0.0; 3], size: 1.0, mean_span: 1.0 };
    let of = |i: usize| if knots.range(i).is_empty() { none } else { Frame::of(knots, i) };
    parallel::map(knots.len(), FRAMES_TOGETHER, of)
}

impl Frame {
    fn of(knots: &Knots, i: usize) -> Self {
        let t = knots.t(i);
        let mean_span = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        Frame { mean_span, ..Self::of_points(knots.values(i), knots.dimension) }
    }

    /// For points on the integers: every span has length 1. Points that are not finite do not affect
    /// the frame.
    pub fn of_points(points: &[f64], d: usize) -> Self {
        let bounds = Bounds::of_flat(points, d);
        let size = bounds.half_size();
        Frame { center: bounds.middle(), size: if size > 0.0 { size } else { 1.0 }, mean_span: 1.0 }
    }

    /// A normalised second derivative of 1 in the units of the input.
    pub fn second_derivative_unit(&self) -> f64 {
        self.size / self.mean_span / self.mean_span
    }

    /// Normalised coordinates in the units of the input.
    pub fn map_back(&self, to: &mut [f64], from: &[f64], d: usize) {
        for (to, from) in to.chunks_exact_mut(d).zip(from.chunks_exact(d)) {
            for c in 0..d {
                to[c] = self.center[c] + self.size * from[c];
            }
        }
    }
}

/// Ends of curves by points, as those by coordinates.
pub(super) fn coordinates(ends: &[usize], d: usize) -> Vec<usize> {
    ends.iter().map(|end| end * d).collect()
}

/// Derivatives at the ends of clamped curves, in input units.
pub(crate) trait EndDerivatives: Sync {
    /// At the first (`end` 0) or last (1) knot of curve `i`. `None` if the end is natural.
    fn end_derivative(&self, i: usize, end: usize) -> Option<&[f64]>;
}

/// A run over chunks of curves, for recordings and for `packing`.
pub(super) struct SplineRun<'a> {
    pub knots: &'a Knots,
    pub frames: &'a [Frame],
    pub ends: &'a dyn EndDerivatives,
    pub samples: &'a Samples<'a>,
    pub sample_offsets: &'a [usize],
}

/// The results of the device.
pub(crate) struct Fitted {
    /// Second derivatives at all knots, in input units.
    pub second: Numbers,
    /// Samples of curve `i` from `offsets[i]` on, knot by knot: coordinates in input units.
    pub samples: Numbers,
    /// Curves whose numbers left the range of the device's floats. The CPU must fit them.
    pub overflowed: Vec<usize>,
    /// Set if the device was lost.
    pub lost: Option<Lost>,
}

/// Which samples to take on the device in the submission that fits.
pub(crate) enum Samples<'a> {
    /// None.
    None,
    /// As many per span, and a last one for open curves.
    PerSpan(usize),
    /// As many per curve, at equal steps of the parameter.
    Evenly(&'a EvenSites),
    /// At given sites.
    At(&'a Sites),
}

impl SplineRun<'_> {
    pub fn fitted_curves(&self, curves: &Range<usize>) -> impl Iterator<Item = usize> {
        curves.clone().filter(|&i| !self.knots.range(i).is_empty())
    }

    /// The number of knots of a chunk.
    pub fn entries(&self, curves: &Range<usize>) -> usize {
        self.knots.offsets[curves.end] - self.knots.offsets[curves.start]
    }

    /// Spans and edges (a point's step to the next) of a chunk, normalised. Edges, not points: a spline
    /// through two close points depends on their difference, which f32 would lose.
    pub fn pack(&self, recording: &mut Recording<'_>, curves: &Range<usize>) -> [Buffer; 2] {
        let (knots, d) = (self.knots, self.knots.dimension);
        let ends = &knots.offsets[curves.start..=curves.end];
        let spans = recording.upload_parts(ends, |k, spans| {
            let (i, frame) = (curves.start + k, self.frames[curves.start + k]);
            for (span, pair) in spans.iter_mut().zip(knots.t(i).windows(2)) {
                *span = (pair[1] - pair[0]) / frame.mean_span;
            }
        });
        let edges = recording.upload_parts(&coordinates(ends, d), |k, edges| {
            let (i, frame) = (curves.start + k, self.frames[curves.start + k]);
            let here = knots.values(i);
            for (edge, (from, to)) in edges.iter_mut().zip(here.iter().zip(here.iter().skip(d))) {
                *edge = (to - from) / frame.size;
            }
        });
        [spans, edges]
    }

    /// The systems of a chunk, and the normalised derivatives at its clamped ends (empty if no end is
    /// clamped).
    pub fn systems(&self, curves: &Range<usize>) -> (Vec<System>, Vec<f64>) {
        let (knots, d) = (self.knots, self.knots.dimension);
        let mut end_derivatives = Vec::new();
        let mut systems = Vec::with_capacity(curves.len());
        for i in self.fitted_curves(curves) {
            let frame = self.frames[i];
            let mut flags = if knots.closed[i] { FLAG_CYCLIC | FLAG_REPEATED } else { 0 };
            for (end, flag) in [FLAG_CLAMPED_START, FLAG_CLAMPED_END].into_iter().enumerate() {
                if let Some(derivative) = self.ends.end_derivative(i, end) {
                    flags |= flag;
                    end_derivatives.resize(2 * d * curves.len(), 0.0);
                    let to = &mut end_derivatives[(2 * (i - curves.start) + end) * d..][..d];
                    let scaled = derivative.iter().map(|v| v * (frame.mean_span / frame.size));
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

    /// Unpacks the results of a chunk's kernels, of number type T.
    ///
    /// # Errors
    /// [`Error::Kernel`](crate::Error::Kernel) if no kernel wrote a curve's status.
    pub fn unpack<T>(&self, curves: &Range<usize>, results: &[Downloaded], out: &mut Fitted) -> Result<()>
    where
        T: Real + bytemuck::Pod,
    {
        let (knots, d) = (self.knots, self.knots.dimension);
        let (second, status) = (results[0].as_slice::<T>(), results[1].as_slice::<u32>());
        for i in self.fitted_curves(curves) {
            let word = status[i - curves.start];
            if word != STATUS_SOLVED && word != STATUS_SINGULAR {
                return Err(unwritten("spline/natural", format_args!("curve {i}"), word));
            }
        }
        let ends = coordinates(&knots.offsets[curves.start..=curves.end], d);
        let own = &mut out.second[ends[0]..ends[curves.len()]];
        parallel::parts(own, &ends, |k, to| {
            let scale = self.frames[curves.start + k].second_derivative_unit();
            let from = &second[ends[k] - ends[0]..];
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from.to_f64() * scale);
        });
        if let Some(samples) = results.get(2) {
            self.unpack_samples::<T>(curves, samples.as_slice(), &mut out.samples);
        }
        let is_finite =
            |i: usize| out.second[knots.offsets[i] * d..knots.offsets[i + 1] * d].iter().all(|m| m.is_finite());
        let overflowed: Vec<usize> = self.fitted_curves(curves).filter(|&i| !is_finite(i)).collect();
        for &i in &overflowed {
            out.samples[self.sample_offsets[i] * d..self.sample_offsets[i + 1] * d].fill(f64::NAN);
        }
        out.overflowed.extend(overflowed);
        Ok(())
    }

    /// The samples of a chunk's curves in input units.
    pub fn unpack_samples<T: Real>(&self, curves: &Range<usize>, results: &[T], out: &mut [f64]) {
        let ends = coordinates(&self.sample_offsets[curves.start..=curves.end], self.knots.dimension);
        parallel::parts(&mut out[ends[0]..ends[curves.len()]], &ends, |k, to| {
            if !self.knots.range(curves.start + k).is_empty() {
                self.unpack_curve(curves, curves.start + k, results, to);
            }
        });
    }

    fn unpack_curve<T: Real>(&self, curves: &Range<usize>, i: usize, results: &[T], to: &mut [f64]) {
        let (knots, d, frame) = (self.knots, self.knots.dimension, self.frames[i]);
        // The device says how far each sample is from the point at the knot before it; the points
        // keep their bits.
        let place = |to: &mut [f64], point: &[f64], from: &[T]| {
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
            Samples::Evenly(sites) => {
                let own = &results[(self.sample_offsets[i] - self.sample_offsets[curves.start]) * d..];
                let (t, values, steps) = (knots.t(i), knots.values(i), Steps::of(knots, i, sites.n));
                let first = &sites.first[knots.range(i)];
                for (k, samples) in first.windows(2).enumerate() {
                    let samples = samples[0] as usize..samples[1] as usize;
                    let point = &values[k * d..(k + 1) * d];
                    let (to, from) = (&mut to[samples.start * d..samples.end * d], &own[samples.start * d..]);
                    to.chunks_exact_mut(d).zip(from.chunks_exact(d)).for_each(|(to, from)| place(to, point, from));
                    if !samples.is_empty() && steps.at(samples.start) <= t[k] {
                        to[..d].copy_from_slice(point);
                    }
                }
                if !knots.closed[i] && sites.n > 1 {
                    to[(sites.n - 1) * d..].copy_from_slice(&values[values.len() - d..]);
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
