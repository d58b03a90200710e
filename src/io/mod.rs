//! Files in and out: one file a format, chosen by extension.

/// Where a batch came from: what is needed to name a place in an error, and to write the same document back.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// The file's name as the user gave it.
    pub file: Option<String>,
    /// One name a curve; without them curves are numbered from 0.
    pub names: Option<Vec<String>>,
    /// The line of the first point of every curve, counted from 1, in formats that have one line a point.
    pub first_lines: Option<Vec<Option<u64>>>,
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
