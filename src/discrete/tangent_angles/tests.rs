use std::f64::consts::TAU;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::shape::Curve;
use super::*;
use crate::discrete::lane::TerminationStatus;
use crate::discrete::setup::set_up;
use crate::discrete::{Fair, Segments, bending, length, plan, tautness, tension, variation};
use crate::linalg::skyline::Skyline;
use crate::{CurveBatch, Device};

/// The points of one open curve at unit steps, or of one ring around the unit circle.
fn points(closed: bool, rng: &mut StdRng, sigma: f64) -> Vec<[f64; 2]> {
    let mut normal = || {
        let (u, v): (f64, f64) = (rng.random_range(f64::MIN_POSITIVE..1.0), rng.random_range(0.0..1.0));
        sigma * (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
    };
    if !closed {
        return (0..5).map(|k| [f64::from(k), normal()]).collect();
    }
    let ring = |k: i32| {
        let (radius, angle) = (1.0 + normal(), TAU * f64::from(k) / 8.0);
        [radius * angle.cos(), radius * angle.sin()]
    };
    (0..8).map(ring).collect()
}

fn problem(energy: &Energy, points: &[[f64; 2]], closed: bool, segments: usize) -> Problem<2> {
    let batch = CurveBatch::from_slices(&[points]).unwrap().closed(closed);
    let fair = Fair { energy: energy.clone(), segments: Segments::PerSpan(segments), ..Fair::default() };
    *set_up::<2>(&fair, &batch).unwrap().remove(0).unwrap().problem
}

/// The start with every unknown perturbed.
fn shaken(angles: &Angles, rng: &mut StdRng) -> Curve {
    let p: Vec<f64> = (0..angles.shape.rows()).map(|_| rng.random_range(-0.1..0.1)).collect();
    angles.start.moved(&angles.shape, 1.0, &p)
}

fn every() -> Energy {
    variation() + 0.3 * bending(2.0) + 0.2 * length() + 0.1 * tautness() + 0.4 * tension()
}

#[test]
fn gradients_are_the_slopes_of_values_and_hessians_those_of_gradients() {
    let mut rng = StdRng::seed_from_u64(1);
    for (closed, segments) in [(false, 5), (true, 5), (false, 1), (true, 1)] {
        let problem = problem(&every(), &points(closed, &mut rng, 0.3), closed, segments);
        let angles = Angles::of(&every(), &problem).unwrap();
        let (shape, curve) = (&angles.shape, shaken(&angles, &mut rng));
        // The multipliers do not change.
        let mut p: Vec<f64> = (0..shape.rows()).map(|_| rng.random_range(-1.0..1.0)).collect();
        (0..shape.spans.len()).flat_map(|k| shape.rows_of_closure(k)).for_each(|row| p[row] = 0.0);
        let multipliers: Vec<[f64; 2]> =
            shape.spans.iter().map(|_| [0, 1].map(|_| rng.random_range(-9.0..9.0))).collect();
        // The Lagrangian, its gradient, and its Hessian as a dense matrix.
        let at = |curve: &Curve| {
            let (mut gradient, mut matrix) = (vec![0.0; shape.rows()], shape.matrix());
            let mut value = angles.functional.add(shape, curve, &mut gradient, &mut matrix);
            shape.add_closures(curve, &multipliers, &mut matrix);
            let full = matrix.dense();
            for (k, gap) in shape.gaps(curve).enumerate() {
                let rows = shape.rows_of_closure(k);
                for c in 0..2 {
                    value += multipliers[k][c] * gap[c];
                    (0..gradient.len()).for_each(|i| gradient[i] += multipliers[k][c] * full[rows[c]][i]);
                }
            }
            (value, gradient, full)
        };
        let step = 1e-6;
        let (before, after) = (at(&curve.moved(shape, -step, &p)), at(&curve.moved(shape, step, &p)));
        let (_, gradient, full) = at(&curve);
        let slope: f64 = gradient.iter().zip(&p).map(|(g, p)| g * p).sum();
        let difference = (after.0 - before.0) / (2.0 * step);
        // The errors are step² times the third derivative, and ε/step of the value.
        assert!(
            (slope - difference).abs() < 1e-6 * slope.abs().max(after.0),
            "{closed} {segments}: {slope} {difference}"
        );
        let size = gradient.iter().fold(0.0, |size: f64, g| size.max(g.abs()));
        for i in (0..gradient.len()).filter(|&i| p[i] != 0.0) {
            let product: f64 = full[i].iter().zip(&p).map(|(h, p)| h * p).sum();
            let difference = (after.1[i] - before.1[i]) / (2.0 * step);
            assert!(
                (product - difference).abs() < 1e-6 * size.max(product.abs()),
                "{closed} row {i}: {product} {difference}"
            );
        }
    }
}

#[test]
fn values_are_those_of_the_polygons() {
    let mut rng = StdRng::seed_from_u64(2);
    for closed in [false, true] {
        let mut problem = problem(&every(), &points(closed, &mut rng, 0.3), closed, 8);
        let angles = Angles::of(&every(), &problem).unwrap();
        let mut curve = angles.start.clone();
        let mut metric = angles.shape.matrix();
        (0..angles.shape.rows()).for_each(|row| metric.add(row, row, 1.0));
        metric.factor().unwrap();
        assert!(angles.shape.retract(&metric, &mut curve));
        problem.rebase(&angles.displacements(&curve, &problem));
        let (own, wanted) = (angles.functional.value(&angles.shape, &curve), problem.energy_of_base(&every()));
        // Third differences of edges that are rounded to ε have the error n³ ε.
        assert!((own - wanted).abs() < 1e-10 * wanted, "{own} {wanted}");
    }
}

#[test]
fn a_retraction_closes_every_span_to_rounding() {
    let mut rng = StdRng::seed_from_u64(3);
    for (closed, segments) in [(false, 16), (true, 16), (false, 2), (true, 3)] {
        let problem = problem(&variation(), &points(closed, &mut rng, 0.6), closed, segments);
        let angles = Angles::of(&variation(), &problem).unwrap();
        let mut curve = shaken(&angles, &mut rng);
        let mut search = Search::new(&angles.shape, angles.start.clone());
        search.add_metric(2, 1.0);
        angles.shape.add_closures(&angles.start, &vec![[0.0; 2]; angles.shape.spans.len()], search.matrix_mut());
        search.matrix_mut().factor().unwrap();
        let gap = |curve: &Curve| angles.shape.gaps(curve).flatten().fold(0.0, |most: f64, gap| most.max(gap.abs()));
        assert!(gap(&curve) > 1e-3);
        assert!(angles.shape.retract(search.matrix_mut(), &mut curve), "{closed} {segments}");
        assert!(gap(&curve) <= 1e-12 * angles.chord(), "{closed} {segments}: {:e}", gap(&curve));
        // Data points have not moved, and edges lead to them.
        let displacements: Vec<[f64; 2]> = angles.displacements(&curve, &problem);
        problem.data.iter().for_each(|&row| assert_eq!(displacements[row as usize], [0.0; 2]));
        let mut moved = problem.clone();
        moved.rebase(&displacements);
        for (edge, own) in moved.base.iter().zip(curve.edges(&angles.shape)) {
            assert!((0..2).all(|c| (edge[c] - own[c]).abs() < 1e-11 * angles.chord()), "{edge:?} {own:?}");
        }
    }
}

#[test]
fn a_circle_is_where_points_of_a_circle_lead() {
    // Unequal steps, so that the spline is not a circle.
    let at = [0.0, 0.5, 1.6, 2.4, 3.9, 4.7, 5.5].map(|angle: f64| [angle.cos(), angle.sin()]);
    let problem = problem(&variation(), &at, true, 16);
    let angles = Angles::of(&variation(), &problem).unwrap();
    let found: Found<2> = angles.descend(&problem, 60);
    let mut there = problem.clone();
    there.rebase(&found.displacements);
    // Edges of different spans differ in length, so the polygon on a circle does not have equal
    // turns.
    let (start, end) = (problem.energy_of_base(&variation()), there.energy_of_base(&variation()));
    assert!(end < 1e-4 * start && end < 1e-4, "{start:e} {end:e} {:?}", found.ending);
    // With points at equal steps all edges are equal, and the energy is 0 up to rounding.
    let equal: Vec<[f64; 2]> =
        (0..7).map(|k| TAU * f64::from(k) / 7.0).map(|angle| [angle.cos(), angle.sin()]).collect();
    let problem = self::problem(&variation(), &equal, true, 16);
    let angles = Angles::of(&variation(), &problem).unwrap();
    let mut search = Search::new(&angles.shape, angles.start.clone());
    let (functional, longest) = (&angles.functional, f64::INFINITY);
    search.descend(&Stage { functional, order: 2, tolerance: 0.0, longest, most_iterations: 8 });
    let turn = TAU / problem.base.len() as f64;
    for j in 0..problem.base.len() {
        let own = angles.shape.turn(&search.curve, j);
        assert!((own - turn).abs() < 1e-9, "edge {j}: {own} where {turn} was wanted");
    }
}

#[test]
fn where_newton_at_the_vertices_converges_angles_lead_to_the_same_energies() {
    let mut rng = StdRng::seed_from_u64(5);
    let energy = variation() + 0.1 * length();
    let plan = plan::Plan { solver: plan::Solver::Newton, order: 3, regularisation: 3 };
    for (closed, sigma) in [(false, 0.2), (false, 0.6), (true, 0.1)] {
        let (mut both, mut same) = (0, 0);
        for _ in 0..40 {
            let problem = problem(&energy, &points(closed, &mut rng, sigma), closed, 16);
            let of = |problem: &Problem<2>| {
                crate::discrete::problem::descend_on_cpu(&plan, &energy, &[problem], &|_, _| {}).remove(0)
            };
            let found: Found<2> = Angles::of(&energy, &problem).unwrap().descend(&problem, 60);
            let vertices = of(&problem);
            let mut there = problem.clone();
            there.rebase(&found.displacements);
            let after = of(&there);
            if [&vertices, &after].iter().all(|outcome| outcome.termination == TerminationStatus::Converged) {
                both += 1;
                same += usize::from((after.energy / vertices.energy - 1.0).abs() < 1e-9);
            }
        }
        println!("closed {closed}, σ {sigma}: {same} of {both} the same");
        // Both methods converge for most curves. Rough points have other minima too.
        assert!(both >= 20 && 10 * same >= 9 * both, "closed {closed}, σ {sigma}: {same} of {both} the same");
    }
}

#[test]
fn what_has_no_form_in_angles_is_left_to_the_vertices() {
    let mut rng = StdRng::seed_from_u64(6);
    let points = points(false, &mut rng, 0.3);
    for energy in [bending(2.0) + length(), variation() + bending(3.0), variation() + crate::discrete::torsion()] {
        assert!(Angles::of(&energy, &problem(&energy, &points, false, 8)).is_none(), "{energy}");
    }
    let energy = variation() + length();
    assert!(Angles::of(&energy, &problem(&energy, &points, false, 8)).is_some());
    let tangents = vec![f64::NAN, f64::NAN, 1.0, 1.0, f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN, f64::NAN];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let constraints = crate::Constraints { tangents: Some(tangents), ..crate::Constraints::default() };
    let batch = batch.with_constraints(constraints).unwrap();
    let fair = Fair { energy: energy.clone(), ..Fair::default() };
    let ready = set_up::<2>(&fair, &batch).unwrap().remove(0).unwrap();
    assert!(Angles::of(&energy, &ready.problem).is_none());
    assert_eq!(fair.fit(&batch, &Device::cpu()).unwrap().reports().len(), 1);
}

impl Skyline {
    /// The dense matrix, row by row.
    fn dense(&self) -> Vec<Vec<f64>> {
        let n = self.rows();
        (0..n).map(|i| (0..n).map(|j| self.entry(i, j)).collect()).collect()
    }
}
