//! Discrete energies on the GPU against the CPU: values, slopes, gradients and Hessians, in f32 and
//! f64 against f64.

use faircurve::discrete::{Energy, Evaluate, attachment, bending, length, tautness, tension, torsion, variation};
use faircurve::{CurveBatch, Device};
use rand::RngExt;

use crate::common::batches::{self, walks};
use crate::common::conform::{Outcome, Unit, compare};
use crate::common::discrete::{Case, NO_WEIGHT, PARTS, Part};
use crate::common::{device, epsilon, precisions, seeded, tolerance};
use crate::elastica::elastica;

/// Vertices of curves around every block boundary, and some long ones.
fn sizes() -> Vec<usize> {
    (1..=40).chain(63..=66).chain([130, 257, 1000]).collect()
}

fn everything() -> Energy {
    length()
        + 0.3 * tension()
        + 0.2 * tautness()
        + bending(3.0)
        + 0.1 * variation()
        + 0.2 * torsion()
        + 2.0 * attachment()
}

#[test]
fn every_energy_of_walks_open_and_closed() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(300 + dimension as u64);
        let case = Case::new(walks(dimension, &sizes(), &mut rng), &mut rng);
        for energy in [length(), tension(), tautness(), bending(2.0), variation(), attachment()] {
            case.conforms("walks", &energy, &PARTS, &device);
        }
        if dimension == 3 {
            // A triangle is plane however its vertices are rounded, but not if its edges are.
            let batch = &case.batch;
            let is_triangle = |i: usize| batch.is_closed(i) && batch.count(i) == 3;
            let others: Vec<usize> = (0..batch.len()).filter(|&i| !is_triangle(i)).collect();
            Case::new(batch.select(&others), &mut rng).conforms("walks", &torsion(), &PARTS, &device);
        }
        case.clone().with_regularisation().conforms("walks with a regularisation", &everything(), &PARTS, &device);
    }
}

#[test]
fn bending_by_any_exponent() {
    let Some(device) = device() else { return };
    let mut rng = seeded(310);
    let case = Case::new(walks(2, &sizes(), &mut rng), &mut rng);
    for exponent in [1.0, 1.5, 2.5, 2.7, 3.3, 4.0, 7.1] {
        case.conforms("walks", &bending(exponent), &[Part::Value, Part::Gradient], &device);
        if exponent > 1.0 {
            // That of |T′ − T| is a difference of equal terms in a plane: 0 but for their rounding.
            case.conforms("walks", &bending(exponent), &[Part::Hessian], &device);
        }
    }
}

#[test]
fn long_smooth_curves_whose_curvature_is_a_difference_of_close_tangents() {
    let Some(device) = device() else { return };
    let wave = |n: usize| -> Vec<[f64; 3]> {
        let at = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        (0..n).map(|k| [at(k).cos(), 1.3 * at(k).sin(), 0.2 * (3.0 * at(k)).sin()]).collect()
    };
    let curves = [wave(40), wave(200), wave(1000), wave(40), wave(200), wave(1000)];
    let closed = (0..6).map(|i| i > 2).collect();
    let batch = CurveBatch::from_slices(&curves.each_ref().map(|c| &c[..])).unwrap().closed_each(closed).unwrap();
    let case = Case::new(batch, &mut seeded(320));
    for energy in [bending(2.0), variation(), torsion()] {
        case.conforms("smooth", &energy, &PARTS, &device);
    }
}

#[test]
fn nasty_curves_beside_each_other() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let batch = batches::nasty(dimension);
        let all = Case::new(batch.clone(), &mut seeded(330));
        // Energies in 1/length³ of curves of sizes 1e±100 and their derivatives are beyond f64 on
        // the CPU.
        let in_range: Vec<usize> = (0..batch.len()).filter(|&i| !batch.name(i).contains("the range of f32")).collect();
        let in_range = Case::new(batch.select(&in_range), &mut seeded(331));
        for energy in [length(), tension(), bending(2.0), variation(), everything()] {
            let case = if energy.to_string().contains("variation") { &in_range } else { &all };
            case.conforms("nasty", &energy, &[Part::Value, Part::Gradient], &device);
        }
    }
}

#[test]
fn a_permuted_batch_gives_the_same_bits() {
    let Some(device) = device() else { return };
    let mut rng = seeded(340);
    let batch = walks(3, &sizes(), &mut rng);
    let mut order: Vec<usize> = (0..batch.len()).collect();
    (1..order.len()).for_each(|k| order.swap(k, rng.random_range(0..=k)));
    let energy = bending(2.0) + variation() + 0.1 * length();
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        let device = device.clone().with_precision(precision);
        for part in PARTS {
            let found = |batch: CurveBatch| {
                let direction = batch.coords().iter().map(|x| x.cos()).collect();
                let (points, weights) = (batch.coords().to_vec(), vec![NO_WEIGHT; batch.total_points()]);
                Case { batch, regularisation: None, points, weights, direction }.outcome(&energy, part, &device)
            };
            let (here, there) = (found(batch.clone()), found(batch.select(&order)));
            for (to, &from) in order.iter().enumerate() {
                assert_eq!(here.bits(from), there.bits(to), "{part:?}, {precision:?}, curve {from}");
            }
        }
    }
}

