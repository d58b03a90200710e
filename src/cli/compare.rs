//! `faircurve compare`: the same fit on the CPU in f64 and on the device, curve by curve.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use faircurve::{Choice, CurveBatch, Device, Error, Fit, Precision, Result, Sampling};
use rayon::prelude::*;
use serde::Serialize;

use super::device::{self, Description, DeviceArgs, PrecisionArg};
use super::method::{MethodArgs, MethodName};
use super::progress::Progress;
use super::{InputArgs, Talk, count, output, show, thousands};

/// Every fit runs this often and the fastest run counts: the first one also starts threads and builds kernels.
const RUNS: usize = 2;

/// What a GPU computes is asked here, not whether it pays: `auto` takes it for the smallest batch.
const WHATEVER_IT_TAKES: usize = usize::MAX;

#[derive(Args, Debug)]
pub struct CompareArgs {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Writes every curve's difference as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Replaces a report that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    talk: Talk,
}

/// A fit with its samples and the seconds both took.
pub struct Run {
    fit: Fit,
    samples: CurveBatch,
    seconds: f64,
}

impl Run {
    /// The precision that the work was done in.
    pub fn precision(&self) -> &'static str {
        device::precision_word(self.fit.device())
    }

    /// What did the work.
    pub fn device(&self) -> &str {
        self.fit.device()
    }
}

/// Fits and samples, [`RUNS`] times; the result of the last, the time of the fastest.
pub fn fit(
    batch: &CurveBatch,
    device: &Device,
    fit_sampled: impl Fn(&CurveBatch, &Device) -> Result<(Fit, CurveBatch)>,
) -> Result<Run> {
    let once = || -> Result<Run> {
        let started = Instant::now();
        let (fit, samples) = fit_sampled(batch, device)?;
        Ok(Run { fit, samples, seconds: started.elapsed().as_secs_f64() })
    };
    let mut run = once()?;
    for _ in 1..RUNS {
        let fastest = run.seconds;
        drop(run);
        run = once()?;
        run.seconds = run.seconds.min(fastest);
    }
    Ok(run)
}

/// Largest differences allowed between a device and the CPU in f64.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bounds {
    /// Of samples, in units of the curve's size.
    pub distance: f64,
    /// Of energies, in units of the energy; none where both sides compute it from the same numbers.
    pub energy: Option<f64>,
}

impl Bounds {
    /// Of splines, which solve linear systems.
    pub fn of_splines(precision: Precision) -> Self {
        match precision {
            Precision::F32 => Bounds { distance: 2e-6, energy: None },
            Precision::F64 | Precision::Auto => Bounds { distance: 1e-12, energy: None },
        }
    }

    /// Of fair curves and smooth connection functions, which each side iterates until its gradient is small.
    pub fn of_iterated_curves(precision: Precision) -> Self {
        match precision {
            Precision::F32 => Bounds { distance: 1e-5, energy: Some(1e-5) },
            Precision::F64 | Precision::Auto => Bounds { distance: 1e-9, energy: Some(1e-10) },
        }
    }
}

/// Energies below this part of the largest of a batch are rounding, such as those of straight curves.
const NO_ENERGY: f64 = 1e-12;

/// So many of the worst curves are named, where curves are iterated.
const WORST_NAMED: usize = 10;

/// What a comparison found.
#[derive(Debug, Serialize)]
pub struct Outcome {
    pub precision: &'static str,
    pub bound: f64,
    /// Largest relative difference of energies, and what is allowed, where energies are compared.
    pub energy: Option<f64>,
    pub energy_bound: Option<f64>,
    pub pass: bool,
    /// Largest difference; infinite (null in JSON) where one side fitted and the other did not.
    pub worst: f64,
    pub worst_curve: Option<String>,
    pub median: f64,
    pub percentile_99: f64,
    pub seconds: f64,
    /// Curves that neither side could fit: they come out as their input, bit for bit, and are in no statistic.
    pub not_fitted: usize,
    #[serde(skip)]
    differences: Vec<Option<f64>>,
}

