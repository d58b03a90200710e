//! Exact Laplacian subdivision is what the equations E₂ₙp = UEₙp₀, and reference values, say it is.

use faircurve::laplacian::{Grids, Rule, Subdivide, Subdivided, energy, residual};
use faircurve::{CurveStatus, Device};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

fn oracle() -> Value {
    serde_json::from_str(include_str!("../data/laplacian_splines.json")).unwrap()
}

fn exactly(grids: &Grids, rounds: u32) -> Subdivided {
    Subdivide { rule: Rule::Exact, rounds }.fit(grids, &Device::cpu()).unwrap()
}

/// One grid of heights, subdivided.
fn fine(shape: [usize; 2], heights: &[f64], rounds: u32) -> Vec<f64> {
    let subdivided = exactly(&Grids::uniform(1, shape, heights.to_vec()).unwrap(), rounds);
    assert_eq!(subdivided.usable(), 1);
    subdivided.grids().grid(0).to_vec()
}

fn random_heights(count: usize, seed: u64) -> Vec<f64> {
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-1.0..1.0)).collect()
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |worst, x| if x > worst || x.is_nan() { x } else { worst })
}

/// Column by column the subdivision matrix of a square grid: a batch of grids with a single 1.
fn columns(side: usize) -> Subdivided {
    let points = side * side;
    let mut values = vec![0.0; points * points];
    (0..points).for_each(|k| values[k * points + k] = 1.0);
    exactly(&Grids::uniform(1, [side, side], values).unwrap(), 1)
}

/// E of a grid as a matrix, written down from the report's rows.
fn energy_matrix([rows, columns]: [usize; 2]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(rows * columns, rows * columns);
    let mut edge = |a: usize, b: usize, weight: f64| {
        matrix[(a, a)] += weight;
        matrix[(b, b)] += weight;
        matrix[(a, b)] -= weight;
        matrix[(b, a)] -= weight;
    };
    for i in 0..rows {
        for j in 0..columns {
            let here = i * columns + j;
            if i + 1 < rows {
                edge(here, here + columns, if j == 0 || j + 1 == columns { 0.5 } else { 1.0 });
            }
            if j + 1 < columns {
                edge(here, here + 1, if i == 0 || i + 1 == rows { 0.5 } else { 1.0 });
            }
        }
    }
    matrix
}

/// Weights of points in the mean: half at borders, a quarter in corners, their sum 1.
fn mean_weights([rows, columns]: [usize; 2]) -> Vec<f64> {
    let end = |k: usize, count: usize| if k == 0 || k + 1 == count { 0.5 } else { 1.0 };
    let all = ((rows - 1) * (columns - 1)) as f64;
    (0..rows * columns).map(|k| end(k / columns, rows) * end(k % columns, columns) / all).collect()
}

fn mean(shape: [usize; 2], heights: &[f64]) -> f64 {
    mean_weights(shape).iter().zip(heights).map(|(weight, x)| weight * x).sum()
}

#[test]
fn subdivision_matrices_are_the_reference_s() {
    let oracle = oracle();
    let mut found = 0.0f64;
    for side in [3usize, 5] {
        let rows = oracle["exact_subdivision"][format!("{side}x{side}")].as_array().unwrap();
        let columns = columns(side);
        assert_eq!(rows.len(), (2 * side - 1) * (2 * side - 1));
        for (i, row) in rows.iter().enumerate() {
            let row: Vec<f64> = row.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            let own: Vec<f64> = (0..side * side).map(|j| columns.grids().grid(j)[i]).collect();
            found = found.max(worst(&own, &row));
        }
    }
    // The reference has 14 decimals.
    assert!(found <= 1e-12, "{found:e}");

    let nine = columns(9);
    let wanted = |name: &str| -> Vec<f64> {
        let rows = oracle["exact_subdivision"]["9x9"][name].as_array().unwrap();
        rows.iter().flat_map(|row| row.as_array().unwrap()).map(|x| x.as_f64().unwrap()).collect()
    };
    let corner: Vec<f64> = (0..25).map(|k| nine.grids().point(0, k / 5, k % 5)[0]).collect();
    found = found.max(worst(&corner, &wanted("corner_column_5x5")));
    let rounded = [0, 1, 2, 3].map(|k| (corner[k] * 1e4).round() / 1e4);
    assert_eq!(rounded, [1.4535, 0.4535, -0.1277, -0.0338], "as in the report");
    for (name, [row, column]) in
        [("centre_vertex_rule", [8, 8]), ("centre_edge_rule", [8, 9]), ("centre_face_rule", [9, 9])]
    {
        let rule: Vec<f64> = (0..81).map(|j| nine.grids().point(j, row, column)[0]).collect();
        found = found.max(worst(&rule, &wanted(name)));
    }
    println!("largest difference from the reference: {found:e}");
    assert!(found <= 1e-12, "{found:e}");
}

