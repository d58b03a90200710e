//! NPZ: NumPy's archive of arrays, as `numpy.savez` and `numpy.savez_compressed` write it.
//!
//! `coords` (N, d) and `offsets` (B + 1), with `t` (N), `weight` (N), `known` (N), `closed` (B) and `names` (B) where there are any.

use std::io::{self, BufReader, BufWriter, Cursor, Read, Seek, Write};
use std::sync::Arc;

use npyz::npz::NpzArchive;
use npyz::zip::{CompressionMethod, DateTime, ZipWriter, write::FileOptions};
use npyz::{AutoSerialize, DType, NpyFile, Order, Serialize, TypeChar, TypeStr, WriterBuilder};

use super::memory::{Full, Room};
use super::npy::{self, Header};
use super::source::{Source, UNPACKED_BYTES, UNPACKED_TIMES, most_unpacked};
use super::{ReadOptions, close, close_as_marked};
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::constraint::Constraints;
use crate::error::{Error, Result, listed, shortened};

const KEYS: [&str; 7] = ["coords", "offsets", "t", "weight", "known", "closed", "names"];

/// Reads an archive.
pub(super) fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
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
    zip: NpzArchive<Cursor<Vec<u8>>>,
    packed_bytes: u64,
    /// What the arrays read so far say that they unpack to.
    unpacked_bytes: u64,
}

impl<'a> Archive<'a> {
    /// Reads all of it.
    pub(super) fn open(source: &'a mut Source<'_>) -> Result<Self> {
        let bytes = source.bytes()?;
        let packed_bytes = bytes.len() as u64;
        // The zip crate takes memory for as many entries as the archive claims: each has at least so many bytes.
        if entries(&bytes).is_some_and(|entries| entries > packed_bytes / ENTRY_BYTES) {
            return Err(
                source.error(None, "the archive claims more arrays than it has bytes for: write the file again")
            );
        }
        // Names and places of all entries.
        source.take(bytes.len().saturating_mul(8))?;
        let zip = NpzArchive::new(Cursor::new(bytes)).map_err(|error| {
            source
                .error(None, format!("this is no NPZ archive, or it was cut off ({error}): write it with numpy.savez"))
        })?;
        Ok(Archive { source, zip, packed_bytes, unpacked_bytes: 0 })
    }

    /// The names of its arrays.
    pub(super) fn keys(&self) -> Vec<String> {
        self.zip.array_names().map(String::from).collect()
    }

    /// Makes place for more of what was read.
    pub(super) fn grow<T>(&self, values: &mut Vec<T>, more: usize) -> Result<()> {
        self.source.grow(values, more)
    }

    pub(super) fn wrong(&self, message: impl Into<String>) -> Error {
        self.source.error(None, message)
    }

    fn check_keys(&self) -> Result<()> {
        let mut found: Vec<&str> = self.zip.array_names().collect();
        found.sort_unstable();
        let missing = KEYS[..2].iter().any(|key| !found.contains(key));
        if missing || found.iter().any(|key| !KEYS.contains(key)) {
            return Err(self.wrong(format!(
                "the arrays are {}: wanted are coords and offsets, and perhaps t, weight, known, closed, names",
                arrays(&found)
            )));
        }
        Ok(())
    }

