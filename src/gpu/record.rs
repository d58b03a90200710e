//! [`Recording`]: one submission, buffers up and dispatches. Every failure becomes an [`Error`].

use std::ops::Range;
use std::sync::{Arc, mpsc};

use bytemuck::Pod;
use wgpu::{BufferUsages, ErrorFilter};

use super::capture::{CapturedBuffer, CapturedDispatch};
use super::context::{Gpu, Kernel, Traffic};
use super::key::KernelKey;
use super::pending::{Download, Pending};
use super::plan;
use super::pool::Buffer;
use super::reflect::{Access, Binding};
use crate::error::{Error, Result};
use crate::parallel::{self, Task};
use crate::precision::Precision;

/// Every array may be written and read by copies.
const COPIED: BufferUsages = BufferUsages::COPY_SRC.union(BufferUsages::COPY_DST);

/// Memory in which the host reads.
const READ: BufferUsages = BufferUsages::MAP_READ.union(BufferUsages::COPY_DST);

/// Memory in which the host writes. In the pool it is mapped.
const WRITE: BufferUsages = BufferUsages::MAP_WRITE.union(BufferUsages::COPY_SRC);

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
    /// The memory of uploads, until it is submitted.
    uploads: Vec<wgpu::Buffer>,
    downloads: Vec<Download>,
    timestamps: Vec<wgpu::QuerySet>,
    bytes: u64,
    traffic: Traffic,
}

/// The workgroups of a dispatch.
enum Workgroups<'b> {
    Number([u32; 3]),
    /// The numbers are in a buffer.
    Listed(&'b Buffer),
}

impl Gpu {
    /// Starts a submission whose kernels compute in this precision.
    #[doc(hidden)]
    pub fn record(&self, precision: Precision) -> Recording<'_> {
        let out_of_memory = self.device.push_error_scope(ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(ErrorFilter::Validation);
        let encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        Recording {
            gpu: self,
            precision,
            encoder,
            out_of_memory,
            validation,
            held: vec![],
            uploads: vec![],
            downloads: vec![],
            timestamps: vec![],
            bytes: 0,
            traffic: Traffic { submissions: 1, ..Traffic::default() },
        }
    }
}

