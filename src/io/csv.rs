//! CSV: one row a point, the curve's name in a column.

mod dialect;
mod order;

use std::cell::Cell;
use std::collections::{BTreeMap, HashMap};
use std::io::{self, Read, Write};
use std::sync::Arc;

use ::csv::{ByteRecord, ErrorKind, ReaderBuilder, Trim};

use self::dialect::Dialect;
use self::order::{Owners, arranged};
use super::columns::Table;
use super::source::{ROW_BYTES, RowReader, Source, read_line};
use super::text::Text;
use super::{ReadOptions, close, close_as_marked, longitude};
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::constraint::Constraints;
use crate::error::{Error, Result, quoted, shortened};
use crate::ragged;

/// Reads a CSV file row by row.
pub(super) fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let mut reader = std::mem::replace(&mut source.reader, Box::new(io::empty()));
    let mut first_line = Vec::new();
    read_line(&mut reader, &source.room, &mut first_line, ROW_BYTES).map_err(|error| source.failed(error))?;
    // Memory for the names of columns.
    let dialect = Dialect::of(&first_line);
    source.take(HEADING_BYTES * first_line.iter().filter(|&&c| c == dialect.separator).count())?;
    let endings = if first_line.ends_with(b"\r\n") { Endings::CrLf } else { Endings::Lf };
    let since_row = Cell::new(0);
    let rows = RowReader { inner: reader, since_row: &since_row };
    let whole = io::Cursor::new(first_line).chain(rows).chain(endings.text());
    let mut csv = ReaderBuilder::new().delimiter(dialect.separator).trim(Trim::Headers).from_reader(whole);
    let header: Vec<String> = match csv.byte_headers() {
        Ok(header) => header.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect(),
        Err(error) => return Err(row_error(source, error, 1)),
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
            return Err(source.error(1, message));
        }
    };
    let table = options.columns.resolve(&source.path, &header)?;
    if options.sorted && table.cell("t").is_none() {
        return Err(source.error(1, "there is no column t to sort by: map one with `ReadOptions::columns`, as in t=…"));
    }
    let mut rows = Rows::new(source, &table, &header, dialect);
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

/// One column of numbers: its cell, whether it may be blank, and its values.
struct Numbers {
    cell: usize,
    optional: bool,
    values: Vec<f64>,
}

impl Numbers {
    fn new(cell: Option<usize>, optional: bool) -> Option<Self> {
        cell.map(|cell| Numbers { cell, optional, values: Vec::new() })
    }
}

/// An upper bound of the memory for the name of a column, beside its letters.
const HEADING_BYTES: usize = 96;

/// An upper bound of the memory for a curve, beside its points and its name.
const CURVE_BYTES: usize = 256;

/// The memory for the curve of a row, and its place in another order.
const OWNER_BYTES: usize = 16;

/// The rows read so far.
struct Rows<'a> {
    source: &'a Source<'a>,
    header: &'a [String],
    dialect: Dialect,
    curve: Option<usize>,
    /// The curve of the last row.
    current: usize,
    owners: Owners,
    longitude: bool,
    dimension: usize,
    /// Columns x, y, z, then those of tangents and curvature vectors, one column an axis.
    coords: Vec<f64>,
    axes: Vec<usize>,
    vectors: [Vec<usize>; 2],
    tangents: Vec<f64>,
    curvatures: Vec<f64>,
    t: Option<Numbers>,
    weight: Option<Numbers>,
    nu: Option<Numbers>,
    known: Option<(usize, Vec<bool>)>,
    pinned: Option<(usize, Vec<bool>)>,
    /// One flag a curve.
    closed: Option<(usize, Vec<bool>)>,
    /// The first point of a curve with a cell that must not be blank, and what to do.
    blanks: BTreeMap<usize, (usize, String)>,
    names: Vec<String>,
    /// Curves by name, to find a curve that goes on after another one began.
    curves: HashMap<String, usize>,
    /// First and last line of every curve.
    lines: Vec<(u64, u64)>,
}

