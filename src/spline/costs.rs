//! The measured cost of a device. Natural splines are the unit of other methods' costs.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};

use super::Natural;
use super::gpu::GROUP;
use crate::batch::CurveBatch;
use crate::curve::Sampling;
use crate::device::{Costs, Device};
use crate::error::Result;
use crate::gpu::source::definitions;
use crate::gpu::{Gpu, KernelKey};
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

/// The bytes that [`Costs::bandwidth`] streams: more than any cache holds, but on software.
const fn streamed(is_software: bool) -> u64 {
    if is_software { 64 << 20 } else { 512 << 20 }
}

impl Costs {
    /// Bytes a second that a GPU reads and writes in its memory. 0 without a clock.
    ///
    /// # Errors
    /// Errors of submissions.
    #[doc(hidden)]
    pub fn bandwidth(gpu: &Gpu) -> Result<f64> {
        let bytes = streamed(gpu.summary().is_software()).min(gpu.limits().array_bytes());
        let count = (bytes / Precision::F32.bytes()) as usize;
        let seconds = kernel_seconds(gpu, "stream", Precision::F32, RateParams { count: count as u32, turns: 0 })?;
        Ok(if seconds > 0.0 { 2.0 * bytes as f64 / seconds } else { 0.0 })
    }
}

/// The least time of an entry of `rate.wgsl`.
fn kernel_seconds(gpu: &Gpu, entry: &'static str, precision: Precision, params: RateParams) -> Result<f64> {
    let mut best = f64::INFINITY;
    for _ in 0..=REPETITIONS {
        gpu.take_kernel_seconds();
        let mut recording = gpu.record(precision);
        let uniform = recording.uniform(&params);
        let results = recording.storage_reals(params.count as usize);
        let definitions = definitions([("GROUP", &GROUP)]);
        let key = KernelKey { path: "spline/rate.wgsl", entry, precision, definitions };
        recording.dispatch(&key, params.count as usize, GROUP, &[("params", &uniform), ("results", &results)])?;
        recording.submit()?.wait()?;
        best = best.min(gpu.take_kernel_seconds());
    }
    Ok(best)
}

/// The rate of f64 arithmetic on a GPU relative to f32. 0 without f64 or a clock.
fn f64_rate(device: &Device) -> Result<f64> {
    let Some(gpu) = device.as_gpu().filter(|gpu| gpu.summary().has_f64) else { return Ok(0.0) };
    let (count, turns) = if gpu.summary().is_software() { (1 << 10, 1_000) } else { (1 << 18, 4_000) };
    let seconds = |precision: Precision| kernel_seconds(gpu, "rate", precision, RateParams { count, turns });
    let [single, double] = [seconds(Precision::F32)?, seconds(Precision::F64)?];
    Ok(if double > 0.0 { single / double } else { 0.0 })
}
