//! The bounds of the curves that the kernels of a family can search.

use crate::precision::Precision;
use crate::scf::family::{Family, SlopesSearch};
use crate::scf::problem::Ends;

/// The bounds of the kernels of a family.
pub(super) struct Bounds {
    /// The most dots of a curve.
    pub dots: usize,
    /// The most trials per curve and submission.
    pub trials: usize,
    /// The most segments evaluated per submission, over all trials.
    pub evaluations: usize,
    /// The relative decrement that curves can reach in f32, in units of ε.
    pub roundings: f64,
    /// The numbers per dot in `work`.
    pub work_numbers: usize,
}

const WORK_NUMBERS: usize = 8;
const WORK_TAUT_NUMBERS: usize = 11;

/// A tick takes seven loop turns per dot, and llvmpipe silently ends a thread's loops after 65,535
/// turns in total.
///
/// An angle of up to π is rounded by half an ε, and its moment by a few ε more. At an inflection,
/// where the moments of both ends almost cancel, the rounding is several times as large.
pub(super) const PLAIN: Bounds =
    Bounds { dots: 8192, trials: 8, evaluations: 1 << 21, roundings: 32.0, work_numbers: WORK_NUMBERS };

/// A tick takes twelve loop turns per dot, and a curve that asks the host waits for the end of the
/// submission. The host completes the search in f64.
pub(super) const UNDER_TENSION: Bounds =
    Bounds { dots: 4096, trials: 4, evaluations: 1 << 18, roundings: 1024.0, work_numbers: WORK_TAUT_NUMBERS };

/// The smallest weight of plain segments, and the smallest cost of the most expensive one, for
/// which f32 is used. The relevant parts are then still normal numbers.
const LEAST_NARROW: f64 = 1e-18;

/// The largest ν in f32: costs are below (2π)^ν.
const MOST_NARROW: f64 = 32.0;

/// The shortest and the longest chord under tension for which f32 is used, in the unit in which λ
/// is 1.
const NARROW_CHORDS: [f64; 2] = [1e-2, 1e4];

/// The smallest weight under tension for which f32 is used.
///
/// Spans are judged one by one, and dots become movable from the most expensive spans on. A cheap
/// span therefore needs a normal number, but no digits.
const LEAST_WEIGHT: f64 = 1e-30;

/// The bounds of the kernels of a family.
pub(super) fn bounds(family: Family) -> Bounds {
    match family {
        Family::Plain(_) => PLAIN,
        Family::UnderTension(_) => UNDER_TENSION,
    }
}

/// Whether a thread has enough loop turns, and the precision enough range, for a curve.
pub(super) fn is_for_kernel(family: Family, search: &SlopesSearch, precision: Precision) -> bool {
    let fits = (2..=bounds(family).dots).contains(&search.problem.dots());
    // Costs at the start are known only under tension.
    let exists = search.found.iter().all(|found| found.exists > 0.0);
    fits && exists && family.unit(search).is_normal() && (precision == Precision::F64 || is_narrow(family, search))
}

/// Whether f32 has enough range for a curve.
fn is_narrow(family: Family, search: &SlopesSearch) -> bool {
    let problem = &search.problem;
    if let Family::UnderTension(_) = family {
        let (weights, least) = (family.weights(search), LEAST_WEIGHT * family.unit(search));
        let [shortest, longest] = NARROW_CHORDS;
        return (0..problem.spans.len()).all(|k| {
            let is_of_length = (shortest..=longest).contains(&family.units(search, k)[0]);
            family.exponent(search, k) <= MOST_NARROW && is_of_length && weights[k] >= least
        });
    }
    let (mut lightest, mut dearest, mut most, mut bent) = (1.0_f64, 0.0_f64, problem.exponent, false);
    for (k, span) in problem.spans.iter().enumerate().filter(|(_, span)| span.ends != Ends::Straight) {
        let angle = span.angles[0].abs().max(span.angles[1].abs());
        let exponent = family.exponent(search, k);
        lightest = lightest.min(span.weight);
        dearest = dearest.max(span.weight * angle.powf(exponent));
        most = most.max(exponent);
        bent |= angle > 0.0;
    }
    lightest >= LEAST_NARROW && most <= MOST_NARROW && (dearest >= LEAST_NARROW || !bent)
}
