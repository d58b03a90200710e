//! Curves in, curves out: what `fit` and `bezier` have in common.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use faircurve::bounds::Bounds;
use faircurve::io::{self, Antimeridian, Format, WriteOptions};
use faircurve::picture::Picture;
use faircurve::{CurveBatch, CurveStatus, Error, Fit, Result};

use super::report::{head, line};
use super::run::Run;
use super::words::{format, one_of};
use super::{InputArgs, count, output, profile};

/// Béziers stray from a curve by at most this part of the size of its points, where --tolerance
/// does not say how much.
pub const BEZIER_TOLERANCE: f64 = 1e-6;

/// SVG rounds control points to a power of ten of at most this part of --tolerance.
pub const ROUNDING: f64 = 0.01;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Shape {
    /// Points along the curve
    Polyline,
    /// Chains of cubic Béziers: drawn in SVG, control points in CSV and NPZ
    Bezier,
}

/// The width of a picture of one curve, in pixels.
const SMALL_PICTURE: f64 = 520.0;

#[derive(Args, Clone, Debug)]
pub struct CurveArgs {
    #[command(flatten)]
    pub input: InputArgs,
    /// File to write, in the format of its extension
    ///
    /// - writes to standard output, with --to.
    #[arg(short, long, help_heading = "Output")]
    pub output: PathBuf,
    /// Format of the output, where its name does not say it
    #[arg(long, value_name = "FORMAT", value_parser = format(), help_heading = "Output")]
    pub to: Option<Format>,
    /// Rounds coordinates to N decimals, in CSV, GeoJSON, TopoJSON and SVG
    ///
    /// TopoJSON is quantised then. By default --tolerance says how many. Without it GeoJSON has as many as the input's points, but no
    /// fewer than ten significant digits, and for longitudes and latitudes no more than nine
    /// decimals (0.1 mm). The other formats have all digits.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=15), help_heading = "Output")]
    pub digits: Option<u8>,
    /// What happens to curves that cross ±180° of longitude
    #[arg(long, value_parser = one_of(Antimeridian::WORDS), default_value_t = Antimeridian::Cut, value_name = "HOW", help_heading = "Output")]
    pub antimeridian: Antimeridian,
    /// Draws input and curves into an SVG file
    #[arg(long, value_name = "FILE.svg", help_heading = "Picture")]
    pub picture: Option<PathBuf>,
    /// Counts single points as unusable curves, and refuses files without curves
    ///
    /// Single points stay as they are, and are not counted otherwise.
    #[arg(long, help_heading = "Run")]
    pub strict: bool,
    /// Leaves unusable curves out of the output
    ///
    /// By default they are written, with the status of every curve: a column of CSV, an array of
    /// NPZ, a property of GeoJSON and TopoJSON.
    #[arg(long, help_heading = "Output")]
    pub drop_unusable: bool,
}

impl CurveArgs {
    /// How curves are written: their points, or the control points of `beziers`, rounded in SVG.
    pub fn write_options(&self, overwrite: bool, beziers: bool, rounding: Option<f64>) -> WriteOptions {
        let (format, decimals, antimeridian) = (self.to, self.digits, self.antimeridian);
        WriteOptions { format, overwrite, beziers, rounding, decimals, antimeridian, ..WriteOptions::default() }
    }

    /// The format that is written, as far as it is known.
    pub fn format(&self) -> Option<Format> {
        self.to.or_else(|| Format::of_extension(&self.output))
    }

    /// The format in which a batch is written.
    fn format_of(&self, batch: &CurveBatch) -> Option<Format> {
        self.to.or_else(|| Format::to_write(&self.output, batch))
    }

    /// The decimals that are written, if not all.
    pub fn decimals(&self, batch: &CurveBatch) -> Option<u8> {
        let needed = || (self.format_of(batch) == Some(Format::GeoJson)).then(|| io::decimals_of(batch)).flatten();
        self.digits.or_else(needed)
    }

    /// Whether the format writes the decimals asked for, and in the units of the input.
    pub fn rounds(&self, batch: &CurveBatch) -> bool {
        matches!(self.format_of(batch), Some(Format::Csv | Format::GeoJson | Format::TopoJson))
    }

    /// Refuses curves that the format cannot hold, as far as format, dimension and numbers of
    /// points are known. With `--strict` a batch without curves is refused, too.
    pub fn check_format(
        &self,
        batch: &CurveBatch,
        dimension: usize,
        beziers: bool,
        points: impl Fn(usize) -> Option<usize>,
    ) -> Result<()> {
        if self.strict && batch.is_empty() {
            let input = self.input.input.display();
            return Err(Error::argument(format!("{input} has no curve, which --strict refuses: leave it out")));
        }
        let Some(format) = self.format() else { return Ok(()) };
        io::check_before(batch, format, dimension, beziers, points)
    }
}

