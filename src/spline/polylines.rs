//! Splines as polylines: sampled on the CPU in lanes, or from samples that a GPU took.

use std::ops::Range;

use super::cubic::{CubicSplines, Spline};
use super::gpu::{self, Samples};
use super::sample::{Cubic, Sites};
use crate::batch::{CurveBatch, are_finite};
use crate::curve::{Curve, Sampling};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::{operation, run, take, tasks};
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;
use crate::report::CurveSet;

impl CubicSplines {
    /// Number of samples of curve `i`; not for equal arc lengths, which only the fit
    /// tells.
    fn count(&self, i: usize, sampling: Sampling) -> usize {
        if let Some(input) = self.unfitted.get(&i) {
            return input.t.len();
        }
        let ends = self.knots.repeats.get(&i).map_or(self.knots.range(i).len(), Vec::len);
        match sampling {
            Sampling::PerSpan(n) => self.steps(i, sampling, n) * (ends - 1) + usize::from(!self.knots.closed[i]),
            Sampling::Count(n) => self.steps(i, sampling, n),
            Sampling::Points(_) | Sampling::Spacing(_) => 0,
        }
    }

    /// Samples a span or of the whole curve `i`, where `n` are asked for: more where it is closed
    /// and has few spans.
    #[inline]
    fn steps(&self, i: usize, sampling: Sampling, n: usize) -> usize {
        if self.knots.closed[i] { n.max(self.spline(i).least(sampling)) } else { n }
    }

    /// Samples of all curves by all threads of the CPU.
    pub(super) fn polylines_on_cpu(&self, sampling: Sampling) -> CurveBatch {
        self.polylines_with(sampling, None)
    }

    /// Polylines of samples that a GPU took: so many a span between knots, or so many a curve.
    pub(crate) fn polylines_of(&self, sampling: Sampling, samples: &[f64]) -> CurveBatch {
        self.polylines_with(sampling, Some(samples))
    }

    /// Polylines of samples that a GPU took, where there are any; the CPU takes the rest.
    fn polylines_with(&self, sampling: Sampling, taken: Option<&[f64]>) -> CurveBatch {
        let Some(offsets) = self.offsets(sampling) else { return self.by_length(sampling) };
        let total = offsets[self.len()];
        let (mut coords, mut t) = (vec![0.0; total * self.knots.dimension], vec![0.0; total]);
        self.write(sampling, &offsets, taken, &mut coords, Some(&mut t));
        self.assemble(coords, t, offsets)
    }

    /// Where the samples of each curve start; not for equal arc lengths, which only sampling tells.
    pub(super) fn offsets(&self, sampling: Sampling) -> Option<Vec<usize>> {
        match sampling {
            Sampling::PerSpan(_) | Sampling::Count(_) => {
                Some(ragged::offsets((0..self.len()).map(|i| self.count(i, sampling))))
            }
            Sampling::Points(_) | Sampling::Spacing(_) => None,
        }
    }

    /// Writes samples between these offsets, and their parameters where these are asked for.
    pub(super) fn write(
        &self,
        sampling: Sampling,
        offsets: &[usize],
        taken: Option<&[f64]>,
        mut coords: &mut [f64],
        mut t: Option<&mut [f64]>,
    ) {
        let (Sampling::PerSpan(steps) | Sampling::Count(steps)) = sampling else {
            unreachable!("samples at equal arc lengths have no offsets before they are taken")
        };
        let (room, needed) = (coords.len(), offsets[self.len()] * self.knots.dimension);
        assert!(room == needed, "samples of {needed} numbers, and room for {room}");
        let work: Vec<_> = tasks(offsets)
            .into_iter()
            .map(|curves| {
                let count = offsets[curves.end] - offsets[curves.start];
                let t = t.as_mut().map(|t| take(t, count));
                (curves, take(&mut coords, count * self.knots.dimension), t)
            })
            .collect();
        // For a number of samples with both ends the last is at 1.
        let (fractions, open) = (fractions(steps, steps), fractions(steps, steps.saturating_sub(1)));
        let taken_offsets = taken.map(|_| self.taken_offsets(sampling)).unwrap_or_default();
        parallel::of(work, |(curves, coords, t)| {
            let (fractions, open) = (&fractions[..], &open[..]);
            let taken = taken.map(|samples| (samples, &taken_offsets[..]));
            SampledRun { splines: self, sampling, offsets, fractions, open, taken, curves, coords, t }.write();
        });
    }

