//! Smoothing splines in time of columns of tracks.

use crate::batch::{Column, CurveBatch, Values};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::spline::{Parametrisation, Smoothing, SmoothingTarget};

/// The column of elevations of GPX files.
pub const ELEVATION: &str = "ele";

/// The batch with the numbers of a column in place of their smoothing splines in time, which
/// [`sample`](super::sample) interpolates smoothly.
///
/// Each curve has its spline. `target` is in units of the column. Blanks stay blank, and so do
/// curves with fewer than two numbers. Closed curves are smoothed from their first point to their last.
///
/// # Errors
/// - A column that does not exist, or holds texts or angles.
/// - A batch without parameters.
/// - The errors of [`Smoothing::fit`].
pub fn smooth_column(batch: &CurveBatch, name: &str, target: SmoothingTarget) -> Result<CurveBatch> {
    let mut columns = batch.columns().to_vec();
    let own = columns.iter_mut().find(|column| column.name == name);
    let Some(Column { values: values @ (Values::Numbers(_) | Values::Smooth(_)), .. }) = own else {
        return Err(Error::argument(format!("there is no column {name} of numbers to smooth")));
    };
    let mut numbers = values.numbers().unwrap_or_default().to_vec();
    if !batch.has_parameters() && batch.total_points() > 0 {
        return Err(Error::argument(format!("column {name} is smoothed in time, and the points have no times")));
    }
    // The rows of every curve with two numbers or more, at different times.
    let (mut rows, mut t, mut offsets) = (Vec::new(), Vec::new(), vec![0]);
    for i in 0..batch.len() {
        let Some(times) = batch.parameters(i).filter(|times| times.is_sorted()) else { continue };
        let first = batch.offsets()[i];
        let own: Vec<usize> = (0..times.len()).filter(|&k| numbers[first + k].is_finite()).collect();
        if own.first().zip(own.last()).is_some_and(|(&a, &b)| times[a] < times[b]) {
            t.extend(own.iter().map(|&k| times[k]));
            rows.extend(own.iter().map(|&k| first + k));
            offsets.push(rows.len());
        }
    }
    let coords = rows.iter().flat_map(|&row| [numbers[row], 0.0]).collect();
    let heights = CurveBatch::from_ragged(2, coords, offsets.clone())?.with_parameters(t)?;
    let smoothing = Smoothing { target, pin_ends: false, parametrisation: Parametrisation::Given };
    let fit = smoothing.fit(&heights, &Device::cpu())?;
    for (i, ends) in offsets.windows(2).enumerate().filter(|(i, _)| fit.reports()[*i].status.is_usable()) {
        let curve = fit.curve(i);
        for (k, &row) in rows[ends[0]..ends[1]].iter().enumerate() {
            let span = k.min(curve.spans() - 1);
            numbers[row] = curve.jet(span, if k > span { 1.0 } else { 0.0 }).point.x;
        }
    }
    *values = Values::Smooth(numbers);
    batch.clone().with_columns(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_smoothed_in_time_and_blanks_stay() {
        let n = 60;
        let noise = |k: usize| if k.is_multiple_of(2) { 2.0 } else { -2.0 };
        let mut heights: Vec<f64> = (0..n).map(|k| (k as f64 / 9.0).sin() * 20.0 + noise(k)).collect();
        heights[7] = f64::NAN;
        let columns = |values: Values| vec![Column { name: "ele".into(), values }];
        let points: Vec<[f64; 2]> = (0..n).map(|k| [k as f64, 0.0]).collect();
        // The second curve has one number, and the third none.
        let (pair, blanks) = ([[0.0, 0.0], [1.0, 0.0]], [5.0, f64::NAN, f64::NAN, f64::NAN]);
        let batch = CurveBatch::from_slices(&[&points[..], &pair, &pair]).unwrap();
        let t = (0..n).chain(0..2).chain(0..2).map(|k| k as f64).collect();
        let all: Vec<f64> = heights.iter().copied().chain(blanks).collect();
        let timed = batch.clone().with_parameters(t).unwrap();
        let timed = timed.with_columns(columns(Values::Numbers(all.clone()))).unwrap();
        for (target, most) in [(SmoothingTarget::CrossValidation, 4.0), (SmoothingTarget::Tube(3.0.into()), 3.0)] {
            let smooth = smooth_column(&timed, "ele", target).unwrap();
            let Values::Smooth(own) = &smooth.columns()[0].values else { panic!("smooth numbers") };
            assert!(own[7].is_nan() && own[n] == 5.0 && own[n + 1..].iter().all(|x| x.is_nan()), "{own:?}");
            let climb = |own: &[f64]| own.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).sum::<f64>();
            assert!(climb(&own[..n]) < 0.8 * climb(&heights), "{own:?}");
            let off = (0..n).map(|k| (own[k] - all[k]).abs()).fold(0.0, f64::max);
            assert!(off <= most * (1.0 + 1e-9), "{off}");
        }
        let refuse = |batch: &CurveBatch, name: &str| {
            smooth_column(batch, name, SmoothingTarget::CrossValidation).unwrap_err().to_string()
        };
        assert!(refuse(&timed, "hr").contains("there is no column hr of numbers"));
        let untimed = batch.with_columns(columns(Values::Numbers(all))).unwrap();
        assert!(refuse(&untimed, "ele").contains("the points have no times"));
    }
}