/// What was made of a batch.
pub struct Made<'a> {
    pub batch: &'a CurveBatch,
    pub fit: &'a Fit,
    /// What is written of it, and how.
    pub curves: CurveBatch,
    pub options: WriteOptions,
    /// The word of the method, and how pictures are drawn.
    pub method: &'static str,
    pub picture: Picture,
    /// What is worth a line about curves that are usable.
    pub notes: Vec<String>,
    /// The unit of λ in the cubed unit of the parameters.
    pub lambda_unit: f64,
}

impl Made<'_> {
    /// Writes, draws, reports and judges it; whether all curves are usable.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(self, mut run: Run, args: &CurveArgs) -> Result<bool> {
        let Made { batch, fit, curves, mut options, .. } = self;
        let (points, unusable) = unusable(args.strict, batch, fit);
        let mut notes = self.notes;
        if args.drop_unusable {
            notes.extend((!unusable.is_empty()).then(|| format!("{} left out", count(unusable.len(), "curve"))));
            options.left_out = unusable.clone();
        } else if let (false, Some(format)) = (unusable.is_empty(), args.format()) {
            options.statuses = fit.reports().iter().map(|report| report.status).collect();
            notes.extend((!format.has_statuses()).then(|| {
                format!(
                    "{} has no place for a status: curves that are not usable are among the others; --drop-unusable leaves them out",
                    format.title()
                )
            }));
        }
        let left_out = left_out(batch, &curves, args);
        run.write(&args.output, || io::write_with(&args.output, &curves, &options))?;
        let mut points_out: Vec<usize> = (0..curves.len()).map(|i| curves.count(i)).collect();
        options.left_out.iter().for_each(|&i| points_out[i] = 0);
        run.draw(args.picture.as_deref(), |path| {
            output::write(path, options.overwrite, |out| self.picture.write(batch, fit, out))
        })?;
        run.report(
            [fit.usable(), fit.len()],
            || head(self.method, fit.device()),
            |i| line(batch, fit, i, points_out[i], self.lambda_unit),
            |i| Some(small_picture(batch, fit, i, &self.picture) + &profile::charts(batch, fit, &curves, i)),
        )?;
        run.tell("", fit.device());
        batch.notes().iter().chain(&notes).chain(&left_out).for_each(|note| run.say(note));
        match points.len() {
            0 => {}
            1 => run.say("1 curve is a single point and stays as it is"),
            n => run.say(format_args!("{} are single points and stay as they are", count(n, "curve"))),
        }
        let reports = fit.reports();
        let of = |i: usize| (reports[i].status, reports[i].message.as_deref(), batch.label(i).to_string());
        Ok(run.judge(fit.len(), &unusable, of))
    }
}

/// What points of the input have that is not written, in a line.
fn left_out(batch: &CurveBatch, curves: &CurveBatch, args: &CurveArgs) -> Option<String> {
    let format = args.to.or_else(|| Format::to_write(&args.output, batch))?;
    let mut names = format.left_out(batch);
    let names_of = |batch: &CurveBatch| -> Vec<String> {
        let times = (0..batch.len()).any(|i| batch.parameters(i).is_some()).then(|| "times".to_string());
        batch.columns().iter().map(|column| column.name.clone()).chain(times).collect()
    };
    let written = names_of(curves);
    let mut lost = names_of(batch);
    lost.retain(|name| !written.contains(name) && !names.contains(name));
    names.extend(lost);
    let (last, them) = (names.pop()?, if names.is_empty() { "it" } else { "them" });
    let are = match &names[..] {
        [] => format!("{last} is"),
        others => format!("{} and {last} are", others.join(", ")),
    };
    Some(format!("{are} left out: {} has no place for {them}", args.output.display()))
}

/// A picture of one curve, like the whole one.
fn small_picture(batch: &CurveBatch, fit: &Fit, i: usize, own: &Picture) -> String {
    let picture = Picture { width: SMALL_PICTURE, title: None, method: String::new(), comb: None, ..own.clone() };
    picture.draw(&batch.select(&[i]), &fit.select(&[i]))
}

/// The curves that are single points, and those that are not usable: single points too where
/// `strict`.
fn unusable(strict: bool, batch: &CurveBatch, fit: &Fit) -> (Vec<usize>, Vec<usize>) {
    let reports = fit.reports();
    let is_point = |&i: &usize| {
        !strict && reports[i].status == CurveStatus::Degenerate && batch.count(i) > 0 && io::is_point(batch, i)
    };
    (0..fit.len()).filter(|&i| !reports[i].status.is_usable()).partition(is_point)
}

/// Largest extent of points along an axis, of those that are finite.
pub fn size(points: &[f64], dimension: usize) -> f64 {
    Bounds::<3>::of_flat(points, dimension).size()
}
