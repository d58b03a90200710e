//! Input as bytes: a file, standard input or any reader, without gzip and the byte-order mark,
//! UTF-16 as UTF-8.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use flate2::bufread::MultiGzDecoder;

use super::encoding::{self, NOT_UTF8};
use super::limits::{ROW_BYTES, Refusal, most_unpacked};
use super::memory::{Full, Room};
use crate::batch::Origin;
use crate::error::{Error, Result, quoted};

/// An open input.
pub(super) struct Source<'a> {
    /// The name for errors, as the user gave it; `-` for standard input, `input` for a reader.
    pub path: PathBuf,
    /// The bytes.
    pub reader: Box<dyn BufRead + 'a>,
    /// The memory that reading may take.
    pub room: Room,
    zipped: bool,
    /// Whether the first bytes told the encoding of the text.
    is_utf8: bool,
}

impl<'a> Source<'a> {
    /// Opens a file, or standard input for `-`.
    pub fn open(path: &Path) -> Result<Self> {
        let raw: Box<dyn BufRead> = if path == Path::new("-") {
            Box::new(BufReader::new(io::stdin()))
        } else {
            let file = File::open(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
            Box::new(BufReader::with_capacity(1 << 16, file))
        };
        Self::unwrapped(path, raw)
    }

    /// Takes bytes that have no name.
    pub fn of_reader(reader: impl Read + 'a) -> Result<Self> {
        Self::unwrapped(Path::new("input"), Box::new(BufReader::with_capacity(1 << 16, reader)))
    }

    /// Takes off gzip, which is known by its first two bytes, whatever the name says.
    fn unwrapped(path: &Path, raw: Box<dyn BufRead + 'a>) -> Result<Self> {
        let source = Source {
            path: path.to_path_buf(),
            reader: Box::new(io::empty()),
            room: Room::of_system(),
            zipped: false,
            is_utf8: false,
        };
        let (head, raw) = peek(raw).map_err(|error| source.failed(error))?;
        if !head.starts_with(&[0x1f, 0x8b]) {
            let (reader, is_utf8) = encoding::as_utf8(&head, raw);
            return Ok(Source { reader, is_utf8, ..source });
        }
        let source = Source { zipped: true, ..source };
        let packed = Rc::new(Cell::new(0));
        let raw = Counted { inner: chain(head, raw), bytes: packed.clone() };
        let unpacked = Unpacked { inner: MultiGzDecoder::new(raw), packed, bytes: 0 };
        let (head, unzipped) =
            peek(Box::new(BufReader::with_capacity(1 << 16, unpacked))).map_err(|error| source.failed(error))?;
        let (reader, is_utf8) = encoding::as_utf8(&head, unzipped);
        Ok(Source { reader, is_utf8, ..source })
    }

    /// A failure to read, as a sentence.
    ///
    /// The system reports it, or gzip data is cut off or much too large.
    pub fn failed(&self, error: io::Error) -> Error {
        let inner = error.get_ref();
        if inner.is_some_and(|inner| inner.is::<Full>() || inner.is::<Refusal>()) {
            return self.error(None, error.to_string());
        }
        match error.kind() {
            io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData if self.zipped => {
                self.error(None, format!("the gzip data is damaged or cut off ({error}): fetch the file again"))
            }
            _ => Error::Read { path: self.path.clone(), source: error },
        }
    }

    /// A parse error at a line of this input.
    pub fn error(&self, line: impl Into<Option<u64>>, message: impl Into<String>) -> Error {
        Error::parse(&self.path, line, message)
    }

    /// The error that there is no room for what the input holds.
    pub fn full(&self, full: Full) -> Error {
        self.error(None, full.to_string())
    }

    /// That a batch was read from here.
    pub fn origin(&self) -> Origin {
        Origin { file: Some(self.path.display().to_string()), ..Origin::default() }
    }

    /// Counts memory that other code allocates.
    pub fn take(&self, bytes: usize) -> Result<()> {
        self.room.take(bytes).map_err(|full| self.full(full))
    }

    /// Makes room for more entries.
    pub fn grow<T>(&self, values: &mut Vec<T>, more: usize) -> Result<()> {
        self.room.grow(values, more).map_err(|full| self.full(full))
    }

    /// Appends an entry.
    pub fn push<T>(&self, values: &mut Vec<T>, value: T) -> Result<()> {
        self.grow(values, 1)?;
        values.push(value);
        Ok(())
    }

    /// Everything, as bytes.
    pub fn bytes(&mut self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut reader = std::mem::replace(&mut self.reader, Box::new(io::empty()));
        loop {
            let found = match reader.fill_buf() {
                Ok(found) => found,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(self.failed(error)),
            };
            if found.is_empty() {
                break;
            }
            self.room.grow(&mut bytes, found.len()).map_err(|full| self.full(full))?;
            bytes.extend_from_slice(found);
            let count = found.len();
            reader.consume(count);
        }
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(self.error(None, "the file is empty: there is nothing to read"));
        }
        Ok(bytes)
    }

