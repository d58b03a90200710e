//! Descents by themselves: how many iterations gentle curves take.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::super::plan::Solver;
use super::*;
use crate::linalg::Lanes;
use crate::spline::{Natural, Parametrisation};
use crate::{CurveBatch, Device, Sampling};

/// Gentle curves of size about 1 with `n` edges a span.
fn splines(count: usize, points: usize, n: usize, height: f64, closed: bool) -> CurveBatch {
    let mut rng = StdRng::seed_from_u64(7);
    let mut coords = Vec::new();
    for _ in 0..count {
        for k in 0..points {
            let turn = std::f64::consts::TAU * k as f64 / points as f64;
            let mut noise = || rng.random_range(-height..height);
            let at = if closed {
                [0.5 * turn.cos() + noise(), 0.5 * turn.sin() + noise()]
            } else {
                [k as f64 / (points - 1) as f64, noise()]
            };
            coords.extend(at);
        }
    }
    let offsets = (0..=count).map(|i| i * points).collect();
    let batch = CurveBatch::from_ragged(2, coords, offsets).unwrap().closed_each(vec![closed; count]).unwrap();
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    by_chords.fit_sampled(&batch, Sampling::PerSpan(n), &Device::cpu()).unwrap().1
}

type Four = Lanes<f64, 4>;

fn run(energy: &super::super::Energy, batch: &CurveBatch, n: usize, order: usize, solver: Solver) -> Vec<Lane<f64>> {
    let closed = batch.is_closed(0);
    let mut bases = Vec::new();
    for l in 0..4 {
        let points: Vec<[f64; 2]> = batch.points(l).as_chunks::<2>().0.to_vec();
        let edges = if closed { points.len() } else { points.len() - 1 };
        let base: Vec<[f64; 2]> = (0..edges).map(|j| subtract(points[(j + 1) % points.len()], points[j])).collect();
        bases.push(base);
    }
    let m = bases[0].len();
    let free = |_, v: usize| if v.is_multiple_of(n) { 0.0 } else { 1.0 };
    let edges = Edges::<Four, 2>::new(closed, &bases.iter().map(|b| &b[..]).collect::<Vec<_>>(), free);
    let mut movable = vec![Four::ONE; edges.rows()];
    (0..edges.vertices().next().unwrap()).step_by(n).for_each(|row| movable[row] = Four::ZERO);
    if closed {
        movable[m] = Four::ZERO;
    }
    let vertices = vec![Four::ZERO; edges.rows()];
    let mut h = 0.0;
    bases[0].iter().for_each(|e| h += dot(*e, *e).sqrt() / m as f64);
    let regularisation = Four::of(2.0 * h.powi(if order == 3 { -5 } else { -1 }));
    let plan = Plan { solver, order, regularisation: order };
    let terms = energy.terms().iter().map(|(w, f)| (Four::of(*w), f)).collect();
    let weights = Weights { highest: Four::of(2.0), vertices, attached: false };
    let bounds = Bounds { tolerance: 1e-8, longest: f64::INFINITY, most_iterations: 2000 };
    let mut descent = Descent::new(plan, edges, movable, weights, terms, regularisation, vec![], &[bounds; 4]);
    let mut kept = None;
    let newton = descent.newton(&mut kept);
    descent.begin();
    while descent.is_running() {
        descent.tick(newton);
    }
    descent.lanes.clone()
}

#[test]
fn gentle_curves_converge_in_tens_of_iterations() {
    use super::super::{bending, length, variation};
    for (closed, height, order, most) in
        [(false, 0.05, 2, 40), (false, 0.15, 2, 150), (true, 0.05, 2, 150), (false, 0.05, 3, 300)]
    {
        for (n, solver) in [16, 64].into_iter().flat_map(|n| [(n, Solver::Sobolev), (n, Solver::Newton)]) {
            let batch = splines(4, 5, n, height, closed);
            let energy = if order == 3 { variation() + length() } else { bending(2.0) + length() };
            let lanes = run(&energy, &batch, n, order, solver);
            for lane in &lanes {
                println!(
                    "{solver:?} closed {closed} height {height} order {order} n {n}: {:?} {} {} {:e}",
                    lane.termination, lane.iterations, lane.evaluations, lane.energy
                );
                assert_eq!(lane.termination, TerminationStatus::Converged);
                assert!(lane.iterations <= most);
            }
        }
    }
}
