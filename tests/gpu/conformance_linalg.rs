//! The tridiagonal kernels against the CPU, and against their twins.

use faircurve::linalg::ring::{RingKernel, Row, solve_lanes, solve_long, solve_on_gpu};
use faircurve::linalg::{Cyclic, Matrix, Real, Solutions, TridiagonalBatch, solve_tridiagonal_batch};
use faircurve::spline::{EndCondition, Knotted, Piecewise};
use faircurve::{CurveStatus, Device, Precision};
use rand::RngExt;

use crate::common::batches::sizes;
use crate::common::conform::{Outcome, Unit, compare, conform};
use crate::common::{device, precisions, seeded, tolerance};

const KERNELS: [RingKernel; 4] = [RingKernel::Auto, RingKernel::Workgroup, RingKernel::Thread, RingKernel::Long];

/// A ragged batch; networks where `lower` is empty, with the excess as diagonal and the weights as
/// upper band. All numbers are exact in f32, so that both precisions solve the same systems.
struct Systems<T> {
    lower: Vec<T>,
    diagonal: Vec<T>,
    upper: Vec<T>,
    offsets: Vec<usize>,
    cyclic: Vec<bool>,
    rhs: Vec<T>,
    columns: usize,
}

impl<T: Real> Systems<T> {
    /// Of these sizes, each one open and one cyclic.
    fn new(network: bool, sizes: &[usize], columns: usize, seed: u64) -> Self {
        let mut rng = seeded(seed);
        let exact = |x: f64| T::from_f64(f64::from(x as f32));
        let (mut lower, mut diagonal, mut upper, mut rhs, mut offsets) = (vec![], vec![], vec![], vec![], vec![0]);
        for n in sizes.iter().flat_map(|&n| [n, n]) {
            for _ in 0..n {
                if network {
                    // Ten decades, and an excess in few rows only.
                    let excess = 10_f64.powf(rng.random_range(-5.0..5.0));
                    diagonal.push(exact(if rng.random_range(0..4) == 0 { excess } else { 0.0 }));
                    upper.push(exact(10_f64.powf(rng.random_range(-5.0..5.0))));
                    rhs.extend((0..columns).map(|_| exact(rng.random_range(0.0..1.0))));
                } else {
                    let (l, u): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                    lower.push(exact(l));
                    upper.push(exact(u));
                    diagonal.push(exact(l.abs() + u.abs() + rng.random_range(0.3..1.3)));
                    rhs.extend((0..columns).map(|_| exact(rng.random_range(-1.0..1.0))));
                }
            }
            if network {
                let (first, last) = (diagonal.len() - n, diagonal.len() - 1);
                diagonal[rng.random_range(first..=last)] = exact(rng.random_range(0.1..1.0));
            }
            offsets.push(diagonal.len());
        }
        let cyclic = (0..2 * sizes.len()).map(|i| i % 2 == 1).collect();
        Systems { lower, diagonal, upper, offsets, cyclic, rhs, columns }
    }

    fn batch(&self) -> TridiagonalBatch<'_, T> {
        let matrix = match self.lower.is_empty() {
            true => Matrix::Network { excess: &self.diagonal, weights: &self.upper },
            false => Matrix::Bands { lower: &self.lower, diagonal: &self.diagonal, upper: &self.upper },
        };
        TridiagonalBatch { matrix, offsets: &self.offsets, cyclic: Cyclic::Each(&self.cyclic) }
    }

    fn solve(&self, kernel: RingKernel, device: &Device) -> Outcome {
        let (systems, rhs) = (self.batch(), &self.rhs);
        self.outcome(match device.as_gpu() {
            None => solve_tridiagonal_batch(&systems, rhs, self.columns, device).unwrap(),
            Some(gpu) => solve_on_gpu(gpu, device.precision(), kernel, &systems, rhs, self.columns).unwrap(),
        })
    }

    fn outcome(&self, solutions: Solutions<T>) -> Outcome {
        let name = |i| format!("{i} of {} rows", self.offsets[i + 1] - self.offsets[i]);
        Outcome {
            values: solutions.x.iter().map(|x| x.to_f64()).collect(),
            offsets: self.offsets.iter().map(|row| row * self.columns).collect(),
            names: (0..solutions.status.len()).map(name).collect(),
            status: solutions.status,
            along: vec![],
        }
    }

    /// The rows of system `i` for one column, as the kernels form them.
    fn rows(&self, i: usize, column: usize) -> Vec<Row<T>> {
        let (first, end, cyclic) = (self.offsets[i], self.offsets[i + 1], self.cyclic[i]);
        let network = self.lower.is_empty();
        let row = |k: usize| {
            let (has_left, has_right) = (cyclic || k > first, cyclic || k + 1 < end);
            let next = if k + 1 < end { k + 1 } else { first };
            let pick = |there: bool, x: T| if there { x } else { T::ZERO };
            let (left, right) = match network {
                true => (pick(has_left, self.upper[k]), pick(has_right, self.upper[next])),
                false => (pick(has_left, -self.lower[k]), pick(has_right, -self.upper[k])),
            };
            let excess = if network { self.diagonal[k] } else { self.diagonal[k] - left - right };
            Row { excess, left, right, rhs: self.rhs[k * self.columns + column] }
        };
        (first..end).map(row).collect()
    }
}

