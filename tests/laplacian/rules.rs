//! Sparse Laplacian rules are what their programmes say: least maxima, precision, symmetries, on
//! grids of any size.

use std::collections::BTreeMap;

use faircurve::laplacian::{Reproduces, SparseRule};
use faircurve::papers::programmes::{Class, Energy, Programme, Unknown};
use serde_json::Value;

use crate::programmes::{exact_mask, optimum, programme, solved, weights_and_targets};

const SUPPORTS: [usize; 5] = [3, 5, 7, 9, 11];

/// Σ (entry − exact entry)² over the masks of a class.
fn squared_distance(programme: &Programme, class: Class, entries: &[f64]) -> f64 {
    let (weights, targets) = weights_and_targets(programme, class, &exact_mask(programme));
    assert_eq!(weights.len(), entries.len());
    entries.iter().zip(weights.iter().zip(&targets)).map(|(x, (weight, target))| weight * (x - target).powi(2)).sum()
}

fn rules() -> impl Iterator<Item = SparseRule> {
    let each = |support| [Reproduces::Constants, Reproduces::Linear].map(|reproduces| (support, reproduces));
    SUPPORTS
        .into_iter()
        .flat_map(each)
        .map(|(support, reproduces)| SparseRule::of_support(support, reproduces).unwrap())
}

/// All unknowns as the rule has them on a grid where no border sees another.
fn entries(rule: &SparseRule) -> Vec<f64> {
    let middle = 20;
    let all = |class| programme(rule.support(), rule.reproduces()).unknowns(class);
    let weight = |unknown| {
        let (fine, coarse) = match unknown {
            Unknown::Interior { far, near } => ([2 * middle + far, 2 * middle + near], [middle, middle]),
            Unknown::Border { row, from_border, along } => ([from_border, 2 * middle + along], [row, middle]),
            Unknown::Corner { rows, from_borders } => (from_borders, rows),
        };
        rule.weight(fine, coarse, [2 * middle, 2 * middle])
    };
    Class::ALL.into_iter().flat_map(all).map(weight).collect()
}

/// Σ weight |difference|² over the edges of a grid, as a matrix: entries by the two points' numbers.
fn energy_matrix(intervals: [usize; 2]) -> BTreeMap<[usize; 2], f64> {
    let [n, m] = intervals;
    let number = |i: usize, j: usize| i * (m + 1) + j;
    let mut matrix = BTreeMap::new();
    let mut edge = |a: usize, b: usize, weight: f64| {
        for (place, sign) in [([a, a], 1.0), ([b, b], 1.0), ([a, b], -1.0), ([b, a], -1.0)] {
            *matrix.entry(place).or_insert(0.0) += sign * weight;
        }
    };
    for i in 0..=n {
        for j in 0..=m {
            if i < n {
                edge(number(i, j), number(i + 1, j), if j % m == 0 { 0.5 } else { 1.0 });
            }
            if j < m {
                edge(number(i, j), number(i, j + 1), if i % n == 0 { 0.5 } else { 1.0 });
            }
        }
    }
    matrix
}

/// Σ |entry| of each row of E₂ₙS − UEₙ.
fn residual_rows(rule: &SparseRule, [n, m]: [usize; 2]) -> Vec<f64> {
    let (rows, columns) = ((2 * n + 1) * (2 * m + 1), (n + 1) * (m + 1));
    let mut residual = vec![vec![0.0; columns]; rows];
    let subdivision: Vec<Vec<f64>> = (0..rows)
        .map(|row| {
            let fine = [row / (2 * m + 1), row % (2 * m + 1)];
            (0..columns).map(|column| rule.weight(fine, [column / (m + 1), column % (m + 1)], [n, m])).collect()
        })
        .collect();
    for ([row, through], weight) in energy_matrix([2 * n, 2 * m]) {
        for (entry, of_subdivision) in residual[row].iter_mut().zip(&subdivision[through]) {
            *entry += weight * of_subdivision;
        }
    }
    for ([row, column], weight) in energy_matrix([n, m]) {
        residual[row / (m + 1) * 2 * (2 * m + 1) + row % (m + 1) * 2][column] -= weight;
    }
    residual.iter().map(|row| row.iter().map(|x| x.abs()).sum()).collect()
}