#[test]
fn grids_meet_the_equations_and_keep_their_mean_after_six_rounds() {
    for (shape, seed) in [([9, 9], 1), ([5, 12], 2), ([2, 2], 3), ([2, 17], 4), ([7, 3], 5)] {
        let heights = random_heights(shape[0] * shape[1], seed);
        for rounds in [1, 2, 6] {
            let fine = fine(shape, &heights, rounds);
            let largest = fine.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
            let off = residual(1, shape, &heights, &fine, rounds);
            // E has entries up to 4, each value is off by some roundings of the largest.
            assert!(off <= 64.0 * f64::EPSILON * largest, "{shape:?}, {rounds} rounds: {off:e} of {largest}");
            let refined = shape.map(|points| ((points - 1) << rounds) + 1);
            let moved = mean(refined, &fine) - mean(shape, &heights);
            assert!(moved.abs() <= 64.0 * f64::EPSILON, "{shape:?}, {rounds} rounds: the mean moves by {moved:e}");
        }
    }
}

#[test]
fn no_other_grid_with_the_same_old_points_or_under_the_same_load_has_less_energy() {
    let (shape, refined) = ([5, 4], [9, 7]);
    let heights = random_heights(20, 7);
    let solution = fine(shape, &heights, 1);
    let least = energy(1, refined, &solution);
    let matrix = energy_matrix(refined);
    let own = DVector::from_column_slice(&solution);
    assert!((own.dot(&(&matrix * &own)) - least).abs() <= 1e-13 * least, "two ways to the energy");
    let load = &matrix * &own;
    let mut random = StdRng::seed_from_u64(8);
    let (mut kept, mut loaded) = (f64::INFINITY, f64::INFINITY);
    for trial in 0..20_000 {
        let size = 10f64.powi(-(trial % 8));
        let other: Vec<f64> = solution.iter().map(|x| x + size * random.random_range(-1.0..1.0)).collect();
        // Changed at new points only.
        let new = |k: usize| k / 7 % 2 == 1 || k % 7 % 2 == 1;
        let same_points: Vec<f64> = (0..63).map(|k| if new(k) { other[k] } else { solution[k] }).collect();
        kept = kept.min(energy(1, refined, &same_points) - least);
        // Scaled so that the work of the load UEₙp₀ = E₂ₙp is the same.
        let other = DVector::from_vec(other);
        let scaled = &other * (own.dot(&load) / other.dot(&load));
        loaded = loaded.min(energy(1, refined, scaled.as_slice()) - least);
    }
    println!("least excess {kept:e} with the same old points, {loaded:e} under the same load");
    let rounding = 1e-13 * least;
    assert!(kept >= -rounding && loaded >= -rounding, "{kept:e}, {loaded:e}");
}

