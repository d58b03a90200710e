//! [`CubicSplines`]: cubic splines of a whole batch, from knots and second derivatives.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::knots::Knots;
use super::sample::Taken;
use super::sample::coefficients;
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::curve::measure::inlined_measures;
use crate::curve::{Curve, Input, Jet, Polygon, Sampling, vector};
use crate::motion::Motion;
use crate::numbers::Numbers;
use crate::report::CurveSet;
use crate::sort;

/// The cubic splines of a batch: knots, points and second derivatives. Curves that could not be
/// fitted are their input polylines.
pub struct CubicSplines {
    pub(super) knots: Arc<Knots>,
    /// p″ at the knots, flat as their points.
    pub(super) second: Numbers,
    /// p″ at both ends of every span, for curves whose p″ may jump at a knot.
    pub(super) sided: BTreeMap<usize, Vec<f64>>,
    /// The curves that were not fitted, as they came in.
    pub(super) unfitted: BTreeMap<usize, Input>,
    pub(super) origin: Arc<Origin>,
}

impl CubicSplines {
    /// Splines of a batch from their knots (whose points are the spline's, not necessarily the
    /// data's) and second derivatives there.
    pub(crate) fn new(batch: &CurveBatch, knots: Knots, second: Numbers) -> Self {
        let unfitted = sort::map(knots.unfitted.keys().map(|&i| (i, Input::of(batch, i))));
        CubicSplines {
            // Weights and radii are the fit's alone.
            knots: Arc::new(Knots { weights: None, radii: None, ..knots }),
            second,
            sided: BTreeMap::new(),
            unfitted,
            origin: batch.origin().clone(),
        }
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

    /// The second derivatives with respect to the parameter at the distinct knots of curve `i`,
    /// `dimension` numbers per knot. A closed curve repeats the first at the end. Empty if the
    /// curve was not fitted.
    ///
    /// A curve that was refitted to keep its shape has them at both ends of every span. They differ
    /// at a knot with an active constraint.
    pub fn second_derivatives(&self, i: usize) -> &[f64] {
        if self.unfitted.contains_key(&i) {
            return &[];
        }
        if let Some(sided) = self.sided.get(&i) {
            return sided;
        }
        &self.second[self.knots.offsets[i] * self.knots.dimension..self.knots.offsets[i + 1] * self.knots.dimension]
    }

    /// ∫|p″|² dt of curve `i`, exactly; nothing where a coefficient of some span is beyond the
    /// range of the numbers.
    pub(super) fn energy(knots: &Knots, second: &[f64], i: usize) -> Option<f64> {
        let (t, d) = (knots.t(i), knots.dimension);
        let own = &second[knots.offsets[i] * d..knots.offsets[i + 1] * d];
        let (energy, size) = match d {
            2 => measure::<2>(t, knots.values(i), own),
            _ => measure::<3>(t, knots.values(i), own),
        };
        // A sum far from the end of the range has such terms only.
        (size < f64::MAX / 32.0 || Self::is_in_range(knots, second, i)).then_some(energy)
    }

    /// Whether all coefficients of all spans of curve `i` are within the range of the numbers.
    fn is_in_range(knots: &Knots, second: &[f64], i: usize) -> bool {
        let (t, d, values) = (knots.t(i), knots.dimension, knots.values(i));
        let second = &second[knots.offsets[i] * d..knots.offsets[i + 1] * d];
        let mut steps = t.windows(2).map(|pair| pair[1] - pair[0]).enumerate();
        steps.all(|(k, h)| {
            (k * d..(k + 1) * d).all(|at| {
                let bent = h * (h * second[at].abs().max(second[at + d].abs()));
                // Sums of a few such are in range, too.
                (bent + (values[at + d] - values[at]).abs()) * 16.0 < f64::MAX
                    && (second[at + d] - second[at]).is_finite()
            })
        })
    }

    pub(super) fn spline(&self, i: usize) -> Spline<'_> {
        let stride = 1 + usize::from(self.sided.contains_key(&i));
        Spline::of(&self.knots, i, self.second_derivatives(i), stride)
    }

    pub(super) fn polygon(&self, i: usize) -> Option<Polygon<'_>> {
        Some(self.unfitted.get(&i)?.polygon(self.knots.dimension, self.knots.closed[i]))
    }
}

