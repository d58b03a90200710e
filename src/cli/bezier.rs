//! `faircurve bezier`: control points in, completed so that their curves bend least; on demand of a
//! higher degree.

use clap::Args;
use faircurve::bezier::MOST_DEGREE;
use faircurve::curve::sample_bytes;
use faircurve::io::{self, Flatness, Format, WriteOptions};
use faircurve::memory;
use faircurve::picture::Picture;
use faircurve::{CurveBatch, CurveStatus, Error, Fit, Result, Sampling, Work};

use super::curves::{BEZIER_TOLERANCE, CurveArgs, Made, ROUNDING, Shape, size};
use super::output::title;
use super::polygons::{Plan, PlanArgs};
use super::run::{Run, RunArgs};
use super::sampling::{per_span, points};
use super::{count, positive, thousands};

/// Arcs of a drawing become cubics within this part of --tolerance.
const ARCS: f64 = 0.01;

#[derive(Args, Debug)]
pub struct BezierArgs {
    #[command(flatten)]
    curves: CurveArgs,
    /// What is written of each curve
    #[arg(long = "as", value_enum, default_value_t = Shape::Bezier, value_name = "SHAPE", help_heading = "Output")]
    shape: Shape,
    #[command(flatten)]
    plan: PlanArgs,
    /// Raises the degree of every piece by N; the curves stay the same
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = "Béziers")]
    elevate: Option<i64>,
    /// Lowers the degree of every piece by N
    ///
    /// The curves are the nearest ones with the same ends.
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "elevate", help_heading = "Béziers")]
    reduce: Option<i64>,
    /// Segments per piece, with --as polyline [default: 16]
    #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = "Output")]
    samples: Option<i64>,
    /// Largest distance of the new cubics from the curves given, with --simplify; of cubics in SVG
    /// from arcs and from curves of higher degree else
    ///
    /// In units of the input [default: 1e-6 of the size, none with --simplify].
    #[arg(long, value_name = "T", allow_negative_numbers = true, help_heading = "Output")]
    tolerance: Option<f64>,
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &BezierArgs) -> Result<bool> {
    let beziers = args.shape == Shape::Bezier;
    let taken = args.rounding(beziers).unwrap_or(0.0) + args.arcs().unwrap_or(0.0);
    let plan = args.plan.plan(&args.curves.input, args.tolerance.map(|tolerance| tolerance - taken))?;
    let [elevate, reduce] = args.changes_of_degree()?;
    args.check()?;

    let mut run = Run::start(&args.run, "curve", ["completing", "completed"]);
    let arcs = args.arcs().map_or(Flatness::OfSize(BEZIER_TOLERANCE), Flatness::Within);
    let batch = plan.read(&args.curves.input, arcs)?;
    args.curves.check_format(&batch, batch.dimension(), args.shape == Shape::Bezier, |_| None)?;
    let volume = format!("{}, {}", count(batch.len(), "curve"), count(batch.total_points(), "control point"));
    // Completing a control point takes the CPU about as long as a point of a natural spline.
    let device = run.device(&Work::splines(points(&batch, Sampling::PerSpan(1))), volume, Some(batch.len()))?;
    let completed = plan.complete(&batch, &device)?;
    let completed = match (elevate, reduce) {
        (Some(by), _) => completed.elevate(by, &device)?,
        (_, Some(by)) => completed.reduce(by, &device)?,
        _ => completed,
    };
    let controls = completed.control_points().clone();
    let simplified = plan.notes(&batch, &controls);
    let degrees: Vec<Option<usize>> = (0..controls.len()).map(|i| completed.degree(i)).collect();
    let fit = completed.into_fit();
    let is_drawn = args.shape == Shape::Bezier && args.curves.format() == Some(Format::Svg);
    let curves = match args.shape {
        Shape::Polyline => {
            let (n, pieces) = (per_span(args.samples)?, (0..fit.len()).map(|i| fit.curve(i).spans()).sum::<usize>());
            memory::check(n as f64 * pieces as f64, sample_bytes(&batch, 0), &format!("{n} samples a piece"), n)?;
            fit.polylines(Sampling::PerSpan(n))
        }
        Shape::Bezier if is_drawn => args.cubics(&plan, &controls, &degrees, &fit)?,
        Shape::Bezier => controls,
    };
    let title = title(&args.curves.input.input);
    let picture = Picture { title, method: args.plan.title(), ..Picture::default() };
    let options = WriteOptions { decimals: args.curves.decimals(&batch), ..args.write_options(is_drawn) };
    let notes = [simplified, not_unique(&fit)].concat();
    let method = "bezier";
    let made = Made { batch: &batch, fit: &fit, curves, options, method, picture, notes, lambda_unit: 1.0 };
    made.finish(run, &args.curves)
}

