//! Cutting tracks at gaps in time.

use crate::batch::CurveBatch;
use crate::error::{Error, Result};

/// Cuts open curves between points whose parameters are more than `gap` apart.
///
/// The parts of a curve `a` are called `a.1`, `a.2` and so on. Points keep all their values. Closed
/// curves, curves without parameters and curves that cannot be fitted stay whole.
///
/// # Errors
/// - A gap that is not a positive number.
/// - A batch without parameters.
pub fn split(batch: &CurveBatch, gap: f64) -> Result<CurveBatch> {
    if !(gap > 0.0 && gap.is_finite()) {
        return Err(Error::argument(format!("the gap is {gap}; it must be a positive time")));
    }
    let mut parts = Vec::new();
    for i in 0..batch.len() {
        let t = match batch.parameters(i) {
            Some(t) => t,
            None if batch.has_parameters() => {
                parts.push((i, 0..batch.count(i)));
                continue;
            }
            None => {
                let what = "the points have no times to see gaps in: give them parameters, a column t";
                return Err(Error::argument(what));
            }
        };
        let whole = batch.is_closed(i) || batch.problem(i).is_some();
        let ends = (1..t.len()).filter(|&k| !whole && t[k] - t[k - 1] > gap).chain([t.len()]);
        let mut from = 0;
        for to in ends {
            parts.push((i, from..to));
            from = to;
        }
    }
    Ok(batch.parted(&parts))
}
