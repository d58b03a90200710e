//! `faircurve grid`: grids of control points in, subdivided to Laplacian-spline surfaces.

mod report;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use faircurve::io::grids::{self, GridFormat, GridWrite};
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use faircurve::memory;
use faircurve::{DeviceReport, Error, Result, Work};

use serde_json::json;

use super::output::title;
use super::report::head;
use super::run::{Run, RunArgs};
use super::{count, thousands};

/// More rounds would divide a single interval into more pieces than there is memory for.
const MOST_ROUNDS: i64 = 30;

/// A run may write this many values: 16 GiB.
const MOST_VALUES: usize = 1 << 31;

/// The support of sparse rules where --support does not say it.
const SUPPORT: i64 = 5;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum RuleWord {
    /// The equations of least energy are solved: all points count
    Exact,
    /// A small window of weights that solves them nearly
    Sparse,
}

#[derive(Args, Debug)]
pub struct GridArgs {
    /// File of grids to read (.csv, .npz)
    ///
    /// CSV has rows of heights, and a blank line between two grids. NPZ has an array `grids`. -
    /// reads standard input, with --from.
    input: PathBuf,
    /// Format of the input, where its name does not say it
    #[arg(long, value_name = "FORMAT", help_heading = "Input")]
    from: Option<GridFormat>,
    /// File to write (.csv, .npz, .obj for a mesh, .svg for a picture)
    ///
    /// - writes to standard output, with --to.
    #[arg(short, long, help_heading = "Output")]
    output: PathBuf,
    /// Format of the output, where its name does not say it
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    to: Option<GridFormat>,
    /// Rounds of subdivision: each puts a point between any two
    #[arg(long, value_name = "N", default_value_t = 3, allow_negative_numbers = true, help_heading = "Subdivision")]
    rounds: i64,
    /// How new points come about
    #[arg(long, value_enum, default_value_t = RuleWord::Exact, help_heading = "Subdivision")]
    rule: RuleWord,
    /// Width of the window of a sparse rule [default: 5]
    ///
    /// 3, 5, 7, 9 or 11 new points.
    #[arg(long, value_name = "W", allow_negative_numbers = true, help_heading = "Subdivision")]
    support: Option<i64>,
    /// Takes the sparse rule that keeps linear functions, at the borders too
    #[arg(long, help_heading = "Subdivision")]
    linear: bool,
    /// Draws surfaces and control points into an SVG file
    #[arg(long, value_name = "FILE.svg", help_heading = "Picture")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    run: RunArgs,
}

pub fn run(args: &GridArgs) -> Result<bool> {
    args.check()?;
    let mut run = Run::start(&args.run, "grid", ["subdividing", "subdivided"]);
    let grids = grids::read(&args.input, args.from)?;
    let drawn = args.picture.as_ref().map(|_| GridFormat::Svg);
    args.format().into_iter().chain(drawn).try_for_each(|format| format.check(&grids))?;
    let points = args.points_out(&grids)?;
    let volume = format!("{}, {}", count(grids.len(), "grid"), count(grids.total_points(), "point"));
    let device = run.device(&Work::splines(grids.total_points().saturating_add(points)), volume, None)?;
    let subdivide = Subdivide { rule: args.rule()?, rounds: args.rounds as u32 };
    let surfaces = subdivide.fit(&grids, &device)?;
    let (fine, reports, did) = (surfaces.grids(), surfaces.reports(), surfaces.device());
    run.write(&args.output, || grids::write(&args.output, fine, &args.write_options(args.to, &grids, did)))?;
    run.draw(args.picture.as_deref(), |path| grids::write(path, fine, &args.write_options(drawn, &grids, did)))?;
    let is_sparse = args.rule == RuleWord::Sparse;
    let head = || {
        let mut head = head("grid", did);
        head["rule"] = json!(if is_sparse { "sparse" } else { "exact" });
        if is_sparse {
            head["support"] = json!(args.support());
            head["reproduces"] = json!(args.reproduces().word());
        }
        head["rounds"] = json!(subdivide.rounds);
        head
    };
    let line = |i: usize| report::line(&grids, &surfaces, i, subdivide.rounds);
    run.report([surfaces.usable(), grids.len()], head, line, |_| None)?;
    run.tell(&format!(" to {}", thousands(points)), did);
    let unusable: Vec<usize> = (0..grids.len()).filter(|&i| !reports[i].status.is_usable()).collect();
    Ok(run.judge(grids.len(), &unusable, |i| (reports[i].status, reports[i].message.as_deref(), i.to_string())))
}