/// Compares two runs curve by curve.
pub fn judge(batch: &CurveBatch, reference: &Run, run: &Run, precision: Precision, bounds: Bounds) -> Outcome {
    let differences: Vec<Option<f64>> =
        (0..batch.len()).into_par_iter().map(|i| difference(batch, i, reference, run)).collect();
    // A NaN that only one side has is a difference without bound, and sorts last.
    let mut sorted: Vec<f64> = differences.iter().flatten().copied().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let quantile =
        |q: f64| if sorted.is_empty() { 0.0 } else { sorted[((sorted.len() - 1) as f64 * q).round() as usize] };
    let worst = quantile(1.0);
    let at = differences.iter().position(|d| *d == Some(worst)).filter(|_| worst > 0.0);
    let energy = bounds.energy.map(|_| energy_difference(reference, run));
    let energy_passes = energy.zip(bounds.energy).is_none_or(|(energy, bound)| energy <= bound);
    Outcome {
        precision: precision.word(),
        bound: bounds.distance,
        energy,
        energy_bound: bounds.energy,
        pass: worst <= bounds.distance && energy_passes,
        worst,
        worst_curve: at.map(|i| batch.name(i).into_owned()),
        median: quantile(0.5),
        percentile_99: quantile(0.99),
        seconds: run.seconds,
        not_fitted: differences.iter().filter(|d| d.is_none()).count(),
        differences,
    }
}

/// Largest relative difference of the energies of curves that both sides could use.
fn energy_difference(reference: &Run, run: &Run) -> f64 {
    let usable = |run: &Run, i: usize| run.fit.reports()[i].status.is_usable();
    let energies: Vec<(f64, f64)> = (0..run.fit.len())
        .filter(|&i| usable(reference, i) && usable(run, i))
        .map(|i| (reference.fit.reports()[i].energy, run.fit.reports()[i].energy))
        .collect();
    let largest = energies.iter().fold(0.0f64, |largest, (energy, _)| largest.max(energy.abs()));
    let relative = |(a, b): &(f64, f64)| if a == b { 0.0 } else { (a - b).abs() / a.abs().max(NO_ENERGY * largest) };
    energies.iter().map(relative).fold(0.0, |worst, x| if x > worst || x.is_nan() { x } else { worst })
}

/// Largest distance between samples of curve `i`, in units of the diagonal of its points' box. `None` where neither
/// side fitted the curve and both say the same; infinite where they disagree about status, number or finiteness.
fn difference(batch: &CurveBatch, i: usize, reference: &Run, run: &Run) -> Option<f64> {
    let (status, other) = (reference.fit.reports()[i].status, run.fit.reports()[i].status);
    let (a, b) = (reference.samples.points(i), run.samples.points(i));
    if status != other || a.len() != b.len() {
        return Some(f64::INFINITY);
    }
    if !reference.fit.curve(i).is_fitted() {
        let same = a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        return if same { None } else { Some(f64::INFINITY) };
    }
    let dimension = batch.dimension();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in batch.points(i).chunks_exact(dimension) {
        for (axis, &x) in point.iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(x), high[axis].max(x));
        }
    }
    let size = (0..dimension).map(|axis| (high[axis] - low[axis]).powi(2)).sum::<f64>().sqrt();
    let distance = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let mut largest = 0.0f64;
    for d in a.chunks_exact(dimension).zip(b.chunks_exact(dimension)).map(distance) {
        if !d.is_finite() {
            return Some(f64::INFINITY);
        }
        largest = largest.max(d);
    }
    Some(if largest == 0.0 { 0.0 } else { largest / size })
}

pub fn run(args: &CompareArgs) -> Result<bool> {
    let method = args.method.method(None)?;
    let per_span = args.method.per_span()?;
    let outputs: Vec<_> = args.report.as_deref().map(|path| ("--report", path)).into_iter().collect();
    output::check(&outputs, args.force)?;

    let mut progress = Progress::new(args.talk.quiet);
    progress.step("reading");
    let batch = args.input.read()?;
    let sampling = Sampling::PerSpan(per_span);
    let fit = |device: &Device| fit(&batch, device, |batch, device| method.fit_sampled(batch, sampling, device));
    progress.step("fitting on the CPU in f64");
    let cpu = Device::cpu().with_precision(Precision::F64);
    let reference = fit(&cpu)?;

    let mut outcomes = Vec::new();
    let mut described = None;
    for precision in args.precisions() {
        progress.step(format!("fitting on the device in {}", precision.word()));
        let asked = DeviceArgs { precision: PrecisionArg::of(precision), ..args.device };
        let opened = device::open(asked, &batch, sampling, WHATEVER_IT_TAKES, args.talk)
            .and_then(|device| Ok((fit(&device)?, device)));
        match opened {
            Ok((run, _)) if run.precision() != precision.word() => {
                let did = run.device();
                args.talk.say(format_args!("no comparison in {}: {did} did the work", precision.word()));
            }
            Ok((run, device)) => {
                if described.is_none() {
                    args.talk.detail(format_args!("{} ({})", run.fit.device(), device.reason()));
                }
                outcomes.push(judge(&batch, &reference, &run, precision, args.bounds(precision)));
                described = Some(device::describe(&device));
            }
            // Where both were to be tried, a device without f64 is still worth its f32.
            Err(error) if !outcomes.is_empty() && args.device.precision == PrecisionArg::Auto => {
                args.talk.say(format_args!("no comparison in {}: {error}", precision.word()));
            }
            Err(error) => return Err(error),
        }
    }
    progress.finish();
    let Some(described) = described else {
        return Err(Error::argument(format!("nothing was compared: {} computed in f64 only", reference.fit.device())));
    };
    args.print(&batch, &reference, &described, &outcomes, per_span)?;
    if let Some(path) = &args.report {
        let file = args.report(&batch, &reference, &described, &outcomes, per_span);
        output::write(path, args.force, |out| {
            serde_json::to_writer_pretty(&mut *out, &file)?;
            writeln!(out)
        })?;
    }
    Ok(outcomes.iter().all(|outcome| outcome.pass))
}

