//! Lists of times, at which curves are to be sampled.

use std::collections::HashMap;
use std::path::Path;

use ::csv::{ReaderBuilder, StringRecord, Trim};

use super::csv::Dialect;
use super::source::Source;
use crate::batch::{Clock, CurveBatch};
use crate::error::{Error, Result, listed, quoted};

/// Times for the curves of a batch.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// Those of all curves.
    all: Vec<f64>,
    /// Those of curves by name.
    own: HashMap<String, Vec<f64>>,
}

impl Times {
    /// The times of every curve of a batch: the list that [`At::Times`](crate::tracks::At::Times)
    /// wants.
    ///
    /// Parts of a curve `a`, called `a.1`, `a.2` …, have the times of `a`.
    ///
    /// # Errors
    /// A name in the file that no curve has.
    pub fn of(&self, batch: &CurveBatch) -> Result<Vec<Vec<f64>>> {
        let whole = |name: &str| match name.rsplit_once('.') {
            Some((whole, number)) if number.bytes().all(|c| c.is_ascii_digit()) => whole.to_string(),
            _ => name.to_string(),
        };
        let mut unused: Vec<&String> = self.own.keys().collect();
        let times = |i: usize| {
            let name = batch.name(i);
            let key = if self.own.contains_key(&*name) { name.into_owned() } else { whole(&name) };
            unused.retain(|other| **other != key);
            self.own.get(&key).unwrap_or(&self.all).clone()
        };
        let times = (0..batch.len()).map(times).collect();
        unused.sort_unstable();
        match unused.first() {
            None => Ok(times),
            Some(name) => Err(Error::argument(format!(
                "times are given for curve {}, which is not among the curves: mend the name, or remove its rows",
                quoted(name)
            ))),
        }
    }
}

/// Reads a table of times: a column `t`, and perhaps `curve`, or one column without a header.
///
/// Times are numbers, or dates if the times of the curves are dates.
///
/// # Errors
/// A file that cannot be read or is no such table. A time that is neither a number nor a date.
pub fn read_times(path: impl AsRef<Path>) -> Result<Times> {
    let mut source = Source::open(path.as_ref())?;
    let (dialect, records) = records(&mut source)?;
    let mut times = Times::default();
    let (mut t, mut curve) = (0, None);
    for (k, (line, record)) in records.into_iter().enumerate() {
        let cell = |cell: usize| record.get(cell).unwrap_or_default();
        if k == 0 && (record.len() > 1 || time(dialect, cell(0)).is_none()) {
            let place = |name: &str| record.iter().position(|heading| heading.eq_ignore_ascii_case(name));
            curve = place("curve");
            t = place("t").ok_or_else(|| {
                source
                    .error(line, format!("there is no column t: the columns are {}", listed(record.iter().map(quoted))))
            })?;
            continue;
        }
        let Some(time) = time(dialect, cell(t)) else {
            let why = "which is neither a number nor a date such as 2024-03-01T06:00:00Z: mend it, or remove the row";
            return Err(source.error(line, format!("column t holds {}, {why}", quoted(cell(t)))));
        };
        match curve {
            None => times.all.push(time),
            Some(curve) => times.own.entry(cell(curve).to_string()).or_default().push(time),
        }
    }
    Ok(times)
}

/// The rows of a small table with their lines, a header among them.
pub(super) fn records(source: &mut Source) -> Result<(Dialect, Vec<(u64, StringRecord)>)> {
    let bytes = source.bytes()?;
    let first_line = bytes.split_inclusive(|&c| c == b'\n').next().unwrap_or_default();
    let (dialect, table) = match Dialect::stated(first_line) {
        Some(dialect) => (dialect, &bytes[first_line.len()..]),
        None => (Dialect::of(first_line), &bytes[..]),
    };
    let skipped = u64::from(table.len() < bytes.len());
    let mut csv =
        ReaderBuilder::new().delimiter(dialect.separator).trim(Trim::All).has_headers(false).from_reader(table);
    let record = |(k, record): (usize, ::csv::Result<StringRecord>)| {
        let line = k as u64 + 1 + skipped;
        Ok((line, record.map_err(|error| source.error(line, format!("{error}: mend the row")))?))
    };
    let records = csv.records().enumerate().map(record).collect::<Result<_>>()?;
    Ok((dialect, records))
}

/// The time in a cell.
fn time(dialect: Dialect, text: &str) -> Option<f64> {
    let number = dialect.number(text.as_bytes()).ok().flatten().filter(|t| t.is_finite());
    number.or_else(|| Clock::read(text).map(|(t, _)| t))
}
