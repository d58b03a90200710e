//! How a batch is divided among threads.

use std::ops::Range;

/// The fewest rows (or points) of a parallel task: some tens of microseconds of work.
const ROWS_PER_TASK: usize = 4096;

/// Divides the curves, or systems, into runs of about [`ROWS_PER_TASK`] rows, from the offsets of
/// their first rows.
pub(crate) fn tasks(offsets: &[usize]) -> Vec<Range<usize>> {
    let mut tasks = Vec::new();
    let mut from = 0;
    for to in 1..offsets.len() {
        // A curve without rows costs something too.
        if offsets[to] - offsets[from] + (to - from) >= ROWS_PER_TASK || to == offsets.len() - 1 {
            tasks.push(from..to);
            from = to;
        }
    }
    tasks
}

/// Cuts the first `count` entries off a slice that is handed out piece by piece.
pub(crate) fn take<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (head, tail) = std::mem::take(rest).split_at_mut(count);
    *rest = tail;
    head
}
