//! [`Origin`]: the file that a batch was read from.

use std::any::Any;
use std::sync::Arc;

use super::Cut;

/// Where a batch came from: what is needed to name a place in an error, and to write the same
/// document back.
#[derive(Clone, Debug, Default)]
#[cfg_attr(not(feature = "formats"), expect(dead_code, reason = "what only files have"))]
pub(crate) struct Origin {
    /// The file's name as the user gave it.
    pub file: Option<String>,
    /// One name a curve; without them curves are numbered from 0.
    pub names: Option<Vec<String>>,
    /// The line of the first point of every curve, counted from 1, in formats that have one line a
    /// point.
    pub first_lines: Option<Vec<Option<u64>>>,
    /// The curves whose longitudes were carried past ±180 because they cross the antimeridian.
    pub unwrapped: Vec<usize>,
    /// Those of them that wind round a pole, and so became open curves that end 360 degrees from
    /// their start.
    pub round_pole: Vec<usize>,
    /// What a format keeps of the file to write it again; that format alone knows its type.
    pub(crate) document: Option<Arc<dyn Any + Send + Sync>>,
    /// Where the curves are pieces of others: of which.
    pub(crate) cut: Option<Cut>,
}

impl Origin {
    /// `"file, line 12, "` for point `k` of curve `i`, as far as known.
    pub(crate) fn place(&self, i: usize, k: usize) -> String {
        let file = self.file.as_ref().map(|file| format!("{file}, ")).unwrap_or_default();
        let line =
            self.first_lines.as_ref().and_then(|lines| lines[i]).map(|line| format!("line {}, ", line + k as u64));
        file + &line.unwrap_or_default()
    }
}
