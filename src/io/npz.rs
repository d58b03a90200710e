//! NPZ: NumPy's archive of arrays, as `numpy.savez` and `numpy.savez_compressed` write it.
//!
//! An archive has `coords` (N, d) and `offsets` (B + 1). It may have `t` (N), `weight` (N), `known`
//! (N), `closed` (B) and `names` (B).

use std::io::{self, BufReader, BufWriter, Cursor, Read, Seek, Write};
use std::sync::Arc;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::antimeridian::{self, wrapped};
use super::formats::Entry;
use super::memory::{Full, Room};
use super::npy::{self, Element, Elements, Header, Order, Padded, integers, numbers, texts};
use super::source::{Source, UNPACKED_BYTES, UNPACKED_TIMES, most_unpacked};
use super::{Antimeridian, ReadOptions, close, close_as_marked, free_names};
use crate::batch::{CurveBatch, Origin, Values};
use crate::constraint::Constraints;
use crate::error::{Error, Result, listed, shortened};

const KEYS: [&str; 7] = ["coords", "offsets", "t", "weight", "known", "closed", "names"];

pub(super) const ENTRY: Entry = Entry {
    word: "npz",
    extensions: &[],
    title: "NPZ",
    reads: "`coords` (N, d), `offsets` (B + 1), optional `t`, `weight`, `known`, `closed`, `names`",
    writes: "the same",
    lacks: "offsets has one entry, and needs one more than there are curves",
    dimensions: 2..=3,
    beziers: true,
    columns: true,
    read,
    write: |out, batch, options, _| write(out, batch, options.antimeridian),
    write_file: Some(|file, batch, options| write_seekable(file, batch, options.antimeridian)),
    check: check_names,
};

/// Reads an archive.
fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let mut archive = Archive::open(source)?;
    archive.check_keys()?;
    let (dimension, coords) = archive.coords()?;
    let points = coords.len() / dimension;
    let offsets = archive.offsets()?;
    let curves = offsets.len().saturating_sub(1);
    let names = archive.names(curves)?;
    let t = archive.floats("t", points, "point")?;
    let weight = archive.floats("weight", points, "point")?;
    let known = archive.known(points)?;
    let closed = archive.floats("closed", curves, "curve")?;
    let source = archive.source;
    let in_file = |error| match error {
        Error::Batch(message) => source.error(None, message),
        other => other,
    };
    let origin = Origin { file: Some(source.path.display().to_string()), names, ..Origin::default() };
    let mut batch = CurveBatch::from_file(dimension, coords, offsets, Arc::new(origin)).map_err(in_file)?;
    if let Some(t) = t {
        batch = batch.with_parameters(t)?;
    }
    if let Some(weight) = weight {
        batch = batch.with_weights(weight)?;
    }
    if known.is_some() {
        batch = batch.with_constraints(Constraints { known, ..Constraints::default() })?;
    }
    let Some(closed) = closed else {
        let marked = vec![false; batch.len()];
        return close(batch, options.closed, &marked, &[]);
    };
    close_as_marked(batch, options.closed, closed.iter().map(|&flag| flag != 0.0).collect())
}

/// An archive in memory, and the file that it was.
pub(super) struct Archive<'a> {
    source: &'a Source<'a>,
    zip: ZipArchive<Cursor<Vec<u8>>>,
    packed_bytes: u64,
    /// Bytes that the arrays read so far claim to unpack to.
    unpacked_bytes: u64,
}