    /// Samples of one curve at any sites, one jet after the other.
    fn walk<C: Curve>(curve: &C, sites: &[(usize, f64)], coords: &mut [f64], t: &mut [f64]) {
        let (d, knots) = (curve.dimension(), curve.knots());
        for ((&(span, u), point), t) in sites.iter().zip(coords.chunks_exact_mut(d)).zip(t) {
            point.copy_from_slice(&curve.jet(span, u).point.to_array()[..d]);
            let start = knots.get(span).copied().unwrap_or(0.0);
            *t = knots.get(span + 1).map_or(start, |end| (start + u * (end - start)).min(*end));
        }
    }

    fn assemble(&self, coords: Vec<f64>, t: Vec<f64>, offsets: Vec<usize>) -> CurveBatch {
        let closed = self.knots.closed.clone();
        let spans = closed.contains(&true).then(|| {
            let span = |i: usize| match t[offsets[i]..offsets[i + 1]].last() {
                Some(last) if self.unfitted.contains_key(&i) => self.unfitted[&i].closing_after(*last),
                Some(last) if closed[i] => self.knots.t(i)[self.knots.range(i).len() - 1] - last,
                _ => f64::NAN,
            };
            (0..self.len()).map(span).collect()
        });
        let problems = self.knots.unfitted.clone();
        CurveBatch::sampled(self.knots.dimension, coords, offsets, closed, t, spans, problems, self.origin.clone())
    }

    /// Samples of all curves by a GPU.
    ///
    /// # Errors
    /// Those of submissions.
    pub(crate) fn sample_on_gpu(&self, gpu: &Gpu, precision: Precision, sampling: Sampling) -> Result<CurveBatch> {
        let sites = match sampling {
            Sampling::PerSpan(_) => None,
            Sampling::Count(n) => Some(Sites::evenly(&self.knots, n)),
            Sampling::Points(_) | Sampling::Spacing(_) => Some(self.sites_by_length(sampling)),
        };
        let wanted = match (sampling, &sites) {
            (Sampling::PerSpan(n), _) => Samples::PerSpan(n),
            (_, Some(sites)) => Samples::At(sites),
            _ => Samples::None,
        };
        let samples = gpu::sample(gpu, precision, &self.knots, &self.second, &wanted)?;
        Ok(match &sites {
            Some(sites) if matches!(sampling, Sampling::Points(_) | Sampling::Spacing(_)) => {
                self.polylines_at(sampling, sites, samples)
            }
            _ => self.polylines_of(sampling, &samples),
        })
    }

    /// Sites at equal arc length along every curve, as knots and fractions.
    fn sites_by_length(&self, sampling: Sampling) -> Sites {
        let of_curves: Vec<Vec<(usize, f64)>> = parallel::map(self.len(), 1, |i| {
            if self.unfitted.contains_key(&i) { Vec::new() } else { self.curve(i).sites(sampling) }
        });
        let mut sites = Sites { offsets: vec![0], knots: Vec::new(), fractions: Vec::new() };
        for (i, of_curve) in of_curves.into_iter().enumerate() {
            for (span, u) in of_curve {
                // No sample falls into a span without length, but at the very end.
                let (k, u) = match self.spline(i).span(span) {
                    (k, true) => (k, u),
                    (k, false) if k + 1 < self.knots.range(i).len() => (k, 0.0),
                    (k, false) => (k - 1, 1.0),
                };
                sites.knots.push(k as u32);
                sites.fractions.push(u);
            }
            sites.offsets.push(sites.knots.len());
        }
        sites
    }