impl<'a> Rows<'a> {
    fn new(source: &'a Source<'a>, table: &Table, header: &'a [String], dialect: Dialect) -> Self {
        let cells = |names: [&str; 3]| names.iter().filter_map(|name| table.cell(name)).collect::<Vec<_>>();
        let axes = cells(["x", "y", "z"]);
        Rows {
            source,
            header,
            dialect,
            curve: table.cell("curve"),
            current: 0,
            owners: Owners::default(),
            longitude: table.longitude,
            dimension: axes.len(),
            coords: Vec::new(),
            axes,
            vectors: [cells(["tx", "ty", "tz"]), cells(["kx", "ky", "kz"])],
            tangents: Vec::new(),
            curvatures: Vec::new(),
            t: Numbers::new(table.cell("t"), false),
            weight: Numbers::new(table.cell("weight"), false),
            nu: Numbers::new(table.cell("nu"), true),
            known: table.cell("known").map(|cell| (cell, Vec::new())),
            pinned: table.cell("pinned").map(|cell| (cell, Vec::new())),
            closed: table.cell("closed").map(|cell| (cell, Vec::new())),
            blanks: BTreeMap::new(),
            names: Vec::new(),
            curves: HashMap::new(),
            lines: Vec::new(),
        }
    }

    fn push(&mut self, record: &ByteRecord, line: u64) -> Result<()> {
        self.begin_or_go_on(record, line)?;
        let cells = Cells { record, line, source: self.source, header: self.header, dialect: self.dialect };
        let flag = "1 for a given control point, 0 else";
        let known = self.known.as_ref().map(|(cell, _)| cells.flag(*cell, flag)).transpose()?;
        let pinned = "1 for a point that the curve goes through exactly, 0 else";
        let pinned = self.pinned.as_ref().map(|(cell, _)| cells.flag(*cell, pinned)).transpose()?;
        let closed = "1 in all rows of a closed curve, 0 else";
        let closed = self.closed.as_ref().map(|(cell, _)| cells.flag(*cell, closed)).transpose()?;
        let curve = self.current;
        let point = self.owners.counts[curve];
        self.owners.push(curve);
        let mut blank = None;
        for &cell in &self.axes {
            let x = cells.number(cell)?;
            if x.is_none() && known != Some(false) {
                blank.get_or_insert((cell, known));
            }
            self.source.push(&mut self.coords, x.unwrap_or(f64::NAN))?;
        }
        for (cells_of, values) in self.vectors.iter().zip([&mut self.tangents, &mut self.curvatures]) {
            cells.vector(cells_of, values)?;
        }
        for column in [&mut self.t, &mut self.weight, &mut self.nu].into_iter().flatten() {
            let x = cells.number(column.cell)?;
            if x.is_none() && !column.optional {
                blank.get_or_insert((column.cell, None));
            }
            self.source.push(&mut column.values, x.unwrap_or(f64::NAN))?;
        }
        if let Some((cell, known)) = blank {
            let why = match known {
                Some(_) => ", but its point is known: fill it in, or write 0 in column known",
                None => ": fill it in, or remove the row",
            };
            let what = || (point, format!("column {} is blank{why}", quoted(&self.header[cell])));
            self.blanks.entry(curve).or_insert_with(what);
        }
        for (column, flag) in [(&mut self.known, known), (&mut self.pinned, pinned)] {
            if let (Some((_, flags)), Some(flag)) = (column, flag) {
                self.source.push(flags, flag)?;
            }
        }
        if let (Some((cell, flags)), Some(closed)) = (&mut self.closed, closed) {
            if flags.len() == curve {
                flags.push(closed);
            } else if flags[curve] != closed {
                let (first, why) = (self.lines[curve].0, "give all rows of a curve the same");
                return Err(cells.wrong(*cell, &format!("but line {first}, of the same curve, holds the other: {why}")));
            }
        }
        Ok(())
    }

