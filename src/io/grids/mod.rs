//! Files of rectangular grids ([`Grids`]) in and out, and pictures and meshes of them out.
//!
//! | format | read | written |
//! |---|---|---|
//! | [CSV](GridFormat::Csv) | rows of numbers without a header, a blank line between two grids: heights, one value per point | the same |
//! | [NPZ](GridFormat::Npz) | array `grids` of the shape (B, rows, columns) or (B, rows, columns, d), or (rows, columns) for a single grid; grids of several shapes as `grids_0`, `grids_1`, … of (rows, columns) or (rows, columns, d) | the same |
//! | [OBJ](GridFormat::Obj) | | meshes of quadrangles, one object per grid |
//! | [SVG](GridFormat::Svg) | | shaded pictures, one panel per grid |
//!
//! The rules of [`io`](super) hold for numbers, `.gz`, `-` and files that exist. Numbers read back
//! to the same bits, including NaN and infinity.

mod csv;
mod npz;
mod obj;
mod svg;

use std::fmt;
use std::io::{Read, Write};
use std::path::Path;
use std::str::FromStr;

use super::source::Source;
use super::{atomic, extension_of, is_gzip, unknown_format, unnamed, write_atomically};
use crate::error::{Error, Result, quoted};
use crate::grids::Grids;

/// A file format for grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GridFormat {
    /// Rows of numbers, a blank line between two grids.
    Csv,
    /// NumPy's archive of arrays.
    Npz,
    /// Wavefront's meshes. Only written.
    Obj,
    /// Shaded pictures. Only written.
    Svg,
}

impl GridFormat {
    /// The format that a file's extension names (`.gz` after it is passed over).
    pub fn of_extension(path: impl AsRef<Path>) -> Option<Self> {
        extension_of(path.as_ref())?.parse().ok()
    }

    /// Refuses what the format cannot hold.
    ///
    /// - CSV: several values a point, and grids without points.
    /// - OBJ and SVG: more than three values a point.
    ///
    /// # Errors
    /// [`Error::Argument`], with the formats that can hold it.
    pub fn check(self, grids: &Grids) -> Result<()> {
        let d = grids.dimension();
        match self {
            GridFormat::Csv if d > 1 => Err(Error::Argument(format!(
                "CSV holds grids of heights, one value a point, but these have {d}: write NPZ{}",
                if d <= 3 { ", OBJ or SVG" } else { "" }
            ))),
            GridFormat::Csv => match grids.shapes().iter().position(|[rows, columns]| rows * columns == 0) {
                Some(i) => Err(Error::Argument(format!(
                    "grid {i} has no points, and rows of CSV would lose it: write NPZ, OBJ or SVG"
                ))),
                None => Ok(()),
            },
            GridFormat::Obj | GridFormat::Svg if d > 3 => Err(Error::Argument(format!(
                "{} shows points of the plane or of space, but these have {d} values each: write NPZ",
                if self == GridFormat::Obj { "OBJ" } else { "SVG" }
            ))),
            _ => Ok(()),
        }
    }

    /// Refuses the formats that are only written.
    fn check_read(self) -> Result<()> {
        match self {
            GridFormat::Csv | GridFormat::Npz => Ok(()),
            GridFormat::Obj | GridFormat::Svg => Err(Error::Argument(format!(
                "{} is only written, grids are read from CSV and NPZ: give one of these",
                self.to_string().to_uppercase()
            ))),
        }
    }

    fn of(path: &Path, given: Option<Self>, option: &str, words: &str) -> Result<Self> {
        given.or_else(|| Self::of_extension(path)).ok_or_else(|| unknown_format(path, option, words))
    }
}

impl FromStr for GridFormat {
    type Err = Error;

    /// The format of a word, which is also its extension.
    fn from_str(word: &str) -> Result<Self> {
        match word.to_ascii_lowercase().as_str() {
            "csv" => Ok(GridFormat::Csv),
            "npz" => Ok(GridFormat::Npz),
            "obj" => Ok(GridFormat::Obj),
            "svg" => Ok(GridFormat::Svg),
            _ => Err(Error::Argument(format!(
                "there is no format {} for grids: csv, npz, obj and svg are possible",
                quoted(word)
            ))),
        }
    }
}

impl fmt::Display for GridFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            GridFormat::Csv => "csv",
            GridFormat::Npz => "npz",
            GridFormat::Obj => "obj",
            GridFormat::Svg => "svg",
        })
    }
}

/// How a file of grids is written.
#[derive(Clone, Debug)]
pub struct GridWrite<'a> {
    /// The format. By default the format of the extension.
    pub format: Option<GridFormat>,
    /// Whether a file that exists is replaced. False by default.
    pub overwrite: bool,
    /// OBJ: the distance of neighbouring heights in x and y. 1 by default.
    ///
    /// After r rounds of subdivision 2⁻ʳ keeps a surface over the domain of its control points.
    pub spacing: f64,
    /// SVG: control points that are drawn as a net, one grid for each grid written.
    ///
    /// None by default.
    pub net: Option<&'a Grids>,
    /// SVG: a line above the picture. None by default.
    pub title: Option<String>,
    /// SVG: text of the caption after the numbers of grids and points. Empty by default.
    pub caption: String,
}

