//! The command line: one file a subcommand, and what the subcommands share.
//!
//! Exit codes stand in `EXIT_STATUS`. Results go to files or to stdout, every other word to
//! stderr.

mod bezier;
mod clean;
mod compare;
mod costs;
mod curves;
mod device;
mod doctor;
mod drive;
mod exponent;
mod fit;
mod given;
mod grid;
mod html;
mod interrupt;
mod jobs;
mod lengths;
mod machine;
mod map;
mod method;
mod output;
mod polygons;
mod profile;
mod progress;
mod report;
mod run;
mod sampling;
mod track;
mod words;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use faircurve::io::{self, Closed, Columns, Flatness, Format, ReadOptions};
use faircurve::picture::drawing::thousands;
use faircurve::{CurveBatch, Error, Result};

use words::with_options;

/// What `--help` says of the exit status.
const EXIT_STATUS: &str = "\
Exit status:
  0  all is well
  1  fit, bezier, grid, exponent: some curves or grids could not be used, and are listed;
     compare, doctor: a difference beyond its bound was found
  2  the run failed: the last line on standard error says why
A curve that is a single point has nothing to fit, stays as it is, and leaves the status 0 unless --strict is given.
A file without curves leaves the status 0, too, unless --strict is given.";

/// Fair curves by the thousand: fits smooth curves to files full of points, on the GPU or on the
/// CPU.
#[derive(Debug, Parser)]
#[command(name = "faircurve", version, arg_required_else_help = true, after_help = EXIT_STATUS)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit a curve to every point list of a file
    #[command(after_help = EXIT_STATUS)]
    Fit(Box<fit::FitArgs>),
    /// Complete Bézier control points so that the curves bend least, and raise their degree
    #[command(after_help = EXIT_STATUS)]
    Bezier(bezier::BezierArgs),
    /// Subdivide grids of control points to Laplacian-spline surfaces
    #[command(after_help = EXIT_STATUS)]
    Grid(grid::GridArgs),
    /// Find the exponent ν of each curve and of its pieces: the one whose smooth connection
    /// functions come nearest
    #[command(after_help = EXIT_STATUS)]
    Exponent(exponent::ExponentArgs),
    /// Fit on the CPU in f64 and on the device, and compare the curves one by one
    #[command(after_help = EXIT_STATUS)]
    Compare(Box<compare::CompareArgs>),
    /// Say what this machine offers, and test that it computes correctly
    #[command(after_help = EXIT_STATUS)]
    Doctor(doctor::DoctorArgs),
}

/// A mistyped subcommand has at most this many letters missing, wrong, added or exchanged.
const MISTYPED: usize = 2;

/// Points along the paths of a drawing: their chords are within this part of a path's size.
const FLATNESS: f64 = 1e-3;

/// What is read, and how.
#[derive(Args, Clone, Debug)]
struct InputArgs {
    /// File to read, in a format that --to lists
    ///
    /// - reads standard input, with --from.
    input: PathBuf,
    /// Format of the input, where its name does not say it
    #[arg(long, value_name = "FORMAT", value_parser = words::format(), hide_possible_values = true, help_heading = "Input")]
    from: Option<Format>,
    /// CSV columns by role, such as x=lon,y=lat,curve=id,t=hours
    ///
    /// Columns that are not named are dropped.
    #[arg(long, value_name = "ROLE=COLUMN,...", help_heading = "Input")]
    columns: Option<Columns>,
    /// Sorts the rows of each curve of a CSV file by their times
    #[arg(long, value_name = "t", value_parser = ["t"], help_heading = "Input")]
    sort: Option<String>,
    /// Whether curves are closed
    ///
    /// auto closes those whose last point repeats their first.
    #[arg(long, value_name = "auto|yes|no", default_value = "auto", help_heading = "Input")]
    closed: Closed,
}

impl InputArgs {
    fn read(&self) -> Result<CurveBatch> {
        io::read_with(&self.input, &self.options())
    }

    /// How the file is read.
    fn options(&self) -> ReadOptions {
        ReadOptions {
            format: self.from,
            columns: self.columns.clone().unwrap_or_default(),
            closed: self.closed,
            sorted: self.sort.is_some(),
            flatness: Some(Flatness::OfSize(FLATNESS)),
            ..ReadOptions::default()
        }
    }

