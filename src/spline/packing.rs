//! Splines on their way to the device and back: normalised in f64, laid out as the kernels take
//! them, mapped back.

use std::ops::Range;

use super::gpu::{Fitted, Job, Samples};
use super::knots::Knots;
use crate::bounds::Bounds;
use crate::error::Result;
use crate::gpu::{Downloaded, unwritten};
use crate::linalg::ring::{FLAG_CYCLIC, STATUS_SINGULAR, STATUS_SOLVED, System};

/// Flags of `natural.wgsl` beside [`FLAG_CYCLIC`].
const FLAG_CLAMPED_START: u32 = 2;
const FLAG_CLAMPED_END: u32 = 4;

/// How a curve is normalised: y = center + size · y′, and t by its mean span, so that all numbers
/// on the device are of order 1 and f32 loses nothing to an offset or a unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub center: [f64; 3],
    pub size: f64,
    pub mean_span: f64,
}

impl Frame {
    pub fn of(knots: &Knots, i: usize) -> Self {
        let t = knots.t(i);
        let mean_span = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        Frame { mean_span, ..Self::of_points(knots.values(i), knots.dimension) }
    }

    /// For points on the integers: every span has length 1. What is not finite spoils no more than
    /// on the CPU: it has no part in the frame.
    pub fn of_points(points: &[f64], d: usize) -> Self {
        let bounds = Bounds::of_flat(points, d);
        let size = bounds.half_size();
        Frame { center: bounds.middle(), size: if size > 0.0 { size } else { 1.0 }, mean_span: 1.0 }
    }

    /// What a normalised second derivative of 1 is in the units of the input.
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

impl Job<'_> {
    pub fn fitted_curves(&self, curves: &Range<usize>) -> impl Iterator<Item = usize> {
        curves.clone().filter(|&i| !self.knots.range(i).is_empty())
    }

    /// Spans and edges (a point's step to the next) of a chunk, normalised. Edges, not points,
    /// since a spline through two points close to each other hangs on their difference, and f32
    /// would lose it.
    pub fn pack(&self, curves: &Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let entries = knots.offsets[curves.end] - first;
        let mut spans = vec![0.0; entries];
        let mut edges = vec![0.0; entries * d];
        for i in self.fitted_curves(curves) {
            let frame = Frame::of(knots, i);
            let range = knots.offsets[i] - first..knots.offsets[i + 1] - first;
            for (span, pair) in spans[range.clone()].iter_mut().zip(knots.t(i).windows(2)) {
                *span = (pair[1] - pair[0]) / frame.mean_span;
            }
            let (here, next) = (knots.values(i), &knots.values(i)[d..]);
            for (edge, (from, to)) in edges[range.start * d..].iter_mut().zip(here.iter().zip(next)) {
                *edge = (to - from) / frame.size;
            }
        }
        (spans, edges)
    }

    /// The systems of a chunk, and the normalised derivatives at its clamped ends (empty where no
    /// end is clamped).
    pub fn systems(&self, curves: &Range<usize>) -> (Vec<System>, Vec<f64>) {
        let (knots, d) = (self.knots, self.knots.dimension);
        let mut end_derivatives = Vec::new();
        let mut systems = Vec::with_capacity(curves.len());
        for i in self.fitted_curves(curves) {
            let frame = Frame::of(knots, i);
            let mut flags = if knots.closed[i] { FLAG_CYCLIC } else { 0 };
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

    pub fn unpack(&self, curves: &Range<usize>, results: &[Downloaded], out: &mut Fitted) -> Result<()> {
        let (knots, d) = (self.knots, self.knots.dimension);
        let first = knots.offsets[curves.start];
        let (second, status) = (results[0].reals(), results[1].as_slice::<u32>());
        let samples = results.get(2).map(Downloaded::reals);
        for i in self.fitted_curves(curves) {
            let word = status[i - curves.start];
            if word != STATUS_SOLVED && word != STATUS_SINGULAR {
                return Err(unwritten("spline/natural", format_args!("curve {i}"), word));
            }
            let frame = Frame::of(knots, i);
            let scale = frame.second_derivative_unit();
            let range = knots.offsets[i] * d..knots.offsets[i + 1] * d;
            let part = &second[range.start - first * d..range.end - first * d];
            let mut finite = true;
            for (to, from) in out.second[range].iter_mut().zip(part) {
                *to = from * scale;
                finite &= to.is_finite();
            }
            if !finite {
                out.overflowed.push(i);
                out.samples[self.sample_offsets[i] * d..self.sample_offsets[i + 1] * d].fill(f64::NAN);
                continue;
            }
            self.unpack_samples(curves, i, samples.as_deref(), &mut out.samples);
        }
        Ok(())
    }

    /// The samples of one curve, from those of its chunk, in input units.
    pub fn unpack_samples(&self, curves: &Range<usize>, i: usize, results: Option<&[f64]>, out: &mut [f64]) {
        let Some(results) = results else { return };
        let (knots, d) = (self.knots, self.knots.dimension);
        let frame = Frame::of(knots, i);
        let to = &mut out[self.sample_offsets[i] * d..self.sample_offsets[i + 1] * d];
        // The device says how far each sample is from the point at the knot before it; the points
        // keep their bits.
        let place = |to: &mut [f64], point: &[f64], from: &[f64]| {
            for ((to, point), from) in to.iter_mut().zip(point).zip(from) {
                *to = point + frame.size * from;
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
