//! Sparse Laplacian rules are what their programmes say: least maxima.

use faircurve::laplacian::{Reproduces, SparseRule};
use faircurve_papers::programmes::{Class, Energy, Programme, Unknown};
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
fn interior_optima_are_the_reference_values() {
    let oracle: Value = serde_json::from_str(include_str!("../../../tests/data/laplacian_splines.json")).unwrap();
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
