//! What completing Bézier curves promises.

use faircurve::bezier::{
    Completion, Energy, Given, Matrix, Pattern, Polygons, Refusal, Solved, complete, elevate, energy_matrix,
    energy_matrix_by_beta, reduce, split,
};
use faircurve::{CurveStatus, Device};
use nalgebra::{DMatrix, DVector};
use num_rational::BigRational;
use num_traits::Zero;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

fn random_points(count: usize, seed: u64) -> Vec<f64> {
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-1.0..1.0)).collect()
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn solve(dimension: usize, coords: &[f64], known: &[bool], energy: Energy) -> Solved {
    let polygons = Polygons { dimension, coords, offsets: &[0, known.len()] };
    let given = Given { known: Some(known), ..Given::default() };
    complete(&polygons, &given, &energy, &Device::cpu()).unwrap()
}

/// Patterns of a degree by the bits of a number.
fn bits(degree: usize, bits: u32) -> Vec<bool> {
    (0..=degree).map(|i| bits >> i & 1 == 1).collect()
}

#[test]
fn operators_solve_the_equations_exactly_up_to_degree_30() {
    let mut random = StdRng::seed_from_u64(3);
    for degree in [2, 3, 4, 7, 10, 15, 22, 30] {
        let matrix = energy_matrix_by_beta(degree, 2);
        for _ in 0..3 {
            let pattern = Pattern::new(&bits(degree, random.random()));
            if pattern.data() < 2 || pattern.data() > degree {
                continue;
            }
            let completion = Completion::new(pattern, &Energy::bending()).unwrap();
            let all = matrix.times(&completion.all());
            for i in pattern.unknown() {
                assert!((0..all.columns()).all(|j| all.at(i, j).is_zero()), "{pattern:?}");
            }
        }
    }
}

/// Control points as good as their sums allow, at degree 30 as at degree 3: against the exact
/// solution for the same f64 points.
#[test]
fn completed_points_are_within_roundings_of_the_exact_ones_at_degree_30() {
    let mut largest = 0.0f64;
    for (degree, known) in [
        (3, vec![0, 1, 3]),
        (10, vec![0, 4, 5, 10]),
        (30, vec![0, 30]),
        (30, vec![0, 1, 29, 30]),
        (30, (0..=30).filter(|i| i % 2 == 0).collect()),
        (30, (0..=30).filter(|i| i % 3 != 1).collect()),
        // Extrapolation: weights of many thousands.
        (30, vec![13, 14, 15, 16]),
        (30, (0..12).collect()),
    ] {
        let flags: Vec<bool> = (0..=degree).map(|i| known.contains(&i)).collect();
        let coords = random_points(degree + 1, degree as u64);
        let solved = solve(1, &coords, &flags, Energy::bending());
        let completion = Completion::new(Pattern::new(&flags), &Energy::bending()).unwrap();
        let weights = completion.weights();
        for (row, i) in (0..=degree).filter(|i| !known.contains(i)).enumerate() {
            let term = |(j, &k): (usize, &usize)| weights.at(row, j) * BigRational::from_float(coords[k]).unwrap();
            let exact: BigRational = known.iter().enumerate().map(term).sum();
            let exact = Matrix::from_fn(1, 1, |_, _| exact.clone()).f64_at(0, 0);
            let sum: f64 = known.iter().enumerate().map(|(j, &k)| (weights.f64_at(row, j) * coords[k]).abs()).sum();
            let error = (solved.coords[i] - exact).abs() / sum.max(exact.abs());
            largest = largest.max(error);
        }
    }
    println!("largest error: {largest:e} of Σ|W||G|");
    assert!(largest < 1.5e-15, "{largest:e}");
}

