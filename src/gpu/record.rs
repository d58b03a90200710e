//! One submission: buffers up, dispatches, results back. Every failure becomes an [`Error`].

use std::borrow::Cow;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use bytemuck::Pod;
use rayon::prelude::*;
use wgpu::{BufferUsages, ErrorFilter};

use super::context::Gpu;
use super::kernel::Kernel;
use super::key::KernelKey;
use super::plan;
use super::pool::{Buffer, Staging};
use super::reflect::Access;
use crate::error::{Error, Result};
use crate::precision::Precision;

/// How long the host waits for one submission.
///
/// Dispatches are far shorter. Only a hung driver takes longer. Software compiles a kernel during its
/// first dispatch: the largest takes 40 s.
const fn timeout(is_software: bool) -> Duration {
    Duration::from_secs(if is_software { 600 } else { 60 })
}

/// Every array may be written and read by copies.
const COPIED: BufferUsages = BufferUsages::COPY_SRC.union(BufferUsages::COPY_DST);

/// Memory in which the host reads.
const READ: BufferUsages = BufferUsages::MAP_READ.union(BufferUsages::COPY_DST);

/// The fewest numbers that a thread converts.
const CONVERTED_TOGETHER: usize = 1 << 14;

/// Work being recorded for one submission.
///
/// The host's numbers are f64. The kernels' numbers have the precision of the recording.
pub struct Recording<'g> {
    gpu: &'g Gpu,
    precision: Precision,
    encoder: wgpu::CommandEncoder,
    // Scopes close in the order opposite to their opening, and fields drop in the order written.
    validation: wgpu::ErrorScopeGuard,
    out_of_memory: wgpu::ErrorScopeGuard,
    /// The buffers of the work, until it is submitted.
    held: Vec<Buffer>,
    downloads: Vec<Download>,
    timestamps: Vec<wgpu::QuerySet>,
    bytes: u64,
}

/// Bytes that the host is to read.
struct Download {
    staging: wgpu::Buffer,
    size: u64,
}

/// A submission under way.
pub struct Pending<'g> {
    gpu: &'g Gpu,
    precision: Precision,
    downloads: Vec<Download>,
    mapped: Vec<mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>>,
    index: wgpu::SubmissionIndex,
    timestamps: Option<Download>,
}

impl Gpu {
    /// Starts a submission whose kernels compute in this precision.
    #[doc(hidden)]
    pub fn record(&self, precision: Precision) -> Recording<'_> {
        let out_of_memory = self.device.push_error_scope(ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(ErrorFilter::Validation);
        let encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (held, downloads, timestamps) = (vec![], vec![], vec![]);
        Recording { gpu: self, precision, encoder, out_of_memory, validation, held, downloads, timestamps, bytes: 0 }
    }
}

impl<'g> Recording<'g> {
    fn create(&mut self, contents: &[u8], usage: BufferUsages) -> Buffer {
        // A storage binding cannot be empty.
        let contents = if contents.is_empty() { &[0; 16] } else { contents };
        let size = (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let usage = usage | COPIED;
        // On a device that is lost or out of memory there is nothing to fill. The scopes report
        // that when the work is submitted.
        let buffer = match self.gpu.pool.take(usage, size) {
            Some(kept) => {
                let all = wgpu::BufferSize::new(size).expect("an array has a size");
                if let Some(mut written) = self.gpu.queue.write_buffer_with(&kept, 0, all) {
                    written.slice(..contents.len()).copy_from_slice(contents);
                }
                kept
            }
            None => {
                let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: true };
                let fresh = self.gpu.device.create_buffer(&descriptor);
                if let Ok(mut mapped) = fresh.get_mapped_range_mut(..) {
                    mapped.slice(..contents.len()).copy_from_slice(contents);
                    drop(mapped);
                    fresh.unmap();
                }
                fresh
            }
        };
        self.hold(buffer, size)
    }

