//! One comparison for every kernel: an operation on the CPU in f64, and on a GPU in every precision
//! it has.

use faircurve::{CurveBatch, CurveReport, CurveStatus, Device, Fit};

use super::tolerance::Tolerance;
use super::{epsilon, precisions};

/// What an operation made of a batch: numbers curve by curve, and one status a curve.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub values: Vec<f64>,
    pub offsets: Vec<usize>,
    pub status: Vec<CurveStatus>,
    pub names: Vec<String>,
    /// By how much values differ since their parameters are rounded; empty for not at all.
    pub along: Vec<f64>,
}

impl Outcome {
    /// Samples at equal steps of the parameter. The CPU rounds the parameter of every sample, the
    /// device that of the first sample of a span: three roundings of the largest parameter, with
    /// which a sample moves along its curve.
    pub fn of_even_samples(fit: &Fit, samples: &CurveBatch) -> Self {
        let mut along = Vec::new();
        for i in 0..samples.len() {
            let curve = fit.curve(i);
            for &t in samples.parameters(i).expect("samples have parameters") {
                let (from, to) = curve.domain();
                let moved = 3.0 * f64::EPSILON * from.abs().max(to.abs()) * curve.derivative(t, 1).length();
                along.extend([moved, moved, moved].iter().take(samples.dimension()));
            }
        }
        Outcome { along, ..Self::of_curves(samples, fit.reports()) }
    }

    /// The coordinates of curves.
    pub fn of_curves(curves: &CurveBatch, reports: &[CurveReport]) -> Self {
        Outcome {
            values: curves.coords().to_vec(),
            offsets: curves.offsets().iter().map(|k| k * curves.dimension()).collect(),
            status: reports.iter().map(|report| report.status).collect(),
            names: (0..curves.len()).map(|i| curves.name(i).into_owned()).collect(),
            along: vec![],
        }
    }

    /// The coordinates of curves that have no report: the status is that of their problem.
    pub fn of_batch(curves: &CurveBatch) -> Self {
        let status = |i| curves.problem(i).map_or(CurveStatus::Converged, |problem| problem.status);
        Outcome { status: (0..curves.len()).map(status).collect(), ..Self::of_curves(curves, &[]) }
    }

    /// One number a curve.
    pub fn of_numbers(values: Vec<f64>) -> Self {
        let count = values.len();
        let names = (0..count).map(|i| i.to_string()).collect();
        Outcome {
            values,
            offsets: (0..=count).collect(),
            status: vec![CurveStatus::Converged; count],
            names,
            along: vec![],
        }
    }

    pub fn len(&self) -> usize {
        self.status.len()
    }

    pub fn curve(&self, i: usize) -> &[f64] {
        &self.values[self.offsets[i]..self.offsets[i + 1]]
    }

    /// The bits of every curve: what must not depend on neighbours, order, or chunks.
    pub fn bits(&self, i: usize) -> (CurveStatus, Vec<u64>) {
        // There are many NaNs, and all are the same to us.
        let bits = |x: &f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
        (self.status[i], self.curve(i).iter().map(bits).collect())
    }
}

/// What differences are measured in.
#[derive(Clone, Copy, Debug)]
pub enum Unit<'a> {
    /// Half the largest extent of the curve's points, of so many coordinates.
    Size(usize),
    /// The largest magnitude of the curve's numbers.
    Largest,
    /// Every number by itself.
    Value,
    /// As given, one a curve.
    Each(&'a [f64]),
}

impl Unit<'_> {
    fn of(self, i: usize, k: usize, values: &[f64]) -> f64 {
        match self {
            Unit::Size(d) => (0..d)
                .map(|c| {
                    let axis = || values.iter().skip(c).step_by(d).filter(|x| x.is_finite());
                    let low = axis().fold(f64::INFINITY, |low, x| low.min(*x));
                    let high = axis().fold(f64::NEG_INFINITY, |high, x| high.max(*x));
                    0.5 * high - 0.5 * low
                })
                .fold(0.0, f64::max),
            Unit::Largest => largest(values),
            Unit::Value => values[k].abs(),
            Unit::Each(units) => units[i],
        }
    }
}