/// By multipliers for all that is given, known points too, in f64: for low degrees, where f64
/// serves.
#[test]
fn mixed_energies_and_derivatives_agree_with_dense_least_squares() {
    let mut random = StdRng::seed_from_u64(17);
    for case in 0..200 {
        let degree = random.random_range(3..=8);
        let energy = Energy { weights: [random.random_range(0.1..1.0), random.random_range(0.0..1.0), 0.01] };
        let known: Vec<bool> =
            (0..=degree).map(|i| (i > 2 && i + 3 <= degree && random.random_bool(0.4)) || i == 0).collect();
        let coords = random_points(degree + 1, case);
        let (start, end) = ([random.random_range(-2.0..2.0)], [random.random_range(-2.0..2.0)]);
        let second = [random.random_range(-9.0..9.0)];
        let given = Given {
            known: Some(&known),
            derivatives: [[Some(&start), Some(&second), None], [Some(&end), None, None]],
            directions: false,
        };
        let polygons = Polygons { dimension: 1, coords: &coords, offsets: &[0, degree + 1] };
        let solved = complete(&polygons, &given, &energy, &Device::cpu()).unwrap();
        assert_eq!(solved.statuses, [CurveStatus::Converged], "{:?}", solved.refusals);

        // M P + Cᵀ λ = 0, C P = g
        let d = degree as f64;
        let mut rows: Vec<(Vec<f64>, f64)> = Vec::new();
        let unit = |entries: &[(usize, f64)]| {
            let mut row = vec![0.0; degree + 1];
            entries.iter().for_each(|&(i, x)| row[i] = x);
            row
        };
        (0..=degree).filter(|&i| known[i]).for_each(|i| rows.push((unit(&[(i, 1.0)]), coords[i])));
        rows.push((unit(&[(0, -d), (1, d)]), start[0]));
        let second_row = unit(&[(0, d * (d - 1.0)), (1, -2.0 * d * (d - 1.0)), (2, d * (d - 1.0))]);
        rows.push((second_row, second[0]));
        rows.push((unit(&[(degree - 1, -d), (degree, d)]), end[0]));
        let size = degree + 1 + rows.len();
        let mut system = DMatrix::zeros(size, size);
        let mut rhs = DVector::zeros(size);
        for i in 0..=degree {
            for j in 0..=degree {
                let terms = (1..=3).map(|r| energy.weights[r - 1] * energy_matrix(degree, r).f64_at(i, j));
                system[(i, j)] = terms.sum();
            }
        }
        for (k, (row, value)) in rows.iter().enumerate() {
            for (j, &x) in row.iter().enumerate() {
                system[(degree + 1 + k, j)] = x;
                system[(j, degree + 1 + k)] = x;
            }
            rhs[degree + 1 + k] = *value;
        }
        let wanted = system.full_piv_lu().solve(&rhs).unwrap();
        let error = worst(&solved.coords, &wanted.as_slice()[..=degree]);
        assert!(error < 1e-10, "case {case}: {error:e}");
    }
}

