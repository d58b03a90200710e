//! Maps: curves that share borders are fitted border by border.

use std::sync::Arc;

use clap::{Args, ValueEnum};
use faircurve::topology::{Crossing, Divided, Faults, Fitted, Mended, Options, Sampled, Topology};
use faircurve::{CurveBatch, Deviation, Error, Result};

use super::given::Given;
use super::lengths::Length;
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
enum Only {
    /// The borders that one polygon has alone
    Coast,
    /// The borders between polygons
    Shared,
    /// Of SVG all but rectangles, circles, ellipses and lines
    Paths,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Junctions {
    /// A border that goes straight on through a junction has no corner there
    Smooth,
    /// Every border ends at its junctions
    Free,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Crossings {
    /// They are counted, and the first are named
    Count,
    /// They are mended: spans that cross are drawn tighter, as far as it takes, in what is written
    /// with --digits
    Mend,
    /// They are not looked for
    Ignore,
}

/// Rings with less than half of their area look lost.
const KEEP_AREA: f64 = 0.5;

/// The number of crossings that are named.
const NAMED: usize = 3;

#[derive(Args, Clone, Debug)]
pub struct MapArgs {
    #[command(flatten)]
    given: Given,
    /// Whether borders that curves share are found, fitted once and stay shared
    #[arg(long, value_enum, default_value_t = Shared::Auto, value_name = "WHEN", help_heading = "Maps")]
    topology: Shared,
    /// What is fitted; the rest stays as it is, bit for bit
    #[arg(long, value_enum, value_name = "WHAT", help_heading = "Maps")]
    only: Option<Only>,
    /// Points within D of each other are one
    ///
    /// By default only points that are exactly equal are one. D is in units of the input.
    #[arg(long, value_name = "D", allow_negative_numbers = true, help_heading = "Maps")]
    snap: Option<Length>,
    /// How borders go through points where three or more meet [default: smooth, with
    /// --preserve-area free]
    #[arg(long, value_enum, value_name = "HOW", help_heading = "Maps")]
    junctions: Option<Junctions>,
    /// What is done where curves cross each other or themselves [default: mend in files with
    /// polygons, count in others]
    #[arg(long, value_enum, value_name = "HOW", help_heading = "Maps")]
    crossings: Option<Crossings>,
    /// The share of its area that a ring keeps, with --crossings mend [default: 0.5]
    ///
    /// Rings that would have less are brought back towards their points. 0 lets them shrink.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, help_heading = "Maps")]
    keep_area: Option<f64>,
}

impl MapArgs {
    /// What the curves share, where that is asked for, and else the frame of the map. `option` is
    /// one that is of each curve. `keeps_area` says whether every border is to keep its area.
    ///
    /// # Errors
    /// Options of maps if borders are not looked for, options of single curves if they are, and the
    /// errors of [`Topology::new`].
    pub fn topology(
        &self,
        batch: &CurveBatch,
        option: Option<&str>,
        keeps_area: bool,
    ) -> Result<Option<Arc<Topology>>> {
        let wanted = match self.topology {
            Shared::Auto => batch.is_map(),
            Shared::Yes => true,
            Shared::No => false,
        };
        if !wanted {
            let is_of_borders = |option: &String| option != "--topology" && (option != "--only" || !self.only_paths());
            return match self.given.of::<Self>().into_iter().find(is_of_borders) {
                None if batch.has_unselected() => match option {
                    None => Topology::apart(batch).map(Some),
                    Some(option) => {
                        Err(Error::argument(format!("{option} is of each curve, and --where keeps some as they are")))
                    }
                },
                None if batch.is_map() && option.is_none() => Topology::frame(batch),
                None => Ok(None),
                Some(option) => Err(Error::argument(format!(
                    "{option} is for borders that curves share, which are not looked for here: add --topology yes"
                ))),
            };
        }
        if let Some(option) = option {
            return Err(Error::argument(format!(
                "{option} is of each curve, but borders are shared: add --topology no"
            )));
        }
        if let (Some(share), false) = (self.keep_area, self.crossings(batch) == Crossings::Mend) {
            return Err(Error::argument(format!(
                "--keep-area {share} is kept where crossings are mended: add --crossings mend"
            )));
        }
        let mut options = Options::of(batch);
        options.snap = self.snap.map_or(options.snap, Length::number);
        options.fitted = match self.only {
            None | Some(Only::Paths) => Fitted::All,
            Some(Only::Coast) => Fitted::Outer,
            Some(Only::Shared) => Fitted::Shared,
        };
        let by_default = if keeps_area { Junctions::Free } else { Junctions::Smooth };
        if self.junctions.unwrap_or(by_default) == Junctions::Free {
            options.straight = 0.0;
        }
        Topology::new(batch, &options).map(Some)
    }

    /// --snap, if it is given.
    pub fn snap(&mut self) -> Option<&mut Deviation> {
        self.snap.as_mut().map(|length| &mut length.0)
    }

    /// Checks what can be checked before anything is read.
    pub fn check(&self) -> Result<()> {
        match self.keep_area {
            Some(share) if !(0.0..=1.0).contains(&share) => Err(Error::argument(format!(
                "--keep-area is {share}; it is a share of a ring's area, from 0 to 1, such as --keep-area {KEEP_AREA}"
            ))),
            _ => Ok(()),
        }
    }

    /// Whether a part of the map stays as it is, bit for bit.
    pub fn keeps_a_part(&self, batch: &CurveBatch) -> bool {
        matches!(self.only, Some(Only::Coast | Only::Shared)) || batch.has_unselected()
    }

    /// Whether the exact shapes of a drawing stay as they are.
    pub fn only_paths(&self) -> bool {
        self.only == Some(Only::Paths)
    }

    fn crossings(&self, batch: &CurveBatch) -> Crossings {
        self.crossings.unwrap_or(if batch.is_map() { Crossings::Mend } else { Crossings::Count })
    }

    /// The fitted strokes, mended where that is asked for, and what is worth a line. Samples have
    /// this number of decimals.
    pub fn mend(&self, topology: &Topology, strokes: Sampled, decimals: Option<u8>) -> (Sampled, Vec<String>) {
        if self.topology == Shared::No {
            return (strokes, vec![]);
        }
        let mut notes: Vec<String> = note(topology).into_iter().collect();
        match self.crossings(topology.curves()) {
            Crossings::Ignore => (strokes, notes),
            Crossings::Count => {
                notes.extend(notes_of_faults(topology, &strokes.faults()));
                (strokes, notes)
            }
            Crossings::Mend => {
                let share = self.keep_area.unwrap_or(KEEP_AREA);
                let (strokes, mended) = strokes.mend(share);
                notes.extend(notes_of_mended(topology, &mended, share, decimals));
                (strokes, notes)
            }
        }
    }
}

/// What is worth a line about faults that stay.
fn notes_of_faults(topology: &Topology, faults: &Faults) -> impl Iterator<Item = String> {
    let Faults { crossings, of_data, misplaced } = faults;
    let crossed = (!crossings.is_empty()).then(|| {
        let of_data = if *of_data > 0 { format!(" ({} in the data)", thousands(*of_data)) } else { String::new() };
        let named = named(topology, crossings);
        format!("{}{of_data}: {named}; --crossings mend mends them", count(crossings.len(), "crossing"))
    });
    let misplaced = misplaced.first().map(|&first| {
        let (all, first) = (count(misplaced.len(), "ring"), topology.curves().label(first));
        format!("{all} came to lie on the other side of others, such as {first}; --crossings mend mends that")
    });
    crossed.into_iter().chain(misplaced)
}

/// What is worth a line about faults that were mended.
fn notes_of_mended(
    topology: &Topology,
    mended: &Mended,
    share: f64,
    digits: Option<u8>,
) -> impl Iterator<Item = String> {
    let Mended { before, left, left_out, lost, decimals, tightened, kept, misplaced, astray } = mended;
    let why = if decimals.is_some() { "in the data or once rounded" } else { "which the data have" };
    let which = if left.is_empty() { String::new() } else { format!(", {why}: {}", named(topology, left)) };
    let (crossings, spans, left) = (count(*before, "crossing"), count(*tightened, "span"), thousands(left.len()));
    let has = |n: usize, one: &'static str, more: &'static str| if n == 1 { one } else { more };
    let mended_sides = misplaced.saturating_sub(astray.len());
    let [left_out_points, kept_rings, misplaced_rings] =
        [(*left_out, "point"), (*kept, "ring"), (mended_sides, "ring")].map(|(n, what)| count(n, what));
    let rings = |of: &[usize], what: String| {
        let first = topology.curves().label(*of.first()?);
        Some(format!("{} {what}, such as {first}", count(of.len(), "ring")))
    };
    let lost = rings(lost, format!("{} less than {share} of their area", has(lost.len(), "has", "have")));
    let astray = rings(astray, format!("{} on the other side of others", has(astray.len(), "lies", "lie")));
    let rounded = digits.zip(*decimals);
    let notes = [
        Some(format!("{crossings}: {spans} were drawn tighter, {left} left{which}")),
        (*kept > 0).then(|| format!("{kept_rings} would have had less than {share} of their area, and keep more")),
        (mended_sides > 0)
            .then(|| format!("{misplaced_rings} would have come to lie on the other side of others, and do not")),
        (*left_out > 0).then(|| {
            format!("{left_out_points} {} left out where rounding folds a border", has(*left_out, "was", "were"))
        }),
        lost,
        astray,
        rounded.map(|(digits, more)| format!("{digits} decimals do not keep apart what is left: --digits {more} does")),
    ];
    notes.into_iter().flatten()
}

/// The first of some crossings.
fn named(topology: &Topology, crossings: &[Crossing]) -> String {
    let name = |crossing: &Crossing| {
        let [a, b] = crossing.curves.map(|i| topology.curves().label(i));
        let [x, y] = crossing.at;
        if a == b {
            format!("curve {a} with itself near {x:.4}, {y:.4}")
        } else {
            format!("curves {a} and {b} near {x:.4}, {y:.4}")
        }
    };
    let mut named = crossings.iter().take(NAMED).map(name).collect::<Vec<_>>().join("; ");
    if crossings.len() > NAMED {
        named += "; …";
    }
    named
}

/// What was divided, in a line.
pub fn note_of(divided: &Divided) -> String {
    let (whole, arcs) = (count(divided.count(), "curve"), count(divided.arcs().len(), "border"));
    format!("{whole} through junctions had no fit as a whole: their {arcs} were fitted one by one")
}

/// What was found, in a line, if anything was.
fn note(topology: &Topology) -> Option<String> {
    if topology.shared_arcs() + topology.junctions() == 0 {
        return None;
    }
    let strokes = topology.strokes();
    let fitted = (0..strokes.len()).filter(|&i| strokes.problem(i).is_none()).count();
    Some(format!(
        "{} that curves share stay shared, and {} stay in place: {} were fitted",
        count(topology.shared_arcs(), "border"),
        count(topology.junctions(), "junction"),
        count(fitted, "curve")
    ))
}