    /// The format that is read, as far as it is known.
    fn format(&self) -> Option<Format> {
        self.from.or_else(|| Format::of_extension(&self.input))
    }
}

/// How much is said on stderr.
#[derive(Args, Clone, Copy, Debug)]
struct Talk {
    /// Says nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Run")]
    quiet: bool,
    /// Says more: times, what was chosen for a GPU, and every curve that is not usable
    #[arg(short, long, help_heading = "Run")]
    verbose: bool,
}

impl Talk {
    fn say(self, line: impl std::fmt::Display) {
        if !self.quiet {
            eprintln!("faircurve: {}", with_options(line));
        }
    }

    fn detail(self, line: impl std::fmt::Display) {
        if self.verbose {
            eprintln!("faircurve: {}", with_options(line));
        }
    }
}

/// Writes a line to standard output.
///
/// # Errors
/// Nobody reads it any more, or it is a file on a full disk.
fn show(line: impl std::fmt::Display) -> Result<()> {
    writeln!(std::io::stdout(), "{line}").map_err(|source| Error::Stream { source })
}

/// Runs the program with these arguments, its name first; its exit status. A `true` from a
/// subcommand means that everything was as it should be.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    interrupt::remove_half_written();
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let matches = Cli::command().subcommands(jobs::commands()).try_get_matches_from(&arguments);
    let cli = matches.and_then(|matches| match jobs::expanded(&arguments, &matches) {
        Some(expanded) => Cli::try_parse_from(expanded),
        None => Cli::from_arg_matches(&matches),
    });
    let cli = match cli {
        Ok(cli) => cli,
        Err(error) => {
            let error = with_nearest_subcommand(error);
            // Nobody may read standard error.
            let _ = error.print();
            return error.exit_code() as u8;
        }
    };
    let result = match cli.command {
        Command::Fit(args) => fit::run(&args),
        Command::Bezier(args) => bezier::run(&args),
        Command::Grid(args) => grid::run(&args),
        Command::Exponent(args) => exponent::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    };
    match result {
        Ok(true) => 0,
        Ok(false) => 1,
        // Whoever reads our output has stopped reading: nothing is left to say.
        Err(Error::Write { source, .. } | Error::Stream { source })
            if source.kind() == std::io::ErrorKind::BrokenPipe =>
        {
            2
        }
        Err(error) => {
            eprintln!("faircurve: {}", with_options(error));
            2
        }
    }
}

/// The error of a mistyped subcommand with the nearest one as a tip, where clap itself sees none:
/// `fti` is `fit` with two letters exchanged.
fn with_nearest_subcommand(mut error: clap::Error) -> clap::Error {
    if error.get(ContextKind::SuggestedSubcommand).is_none()
        && let Some(ContextValue::String(typed)) = error.get(ContextKind::InvalidSubcommand)
    {
        let command = Cli::command().subcommands(jobs::commands());
        let distance = |name: &str| strsim::damerau_levenshtein(typed, name);
        let nearest = command.get_subcommands().map(|command| command.get_name()).min_by_key(|name| distance(name));
        if let Some(nearest) = nearest.filter(|name| distance(name) <= MISTYPED) {
            error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![nearest.to_string()]));
        }
    }
    error
}

/// An option that must be a positive number. `meaning` says what it is, and gives an example.
///
/// # Errors
/// Another number.
fn positive(option: &str, number: f64, meaning: &str) -> Result<f64> {
    match number > 0.0 && number.is_finite() {
        true => Ok(number),
        false => Err(Error::argument(format!("{option} is {number}; {meaning}"))),
    }
}

/// Whether a file's name ends in one of these extensions.
fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|found| extensions.iter().any(|extension| found.eq_ignore_ascii_case(extension)))
}

/// "1 curve", "2,000 curves".
fn count(n: usize, what: &str) -> String {
    format!("{} {what}{}", thousands(n), if n == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().subcommands(jobs::commands()).debug_assert();
    }

    #[test]
    fn counts_are_readable() {
        assert_eq!(
            [count(1, "curve"), count(0, "curve"), count(1234567, "point")],
            ["1 curve", "0 curves", "1,234,567 points"]
        );
    }
}