    /// One array: its shape, whether it is stored column after column, and its values. All of it is read, so that its
    /// checksum is compared.
    pub(super) fn array<T>(
        &mut self,
        key: &str,
        values: impl FnOnce(Npy, &Room) -> io::Result<Option<Vec<T>>>,
    ) -> Result<Option<Array<T>>> {
        if !self.zip.array_names().any(|name| name == key) {
            return Ok(None);
        }
        let (source, name) = (self.source, shortened(key));
        let wrong = |message: String| source.error(None, format!("array {name} {message}"));
        let damaged = |error: io::Error| match error.get_ref().is_some_and(|inner| inner.is::<Full>()) {
            true => source.failed(error),
            false => wrong(format!("is damaged or cut off ({}): write the file again", shortened(&error.to_string()))),
        };
        // With a password, so that the zip crate tells of a secret entry in place of panicking; none is taken.
        let entry = self.zip.zip_archive().by_name_decrypt(&npyz::npz::file_name_from_array_name(key), b"");
        let Ok(mut entry) = entry.map_err(|error| damaged(error.into()))? else {
            return Err(wrong("is encrypted: write the file without a password".into()));
        };
        if !matches!(entry.compression(), CompressionMethod::Stored | CompressionMethod::Deflated) {
            return Err(wrong("is packed as NumPy packs none: write the file with numpy.savez".into()));
        }
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
        // A damaged header must not ask for more memory than the archive can fill, nor for elements of no bytes.
        let element_bytes = kind.num_bytes().unwrap_or(usize::MAX).max(1) as u64;
        let count =
            header.count().filter(|count| count.checked_mul(element_bytes).is_some_and(|bytes| bytes <= stored_bytes));
        let Some(count) = count else {
            return Err(wrong(format!("has the shape {}, but holds less: write the file again", tuple(&header.shape))));
        };
        let file = NpyFile::with_header(npy::plain(&kind, count).map_err(damaged)?, &mut reader as &mut dyn Read);
        let values = values(file, &source.room).map_err(damaged)?.ok_or_else(of_type)?;
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
        let offsets = self.array("offsets", |file, room| integers(file, room, |x| x))?.expect("checked with the keys");
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
        let array = self.array("known", |file, room| integers(file, room, |x| x))?;
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
        let array = self.array("names", |file, room| match kind(&file) {
            Some((TypeChar::UnicodeStr | TypeChar::ByteStr, _)) => values::<String, _>(file, room, |name| name),
            _ => Ok(None),
        })?;
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

pub(super) type Npy<'a> = NpyFile<&'a mut dyn Read>;

/// A shape as NumPy writes it.
pub(super) fn tuple(shape: &[u64]) -> String {
    match shape {
        [length] => format!("({length},)"),
        _ => format!("({})", listed(shape.iter().map(u64::to_string))),
    }
}

/// The names of arrays that were found.
pub(super) fn arrays(found: &[impl AsRef<str>]) -> String {
    match found {
        [] => "none".to_string(),
        _ => listed(found.iter().map(|name| shortened(name.as_ref()).into_owned())),
    }
}

/// The least that an entry takes in the directory of an archive.
const ENTRY_BYTES: u64 = 46;

/// How many entries an archive claims to have where it does so in 64 bits, in the place where the zip crate looks: the
/// claim in 16 bits asks for no memory to speak of.
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

fn kind(file: &Npy) -> Option<(TypeChar, u64)> {
    match file.dtype() {
        DType::Plain(kind) => Some((kind.type_char(), kind.size_field())),
        _ => None,
    }
}

/// The elements, turned into something else one by one.
fn values<T: npyz::Deserialize, U>(file: Npy, room: &Room, turn: impl Fn(T) -> U) -> io::Result<Option<Vec<U>>> {
    let mut values = Vec::new();
    room.reserve(&mut values, usize::try_from(file.len()).unwrap_or(usize::MAX))?;
    for value in file.data::<T>().map_err(io::Error::other)? {
        values.push(turn(value?));
    }
    Ok(Some(values))
}

/// Floats, integers or booleans as f64; `None` for another type.
pub(super) fn numbers(file: Npy, room: &Room) -> io::Result<Option<Vec<f64>>> {
    match kind(&file) {
        Some((TypeChar::Float, 8)) => values::<f64, _>(file, room, |x| x),
        Some((TypeChar::Float, 4)) => values::<f32, _>(file, room, f64::from),
        _ => integers(file, room, |value| value as f64),
    }
}

/// Integers of any width, or booleans; `None` for another type.
fn integers<U>(file: Npy, room: &Room, turn: impl Fn(i64) -> U) -> io::Result<Option<Vec<U>>> {
    match kind(&file) {
        Some((TypeChar::Int, 8)) => values::<i64, _>(file, room, turn),
        Some((TypeChar::Int, 4)) => values::<i32, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Int, 2)) => values::<i16, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Int, 1)) => values::<i8, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Uint, 8)) => values::<u64, _>(file, room, |x| turn(i64::try_from(x).unwrap_or(i64::MAX))),
        Some((TypeChar::Uint, 4)) => values::<u32, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Uint, 2)) => values::<u16, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Uint, 1)) => values::<u8, _>(file, room, |x| turn(x.into())),
        Some((TypeChar::Bool, _)) => values::<bool, _>(file, room, |x| turn(x.into())),
        _ => Ok(None),
    }
}

