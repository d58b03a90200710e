//! `faircurve fit`: a file of points in, a file of curves out.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use faircurve::bezier::LEAST_TOLERANCE;
use faircurve::io::{self, Format, WriteOptions};
use faircurve::picture::Picture;
use faircurve::{CurveBatch, CurveStatus, Error, Fit, Result};

use super::device::{self, DeviceArgs};
use super::method::{self, Method, MethodArgs};
use super::output;
use super::progress::Progress;
use super::report::{self, Head, Seconds};
use super::{InputArgs, Talk, count};

/// This many curves that are not usable are listed; --report and -v list them all.
const MOST_LISTED: usize = 20;

/// Béziers stray from a curve by at most this part of the size of its points, where --tolerance does not say how much.
pub(super) const BEZIER_TOLERANCE: f64 = 1e-6;

/// SVG rounds control points to a power of ten of at most this part of --tolerance.
const ROUNDING: f64 = 0.01;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(super) enum Shape {
    /// Points along the curve
    Polyline,
    /// Chains of cubic Béziers within --tolerance of the curves: drawn in SVG, control points in CSV and NPZ
    Bezier,
}

#[derive(Args, Debug)]
pub struct FitArgs {
    #[command(flatten)]
    input: InputArgs,
    /// File to write, in the format its extension says; - for standard output, with --to
    #[arg(short, long)]
    output: PathBuf,
    /// Format of the output, where its name does not say it
    #[arg(long, value_name = "FORMAT")]
    to: Option<Format>,
    #[command(flatten)]
    method: MethodArgs,
    /// Samples at equal arc length, at most D apart (units of the input), in place of --samples
    #[arg(long, value_name = "D", conflicts_with = "samples", allow_negative_numbers = true)]
    spacing: Option<f64>,
    #[command(flatten)]
    device: DeviceArgs,
    /// What is written of each curve
    #[arg(long = "as", value_enum, default_value_t = Shape::Polyline, value_name = "SHAPE")]
    shape: Shape,
    /// Writes a report with one line a curve as JSON
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Draws input and curves as SVG
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
    /// Draws curvature combs into the picture; SCALE lengthens their quills [default: 1]
    #[arg(long, value_name = "SCALE", requires = "picture", num_args = 0..=1, default_missing_value = "1")]
    comb: Option<f64>,
    /// Replaces outputs that exist
    #[arg(long)]
    force: bool,
    /// Counts single points, which have nothing to fit and stay as they are, as curves that could not be fitted
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    talk: Talk,
}

pub fn run(args: &FitArgs) -> Result<bool> {
    let sampling = method::sampling(&args.method, args.spacing)?;
    let method = args.method()?;
    args.check()?;

    let mut progress = Progress::new(args.talk.quiet);
    let mut seconds = Seconds::default();
    progress.step("reading");
    let batch = args.input.read()?;
    if let Some(format) = args.to.or_else(|| Format::of_extension(&args.output)) {
        format.check(batch.dimension(), args.shape == Shape::Bezier)?;
    }
    let tolerances = args.bezier_tolerances(&batch)?;
    seconds.read = progress.step("preparing the device");
    let device = device::open(args.device, &batch, sampling, args.method.cost(), args.talk)?;
    let volume = format!("{}, {}", count(batch.len(), "curve"), count(batch.total_points(), "point"));
    progress.count("fitting", batch.len());
    let device = device.with_counter(progress.counter());
    let (fit, curves) = match args.shape {
        Shape::Polyline => method.fit_sampled(&batch, sampling, &device)?,
        Shape::Bezier => {
            let fit = method.fit(&batch, &device)?;
            let beziers = fit.beziers_each(|i| tolerances[i]);
            (fit, beziers)
        }
    };
    seconds.fit = progress.step(format!("writing {}", args.output.display()));
    io::write_with(&args.output, &curves, &args.write_options())?;
    let points_out: Vec<usize> = (0..curves.len()).map(|i| curves.count(i)).collect();
    drop(curves);
    seconds.write = progress.step("drawing");
    if let Some(path) = &args.picture {
        args.draw(path, &batch, &fit)?;
        let drawn = progress.step("");
        args.talk.detail(format_args!("drew {} in {drawn:.3} s", path.display()));
    }
    if let Some(path) = &args.report {
        progress.count("measuring", fit.len());
        let head = Head::of(args.method.word(), &device, fit.device());
        output::write(path, args.force, |out| {
            report::write(out, &head, &batch, &fit, &points_out, seconds, &progress)
        })?;
    }
    progress.finish();

    args.talk.say(format_args!("{volume}: fitted on {} ({})", fit.device(), device.reason()));
    let Seconds { read, fit: fitted, write } = seconds;
    args.talk.detail(format_args!("read in {read:.3} s, fitted in {fitted:.3} s, written in {write:.3} s"));
    method.notes(&fit).iter().for_each(|note| args.talk.say(note));
    Ok(judge(args.talk, args.strict, &batch, &fit))
}

