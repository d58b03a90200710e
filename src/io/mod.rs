//! Files in and out. [`Format`] lists what is read and written. The extension tells the format.
//!
//! - Numbers are written as the shortest decimals that read back to the same bits.
//! - `.gz` after the extension compresses. Compressed input is known by its first bytes.
//! - `-` is standard input or output and needs a format.
//! - Nothing is ever left half-written ([`write_atomically`]), and nothing is overwritten unless
//!   [`WriteOptions::overwrite`] is set.
//!
//! **Closed curves.** Polygon rings, SVG polygons and closed subpaths are always closed. A column
//! `closed` of CSV (1 or 0, the same in all rows of a curve) and the array `closed` of NPZ mark
//! each curve as closed or open. Otherwise [`Closed::Auto`] closes a curve of three points or more
//! whose last equals its first. GeoJSON rings repeat their first point. So does the last row of a
//! closed curve in CSV; its `t` says where the curve meets its first point again. NPZ does not:
//! there a closed curve has as many rows as points.
//!
//! **Blanks.** Some curves lack a number: a blank coordinate, parameter or weight in CSV, or a
//! position of GeoJSON that is `null`, holds `null` or has fewer than two numbers. The number is
//! NaN in the batch. It makes that curve [`Invalid`](crate::CurveStatus::Invalid), and no other. A
//! curve of CSV whose parameters are all blank has none.
//!
//! **Separators.** Cells of CSV are separated by commas, semicolons or tabs, whichever the first
//! line has most of, or by what a line such as `sep=;` above it says. Unless commas separate, a
//! comma may be the decimal point. `NA`, `N/A`, `null`, `none` and what databases and spreadsheets
//! write for them, such as `\N` and `#N/A`, are blanks. Files called `.tsv` are written with tabs.
//!
//! **Encodings.** Text is UTF-8, or UTF-16 where its first bytes say so. XML may declare UTF-16,
//! ISO-8859-1 or Windows-1252. What is written is UTF-8.
//!
//! **Times.** Dates in a column `t`, such as `2024-03-01T06:00:00Z`, `2024-03-01 06:00` or
//! `2024-03-01` (ISO 8601), become seconds since the beginning of 1970. CSV writes them as they
//! came, with as many digits as the samples need. Without a zone they are taken for UTC.
//!
//! **Other columns** of CSV travel along where [`ReadOptions::carried`] says so.
//!
//! **No header.** If the first row of a CSV file is two or three numbers, the file is one curve
//! with the columns x, y and z.
//!
//! **y points up** in every batch, as in GeoJSON, on paper and in the pictures. In SVG it points
//! down. So y is turned over when a drawing is read, and again when one is written. A curve looks
//! the same in all formats:
//!
//! - A map has its north on top.
//! - A drawing that is read and written keeps its numbers (but for the sign of 0).
//! - A drawing written as CSV, GeoJSON or NPZ has the y of the drawing with the other sign.
//! - Curvature is positive where the curve, as seen, turns left.
//!
//! **Longitudes.** x is a longitude in GeoJSON, and in CSV if it is mapped from a column `lon`,
//! `long`, `lng` or `longitude`. If all of such a curve lies within |x| ≤ 360, |y| ≤ 90, neighbours
//! more than 180 apart are taken to cross the antimeridian. ±360 is added from there on. So curves
//! run on past ±180 and never tear. They do so in the output too, unless
//! [`WriteOptions::antimeridian`] cuts them there. A line that winds round a pole becomes an open
//! curve that ends 360 from its start. A polygon ring that winds once round a pole is opened where
//! it crosses ±180 nearest to the pole, and closed along ±180 and over the pole; a note says so.
//! The holes of a polygon are brought to their shell. Longitudes and latitudes of GeoJSON that miss
//! ±180 or a pole by rounding, 1e-9 at most, are set there.
//!
//! **Sizes.** No file ends a program for want of memory. What a file claims is compared with what
//! it has, and memory that grows with it is requested before it is used. A larger input is an error
//! that says so:
//!
//! - Reading takes at most half of the free memory. On Linux the system, the process's limits and
//!   its control group tell how much is free. Elsewhere the limit is where the allocator refuses.
//! - Packed data, gzip or in an archive, may unpack to 100 times its size and 256 MiB. Text of
//!   numbers packs to a third or a tenth. Only data of next to no content packs to less than a
//!   hundredth. The limit does not hold for unpacked files, so such a file can be unpacked first.
//! - A row of CSV may have 16 MiB.
//! - An element of SVG may have 10,000 attributes. Entities of SVG may make 16 MiB of text.
//!
//! The checksums of gzip and of every array are compared.
//!
//! [`grids`] reads and writes rectangular grids, [`read_mesh`] reads triangle meshes, and
//! [`surfaces`] makes surfaces of files.

