//! OBJ: meshes of quadrangles, one object per grid.
//!
//! A grid of one row or column is a polyline. A grid of one point is a point.

use std::io::{self, Write};

use super::super::text::Text;
use super::is_finite;
use crate::grids::Grids;

/// Writes meshes. Heights stand over columns (x) and rows (y), `spacing` apart.
pub(super) fn write(out: &mut dyn Write, grids: &Grids, spacing: f64) -> io::Result<()> {
    let mut text = Text::new(out);
    // Vertices are counted from 1, through all objects.
    let mut first = 1;
    for i in 0..grids.len() {
        let [rows, columns] = grids.shape(i);
        if rows * columns == 0 {
            text.push(format!("# grid_{i} has no points and is left out\n"))?;
        } else if !is_finite(grids, i) {
            text.push(format!("# grid_{i} has values that are not finite and is left out\n"))?;
        } else {
            text.push(format!("o grid_{i}\n"))?;
            vertices(&mut text, grids, i, spacing)?;
            faces(&mut text, [rows, columns], first)?;
            first += rows * columns;
        }
    }
    text.finish()
}

fn vertices(text: &mut Text, grids: &Grids, i: usize, spacing: f64) -> io::Result<()> {
    let [rows, columns] = grids.shape(i);
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let vertex = match *grids.point(i, row, column) {
            [height] => [column as f64 * spacing, row as f64 * spacing, height],
            [x, y] => [x, y, 0.0],
            [x, y, z, ..] => [x, y, z],
            [] => unreachable!("grids have a value a point or more"),
        };
        text.push("v ")?;
        text.point(&vertex, " ")?;
        text.push("\n")?;
    }
    Ok(())
}

/// Quadrangles, counterclockwise where columns run to the right and rows upwards.
fn faces(text: &mut Text, [rows, columns]: [usize; 2], first: usize) -> io::Result<()> {
    if rows == 1 || columns == 1 {
        text.push(if rows * columns == 1 { "p" } else { "l" })?;
        for k in 0..rows * columns {
            text.push(format!(" {}", first + k))?;
        }
        return text.push("\n");
    }
    for row in 0..rows - 1 {
        for a in (0..columns - 1).map(|column| first + row * columns + column) {
            text.push(format!("f {a} {} {} {}\n", a + 1, a + columns + 1, a + columns))?;
        }
    }
    Ok(())
}
