//! [`Ends`] and [`EndCondition`]: conditions at the ends of open splines.
//!
//! [`Ends`] interprets the tangents of a batch. An [`EndCondition`] comes with its numbers.

use super::knots::Knots;
use crate::batch::CurveBatch;

/// The conditions at both ends of an open curve. Closed curves are always periodic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ends {
    /// Clamped at an end whose point has a tangent, natural at the other.
    #[default]
    Auto,
    /// p″ = 0. A curve with tangents is refused.
    Natural,
    /// p′ is the tangent given at both ends; a curve without them is refused.
    Clamped,
}

/// The condition at one end of an open [`Piecewise`](super::Piecewise) spline.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EndCondition<'a> {
    /// The first (last) two spans are one cubic.
    NotAKnot,
    /// The first derivative: a value for each curve and column.
    First(&'a [f64]),
    /// The second derivative, likewise. A natural end has 0.
    Second(&'a [f64]),
}

/// The tangents at the first and the last knot.
pub(super) type Tangents<'a> = [Option<&'a [f64]>; 2];

/// The tangents at the ends of curve `i`, or why it is refused.
pub(super) fn end_tangents<'a>(
    ends: Ends,
    batch: &'a CurveBatch,
    knots: &Knots,
    i: usize,
) -> Result<Tangents<'a>, String> {
    let (n, closed) = (batch.count(i), batch.is_closed(i));
    let last = knots.range(i).len() - 1;
    let mut found: Tangents = [None, None];
    for k in 0..n {
        let Some(tangent) = batch.tangent(i, k) else { continue };
        let knot = knots.entry(i, k);
        let what = match knot {
            _ if closed => "a closed spline is periodic and cannot meet a tangent: leave it out",
            _ if ends == Ends::Natural => "natural ends leave no room for a tangent: leave it out, or clamp the ends",
            0 => {
                found[0].get_or_insert(tangent);
                continue;
            }
            _ if knot == last => {
                found[1].get_or_insert(tangent);
                continue;
            }
            _ => "a cubic spline meets tangents at its two ends only: leave this one out, or split the curve here",
        };
        return Err(batch.sentence(i, k, what));
    }
    if ends == Ends::Clamped && !closed {
        for (end, k) in found.iter().zip([0, n - 1]) {
            if end.is_none() {
                return Err(batch.sentence(
                    i,
                    k,
                    "clamped ends need a tangent here: give one, or let the ends be natural",
                ));
            }
        }
    }
    Ok(found)
}
