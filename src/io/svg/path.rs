//! Path data, checked before kurbo reads it.

use kurbo::{BezPath, PathEl};

/// The largest number in a path with arcs. Paths with larger ones are refused.
///
/// kurbo divides an arc into as many Béziers as the sixth root of its radius asks for, without
/// limit.
const LARGEST_ARC: f64 = 1e9;

/// Béziers that kurbo divides a full turn of the largest arc into: (1.1163 · 1e9 / 0.1)^(1/6),
/// rounded up.
const ARC_PIECES: usize = 48;

/// The most memory that path data makes.
///
/// - An element takes at least two bytes ("h1 1 1").
/// - An arc makes the elements of a full turn from at least ten bytes ("A1 1 0 11 1").
/// - The vector of elements grows by doubling.
/// - Each element has three points.
pub(super) fn most_bytes(data: &str) -> usize {
    let elements = match has_arcs(data) {
        true => data.len().saturating_mul(ARC_PIECES) / 10,
        false => 0,
    };
    elements.saturating_add(data.len() / 2).saturating_mul(2 * size_of::<PathEl>() + 48)
}

/// Parses a path, or says what is wrong with it.
pub(super) fn parse(data: &str) -> Result<BezPath, String> {
    // kurbo stops at a letter it does not expect and returns what came before it.
    let foreign =
        |c: char| !(c.is_ascii_digit() || c.is_ascii_whitespace() || "+-.,eEMmLlHhVvCcSsQqTtAaZz".contains(c));
    if let Some(c) = data.chars().find(|&c| foreign(c)) {
        return Err(format!("its path holds {c:?}, which is no path command: mend it"));
    }
    if has_arcs(data)
        && let Some(number) = numbers(data).find(|x| x.abs() > LARGEST_ARC)
    {
        return Err(format!(
            "its path has arcs and the number {number:e}, but arcs can be divided up to {LARGEST_ARC:e}: scale it down"
        ));
    }
    BezPath::from_svg(data).map_err(|error| format!("its path cannot be read ({error}): mend it"))
}

fn has_arcs(data: &str) -> bool {
    data.contains(['a', 'A'])
}

/// The numbers of the data, also those separated only by a sign or a point.
///
/// Flags of arcs may stick to a number, as further digits.
fn numbers(data: &str) -> impl Iterator<Item = f64> {
    let bytes = data.as_bytes();
    let mut at = 0;
    std::iter::from_fn(move || {
        let digit = |at: usize| bytes.get(at).is_some_and(u8::is_ascii_digit);
        let digits = |mut at: usize| {
            while digit(at) {
                at += 1;
            }
            at
        };
        while at < bytes.len() && !digit(at) && !(bytes[at] == b'.' && digit(at + 1)) {
            at += 1;
        }
        if at >= bytes.len() {
            return None;
        }
        let start = at;
        at = digits(at);
        if bytes.get(at) == Some(&b'.') {
            at = digits(at + 1);
        }
        if matches!(bytes.get(at), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
            if digit(at + 1 + sign) {
                at = digits(at + 1 + sign);
            }
        }
        Some(data[start..at].parse().unwrap_or(f64::INFINITY))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_of_any_size_ends_in_a_path_or_a_sentence() {
        for data in ["M0 0A1e300 1e300 0 1 1 1 1", "M0 0a5e9.5 0 11 1 1", "M1e99,0 A2,2 0 0 0 3,3"] {
            let sentence = parse(data).unwrap_err();
            assert!(sentence.contains("arcs can be divided up to 1e9: scale it down"), "{sentence}");
        }
        for data in ["M0 0A1e9 1e9 0 1 1 1 1", "M0 0 A5 5 0 10 1e1-1", "M0,0A0 0 0 0 0 3 3"] {
            let path = parse(data).unwrap();
            let elements = path.elements();
            assert!(elements.len() <= ARC_PIECES + 1 && size_of_val(elements) < most_bytes(data), "{}", elements.len());
        }
        assert!(parse("M1e300 0L1e300 5").is_ok());
        assert_eq!(numbers("M1-2.5.5e3,7e 1e400").collect::<Vec<_>>(), [1.0, 2.5, 500.0, 7.0, f64::INFINITY]);
    }
}
