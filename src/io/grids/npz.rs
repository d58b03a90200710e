//! NPZ: `grids` if all grids have one shape, else `grids_0`, `grids_1`, ….

use std::io::{self, Cursor, Write};

use super::super::npy::numbers;
use super::super::npz::{Archive, Place, arrays, tuple, zip_into};
use super::super::source::Source;
use crate::error::Result;
use crate::grids::Grids;
use crate::sort;

/// The name of the array if all grids have one shape, else the prefix before the number of a grid.
const KEY: &str = "grids";

/// Reads an archive.
pub(super) fn read(source: &mut Source) -> Result<Grids> {
    let mut archive = Archive::open(source)?;
    let mut keys = archive.keys();
    if keys == [KEY] {
        return one_shape(&mut archive);
    }
    // In order of their numbers: grids_10 comes after grids_9.
    sort::by(&mut keys, |a, b| (a.len(), a).cmp(&(b.len(), b)));
    if keys.is_empty() || (0..keys.len()).any(|k| keys[k] != format!("{KEY}_{k}")) {
        return Err(archive.wrong(format!(
            "the arrays are {}: wanted is {KEY} of the shape (B, rows, columns) or (B, rows, columns, d), or, for grids of several \
             shapes, {KEY}_0, {KEY}_1 and so on, of (rows, columns) or (rows, columns, d)",
            arrays(&keys)
        )));
    }
    several_shapes(&mut archive, &keys)
}

fn one_shape(archive: &mut Archive) -> Result<Grids> {
    let array = archive.array(KEY, numbers)?.expect("its key was found");
    let (number, rows, columns, dimension) = match array.shape[..] {
        [rows, columns] => (1, rows, columns, 1),
        [number, rows, columns] => (number, rows, columns, 1),
        [number, rows, columns, dimension] => (number, rows, columns, dimension),
        _ => {
            return Err(archive.wrong(format!(
                "array {KEY} has the shape {}: it must be (B, rows, columns) or (B, rows, columns, d), or (rows, columns) for a single grid",
                tuple(&array.shape)
            )));
        }
    };
    if [number, rows, columns, dimension].contains(&0) {
        return Err(archive.wrong(format!(
            "array {KEY} has the shape {} and holds no point: there is nothing to read",
            tuple(&array.shape)
        )));
    }
    Grids::uniform(dimension as usize, [rows as usize, columns as usize], array.into_rows())
}

fn several_shapes(archive: &mut Archive, keys: &[String]) -> Result<Grids> {
    let (mut dimension, mut shapes, mut values) = (None, Vec::new(), Vec::new());
    for key in keys {
        let array = archive.array(key, numbers)?.expect("its key was found");
        let (rows, columns, d) = match array.shape[..] {
            [rows, columns] => (rows, columns, 1),
            [rows, columns, d] if d > 0 => (rows, columns, d),
            _ => {
                return Err(archive.wrong(format!(
                    "array {key} has the shape {}: it must be (rows, columns) or (rows, columns, d)",
                    tuple(&array.shape)
                )));
            }
        };
        match dimension.replace(d) {
            Some(first) if first != d => {
                return Err(archive.wrong(format!(
                    "array {key} has the shape {}, {d} values a point, but {KEY}_0 has {first}: grids of one file have equally many",
                    tuple(&array.shape)
                )));
            }
            _ => {}
        }
        shapes.push([rows as usize, columns as usize]);
        archive.grow(&mut values, array.values.len())?;
        values.extend(array.into_rows());
    }
    Grids::new(dimension.unwrap_or(1) as usize, shapes, values)
}

/// Writes an archive through memory, to an output that cannot seek.
pub(super) fn write(out: &mut dyn Write, grids: &Grids) -> io::Result<()> {
    let mut bytes = Cursor::new(Vec::new());
    write_seekable(&mut bytes, grids)?;
    out.write_all(bytes.get_ref())
}

/// Writes an archive. Equal grids give equal bytes.
pub(super) fn write_seekable(out: &mut dyn Place, grids: &Grids) -> io::Result<()> {
    let mut zip = zip_into(out);
    let d = grids.dimension() as u64;
    let shape = |i: usize| -> Vec<u64> {
        let rows_and_columns = grids.shape(i).into_iter().map(|length| length as u64);
        rows_and_columns.chain((d > 1).then_some(d)).collect()
    };
    if grids.shapes().windows(2).all(|pair| pair[0] == pair[1]) && grids.total_points() > 0 {
        let shape: Vec<u64> = [grids.len() as u64].into_iter().chain(shape(0)).collect();
        zip.floats(KEY, &shape, grids.values().iter().copied())?;
    } else {
        for i in 0..grids.len() {
            zip.floats(&format!("{KEY}_{i}"), &shape(i), grids.grid(i).iter().copied())?;
        }
    }
    zip.finish()
}