impl FitArgs {
    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        if self.shape == Shape::Bezier && (self.method.samples.is_some() || self.spacing.is_some()) {
            let why = "--as bezier writes the curves themselves: leave --samples and --spacing out";
            return Err(Error::argument(why));
        }
        if let Some(tolerance) = self.asked_tolerance().filter(|&tolerance| !(tolerance > 0.0 && tolerance.is_finite()))
        {
            return Err(Error::argument(format!(
                "--tolerance is {tolerance}; with --as bezier it is the largest distance of the Béziers from the curve: a positive number, \
                 in units of the input, such as --tolerance 0.001"
            )));
        }
        if let Some(scale) = self.comb.filter(|&scale| !(scale > 0.0 && scale.is_finite())) {
            return Err(Error::argument(format!(
                "--comb is {scale}; the scale of its quills must be a positive number, such as --comb 2"
            )));
        }
        io::check_output(&self.output, &self.write_options())?;
        check_outputs(&self.output, self.report.as_deref(), self.picture.as_deref(), self.force)
    }

    fn write_options(&self) -> WriteOptions {
        WriteOptions {
            format: self.to,
            overwrite: self.force,
            beziers: self.shape == Shape::Bezier,
            rounding: self.asked_tolerance().map(|tolerance| ROUNDING * tolerance),
        }
    }

    /// --tolerance, where it is that of Béziers.
    fn asked_tolerance(&self) -> Option<f64> {
        self.method.tolerance.filter(|_| self.shape == Shape::Bezier)
    }

    /// The method asked for; with --as bezier --tolerance is none of its options.
    fn method(&self) -> Result<Method> {
        match self.shape {
            Shape::Polyline => self.method.method(self.spacing),
            Shape::Bezier => self.method.without_tolerance().method(self.spacing),
        }
    }

    /// How far Béziers may be from each curve.
    fn bezier_tolerances(&self, batch: &CurveBatch) -> Result<Vec<f64>> {
        let largest = |points: &[f64]| points.iter().filter(|x| x.is_finite()).fold(0.0f64, |a, x| a.max(x.abs()));
        let Some(tolerance) = self.asked_tolerance() else {
            let own = |i: usize| {
                let points = batch.points(i);
                (BEZIER_TOLERANCE * size(points, batch.dimension())).max(LEAST_TOLERANCE * largest(points))
            };
            return Ok((0..batch.len()).map(own).collect());
        };
        // Curves that cannot be fitted come out as they came in, whatever the tolerance.
        let fitted = (0..batch.len()).filter(|&i| batch.problem(i).is_none());
        let largest = fitted.map(|i| largest(batch.points(i))).fold(0.0, f64::max);
        let least = LEAST_TOLERANCE * largest;
        if tolerance < least {
            return Err(Error::argument(format!(
                "--tolerance is {tolerance}, but coordinates up to {largest} are rounded to about as much: give {least:.0e} or more"
            )));
        }
        // What the rounding of the output takes is left to it.
        Ok(vec![(1.0 - ROUNDING) * tolerance; batch.len()])
    }

    fn draw(&self, path: &Path, batch: &CurveBatch, fit: &Fit) -> Result<()> {
        let picture = Picture {
            comb: self.comb,
            title: title(&self.input.input),
            method: self.method.title(),
            ..Picture::default()
        };
        output::write(path, self.force, |out| picture.write(batch, fit, out))
    }
}

