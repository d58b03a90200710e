//! `faircurve bezier`: control points in, completed so that their curves bend least; on demand of a higher degree.

use std::path::{Path, PathBuf};

use clap::Args;
use faircurve::bezier::MOST_DEGREE;
use faircurve::io::{self, Format, WriteOptions};
use faircurve::picture::Picture;
use faircurve::{CurveBatch, CurveStatus, Error, Fit, Result, Sampling};

use super::device::{self, DeviceArgs};
use super::fit::{self, Shape};
use super::method;
use super::output;
use super::polygons::{Plan, PlanArgs};
use super::progress::Progress;
use super::report::{self, Head, Seconds};
use super::{InputArgs, Talk, count, thousands};

/// Completing a control point takes the CPU about as long as a point of a natural spline.
const COST: usize = 1;

#[derive(Args, Debug)]
pub struct BezierArgs {
    #[command(flatten)]
    input: InputArgs,
    /// File to write, in the format its extension says; - for standard output, with --to
    #[arg(short, long)]
    output: PathBuf,
    /// Format of the output, where its name does not say it
    #[arg(long, value_name = "FORMAT")]
    to: Option<Format>,
    #[command(flatten)]
    plan: PlanArgs,
    /// Raises the degree of every piece by N; the curves stay the same
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    elevate: Option<i64>,
    /// Lowers the degree of every piece by N: the nearest curves with the same ends
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "elevate")]
    reduce: Option<i64>,
    /// What is written of each curve
    #[arg(long = "as", value_enum, default_value_t = Shape::Bezier, value_name = "SHAPE")]
    shape: Shape,
    /// Segments a piece, with --as polyline [default: 16]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    samples: Option<i64>,
    /// Cubics in SVG stray at most this far from curves of higher degree, in units of the input [default: 1e-6 of the size]
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    #[command(flatten)]
    device: DeviceArgs,
    /// Writes a report with one line a curve as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Draws control points and curves as SVG
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
    /// Replaces outputs that exist
    #[arg(long)]
    force: bool,
    /// Counts single points, which have nothing to complete and stay as they are, as curves that could not be completed
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    talk: Talk,
}

pub fn run(args: &BezierArgs) -> Result<bool> {
    let plan = args.plan.plan(&args.input)?;
    let [elevate, reduce] = args.changes_of_degree()?;
    args.check()?;

    let mut progress = Progress::new(args.talk.quiet);
    let mut seconds = Seconds::default();
    progress.step("reading");
    let batch = plan.read(&args.input)?;
    if let Some(format) = args.format() {
        format.check(batch.dimension(), args.shape == Shape::Bezier)?;
    }
    seconds.read = progress.step("preparing the device");
    let device = device::open(args.device, &batch, Sampling::PerSpan(1), COST, args.talk)?;
    let volume = format!("{}, {}", count(batch.len(), "curve"), count(batch.total_points(), "control point"));
    progress.count("completing", batch.len());
    let device = device.with_counter(progress.counter());
    let completed = plan.complete(&batch, &device)?;
    let completed = match (elevate, reduce) {
        (Some(by), _) => completed.elevate(by, &device)?,
        (_, Some(by)) => completed.reduce(by, &device)?,
        _ => completed,
    };
    let controls = completed.control_points().clone();
    let degrees: Vec<Option<usize>> = (0..controls.len()).map(|i| completed.degree(i)).collect();
    let fit = completed.into_fit();
    let curves = match (args.shape, args.format()) {
        (Shape::Polyline, _) => fit.polylines(Sampling::PerSpan(method::per_span(args.samples)?)),
        (Shape::Bezier, Some(Format::Svg)) => args.cubics(&plan, &controls, &degrees, &fit)?,
        (Shape::Bezier, _) => controls,
    };
    seconds.fit = progress.step(format!("writing {}", args.output.display()));
    let drawn = args.shape == Shape::Bezier && args.format() == Some(Format::Svg);
    io::write_with(&args.output, &curves, &args.write_options(drawn))?;
    let points_out: Vec<usize> = (0..curves.len()).map(|i| curves.count(i)).collect();
    drop(curves);
    seconds.write = progress.step("drawing");
    if let Some(path) = &args.picture {
        args.draw(path, &batch, &fit)?;
    }
    if let Some(path) = &args.report {
        progress.count("measuring", fit.len());
        let head = Head::of("bezier", &device, fit.device());
        output::write(path, args.force, |out| {
            report::write(out, &head, &batch, &fit, &points_out, seconds, &progress)
        })?;
    }
    progress.finish();

    args.talk.say(format_args!("{volume}: completed on {} ({})", fit.device(), device.reason()));
    let Seconds { read, fit: completed, write } = seconds;
    args.talk.detail(format_args!("read in {read:.3} s, completed in {completed:.3} s, written in {write:.3} s"));
    args.tell_not_unique(&fit);
    Ok(fit::judge(args.talk, args.strict, &batch, &fit))
}