#[test]
fn every_kernel_solves_bands_of_every_size_open_and_cyclic() {
    let Some(device) = device() else { return };
    for columns in [1, 3] {
        let systems = Systems::<f64>::new(false, &sizes(), columns, columns as u64);
        for kernel in KERNELS {
            let what = format!("bands, {kernel:?}, {columns} columns");
            conform(&what, &device, tolerance::BANDS, Unit::Largest, |device| systems.solve(kernel, device));
        }
    }
    // Three columns at once and two more.
    let systems = Systems::<f64>::new(false, &(1..=40).collect::<Vec<_>>(), 5, 5);
    let solve = |device: &Device| systems.solve(RingKernel::Auto, device);
    conform("bands, 5 columns", &device, tolerance::BANDS, Unit::Largest, solve);
}

#[test]
fn every_kernel_keeps_every_unknown_of_networks_over_ten_decades() {
    let Some(device) = device() else { return };
    let systems = Systems::<f64>::new(true, &sizes(), 2, 11);
    for kernel in [RingKernel::Auto, RingKernel::Thread, RingKernel::Long] {
        let what = format!("networks, {kernel:?}");
        conform(&what, &device, tolerance::NETWORK, Unit::Value, |device| systems.solve(kernel, device));
    }
}

#[test]
fn networks_without_excess_have_the_solution_of_mean_zero_or_none() {
    let Some(device) = device() else { return };
    let sizes = [1, 2, 3, 7, 8, 9, 64, 100];
    let mut systems = Systems::<f64>::new(true, &sizes, 2, 21);
    // Every second pair of systems is free; of those, every second pair has no solution.
    for i in (0..2 * sizes.len()).filter(|i| i / 2 % 2 == 0) {
        let rows = systems.offsets[i]..systems.offsets[i + 1];
        systems.diagonal[rows.clone()].fill(0.0);
        for column in 0..2 {
            let total: f64 = rows.clone().skip(1).map(|row| systems.rhs[2 * row + column]).sum();
            systems.rhs[2 * rows.start + column] = if i / 4 % 2 == 0 { -total } else { 1.0 };
        }
    }
    let cpu = systems.solve(RingKernel::Auto, &Device::cpu());
    for status in [CurveStatus::Converged, CurveStatus::NotUnique, CurveStatus::Invalid] {
        assert!(cpu.status.contains(&status), "{status:?} is not among {:?}", cpu.status);
    }
    for kernel in [RingKernel::Auto, RingKernel::Thread, RingKernel::Long] {
        let what = format!("free networks, {kernel:?}");
        conform(&what, &device, tolerance::NETWORK, Unit::Largest, |device| systems.solve(kernel, device));
    }
}