impl<'g> Recording<'g> {
    /// Makes an array of some bytes that `write` writes, into mapped memory that the pool keeps. The
    /// device copies from there.
    fn create(&mut self, bytes: usize, usage: BufferUsages, write: impl FnOnce(&wgpu::Buffer)) -> Buffer {
        // A storage binding cannot be empty.
        let size = (bytes.max(16) as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let staging = self.gpu.pool.take(WRITE, size).unwrap_or_else(|| {
            let descriptor = wgpu::BufferDescriptor { label: None, size, usage: WRITE, mapped_at_creation: true };
            self.gpu.device.create_buffer(&descriptor)
        });
        if bytes == 0 {
            fill(&staging, 0..16, |room| room.slice(..).fill(0));
        }
        write(&staging);
        staging.unmap();
        let usage = usage | COPIED;
        let buffer = self.gpu.pool.take(usage, size).unwrap_or_else(|| self.fresh(size, usage));
        self.encoder.copy_buffer_to_buffer(&staging, 0, &buffer, 0, size);
        self.uploads.push(staging);
        self.traffic.up += size;
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
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.create(bytes.len(), BufferUsages::STORAGE, |room| copy(room, bytes))
    }

    /// Uploads numbers, each rounded once to the precision of the recording.
    pub fn upload_reals(&mut self, numbers: &[f64]) -> Buffer {
        let ends: Vec<usize> = (0..numbers.len()).step_by(parallel::TOGETHER).chain([numbers.len()]).collect();
        self.upload_parts(&ends, |k, to| to.copy_from_slice(&numbers[ends[k]..ends[k + 1]]))
    }

    /// Uploads numbers that all threads write part by part, each rounded once to the precision of
    /// the recording. Part k goes from `ends[k]` to `ends[k + 1]`, less `ends[0]`. `write` gets
    /// zeros.
    pub(crate) fn upload_parts(&mut self, ends: &[usize], write: impl Fn(usize, &mut [f64]) + Sync) -> Buffer {
        let (precision, count) = (self.precision, ends[ends.len() - 1] - ends[0]);
        self.create(count * precision.bytes() as usize, BufferUsages::STORAGE, |room| {
            let (parts, mut tasks) = (Parts { room, ends, precision, write: &write }, Vec::new());
            divide(&parts, 0..ends.len() - 1, &mut tasks);
            parallel::run(&mut tasks);
        })
    }

    /// A uniform with these contents.
    pub fn uniform<T: Pod>(&mut self, data: &T) -> Buffer {
        let bytes = bytemuck::bytes_of(data);
        self.create(bytes.len(), BufferUsages::UNIFORM, |room| copy(room, bytes))
    }

    /// Uploads words that kernels write before later dispatches read them: as a uniform, or as
    /// numbers of workgroups.
    pub(crate) fn upload_control<T: Pod>(&mut self, data: &T) -> Buffer {
        let bytes = bytemuck::bytes_of(data);
        let usage = BufferUsages::STORAGE | BufferUsages::UNIFORM | BufferUsages::INDIRECT;
        self.create(bytes.len(), usage, |room| copy(room, bytes))
    }

    /// Makes an array that kernels write, zero at first.
    pub fn storage(&mut self, bytes: u64) -> Buffer {
        let array = self.room(bytes);
        if !self.gpu.poisoned {
            self.encoder.clear_buffer(array.wgpu(), 0, Some(array.size()));
        }
        array
    }

    /// Makes an array of `count` numbers in the precision of the recording, of any value: kernels
    /// write them all before they read them.
    pub fn storage_reals(&mut self, count: usize) -> Buffer {
        self.room(count as u64 * self.precision.bytes())
    }

    fn room(&mut self, bytes: u64) -> Buffer {
        let size = bytes.next_multiple_of(4).max(16);
        if self.gpu.poisoned {
            // NaN in both precisions, and not a status word.
            return self.create(size as usize, BufferUsages::STORAGE, |room| {
                fill(room, 0..size, |room| room.slice(..).fill(0xff));
            });
        }
        let usage = BufferUsages::STORAGE | COPIED;
        let buffer = self.gpu.pool.take(usage, size).unwrap_or_else(|| self.fresh(size, usage));
        self.hold(buffer, size)
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
        let groups = plan::workgroups(tasks, per_group, self.gpu.limits())?;
        // The kernel is compiled for no tasks too, so that its errors do not depend on the curves.
        self.dispatch_groups(key, (tasks > 0).then_some(Workgroups::Number(groups)), buffers)
    }

    /// The same, with the numbers of workgroups that a kernel has written.
    ///
    /// # Errors
    /// As [`dispatch`](Self::dispatch).
    pub(crate) fn dispatch_listed(
        &mut self,
        key: &KernelKey,
        groups: &Buffer,
        buffers: &[(&str, &Buffer)],
    ) -> Result<()> {
        self.held.push(groups.clone());
        self.dispatch_groups(key, Some(Workgroups::Listed(groups)), buffers)
    }

    fn dispatch_groups(
        &mut self,
        key: &KernelKey,
        groups: Option<Workgroups<'_>>,
        buffers: &[(&str, &Buffer)],
    ) -> Result<()> {
        debug_assert_eq!(key.precision, self.precision, "{}", key.name());
        let kernel = &*self.gpu.kernel(key)?;
        let Some(groups) = groups else { return Ok(()) };
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

    /// The contents of buffers after the dispatches recorded so far.
    fn contents<'b>(&mut self, buffers: impl Iterator<Item = &'b Buffer>) -> Result<Vec<Vec<u8>>> {
        self.flush();
        let mut reading = self.gpu.record(Precision::F32);
        buffers.for_each(|buffer| reading.download(buffer));
        Ok(reading.submit()?.wait()?.iter().map(|bytes| bytes.as_slice::<u8>().to_vec()).collect())
    }

    /// A dispatch on its own, with its buffers before and after.
    fn dispatch_captured(
        &mut self,
        kernel: &Kernel,
        groups: Workgroups<'_>,
        bound: &[(&Binding, &Buffer)],
    ) -> Result<()> {
        let gpu = self.gpu();
        let groups = match groups {
            Workgroups::Number(groups) => groups,
            Workgroups::Listed(buffer) => {
                let words: Vec<u32> = bytemuck::pod_collect_to_vec(&self.contents([buffer].into_iter())?[0]);
                [words[0], words[1], words[2]]
            }
        };
        let arrays = || bound.iter().map(|(_, buffer)| *buffer);
        let before = self.contents(arrays())?;
        let entries: Vec<_> = bound.iter().map(|(binding, buffer)| buffer.entry(binding.binding)).collect();
        self.encode(kernel, Workgroups::Number(groups), &entries);
        let after = self.contents(arrays())?;
        let buffers = bound.iter().zip(before).zip(after).map(|(((binding, _), before), after)| CapturedBuffer {
            binding: binding.binding,
            name: binding.name.clone(),
            access: binding.access,
            before,
            after: is_written(binding.access).then_some(after),
        });
        let dispatch = CapturedDispatch {
            kernel: kernel.name.clone(),
            wgsl: kernel.wgsl.clone(),
            entry: kernel.entry.to_string(),
            groups,
            buffers: buffers.collect(),
        };
        if let Some(captured) = &mut *gpu.capture.lock().expect("no panic while held") {
            captured.push(dispatch);
        }
        Ok(())
    }

    pub(crate) fn gpu(&self) -> &'g Gpu {
        self.gpu
    }

