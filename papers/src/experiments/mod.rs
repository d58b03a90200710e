//! The tables and pictures of the papers, computed again.
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

use faircurve::Result;

/// What a paper shows.
pub struct Experiment {
    /// As given on the command line; the names of its files start with it.
    pub name: &'static str,
    /// The files it writes.
    pub files: &'static [&'static str],
    /// Computes everything.
    pub run: fn() -> Result<Outcome>,
}

/// The result of an experiment.
pub struct Outcome {
    /// The text of every file, in the order of [`Experiment::files`]. The first is a table for
    /// people, which is printed as well.
    pub files: Vec<String>,
    /// Whether everything is as the paper says.
    pub agrees: bool,
}

/// A table under way, and whether everything in it is as it should be.
struct Record {
    table: String,
    agrees: bool,
    /// The words for a claim that holds and for one that fails.
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

/// All experiments.
pub const EXPERIMENTS: &[Experiment] = &[
    bezier::EXPERIMENT,
    laplacian::EXPERIMENT,
    renka::EXPERIMENT,
    scf::EXPERIMENT,
    shape::EXPERIMENT,
    surfaces::EXPERIMENT,
    toms828::EXPERIMENT,
];
