//! Bézier curves of least bending energy are what Eberly's paper, and reference values, say they
//! are.

use faircurve::Device;
use faircurve::bezier::{
    BigRational, Completion, Eigenstructure, Energy, Given, Matrix, Pattern, Polygons, complete, elevate,
    energy_matrix, energy_matrix_by_beta,
};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

fn oracle() -> Value {
    serde_json::from_str(include_str!("../data/bezier_bending.json")).unwrap()
}

fn rational(p: i64, q: i64) -> BigRational {
    BigRational::new(p.into(), q.into())
}

/// Flags of the control points listed.
fn flags(degree: usize, known: &[usize]) -> Vec<bool> {
    (0..=degree).map(|i| known.contains(&i)).collect()
}

fn completed(dimension: usize, points: &[f64], known: &[usize]) -> (Vec<f64>, f64) {
    let count = points.len() / dimension;
    let known = flags(count - 1, known);
    let given = |(k, &x): (usize, &f64)| if known[k / dimension] { x } else { f64::NAN };
    let coords: Vec<f64> = points.iter().enumerate().map(given).collect();
    let polygons = Polygons { dimension, coords: &coords, offsets: &[0, count] };
    let given = Given { known: Some(&known), ..Given::default() };
    let solved = complete(&polygons, &given, &Energy::bending(), &Device::cpu()).unwrap();
    assert_eq!(solved.refusals, []);
    (solved.coords, solved.energies[0])
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn random_points(count: usize, seed: u64) -> Vec<f64> {
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-2.0..2.0)).collect()
}

#[test]
fn matrices_are_the_reference_s_exactly() {
    let oracle = oracle();
    let matrices = oracle["matrices"].as_object().unwrap();
    assert_eq!(matrices.len(), 11);
    for (degree, rows) in matrices {
        let degree = degree.parse().unwrap();
        let entry = |i: usize, j: usize| rows[i][j].as_str().unwrap().parse().unwrap();
        let wanted = Matrix::from_fn(degree + 1, degree + 1, entry);
        assert_eq!(energy_matrix(degree, 2), wanted, "degree {degree}");
        assert_eq!(energy_matrix_by_beta(degree, 2), wanted, "degree {degree}");
    }
}

#[test]
fn completions_are_the_reference_s() {
    let oracle = oracle();
    let cases = oracle["completed"].as_array().unwrap();
    assert_eq!(cases.len(), 9);
    for case in cases {
        let points: Vec<Vec<f64>> = serde_json::from_value(case["control_points"].clone()).unwrap();
        let known: Vec<usize> = serde_json::from_value(case["known"].clone()).unwrap();
        let dimension = points[0].len();
        let points = points.concat();
        let (found, energy) = completed(dimension, &points, &known);
        assert!(worst(&found, &points) < 1e-12, "{known:?}: {found:?}");
        let wanted = case["energy"].as_f64().unwrap();
        assert!((energy - wanted).abs() < 1e-12 * wanted.max(1.0), "{known:?}: {energy}, {wanted}");
    }
}

#[test]
fn cubics_have_the_eigenstructure_of_the_paper() {
    let cubic = Eigenstructure::new(3, &Energy::bending()).unwrap();
    // E = 6 Pᵀ M P there.
    assert!(worst(&cubic.values, &[60.0, 36.0, 0.0, 0.0]) < 1e-12, "{:?}", cubic.values);
    let (v0, v1) = ([1.0, -3.0, 3.0, -1.0].map(|x| x / 20f64.sqrt()), [0.5, -0.5, -0.5, 0.5]);
    assert!(worst(&cubic.vectors[0], &v0) < 1e-14 && worst(&cubic.vectors[1], &v1) < 1e-14);
    // The eigenspace of 0 is spanned by the paper's V₂ and V₃.
    for v in [[1.0, 0.0, -1.0, -2.0].map(|x| x / 6f64.sqrt()), [4.0, 3.0, 2.0, 1.0].map(|x| x / 30f64.sqrt())] {
        let along = |vector: &[f64]| vector.iter().zip(v).map(|(a, b)| a * b).sum::<f64>();
        let inside: f64 = cubic.vectors[2..].iter().map(|vector| along(vector).powi(2)).sum();
        assert!((inside - 1.0).abs() < 1e-14);
    }
}