    /// Starts a curve if the name changes.
    fn begin_or_go_on(&mut self, record: &ByteRecord, line: u64) -> Result<()> {
        let name = self.curve.map_or(&b"0"[..], |cell| &record[cell]);
        if let (Some(last), Some(lines)) = (self.names.get(self.current), self.lines.get_mut(self.current))
            && last.as_bytes() == name
        {
            lines.1 = line;
            return Ok(());
        }
        let name = std::str::from_utf8(name)
            .map_err(|_| self.source.error(line, "the curve's name is not UTF-8 text: save the file as UTF-8"))?;
        if let Some(&earlier) = self.curves.get(name) {
            // From now on rows of the file are no longer curve by curve.
            if !self.owners.is_mixed() {
                self.source.take(OWNER_BYTES * self.coords.len() / self.dimension)?;
            }
            self.source.take(OWNER_BYTES)?;
            self.owners.mix();
            self.current = earlier;
            self.lines[earlier].1 = line;
            return Ok(());
        }
        // The name, twice, and the places in all lists of curves. The lists grow by doubling.
        self.source.take(CURVE_BYTES + 2 * name.len())?;
        self.curves.insert(name.to_string(), self.names.len());
        self.names.push(name.to_string());
        self.lines.push((line, line));
        self.current = self.names.len() - 1;
        self.owners.counts.push(0);
        Ok(())
    }

    /// Brings all columns into another order of rows.
    fn arrange(&mut self, order: &[usize]) {
        let d = self.dimension;
        arranged(&mut self.coords, d, order);
        for vectors in [&mut self.tangents, &mut self.curvatures].into_iter().filter(|vectors| !vectors.is_empty()) {
            arranged(vectors, d, order);
        }
        for column in [&mut self.t, &mut self.weight, &mut self.nu].into_iter().flatten() {
            arranged(&mut column.values, 1, order);
        }
        for (_, flags) in [&mut self.known, &mut self.pinned].into_iter().flatten() {
            arranged(flags, 1, order);
        }
    }

    fn finish(mut self, options: &ReadOptions) -> Result<CurveBatch> {
        let d = self.dimension;
        let offsets = ragged::offsets(self.owners.counts.iter().copied());
        let t = self.t.as_ref().filter(|_| options.sorted).map(|t| &t.values[..]);
        if let Some(order) = self.owners.order(t) {
            self.arrange(&order);
        }
        // Blank lines, names of several lines, and rows between others or in another order make the
        // line of a point uncertain. Then only the curve is named.
        let first_line = |i: usize| {
            let ((first, last), count) = (self.lines[i], self.owners.counts[i]);
            (!options.sorted && last.saturating_sub(first) + 1 == count as u64).then_some(first)
        };
        let mut origin = Origin {
            file: Some(self.source.path.display().to_string()),
            first_lines: Some((0..self.names.len()).map(first_line).collect()),
            names: self.curve.map(|_| self.names),
            ..Origin::default()
        };
        for i in 0..offsets.len() - 1 {
            let points = &mut self.coords[offsets[i] * d..offsets[i + 1] * d];
            if self.longitude
                && longitude::is_geographic(points, d)
                && let Some(turns) = longitude::turns(points, d)
            {
                let ring = points[..d] == points[points.len() - d..];
                if ring && longitude::winds(&turns) {
                    origin.round_pole.push(i);
                }
                longitude::apply(points, d, &turns);
                origin.unwrapped.push(i);
            }
        }
        let round_pole = origin.round_pole.clone();
        let mut batch = CurveBatch::from_file(d, self.coords, offsets, Arc::new(origin))?;
        if let Some(t) = self.t {
            batch = batch.with_parameters(t.values)?;
        }
        if let Some(weight) = self.weight {
            batch = batch.with_weights(weight.values)?;
        }
        let [tangents, curvatures] =
            [self.tangents, self.curvatures].map(|vectors| Some(vectors).filter(|v| !v.is_empty()));
        let [known, pinned] = [self.known, self.pinned].map(|column| column.map(|(_, flags)| flags));
        let exponents = self.nu.map(|column| column.values);
        batch = batch.with_constraints(Constraints { tangents, curvatures, exponents, known, pinned })?;
        for (i, (point, what)) in self.blanks {
            batch.refuse(i, point, &what);
        }
        match self.closed {
            Some((_, flags)) => close_as_marked(batch, options.closed, flags),
            None => {
                let marked = vec![false; batch.len()];
                close(batch, options.closed, &marked, &round_pole)
            }
        }
    }
}

