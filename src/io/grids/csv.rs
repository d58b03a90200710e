//! CSV: rows of numbers, one grid per block, with a blank line between two.

use std::io::{self, Write};

use super::super::csv::Dialect;
use super::super::source::{Source, read_line};
use super::super::text::Text;
use crate::error::{Error, Result, listed, quoted};
use crate::grids::Grids;

/// Reads blocks of rows.
pub(super) fn read(source: &mut Source) -> Result<Grids> {
    let mut reader = std::mem::replace(&mut source.reader, Box::new(io::empty()));
    let mut blocks = Blocks::default();
    let mut bytes = Vec::new();
    let mut line = 0;
    loop {
        bytes.clear();
        if read_line(&mut reader, &source.room, &mut bytes, u64::MAX).map_err(|error| source.failed(error))? == 0 {
            break;
        }
        line += 1;
        match bytes.trim_ascii() {
            [] => blocks.end(source)?,
            row => blocks.push(source, line, row)?,
        }
    }
    blocks.end(source)?;
    match blocks.shapes.is_empty() {
        true => Err(source.error(None, "the file is empty: there is nothing to read")),
        false => Grids::new(1, blocks.shapes, blocks.values),
    }
}

#[derive(Default)]
struct Blocks {
    shapes: Vec<[usize; 2]>,
    values: Vec<f64>,
    /// Rows and columns of the block at hand, and the line where it began.
    shape: [usize; 2],
    first_line: u64,
}

impl Blocks {
    fn push(&mut self, source: &Source, line: u64, row: &[u8]) -> Result<()> {
        let before = self.values.len();
        for (column, cell) in row.split(|&byte| byte == b',').enumerate() {
            match number(cell) {
                Some(x) => source.push(&mut self.values, x)?,
                None if before == 0 && is_header(row) => return Err(header(source, line, row)),
                None => return Err(wrong(source, line, column + 1, cell)),
            }
        }
        let columns = self.values.len() - before;
        if self.shape[0] == 0 {
            (self.shape, self.first_line) = ([0, columns], line);
        }
        if columns != self.shape[1] {
            return Err(source.error(
                line,
                format!(
                    "the row has {columns} numbers, but the rows of its grid, which began on line {}, have {}: add or remove numbers, or put a \
                     blank line between two grids",
                    self.first_line, self.shape[1]
                ),
            ));
        }
        self.shape[0] += 1;
        Ok(())
    }

    fn end(&mut self, source: &Source) -> Result<()> {
        match self.shape[0] {
            0 => Ok(()),
            _ => source.push(&mut self.shapes, std::mem::take(&mut self.shape)),
        }
    }
}

/// The number in a cell. A blank is NaN, as it is in points: the trouble of its grid alone.
fn number(cell: &[u8]) -> Option<f64> {
    Dialect::of(b",").number(cell).ok().map(|number| number.unwrap_or(f64::NAN))
}

/// Whether no cell of a row is a number, and none is empty.
fn is_header(row: &[u8]) -> bool {
    let word = |cell: &[u8]| cell.iter().any(u8::is_ascii_alphabetic) && number(cell).is_none();
    row.split(|&byte| byte == b',').all(word)
}

fn header(source: &Source, line: u64, row: &[u8]) -> Error {
    let words = listed(row.split(|&byte| byte == b',').map(quoted_cell));
    source.error(
        line,
        format!(
            "the row holds {words} as a header does, but grids have none: remove the line, so that all rows are numbers"
        ),
    )
}

fn wrong(source: &Source, line: u64, column: usize, cell: &[u8]) -> Error {
    let text = cell.trim_ascii();
    source.error(
        line,
        if text.split(|byte| b"; \t".contains(byte)).all(|part| part.is_empty() || number(part).is_some()) {
            format!("column {column} holds {}, which is no number: separate numbers by commas", quoted_cell(text))
        } else {
            format!("column {column} holds {}, which is no number: mend it", quoted_cell(text))
        },
    )
}

fn quoted_cell(cell: &[u8]) -> String {
    // Only the start of the cell is shown, which may be megabytes long.
    let start = &cell.trim_ascii()[..cell.trim_ascii().len().min(1000)];
    quoted(&String::from_utf8_lossy(start))
}

/// Writes rows of heights, and a blank line between two grids.
pub(super) fn write(out: &mut dyn Write, grids: &Grids) -> io::Result<()> {
    let mut text = Text::new(out);
    for i in 0..grids.len() {
        if i > 0 {
            text.push("\n")?;
        }
        for row in grids.grid(i).chunks_exact(grids.shape(i)[1].max(1)) {
            text.point(row, ",")?;
            text.push("\n")?;
        }
    }
    text.finish()
}
