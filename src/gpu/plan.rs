//! Sizes and chunks for a device's limits: pure functions, tested without a device.

use std::ops::Range;

use crate::error::{Error, Result};

/// The most iterations that a thread's loops may take together in one dispatch.
///
/// llvmpipe silently ends loops after 65,535 iterations. Watchdogs of hardware end long dispatches.
pub const LOOP_TURNS: usize = 60_000;

/// Bytes of all buffers of one chunk, unless a caller says otherwise.
///
/// Two such chunks fit on a modest GPU at once, and one is large enough to hide the round trip. On a
/// large card a chunk of 256 MiB holds a third of the curves that it can descend at once.
#[cfg(feature = "gpu")]
pub(super) const fn chunk_bytes(is_discrete: bool, buffer_bytes: u64) -> u64 {
    if is_discrete && buffer_bytes >= 4 << 30 { 1 << 30 } else { 256 << 20 }
}

/// The limits of a device that matter here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest storage binding.
    pub binding_bytes: u64,
    /// Largest buffer.
    pub buffer_bytes: u64,
    /// Workgroup memory.
    pub workgroup_bytes: u32,
    /// Threads of a workgroup.
    pub workgroup_threads: u32,
    /// Storage bindings of a kernel.
    pub storage_bindings: u32,
    /// Workgroups along one dimension of a dispatch.
    pub workgroups: u32,
    /// Bytes that all buffers of a chunk may take together.
    pub chunk_bytes: u64,
}

impl Limits {
    /// The same limits with chunks of at most `bytes` bytes.
    pub fn with_chunks_of(self, bytes: u64) -> Self {
        Limits { chunk_bytes: self.chunk_bytes.min(bytes), ..self }
    }

    /// The largest single array a chunk may hold.
    pub fn array_bytes(&self) -> u64 {
        self.binding_bytes.min(self.buffer_bytes)
    }
}

/// Divides curves, in order, into chunks that fit a device.
///
/// No array of a chunk exceeds a binding, and all its arrays together stay below the chunk size.
/// `points[i]` is the size of curve `i`. A point takes `largest_bytes` in the largest array and
/// `total_bytes` in all arrays together.
///
/// # Errors
/// [`Error::Limit`] if a single curve does not fit. It never will, on this device.
pub fn chunks(
    points: impl IntoIterator<Item = usize>,
    largest_bytes: u64,
    total_bytes: u64,
    limits: &Limits,
) -> Result<Vec<Range<usize>>> {
    let mut points = points.into_iter();
    divided(&mut || points.next(), largest_bytes, total_bytes, limits)
}

fn divided(
    points: &mut dyn FnMut() -> Option<usize>,
    largest_bytes: u64,
    total_bytes: u64,
    limits: &Limits,
) -> Result<Vec<Range<usize>>> {
    let single = limits.array_bytes() / largest_bytes.max(1);
    let together = (limits.chunk_bytes / total_bytes.max(1)).clamp(1, single);
    let mut chunks = Vec::new();
    let (mut start, mut held, mut count) = (0, 0u64, 0);
    for (i, points) in std::iter::from_fn(points).enumerate() {
        let points = points as u64;
        if points > single {
            return Err(Error::Limit {
                what: format!("curve {i} with {points} points"),
                asked: points * largest_bytes,
                allowed: limits.array_bytes(),
                remedy: "fit it on the CPU, or with fewer samples".into(),
            });
        }
        if held > 0 && held + points > together {
            chunks.push(start..i);
            (start, held) = (i, 0);
        }
        held += points;
        count = i + 1;
    }
    if count > start {
        chunks.push(start..count);
    }
    Ok(chunks)
}

/// The workgroups of a two-dimensional dispatch of tasks, `per_group` in a workgroup.
///
/// # Errors
/// [`Error::Limit`] beyond the square of the device's limit.
pub fn workgroups(tasks: usize, per_group: usize, limits: &Limits) -> Result<[u32; 3]> {
    let groups = tasks.div_ceil(per_group) as u64;
    let width = u64::from(limits.workgroups);
    let rows = groups.div_ceil(width);
    if rows > width {
        let what = format!("a dispatch of {tasks} tasks");
        return Err(Error::Limit { what, asked: groups, allowed: width * width, remedy: "divide the batch".into() });
    }
    let across = if rows > 0 { groups.div_ceil(rows) } else { 0 };
    Ok([across as u32, rows as u32, 1])
}

/// Sorts indices into buckets by the first bound not below their size.
///
/// Returns the order and one range of it for each bound. Sizes above the last bound are in the last
/// bucket.
pub fn buckets(sizes: &[usize], bounds: &[usize]) -> (Vec<u32>, Vec<Range<usize>>) {
    let bucket = |size: usize| bounds.partition_point(|&bound| bound < size);
    let mut order = Vec::with_capacity(sizes.len());
    let mut ranges = Vec::with_capacity(bounds.len() + 1);
    for b in 0..=bounds.len() {
        let start = order.len();
        order.extend((0..sizes.len() as u32).filter(|&i| bucket(sizes[i as usize]) == b));
        ranges.push(start..order.len());
    }
    (order, ranges)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        binding_bytes: 1000,
        buffer_bytes: 2000,
        workgroup_bytes: 16384,
        workgroup_threads: 256,
        storage_bindings: 8,
        workgroups: 10,
        chunk_bytes: 3000,
    };

    #[test]
    fn chunks_cover_every_curve_once_and_respect_both_limits() {
        let points = [50, 50, 50, 1, 0, 99, 100, 7];
        let chunks = chunks(points, 10, 25, &LIMITS).unwrap();
        assert_eq!(chunks, [0..2, 2..5, 5..6, 6..7, 7..8]);
        for chunk in &chunks {
            let held: usize = points[chunk.clone()].iter().sum();
            assert!(held * 10 <= 1000 && held * 25 <= 3000);
        }
    }

    #[test]
    #[cfg(feature = "gpu")]
    fn chunks_of_large_discrete_cards_are_a_gibibyte() {
        let mebibytes = |is_discrete, buffer: u64| super::chunk_bytes(is_discrete, buffer << 30) >> 20;
        assert_eq!([mebibytes(true, 4), mebibytes(true, 2), mebibytes(false, 4)], [1024, 256, 256]);
    }

    #[test]
    fn a_curve_that_never_fits_is_refused_with_sizes_and_remedy() {
        let error = chunks([3, 101], 10, 25, &LIMITS).unwrap_err().to_string();
        assert_eq!(
            error,
            "curve 1 with 101 points needs 1010, but the device allows 1000: fit it on the CPU, or with fewer samples"
        );
    }

    #[test]
    fn no_curves_make_no_chunks() {
        assert!(chunks([], 10, 25, &LIMITS).unwrap().is_empty());
    }

    #[test]
    fn dispatches_spill_into_the_second_dimension() {
        assert_eq!(workgroups(0, 8, &LIMITS).unwrap(), [0, 0, 1]);
        assert_eq!(workgroups(80, 8, &LIMITS).unwrap(), [10, 1, 1]);
        assert_eq!(workgroups(81, 8, &LIMITS).unwrap(), [6, 2, 1]);
        assert!(workgroups(801, 8, &LIMITS).is_err());
    }

    #[test]
    fn buckets_sort_stably_by_size_class() {
        let (order, ranges) = buckets(&[5, 100, 8, 9, 1], &[8, 16]);
        assert_eq!(order, [0, 2, 4, 3, 1]);
        assert_eq!(ranges, [0..3, 3..4, 4..5]);
    }
}
