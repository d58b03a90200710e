//! CSV: one row per point, the curve's name in a column.

mod carried;
mod dialect;
mod order;
mod rows;

use std::cell::Cell;
use std::collections::HashMap;
use std::io::{self, Read, Write};

use ::csv::{ByteRecord, ErrorKind, ReaderBuilder, Trim};

pub(super) use self::dialect::Dialect;
use self::rows::Rows;
use super::columns::STATUS;
use super::encoding::NOT_UTF8;
use super::entry::Entry;
use super::limits::ROW_BYTES;
use super::source::{RowReader, Source, read_line};
use super::text::Text;
use super::{Antimeridian, ReadOptions, WriteOptions, antimeridian, free_names};
use crate::batch::{Clock, CurveBatch, Values};
use crate::error::{Error, Result, quoted, shortened};

/// Whether cells are separated by tabs in files of this extension.
fn is_tabbed(extension: &str) -> bool {
    ["tsv", "tab"].iter().any(|tabbed| extension.eq_ignore_ascii_case(tabbed))
}

pub(super) const ENTRY: Entry = Entry {
    extensions: &["tsv", "tab"],
    reads: "one row a point",
    writes: "samples `curve,x,y[,z],t`, or control points",
    lacks: "there is a header, but no row after it",
    beziers: true,
    columns: true,
    statuses: true,
    parameters: true,
    check: check_names,
    ..Entry::new("csv", "CSV", read, |out, batch, options, extension| {
        write(out, batch, if is_tabbed(extension) { '\t' } else { ',' }, options)
    })
};

/// Reads a CSV file row by row.
fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let mut reader = std::mem::replace(&mut source.reader, Box::new(io::empty()));
    let mut first_line = Vec::new();
    read_line(&mut reader, &source.room, &mut first_line, ROW_BYTES).map_err(|error| source.failed(error))?;
    // Memory for the names of columns.
    let (dialect, heading) = match Dialect::stated(&first_line) {
        None => (Dialect::of(&first_line), 1),
        Some(dialect) => {
            // A blank line in its place keeps the numbers of lines.
            first_line.retain(|byte| b"\r\n".contains(byte));
            read_line(&mut reader, &source.room, &mut first_line, ROW_BYTES).map_err(|error| source.failed(error))?;
            (dialect, 2)
        }
    };
    source.take(HEADING_BYTES * first_line.iter().filter(|&&c| c == dialect.separator).count())?;
    let endings = if first_line.ends_with(b"\r\n") { Endings::CrLf } else { Endings::Lf };
    let since_row = Cell::new(0);
    let rows = RowReader { inner: reader, since_row: &since_row };
    let whole = io::Cursor::new(first_line).chain(rows).chain(endings.text());
    let mut csv = ReaderBuilder::new().delimiter(dialect.separator).trim(Trim::Headers).from_reader(whole);
    let header: Vec<String> = match csv.byte_headers() {
        Ok(header) => {
            let names = header.iter().map(|name| String::from_utf8_lossy(name).into_owned());
            // NumPy writes headers as comments.
            let uncommented = |(k, name): (usize, String)| match name.strip_prefix('#').filter(|_| k == 0) {
                Some(name) => name.trim_start().to_string(),
                None => name,
            };
            names.enumerate().map(uncommented).collect()
        }
        Err(error) => return Err(row_error(source, error, heading)),
    };
    if header.iter().all(String::is_empty) {
        return Err(source.error(None, "the file is empty: there is nothing to read"));
    }
    let mut record = ByteRecord::new();
    let is_number = |cell: &String| matches!(dialect.number(cell.as_bytes()), Ok(Some(_)));
    let numbered = options.columns.are_numbers(&header);
    let headless = match (numbered, options.columns.number_of("x")) {
        (true, Some(x)) => header.get(x - 1).is_some_and(is_number),
        _ => options.columns.is_empty() && header.iter().all(is_number),
    };
    let header = match header.len() {
        columns if numbered => (1..=columns).map(|number| number.to_string()).collect(),
        _ if !headless => header,
        columns @ (2 | 3) => ["x", "y", "z"][..columns].iter().map(|name| name.to_string()).collect(),
        columns => {
            let message = format!(
                "there is no header, but a row of numbers, {columns} of them: two are read as x and y, three as x, y and z; put \
                 a line above that names the columns, such as curve,x,y,t, or give `ReadOptions::columns` by number, as in x=1,y=2"
            );
            return Err(source.error(heading, message));
        }
    };
    let table = options.columns.resolve(&source.path, heading, &header, &options.carried)?;
    if options.sorted && table.cell("t").is_none() {
        return Err(
            source.error(heading, "there is no column t to sort by: map one with `ReadOptions::columns`, as in t=…")
        );
    }
    let carried = options.carried.among(&table, &header);
    let names = csv.byte_headers().map_err(|error| row_error(source, error, heading))?;
    if let Some((_, name, _)) = carried.iter().find(|(cell, ..)| std::str::from_utf8(&names[*cell]).is_err()) {
        return Err(source.error(heading, format!("the name of column {} is {NOT_UTF8}", quoted(name))));
    }
    let mut rows = Rows::new(source, &table, &header, dialect, carried);
    if headless {
        record.clone_from(csv.byte_headers().expect("read above"));
        rows.push(&record, endings.line(csv.position().line(), &record))?;
    }
    loop {
        let read = csv.read_byte_record(&mut record);
        let line = endings.line(csv.position().line(), &record);
        if !read.map_err(|error| row_error(source, error, line))? {
            return rows.finish(options);
        }
        rows.push(&record, line)?;
        since_row.set(0);
    }
}

