use std::f64::consts::TAU;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;

/// Heights of a function at the nodes of a field.
fn field(shape: [usize; 2], spacing: [f64; 2], origin: [f64; 2], h: impl Fn(f64, f64) -> f64) -> HeightField {
    let [rows, columns] = shape;
    let at = |k: usize| h(origin[0] + (k % columns) as f64 * spacing[0], origin[1] + (k / columns) as f64 * spacing[1]);
    let heights = (0..rows * columns).map(at).collect();
    HeightField::new(shape, heights).unwrap().with_spacing(spacing).unwrap().with_origin(origin).unwrap()
}

/// Random heights from 0 to `most`, with spacings of 30 and rows from north to south.
fn steep(most: f64, seed: u64) -> HeightField {
    let mut rng = StdRng::seed_from_u64(seed);
    let heights = (0..20 * 20).map(|_| rng.random_range(0.0..most)).collect();
    HeightField::new([20, 20], heights).unwrap().with_spacing([30.0, -30.0]).unwrap()
}

#[test]
fn heights_at_nodes_are_those_given() {
    let (rows, columns) = (7, 9);
    let mut rng = StdRng::seed_from_u64(3);
    let heights: Vec<f64> = (0..rows * columns).map(|_| rng.random_range(-500.0..3000.0)).collect();
    let field = HeightField::new([rows, columns], heights.clone()).unwrap();
    let turned = field.clone().with_spacing([0.25, -0.5]).unwrap().with_origin([-3.0, 8.0]).unwrap();
    for (k, height) in heights.iter().enumerate() {
        let (u, v) = ((k % columns) as f64, (k / columns) as f64);
        assert_eq!(field.height(u, v), *height, "column {u}, row {v}");
        assert_eq!(turned.height(-3.0 + 0.25 * u, 8.0 - 0.5 * v), *height, "column {u}, row {v}");
    }
    assert_eq!(turned.bounds(), [[-3.0, -1.0], [5.0, 8.0]]);
}

#[test]
fn flat_and_tilted_fields_are_planes_to_rounding_within_and_beyond() {
    let plane = |x: f64, y: f64| 0.3 * x - 1.7 * y + 12.0;
    for shape in [[2, 2], [3, 2], [2, 5], [6, 8]] {
        let tilted = field(shape, [0.7, -1.3], [0.2, 0.4], plane);
        for (x, y) in [(0.2, 0.4), (0.5, 0.0), (0.81, -0.6), (4.0, 3.0), (-3.0, 3.0)] {
            let at = DVec3::new(x, y, 5.0);
            assert!((tilted.height(x, y) - plane(x, y)).abs() < 1e-13, "{shape:?} {x} {y}");
            assert!((tilted.gradient(at) - DVec3::new(-0.3, 1.7, 1.0)).length() < 1e-13);
            assert!(tilted.hessian(at).to_cols_array().iter().all(|x| x.abs() < 1e-13));
            let normal = DVec3::new(-0.3, 1.7, 1.0).normalize();
            let below = at - (at - tilted.plumb(x, y)).dot(normal) * normal;
            for found in [tilted.closest(at).unwrap(), tilted.project(at).unwrap()] {
                assert!((found - below).length() < 1e-13 * (1.0 + at.length()), "{shape:?} {x} {y}");
            }
        }
        let flat = field(shape, [2.0, 3.0], [0.0, 0.0], |_, _| 812.3);
        let at = DVec3::new(1.1, -5.0, 800.0);
        assert_eq!((flat.gradient(at), flat.hessian(at)), (DVec3::Z, DMat3::ZERO));
        assert!((flat.closest(at).unwrap() - DVec3::new(1.1, -5.0, 812.3)).length() < 1e-12);
    }
}

