//! Curves under tension on the GPU are those of the CPU: the same statuses, and the same costs, since the host ends
//! every search in f64. What is told of a device is how many curves it did not bring to an end.

use faircurve::scf::Smooth;
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Fit, Precision};
use rand::RngExt;
use rand::rngs::StdRng;
use serde::Deserialize;

use crate::common::batches::countries;
use crate::common::{device, precisions, seeded};

/// Relative differences of costs: two searches end at decrements of up to 1e-10, and so some 1e-20 from the minimum,
/// and a cost of the CPU is good to 1e-12.
const COST: f64 = 1e-12;

fn taut(exponent: f64) -> Smooth {
    Smooth { exponent, tension: 1.0, ..Smooth::default() }
}

/// The GPU, in every precision that it has.
fn devices() -> Option<Vec<Device>> {
    let device = device()?;
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    Some(precisions.into_iter().map(|precision| device.clone().with_precision(precision)).collect())
}

/// Compares a fit with the CPU's; the share of curves that the CPU had to search.
fn compare(what: &str, batch: &CurveBatch, smooth: &Smooth, device: &Device, wanted: &Fit) -> f64 {
    let found = smooth.fit(batch, device).unwrap();
    assert!(found.device().is_gpu, "{}", found.device());
    let mut worst: f64 = 0.0;
    for (i, (found, wanted)) in found.reports().iter().zip(wanted.reports()).enumerate() {
        assert_eq!(
            found.status,
            wanted.status,
            "{what}, curve {i}, {}: {found:?} for {wanted:?}",
            device.precision().word()
        );
        if !wanted.energy.is_finite() || wanted.energy == 0.0 {
            assert_eq!(found.energy.to_bits(), wanted.energy.to_bits(), "{what}, curve {i}");
            continue;
        }
        let apart = (found.energy / wanted.energy - 1.0).abs();
        assert!(
            apart <= COST,
            "{what}, curve {i}, {}: costs are {apart:e} apart, {found:?} for {wanted:?}",
            device.precision().word()
        );
        worst = worst.max(apart);
    }
    let share = found.device().finished_on_cpu as f64 / batch.len() as f64;
    println!(
        "{what}, {}: costs {worst:.1e} apart, {share:.4} of the curves searched by the CPU",
        device.precision().word()
    );
    device.as_gpu().expect("a GPU").take_notes().iter().for_each(|note| println!("  {note}"));
    share
}

#[derive(Deserialize)]
struct Exact {
    closed: bool,
    nu: f64,
    tension: f64,
    points: Vec<[f64; 2]>,
    cost: f64,
}

#[test]
fn curves_under_tension_cost_as_in_fifty_digit_arithmetic() {
    let Some(devices) = devices() else { return };
    let rows: Vec<Exact> = serde_json::from_str(include_str!("../data/scf_tension.json")).unwrap();
    assert_eq!(rows.len(), 97);
    for device in &devices {
        let (mut worst, mut on_cpu): (f64, usize) = (0.0, 0);
        for row in &rows {
            let batch = CurveBatch::from_slices(&[&row.points[..]]).unwrap().closed(row.closed);
            let fit =
                Smooth { exponent: row.nu, tension: row.tension, ..Smooth::default() }.fit(&batch, device).unwrap();
            let report = &fit.reports()[0];
            assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
            let off = (report.energy / row.cost - 1.0).abs();
            assert!(off < COST, "ν = {}, {:?}, {}: off by {off:e}", row.nu, row.points, device.precision().word());
            worst = worst.max(off);
            on_cpu += fit.device().finished_on_cpu;
        }
        println!("{}: off by {worst:.1e}, {on_cpu} searched by the CPU", device.precision().word());
    }
}

#[test]
fn borders_under_tension_are_those_of_the_cpu_and_few_are_left_to_it() {
    let Some(devices) = devices() else { return };
    let borders = countries();
    for nu in [2.0, 20.0] {
        let wanted = taut(nu).fit(&borders, &Device::cpu()).unwrap();
        for device in &devices {
            let share = compare(&format!("borders, ν = {nu}"), &borders, &taut(nu), device, &wanted);
            let is_narrow = device.precision() == Precision::F32 && nu == 20.0;
            assert!(share <= if is_narrow { 0.08 } else { 0.005 }, "ν = {nu}, {}: {share}", device.precision().word());
        }
    }
}

