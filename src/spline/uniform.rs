//! Natural cubic splines on the integers: the bounded-domain subdivision system of Warren & Weimer,
//! chapter 6.
//!
//! A spline is given by its *coefficients* p⁰, one point an integer. Three matrices make up the
//! system:
//!
//! * **N**, rows 1/6 2/3 1/6, unit rows at the ends: N p⁰ are the spline's [values](interpolated)
//!   on the integers, and p⁰ = N⁻¹ b the [`coefficients`] that interpolate b.
//! * **S**, which keeps the ends, turns an interior point into ⅛ ¾ ⅛ and sets a new point ½ ½
//!   between two: [`subdivide`]. p^k = S p^{k−1} converges to the spline.
//! * **E_k = 8^k E_0**, E_0 with rows 1 −2 1, −2 5 −4 1, 1 −4 6 −4 1 …: p_kᵀE_k p_k are the
//!   [discrete energies](discrete_energies) and p⁰ᵀE_0 N p⁰ the [exact energy](exact_energies)
//!   ∫|p″|² dt of the limit.
//!
//! They fit together by 8 E S = U E, U inserting zeros, and so E_k = E_∞ + 4^{−k}(E_0 − E_∞) for
//! the energies of any p⁰. Closed curves use the same rows cyclically. Every coordinate of every
//! curve is treated alike; parameters and weights of a batch play no part here, since the knots are
//! the integers. For knots of their own see [`Natural`](super::Natural) and
//! [`Smoothing`](super::Smoothing).
//!
//! A curve that holds a NaN spoils only itself: its results are NaN.

use super::energy::{discrete_energy, exact_product};
use super::subdivide::subdivide_rounds;
use super::uniform_gpu::{self, Operation};
use crate::batch::CurveBatch;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch, take};
use crate::parallel;

/// Points that [`subdivide`] writes at most, over all curves: 1.6 GB in two dimensions.
pub const MAX_POINTS: u64 = 100_000_000;

/// Rounds that [`subdivide`] and [`discrete_energies`] accept at most; steps of 2⁻⁴⁸ are below the
/// resolution of any curve.
pub const MAX_ROUNDS: u32 = 48;

/// The coefficients p⁰ = N⁻¹ b whose spline takes the batch's points as values on the integers.
///
/// One tridiagonal system a curve (cyclic for closed curves), one right-hand side a coordinate. N
/// is diagonally dominant with condition number 3 at most, so the coefficients are good to a few
/// units of the last place of the curve's largest coordinate. A curve that has a
/// [`problem`](CurveBatch::problem) keeps its points.
///
/// ```
/// use faircurve::{CurveBatch, Device, spline::uniform};
/// let values = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 4.0], [2.0, 0.0]][..]])?;
/// let coefficients = uniform::coefficients(&values, &Device::cpu())?;
/// assert!((coefficients.points(0)[3] - 6.0).abs() < 1e-15); // (4 − 0/6 − 0/6) · 3/2
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// A batch with constraints, which this system cannot honour.
pub fn coefficients(values: &CurveBatch, device: &Device) -> Result<CurveBatch> {
    refuse_constraints(values)?;
    let Some(gpu) = device.as_gpu() else { return coefficients_on_cpu(values) };
    let mut coords = on_gpu(gpu, device, values, Operation::Coefficients, values.offsets())?;
    keep_points_of_problems(values, &mut coords);
    Ok(values.with_points(coords, values.offsets().to_vec()))
}

/// The values N p⁰ of the splines on the integers: the inverse of [`coefficients`], and the way
/// from the coefficients of any round of [`subdivide`] to points of the curve, at steps of 2^−k.
///
/// # Errors
/// A batch with constraints.
pub fn interpolated(coefficients: &CurveBatch, device: &Device) -> Result<CurveBatch> {
    refuse_constraints(coefficients)?;
    let Some(gpu) = device.as_gpu() else { return Ok(interpolated_on_cpu(coefficients)) };
    let coords = on_gpu(gpu, device, coefficients, Operation::Interpolated, coefficients.offsets())?;
    Ok(coefficients.with_points(coords, coefficients.offsets().to_vec()))
}

/// The coefficients p^k = S^k p⁰ after `rounds` rounds: n points become (n − 1)·2^k + 1, of a
/// closed curve n·2^k.
///
/// Point i of the result belongs to the parameter i/2^k. The points converge to the curve like
/// 4^−k; N p^k, from [`interpolated`], lies on it.
///
/// # Errors
/// More than [`MAX_ROUNDS`] rounds or more than [`MAX_POINTS`] points; a batch with constraints.
pub fn subdivide(coefficients: &CurveBatch, rounds: u32, device: &Device) -> Result<CurveBatch> {
    refuse_constraints(coefficients)?;
    let offsets = refined_offsets(coefficients, rounds)?;
    let Some(gpu) = device.as_gpu() else { return Ok(subdivide_on_cpu(coefficients, rounds, offsets)) };
    let coords = on_gpu(gpu, device, coefficients, Operation::Subdivide(rounds), &offsets)?;
    Ok(coefficients.with_points(coords, offsets))
}