/// Checks the places of all files that will be written, and that the picture's name is that of an SVG file.
pub(super) fn check_outputs(output: &Path, report: Option<&Path>, picture: Option<&Path>, force: bool) -> Result<()> {
    let mut outputs = vec![("--output", output)];
    outputs.extend(report.map(|path| ("--report", path)));
    if let Some(path) = picture {
        let svg = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
        if !svg && !is_stdio(path) {
            let path = path.display();
            return Err(Error::argument(format!("--picture {path}: pictures are SVG, give a name that ends in .svg")));
        }
        outputs.push(("--picture", path));
    }
    output::check(&outputs, force)
}

/// Lists the curves that are not usable, and why; whether there is none. Single points count only where `strict`.
pub(super) fn judge(talk: Talk, strict: bool, batch: &CurveBatch, fit: &Fit) -> bool {
    let reports = || fit.reports().iter().enumerate();
    let is_point = |i: usize| fit.reports()[i].status == CurveStatus::Degenerate && is_single_point(batch, i);
    let points = reports().filter(|(i, _)| !strict && is_point(*i)).count();
    match points {
        0 => {}
        1 => talk.say("1 curve is a single point and stays as it is"),
        n => talk.say(format_args!("{} are single points and stay as they are", count(n, "curve"))),
    }
    let unusable = fit.len() - fit.usable() - points;
    let lines =
        reports().filter(|(i, report)| !report.status.is_usable() && (strict || !is_point(*i))).map(|(i, report)| {
            let word = report.status.word();
            match &report.message {
                Some(message) => format!("{word}: {message}"),
                None => format!("{word}: curve {}", batch.label(i)),
            }
        });
    list(talk, "curve", [unusable, fit.len()], lines);
    unusable == 0
}

/// Whether a curve is one point, once or repeated, and has nothing to fit.
fn is_single_point(batch: &CurveBatch, i: usize) -> bool {
    let mut points = batch.points(i).chunks_exact(batch.dimension());
    points.next().is_some_and(|first| points.all(|point| point == first))
}

/// Lists how many of all are not usable, and the first of the lines that say why.
pub(super) fn list(talk: Talk, what: &str, [unusable, all]: [usize; 2], lines: impl Iterator<Item = String>) {
    if unusable == 0 || talk.quiet {
        return;
    }
    let (are, total) = (if unusable == 1 { "is" } else { "are" }, count(all, what));
    talk.say(format_args!("{} of {total} {are} not usable:", super::thousands(unusable)));
    let most = if talk.verbose { usize::MAX } else { MOST_LISTED };
    lines.take(most).for_each(|line| eprintln!("  {line}"));
    if unusable > most {
        eprintln!("  and {} more: --report FILE.json and -v list them all", super::thousands(unusable - most));
    }
}

/// The file's name without folder and extensions; none for standard input.
pub(super) fn title(input: &Path) -> Option<String> {
    let zipped = input.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"));
    let stem = if zipped { Path::new(input.file_stem()?).file_stem()? } else { input.file_stem()? };
    (!is_stdio(input)).then(|| stem.to_string_lossy().into_owned())
}

/// Whether this is standard input or output.
fn is_stdio(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Largest extent of points along an axis, of those that are finite.
pub(super) fn size(points: &[f64], dimension: usize) -> f64 {
    let mut size = 0.0f64;
    for axis in 0..dimension {
        let values = points.iter().skip(axis).step_by(dimension).filter(|x| x.is_finite());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
        size = size.max(high - low);
    }
    size
}
