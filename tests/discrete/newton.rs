//! Newton's method in the Sobolev metric takes a handful of iterations, however fine the curves.

use faircurve::discrete::{Energy, Fair, Segments, Solver, bending, length, variation};
use faircurve::{CurveReport, CurveStatus, Device, Fit, Sampling};

use crate::rough::Family;

const SEED: u64 = 11;

fn family(dimension: usize, closed: bool) -> Family {
    Family { dimension, closed, points: if closed { 8 } else { 5 }, sigma: if closed { 0.1 } else { 0.2 } }
}

fn fit(fair: &Fair, family: Family, curves: usize) -> Fit {
    println!("{family}: {}, seed {SEED}", fair.energy);
    fair.fit(&family.batch(curves, SEED), &Device::cpu()).unwrap()
}

/// Median of the iterations; all must have converged.
fn median(fit: &Fit) -> u32 {
    let converged = |report: &CurveReport| {
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        report.iterations
    };
    let mut iterations: Vec<u32> = fit.reports().iter().map(converged).collect();
    iterations.sort_unstable();
    println!("    median {}, most {}", iterations[iterations.len() / 2], iterations[iterations.len() - 1]);
    iterations[iterations.len() / 2]
}

fn gentle(energy: Energy, most: u32, curves: usize) {
    for (dimension, closed) in [(2, false), (3, false), (2, true), (3, true)] {
        let fair = Fair { energy: energy.clone(), ..Fair::default() };
        let median = median(&fit(&fair, family(dimension, closed), curves));
        assert!(median <= most, "{} {dimension}-D closed {closed}: {median} iterations", fair.energy);
    }
}

#[test]
fn gentle_curves_of_least_bending_take_five_iterations_at_most() {
    gentle(bending(2.0), 5, 100);
    gentle(bending(2.0) + 0.1 * length(), 5, 100);
    gentle(bending(2.0) + length(), 5, 100);
}

#[test]
fn gentle_curves_of_other_energies_take_twelve_at_most() {
    gentle(bending(3.0) + length(), 12, 50);
    gentle(bending(4.0) + length(), 12, 50);
}

#[test]
fn gentle_planar_curves_of_least_variation_take_twelve_at_most() {
    for closed in [false, true] {
        let fair = Fair { energy: variation() + length(), ..Fair::default() };
        assert!(median(&fit(&fair, family(2, closed), 20)) <= 12);
    }
}

#[test]
fn the_number_of_iterations_does_not_depend_on_that_of_the_vertices() {
    for segments in [8, 32, 256] {
        let fair =
            Fair { energy: bending(2.0) + 0.1 * length(), segments: Segments::PerSpan(segments), ..Fair::default() };
        assert!(median(&fit(&fair, family(2, false), 40)) <= 4, "{segments} edges a span");
    }
}

#[test]
fn rough_curves_converge_where_length_bounds_them() {
    for dimension in [2, 3] {
        let fair = Fair { energy: bending(2.0) + length(), max_iterations: 100, ..Fair::default() };
        let rough = Family { sigma: 1.2, ..family(dimension, false) };
        median(&fit(&fair, rough, 200));
    }
}

#[test]
fn without_length_rough_curves_are_unbounded_or_minimal_but_never_neither() {
    let fair = Fair { energy: bending(2.0), max_iterations: 100, ..Fair::default() };
    let fit = fit(&fair, Family { sigma: 1.2, ..family(2, false) }, 200);
    let count = |status: CurveStatus| fit.reports().iter().filter(|report| report.status == status).count();
    let (converged, unbounded) = (count(CurveStatus::Converged), count(CurveStatus::Unbounded));
    println!("{converged} converged, {unbounded} unbounded");
    assert_eq!(converged + unbounded, 200);
    assert!(converged > 50 && unbounded > 50);
}

#[test]
fn by_default_rough_curves_converge_within_a_hundred_iterations() {
    for dimension in [2, 3] {
        for closed in [false, true] {
            let rough = Family { sigma: 1.2, ..family(dimension, closed) };
            median(&fit(&Fair { max_iterations: 100, ..Fair::default() }, rough, 200));
        }
    }
}

#[test]
fn newton_and_sobolev_gradients_end_at_the_same_curves() {
    for (energy, closed) in [(bending(2.0) + 0.1 * length(), false), (bending(3.0) + length(), true)] {
        let newton = Fair { energy, ..Fair::default() };
        let gradients = Fair { solver: Solver::Sobolev, ..newton.clone() };
        let [a, b] = [&newton, &gradients].map(|fair| fit(fair, family(2, closed), 30));
        let [p, q] = [&a, &b].map(|fit| fit.polylines(Sampling::PerSpan(16)));
        for i in 0..30 {
            let both = [&a, &b].map(|fit| fit.reports()[i].status);
            assert_eq!(both, [CurveStatus::Converged; 2], "curve {i}");
            let far = p.points(i).iter().zip(q.points(i)).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            // Gradients of 1e-8 leave that much of the curve.
            assert!(far <= 1e-7, "curve {i}: {far:e}");
        }
    }
}

#[test]
fn exponents_far_from_two_are_reached_in_stages() {
    let points = [[0.0, 0.0], [1.0, 0.6], [2.1, 0.1], [3.0, 0.9]];
    let batch = faircurve::CurveBatch::from_slices(&[&points[..]]).unwrap();
    for (exponent, segments) in [(8.0, 16), (20.0, 16), (20.0, 64)] {
        let fair = Fair { energy: bending(exponent), segments: Segments::PerSpan(segments), ..Fair::default() };
        let fit = fair.fit(&batch, &Device::cpu()).unwrap();
        println!("ν = {exponent}, {segments} edges a span: {} iterations", fit.reports()[0].iterations);
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
        assert!(fit.reports()[0].iterations <= 30);
    }
}

#[test]
fn a_curve_of_a_hundred_thousand_vertices_takes_no_more_iterations_than_one_of_a_hundred() {
    let long = Family { points: 6_251, ..family(2, false) };
    let fair = Fair { energy: bending(2.0) + 0.1 * length(), ..Fair::default() };
    let fit = fit(&fair, long, 1);
    println!("{} iterations, {:e}", fit.reports()[0].iterations, fit.reports()[0].gradient_norm);
    assert_eq!(fit.polylines(Sampling::PerSpan(16)).total_points(), 100_001);
    assert_eq!(fit.reports()[0].status, CurveStatus::Converged, "{:?}", fit.reports()[0]);
    assert!(fit.reports()[0].iterations <= 12);
}
