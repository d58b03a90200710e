//! Batches without some of their curves, for writers.

use std::sync::Arc;

use super::{CurveBatch, Origin};

impl CurveBatch {
    /// The batch without the listed curves. Unlike [`select`](Self::select) it keeps the properties
    /// of the file, such as the format of times, and its document.
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

    /// The batch with the listed curves emptied.
    pub(crate) fn emptied(&self, left_out: &[usize]) -> Self {
        let kept = self.without(left_out);
        let mut counts = vec![0; self.len()];
        for i in self.others(left_out) {
            counts[i] = self.count(i);
        }
        CurveBatch {
            offsets: crate::ragged::offsets(counts),
            closed: self.closed.clone(),
            closing_spans: self.closing_spans.clone(),
            problems: self.problems.clone(),
            origin: self.origin.clone(),
            ..kept
        }
    }

    /// The other curves, in order.
    pub(crate) fn others(&self, listed: &[usize]) -> Vec<usize> {
        let mut is_listed = vec![false; self.len()];
        for &i in listed {
            is_listed[i] = true;
        }
        (0..self.len()).filter(|&i| !is_listed[i]).collect()
    }
}
