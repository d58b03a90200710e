//! Which device does the work: the choice on the command line, and the one place where it is
//! opened.

use clap::Args;
use faircurve::{Choice, Device, DeviceReport, Error, Precision, Result, Work, gpu};
use serde::Serialize;

use super::words::one_of;
use super::{Talk, costs, machine};

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
        false => gpu::silently(|| Device::choose_by(choice, work, &costs::of)),
    };
    Ok(device?.with_precision(precision))
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
                let driver = format!("{}, {}", super::count(machine::threads(), "thread"), machine::simd());
                Description { kind: "cpu", name: machine::cpu_name(), driver }
            }
        }
    }
}