#[test]
fn value_slope_and_bend_go_on_across_rows_columns_and_edges_and_the_third_derivative_jumps() {
    let field = steep(20.0, 4);
    let tiny = 1e-9;
    let jump = |at: DVec3, across: DVec3| {
        let (before, after) = (at - tiny * across, at + tiny * across);
        let bend = (field.hessian(after) - field.hessian(before)).to_cols_array();
        let third = (field.third(after, across) - field.third(before, across)).to_cols_array();
        let most = |numbers: [f64; 9]| numbers.into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let slope = (field.gradient(after) - field.gradient(before)).length();
        [(field.value(after) - field.value(before)).abs(), slope, most(bend), most(third)]
    };
    for (along, line) in (0..20).map(|line| (11.0 + 28.0 * f64::from(line), 30.0 * f64::from(line))) {
        for (at, across) in [(DVec3::new(line, -along, 0.0), DVec3::X), (DVec3::new(along, -line, 0.0), DVec3::Y)] {
            let jumps = jump(at, across);
            assert!(jumps[0] < 1e-7 && jumps[1] < 1e-8 && jumps[2] < 1e-9, "{at}: {jumps:?}");
            assert!(jumps[3] > 1e-7, "{at}: {jumps:?}");
        }
    }
}

#[test]
fn derivatives_beyond_the_grid_are_those_of_differences() {
    let field = steep(20.0, 5);
    let h = 1e-4;
    for at in [DVec3::new(-50.0, -100.0, 3.0), DVec3::new(305.0, 45.0, 3.0), DVec3::new(700.0, -800.0, 0.0)] {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let slope = DVec3::from_array(axes.map(|e| (field.value(at + h * e) - field.value(at - h * e)) / (2.0 * h)));
        assert!((slope - field.gradient(at)).length() < 1e-8, "{at}");
        for (k, e) in axes.into_iter().enumerate() {
            let bend = (field.gradient(at + h * e) - field.gradient(at - h * e)) / (2.0 * h);
            assert!((bend - field.hessian(at).col(k)).length() < 1e-8, "{at}");
            let third = (field.hessian(at + h * e) - field.hessian(at - h * e)) * (0.5 / h);
            let own = field.third(at, e);
            assert!((third - own).to_cols_array().iter().all(|x| x.abs() < 1e-9), "{at}");
        }
        assert!(field.undefined(at).is_some());
    }
}

/// The largest errors of h, of its slope and of its bends, at places so many nodes or more from the
/// edges and, with `most`, fewer than `most` from them.
fn errors(nodes: usize, from: f64, most: f64) -> [f64; 3] {
    // A wave of length 1, of which the edges cut the crests.
    let wave = |x: f64| (TAU * x + 1.0).sin();
    let d = 1.0 / nodes as f64;
    let count = 2 * nodes + 1;
    let field = field([count; 2], [d; 2], [0.0; 2], |x, y| wave(x) * wave(y));
    let mut worst = [0.0_f64; 3];
    let places = 8 * (count - 1);
    for k in 0..=places {
        for l in (0..=places).filter(|l| l % 3 == 0) {
            let [u, v] = [k, l].map(|k| k as f64 / 8.0);
            let edge = [u, v].map(|u| u.min((count - 1) as f64 - u)).into_iter().fold(f64::MAX, f64::min);
            if edge < from || edge >= most {
                continue;
            }
            let (x, y) = (u * d, v * d);
            let [(sx, cx), (sy, cy)] = [x, y].map(|x| (TAU * x + 1.0).sin_cos());
            let cell = Cell::of(&field, x, y);
            worst[0] = worst[0].max((cell.derivative(0, 0) - sx * sy).abs());
            let slope = cell.slope() / TAU - DVec2::new(cx * sy, sx * cy);
            worst[1] = worst[1].max(slope.abs().max_element());
            let bend = cell.bend().map(|bend| bend / (TAU * TAU));
            let exact = [-sx * sy, cx * cy, -sx * sy];
            (0..3).for_each(|k| worst[2] = worst[2].max((bend[k] - exact[k]).abs()));
        }
    }
    worst
}

