//! [`PreparedBatch`]: control polygons with what is computed once per pattern.

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::FxHashMap;

use super::MOST_DEGREE;
use super::directions::{Found, Speeds};
use super::energy::Energy;
use super::pattern::Pattern;
use super::polygons::{Given, Polygons};
use super::ready::{Form, Ready};
use super::refusal::Refusal;
use crate::error::Result;
use crate::parallel;

/// Control polygons with what is computed once per pattern.
pub(super) struct PreparedBatch<'a> {
    pub polygons: Polygons<'a>,
    given: Given<'a>,
    pub energy: Energy,
    pub ready: Vec<Option<Ready>>,
    /// The index of each curve's pattern in `ready`, or [`NONE`].
    pub numbers: Vec<u32>,
}

/// The index that stands for no pattern, no operator.
pub(super) const NONE: u32 = u32::MAX;

impl<'a> PreparedBatch<'a> {
    pub fn new(polygons: &Polygons<'a>, given: &Given<'a>, energy: &Energy) -> Self {
        let mut batch = PreparedBatch {
            polygons: *polygons,
            given: *given,
            energy: *energy,
            ready: Vec::new(),
            numbers: Vec::new(),
        };
        let found: Vec<Option<Pattern>> = parallel::map(polygons.len(), 1024, |i| batch.pattern(i).ok());
        let (mut patterns, mut places) = (Vec::new(), FxHashMap::default());
        let mut number = |pattern| {
            *places.entry(pattern).or_insert_with(|| {
                patterns.push(pattern);
                patterns.len() as u32 - 1
            })
        };
        batch.numbers = found.into_iter().map(|pattern| pattern.map_or(NONE, &mut number)).collect();
        let degrees: BTreeSet<usize> = patterns.iter().map(Pattern::degree).collect();
        let forms: BTreeMap<usize, Form> = parallel::of(degrees, |d| (d, Form::new(energy, d))).into_iter().collect();
        batch.ready = parallel::of(patterns, |own| Ready::new(own, &forms[&own.degree()]));
        batch
    }

    /// The pattern of a curve.
    fn pattern(&self, i: usize) -> Result<Pattern, Refusal> {
        let points = self.polygons.offsets[i]..self.polygons.offsets[i + 1];
        match points.len() {
            0 => return Err(Refusal::Empty),
            count if count > MOST_DEGREE + 1 => return Err(Refusal::Degree(count)),
            _ => {}
        }
        let mut pattern = match self.given.known {
            Some(known) => Pattern::new(&known[points]),
            None => Pattern::new(&[true; MOST_DEGREE + 1][..points.len()]),
        };
        for (end, r) in [0, 1].into_iter().flat_map(|end| [1, 2, 3].map(|r| (end, r))) {
            if self.derivative(i, end, r).is_some() {
                pattern = pattern.with_derivative(end, r);
            }
        }
        Ok(pattern)
    }

    /// What is computed once for the pattern of a curve.
    #[inline(always)]
    pub fn ready(&self, i: usize) -> Result<&Ready, Refusal> {
        match self.numbers[i] {
            NONE => Err(self.pattern(i).expect_err("curves with a pattern have a number")),
            number => self.ready[number as usize].as_ref().ok_or(Refusal::Contradiction),
        }
    }

    fn derivative(&self, i: usize, end: usize, r: usize) -> Option<&[f64]> {
        let dimension = self.polygons.dimension;
        let vector = &self.given.derivatives[end][r - 1]?[i * dimension..(i + 1) * dimension];
        (!vector[0].is_nan()).then_some(vector)
    }

    /// Collects the data of a curve of this pattern, points relative to the first known one.
    ///
    /// Returns that point, or 0 if no point is known. Directions get their speeds here.
    pub fn gather<const D: usize>(&self, i: usize, ready: &Ready, data: &mut Vec<f64>) -> Result<[f64; D], Refusal> {
        let (points, _) = self.polygons.points(i).as_chunks::<D>();
        data.clear();
        let origin = ready.known.first().map_or([0.0; D], |&first| points[usize::from(first)]);
        for &place in &ready.known {
            let point = points[usize::from(place)];
            if let Some(axis) = point.iter().position(|x| !x.is_finite()) {
                return Err(Refusal::Value(place.into(), axis, point[axis]));
            }
            for c in 0..D {
                data.push(point[c] - origin[c]);
            }
        }
        for (end, r) in ready.pattern.derivatives() {
            let vector = self.derivative(i, end, r).expect("the pattern says so");
            if vector.iter().any(|x| !x.is_finite()) {
                return Err(Refusal::Derivative(end, r));
            }
            data.extend_from_slice(vector);
        }
        if self.given.directions
            && let Some(speeds) = &ready.speeds
        {
            set_speeds::<D>(speeds, data.as_chunks_mut().0)?;
        }
        Ok(origin)
    }
}

/// Scales directions to the speeds of least energy.
fn set_speeds<const D: usize>(speeds: &Speeds, data: &mut [[f64; D]]) -> Result<(), Refusal> {
    for (end, column) in speeds.columns.iter().enumerate() {
        if column.is_some_and(|column| data[column].iter().all(|&x| x == 0.0)) {
            return Err(Refusal::NoDirection(end));
        }
    }
    match speeds.find(data) {
        Found::Any => Ok(()),
        Found::Still(end) => Err(Refusal::Still(end)),
        Found::Speeds(found) => {
            for (column, speed) in speeds.columns.iter().zip(found) {
                if let &Some(column) = column {
                    data[column] = data[column].map(|x| speed * x);
                }
            }
            Ok(())
        }
    }
}
