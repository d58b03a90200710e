//! Arrays in NumPy's format: a header, and elements.
//!
//! Only headers of the form that NumPy writes are read. Nothing is allocated because a header
//! claims it. (`npyz` allocates what a header claims, and parses nested brackets recursively.)
//!
//! Source: NumPy enhancement proposal 1, *A simple file format for NumPy arrays*.

use std::io::{self, BufWriter, IntoInnerError, Read, Write};

use super::memory::Room;

/// The longest header. Longer ones are refused, as `numpy.load` does.
const HEADER_BYTES: usize = 10_000;

/// The longest axis of an array without elements. Every row may make work, even if it is empty.
const EMPTY_LENGTH: u64 = 1 << 24;

/// The content of an array.
pub(super) struct Array<T> {
    pub shape: Vec<u64>,
    pub order: Order,
    pub values: Vec<T>,
}

impl<T: Copy> Array<T> {
    /// The values row after row, however they were stored.
    pub fn into_rows(self) -> Vec<T> {
        if self.order == Order::C {
            return self.values;
        }
        let count = self.values.len();
        let place = |mut index: usize| {
            // The place in the other order, digit by digit, the last axis first.
            let (mut place, mut stride) = (0, count);
            for length in self.shape.iter().rev().map(|&length| length as usize) {
                stride /= length;
                place += index % length * stride;
                index /= length;
            }
            place
        };
        (0..count).map(|index| self.values[place(index)]).collect()
    }
}

/// How the elements of an array follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Row after row.
    C,
    /// Column after column.
    Fortran,
}

/// The type of an element, such as `<f8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    is_big_endian: bool,
    /// `f` float, `i` and `u` integer, `b` boolean, `U` text, `S` bytes.
    letter: char,
    /// Bytes of an element, or code points if it is text.
    size: usize,
}

impl Kind {
    /// Parses a type. `None` if its elements have no size of their own.
    fn parse(text: &str) -> Option<Self> {
        let mut characters = text.chars();
        let order = characters.next().filter(|order| "<>|".contains(*order))?;
        let letter = characters.next().filter(char::is_ascii_alphabetic)?;
        let size = characters.as_str().parse().ok()?;
        Some(Kind { is_big_endian: order == '>', letter, size })
    }

    /// Bytes of an element. `None` if they are too many for a number.
    pub fn bytes(self) -> Option<usize> {
        if self.letter == 'U' { self.size.checked_mul(4) } else { Some(self.size) }
    }
}

/// Writes an array, row after row, of elements that are bytes, the least significant first.
pub(super) fn write<B: AsRef<[u8]>>(
    out: &mut dyn Write,
    kind: &str,
    shape: &[u64],
    elements: impl Iterator<Item = B>,
) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({lengths}), }}");
    // The elements begin at a multiple of 64 bytes. A new line ends the header.
    let padded = (START_BYTES + 2 + header.len() + 1).next_multiple_of(64) - START_BYTES - 2;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(padded as u16).to_le_bytes())?;
    writeln!(out, "{header:<width$}", width = padded - 1)?;
    for element in elements {
        out.write_all(element.as_ref())?;
    }
    // What is behind the buffer is not flushed: that would begin another block of a gzip file.
    out.into_inner().map(drop).map_err(IntoInnerError::into_error)
}

/// A text as an element of `length` code points, with NUL after its end.
pub(super) fn padded(text: &str, length: usize) -> Vec<u8> {
    let points = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(length);
    points.flat_map(u32::to_le_bytes).collect()
}

/// Bytes of the name of the format and its version.
const START_BYTES: usize = 8;

/// The elements of an array, yet to be read.
pub(super) struct Elements<'a> {
    pub kind: Kind,
    pub count: u64,
    pub reader: &'a mut dyn Read,
}

impl Elements<'_> {
    /// The elements, each made from its bytes, the least significant first (text: from its code
    /// points).
    fn map<T>(self, room: &Room, make: impl Fn(&[u8]) -> Option<T>) -> io::Result<Vec<T>> {
        let mut found = Vec::new();
        room.reserve(&mut found, usize::try_from(self.count).unwrap_or(usize::MAX))?;
        let mut bytes = vec![0; self.kind.bytes().ok_or_else(|| wrong("its elements are too large"))?];
        let point_bytes = if self.kind.letter == 'U' { 4 } else { bytes.len().max(1) };
        for _ in 0..self.count {
            self.reader.read_exact(&mut bytes)?;
            if self.kind.is_big_endian {
                bytes.chunks_exact_mut(point_bytes).for_each(<[u8]>::reverse);
            }
            found.push(make(&bytes).ok_or_else(|| wrong("an element is not of its type"))?);
        }
        Ok(found)
    }
}

