//! Costs and derivatives of many segments at once.

use super::evaluation::Evaluation;
use super::gpu::evaluate_on_gpu;
use super::universal::Universal;
use super::workspace::evaluate_all;
use crate::device::Device;
use crate::error::{Error, Result};

/// A segment asked for: a chord, the angles of the two end tangents from it, and ν.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Length of the chord, > 0.
    pub chord: f64,
    /// Angles of the tangents at both ends from the chord, in radians from −π to π.
    pub angles: [f64; 2],
    /// ν > 1
    pub exponent: f64,
}

/// What a segment costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// ∫|κ|^ν ds
    pub cost: f64,
    /// Derivatives in the angles of the first and of the last tangent: −ν and ν times the bending
    /// moments |κ|^{ν−1} sgn κ there.
    pub gradient: [f64; 2],
    /// Second derivatives: in the first angle, in both, in the last.
    pub hessian: [f64; 3],
}

/// The cost of the cheapest segment for every query, with its derivatives; `None` where there is no
/// minimiser.
///
/// Relative errors of costs are about 1e-13 in f64; of segments that hardly turn, second
/// derivatives are good to ε/turning². The universal curve of every exponent asked for is computed
/// once: many segments of few exponents are fastest, several million a second on two cores. On a
/// GPU segments of all exponents are evaluated together, in f64 where the adapter has it; in f32,
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
/// A chord that is not positive, an angle beyond ±π, an exponent that is not above 1, or what is
/// not finite, with the number of the query; on a GPU what becomes of submissions.
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

/// From the unit chord to the query's own.
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