impl BezierArgs {
    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        if self.shape == Shape::Bezier && self.samples.is_some() {
            return Err(Error::argument(
                "--samples belongs to --as polyline; control points are written as they are: leave it out",
            ));
        }
        method::per_span(self.samples)?;
        if let Some(tolerance) = self.tolerance {
            if !(tolerance > 0.0 && tolerance.is_finite()) {
                return Err(Error::argument(format!(
                    "--tolerance is {tolerance}; it must be a positive length in units of the input, such as --tolerance 0.001"
                )));
            }
            if self.shape == Shape::Polyline || self.format() != Some(Format::Svg) {
                return Err(Error::argument(format!(
                    "--tolerance {tolerance} is how near cubics come to curves of higher degree in SVG, which is not written \
                     here: leave it out"
                )));
            }
        }
        let beziers = self.shape == Shape::Bezier;
        io::check_output(&self.output, &self.write_options(beziers))?;
        fit::check_outputs(&self.output, self.report.as_deref(), self.picture.as_deref(), self.force)
    }

    /// By how much degrees are raised or lowered.
    fn changes_of_degree(&self) -> Result<[Option<usize>; 2]> {
        let change = |option: &str, by: Option<i64>| match by {
            None => Ok(None),
            Some(by) if (1..MOST_DEGREE as i64).contains(&by) => Ok(Some(by as usize)),
            Some(by) => Err(Error::argument(format!(
                "{option} is {by}; degrees change by 1 to {}, and stay between 1 and {MOST_DEGREE}: give {option} 1, or leave it out",
                MOST_DEGREE - 1
            ))),
        };
        Ok([change("--elevate", self.elevate)?, change("--reduce", self.reduce)?])
    }

    /// The format that is written, as far as it is known.
    fn format(&self) -> Option<Format> {
        self.to.or_else(|| Format::of_extension(&self.output))
    }

    fn write_options(&self, beziers: bool) -> WriteOptions {
        WriteOptions { format: self.to, overwrite: self.force, beziers, rounding: None }
    }

    /// Chains of cubics for SVG: control points of cubics as they are, curves of other degrees within the tolerance.
    fn cubics(&self, plan: &Plan, controls: &CurveBatch, degrees: &[Option<usize>], fit: &Fit) -> Result<CurveBatch> {
        let own = |i: usize| fit::BEZIER_TOLERANCE * fit::size(controls.points(i), controls.dimension());
        let near = fit.beziers_each(|i| self.tolerance.unwrap_or_else(|| own(i)));
        let d = controls.dimension();
        let (mut coords, mut offsets) = (Vec::with_capacity(near.coords().len()), vec![0]);
        for (i, &degree) in degrees.iter().enumerate() {
            let pieces = controls.spans(i) / 3;
            let whole = controls.count(i) > 1 && pieces * 3 == controls.spans(i);
            // What was not completed is still what was read: of a drawing cubics, else a polygon.
            let is_cubic = degree.map_or(plan.reads_cubics(), |degree| degree == 3);
            let points = if whole && is_cubic { controls.points(i) } else { near.points(i) };
            coords.extend_from_slice(points);
            if controls.is_closed(i) {
                // Marking the chain as closed drops its repeated first point, and only that.
                coords.extend_from_slice(&points[..d.min(points.len())]);
            }
            offsets.push(coords.len() / d);
        }
        let closed = (0..controls.len()).map(|i| controls.is_closed(i)).collect();
        let names = (0..controls.len()).map(|i| controls.name(i).into_owned()).collect();
        CurveBatch::from_ragged(d, coords, offsets)?.closed_each(closed)?.with_names(names)
    }

    fn draw(&self, path: &Path, batch: &CurveBatch, fit: &Fit) -> Result<()> {
        let picture = Picture { title: fit::title(&self.input.input), method: self.plan.title(), ..Picture::default() };
        output::write(path, self.force, |out| picture.write(batch, fit, out))
    }

    /// Says how many curves could be others as well.
    fn tell_not_unique(&self, fit: &Fit) {
        let not_unique = fit.reports().iter().filter(|report| report.status == CurveStatus::NotUnique).count();
        if not_unique > 0 {
            let (are, total) = (if not_unique == 1 { "is" } else { "are" }, count(fit.len(), "curve"));
            self.talk.say(format_args!(
                "{} of {total} {are} not unique: too few points are known, and the smallest of equally fair ones was taken",
                thousands(not_unique)
            ));
        }
    }
}