/// ∫|p″|² dt of a curve, and a sum of sizes that none of its spans' coefficients exceeds.
///
/// p″ is linear between knots, so that a span contributes h/3·(m·m + m·n + n·n).
#[inline]
fn measure<const D: usize>(t: &[f64], values: &[f64], second: &[f64]) -> (f64, f64) {
    let (values, second) = (values.as_chunks::<D>().0, second.as_chunks::<D>().0);
    let (mut energies, mut sizes) = ([0.0; D], [0.0; D]);
    let ends = values.windows(2).zip(second.windows(2));
    for (t, (p, m)) in t.windows(2).zip(ends) {
        let h = t[1] - t[0];
        let third = h / 3.0;
        for c in 0..D {
            let (m, n) = (m[0][c], m[1][c]);
            // m² + mn + n² as squares, whose sum may overflow but is never ∞ − ∞; h times a moment
            // first, since its square alone may be out of range.
            let middle = m + 0.5 * n;
            energies[c] += third * middle * middle + 0.75 * third * n * n;
            let bent = m.abs() + n.abs();
            sizes[c] += bent + h * (h * bent) + (p[1][c] - p[0][c]).abs();
        }
    }
    (energies.iter().sum(), sizes.iter().sum())
}

impl CurveSet for CubicSplines {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.polygon(i) {
            Some(polygon) => Box::new(polygon),
            None => Box::new(self.spline(i)),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        self.polylines_with(sampling, None)
    }

    fn sample_offsets(&self, sampling: Sampling) -> Option<Vec<usize>> {
        self.offsets(sampling)
    }

    fn sample_into(&self, sampling: Sampling, coords: &mut [f64]) {
        match self.offsets(sampling) {
            Some(offsets) => self.write(sampling, &offsets, &Taken::None, coords),
            None => coords.copy_from_slice(self.polylines(sampling).coords()),
        }
    }
}

/// One fitted curve.
pub(super) struct Spline<'a> {
    pub t: &'a [f64],
    pub values: &'a [f64],
    /// p″ at the start and the end of every span.
    pub second: &'a [f64],
    /// Second derivatives per span: 1 if p″ is continuous, else 2.
    pub stride: usize,
    pub dimension: usize,
    pub closed: bool,
    /// The knot of every data point, where they are not one to one.
    pub entries: Option<&'a [u32]>,
    /// The parameter of every data point then, computed on demand.
    repeated: OnceLock<Vec<f64>>,
}

impl<'a> Spline<'a> {
    /// Curve `i` of these knots, with `stride` second derivatives at each.
    pub(super) fn of(knots: &'a Knots, i: usize, second: &'a [f64], stride: usize) -> Self {
        Spline {
            t: knots.t(i),
            values: knots.values(i),
            second,
            stride,
            dimension: knots.dimension,
            closed: knots.closed[i],
            entries: knots.repeats.get(&i).map(Vec::as_slice),
            repeated: OnceLock::new(),
        }
    }
}

impl Spline<'_> {
    /// Knot at which a data span starts, and whether the span has any length.
    #[inline(always)]
    pub fn span(&self, span: usize) -> (usize, bool) {
        match self.entries {
            None => (span, true),
            Some(entries) => (entries[span] as usize, entries[span] < entries[span + 1]),
        }
    }

    #[inline(always)]
    fn value(&self, k: usize) -> DVec3 {
        vector(&self.values[k * self.dimension..(k + 1) * self.dimension])
    }

    /// The polynomial p + u (a + u (b + u c)) between the knots `k` and `k + 1`: the points and
    /// second derivatives at both, a, b and c, and the length h.
    #[inline(always)]
    fn cubic_at(&self, k: usize) -> ([DVec3; 4], [DVec3; 3], f64) {
        let h = self.t[k + 1] - self.t[k];
        let second = |at: usize| vector(&self.second[at * self.dimension..(at + 1) * self.dimension]);
        let start = self.stride * k;
        let ends = [self.value(k), self.value(k + 1), second(start), second(start + 1)];
        let [x, y, z] = [0, 1, 2].map(|c| coefficients(h, ends.map(|v| v[c])));
        (ends, [0, 1, 2].map(|power| DVec3::new(x[power], y[power], z[power])), h)
    }

    /// The jet at the fraction `u` between the knots `k` and `k + 1`.
    #[inline(always)]
    pub fn jet_at(&self, k: usize, u: f64) -> Jet {
        let ([p, q, m, n], [a, b, c], h) = self.cubic_at(k);
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

    fn knots(&self) -> &[f64] {
        match self.entries {
            None => self.t,
            Some(entries) => {
                self.repeated.get_or_init(|| entries.iter().map(|&entry| self.t[entry as usize]).collect())
            }
        }
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

    #[inline(always)]
    fn pieces(&self, span: usize) -> usize {
        usize::from(self.span(span).1)
    }

    #[inline(always)]
    fn motion(&self, span: usize, _: usize) -> Option<Motion> {
        let (k, _) = self.span(span);
        let (_, [a, b, c], _) = self.cubic_at(k);
        Some(Motion::of_cubic(a, b, c))
    }

    #[inline(always)]
    fn pace(&self, span: usize) -> f64 {
        match self.span(span) {
            (k, true) => self.t[k + 1] - self.t[k],
            (_, false) => 0.0,
        }
    }

    inlined_measures!();
}
