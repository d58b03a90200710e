//! What the GPU tests share: the adapter (required where FAIRCURVE_REQUIRE_GPU is set), seeded
//! numbers, batches that are hard to fit, and the comparison of what the devices make of them.

pub mod batches;
pub mod conform;
pub mod discrete;
pub mod tolerance;

use std::io::Write;
use std::sync::OnceLock;

use faircurve::gpu::Gpu;
use faircurve::{Device, Precision};
use rand::SeedableRng;
use rand::rngs::StdRng;

/// The first adapter, opened anew. Without one a test returns early
/// (`let Some(gpu) = gpu() else { return };`) after a notice that is not captured, and fails where
/// `FAIRCURVE_REQUIRE_GPU` is set.
pub fn gpu() -> Option<Gpu> {
    match Gpu::open(0) {
        Ok(gpu) => {
            println!("adapter: {} ({})", gpu.summary().name, gpu.summary().driver);
            Some(gpu)
        }
        Err(error) if std::env::var_os("FAIRCURVE_REQUIRE_GPU").is_some() => panic!(
            "FAIRCURVE_REQUIRE_GPU is set, but there is {error}; install a Vulkan driver (software will do: \
             mesa-vulkan-drivers and libvulkan1), or name its file in VK_DRIVER_FILES"
        ),
        Err(error) => {
            notice(&format!("a GPU test is skipped: {error}"));
            None
        }
    }
}

/// One device for all tests of a file, so that every kernel is compiled once. Its arrays hold NaN
/// before kernels write them: what no kernel wrote fails every comparison.
pub fn device() -> Option<Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE.get_or_init(|| gpu().map(|gpu| Device::from_gpu(gpu.with_poisoned_arrays()))).clone()
}

/// The precisions an adapter has, with a notice where it lacks f64.
pub fn precisions(gpu: &Gpu) -> Vec<Precision> {
    if !gpu.summary().has_f64 {
        notice(&format!("{} has no 64-bit floats: f64 is not tested", gpu.summary().name));
        return vec![Precision::F32];
    }
    vec![Precision::F32, Precision::F64]
}

/// The distance from 1 to the next number of a precision.
pub fn epsilon(precision: Precision) -> f64 {
    if precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) }
}

/// Prints past the capture of test output.
fn notice(text: &str) {
    let _ = writeln!(std::io::stderr(), "NOTICE: {text}");
}

/// A generator whose seed is printed.
pub fn seeded(seed: u64) -> StdRng {
    println!("seed {seed}");
    StdRng::seed_from_u64(seed)
}
