//! Which device does the work: the choice on the command line, and the one place where it is opened.

use clap::{Args, ValueEnum};
use faircurve::{Choice, CurveBatch, Device, Error, Precision, Result, Sampling};
use serde::Serialize;

use super::Talk;

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum PrecisionArg {
    /// f64 on the CPU; on a GPU f32 for natural splines, f64 for smoothing where it has f64
    Auto,
    /// 32-bit floats
    F32,
    /// 64-bit floats
    F64,
}

impl PrecisionArg {
    pub fn of(precision: Precision) -> Self {
        match precision {
            Precision::Auto => PrecisionArg::Auto,
            Precision::F32 => PrecisionArg::F32,
            Precision::F64 => PrecisionArg::F64,
        }
    }

    pub fn precision(self) -> Precision {
        match self {
            PrecisionArg::Auto => Precision::Auto,
            PrecisionArg::F32 => Precision::F32,
            PrecisionArg::F64 => Precision::F64,
        }
    }
}

#[derive(Args, Clone, Copy, Debug)]
pub struct DeviceArgs {
    /// What does the work: auto, cpu, gpu or gpu:N
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    pub device: Choice,
    /// Precision of the arithmetic
    #[arg(long, value_enum, default_value_t = PrecisionArg::Auto)]
    pub precision: PrecisionArg,
}

/// The device asked for. `auto` decides by the points that are read and written together, each worth as many of natural
/// splines as the method takes longer (`cost`).
///
/// # Errors
/// A GPU that was asked for and is not there; f32 on the CPU.
pub fn open(args: DeviceArgs, batch: &CurveBatch, sampling: Sampling, cost: usize, talk: Talk) -> Result<Device> {
    let per_span = match sampling {
        Sampling::PerSpan(n) => n,
        // How many they will be is known only after the fit; this many is usual.
        _ => 16,
    };
    let spans: usize = (0..batch.len()).map(|i| batch.spans(i)).sum();
    let points = batch.total_points().saturating_add(spans.saturating_mul(per_span));
    open_for(args, points.saturating_mul(cost), talk)
}

/// The device asked for, where so many points are read and written together.
///
/// # Errors
/// As [`open`].
pub fn open_for(args: DeviceArgs, points: usize, talk: Talk) -> Result<Device> {
    let (choice, precision) = (args.device, args.precision.precision());
    if (choice, precision) == (Choice::Cpu, Precision::F32) {
        let why =
            "--precision f32 belongs to a GPU; the CPU computes in f64: leave --precision out, or use --device gpu";
        return Err(Error::argument(why));
    }
    let device = match talk.verbose {
        true => Device::choose(choice, points),
        false => silently(|| Device::choose(choice, points)),
    };
    Ok(device?.with_precision(precision))
}

/// Does something while what drivers and their loaders print to stderr is kept from the user, where that can be done.
pub fn silently<T>(act: impl FnOnce() -> T) -> T {
    let _silence = gag::Gag::stderr();
    act()
}

/// A device as the report names it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Description {
    /// `cpu` or `gpu`.
    pub kind: &'static str,
    pub name: String,
    pub driver: String,
}

/// Names a device.
pub fn describe(device: &Device) -> Description {
    match device.as_gpu() {
        None => Description {
            kind: "cpu",
            name: cpu_name(),
            driver: format!("{}, {}", super::count(threads(), "thread"), simd()),
        },
        Some(gpu) => {
            Description { kind: "gpu", name: gpu.summary().name.clone(), driver: gpu.summary().driver.clone() }
        }
    }
}

/// The precision of a result, from what it says about the device that did the work.
pub fn precision_word(device: &str) -> &'static str {
    if device.contains("f32") { "f32" } else { "f64" }
}

/// Threads that share the work.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// The processor's own name where the system tells it, else the architecture.
pub fn cpu_name() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").ok();
    let line = told.as_deref().and_then(|text| text.lines().find(|line| line.starts_with("model name")));
    let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim());
    name.filter(|name| !name.is_empty()).unwrap_or(std::env::consts::ARCH).to_string()
}

/// The widest vector instructions this machine has among those that matter here.
pub fn simd() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let fma = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        if fma && is_x86_feature_detected!("avx512f") {
            "AVX-512"
        } else if fma {
            "AVX2 and FMA"
        } else {
            "SSE2"
        }
    }
    #[cfg(target_arch = "aarch64")]
    {
        "NEON"
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    {
        "no vector instructions known"
    }
}