#[test]
fn a_dense_solve_of_33_by_33_points_agrees() {
    for (shape, seed) in [([17, 17], 9), ([9, 20], 10)] {
        let refined = shape.map(|points: usize| 2 * points - 1);
        let heights = random_heights(shape[0] * shape[1], seed);
        let mut matrix = energy_matrix(refined);
        let forces = energy_matrix(shape) * DVector::from_column_slice(&heights);
        let mut right = DVector::zeros(refined[0] * refined[1]);
        for (k, force) in forces.iter().enumerate() {
            right[2 * (k / shape[1]) * refined[1] + 2 * (k % shape[1])] = *force;
        }
        // E is singular: one row gives way to the mean, as in the report.
        for (k, weight) in mean_weights(refined).into_iter().enumerate() {
            matrix[(0, k)] = weight;
        }
        right[0] = mean(shape, &heights);
        let solved = matrix.lu().solve(&right).unwrap();
        let off = worst(solved.as_slice(), &fine(shape, &heights, 1));
        println!("{shape:?}: {off:e}");
        assert!(off <= 1e-10, "{shape:?}: {off:e}");
    }
}

#[test]
fn the_middle_of_a_large_grid_has_the_unbounded_mask() {
    let pi = std::f64::consts::PI;
    for side in [17usize, 33, 65, 129] {
        let mut heights = vec![0.0; side * side];
        heights[side * side / 2] = 1.0;
        let fine = fine([side, side], &heights, 1);
        let centre = (side - 1) * (2 * side - 1) + side - 1;
        // The borders' images are 2n, n, … away and weigh some |x|⁻⁴ each.
        let off = [fine[centre] - (4.0 - 8.0 / pi), fine[centre + 1] - (3.0 - 8.0 / pi)];
        let bound = 40.0 / (side as f64).powi(4);
        assert!(off.iter().all(|x| x.abs() < bound), "{side}: {off:?} against {bound:e}");
    }
}

#[test]
fn constants_stay_to_rounding_and_coordinates_do_not_mix() {
    let (shape, count) = ([6, 11], 66);
    let planes: Vec<Vec<f64>> =
        vec![random_heights(count, 11), vec![7.25; count], vec![1e9; count], random_heights(count, 12)];
    let values = (0..count).flat_map(|k| planes.iter().map(move |plane| plane[k])).collect();
    let together = exactly(&Grids::uniform(4, shape, values).unwrap(), 3);
    for (c, plane) in planes.iter().enumerate() {
        let alone = fine(shape, plane, 3);
        let own: Vec<f64> = together.grids().grid(0).iter().skip(c).step_by(4).copied().collect();
        assert!(own.iter().zip(&alone).all(|(a, b)| a.to_bits() == b.to_bits()), "coordinate {c}");
        if plane.iter().all(|x| *x == plane[0]) {
            let off = own.iter().map(|x| (x / plane[0] - 1.0).abs()).fold(0.0, f64::max);
            assert!(off <= 32.0 * f64::EPSILON, "coordinate {c}: {off:e}");
        }
    }
}

#[test]
fn bad_grids_have_a_status_and_a_sentence_and_their_neighbours_the_same_bits() {
    let good = random_heights(12, 13);
    let mut values = good.clone();
    values.extend([1.0, 2.0, f64::NAN, 4.0]);
    values.extend(&good);
    values.extend([f64::INFINITY]);
    values.extend([1e308, -1e308, 1.7e308, -1.7e308, 1e308, -1.7e308]);
    values.extend(&good);
    let shapes = vec![[3, 4], [2, 2], [4, 3], [1, 1], [3, 2], [0, 5], [3, 4]];
    let grids = Grids::new(1, shapes, values).unwrap().with_file(Some("hills.csv".into()));
    let subdivided = exactly(&grids, 2);
    use CurveStatus::{Converged, Degenerate, Invalid};
    let status: Vec<CurveStatus> = subdivided.reports().iter().map(|report| report.status).collect();
    assert_eq!(status, [Converged, Invalid, Converged, Invalid, Invalid, Degenerate, Converged]);
    let says = |i: usize, words: &str| {
        let message = subdivided.reports()[i].message.as_deref().unwrap_or("nothing");
        assert!(message.contains(words), "{i}: {message}");
    };
    says(1, "hills.csv, grid 1: the value in row 1, column 0 (counted from 0) is NaN; all must be finite: mend it");
    says(3, "grid 3: the value in row 0, column 0 (counted from 0) is inf");
    says(4, "grid 4: sums of its values overflow: give smaller numbers");
    says(5, "grid 5 has no points: give it some");
    assert_eq!(subdivided.grids().shapes(), [[9, 13], [5, 5], [13, 9], [1, 1], [9, 5], [0, 17], [9, 13]]);
    for i in [1, 3, 4] {
        assert!(subdivided.grids().grid(i).iter().all(|x| x.is_nan()), "{i}");
    }
    assert_eq!(subdivided.usable(), 3);
    let alone = fine([3, 4], &good, 2);
    for i in [0, 6] {
        assert!(subdivided.grids().grid(i).iter().zip(&alone).all(|(a, b)| a.to_bits() == b.to_bits()), "{i}");
    }
}