#[test]
fn a_users_energy_is_evaluated_like_the_same_one_built_in() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(350);
        let case = Case::new(walks(dimension, &sizes(), &mut rng), &mut rng);
        let own = 0.7 * elastica() + 0.2 * length();
        let built_in = 0.7 * bending(2.0) + 0.2 * length();
        for part in PARTS {
            let units = case.units(&built_in, part);
            let wanted = case.outcome(&built_in, part, &Device::cpu());
            for device in [vec![Device::cpu()], both(&device)].concat() {
                let found = case.outcome(&own, part, &device);
                let epsilon = if device.as_gpu().is_some() { epsilon(device.precision()) } else { f64::EPSILON };
                let what = format!("a user's energy, {dimension}-D, {part:?}, {}", device.name());
                compare(&what, &found, &wanted, tolerance::DISCRETE, epsilon, Unit::Each(&units));
            }
        }
    }
}

/// A GPU in every precision it has.
fn both(device: &Device) -> Vec<Device> {
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    precisions.into_iter().map(|precision| device.clone().with_precision(precision)).collect()
}

#[test]
fn exponents_and_users_energies_are_composed_in_any_number() {
    let Some(device) = device() else { return };
    let mut rng = seeded(380);
    let case = Case::new(walks(2, &sizes(), &mut rng), &mut rng);
    let bends = bending(2.0) + 0.4 * bending(3.0) + 0.2 * bending(1.5) + 0.3 * bending(3.0);
    case.conforms("walks", &bends, &PARTS, &device);
    let own = 0.7 * elastica() + quotient(0.5);
    case.conforms("walks", &(own + 0.2 * elastica() + bends), &[Part::Value], &device);
}

#[test]
fn two_energies_of_one_name_are_refused_by_a_kernel_in_a_sentence() {
    let Some(device) = device() else { return };
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 0.0]][..]]).unwrap();
    let energy = quotient(0.5) + quotient(1.5);
    let error = energy.evaluate(&batch, Evaluate::default(), &device).unwrap_err().to_string();
    assert_eq!(error, "a kernel has something else called quotient: give each energy a name of its own");
}

/// (Δs/Δs′)^y: a power of any number.
fn quotient(exponent: f64) -> Energy {
    Energy::custom("quotient", 2, 0.0, |_, s| (s[0] / s[1]).powf(exponent))
}

#[test]
fn powers_of_any_positive_number_in_both_precisions() {
    let Some(device) = device() else { return };
    // Quotients over sixty decades, dense around 1.
    let decades = (-300..=300).map(|k| 0.1 * f64::from(k)).chain((-50..=50).map(|k| 1e-4 * f64::from(k * k * k)));
    let quotients: Vec<f64> = decades.map(|k| 10_f64.powf(k) * 1.037).filter(|x| *x > 1e-30 && *x < 1e30).collect();
    let (mut coords, mut offsets) = (vec![], vec![0]);
    for x in &quotients {
        // The short edge ends, or begins, at 0, where it keeps its digits.
        let vertices = if *x < 1.0 { [0.0, *x, 1.0 + x] } else { [-1.0, 0.0, 1.0 / x] };
        vertices.iter().for_each(|v| coords.extend([*v, 0.0]));
        offsets.push(coords.len() / 2);
    }
    let case = Case::new(CurveBatch::from_ragged(2, coords, offsets).unwrap(), &mut seeded(360));
    for exponent in [-2.5, -1.3, -0.35, 0.15, 0.5, 1.0, 1.35, 2.2, 3.55] {
        let energy = quotient(exponent);
        for device in both(&device) {
            let [found, wanted] = [&device, &Device::cpu()].map(|d| case.outcome(&energy, Part::Value, d));
            let is_single = epsilon(device.precision()) > 1e-10;
            // Results in the range of f32; and in f32 edges whose squares are.
            let reach = if is_single { 17.0 } else { 30.0 };
            let is_kept = |i: &usize| wanted.values[*i].log10().abs() < 36.0 && quotients[*i].log10().abs() < reach;
            let keep: Vec<usize> = (0..quotients.len()).filter(is_kept).collect();
            let kept = |outcome: &Outcome| Outcome::of_numbers(keep.iter().map(|&i| outcome.values[i]).collect());
            let logarithm = |i: usize| if is_single { (exponent * quotients[i].log2()).abs() } else { 0.0 };
            let unit = |&i: &usize| wanted.values[i] * (1.0 + exponent.abs()) * (1.0 + logarithm(i));
            let units: Vec<f64> = keep.iter().map(unit).collect();
            let what = format!("x^{exponent}, {}", device.precision().word());
            compare(
                &what,
                &kept(&found),
                &kept(&wanted),
                tolerance::POWER,
                epsilon(device.precision()),
                Unit::Each(&units),
            );
        }
    }
}
