//! Cubic splines by any conditions at their ends, and what is asked of piecewise polynomials.
//!
//! `python/tests/test_scipy.py` holds them against SciPy's.

use faircurve::spline::{EndCondition, Extrapolate, Knotted, Piecewise};
use faircurve::{CurveStatus, Device};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const NOT_A_KNOT: [EndCondition<'static>; 2] = [EndCondition::NotAKnot; 2];

/// Random knots of curves of 2 to 12 points.
fn knots(seed: u64) -> (Vec<f64>, Vec<usize>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut x, mut offsets) = (Vec::new(), vec![0]);
    for i in 0..60 {
        let mut at: f64 = random.random_range(-3.0..3.0);
        for _ in 0..2 + i % 11 {
            x.push(at);
            at += random.random_range(0.05..2.0);
        }
        offsets.push(x.len());
    }
    (x, offsets)
}

/// Columns of random values.
fn values(seed: u64, count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-1.0..1.0)).collect()
}

fn cubic(given: &Knotted, ends: &[EndCondition; 2]) -> Piecewise {
    Piecewise::cubic(given, ends, &Device::cpu()).unwrap()
}

fn close(a: f64, b: f64, what: &str) {
    assert!((a - b).abs() <= 1e-11 * b.abs().max(1.0), "{what}: {a} instead of {b}");
}

#[test]
fn a_cubic_is_its_own_spline_without_knots_at_the_ends() {
    let (x, offsets) = knots(1);
    // Degrees as low as the numbers of knots call for: a line, a parabola, a cubic.
    let term = |i: usize| (offsets[i + 1] - offsets[i]).min(4) - 1;
    let p = |i: usize, x: f64| [1.0 + 0.5 * x, 0.3 * x * x, -0.2 * x * x * x][..term(i)].iter().sum::<f64>();
    let first = |i: usize, x: f64| [0.5, 0.6 * x, -0.6 * x * x][..term(i)].iter().sum::<f64>();
    let primitive =
        |i: usize, x: f64| [x + 0.25 * x * x, 0.1 * x.powi(3), -0.05 * x.powi(4)][..term(i)].iter().sum::<f64>();
    let y: Vec<f64> = (0..60).flat_map(|i| x[offsets[i]..offsets[i + 1]].iter().map(move |&x| p(i, x))).collect();
    let splines = cubic(&Knotted { x: &x, offsets: &offsets, y: &y, columns: 1, periodic: false }, &NOT_A_KNOT);
    let places: Vec<f64> = (-10..30).map(|k| 0.5 * f64::from(k)).collect();
    let all = |nu: usize| splines.evaluate_all(&places, nu, Extrapolate::Yes);
    let (points, slopes, fourth) = (all(0), all(1), all(4));
    let integrals = splines.integrate(-1.5, 2.5, Extrapolate::Yes);
    let primitives = splines.antiderivative(1).evaluate_all(&places, 0, Extrapolate::Yes);
    for i in 0..60 {
        for (k, &x) in places.iter().enumerate() {
            let at = i * places.len() + k;
            // Beyond the knots rounding grows as the cube of the distance in spans.
            let scale = (1.0 + x.abs()).powi(3);
            close(points[at] / scale, p(i, x) / scale, "values");
            close(slopes[at] / scale, first(i, x) / scale, "derivatives");
            assert_eq!(fourth[at], 0.0);
            let start = splines.knots(i)[0];
            let scale = scale * (1.0 + x.abs());
            close(primitives[at] / scale, (primitive(i, x) - primitive(i, start)) / scale, "antiderivatives");
        }
    }
    for (i, integral) in integrals.into_iter().enumerate() {
        close(integral, primitive(i, 2.5) - primitive(i, -1.5), "integrals");
    }
}

#[test]
fn conditions_are_met_and_curvature_does_not_jump() {
    let (x, offsets) = knots(2);
    let columns = 5;
    let mut y = values(3, x.len() * columns);
    let given = values(4, 60 * columns);
    let conditions = [EndCondition::First(&given), EndCondition::Second(&given)];
    for (periodic, ends) in [(false, conditions), (true, NOT_A_KNOT), (false, NOT_A_KNOT)] {
        if periodic {
            for pair in offsets.windows(2) {
                y.copy_within(pair[0] * columns..(pair[0] + 1) * columns, (pair[1] - 1) * columns);
            }
        }
        let splines = cubic(&Knotted { x: &x, offsets: &offsets, y: &y, columns, periodic }, &ends);
        let at = |i: usize, x: f64, nu: usize| {
            let place = [x];
            splines.evaluate_all(&place, nu, Extrapolate::Yes)[i * columns..(i + 1) * columns].to_vec()
        };
        for i in 0..60 {
            let knots = splines.knots(i);
            let (c, last) = (splines.coefficients(i), knots.len() - 2);
            for column in 0..columns {
                for span in 0..last {
                    // From the left and from the right.
                    let h = knots[span + 1] - knots[span];
                    let m = |span: usize, m: usize| c[(span * 4 + m) * columns + column];
                    let scale = y.iter().fold(1.0 / h / h, |a: f64, b| a.max(b.abs() / h / h));
                    let second = 6.0 * m(span, 0) * h + 2.0 * m(span, 1);
                    assert!((second - 2.0 * m(span + 1, 1)).abs() < 1e-9 * scale, "curve {i}, knot {}", span + 1);
                }
                let (from, to) = (knots[0], knots[last + 1]);
                if let (EndCondition::First(_), value) = (ends[0], given[i * columns + column]) {
                    close(at(i, from, 1)[column], value, "first derivative");
                    assert!((at(i, to, 2)[column] - value).abs() < 1e-9 * (1.0 + (to - from).powi(-2)), "second, {i}");
                }
                if periodic {
                    for nu in 1..3 {
                        let (a, b) = (at(i, from, nu)[column], at(i, to, nu)[column]);
                        assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "derivative {nu} of curve {i}: {a} and {b}");
                    }
                }
            }
        }
    }
}

