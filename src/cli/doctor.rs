//! `faircurve doctor`: what this machine offers, and whether it computes correctly.

use std::time::Instant;

use clap::Args;
use faircurve::gpu::{self, AdapterSummary, Gpu};
use faircurve::linalg::ring;
use faircurve::spline::Natural;
use faircurve::{Costs, CurveBatch, Device, Precision, Result, Sampling};

use super::compare::difference::{self, Bounds, Outcome};
use super::words::with_options;
use super::{costs, count, machine, show, thousands};

#[derive(Args, Debug)]
pub struct DoctorArgs {}

pub fn run(_: &DoctorArgs) -> Result<bool> {
    show(format_args!(
        "faircurve {} ({}, {})",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS
    ))?;
    show(format_args!("\nCPU: {}", machine::cpu_name()))?;
    show(format_args!("  {}, {}", count(machine::threads(), "thread"), machine::simd()))?;
    let mut sound = self_test(&Device::cpu(), &[Precision::F64])?;
    let began = Instant::now();
    let adapters = gpu::silently(gpu::adapters);
    let found = began.elapsed().as_secs_f64();
    if adapters.is_empty() {
        show(format_args!(
            "\nGPU: none; there is no Vulkan, Metal or DirectX 12 adapter, so everything runs on the CPU"
        ))?;
    }
    for (number, adapter) in adapters.iter().enumerate() {
        show(format_args!("\ngpu:{number}: {}", adapter.name))?;
        print_adapter(adapter)?;
        let began = Instant::now();
        match gpu::silently(|| Gpu::open(number)) {
            Ok(gpu) => sound &= test_gpu(gpu, found + began.elapsed().as_secs_f64())?,
            Err(error) => {
                show(format_args!("  {}", with_options(error)))?;
                sound = false;
            }
        }
    }
    Ok(sound)
}

fn print_adapter(adapter: &AdapterSummary) -> Result<()> {
    let AdapterSummary { driver, backend, kind, pci_bus_id, subgroup_sizes: (least, most), .. } = adapter;
    let bus = if pci_bus_id.is_empty() { String::new() } else { format!(", PCI bus {pci_bus_id}") };
    show(format_args!("  {kind}, {backend}{bus}, driver {driver}"))?;
    let has = |feature: bool, what: &str| format!("{} {what}", if feature { "has" } else { "no" });
    show(format_args!(
        "  {}, {} ({least} to {most} lanes), {}",
        has(adapter.has_f64, "64-bit floats"),
        has(adapter.has_subgroups, "subgroups"),
        has(adapter.has_timestamps, "timestamps")
    ))
}

/// `open`: seconds until it was found and open.
fn test_gpu(gpu: Gpu, open: f64) -> Result<bool> {
    let limits = gpu.limits();
    let mebibytes = |bytes: u64| thousands((bytes >> 20) as usize);
    show(format_args!(
        "  limits: buffer {} MiB, binding {} MiB, workgroup {} KiB and {} threads, {} workgroups, chunks of {} MiB",
        mebibytes(limits.buffer_bytes),
        mebibytes(limits.binding_bytes),
        limits.workgroup_bytes >> 10,
        limits.workgroup_threads,
        thousands(limits.workgroups as usize),
        mebibytes(limits.chunk_bytes)
    ))?;
    let mut sound = true;
    for test in ring::self_test(&gpu) {
        sound &= test.passed();
        match &test.outcome {
            Ok(difference) => print_test(&test.what, *difference, test.bound, test.passed())?,
            Err(why) => show(format_args!("  self-test {}: FAILED, {why}", test.what))?,
        }
    }
    let mut precisions = vec![Precision::F32];
    precisions.extend(gpu.summary().has_f64.then_some(Precision::F64));
    let device = Device::from_gpu(gpu);
    let is_sound = self_test(&device, &precisions)? && sound;
    match Costs::measured(&device, open) {
        Ok(costs) => print_costs(&device, &costs)?,
        Err(error) => show(format_args!("  not measured: {error}"))?,
    }
    Ok(is_sound)
}

/// Prints what was measured, and keeps it for `--device auto`.
fn print_costs(device: &Device, costs: &Costs) -> Result<()> {
    let [cpu, transfer, kernels] = [costs.cpu, costs.transfer, costs.kernels].map(|seconds| 1e9 * seconds);
    show(format_args!(
        "  opened in {:.2} s; a point of natural splines takes {cpu:.1} ns on the CPU, {transfer:.1} ns on the way here or \
         back, {kernels:.2} ns in kernels",
        costs.open
    ))?;
    if costs.f64_rate > 0.0 {
        show(format_args!("  f64 arithmetic runs at {:.2} of the rate of f32", costs.f64_rate))?;
    }
    match costs::keep(device.as_gpu().expect("it is one").summary(), costs) {
        Ok(file) => show(format_args!("  kept for --device auto in {}", file.display())),
        Err(why) => show(format_args!("  not kept for --device auto: {why}")),
    }
}

fn print_test(what: &str, difference: f64, bound: f64, passed: bool) -> Result<()> {
    let result = if passed { "passed" } else { "FAILED" };
    show(format_args!("  self-test {what}: largest difference {difference:.1e} of {bound:.1e} allowed, {result}"))
}

/// Fits curves of many lengths on a device and compares them with the CPU in f64.
fn self_test(device: &Device, precisions: &[Precision]) -> Result<bool> {
    let batch = spirals()?;
    let natural = Natural::default();
    let fit = |device: &Device| {
        difference::fit(&batch, device, |batch, device| natural.fit_sampled(batch, Sampling::PerSpan(8), device))
    };
    let reference = fit(&Device::cpu().with_precision(Precision::F64))?;
    let mut sound = true;
    for &precision in precisions {
        let what = format!("natural splines, {precision}");
        match fit(&device.clone().with_precision(precision)) {
            Ok(run) if run.device().precision != precision => {
                show(format_args!("  no self-test of {what}: {} did the work", run.device()))?;
            }
            Ok(run) => {
                let Outcome { worst, bound, pass, .. } =
                    difference::judge(&batch, &reference, &run, precision, Bounds::of_splines(precision));
                print_test(&what, worst, bound, pass)?;
                sound &= pass;
            }
            Err(error) => {
                show(format_args!("  self-test {what}: FAILED, {error}"))?;
                sound = false;
            }
        }
    }
    Ok(sound)
}

/// Open and closed spirals of 3 to 200 points: every length a kernel may treat in its own way.
fn spirals() -> Result<CurveBatch> {
    let spiral = |n: usize| -> Vec<[f64; 2]> {
        let radius = |k: usize| 1.0 + 0.5 * (k as f64 * 0.7).sin();
        (0..n).map(|k| (k, (k as f64 * 0.4).sin_cos())).map(|(k, (s, c))| [radius(k) * c, radius(k) * s]).collect()
    };
    let curves: Vec<_> = (3..=200).map(spiral).collect();
    let slices: Vec<&[[f64; 2]]> = curves.iter().map(|curve| &curve[..]).collect();
    CurveBatch::from_slices(&slices)?.closed_each((0..curves.len()).map(|k| k % 2 == 1).collect())
}