#[test]
fn kernels_and_their_twins_agree_in_f32() {
    let Some(device) = device() else { return };
    let device = device.with_precision(Precision::F32);
    for network in [false, true] {
        let systems = Systems::<f32>::new(network, &sizes(), 1, 31);
        for kernel in KERNELS {
            let twin = |rows: &[Row<f32>]| match (kernel, rows.len()) {
                (RingKernel::Thread, _) => solve_lanes(rows, 1),
                (RingKernel::Long, n) => solve_long(rows, 32, if n.div_ceil(32) <= 256 { 8 } else { 128 }),
                (_, ..=256) => solve_lanes(rows, 8),
                (RingKernel::Workgroup, ..=1024) => solve_lanes(rows, 32),
                (_, ..=4096) => solve_lanes(rows, 128),
                _ => solve_long(rows, 32, 8),
            };
            let (mut x, mut status) = (Vec::new(), Vec::new());
            for i in 0..systems.cyclic.len() {
                let (solution, singular) = twin(&systems.rows(i, 0));
                x.extend(solution);
                status.push(if singular { CurveStatus::NotUnique } else { CurveStatus::Converged });
            }
            let twin = systems.outcome(Solutions { x, status });
            let what = format!("twin of {kernel:?}, network {network}");
            let found = systems.solve(kernel, &device);
            compare(&what, &found, &twin, tolerance::TWIN, f64::from(f32::EPSILON), Unit::Largest);
        }
    }
}

#[test]
fn the_device_given_does_the_work_in_the_precision_asked_for() {
    let Some(device) = device() else { return };
    let gpu = device.as_gpu().unwrap();
    let systems = Systems::<f64>::new(false, &[5, 40, 300], 2, 23);
    let batch = systems.batch();
    let solve = |device: &Device| solve_tridiagonal_batch(&batch, &systems.rhs, systems.columns, device).unwrap();
    let of_f32 = |x: &[f64]| x.iter().all(|&x| f64::from(x as f32) == x);
    assert!(!of_f32(&solve(&Device::cpu()).x), "the CPU computes in the type given");
    let mut asked = precisions(gpu);
    asked.push(Precision::Auto);
    for precision in asked {
        let found = solve(&device.clone().with_precision(precision));
        let kernel = if precision == Precision::Auto && gpu.summary().has_f64 { Precision::F64 } else { precision };
        let direct = solve_on_gpu(gpu, kernel, RingKernel::Auto, &batch, &systems.rhs, systems.columns).unwrap();
        assert_eq!(found, direct, "{precision:?}");
        assert_eq!(of_f32(&found.x), kernel != Precision::F64, "{precision:?}");
    }
    let systems = Systems::<f32>::new(true, &[5, 40, 300], 1, 24);
    let (batch, auto) = (systems.batch(), device.clone().with_precision(Precision::Auto));
    let found = solve_tridiagonal_batch(&batch, &systems.rhs, 1, &auto).unwrap();
    assert_eq!(found, solve_on_gpu(gpu, Precision::F32, RingKernel::Auto, &batch, &systems.rhs, 1).unwrap());
}

/// Splines of 2 to 70 knots by every condition, in f64: not-a-knot rows are not dominated by their
/// diagonals.
#[test]
fn splines_by_any_conditions_are_the_cpus() {
    let Some(gpu) = device() else { return };
    if !precisions(gpu.as_gpu().expect("a GPU")).contains(&Precision::F64) {
        return;
    }
    let mut rng = seeded(21);
    let (mut x, mut offsets) = (Vec::new(), vec![0]);
    for n in 2..=70 {
        let mut at: f64 = 0.0;
        x.extend((0..n).map(|_| {
            at += rng.random_range(0.05..2.0);
            at
        }));
        offsets.push(x.len());
    }
    let mut y: Vec<f64> = (0..x.len() * 3).map(|_| rng.random_range(-1.0..1.0)).collect();
    for pair in offsets.windows(2) {
        y.copy_within(3 * pair[0]..3 * pair[0] + 3, 3 * (pair[1] - 1));
    }
    let given: Vec<f64> = (0..69 * 3).map(|_| rng.random_range(-1.0..1.0)).collect();
    for (periodic, ends) in [
        (false, [EndCondition::NotAKnot; 2]),
        (false, [EndCondition::First(&given), EndCondition::Second(&given)]),
        (true, [EndCondition::NotAKnot; 2]),
    ] {
        let knotted = Knotted { x: &x, offsets: &offsets, y: &y, columns: 3, periodic };
        let [cpu, gpu] = [Device::cpu(), gpu.clone().with_precision(Precision::F64)]
            .map(|device| Piecewise::cubic(&knotted, &ends, &device).unwrap());
        for i in 0..69 {
            let [a, b] = [&cpu, &gpu].map(|splines| splines.coefficients(i));
            let largest = a.iter().fold(1.0, |largest: f64, c| largest.max(c.abs()));
            let error = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest;
            assert!(error <= 1e-12, "{ends:?}, periodic {periodic}, {} knots: {error:e}", i + 2);
        }
    }
}
