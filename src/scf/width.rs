//! How much room the data leave a curve in a span, by which its tension is measured.

use super::start::Chords;

/// The least width of a span, as a part of its chord.
const NARROWEST: f64 = 0.1;

/// The width w of every span.
///
/// ```text
/// w = max(h′ (1 + cos θ)/2, h/10)
/// ```
///
/// h is the chord, h′ the shortest of it and the chords beside it, and θ the larger turn of the
/// data's polygon at its two ends; an open curve has no turn at its own ends. It is the width of
/// [`tautness`](crate::discrete::tautness).
pub(crate) fn widths(chords: &Chords, closed: bool) -> Vec<f64> {
    let count = chords.lengths.len();
    // (1 + cos θ)/2 where span k begins, and the length of the span before it.
    let beginning = |k: usize| {
        let (before, after) = ((k + count - 1) % count, k % count);
        let turn = chords.directions[after] - chords.directions[before];
        if closed || (k > 0 && k < count) {
            (0.5 + 0.5 * turn.cos(), chords.lengths[before])
        } else {
            (1.0, f64::INFINITY)
        }
    };
    let width = |(k, &length): (usize, &f64)| {
        let ((start, before), (end, _)) = (beginning(k), beginning(k + 1));
        let after = if closed || k + 1 < count { chords.lengths[(k + 1) % count] } else { f64::INFINITY };
        (length.min(before).min(after) * start.min(end)).max(NARROWEST * length)
    };
    chords.lengths.iter().enumerate().map(width).collect()
}
