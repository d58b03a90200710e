//! Splines as polylines: sampled on the CPU in lanes, or from samples that a GPU took.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::cubic::{CubicSplines, Spline};
use super::gpu::{self, Samples};
use super::knots::Knots;
use super::sample::{Cubic, EvenSites, Sites, Taken};
use crate::batch::{CurveBatch, Parameters, are_finite};
use crate::curve::{Curve, Input, Sampling, samples_at};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::linalg::{operation, run, take, tasks};
use crate::numbers::Numbers;
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;

/// The fractions k/n for n samples: of a closed curve or a span, and of an open curve, whose last
/// sample is at 1.
struct Fractions {
    closed: Vec<f64>,
    open: Vec<f64>,
}

impl Fractions {
    fn new(n: usize) -> Self {
        let of = |steps: usize| (0..n).map(|k| k as f64 / steps.max(1) as f64).collect();
        Fractions { closed: of(n), open: of(n.saturating_sub(1)) }
    }
}

impl CubicSplines {
    /// Polylines of all curves, from the samples that a GPU took.
    pub(crate) fn polylines_with(&self, sampling: Sampling, taken: Option<Numbers>) -> CurveBatch {
        let Some(offsets) = self.offsets(sampling) else {
            return self.at_sites(sampling, &self.sites_of_curves(sampling), None);
        };
        let taken = taken.map(|taken| match sampling {
            Sampling::Count(n) => (taken, gpu::offsets_of(&self.knots, |_| n)),
            Sampling::PerSpan(n) => (taken, gpu::sample_offsets(&self.knots, &Samples::PerSpan(n))),
            _ => unreachable!("samples at equal arc lengths have no offsets before they are taken"),
        });
        let room = || Numbers::room(offsets[self.len()] * self.knots.dimension);
        let (mut coords, taken) = match taken {
            None => (room(), Taken::None),
            Some((taken, starts)) if starts == offsets => (taken, Taken::Here),
            Some((taken, starts)) => (room(), Taken::There(taken, starts)),
        };
        self.write(sampling, &offsets, &taken, &mut coords);
        let of = SampleParameters {
            knots: self.knots.clone(),
            unfitted: self.unfitted.clone(),
            offsets: offsets.clone(),
            sampling,
        };
        let closed = self.knots.closed.clone();
        let spans = closed.contains(&true).then(|| {
            let fractions = of.fractions();
            parallel::map(self.len(), 256, |i| match closed[i] {
                true => of.curve(i, &fractions).last().map_or(f64::NAN, |last| self.closing(i, *last)),
                false => f64::NAN,
            })
        });
        let (problems, t) = (self.knots.unfitted.clone(), Parameters::later(move || of.all()));
        CurveBatch::sampled(self.knots.dimension, coords, offsets, closed, t, spans, problems, self.origin.clone())
    }

    /// The parameter length from the last sample of a curve, at this parameter, to its first. NaN
    /// for an open curve.
    fn closing(&self, i: usize, last: f64) -> f64 {
        match self.unfitted.get(&i) {
            Some(input) => input.closing_after(last),
            None if self.knots.closed[i] => self.knots.t(i)[self.knots.range(i).len() - 1] - last,
            None => f64::NAN,
        }
    }

    /// Where the samples of each curve start. `None` for equal arc lengths, which only sampling
    /// tells.
    pub(super) fn offsets(&self, sampling: Sampling) -> Option<Vec<usize>> {
        let (Sampling::PerSpan(n) | Sampling::Count(n)) = sampling else { return None };
        let count = |i: usize| {
            if let Some(input) = self.unfitted.get(&i) {
                return input.t.len();
            }
            let ends = self.knots.repeats.get(&i).map_or(self.knots.range(i).len(), Vec::len);
            match sampling {
                Sampling::PerSpan(_) => self.steps(i, sampling, n) * (ends - 1) + usize::from(!self.knots.closed[i]),
                _ => self.steps(i, sampling, n),
            }
        };
        Some(ragged::offsets((0..self.len()).map(count)))
    }

    /// Samples per span or of the whole curve `i`: `n`, or more if it is closed and has few spans.
    #[inline]
    fn steps(&self, i: usize, sampling: Sampling, n: usize) -> usize {
        if self.knots.closed[i] { n.max(self.spline(i).least(sampling)) } else { n }
    }

