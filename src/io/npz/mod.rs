//! NPZ: NumPy's archive of arrays, as `numpy.savez` and `numpy.savez_compressed` write it.
//!
//! An archive has `coords` (N, d) and `offsets` (B + 1). It may have `t` (N), `weight` (N), `known`
//! (N), `closed` (B) and `names` (B). Other arrays, with an entry a point, travel along on demand.
//!
//! Streamlines as nibabel keeps them are read, too, and written again so: `data` (N, d), and
//! `offsets` and `lengths` (B), the first point of each and the number of its points.

mod archive;

use std::any::Any;
use std::io::{self, Cursor, Write};
use std::sync::Arc;

use super::antimeridian::{self, wrapped};
use super::columns::STATUS;
use super::entry::Entry;
use super::npy::{integers, numbers, texts};
use super::source::Source;
use super::{Antimeridian, ReadOptions, WriteOptions, close, close_as_marked, free_names};
use crate::batch::{Column, CurveBatch, Origin, Values};
use crate::constraint::Constraints;
use crate::error::{Error, Result};
use archive::ReadValues;
pub(super) use archive::{Archive, Place, arrays, tuple, zip_into};

const KEYS: [&str; 7] = ["coords", "offsets", "t", "weight", "known", "closed", "names"];

/// The arrays of nibabel's streamlines, which make coords and offsets.
const DATA: &str = "data";
const LENGTHS: &str = "lengths";

/// That a batch was read from nibabel's streamlines.
struct Streamlines;

pub(super) const ENTRY: Entry = Entry {
    reads: "`coords` (N, d), `offsets` (B + 1), optional `t`, `weight`, `known`, `closed`, `names`; or nibabel's `data`, `offsets`, `lengths`",
    writes: "the same, and columns",
    lacks: "offsets has one entry, and needs one more than there are curves",
    beziers: true,
    columns: true,
    statuses: true,
    parameters: true,
    write_file: Some(|file, batch, options| write_seekable(file, batch, options)),
    check: check_names,
    ..Entry::new("npz", "NPZ", read, |out, batch, options, _| write(out, batch, options))
};

/// Reads an archive.
fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let mut archive = Archive::open(source)?;
    let streamlines = archive.check_keys()?;
    let (dimension, coords) = archive.coords(if streamlines { DATA } else { "coords" })?;
    let (coords, offsets) = match streamlines {
        true => archive.streamlines(dimension, coords)?,
        false => (coords, archive.offsets()?),
    };
    let points = coords.len() / dimension;
    let curves = offsets.len().saturating_sub(1);
    let names = archive.list("names", texts, curves, "curve")?;
    let t = archive.list("t", numbers, points, "point")?;
    let weight = archive.list("weight", numbers, points, "point")?;
    let known = archive.known(points)?;
    let closed = archive.list("closed", numbers, curves, "curve")?;
    let (columns, notes) = if streamlines { (vec![], vec![]) } else { archive.others(points, options)? };
    let source = archive.source;
    let in_file = |error| match error {
        Error::Batch(message) => source.error(None, message),
        other => other,
    };
    let document = streamlines.then(|| Arc::new(Streamlines) as Arc<dyn Any + Send + Sync>);
    let origin = Origin { names, notes, document, ..source.origin() };
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
    batch = batch.with_columns(columns)?;
    let Some(closed) = closed else {
        return close(batch, options.closed, &[], &[]);
    };
    close_as_marked(batch, options.closed, closed.iter().map(|&flag| flag != 0.0).collect())
}