/// The discrete energies p_kᵀE_k p_k = 8^k Σ|Δ²p_k|² of curves that went through `round` rounds of
/// [`subdivide`], one a curve, summed over the coordinates. Units: length² (the parameter has
/// none).
///
/// Differences of nearby points are taken, so the relative rounding error grows as 4^k ε;
/// [`exact_energies`] of p⁰ is the limit without that loss.
///
/// # Errors
/// More than [`MAX_ROUNDS`] rounds; a batch with constraints.
pub fn discrete_energies(coefficients: &CurveBatch, round: u32, device: &Device) -> Result<Vec<f64>> {
    refuse_constraints(coefficients)?;
    expect_rounds(round)?;
    let Some(gpu) = device.as_gpu() else { return Ok(discrete_energies_on_cpu(coefficients, round)) };
    let mut energies = on_gpu(gpu, device, coefficients, Operation::DiscreteEnergy, coefficients.offsets())?;
    energies.iter_mut().for_each(|energy| *energy *= 8_f64.powi(round as i32));
    Ok(energies)
}

/// The energies ∫|p″|² dt = p⁰ᵀE_0 N p⁰ of the splines with these coefficients, one a curve, summed
/// over the coordinates.
///
/// # Errors
/// A batch with constraints.
pub fn exact_energies(coefficients: &CurveBatch, device: &Device) -> Result<Vec<f64>> {
    inner_products(coefficients, coefficients, device)
}

/// The inner products ∫p″·q″ dt = p⁰ᵀE_0 N q⁰ of the splines with these coefficients, curve by
/// curve, summed over the coordinates. Symmetric in p and q to the last bit.
///
/// # Errors
/// Batches that differ in the number of curves, their dimension, their points or their closedness;
/// a batch with constraints.
pub fn inner_products(p: &CurveBatch, q: &CurveBatch, device: &Device) -> Result<Vec<f64>> {
    refuse_constraints(p)?;
    refuse_constraints(q)?;
    expect_same_shape(p, q)?;
    let Some(gpu) = device.as_gpu() else { return Ok(inner_products_on_cpu(p, q)) };
    on_gpu(gpu, device, p, Operation::ExactProduct(q), p.offsets())
}

/// N is diagonally dominant, so f32 serves for points where nothing else is asked for; energies are
/// made of differences of nearby points, which cancel: they take f64 where the adapter has it.
fn on_gpu(gpu: &Gpu, device: &Device, batch: &CurveBatch, operation: Operation, offsets: &[usize]) -> Result<Vec<f64>> {
    uniform_gpu::run(gpu, device.kernel_precision(gpu, !operation.is_energy())?, batch, operation, offsets)
}

/// The systems of [`coefficients`], rows 1 4 1 for the right-hand side 6 b: lower band, diagonal,
/// upper band, right-hand side.
fn interpolation_systems(values: &CurveBatch) -> [Vec<f64>; 4] {
    let d = values.dimension();
    let total = values.total_points();
    let (mut beside, mut diagonal, mut rhs) = (vec![1.0; total], vec![4.0; total], values.coords().to_vec());
    rhs.iter_mut().for_each(|x| *x *= 6.0);
    for i in (0..values.len()).filter(|&i| !values.is_closed(i) && values.count(i) > 0) {
        for end in [values.offsets()[i], values.offsets()[i + 1] - 1] {
            (beside[end], diagonal[end]) = (0.0, 1.0);
            rhs[end * d..(end + 1) * d].copy_from_slice(&values.coords()[end * d..(end + 1) * d]);
        }
    }
    [beside.clone(), diagonal, beside, rhs]
}

/// [`coefficients`] on all threads of the CPU.
fn coefficients_on_cpu(values: &CurveBatch) -> Result<CurveBatch> {
    let [lower, diagonal, upper, rhs] = interpolation_systems(values);
    let closed: Vec<bool> = (0..values.len()).map(|i| values.is_closed(i)).collect();
    let systems = TridiagonalBatch {
        matrix: Matrix::Bands { lower: &lower, diagonal: &diagonal, upper: &upper },
        offsets: values.offsets(),
        cyclic: Cyclic::Each(&closed),
    };
    let mut coords = solve_tridiagonal_batch(&systems, &rhs, values.dimension(), &Device::cpu())?.x;
    keep_points_of_problems(values, &mut coords);
    Ok(values.with_points(coords, values.offsets().to_vec()))
}

fn keep_points_of_problems(values: &CurveBatch, coords: &mut [f64]) {
    for i in (0..values.len()).filter(|&i| values.problem(i).is_some()) {
        let range = values.offsets()[i] * values.dimension()..values.offsets()[i + 1] * values.dimension();
        coords[range].copy_from_slice(values.points(i));
    }
}

