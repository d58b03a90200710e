//! Completion and transformation of control polygons on a GPU.
//!
//! f32 loses too many digits of a curve if its magnitudes Σ|entry · datum| are far above its size.
//! The CPU computes such curves again in f64.

use std::collections::BTreeMap;

use super::layout::CurveResults;
use super::{NONE, Product, Products};
use crate::bezier::operator::Operator;
use crate::bezier::polygons::{Controls, Polygons, Solved};
use crate::bezier::prepared::PreparedBatch;
use crate::bezier::ready::{MOST_DATA, Outcome, Ready};
use crate::bezier::refusal::Refusal;
use crate::bounds::Bounds;
use crate::error::Result;
use crate::gpu::{Gpu, kept};
use crate::linalg::{take, tasks};
use crate::parallel;
use crate::precision::Precision;

/// Error of points in f32, in units of half the curve's largest extent.
const POINTS: f64 = 2e-6;

/// Relative error of energies in f32.
const ENERGIES: f64 = 64.0 * f32::EPSILON as f64;

/// The largest error of a sum in f32, in halves of ε of its magnitude.
///
/// Entry, datum and product lose one each, and so does every further term. That bounds the error of
/// up to three terms. With more terms the roundings do not conspire: a test has found 3.4.
pub(super) const ROUNDINGS: f64 = 5.0;

/// Completes all curves.
///
/// In f32 control points are good to 2e-6 of half the curve's largest extent, and energies to 64 ε
/// of themselves. The CPU computes a curve again if the magnitudes that went into it do not promise
/// that.
///
/// # Errors
/// Errors of compiling the kernel and of submissions.
pub(crate) fn complete_on_gpu<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    completion: &PreparedBatch,
    solved: &mut Solved,
) -> Result<Vec<Outcome>> {
    let narrow = precision != Precision::F64;
    let lines: Vec<Option<Line>> = completion
        .ready
        .iter()
        .map(|ready| ready.as_ref().filter(|_| narrow).and_then(|own| Line::of(own, completion)))
        .collect();
    let operators = completion
        .ready
        .iter()
        .map(|ready| ready.as_ref().map(|own| Product { operator: &own.operator, points: own.unknown.len() }))
        .collect();
    let products = Products { gpu, precision, dimension: D, operators, numbers: completion.numbers.clone() };
    let gather = |i: usize, data: &mut Vec<f64>| {
        let number = products.numbers[i] as usize;
        let Some(ready) = &completion.ready[number] else { return false };
        let is_given = completion.gather::<D>(i, ready, data).is_ok();
        if let (Some(line), true) = (&lines[number], is_given) {
            line.take_from(data.as_chunks_mut::<D>().0);
        }
        is_given
    };
    let mut outcomes = Vec::with_capacity(completion.polygons.len());
    let offsets = completion.polygons.offsets;
    let Solved { coords, energies, .. } = solved;
    let (mut coords, mut energies) = (&mut coords[..], &mut energies[..]);
    let done = products.run(&gather, &mut |chunk, found| {
        let parts: Vec<_> = tasks(&offsets[chunk.start..=chunk.end])
            .into_iter()
            .map(|curves| {
                let curves = chunk.start + curves.start..chunk.start + curves.end;
                let points = offsets[curves.end] - offsets[curves.start];
                (take(&mut coords, points * D), take(&mut energies, curves.len()), curves)
            })
            .collect();
        let found = parallel::of(parts, |(coords, energies, curves)| {
            let (mut points, _) = coords.as_chunks_mut::<D>();
            let mut data = Vec::with_capacity(MOST_DATA * D);
            let mut outcomes = Vec::with_capacity(curves.len());
            for (i, energy) in curves.zip(energies) {
                let own = take(&mut points, completion.polygons.count(i));
                outcomes.push(completion.ready(i).and_then(|ready| {
                    if let Some(found) = found.of(i) {
                        *energy = complete(ready, lines[products.numbers[i] as usize].as_ref(), &found, own);
                        let outcome = ready.status(own.as_flattened(), *energy);
                        if outcome.is_ok() && is_precise::<D>(&found, &[own], *energy) {
                            return outcome;
                        }
                    }
                    let origin = completion.gather(i, ready, &mut data)?;
                    *energy = ready.complete(data.as_chunks().0, &origin, |place, point| own[place] = point);
                    ready.status(own.as_flattened(), *energy)
                }));
            }
            outcomes
        });
        outcomes.extend(found.into_iter().flatten());
    });
    kept(done)?;
    outcomes.resize(completion.polygons.len(), Err(Refusal::Lost));
    Ok(outcomes)
}

/// Puts the unknown points in their places. Returns the energy.
#[inline(always)]
fn complete<const D: usize>(ready: &Ready, line: Option<&Line>, found: &CurveResults, own: &mut [[f64; D]]) -> f64 {
    let origin = ready.known.first().map_or([0.0; D], |&first| own[usize::from(first)]);
    let slope = line.map(|line| line.slope::<D>(&std::array::from_fn(|c| own[line.last][c] - origin[c])));
    for (row, &place) in ready.unknown.iter().enumerate() {
        let place = usize::from(place);
        let point = found.point::<D>(row);
        own[place] = match (line, slope) {
            (Some(line), Some(slope)) => {
                let steps = place as f64 - line.first as f64;
                std::array::from_fn(|c| origin[c] + (slope[c] * steps + point[c]))
            }
            _ => std::array::from_fn(|c| point[c] + ready.sums[row] * origin[c]),
        };
    }
    found.energy()
}