    /// Polylines of samples taken elsewhere at sites. Those of unfitted curves are their own.
    fn polylines_at(&self, sampling: Sampling, sites: &Sites, samples: Vec<f64>) -> CurveBatch {
        let d = self.knots.dimension;
        let (mut coords, mut t, mut offsets) = (Vec::with_capacity(samples.len()), Vec::new(), vec![0]);
        for i in 0..self.len() {
            let own = sites.offsets[i]..sites.offsets[i + 1];
            match self.unfitted.get(&i) {
                Some(input) => {
                    let (own_coords, own_t) = input.sample(d, self.knots.closed[i], sampling);
                    coords.extend(own_coords);
                    t.extend(own_t);
                }
                None => {
                    let taken = &samples[own.start * d..own.end * d];
                    if are_finite(taken) && !self.sided.contains_key(&i) {
                        coords.extend_from_slice(taken);
                    } else {
                        let spline = self.spline(i);
                        let at = sites.knots[own.clone()].iter().zip(&sites.fractions[own.clone()]);
                        coords.extend(
                            at.flat_map(|(&k, &u)| spline.jet_at(k as usize, u).point.to_array().into_iter().take(d)),
                        );
                    }
                    let knots = self.knots.t(i);
                    let at = |(&k, &u): (&u32, &f64)| {
                        let (from, to) = (knots[k as usize], knots[k as usize + 1]);
                        (from + u * (to - from)).min(to)
                    };
                    t.extend(sites.knots[own.clone()].iter().zip(&sites.fractions[own]).map(at));
                }
            }
            offsets.push(t.len());
        }
        self.assemble(coords, t, offsets)
    }

    /// Where the samples of each curve that a GPU took start.
    fn taken_offsets(&self, sampling: Sampling) -> Vec<usize> {
        match sampling {
            Sampling::Count(n) => gpu::offsets_of(&self.knots, |_| n),
            Sampling::PerSpan(n) => gpu::sample_offsets(&self.knots, &Samples::PerSpan(n)),
            Sampling::Points(_) | Sampling::Spacing(_) => {
                unreachable!("samples at equal arc lengths come with their sites")
            }
        }
    }

    /// Samples by equal arc length.
    fn by_length(&self, sampling: Sampling) -> CurveBatch {
        let d = self.knots.dimension;
        let pieces: Vec<(Vec<f64>, Vec<f64>)> = parallel::map(self.len(), 1, |i| {
            if let Some(input) = self.unfitted.get(&i) {
                return input.sample(d, self.knots.closed[i], sampling);
            }
            let sites = self.spline(i).sites(sampling);
            let (mut coords, mut t) = (vec![0.0; sites.len() * d], vec![0.0; sites.len()]);
            Self::walk(&self.spline(i), &sites, &mut coords, &mut t);
            (coords, t)
        });
        let offsets = ragged::offsets(pieces.iter().map(|(_, t)| t.len()));
        let (mut coords, mut t) =
            (Vec::with_capacity(offsets[self.len()] * d), Vec::with_capacity(offsets[self.len()]));
        for (of_curve, t_of_curve) in pieces {
            coords.extend(of_curve);
            t.extend(t_of_curve);
        }
        self.assemble(coords, t, offsets)
    }
}

/// k/n for so many k; n counts as 1 at least.
fn fractions(count: usize, n: usize) -> Vec<f64> {
    (0..count).map(|k| k as f64 / n.max(1) as f64).collect()
}

/// The samples of a run of curves.
struct SampledRun<'a> {
    splines: &'a CubicSplines,
    sampling: Sampling,
    offsets: &'a [usize],
    fractions: &'a [f64],
    open: &'a [f64],
    /// Samples that a GPU took, and where those of each curve start.
    taken: Option<(&'a [f64], &'a [usize])>,
    curves: Range<usize>,
    coords: &'a mut [f64],
    /// Parameters, where these are asked for.
    t: Option<&'a mut [f64]>,
}

