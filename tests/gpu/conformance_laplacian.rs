//! Grids subdivided on the GPU: the CPU's points and statuses, by both rules, alone and by the ten
//! thousand.

use std::time::Instant;

use faircurve::gpu::plan::Limits;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use faircurve::{CurveStatus, Device};
use rand::RngExt;
use rand::rngs::StdRng;

use crate::common::conform::{Outcome, Unit, compare, conform};
use crate::common::tolerance::LAPLACIAN;
use crate::common::{device, epsilon, gpu, precisions, seeded};

/// Shapes about which everything is told apart: points, lines, grids whose borders see each other
/// under one rule or another, one axis or both, and large ones.
const SHAPES: [[usize; 2]; 18] = [
    [1, 1],
    [1, 7],
    [2, 2],
    [2, 9],
    [3, 3],
    [4, 5],
    [7, 1],
    [6, 7],
    [7, 7],
    [8, 8],
    [9, 9],
    [11, 11],
    [12, 12],
    [13, 4],
    [3, 40],
    [40, 3],
    [9, 9],
    [33, 17],
];

fn sparse(support: usize, reproduces: Reproduces) -> Rule {
    Rule::Sparse(SparseRule::of_support(support, reproduces).unwrap())
}

/// The exact rule and every sparse one.
fn rules() -> Vec<(String, Rule)> {
    let mut rules = vec![("exact".to_string(), Rule::Exact)];
    for reproduces in [Reproduces::Constants, Reproduces::Linear] {
        for support in [3, 5, 7, 9, 11] {
            rules.push((format!("support {support}, {reproduces:?}"), sparse(support, reproduces)));
        }
    }
    rules
}

/// Noise, each grid of its own size and in its own place.
fn grids(dimension: usize, shapes: &[[usize; 2]], random: &mut StdRng) -> Grids {
    let mut values = Vec::new();
    for [rows, columns] in shapes {
        let size = 10_f64.powf(random.random_range(-6.0..6.0));
        let places: Vec<f64> = (0..dimension).map(|_| size * random.random_range(-3.0..3.0)).collect();
        for _ in 0..rows * columns {
            values.extend(places.iter().map(|place| place + size * random.random_range(-1.0..1.0)));
        }
    }
    Grids::new(dimension, shapes.to_vec(), values).unwrap()
}

/// The grids of these numbers, in this order.
fn select(grids: &Grids, numbers: &[usize]) -> Grids {
    let values = numbers.iter().flat_map(|&i| grids.grid(i)).copied().collect();
    Grids::new(grids.dimension(), numbers.iter().map(|&i| grids.shape(i)).collect(), values).unwrap()
}

fn fitted(rule: &Rule, rounds: u32, grids: &Grids, device: &Device) -> Outcome {
    let fine = Subdivide { rule: rule.clone(), rounds }.fit(grids, device).unwrap();
    let mut offsets = vec![0];
    (0..grids.len()).for_each(|i| offsets.push(offsets[i] + fine.grids().grid(i).len()));
    Outcome {
        values: fine.grids().values().to_vec(),
        offsets,
        status: fine.reports().iter().map(|report| report.status).collect(),
        names: (0..grids.len()).map(|i| format!("{i}, {:?}", grids.shape(i))).collect(),
        along: vec![],
    }
}

#[test]
fn every_rule_makes_the_cpus_points_of_grids_of_every_shape() {
    let Some(device) = device() else { return };
    let mut random = seeded(1500);
    for (k, (name, rule)) in rules().iter().enumerate() {
        for dimension in 1..=4 {
            // Of more rounds, each rule in one dimension, and the usual ones in all.
            let rounds: &[u32] = if k % 4 + 1 == dimension || [0, 2].contains(&k) { &[0, 1, 3] } else { &[1] };
            let grids = grids(dimension, &SHAPES, &mut random);
            for &rounds in rounds {
                let what = format!("{name}, {dimension} values a point, {rounds} rounds");
                conform(&what, &device, LAPLACIAN, Unit::Size(dimension), |device| {
                    fitted(rule, rounds, &grids, device)
                });
            }
        }
    }
}

