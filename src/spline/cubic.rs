//! [`CubicSplines`]: cubic splines of a whole batch, from knots and second derivatives.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::gpu::Samples;
use super::knots::Knots;
use super::sample::{Cubic, Sites};
use crate::batch::CurveBatch;
use crate::curve::{Curve, Jet, Polygon, Sampling, vector};
use crate::device::Precision;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::io::Origin;
use crate::linalg::{take, tasks};
use crate::report::CurveSet;

/// The cubic splines of a batch: knots, points and second derivatives. Curves that could not be fitted are their input
/// polylines.
pub struct CubicSplines {
    knots: Knots,
    /// p″ at the knots, flat as their points.
    second: Vec<f64>,
    /// The data points of the curves that were not fitted.
    unfitted: BTreeMap<usize, Vec<f64>>,
    origin: Arc<Origin>,
}

impl CubicSplines {
    /// Splines of a batch from their knots (whose points are the spline's, not necessarily the data's) and second
    /// derivatives there.
    pub(crate) fn new(batch: &CurveBatch, knots: Knots, second: Vec<f64>) -> Self {
        let unfitted = knots.unfitted.keys().map(|&i| (i, batch.points(i).to_vec())).collect();
        CubicSplines { knots, second, unfitted, origin: batch.origin().clone() }
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.knots.len()
    }

    /// Whether there is no curve at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The knots.
    pub(crate) fn knots(&self) -> &Knots {
        &self.knots
    }

    /// The second derivatives with respect to the parameter at the distinct knots of curve `i`, `dimension` numbers a
    /// knot; those of a closed curve repeat the first at the end. Empty where the curve was not fitted.
    pub fn second_derivatives(&self, i: usize) -> &[f64] {
        if self.unfitted.contains_key(&i) {
            return &[];
        }
        &self.second[self.knots.offsets[i] * self.knots.dimension..self.knots.offsets[i + 1] * self.knots.dimension]
    }

    /// ∫|p″|² dt of curve `i`, exactly: p″ is linear between knots, so a span contributes h/3·(m·m + m·n + n·n).
    pub(crate) fn energy(&self, i: usize) -> f64 {
        let (t, d, m) = (self.knots.t(i), self.knots.dimension, self.second_derivatives(i));
        let mut energy = 0.0;
        for (k, pair) in t.windows(2).enumerate() {
            let third = (pair[1] - pair[0]) / 3.0;
            for c in 0..d {
                let (m, n) = (m[k * d + c], m[(k + 1) * d + c]);
                // h times m first: the square of m alone may be out of range.
                energy += third * m * (m + n) + third * n * n;
            }
        }
        energy
    }

