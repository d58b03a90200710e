//! Splines on the integers keep what the book promises of them.

use faircurve::spline::uniform::{
    MAX_ROUNDS, coefficients, discrete_energies, exact_energies, inner_products, interpolated, subdivide,
};
use faircurve::{Constraints, CurveBatch, Device};
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// Largest difference; lengths must agree.
fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A ragged batch with every length from 1 to 40 and some longer, of random points in the unit
/// square or cube.
fn random_batch(dimension: usize, closed: bool, seed: u64) -> CurveBatch {
    let mut random = StdRng::seed_from_u64(seed);
    let mut offsets = vec![0];
    (1..=40).chain([0, 63, 64, 65, 257, 1000]).for_each(|n| offsets.push(offsets[offsets.len() - 1] + n));
    let coords = (0..offsets[offsets.len() - 1] * dimension).map(|_| random.random_range(-1.0..1.0)).collect();
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed(closed)
}

#[test]
fn the_reference_values_are_met() {
    let oracle: Value = serde_json::from_str(include_str!("../data/natural_cubic.json")).unwrap();
    let cases = oracle["uniform"].as_array().unwrap();
    assert_eq!(cases.len(), 5);
    let device = Device::cpu();
    let mut offsets = vec![0];
    let mut coords = Vec::new();
    for case in cases {
        coords.extend(numbers(&case["values"]));
        offsets.push(coords.len() / 2);
    }
    let values = CurveBatch::from_ragged(2, coords, offsets).unwrap();
    let p = coefficients(&values, &device).unwrap();
    let exact = exact_energies(&p, &device).unwrap();
    let half_steps = interpolated(&subdivide(&p, 1, &device).unwrap(), &device).unwrap();
    for (i, case) in cases.iter().enumerate() {
        assert!(worst(p.points(i), &numbers(&case["coefficients"])) < 1e-12);
        let energy = case["exact_energy"].as_f64().unwrap();
        assert!((exact[i] - energy).abs() < 1e-12 * energy, "{} {energy}", exact[i]);
        let halves: Vec<f64> = half_steps.points(i).chunks(2).skip(1).step_by(2).flatten().copied().collect();
        assert!(worst(&halves, &numbers(&case["samples_at_half_integers"])) < 1e-12);
        let wholes: Vec<f64> = half_steps.points(i).chunks(2).step_by(2).flatten().copied().collect();
        assert!(worst(&wholes, values.points(i)) < 1e-12);
    }
    for round in 0..7 {
        let energies = discrete_energies(&subdivide(&p, round, &device).unwrap(), round, &device).unwrap();
        for (case, energy) in cases.iter().zip(energies) {
            let wanted = case["discrete_energies"][round as usize].as_f64().unwrap();
            assert!((energy - wanted).abs() < 1e-12 * wanted, "round {round}: {energy} {wanted}");
        }
    }
}

#[test]
fn coefficients_solve_the_interpolation_system_of_every_curve() {
    for (dimension, closed) in [(2, false), (3, false), (2, true), (3, true)] {
        let values = random_batch(dimension, closed, 1);
        let device = Device::cpu();
        let p = coefficients(&values, &device).unwrap();
        let back = interpolated(&p, &device).unwrap();
        assert_eq!(back.offsets(), values.offsets());
        // Coefficients are at most 3 times as large as the values; a row of N rounds some four
        // times.
        assert!(worst(back.coords(), values.coords()) < 16.0 * f64::EPSILON);
        if !closed {
            for i in (0..values.len()).filter(|&i| values.count(i) > 0) {
                let (p, b) = (p.points(i), values.points(i));
                assert_eq!((&p[..dimension], &p[p.len() - dimension..]), (&b[..dimension], &b[b.len() - dimension..]));
            }
        }
    }
}

#[test]
fn discrete_energies_follow_the_law_of_a_quarter() {
    let device = Device::cpu();
    for closed in [false, true] {
        let p = random_batch(2, closed, 2);
        let exact = exact_energies(&p, &device).unwrap();
        let energies: Vec<Vec<f64>> = (0..=6)
            .map(|round| discrete_energies(&subdivide(&p, round, &device).unwrap(), round, &device).unwrap())
            .collect();
        for i in 0..p.len() {
            for (round, of_round) in energies.iter().enumerate() {
                let law = exact[i] + 0.25_f64.powi(round as i32) * (energies[0][i] - exact[i]);
                let error = (of_round[i] - law).abs();
                // Points below 1 are rounded, so a line of two points does not stay quite straight:
                // 4 ε a difference.
                let differences = (p.count(i) << round) as f64 * 2.0;
                let floor = 8_f64.powi(round as i32) * differences * (4.0 * f64::EPSILON).powi(2);
                assert!(error <= 1e-12 * law + floor, "{} points, closed {closed}, round {round}: {error}", p.count(i));
            }
            let error = (4.0 * energies[1][i] - energies[0][i] - 3.0 * exact[i]).abs();
            assert!(error <= 1e-12 * exact[i], "{} points, closed {closed}: {error}", p.count(i));
        }
    }
}