impl<'a> Archive<'a> {
    /// Reads all of it.
    pub(super) fn open(source: &'a mut Source<'_>) -> Result<Self> {
        let bytes = source.bytes()?;
        let packed_bytes = bytes.len() as u64;
        // The zip crate takes memory for as many entries as the archive claims. Each entry has at
        // least so many bytes.
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
    pub(super) fn keys(&self) -> Vec<String> {
        self.zip.file_names().flatten().filter_map(|name| name.strip_suffix(".npy").map(String::from)).collect()
    }

    /// Makes room for more of the values read.
    pub(super) fn grow<T>(&self, values: &mut Vec<T>, more: usize) -> Result<()> {
        self.source.grow(values, more)
    }

    pub(super) fn wrong(&self, message: impl Into<String>) -> Error {
        self.source.error(None, message)
    }

    fn check_keys(&self) -> Result<()> {
        let mut found = self.keys();
        found.sort_unstable();
        let missing = KEYS[..2].iter().any(|key| !found.iter().any(|found| found == key));
        if missing || found.iter().any(|key| !KEYS.contains(&key.as_str())) {
            return Err(self.wrong(format!(
                "the arrays are {}: wanted are coords and offsets, and perhaps t, weight, known, closed, names",
                arrays(&found)
            )));
        }
        Ok(())
    }

    /// One array: its shape, whether it is stored column after column, and its values.
    ///
    /// All of it is read, so that its checksum is compared.
    pub(super) fn array<T>(
        &mut self,
        key: &str,
        values: fn(Elements, &Room) -> io::Result<Option<Vec<T>>>,
    ) -> Result<Option<Array<T>>> {
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

    fn coords(&mut self) -> Result<(usize, Vec<f64>)> {
        let array = self.array("coords", numbers)?.expect("checked with the keys");
        let [points, dimension @ (2 | 3)] = array.shape[..] else {
            let shape = tuple(&array.shape);
            return Err(self.wrong(format!("array coords has the shape {shape}: it must be (N, 2) or (N, 3)")));
        };
        let (n, d) = (points as usize, dimension as usize);
        Ok(match array.order {
            Order::C => (d, array.values),
            Order::Fortran => (d, (0..n * d).map(|at| array.values[at % d * n + at / d]).collect()),
        })
    }

    fn offsets(&mut self) -> Result<Vec<usize>> {
        let offsets = self.array("offsets", integers)?.expect("checked with the keys");
        self.expect_one_axis("offsets", &offsets.shape)?;
        let negative = offsets.values.iter().find(|&&offset| offset < 0);
        match negative {
            Some(offset) => Err(self.wrong(format!("array offsets holds {offset}: offsets count points from 0"))),
            None => Ok(offsets.values.iter().map(|&offset| offset as usize).collect()),
        }
    }

    fn floats(&mut self, key: &str, wanted: usize, unit: &str) -> Result<Option<Vec<f64>>> {
        let array = self.array(key, numbers)?;
        self.expect_length(key, array, wanted, unit)
    }

    /// Which control points are given.
    fn known(&mut self, points: usize) -> Result<Option<Vec<bool>>> {
        let array = self.array("known", integers)?;
        let Some(flags) = self.expect_length("known", array, points, "point")? else { return Ok(None) };
        match flags.iter().position(|flag| !matches!(flag, 0 | 1)) {
            Some(point) => Err(self.wrong(format!(
                "array known holds {} for point {point}, which is neither 1 nor 0: write 1 for a given control point, 0 else",
                flags[point]
            ))),
            None => Ok(Some(flags.iter().map(|&flag| flag == 1).collect())),
        }
    }

    fn names(&mut self, wanted: usize) -> Result<Option<Vec<String>>> {
        let array = self.array("names", texts)?;
        self.expect_length("names", array, wanted, "curve")
    }

    fn expect_length<T>(
        &self,
        key: &str,
        array: Option<Array<T>>,
        wanted: usize,
        unit: &str,
    ) -> Result<Option<Vec<T>>> {
        let Some(array) = array else { return Ok(None) };
        self.expect_one_axis(key, &array.shape)?;
        match array.values.len() {
            found if found == wanted => Ok(Some(array.values)),
            found => {
                Err(self.wrong(format!("array {key} has {found} entries for {wanted} {unit}s: give one a {unit}")))
            }
        }
    }

    fn expect_one_axis(&self, key: &str, shape: &[u64]) -> Result<()> {
        match shape {
            [_] => Ok(()),
            _ => Err(self.wrong(format!("array {key} has the shape {}: it must have one axis", tuple(shape)))),
        }
    }
}

/// The content of one array.
pub(super) struct Array<T> {
    pub shape: Vec<u64>,
    pub order: Order,
    pub values: Vec<T>,
}

/// A shape as NumPy writes it.
pub(super) fn tuple(shape: &[u64]) -> String {
    match shape {
        [length] => format!("({length},)"),
        _ => format!("({})", listed(shape.iter().map(u64::to_string))),
    }
}

/// The names of arrays that were found, in words.
pub(super) fn arrays(found: &[impl AsRef<str>]) -> String {
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

/// The most bytes that the names of an NPZ file may take together.
const NAMES_BYTES: usize = 1 << 30;

/// Refuses names that would fill the disk. Each name takes the space of the longest.
fn check_names(batch: &CurveBatch) -> Result<()> {
    let Some(names) = &batch.origin().names else { return Ok(()) };
    let length = |name: &String| name.chars().count();
    let longest = (0..batch.len()).max_by_key(|&i| length(&names[i]));
    match longest.map(|i| (i, length(&names[i]))) {
        Some((i, longest)) if longest.saturating_mul(4).saturating_mul(batch.len()) > NAMES_BYTES => {
            Err(Error::Argument(format!(
                "NPZ gives every name the room of the longest, the {longest} letters of curve {}, and {} names would take \
                 more than {} MiB: shorten it, or write CSV, GeoJSON or SVG",
                batch.label(i),
                batch.len(),
                NAMES_BYTES >> 20
            )))
        }
        _ => Ok(()),
    }
}

/// Writes an archive through memory, to an output that cannot seek.
fn write(out: &mut dyn Write, batch: &CurveBatch, antimeridian: Antimeridian) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    write_seekable(&mut bytes, batch, antimeridian)?;
    out.write_all(bytes.get_ref())
}

/// Writes an archive. Equal batches give equal bytes.
fn write_seekable<W: Write + Seek>(out: W, batch: &CurveBatch, antimeridian: Antimeridian) -> io::Result<()> {
    let (points, curves) = (batch.total_points() as u64, batch.len() as u64);
    let mut zip = ZipWriter::new(BufWriter::with_capacity(1 << 16, out));
    let coords = (0..batch.len()).flat_map(|i| {
        let wrap = antimeridian == Antimeridian::Cut && antimeridian::concerns(batch, i);
        let d = batch.dimension();
        batch.points(i).iter().enumerate().map(move |(at, &x)| if wrap && at % d == 0 { wrapped(x) } else { x })
    });
    array(&mut zip, "coords", "<f8", &[points, batch.dimension() as u64], coords)?;
    let offsets = batch.offsets().iter().map(|&offset| offset as i64);
    array(&mut zip, "offsets", "<i8", &[curves + 1], offsets)?;
    array(&mut zip, "closed", "|b1", &[curves], (0..batch.len()).map(|i| batch.is_closed(i)))?;
    let all = || 0..batch.len();
    if all().any(|i| batch.parameters(i).is_some()) {
        let t = all().flat_map(|i| batch.parameters(i).unwrap_or_default()).copied();
        array(&mut zip, "t", "<f8", &[points], t)?;
    }
    if all().any(|i| batch.weights(i).is_some()) {
        let weights = all().flat_map(|i| batch.weights(i).unwrap_or_default()).copied();
        array(&mut zip, "weight", "<f8", &[points], weights)?;
    }
    if let Some(known) = &batch.constraints().known {
        array(&mut zip, "known", "|b1", &[points], known.iter().copied())?;
    }
    if batch.origin().names.is_some() {
        let longest = all().map(|i| batch.name(i).chars().count()).max().unwrap_or(0).max(1);
        let names = all().map(|i| Padded(batch.name(i), longest));
        array(&mut zip, "names", &format!("<U{longest}"), &[curves], names)?;
    }
    for (column, name) in batch.columns().iter().zip(free_names(batch, &KEYS)) {
        match &column.values {
            Values::Numbers(numbers) => array(&mut zip, &name, "<f8", &[points], numbers.iter().copied())?,
            Values::Texts(texts) => {
                let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
                let texts = texts.iter().map(|text| Padded(text.into(), longest));
                array(&mut zip, &name, &format!("<U{longest}"), &[points], texts)?;
            }
        }
    }
    zip.finish()?.flush()
}

/// The archive's name of an array.
fn file_name(key: &str) -> String {
    format!("{key}.npy")
}

/// Writes one array of a type as NumPy names it.
pub(super) fn array<E: Element, W: Write + Seek>(
    zip: &mut ZipWriter<W>,
    key: &str,
    kind: &str,
    shape: &[u64],
    elements: impl Iterator<Item = E>,
) -> io::Result<()> {
    // Names are the widest elements, and check_names bounds them.
    let bytes = shape.iter().product::<u64>().saturating_mul(8);
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .large_file(bytes > u64::from(u32::MAX) - 4096);
    zip.start_file(file_name(key), options)?;
    let mut buffer = BufWriter::with_capacity(1 << 16, zip);
    npy::write(&mut buffer, kind, shape, elements)?;
    buffer.flush()
}