/// How lines end, to tell the line that a row begins on.
///
/// The csv crate counts from before the blank lines ahead of a row, and takes the second byte of CR
/// LF for one of them.
#[derive(Clone, Copy)]
enum Endings {
    Lf,
    CrLf,
}

impl Endings {
    /// Appended to the file, so that its last row ends like the others.
    fn text(self) -> &'static [u8] {
        match self {
            Endings::Lf => b"\n",
            Endings::CrLf => b"\r\n",
        }
    }

    /// The line on which a row begins, if the reader stands at line `after` behind it.
    fn line(self, after: u64, row: &ByteRecord) -> u64 {
        let within = row.as_slice().iter().filter(|&&byte| byte == b'\n').count() as u64;
        let last = match self {
            Endings::Lf => after.saturating_sub(1),
            Endings::CrLf => after,
        };
        last.saturating_sub(within)
    }
}

fn row_error(source: &Source, error: ::csv::Error, line: u64) -> Error {
    match error.into_kind() {
        ErrorKind::Io(error) => source.failed(error),
        ErrorKind::UnequalLengths { expected_len, len, .. } => source.error(
            line,
            format!(
                "the row has {len} cells, but the header has {expected_len}: add or remove a comma; a file cut off ends so"
            ),
        ),
        other => source.error(line, format!("{}: mend the row", shortened(&format!("{other:?}")))),
    }
}

/// An upper bound of the memory for the name of a column, in addition to its letters.
const HEADING_BYTES: usize = 96;

/// Refuses two curves of one name, which a file of rows could not tell apart.
fn check_names(batch: &CurveBatch) -> Result<()> {
    if batch.origin().names.is_none() {
        return Ok(());
    }
    let mut curves = HashMap::with_capacity(batch.len());
    for i in 0..batch.len() {
        if let Some(first) = curves.insert(batch.name(i), i) {
            return Err(Error::Argument(format!(
                "curves {first} and {i} are both called {}, and rows of CSV are told apart by the name alone: rename \
                 one, or write GeoJSON, SVG or NPZ",
                quoted(&batch.name(i))
            )));
        }
    }
    Ok(())
}

