//! Ragged arrays.

/// The first entry of each curve, and the total number at the end.
pub(crate) fn offsets(counts: impl IntoIterator<Item = usize>) -> Vec<usize> {
    let counts = counts.into_iter();
    let mut offsets = Vec::with_capacity(counts.size_hint().0 + 1);
    let mut total = 0;
    offsets.push(total);
    offsets.extend(counts.map(|count| {
        total += count;
        total
    }));
    offsets
}
