//! Columns between data points.

use crate::batch::{Column, CurveBatch, Values, turned, way_round};

/// The columns of a batch, without entries.
pub(super) fn empty(batch: &CurveBatch) -> Vec<Column> {
    let of = |column: &Column| Column { name: column.name.clone(), values: column.values.gather(&[]) };
    batch.columns().iter().map(of).collect()
}

/// Appends the columns at sites along curve `i`, whose points have these times.
pub(super) fn push(batch: &CurveBatch, i: usize, knots: &[f64], sites: &[(usize, f64)], columns: &mut [Column]) {
    let count = batch.count(i);
    let entries = Entries { batch, i, knots };
    for (column, all) in columns.iter_mut().zip(batch.columns()) {
        match (&mut column.values, &all.values) {
            // Curves without points have samples too.
            (Values::Texts(out), _) if count == 0 => out.extend(sites.iter().map(|_| String::new())),
            (values, _) if count == 0 => {
                values.numbers_mut().into_iter().for_each(|out| out.extend(sites.iter().map(|_| f64::NAN)));
            }
            (Values::Smooth(out) | Values::SmoothAngles(out), all) => {
                out.extend(sites.iter().map(|&(span, u)| entries.smooth(all, span, u)));
            }
            (values, all) => {
                sites.iter().for_each(|&(span, u)| values.push_between(all, entries.ends(span), u));
            }
        }
    }
}

/// The entries along a curve with points.
struct Entries<'a> {
    batch: &'a CurveBatch,
    i: usize,
    knots: &'a [f64],
}

/// The time and the change of a span.
#[derive(Clone, Copy)]
struct Step {
    time: f64,
    change: f64,
}

impl Entries<'_> {
    /// The entries at both ends of a span.
    fn ends(&self, span: usize) -> [usize; 2] {
        [span, span + 1].map(|k| self.batch.offsets()[self.i] + k % self.batch.count(self.i))
    }

    fn numbers(&self, values: &Values, span: usize) -> [f64; 2] {
        self.ends(span).map(|k| values.numbers().map_or(f64::NAN, |numbers| numbers[k]))
    }

    /// The step of a span. `None` beyond the ends, in no time and next to blanks.
    fn step(&self, values: &Values, span: isize) -> Option<Step> {
        let spans = self.knots.len() as isize - 1;
        let span = if self.batch.is_closed(self.i) { span.rem_euclid(spans.max(1)) } else { span };
        let span = usize::try_from(span).ok().filter(|_| span < spans)?;
        let [a, b] = self.numbers(values, span);
        let change = if values.are_angles() { way_round(a, b)? } else { b - a };
        let time = self.knots[span + 1] - self.knots[span];
        (time > 0.0 && change.is_finite()).then_some(Step { time, change })
    }

    /// The monotone cubic at the fraction `u` of a span. Spans without a step are linear.
    fn smooth(&self, values: &Values, span: usize, u: f64) -> f64 {
        let steps = [-1, 0, 1].map(|away| self.step(values, span as isize + away));
        let (true, [before, Some(own), after]) = (u > 0.0 && u < 1.0, steps) else {
            return values.between(self.ends(span), u);
        };
        let [start, end] = [slope(own, before, after), slope(own, after, before)].map(|slope| slope * own.time);
        let (v, w) = (1.0 - u, u * u * (3.0 - 2.0 * u));
        let change = w * own.change + u * v * (v * start - u * end);
        let [a, b] = self.numbers(values, span);
        if values.are_angles() { turned(a, b, change) } else { a + change }
    }
}