    /// Everything, as text. XML in another encoding says that it is UTF-8 then.
    pub fn text(&mut self) -> Result<String> {
        let bytes = self.bytes()?;
        let declared = encoding::declared(&bytes);
        let name = declared.clone().map(|place| String::from_utf8_lossy(&bytes[place]).into_owned());
        let mut text = match name.filter(|name| !(self.is_utf8 || bytes.is_ascii() || encoding::is_utf8(name))) {
            None => String::from_utf8(bytes).map_err(|error| {
                let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
                let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count() as u64;
                self.error(line, format!("byte {} of the file is {NOT_UTF8}", good.len()))
            })?,
            Some(name) if encoding::is_latin(&name) => {
                self.take(2 * bytes.len())?;
                encoding::of_latin(&bytes)
            }
            Some(name) => {
                let read = "UTF-8, UTF-16, ISO-8859-1 and windows-1252 are read: save the file as UTF-8";
                return Err(self.error(1, format!("its encoding is {}, and {read}", quoted(&name))));
            }
        };
        if let Some(place) = declared {
            text.replace_range(place, "UTF-8");
        }
        Ok(text)
    }
}

/// The first three bytes (fewer at the end of the input), and what comes after them.
fn peek<'a>(mut reader: Box<dyn BufRead + 'a>) -> io::Result<(Vec<u8>, Box<dyn BufRead + 'a>)> {
    let mut head = Vec::with_capacity(3);
    reader.by_ref().take(3).read_to_end(&mut head)?;
    Ok((head, reader))
}

fn chain<'a>(head: Vec<u8>, reader: Box<dyn BufRead + 'a>) -> Box<dyn BufRead + 'a> {
    Box::new(io::Cursor::new(head).chain(reader))
}

/// Counts the bytes taken from a reader.
struct Counted<R> {
    inner: R,
    bytes: Rc<Cell<u64>>,
}

impl<R: BufRead> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.bytes.set(self.bytes.get() + count as u64);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Counted<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.inner.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.bytes.set(self.bytes.get() + count as u64);
        self.inner.consume(count);
    }
}

/// The output of a decoder, as long as it is not too much for the bytes it took.
struct Unpacked<R> {
    inner: R,
    packed: Rc<Cell<u64>>,
    bytes: u64,
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.bytes += count as u64;
        match self.bytes > most_unpacked(self.packed.get()) {
            true => Err(io::Error::other(Refusal::Unpacked)),
            false => Ok(count),
        }
    }
}

/// Gives rows of bounded length. Code that has read a row sets `since_row` to 0.
pub(super) struct RowReader<'c, R> {
    pub inner: R,
    pub since_row: &'c Cell<u64>,
}

impl<R: Read> Read for RowReader<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        let bytes = self.since_row.get() + count as u64;
        self.since_row.set(bytes);
        if bytes > ROW_BYTES { Err(io::Error::other(Refusal::Row)) } else { Ok(count) }
    }
}

/// Reads a line of at most `most_bytes` bytes, with its end, and appends it to `bytes`.
pub(super) fn read_line(
    reader: &mut dyn BufRead,
    room: &Room,
    bytes: &mut Vec<u8>,
    most_bytes: u64,
) -> io::Result<usize> {
    let before = bytes.len();
    loop {
        let found = match reader.fill_buf() {
            Ok(found) => found,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        let end = found.iter().position(|&byte| byte == b'\n').map(|at| at + 1);
        let count = end.unwrap_or(found.len());
        room.grow(bytes, count)?;
        bytes.extend_from_slice(&found[..count]);
        reader.consume(count);
        if (bytes.len() - before) as u64 > most_bytes {
            return Err(io::Error::other(Refusal::Row));
        }
        if end.is_some() || count == 0 {
            return Ok(bytes.len() - before);
        }
    }
}