#[test]
fn large_grids_and_many_rounds_lose_no_more() {
    let Some(device) = device() else { return };
    let mut random = seeded(1501);
    let mut check = |rules: &[(String, Rule)], shapes: &[[usize; 2]], rounds: u32| {
        let grids = grids(1, shapes, &mut random);
        for (name, rule) in rules {
            let what = format!("{:?} and others, {name}, {rounds} rounds", shapes[0]);
            conform(&what, &device, LAPLACIAN, Unit::Size(1), |device| fitted(rule, rounds, &grids, device));
        }
    };
    check(&rules(), &[[65, 129]], 1);
    check(&rules(), &[[5, 5], [3, 4], [2, 2]], 6);
    let some = [("exact".to_string(), Rule::Exact), ("support 11".to_string(), sparse(11, Reproduces::Constants))];
    check(&some, &[[129, 65]], 2);
    check(&some, &[[9, 9]], 6);
    check(&some, &[[5, 5]; 40], 6);
    check(&some, &[[2, 2]; 9], 7);
}

#[test]
fn a_grid_of_a_quarter_of_a_million_points_is_one_dispatch_a_step() {
    let Some(device) = device() else { return };
    let grids = grids(1, &[[513, 513]], &mut seeded(1502));
    let wanted = fitted(&Rule::Exact, 1, &grids, &Device::cpu());
    for precision in precisions(device.as_gpu().unwrap()) {
        let device = device.clone().with_precision(precision);
        let start = Instant::now();
        let found = fitted(&Rule::Exact, 1, &grids, &device);
        let what = format!("513 × 513, exact, {}, {}", device.name(), precision.word());
        println!("{what}: {:.2} s", start.elapsed().as_secs_f64());
        compare(&what, &found, &wanted, LAPLACIAN, epsilon(precision), Unit::Size(1));
    }
}

#[test]
fn ten_thousand_grids_are_subdivided_in_one_call() {
    let Some(device) = device() else { return };
    let grids = grids(1, &vec![[9, 9]; 10_000], &mut seeded(1503));
    for (name, rule) in [("support 5", sparse(5, Reproduces::Constants)), ("exact", Rule::Exact)] {
        let start = Instant::now();
        let wanted = fitted(&rule, 3, &grids, &Device::cpu());
        println!("10,000 grids of 9 × 9, 3 rounds, {name}, CPU: {:.2} s", start.elapsed().as_secs_f64());
        for precision in precisions(device.as_gpu().unwrap()) {
            let device = device.clone().with_precision(precision);
            let start = Instant::now();
            let found = fitted(&rule, 3, &grids, &device);
            let what = format!("10,000 grids of 9 × 9, 3 rounds, {name}, {}, {}", device.name(), precision.word());
            println!("{what}: {:.2} s", start.elapsed().as_secs_f64());
            compare(&what, &found, &wanted, LAPLACIAN, epsilon(precision), Unit::Size(1));
        }
    }
}

#[test]
fn bad_neighbours_change_no_bits_and_are_told() {
    let Some(device) = device() else { return };
    let mut random = seeded(1504);
    let grids = grids(2, &SHAPES, &mut random);
    // Between any two a bad one, or one far from the others in size.
    let (mut shapes, mut values) = (Vec::new(), Vec::new());
    for i in 0..grids.len() {
        shapes.push(grids.shape(i));
        values.extend_from_slice(grids.grid(i));
        let (shape, scale, spoilt) = match i % 7 {
            0 => ([3, 3], 1.0, Some(f64::NAN)),
            1 => ([9, 9], 1.0, Some(f64::NEG_INFINITY)),
            2 => ([0, 5], 1.0, None),
            3 => ([4, 4], 1e300, None),
            4 => ([9, 9], 1e-300, None),
            5 => ([5, 6], 0.0, None),
            _ => ([2, 2], 1e-305, None),
        };
        shapes.push(shape);
        let own = values.len();
        values.extend((0..2 * shape[0] * shape[1]).map(|_| scale * random.random_range(-1.0..1.0)));
        if let Some(spoilt) = spoilt {
            values[own + 5] = spoilt;
        }
    }
    let mixed = Grids::new(2, shapes, values).unwrap();
    for rule in [Rule::Exact, sparse(5, Reproduces::Constants), sparse(7, Reproduces::Linear)] {
        conform("bad neighbours", &device, LAPLACIAN, Unit::Size(2), |device| fitted(&rule, 2, &mixed, device));
        for precision in precisions(device.as_gpu().unwrap()) {
            let device = device.clone().with_precision(precision);
            let (alone, beside) = (fitted(&rule, 2, &grids, &device), fitted(&rule, 2, &mixed, &device));
            for i in 0..grids.len() {
                assert_eq!(alone.bits(i), beside.bits(2 * i), "grid {i}");
                let bad = beside.curve(2 * i + 1);
                let wanted = match i % 7 {
                    0 | 1 => CurveStatus::Invalid,
                    2 => CurveStatus::Degenerate,
                    _ => CurveStatus::Converged,
                };
                assert_eq!(beside.status[2 * i + 1], wanted);
                assert!(bad.iter().all(|x| x.is_finite() == wanted.is_usable()), "grid {i}: {bad:?}");
            }
        }
    }
}