    /// An array of this recording.
    fn hold(&mut self, buffer: wgpu::Buffer, size: u64) -> Buffer {
        self.bytes += size;
        let array = Buffer::new(buffer, size, &self.gpu.pool);
        self.held.push(array.clone());
        array
    }

    fn fresh(&self, size: u64, usage: BufferUsages) -> wgpu::Buffer {
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        self.gpu.device.create_buffer(&descriptor)
    }

    /// Uploads an array with these contents, for kernels to read (or to read and write).
    pub fn upload<T: Pod>(&mut self, data: &[T]) -> Buffer {
        self.create(bytemuck::cast_slice(data), BufferUsages::STORAGE)
    }

    /// Uploads numbers, each rounded once to the precision of the recording.
    pub fn upload_reals(&mut self, numbers: &[f64]) -> Buffer {
        match self.precision {
            Precision::F64 => self.upload(numbers),
            _ => {
                let rounded = numbers.par_iter().with_min_len(CONVERTED_TOGETHER).map(|&x| x as f32);
                self.upload(&rounded.collect::<Vec<f32>>())
            }
        }
    }

    /// A uniform with these contents.
    pub fn uniform<T: Pod>(&mut self, data: &T) -> Buffer {
        self.create(bytemuck::bytes_of(data), BufferUsages::UNIFORM)
    }

    /// Makes an array that kernels write, zero at first.
    pub fn storage(&mut self, bytes: u64) -> Buffer {
        let size = bytes.next_multiple_of(4).max(16);
        if self.gpu.poisoned {
            // NaN in both precisions, and not a status word.
            return self.create(&vec![0xff; size as usize], BufferUsages::STORAGE);
        }
        let usage = BufferUsages::STORAGE | COPIED;
        let buffer = match self.gpu.pool.take(usage, size) {
            Some(kept) => {
                self.encoder.clear_buffer(&kept, 0, Some(size));
                kept
            }
            None => self.fresh(size, usage),
        };
        self.hold(buffer, size)
    }

    /// Makes an array of `count` numbers in the precision of the recording.
    pub fn storage_reals(&mut self, count: usize) -> Buffer {
        self.storage(count as u64 * self.precision.bytes())
    }

    /// Dispatches a kernel, with its buffers by name.
    ///
    /// A workgroup has `per_group` of the tasks.
    ///
    /// # Errors
    /// - Errors of [`Gpu::kernel`] and of [`plan::workgroups`].
    /// - [`Error::Kernel`] if a buffer that the kernel uses is not named, or is too small for one
    ///   element.
    pub fn dispatch(
        &mut self,
        key: &KernelKey,
        tasks: usize,
        per_group: usize,
        buffers: &[(&str, &Buffer)],
    ) -> Result<()> {
        debug_assert_eq!(key.precision, self.precision, "{}", key.name());
        let kernel = &*self.gpu.kernel(key)?;
        let groups = plan::workgroups(tasks, per_group, self.gpu.limits())?;
        if tasks == 0 {
            return Ok(());
        }
        let mut bound = Vec::with_capacity(kernel.reflection.bindings.len());
        for binding in &kernel.reflection.bindings {
            let found = buffers.iter().find(|(name, _)| *name == binding.name).map(|(_, buffer)| *buffer);
            let fits = found.filter(|buffer| buffer.size() >= u64::from(binding.element_bytes));
            let buffer = fits.ok_or_else(|| Error::Kernel {
                kernel: kernel.name.clone(),
                message: format!("buffer {} is missing or smaller than {} bytes", binding.name, binding.element_bytes),
            })?;
            self.held.push(buffer.clone());
            bound.push((binding, buffer));
        }
        if self.gpu.capture.lock().expect("no panic while held").is_some() {
            return self.dispatch_captured(kernel, groups, &bound);
        }
        let entries: Vec<_> = bound.iter().map(|(b, buffer)| buffer.entry(b.binding)).collect();
        self.encode(kernel, groups, &entries);
        Ok(())
    }

