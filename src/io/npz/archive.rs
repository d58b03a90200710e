//! [`Archive`]: a zip of arrays, read with care and written.

use std::cell::RefCell;
use std::io::{self, BufReader, BufWriter, Cursor, Read, Seek, SeekFrom, Write};
use std::rc::Rc;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::error::{Error, Result, listed, shortened};
use crate::io::limits::{UNPACKED_BYTES, UNPACKED_TIMES, most_unpacked};
use crate::io::memory::{Full, Room};
use crate::io::npy::{self, Array, Elements, Header, padded};
use crate::io::source::Source;

/// Reads the values of an array, if they are of the type wanted.
pub(in crate::io) type ReadValues<T> = fn(Elements, &Room) -> io::Result<Option<Vec<T>>>;

/// An archive in memory, and the file that it was.
pub(in crate::io) struct Archive<'a> {
    pub source: &'a Source<'a>,
    zip: ZipArchive<Cursor<Vec<u8>>>,
    packed_bytes: u64,
    /// Bytes that the arrays read so far claim to unpack to.
    unpacked_bytes: u64,
}

impl<'a> Archive<'a> {
    /// Reads all of it.
    pub(in crate::io) fn open(source: &'a mut Source<'_>) -> Result<Self> {
        let bytes = source.bytes()?;
        let packed_bytes = bytes.len() as u64;
        // The zip crate takes memory for as many entries as the archive claims. Each entry has at
        // least that many bytes.
        if entries(&bytes).is_some_and(|entries| entries > packed_bytes / ENTRY_BYTES) {
            return Err(
                source.error(None, "the archive claims more arrays than it has bytes for: write the file again")
            );
        }
        // Names and places of all entries.
        source.take(bytes.len().saturating_mul(8))?;
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            source
                .error(None, format!("this is no NPZ archive, or it was cut off ({error}): write it with numpy.savez"))
        })?;
        Ok(Archive { source, zip, packed_bytes, unpacked_bytes: 0 })
    }

    /// The names of the archive's arrays.
    pub(in crate::io) fn keys(&self) -> Vec<String> {
        self.zip.file_names().flatten().filter_map(|name| name.strip_suffix(".npy").map(String::from)).collect()
    }

    /// What an array's header says, if it can be read.
    pub(in crate::io) fn header(&mut self, key: &str) -> Option<Header> {
        let number = self.zip.index_for_name(&file_name(key))?;
        Header::read(&mut self.zip.by_index(number).ok()?).ok()
    }

    /// Makes room for more of the values read.
    pub(in crate::io) fn grow<T>(&self, values: &mut Vec<T>, more: usize) -> Result<()> {
        self.source.grow(values, more)
    }

    pub(in crate::io) fn wrong(&self, message: impl Into<String>) -> Error {
        self.source.error(None, message)
    }

    /// One array, if the archive has it.
    ///
    /// All of it is read, so that its checksum is compared.
    pub(in crate::io) fn array<T>(&mut self, key: &str, values: ReadValues<T>) -> Result<Option<Array<T>>> {
        let Some(number) = self.zip.index_for_name(&file_name(key)) else { return Ok(None) };
        let (source, name) = (self.source, shortened(key));
        let wrong = |message: String| source.error(None, format!("array {name} {message}"));
        let damaged = |error: io::Error| match error.get_ref().is_some_and(|inner| inner.is::<Full>()) {
            true => source.failed(error),
            false => wrong(format!("is damaged or cut off ({}): write the file again", shortened(&error.to_string()))),
        };
        let raw = self.zip.by_index_raw(number).map_err(|error| damaged(error.into()))?;
        if raw.encrypted() {
            return Err(wrong("is encrypted: write the file without a password".into()));
        }
        if !matches!(raw.compression(), CompressionMethod::Stored | CompressionMethod::Deflated) {
            return Err(wrong("is packed as NumPy packs none: write the file with numpy.savez".into()));
        }
        drop(raw);
        let mut entry = self.zip.by_index(number).map_err(|error| damaged(error.into()))?;
        let stored_bytes = entry.size();
        self.unpacked_bytes = self.unpacked_bytes.saturating_add(stored_bytes);
        if self.unpacked_bytes > most_unpacked(self.packed_bytes) {
            return Err(wrong(format!(
                "brings what the archive unpacks to above {UNPACKED_TIMES} times its size and {} MiB: if it is meant to, \
                 write the file with numpy.savez, which does not pack",
                UNPACKED_BYTES >> 20
            )));
        }
        let mut reader = BufReader::with_capacity(1 << 16, &mut entry as &mut dyn Read);
        let header = Header::read(&mut reader).map_err(damaged)?;
        let of_type = || wrong(format!("has the type {}: {}", shortened(&header.descr), wanted_type(key)));
        let kind = header.kind().ok_or_else(of_type)?;
        // A damaged header must not ask for more memory than the archive can fill. Nor may it ask
        // for elements of no bytes.
        let element_bytes = kind.bytes().unwrap_or(usize::MAX).max(1) as u64;
        let count =
            header.count().filter(|count| count.checked_mul(element_bytes).is_some_and(|bytes| bytes <= stored_bytes));
        let Some(count) = count else {
            return Err(wrong(format!("has the shape {}, but holds less: write the file again", tuple(&header.shape))));
        };
        let elements = Elements { kind, count, reader: &mut reader };
        let values = values(elements, &source.room).map_err(damaged)?.ok_or_else(of_type)?;
        // The checksum is compared at the end.
        match reader.read(&mut [0]).map_err(damaged)? {
            0 => Ok(Some(Array { shape: header.shape, order: header.order, values })),
            _ => Err(wrong(format!("has the shape {}, but holds more: write the file again", tuple(&header.shape)))),
        }
    }
}