impl SampledRun<'_> {
    fn write(self) {
        let (d, mut coords, mut all_t) = (self.splines.knots.dimension, self.coords, self.t);
        let mut own_t = Vec::new();
        for i in self.curves {
            let count = self.offsets[i + 1] - self.offsets[i];
            let (coords, t) = (take(&mut coords, count * d), all_t.as_mut().map(|t| take(t, count)));
            if let Some(input) = self.splines.unfitted.get(&i) {
                coords.copy_from_slice(&input.coords);
                if let Some(t) = t {
                    t.copy_from_slice(&input.t);
                }
                continue;
            }
            let spline = self.splines.spline(i);
            let steps = self.splines.steps(i, self.sampling, self.fractions.len());
            let more = if steps > self.fractions.len() { fractions(steps, steps) } else { Vec::new() };
            let own = if more.is_empty() { self.fractions } else { &more };
            let even = if spline.closed { own } else { self.open };
            // Samples beyond the range of the GPU's floats, and of curves that the CPU has mended, are taken by the CPU.
            let taken = self.taken.map(|(samples, offsets)| &samples[offsets[i] * d..offsets[i + 1] * d]);
            let taken = taken.filter(|samples| more.is_empty() && are_finite(samples) && spline.stride == 1);
            if let Sampling::PerSpan(_) = self.sampling {
                match taken {
                    Some(samples) => {
                        if let Some(t) = t {
                            spline.per_span_parameters(own, t);
                        }
                        spline.per_span_taken(own.len() * d, samples, coords);
                    }
                    None if d == 2 => run(PerSpan::<2> { spline: &spline, fractions: own, t, coords }),
                    None => run(PerSpan::<3> { spline: &spline, fractions: own, t, coords }),
                }
            } else {
                let t = t.unwrap_or_else(|| {
                    own_t.resize(count, 0.0);
                    &mut own_t
                });
                match taken {
                    Some(samples) => {
                        spline.even_parameters(even, t);
                        coords.copy_from_slice(samples);
                    }
                    None if d == 2 => run(Evenly::<2> { spline: &spline, fractions: even, t, coords }),
                    None => run(Evenly::<3> { spline: &spline, fractions: even, t, coords }),
                }
            }
        }
    }
}

operation! {
    /// Samples of the spans of one curve, and their parameters where these are asked for.
    PerSpan<'a; D> { spline: &'a Spline<'a>, fractions: &'a [f64], t: Option<&'a mut [f64]>, coords: &'a mut [f64] } -> () {{
        if let Some(t) = t {
            spline.per_span_parameters(fractions, t);
        }
        spline.per_span::<D>(fractions, coords);
    }}
}

operation! {
    /// Samples of one curve at fractions of the whole, and their parameters.
    Evenly<'a; D> { spline: &'a Spline<'a>, fractions: &'a [f64], t: &'a mut [f64], coords: &'a mut [f64] } -> () {{
        spline.even_parameters(fractions, t);
        spline.evenly::<D>(t, coords);
    }}
}

