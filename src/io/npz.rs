//! NPZ: NumPy's archive of arrays, as `numpy.savez` and `numpy.savez_compressed` write it.
//!
//! `coords` (N, d) and `offsets` (B + 1), with `t` (N), `weight` (N), `known` (N), `closed` (B) and `names` (B) where there are any.

use std::io::{self, BufReader, BufWriter, Cursor, Read, Seek, Write};
use std::sync::Arc;

use npyz::npz::NpzArchive;
use npyz::zip::{CompressionMethod, DateTime, ZipWriter, write::FileOptions};
use npyz::{AutoSerialize, DType, NpyFile, Order, Serialize, TypeChar, TypeStr, WriterBuilder};

use super::source::Source;
use super::{Origin, ReadOptions, close};
use crate::batch::CurveBatch;
use crate::constraint::Constraints;
use crate::error::{Error, Result};

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
    let marked = match options.closed {
        super::Closed::Auto => closed.iter().map(|&flag| flag != 0.0).collect(),
        given => vec![given == super::Closed::Yes; curves],
    };
    batch.closed_each(marked)
}

/// An archive in memory, and the file that it was.
pub(super) struct Archive<'a> {
    source: &'a Source<'a>,
    zip: NpzArchive<Cursor<Vec<u8>>>,
}

impl<'a> Archive<'a> {
    /// Reads all of it.
    pub(super) fn open(source: &'a mut Source<'_>) -> Result<Self> {
        let bytes = source.bytes()?;
        let zip = NpzArchive::new(Cursor::new(bytes)).map_err(|error| {
            source
                .error(None, format!("this is no NPZ archive, or it was cut off ({error}): write it with numpy.savez"))
        })?;
        Ok(Archive { source, zip })
    }

    /// The names of its arrays.
    pub(super) fn keys(&self) -> Vec<String> {
        self.zip.array_names().map(String::from).collect()
    }

    pub(super) fn wrong(&self, message: impl Into<String>) -> Error {
        self.source.error(None, message)
    }

    fn check_keys(&self) -> Result<()> {
        let mut found: Vec<&str> = self.zip.array_names().collect();
        found.sort_unstable();
        let missing = KEYS[..2].iter().any(|key| !found.contains(key));
        if missing || found.iter().any(|key| !KEYS.contains(key)) {
            let found = if found.is_empty() { "none".to_string() } else { found.join(", ") };
            return Err(self.wrong(format!(
                "the arrays are {found}: wanted are coords and offsets, and perhaps t, weight, known, closed, names"
            )));
        }
        Ok(())
    }

    /// One array: its shape, whether it is stored column after column, and its values.
    pub(super) fn array<T>(
        &mut self,
        key: &str,
        values: impl FnOnce(Npy) -> io::Result<Option<Vec<T>>>,
    ) -> Result<Option<Array<T>>> {
        if !self.zip.array_names().any(|name| name == key) {
            return Ok(None);
        }
        let damaged = |error: io::Error, source: &Source| {
            source.error(None, format!("array {key} is damaged or cut off ({error}): write the file again"))
        };
        let entry = self.zip.zip_archive().by_name(&npyz::npz::file_name_from_array_name(key));
        let entry = entry.map_err(|error| damaged(error.into(), self.source))?;
        let stored_bytes = entry.size();
        let file = NpyFile::new(BufReader::with_capacity(1 << 16, Box::new(entry) as Box<dyn Read>))
            .map_err(|error| damaged(error, self.source))?;
        let (shape, order, dtype) = (file.shape().to_vec(), file.order(), file.dtype().descr());
        // A damaged header must not ask for more memory than the archive can fill.
        let bytes =
            shape.iter().try_fold(file.dtype().num_bytes().unwrap_or(1) as u64, |n, &length| n.checked_mul(length));
        if bytes.is_none_or(|bytes| bytes > stored_bytes) {
            let message = format!("array {key} has the shape {}, but holds less: write the file again", tuple(&shape));
            return Err(self.source.error(None, message));
        }
        match values(file) {
            Ok(Some(values)) => Ok(Some(Array { shape, order, values })),
            Ok(None) => Err(self.source.error(None, format!("array {key} has the type {dtype}: {}", wanted_type(key)))),
            Err(error) => Err(damaged(error, self.source)),
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
        let array = self.array("names", |file| match kind(&file) {
            Some((TypeChar::UnicodeStr | TypeChar::ByteStr, _)) => file.into_vec::<String>().map(Some),
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

pub(super) type Npy<'a> = NpyFile<BufReader<Box<dyn Read + 'a>>>;

/// A shape as NumPy writes it.
pub(super) fn tuple(shape: &[u64]) -> String {
    match shape {
        [length] => format!("({length},)"),
        _ => format!("({})", shape.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")),
    }
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

/// Floats, integers or booleans as f64; `None` for another type.
pub(super) fn numbers(file: Npy) -> io::Result<Option<Vec<f64>>> {
    match kind(&file) {
        Some((TypeChar::Float, 8)) => file.into_vec::<f64>().map(Some),
        Some((TypeChar::Float, 4)) => {
            let values: io::Result<Vec<f64>> =
                file.data::<f32>().map_err(io::Error::other)?.map(|x| x.map(f64::from)).collect();
            values.map(Some)
        }
        _ => Ok(integers(file)?.map(|values| values.into_iter().map(|value| value as f64).collect())),
    }
}

/// Integers of any width, or booleans; `None` for another type.
fn integers(file: Npy) -> io::Result<Option<Vec<i64>>> {
    fn widen<T: npyz::Deserialize>(file: Npy, widen: impl Fn(T) -> i64) -> io::Result<Option<Vec<i64>>> {
        let values: io::Result<Vec<i64>> =
            file.data::<T>().map_err(io::Error::other)?.map(|value| value.map(&widen)).collect();
        values.map(Some)
    }
    match kind(&file) {
        Some((TypeChar::Int, 8)) => widen::<i64>(file, |value| value),
        Some((TypeChar::Int, 4)) => widen::<i32>(file, i64::from),
        Some((TypeChar::Int, 2)) => widen::<i16>(file, i64::from),
        Some((TypeChar::Int, 1)) => widen::<i8>(file, i64::from),
        Some((TypeChar::Uint, 8)) => widen::<u64>(file, |value| i64::try_from(value).unwrap_or(i64::MAX)),
        Some((TypeChar::Uint, 4)) => widen::<u32>(file, i64::from),
        Some((TypeChar::Uint, 2)) => widen::<u16>(file, i64::from),
        Some((TypeChar::Uint, 1)) => widen::<u8>(file, i64::from),
        Some((TypeChar::Bool, _)) => widen::<bool>(file, i64::from),
        _ => Ok(None),
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