#[test]
fn eigenvectors_diagonalise_the_energy_at_every_degree() {
    for degree in 0..=30 {
        for order in 1..=3 {
            let energy = Energy::of_order(order);
            let structure = Eigenstructure::new(degree, &energy).unwrap();
            let matrix = energy_matrix(degree, order);
            let scale = structure.values[0].max(f64::MIN_POSITIVE);
            for i in 0..=degree {
                for j in 0..=degree {
                    let terms = |k: usize| structure.vectors[k][i] * structure.vectors[k][j];
                    let product: f64 = (0..=degree).map(|k| structure.values[k] * terms(k)).sum();
                    assert!((product - matrix.f64_at(i, j)).abs() < 2e-14 * scale, "{degree}, {order}");
                    let dot: f64 = (0..=degree).map(|c| structure.vectors[i][c] * structure.vectors[j][c]).sum();
                    assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14, "{degree}, {order}");
                }
            }
            let zeros = structure.values.iter().filter(|&&value| value == 0.0).count();
            assert_eq!(zeros, order.min(degree + 1));
        }
    }
}

#[test]
fn two_known_ends_make_the_elevated_line_exactly() {
    for degree in 2..=30 {
        let completion = Completion::new(Pattern::new(&flags(degree, &[0, degree])), &Energy::bending()).unwrap();
        let d = degree as i64;
        let line = Matrix::from_fn(degree - 1, 2, |i, j| {
            let i = i as i64 + 1;
            rational(if j == 0 { d - i } else { i }, d)
        });
        assert_eq!(completion.weights(), line, "degree {degree}");
    }
    let ends = [1.0, -2.0, 4.0, 4.0];
    let degree = 7;
    let points: Vec<f64> = [&ends[..2], &[0.0; 12], &ends[2..]].concat();
    let (found, energy) = completed(2, &points, &[0, degree]);
    let line = Polygons { dimension: 2, coords: &ends, offsets: &[0, 2] };
    assert!(worst(&found, &elevate(&line, degree - 1, &Device::cpu()).unwrap().coords) < 1e-15 * 8.0);
    assert!(energy < 1e-28, "{energy}");
}

#[test]
fn a_cubic_without_its_third_point_has_the_middle_of_its_neighbours() {
    let pattern = Pattern::new(&[true, true, false, true]);
    let completion = Completion::new(pattern, &Energy::bending()).unwrap();
    assert_eq!(completion.weights(), Matrix::from_fn(1, 3, |_, j| rational([0, 1, 1][j], 2)));
    assert!(completion.is_unique());
}

#[test]
fn two_points_at_each_end_make_an_elevated_cubic() {
    for degree in 4..=30 {
        let known = [0, 1, degree - 1, degree];
        let points = random_points(3 * (degree + 1), degree as u64);
        let (found, energy) = completed(3, &points, &known);
        // The cubic of the same ends and end derivatives: d (P₁ − P₀) = 3 (Q₁ − Q₀).
        let third = degree as f64 / 3.0;
        let at = |i: usize, c: usize| points[3 * i + c];
        let first = (0..3).map(|c| at(0, c) + third * (at(1, c) - at(0, c)));
        let second = (0..3).map(|c| at(degree, c) + third * (at(degree - 1, c) - at(degree, c)));
        let (start, end) = (points[..3].iter().copied(), points[3 * degree..].iter().copied());
        let cubic: Vec<f64> = start.chain(first).chain(second).chain(end).collect();
        let polygons = Polygons { dimension: 3, coords: &cubic, offsets: &[0, 4] };
        let raised = elevate(&polygons, degree - 3, &Device::cpu()).unwrap();
        let size = cubic.iter().fold(0.0f64, |size, x| size.max(x.abs()));
        assert!(worst(&found, &raised.coords) < 1e-14 * size, "degree {degree}");
        let own = complete(&polygons, &Given::default(), &Energy::bending(), &Device::cpu()).unwrap().energies[0];
        assert!((energy - own).abs() < 1e-13 * own, "degree {degree}: {energy}, {own}");
    }
}

/// Where the known points are those that an elevated curve of lower degree has, and that curve is
/// the minimiser, completing and elevating commute: r known derivatives of either end are those of
/// a polynomial of degree 2r − 1, which is what has the least ∫|X⁽ʳ⁾|².
#[test]
fn elevation_commutes_with_completion_from_the_ends() {
    for order in 1..=3 {
        let energy = Energy::of_order(order);
        let low = 2 * order - 1;
        let points = random_points(2 * (low + 1), 40 + order as u64);
        let polygons = Polygons { dimension: 2, coords: &points, offsets: &[0, low + 1] };
        for by in 1..=12 {
            let raised = elevate(&polygons, by, &Device::cpu()).unwrap();
            let count = low + by + 1;
            let known: Vec<bool> = (0..count).map(|i| i < order || i >= count - order).collect();
            let given = Given { known: Some(&known), ..Given::default() };
            let solved = complete(&raised.polygons(), &given, &energy, &Device::cpu()).unwrap();
            let error = worst(&solved.coords, &raised.coords);
            assert!(error < 1e-14, "order {order}, by {by}: {error:e}");
        }
    }
}
