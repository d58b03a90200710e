//! `faircurve compare`: the same fit on the CPU in f64 and on the device, curve by curve.

pub mod difference;

use clap::Args;
use faircurve::{Choice, CurveBatch, Device, Error, Precision, Result, Sampling, Work};
use serde_json::{Map, Value, json};

use self::difference::{Bounds, Outcome, Timed};
use super::device::{self, Description, DeviceArgs};
use super::method::{MethodArgs, MethodName};
use super::progress::Progress;
use super::run::{RunArgs, is_html};
use super::sampling::per_span;
use super::{InputArgs, count, output, show, thousands};

/// The number of the worst curves that are named, for methods that iterate.
const WORST_NAMED: usize = 10;

#[derive(Args, Debug)]
pub struct CompareArgs {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &CompareArgs) -> Result<bool> {
    let method = args.method.method(None)?;
    let per_span = per_span(args.method.samples)?;
    args.run.check(None, None, None)?;
    if let Some(path) = args.run.report.as_deref().filter(|path| is_html(path)) {
        let path = path.display();
        return Err(Error::argument(format!("--report {path}: compare writes JSON, give a name that ends in .json")));
    }

    let talk = args.run.talk;
    let mut progress = Progress::new(talk.quiet);
    progress.step("reading");
    let batch = args.input.read()?;
    let (method, note) = method.for_times_of(&batch);
    note.iter().for_each(|note| talk.say(note));
    let sampling = Sampling::PerSpan(per_span);
    let fit =
        |device: &Device| difference::fit(&batch, device, |batch, device| method.fit_sampled(batch, sampling, device));
    progress.step("fitting on the CPU in f64");
    let cpu = Device::cpu().with_precision(Precision::F64);
    let reference = fit(&cpu)?;

    let mut outcomes = Vec::new();
    let mut described = None;
    for precision in args.precisions() {
        progress.step(format!("fitting on the device in {precision}"));
        let asked = DeviceArgs { precision, ..args.run.device };
        // What a GPU computes is asked here, not whether it pays.
        let opened = device::open(asked, &Work::ENDLESS, talk).and_then(|device| Ok((fit(&device)?, device)));
        match opened {
            Ok((run, _)) if run.device().precision != precision => {
                talk.say(format_args!("no comparison in {precision}: {} did the work", run.device()));
            }
            Ok((run, device)) => {
                if described.is_none() {
                    talk.detail(format_args!("{} ({})", run.device(), device.reason()));
                }
                outcomes.push(difference::judge(&batch, &reference, &run, precision, args.bounds(precision)));
                described = Some(Description::of(run.device()));
            }
            // Where both were to be tried, a device without f64 is still worth its f32.
            Err(error) if !outcomes.is_empty() && args.run.device.precision == Precision::Auto => {
                talk.say(format_args!("no comparison in {precision}: {error}"));
            }
            Err(error) => return Err(error),
        }
    }
    progress.finish();
    let Some(described) = described else {
        return Err(Error::argument(format!("nothing was compared: {} computed in f64 only", reference.device())));
    };
    args.print(&batch, &reference, &described, &outcomes, per_span)?;
    if let Some(path) = &args.run.report {
        let file = args.report(&batch, &reference, &described, &outcomes, per_span);
        output::write(path, args.run.force, |out| {
            serde_json::to_writer_pretty(&mut *out, &file)?;
            writeln!(out)
        })?;
    }
    Ok(outcomes.iter().all(|outcome| outcome.pass))
}

impl CompareArgs {
    fn precisions(&self) -> Vec<Precision> {
        match self.run.device.precision {
            // The CPU against itself: the same bits again, or something is badly wrong.
            Precision::Auto if self.run.device.device == Choice::Cpu => vec![Precision::F64],
            Precision::Auto => vec![Precision::F32, Precision::F64],
            one => vec![one],
        }
    }

    fn bounds(&self, precision: Precision) -> Bounds {
        match self.method.name() {
            MethodName::Fair | MethodName::Scf | MethodName::Geodesic => Bounds::of_iterated_curves(precision),
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
            worst.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            worst.truncate(WORST_NAMED);
            let named = worst.iter().map(|(i, d)| format!("{} {d:.2e}", batch.label(*i)));
            show(format_args!("{precision}: worst curves: {}", named.collect::<Vec<_>>().join(", ")))?;
        }
        Ok(())
    }

    fn print(
        &self,
        batch: &CurveBatch,
        reference: &Timed,
        device: &Description,
        outcomes: &[Outcome],
        per_span: usize,
    ) -> Result<()> {
        let curves = batch.len();
        let rate = |seconds: f64| thousands((curves as f64 / seconds.max(1e-9)).round() as usize);
        let (size, points) = (count(curves, "curve"), count(batch.total_points(), "point"));
        show(format_args!("{size}, {points}, --method {}, {} a span", self.method.word(), count(per_span, "sample")))?;
        let cpu = Description::of(reference.device());
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
        if let Some(outcome) = outcomes.first().filter(|outcome| outcome.unusable > 0) {
            show(format_args!("\nusable on neither side, and in no statistic: {}", count(outcome.unusable, "curve")))?;
        }
        self.print_iterated(batch, outcomes)
    }

    /// The report. A difference is null where the curve is usable on neither side.
    fn report(
        &self,
        batch: &CurveBatch,
        reference: &Timed,
        device: &Description,
        comparisons: &[Outcome],
        samples_per_span: usize,
    ) -> Value {
        let line = |i: usize| {
            let differences =
                comparisons.iter().map(|outcome| (outcome.precision.into(), json!(outcome.differences[i])));
            json!({
                "curve": batch.name(i),
                "status": reference.fit.reports()[i].status,
                "differences": differences.collect::<Map<String, Value>>(),
            })
        };
        let cpu = Description::of(reference.device());
        json!({
            "faircurve": env!("CARGO_PKG_VERSION"),
            "method": self.method.word(),
            "samples_per_span": samples_per_span,
            "reference": {"device": cpu, "precision": "f64", "seconds": reference.seconds},
            "device": device,
            "comparisons": comparisons,
            "curves": (0..batch.len()).map(line).collect::<Vec<Value>>(),
        })
    }
}