#[test]
fn order_and_chunks_change_no_bits() {
    let Some(device) = device() else { return };
    let mut random = seeded(1505);
    let shapes: Vec<[usize; 2]> = SHAPES.iter().cycle().take(150).copied().collect();
    let grids = grids(3, &shapes, &mut random);
    let mut order: Vec<usize> = (0..grids.len()).collect();
    (1..order.len()).for_each(|k| order.swap(k, random.random_range(0..=k)));
    let permuted = select(&grids, &order);
    for rule in [Rule::Exact, sparse(3, Reproduces::Linear), sparse(9, Reproduces::Constants)] {
        for precision in precisions(device.as_gpu().unwrap()) {
            let device = device.clone().with_precision(precision);
            let limits = Limits { chunk_bytes: 1 << 20, ..*device.as_gpu().unwrap().limits() };
            let small = Device::from_gpu(gpu().unwrap().with_limits(limits)).with_precision(precision);
            let here = fitted(&rule, 2, &grids, &device);
            let (there, in_chunks) = (fitted(&rule, 2, &permuted, &device), fitted(&rule, 2, &grids, &small));
            for (to, &from) in order.iter().enumerate() {
                assert_eq!(there.bits(to), here.bits(from), "grid {from} at place {to}");
                assert_eq!(in_chunks.bits(from), here.bits(from), "grid {from} in a small chunk");
            }
        }
    }
}

#[test]
fn what_the_device_is_not_made_for_the_host_computes() {
    let Some(device) = device() else { return };
    let mut random = seeded(1506);
    let same = |what: &str, device: &Device, rule: &Rule, rounds: u32, grids: &Grids, hosts: &[usize]| {
        let (found, wanted) = (fitted(rule, rounds, grids, device), fitted(rule, rounds, grids, &Device::cpu()));
        let of_host: Vec<usize> = (0..grids.len()).filter(|&i| found.bits(i) == wanted.bits(i)).collect();
        assert_eq!(of_host, hosts, "{what}");
        compare(what, &found, &wanted, LAPLACIAN, epsilon(device.precision()), Unit::Size(grids.dimension()));
    };
    let device = device.with_precision(faircurve::Precision::F32);
    let support = sparse(5, Reproduces::Constants);
    // Sums longer than threads have patience for; as weighted sums of windows they are short.
    let long = grids(1, &[[3, 40_000], [4, 4], [40_000, 3], [3, 3]], &mut random);
    same("long sums", &device, &Rule::Exact, 1, &long, &[0, 2]);
    same("long grids", &device, &support, 1, &long, &[]);
    // More numbers than an array of the device holds, which are 1024.
    let limits = Limits { binding_bytes: 4096, ..*device.as_gpu().unwrap().limits() };
    let small = Device::from_gpu(gpu().unwrap().with_limits(limits)).with_precision(faircurve::Precision::F32);
    let large = grids(1, &[[3, 3], [17, 17], [16, 17], [4, 4]], &mut random);
    same("large grids", &small, &Rule::Exact, 1, &large, &[1]);
    // Nor do the stencils fit.
    same("large stencils", &small, &support, 1, &large, &[0, 1, 2, 3]);
}