    fn spline(&self, i: usize) -> Spline<'_> {
        Spline {
            knots: &self.knots,
            i,
            t: self.knots.t(i),
            values: self.knots.values(i),
            second: self.second_derivatives(i),
            dimension: self.knots.dimension,
            closed: self.knots.closed[i],
            entries: self.knots.repeats.get(&i).map(Vec::as_slice),
        }
    }

    fn polygon(&self, i: usize) -> Option<Polygon<'_>> {
        let coords = self.unfitted.get(&i)?;
        Some(Polygon { coords, dimension: self.knots.dimension, closed: self.knots.closed[i] })
    }

    /// Number of samples of curve `i`; not for [`Sampling::Spacing`], whose number only the lengths tell.
    fn count(&self, i: usize, sampling: Sampling) -> usize {
        if let Some(coords) = self.unfitted.get(&i) {
            return coords.len() / self.knots.dimension;
        }
        let ends = self.knots.repeats.get(&i).map_or(self.knots.range(i).len(), Vec::len);
        match sampling {
            Sampling::PerSpan(n) => n * (ends - 1) + usize::from(!self.knots.closed[i]),
            Sampling::Count(n) => n,
            Sampling::Spacing(_) => 0,
        }
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
                Some(last) if closed[i] && self.unfitted.contains_key(&i) => last + 1.0 - last,
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
            Sampling::Spacing(_) => Some(self.sites_by_spacing(sampling)),
        };
        let wanted = match (sampling, &sites) {
            (Sampling::PerSpan(n), _) => Samples::PerSpan(n),
            (_, Some(sites)) => Samples::At(sites),
            _ => Samples::None,
        };
        let samples = super::gpu::sample(gpu, precision, &self.knots, &self.second, &wanted)?;
        Ok(match &sites {
            Some(sites) if matches!(sampling, Sampling::Spacing(_)) => self.polylines_at(sites, samples),
            _ => self.polylines_of(sampling, samples),
        })
    }

    /// Sites at equal arc length along every curve, as knots and fractions.
    fn sites_by_spacing(&self, sampling: Sampling) -> Sites {
        let of_curves: Vec<Vec<(usize, f64)>> = (0..self.len())
            .into_par_iter()
            .map(|i| if self.unfitted.contains_key(&i) { Vec::new() } else { self.curve(i).sites(sampling) })
            .collect();
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

    /// Polylines of samples taken elsewhere at sites; unfitted curves are their data points.
    fn polylines_at(&self, sites: &Sites, samples: Vec<f64>) -> CurveBatch {
        let d = self.knots.dimension;
        let (mut coords, mut t, mut offsets) = (Vec::with_capacity(samples.len()), Vec::new(), vec![0]);
        for i in 0..self.len() {
            let own = sites.offsets[i]..sites.offsets[i + 1];
            match self.unfitted.get(&i) {
                Some(points) => {
                    coords.extend_from_slice(points);
                    t.extend((0..points.len() / d).map(|k| k as f64));
                }
                None => {
                    coords.extend_from_slice(&samples[own.start * d..own.end * d]);
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

    /// Polylines of samples taken elsewhere: by knots, so many a span, or so many a curve.
    pub(crate) fn polylines_of(&self, sampling: Sampling, samples: Vec<f64>) -> CurveBatch {
        let mut polylines = self.polylines_on_cpu(sampling);
        let d = self.knots.dimension;
        let Sampling::PerSpan(n) = sampling else {
            // Curve after curve, but for those that were not fitted.
            let mut rest = &samples[..];
            for i in (0..self.len()).filter(|i| !self.unfitted.contains_key(i)) {
                let to = polylines.points_mut(i);
                to.copy_from_slice(&rest[..to.len()]);
                rest = &rest[to.len()..];
            }
            return polylines;
        };
        let mut from = 0;
        for i in (0..self.len()).filter(|i| !self.knots.range(*i).is_empty()) {
            let spans = self.knots.range(i).len() - 1;
            let own = &samples[from..from + (n * spans + usize::from(!self.knots.closed[i])) * d];
            from += own.len();
            if self.unfitted.contains_key(&i) {
                continue;
            }
            let spline = self.spline(i);
            let to = polylines.points_mut(i);
            if spline.entries.is_none() {
                to.copy_from_slice(own);
                continue;
            }
            // Spans without length repeat their data point; the CPU's are right as they are.
            for (span, to) in to.chunks_exact_mut(n * d).enumerate() {
                if let (k, true) = spline.span(span) {
                    to.copy_from_slice(&own[k * n * d..(k + 1) * n * d]);
                }
            }
        }
        polylines
    }

    /// Samples by equal arc length.
    fn by_spacing(&self, sampling: Sampling) -> CurveBatch {
        let d = self.knots.dimension;
        let pieces: Vec<(Vec<f64>, Vec<f64>)> = (0..self.len())
            .into_par_iter()
            .map(|i| {
                let sites = self.curve(i).sites(sampling);
                let (mut coords, mut t) = (vec![0.0; sites.len() * d], vec![0.0; sites.len()]);
                match self.polygon(i) {
                    Some(polygon) => {
                        coords.copy_from_slice(polygon.coords);
                        t.iter_mut().enumerate().for_each(|(k, t)| *t = k as f64);
                    }
                    None => Self::walk(&self.spline(i), &sites, &mut coords, &mut t),
                }
                (coords, t)
            })
            .collect();
        let mut offsets = vec![0];
        pieces.iter().for_each(|(_, t)| offsets.push(offsets[offsets.len() - 1] + t.len()));
        let (mut coords, mut t) =
            (Vec::with_capacity(offsets[self.len()] * d), Vec::with_capacity(offsets[self.len()]));
        for (of_curve, t_of_curve) in pieces {
            coords.extend(of_curve);
            t.extend(t_of_curve);
        }
        self.assemble(coords, t, offsets)
    }
}

impl CurveSet for CubicSplines {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.polygon(i) {
            Some(polygon) => Box::new(polygon),
            None => Box::new(self.spline(i)),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        self.polylines_on_cpu(sampling)
    }
}

impl CubicSplines {
    fn polylines_on_cpu(&self, sampling: Sampling) -> CurveBatch {
        let (d, steps) = (
            self.knots.dimension,
            match sampling {
                Sampling::PerSpan(n) | Sampling::Count(n) => n,
                Sampling::Spacing(_) => return self.by_spacing(sampling),
            },
        );
        let mut offsets = Vec::with_capacity(self.len() + 1);
        offsets.push(0);
        for i in 0..self.len() {
            offsets.push(offsets[i] + self.count(i, sampling));
        }
        let total = offsets[self.len()];
        let (mut coords, mut t) = (vec![0.0; total * d], vec![0.0; total]);
        let (mut coords_rest, mut t_rest) = (&mut coords[..], &mut t[..]);
        let work: Vec<_> = tasks(&offsets)
            .into_iter()
            .map(|curves| {
                let count = offsets[curves.end] - offsets[curves.start];
                (curves, take(&mut coords_rest, count * d), take(&mut t_rest, count))
            })
            .collect();
        // k/n, and k/(n − 1) for a number of samples with both ends.
        let fractions = |n: usize| (0..steps).map(|k| k as f64 / n as f64).collect::<Vec<f64>>();
        let (fractions, open) = (fractions(steps.max(1)), fractions(steps.saturating_sub(1).max(1)));
        work.into_par_iter().for_each(|(curves, mut coords, mut t)| {
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    for i in curves.clone() {
                        let count = offsets[i + 1] - offsets[i];
                        let (coords, t) = (take(&mut coords, count * d), take(&mut t, count));
                        if let Some(points) = self.unfitted.get(&i) {
                            coords.copy_from_slice(points);
                            t.iter_mut().enumerate().for_each(|(k, t)| *t = k as f64);
                            continue;
                        }
                        let spline = self.spline(i);
                        match (sampling, d) {
                            (Sampling::PerSpan(_), 2) => spline.per_span::<2>(&fractions, coords, t),
                            (Sampling::PerSpan(_), _) => spline.per_span::<3>(&fractions, coords, t),
                            (_, 2) if spline.closed => spline.evenly::<2>(&fractions, coords, t),
                            (_, 2) => spline.evenly::<2>(&open, coords, t),
                            (_, _) if spline.closed => spline.evenly::<3>(&fractions, coords, t),
                            (_, _) => spline.evenly::<3>(&open, coords, t),
                        }
                    }
                },
            );
        });
        self.assemble(coords, t, offsets)
    }
}

/// One fitted curve.
struct Spline<'a> {
    knots: &'a Knots,
    i: usize,
    t: &'a [f64],
    values: &'a [f64],
    second: &'a [f64],
    dimension: usize,
    closed: bool,
    /// The knot of every data point, where they are not one to one.
    entries: Option<&'a [u32]>,
}

impl Spline<'_> {
    #[inline(always)]
    fn cubic<const D: usize>(&self, k: usize) -> Cubic<D> {
        let h = self.t[k + 1] - self.t[k];
        let (p, m) = (&self.values[k * D..(k + 2) * D], &self.second[k * D..(k + 2) * D]);
        Cubic::new(h, p, m)
    }

    /// Knot at which a data span starts, and whether the span has any length.
    fn span(&self, span: usize) -> (usize, bool) {
        match self.entries {
            None => (span, true),
            Some(entries) => (entries[span] as usize, entries[span] < entries[span + 1]),
        }
    }

    #[inline(always)]
    fn per_span<const D: usize>(&self, fractions: &[f64], coords: &mut [f64], t: &mut [f64]) {
        let (points, _) = coords.as_chunks_mut::<D>();
        let (mut rest, mut t_rest, n) = (points, t, fractions.len());
        let ends = self.entries.map_or(self.t.len(), <[u32]>::len);
        for span in 0..ends - 1 {
            let (points, t) = (take(&mut rest, n), take(&mut t_rest, n));
            let (k, long) = self.span(span);
            let Some((first, points)) = points.split_first_mut() else { continue };
            // Data points are copied, so that they keep their bits.
            first.copy_from_slice(&self.values[k * D..(k + 1) * D]);
            if !long {
                points.fill(*first);
                t.fill(self.t[k]);
                continue;
            }
            let (from, to, cubic) = (self.t[k], self.t[k + 1], self.cubic::<D>(k));
            for (t, &u) in t.iter_mut().zip(fractions) {
                *t = (from + u * (to - from)).min(to);
            }
            for (point, &u) in points.iter_mut().zip(&fractions[1..]) {
                *point = cubic.at(u);
            }
        }
        if let [last] = rest {
            last.copy_from_slice(&self.values[self.values.len() - D..]);
            t_rest[0] = self.t[self.t.len() - 1];
        }
    }

    #[inline(always)]
    fn evenly<const D: usize>(&self, fractions: &[f64], coords: &mut [f64], t: &mut [f64]) {
        let (points, _) = coords.as_chunks_mut::<D>();
        let last = self.t.len() - 1;
        let (from, to) = (self.t[0], self.t[last]);
        let n = fractions.len();
        for (t, fraction) in t.iter_mut().zip(fractions) {
            *t = (from + (to - from) * fraction).min(to);
        }
        let mut start = 0;
        for k in 0..last {
            let (a, b) = (self.t[k], self.t[k + 1]);
            let end = if k + 1 == last { n } else { start + t[start..].iter().take_while(|&&t| t < b).count() };
            let (cubic, reciprocal) = (self.cubic::<D>(k), 1.0 / (b - a));
            let parameters = &t[start..end];
            if reciprocal.is_finite() {
                for (point, t) in points[start..end].iter_mut().zip(parameters) {
                    *point = cubic.at((t - a) * reciprocal);
                }
            } else {
                for (point, t) in points[start..end].iter_mut().zip(parameters) {
                    *point = cubic.at((t - a) / (b - a));
                }
            }
            start = end;
        }
        // Both ends are data points.
        if let Some(point) = points.first_mut() {
            point.copy_from_slice(&self.values[..D]);
        }
        if !self.closed && n > 1 {
            points[n - 1].copy_from_slice(&self.values[last * D..]);
            t[n - 1] = to;
        }
    }

    fn value(&self, k: usize) -> DVec3 {
        vector(&self.values[k * self.dimension..(k + 1) * self.dimension])
    }

    /// The jet at the fraction `u` between the knots `k` and `k + 1`.
    fn jet_at(&self, k: usize, u: f64) -> Jet {
        let h = self.t[k + 1] - self.t[k];
        let second = |k: usize| vector(&self.second[k * self.dimension..(k + 1) * self.dimension]);
        let (p, q, m, n) = (self.value(k), self.value(k + 1), second(k), second(k + 1));
        let (start, end) = (h * (h * m), h * (h * n));
        let (a, b, c) = (q - p - (2.0 * start + end) / 6.0, 0.5 * start, (end - start) / 6.0);
        // Both ends exactly, so that neighbouring spans agree in every bit.
        let (point, second) = match u {
            0.0 => (p, m),
            1.0 => (q, n),
            _ => (p + u * (a + u * (b + u * c)), m + u * (n - m)),
        };
        Jet { point, first: (a + u * (2.0 * b + u * (3.0 * c))) / h, second, third: (n - m) / h }
    }
}

impl Curve for Spline<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> Cow<'_, [f64]> {
        self.knots.data_parameters(self.i)
    }

    fn spans(&self) -> usize {
        self.entries.map_or(self.t.len(), <[u32]>::len) - 1
    }

    /// A span without length, between repeated points, is all at its data point.
    fn jet(&self, span: usize, u: f64) -> Jet {
        match self.span(span) {
            (k, true) => self.jet_at(k, u),
            (k, false) if k + 1 < self.t.len() => self.jet_at(k, 0.0),
            (k, false) => self.jet_at(k - 1, 1.0),
        }
    }

    fn speed(&self, span: usize, u: f64) -> f64 {
        match self.span(span) {
            (k, true) => self.jet_at(k, u).first.length() * (self.t[k + 1] - self.t[k]),
            (_, false) => 0.0,
        }
    }
}
