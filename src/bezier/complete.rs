//! Completion of many control polygons at once. The unknown points of each are those of least
//! energy.

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::FxHashMap;

use super::MOST_DEGREE;
use super::directions::Found;
use super::energy::Energy;
use super::gpu::complete_on_gpu;
use super::pattern::Pattern;
use super::polygons::{Given, Polygons};
use super::ready::{Form, MOST_DATA, Ready};
use super::refusal::Refusal;
use crate::device::Device;
use crate::error::Result;
use crate::linalg::{Operation, run, take, tasks};
use crate::parallel;
use crate::status::CurveStatus;

/// Completed control polygons.
#[derive(Clone, Debug)]
pub struct Solved {
    /// All control points, in the places of the given ones.
    ///
    /// Known points keep their bits. Refused curves are as they were.
    pub coords: Vec<f64>,
    /// The energy of every curve, summed over coordinates. NaN for refused curves.
    pub energies: Vec<f64>,
    /// [`CurveStatus::Converged`], [`CurveStatus::NotUnique`], or the status of the refusal.
    pub statuses: Vec<CurveStatus>,
    /// The curves refused, in order, and why.
    pub refusals: Vec<(usize, Refusal)>,
}

/// Completes control polygons of any degrees and patterns in one call, in 1 to 4 dimensions.
///
/// Each curve is a product U = W G. [`Completion`](super::Completion) finds W once for every degree
/// and pattern.
///
/// On the CPU control points are good to rounding: about 1e-15 of the largest Σ|W||G|, at degree 30
/// as at degree 3.
///
/// On a GPU all curves are completed in one dispatch a chunk, in f32 unless the device is asked for
/// f64. In f32 points are good to 2e-6 of half the curve's largest extent, and energies to a
/// relative error of 8e-6. The sums of some curves are too large, compared with the curve, to
/// promise that. The CPU completes those again in f64.
///
/// ```
/// use faircurve::{Device, bezier::{Energy, Given, Polygons, complete}};
///
/// // A cubic without its third control point.
/// let polygons = Polygons { dimension: 2, coords: &[0.0, 0.0, 1.0, 2.0, f64::NAN, f64::NAN, 3.0, 0.0], offsets: &[0, 4] };
/// let given = Given { known: Some(&[true, true, false, true]), ..Given::default() };
/// let solved = complete(&polygons, &given, &Energy::bending(), &Device::cpu())?;
/// assert_eq!(solved.coords[4..6], [2.0, 1.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - Arrays that do not fit together.
/// - An energy without a positive weight.
/// - On a GPU the errors of submissions.
///
/// A curve that cannot be completed is [refused](Solved::refusals) by itself.
pub fn complete(polygons: &Polygons, given: &Given, energy: &Energy, device: &Device) -> Result<Solved> {
    polygons.check()?;
    given.check(polygons)?;
    energy.check()?;
    let completion = Completion::new(polygons, given, energy);
    let mut solved = Solved {
        coords: polygons.coords.to_vec(),
        energies: vec![f64::NAN; polygons.len()],
        statuses: vec![CurveStatus::Invalid; polygons.len()],
        refusals: Vec::new(),
    };
    let outcomes = match device.as_gpu() {
        Some(gpu) => {
            let precision = device.kernel_precision(gpu, true)?;
            match polygons.dimension {
                1 => complete_on_gpu::<1>(gpu, precision, &completion, &mut solved)?,
                2 => complete_on_gpu::<2>(gpu, precision, &completion, &mut solved)?,
                3 => complete_on_gpu::<3>(gpu, precision, &completion, &mut solved)?,
                _ => complete_on_gpu::<4>(gpu, precision, &completion, &mut solved)?,
            }
        }
        None => match polygons.dimension {
            1 => completion.run::<1>(&mut solved),
            2 => completion.run::<2>(&mut solved),
            3 => completion.run::<3>(&mut solved),
            _ => completion.run::<4>(&mut solved),
        },
    };
    for (i, outcome) in outcomes.into_iter().enumerate() {
        match outcome {
            Ok(status) => solved.statuses[i] = status,
            Err(refusal) => {
                solved.statuses[i] = refusal.status();
                solved.energies[i] = f64::NAN;
                let own = polygons.offsets[i] * polygons.dimension..polygons.offsets[i + 1] * polygons.dimension;
                solved.coords[own.clone()].copy_from_slice(&polygons.coords[own]);
                solved.refusals.push((i, refusal));
            }
        }
    }
    Ok(solved)
}