/// Names of NPZ may take so many bytes together.
const NAMES_BYTES: usize = 1 << 30;

/// Refuses names that would fill the disk: each takes the room of the longest.
pub(super) fn check_names(batch: &CurveBatch) -> Result<()> {
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
pub(super) fn write(out: &mut dyn Write, batch: &CurveBatch) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    write_seekable(&mut bytes, batch)?;
    out.write_all(bytes.get_ref())
}

/// Writes an archive; equal batches give equal bytes.
pub(super) fn write_seekable<W: Write + Seek>(out: W, batch: &CurveBatch) -> io::Result<()> {
    let (points, curves) = (batch.total_points() as u64, batch.len() as u64);
    let mut zip = ZipWriter::new(BufWriter::with_capacity(1 << 16, out));
    array(
        &mut zip,
        "coords",
        f64::default_dtype(),
        &[points, batch.dimension() as u64],
        batch.coords().iter().copied(),
    )?;
    let offsets = batch.offsets().iter().map(|&offset| offset as i64);
    array(&mut zip, "offsets", i64::default_dtype(), &[curves + 1], offsets)?;
    array(&mut zip, "closed", bool::default_dtype(), &[curves], (0..batch.len()).map(|i| batch.is_closed(i)))?;
    let all = || 0..batch.len();
    if all().any(|i| batch.parameters(i).is_some()) {
        let t = all().flat_map(|i| batch.parameters(i).unwrap_or_default()).copied();
        array(&mut zip, "t", f64::default_dtype(), &[points], t)?;
    }
    if all().any(|i| batch.weights(i).is_some()) {
        let weights = all().flat_map(|i| batch.weights(i).unwrap_or_default()).copied();
        array(&mut zip, "weight", f64::default_dtype(), &[points], weights)?;
    }
    if let Some(known) = &batch.constraints().known {
        array(&mut zip, "known", bool::default_dtype(), &[points], known.iter().copied())?;
    }
    if batch.origin().names.is_some() {
        let longest = all().map(|i| batch.name(i).chars().count()).max().unwrap_or(0).max(1);
        let text: TypeStr = format!("<U{longest}").parse().map_err(io::Error::other)?;
        array(&mut zip, "names", DType::Plain(text), &[curves], all().map(|i| batch.name(i).into_owned()))?;
    }
    zip.finish()?.flush()
}

/// Writes one array.
pub(super) fn array<T: Serialize, W: Write + Seek>(
    zip: &mut ZipWriter<W>,
    key: &str,
    dtype: DType,
    shape: &[u64],
    values: impl Iterator<Item = T>,
) -> io::Result<()> {
    let bytes = shape.iter().product::<u64>().saturating_mul(dtype.num_bytes().unwrap_or(8) as u64);
    let options = FileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .large_file(bytes > u64::from(u32::MAX) - 4096);
    zip.start_file(npyz::npz::file_name_from_array_name(key), options)?;
    let mut buffer = BufWriter::with_capacity(1 << 16, zip);
    let mut npy = npyz::WriteOptions::new().dtype(dtype).shape(shape).writer(&mut buffer).begin_nd()?;
    npy.extend(values)?;
    npy.finish()?;
    buffer.flush()
}
