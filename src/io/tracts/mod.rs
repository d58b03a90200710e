//! Tracts: streamlines through the white matter of a brain, as TrackVis and MRtrix keep them.
//!
//! Coordinates are millimetres, x to the right, y to the front, z up (RAS+), as nibabel gives them.

mod space;
pub(super) mod tck;
pub(super) mod trk;

use super::source::Source;
use super::{ReadOptions, close_as_marked};
use crate::batch::CurveBatch;
use crate::error::{Error, Result};

/// Metres in a unit of streamlines.
const MILLIMETRE: f64 = 1e-3;

/// Streamlines are open, unless all curves are to be closed.
fn as_streamlines(batch: CurveBatch, options: &ReadOptions) -> Result<CurveBatch> {
    close_as_marked(batch, options.closed, vec![])
}

/// The points of a curve as a streamline. A closed one repeats its first.
fn streamline(batch: &CurveBatch, i: usize) -> impl Iterator<Item = usize> {
    let count = batch.count(i);
    (0..count).chain((batch.is_closed(i) && count > 0).then_some(0))
}

/// Numbers of a file, from its bytes.
struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

/// Bytes that a file lacks.
struct CutOff;

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], CutOff> {
        let mut bytes: [u8; N] =
            self.bytes.get(self.at..self.at + N).and_then(|bytes| bytes.try_into().ok()).ok_or(CutOff)?;
        self.at += N;
        if self.is_big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn i16(&mut self) -> Result<i16, CutOff> {
        self.take().map(i16::from_le_bytes)
    }

    fn i32(&mut self) -> Result<i32, CutOff> {
        self.take().map(i32::from_le_bytes)
    }

    fn f32(&mut self) -> Result<f64, CutOff> {
        self.take().map(|bytes| f64::from(f32::from_le_bytes(bytes)))
    }

    fn f64(&mut self) -> Result<f64, CutOff> {
        self.take().map(f64::from_le_bytes)
    }

    fn is_at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }
}

/// The error that a file ends inside a streamline.
fn cut_off(source: &Source, streamline: usize) -> Error {
    source
        .error(None, format!("it ends within streamline {streamline}, counted from 0: it was cut off, fetch it again"))
}
