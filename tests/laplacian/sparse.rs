//! Sparse Laplacian subdivision is its rule applied, whatever the grid's size, and keeps what it
//! says it keeps.

use faircurve::Device;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide};
use proptest::prelude::*;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

const SUPPORTS: [usize; 5] = [3, 5, 7, 9, 11];

fn rules() -> impl Iterator<Item = SparseRule> {
    let of = |support| {
        [Reproduces::Constants, Reproduces::Linear]
            .map(|reproduces| SparseRule::of_support(support, reproduces).unwrap())
    };
    SUPPORTS.into_iter().flat_map(of)
}

fn subdivided(rule: &SparseRule, rounds: u32, grids: &Grids) -> Grids {
    let subdivided = Subdivide { rule: Rule::Sparse(rule.clone()), rounds }.fit(grids, &Device::cpu()).unwrap();
    assert_eq!(subdivided.usable(), grids.len());
    subdivided.grids().clone()
}

fn random_values(count: usize, random: &mut StdRng) -> Vec<f64> {
    (0..count).map(|_| random.random_range(-1.0..1.0)).collect()
}

/// Every weight asked for by itself.
fn by_definition(rule: &SparseRule, dimension: usize, [rows, columns]: [usize; 2], values: &[f64]) -> Vec<f64> {
    let intervals = [rows - 1, columns - 1];
    let mut fine = Vec::new();
    for row in 0..2 * rows - 1 {
        for column in 0..2 * columns - 1 {
            let mut point = vec![0.0; dimension];
            for (k, old) in values.chunks_exact(dimension).enumerate() {
                let weight = rule.weight([row, column], [k / columns, k % columns], intervals);
                point.iter_mut().zip(old).for_each(|(sum, x)| *sum += weight * x);
            }
            fine.extend(point);
        }
    }
    fine
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |worst, x| if x > worst || x.is_nan() { x } else { worst })
}

#[test]
fn new_points_are_weighted_sums_of_old_ones_in_grids_of_all_sizes() {
    let mut random = StdRng::seed_from_u64(1);
    println!("seed 1");
    for rule in rules() {
        for rows in [2, 3, 4, 6, 7, 9, 10, 11, 14] {
            for columns in [2, 3, 5, 6, 8, 9, 10, 11, 12, 17] {
                let dimension = 1 + (rows + columns) % 3;
                let values = random_values(rows * columns * dimension, &mut random);
                let grids = Grids::uniform(dimension, [rows, columns], values.clone()).unwrap();
                let fine = subdivided(&rule, 1, &grids);
                let wanted = by_definition(&rule, dimension, [rows, columns], &values);
                let off = worst(fine.values(), &wanted);
                // Another order of at most 36 terms.
                assert!(off <= 1e-14, "support {}, {rows} × {columns} × {dimension}: {off:e}", rule.support());
            }
        }
    }
}

#[test]
fn wide_grids_and_rounds_after_one_another_agree_too() {
    let mut random = StdRng::seed_from_u64(2);
    println!("seed 2");
    for rule in rules() {
        for (dimension, shape) in [(1, [3, 301]), (1, [40, 65]), (3, [25, 33]), (4, [12, 12])] {
            let values = random_values(shape[0] * shape[1] * dimension, &mut random);
            let grids = Grids::uniform(dimension, shape, values).unwrap();
            let mut step = grids.clone();
            for _ in 0..3 {
                step = subdivided(&rule, 1, &step);
            }
            assert_eq!(subdivided(&rule, 3, &grids), step, "three rounds are three times one");
        }
        let values = random_values(21 * 200, &mut random);
        let fine = subdivided(&rule, 1, &Grids::uniform(1, [21, 200], values.clone()).unwrap());
        let off = worst(fine.values(), &by_definition(&rule, 1, [21, 200], &values));
        assert!(off <= 1e-14, "support {}: {off:e}", rule.support());
    }
}

#[test]
fn constants_and_planes_stay_to_rounding_at_borders_and_corners() {
    let plane = |row: usize, column: usize, step: f64| 3.0 - 2.0 * row as f64 * step + 0.7 * column as f64 * step;
    let heights = |[rows, columns]: [usize; 2], step: f64| -> Vec<f64> {
        (0..rows * columns).map(|k| plane(k / columns, k % columns, step)).collect()
    };
    let rounds = 3;
    for rule in rules() {
        let mut found = [0.0f64; 2];
        for rows in 1..=16 {
            for columns in 1..=16 {
                let shape = [rows, columns];
                let fine = subdivided(&rule, rounds, &Grids::uniform(1, shape, vec![1.0; rows * columns]).unwrap());
                found[0] = found[0].max(worst(fine.values(), &vec![1.0; fine.values().len()]));
                if rule.reproduces() == Reproduces::Linear {
                    let fine = subdivided(&rule, rounds, &Grids::uniform(1, shape, heights(shape, 1.0)).unwrap());
                    found[1] = found[1].max(worst(fine.values(), &heights(fine.shape(0), 0.125)));
                }
            }
        }
        println!(
            "support {}, {:?}: constants {:e}, planes {:e}",
            rule.support(),
            rule.reproduces(),
            found[0],
            found[1]
        );
        // Each round rounds weights and sums of up to 36 of them; heights go up to 33.
        assert!(found[0] <= 1e-14 && found[1] <= 33.0 * 1e-14, "support {}: {found:?}", rule.support());
    }
}

