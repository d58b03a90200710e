//! Sets up the [`SlopesProblem`] of a curve's tangent angles: distinct dots, chords, exponents,
//! weights.
//!
//! A dot is a data point, with its consecutive repetitions.

use super::problem::{Ends, SlopesProblem, Span};
use super::start::{Chords, Start, wrap};
use super::tension::{TensionLaw, TensionSpan};
use super::universal::Universal;
use crate::batch::{CurveBatch, Unfitted};
use crate::error::{Error, Result};
use crate::status::CurveStatus;
use crate::width::widths;

/// The most exponents of a batch: indices are stored in 16 bits.
const MOST_EXPONENTS: usize = 1 << 16;

/// The exponents of a batch, each with its universal curve.
#[derive(Clone, Debug)]
pub(crate) struct Exponents {
    pub universal: Vec<Universal>,
    /// The quadrature rules of every exponent, if curves have tension.
    pub laws: Vec<TensionLaw>,
    /// τ; 0 without tension.
    pub tension: f64,
    /// Increasing.
    values: Vec<f64>,
    /// The exponent of the method.
    default: f64,
}

impl Exponents {
    /// The exponent of the method, and the exponents of the column `nu`.
    pub fn of(exponent: f64, batch: &CurveBatch) -> Result<Self> {
        let mut values = vec![exponent];
        let given = batch.constraints().exponents.iter().flatten();
        values.extend(given.copied().filter(|nu| *nu > 1.0 && nu.is_finite()));
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() > MOST_EXPONENTS {
            let count = values.len();
            return Err(Error::argument(format!(
                "{count} different exponents (column nu) in one batch; {MOST_EXPONENTS} are possible: round them, or split the batch"
            )));
        }
        Ok(Self::from(values, exponent, 0.0))
    }

    fn from(values: Vec<f64>, default: f64, tension: f64) -> Self {
        let universal = values.iter().map(|&nu| Universal::new(nu)).collect();
        let laws = if tension > 0.0 { values.iter().map(|&nu| TensionLaw::new(nu)).collect() } else { Vec::new() };
        Exponents { universal, laws, tension, values, default }
    }

    /// The same exponents under a tension τ.
    pub fn under(self, tension: f64) -> Self {
        if tension > 0.0 { Self::from(self.values, self.default, tension) } else { self }
    }

    /// The same exponents under a multiple of the tension.
    pub fn tightened(&self, times: f64) -> Self {
        Exponents { tension: times * self.tension, ..self.clone() }
    }

    /// The index of an exponent.
    fn number(&self, exponent: f64) -> u16 {
        self.values.partition_point(|&value| value < exponent) as u16
    }

    /// Whether continuation from exponent 2 is useful: within a tenth of 2 curves differ little.
    pub fn are_far_from_two(&self) -> bool {
        self.values.iter().any(|nu| (nu / 2.0).ln().abs() > 0.1)
    }

    /// Exponents between 2 (at 0) and these (at 1), in equal ratios and with the same indices.
    pub fn towards(&self, part: f64) -> Self {
        let stage = |nu: &f64| 2.0 * (nu / 2.0).powf(part);
        Self::from(self.values.iter().map(stage).collect(), stage(&self.default), self.tension)
    }
}

/// The distinct dots of a curve.
#[derive(Clone, Debug)]
pub(crate) struct Dots {
    pub closed: bool,
    pub points: Vec<[f64; 2]>,
    /// The index of each dot's input point.
    pub entries: Vec<usize>,
    /// The dot at the start of every input span; `None` between repeated points.
    pub spans: Vec<Option<usize>>,
    pub chords: Chords,
    /// The given directions; NaN if missing.
    pub fixed: Vec<f64>,
    /// The index of every segment's exponent.
    pub curves: Vec<u16>,
}