impl Default for GridWrite<'_> {
    fn default() -> Self {
        GridWrite { format: None, overwrite: false, spacing: 1.0, net: None, title: None, caption: String::new() }
    }
}

/// Reads grids from a file, or from standard input for `-` (then the format must be given).
///
/// A value that is NaN or infinite is kept. It is a fault of its grid and not of the file. Blank
/// cells of CSV, `NA` and the like are NaN.
///
/// ```
/// let grids = faircurve::io::grids::read("examples/data/heights.csv", None)?;
/// assert_eq!((grids.len(), grids.dimension(), grids.shape(0)), (1, 1, [9, 13]));
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - A file that cannot be read or does not hold what its format promises.
/// - A format that is unknown or only written.
pub fn read(path: impl AsRef<Path>, format: Option<GridFormat>) -> Result<Grids> {
    let path = path.as_ref();
    let format = GridFormat::of(path, format, "`format`", "csv or npz")?;
    format.check_read()?;
    Ok(read_source(Source::open(path)?, format)?.with_file(Some(path.display().to_string())))
}

/// Reads grids from bytes. Gzip is known by its first bytes. Messages call the bytes `input`.
///
/// ```
/// use faircurve::io::grids::{self, GridFormat};
/// let grids = grids::read_from(&b"1,2,3\n4,5,6\n"[..], GridFormat::Csv)?;
/// assert_eq!((grids.shape(0), grids.grid(0)), ([2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0][..]));
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// As [`read()`].
pub fn read_from(reader: impl Read, format: GridFormat) -> Result<Grids> {
    format.check_read()?;
    read_source(Source::of_reader(reader)?, format)
}

fn read_source(mut source: Source, format: GridFormat) -> Result<Grids> {
    match format {
        GridFormat::Csv => csv::read(&mut source),
        _ => npz::read(&mut source),
    }
}
/// Writes grids to a file, or to standard output for `-` (then the format must be given).
///
/// A file is written whole or not at all.
///
/// CSV and NPZ keep NaN and infinite values. Meshes and pictures leave such grids out, and say so.
///
/// # Errors
/// - [`Error::Exists`] if the file exists and may not be replaced.
/// - [`Error::Write`], which leaves nothing behind.
/// - [`Error::Argument`] for an unknown format and for grids that it cannot hold.
pub fn write(path: impl AsRef<Path>, grids: &Grids, options: &GridWrite) -> Result<()> {
    let path = path.as_ref();
    let format = GridFormat::of(path, options.format, "`GridWrite::format`", "csv, npz, obj or svg")?;
    format.check(grids)?;
    write_atomically(path, options.overwrite, |out| {
        if is_gzip(path) {
            let mut zipped = flate2::write::GzEncoder::new(out, flate2::Compression::default());
            fill(&mut zipped, grids, format, options)?;
            zipped.finish()?.flush()
        } else if let (GridFormat::Npz, Some(file)) = (format, out.seekable()) {
            npz::write_seekable(file, grids)
        } else {
            fill(out, grids, format, options)
        }
    })
}

/// Writes grids as bytes, into a vector or any other writer.
///
/// The format must be given. Nothing is compressed.
///
/// # Errors
/// - [`Error::Argument`] for grids that the format cannot hold, and if no format is given.
/// - [`Error::Stream`] with the error of `out`, which may then hold a part.
pub fn write_to(mut out: impl Write, grids: &Grids, options: &GridWrite) -> Result<()> {
    let format = options.format.ok_or_else(|| unnamed("GridWrite::format"))?;
    format.check(grids)?;
    fill(&mut out, grids, format, options).map_err(|source| Error::Stream { source })
}

fn fill(out: &mut dyn Write, grids: &Grids, format: GridFormat, options: &GridWrite) -> std::io::Result<()> {
    match format {
        GridFormat::Csv => csv::write(out, grids),
        GridFormat::Npz => npz::write(out, grids),
        GridFormat::Obj => obj::write(out, grids, options.spacing),
        GridFormat::Svg => svg::write(out, grids, options),
    }
}

/// Checks, before anything is computed, that an output can be written.
///
/// Its format must be known and its folder must exist. No file may stand there unless overwriting
/// is allowed.
///
/// # Errors
/// Those of [`write()`] that can be known without the grids.
pub fn check_output(path: impl AsRef<Path>, options: &GridWrite) -> Result<()> {
    let path = path.as_ref();
    GridFormat::of(path, options.format, "`GridWrite::format`", "csv, npz, obj or svg")?;
    atomic::check(path, options.overwrite)
}

/// Whether all values of grid `i` are finite, as meshes need them.
fn is_finite(grids: &Grids, i: usize) -> bool {
    grids.grid(i).iter().all(|x| x.is_finite())
}