#[test]
fn one_row_is_interpolated_one_point_copied_and_no_round_changes_nothing() {
    assert_eq!(fine([1, 3], &[0.0, 2.0, -1.0], 1), [0.0, 1.0, 2.0, 0.5, -1.0]);
    assert_eq!(fine([3, 1], &[0.0, 2.0, -1.0], 2), [0.0, 0.5, 1.0, 1.5, 2.0, 1.25, 0.5, -0.25, -1.0]);
    assert_eq!(fine([1, 1], &[0.3], 5), [0.3]);
    assert_eq!(fine([1, 2], &[1.7e308, 1.7e308], 1), [1.7e308; 3]);
    let heights = random_heights(20, 14);
    assert_eq!(fine([4, 5], &heights, 0), heights);
    let line = fine([1, 9], &random_heights(9, 15), 3);
    assert!(residual(1, [1, 9], &random_heights(9, 15), &line, 3) <= 8.0 * f64::EPSILON);
}

#[test]
fn more_points_than_there_is_room_for_are_refused() {
    let grids = Grids::uniform(1, [3, 3], vec![0.0; 9]).unwrap();
    let refused =
        |rounds: u32| Subdivide { rule: Rule::Exact, rounds }.fit(&grids, &Device::cpu()).unwrap_err().to_string();
    assert!(refused(31).contains("31 rounds make 1.845e19 points, for which there is no memory: fewer rounds"));
    assert!(refused(63).contains("63 rounds of a grid of 3 × 3 points make more points than there are numbers for"));
    assert!(refused(64).contains("64 rounds of a grid"));
    assert!(Grids::new(1, vec![[usize::MAX, 2]], vec![]).unwrap_err().to_string().contains("beyond all memory"));
    assert!(Grids::new(0, vec![], vec![]).unwrap_err().to_string().contains("0 values; 1 is the least"));
    assert!(Grids::new(2, vec![[2, 2]], vec![0.0; 7]).unwrap_err().to_string().contains("give 8"));
    assert!(Grids::uniform(1, [2, 2], vec![0.0; 7]).unwrap_err().to_string().contains("7 values"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn turned_and_mirrored_grids_give_turned_and_mirrored_surfaces(
        rows in 1usize..12, columns in 1usize..12, seed in 0u64..1 << 32, rounds in 1u32..3,
    ) {
        let mut random = StdRng::seed_from_u64(seed);
        let heights: Vec<f64> = (0..rows * columns).map(|_| random.random_range(-1.0..1.0)).collect();
        let upright = fine([rows, columns], &heights, rounds);
        let turned: Vec<f64> = (0..rows * columns).map(|k| heights[k % rows * columns + k / rows]).collect();
        let turned = fine([columns, rows], &turned, rounds);
        let reversed: Vec<f64> = heights.iter().rev().copied().collect();
        let reversed = fine([rows, columns], &reversed, rounds);
        let [wide, high] = [columns, rows].map(|points| ((points - 1) << rounds) + 1);
        for k in 0..upright.len() {
            let (row, column) = (k / wide, k % wide);
            prop_assert!((upright[k] - turned[column * high + row]).abs() < 1e-13);
            prop_assert!((upright[k] - reversed[upright.len() - 1 - k]).abs() < 1e-13);
        }
    }
}
