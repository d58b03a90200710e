//! Text in other encodings than UTF-8: UTF-16, which its first bytes tell, and what XML declares.

use std::io::{self, BufRead, BufReader, Read};
use std::ops::Range;

use super::limits::Refusal;

/// What is read of UTF-16 at once.
const CHUNK_BYTES: u64 = 1 << 15;

/// What a text in another encoding lacks.
pub(super) const NOT_UTF8: &str = "not UTF-8 text: save the file as UTF-8";

/// Text without its byte-order mark, as UTF-8, and whether its first bytes, of which `head` has
/// three, tell its encoding. A letter of two bytes, one of them 0, begins UTF-16 without a mark.
pub(super) fn as_utf8<'a>(head: &[u8], reader: Box<dyn BufRead + 'a>) -> (Box<dyn BufRead + 'a>, bool) {
    let after = |skipped: usize| Box::new(io::Cursor::new(head[skipped..].to_vec()));
    let (skipped, is_big_endian) = match *head {
        [0xef, 0xbb, 0xbf] => return (reader, true),
        [0xff, 0xfe, ..] => (2, false),
        [0xfe, 0xff, ..] => (2, true),
        [first, second, ..] if (first == 0) != (second == 0) => (0, first == 0),
        _ => return (Box::new(after(0).chain(reader)), false),
    };
    let inner = Box::new(after(skipped).chain(reader));
    (Box::new(BufReader::new(Utf16 { inner, is_big_endian, text: io::Cursor::default() })), true)
}

/// Text in UTF-16, as UTF-8.
struct Utf16<'a> {
    inner: Box<dyn BufRead + 'a>,
    is_big_endian: bool,
    /// What was read last.
    text: io::Cursor<Vec<u8>>,
}

impl Utf16<'_> {
    /// The next letters. At the end there are none.
    fn next(&mut self) -> io::Result<Vec<u8>> {
        let mut units: Vec<u16> = Vec::new();
        let mut wanted = CHUNK_BYTES;
        // A letter of two units is not cut.
        while units.is_empty() || units.last().is_some_and(|unit| (0xd800..0xdc00).contains(unit)) {
            let mut bytes = Vec::new();
            self.inner.by_ref().take(wanted).read_to_end(&mut bytes)?;
            let (pairs, rest) = bytes.as_chunks::<2>();
            if !rest.is_empty() {
                return Err(io::Error::other(Refusal::Utf16));
            }
            if pairs.is_empty() {
                break;
            }
            let unit = |&pair| if self.is_big_endian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) };
            units.extend(pairs.iter().map(unit));
            wanted = 2;
        }
        let text: Result<String, _> = char::decode_utf16(units).collect();
        text.map(String::into_bytes).map_err(|_| io::Error::other(Refusal::Utf16))
    }
}

impl Read for Utf16<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.text.position() == self.text.get_ref().len() as u64 {
            self.text = io::Cursor::new(self.next()?);
        }
        self.text.read(buffer)
    }
}

/// The place of the encoding's name in an XML declaration.
pub(super) fn declared(bytes: &[u8]) -> Option<Range<usize>> {
    let end = bytes.strip_prefix(b"<?xml")?.windows(2).take(256).position(|two| two == b"?>")? + 5;
    let text = std::str::from_utf8(&bytes[..end]).ok()?;
    let name = text.find("encoding")? + "encoding".len();
    let value = text[name..].trim_start().strip_prefix('=')?.trim_start();
    let mark = value.chars().next().filter(|mark| ['"', '\''].contains(mark))?;
    let length = value[1..].find(mark)?;
    let start = end - value.len() + 1;
    Some(start..start + length)
}

/// Whether text with this declared encoding is UTF-8. UTF-16 is recognised by its first bytes. Text
/// that only declares it is UTF-8.
pub(super) fn is_utf8(name: &str) -> bool {
    name.to_ascii_lowercase().starts_with("utf")
}

/// Whether [`of_latin`] reads text with this declared encoding.
pub(super) fn is_latin(name: &str) -> bool {
    let names = ["iso-8859-1", "iso8859-1", "iso_8859-1", "latin1", "latin-1", "windows-1252", "cp1252"];
    names.iter().any(|latin| name.eq_ignore_ascii_case(latin))
}

/// Text in Windows-1252, for which Latin-1 is taken too: it has letters where Latin-1 has controls.
pub(super) fn of_latin(bytes: &[u8]) -> String {
    let letter = |&byte: &u8| match byte {
        0x80..0xa0 => WINDOWS_1252[usize::from(byte) - 0x80],
        _ => char::from(byte),
    };
    bytes.iter().map(letter).collect()
}

/// The letters from 0x80 on.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];
