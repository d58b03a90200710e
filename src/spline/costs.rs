//! The measured cost of a device. Natural splines are the unit of other methods' costs.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};

use super::Natural;
use super::gpu::GROUP;
use crate::batch::CurveBatch;
use crate::curve::Sampling;
use crate::device::{Costs, Device};
use crate::error::Result;
use crate::gpu::KernelKey;
use crate::gpu::source::definitions;
use crate::precision::Precision;

/// Repetitions of a measurement, of which the best counts.
const REPETITIONS: usize = 3;

impl Costs {
    /// Measures natural splines in f32 on a GPU that took `open` seconds to open, and on the CPU.
    ///
    /// An adapter without a clock counts its kernels as transfer.
    ///
    /// # Errors
    /// Failed fits.
    pub fn measured(device: &Device, open: f64) -> Result<Self> {
        let (curves, points, per_span) = (20_000, 10, 8);
        let coords = (0..curves * points).flat_map(|k| [k as f64 * 0.3, (k as f64 * 0.7).sin()]).collect();
        let batch = CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| i * points).collect())?;
        let count = (curves * (points + (points - 1) * per_span + 1)) as f64;
        let fit = |device: &Device| -> Result<f64> {
            let began = Instant::now();
            Natural::default().fit_sampled(&batch, Sampling::PerSpan(per_span), device)?;
            Ok(began.elapsed().as_secs_f64())
        };
        let best = |device: &Device| -> Result<(f64, f64)> {
            // The first compiles, and makes arrays.
            fit(device)?;
            let mut best = (f64::INFINITY, 0.0);
            for _ in 0..REPETITIONS {
                device.as_gpu().map(|gpu| gpu.take_kernel_seconds());
                let whole = fit(device)?;
                let kernels = device.as_gpu().map_or(0.0, |gpu| gpu.take_kernel_seconds());
                best = if whole < best.0 { (whole, kernels) } else { best };
            }
            Ok(best)
        };
        let (cpu, _) = best(&Device::cpu())?;
        let (whole, kernels) = best(&device.clone().with_precision(Precision::F32))?;
        let transfer = (whole - kernels).max(0.0) / count;
        let f64_rate = f64_rate(device)?;
        Ok(Costs { open, cpu: cpu / count, transfer, kernels: kernels / count, f64_rate, measured: true })
    }
}

/// `RateParams` of `rate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct RateParams {
    pub count: u32,
    pub turns: u32,
}

/// The rate of f64 arithmetic on a GPU relative to f32. 0 without f64 or a clock.
fn f64_rate(device: &Device) -> Result<f64> {
    let Some(gpu) = device.as_gpu().filter(|gpu| gpu.summary().has_f64) else { return Ok(0.0) };
    let software = gpu.summary().is_software();
    let (count, turns) = if software { (1 << 10, 1_000) } else { (1 << 18, 4_000) };
    let seconds = |precision: Precision| -> Result<f64> {
        let mut best = f64::INFINITY;
        for _ in 0..=REPETITIONS {
            gpu.take_kernel_seconds();
            let mut recording = gpu.record(precision);
            let params = recording.uniform(&RateParams { count: count as u32, turns });
            let results = recording.storage_reals(count);
            let definitions = definitions([("GROUP", &GROUP)]);
            let key = KernelKey { path: "spline/rate.wgsl", entry: "rate", precision, definitions };
            recording.dispatch(&key, count, GROUP, &[("params", &params), ("results", &results)])?;
            recording.submit()?.wait()?;
            best = best.min(gpu.take_kernel_seconds());
        }
        Ok(best)
    };
    let [single, double] = [seconds(Precision::F32)?, seconds(Precision::F64)?];
    Ok(if double > 0.0 { single / double } else { 0.0 })
}
