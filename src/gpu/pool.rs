//! [`Pool`]: memory of a device that is kept for the next submission.
//!
//! New memory costs more than the work on it: the driver finds and clears it, and the system maps it
//! page by page. A fit of the same kind as the last one finds all its memory here.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use wgpu::BufferUsages;

/// A kept buffer serves arrays from half its size on.
const LOOSEST: u64 = 2;

pub(super) struct Pool {
    /// The most bytes that are kept: the arrays of two chunks, and their way there and back.
    most: u64,
    /// Buffers that nothing uses, the one kept first at the front.
    kept: Mutex<Vec<wgpu::Buffer>>,
    /// How often no kept buffer was of fitting size.
    missed: AtomicUsize,
}

impl Pool {
    /// An empty pool that keeps at most this many bytes.
    pub fn new(most: u64) -> Self {
        Pool { most, kept: Mutex::default(), missed: AtomicUsize::new(0) }
    }

    /// The smallest kept buffer of this usage that fits a size, if there is one.
    pub fn take(&self, usage: BufferUsages, size: u64) -> Option<wgpu::Buffer> {
        let mut kept = self.kept.lock().expect("no panic while held");
        let fits = |buffer: &wgpu::Buffer| buffer.usage() == usage && (size..=LOOSEST * size).contains(&buffer.size());
        let best = (0..kept.len()).filter(|&k| fits(&kept[k])).min_by_key(|&k| kept[k].size());
        if best.is_none() {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
        best.map(|k| kept.remove(k))
    }

    /// Keeps a buffer that no unsubmitted work uses, and drops the buffers that were kept longest.
    pub fn keep(&self, buffer: wgpu::Buffer) {
        let mut kept = self.kept.lock().expect("no panic while held");
        kept.push(buffer);
        let mut bytes: u64 = kept.iter().map(wgpu::Buffer::size).sum();
        while bytes > self.most {
            bytes -= kept.remove(0).size();
        }
    }

    /// How often memory was allocated.
    pub fn missed(&self) -> usize {
        self.missed.load(Ordering::Relaxed)
    }

    /// Gives all memory back to the device.
    pub fn clear(&self) {
        self.kept.lock().expect("no panic while held").clear();
    }
}

/// An array on the device.
///
/// Its memory returns to the pool when nothing holds it any more. Recordings hold their arrays until
/// they are submitted. Later submissions wait for earlier ones on the device.
#[derive(Clone)]
pub struct Buffer(Arc<Held>);

struct Held {
    buffer: wgpu::Buffer,
    size: u64,
    pool: Arc<Pool>,
}

impl Drop for Held {
    fn drop(&mut self) {
        self.pool.keep(self.buffer.clone());
    }
}

impl Buffer {
    /// An array at the start of a buffer.
    pub(super) fn new(buffer: wgpu::Buffer, size: u64, pool: &Arc<Pool>) -> Self {
        Buffer(Arc::new(Held { buffer, size, pool: Arc::clone(pool) }))
    }

    /// Bytes of the array.
    pub fn size(&self) -> u64 {
        self.0.size
    }

    pub(super) fn wgpu(&self) -> &wgpu::Buffer {
        &self.0.buffer
    }

    pub(super) fn entry(&self, binding: u32) -> wgpu::BindGroupEntry<'_> {
        let size = wgpu::BufferSize::new(self.0.size);
        let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &self.0.buffer, offset: 0, size });
        wgpu::BindGroupEntry { binding, resource }
    }
}

/// Memory in which the host reads a result. It is mapped until it returns to the pool.
pub(super) struct Staging {
    pub buffer: wgpu::Buffer,
    pub device: wgpu::Device,
    pub pool: Arc<Pool>,
}

impl Drop for Staging {
    fn drop(&mut self) {
        // The device may have been lost since.
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        self.buffer.unmap();
        if pollster::block_on(scope.pop()).is_none() {
            self.pool.keep(self.buffer.clone());
        }
    }
}