#[test]
fn errors_fall_with_the_spacing_by_orders_4_3_and_2_inside_and_by_2_1_and_0_at_edges() {
    let [coarse, fine] = [20, 40].map(|nodes| errors(nodes, 10.0, f64::MAX));
    println!("inside, 20 and 40 nodes a wave: {coarse:?} {fine:?}");
    let orders = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| (a[k] / b[k]).log2());
    for (order, wanted) in orders(coarse, fine).into_iter().zip([4.0, 3.0, 2.0]) {
        assert!((order - wanted).abs() < 0.1, "{order} {wanted}");
    }
    let [coarse_edge, fine_edge] = [20, 40].map(|nodes| errors(nodes, 0.0, 1.0));
    println!("at edges: {coarse_edge:?} {fine_edge:?}");
    for (order, wanted) in orders(coarse_edge, fine_edge).into_iter().zip([2.0, 1.0, 0.0]) {
        assert!((order - wanted).abs() < 0.15, "{order} {wanted}");
    }
    // By 2 + √3 from node to node.
    let strips: Vec<[f64; 3]> = (0..10).map(|k| errors(20, f64::from(k), f64::from(k + 1))).collect();
    (0..10).for_each(|k| println!("from {k} to {} nodes: {:?}", k + 1, strips[k]));
    for pair in strips[..4].windows(2) {
        let shrinks = pair[0][2] / pair[1][2];
        assert!((2.0..7.0).contains(&shrinks), "{shrinks}");
    }
    (0..3).for_each(|k| assert!(strips[5][k] < 1.1 * coarse[k], "{:?} {coarse:?}", strips[5]));
}

#[test]
fn closest_points_of_steep_terrain_are_straight_below_along_the_normal_and_no_place_near_is_closer() {
    let mut rng = StdRng::seed_from_u64(6);
    // Slopes of up to 10 and more.
    for (most, height) in [(30.0, 5.0), (200.0, 5.0), (200.0, 50.0), (600.0, 300.0)] {
        let field = steep(most, 7);
        for _ in 0..500 {
            let (x, y) = (rng.random_range(-30.0..600.0), rng.random_range(-600.0..30.0));
            let below = field.plumb(x, y);
            let at = below + rng.random_range(-height..height) * DVec3::Z;
            let closest = field.closest(at).unwrap();
            let away = at - closest;
            assert!(field.value(closest) == 0.0 && away.length() <= (at.z - below.z).abs() * (1.0 + 1e-15));
            let across = away.cross(super::super::normal(&field, closest)).length();
            assert!(across < 1e-10 * (1.0 + away.length()), "heights to {most}: {across:e} of {away} at {at}");
            for k in 0..8 {
                let (sin, cos) = (f64::from(k) * TAU / 8.0).sin_cos();
                let near = field.plumb(closest.x + 1e-3 * cos, closest.y + 1e-3 * sin);
                assert!(near.distance(at) >= away.length() - 1e-12, "{near} {closest}");
            }
        }
    }
}

#[test]
fn feet_lie_on_steep_terrain_from_any_height_and_agree_with_closest_points_near_it() {
    let mut rng = StdRng::seed_from_u64(8);
    for (most, height) in [(30.0, 0.01), (30.0, 5.0), (200.0, 50.0), (600.0, 300.0), (600.0, 1e5)] {
        let field = steep(most, 9);
        for _ in 0..500 {
            let (x, y) = (rng.random_range(-30.0..600.0), rng.random_range(-600.0..30.0));
            let at = field.plumb(x, y) + rng.random_range(-height..height) * DVec3::Z;
            let foot = field.project(at).unwrap_or_else(|| panic!("no foot below {at}"));
            assert_eq!(field.value(foot), 0.0);
            if height < 0.1 {
                let closest = field.closest(at).unwrap();
                let away = closest.distance(at);
                assert!(foot.distance(closest) <= away * away + 1e-12, "{foot} {closest}");
            }
        }
    }
}