impl GridArgs {
    /// Checks what can be checked before anything is read.
    fn check(&self) -> Result<()> {
        if !(1..=MOST_ROUNDS).contains(&self.rounds) {
            return Err(Error::argument(format!(
                "--rounds is {}; every round doubles the intervals, and 1 to {MOST_ROUNDS} rounds are possible, such as --rounds 3",
                self.rounds
            )));
        }
        match (self.rule, self.support) {
            (RuleWord::Exact, Some(support)) => {
                return Err(Error::argument(format!(
                    "--support {support} is the window of a sparse rule; with --rule exact all points count: give --rule sparse, or leave it out"
                )));
            }
            (RuleWord::Sparse, Some(support)) if support % 2 == 0 || !(3..=11).contains(&support) => {
                return Err(Error::argument(format!(
                    "--support is {support}; windows are 3, 5, 7, 9 or 11 new points wide: give one of these, such as --support 5"
                )));
            }
            _ => {}
        }
        if self.linear && self.rule == RuleWord::Exact {
            return Err(Error::argument(
                "--linear asks a sparse rule to keep linear functions; the exact rule is the one of least energy, and has no such choice: \
                 give --rule sparse, or leave it out",
            ));
        }
        grids::check_output(
            &self.output,
            &GridWrite { format: self.to, overwrite: self.run.force, ..GridWrite::default() },
        )?;
        self.run.check(Some(&self.output), self.picture.as_deref(), None)
    }

    /// The rule asked for; weights of sparse ones are found here.
    fn rule(&self) -> Result<Rule> {
        match self.rule {
            RuleWord::Exact => Ok(Rule::Exact),
            RuleWord::Sparse => SparseRule::of_support(self.support() as usize, self.reproduces()).map(Rule::Sparse),
        }
    }

    fn support(&self) -> i64 {
        self.support.unwrap_or(SUPPORT)
    }

    fn reproduces(&self) -> Reproduces {
        if self.linear { Reproduces::Linear } else { Reproduces::Constants }
    }

    /// The format that is written, as far as it is known.
    fn format(&self) -> Option<GridFormat> {
        self.to.or_else(|| GridFormat::of_extension(&self.output))
    }

    /// Points that will be written.
    ///
    /// # Errors
    /// More values than there may be, with the number of rounds that is possible.
    fn points_out(&self, grids: &Grids) -> Result<usize> {
        // A value takes its memory twice while grids are made.
        let most = MOST_VALUES.min(memory::most(2 * size_of::<f64>()) as usize);
        let fits = |rounds: u32| points_after(grids, rounds).filter(|points| *points <= most / grids.dimension());
        let rounds = self.rounds as u32;
        if let Some(points) = fits(rounds) {
            return Ok(points);
        }
        let number = match points_after(grids, rounds).and_then(|points| points.checked_mul(grids.dimension())) {
            Some(values) => format!("{} values", thousands(values)),
            None => "more values than can be counted".into(),
        };
        let remedy = match (1..rounds).rev().find(|&rounds| fits(rounds).is_some()) {
            Some(rounds) => format!("give --rounds {rounds} or fewer, or divide the file"),
            None => "divide the file".into(),
        };
        let from = count(grids.total_points(), "point");
        let limit = if most < MOST_VALUES { "fit into the free memory" } else { "are possible" };
        Err(Error::argument(format!(
            "--rounds {rounds} makes {number} of the {from} in {}, and {} {limit}: {remedy}",
            self.input.display(),
            thousands(most)
        )))
    }

    fn write_options<'a>(&self, format: Option<GridFormat>, net: &'a Grids, device: &DeviceReport) -> GridWrite<'a> {
        let rule = match (self.rule, self.linear) {
            (RuleWord::Exact, _) => "exact rule".into(),
            (_, linear) => format!("sparse rule of support {}{}", self.support(), if linear { ", linear" } else { "" }),
        };
        GridWrite {
            format,
            overwrite: self.run.force,
            spacing: 0.5f64.powi(self.rounds as i32),
            net: Some(net),
            title: title(&self.input),
            caption: format!("Laplacian splines, {rule}, {} · {device}", count(self.rounds as usize, "round")),
        }
    }
}

/// Points of all grids after some rounds. `None` if they overflow.
fn points_after(grids: &Grids, rounds: u32) -> Option<usize> {
    let after = |count: usize| match count.checked_sub(1) {
        None => Some(0),
        Some(intervals) => intervals.checked_mul(1 << rounds)?.checked_add(1),
    };
    grids
        .shapes()
        .iter()
        .try_fold(0usize, |sum, &[rows, columns]| sum.checked_add(after(rows)?.checked_mul(after(columns)?)?))
}
