//! The bits of a curve on a GPU depend on nothing but the curve: not on its neighbours, their
//! order, or the chunks.

use faircurve::gpu::Gpu;
use faircurve::gpu::plan::Limits;
use faircurve::spline::{Natural, uniform};
use faircurve::{CurveBatch, Device, Sampling};
use rand::RngExt;

use crate::common;
use crate::common::batches::{self, walks};
use crate::common::conform::{Outcome, Unit, conform};
use crate::common::{device, gpu, precisions, seeded, tolerance};

/// Sizes of four kernels.
const SIZES: [usize; 14] = [1, 2, 3, 4, 7, 8, 9, 15, 16, 17, 20, 30, 33, 257];

type Operation = (&'static str, fn(&CurveBatch, &Device) -> Outcome);

/// Everything that has kernels, with statuses where there are any.
const OPERATIONS: [Operation; 6] = [
    ("spline, so many a span", |batch, device| sampled(batch, Sampling::PerSpan(3), device)),
    ("spline, so many a curve", |batch, device| sampled(batch, Sampling::Count(20), device)),
    ("spline, by arc length", |batch, device| sampled(batch, Sampling::Spacing(0.7371), device)),
    ("coefficients", |batch, device| Outcome::of_batch(&uniform::coefficients(batch, device).unwrap())),
    ("subdivision", |batch, device| Outcome::of_batch(&uniform::subdivide(batch, 2, device).unwrap())),
    ("energies", |batch, device| Outcome::of_numbers(uniform::exact_energies(batch, device).unwrap())),
];

fn sampled(batch: &CurveBatch, sampling: Sampling, device: &Device) -> Outcome {
    let (fit, samples) = Natural::default().fit_sampled(batch, sampling, device).unwrap();
    match sampling {
        Sampling::Count(_) => Outcome::of_even_samples(&fit, &samples),
        _ => Outcome::of_curves(&samples, fit.reports()),
    }
}

/// The CPU, and the GPU in every precision.
fn all(device: &Device) -> Vec<Device> {
    let precisions = precisions(device.as_gpu().expect("a GPU")).into_iter();
    [Device::cpu()].into_iter().chain(precisions.map(|precision| device.clone().with_precision(precision))).collect()
}

fn describe(operation: &str, device: &Device) -> String {
    format!("{operation}, {}, {}", device.name(), device.precision().word())
}

fn batch() -> CurveBatch {
    walks(2, &SIZES, &mut seeded(201))
}

#[test]
fn a_permuted_batch_gives_the_same_bits() {
    let Some(device) = device() else { return };
    let batch = batch();
    let mut rng = seeded(202);
    let mut order: Vec<usize> = (0..batch.len()).collect();
    (1..order.len()).for_each(|k| order.swap(k, rng.random_range(0..=k)));
    let permuted = batch.select(&order);
    for device in all(&device) {
        for (name, operation) in OPERATIONS {
            let (here, there) = (operation(&batch, &device), operation(&permuted, &device));
            for (to, &from) in order.iter().enumerate() {
                let what = describe(name, &device);
                assert_eq!(there.bits(to), here.bits(from), "{what}, curve {from} at place {to}");
            }
        }
    }
}

#[test]
fn a_second_run_gives_the_same_bits() {
    let Some(device) = device() else { return };
    let batch = batch();
    for device in all(&device) {
        for (name, operation) in OPERATIONS {
            let (first, second) = (operation(&batch, &device), operation(&batch, &device));
            (0..batch.len()).for_each(|i| assert_eq!(first.bits(i), second.bits(i), "{}", describe(name, &device)));
        }
    }
}

#[test]
fn bad_neighbours_change_no_bits() {
    let Some(device) = device() else { return };
    let batch = batch();
    let mut coords = batch.coords().to_vec();
    let victims: Vec<usize> = (0..batch.len()).skip(3).step_by(5).collect();
    for (k, &i) in victims.iter().enumerate() {
        // NaN, infinity, and numbers whose splines leave the range of f32 and of f64.
        let value = [f64::NAN, f64::INFINITY, 1e60, 1e300][k % 4];
        coords[batch.offsets()[i] * 2] = value;
    }
    let closed = (0..batch.len()).map(|i| batch.is_closed(i)).collect();
    let spoilt = CurveBatch::from_ragged(2, coords, batch.offsets().to_vec()).unwrap().closed_each(closed).unwrap();
    for device in all(&device) {
        for (name, operation) in OPERATIONS.into_iter().filter(|(name, _)| !name.contains("arc length")) {
            let (good, bad) = (operation(&batch, &device), operation(&spoilt, &device));
            for i in (0..batch.len()).filter(|i| !victims.contains(i)) {
                assert_eq!(good.bits(i), bad.bits(i), "{}, curve {i}", describe(name, &device));
            }
        }
    }
}

#[test]
fn a_neighbour_beyond_the_range_of_the_device_changes_no_bits() {
    let Some(device) = device() else { return };
    let all_curves = batches::nasty_parameters();
    let good: Vec<usize> = [0, 2, 6, 8].into();
    let alone = all_curves.select(&good);
    for device in all(&device) {
        for sampling in [Sampling::PerSpan(3), Sampling::Count(20)] {
            let (together, alone) = (sampled(&all_curves, sampling, &device), sampled(&alone, sampling, &device));
            for (to, &i) in good.iter().enumerate() {
                assert_eq!(together.bits(i), alone.bits(to), "{}, {}", all_curves.name(i), describe("spline", &device));
            }
        }
    }
}

/// A GPU that takes a few curves at a time.
fn narrow(gpu: Gpu) -> Gpu {
    let limits = Limits { chunk_bytes: 1000, binding_bytes: 20_000, ..*gpu.limits() };
    gpu.with_limits(limits)
}

#[test]
fn chunks_give_the_same_bits() {
    let (Some(device), Some(gpu)) = (device(), gpu()) else { return };
    let chunked = Device::from_gpu(narrow(gpu).with_poisoned_arrays());
    let batch = batch();
    let dispatches = |device: &Device| {
        let gpu = device.as_gpu().expect("it is one");
        gpu.capture(|| uniform::exact_energies(&batch, device)).unwrap().1.len()
    };
    let (few, many) = (dispatches(&Device::from_gpu(common::gpu().expect("as before"))), dispatches(&chunked));
    assert!(few == 1 && many > 10, "{few} and {many} chunks");
    for precision in precisions(device.as_gpu().expect("it is one")) {
        let (whole, chunked) = (device.clone().with_precision(precision), chunked.clone().with_precision(precision));
        for (name, operation) in OPERATIONS {
            let (whole, chunked) = (operation(&batch, &whole), operation(&batch, &chunked));
            (0..batch.len())
                .for_each(|i| assert_eq!(whole.bits(i), chunked.bits(i), "{name}, {precision:?}, curve {i}"));
        }
    }
}

#[test]
fn dispatches_in_two_dimensions_give_the_same_bits() {
    let (Some(device), Some(gpu)) = (device(), gpu()) else { return };
    // 60 workgroups of samples as 8 rows of up to 8.
    let limits = Limits { workgroups: 8, ..*gpu.limits() };
    let folded = Device::from_gpu(gpu.with_limits(limits).with_poisoned_arrays());
    let batch = batch();
    for (name, operation) in OPERATIONS {
        let (flat, folded) = (operation(&batch, &device), operation(&batch, &folded));
        (0..batch.len()).for_each(|i| assert_eq!(flat.bits(i), folded.bits(i), "{name}, curve {i}"));
    }
}

#[test]
fn without_subgroups_the_results_are_as_good() {
    let Some(gpu) = gpu() else { return };
    let device = Device::from_gpu(gpu.without_subgroups().with_poisoned_arrays());
    let batch = batch();
    for sampling in [Sampling::PerSpan(8), Sampling::Count(40)] {
        let name = format!("without subgroups, {sampling:?}");
        conform(&name, &device, tolerance::SPLINE, Unit::Size(2), |device| sampled(&batch, sampling, device));
    }
    let coefficients = |device: &Device| Outcome::of_batch(&uniform::coefficients(&batch, device).unwrap());
    conform("without subgroups, coefficients", &device, tolerance::UNIFORM, Unit::Size(2), coefficients);
}
