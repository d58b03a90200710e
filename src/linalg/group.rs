//! [`Group`]: systems side by side, and the way of their rows from arrays into lanes and back.

// Loops over lanes by number become vector instructions.
#![allow(clippy::needless_range_loop)]

use super::scalar::Real;

/// Rows that are carried between the arrays and the lanes at once: L·8 numbers of each array stay
/// in the first cache.
pub(super) const BLOCK: usize = 8;

/// The systems that share a pass through the lanes. Lanes without a system have no rows.
pub(super) struct Group<const L: usize> {
    pub(super) system: [usize; L],
    /// First row in the arrays.
    pub(super) start: [usize; L],
    pub(super) rows: [usize; L],
    pub(super) count: usize,
    pub(super) shortest: usize,
    pub(super) longest: usize,
}

impl<const L: usize> Group<L> {
    /// Systems of a batch, by its first rows and their numbers.
    pub(super) fn new(offsets: &[usize], members: &[usize]) -> Self {
        let mut group =
            Group { system: [0; L], start: [0; L], rows: [0; L], count: members.len(), shortest: 0, longest: 0 };
        for (lane, &i) in members.iter().enumerate() {
            group.system[lane] = i;
            group.start[lane] = offsets[i];
            group.rows[lane] = offsets[i + 1] - offsets[i];
        }
        group.longest = group.rows.iter().copied().max().unwrap_or(0);
        group.shortest = group.rows.iter().copied().min().unwrap_or(0);
        group
    }

    /// Reads up to [`BLOCK`] rows from `row` on of every system into the lanes. `missing` rows at a
    /// system's end are not there to be read.
    #[inline(always)]
    pub(super) fn gather<T: Real>(
        &self,
        source: &[T],
        stride: usize,
        column: usize,
        row: usize,
        missing: usize,
        lanes: &mut [[T; L]; BLOCK],
    ) {
        for j in 0..L {
            let rows = (self.rows[j].saturating_sub(missing)).saturating_sub(row).min(BLOCK);
            let from = (self.start[j] + row) * stride + column;
            if rows == BLOCK {
                let source = &source[from..from + (BLOCK - 1) * stride + 1];
                for b in 0..BLOCK {
                    lanes[b][j] = source[b * stride];
                }
            } else {
                for b in 0..rows {
                    lanes[b][j] = source[from + b * stride];
                }
            }
        }
    }

    /// The way back of [`gather`](Self::gather) into an array that begins with row `start`.
    #[inline(always)]
    pub(super) fn scatter<T: Real>(
        &self,
        lanes: &[[T; L]; BLOCK],
        target: &mut [T],
        stride: usize,
        column: usize,
        row: usize,
        start: usize,
    ) {
        for j in 0..L {
            let rows = self.rows[j].saturating_sub(row).min(BLOCK);
            if rows == 0 {
                continue;
            }
            let from = (self.start[j] - start + row) * stride + column;
            if rows == BLOCK {
                let target = &mut target[from..from + (BLOCK - 1) * stride + 1];
                for b in 0..BLOCK {
                    target[b * stride] = lanes[b][j];
                }
            } else {
                for b in 0..rows {
                    target[from + b * stride] = lanes[b][j];
                }
            }
        }
    }
}