    /// The precision that the recording's kernels compute in.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    fn encode(&mut self, kernel: &Kernel, groups: Workgroups<'_>, entries: &[wgpu::BindGroupEntry<'_>]) {
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
        match groups {
            Workgroups::Number([x, y, z]) => pass.dispatch_workgroups(x, y, z),
            Workgroups::Listed(buffer) => pass.dispatch_workgroups_indirect(buffer.wgpu(), 0),
        }
        drop(pass);
        self.timestamps.extend(times);
        self.traffic.dispatches += 1;
    }

    /// Submits the work recorded so far, so that another submission can read its results.
    fn flush(&mut self) {
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
        self.traffic.down += size;
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
        self.gpu.traffic.lock().expect("no panic while held").add(self.traffic);
        for staging in self.uploads {
            let (pool, kept) = (Arc::clone(&self.gpu.pool), staging.clone());
            staging.map_async(wgpu::MapMode::Write, .., move |mapped| {
                if mapped.is_ok() {
                    pool.keep(kept);
                }
            });
        }
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

/// Writes a range of mapped memory.
///
/// On a device that is lost or out of memory there is nothing to write. The scopes report that when
/// the work is submitted.
fn fill(room: &wgpu::Buffer, range: Range<u64>, write: impl FnOnce(&mut wgpu::BufferViewMut)) {
    if !range.is_empty()
        && let Ok(mut mapped) = room.get_mapped_range_mut(range)
    {
        write(&mut mapped);
    }
}

fn copy(room: &wgpu::Buffer, bytes: &[u8]) {
    let whole = (bytes.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
    fill(room, 0..whole, |room| room.slice(..bytes.len()).copy_from_slice(bytes));
}

/// Numbers that are written part by part.
struct Parts<'a> {
    room: &'a wgpu::Buffer,
    ends: &'a [usize],
    precision: Precision,
    write: &'a (dyn Fn(usize, &mut [f64]) + Sync),
}

/// Makes the tasks that write some parts.
fn divide<'a>(parts: &'a Parts<'a>, own: Range<usize>, tasks: &mut Vec<Task<'a>>) {
    let bytes = parts.precision.bytes();
    let at = move |k: usize| (parts.ends[k] - parts.ends[0]) as u64 * bytes;
    let first = parts.ends[own.start];
    let count = parts.ends[own.end] - first;
    // Mapped ranges begin at multiples of 8 bytes.
    let middle = (own.start + own.len() / 2..own.end).find(|&k| k > own.start && at(k) % wgpu::MAP_ALIGNMENT == 0);
    if let (true, Some(middle)) = (count > parallel::TOGETHER, middle) {
        divide(parts, own.start..middle, tasks);
        divide(parts, middle..own.end, tasks);
        return;
    }
    tasks.push(Box::new(move || {
        let mut numbers = vec![0.0; count];
        for k in own.clone() {
            (parts.write)(k, &mut numbers[parts.ends[k] - first..parts.ends[k + 1] - first]);
        }
        fill(parts.room, at(own.start)..at(own.end), |room| match parts.precision {
            Precision::F64 => room.copy_from_slice(bytemuck::cast_slice(&numbers)),
            _ => {
                let rounded: Vec<f32> = numbers.iter().map(|&x| x as f32).collect();
                room.copy_from_slice(bytemuck::cast_slice(&rounded));
            }
        });
    }));
}

/// Whether a kernel may change a buffer with this access.
fn is_written(access: Access) -> bool {
    access == Access::ReadWrite
}
