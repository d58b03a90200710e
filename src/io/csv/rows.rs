//! [`Rows`]: the points of curves, row by row, and the batch that they make.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use csv::ByteRecord;

use super::carried::Cells as CarriedCells;
use super::dialect::Dialect;
use super::order::{Owners, arranged};
use crate::batch::{Clock, CurveBatch, Origin};
use crate::constraint::Constraints;
use crate::error::{Error, Result, quoted};
use crate::io::columns::{Between, Table};
use crate::io::encoding::NOT_UTF8;
use crate::io::source::Source;
use crate::io::{ReadOptions, close, close_as_marked, longitude};
use crate::ragged;

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

/// An upper bound of the memory for a curve, beside its points and its name.
const CURVE_BYTES: usize = 256;

/// The memory for the curve of a row, and its place in another order.
const OWNER_BYTES: usize = 16;

/// The rows read so far.
pub(super) struct Rows<'a> {
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
    /// How the times are written, if they are dates, and how those of every curve are.
    clock: Option<Clock>,
    clocks: Vec<Option<Clock>>,
    weight: Option<Numbers>,
    nu: Option<Numbers>,
    kmax: Option<Numbers>,
    corridor: Option<Numbers>,
    known: Option<(usize, Vec<bool>)>,
    pinned: Option<(usize, Vec<bool>)>,
    /// One flag a curve.
    closed: Option<(usize, Vec<bool>)>,
    /// The first point of a curve with a cell that must not be blank, and what to do.
    blanks: BTreeMap<usize, (usize, String)>,
    /// The first point of a curve without a parameter. Where all lack it, the curve has none.
    timeless: BTreeMap<usize, usize>,
    names: Vec<String>,
    carried: Vec<CarriedCells>,
    /// Curves by name, to find a curve that goes on after another one began.
    curves: HashMap<String, usize>,
    /// First and last line of every curve.
    lines: Vec<(u64, u64)>,
    passes_status: bool,
}

impl<'a> Rows<'a> {
    pub fn new(
        source: &'a Source<'a>,
        table: &Table,
        header: &'a [String],
        dialect: Dialect,
        carried: Vec<(usize, &str, Between)>,
    ) -> Self {
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
            clock: None,
            carried: carried.into_iter().map(|(cell, name, between)| CarriedCells::new(name, cell, between)).collect(),
            weight: Numbers::new(table.cell("weight"), false),
            nu: Numbers::new(table.cell("nu"), true),
            kmax: Numbers::new(table.cell("kmax"), true),
            corridor: Numbers::new(table.cell("corridor"), true),
            known: table.cell("known").map(|cell| (cell, Vec::new())),
            pinned: table.cell("pinned").map(|cell| (cell, Vec::new())),
            closed: table.cell("closed").map(|cell| (cell, Vec::new())),
            blanks: BTreeMap::new(),
            clocks: Vec::new(),
            timeless: BTreeMap::new(),
            names: Vec::new(),
            curves: HashMap::new(),
            lines: Vec::new(),
            passes_status: table.passes_status,
        }
    }

    pub fn push(&mut self, record: &ByteRecord, line: u64) -> Result<()> {
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
        if let Some(t) = &mut self.t {
            self.clocks.resize(self.names.len(), None);
            let x = cells.time(t, &mut self.clock, &mut self.clocks[curve])?;
            if x.is_none() {
                self.timeless.entry(curve).or_insert(point);
            }
            self.source.push(&mut t.values, x.unwrap_or(f64::NAN))?;
        }
        for column in [&mut self.weight, &mut self.nu, &mut self.kmax, &mut self.corridor].into_iter().flatten() {
            let x = cells.number(column.cell)?;
            if x.is_none() && !column.optional {
                blank.get_or_insert((column.cell, None));
            }
            self.source.push(&mut column.values, x.unwrap_or(f64::NAN))?;
        }
        for column in &mut self.carried {
            column.push(self.source, record, line)?;
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
            .map_err(|_| self.source.error(line, format!("the curve's name is {NOT_UTF8}")))?;
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
        for column in
            [&mut self.t, &mut self.weight, &mut self.nu, &mut self.kmax, &mut self.corridor].into_iter().flatten()
        {
            arranged(&mut column.values, 1, order);
        }
        for (_, flags) in [&mut self.known, &mut self.pinned].into_iter().flatten() {
            arranged(flags, 1, order);
        }
    }

    pub fn finish(mut self, options: &ReadOptions) -> Result<CurveBatch> {
        let d = self.dimension;
        let offsets = ragged::offsets(self.owners.counts.iter().copied());
        let t = self.t.as_ref().filter(|_| options.sorted).map(|t| &t.values[..]);
        let order = self.owners.order(t);
        if let Some(order) = &order {
            self.arrange(order);
        }
        let finish =
            |column: CarriedCells| column.finish(self.source, order.as_deref(), &self.owners.counts, self.dialect);
        for (curve, point) in std::mem::take(&mut self.timeless) {
            let Some(t) = self.t.as_ref() else { break };
            let has_none = t.values[offsets[curve]..offsets[curve + 1]].iter().all(|t| t.is_nan());
            if !has_none && self.blanks.get(&curve).is_none_or(|(first, _)| point < *first) {
                let what = format!("column {} is blank: fill it in, or remove the row", quoted(&self.header[t.cell]));
                self.blanks.insert(curve, (point, what));
            }
        }
        let columns = std::mem::take(&mut self.carried).into_iter().map(finish).collect::<Result<Vec<_>>>()?;
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
            clock: self.clock,
            clocks: self.clock.and_then(|clock| clock.each_own(&self.clocks)),
            notes: self.passes_status.then(|| "column status passed over".into()).into_iter().collect(),
            geographic: self.longitude && longitude::are_geographic(&self.coords, d),
            ..Origin::default()
        };
        origin.within_half_turn = self.coords.iter().step_by(d).all(|&x| longitude::within_half_turn(x));
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
        let [exponents, largest_curvatures, corridors] =
            [self.nu, self.kmax, self.corridor].map(|column| column.map(|column| column.values));
        let constraints = Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors };
        batch = batch.with_constraints(constraints)?;
        batch = batch.with_columns(columns)?;
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

    /// The time in a cell: a number, or a date as in the rows before, of all curves and of its own.
    fn time(&self, column: &Numbers, clock: &mut Option<Clock>, own: &mut Option<Clock>) -> Result<Option<f64>> {
        let cell = column.cell;
        let none_before = || column.values.iter().all(|t| t.is_nan());
        match (self.dialect.number(&self.record[cell]), &clock) {
            (Ok(None), _) => Ok(None),
            (Ok(number), None) => Ok(number),
            (Err(()), None) if !none_before() => {
                Err(self.wrong(cell, "but the times before it are numbers: write all in one way"))
            }
            (Ok(_), Some(_)) => Err(self.wrong(cell, "but the times before it are dates: write all in one way")),
            (Err(()), _) => {
                let text = String::from_utf8_lossy(self.record[cell].trim_ascii());
                let Some((t, here)) = Clock::read(&text) else {
                    let why =
                        "which is neither a number nor a date such as 2024-03-01T06:00:00Z: mend it, or remove the row";
                    return Err(self.wrong(cell, why));
                };
                for clock in [clock, own] {
                    *clock = Some(clock.map_or(here, |clock| clock.with(here)));
                }
                Ok(Some(t))
            }
        }
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