#[test]
fn places_beyond_the_grid_are_unknown_and_its_edges_are_known() {
    let field = field([4, 5], [0.1, -0.1], [0.3, 0.7], |x, y| x * y);
    for (x, y) in [(0.3, 0.7), (0.3 + 0.4, 0.7), (0.7, 0.4), (0.5, 0.5), (0.3, 0.4)] {
        assert_eq!(field.undefined(DVec3::new(x, y, 9.0)), None, "{x} {y}");
    }
    for (x, y) in [(0.29, 0.5), (0.71, 0.5), (0.5, 0.71), (0.5, 0.39), (f64::NAN, 0.5)] {
        let why = field.undefined(DVec3::new(x, y, 0.0)).unwrap();
        assert!(why.starts_with("lies beyond the grid of x from 0.3 to 0.7") && why.contains(" and y from "), "{why}");
    }
}

#[test]
fn gaps_are_holes_that_change_nothing_far_from_them() {
    let hill = |x: f64, y: f64| (0.3 * x).sin() + 0.1 * x * y;
    let whole = field([20, 24], [1.0, 1.0], [0.0, 0.0], hill);
    let gaps = [[9usize, 11usize], [9, 12], [10, 11], [0, 0]];
    let mut heights: Vec<f64> = (0..480).map(|k| hill((k % 24) as f64, (k / 24) as f64)).collect();
    gaps.iter().for_each(|[row, column]| heights[24 * row + column] = f64::NAN);
    heights[24 * 19] = f64::INFINITY;
    let field = HeightField::new([20, 24], heights).unwrap();
    for (x, y) in [(11.0, 9.0), (10.5, 9.2), (12.7, 8.3), (11.0, 10.9), (0.0, 0.5), (0.5, 18.5)] {
        let why = field.undefined(DVec3::new(x, y, 0.0)).unwrap();
        assert!(why.starts_with("lies in a hole of the grid: row ") && field.height(x, y).is_nan(), "{x} {y} {why}");
        // Descents do not break there.
        assert!(field.project(DVec3::new(x, y, 3.0)).is_some_and(|foot| foot.is_finite()), "{x} {y}");
    }
    for (x, y) in [(10.0, 9.0), (10.0, 9.5), (13.0, 9.0), (1.0, 0.0), (1.0, 0.4), (12.0, 11.0), (2.5, 3.5)] {
        assert_eq!(field.undefined(DVec3::new(x, y, 0.0)), None, "{x} {y}");
    }
    // What a gap does falls to 2 − √3 from node to node.
    for away in [4.0, 6.0, 8.0] {
        let (x, y) = (11.5, 10.0 + away + 0.5);
        let error = (field.height(x, y) - whole.height(x, y)).abs();
        assert!(error <= 2.0 * (2.0 - 3f64.sqrt()).powf(away), "{away}: {error}");
    }
}

#[test]
fn what_is_no_height_field_is_refused_with_a_sentence() {
    let new = |shape, heights: &[f64]| HeightField::new(shape, heights.to_vec());
    for (refused, what) in [
        (new([1, 4], &[0.0; 4]), "a height field of 1 × 4 heights is no surface: give 2 rows and 2 columns, or more"),
        (new([0, 0], &[]), "a height field of 0 × 0 heights is no surface"),
        (new([2, 3], &[0.0; 5]), "5 heights for a height field of 2 rows and 3 columns: give one for each"),
        (new([usize::MAX, 3], &[0.0; 5]), "5 heights for"),
        (new([2, 3], &[f64::NAN; 6]), "none of the 2 × 3 heights of a height field is a finite number: give some"),
        (new([2, 2], &[0.0; 4]).unwrap().with_spacing([30.0, 0.0]), "the spacing of rows is 0: give a finite number"),
        (new([2, 2], &[0.0; 4]).unwrap().with_spacing([f64::NAN, 1.0]), "the spacing of columns is NaN"),
        (new([2, 2], &[0.0; 4]).unwrap().with_origin([0.0, f64::INFINITY]), "is at inf: give finite coordinates"),
    ] {
        let error = refused.unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}