/// Writes `curve,x,y[,z],t`, `closed` if a curve is, `status` if statuses are given, and all
/// columns.
///
/// t is the parameter, or the number of the vertex if no curve has any. The last row of a closed
/// curve repeats its first, where the curve meets it again.
fn write(out: &mut dyn Write, batch: &CurveBatch, separator: char, options: &WriteOptions) -> io::Result<()> {
    let d = batch.dimension();
    let mut text = Text::new(out).with_decimals(options.decimals);
    let any_closed = (0..batch.len()).any(|i| batch.is_closed(i));
    let separator = &*separator.to_string();
    let own = ["curve", "x", "y", "z", "t", "closed", STATUS];
    let is_written = |&name: &&str| match name {
        "z" => d == 3,
        "closed" => any_closed,
        STATUS => !options.statuses.is_empty(),
        _ => true,
    };
    let names: Vec<&str> = own.into_iter().filter(is_written).collect();
    let columns = free_names(batch, if options.statuses.is_empty() { &own[..6] } else { &own });
    text.push(row(names.into_iter().chain(columns.iter().map(|name| &**name)), separator))?;
    text.push("\n")?;
    // All times have as many digits.
    let of_curve = |i: usize| Some(batch.origin().clock(i)?.for_all(batch.parameters(i)?.iter().copied()));
    let digits = (0..batch.len()).filter_map(of_curve).reduce(Clock::with);
    for i in 0..batch.len() {
        let name = row([&*batch.name(i)], separator);
        let parameters = batch.parameters(i);
        let clock = batch.origin().clock(i).zip(digits).map(|(clock, digits)| clock.with(digits));
        let (first, count) = (batch.offsets()[i], batch.count(i));
        let wrap = options.antimeridian == Antimeridian::Cut && antimeridian::concerns(batch, i);
        let again = usize::from(batch.is_closed(i) && count > 0);
        for k in 0..count + again {
            let own = k % count;
            text.push(&name)?;
            text.push(separator)?;
            let point = &batch.points(i)[own * d..][..d];
            match wrap {
                false => text.point(point, separator)?,
                true => text.point(&[&[antimeridian::wrapped(point[0])], &point[1..]].concat(), separator)?,
            }
            text.push(separator)?;
            let t = parameters.map(|t| if k < count { t[k] } else { t[count - 1] + batch.closing_length(i, t) });
            match (t, clock) {
                (Some(t), Some(clock)) => text.push(clock.write(t))?,
                (Some(t), None) => text.number(t)?,
                // A blank, where others have parameters.
                (None, _) if batch.has_parameters() => {}
                (None, _) => text.number(k as f64)?,
            }
            if any_closed {
                text.push(separator)?;
                text.push(if batch.is_closed(i) { "1" } else { "0" })?;
            }
            if let Some(status) = options.statuses.get(i) {
                text.push(separator)?;
                text.push(status.word())?;
            }
            for column in batch.columns() {
                text.push(separator)?;
                match (&column.values, column.values.numbers()) {
                    // A blank, as it was read.
                    (_, Some(numbers)) if numbers[first + own].is_nan() => {}
                    (_, Some(numbers)) => text.number(numbers[first + own])?,
                    (Values::Texts(texts), _) => text.push(row([&*texts[first + own]], separator))?,
                    _ => unreachable!("a column holds numbers or texts"),
                }
            }
            text.push("\n")?;
        }
    }
    text.finish()
}

/// Cells with separators between them, quoted where they must be.
fn row<'a>(cells: impl IntoIterator<Item = &'a str>, separator: &str) -> Vec<u8> {
    let mut row = Vec::new();
    for (k, cell) in cells.into_iter().enumerate() {
        if k > 0 {
            row.extend_from_slice(separator.as_bytes());
        }
        match cell.contains(['"', '\r', '\n']) || cell.contains(separator) {
            false => row.extend_from_slice(cell.as_bytes()),
            true => row.extend_from_slice(format!("\"{}\"", cell.replace('"', "\"\"")).as_bytes()),
        }
    }
    row
}
