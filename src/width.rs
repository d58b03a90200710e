//! The width that the data leave a curve in a span. It scales the tautness of fair curves and the
//! tension of smooth connection functions.

/// The least width of a span, as a fraction of its chord.
///
/// e^(−10 s/h) halves within 1.1 of 16 edges. Fair curves do not converge with smaller widths.
const NARROWEST: f64 = 0.1;

/// The width w of every span, from the chord lengths and the cosines of the turns between chords.
///
/// ```text
/// w = max(h′ (1 + cos θ)/2, h/10)
/// ```
///
/// h is the chord, h′ the shortest of h and the adjacent chords, and θ the larger turn of the data
/// polygon at the span's ends. An open curve does not turn at its ends.
pub(crate) fn widths(lengths: &[f64], closed: bool, cosine: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let count = lengths.len();
    // (1 + cos θ)/2 at the start of span k, and the length of the span before it.
    let beginning = |k: usize| match closed || (k > 0 && k < count) {
        true => {
            let (before, after) = ((k + count - 1) % count, k % count);
            (0.5 + 0.5 * cosine(before, after), lengths[before])
        }
        false => (1.0, f64::INFINITY),
    };
    let width = |(k, &length): (usize, &f64)| {
        let ((start, before), (end, _)) = (beginning(k), beginning(k + 1));
        let after = if closed || k + 1 < count { lengths[(k + 1) % count] } else { f64::INFINITY };
        (length.min(before).min(after) * start.min(end)).max(NARROWEST * length)
    };
    lengths.iter().enumerate().map(width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_width_is_the_shortest_chord_around_less_at_a_turn_and_a_tenth_of_its_own_at_least() {
        let lengths = [1.0, 2.0, 8.0];
        // A right angle between the first two, straight on from there, and back where a closed one
        // begins again.
        let cosine = |before: usize, _: usize| [0.0, 1.0, -1.0][before];
        assert_eq!(widths(&lengths, false, cosine), [0.5, 0.5, 2.0]);
        assert_eq!(widths(&lengths, true, cosine), [0.1, 0.5, 0.8]);
        assert_eq!(widths(&[3.0], false, cosine), [3.0]);
        assert!(widths(&[], false, cosine).is_empty());
    }
}
