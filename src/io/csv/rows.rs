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

/// Columns of one role, one for each axis of a vector, and their numbers row by row.
struct Group {
    cells: Vec<usize>,
    blank: Blank,
    values: Vec<f64>,
}

/// What a blank cell of a column means.
#[derive(Clone, Copy)]
enum Blank {
    /// Nothing is given.
    Free,
    /// No component of the vector is given, or it is an error.
    WholeVector,
    /// The curve cannot be fitted.
    Unfitted,
    /// The same, unless the control point is unknown.
    UnfittedIfKnown,
    /// An error: cells hold 1 or 0, which mean this.
    Flag(&'static str),
}

/// The roles of columns of numbers but `t`.
const GROUPS: [(&[&str], Blank); 10] = [
    (&["known"], Blank::Flag("1 for a given control point, 0 else")),
    (&["pinned"], Blank::Flag("1 for a point that the curve goes through exactly, 0 else")),
    (&["x", "y", "z"], Blank::UnfittedIfKnown),
    (&["tx", "ty", "tz"], Blank::WholeVector),
    (&["kx", "ky", "kz"], Blank::WholeVector),
    (&["weight"], Blank::Unfitted),
    (&["nu"], Blank::Free),
    (&["kmax"], Blank::Free),
    (&["corridor"], Blank::Free),
    (&["corridor_left", "corridor_right"], Blank::WholeVector),
];

/// Places in [`GROUPS`].
const KNOWN: usize = 0;
const POINTS: usize = 2;

impl Group {
    /// Adds the cells of a row, whose control point is `known` (1, 0, or not said). Returns the
    /// first cell that is blank if the curve cannot be fitted, and the remedy.
    fn push(&mut self, row: &Cells, known: Option<f64>) -> Result<Option<(usize, &'static str)>> {
        let (start, mut blank) = (self.values.len(), None);
        for &cell in &self.cells {
            let x = match self.blank {
                Blank::Flag(meaning) => Some(f64::from(u8::from(row.flag(cell, meaning)?))),
                _ => row.number(cell)?,
            };
            blank = blank.or(x.is_none().then_some(cell));
            row.source.push(&mut self.values, x.unwrap_or(f64::NAN))?;
        }
        let why = match (self.blank, known) {
            (Blank::WholeVector, _) => {
                row.check_vector(&self.cells, &self.values[start..])?;
                return Ok(None);
            }
            (Blank::Free | Blank::Flag(_), _) | (Blank::UnfittedIfKnown, Some(0.0)) => return Ok(None),
            (Blank::UnfittedIfKnown, Some(_)) => ", but its point is known: fill it in, or write 0 in column known",
            (Blank::Unfitted | Blank::UnfittedIfKnown, _) => ": fill it in, or remove the row",
        };
        Ok(blank.map(|cell| (cell, why)))
    }
}

/// An upper bound of the memory for a curve, in addition to its points and its name.
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
    /// The columns of [`GROUPS`].
    groups: [Group; GROUPS.len()],
    /// The cell of the parameter, and the parameters.
    t: Option<(usize, Vec<f64>)>,
    /// How times are written if they are dates, for the file and for each curve.
    clock: Option<Clock>,
    clocks: Vec<Option<Clock>>,
    /// One flag per curve.
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
        let group = |(roles, blank): (&[&str], Blank)| {
            let cells = roles.iter().filter_map(|role| table.cell(role)).collect();
            Group { cells, blank, values: Vec::new() }
        };
        Rows {
            source,
            header,
            dialect,
            curve: table.cell("curve"),
            current: 0,
            owners: Owners::default(),
            longitude: table.longitude,
            groups: GROUPS.map(group),
            t: table.cell("t").map(|cell| (cell, Vec::new())),
            clock: None,
            clocks: Vec::new(),
            closed: table.cell("closed").map(|cell| (cell, Vec::new())),
            blanks: BTreeMap::new(),
            timeless: BTreeMap::new(),
            names: Vec::new(),
            carried: carried.into_iter().map(|(cell, name, between)| CarriedCells::new(name, cell, between)).collect(),
            curves: HashMap::new(),
            lines: Vec::new(),
            passes_status: table.passes_status,
        }
    }

    pub fn push(&mut self, record: &ByteRecord, line: u64) -> Result<()> {
        self.begin_or_go_on(record, line)?;
        let row = Cells { record, line, source: self.source, header: self.header, dialect: self.dialect };
        let curve = self.current;
        let point = self.owners.counts[curve];
        self.owners.push(curve);
        let mut blank = None;
        for k in 0..GROUPS.len() {
            let known = self.groups[KNOWN].values.last().copied();
            blank = blank.or(self.groups[k].push(&row, known)?);
        }
        if let Some((cell, values)) = &mut self.t {
            self.clocks.resize(self.names.len(), None);
            let x = row.time(*cell, values, &mut self.clock, &mut self.clocks[curve])?;
            if x.is_none() {
                self.timeless.entry(curve).or_insert(point);
            }
            self.source.push(values, x.unwrap_or(f64::NAN))?;
        }
        for column in &mut self.carried {
            column.push(self.source, record, line)?;
        }
        if let Some((cell, why)) = blank {
            let what = || (point, format!("column {} is blank{why}", quoted(&self.header[cell])));
            self.blanks.entry(curve).or_insert_with(what);
        }
        if let Some((cell, flags)) = &mut self.closed {
            let closed = row.flag(*cell, "1 in all rows of a closed curve, 0 else")?;
            if flags.len() == curve {
                flags.push(closed);
            } else if flags[curve] != closed {
                let (first, why) = (self.lines[curve].0, "give all rows of a curve the same");
                return Err(row.wrong(*cell, &format!("but line {first}, of the same curve, holds the other: {why}")));
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
                self.source.take(OWNER_BYTES * self.owners.counts.iter().sum::<usize>())?;
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

    pub fn finish(mut self, options: &ReadOptions) -> Result<CurveBatch> {
        let offsets = ragged::offsets(self.owners.counts.iter().copied());
        let t = self.t.as_ref().filter(|_| options.sorted).map(|(_, t)| &t[..]);
        let order = self.owners.order(t);
        if let Some(order) = &order {
            for group in self.groups.iter_mut().filter(|group| !group.cells.is_empty()) {
                arranged(&mut group.values, group.cells.len(), order);
            }
            self.t.iter_mut().for_each(|(_, t)| arranged(t, 1, order));
        }
        let finish =
            |column: CarriedCells| column.finish(self.source, order.as_deref(), &self.owners.counts, self.dialect);
        for (curve, point) in std::mem::take(&mut self.timeless) {
            let Some((cell, t)) = &self.t else { break };
            let has_none = t[offsets[curve]..offsets[curve + 1]].iter().all(|t| t.is_nan());
            if !has_none && self.blanks.get(&curve).is_none_or(|(first, _)| point < *first) {
                let what = format!("column {} is blank: fill it in, or remove the row", quoted(&self.header[*cell]));
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
        let d = self.groups[POINTS].cells.len();
        let values = self.groups.map(|group| (!group.values.is_empty()).then_some(group.values));
        let [known, pinned, coords, tangents, curvatures, weights, exponents, largest_curvatures, corridors, widths] =
            values;
        let mut coords = coords.unwrap_or_default();
        let within_half_turn = coords.iter().step_by(d).all(|&x| longitude::within_half_turn(x));
        let geographic = self.longitude && longitude::are_geographic(&coords, d);
        let (unwrapped, round_pole) = match self.longitude {
            true => longitude::unwrap(&mut coords, d, &offsets),
            false => Default::default(),
        };
        let origin = Origin {
            first_lines: Some((0..self.names.len()).map(first_line).collect()),
            names: self.curve.map(|_| self.names),
            clock: self.clock,
            clocks: self.clock.and_then(|clock| clock.each_own(&self.clocks)),
            notes: self.passes_status.then(|| "column status passed over".into()).into_iter().collect(),
            geographic,
            within_half_turn,
            unwrapped,
            ..self.source.origin()
        };
        let mut batch = CurveBatch::from_file(d, coords, offsets, Arc::new(origin))?;
        if let Some((_, t)) = self.t {
            batch = batch.with_parameters(t)?;
        }
        if let Some(weights) = weights {
            batch = batch.with_weights(weights)?;
        }
        let [known, pinned] = [known, pinned].map(|flags| Some(flags?.into_iter().map(|flag| flag == 1.0).collect()));
        let constraints =
            Constraints { tangents, curvatures, exponents, known, pinned, largest_curvatures, corridors, widths };
        batch = batch.with_constraints(constraints)?;
        batch = batch.with_columns(columns)?;
        for (i, (point, what)) in self.blanks {
            batch.refuse(i, point, &what);
        }
        match self.closed {
            Some((_, flags)) => close_as_marked(batch, options.closed, flags),
            None => close(batch, options.closed, &[], &round_pole),
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

    /// The time in a cell: a number, or a date in the way of the rows before.
    fn time(
        &self,
        cell: usize,
        before: &[f64],
        clock: &mut Option<Clock>,
        own: &mut Option<Clock>,
    ) -> Result<Option<f64>> {
        let none_before = || before.iter().all(|t| t.is_nan());
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

    /// Refuses a vector that has some of its components only.
    fn check_vector(&self, cells: &[usize], values: &[f64]) -> Result<()> {
        match values.iter().position(|x| x.is_nan()) {
            Some(blank) if !values.iter().all(|x| x.is_nan()) => {
                Err(self.wrong(cells[blank], "but its vector has other components: give all of them, or none"))
            }
            _ => Ok(()),
        }
    }

    fn wrong(&self, cell: usize, why: &str) -> Error {
        let (column, text) = (&self.header[cell], String::from_utf8_lossy(&self.record[cell]));
        self.source.error(self.line, format!("column {} holds {}, {why}", quoted(column), quoted(&text)))
    }
}