/// One row, and what is needed to say what is wrong with it.
struct Cells<'a> {
    record: &'a ByteRecord,
    line: u64,
    source: &'a Source<'a>,
    header: &'a [String],
    dialect: Dialect,
}

impl Cells<'_> {
    /// The number in a cell, or `None` if it is blank.
    fn number(&self, cell: usize) -> Result<Option<f64>> {
        let number = self.dialect.number(&self.record[cell]);
        number.map_err(|()| self.wrong(cell, "which is no number: mend it, or remove the row"))
    }

    fn flag(&self, cell: usize, meaning: &str) -> Result<bool> {
        match self.number(cell) {
            Ok(Some(1.0)) => Ok(true),
            Ok(Some(0.0)) => Ok(false),
            _ => Err(self.wrong(cell, &format!("which is neither 1 nor 0: write {meaning}"))),
        }
    }

    /// A tangent or curvature vector: all of its components, or none.
    fn vector(&self, cells: &[usize], values: &mut Vec<f64>) -> Result<()> {
        let start = values.len();
        for &cell in cells {
            self.source.push(values, self.number(cell)?.unwrap_or(f64::NAN))?;
        }
        let free = values[start..].iter().filter(|x| x.is_nan()).count();
        if free > 0 && free < cells.len() {
            let cell = cells[values[start..].iter().position(|x| x.is_nan()).expect("counted above")];
            return Err(self.wrong(cell, "but its vector has other components: give all of them, or none"));
        }
        Ok(())
    }

    fn wrong(&self, cell: usize, why: &str) -> Error {
        let (column, text) = (&self.header[cell], String::from_utf8_lossy(&self.record[cell]));
        self.source.error(self.line, format!("column {} holds {}, {why}", quoted(column), quoted(&text)))
    }
}

/// Refuses two curves of one name, which a file of rows could not tell apart.
pub(super) fn check_names(batch: &CurveBatch) -> Result<()> {
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

/// Writes `curve,x,y[,z],t`, and `closed` if a curve is.
///
/// t is the parameter, or the number of the vertex if there is none.
pub(super) fn write(out: &mut dyn Write, batch: &CurveBatch, decimals: Option<u8>) -> io::Result<()> {
    let d = batch.dimension();
    let mut text = Text::new(out).with_decimals(decimals);
    let any_closed = (0..batch.len()).any(|i| batch.is_closed(i));
    text.push(if d == 2 { "curve,x,y,t" } else { "curve,x,y,z,t" })?;
    text.push(if any_closed { ",closed\n" } else { "\n" })?;
    for i in 0..batch.len() {
        let name = name_cell(&batch.name(i))?;
        let parameters = batch.parameters(i);
        for (k, point) in batch.points(i).chunks_exact(d).enumerate() {
            text.push(&name)?;
            text.point(point, ",")?;
            text.push(",")?;
            text.number(parameters.map_or(k as f64, |t| t[k]))?;
            text.push(match (any_closed, batch.is_closed(i)) {
                (false, _) => "\n",
                (true, true) => ",1\n",
                (true, false) => ",0\n",
            })?;
        }
    }
    text.finish()
}

/// A name and a comma, quoted where it must be.
fn name_cell(name: &str) -> io::Result<Vec<u8>> {
    let mut row = ::csv::WriterBuilder::new().buffer_capacity(64).from_writer(Vec::new());
    row.write_record([name, ""])?;
    let mut cell = row.into_inner().map_err(|error| error.into_error())?;
    cell.truncate(cell.len().saturating_sub(1));
    Ok(cell)
}
