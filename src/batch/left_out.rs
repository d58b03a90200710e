//! Batches without some of their curves, as they are written.

use std::sync::Arc;

use super::{CurveBatch, Origin};

impl CurveBatch {
    /// The batch without the curves listed. Unlike [`select`](Self::select) it keeps what its file said of all
    /// curves, such as how times are written, and its document.
    pub(crate) fn without(&self, left_out: &[usize]) -> Self {
        let kept = self.others(left_out);
        let selected = self.select(&kept);
        let numbers = |curves: &[usize]| curves.iter().filter_map(|i| kept.binary_search(i).ok()).collect();
        let origin = Origin {
            names: selected.origin().names.clone(),
            first_lines: None,
            cut: None,
            unwrapped: numbers(&self.origin.unwrapped),
            ..Origin::clone(&self.origin)
        };
        selected.with_origin(Arc::new(origin))
    }

    /// The same curves, of which those listed have no points.
    pub(crate) fn emptied(&self, left_out: &[usize]) -> Self {
        let kept = self.without(left_out);
        let mut counts = vec![0; self.len()];
        self.others(left_out).into_iter().for_each(|i| counts[i] = self.count(i));
        CurveBatch {
            offsets: crate::ragged::offsets(counts),
            closed: self.closed.clone(),
            closing_spans: self.closing_spans.clone(),
            problems: self.problems.clone(),
            origin: self.origin.clone(),
            ..kept
        }
    }

    /// The curves that are not listed, in order.
    pub(crate) fn others(&self, listed: &[usize]) -> Vec<usize> {
        let mut is_listed = vec![false; self.len()];
        listed.iter().for_each(|&i| is_listed[i] = true);
        (0..self.len()).filter(|&i| !is_listed[i]).collect()
    }
}
