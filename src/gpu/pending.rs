//! [`Pending`]: a submission under way, and its results. Every failure becomes an [`Error`].

use std::borrow::Cow;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use bytemuck::Pod;
use rayon::prelude::*;

use super::context::Gpu;
use super::pool::Staging;
use crate::error::{Error, Result};
use crate::precision::{Precision, Reals};

/// How long the host waits for one submission.
///
/// Dispatches are far shorter. Only a hung driver takes longer. Software compiles a kernel during its
/// first dispatch: the largest takes 40 s.
const fn timeout(is_software: bool) -> Duration {
    Duration::from_secs(if is_software { 600 } else { 60 })
}

/// The fewest numbers that a thread converts.
pub(super) const CONVERTED_TOGETHER: usize = 1 << 14;

/// Bytes that the host is to read.
pub(super) struct Download {
    pub(super) staging: wgpu::Buffer,
    pub(super) size: u64,
}

/// A submission under way.
pub struct Pending<'g> {
    pub(super) gpu: &'g Gpu,
    pub(super) precision: Precision,
    pub(super) downloads: Vec<Download>,
    pub(super) mapped: Vec<mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>>,
    pub(super) index: wgpu::SubmissionIndex,
    pub(super) timestamps: Option<Download>,
}

impl<'g> Pending<'g> {
    pub(super) fn gpu(&self) -> &'g Gpu {
        self.gpu
    }

    pub(super) fn precision(&self) -> Precision {
        self.precision
    }

    /// Waits, and returns the downloads.
    ///
    /// # Errors
    /// [`Error::Timeout`] after a minute (ten on software), and [`Error::DeviceLost`].
    pub fn wait(self) -> Result<Vec<Downloaded>> {
        let limit = timeout(self.gpu.summary().is_software());
        let timeout = || Error::Timeout { seconds: limit.as_secs() };
        let wait = wgpu::PollType::Wait { submission_index: Some(self.index.clone()), timeout: Some(limit) };
        if self.gpu.device.poll(wait).is_err() {
            return Err(self.gpu.failure(timeout()));
        }
        for receiver in &self.mapped {
            let result = receiver.recv_timeout(limit).map_err(|_| timeout());
            let lost = |message: String| self.gpu.failure(Error::DeviceLost(message));
            result.map_err(|error| self.gpu.failure(error))?.map_err(|error| lost(error.to_string()))?;
        }
        let read = |Download { staging, size }: &Download| {
            let range = staging.slice(..size).get_mapped_range();
            range.map_err(|error| self.gpu.failure(Error::DeviceLost(error.to_string())))
        };
        if let Some(timestamps) = &self.timestamps {
            self.add_kernel_time(&read(timestamps)?);
        }
        let downloaded = |download: &Download| {
            let (device, pool) = (self.gpu.device.clone(), Arc::clone(&self.gpu.pool));
            let staging = Staging { buffer: download.staging.clone(), device, pool };
            Ok(Downloaded { bytes: read(download)?, precision: self.precision, _staging: staging })
        };
        self.downloads.iter().map(downloaded).collect()
    }

    fn add_kernel_time(&self, bytes: &[u8]) {
        let period = f64::from(self.gpu.queue.get_timestamp_period());
        let ticks = |pair: &[u8]| u64::from_le_bytes(pair.try_into().expect("eight bytes"));
        let spans = bytes.chunks_exact(wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT as usize);
        let total: u64 = spans.map(|span| ticks(&span[8..16]).saturating_sub(ticks(&span[..8]))).sum();
        *self.gpu.kernel_nanoseconds.lock().expect("no panic while held") += total as f64 * period;
    }
}

/// The contents of a buffer, mapped.
pub struct Downloaded {
    // The view is dropped before the memory that it shows.
    bytes: wgpu::BufferView,
    precision: Precision,
    _staging: Staging,
}

impl Downloaded {
    /// The contents as words, or as structs of words.
    pub fn as_slice<T: Pod>(&self) -> &[T] {
        bytemuck::cast_slice(&self.bytes)
    }

    /// The contents as numbers in the precision of the recording, converted as they are read.
    pub(crate) fn numbers(&self) -> Reals<'_> {
        match self.precision {
            Precision::F64 => Reals::F64(self.as_slice()),
            _ => Reals::F32(self.as_slice()),
        }
    }

    /// The contents as numbers in the precision of the recording.
    pub fn reals(&self) -> Cow<'_, [f64]> {
        match self.precision {
            Precision::F64 => self.as_slice().into(),
            _ => {
                let narrow = self.as_slice::<f32>().par_iter().with_min_len(CONVERTED_TOGETHER);
                narrow.map(|&x| f64::from(x)).collect::<Vec<f64>>().into()
            }
        }
    }
}
