//! Quantities along a curve as small charts, for the page of a report.

use faircurve::tracks::{self, At, Quantity};
use faircurve::{CurveBatch, Fit, Sampling, Values};

const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 60.0;

/// The charts of curve `i`: its curvature and its distance from the data points by arc length, its speed if it
/// has times, and the speed of a drive by time, which `curves`, what is written, has.
pub fn charts(batch: &CurveBatch, fit: &Fit, curves: &CurveBatch, i: usize) -> String {
    let (own, of_own) = (batch.select(&[i]), fit.select(&[i]));
    let mut quantities = vec![Quantity::Arclength, Quantity::Curvature];
    quantities.extend(own.parameters(0).map(|_| Quantity::Speed));
    let along = At::Along(Sampling::PerSpan(8));
    let own = own.with_columns(vec![]).expect("no columns have no length");
    let Ok(samples) = tracks::sample(&own, &of_own, &along, &quantities) else { return String::new() };
    let column = |batch: &CurveBatch, i: usize, name: &str| -> Option<Vec<f64>> {
        let column = batch.columns().iter().find(|column| column.name == name)?;
        let rows = batch.offsets()[i]..batch.offsets()[i + 1];
        if let Values::Numbers(numbers) = &column.values { Some(numbers[rows].to_vec()) } else { None }
    };
    let lengths = column(&samples, 0, "arclength").unwrap_or_default();
    let mut all = String::new();
    for name in ["curvature", "speed"] {
        all += &column(&samples, 0, name).map(|values| chart(name, "length", &lengths, &values)).unwrap_or_default();
    }
    let curve = fit.curve(i);
    if curve.is_fitted() && curve.dimension() == own.dimension() {
        let d = own.dimension();
        // Longitudes and latitudes on a globe are as far apart as their places.
        let place = |points: &[f64], k: usize| match (curve.globe(), &points[k * d..(k + 1) * d]) {
            (Some(globe), [x, y, ..]) => globe.place(*x, *y).to_array(),
            (_, point) => std::array::from_fn(|c| point.get(c).copied().unwrap_or(0.0)),
        };
        let points = (0..own.count(0)).filter(|k| 8 * k < lengths.len());
        let off = points.map(|k| {
            let [a, b] = [place(samples.points(0), 8 * k), place(own.points(0), k)];
            (lengths[8 * k], (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum::<f64>().sqrt())
        });
        let (at, off): (Vec<f64>, Vec<f64>) = off.unzip();
        all += &chart("deviation", "length", &at, &off);
    }
    if let (Some(t), Some(v)) = (curves.parameters(i), column(curves, i, "v")) {
        all += &chart("v", "t", t, &v);
    }
    all
}

/// A chart of a quantity, with its range. Empty where it is the same everywhere.
fn chart(name: &str, by: &str, at: &[f64], values: &[f64]) -> String {
    let range = |numbers: &[f64]| {
        let finite = numbers.iter().filter(|x| x.is_finite());
        finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| [low.min(x), high.max(x)])
    };
    let ([from, to], [low, high]) = (range(at), range(values));
    if !(from < to && low < high) {
        return String::new();
    }
    let mut points = String::new();
    for (x, y) in at.iter().zip(values).filter(|(_, y)| y.is_finite()) {
        let (x, y) = ((x - from) / (to - from) * WIDTH, 18.0 + (high - y) / (high - low) * HEIGHT);
        points += &format!("{x:.1},{y:.1} ");
    }
    let bottom = HEIGHT + 34.0;
    format!(
        "<svg viewBox=\"0 0 {WIDTH} {bottom}\" width=\"{WIDTH}\" height=\"{bottom}\" font-family=\"sans-serif\" font-size=\"12\"><text \
         x=\"0\" y=\"12\">{name} by {by}: {low:.4} to {high:.4}</text><polyline points=\"{points}\" fill=\"none\" stroke=\"#0072B2\"/><text \
         x=\"0\" y=\"{bottom}\">{from:.4}</text><text x=\"{WIDTH}\" y=\"{bottom}\" text-anchor=\"end\">{to:.4}</text></svg>"
    )
}
