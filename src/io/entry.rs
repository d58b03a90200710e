//! [`Entry`]: what a format is and can.

use std::fs::File;
use std::io::{self, Write};
use std::ops::RangeInclusive;

use super::source::Source;
use super::{ReadOptions, WriteOptions};
use crate::batch::CurveBatch;
use crate::error::Result;

/// Writes a batch into a file that can be gone back in.
pub(super) type WriteFile = fn(&mut File, &CurveBatch, &WriteOptions) -> io::Result<()>;

/// What a format is and can.
pub(super) struct Entry {
    /// Its word, which is an extension of its files.
    pub word: &'static str,
    /// More extensions.
    pub extensions: &'static [&'static str],
    /// Its name in sentences.
    pub title: &'static str,
    /// What of it is read, and what is written, for tables.
    pub reads: &'static str,
    pub writes: &'static str,
    /// What a file without a curve lacks.
    pub lacks: &'static str,
    /// The dimensions of points that it holds.
    pub dimensions: RangeInclusive<usize>,
    /// Whether it holds control points of Béziers.
    pub beziers: bool,
    /// Whether it holds [columns](CurveBatch::columns) of any name.
    pub columns: bool,
    /// Whether it holds [statuses](WriteOptions::statuses).
    pub statuses: bool,
    /// Whether the document that a batch was read from is written again, in which every curve has
    /// its place.
    pub fills: fn(&CurveBatch) -> bool,
    /// Whether it holds the parameters of points.
    pub parameters: bool,
    pub read: fn(&mut Source, &ReadOptions) -> Result<CurveBatch>,
    /// Writes a batch into a file of this extension.
    pub write: fn(&mut dyn Write, &CurveBatch, &WriteOptions, &str) -> io::Result<()>,
    /// Writes files, if that is another way than writing bytes.
    pub write_file: Option<WriteFile>,
    /// Refuses what of a batch it cannot hold.
    pub check: fn(&CurveBatch) -> Result<()>,
}

impl Entry {
    /// The entry of a format of plain points in the plane or in space, which holds nothing else.
    pub const fn new(
        word: &'static str,
        title: &'static str,
        read: fn(&mut Source, &ReadOptions) -> Result<CurveBatch>,
        write: fn(&mut dyn Write, &CurveBatch, &WriteOptions, &str) -> io::Result<()>,
    ) -> Self {
        Entry {
            word,
            extensions: &[],
            title,
            reads: "",
            writes: "",
            lacks: "",
            dimensions: 2..=3,
            beziers: false,
            columns: false,
            statuses: false,
            fills: |_| false,
            parameters: false,
            read,
            write,
            write_file: None,
            check: |_| Ok(()),
        }
    }
}