impl Archive<'_> {
    /// Whether the archive has nibabel's streamlines.
    fn check_keys(&self) -> Result<bool> {
        let mut found = self.keys();
        found.sort_unstable();
        let has = |keys: &[&str]| keys.iter().all(|key| found.iter().any(|found| found == key));
        match (has(&KEYS[..2]), has(&[DATA, "offsets", LENGTHS])) {
            (true, _) => Ok(false),
            (false, true) => Ok(true),
            _ => Err(self.wrong(format!(
                "the arrays are {}: wanted are coords and offsets, and perhaps t, weight, known, closed, names; or nibabel's \
                 data, offsets and lengths",
                arrays(&found)
            ))),
        }
    }

    /// The points of nibabel's streamlines one after the other, and where each begins.
    fn streamlines(&mut self, dimension: usize, data: Vec<f64>) -> Result<(Vec<f64>, Vec<usize>)> {
        let starts = self.offsets()?;
        let lengths = self.list(LENGTHS, integers, starts.len(), "streamline")?.unwrap_or_default();
        let (mut coords, mut offsets) = (Vec::new(), vec![0]);
        for (i, (start, length)) in starts.into_iter().zip(lengths).enumerate() {
            let own = usize::try_from(length).ok().and_then(|length| {
                let from = start.checked_mul(dimension)?;
                data.get(from..from.checked_add(length.checked_mul(dimension)?)?)
            });
            let Some(own) = own else {
                let points = data.len() / dimension;
                return Err(self.wrong(format!(
                    "streamline {i} begins at point {start} and has {length} points, but data has {points}: write the file again"
                )));
            };
            self.grow(&mut coords, own.len())?;
            coords.extend_from_slice(own);
            offsets.push(coords.len() / dimension);
        }
        Ok((coords, offsets))
    }

    /// The other arrays: those that are carried, and a note of the rest.
    fn others(&mut self, points: usize, options: &ReadOptions) -> Result<(Vec<Column>, Vec<String>)> {
        let mut names: Vec<String> = self.keys().into_iter().filter(|key| !KEYS.contains(&&**key)).collect();
        names.sort_unstable();
        let (mut columns, mut passed_over) = (Vec::new(), Vec::new());
        for name in names {
            let (header, how) = (self.header(&name), options.carried.how(&name));
            // Of all arrays those are carried that have an entry a point.
            let fits = header.as_ref().is_some_and(|header| header.shape == [points as u64]);
            let Some(between) = how.filter(|_| fits || options.carried.names(&name)) else {
                passed_over.push(name);
                continue;
            };
            let values = match header.is_some_and(|header| header.is_text()) {
                true => Values::Texts(self.list(&name, texts, points, "point")?.unwrap_or_default()),
                false => between.values(self.list(&name, numbers, points, "point")?.unwrap_or_default()),
            };
            columns.push(Column { name, values });
        }
        let note = (!passed_over.is_empty()).then(|| {
            let what = if passed_over.len() == 1 { "array" } else { "arrays" };
            format!(
                "{what} {} passed over: coords, offsets, t, weight, known, closed and names are read",
                arrays(&passed_over)
            )
        });
        Ok((columns, note.into_iter().collect()))
    }

    fn coords(&mut self, key: &str) -> Result<(usize, Vec<f64>)> {
        let array = self.array(key, numbers)?.expect("checked with the keys");
        match array.shape[..] {
            [_, dimension @ (2 | 3)] => Ok((dimension as usize, array.into_rows())),
            _ => {
                let shape = tuple(&array.shape);
                Err(self.wrong(format!("array {key} has the shape {shape}: it must be (N, 2) or (N, 3)")))
            }
        }
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

    /// Which control points are given.
    fn known(&mut self, points: usize) -> Result<Option<Vec<bool>>> {
        let Some(flags) = self.list("known", integers, points, "point")? else { return Ok(None) };
        match flags.iter().position(|flag| !matches!(flag, 0 | 1)) {
            Some(point) => Err(self.wrong(format!(
                "array known holds {} for point {point}, which is neither 1 nor 0: write 1 for a given control point, 0 else",
                flags[point]
            ))),
            None => Ok(Some(flags.iter().map(|&flag| flag == 1).collect())),
        }
    }

    /// An array of one axis, if the archive has it.
    fn list<T>(&mut self, key: &str, values: ReadValues<T>, wanted: usize, unit: &str) -> Result<Option<Vec<T>>> {
        let Some(array) = self.array(key, values)? else { return Ok(None) };
        self.expect_one_axis(key, &array.shape)?;
        match array.values.len() {
            found if found == wanted => Ok(Some(array.values)),
            found => {
                Err(self.wrong(format!("array {key} has {found} entries for {wanted} {unit}s: give one per {unit}")))
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
fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    write_seekable(&mut bytes, batch, options)?;
    out.write_all(bytes.get_ref())
}

/// Writes an archive. Equal batches give equal bytes.
fn write_seekable(out: &mut dyn Place, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let (points, curves) = (batch.total_points() as u64, batch.len() as u64);
    let mut zip = zip_into(out);
    let coords = (0..batch.len()).flat_map(|i| {
        let wrap = options.antimeridian == Antimeridian::Cut && antimeridian::concerns(batch, i);
        let d = batch.dimension();
        batch.points(i).iter().enumerate().map(move |(at, &x)| if wrap && at % d == 0 { wrapped(x) } else { x })
    });
    let shape = [points, batch.dimension() as u64];
    let offsets = batch.offsets().iter().copied();
    if batch.origin().document.as_ref().is_some_and(|document| document.is::<Streamlines>()) {
        zip.floats(DATA, &shape, coords)?;
        zip.integers("offsets", curves, offsets.take(batch.len()))?;
        zip.integers(LENGTHS, curves, (0..batch.len()).map(|i| batch.count(i)))?;
        return zip.finish();
    }
    zip.floats("coords", &shape, coords)?;
    zip.integers("offsets", curves + 1, offsets)?;
    zip.flags("closed", curves, (0..batch.len()).map(|i| batch.is_closed(i)))?;
    let all = || 0..batch.len();
    if all().any(|i| batch.parameters(i).is_some()) {
        let t = |i: usize| batch.parameters(i).map_or_else(|| vec![f64::NAN; batch.count(i)], <[f64]>::to_vec);
        zip.floats("t", &[points], all().flat_map(t))?;
    }
    if all().any(|i| batch.weights(i).is_some()) {
        let weights = all().flat_map(|i| batch.weights(i).unwrap_or_default()).copied();
        zip.floats("weight", &[points], weights)?;
    }
    if let Some(known) = &batch.constraints().known {
        zip.flags("known", points, known.iter().copied())?;
    }
    if batch.origin().names.is_some() {
        zip.texts("names", &all().map(|i| batch.name(i)).collect::<Vec<_>>())?;
    }
    let mut own = KEYS.to_vec();
    if !options.statuses.is_empty() {
        own.push(STATUS);
        zip.texts(STATUS, &options.statuses.iter().map(|status| status.word()).collect::<Vec<_>>())?;
    }
    for (column, name) in batch.columns().iter().zip(free_names(batch, &own)) {
        match &column.values {
            Values::Texts(texts) => zip.texts(&name, texts)?,
            values => zip.floats(&name, &[points], values.numbers().into_iter().flatten().copied())?,
        }
    }
    zip.finish()
}
