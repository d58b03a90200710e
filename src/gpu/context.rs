//! [`Gpu`]: an open device with its limits, its compiled kernels, the memory that it keeps, and the
//! reason if it was lost.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use wgpu::{Adapter, Features};

use super::adapter;
use super::capture::CapturedDispatch;
use super::plan::{self, Limits};
use super::pool::Pool;
use super::reflect::Reflection;
use super::summary::AdapterSummary;
use crate::error::{Error, Result};

/// Workgroup memory that the kernels are designed for. Every WebGPU device has it.
const DESIGN_WORKGROUP_BYTES: u32 = 16 * 1024;

/// A compiled kernel.
pub(super) struct Kernel {
    pub(super) name: String,
    pub(super) wgsl: String,
    pub(super) entry: &'static str,
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) reflection: Reflection,
}

/// What went to a device and back.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Submissions.
    pub submissions: usize,
    /// Dispatches of kernels.
    pub dispatches: usize,
    /// Bytes to the device.
    pub up: u64,
    /// Bytes from the device.
    pub down: u64,
}

impl Traffic {
    pub(super) fn add(&mut self, other: Self) {
        self.submissions += other.submissions;
        self.dispatches += other.dispatches;
        self.up += other.up;
        self.down += other.down;
    }
}

/// An open GPU.
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    summary: AdapterSummary,
    limits: Limits,
    lost: Arc<OnceLock<String>>,
    pub(super) kernels: Mutex<HashMap<String, Arc<Kernel>>>,
    pub(super) pool: Arc<Pool>,
    pub(super) kernel_nanoseconds: Mutex<f64>,
    pub(super) traffic: Mutex<Traffic>,
    notes: Mutex<Vec<String>>,
    pub(super) capture: Mutex<Option<Vec<CapturedDispatch>>>,
    pub(super) poisoned: bool,
    lanes: Option<usize>,
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gpu({}, {})", self.summary.name, self.summary.driver)
    }
}

impl Gpu {
    /// Opens adapter `number` of [`adapters`](super::adapters).
    ///
    /// # Errors
    /// [`Error::NoGpu`] if there is no such adapter or it cannot be opened.
    pub fn open(number: usize) -> Result<Self> {
        let adapters = adapter::sorted(&adapter::instance());
        let found = match adapters.len() {
            0 => "this machine offers no Vulkan, Metal or DirectX 12 adapter; use `Device::cpu`, or install a driver"
                .to_string(),
            1 => {
                format!("gpu:{number} was asked for, but there is one adapter, gpu:0; `gpu::adapters` describes it")
            }
            n => format!(
                "gpu:{number} was asked for, but the adapters are gpu:0 … gpu:{}; `gpu::adapters` lists them",
                n - 1
            ),
        };
        let adapter = adapters.into_iter().nth(number).ok_or(Error::NoGpu(found))?;
        Self::from_adapter(&adapter)
    }

