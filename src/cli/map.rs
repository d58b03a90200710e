//! Maps: curves that share borders are fitted border by border.

use std::sync::Arc;

use clap::{Args, ValueEnum};
use faircurve::topology::{Options, Topology};
use faircurve::{CurveBatch, Error, Result};

use super::{count, thousands};

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Shared {
    /// In files with polygons
    Auto,
    /// Always
    Yes,
    /// Never: every curve is fitted by itself
    No,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Junctions {
    /// A border that goes straight on through a junction has no corner there
    Smooth,
    /// Every border ends at its junctions
    Free,
}

#[derive(Args, Debug)]
pub struct MapArgs {
    /// Whether borders that curves share are found, fitted once and stay shared
    #[arg(long, value_enum, default_value_t = Shared::Auto, value_name = "WHEN", help_heading = "Maps")]
    topology: Shared,
    /// Points within D of each other are one
    ///
    /// By default points that are exactly equal are. D is in units of the input.
    #[arg(long, value_name = "D", allow_negative_numbers = true, help_heading = "Maps")]
    snap: Option<f64>,
    /// How borders go through points where three or more meet [default: smooth]
    #[arg(long, value_enum, value_name = "HOW", help_heading = "Maps")]
    junctions: Option<Junctions>,
}

impl MapArgs {
    /// What the curves share, where that is asked for.
    ///
    /// # Errors
    /// Options of maps where no borders are looked for, and those of [`Topology::new`].
    pub fn topology(&self, batch: &CurveBatch) -> Result<Option<Arc<Topology>>> {
        let wanted = match self.topology {
            Shared::Auto => batch.is_map(),
            Shared::Yes => true,
            Shared::No => false,
        };
        if !wanted {
            let given = [("--snap", self.snap.is_some()), ("--junctions", self.junctions.is_some())];
            return match given.into_iter().find(|(_, given)| *given) {
                None => Ok(None),
                Some((option, _)) => Err(Error::argument(format!(
                    "{option} is for borders that curves share, which are not looked for here: add --topology yes"
                ))),
            };
        }
        let mut options = Options::of(batch);
        options.snap = self.snap.unwrap_or(options.snap);
        if self.junctions == Some(Junctions::Free) {
            options.straight = 0.0;
        }
        Topology::new(batch, &options).map(Some)
    }
}

/// What was found, in a line.
pub fn note(topology: &Topology) -> String {
    format!(
        "{} that curves share stay shared, {} stay in place: {} were fitted",
        count(topology.shared_arcs(), "border"),
        count(topology.junctions(), "junction"),
        thousands(topology.strokes().len())
    )
}