#[test]
fn a_grid_has_the_same_bits_alone_and_among_others_of_all_sizes() {
    let mut random = StdRng::seed_from_u64(3);
    println!("seed 3");
    let shapes: Vec<[usize; 2]> = (0..60).map(|k| [1 + k % 11, 1 + k * 7 % 19]).chain([[100, 120], [0, 3]]).collect();
    let count = shapes.iter().map(|[rows, columns]| rows * columns * 2).sum();
    let mut grids = Grids::new(2, shapes, random_values(count, &mut random)).unwrap();
    let rule = SparseRule::of_support(7, Reproduces::Constants).unwrap();
    let method = Subdivide { rule: Rule::Sparse(rule), rounds: 2 };
    let together = method.fit(&grids, &Device::cpu()).unwrap();
    for i in 0..grids.len() - 1 {
        let alone = Grids::uniform(2, grids.shape(i), grids.grid(i).to_vec()).unwrap();
        let alone = method.fit(&alone, &Device::cpu()).unwrap();
        assert_eq!(together.grids().grid(i), alone.grids().grid(0), "{i}");
    }
    // A bad value spoils its own grid only.
    let mut values = grids.values().to_vec();
    values[5] = f64::NAN;
    grids = Grids::new(2, grids.shapes().to_vec(), values).unwrap();
    let spoilt = method.fit(&grids, &Device::cpu()).unwrap();
    let bad = (0..grids.len()).find(|&i| grids.grid(i).iter().any(|x| x.is_nan())).unwrap();
    for i in (0..grids.len()).filter(|&i| i != bad) {
        assert_eq!(together.grids().grid(i), spoilt.grids().grid(i), "{i}");
    }
    assert!(spoilt.grids().grid(bad).iter().all(|x| x.is_nan()));
}

#[test]
fn a_peak_rises_by_the_pole_of_the_laplacian_and_under_sparse_rules_by_a_little_less_every_round() {
    let mut heights = vec![0.0; 169];
    heights[84] = 1.0;
    let grids = Grids::uniform(1, [13, 13], heights).unwrap();
    // The force E p₀ on the peak is 4.
    let pole = 4.0 * std::f64::consts::LN_2 / (2.0 * std::f64::consts::PI);
    let rises = |rule: Rule| {
        let peak = |rounds: u32| {
            let fine = Subdivide { rule: rule.clone(), rounds }.fit(&grids, &Device::cpu()).unwrap();
            fine.grids().point(0, 6 << rounds, 6 << rounds)[0]
        };
        let peaks = [4, 5, 6].map(peak);
        [peaks[1] - peaks[0], peaks[2] - peaks[1]]
    };
    let exact = rises(Rule::Exact);
    assert!(exact.iter().all(|rise| (rise / pole - 1.0).abs() < 1e-3), "{exact:?}, pole {pole}");
    for (support, loss) in [(5, 1e-4), (7, 1.7e-2), (9, 4e-3), (11, 1e-3)] {
        let [before, after] = rises(Rule::Sparse(SparseRule::of_support(support, Reproduces::Constants).unwrap()));
        let lost = 1.0 - after / before;
        assert!((0.6..1.5).contains(&(lost / loss)) && before < pole, "support {support}: {before}, {after}, {lost:e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn turned_and_mirrored_grids_give_turned_and_mirrored_surfaces(
        rows in 2usize..25, columns in 2usize..25, seed in 0u64..1 << 32, which in 0usize..10,
    ) {
        let rule = rules().nth(which).unwrap();
        let mut random = StdRng::seed_from_u64(seed);
        let heights = random_values(rows * columns, &mut random);
        let fine = |shape: [usize; 2], heights: Vec<f64>| subdivided(&rule, 1, &Grids::uniform(1, shape, heights).unwrap());
        let upright = fine([rows, columns], heights.clone());
        let turned = (0..rows * columns).map(|k| heights[k % rows * columns + k / rows]).collect();
        let turned = fine([columns, rows], turned);
        let reversed = fine([rows, columns], heights.iter().rev().copied().collect());
        let [high, wide] = upright.shape(0);
        for row in 0..high {
            for column in 0..wide {
                let here = upright.point(0, row, column)[0];
                prop_assert!((here - turned.point(0, column, row)[0]).abs() < 1e-14);
                prop_assert!((here - reversed.point(0, high - 1 - row, wide - 1 - column)[0]).abs() < 1e-14);
            }
        }
    }
}
