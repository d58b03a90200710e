//! [`Carried`] columns of a file: cells as they came, and what they are once all are read.

use csv::ByteRecord;

use super::dialect::Dialect;
use crate::batch::{Column, Values};
use crate::error::{Result, quoted};
use crate::io::columns::Between;
use crate::io::encoding::NOT_UTF8;
use crate::io::source::Source;

/// A column that no method knows.
pub(super) struct Cells {
    name: String,
    cell: usize,
    between: Between,
    /// All cells as text, one after the other, and where each ends.
    text: Vec<u8>,
    ends: Vec<usize>,
}

impl Cells {
    pub fn new(name: &str, cell: usize, between: Between) -> Self {
        Cells { name: name.into(), cell, between, text: vec![], ends: vec![] }
    }

    pub fn push(&mut self, source: &Source, record: &ByteRecord, line: u64) -> Result<()> {
        let cell = &record[self.cell];
        if std::str::from_utf8(cell).is_err() {
            return Err(source.error(line, format!("column {} is {NOT_UTF8}", quoted(&self.name))));
        }
        source.grow(&mut self.text, cell.len())?;
        self.text.extend_from_slice(cell);
        source.push(&mut self.ends, self.text.len())
    }

    /// The cell of a row.
    fn cell(&self, row: usize) -> &[u8] {
        &self.text[if row == 0 { 0 } else { self.ends[row - 1] }..self.ends[row]]
    }

    /// The column, with rows in this order. `counts` has the number of rows of each curve.
    ///
    /// Cells that are the same in all rows of each curve stay as they came: a number of a ship is
    /// no quantity. Others are numbers if all of them are.
    pub fn finish(
        self,
        source: &Source,
        order: Option<&[usize]>,
        counts: &[usize],
        dialect: Dialect,
    ) -> Result<Column> {
        let rows: Vec<usize> = match order {
            Some(order) => order.to_vec(),
            None => (0..self.ends.len()).collect(),
        };
        let mut from = 0;
        let constant = counts.iter().all(|&count| {
            let of_curve = &rows[from..from + count];
            from += count;
            of_curve.iter().all(|&row| self.cell(row) == self.cell(of_curve[0]))
        });
        let number = |row: &usize| dialect.number(self.cell(*row)).ok().map(|number| number.unwrap_or(f64::NAN));
        let is_text = self.between == Between::Nearest || constant;
        let numbers = if is_text { None } else { rows.iter().map(number).collect::<Option<Vec<f64>>>() };
        let values = match numbers {
            Some(numbers) => self.between.values(numbers),
            None => {
                source.take(self.text.len() + TEXT_BYTES * rows.len())?;
                Values::Texts(rows.iter().map(|&row| String::from_utf8_lossy(self.cell(row)).into_owned()).collect())
            }
        };
        Ok(Column { name: self.name, values })
    }
}

/// The memory for a text, in addition to its letters.
const TEXT_BYTES: usize = 48;