impl BezierArgs {
    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        if self.shape == Shape::Bezier && self.samples.is_some() {
            return Err(Error::argument(
                "--samples belongs to --as polyline; control points are written as they are: leave it out",
            ));
        }
        per_span(self.samples)?;
        if let Some(tolerance) = self.tolerance {
            let why = "it must be a positive length in units of the input, such as --tolerance 0.001";
            positive("--tolerance", tolerance, why)?;
            let draws = self.shape == Shape::Bezier && self.curves.format() == Some(Format::Svg);
            // Simplified curves may be written as anything.
            if !self.plan.simplifies() && !draws {
                return Err(Error::argument(format!(
                    "--tolerance {tolerance} is how near cubics come to curves of higher degree in SVG, which is not written \
                     here: leave it out"
                )));
            }
        }
        let beziers = self.shape == Shape::Bezier;
        io::check_output(&self.curves.output, &self.write_options(beziers))?;
        self.run.check(Some(&self.curves.output), self.curves.picture.as_deref(), None)
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

    fn write_options(&self, beziers: bool) -> WriteOptions {
        self.curves.write_options(self.run.force, beziers, self.rounding(beziers))
    }

    /// What coordinates of simplified curves in SVG may move by rounding.
    fn rounding(&self, beziers: bool) -> Option<f64> {
        let svg = self.curves.format() == Some(Format::Svg);
        let rounds = beziers && svg && self.plan.simplifies() && self.curves.digits.is_none();
        self.tolerance.filter(|_| rounds).map(|tolerance| ROUNDING * tolerance)
    }

    /// How far the cubics that arcs of a drawing become may be from them.
    fn arcs(&self) -> Option<f64> {
        let svg = self.curves.input.format() == Some(Format::Svg);
        self.tolerance.filter(|_| svg).map(|tolerance| ARCS * tolerance)
    }

    /// Chains of cubics for SVG: control points of cubics as they are, curves of other degrees
    /// within the tolerance.
    fn cubics(&self, plan: &Plan, controls: &CurveBatch, degrees: &[Option<usize>], fit: &Fit) -> Result<CurveBatch> {
        let own = |i: usize| BEZIER_TOLERANCE * size(controls.points(i), controls.dimension());
        let tolerance = self.tolerance.map(|tolerance| tolerance - self.arcs().unwrap_or(0.0));
        let near = fit.beziers_each(|i| tolerance.unwrap_or_else(|| own(i)));
        let d = controls.dimension();
        let (mut coords, mut offsets) = (Vec::with_capacity(near.coords().len()), vec![0]);
        for (i, &degree) in degrees.iter().enumerate() {
            let pieces = controls.spans(i) / 3;
            let whole = controls.count(i) < 2 || pieces * 3 == controls.spans(i);
            // What was not completed is still what was read: of a drawing cubics, else a polygon.
            let is_cubic = degree.map_or(plan.reads_cubics(), |degree| degree == 3);
            let points = if whole && is_cubic { controls.points(i) } else { near.points(i) };
            coords.extend_from_slice(points);
            offsets.push(coords.len() / d);
        }
        near.replaced(coords, offsets)
    }
}

/// Says how many curves could be others as well.
fn not_unique(fit: &Fit) -> Vec<String> {
    let not_unique = fit.reports().iter().filter(|report| report.status == CurveStatus::NotUnique).count();
    if not_unique == 0 {
        return Vec::new();
    }
    let (are, total) = (if not_unique == 1 { "is" } else { "are" }, count(fit.len(), "curve"));
    vec![format!(
        "{} of {total} {are} not unique: too few points are known, and the smallest of equally fair ones was taken",
        thousands(not_unique)
    )]
}