/// ∫|p″|² dt of the interpolating spline from its second derivatives: a dense solve of the classic
/// moment system.
fn moment_energy(values: &[f64], closed: bool) -> f64 {
    let n = values.len();
    let mut system = DMatrix::<f64>::zeros(n, n);
    let mut rhs = DVector::<f64>::zeros(n);
    for k in 0..n {
        if !closed && (k == 0 || k + 1 == n) {
            system[(k, k)] = 1.0;
            continue;
        }
        let (before, next) = ((k + n - 1) % n, (k + 1) % n);
        system[(k, before)] += 1.0 / 6.0;
        system[(k, k)] += 2.0 / 3.0;
        system[(k, next)] += 1.0 / 6.0;
        rhs[k] = values[next] - 2.0 * values[k] + values[before];
    }
    let moments = system.lu().solve(&rhs).unwrap();
    let spans = if closed { n } else { n - 1 };
    (0..spans).map(|k| (moments[k], moments[(k + 1) % n])).map(|(a, b)| (a * a + a * b + b * b) / 3.0).sum()
}

#[test]
fn the_exact_energy_is_the_integral_of_the_squared_second_derivative() {
    let device = Device::cpu();
    for closed in [false, true] {
        let values = random_batch(3, closed, 3);
        let energies = exact_energies(&coefficients(&values, &device).unwrap(), &device).unwrap();
        for i in (0..values.len()).filter(|&i| (1..=65).contains(&values.count(i))) {
            let axis = |axis: usize| values.points(i).iter().skip(axis).step_by(3).copied().collect::<Vec<_>>();
            let wanted: f64 = (0..3).map(|k| moment_energy(&axis(k), closed)).sum();
            let error = (energies[i] - wanted).abs();
            assert!(error <= 1e-12 * wanted, "{} points, closed {closed}: {error} of {wanted}", values.count(i));
        }
    }
}

#[test]
fn no_other_curve_through_the_values_has_less_energy() {
    // Against the splines of one round more, of which those through the values on the integers are
    // all competitors.
    let device = Device::cpu();
    let values = random_batch(2, false, 4);
    let p = coefficients(&values, &device).unwrap();
    let least = exact_energies(&p, &device).unwrap();
    let fine = interpolated(&subdivide(&p, 1, &device).unwrap(), &device).unwrap();
    let mut random = StdRng::seed_from_u64(5);
    let mut coords = fine.coords().to_vec();
    for i in 0..fine.len() {
        for k in (0..fine.count(i)).skip(1).step_by(2) {
            coords[(fine.offsets()[i] + k) * 2] += random.random_range(-1e-3..1e-3);
        }
    }
    let moved = CurveBatch::from_ragged(2, coords, fine.offsets().to_vec()).unwrap();
    let energies = exact_energies(&coefficients(&moved, &device).unwrap(), &device).unwrap();
    for i in (0..p.len()).filter(|&i| p.count(i) > 1) {
        // Half steps: ∫|p″|² grows by 2³.
        assert!(8.0 * energies[i] > least[i], "{} points: {} {}", p.count(i), 8.0 * energies[i], least[i]);
    }
}

#[test]
fn inner_products_are_symmetric_and_belong_to_the_energy() {
    let device = Device::cpu();
    for closed in [false, true] {
        let (p, q) = (random_batch(2, closed, 6), random_batch(2, closed, 7));
        let (pq, qp) = (inner_products(&p, &q, &device).unwrap(), inner_products(&q, &p, &device).unwrap());
        assert_eq!(pq, qp);
        let sum = p.coords().iter().zip(q.coords()).map(|(p, q)| p + q).collect();
        let sum = CurveBatch::from_ragged(2, sum, p.offsets().to_vec()).unwrap().closed(closed);
        let [of_p, of_q, of_sum] = [&p, &q, &sum].map(|batch| exact_energies(batch, &device).unwrap());
        for i in 0..p.len() {
            let wanted = of_p[i] + 2.0 * pq[i] + of_q[i];
            assert!((of_sum[i] - wanted).abs() <= 1e-13 * (of_p[i] + of_q[i]), "{} points", p.count(i));
        }
    }
}

