//! The program `faircurve-papers`: writes the tables and pictures of the papers.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use clap::builder::PossibleValuesParser;
use faircurve::io::write_atomically;
use faircurve::{Error, Result};
use faircurve_papers::experiments::{EXPERIMENTS, Experiment};

/// Reproduces tables and pictures of the papers.
///
/// The exit status is 0 if everything is as the papers say, 1 if something is not, and 2 if the run
/// failed.
#[derive(Debug, Parser)]
#[command(name = "faircurve-papers", version)]
struct Arguments {
    /// Which experiment; all without it
    #[arg(value_parser = names())]
    name: Option<String>,
    /// Folder for tables (.txt, .csv) and pictures (.svg); made where it is missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replaces outputs that exist
    #[arg(long)]
    force: bool,
    /// Says nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,
    /// Says more
    #[arg(short, long)]
    verbose: bool,
}

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(EXPERIMENTS.iter().map(|experiment| experiment.name))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("faircurve-papers: {error}");
            ExitCode::from(2)
        }
    }
}

/// Runs the experiments asked for. Returns whether all is as the papers say.
fn run(arguments: &Arguments) -> Result<bool> {
    let asked = |experiment: &&Experiment| arguments.name.as_deref().is_none_or(|name| name == experiment.name);
    let chosen: Vec<&Experiment> = EXPERIMENTS.iter().filter(asked).collect();
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    let paths = chosen.iter().flat_map(|experiment| experiment.files).map(|file| folder.join(file));
    if let Some(path) = paths.into_iter().find(|path| !arguments.force && path.exists()) {
        return Err(Error::argument(format!("{} exists already: give --force to replace it", path.display())));
    }
    let mut agrees = true;
    for experiment in chosen {
        let outcome = (experiment.run)()?;
        for (file, text) in experiment.files.iter().zip(&outcome.files) {
            write_atomically(folder.join(file), arguments.force, |out| out.write_all(text.as_bytes()))?;
        }
        let table = outcome.files[0].trim_end();
        writeln!(std::io::stdout(), "{table}").map_err(|source| Error::Stream { source })?;
        if !outcome.agrees && !arguments.quiet {
            eprintln!("faircurve-papers: {} is not as it should be: see its table", experiment.name);
        }
        if arguments.verbose {
            let count = outcome.files.len();
            eprintln!("faircurve-papers: {}: {count} files in {}", experiment.name, folder.display());
        }
        agrees &= outcome.agrees;
    }
    Ok(agrees)
}
