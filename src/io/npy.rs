//! The header of an array in NumPy's format, read with care.
//!
//! npyz allocates what a header claims and parses any Python literal in it, at a cost that doubles with each bracket. So
//! headers are read here, of the form that NumPy writes, and npyz is given a plain one of what was found.

use std::io::{self, Read};

use npyz::{NpyHeader, Order, TypeStr};

/// Longer headers are refused, as `numpy.load` does.
const HEADER_BYTES: usize = 10_000;

/// The most that an axis of an array without elements may have: there may be work for every row, even if it is empty.
const EMPTY_LENGTH: u64 = 1 << 24;

/// What a header says.
#[derive(Debug)]
pub(super) struct Header {
    /// The type as it is written, quotation marks included.
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
        let mut start = [0; 8];
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

    /// The type, where it is a plain one and no record.
    pub fn kind(&self) -> Option<TypeStr> {
        let inner = self.descr.strip_prefix(['\'', '"'])?.strip_suffix(['\'', '"'])?;
        inner.parse().ok()
    }

    /// Number of elements; none where it is beyond all numbers.
    pub fn count(&self) -> Option<u64> {
        match self.shape.contains(&0) {
            true => self.shape.iter().all(|&length| length <= EMPTY_LENGTH).then_some(0),
            false => self.shape.iter().try_fold(1u64, |count, &length| count.checked_mul(length)),
        }
    }
}

/// The header that npyz reads for so many elements of a type, all on one axis.
pub(super) fn plain(kind: &TypeStr, count: u64) -> io::Result<NpyHeader> {
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({count},), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    NpyHeader::from_reader(&bytes[..])
}

/// The byte after the string that the text begins with; without escapes, which no header needs.
fn string_end(text: &str) -> Option<usize> {
    let mark = text.chars().next().filter(|mark| "'\"".contains(*mark))?;
    let end = text[1..].find(mark)? + 2;
    (!text[..end].contains('\\')).then_some(end)
}

/// The end of the value that the text begins with: a comma outside brackets, or that of the text.
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

/// The lengths of the axes; Python 2 wrote some with an L.
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
}
