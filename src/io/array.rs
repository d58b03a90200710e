//! NPY: one array of NumPy, curves of one length.

use std::io::{self, Cursor, Read, Write};
use std::sync::Arc;

use super::entry::Entry;
use super::npy::{self, Array, Elements, Header, numbers};
use super::npz::tuple;
use super::source::Source;
use super::{ReadOptions, WriteOptions, close};
use crate::batch::CurveBatch;
use crate::error::{Error, Result, shortened};
use crate::status::CurveStatus;

pub(super) const ENTRY: Entry = Entry {
    reads: "an array of NumPy, (B, n, d) for B curves, (n, d) for one; d is 2 or 3",
    writes: "(B, n, d), of curves with n points each",
    lacks: "the array has no curve",
    beziers: true,
    ..Entry::new("npy", "NPY", read, |out, batch, options, _| write(out, batch, options))
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
    let values = numbers(elements, &source.room).map_err(damaged)?.ok_or_else(of_type)?;
    let coords = Array { shape: header.shape, order: header.order, values }.into_rows();
    // Of curves without points the shape alone says how many there are.
    source.take(curves.saturating_mul(std::mem::size_of::<usize>()))?;
    let offsets = (0..=curves).map(|i| i * length).collect();
    let batch = CurveBatch::from_file(d, coords, offsets, Arc::new(source.origin()))?;
    close(batch, options.closed, &[], &[])
}

/// The number of rows of every curve.
///
/// # Errors
/// Curves of several lengths, but for those that are not usable.
pub(super) fn length(batch: &CurveBatch, statuses: &[CurveStatus]) -> Result<usize> {
    let is_fitted = |i: usize| batch.problem(i).is_none() && !is_point(batch, i);
    let usable = |i: &usize| is_fitted(*i) && statuses.get(*i).is_none_or(|status| status.is_usable());
    match common((0..batch.len()).filter(usable).map(|i| rows(batch, i)))? {
        Some(length) => Ok(length),
        None => Ok((0..batch.len()).map(|i| rows(batch, i)).max().unwrap_or(0)),
    }
}

/// The length that all have, if there are any.
pub(super) fn common(lengths: impl Iterator<Item = usize>) -> Result<Option<usize>> {
    let ends = lengths.fold(None, |ends: Option<(usize, usize)>, n| {
        Some(ends.map_or((n, n), |(least, most)| (least.min(n), most.max(n))))
    });
    match ends {
        Some((least, most)) if least < most => Err(Error::Argument(format!(
            "NPY holds curves of one length, and these have {least} to {most} points (closed ones repeat their first): write NPZ, or sample each at as many points"
        ))),
        ends => Ok(ends.map(|(length, _)| length)),
    }
}

/// The rows of curve `i`. A closed curve repeats its first point.
fn rows(batch: &CurveBatch, i: usize) -> usize {
    batch.count(i) + usize::from(batch.is_closed(i) && batch.count(i) > 0)
}

/// Whether a curve is one point, once or repeated.
pub(crate) fn is_point(batch: &CurveBatch, i: usize) -> bool {
    let mut points = batch.points(i).chunks_exact(batch.dimension());
    points.next().is_none_or(|first| points.all(|point| point == first))
}

/// Writes (B, n, d). Curves that are not usable and have another length are NaN, but for single
/// points, which are repeated.
fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let (d, length) = (batch.dimension(), length(batch, &options.statuses).map_err(io::Error::other)?);
    let points = (0..batch.len()).flat_map(|i| {
        let fits = (rows(batch, i) == length || is_point(batch, i)) && batch.count(i) > 0;
        let own = if fits { batch.points(i) } else { &[f64::NAN] };
        own.iter().cycle().take(length * d)
    });
    npy::write(out, "<f8", &[batch.len() as u64, length as u64, d as u64], points.map(|x| x.to_le_bytes()))
}
