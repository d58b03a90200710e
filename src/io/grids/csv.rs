//! CSV: rows of numbers, one grid a block, a blank line between two.

use std::io::{self, BufRead, Write};

use super::super::source::Source;
use super::super::text::Text;
use crate::error::{Error, Result};
use crate::grids::Grids;

/// Cells that an error quotes, and letters of each.
const QUOTED: usize = 4;
const LETTERS: usize = 40;

/// Reads blocks of rows.
pub(super) fn read(source: &mut Source) -> Result<Grids> {
    let mut reader = std::mem::replace(&mut source.reader, Box::new(io::empty()));
    let mut blocks = Blocks::default();
    let mut bytes = Vec::new();
    let mut line = 0;
    loop {
        bytes.clear();
        if reader.read_until(b'\n', &mut bytes).map_err(|error| source.failed(error))? == 0 {
            break;
        }
        line += 1;
        match bytes.trim_ascii() {
            [] => blocks.end(),
            row => blocks.push(source, line, row)?,
        }
    }
    blocks.end();
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
                Some(x) => self.values.push(x),
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
                    "the row has {columns} numbers, but those of its grid, which began on line {}, have {}: add or remove numbers, or put a \
                     blank line between two grids",
                    self.first_line, self.shape[1]
                ),
            ));
        }
        self.shape[0] += 1;
        Ok(())
    }

    fn end(&mut self) {
        if self.shape[0] > 0 {
            self.shapes.push(std::mem::take(&mut self.shape));
        }
    }
}

fn number(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell.trim_ascii()).ok()?.parse().ok()
}

/// Whether no cell of a row is a number, and none is empty.
fn is_header(row: &[u8]) -> bool {
    let word = |cell: &[u8]| cell.iter().any(u8::is_ascii_alphabetic) && number(cell).is_none();
    row.split(|&byte| byte == b',').all(word)
}

fn header(source: &Source, line: u64, row: &[u8]) -> Error {
    let cells: Vec<String> = row.split(|&byte| byte == b',').map(quoted).collect();
    let more = if cells.len() > QUOTED { ", …" } else { "" };
    let words = cells[..cells.len().min(QUOTED)].join(", ");
    source.error(line, format!("the row holds {words}{more} as a header does, but grids have none: remove the line, so that all rows are numbers"))
}

fn wrong(source: &Source, line: u64, column: usize, cell: &[u8]) -> Error {
    let text = cell.trim_ascii();
    source.error(
        line,
        if text.is_empty() {
            format!("column {column} is empty: fill in a number, or remove the comma")
        } else if text.split(|byte| b"; \t".contains(byte)).all(|part| part.is_empty() || number(part).is_some()) {
            format!("column {column} holds {}, which is no number: separate numbers by commas", quoted(text))
        } else {
            format!("column {column} holds {}, which is no number: mend it", quoted(text))
        },
    )
}

/// A cell in quotation marks, cut off where it is long.
fn quoted(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell.trim_ascii());
    match text.char_indices().nth(LETTERS) {
        Some((at, _)) => format!("{:?} …", &text[..at]),
        None => format!("{text:?}"),
    }
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
