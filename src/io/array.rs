//! NPY: one array of NumPy, curves of one length.

use std::io::{self, Cursor, Read, Write};
use std::sync::Arc;

use super::formats::Entry;
use super::npy::{self, Elements, Header, Order, numbers};
use super::npz::tuple;
use super::source::Source;
use super::{ReadOptions, close};
use crate::batch::{CurveBatch, Origin};
use crate::error::{Error, Result, shortened};

pub(super) const ENTRY: Entry = Entry {
    word: "npy",
    extensions: &[],
    title: "NPY",
    reads: "an array of NumPy, (B, n, d) for B curves, (n, d) for one; d is 2 or 3",
    writes: "(B, n, d), of curves with n points each",
    lacks: "the array has no curve",
    dimensions: 2..=3,
    beziers: true,
    columns: false,
    parameters: false,
    read,
    write: |out, batch, _, _| write(out, batch),
    write_file: None,
    check,
};

fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let bytes = source.bytes()?;
    let wrong = |what: String| source.error(None, format!("{what}: write it with numpy.save"));
    let damaged =
        |error: io::Error| wrong(format!("the array is damaged or cut off ({})", shortened(&error.to_string())));
    let mut reader = Cursor::new(&bytes[..]);
    let header = Header::read(&mut reader).map_err(damaged)?;
    let of_type = || wrong(format!("the array has the type {}, and must hold numbers", shortened(&header.descr)));
    let kind = header.kind().ok_or_else(of_type)?;
    let (curves, length, d) = match header.shape[..] {
        [n, d @ (2 | 3)] => (1, n as usize, d as usize),
        [curves, n, d @ (2 | 3)] => (curves as usize, n as usize, d as usize),
        _ => {
            let shape = tuple(&header.shape);
            return Err(wrong(format!(
                "the array has the shape {shape}, and must be (B, n, 2), (B, n, 3), (n, 2) or (n, 3)"
            )));
        }
    };
    let element_bytes = kind.bytes().unwrap_or(usize::MAX).max(1) as u64;
    let stored = bytes.len() as u64 - reader.position();
    let fits = |count: &u64| count.checked_mul(element_bytes) == Some(stored);
    let Some(count) = header.count().filter(fits) else {
        return Err(wrong(format!("the array has the shape {}, but holds {stored} bytes", tuple(&header.shape))));
    };
    let elements = Elements { kind, count, reader: &mut reader as &mut dyn Read };
    let mut coords = numbers(elements, &source.room).map_err(damaged)?.ok_or_else(of_type)?;
    if header.order == Order::Fortran {
        // The first axis runs fastest.
        let place = |at: usize| at / (length * d) + curves * (at / d % length + length * (at % d));
        coords = (0..coords.len()).map(|at| coords[place(at)]).collect();
    }
    // Of curves without points the shape alone says how many there are.
    source.take(curves.saturating_mul(std::mem::size_of::<usize>()))?;
    let offsets = (0..=curves).map(|i| i * length).collect();
    let origin = Origin { file: Some(source.path.display().to_string()), ..Origin::default() };
    let batch = CurveBatch::from_file(d, coords, offsets, Arc::new(origin))?;
    let marked = vec![false; batch.len()];
    close(batch, options.closed, &marked, &[])
}

/// Refuses curves of several lengths.
fn check(batch: &CurveBatch) -> Result<()> {
    let rows = |i: usize| batch.count(i) + usize::from(batch.is_closed(i));
    let (least, most) = (0..batch.len()).map(rows).fold((usize::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
    if least < most {
        return Err(Error::Argument(format!(
            "NPY holds curves of one length, and these have {least} to {most} points: write NPZ, or sample each at as many points"
        )));
    }
    Ok(())
}

/// Writes (B, n, d). A closed curve repeats its first point.
fn write(out: &mut dyn Write, batch: &CurveBatch) -> io::Result<()> {
    let d = batch.dimension();
    let rows = |i: usize| batch.count(i) + usize::from(batch.is_closed(i) && batch.count(i) > 0);
    let length = if batch.is_empty() { 0 } else { rows(0) };
    let points = (0..batch.len()).flat_map(|i| batch.points(i).iter().cycle().take(rows(i) * d));
    npy::write(out, "<f8", &[batch.len() as u64, length as u64, d as u64], points.copied())
}