impl Dots {
    /// The dots of curve `i`, or the reason why it cannot be fitted.
    pub fn of(batch: &CurveBatch, i: usize, exponents: &Exponents) -> Result<Self, Unfitted> {
        if let Some(problem) = batch.problem(i) {
            return Err(problem.clone());
        }
        let points = batch.points(i).as_chunks::<2>().0;
        let closed = batch.is_closed(i);
        let invalid = |k: usize, what: String| {
            Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &what) })
        };
        let mut dots = Dots {
            closed,
            points: Vec::with_capacity(points.len()),
            entries: Vec::with_capacity(points.len()),
            spans: Vec::with_capacity(batch.spans(i)),
            chords: Chords::default(),
            fixed: Vec::with_capacity(points.len()),
            curves: Vec::with_capacity(points.len()),
        };
        let mut segments = 0;
        for (k, &point) in points.iter().enumerate() {
            // A dot is the first of its points. The last points of a closed curve may repeat the
            // first dot.
            let dot = if closed && segments > 0 && k > 0 && points[k..].iter().all(|p| *p == points[0]) {
                0
            } else {
                segments
            };
            if dot == dots.points.len() {
                dots.points.push(point);
                dots.entries.push(k);
                dots.fixed.push(f64::NAN);
            }
            if let Some(tangent) = batch.tangent(i, k).filter(|_| dots.fixed[dot].is_nan()) {
                if tangent[0] == 0.0 && tangent[1] == 0.0 {
                    return invalid(k, "the tangent is 0 long and has no direction: leave it out, or give one".into());
                }
                dots.fixed[dot] = tangent[1].atan2(tangent[0]);
            }
            let nu = batch.constraints().exponents.as_ref().map_or(f64::NAN, |nu| nu[batch.offsets()[i] + k]);
            if !(nu.is_nan() || nu > 1.0 && nu.is_finite()) {
                return invalid(k, format!("the exponent nu is {nu}; it must be above 1, such as 2, or left empty"));
            }
            if k < batch.spans(i) {
                let leads_on = points[(k + 1) % points.len()] != point;
                dots.spans.push(leads_on.then_some(segments));
                if leads_on {
                    dots.curves.push(exponents.number(if nu.is_nan() { exponents.default } else { nu }));
                    segments += 1;
                }
            }
        }
        if segments == 0 {
            let what = "all points of the curve are one and the same; at least two different points are needed: add points, or remove \
                        the curve";
            return Err(Unfitted { status: CurveStatus::Degenerate, message: batch.sentence(i, 0, what) });
        }
        dots.chords = Chords::of(&dots.points, closed);
        if let Some(k) = dots.chords.lengths.iter().position(|length| !(*length > 0.0 && length.is_finite())) {
            let (length, entry) = (dots.chords.lengths[k], dots.entries[k]);
            return invalid(
                entry,
                format!("the next point is {length} away, beyond the range of numbers: scale the curve"),
            );
        }
        Ok(dots)
    }

    /// The directions from which a search starts; NaN for free ends.
    pub fn directions(&self, start: Start) -> Vec<f64> {
        let segments = self.chords.lengths.len();
        let direction = |dot: usize| {
            let free = !self.closed && (dot == 0 || dot == segments);
            match self.fixed[dot] {
                given if given.is_finite() => given,
                _ if free => f64::NAN,
                _ => self.chords.start(start, (dot + segments - 1) % segments, dot),
            }
        };
        (0..self.points.len()).map(direction).collect()
    }

    /// The problem of the tangent angles with these reference directions, and the logarithm of the
    /// unit of its costs.
    pub fn problem(&self, directions: &[f64], exponents: &Exponents) -> (SlopesProblem, f64) {
        let dots = directions.len();
        let exponent = |segment: usize| exponents.universal[self.curves[segment] as usize].exponent;
        let power = |segment: usize| (1.0 - exponent(segment)) * self.chords.lengths[segment].ln();
        let segments = self.chords.lengths.len();
        let scale = (0..segments).map(power).fold(f64::NEG_INFINITY, f64::max);
        let span = |k: usize| {
            let [a, b] = [directions[k], directions[(k + 1) % dots]];
            let angle = |direction: f64| {
                if direction.is_nan() { 0.0 } else { wrap(direction - self.chords.directions[k]) }
            };
            let weight = (power(k) - scale).exp();
            Span { angles: [angle(a), angle(b)], weight, curve: self.curves[k], ends: Ends::between(a, b) }
        };
        let movable = |dot: usize| {
            let held = directions[dot].is_nan() || self.fixed[dot].is_finite();
            if held { 0.0 } else { 1.0 }
        };
        let problem = SlopesProblem {
            closed: self.closed,
            exponent: (0..segments).map(exponent).fold(0.0, f64::max),
            spans: (0..segments).map(span).collect(),
            movable: (0..dots).map(movable).collect(),
        };
        (problem, scale)
    }

    /// The spans of a curve under tension, for these directions: λ = (2qτ/w)^ν with q = 1 − 1/ν.
    pub fn tension_spans(&self, directions: &[f64], exponents: &Exponents) -> Vec<TensionSpan> {
        let dots = directions.len();
        let span = |(k, width): (usize, f64)| {
            let chord = self.chords.lengths[k];
            let nu = exponents.laws[self.curves[k] as usize].exponent();
            let ends = Ends::between(directions[k], directions[(k + 1) % dots]);
            let part = 2.0 * (1.0 - 1.0 / nu) * exponents.tension;
            TensionSpan { chord, tension: (part * chord / width).powf(nu), ends }
        };
        let Chords { lengths, directions } = &self.chords;
        let cosine = |before: usize, after: usize| (directions[after] - directions[before]).cos();
        widths(lengths, self.closed, cosine).into_iter().enumerate().map(span).collect()
    }
}