mod antimeridian;
mod array;
mod atomic;
mod columns;
mod csv;
mod decimals;
mod encoding;
mod entry;
mod formats;
mod frames;
mod geojson;
mod gpx;
pub mod grids;
mod limit_table;
mod limits;
mod longitude;
mod memory;
mod meshes;
mod npy;
mod npz;
mod source;
pub mod surfaces;
mod svg;
mod text;
mod times;
mod topojson;
mod tracts;
mod xml;

use std::borrow::Cow;
use std::collections::HashSet;
use std::fmt::{self, Display, Formatter};
use std::io::{Read, Write};
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use crate::batch::CurveBatch;
use crate::error::{Error, Result, quoted};
use crate::status::CurveStatus;

pub use antimeridian::Antimeridian;
#[cfg(feature = "cli")]
pub(crate) use array::is_point;
#[cfg(all(unix, feature = "cli"))]
pub(crate) use atomic::give_up;
pub use atomic::{Output, write_atomically};
pub use columns::{Carried, Columns};
pub use decimals::decimals_of;
use entry::Entry;
pub use formats::Format;
pub use limit_table::read_limits;
pub use meshes::{read_mesh, read_mesh_from};
use source::Source;
pub use times::{Times, read_times};

/// Which curves are closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Closed {
    /// Curves that the file marks.
    ///
    /// If it marks none, also curves of three points or more whose last point equals their first.
    #[default]
    Auto,
    /// All of them.
    Yes,
    /// None but polygon rings and closed subpaths.
    No,
}

impl FromStr for Closed {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        match word {
            "auto" => Ok(Closed::Auto),
            "yes" => Ok(Closed::Yes),
            "no" => Ok(Closed::No),
            _ => Err(Error::Argument(format!("closed is {}: auto, yes and no are possible", quoted(word)))),
        }
    }
}

/// How a file is read.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The format. By default the format of the extension.
    pub format: Option<Format>,
    /// What the columns of a CSV file mean. In GeoJSON only `z=` has a meaning: it drops altitudes.
    pub columns: Columns,
    /// Which curves are closed.
    pub closed: Closed,
    /// CSV: whether the rows of each curve are sorted by `t`. Rows of one `t` keep their order.
    pub sorted: bool,
    /// CSV: which other columns travel along. By default none.
    pub carried: Carried,
    /// Whether subpaths of SVG are read as chains of cubic Béziers, in place of their vertices.
    ///
    /// The points of a curve are then control points, 3 a piece and one more. A closed chain does
    /// not repeat its first point. Lines and quadratic curves become the cubics that they are. Arcs
    /// become cubics as near to them as [`flatness`](Self::flatness) says. The points of other
    /// formats are read as they stand. False by default.
    pub controls: bool,
    /// SVG: how near the chords between the points of a curve are to the curved segments of its
    /// path. The points are on the path. With [`controls`](Self::controls), how near cubics are to
    /// arcs.
    ///
    /// By default curved segments have their ends alone, and arcs are divided into quarters of a
    /// turn.
    pub flatness: Option<Flatness>,
    /// SVG: whether only `path`, `polyline` and `polygon` are read. `rect`, `circle`, `ellipse` and
    /// `line` then stay as they are. False by default.
    pub paths_only: bool,
    /// GeoJSON, TopoJSON and SVG: what is selected. The rest stays as it is, bit for bit. By default
    /// all is selected.
    pub selected: Option<Selection>,
}

