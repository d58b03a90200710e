//! [`evaluate_segments`]: costs and derivatives of many segments at once.

use super::evaluation::Evaluation;
use super::gpu::evaluate_on_gpu;
use super::universal::Universal;
use super::workspace::evaluate_all;
use crate::device::Device;
use crate::error::{Error, Result};

/// A query for a segment: its chord, the angles of both end tangents from the chord, and ν.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// The length of the chord, positive.
    pub chord: f64,
    /// The angles of the tangents at both ends from the chord, in radians from −π to π.
    pub angles: [f64; 2],
    /// ν > 1
    pub exponent: f64,
}

/// The cost of a segment, with its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// ∫|κ|^ν ds
    pub cost: f64,
    /// The derivatives by the angles of the first and the last tangent: −ν and ν times the bending
    /// moments
    /// |κ|^{ν−1} sgn κ there.
    pub gradient: [f64; 2],
    /// The second derivatives: by the first angle, by both, by the last.
    pub hessian: [f64; 3],
}

/// The cost of the cheapest segment for every query, with its derivatives. `None` if there is no
/// minimiser.
///
/// Relative errors of costs are about 1e-13 in f64. For segments that hardly turn, second
/// derivatives have an error of ε/turning². The universal curve of each exponent is computed once,
/// so many segments of few exponents are fastest: several million per second on two cores. On a GPU
/// the segments of all exponents are evaluated together, in f64 if the adapter supports it. In f32,
/// costs of unit chord below 1.2e-38 count as 0.
///
/// ```
/// use faircurve::{Device, scf};
///
/// // Both ends perpendicular to the chord: (2π/ϖ)², ϖ the lemniscate constant.
/// let query = scf::Query { chord: 1.0, angles: [1.570796326794896, -1.570796326794896], exponent: 2.0 };
/// let cost = scf::evaluate_segments(&[query], &Device::cpu())?[0].unwrap();
/// assert!((cost.cost - 5.742160088369037).abs() < 1e-12);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// A chord that is not positive, an angle beyond ±π, an exponent that is not above 1, or a number
/// that is not finite. The error contains the index of the query. On a GPU, errors of submissions.
pub fn evaluate_segments(queries: &[Query], device: &Device) -> Result<Vec<Option<Cost>>> {
    for (number, query) in queries.iter().enumerate() {
        check(number, query)?;
    }
    let mut order: Vec<u32> = (0..queries.len() as u32).collect();
    order.sort_by(|&i, &j| queries[i as usize].exponent.total_cmp(&queries[j as usize].exponent));
    let same = || order.chunk_by(|&i, &j| queries[i as usize].exponent == queries[j as usize].exponent);
    let curves: Vec<Universal> = same().map(|same| Universal::new(queries[same[0] as usize].exponent)).collect();
    let mut found = vec![Evaluation::missing(); queries.len()];
    if let Some(gpu) = device.as_gpu() {
        let precision = device.kernel_precision(gpu, false)?;
        let of_same = |(number, same): (usize, &[u32])| -> Vec<(u32, [f64; 2])> {
            same.iter().map(|&i| (number as u32, queries[i as usize].angles)).collect()
        };
        let segments: Vec<(u32, [f64; 2])> = same().enumerate().flat_map(of_same).collect();
        found = evaluate_on_gpu(gpu, precision, &curves, &segments)?;
    } else {
        let mut rest = &mut found[..];
        for (curve, same) in curves.iter().zip(same()) {
            let angles: Vec<[f64; 2]> = same.iter().map(|&i| queries[i as usize].angles).collect();
            let (part, others) = rest.split_at_mut(same.len());
            evaluate_all(curve, false, &angles, part);
            rest = others;
        }
    }
    let mut costs = vec![None; queries.len()];
    for (&i, found) in order.iter().zip(&found) {
        costs[i as usize] = scaled(found, &queries[i as usize]);
    }
    Ok(costs)
}

/// Scales from the unit chord to the query's chord.
fn scaled(found: &Evaluation<f64>, query: &Query) -> Option<Cost> {
    let weight = query.chord.powf(1.0 - query.exponent);
    (found.exists > 0.0).then(|| Cost {
        cost: weight * found.cost,
        gradient: found.gradient.map(|x| weight * x),
        hessian: found.hessian.map(|x| weight * x),
    })
}

fn check(number: usize, query: &Query) -> Result<()> {
    let Query { chord, angles, exponent } = *query;
    let refuse = |why: String| Err(Error::argument(format!("segment {number}: {why}")));
    if !(chord > 0.0 && chord.is_finite()) {
        return refuse(format!("the chord is {chord} long; it must be a positive number"));
    }
    if !(exponent > 1.0 && exponent.is_finite()) {
        return refuse(format!("the exponent is {exponent}; it must be above 1, such as 2"));
    }
    match angles.into_iter().find(|angle| angle.is_nan() || angle.abs() > std::f64::consts::PI) {
        Some(angle) => {
            refuse(format!("an end tangent is at {angle} radians from the chord; angles from −π to π are possible"))
        }
        None => Ok(()),
    }
}
