//! [`Device`]: the CPU or a GPU, the precision, and how `auto` chooses.

mod costs;

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

pub use costs::{Costs, Work};

use crate::error::{Error, Result};
use crate::gpu::{self, AdapterSummary, Gpu};
use crate::precision::Precision;

/// The choice of a device, on the command line `auto`, `cpu`, `gpu` or `gpu:N`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Choice {
    /// A hardware GPU if there is one and it is faster for the batch, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The adapter of this index. Hardware adapters come before software ones.
    Gpu(usize),
}

#[doc(hidden)]
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

/// The device of a fit. Displayed as `CPU, 2 threads, f64`.
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
    /// Number of a GPU's curves that the CPU finished in f64, mostly because f32 was not precise
    /// enough.
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

/// The device of a fit, and its precision.
#[derive(Clone, Debug)]
pub struct Device {
    gpu: Option<Arc<Gpu>>,
    precision: Precision,
    /// Whether [`Precision::Auto`] is f64.
    prefers_f64: bool,
    reason: String,
    finished: Option<Arc<AtomicUsize>>,
    stop: Option<Arc<AtomicBool>>,
}

/// The payload with which a [stopped](Device::stopped_by) fit unwinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

impl Device {
    /// The CPU, with all threads of rayon's pool.
    pub fn cpu() -> Self {
        Device {
            gpu: None,
            precision: Precision::Auto,
            prefers_f64: false,
            reason: "as asked".into(),
            finished: None,
            stop: None,
        }
    }

    /// The adapter of this index in [`gpu::adapters`].
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
        Self::choose(Choice::Auto, &Work::ENDLESS)
    }

    /// Chooses a device. `Auto` takes a hardware GPU if it is estimated to be faster than the CPU.
    ///
    /// # Errors
    /// [`Error::NoGpu`] if a GPU was asked for and does not open.
    pub fn choose(choice: Choice, work: &Work) -> Result<Self> {
        Self::choose_by(choice, work, &Costs::estimated)
    }

    #[doc(hidden)]
    /// As [`choose`](Self::choose), with other costs, such as [`Costs::measured`].
    ///
    /// # Errors
    /// [`Error::NoGpu`] if a GPU was asked for and does not open.
    pub fn choose_by(choice: Choice, work: &Work, costs: &dyn Fn(&AdapterSummary) -> Costs) -> Result<Self> {
        let device = match choice {
            Choice::Cpu => Self::cpu(),
            Choice::Gpu(number) => Self::gpu(number)?,
            Choice::Auto => Self::choose_automatically(work, costs),
        };
        let prefers_f64 = device.as_gpu().is_some_and(|gpu| costs(gpu.summary()).prefers_f64());
        Ok(Device { prefers_f64, ..device })
    }

    fn choose_automatically(work: &Work, costs: &dyn Fn(&AdapterSummary) -> Costs) -> Self {
        let cpu = |reason: String| Device { reason, ..Self::cpu() };
        if costs::on_the_cpu(work) < costs::LEAST_OPEN {
            return cpu("auto: done before a GPU would be open".into());
        }
        let adapters = gpu::adapters();
        let Some(first) = adapters.first() else { return cpu("auto: there is no GPU".into()) };
        match preferred(first, work, costs) {
            Err(why) => cpu(why),
            Ok(why) => match Self::gpu(0) {
                Ok(device) => Device { reason: why, ..device },
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

    /// The same device with a flag that stops fits, for Ctrl-C.
    ///
    /// Once the flag is set, a fit ends with the next finished curve. It unwinds with [`Stopped`]
    /// by [`resume_unwind`](std::panic::resume_unwind), for
    /// [`catch_unwind`](std::panic::catch_unwind). Natural splines and completed Béziers finish all
    /// curves at once and are not stopped.
    pub fn stopped_by(mut self, flag: Arc<AtomicBool>) -> Self {
        self.stop = Some(flag);
        self
    }

    /// The CPU in place of this device, with the same counter and flag.
    pub(crate) fn on_cpu(&self) -> Self {
        Device { gpu: None, ..self.clone() }
    }

    /// Adds to the counter of finished curves. Unwinds if the fit is stopped.
    pub(crate) fn finished(&self, curves: usize) {
        if let Some(counter) = &self.finished {
            counter.fetch_add(curves, Ordering::Relaxed);
        }
        if self.stop.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            std::panic::resume_unwind(Box::new(Stopped));
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

    /// Why this device was chosen.
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

    /// The report of a fit on this device.
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

    /// The report of a fit on this device in this precision, for methods outside this crate.
    pub fn report_of(&self, precision: Precision) -> DeviceReport {
        let (name, driver) = match self.as_gpu() {
            Some(gpu) => (gpu.summary().name.clone(), gpu.summary().driver.clone()),
            None => ("CPU".into(), threads()),
        };
        DeviceReport { is_gpu: self.gpu.is_some(), name, driver, precision, finished_on_cpu: 0 }
    }

    /// The precision of a kernel. `Auto` takes f32 if the adapter has no f64, or if the problem is
    /// `well_conditioned` and f64 was not measured to be about as fast.
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
            Precision::Auto if has_f64 && (self.prefers_f64 || !well_conditioned) => Ok(Precision::F64),
            Precision::Auto => Ok(Precision::F32),
            asked => Ok(asked),
        }
    }
}

/// Why an adapter is taken, or why it is not.
fn preferred(
    adapter: &AdapterSummary,
    work: &Work,
    costs: &dyn Fn(&AdapterSummary) -> Costs,
) -> std::result::Result<String, String> {
    let name = &adapter.name;
    if adapter.is_software() {
        return Err(format!("auto: the only adapter, {name}, is software and slower than the CPU itself"));
    }
    if *work == Work::ENDLESS {
        return Ok("auto: a hardware GPU".into());
    }
    let costs = costs(adapter);
    let compared = costs.compared(work);
    if costs.pays(work) { Ok(format!("auto: {compared}")) } else { Err(format!("auto: on {name} {compared}")) }
}

fn threads() -> String {
    match rayon::current_num_threads() {
        1 => "1 thread".into(),
        threads => format!("{threads} threads"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_takes_hardware_where_it_pays_and_says_what_it_compared() {
        let costs = Costs { open: 0.25, cpu: 4e-9, transfer: 3e-9, kernels: 1e-10, f64_rate: 0.0, measured: true };
        let preferred = |kind, work: Work| preferred(&AdapterSummary::of_kind(kind), &work, &|_| costs);
        let fair = Work { points: 10_000_000, cost: 50.0, on_host: 0.0 };
        let paying = preferred("discrete GPU", fair).unwrap();
        assert_eq!(paying, "auto: some 0.3 s against 2.0 s on the CPU, measured");
        let small = preferred("discrete GPU", Work { points: 100_000, cost: 50.0, on_host: 0.0 }).unwrap_err();
        assert_eq!(small, "auto: on a card some 0.3 s against 0.0 s on the CPU, measured");
        assert!(preferred("software", Work::ENDLESS).unwrap_err().contains("is software"));
        assert_eq!(preferred("integrated GPU", Work::ENDLESS).unwrap(), "auto: a hardware GPU");
    }
}
