//! The exact rule without borders: its closed form, its decay, and the bounded rule as its
//! reflections.

use std::f64::consts::PI;

use faircurve_papers::unbounded::{UnboundedMask, potential, reflected, unbounded_weight};
use num_rational::BigRational;
use serde_json::Value;

fn ratio(p: i64, q: i64) -> BigRational {
    BigRational::new(p.into(), q.into())
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

fn oracle() -> Value {
    serde_json::from_str(include_str!("../../../tests/data/laplacian_splines.json")).unwrap()
}

#[test]
fn closed_forms_are_those_known() {
    let pair = |x: faircurve_papers::unbounded::Closed| (x.rational, x.over_pi);
    assert_eq!(pair(potential(0, 0)), (ratio(0, 1), ratio(0, 1)));
    assert_eq!(pair(potential(1, 0)), (ratio(1, 4), ratio(0, 1)));
    assert_eq!(pair(potential(0, -2)), (ratio(1, 1), ratio(-2, 1)));
    assert_eq!(pair(potential(-2, 1)), (ratio(-1, 4), ratio(2, 1)));
    assert_eq!(pair(potential(3, 3)), (ratio(0, 1), ratio(1, 1) + ratio(1, 3) + ratio(1, 5)));
    assert_eq!(pair(unbounded_weight(0, 0)), (ratio(4, 1), ratio(-8, 1)));
    for beside in [unbounded_weight(1, 0), unbounded_weight(-1, 0), unbounded_weight(0, 1), unbounded_weight(0, -1)] {
        assert_eq!(pair(beside), (ratio(3, 1), ratio(-8, 1)));
    }
    let mask = UnboundedMask::of_radius(1);
    // Rounded once, where 4.0 - 8.0 / PI has two roundings.
    assert_eq!(mask.weight(0, 0), "1.453520910529674627697859786033977".parse::<f64>().unwrap());
    assert!((mask.weight(0, -1) - (3.0 - 8.0 / PI)).abs() < 1e-15);
    assert_eq!(mask.weight(2, 0), 0.0);
    let known = &oracle()["unbounded_exact_mask"];
    for (place, x, y) in [("0,0", 0, 0), ("1,0", 1, 0)] {
        assert!((mask.weight(x, y) - known[place].as_f64().unwrap()).abs() < 1e-15, "{place}");
    }
}

#[test]
fn the_potential_is_harmonic_and_grows_like_the_logarithm() {
    for (x, y) in [(1, 0), (1, 1), (5, 2), (7, 7), (20, 13)] {
        let around = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(i, j)| potential(x + i, y + j));
        let rational: BigRational = around.iter().map(|a| &a.rational).sum();
        let over_pi: BigRational = around.iter().map(|a| &a.over_pi).sum();
        let here = potential(x, y);
        assert_eq!((rational, over_pi), (here.rational * ratio(4, 1), here.over_pi * ratio(4, 1)), "{x}, {y}");
    }
    // ln |x| / 2π + (γ + ln 8 / 2) / 2π (Spitzer's kernel is four times this), with an error like
    // |x|⁻².
    let gamma = 0.577_215_664_901_532_9;
    for (x, y) in [(64, 0), (60, 60), (100, 31)] {
        let distance = f64::hypot(x as f64, y as f64);
        let expected = (distance.ln() + gamma + 8.0f64.ln() / 2.0) / (2.0 * PI);
        assert!((potential(x, y).value() - expected).abs() < 0.03 / distance.powi(2), "{x}, {y}");
    }
}

#[test]
fn the_mask_is_the_inverse_transform_of_its_symbol() {
    // On a torus of N × N points, whose images are N away: an error like N⁻⁴.
    let size = 256;
    let angle = |k: i32| 2.0 * PI * f64::from(k) / f64::from(size);
    let lambda = |x: f64, y: f64| 4.0 - 2.0 * x.cos() - 2.0 * y.cos();
    let mask = UnboundedMask::of_radius(12);
    for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (5, 3), (12, 0), (12, 12)] {
        let mut sum = 4.0;
        for (k, l) in (0..size).flat_map(|k| (0..size).map(move |l| (k, l))).skip(1) {
            let (x, y) = (angle(k), angle(l));
            sum += lambda(2.0 * x, 2.0 * y) / lambda(x, y) * (x * f64::from(i) + y * f64::from(j)).cos();
        }
        let error = sum / f64::from(size * size) - mask.weight(i as isize, j as isize);
        assert!(error.abs() < 10.0 / f64::from(size).powi(4), "{i}, {j}: {error}");
    }
}