pub fn largest(values: &[f64]) -> f64 {
    values.iter().filter(|x| x.is_finite()).fold(0.0, |largest, x| largest.max(x.abs()))
}

/// Runs an operation on the CPU and on the GPU in every precision it has, and asserts that lengths
/// and statuses agree and that every number of every curve does, within the tolerance. There are no
/// allowed failures.
pub fn conform(
    what: &str,
    device: &Device,
    tolerance: Tolerance,
    unit: Unit<'_>,
    operation: impl Fn(&Device) -> Outcome,
) {
    let cpu = operation(&Device::cpu());
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        let gpu = operation(&device.clone().with_precision(precision));
        let what = format!("{what}, {}", precision.word());
        compare(&what, &gpu, &cpu, tolerance, epsilon(precision), unit);
    }
}

/// Asserts that `found` is `wanted` within the tolerance for a device of rounding `epsilon`.
pub fn compare(what: &str, found: &Outcome, wanted: &Outcome, tolerance: Tolerance, epsilon: f64, unit: Unit<'_>) {
    assert_eq!(found.offsets.len(), wanted.offsets.len(), "{what}: number of curves");
    for i in 0..wanted.len() {
        let (name, lengths) = (&wanted.names[i], (found.curve(i).len(), wanted.curve(i).len()));
        assert_eq!(lengths.0, lengths.1, "{what}: numbers of curve {name}");
        assert_eq!(found.status[i], wanted.status[i], "{what}: status of curve {name}");
    }
    let mut worst = Worst::default();
    let mut failures = 0;
    for i in 0..wanted.len() {
        let (found, wanted_values) = (found.curve(i), wanted.curve(i));
        let reach = largest(wanted_values);
        let unit_of_curve = unit.of(i, 0, if wanted_values.is_empty() { &[0.0] } else { wanted_values });
        let mut failed = false;
        for (k, (&x, &y)) in found.iter().zip(wanted_values).enumerate() {
            if x == y || (x.is_nan() && y.is_nan()) {
                continue;
            }
            let unit = if let Unit::Value = unit { unit.of(i, k, wanted_values) } else { unit_of_curve };
            let own = tolerance.roundings * epsilon * unit;
            let along =
                wanted.along.get(wanted.offsets[i] + k).copied().filter(|moved| moved.is_finite()).unwrap_or(0.0);
            let bound = own + tolerance.reach * f64::EPSILON * reach + along;
            // What is a number on one device only is infinitely far off.
            let used = Some((x - y).abs() / bound).filter(|used| !used.is_nan()).unwrap_or(f64::INFINITY);
            failed |= used > 1.0;
            if used > worst.used || worst.name.is_empty() {
                worst = Worst { used, name: wanted.names[i].clone(), k, found: x, wanted: y, unit };
            }
        }
        failures += usize::from(failed);
    }
    if worst.name.is_empty() {
        println!("{what}: all numbers of {} curves are the same to the last bit", wanted.len());
        return;
    }
    let Worst { used, name, k, found, wanted: right, unit } = worst;
    println!(
        "{what}: worst is value {k} of curve {name:?}, {found:e} for {right:e}, {:.1e} of its unit {unit:.3e}, {:.0} % of the tolerance",
        (found - right).abs() / unit,
        100.0 * used,
    );
    assert!(
        failures == 0,
        "{what}: {failures} of {} curves differ by more than {} roundings ({}); worst is value {k} of curve {name:?}: \
         {found:e} for {right:e}, {:e} of its unit {unit:e}, {used:.1} times the tolerance",
        wanted.len(),
        tolerance.roundings,
        tolerance.why,
        (found - right).abs() / unit,
    );
}

#[derive(Default)]
struct Worst {
    used: f64,
    name: String,
    k: usize,
    found: f64,
    wanted: f64,
    unit: f64,
}