    fn from_adapter(adapter: &Adapter) -> Result<Self> {
        let info = adapter.get_info();
        let wanted = Features::SUBGROUP | Features::SHADER_F64 | Features::TIMESTAMP_QUERY;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("faircurve"),
            required_features: adapter.features() & wanted,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| Error::NoGpu(format!("{} did not open: {error}", info.name)))?;
        Ok(Self::from_wgpu(device, queue))
    }

    /// Borrows a device and queue that the host program opened itself.
    ///
    /// Features that it did not enable are not used. Without `SUBGROUP` the workgroup-memory
    /// kernels run. Without `SHADER_F64` only f32 is possible.
    ///
    /// This sets the device's lost callback.
    pub fn from_wgpu(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let lost = Arc::new(OnceLock::new());
        let note = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, text| {
            // Only the first reason counts. Later ones are its echoes.
            let _ = note.set(format!("{reason:?}: {text}").trim_end_matches([':', ' ']).to_string());
        });
        let granted = device.limits();
        let is_discrete = device.adapter_info().device_type == wgpu::DeviceType::DiscreteGpu;
        let chunk_bytes = plan::chunk_bytes(is_discrete, granted.max_buffer_size);
        let limits = Limits {
            binding_bytes: granted.max_storage_buffer_binding_size,
            buffer_bytes: granted.max_buffer_size,
            workgroup_bytes: granted.max_compute_workgroup_storage_size.min(DESIGN_WORKGROUP_BYTES),
            workgroup_threads: granted.max_compute_invocations_per_workgroup.min(granted.max_compute_workgroup_size_x),
            storage_bindings: granted.max_storage_buffers_per_shader_stage,
            workgroups: granted.max_compute_workgroups_per_dimension,
            chunk_bytes,
        };
        Gpu {
            summary: adapter::summarise(&device.adapter_info(), device.features()),
            limits,
            lost,
            kernels: Mutex::default(),
            pool: Arc::new(Pool::new(3 * chunk_bytes)),
            kernel_nanoseconds: Mutex::new(0.0),
            traffic: Mutex::default(),
            notes: Mutex::default(),
            capture: Mutex::default(),
            poisoned: false,
            lanes: None,
            device,
            queue,
        }
    }

    /// The same GPU with smaller limits, for tests of chunking and for sharing a device.
    #[doc(hidden)]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// Treats the device as one without subgroups, so that the workgroup-memory kernels run.
    #[doc(hidden)]
    pub fn without_subgroups(mut self) -> Self {
        self.summary.has_subgroups = false;
        self
    }

    /// Fills the arrays that kernels write with NaN first, instead of zeros.
    ///
    /// Tests can then tell unwritten numbers from zeros.
    #[doc(hidden)]
    pub fn with_poisoned_arrays(mut self) -> Self {
        self.poisoned = true;
        self
    }

    /// Gives every curve 1, 4, 8, 16 or 32 lanes in descents by Newton's method. Otherwise the cost
    /// model chooses.
    #[doc(hidden)]
    pub fn with_lanes(mut self, lanes: usize) -> Self {
        self.lanes = Some(lanes);
        self
    }

    /// How many arrays were allocated, because none was kept from earlier submissions.
    #[doc(hidden)]
    pub fn arrays_made(&self) -> usize {
        self.pool.missed()
    }

    /// The lanes of [`with_lanes`](Self::with_lanes).
    pub(crate) fn lanes(&self) -> Option<usize> {
        self.lanes
    }

    /// A description of the adapter.
    pub fn summary(&self) -> &AdapterSummary {
        &self.summary
    }

    /// The limits that plans are made against.
    #[doc(hidden)]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The wgpu device, for host programs that share it.
    pub fn wgpu_device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Why the device was lost, if it was.
    pub fn lost(&self) -> Option<&str> {
        self.lost.get().map(String::as_str)
    }

    /// Seconds that the kernels ran since the last call, by the device's own clock.
    ///
    /// 0 if the device has no clock.
    pub fn take_kernel_seconds(&self) -> f64 {
        std::mem::take(&mut *self.kernel_nanoseconds.lock().expect("no panic while held")) * 1e-9
    }

    /// What went to the device and back since the last call.
    #[doc(hidden)]
    pub fn take_traffic(&self) -> Traffic {
        std::mem::take(&mut *self.traffic.lock().expect("no panic while held"))
    }

    /// Notes a choice of kernels.
    pub(crate) fn note(&self, choice: String) {
        let mut notes = self.notes.lock().expect("no panic while held");
        if !notes.contains(&choice) {
            notes.push(choice);
        }
    }

    /// The choices of kernels since the last call, a sentence each.
    pub fn take_notes(&self) -> Vec<String> {
        std::mem::take(&mut *self.notes.lock().expect("no panic while held"))
    }

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

    /// The error behind a failed wait: a lost device with its reason, or else `otherwise`.
    pub(super) fn failure(&self, otherwise: Error) -> Error {
        // The reason arrives by a callback. Only polling calls it, once nothing is under way any
        // more. If polling fails, that reason tells why.
        let timeout = Some(std::time::Duration::from_secs(5));
        let _ = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
        match self.lost() {
            Some(reason) => Error::DeviceLost(reason.to_string()),
            None => otherwise,
        }
    }
}