/// What is selected of a file: what has one of some values for a key.
///
/// Of GeoJSON and TopoJSON the key is a property of features, or `layer`, the name of a topology's
/// object. Of SVG it is an attribute of an element, or of a group around it. `class` has several
/// values.
///
/// ```
/// let selection: faircurve::io::Selection = "name=Utah,Colorado".parse()?;
/// assert!(selection.has("Utah") && selection.key == "name");
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// The key.
    pub key: String,
    /// The values, of which one suffices.
    pub values: Vec<String>,
}

impl Selection {
    /// Whether a value is one of the selection.
    pub fn has(&self, value: &str) -> bool {
        self.values.iter().any(|own| own == value)
    }
}

impl FromStr for Selection {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.split_once('=') {
            Some((key, values)) if !key.is_empty() => {
                Ok(Selection { key: key.into(), values: values.split(',').map(str::to_string).collect() })
            }
            _ => Err(Error::argument(format!(
                "{} selects nothing: give a key and its values, such as name=Utah,Colorado",
                quoted(text)
            ))),
        }
    }
}

impl Display for Selection {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.values.join(","))
    }
}

/// How near chords are to a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flatness {
    /// Within a distance (> 0), in units of the drawing.
    Within(f64),
    /// Within a part (> 0) of the path's larger side.
    OfSize(f64),
}

/// How a file is written.
#[derive(Clone, Debug, Default)]
pub struct WriteOptions {
    /// The format. By default [the format of the extension](Format::to_write).
    pub format: Option<Format>,
    /// Whether a file that exists is replaced. False by default.
    pub overwrite: bool,
    /// Whether the points of each curve are the control points of a chain of cubic Béziers.
    ///
    /// A chain has 3 points a piece and one more. A closed chain repeats the first at the end. SVG
    /// draws the curves. CSV and NPZ hold the control points.
    pub beziers: bool,
    /// SVG with `beziers`: control points are rounded, and written as relative steps, in fewer
    /// bytes.
    ///
    /// The step is the largest power of ten not above this (units of the curves, > 0). Each point
    /// moves by no more than 0.71 of it. By default, and if coordinates have no such digits, points
    /// are exact.
    pub rounding: Option<f64>,
    /// CSV, GeoJSON, TopoJSON and SVG: coordinates are rounded to this many decimals. TopoJSON is
    /// then quantised.
    ///
    /// By default coordinates are the shortest decimals that read back to the same bits.
    /// [`decimals_of`] says what points need.
    pub decimals: Option<u8>,
    /// What becomes of longitudes beyond ±180. By default they stay.
    pub antimeridian: Antimeridian,
    /// How the fit of each curve ended, to be written with the curves. By default nothing is
    /// written.
    ///
    /// CSV has a column `status`, NPZ an array, GeoJSON and TopoJSON a property of each feature:
    /// the worst of its curves. [`Format::has_statuses`] tells the others, which pass them over.
    pub statuses: Vec<CurveStatus>,
    /// Curves that are left out, by their number. By default none.
    ///
    /// A document that was read keeps their places, without points.
    pub left_out: Vec<usize>,
}

/// Reads curves from a file, in the format of its extension.
///
/// ```
/// let countries = faircurve::io::read("examples/data/countries-110m.geojson")?;
/// assert_eq!((countries.len(), countries.dimension()), (595, 2));
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// A file that cannot be read or does not hold what its format promises.
///
/// A fault of one curve (NaN, decreasing parameters, an element of SVG that cannot be read) is not
/// an error. The curve gets an [`Unfitted`](crate::Unfitted). Nor is a file without curves, whose
/// batch is empty: [`CurveBatch::notes`] says so.
pub fn read(path: impl AsRef<Path>) -> Result<CurveBatch> {
    read_with(path, &ReadOptions::default())
}