/// Whether f32 was precise enough for a curve. f64 always is.
fn is_precise<const D: usize>(found: &CurveResults, points: &[&[[f64; D]]], energy: f64) -> bool {
    let Some(magnitude) = found.magnitude() else { return true };
    let lost = ROUNDINGS * 0.5 * f64::from(f32::EPSILON);
    let extent = points.iter().map(|points| Bounds::of(points.iter().copied()).half_size()).fold(0.0, f64::max);
    // √(Σ (r + δ)²) differs from √(Σ r²) by at most √(Σ δ²).
    let of_energy = found.energy_magnitude().unwrap_or(0.0).sqrt();
    lost * magnitude <= POINTS * extent && 2.0 * lost * of_energy <= ENERGIES * energy.sqrt()
}

/// The line through the first and the last known point, at constant speed.
///
/// An energy without first derivatives does not change if the line is subtracted from the curve. So
/// it is subtracted from the data and added to the result. What is left is smaller and loses less
/// in f32.
struct Line {
    /// The two points' numbers, and the number of the last among the data.
    first: usize,
    last: usize,
    last_datum: usize,
    /// The datum of the line with slope 1, for each datum.
    steps: Vec<f64>,
}

impl Line {
    fn of(ready: &Ready, completion: &PreparedBatch) -> Option<Self> {
        let (&first, &last) = (ready.known.first()?, ready.known.last()?);
        if !ready.is_unique || completion.energy.weights[0] > 0.0 || first == last {
            return None;
        }
        let degree = ready.pattern.degree() as f64;
        let of_points = ready.known.iter().map(|&k| f64::from(k) - f64::from(first));
        let of_derivatives = ready.pattern.derivatives().map(|(_, r)| if r == 1 { degree } else { 0.0 });
        let steps = of_points.chain(of_derivatives).collect();
        Some(Line { first: first.into(), last: last.into(), last_datum: ready.known.len() - 1, steps })
    }

    /// The slope from the last known point relative to the first.
    fn slope<const D: usize>(&self, last: &[f64; D]) -> [f64; D] {
        last.map(|x| x / (self.last - self.first) as f64)
    }

    fn take_from<const D: usize>(&self, data: &mut [[f64; D]]) {
        let slope = self.slope(&data[self.last_datum]);
        for (datum, steps) in data.iter_mut().zip(&self.steps) {
            *datum = std::array::from_fn(|c| datum[c] - slope[c] * steps);
        }
        // Here not even a rounding is left.
        data[self.last_datum] = [0.0; D];
    }
}

/// Applies to every curve the matrix of its number of points, whose rows sum to 1.
///
/// The matrix is applied to the points relative to the first one. A row that is a point itself
/// gives that point bit for bit. Points in f32 are good to 2e-6 of half the largest extent of the
/// points given, or of those made.
///
/// # Errors
/// Errors of [`complete_on_gpu`].
pub(crate) fn transform_on_gpu<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    polygons: &Polygons,
    operators: &BTreeMap<usize, Operator<f64>>,
    made: &mut Controls,
) -> Result<()> {
    let counts: Vec<usize> = operators.keys().copied().collect();
    let number = |i: usize| counts.binary_search(&polygons.count(i)).ok();
    let copies: Vec<Vec<Option<usize>>> = operators.values().map(copies).collect();
    let products = Products {
        gpu,
        precision,
        dimension: D,
        operators: operators.values().map(|operator| Some(Product { operator, points: operator.rows() })).collect(),
        numbers: (0..polygons.len()).map(|i| number(i).map_or(NONE, |number| number as u32)).collect(),
    };
    let gather = |i: usize, data: &mut Vec<f64>| {
        let (points, _) = polygons.points(i).as_chunks::<D>();
        data.clear();
        for point in points {
            for c in 0..D {
                data.push(point[c] - points[0][c]);
            }
        }
        true
    };
    let offsets = &made.offsets;
    let mut coords = &mut made.coords[..];
    products.run(&gather, &mut |chunk, found| {
        let parts: Vec<_> = tasks(&offsets[chunk.start..=chunk.end])
            .into_iter()
            .map(|curves| {
                let curves = chunk.start + curves.start..chunk.start + curves.end;
                (take(&mut coords, (offsets[curves.end] - offsets[curves.start]) * D), curves)
            })
            .collect();
        parallel::of(parts, |(coords, curves)| {
            let (mut points, _) = coords.as_chunks_mut::<D>();
            for i in curves {
                let own = take(&mut points, offsets[i + 1] - offsets[i]);
                let given = polygons.points(i).as_chunks::<D>().0;
                let Some(number) = number(i) else { continue };
                if let Some(found) = found.of(i) {
                    for (row, (point, copy)) in own.iter_mut().zip(&copies[number]).enumerate() {
                        *point = match *copy {
                            Some(copy) => given[copy],
                            None => {
                                let relative = found.point::<D>(row);
                                std::array::from_fn(|c| given[0][c] + relative[c])
                            }
                        };
                    }
                    if is_precise(&found, &[given, own], 0.0) {
                        continue;
                    }
                }
                operators[&polygons.count(i)].apply::<D>(given, |row, point| own[row] = point);
            }
        });
    })?;
    Ok(())
}

/// For each row the column whose point it copies, if it copies one.
fn copies(operator: &Operator<f64>) -> Vec<Option<usize>> {
    let columns = operator.columns();
    let copy = |row: usize| {
        let column = (0..columns).find(|&j| operator.at(row, j) != 0.0)?;
        let others = (column + 1..columns).all(|j| operator.at(row, j) == 0.0);
        (operator.at(row, column) == 1.0 && others).then_some(column)
    };
    (0..operator.rows()).map(copy).collect()
}
