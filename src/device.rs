//! [`Device`]: the CPU or a GPU, the precision, and how `auto` chooses.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::gpu::{self, Gpu};
use crate::precision::Precision;

/// The device to use, as asked for on the command line: `auto`, `cpu`, `gpu` or `gpu:N`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Choice {
    /// A hardware GPU if there is one and the batch is large enough to gain, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The adapter of this number. Hardware adapters come before software ones.
    Gpu(usize),
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Choice::Auto),
            "cpu" => Ok(Choice::Cpu),
            "gpu" => Ok(Choice::Gpu(0)),
            _ => {
                let number = text.strip_prefix("gpu:").and_then(|number| number.parse().ok());
                number.map(Choice::Gpu).ok_or_else(|| format!("'{text}' is no device: use auto, cpu, gpu, or gpu:N"))
            }
        }
    }
}

/// From this many points on, read and written together, `Auto` takes a GPU for natural splines.
///
/// With fewer points the CPU fits and samples them before a GPU is open. Two cores take some 5 ns a
/// point (0.05 s for so many), and opening a device takes about as long at best. If a method takes
/// longer, each of its points counts as several. This is an estimate: no hardware GPU has been
/// measured yet.
pub const GPU_PAYS_ABOVE: usize = 10_000_000;

/// What did the work of a fit. Displayed as `CPU, 2 threads, f64`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceReport {
    /// Whether it is a GPU rather than the CPU.
    pub is_gpu: bool,
    /// `CPU`, or the adapter's name.
    pub name: String,
    /// `2 threads`, or the adapter's driver.
    pub driver: String,
    /// The precision of the arithmetic: f32 or f64.
    pub precision: Precision,
    /// Number of a GPU's curves that the CPU finished in f64, because f32 lacked the digits for
    /// them.
    pub finished_on_cpu: usize,
}

impl fmt::Display for DeviceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DeviceReport { is_gpu, name, driver, precision, finished_on_cpu } = self;
        match is_gpu {
            true => write!(f, "{name} ({driver}), {precision}")?,
            false => write!(f, "{name}, {driver}, {precision}")?,
        }
        match finished_on_cpu {
            0 => Ok(()),
            _ => write!(f, "; {finished_on_cpu} of its curves finished on the CPU in f64"),
        }
    }
}

/// The device that does the work, and its precision.
#[derive(Clone, Debug)]
pub struct Device {
    gpu: Option<Arc<Gpu>>,
    precision: Precision,
    reason: String,
    finished: Option<Arc<AtomicUsize>>,
}

impl Device {
    /// The CPU, with all threads of rayon's pool.
    pub fn cpu() -> Self {
        Device { gpu: None, precision: Precision::Auto, reason: "as asked".into(), finished: None }
    }

    /// The adapter of this number. [`gpu::adapters`] lists them.
    ///
    /// # Errors
    /// [`Error::NoGpu`].
    pub fn gpu(number: usize) -> Result<Self> {
        Ok(Self::from_gpu(Gpu::open(number)?))
    }

    /// A GPU that [`Gpu`] opened, or borrowed from the host program.
    pub fn from_gpu(gpu: Gpu) -> Self {
        Device { gpu: Some(Arc::new(gpu)), ..Self::cpu() }
    }

    /// A hardware GPU if there is one, else the CPU. [`reason`](Self::reason) says why.
    ///
    /// # Errors
    /// None today.
    pub fn auto() -> Result<Self> {
        Self::choose(Choice::Auto, usize::MAX)
    }

    /// The device asked for.
    ///
    /// `points` is the size of a batch of natural splines, points read and points written together.
    /// `Auto` decides by it ([`GPU_PAYS_ABOVE`]), and looks for no GPU if the points are too few.
    ///
    /// # Errors
    /// [`Error::NoGpu`] if a GPU was asked for and does not open.
    pub fn choose(choice: Choice, points: usize) -> Result<Self> {
        match choice {
            Choice::Cpu => Ok(Self::cpu()),
            Choice::Gpu(number) => Self::gpu(number),
            Choice::Auto => Ok(Self::choose_automatically(points)),
        }
    }

