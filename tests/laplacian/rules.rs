//! Sparse Laplacian rules have the precision, the symmetries and the residuals that they promise, on
//! grids of any size.

use std::collections::BTreeMap;

use faircurve::laplacian::{Reproduces, SparseRule};

const SUPPORTS: [usize; 5] = [3, 5, 7, 9, 11];

fn rules() -> impl Iterator<Item = SparseRule> {
    let each = |support| [Reproduces::Constants, Reproduces::Linear].map(|reproduces| (support, reproduces));
    SUPPORTS
        .into_iter()
        .flat_map(each)
        .map(|(support, reproduces)| SparseRule::of_support(support, reproduces).unwrap())
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