/// Reads curves from a file, or from standard input for `-` (then the format must be given).
///
/// # Errors
/// Those of [`read()`], and an unknown format.
pub fn read_with(path: impl AsRef<Path>, options: &ReadOptions) -> Result<CurveBatch> {
    let path = path.as_ref();
    let format = Format::of(path, options.format, "`ReadOptions::format`")?;
    read_source(Source::open(path)?, format, options)
}

/// Reads curves from bytes: a slice, a pipe, a part of something larger.
///
/// The format must be given. Gzip is known by its first bytes. Messages call the bytes `input`.
///
/// ```
/// use faircurve::io::{self, Format, ReadOptions};
/// let options = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
/// let batch = io::read_from(&b"curve,x,y\na,0,0\na,1,2\n"[..], &options)?;
/// assert_eq!((batch.name(0).as_ref(), batch.points(0)), ("a", &[0.0, 0.0, 1.0, 2.0][..]));
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// Those of [`read()`], and a format that is not given.
pub fn read_from(reader: impl Read, options: &ReadOptions) -> Result<CurveBatch> {
    let format = options.format.ok_or_else(|| unnamed("ReadOptions::format"))?;
    read_source(Source::of_reader(reader)?, format, options)
}

fn read_source(mut source: Source, format: Format, options: &ReadOptions) -> Result<CurveBatch> {
    let Entry { read, lacks, .. } = format.entry();
    let batch = read(&mut source, options)?;
    if let Some(selection) = &options.selected {
        if !matches!(format, Format::GeoJson | Format::TopoJson | Format::Svg) {
            return Err(Error::argument(format!(
                "{selection} selects features of GeoJSON and TopoJSON and elements of SVG, and {} has none",
                format.title()
            )));
        }
        if batch.origin().unselected.len() == batch.len() {
            return Err(
                source.error(None, format!("nothing with a shape has {selection}: give a key and a value that it has"))
            );
        }
    }
    if !batch.is_empty() {
        return Ok(batch);
    }
    let mut origin = (**batch.origin()).clone();
    origin.notes.push(format!("no curve was found: {lacks}"));
    Ok(batch.with_origin(Arc::new(origin)))
}

/// Writes curves to a file, in the format of its extension. A file that exists is never replaced.
///
/// # Errors
/// - [`Error::Exists`] if the file exists.
/// - [`Error::Write`], which leaves nothing behind.
/// - [`Error::Argument`] for what the format cannot hold.
pub fn write(path: impl AsRef<Path>, batch: &CurveBatch) -> Result<()> {
    write_with(path, batch, &WriteOptions::default())
}

/// Writes curves to a file, or to standard output for `-` (then the format must be given). By
/// default the format is [`Format::to_write`].
///
/// CSV and NPZ keep coordinates that are NaN or infinite. GeoJSON and SVG have no such numbers.
/// There the curve keeps its place and its name but has no points.
///
/// # Errors
/// Those of [`write()`], and an unknown format.
pub fn write_with(path: impl AsRef<Path>, batch: &CurveBatch, options: &WriteOptions) -> Result<()> {
    let path = path.as_ref();
    let given = options.format.or_else(|| Format::to_write(path, batch));
    let format = Format::of(path, given, "`WriteOptions::format`")?;
    let (batch, options) = prepared(batch, format, options)?;
    let (batch, options) = (&*batch, &*options);
    let (Entry { write, write_file, .. }, extension) = (format.entry(), extension_of(path).unwrap_or_default());
    write_atomically(path, options.overwrite, |out| {
        if is_gzip(path) {
            let mut zipped = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            write(&mut zipped, batch, options, &extension)?;
            zipped.finish()?.flush()
        } else if let (Some(write_file), Some(file)) = (write_file, out.seekable()) {
            write_file(file, batch, options)
        } else {
            write(out, batch, options, &extension)
        }
    })
}