#[test]
fn places_of_a_value_are_all_found() {
    let (x, offsets) = knots(5);
    let y = values(6, x.len());
    let splines = cubic(&Knotted { x: &x, offsets: &offsets, y: &y, columns: 1, periodic: false }, &NOT_A_KNOT);
    for (i, roots) in splines.solve(0.1, Extrapolate::No).iter().enumerate() {
        let knots = splines.knots(i);
        assert!(roots.is_sorted() && roots.iter().all(|x| (knots[0]..=knots[knots.len() - 1]).contains(x)));
        let at = |x: f64| splines.evaluate_all(&[x], 0, Extrapolate::Yes)[i] - 0.1;
        assert!(roots.iter().all(|&x| at(x).abs() < 1e-12), "curve {i}: {roots:?}");
        // Where the sign changes between neighbours of a fine net, there is one.
        let net: Vec<f64> =
            (0..=2000).map(|k| knots[0] + (knots[knots.len() - 1] - knots[0]) * f64::from(k) / 2000.0).collect();
        let below: Vec<bool> = net.iter().map(|&x| at(x) < 0.0).collect();
        let changes = below.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(roots.len() >= changes && roots.len() <= changes + 2, "curve {i}: {} of {changes}", roots.len());
    }
    // A double root, and a span that is 0 all along.
    let parabola = [4.0, 1.0, 0.0, 1.0, 4.0];
    let line = [0.0, 1.0, 2.0, 3.0, 4.0];
    let of = |y: &[f64]| {
        cubic(&Knotted { x: &line, offsets: &[0, 5], y, columns: 1, periodic: false }, &NOT_A_KNOT)
            .solve(0.0, Extrapolate::Yes)
            .remove(0)
    };
    assert_eq!(of(&parabola), [2.0]);
    assert_eq!(of(&[0.0; 5]).iter().filter(|x| x.is_nan()).count(), 4);
}

#[test]
fn a_curve_without_a_spline_is_data_and_leaves_its_neighbours_alone() {
    let x = [0.0, 1.0, 3.0, 5.0, 5.0, 6.0, 0.0, 0.0, 2.0, 3.0];
    let mut y = values(7, 20);
    y[17] = f64::INFINITY;
    // Four curves: good, with equal knots, of one knot, of none; and one with a value that is none.
    let offsets = [0, 3, 6, 7, 7, 10];
    let splines = cubic(&Knotted { x: &x, offsets: &offsets, y: &y, columns: 2, periodic: false }, &NOT_A_KNOT);
    let good: Vec<bool> = splines.status().iter().map(|status| *status == CurveStatus::Converged).collect();
    assert_eq!(good, [true, false, false, false, false]);
    let alone = cubic(&Knotted { x: &x[..3], offsets: &[0, 3], y: &y[..6], columns: 2, periodic: false }, &NOT_A_KNOT);
    assert_eq!(splines.coefficients(0), alone.coefficients(0));
    let values = splines.evaluate_all(&[0.5], 0, Extrapolate::Yes);
    assert!(values[..2].iter().all(|x| x.is_finite()) && values[2..].iter().all(|x| x.is_nan()));
    for (i, sentence) in [
        (1, "curve 1: knot 1 is 5 after 5: knots must increase"),
        (2, "curve 2 has 1 knots: a spline needs two"),
        (4, "curve 4: the value at knot 1 is inf, not a number"),
    ] {
        assert_eq!(splines.message(i), Some(sentence));
    }
    let not_closed =
        cubic(&Knotted { x: &x[..3], offsets: &[0, 3], y: &y[..6], columns: 2, periodic: true }, &NOT_A_KNOT);
    assert_eq!(not_closed.status(), [CurveStatus::Invalid]);
    for wrong in [
        Knotted { x: &x, offsets: &[0, 3], y: &y, columns: 2, periodic: false },
        Knotted { x: &x, offsets: &offsets, y: &y[1..], columns: 2, periodic: false },
        Knotted { x: &x, offsets: &offsets, y: &y, columns: 0, periodic: false },
    ] {
        assert!(Piecewise::cubic(&wrong, &NOT_A_KNOT, &Device::cpu()).is_err());
    }
}
