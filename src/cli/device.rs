//! Which device does the work: the choice on the command line, and the one place where it is opened.

use clap::Args;
use faircurve::{Choice, Device, DeviceReport, Error, Precision, Result, Work};
use serde::Serialize;

use super::words::one_of;
use super::{Talk, costs};

#[derive(Args, Clone, Copy, Debug)]
pub struct DeviceArgs {
    /// What does the work: auto, cpu, gpu or gpu:N
    #[arg(long, value_name = "DEVICE", default_value = "auto", help_heading = "Run")]
    pub device: Choice,
    /// Precision of the arithmetic
    #[arg(long, value_parser = one_of(Precision::WORDS), default_value_t = Precision::Auto, help_heading = "Run")]
    pub precision: Precision,
}

/// The device asked for; `auto` decides by the work, and by what `doctor` has measured.
///
/// # Errors
/// A GPU that was asked for and is not there; f32 on the CPU.
pub fn open(args: DeviceArgs, work: &Work, talk: Talk) -> Result<Device> {
    let (choice, precision) = (args.device, args.precision);
    if (choice, precision) == (Choice::Cpu, Precision::F32) {
        let why =
            "--precision f32 belongs to a GPU; the CPU computes in f64: leave --precision out, or use --device gpu";
        return Err(Error::argument(why));
    }
    let device = match talk.verbose {
        true => Device::choose_by(choice, work, &costs::of),
        false => silently(|| Device::choose_by(choice, work, &costs::of)),
    };
    Ok(device?.with_precision(precision))
}

/// Does something while what drivers and their loaders print to stderr is kept from the user, where
/// that can be done.
pub fn silently<T>(act: impl FnOnce() -> T) -> T {
    #[cfg(unix)]
    let _silence = Silence::of_stderr();
    act()
}

/// Sends stderr nowhere until it is dropped.
#[cfg(unix)]
struct Silence {
    stderr: std::os::fd::OwnedFd,
}

#[cfg(unix)]
impl Silence {
    fn of_stderr() -> std::io::Result<Silence> {
        use std::os::fd::AsFd;
        let stderr = std::io::stderr().as_fd().try_clone_to_owned()?;
        let nowhere = std::fs::OpenOptions::new().write(true).open("/dev/null")?;
        rustix::stdio::dup2_stderr(nowhere)?;
        Ok(Silence { stderr })
    }
}

#[cfg(unix)]
impl Drop for Silence {
    fn drop(&mut self) {
        // Where this fails there is nobody to tell.
        let _ = rustix::stdio::dup2_stderr(&self.stderr);
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

impl Description {
    /// Of what did the work; of the CPU it says which.
    pub fn of(device: &DeviceReport) -> Self {
        match device.is_gpu {
            true => Description { kind: "gpu", name: device.name.clone(), driver: device.driver.clone() },
            false => {
                let driver = format!("{}, {}", super::count(threads(), "thread"), simd());
                Description { kind: "cpu", name: cpu_name(), driver }
            }
        }
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
