//! [`Format`]: the table of formats of curves. Each is a module with an [`Entry`], and a line here.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use super::entry::Entry;
use super::svg::motion;
use super::tracts::{tck, trk};
use super::{array, csv, frames, geojson, gpx, npz, svg, topojson};
use super::{extension_of, unknown_format};
use crate::batch::{Column, CurveBatch};
use crate::error::{Error, Result, quoted};

/// Makes the enum, with an entry each.
macro_rules! formats {
    ($($(#[doc = $doc:literal])* $format:ident: $module:ident,)*) => {
        /// A file format of curves.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum Format { $($(#[doc = $doc])* $format,)* }

        impl Format {
            /// All formats, in the order of the tables that list them.
            pub const ALL: &[Format] = &[$(Format::$format),*];

            pub(super) fn entry(self) -> &'static Entry {
                match self { $(Format::$format => const { &$module::ENTRY },)* }
            }
        }
    };
}

formats! {
    /// Rows of text, one per point. Rows with the same name in `curve` are a curve.
    Csv: csv,
    /// GeoJSON, RFC 7946: one curve per LineString or ring. Points pass through. The document that
    /// was read is written, with new coordinates.
    GeoJson: geojson,
    /// TopoJSON: arcs that neighbours share. The objects that were read are written, with arcs of
    /// new coordinates.
    TopoJson: topojson,
    /// Scalable Vector Graphics: one curve per subpath or other shape, after transforms: its
    /// vertices, points along its [curves](super::ReadOptions::flatness), or [control
    /// points](super::ReadOptions::controls). The drawing that was read is written, with new paths.
    Svg: svg,
    /// NumPy's archive of arrays: `coords`, `offsets`, `t`, `weight`, `known`, `closed`, `names`;
    /// or nibabel's streamlines, `data`, `offsets` and `lengths`.
    Npz: npz,
    /// One array of NumPy: (B, n, d), or (n, d) for one curve.
    Npy: array,
    /// TrackVis' tracks: streamlines in millimetres (RAS+), with what points and streamlines have
    /// as [columns](CurveBatch::columns). The header that was read is written.
    Trk: trk,
    /// MRtrix's tracks: streamlines in millimetres (RAS+). The header that was read is written.
    Tck: tck,
    /// GPS Exchange, version 1.1: one curve per segment of a track, and per route, with longitudes,
    /// latitudes and times. Elevations travel along as the [column](CurveBatch::columns) `ele`.
    Gpx: gpx,
    /// JSON for animation: a list of curves, each with a frame of its time, its place and its
    /// [columns](CurveBatch::columns) per sample. It is written, and not read.
    Frames: frames,
    /// SVG in which a marker moves along each curve in the times of its samples, with the
    /// [columns](CurveBatch::columns) `opacity`, `scale` and `rotation` (degrees).
    Motion: motion,
}

impl Format {
    /// The format that a file's extension names (`.gz` after it is passed over).
    pub fn of_extension(path: impl AsRef<Path>) -> Option<Self> {
        let extension = extension_of(path.as_ref())?.to_ascii_lowercase();
        Self::ALL.iter().copied().find(|format| format.extensions().any(|own| own == extension))
    }

    /// The format in which curves are written to a file, by its extension. `.json` is TopoJSON for
    /// curves that were read from a topology, and else GeoJSON.
    pub fn to_write(path: impl AsRef<Path>, batch: &CurveBatch) -> Option<Self> {
        let path = path.as_ref();
        match Self::of_extension(path)? {
            Format::GeoJson if is_json(path) && !geojson::objects(batch).is_empty() => Some(Format::TopoJson),
            format => Some(format),
        }
    }

    /// The extensions of its files, the word first.
    pub fn extensions(self) -> impl Iterator<Item = &'static str> {
        let Entry { word, extensions, .. } = self.entry();
        std::iter::once(*word).chain(extensions.iter().copied())
    }

    /// Its name in sentences.
    pub fn title(self) -> &'static str {
        self.entry().title
    }

    /// What of it is read, and what is written, in a few words.
    pub fn holds(self) -> [&'static str; 2] {
        [self.entry().reads, self.entry().writes]
    }

    /// Whether it holds columns of any name.
    pub fn has_columns(self) -> bool {
        self.entry().columns
    }

    /// Whether it holds the [statuses](super::WriteOptions::statuses) of curves.
    pub fn has_statuses(self) -> bool {
        self.entry().statuses
    }

    /// What points of a batch have that its files have no place for: names of columns, and `times`.
    /// Where tracks of a GPX file were divided also `what is no track`.
    pub fn left_out(self, batch: &CurveBatch) -> Vec<String> {
        let holds = |column: &&Column| match self {
            Format::GeoJson | Format::TopoJson => geojson::holds(batch, column, self == Format::GeoJson),
            Format::Gpx => gpx::holds(batch, column),
            Format::Motion => motion::holds(&column.name, &column.values),
            _ => self.has_columns(),
        };
        let columns = batch.columns().iter().filter(|column| !holds(column)).map(|column| column.name.clone());
        let holds_times = self.entry().parameters && (self != Format::GeoJson || geojson::is_own(batch));
        let times = batch.has_parameters() && !holds_times;
        let rest = self == Format::Gpx && gpx::is_divided(batch);
        let others = [(times, "times"), (rest, "what is no track")].into_iter().filter(|(lost, _)| *lost);
        columns.chain(others.map(|(_, what)| what.to_string())).collect()
    }

    /// Refuses what the format cannot hold: three dimensions in SVG, Bézier curves in GeoJSON.
    ///
    /// # Errors
    /// [`Error::Argument`], with the formats that can hold it.
    pub fn check(self, dimension: usize, beziers: bool) -> Result<()> {
        let own = self.entry();
        let holds = |other: &&Format| {
            let other = other.entry();
            other.dimensions.contains(&dimension) && (other.beziers || !beziers)
        };
        let others: Vec<&str> = Self::ALL.iter().filter(holds).map(|other| other.title()).collect();
        let others = alternatives(&others);
        if !own.dimensions.contains(&dimension) {
            let [least, most] = [own.dimensions.start(), own.dimensions.end()];
            let range = if least == most { least.to_string() } else { format!("{least} or {most}") };
            return Err(Error::Argument(format!(
                "{} holds points of {range} dimensions, but the curves have {dimension}: write {others}",
                own.title
            )));
        }
        if beziers && !own.beziers {
            return Err(Error::Argument(format!(
                "{} holds straight lines and no Bézier curves: write {others}, or ask for polylines",
                own.title
            )));
        }
        Ok(())
    }

    /// The format given, or else the format of the extension. `option` names the option that gives
    /// one.
    pub(super) fn of(path: &Path, given: Option<Format>, option: &str) -> Result<Self> {
        given.or_else(|| Self::of_extension(path)).ok_or_else(|| unknown_format(path, option, &alternatives(&words())))
    }
}

/// Whether a file is called `.json`, which several formats use.
fn is_json(path: &Path) -> bool {
    extension_of(path).is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// The words of all formats.
fn words() -> Vec<&'static str> {
    Format::ALL.iter().map(|format| format.entry().word).collect()
}

/// "a, b or c".
pub(super) fn alternatives(words: &[&str]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}

impl FromStr for Format {
    type Err = Error;

    /// The format of a word, or of another extension.
    fn from_str(word: &str) -> Result<Self> {
        let lower = word.to_ascii_lowercase();
        let found = Self::ALL.iter().copied().find(|format| format.extensions().any(|own| own == lower));
        found.ok_or_else(|| {
            Error::Argument(format!("there is no format {}: give {}", quoted(word), alternatives(&words())))
        })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.entry().word)
    }
}