#[test]
fn straight_and_short_curves_stay_what_they_are() {
    let device = Device::cpu();
    let (one, two) = ([[3.0, -1.0]], [[0.0, 0.0], [8.0, 4.0]]);
    let line: Vec<[f64; 2]> = (0..9).map(|k| [k as f64, 2.0 * k as f64]).collect();
    let batch = CurveBatch::from_slices(&[&one[..], &two[..], &line[..], &[]]).unwrap();
    let p = coefficients(&batch, &device).unwrap();
    assert!(worst(p.coords(), batch.coords()) < 1e-14);
    let fine = subdivide(&batch, 2, &device).unwrap();
    assert_eq!(fine.offsets(), [0, 1, 6, 39, 39]);
    assert_eq!(fine.points(1), [0.0, 0.0, 2.0, 1.0, 4.0, 2.0, 6.0, 3.0, 8.0, 4.0]);
    assert!(fine.points(2).chunks(2).all(|point| point[1] == 2.0 * point[0]));
    assert_eq!(exact_energies(&batch, &device).unwrap(), [0.0; 4]);
    assert_eq!(discrete_energies(&fine, 2, &device).unwrap(), [0.0; 4]);
    let closed = subdivide(&batch.closed(true), 2, &device).unwrap();
    assert_eq!(closed.offsets(), [0, 4, 12, 48, 48]);
    assert_eq!(closed.points(0), [3.0, -1.0].repeat(4));
}

#[test]
fn a_closed_curve_whose_finer_points_meet_keeps_them_all() {
    // The subdivided flat ring passes through its first point again at its end.
    let flat = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&flat[..]]).unwrap().closed(true);
    let collapsed = CurveBatch::from_slices(&[&[[0.5, 0.5]; 3][..2]]).unwrap();
    assert_eq!(subdivide(&batch, 3, &Device::cpu()).unwrap().count(0), 32);
    assert_eq!(subdivide(&collapsed, 1, &Device::cpu()).unwrap().count(0), 3);
}

#[test]
fn a_spoiled_curve_leaves_its_neighbours_bits_alone() {
    let device = Device::cpu();
    let good = random_batch(2, false, 8);
    let mut coords = good.coords().to_vec();
    let spoiled = 20;
    coords[good.offsets()[spoiled] * 2 + 3] = f64::NAN;
    let bad = CurveBatch::from_ragged(2, coords, good.offsets().to_vec()).unwrap();
    let (p, q) = (coefficients(&good, &device).unwrap(), coefficients(&bad, &device).unwrap());
    assert!(q.problem(spoiled).unwrap().message.contains("y is NaN"));
    let (fine_p, fine_q) = (subdivide(&p, 3, &device).unwrap(), subdivide(&q, 3, &device).unwrap());
    let (e, f) = (exact_energies(&p, &device).unwrap(), exact_energies(&q, &device).unwrap());
    for i in 0..good.len() {
        if i == spoiled {
            assert!(f[i].is_nan());
            assert_eq!(q.points(i)[..3], good.points(i)[..3]);
        } else {
            assert_eq!((p.points(i), fine_p.points(i), e[i]), (q.points(i), fine_q.points(i), f[i]));
        }
    }
}

#[test]
fn impossible_requests_are_sentences() {
    let device = Device::cpu();
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]][..]]).unwrap();
    let says = |error: faircurve::Error, sentence: &str| assert_eq!(error.to_string(), sentence);
    says(
        subdivide(&batch, 30, &device).unwrap_err(),
        "30 rounds of subdivision would make 2147483649 points, more than 100000000: \
         use 25 rounds at most, or fewer curves at a time",
    );
    says(
        discrete_energies(&batch, MAX_ROUNDS + 1, &device).unwrap_err(),
        "49 rounds of subdivision were asked for; 48 at most are possible, and 10 make any curve smooth",
    );
    assert!(subdivide(&batch, u32::MAX, &device).is_err());
    let other = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]]).unwrap();
    says(
        inner_products(&batch, &other, &device).unwrap_err(),
        "inner products pair curves of equal shape, but curve 0 has 3 points in one batch and 2 in the other",
    );
    says(
        inner_products(&batch, &batch.clone().closed(true), &device).unwrap_err(),
        "inner products pair curves of equal shape, but curve 0 is closed in one batch and open in the other",
    );
    says(
        inner_products(&batch, &batch.select(&[0, 0]), &device).unwrap_err(),
        "inner products pair curves of equal shape, but one batch has 1 curves and the other 2",
    );
    let solid = CurveBatch::from_slices(&[&[[0.0; 3]; 3][..]]).unwrap();
    says(
        inner_products(&batch, &solid, &device).unwrap_err(),
        "inner products pair curves of equal shape, but one batch is 2-D and the other 3-D",
    );
    let tangents = Some(vec![1.0; 6]);
    let bound = batch.with_constraints(Constraints { tangents, ..Constraints::default() }).unwrap();
    let error = coefficients(&bound, &device).unwrap_err().to_string();
    assert_eq!(
        error,
        "splines on the integers know no tangents (columns tx ty tz): leave these columns out, or choose a method that knows them"
    );
}