/// Writes curves as bytes, into a vector or any other writer.
///
/// The format must be given. Nothing is compressed.
///
/// ```
/// use faircurve::io::{self, Format, WriteOptions};
/// let batch = faircurve::CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 2.5]][..]])?;
/// let mut bytes = Vec::new();
/// io::write_to(&mut bytes, &batch, &WriteOptions { format: Some(Format::Csv), ..WriteOptions::default() })?;
/// assert_eq!(bytes, b"curve,x,y,t\n0,0,0,0\n0,1,2.5,1\n");
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - [`Error::Argument`] for what the format cannot hold, and if no format is given.
/// - [`Error::Stream`] with the error of `out`, which may then hold a part.
pub fn write_to(mut out: impl Write, batch: &CurveBatch, options: &WriteOptions) -> Result<()> {
    let format = options.format.ok_or_else(|| unnamed("WriteOptions::format"))?;
    let (batch, options) = prepared(batch, format, options)?;
    (format.entry().write)(&mut out, &batch, &options, "").map_err(|source| Error::Stream { source })
}

/// The curves that are written, without those left out, and how. Refuses what the format cannot
/// hold.
fn prepared<'a>(
    batch: &'a CurveBatch,
    format: Format,
    options: &'a WriteOptions,
) -> Result<(Cow<'a, CurveBatch>, Cow<'a, WriteOptions>)> {
    let WriteOptions { statuses, left_out, .. } = options;
    if !statuses.is_empty() && statuses.len() != batch.len() {
        let (statuses, curves) = (statuses.len(), batch.len());
        return Err(Error::Argument(format!("there are {statuses} statuses for {curves} curves: give one per curve")));
    }
    if let Some(i) = left_out.iter().find(|&&i| i >= batch.len()) {
        let curves = batch.len();
        return Err(Error::Argument(format!("curve {i} is to be left out of {curves}: give numbers counted from 0")));
    }
    let (batch, options) = match left_out[..] {
        [] => (Cow::Borrowed(batch), Cow::Borrowed(options)),
        _ if (format.entry().fills)(batch) => (Cow::Owned(batch.emptied(left_out)), Cow::Borrowed(options)),
        _ => {
            let kept = batch.others(left_out).into_iter();
            let statuses = kept.filter_map(|i| statuses.get(i).copied()).collect();
            (Cow::Owned(batch.without(left_out)), Cow::Owned(WriteOptions { statuses, ..options.clone() }))
        }
    };
    check_batch(&batch, format, &options)?;
    Ok((batch, options))
}

/// Refuses what the format cannot hold.
fn check_batch(batch: &CurveBatch, format: Format, options: &WriteOptions) -> Result<()> {
    format.check(batch.dimension(), options.beziers)?;
    if options.beziers {
        check_chains(batch)?;
    }
    (format.entry().check)(batch)?;
    match format {
        Format::Npy => array::length(batch, &options.statuses).map(drop),
        _ => Ok(()),
    }
}

/// Refuses, before anything is fitted, curves that the format cannot hold, as far as that is known.
/// Their samples have this dimension, and `points` of a curve points.
#[cfg(feature = "cli")]
pub(crate) fn check_before(
    batch: &CurveBatch,
    format: Format,
    dimension: usize,
    beziers: bool,
    points: impl Fn(usize) -> Option<usize>,
) -> Result<()> {
    format.check(dimension, beziers)?;
    (format.entry().check)(batch)?;
    match format {
        Format::Npy => {
            let fitted = (0..batch.len()).filter(|&i| batch.problem(i).is_none() && !array::is_point(batch, i));
            array::common(fitted.filter_map(|i| Some(points(i)? + usize::from(batch.is_closed(i))))).map(drop)
        }
        _ => Ok(()),
    }
}

/// Checks, before anything is computed, that an output can be written.
///
/// Its format must be known and must hold what is asked for. Its folder must exist. No file may
/// stand there unless overwriting is allowed.
///
/// # Errors
/// Those of [`write_with`] that can be known without the curves.
pub fn check_output(path: impl AsRef<Path>, options: &WriteOptions) -> Result<()> {
    let path = path.as_ref();
    let format = Format::of(path, options.format, "`WriteOptions::format`")?;
    format.check(*format.entry().dimensions.start(), options.beziers)?;
    atomic::check(path, options.overwrite)
}

/// The extension. For a name that ends in `.gz` it is the one before that.
fn extension_of(path: &Path) -> Option<String> {
    let inner = if is_gzip(path) { path.with_extension("") } else { path.to_path_buf() };
    Some(inner.extension()?.to_str()?.to_string())
}