#[derive(Serialize)]
struct File<'a> {
    faircurve: &'static str,
    method: &'static str,
    samples_per_span: usize,
    reference: Reference,
    device: &'a Description,
    comparisons: &'a [Outcome],
    curves: Vec<Line<'a>>,
}

#[derive(Serialize)]
struct Reference {
    device: Description,
    precision: &'static str,
    seconds: f64,
}

/// One curve: its status on the CPU, and its difference in each precision compared (null where neither side fitted it).
#[derive(Serialize)]
struct Line<'a> {
    curve: String,
    status: &'static str,
    differences: std::collections::BTreeMap<&'a str, Option<f64>>,
}

impl CompareArgs {
    fn precisions(&self) -> Vec<Precision> {
        match self.device.precision {
            // The CPU against itself: the same bits again, or something is badly wrong.
            PrecisionArg::Auto if self.device.device == Choice::Cpu => vec![Precision::F64],
            PrecisionArg::Auto => vec![Precision::F32, Precision::F64],
            one => vec![one.precision()],
        }
    }

    fn bounds(&self, precision: Precision) -> Bounds {
        match self.method.name() {
            MethodName::Fair | MethodName::Scf => Bounds::of_iterated_curves(precision),
            MethodName::Natural | MethodName::Smoothing => Bounds::of_splines(precision),
        }
    }

    /// Energies, and the worst curves by name, of methods that iterate.
    fn print_iterated(&self, batch: &CurveBatch, outcomes: &[Outcome]) -> Result<()> {
        for outcome in outcomes {
            let Some((energy, bound)) = outcome.energy.zip(outcome.energy_bound) else { continue };
            let result = if energy <= bound { "pass" } else { "FAIL" };
            let precision = outcome.precision;
            show(format_args!(
                "\n{precision}: energies differ by {energy:.2e} of themselves at most, bound {bound:.0e}: {result}"
            ))?;
            let mut worst: Vec<(usize, f64)> =
                outcome.differences.iter().enumerate().filter_map(|(i, d)| Some((i, (*d)?))).collect();
            worst.sort_by(|a, b| b.1.total_cmp(&a.1));
            worst.truncate(WORST_NAMED);
            let named = worst.iter().map(|(i, d)| format!("{} {d:.2e}", batch.label(*i)));
            show(format_args!("{precision}: worst curves: {}", named.collect::<Vec<_>>().join(", ")))?;
        }
        Ok(())
    }