/// Floats, integers or booleans as f64. `None` for another type.
pub(super) fn numbers(elements: Elements, room: &Room) -> io::Result<Option<Vec<f64>>> {
    match (elements.kind.letter, elements.kind.size) {
        ('f', 8) => elements.map(room, |bytes| Some(f64::from_le_bytes(bytes.try_into().ok()?))).map(Some),
        ('f', 4) => elements.map(room, |bytes| Some(f32::from_le_bytes(bytes.try_into().ok()?).into())).map(Some),
        _ => Ok(integers(elements, room)?.map(|values| values.into_iter().map(|value| value as f64).collect())),
    }
}

/// Integers of any width, up to the largest i64, or booleans. `None` for another type.
pub(super) fn integers(elements: Elements, room: &Room) -> io::Result<Option<Vec<i64>>> {
    let Kind { letter, size, .. } = elements.kind;
    if !matches!((letter, size), ('i' | 'u', 1 | 2 | 4 | 8) | ('b', 1)) {
        return Ok(None);
    }
    let integer = |bytes: &[u8]| {
        let is_negative = letter == 'i' && bytes[size - 1] & 0x80 != 0;
        let mut whole = [if is_negative { 0xff } else { 0 }; 8];
        whole[..size].copy_from_slice(bytes);
        match letter {
            'i' => Some(i64::from_le_bytes(whole)),
            'u' => Some(i64::try_from(u64::from_le_bytes(whole)).unwrap_or(i64::MAX)),
            _ => Some(i64::from(bytes[0])).filter(|&flag| flag <= 1),
        }
    };
    elements.map(room, integer).map(Some)
}

/// Text, or bytes that are UTF-8, up to the NULs at its end. `None` for another type.
pub(super) fn texts(elements: Elements, room: &Room) -> io::Result<Option<Vec<String>>> {
    let text = |points: Option<String>| points.map(|text| text.trim_end_matches('\0').to_string());
    match elements.kind.letter {
        'U' => elements.map(room, |bytes| {
            let (points, _) = bytes.as_chunks::<4>();
            text(points.iter().map(|point| char::from_u32(u32::from_le_bytes(*point))).collect())
        }),
        'S' | 'a' => elements.map(room, |bytes| text(String::from_utf8(bytes.to_vec()).ok())),
        _ => return Ok(None),
    }
    .map(Some)
}

/// What a header says.
#[derive(Debug)]
pub(super) struct Header {
    /// The type as it is written, with its quotation marks.
    pub descr: String,
    pub order: Order,
    pub shape: Vec<u64>,
}

fn wrong(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

impl Header {
    /// Reads a header, up to the first byte of the array.
    pub fn read(reader: &mut impl Read) -> io::Result<Self> {
        let mut start = [0; START_BYTES];
        reader.read_exact(&mut start).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => wrong("it does not begin as an array of NumPy"),
            _ => error,
        })?;
        if &start[..6] != b"\x93NUMPY" {
            return Err(wrong("it does not begin as an array of NumPy"));
        }
        let length = match start[6..] {
            [1, 0] => {
                let mut bytes = [0; 2];
                reader.read_exact(&mut bytes)?;
                usize::from(u16::from_le_bytes(bytes))
            }
            [2 | 3, 0] => {
                let mut bytes = [0; 4];
                reader.read_exact(&mut bytes)?;
                u32::from_le_bytes(bytes) as usize
            }
            [major, minor, ..] => {
                return Err(wrong(format!("its version is {major}.{minor}, and 1.0 to 3.0 are known")));
            }
            _ => unreachable!("eight bytes were read"),
        };
        if length > HEADER_BYTES {
            return Err(wrong(format!("its header has {length} bytes, and {HEADER_BYTES} are the most")));
        }
        let mut bytes = vec![0; length];
        reader.read_exact(&mut bytes)?;
        let text = std::str::from_utf8(&bytes).map_err(|_| wrong("its header is no text"))?;
        Self::parse(text).ok_or_else(|| wrong("its header is not as NumPy writes it"))
    }

    /// Reads `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }`, in any order.
    fn parse(text: &str) -> Option<Self> {
        let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
        let (mut descr, mut order, mut shape) = (None, None, None);
        while !rest.is_empty() {
            let end = string_end(rest)?;
            let key = &rest[1..end - 1];
            let value = rest[end..].trim_start().strip_prefix(':')?.trim_start();
            let end = value_end(value)?;
            let found = value[..end].trim();
            match key {
                "descr" => descr = Some(found.to_string()),
                "fortran_order" => order = Some(if boolean(found)? { Order::Fortran } else { Order::C }),
                "shape" => shape = Some(lengths(found)?),
                _ => {}
            }
            rest = value[end..].strip_prefix(',').unwrap_or(&value[end..]).trim_start();
        }
        Some(Header { descr: descr?, order: order?, shape: shape? })
    }

    /// Whether the array holds text.
    pub fn is_text(&self) -> bool {
        self.kind().is_some_and(|kind| matches!(kind.letter, 'U' | 'S' | 'a'))
    }

    /// The type, if it is a plain one and no record.
    pub fn kind(&self) -> Option<Kind> {
        Kind::parse(self.descr.strip_prefix(['\'', '"'])?.strip_suffix(['\'', '"'])?)
    }

    /// Number of elements. `None` if it is too large for a number.
    pub fn count(&self) -> Option<u64> {
        match self.shape.contains(&0) {
            true => self.shape.iter().all(|&length| length <= EMPTY_LENGTH).then_some(0),
            false => self.shape.iter().try_fold(1u64, |count, &length| count.checked_mul(length)),
        }
    }
}