    pub(crate) fn gpu(&self) -> &'g Gpu {
        self.gpu
    }

    /// The precision that the recording's kernels compute in.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    pub(super) fn encode(&mut self, kernel: &Kernel, groups: [u32; 3], entries: &[wgpu::BindGroupEntry<'_>]) {
        let device = &self.gpu.device;
        let layout = &kernel.pipeline.get_bind_group_layout(0);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries });
        let times = self.gpu.summary().has_timestamps.then(|| {
            device.create_query_set(&wgpu::QuerySetDescriptor { label: None, ty: wgpu::QueryType::Timestamp, count: 2 })
        });
        let timestamp_writes = times.as_ref().map(|query_set| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        });
        let descriptor = wgpu::ComputePassDescriptor { label: Some(&kernel.name), timestamp_writes };
        let mut pass = self.encoder.begin_compute_pass(&descriptor);
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
        drop(pass);
        self.timestamps.extend(times);
    }

    /// Submits the work recorded so far, so that another submission can read its results.
    pub(super) fn flush(&mut self) {
        let fresh = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let recorded = std::mem::replace(&mut self.encoder, fresh);
        self.gpu.queue.submit([recorded.finish()]);
    }

    /// Downloads a buffer after the dispatches recorded so far.
    ///
    /// Results come in the order of the calls.
    pub fn download(&mut self, buffer: &Buffer) {
        let size = buffer.size();
        self.bytes += size;
        let staging = self.gpu.pool.take(READ, size).unwrap_or_else(|| self.fresh(size, READ));
        self.encoder.copy_buffer_to_buffer(buffer.wgpu(), 0, &staging, 0, size);
        self.held.push(buffer.clone());
        self.downloads.push(Download { staging, size });
    }

    /// Submits. The work goes on while the host prepares the next.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`], or [`Error::Kernel`] for what wgpu's
    /// validation refuses.
    pub fn submit(mut self) -> Result<Pending<'g>> {
        let timestamps = self.resolve_timestamps();
        let index = self.gpu.queue.submit([self.encoder.finish()]);
        // Within the scopes, since on a lost device there is nothing to map.
        let mapped: Vec<_> = self
            .downloads
            .iter()
            .chain(&timestamps)
            .map(|Download { staging, .. }| {
                let (sender, receiver) = mpsc::channel();
                // The receiver is gone only if nobody waits any more.
                staging.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
                receiver
            })
            .collect();
        let validation = pollster::block_on(self.validation.pop());
        let out_of_memory = pollster::block_on(self.out_of_memory.pop());
        if out_of_memory.is_some() {
            self.gpu.pool.clear();
            return Err(self.gpu.failure(Error::OutOfMemory { chunk_bytes: self.bytes }));
        }
        if let Some(error) = validation {
            let kernel = "submission".to_string();
            return Err(self.gpu.failure(Error::Kernel { kernel, message: error.to_string() }));
        }
        let Recording { gpu, precision, downloads, .. } = self;
        Ok(Pending { gpu, precision, mapped, downloads, index, timestamps })
    }

    fn resolve_timestamps(&mut self) -> Option<Download> {
        if self.timestamps.is_empty() {
            return None;
        }
        // Query results must land at multiples of this many bytes.
        let stride = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;
        let size = stride * self.timestamps.len() as u64;
        let resolved = self.fresh(size, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC);
        let staging = self.fresh(size, READ);
        for (k, times) in self.timestamps.iter().enumerate() {
            self.encoder.resolve_query_set(times, 0..2, &resolved, k as u64 * stride);
        }
        self.encoder.copy_buffer_to_buffer(&resolved, 0, &staging, 0, size);
        Some(Download { staging, size })
    }
}

/// Whether a kernel may change a buffer with this access.
pub(super) fn is_written(access: Access) -> bool {
    access == Access::ReadWrite
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