#[test]
fn tables_attain_the_optimum_of_every_programme() {
    for rule in rules() {
        let programme = programme(rule.support(), rule.reproduces());
        let entries = entries(&rule);
        // No row exceeds what its own class, or one before it, makes unavoidable.
        let mut before = 0.0f64;
        for (class, shipped) in Class::ALL.into_iter().zip(rule.residual()) {
            let last = Class::ALL.into_iter().rev().find(|&other| other < class);
            let known = &entries[..last.map_or(0, |class| programme.known_after(class))];
            let (least, _) = optimum(&programme, class, known);
            before = before.max(least);
            let attained = programme.maximum(class, &entries);
            let what = format!("{} {:?} {class:?}", rule.support(), rule.reproduces());
            assert!(shipped < (1.0 + 1e-6) * before, "{what}: {shipped}, least {least}, of all so far {before}");
            assert!(shipped > (1.0 - 1e-6) * least, "{what}: {shipped}, least {least}");
            assert!((shipped - attained).abs() < 1e-14, "{what}: {shipped}, attained {attained}");
            for constraint in programme.constraints(class) {
                assert!(constraint.at(&entries).abs() < 1e-14, "{what}: {constraint:?}");
            }
        }
    }
}

#[test]
fn of_all_optimal_rules_the_shipped_one_is_next_to_the_exact_rule() {
    for rule in rules() {
        let programme = programme(rule.support(), rule.reproduces());
        let entries = entries(&rule);
        let what = format!("{} {:?}", rule.support(), rule.reproduces());
        let differences = entries.iter().zip(solved(&programme)).map(|(a, b)| (a - b).abs());
        let worst = differences.fold(0.0, f64::max);
        assert!(worst < 1e-6, "{what}: computed again, {worst} away");
        // What the linear programme alone gives is as good, and further away.
        let mut first = 0;
        for class in Class::ALL {
            let last = programme.known_after(class);
            let (_, any) = optimum(&programme, class, &entries[..first]);
            let [near, far] = [&entries[first..last], &any].map(|entries| squared_distance(&programme, class, entries));
            assert!(near < far + 1e-12, "{what} {class:?}: {near}, any {far}");
            first = last;
        }
    }
}

#[test]
fn on_a_whole_grid_no_row_exceeds_the_optimum_of_its_class() {
    for rule in rules() {
        let least = rule.least_intervals();
        for intervals in [[14, 15], [least, least], [least, least + 1], [least + 3, least]] {
            let [n, m] = intervals.map(|n| 2 * n);
            // Up to where a row of E reaches a border mask.
            let last = least - 1;
            let mut largest = [0.0f64; 3];
            for (number, sum) in residual_rows(&rule, intervals).into_iter().enumerate() {
                let [i, j] = [number / (m + 1), number % (m + 1)];
                let near = usize::from(i.min(n - i) <= last) + usize::from(j.min(m - j) <= last);
                largest[near] = largest[near].max(sum);
            }
            let what = format!("{} {:?} {intervals:?}: {largest:?}", rule.support(), rule.reproduces());
            let [interior, border, corner] = rule.residual();
            if intervals == [14, 15] {
                assert!((largest[0] - interior).abs() < 1e-12, "{what}");
                assert!((largest[1] - border).abs() < 1e-12, "{what}");
            }
            // Not every row so near to both borders sees a corner mask, but those that do are among
            // them.
            assert!(largest[2] > corner - 1e-12 && largest[2] < interior.max(border).max(corner) + 1e-12, "{what}");
        }
    }
}