#[test]
fn every_entry_out_to_radius_64_satisfies_the_equations() {
    let mask = UnboundedMask::of_radius(64);
    for (i, j) in (-63..=63isize).flat_map(|i| (-63..=63isize).map(move |j| (i, j))) {
        let around: f64 = [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().map(|(x, y)| mask.weight(i + x, j + y)).sum();
        let energy = match (i, j) {
            (0, 0) => 4.0,
            (2 | -2, 0) | (0, 2 | -2) => -1.0,
            _ => 0.0,
        };
        // Relative to the entry: far ones are not what rounding has left of near ones.
        let scale = 8.0 * mask.weight(i, j).abs() + around.abs();
        assert!(
            (4.0 * mask.weight(i, j) - around - energy).abs() < 1e-14 * (scale + mask.weight(i, j + 1).abs()),
            "{i}, {j}"
        );
    }
}

#[test]
fn the_mask_decays_like_the_fourth_power_of_the_distance_and_not_exponentially() {
    let mask = UnboundedMask::of_radius(64);
    let scaled = |i: isize, j: isize| mask.weight(i, j) * ((i * i + j * j) as f64).powi(2);
    let all = (-64..=64).flat_map(|i| (-64..=64).map(move |j| (i, j)));
    let largest = all.map(|(i, j)| scaled(i, j).abs()).fold(0.0, f64::max);
    assert!(largest < 2.74, "{largest}");
    // −(6/π) cos 4φ, and what follows falls with the square of the distance.
    for r in [8, 16, 32, 64] {
        let left = 12.0 / (r * r) as f64;
        assert!((scaled(r, 0) + 6.0 / PI).abs() < left, "{r}: {}", scaled(r, 0));
        assert!((scaled(r, r) - 6.0 / PI).abs() < left / 2.0, "{r}: {}", scaled(r, r));
    }
    // Whatever falls exponentially falls by the same factor over the same distance.
    let factor = |r: isize| mask.weight(r + 16, 0) / mask.weight(r, 0);
    assert!(factor(16) < 0.1 && factor(48) > 0.3, "{} {}", factor(16), factor(48));
}

#[test]
fn the_weights_of_a_new_point_have_sum_one() {
    let mask = UnboundedMask::of_radius(64);
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let coarse = (-31..=31).flat_map(|a| (-31..=31).map(move |b| (a, b)));
        let sum: f64 = coarse.map(|(a, b)| mask.weight(i - 2 * a, j - 2 * b)).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{i}, {j}: {sum}");
    }
}

/// The largest error of all entries of the matrix from n × n to 2n × 2n intervals.
fn reflection_error(mask: &UnboundedMask, matrix: &[f64], n: usize) -> f64 {
    let (coarse, fine) = (n + 1, 2 * n + 1);
    assert_eq!(matrix.len(), (coarse * fine).pow(2));
    let error = |(number, exact): (usize, &f64)| {
        let (row, column) = (number / coarse.pow(2), number % coarse.pow(2));
        let weight = reflected(mask, [row / fine, row % fine], [column / coarse, column % coarse], [n, n]);
        (weight - exact).abs()
    };
    matrix.iter().enumerate().map(error).fold(0.0, f64::max)
}

#[test]
fn reflections_of_the_mask_make_the_exact_rule_of_bounded_grids() {
    let oracle = oracle();
    for (name, n) in [("3x3", 2), ("5x5", 4)] {
        let matrix = numbers(&oracle["exact_subdivision"][name]);
        let mut last = f64::INFINITY;
        for radius in [8, 16, 32, 64] {
            let error = reflection_error(&UnboundedMask::of_radius(radius), &matrix, n);
            // The images left out, −(6/π) cos 4φ / |x|⁴ at 1 / 4n² a point outside the square: 1 /
            // (2π n² R²), once it is large for the grid.
            let tail = 1.0 / (2.0 * PI * (n * n * radius * radius) as f64);
            assert!(error < last / 3.9, "{name}, {radius}: {error} after {last}");
            let allowed = if radius >= 8 * n { 1.02 } else { 4.1 };
            assert!(error < allowed * tail, "{name}, {radius}: {error} of {tail}");
            last = error;
        }
    }
    // The column of a corner, of a grid of 9 × 9 points, and the rule of its middle.
    let large = &oracle["exact_subdivision"]["9x9"];
    let mask = UnboundedMask::of_radius(64);
    let corner = numbers(&large["corner_column_5x5"]);
    let middle = numbers(&large["centre_vertex_rule"]);
    assert_eq!((corner.len(), middle.len()), (25, 81));
    for (number, exact) in corner.iter().enumerate() {
        assert!((reflected(&mask, [number / 5, number % 5], [0, 0], [8, 8]) - exact).abs() < 1e-6);
    }
    for (number, exact) in middle.iter().enumerate() {
        assert!((reflected(&mask, [8, 8], [number / 9, number % 9], [8, 8]) - exact).abs() < 1e-6);
    }
}