/// The names of a batch's columns, with an underscore behind those that a format uses itself.
fn free_names(batch: &CurveBatch, own: &[&str]) -> Vec<String> {
    let free = |name: &String| if own.contains(&&**name) { format!("{name}_") } else { name.clone() };
    batch.columns().iter().map(|column| free(&column.name)).collect()
}

/// A group of curves of a file: its number, its name, and how many curves it has.
type Group<'a> = (usize, Option<&'a String>, usize);

/// Names of curves: the names of their groups if every group has one and no two are equal, else the
/// groups' numbers. If a group has several curves, `part` adds their numbers, counted from 0.
fn grouped_names(groups: &[Group], part: fn(&str, usize) -> String) -> Vec<String> {
    let mut seen = HashSet::new();
    let named = groups.iter().all(|(_, name, _)| name.is_some_and(|name| seen.insert(name)));
    let mut names = Vec::new();
    for &(number, name, count) in groups {
        let name = name.filter(|_| named).cloned().unwrap_or_else(|| number.to_string());
        match count {
            1 => names.push(name),
            _ => names.extend((0..count).map(|k| part(&name, k))),
        }
    }
    names
}

/// The name of a curve of a feature or of a path.
fn part(name: &str, k: usize) -> String {
    format!("{name}/{k}")
}

/// "1 curve has", "2 curves have".
fn counted(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}

/// The error for a path whose format is unknown. `option` names the format, one of `words`.
fn unknown_format(path: &Path, option: &str, words: &str) -> Error {
    Error::Argument(match path == Path::new("-") {
        true => format!("- has no extension to tell its format: give {option} with {words}"),
        false => {
            format!("the format of {} is not known from its extension: give {option} with {words}", path.display())
        }
    })
}

/// The error that bytes have no extension to tell the format.
fn unnamed(option: &str) -> Error {
    Error::Argument(format!("bytes have no extension to tell their format: set {option}"))
}

fn is_gzip(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gz"))
}

fn check_chains(batch: &CurveBatch) -> Result<()> {
    let odd = |&i: &usize| {
        let points = batch.count(i) + usize::from(batch.is_closed(i));
        points % 3 != 1 && batch.count(i) > 1
    };
    match (0..batch.len()).find(odd) {
        None => Ok(()),
        Some(i) => Err(Error::Argument(format!(
            "curve {} has {} control points, but a chain of cubic Béziers has three a piece and one more",
            batch.label(i),
            batch.count(i)
        ))),
    }
}

/// Whether all coordinates of curve `i` are finite, as GeoJSON and SVG need them.
fn is_finite(batch: &CurveBatch, i: usize) -> bool {
    batch.points(i).iter().all(|x| x.is_finite())
}

/// Closes all curves, none, or the marked ones. `marked` has a flag per curve, or none at all.
fn close_as_marked(batch: CurveBatch, closed: Closed, mut marked: Vec<bool>) -> Result<CurveBatch> {
    marked.resize(batch.len(), false);
    match closed {
        Closed::Auto => batch.closed_each(marked),
        given => {
            let flags = vec![given == Closed::Yes; batch.len()];
            batch.closed_each(flags)
        }
    }
}

/// Closes the marked curves, and the others as `closed` says. Curves in `opened` stay open.
/// `marked` has a flag per curve, or none at all.
fn close(batch: CurveBatch, closed: Closed, marked: &[bool], opened: &[usize]) -> Result<CurveBatch> {
    let repeats = |i: usize| batch.count(i) > 2 && batch.repeats_first(i);
    let is_marked = |i: usize| marked.get(i).is_some_and(|marked| *marked);
    let mut flags: Vec<bool> = (0..batch.len())
        .map(|i| match closed {
            Closed::Auto => is_marked(i) || repeats(i),
            Closed::Yes => true,
            Closed::No => is_marked(i),
        })
        .collect();
    opened.iter().for_each(|&i| flags[i] = false);
    batch.closed_each(flags)
}
