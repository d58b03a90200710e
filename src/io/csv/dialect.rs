//! How a file of rows separates cells, and writes numbers.

/// Separators, the usual one first.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];

/// Words for a number that is not there, as people, databases, spreadsheets and programs write
/// them.
const BLANKS: [&str; 10] = ["na", "n/a", "null", "none", "\\n", "(null)", "<null>", "#n/a", "<na>", "nat"];

/// A way to write tables as text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::io) struct Dialect {
    pub separator: u8,
}

impl Dialect {
    /// The one that a line such as `sep=;` states, which spreadsheets write above the header.
    pub fn stated(line: &[u8]) -> Option<Self> {
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let line = line.strip_prefix(b"\"").and_then(|inner| inner.strip_suffix(b"\"")).unwrap_or(line);
        match *line {
            [b's' | b'S', b'e' | b'E', b'p' | b'P', b'=', separator] => Some(Dialect { separator }),
            _ => None,
        }
    }

    /// By the separator that stands most often in the first line, outside quotation marks.
    pub fn of(first_line: &[u8]) -> Self {
        let (mut counts, mut quoted) = ([0; SEPARATORS.len()], false);
        for byte in first_line {
            quoted ^= *byte == b'"';
            if let Some(k) = SEPARATORS.iter().position(|separator| separator == byte).filter(|_| !quoted) {
                counts[k] += 1;
            }
        }
        let most = (0..counts.len()).rev().max_by_key(|&k| counts[k]).unwrap_or(0);
        Dialect { separator: SEPARATORS[most] }
    }

    /// The number in a cell, `None` where none is there. An error is the cell's.
    ///
    /// Unless commas separate cells, a comma may stand for the decimal point.
    pub fn number(self, cell: &[u8]) -> Result<Option<f64>, ()> {
        let text = std::str::from_utf8(cell.trim_ascii()).map_err(drop)?;
        if text.is_empty() || BLANKS.iter().any(|blank| text.eq_ignore_ascii_case(blank)) {
            return Ok(None);
        }
        match text.parse() {
            Ok(number) => Ok(Some(number)),
            Err(_) if self.separator != b',' => text.replacen(',', ".", 1).parse().map(Some).map_err(drop),
            Err(_) => Err(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_one_that_is_there() {
        let of = |line: &str| Dialect::of(line.as_bytes()).separator;
        assert_eq!([of("x,y"), of("x;y"), of("x\ty"), of("x"), of("")], [b',', b';', b'\t', b',', b',']);
        assert_eq!([of("\"a;b;c\",x,y"), of("a;b;\"x,y,z,w\""), of("1,5;2,5;3")], [b',', b';', b',']);
    }

    #[test]
    fn numbers_may_be_absent_or_have_a_comma() {
        let number = |separator: u8, text: &str| Dialect { separator }.number(text.as_bytes());
        assert_eq!(number(b',', " 1.5 "), Ok(Some(1.5)));
        assert_eq!(
            [number(b';', "1,5"), number(b';', "1,5,2"), number(b',', "1,5")],
            [Ok(Some(1.5)), Err(()), Err(())]
        );
        assert!(["", " ", "NA", "n/a", "NULL", "None"].iter().all(|text| number(b',', text) == Ok(None)));
        assert_eq!(number(b',', "abc"), Err(()));
    }
}
