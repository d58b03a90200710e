//! [`Origin`]: the provenance of a batch. [`Cut`]: the provenance of points that come from other
//! curves.

use std::any::Any;
use std::borrow::Cow;
use std::sync::Arc;

use super::Clock;
use crate::error::shortened;

/// The provenance of a batch: places for messages, and the document to write back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origin {
    /// The file's name, as given.
    pub file: Option<String>,
    /// One name per curve. Without names curves are numbered from 0.
    pub names: Option<Vec<String>>,
    /// The line of the first point of every curve, counted from 1, for formats with one line per
    /// point.
    pub first_lines: Option<Vec<Option<u64>>>,
    /// The curves whose longitudes continue past ±180 across the antimeridian.
    pub unwrapped: Vec<usize>,
    /// Whether all longitudes in the file are within ±180.
    pub within_half_turn: bool,
    /// The first curve of every feature, and what people call it, such as Fiji.
    pub titles: Vec<(usize, Option<String>)>,
    /// The curves that were not selected, in order: they stay as they are.
    pub unselected: Vec<usize>,
    /// Whether the file has polygons, whose neighbours share borders.
    pub is_map: bool,
    /// Notes about the file, one line each.
    pub notes: Vec<String>,
    /// Whether parameters were given.
    pub timed: bool,
    /// The format of times, if the parameters are times.
    pub clock: Option<Clock>,
    /// The format per curve, if offsets from UTC differ.
    pub clocks: Option<Vec<Clock>>,
    /// The curves without parameters in a batch with parameters, in order.
    pub untimed: Vec<usize>,
    /// Whether x and y are longitudes and latitudes in degrees.
    pub geographic: bool,
    /// Metres in a unit of the coordinates, if the file says so.
    pub metres: Option<f64>,
    /// The document that a format keeps to write it back.
    pub(crate) document: Option<Arc<dyn Any + Send + Sync>>,
    /// The original curves, if these are pieces.
    pub(crate) cut: Option<Cut>,
}

impl Origin {
    /// The name of curve `i`, or its number counted from 0.
    pub(crate) fn name(&self, i: usize) -> Cow<'_, str> {
        match &self.names {
            Some(names) => Cow::Borrowed(&names[i]),
            None => Cow::Owned(i.to_string()),
        }
    }

    /// What messages call curve `i`: its name, and what people call its feature.
    pub(crate) fn label(&self, i: usize) -> String {
        let name = self.name(i);
        let feature = self.titles.partition_point(|(first, _)| *first <= i).checked_sub(1);
        match feature.and_then(|feature| self.titles[feature].1.as_deref()).filter(|title| *title != name) {
            Some(title) => format!("{} ({})", shortened(&name), shortened(title)),
            None => shortened(&name).into_owned(),
        }
    }

    /// The format of the times of curve `i`, if the parameters are times.
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

/// The original points of curves, for messages.
#[derive(Clone, Debug)]
pub(crate) struct Cut {
    /// The origin of the original curves.
    pub whole: Arc<Origin>,
    pub(super) offsets: Vec<usize>,
    /// The original curve at the start of every curve, which may have no points.
    pub(super) curves: Vec<u32>,
    /// The original curve and point of every point.
    pub(super) points: Vec<(u32, u32)>,
}

impl Cut {
    /// The original curve and point of point `k` of curve `i`.
    pub fn given(&self, i: usize, k: usize) -> (usize, usize) {
        let of_curve = &self.points[self.offsets[i]..self.offsets[i + 1]];
        let (curve, point) = of_curve.get(k).copied().unwrap_or((self.curves[i], 0));
        (curve as usize, point as usize)
    }
}
