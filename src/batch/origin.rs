//! [`Origin`]: the file that a batch was read from.

use std::any::Any;
use std::borrow::Cow;
use std::sync::Arc;

use super::{Clock, Cut};

/// Where a batch came from.
///
/// It names places in errors, and lets the same document be written back.
#[derive(Clone, Debug, Default)]
#[cfg_attr(not(feature = "formats"), expect(dead_code, reason = "what only files have"))]
pub(crate) struct Origin {
    /// The file's name as the user gave it.
    pub file: Option<String>,
    /// One name a curve. Without names curves are numbered from 0.
    pub names: Option<Vec<String>>,
    /// The line of the first point of every curve, counted from 1.
    ///
    /// Only formats with one line a point have it.
    pub first_lines: Option<Vec<Option<u64>>>,
    /// The curves whose longitudes were carried past ±180 because they cross the antimeridian.
    pub unwrapped: Vec<usize>,
    /// Whether all longitudes were within ±180 as they were read.
    pub within_half_turn: bool,
    /// Whether the file has polygons, whose neighbours share borders.
    pub is_map: bool,
    /// What is worth a line about the file.
    pub notes: Vec<String>,
    /// Whether parameters were given, of which those of samples are made.
    pub timed: bool,
    /// How times are written, where the parameters are times.
    pub clock: Option<Clock>,
    /// How those of every curve are, where not all are given with one offset from UTC.
    pub clocks: Option<Vec<Clock>>,
    /// The curves without parameters in a batch that has parameters, in order.
    pub untimed: Vec<usize>,
    /// Whether x and y of all curves are longitudes and latitudes in degrees.
    pub geographic: bool,
    /// What a format keeps of the file to write it again. Only that format knows the type.
    pub(crate) document: Option<Arc<dyn Any + Send + Sync>>,
    /// What the curves were cut from, if they are pieces of others.
    pub(crate) cut: Option<Cut>,
}

impl Origin {
    /// The name of curve `i`: the one given, or else its number counted from 0.
    pub(crate) fn name(&self, i: usize) -> Cow<'_, str> {
        match &self.names {
            Some(names) => Cow::Borrowed(&names[i]),
            None => Cow::Owned(i.to_string()),
        }
    }

    /// How the times of curve `i` are written, where the parameters are times.
    pub(crate) fn clock(&self, i: usize) -> Option<Clock> {
        self.clocks.as_ref().map(|clocks| clocks[i]).or(self.clock)
    }

    /// `"file, line 12, "` for point `k` of curve `i`, as far as known.
    pub(crate) fn place(&self, i: usize, k: usize) -> String {
        let file = self.file.as_ref().map(|file| format!("{file}, ")).unwrap_or_default();
        let line =
            self.first_lines.as_ref().and_then(|lines| lines[i]).map(|line| format!("line {}, ", line + k as u64));
        file + &line.unwrap_or_default()
    }
}