#[test]
fn the_energy_reported_is_that_of_the_curve() {
    for degree in [1, 2, 3, 6, 12, 30] {
        let coords = random_points(3 * (degree + 1), 5);
        let known: Vec<bool> = (0..=degree).map(|i| i % 3 != 1 || degree < 3).collect();
        let energy = Energy { weights: [0.3, 1.0, 0.0] };
        let solved = solve(3, &coords, &known, energy);
        let mut wanted = 0.0;
        for (order, weight) in [(1, 0.3), (2, 1.0)] {
            let matrix = energy_matrix(degree, order);
            for (i, a) in solved.coords.chunks(3).enumerate() {
                for (j, b) in solved.coords.chunks(3).enumerate() {
                    wanted += weight * matrix.f64_at(i, j) * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        let energy = solved.energies[0];
        assert!((energy - wanted).abs() < 1e-10 * wanted, "degree {degree}: {energy}, {wanted}");
    }
}

/// SVD's pseudoinverse finds the minimum-norm solution too.
#[test]
fn what_is_not_determined_is_the_smallest_and_says_so() {
    for (degree, known, order) in [(3, vec![], 2), (3, vec![1], 2), (5, vec![5], 2), (6, vec![2, 4], 3), (4, vec![], 1)]
    {
        let coords = random_points(2 * (degree + 1), 9);
        let flags: Vec<bool> = (0..=degree).map(|i| known.contains(&i)).collect();
        let solved = solve(2, &coords, &flags, Energy::of_order(order));
        assert_eq!(solved.statuses, [CurveStatus::NotUnique]);
        let unknown: Vec<usize> = (0..=degree).filter(|i| !known.contains(i)).collect();
        let matrix = energy_matrix(degree, order);
        let a = DMatrix::from_fn(unknown.len(), unknown.len(), |i, j| matrix.f64_at(unknown[i], unknown[j]));
        let inverse = a.pseudo_inverse(1e-9).unwrap();
        for c in 0..2 {
            let rhs = DVector::from_fn(unknown.len(), |i, _| {
                -known.iter().map(|&k| matrix.f64_at(unknown[i], k) * coords[2 * k + c]).sum::<f64>()
            });
            let wanted = &inverse * rhs;
            let found: Vec<f64> = unknown.iter().map(|&i| solved.coords[2 * i + c]).collect();
            assert!(worst(&found, wanted.as_slice()) < 1e-11, "degree {degree}, {known:?}");
        }
        assert!(solved.energies[0] < 1e-24, "{}", solved.energies[0]);
    }
}

#[test]
fn refused_curves_keep_their_points_and_leave_their_neighbours_bits() {
    let mut random = StdRng::seed_from_u64(11);
    let (mut coords, mut offsets, mut known) = (Vec::new(), vec![0], Vec::new());
    let mut push = |count: usize, random: &mut StdRng, spoil: Option<f64>| {
        for k in 0..count {
            known.push(k == 0 || k + 1 == count || random.random_bool(0.5));
            coords.extend([random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)]);
        }
        if let Some(x) = spoil {
            let end = coords.len() - 1;
            coords[end] = x;
        }
        offsets.push(known.len());
    };
    let good = [0, 2, 4, 6, 8];
    push(5, &mut random, None);
    push(4, &mut random, Some(f64::NAN));
    push(7, &mut random, None);
    push(0, &mut random, None);
    push(31, &mut random, None);
    push(32, &mut random, None);
    push(2, &mut random, None);
    push(6, &mut random, Some(f64::MAX));
    push(1, &mut random, None);
    let polygons = Polygons { dimension: 2, coords: &coords, offsets: &offsets };
    let given = Given { known: Some(&known), ..Given::default() };
    let solved = complete(&polygons, &given, &Energy::bending(), &Device::cpu()).unwrap();
    let kinds: Vec<(usize, CurveStatus)> = solved.refusals.iter().map(|(i, refusal)| (*i, refusal.status())).collect();
    use CurveStatus::{Degenerate, Invalid};
    assert_eq!(kinds, [(1, Invalid), (3, Degenerate), (5, Invalid), (7, Invalid)]);
    assert!(matches!(solved.refusals[0].1, Refusal::Value(3, 1, value) if value.is_nan()));
    assert_eq!((solved.refusals[2].1, solved.refusals[3].1), (Refusal::Degree(32), Refusal::Overflow));
    for i in 0..offsets.len() - 1 {
        let own = offsets[i] * 2..offsets[i + 1] * 2;
        if good.contains(&i) {
            let alone = solve(2, &coords[own.clone()], &known[offsets[i]..offsets[i + 1]], Energy::bending());
            assert_eq!(solved.coords[own], alone.coords, "curve {i}");
            assert_eq!(solved.energies[i].to_bits(), alone.energies[0].to_bits());
        } else {
            let bits = |slice: &[f64]| slice.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
            assert_eq!(bits(&solved.coords[own.clone()]), bits(&coords[own]));
            assert!(solved.energies[i].is_nan());
        }
    }
}

#[test]
fn every_refusal_says_where_what_and_what_to_do() {
    let sentence = |refusal: Refusal| refusal.sentence(5);
    assert_eq!(sentence(Refusal::Value(2, 1, f64::INFINITY)).0, 2);
    assert!(
        sentence(Refusal::Value(2, 1, f64::INFINITY))
            .1
            .starts_with("y is inf; a known control point needs finite numbers")
    );
    assert!(sentence(Refusal::Degree(33)).1.starts_with("33 control points make a curve of degree 32; up to 30"));
    assert_eq!(
        sentence(Refusal::Derivative(1, 2)),
        (4, "the derivative of order 2 at the end is not finite: mend it, or leave it out".into())
    );
    assert_eq!(
        sentence(Refusal::NoDirection(0)),
        (0, "the direction at the start is 0: give one, or leave it out".into())
    );
    assert!(sentence(Refusal::Contradiction).1.contains("leave some out"));
    assert!(sentence(Refusal::Still(1)).1.contains("turn the direction"));
    assert!(sentence(Refusal::Overflow).1.contains("overflow"));
    assert!(sentence(Refusal::Empty).1.contains("one control point at least"));
}

#[test]
fn what_is_given_twice_is_refused() {
    let coords = [0.0, 1.0, f64::NAN, 3.0];
    let polygons = Polygons { dimension: 1, coords: &coords, offsets: &[0, 4] };
    let given = Given {
        known: Some(&[true, true, false, true]),
        derivatives: [[Some(&[3.0]), None, None], [None; 3]],
        directions: false,
    };
    let solved = complete(&polygons, &given, &Energy::bending(), &Device::cpu()).unwrap();
    assert_eq!(solved.refusals, [(0, Refusal::Contradiction)]);
}

#[test]
fn arrays_that_do_not_fit_are_an_error_with_a_sentence() {
    let device = Device::cpu();
    let text = |dimension, coords: &[f64], offsets: &[usize], given: Given| {
        let polygons = Polygons { dimension, coords, offsets };
        complete(&polygons, &given, &Energy::bending(), &device).unwrap_err().to_string()
    };
    let none = Given::default();
    assert!(text(5, &[], &[0], none).contains("control points have 5 coordinates; 1 to 4 are possible"));
    assert!(text(2, &[1.0], &[0], none).contains("1 coordinates are no whole number of 2-D points"));
    assert!(text(1, &[1.0, 2.0], &[0, 1], none).contains("begin with 0, never decrease, and end with 2"));
    assert!(text(1, &[1.0], &[0, 1], Given { known: Some(&[]), ..none }).contains("0 known flags for 1 points"));
    let derivatives = [[Some(&[1.0, 2.0][..]), None, None], [None; 3]];
    assert!(text(1, &[1.0], &[0, 1], Given { derivatives, ..none }).contains("2 numbers for 1 of derivatives"));
    let line = Polygons { dimension: 1, coords: &[0.0, 1.0], offsets: &[0, 2] };
    assert!(
        elevate(&line, 30, &device)
            .unwrap_err()
            .to_string()
            .contains("curve 0 has degree 1 and cannot be elevated by 30")
    );
    assert!(reduce(&line, 1, &device).unwrap_err().to_string().contains("cannot be reduced by 1"));
    // No number overflows.
    assert!(elevate(&line, usize::MAX, &device).is_err() && reduce(&line, usize::MAX, &device).is_err());
    assert!(split(&line, 1.5, &device).unwrap_err().to_string().contains("t = 1.5"));
}

/// Speeds of least energy, found by trying: no other pair of speeds is cheaper, and directions are
/// kept.
#[test]
fn directions_take_the_speeds_of_least_energy() {
    let mut random = StdRng::seed_from_u64(23);
    let (mut usable, mut still) = (0, 0);
    for _ in 0..200 {
        let degree: usize = random.random_range(3..=7);
        let mut known = vec![false; degree + 1];
        (known[0], known[degree]) = (true, true);
        let coords: Vec<f64> = (0..2 * (degree + 1)).map(|_| random.random_range(-1.0..1.0)).collect();
        let mut direction = || [random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)];
        let (start, end) = (direction(), direction());
        let solve = |start: [f64; 2], end: [f64; 2], directions| {
            let derivatives = [[Some(&start[..]), None, None], [Some(&end[..]), None, None]];
            let polygons = Polygons { dimension: 2, coords: &coords, offsets: &[0, degree + 1] };
            complete(
                &polygons,
                &Given { known: Some(&known), derivatives, directions },
                &Energy::bending(),
                &Device::cpu(),
            )
            .unwrap()
        };
        let least = solve(start, end, true);
        let with = |a: f64, b: f64| solve(start.map(|x| a * x), end.map(|x| b * x), false).energies[0];
        match least.refusals[..] {
            [] => {
                usable += 1;
                let speed = |i: usize, j: usize, direction: [f64; 2]| {
                    let step: Vec<f64> =
                        (0..2).map(|c| degree as f64 * (least.coords[2 * j + c] - least.coords[2 * i + c])).collect();
                    let along = (step[0] * direction[0] + step[1] * direction[1])
                        / (direction[0].powi(2) + direction[1].powi(2));
                    assert!((step[0] - along * direction[0]).hypot(step[1] - along * direction[1]) < 1e-12);
                    along
                };
                let (a, b) = (speed(0, 1, start), speed(degree - 1, degree, end));
                assert!(a > 0.0 && b > 0.0);
                for (da, db) in [(1.01, 1.0), (0.99, 1.0), (1.0, 1.01), (1.0, 0.99), (1.5, 0.7), (0.5, 1.5)] {
                    assert!(with(a * da, b * db) > least.energies[0] * (1.0 - 1e-12));
                }
            }
            [(0, Refusal::Still(_))] => {
                still += 1;
                // Slower is cheaper at one end at least.
                let slower = [(0.01, 1.0), (1.0, 0.01), (0.01, 0.01)]
                    .into_iter()
                    .map(|(a, b)| with(a, b))
                    .fold(f64::MAX, f64::min);
                assert!(slower < with(1.0, 1.0));
            }
            _ => panic!("{:?}", least.refusals),
        }
    }
    println!("{usable} curves have speeds, {still} would stand still");
    assert!(usable > 40 && still > 40);
}
