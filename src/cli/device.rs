//! Which device does the work: the choice on the command line, and the one place where it is opened.

use std::str::FromStr;

use clap::{Args, ValueEnum};
use faircurve::{Device, Error, Precision, Result};
use serde::Serialize;

/// `auto`, `cpu`, `gpu` or `gpu:N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    Auto,
    Cpu,
    Gpu(Option<usize>),
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Choice::Auto),
            "cpu" => Ok(Choice::Cpu),
            "gpu" => Ok(Choice::Gpu(None)),
            _ => match text.strip_prefix("gpu:").map(str::parse) {
                Some(Ok(n)) => Ok(Choice::Gpu(Some(n))),
                _ => Err("auto, cpu, gpu and gpu:N (N = 0, 1, … as `faircurve doctor` lists them) are possible".into()),
            },
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum PrecisionArg {
    /// f64 on the CPU; on a GPU what the method can do with
    Auto,
    /// 32-bit floats
    F32,
    /// 64-bit floats
    F64,
}

impl PrecisionArg {
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

/// The device asked for, and why it is this one. `work` is the number of coordinates of the batch.
///
/// # Errors
/// A GPU that was asked for and is not there.
pub fn open(choice: Choice, precision: Precision, work: usize) -> Result<(Device, String)> {
    let _ = work;
    match choice {
        Choice::Cpu => Ok((Device::cpu().with_precision(precision), "asked for with --device cpu".into())),
        Choice::Auto => Ok((Device::cpu().with_precision(precision), "the only device of this version".into())),
        Choice::Gpu(_) => {
            Err(Error::NoGpu("this version computes on the CPU only: use --device cpu, or leave --device out".into()))
        }
    }
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
    let _ = device;
    Description { kind: "cpu", name: cpu_name(), driver: format!("{}, {}", super::count(threads(), "thread"), simd()) }
}

/// The precision a device computes in.
pub fn precision_word(device: &Device) -> &'static str {
    match device.precision() {
        Precision::F32 => "f32",
        Precision::F64 | Precision::Auto => "f64",
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_parsed_and_others_refused() {
        assert_eq!("auto".parse(), Ok(Choice::Auto));
        assert_eq!("gpu".parse(), Ok(Choice::Gpu(None)));
        assert_eq!("gpu:3".parse(), Ok(Choice::Gpu(Some(3))));
        for wrong in ["gpu:", "gpu:-1", "GPU", "tpu", ""] {
            assert!(wrong.parse::<Choice>().is_err_and(|why| why.contains("gpu:N")), "{wrong}");
        }
    }
}