#[test]
fn interior_optima_are_the_reference_values() {
    let oracle: Value = serde_json::from_str(include_str!("../data/laplacian_splines.json")).unwrap();
    let masks = oracle["sparse_interior_masks"].as_array().unwrap();
    assert_eq!(masks.len(), 4);
    for mask in masks {
        let support = mask["support"].as_u64().unwrap() as usize;
        let norm = mask["residual_norm"].as_f64().unwrap();
        for reproduces in [Reproduces::Constants, Reproduces::Linear] {
            let rule = SparseRule::of_support(support, reproduces).unwrap();
            assert!((rule.residual()[0] - norm).abs() < 1e-7, "{support}: {norm}");
        }
        // Another optimum, of another solver, has the same maximum in our rows.
        let programme = programme(support, Reproduces::Constants);
        let entry = |unknown| match unknown {
            Unknown::Interior { far, near } => mask["one_optimal_mask"][format!("{far},{near}")].as_f64().unwrap(),
            other => panic!("{other:?} in the interior"),
        };
        let values: Vec<f64> = programme.unknowns(Class::Interior).into_iter().map(entry).collect();
        assert!((programme.maximum(Class::Interior, &values) - norm).abs() < 1e-9);
    }
}

#[test]
fn constants_and_linear_functions_are_reproduced_on_grids_of_any_size() {
    for rule in rules() {
        for n in 1..=12 {
            for m in 1..=12 {
                let coarse = || (0..=n).flat_map(|a| (0..=m).map(move |b| [a, b]));
                for i in 0..=2 * n {
                    for j in 0..=2 * m {
                        let mut moments = [-1.0, -(i as f64) / 2.0, -(j as f64) / 2.0];
                        for [a, b] in coarse() {
                            let weight = rule.weight([i, j], [a, b], [n, m]);
                            moments[0] += weight;
                            moments[1] += weight * a as f64;
                            moments[2] += weight * b as f64;
                        }
                        let kept = if rule.reproduces() == Reproduces::Linear { 3 } else { 1 };
                        // Coordinates are up to 12.
                        for (moment, tolerance) in moments[..kept].iter().zip([1e-14, 1e-13, 1e-13]) {
                            assert!(
                                moment.abs() < tolerance,
                                "{} [{i}, {j}] of {n} × {m}: {moments:?}",
                                rule.support()
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn weights_have_the_symmetries_of_the_rectangle_bit_by_bit() {
    for rule in rules() {
        for [n, m] in [[1, 1], [1, 2], [2, 3], [3, 3], [4, 9], [10, 11], [12, 12]] {
            for (i, j) in (0..=2 * n).flat_map(|i| (0..=2 * m).map(move |j| (i, j))) {
                for (a, b) in (0..=n).flat_map(|a| (0..=m).map(move |b| (a, b))) {
                    let weight = rule.weight([i, j], [a, b], [n, m]);
                    let upside_down = rule.weight([2 * n - i, j], [n - a, b], [n, m]);
                    let backward = rule.weight([i, 2 * m - j], [a, m - b], [n, m]);
                    let transposed = rule.weight([j, i], [b, a], [m, n]);
                    for other in [upside_down, backward, transposed] {
                        assert_eq!(weight.to_bits(), other.to_bits(), "[{i}, {j}] from [{a}, {b}] of {n} × {m}");
                    }
                }
            }
        }
    }
}

#[test]
fn small_grids_reflect_the_interior_mask() {
    // Support 3 on a grid of one interval is bilinear whichever way it is continued.
    for reproduces in [Reproduces::Constants, Reproduces::Linear] {
        let rule = SparseRule::of_support(3, reproduces).unwrap();
        assert_eq!(rule.weight([1, 1], [0, 1], [1, 1]), 0.25);
        assert_eq!(rule.weight([0, 1], [0, 1], [1, 1]), 0.5);
        assert_eq!(rule.weight([2, 2], [1, 1], [1, 1]), 1.0);
    }
    // Support 5 at the end of a grid of 4 intervals, by hand: the coarse points beside it and their
    // images.
    let of = |reproduces| SparseRule::of_support(5, reproduces).unwrap();
    let mask = |rule: &SparseRule, i: usize| rule.weight([40 + i, 40], [20, 20], [40, 40]);
    let even = of(Reproduces::Constants);
    assert_eq!(even.weight([0, 4], [1, 2], [4, 4]), 2.0 * mask(&even, 2));
    assert_eq!(even.weight([1, 4], [0, 2], [4, 4]), mask(&even, 1));
    // p(−1) = 2p(0) − p(1): the first two cancel at the point beside the end, and all of it falls
    // to the end.
    let turned = of(Reproduces::Linear);
    assert_eq!(turned.weight([0, 4], [1, 2], [4, 4]), 0.0);
    assert!((turned.weight([0, 4], [0, 2], [4, 4]) - (mask(&turned, 0) + 2.0 * mask(&turned, 2))).abs() < 1e-15);
}

#[test]
fn reflection_of_the_interior_mask_is_feasible_and_no_worse_than_the_interior() {
    for support in SUPPORTS {
        let programme = programme(support, Reproduces::Constants);
        let rule = SparseRule::of_support(support, Reproduces::Constants).unwrap();
        let mask = |i: isize, j: isize| match i.unsigned_abs().max(j.unsigned_abs()) > rule.radius() {
            true => 0.0,
            false => rule.weight([i, j].map(|x| 40usize.checked_add_signed(x).unwrap()), [20, 20], [40, 40]),
        };
        let images = |row: usize, fine: usize| {
            let (row, fine) = (2 * row as isize, fine as isize);
            if row == 0 { vec![fine] } else { vec![fine - row, fine + row] }
        };
        let folded = |unknown| -> f64 {
            match unknown {
                Unknown::Interior { far, near } => mask(far as isize, near as isize),
                Unknown::Border { row, from_border, along } => {
                    images(row, from_border).into_iter().map(|i| mask(i, along as isize)).sum()
                }
                Unknown::Corner { rows, from_borders } => {
                    let [first, second] = [0, 1].map(|axis| images(rows[axis], from_borders[axis]));
                    first.iter().flat_map(|&i| second.iter().map(move |&j| mask(i, j))).sum()
                }
            }
        };
        let unknowns = Class::ALL.into_iter().flat_map(|class| programme.unknowns(class));
        let values: Vec<f64> = unknowns.map(folded).collect();
        let interior = programme.maximum(Class::Interior, &values);
        for class in [Class::Border, Class::Corner] {
            assert!(programme.maximum(class, &values) <= interior * (1.0 + 1e-12), "{support} {class:?}");
            for constraint in programme.constraints(class) {
                assert!(constraint.at(&values).abs() < 1e-14, "{support} {class:?}");
            }
        }
    }
}

#[test]
fn with_masks_of_their_own_only_for_points_on_the_border_the_residual_is_larger() {
    let narrow = Programme::new(Energy::Dirichlet, 2, Reproduces::Constants).with_own_rows(1);
    let wide = SparseRule::of_support(5, Reproduces::Constants).unwrap();
    // What the border attains depends on which of the best interior masks it meets: ours, or that
    // of the vertex 13/9, 11/24, ….
    let ours = entries(&wide)[..6].to_vec();
    let vertex = vec![13.0 / 9.0, 11.0 / 24.0, 0.25, -1.0 / 9.0, 1.0 / 48.0, 0.0];
    for (mut known, at_border) in [(ours, 0.6097), (vertex, 11.0 / 18.0)] {
        let (least, border) = optimum(&narrow, Class::Border, &known);
        assert!((least - at_border).abs() < 1e-4, "{least}");
        known.extend(border);
        let (at_corner, _) = optimum(&narrow, Class::Corner, &known);
        assert!(at_corner > 1.3 * wide.residual()[2], "{at_corner}");
    }
}

#[test]
fn other_supports_are_refused_with_those_there_are() {
    for support in [0, 1, 4, 13] {
        let error = SparseRule::of_support(support, Reproduces::Constants).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "a support of {support} points: sparse rules have a support of 3, 5, 7, 9 or 11; for more, take the exact rule"
            )
        );
    }
}