    fn choose_automatically(points: usize) -> Self {
        let cpu = |reason: String| Device { reason, ..Self::cpu() };
        if points < GPU_PAYS_ABOVE {
            return cpu("auto: done before a GPU would be open".into());
        }
        match gpu::adapters().first() {
            None => cpu("auto: there is no GPU".into()),
            Some(first) if first.is_software() => {
                cpu(format!("auto: the only adapter, {}, is software and slower than the CPU itself", first.name))
            }
            Some(_) => match Self::gpu(0) {
                Ok(device) => Device { reason: "auto: a hardware GPU".into(), ..device },
                Err(error) => cpu(format!("auto: {error}")),
            },
        }
    }

    /// The same device with another precision.
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// The same device with a counter of finished curves, for progress bars.
    ///
    /// Fits add to the counter as they go.
    pub fn with_counter(mut self, finished: Arc<AtomicUsize>) -> Self {
        self.finished = Some(finished);
        self
    }

    /// The CPU in place of this device, with the same counter.
    pub(crate) fn on_cpu(&self) -> Self {
        Device { gpu: None, ..self.clone() }
    }

    /// Counts so many more curves as finished.
    pub(crate) fn finished(&self, curves: usize) {
        if let Some(counter) = &self.finished {
            counter.fetch_add(curves, Ordering::Relaxed);
        }
    }

    /// The precision asked for.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// The GPU, if it is one.
    pub fn as_gpu(&self) -> Option<&Gpu> {
        self.gpu.as_deref()
    }

    /// Why this device was chosen: what `auto` found, or that it was asked for.
    pub fn reason(&self) -> &str {
        &self.reason
    }

    /// `CPU, 2 threads` or the adapter's name and driver.
    pub fn name(&self) -> String {
        match self.as_gpu() {
            Some(gpu) => format!("{} ({})", gpu.summary().name, gpu.summary().driver),
            None => format!("CPU, {}", threads()),
        }
    }

    /// The report of this device as what did the work of a fit.
    ///
    /// # Errors
    /// As [`kernel_precision`](Self::kernel_precision).
    pub(crate) fn report(&self, well_conditioned: bool) -> Result<DeviceReport> {
        let precision = match self.as_gpu() {
            Some(gpu) => self.kernel_precision(gpu, well_conditioned)?,
            None => Precision::F64,
        };
        Ok(self.report_of(precision))
    }

    /// The report of this device for a fit by a method of your own, computed in this precision.
    pub fn report_of(&self, precision: Precision) -> DeviceReport {
        let (name, driver) = match self.as_gpu() {
            Some(gpu) => (gpu.summary().name.clone(), gpu.summary().driver.clone()),
            None => ("CPU".into(), threads()),
        };
        DeviceReport { is_gpu: self.gpu.is_some(), name, driver, precision, finished_on_cpu: 0 }
    }

    /// The precision that a kernel runs in.
    ///
    /// It is the one asked for. `Auto` takes f32 if that is accurate enough for the problem
    /// (`well_conditioned`), or if the adapter has no other.
    ///
    /// # Errors
    /// [`Error::NoGpu`] if f64 was asked for and the adapter has none.
    pub(crate) fn kernel_precision(&self, gpu: &Gpu, well_conditioned: bool) -> Result<Precision> {
        let has_f64 = gpu.summary().has_f64;
        match self.precision {
            Precision::F64 if !has_f64 => {
                let name = &gpu.summary().name;
                Err(Error::NoGpu(format!("{name} has no 64-bit floats; use `Precision::F32`, or `Device::cpu`")))
            }
            Precision::Auto if has_f64 && !well_conditioned => Ok(Precision::F64),
            Precision::Auto => Ok(Precision::F32),
            asked => Ok(asked),
        }
    }
}

fn threads() -> String {
    match rayon::current_num_threads() {
        1 => "1 thread".into(),
        threads => format!("{threads} threads"),
    }
}