/// The byte after the string that the text begins with. Escapes are not read: no header needs them.
fn string_end(text: &str) -> Option<usize> {
    let mark = text.chars().next().filter(|mark| "'\"".contains(*mark))?;
    let end = text[1..].find(mark)? + 2;
    (!text[..end].contains('\\')).then_some(end)
}

/// The end of the value that the text begins with: a comma outside brackets, or the end of the
/// text.
fn value_end(text: &str) -> Option<usize> {
    let (mut at, mut depth) = (0, 0usize);
    while let Some(c) = text[at..].chars().next() {
        match c {
            '\'' | '"' => {
                at += string_end(&text[at..])?;
                continue;
            }
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.checked_sub(1)?,
            ',' if depth == 0 => return Some(at),
            _ => {}
        }
        at += c.len_utf8();
    }
    (depth == 0).then_some(at)
}

fn boolean(text: &str) -> Option<bool> {
    match text {
        "True" => Some(true),
        "False" => Some(false),
        _ => None,
    }
}

/// The lengths of the axes. Python 2 wrote some with an L.
fn lengths(text: &str) -> Option<Vec<u64>> {
    let inner = text.strip_prefix(['(', '['])?.strip_suffix([')', ']'])?.trim();
    let inner = inner.strip_suffix(',').unwrap_or(inner);
    if inner.is_empty() {
        return Some(Vec::new());
    }
    inner.split(',').map(|length| length.trim().trim_end_matches('L').parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_read_as_numpy_writes_them_and_no_others() {
        let read = |text: &str| Header::parse(text).map(|h| (h.descr, h.order == Order::Fortran, h.shape));
        let some = |descr: &str, fortran, shape: &[u64]| Some((descr.to_string(), fortran, shape.to_vec()));
        assert_eq!(
            read("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }    \n"),
            some("'<f8'", false, &[3, 2])
        );
        assert_eq!(read("{\"shape\":(4L,),\"fortran_order\":True,\"descr\":\"|u1\"}"), some("\"|u1\"", true, &[4]));
        assert_eq!(
            read("{'descr': [('a}', '<f4', (2, 3)), ('b', '<i8')], 'fortran_order': False, 'shape': ()}"),
            some("[('a}', '<f4', (2, 3)), ('b', '<i8')]", false, &[])
        );
        for bad in [
            "",
            "{}",
            "{'descr'",
            "{'descr': '<f8', 'fortran_order': 1, 'shape': (3,)}",
            "{'descr': '<f8', 'fortran_order': True, 'shape': (-3,)}",
            "{'descr': '<f8', 'fortran_order': True, 'shape': (99999999999999999999,)}",
            "{'descr': '<f8', 'fortran_order': True, 'shape': 3}",
            "{'descr': '\\'', 'fortran_order': True, 'shape': (3,)}",
            "{'descr': ')(', 'fortran_order': True, 'shape': )(}",
        ] {
            assert_eq!(read(bad), None, "{bad}");
        }
        // What a parser of Python takes for ever, or its stack, over.
        let deep = format!("{{'descr': {}1{}, ", "[".repeat(4000), "]".repeat(4000));
        assert!(read(&format!("{deep}'fortran_order': True, 'shape': (3,)}}")).is_some());
    }

    #[test]
    fn a_header_that_claims_gigabytes_is_refused_unread() {
        let mut claim = b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec();
        claim.extend(b"{}");
        let error = Header::read(&mut &claim[..]).unwrap_err().to_string();
        assert_eq!(error, "its header has 4294967295 bytes, and 10000 are the most");
    }

    #[test]
    fn shapes_beyond_all_numbers_have_no_count() {
        let count = |shape: &[u64]| Header { descr: String::new(), order: Order::C, shape: shape.to_vec() }.count();
        assert_eq!(count(&[1 << 32, 1 << 32]), None);
        assert_eq!((count(&[3, 0, 5]), count(&[1 << 32, 0])), (Some(0), None));
        assert_eq!((count(&[]), count(&[3, 4])), (Some(1), Some(12)));
    }

    #[test]
    fn every_type_is_read_in_either_order_of_bytes() {
        let room = Room::of_system();
        let read = |descr: &str, bytes: &[u8]| {
            let kind = Kind::parse(descr).unwrap();
            let count = (bytes.len() / kind.bytes().unwrap()) as u64;
            Elements { kind, count, reader: &mut &bytes.to_vec()[..] }.numbers_of(&room)
        };
        assert_eq!(read("<f8", &1.5f64.to_le_bytes()), [1.5]);
        assert_eq!(read(">f8", &1.5f64.to_be_bytes()), [1.5]);
        assert_eq!(read(">f4", &(-2.5f32).to_be_bytes()), [-2.5]);
        assert_eq!(read("<i8", &(-7i64).to_le_bytes()), [-7.0]);
        assert_eq!(read(">i4", &(-7i32).to_be_bytes()), [-7.0]);
        assert_eq!(read("<i2", &(-300i16).to_le_bytes()), [-300.0]);
        assert_eq!(read("|i1", &[0x80, 0x7f]), [-128.0, 127.0]);
        assert_eq!(read("<u8", &u64::MAX.to_le_bytes()), [i64::MAX as f64]);
        assert_eq!(read(">u4", &u32::MAX.to_be_bytes()), [f64::from(u32::MAX)]);
        assert_eq!(read("<u2", &[0xff, 0xff]), [65535.0]);
        assert_eq!(read("|u1", &[200]), [200.0]);
        assert_eq!(read("|b1", &[0, 1]), [0.0, 1.0]);
        for other in ["<f2", "<c16", "<i3", "|b2", "<U1"] {
            assert!(read(other, &[0; 48]).is_empty(), "{other}");
        }
        for bad in ["f8", "<f", "<O", "", "<f8[s]", "=f8"] {
            assert_eq!(Kind::parse(bad), None, "{bad}");
        }
    }

    impl Elements<'_> {
        fn numbers_of(self, room: &Room) -> Vec<f64> {
            numbers(self, room).unwrap().unwrap_or_default()
        }
    }

    #[test]
    fn texts_end_where_their_nuls_begin_and_bad_ones_are_errors() {
        let room = Room::of_system();
        let read = |descr: &str, bytes: &[u8]| {
            texts(Elements { kind: Kind::parse(descr).unwrap(), count: 1, reader: &mut &bytes.to_vec()[..] }, &room)
        };
        let points = |text: &str| text.chars().map(u32::from).collect::<Vec<u32>>();
        let little: Vec<u8> = points("nä\0m\0").iter().flat_map(|point| point.to_le_bytes()).collect();
        let big: Vec<u8> = points("nä\0m\0").iter().flat_map(|point| point.to_be_bytes()).collect();
        assert_eq!(read("<U5", &little).unwrap().unwrap(), ["nä\0m"]);
        assert_eq!(read(">U5", &big).unwrap().unwrap(), ["nä\0m"]);
        assert_eq!(read("|S3", b"ab\0").unwrap().unwrap(), ["ab"]);
        assert!(read("<U1", &0xd800u32.to_le_bytes()).is_err() && read("|S1", b"\xff").is_err());
        assert!(read("<U2", &[0; 4]).is_err() && read("<f8", &[0; 8]).unwrap().is_none());
    }

    #[test]
    fn what_is_written_is_read() {
        let mut bytes = Vec::new();
        write(&mut bytes, "<U3", &[2, 1], ["äb", ""].into_iter().map(|name| padded(name, 3))).unwrap();
        assert_eq!((bytes.len() - 24) % 64, 0);
        let mut reader = &bytes[..];
        let header = Header::read(&mut reader).unwrap();
        let elements = Elements { kind: header.kind().unwrap(), count: header.count().unwrap(), reader: &mut reader };
        assert_eq!(texts(elements, &Room::of_system()).unwrap().unwrap(), ["äb", ""]);
        assert_eq!((header.shape, reader.len()), (vec![2, 1], 0));
    }
}