/// [`interpolated`] on all threads of the CPU.
fn interpolated_on_cpu(coefficients: &CurveBatch) -> CurveBatch {
    let d = coefficients.dimension();
    let mut coords = vec![0.0; coefficients.coords().len()];
    parallel::of(per_curve(coefficients.offsets(), d, &mut coords).into_iter().enumerate(), |(i, values)| {
        let (p, closed) = (coefficients.points(i), coefficients.is_closed(i));
        let count = p.len() / d;
        for k in 0..count {
            let end = !closed && (k == 0 || k + 1 == count);
            let previous = if k == 0 { count - 1 } else { k - 1 };
            let next = if k + 1 == count { 0 } else { k + 1 };
            for axis in 0..d {
                let at = |k: usize| p[k * d + axis];
                values[k * d + axis] = if end { at(k) } else { (4.0 * at(k) + (at(previous) + at(next))) / 6.0 };
            }
        }
    });
    coefficients.with_points(coords, coefficients.offsets().to_vec())
}

/// [`subdivide`] on all threads of the CPU.
fn subdivide_on_cpu(coefficients: &CurveBatch, rounds: u32, offsets: Vec<usize>) -> CurveBatch {
    let d = coefficients.dimension();
    let mut coords = vec![0.0; offsets[coefficients.len()] * d];
    parallel::of(per_curve(&offsets, d, &mut coords).into_iter().enumerate(), |(i, fine)| {
        subdivide_rounds(coefficients.points(i), fine, &mut Vec::new(), d, coefficients.is_closed(i), rounds);
    });
    coefficients.with_points(coords, offsets)
}

/// [`discrete_energies`] on all threads of the CPU.
fn discrete_energies_on_cpu(coefficients: &CurveBatch, round: u32) -> Vec<f64> {
    let scale = 8_f64.powi(round as i32);
    let energy = |i| discrete_energy(coefficients.points(i), coefficients.dimension(), coefficients.is_closed(i));
    parallel::map(coefficients.len(), 1, |i| scale * energy(i))
}

/// [`inner_products`] on all threads of the CPU.
fn inner_products_on_cpu(p: &CurveBatch, q: &CurveBatch) -> Vec<f64> {
    let product = |i| exact_product(p.points(i), q.points(i), p.dimension(), p.is_closed(i));
    parallel::map(p.len(), 1, product)
}

/// Cuts flat coordinates into one slice a curve.
fn per_curve<'a>(offsets: &[usize], dimension: usize, mut coords: &'a mut [f64]) -> Vec<&'a mut [f64]> {
    offsets.windows(2).map(|pair| take(&mut coords, (pair[1] - pair[0]) * dimension)).collect()
}

/// First point of every curve after `rounds` rounds, once it is clear that they fit.
fn refined_offsets(batch: &CurveBatch, rounds: u32) -> Result<Vec<usize>> {
    expect_rounds(rounds)?;
    let mut offsets = Vec::with_capacity(batch.len() + 1);
    let (mut total, mut coarse_total) = (0_u128, 0);
    offsets.push(0);
    for i in 0..batch.len() {
        let (count, spans) = (batch.count(i) as u128, batch.spans(i) as u128);
        total += count - spans + (spans << rounds);
        coarse_total += spans;
        offsets.push(usize::try_from(total).unwrap_or(usize::MAX));
    }
    if total <= u128::from(MAX_POINTS) {
        return Ok(offsets);
    }
    let fits = (0..rounds).rev().find(|&k| (coarse_total << k) + batch.len() as u128 <= u128::from(MAX_POINTS));
    let remedy = match fits {
        Some(k) => format!("use {k} rounds at most, or fewer curves at a time"),
        None => "use fewer curves at a time".into(),
    };
    Err(Error::argument(format!(
        "{rounds} rounds of subdivision would make {total} points, more than {MAX_POINTS}: {remedy}"
    )))
}

fn expect_rounds(rounds: u32) -> Result<()> {
    if rounds <= MAX_ROUNDS {
        return Ok(());
    }
    Err(Error::argument(format!(
        "{rounds} rounds of subdivision were asked for; {MAX_ROUNDS} at most are possible, and 10 make any curve smooth"
    )))
}

fn refuse_constraints(batch: &CurveBatch) -> Result<()> {
    batch.allows(&[], "splines on the integers")
}

fn expect_same_shape(p: &CurveBatch, q: &CurveBatch) -> Result<()> {
    let differ = |what: String| Err(Error::argument(format!("inner products pair curves of equal shape, but {what}")));
    if p.len() != q.len() {
        return differ(format!("one batch has {} curves and the other {}", p.len(), q.len()));
    }
    if p.dimension() != q.dimension() {
        return differ(format!("one batch is {}-D and the other {}-D", p.dimension(), q.dimension()));
    }
    for i in 0..p.len() {
        if p.count(i) != q.count(i) {
            return differ(format!(
                "curve {} has {} points in one batch and {} in the other",
                p.label(i),
                p.count(i),
                q.count(i)
            ));
        }
        if p.is_closed(i) != q.is_closed(i) {
            return differ(format!("curve {} is closed in one batch and open in the other", p.label(i)));
        }
    }
    Ok(())
}
