//! Bytes in: a file, standard input or any reader, gzip and the byte-order mark taken off.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use crate::error::{Error, Result};

/// An open input.
pub(super) struct Source<'a> {
    /// The name for errors, as the user gave it; `-` for standard input, `input` for a reader.
    pub path: PathBuf,
    /// The bytes.
    pub reader: Box<dyn BufRead + 'a>,
    zipped: bool,
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

    /// Gzip is known by its first two bytes, whatever the name says.
    fn unwrapped(path: &Path, raw: Box<dyn BufRead + 'a>) -> Result<Self> {
        let source = Source { path: path.to_path_buf(), reader: Box::new(io::empty()), zipped: false };
        let (head, raw) = peek(raw).map_err(|error| source.failed(error))?;
        if !head.starts_with(&[0x1f, 0x8b]) {
            return Ok(Source { reader: without_mark(&head, raw), ..source });
        }
        let source = Source { zipped: true, ..source };
        let unzipped = Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(chain(head, raw))));
        let (head, unzipped) = peek(unzipped).map_err(|error| source.failed(error))?;
        Ok(Source { reader: without_mark(&head, unzipped), ..source })
    }

    /// A failure to read, as a sentence: the system's, or that of gzip data cut off.
    pub fn failed(&self, error: io::Error) -> Error {
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

    /// Everything, as bytes.
    pub fn bytes(&mut self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.reader.read_to_end(&mut bytes).map_err(|error| self.failed(error))?;
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(self.error(None, "the file is empty: there is nothing to read"));
        }
        Ok(bytes)
    }

    /// Everything, as text.
    pub fn text(&mut self) -> Result<String> {
        String::from_utf8(self.bytes()?).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            self.error(None, format!("byte {at} is not UTF-8 text: save the file as UTF-8"))
        })
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

fn without_mark<'a>(head: &[u8], reader: Box<dyn BufRead + 'a>) -> Box<dyn BufRead + 'a> {
    if head == b"\xef\xbb\xbf" { reader } else { chain(head.to_vec(), reader) }
}