    /// Writes samples between these offsets.
    pub(super) fn write(&self, sampling: Sampling, offsets: &[usize], taken: &Taken, mut coords: &mut [f64]) {
        let d = self.knots.dimension;
        let (Sampling::PerSpan(n) | Sampling::Count(n)) = sampling else {
            unreachable!("samples at equal arc lengths have no offsets before they are taken")
        };
        let (room, needed) = (coords.len(), offsets[self.len()] * d);
        assert!(room == needed, "samples of {needed} numbers, and room for {room}");
        let mut work = Vec::new();
        for curves in tasks(offsets) {
            let count = offsets[curves.end] - offsets[curves.start];
            work.push((curves, take(&mut coords, count * d)));
        }
        let fractions = Fractions::new(n);
        parallel::of(work, |(curves, mut coords)| {
            let mut t = Vec::new();
            for i in curves {
                let coords = take(&mut coords, (offsets[i + 1] - offsets[i]) * d);
                let taken = match taken {
                    Taken::None => None,
                    Taken::Here if are_finite(coords) && self.is_as_taken(i) => continue,
                    Taken::Here => None,
                    Taken::There(samples, offsets) => Some(&samples[offsets[i] * d..offsets[i + 1] * d]),
                };
                self.write_curve(i, sampling, &fractions, taken, coords, &mut t);
            }
        });
    }

    /// Whether the spline of curve `i` is the one that a GPU has sampled.
    fn is_as_taken(&self, i: usize) -> bool {
        !self.unfitted.contains_key(&i) && !self.sided.contains_key(&i)
    }

    /// Writes the samples of a curve. `t` is storage.
    fn write_curve(
        &self,
        i: usize,
        sampling: Sampling,
        fractions: &Fractions,
        taken: Option<&[f64]>,
        coords: &mut [f64],
        t: &mut Vec<f64>,
    ) {
        if let Some(input) = self.unfitted.get(&i) {
            return coords.copy_from_slice(&input.coords);
        }
        let (d, spline) = (self.knots.dimension, self.spline(i));
        let steps = self.steps(i, sampling, fractions.closed.len());
        let more = if steps > fractions.closed.len() { Some(Fractions::new(steps)) } else { None };
        let Fractions { closed, open } = more.as_ref().unwrap_or(fractions);
        let taken = taken.filter(|samples| more.is_none() && are_finite(samples) && self.is_as_taken(i));
        if let Sampling::PerSpan(_) = sampling {
            match taken {
                Some(samples) => spline.per_span_taken(closed.len() * d, samples, coords),
                None if d == 2 => run(PerSpan::<2> { spline: &spline, fractions: closed, coords }),
                None => run(PerSpan::<3> { spline: &spline, fractions: closed, coords }),
            }
            return;
        }
        let even = if spline.closed { closed } else { open };
        t.resize(coords.len() / d, 0.0);
        match taken {
            Some(samples) => coords.copy_from_slice(samples),
            None if d == 2 => run(Evenly::<2> { spline: &spline, fractions: even, t, coords }),
            None => run(Evenly::<3> { spline: &spline, fractions: even, t, coords }),
        }
    }

    /// Samples of all curves by a GPU.
    ///
    /// # Errors
    /// Failed submissions.
    pub(crate) fn sample_on_gpu(&self, gpu: &Gpu, precision: Precision, sampling: Sampling) -> Result<CurveBatch> {
        let sample = |wanted: &Samples| gpu::sample(gpu, precision, &self.knots, &self.second, wanted);
        match sampling {
            Sampling::PerSpan(n) => Ok(self.polylines_with(sampling, Some(sample(&Samples::PerSpan(n))?))),
            Sampling::Count(n) => {
                let sites = EvenSites::new(&self.knots, n);
                Ok(self.polylines_with(sampling, Some(sample(&Samples::Evenly(&sites))?)))
            }
            Sampling::Points(_) | Sampling::Spacing(_) | Sampling::Tolerance(_) | Sampling::AsMany(_) => {
                let of_curves = self.sites_of_curves(sampling);
                let sites = self.by_knots(&of_curves);
                let taken = sample(&Samples::At(&sites))?;
                Ok(self.at_sites(sampling, &of_curves, Some(&taken)))
            }
        }
    }

