//! `faircurve experiments`: the tables and pictures of the papers, computed anew.
//!
//! An experiment is a module of this folder and an entry of [`EXPERIMENTS`].

mod bezier;
mod laplacian;
mod renka;
mod scf;
mod shape;
mod surfaces;
mod toms828;

use std::fmt::{Display, Write as _};
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::PossibleValuesParser;
use faircurve::{Error, Result};

use super::{Talk, output, show};

/// What a paper shows, computed anew.
struct Experiment {
    /// As given on the command line; the names of its files start with it.
    name: &'static str,
    /// The files it writes.
    files: &'static [&'static str],
    /// Computes everything.
    run: fn() -> Result<Outcome>,
}

/// What an experiment found.
struct Outcome {
    /// The text of every file, in the order of [`Experiment::files`]. The first is a table for
    /// people, which is printed as well.
    files: Vec<String>,
    /// Whether everything is as the paper says.
    agrees: bool,
}

/// A table under way, and whether everything in it is as it should be.
struct Record {
    table: String,
    agrees: bool,
    /// What is said of a claim that holds, and of one that does not.
    verdicts: [&'static str; 2],
}

impl Record {
    fn new(head: &str, verdicts: [&'static str; 2]) -> Self {
        Record { table: head.into(), agrees: true, verdicts }
    }

    fn line(&mut self, line: impl Display) {
        let _ = writeln!(self.table, "{line}");
    }

    /// A line with a claim and whether it holds.
    fn check(&mut self, claim: &str, holds: bool) {
        self.agrees &= holds;
        let verdict = self.verdicts[usize::from(!holds)];
        self.line(format_args!("    {claim}: {verdict}"));
    }

    /// The last line: whether everything is as it should be.
    fn end(&mut self, should: &str) {
        self.line(match self.agrees {
            true => format!("\nEverything is as {should}."),
            false => format!("\nSomething is not as {should}: see above."),
        });
    }
}

const EXPERIMENTS: &[Experiment] = &[
    bezier::EXPERIMENT,
    laplacian::EXPERIMENT,
    renka::EXPERIMENT,
    scf::EXPERIMENT,
    shape::EXPERIMENT,
    surfaces::EXPERIMENT,
    toms828::EXPERIMENT,
];

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(EXPERIMENTS.iter().map(|experiment| experiment.name))
}

#[derive(Args, Debug)]
pub struct ExperimentsArgs {
    /// Which experiment; all without it
    #[arg(value_parser = names())]
    name: Option<String>,
    /// Folder for tables (.txt, .csv) and pictures (.svg); made where it is missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replaces outputs that exist
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    talk: Talk,
}

pub fn run(args: &ExperimentsArgs) -> Result<bool> {
    let chosen = |experiment: &&Experiment| args.name.as_deref().is_none_or(|name| name == experiment.name);
    let chosen: Vec<&Experiment> = EXPERIMENTS.iter().filter(chosen).collect();
    let folder = &args.output;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    let paths: Vec<PathBuf> =
        chosen.iter().flat_map(|experiment| experiment.files).map(|file| folder.join(file)).collect();
    let outputs: Vec<(&str, &Path)> = paths.iter().map(|path| ("--output", &**path)).collect();
    output::check(&outputs, args.force)?;

    let mut agrees = true;
    for experiment in chosen {
        let outcome = (experiment.run)()?;
        debug_assert_eq!(outcome.files.len(), experiment.files.len());
        for (file, text) in experiment.files.iter().zip(&outcome.files) {
            output::write(&folder.join(file), args.force, |out| out.write_all(text.as_bytes()))?;
        }
        show(outcome.files[0].trim_end())?;
        if !outcome.agrees {
            args.talk.say(format_args!("{} is not as it should be: see its table", experiment.name));
        }
        args.talk.detail(format_args!("{}: {} files in {}", experiment.name, outcome.files.len(), folder.display()));
        agrees &= outcome.agrees;
    }
    Ok(agrees)
}