/// The status of a completed curve, or why it was refused.
pub(super) type Outcome = Result<CurveStatus, Refusal>;

/// Polygons with what is computed once for each pattern.
pub(super) struct Completion<'a> {
    pub polygons: Polygons<'a>,
    given: Given<'a>,
    pub energy: Energy,
    pub ready: Vec<Option<Ready>>,
    /// For every curve the place of its pattern in `ready`, or [`NONE`].
    pub numbers: Vec<u32>,
}

/// The number of no pattern, no operator.
pub(super) const NONE: u32 = u32::MAX;

impl<'a> Completion<'a> {
    fn new(polygons: &Polygons<'a>, given: &Given<'a>, energy: &Energy) -> Self {
        let mut completion =
            Completion { polygons: *polygons, given: *given, energy: *energy, ready: Vec::new(), numbers: Vec::new() };
        let found: Vec<Option<Pattern>> = parallel::map(polygons.len(), 1024, |i| completion.pattern(i).ok());
        let (mut patterns, mut places) = (Vec::new(), FxHashMap::default());
        let mut number = |pattern| {
            *places.entry(pattern).or_insert_with(|| {
                patterns.push(pattern);
                patterns.len() as u32 - 1
            })
        };
        completion.numbers = found.into_iter().map(|pattern| pattern.map_or(NONE, &mut number)).collect();
        let degrees: BTreeSet<usize> = patterns.iter().map(Pattern::degree).collect();
        let forms: BTreeMap<usize, Form> = parallel::of(degrees, |d| (d, Form::new(energy, d))).into_iter().collect();
        completion.ready = parallel::of(patterns, |own| Ready::new(own, &forms[&own.degree()]));
        completion
    }

    /// What is given of a curve.
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

    /// What is computed once for the curve's pattern.
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
    /// Returns that point, or 0 if there is none. Lengths of directions are found here.
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
            self.set_speeds::<D>(speeds, data.as_chunks_mut().0)?;
        }
        Ok(origin)
    }

    fn set_speeds<const D: usize>(
        &self,
        speeds: &super::directions::Speeds,
        data: &mut [[f64; D]],
    ) -> Result<(), Refusal> {
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

    /// Completes all curves on all threads.
    fn run<const D: usize>(&self, solved: &mut Solved) -> Vec<Outcome> {
        let offsets = self.polygons.offsets;
        let (mut coords, mut energies) = (&mut solved.coords[..], &mut solved.energies[..]);
        let parts: Vec<Part<D>> = tasks(offsets)
            .into_iter()
            .map(|curves| Part {
                completion: self,
                coords: take(&mut coords, (offsets[curves.end] - offsets[curves.start]) * D),
                energies: take(&mut energies, curves.len()),
                curves,
            })
            .collect();
        parallel::of(parts, run).concat()
    }
}

/// Curves one after the other.
struct Part<'a, const D: usize> {
    completion: &'a Completion<'a>,
    curves: std::ops::Range<usize>,
    coords: &'a mut [f64],
    energies: &'a mut [f64],
}

impl<const D: usize> Operation for Part<'_, D> {
    type Output = Vec<Outcome>;

    #[inline(always)]
    fn run(self) -> Vec<Outcome> {
        let Part { completion, curves, coords, energies } = self;
        let (mut points, _) = coords.as_chunks_mut::<D>();
        let mut data = Vec::with_capacity(MOST_DATA * D);
        let mut outcomes = Vec::with_capacity(curves.len());
        for (i, energy) in curves.zip(energies) {
            let own = take(&mut points, completion.polygons.offsets[i + 1] - completion.polygons.offsets[i]);
            outcomes.push(completion.ready(i).and_then(|ready| {
                let origin = completion.gather(i, ready, &mut data)?;
                *energy = ready.complete(data.as_chunks().0, &origin, |place, point| own[place] = point);
                ready.status(own.as_flattened(), *energy)
            }));
        }
        outcomes
    }
}

impl Ready {
    /// The status of a completed curve, or why it is refused.
    #[inline(always)]
    pub fn status(&self, coords: &[f64], energy: f64) -> Outcome {
        match (coords.iter().all(|x| x.is_finite()) && energy.is_finite(), self.is_unique) {
            (false, _) => Err(Refusal::Overflow),
            (true, true) => Ok(CurveStatus::Converged),
            (true, false) => Ok(CurveStatus::NotUnique),
        }
    }
}