    /// Sites along every curve. Unfitted curves have none.
    fn sites_of_curves(&self, sampling: Sampling) -> Vec<Vec<(usize, f64)>> {
        parallel::map(self.len(), 1, |i| match self.unfitted.contains_key(&i) {
            true => Vec::new(),
            false => self.spline(i).sites(sampling),
        })
    }

    /// The same as knots and fractions.
    fn by_knots(&self, of_curves: &[Vec<(usize, f64)>]) -> Sites {
        let mut sites = Sites { offsets: vec![0], knots: Vec::new(), fractions: Vec::new() };
        for (i, of_curve) in of_curves.iter().enumerate() {
            for &(span, u) in of_curve {
                // Only at the very end does a sample fall into a span without length.
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

    /// Polylines of samples at these sites, of which a GPU may have taken all.
    fn at_sites(&self, sampling: Sampling, sites: &[Vec<(usize, f64)>], taken: Option<&[f64]>) -> CurveBatch {
        let (d, closed) = (self.knots.dimension, &self.knots.closed);
        let offsets = ragged::offsets(sites.iter().map(|sites| d * sites.len()));
        let samples = parallel::map(self.len(), 1, |i| {
            if let Some(input) = self.unfitted.get(&i) {
                return input.sample(d, closed[i], sampling);
            }
            let taken = taken.map(|taken| &taken[offsets[i]..offsets[i + 1]]);
            let taken = taken.filter(|taken| are_finite(taken) && !self.sided.contains_key(&i));
            samples_at(&self.spline(i), &sites[i], taken)
        });
        let (closing, problems) = (|i: usize, last: f64| self.closing(i, last), self.knots.unfitted.clone());
        CurveBatch::from_samples(d, samples, closing, closed.clone(), problems, self.origin.clone())
    }
}

/// The parameters of samples.
struct SampleParameters {
    knots: Arc<Knots>,
    unfitted: BTreeMap<usize, Input>,
    offsets: Vec<usize>,
    sampling: Sampling,
}

impl SampleParameters {
    /// The fractions of most curves.
    fn fractions(&self) -> Fractions {
        match self.sampling {
            Sampling::PerSpan(n) | Sampling::Count(n) => Fractions::new(n),
            _ => unreachable!("samples at equal arc lengths have no fractions before they are taken"),
        }
    }

    /// The parameters of all curves' samples.
    fn all(&self) -> Vec<f64> {
        let (mut t, fractions) = (vec![0.0; self.offsets[self.knots.len()]], self.fractions());
        parallel::parts(&mut t, &self.offsets, |i, t| self.write(i, &fractions, t));
        t
    }

    /// The parameters of a curve's samples.
    fn curve(&self, i: usize, fractions: &Fractions) -> Vec<f64> {
        let mut t = vec![0.0; self.offsets[i + 1] - self.offsets[i]];
        self.write(i, fractions, &mut t);
        t
    }

    fn write(&self, i: usize, fractions: &Fractions, t: &mut [f64]) {
        if let Some(input) = self.unfitted.get(&i) {
            return t.copy_from_slice(&input.t);
        }
        let spline = Spline::of(&self.knots, i, &[], 1);
        let is_per_span = matches!(self.sampling, Sampling::PerSpan(_));
        let steps = match is_per_span {
            true => (t.len() - usize::from(!spline.closed)) / spline.spans(),
            false => t.len(),
        };
        let more = (steps != fractions.closed.len()).then(|| Fractions::new(steps));
        let Fractions { closed, open } = more.as_ref().unwrap_or(fractions);
        match is_per_span {
            true => spline.per_span_parameters(closed, t),
            false => spline.even_parameters(if spline.closed { closed } else { open }, t),
        }
    }
}

operation! {
    /// Samples of the spans of one curve.
    PerSpan<'a; D> { spline: &'a Spline<'a>, fractions: &'a [f64], coords: &'a mut [f64] }
        -> () { spline.per_span::<D>(fractions, coords) }
}

operation! {
    /// Samples of one curve at fractions of the whole. `t` becomes their parameters.
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

    /// Parameters of the samples of all data spans.
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