/// The slope of a step at one of its ends: the harmonic mean of Fritsch and Butland with the step on the
/// other side. At an end of the data it is the slope of a parabola through this step and the one `beyond`
/// it.
fn slope(own: Step, other: Option<Step>, beyond: Option<Step>) -> f64 {
    let rate = |step: Step| step.change / step.time;
    let mean = rate(own);
    match (other, beyond) {
        (Some(other), _) if mean * rate(other) <= 0.0 => 0.0,
        (Some(other), _) => {
            let (to_own, to_other) = (own.time + 2.0 * other.time, 2.0 * own.time + other.time);
            (to_own + to_other) / (to_own / mean + to_other / rate(other))
        }
        (None, Some(next)) => {
            let slope = ((2.0 * own.time + next.time) * mean - own.time * rate(next)) / (own.time + next.time);
            match slope * mean <= 0.0 {
                true => 0.0,
                false if mean * rate(next) <= 0.0 => slope.clamp(-3.0 * mean.abs(), 3.0 * mean.abs()),
                false => slope,
            }
        }
        (None, None) => mean,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{At, sample};
    use super::*;
    use crate::Device;
    use crate::spline::Natural;

    /// The values of a column at some times, of points 0, 1, 2 … on a line at `t`.
    fn sampled(t: &[f64], values: Values, closed: Option<f64>, at: &[f64]) -> Vec<f64> {
        let points: Vec<[f64; 2]> = (0..t.len()).map(|k| [k as f64, (k * k) as f64]).collect();
        let mut batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(t.to_vec()).unwrap();
        if let Some(length) = closed {
            batch = batch.closed(true).with_closing_spans(vec![length]).unwrap();
        }
        let batch = batch.with_columns(vec![Column { name: "a".into(), values }]).unwrap();
        let fit = Natural::default().fit(&batch, &Device::cpu()).unwrap();
        let samples = sample(&batch, &fit, &At::Times(&[at.to_vec()]), &[]).unwrap();
        samples.columns()[0].values.numbers().unwrap().to_vec()
    }

    fn assert_close(own: &[f64], expected: &[f64]) {
        assert!(own.len() == expected.len(), "{own:?}");
        assert!(own.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13), "{own:?} {expected:?}");
    }

    const T: [f64; 7] = [0.0, 1.0, 2.5, 3.0, 5.0, 6.0, 8.0];
    const Y: [f64; 7] = [1.0, 4.0, 3.0, 3.0, 7.0, 7.5, -2.0];
    const AT: [f64; 9] = [0.25, 0.9, 1.5, 2.75, 3.5, 4.5, 5.75, 6.5, 7.75];

    /// What SciPy's PchipInterpolator gives.
    const PCHIP: [f64; 9] = [
        2.0968750000000003,
        3.9562,
        3.7407407407407405,
        3.0,
        3.5546875,
        6.1640625,
        7.45703125,
        6.7890625,
        -0.0126953125,
    ];

    #[test]
    fn smooth_columns_are_those_of_scipys_pchip() {
        assert_close(&sampled(&T, Values::Smooth(Y.to_vec()), None, &AT), &PCHIP);
        assert_close(&sampled(&T, Values::Smooth(Y.to_vec()), None, &T), &Y);
        assert_close(&sampled(&[0.0, 2.0], Values::Smooth(vec![1.0, 5.0]), None, &[0.5]), &[2.0]);
        // Angles are the same, turned: 350 is 0 here.
        let turned: Vec<f64> = Y.iter().map(|y| (350.0 + 10.0 * y) % 360.0).collect();
        let expected: Vec<f64> = PCHIP.iter().map(|y| (350.0 + 10.0 * y) % 360.0).collect();
        assert_close(&sampled(&T, Values::SmoothAngles(turned), None, &AT), &expected);
    }

    #[test]
    fn smooth_columns_go_on_beside_blanks_and_round_closed_curves() {
        let mut blank = Y.to_vec();
        blank[3] = f64::NAN;
        let own = sampled(&T, Values::Smooth(blank), None, &AT);
        assert!(own[3].is_nan() && own[4].is_nan() && own[5].is_nan() && own[6].is_finite(), "{own:?}");
        assert_close(&own[..2], &PCHIP[..2]);
        // A closed curve is one period of an open one.
        let period = 9.5;
        let at = [0.25, 0.9, 7.75, 8.5, 9.25];
        let own = sampled(&T, Values::Smooth(Y.to_vec()), Some(period - T[6]), &at);
        let thrice = |values: &[f64], step: f64| -> Vec<f64> {
            (0..3).flat_map(|n| values.iter().map(move |x| x + step * f64::from(n))).collect()
        };
        let at: Vec<f64> = at.iter().map(|t| t + period).collect();
        assert_close(&own, &sampled(&thrice(&T, period), Values::Smooth(thrice(&Y, 0.0)), None, &at));
    }
}