/// A shape as NumPy writes it.
pub(in crate::io) fn tuple(shape: &[u64]) -> String {
    match shape {
        [length] => format!("({length},)"),
        _ => format!("({})", listed(shape.iter().map(u64::to_string))),
    }
}

/// The names of arrays that were found, in words.
pub(in crate::io) fn arrays(found: &[impl AsRef<str>]) -> String {
    match found {
        [] => "none".to_string(),
        _ => listed(found.iter().map(|name| shortened(name.as_ref()).into_owned())),
    }
}

/// The fewest bytes of an entry in the directory of an archive.
const ENTRY_BYTES: u64 = 46;

/// How many entries an archive claims in 64 bits, in the place where the zip crate looks.
///
/// A claim in 16 bits asks for little memory.
fn entries(bytes: &[u8]) -> Option<u64> {
    let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at.checked_add(8)?)?.try_into().ok()?));
    let last = bytes.len().checked_sub(22)?;
    let end =
        (last.saturating_sub(usize::from(u16::MAX))..=last).rev().find(|&at| bytes[at..].starts_with(b"PK\x05\x06"))?;
    let comment = usize::from(u16::from_le_bytes([bytes[end + 20], bytes[end + 21]]));
    let locator = bytes.len().checked_sub(42 + comment)?;
    if !bytes[locator..].starts_with(b"PK\x06\x07") {
        return None;
    }
    let from = usize::try_from(number(locator + 8)?).ok()?;
    let footer = (from..=end.checked_sub(60)?).find(|&at| bytes[at..].starts_with(b"PK\x06\x06"))?;
    number(footer + 32)
}

fn wanted_type(key: &str) -> &'static str {
    match key {
        "offsets" => "it must hold integers",
        "known" => "it must hold booleans or integers, 1 for a given control point and 0 else",
        "names" => "it must hold text, such as numpy.array([\"a\", \"b\"]), and no Python objects",
        _ => "it must hold numbers, such as float64",
    }
}

/// The archive's name of an array.
fn file_name(key: &str) -> String {
    format!("{key}.npy")
}

