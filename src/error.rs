//! The crate's error type.
//!
//! Every message is a sentence with the value, the limit and the remedy.
//!
//! An [`Error`] concerns a whole run: a file, an argument or a device. A problem of one curve
//! becomes that curve's [`CurveStatus`](crate::CurveStatus) and does not affect its neighbours.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// The crate's result type.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error that stops a whole run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// A file could not be written.
    ///
    /// A previous file at `path` is unchanged.
    #[error("cannot write {}: {source}; nothing was left half-written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// Output could not be written to its receiver, which may have received a part.
    #[error("cannot write: {source}; a part may have been written")]
    Stream {
        /// The receiver's message.
        source: std::io::Error,
    },
    /// The output file exists, and overwriting is not allowed.
    #[error("{} exists already: give `overwrite` to replace it, or another name", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The content of a file does not match its format.
    #[error("{}: {message}", place(file, *line))]
    Parse {
        /// The file's name, or `-` for standard input.
        file: String,
        /// The line, counted from 1, for formats with lines.
        line: Option<u64>,
        /// The problem, the value found, and the remedy.
        message: String,
    },
    /// An option or an argument is invalid. The sentence has its name, its value and the valid
    /// range.
    #[error("{0}")]
    Argument(String),
    /// The arrays that describe a batch do not fit together.
    #[error("malformed batch: {0}")]
    Batch(String),
    /// No suitable GPU was found.
    #[error("no usable GPU: {0}")]
    NoGpu(String),
    /// An indivisible part of the work exceeds a limit of the device.
    #[error("{what} needs {asked}, but the device allows {allowed}: {remedy}")]
    Limit {
        /// The requested resource.
        what: String,
        /// The requested amount.
        asked: u64,
        /// The device's limit.
        allowed: u64,
        /// The remedy.
        remedy: String,
    },
    /// The device ran out of memory even after the chunk was halved.
    #[error(
        "the device ran out of memory at a chunk of {chunk_bytes} bytes, and again at half of it: close other programs, or use the CPU"
    )]
    OutOfMemory {
        /// The chunk that failed first.
        chunk_bytes: u64,
    },
    /// The device was lost.
    ///
    /// Results finished before are kept.
    #[error("the device was lost: {0}; run again, or use the CPU")]
    DeviceLost(String),
    /// The device did not answer in time.
    #[error("the device did not answer within {seconds} s: it may hang; run again, or use the CPU")]
    Timeout {
        /// How long the host waited.
        seconds: u64,
    },
    /// The shader compiler or the driver refused a kernel: a fault of faircurve or of the driver.
    #[error("kernel {kernel} was refused: {message}")]
    Kernel {
        /// The kernel's name.
        kernel: String,
        /// The compiler's message.
        message: String,
    },
}

fn place(file: &str, line: Option<u64>) -> String {
    match line {
        Some(line) => format!("{file}, line {line}"),
        None => file.to_string(),
    }
}

/// The most characters that a sentence quotes from its input.
const QUOTED: usize = 80;
/// The most entries that a sentence lists.
#[cfg(feature = "formats")]
const LISTED: usize = 8;

/// Input text for a sentence, cut to 80 characters.
pub(crate) fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(QUOTED) {
        None => Cow::Borrowed(text),
        Some(_) => {
            let end = text.char_indices().nth(QUOTED - 1).map_or(0, |(at, _)| at);
            Cow::Owned(format!("{}…", &text[..end]))
        }
    }
}

/// Input text in quotation marks for a sentence, with escapes as in Rust, cut to 80 characters.
pub(crate) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    let mut count = 0;
    for (at, c) in text.char_indices() {
        let escaped = c.escape_debug();
        let last = at + c.len_utf8() == text.len();
        // The last character may replace the dots.
        if count + escaped.len() + usize::from(!last) > QUOTED {
            quoted.push('…');
            break;
        }
        count += escaped.len();
        // A single quotation mark needs no escape between double ones.
        if c == '\'' { quoted.push(c) } else { quoted.extend(escaped) }
    }
    quoted.push('"');
    quoted
}

/// The first eight entries, separated by commas, and the number of the others.
#[cfg(feature = "formats")]
pub(crate) fn listed(entries: impl IntoIterator<Item = String>) -> String {
    let mut entries = entries.into_iter();
    let first: Vec<String> = entries.by_ref().take(LISTED).collect();
    match entries.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// A number with commas between thousands: 12345 is "12,345".
pub(crate) fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let (head, tail) = digits.split_at((digits.len() + 2) % 3 + 1);
    let groups = tail.as_bytes().chunks(3).map(|group| format!(",{}", String::from_utf8_lossy(group)));
    head.chars().map(String::from).chain(groups).collect()
}

/// A number for a sentence, with an exponent where it would be long.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() || (1e-5..1e17).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
}

impl Error {
    /// A parse error at a line of a file.
    pub fn parse(file: &Path, line: impl Into<Option<u64>>, message: impl Into<String>) -> Self {
        Error::Parse { file: file.display().to_string(), line: line.into(), message: message.into() }
    }

    /// An error about an option or argument.
    pub fn argument(message: impl Into<String>) -> Self {
        Error::Argument(message.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_numbers_have_commas() {
        let of = [0, 12, 999, 1000, 12_345, 123_456, 1_234_567].map(thousands);
        assert_eq!(of, ["0", "12", "999", "1,000", "12,345", "123,456", "1,234,567"]);
    }

    #[cfg(feature = "formats")]
    #[test]
    fn sentences_quote_no_more_than_80_characters_and_list_no_more_than_8_entries() {
        let long = "ä".repeat(5_000_000);
        assert_eq!(shortened(&long), format!("{}…", "ä".repeat(79)));
        assert_eq!(quoted(&long), format!("\"{}…\"", "ä".repeat(79)));
        assert_eq!(shortened(&long[..160]), long[..160]);
        assert_eq!(quoted(&long[..160]), format!("\"{}\"", &long[..160]));
        assert_eq!(quoted("a\"b\\ \n'ü\0"), format!("{:?}", "a\"b\\ \n'ü\0"));
        assert!(quoted(&"\u{1}".repeat(1000)).chars().count() <= 82);
        let numbers = |n: usize| listed((0..n).map(|k| k.to_string()));
        assert_eq!((numbers(0).as_str(), numbers(2).as_str()), ("", "0, 1"));
        assert_eq!(numbers(5_000), "0, 1, 2, 3, 4, 5, 6, 7 and 4992 more");
    }

    #[test]
    fn numbers_in_sentences_are_short() {
        let expected =
            [(1e308, "1e308"), (-5e-324, "-5e-324"), (0.1, "0.1"), (0.0, "0"), (1e6, "1000000"), (-2.5, "-2.5")];
        for (x, text) in expected {
            assert_eq!(short(x), text);
        }
        assert_eq!((short(f64::NAN).as_str(), short(f64::INFINITY).as_str()), ("NaN", "inf"));
    }
}