impl Spline<'_> {
    #[inline(always)]
    fn cubic<const D: usize>(&self, k: usize) -> Cubic<D> {
        let h = self.t[k + 1] - self.t[k];
        let start = self.stride * k;
        let (p, m) = (&self.values[k * D..(k + 2) * D], &self.second[start * D..(start + 2) * D]);
        Cubic::new(h, p, m)
    }

    /// Parameters of so many samples a data span.
    #[inline(always)]
    fn per_span_parameters(&self, fractions: &[f64], t: &mut [f64]) {
        let (mut rest, n) = (t, fractions.len());
        for span in 0..self.spans() {
            let t = take(&mut rest, n);
            match self.span(span) {
                (k, true) => {
                    let (from, to) = (self.t[k], self.t[k + 1]);
                    for (t, &u) in t.iter_mut().zip(fractions) {
                        *t = (from + u * (to - from)).min(to);
                    }
                }
                (k, false) => t.fill(self.t[k]),
            }
        }
        if let [last] = rest {
            *last = self.t[self.t.len() - 1];
        }
    }

    #[inline(always)]
    fn per_span<const D: usize>(&self, fractions: &[f64], coords: &mut [f64]) {
        let (mut rest, _) = coords.as_chunks_mut::<D>();
        for span in 0..self.spans() {
            let (k, long) = self.span(span);
            let first: [f64; D] = std::array::from_fn(|c| self.values[k * D + c]);
            if long {
                self.cubic::<D>(k).write(rest, (0, fractions.len()), |u| u, fractions);
            } else {
                rest[..fractions.len()].fill(first);
            }
            // Data points are copied, so that they keep their bits.
            if let Some(point) = take(&mut rest, fractions.len()).first_mut() {
                *point = first;
            }
        }
        if let [last] = rest {
            last.copy_from_slice(&self.values[self.values.len() - D..]);
        }
    }

    /// The same from samples by knots, `width` numbers a span: spans between repeated data points
    /// are put in.
    fn per_span_taken(&self, width: usize, samples: &[f64], coords: &mut [f64]) {
        if self.entries.is_none() {
            return coords.copy_from_slice(samples);
        }
        let (mut rest, d) = (coords, self.dimension);
        for span in 0..self.spans() {
            let to = take(&mut rest, width);
            match self.span(span) {
                (k, true) => to.copy_from_slice(&samples[k * width..(k + 1) * width]),
                (k, false) => {
                    to.chunks_exact_mut(d).for_each(|to| to.copy_from_slice(&self.values[k * d..(k + 1) * d]));
                }
            }
        }
        rest.copy_from_slice(&self.values[self.values.len() - rest.len()..]);
    }

    /// Parameters at fractions of the whole curve.
    #[inline(always)]
    fn even_parameters(&self, fractions: &[f64], t: &mut [f64]) {
        let (from, to) = (self.t[0], self.t[self.t.len() - 1]);
        for (t, fraction) in t.iter_mut().zip(fractions) {
            *t = (from + (to - from) * fraction).min(to);
        }
        if let [_, .., last] = t
            && !self.closed
        {
            *last = to;
        }
    }

    /// Points at increasing parameters, the first of them the curve's, and for an open curve the
    /// last.
    #[inline(always)]
    fn evenly<const D: usize>(&self, t: &[f64], coords: &mut [f64]) {
        let (points, _) = coords.as_chunks_mut::<D>();
        let (last, n) = (self.t.len() - 1, t.len());
        if n == 0 {
            return;
        }
        // Samples a unit of the parameter.
        let pace = (n - usize::from(!self.closed && n > 1)) as f64 / (self.t[last] - self.t[0]);
        let mut start = 0;
        for k in 0..last {
            let (a, b) = (self.t[k], self.t[k + 1]);
            let mut end = n;
            if k + 1 < last {
                // Near enough to where the steps come to b; then exactly.
                end = start.max(((b - t[0]) * pace) as usize + 1).min(n);
                while end > start && t[end - 1] >= b {
                    end -= 1;
                }
                while end < n && t[end] < b {
                    end += 1;
                }
            }
            let (cubic, reciprocal) = (self.cubic::<D>(k), 1.0 / (b - a));
            if reciprocal.is_finite() {
                cubic.write(points, (start, end), |t| (t - a) * reciprocal, t);
            } else {
                cubic.write(points, (start, end), |t| (t - a) / (b - a), t);
            }
            start = end;
        }
        // Both ends are data points.
        if let Some(point) = points.first_mut() {
            point.copy_from_slice(&self.values[..D]);
        }
        if !self.closed && n > 1 {
            points[n - 1].copy_from_slice(&self.values[last * D..]);
        }
    }
}