/// An archive that is written.
pub(in crate::io) struct Zip<'a> {
    archive: ZipWriter<Kept<'a>>,
    failure: Rc<RefCell<Option<io::Error>>>,
}

impl Zip<'_> {
    /// Writes an array of numbers.
    pub fn floats(&mut self, key: &str, shape: &[u64], numbers: impl Iterator<Item = f64>) -> io::Result<()> {
        self.array(key, "<f8", shape, numbers.map(f64::to_le_bytes))
    }

    /// Writes a list of integers.
    pub fn integers(&mut self, key: &str, length: u64, integers: impl Iterator<Item = usize>) -> io::Result<()> {
        self.array(key, "<i8", &[length], integers.map(|integer| (integer as i64).to_le_bytes()))
    }

    /// Writes a list of booleans.
    pub fn flags(&mut self, key: &str, length: u64, flags: impl Iterator<Item = bool>) -> io::Result<()> {
        self.array(key, "|b1", &[length], flags.map(|flag| [u8::from(flag)]))
    }

    /// Writes a list of texts.
    pub fn texts(&mut self, key: &str, texts: &[impl AsRef<str>]) -> io::Result<()> {
        let longest = texts.iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0).max(1);
        let elements = texts.iter().map(|text| padded(text.as_ref(), longest));
        self.array(key, &format!("<U{longest}"), &[texts.len() as u64], elements)
    }

    /// Writes an array of a type as NumPy names it.
    fn array<B: AsRef<[u8]>>(
        &mut self,
        key: &str,
        kind: &str,
        shape: &[u64],
        elements: impl Iterator<Item = B>,
    ) -> io::Result<()> {
        // Names are the widest elements, and check_names bounds them.
        let bytes = shape.iter().product::<u64>().saturating_mul(8);
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(bytes > u64::from(u32::MAX) - 4096);
        self.archive.start_file(file_name(key), options)?;
        npy::write(&mut self.archive, kind, shape, elements)
    }

    /// Ends the archive.
    ///
    /// # Errors
    /// The first of all that was written.
    pub fn finish(self) -> io::Result<()> {
        // The zip crate's destructor would try again, and complain on standard error.
        self.archive.finish()?.flush()?;
        self.failure.take().map_or(Ok(()), Err)
    }
}

/// A place that keeps its first failure to itself, and takes nothing from then on.
struct Kept<'a> {
    out: BufWriter<&'a mut dyn Place>,
    failure: Rc<RefCell<Option<io::Error>>>,
    /// Where the next byte goes, and where the last one is.
    at: u64,
    end: u64,
}

impl Kept<'_> {
    fn keep(&mut self, step: impl FnOnce(&mut BufWriter<&mut dyn Place>) -> io::Result<()>) {
        let mut failure = self.failure.borrow_mut();
        if failure.is_none() {
            *failure = step(&mut self.out).err();
        }
    }
}

impl Write for Kept<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.keep(|out| out.write_all(bytes));
        self.at += bytes.len() as u64;
        self.end = self.end.max(self.at);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.keep(|out| out.flush());
        Ok(())
    }
}

impl Seek for Kept<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::End(by) => self.end.checked_add_signed(by),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
        };
        self.at = at.ok_or(io::ErrorKind::InvalidInput)?;
        self.keep(|out| out.seek(SeekFrom::Start(at.unwrap_or_default())).map(drop));
        Ok(self.at)
    }
}

/// Where an archive is written: every kind of place by the same code.
pub(in crate::io) trait Place: Write + Seek {}

impl<W: Write + Seek> Place for W {}

/// An archive without arrays, into an empty place.
pub(in crate::io) fn zip_into(out: &mut dyn Place) -> Zip<'_> {
    let failure = Rc::default();
    let out = Kept { out: BufWriter::with_capacity(1 << 16, out), failure: Rc::clone(&failure), at: 0, end: 0 };
    Zip { archive: ZipWriter::new(out), failure }
}