    fn print(
        &self,
        batch: &CurveBatch,
        reference: &Run,
        device: &Description,
        outcomes: &[Outcome],
        per_span: usize,
    ) -> Result<()> {
        let curves = batch.len();
        let rate = |seconds: f64| thousands((curves as f64 / seconds.max(1e-9)).round() as usize);
        let (size, points) = (count(curves, "curve"), count(batch.total_points(), "point"));
        show(format_args!("{size}, {points}, --method {}, {} a span", self.method.word(), count(per_span, "sample")))?;
        let cpu = device::describe(&Device::cpu());
        show(format_args!("reference: CPU f64, {} ({})", cpu.name, cpu.driver))?;
        show(format_args!("device:    {}, {} ({})", device.kind.to_uppercase(), device.name, device.driver))?;
        show(format_args!("differences are distances in units of the curve's size (the diagonal of its box)\n"))?;
        show(format_args!(
            "{:<10} {:>9} {:>9} {:>9} {:>7}  {:<6} {:>10} {:>14}  worst curve",
            "", "worst", "median", "99 %", "bound", "result", "seconds", "curves/s"
        ))?;
        let seconds = reference.seconds;
        show(format_args!(
            "{:<10} {:>9} {:>9} {:>9} {:>7}  {:<6} {seconds:>10.6} {:>14}",
            "reference",
            "",
            "",
            "",
            "",
            "",
            rate(seconds)
        ))?;
        for outcome in outcomes {
            let Outcome { precision, bound, pass, worst, median, percentile_99, seconds, .. } = outcome;
            let label = format!("{} {precision}", device.kind.to_uppercase());
            let result = if *pass { "pass" } else { "FAIL" };
            let name = outcome.worst_curve.as_deref().unwrap_or("all alike");
            show(format_args!(
                "{label:<10} {worst:>9.2e} {median:>9.2e} {percentile_99:>9.2e} {bound:>7.0e}  {result:<6} {seconds:>10.6} {:>14}  {name}",
                rate(*seconds)
            ))?;
        }
        if let Some(outcome) = outcomes.first().filter(|outcome| outcome.not_fitted > 0) {
            show(format_args!(
                "\nnot fitted by either side, and in no statistic: {}",
                count(outcome.not_fitted, "curve")
            ))?;
        }
        self.print_iterated(batch, outcomes)
    }

    fn report<'a>(
        &self,
        batch: &CurveBatch,
        reference: &Run,
        device: &'a Description,
        comparisons: &'a [Outcome],
        samples_per_span: usize,
    ) -> File<'a> {
        let line = |i: usize| Line {
            curve: batch.name(i).into_owned(),
            status: reference.fit.reports()[i].status.word(),
            differences: comparisons.iter().map(|outcome| (outcome.precision, outcome.differences[i])).collect(),
        };
        let cpu = device::describe(&Device::cpu());
        File {
            faircurve: env!("CARGO_PKG_VERSION"),
            method: self.method.word(),
            samples_per_span,
            reference: Reference { device: cpu, precision: "f64", seconds: reference.seconds },
            device,
            comparisons,
            curves: (0..batch.len()).map(line).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use faircurve::spline::Natural;

    use super::*;

    fn run_of(middle: [f64; 2], last: f64) -> (CurveBatch, Run) {
        let curves = [[[0.0, 0.0], middle, [2.0, 0.0]], [[0.0, 0.0], [3.0, 4.0], [last, 0.0]]];
        let batch = CurveBatch::from_slices(&[&curves[0][..], &curves[1][..]]).unwrap();
        let sampling = Sampling::PerSpan(4);
        let run = fit(&batch, &Device::cpu(), |b, d| Natural::default().fit_sampled(b, sampling, d)).unwrap();
        (batch, run)
    }

    #[test]
    fn a_difference_is_measured_in_units_of_the_curve_and_breaks_the_bound() {
        let (batch, reference) = run_of([1.0, 1.0], 6.0);
        let (_, moved) = run_of([1.0, 1.001], 6.0);
        let outcome = judge(&batch, &reference, &moved, Precision::F32, Bounds::of_splines(Precision::F32));
        assert!(!outcome.pass && outcome.worst_curve.as_deref() == Some("0"), "{outcome:?}");
        // The point moved is a sample, moved by 0.001 in a box of 2 by 1; no sample moves much farther.
        let size = 5f64.sqrt();
        assert!(outcome.worst >= 0.0009999 / size && outcome.worst < 0.0015 / size, "{outcome:?}");
        assert_eq!(outcome.differences[1], Some(0.0));
        assert!(judge(&batch, &reference, &reference, Precision::F64, Bounds::of_splines(Precision::F64)).pass);
    }

    #[test]
    fn a_curve_that_only_one_side_fitted_is_an_infinite_difference() {
        let (batch, reference) = run_of([1.0, 1.0], 6.0);
        let (_, broken) = run_of([1.0, 1.0], f64::NAN);
        let outcome = judge(&batch, &reference, &broken, Precision::F32, Bounds::of_splines(Precision::F32));
        assert!(!outcome.pass && outcome.worst == f64::INFINITY, "{outcome:?}");
        assert_eq!(outcome.worst_curve.as_deref(), Some("1"));
        // Where both sides say the same there is nothing to compare.
        assert_eq!(judge(&batch, &broken, &broken, Precision::F32, Bounds::of_splines(Precision::F32)).not_fitted, 1);
    }
}
