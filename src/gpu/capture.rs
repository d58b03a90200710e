//! Recording of dispatches with their buffers, so that another WGSL compiler can replay any kernel.

use super::context::Gpu;
use super::kernel::Kernel;
use super::pool::Buffer;
use super::record::{Recording, is_written};
use super::reflect::{Access, Binding};
use crate::error::Result;
use crate::precision::Precision;

/// One buffer of a captured dispatch.
#[derive(Clone, Debug)]
pub struct CapturedBuffer {
    /// Its `@binding` in group 0.
    pub binding: u32,
    /// Its name in the source.
    pub name: String,
    /// How the kernel uses it.
    pub access: Access,
    /// Its contents before the dispatch.
    pub before: Vec<u8>,
    /// Its contents after the dispatch, if the kernel may have written it.
    pub after: Option<Vec<u8>>,
}

/// One dispatch, with everything needed to run it again elsewhere.
#[derive(Clone, Debug)]
pub struct CapturedDispatch {
    /// The kernel's name.
    pub kernel: String,
    /// The composed source.
    pub wgsl: String,
    /// The entry point.
    pub entry: String,
    /// Workgroups.
    pub groups: [u32; 3],
    /// Its buffers.
    pub buffers: Vec<CapturedBuffer>,
}

impl Gpu {
    /// Runs `work` and returns every dispatch it made, with the buffers before and after.
    ///
    /// This is slow: each dispatch is a separate submission.
    ///
    /// # Errors
    /// Errors of `work`.
    #[doc(hidden)]
    pub fn capture<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<(T, Vec<CapturedDispatch>)> {
        *self.capture.lock().expect("no panic while held") = Some(Vec::new());
        let result = work();
        let captured = self.capture.lock().expect("no panic while held").take().unwrap_or_default();
        Ok((result?, captured))
    }
}

impl Recording<'_> {
    pub(super) fn dispatch_captured(
        &mut self,
        kernel: &Kernel,
        groups: [u32; 3],
        bound: &[(&Binding, &Buffer)],
    ) -> Result<()> {
        let gpu = self.gpu();
        let contents = |recording: &mut Self| -> Result<Vec<Vec<u8>>> {
            recording.flush();
            let mut reading = gpu.record(Precision::F32);
            bound.iter().for_each(|(_, buffer)| reading.download(buffer));
            Ok(reading.submit()?.wait()?.iter().map(|bytes| bytes.as_slice::<u8>().to_vec()).collect())
        };
        let before = contents(self)?;
        let entries: Vec<_> = bound.iter().map(|(binding, buffer)| buffer.entry(binding.binding)).collect();
        self.encode(kernel, groups, &entries);
        let after = contents(self)?;
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
}