/// Open and closed curves of 2 to 40 points with turns of any size, of mixed exponents.
fn ragged(rng: &mut StdRng) -> CurveBatch {
    let (mut coords, mut offsets, mut closed, mut exponents) = (Vec::new(), vec![0], Vec::new(), Vec::new());
    for i in 0..60usize {
        let (n, is_closed) = ([2, 3, 4, 5, 8, 13, 40][i % 7], i % 2 == 1 && i % 7 != 0);
        let (mut at, mut direction) = ([0.0f64, 0.0], 0.0f64);
        for k in 0..n {
            let turn = std::f64::consts::TAU * (k as f64 + rng.random_range(-0.4..0.4)) / n as f64;
            let radius = n as f64 / 6.0 * rng.random_range(0.6..1.4);
            direction += rng.random_range(-2.5..2.5);
            let length = 10f64.powf(rng.random_range(-0.5..0.5));
            at = [at[0] + length * direction.cos(), at[1] + length * direction.sin()];
            coords.extend(if is_closed { [radius * turn.cos(), radius * turn.sin()] } else { at });
            exponents.push([2.0, 1.5, 3.0, 20.0, f64::NAN][(i + k) % 5]);
        }
        offsets.push(coords.len() / 2);
        closed.push(is_closed);
    }
    let constraints = Constraints { exponents: Some(exponents), ..Constraints::default() };
    CurveBatch::from_ragged(2, coords, offsets)
        .unwrap()
        .closed_each(closed)
        .unwrap()
        .with_constraints(constraints)
        .unwrap()
}

#[test]
fn ragged_batches_of_mixed_exponents_end_as_on_the_cpu() {
    let Some(devices) = devices() else { return };
    let batch = ragged(&mut seeded(520));
    let wanted = taut(2.0).fit(&batch, &Device::cpu()).unwrap();
    for device in &devices {
        compare("ragged", &batch, &taut(2.0), device, &wanted);
    }
}

/// Repeated points, single ones, straight lines, hairpins, a scalene triangle, numbers that are none.
fn degenerate() -> CurveBatch {
    let lists: [(&[[f64; 2]], bool); 10] = [
        (&[[0.0, 0.0], [0.0, 0.0], [1.0, 0.5], [1.0, 0.5], [2.0, 0.0]], false),
        (&[[1.0, 1.0]], false),
        (&[[1.0, 1.0], [1.0, 1.0], [1.0, 1.0]], true),
        (&[[0.0, 0.0], [1.0, 0.5], [2.0, 1.0], [3.0, 1.5]], false),
        (&[[0.0, 0.0], [3.0, 1.0]], false),
        (&[[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]], false),
        (&[[0.0, 0.0], [1.0, 0.0], [0.3, 0.0]], true),
        (&[[0.0, 0.0], [2.0, 0.2], [0.7, 1.4]], true),
        (&[[0.0, 0.0], [f64::NAN, 0.2], [0.7, 1.4]], false),
        (&[[0.0, 0.0], [1e-9, 1.0], [1.0, 1e-9], [1e6, 1e-9]], false),
    ];
    let points: Vec<&[[f64; 2]]> = lists.iter().map(|(points, _)| *points).collect();
    CurveBatch::from_slices(&points).unwrap().closed_each(lists.iter().map(|(_, closed)| *closed).collect()).unwrap()
}

#[test]
fn degenerate_curves_under_tension_end_as_on_the_cpu() {
    let Some(devices) = devices() else { return };
    let batch = degenerate();
    for nu in [1.5, 2.0, 20.0] {
        let wanted = taut(nu).fit(&batch, &Device::cpu()).unwrap();
        for device in &devices {
            compare(&format!("degenerate, ν = {nu}"), &batch, &taut(nu), device, &wanted);
        }
    }
}

#[test]
fn a_bad_curve_leaves_its_neighbours_bits_unchanged() {
    let Some(devices) = devices() else { return };
    let good = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
    let bad = [[0.0, 0.0], [f64::INFINITY, 0.0], [1.0, 1.0]];
    let back = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]];
    let alone = CurveBatch::from_slices(&[&good[..]]).unwrap();
    let among = CurveBatch::from_slices(&[&bad[..], &back[..], &good[..], &bad[..]]).unwrap();
    for device in &devices {
        let alone = taut(3.0).fit(&alone, device).unwrap();
        let among = taut(3.0).fit(&among, device).unwrap();
        let statuses = among.reports().iter().map(|report| report.status).collect::<Vec<_>>();
        assert_eq!(statuses[0], CurveStatus::Invalid);
        assert_eq!(statuses[3], CurveStatus::Invalid);
        assert_eq!(alone.reports()[0], among.reports()[2], "{}", device.precision().word());
    }
}
