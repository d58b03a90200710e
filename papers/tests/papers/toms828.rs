//! Graphs y(t) against R. J. Renka's published program: Algorithm 828, ACM TOMS 29(4), 2003.
//! `data/toms828.json` holds the inputs and the printed output of its five data sets.

use std::collections::BTreeMap;

use faircurve::CurveStatus;
use faircurve_papers::toms828::{Graph, GraphMove, GraphTrace, Mesh};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    sets: BTreeMap<String, Set>,
}

#[derive(Deserialize)]
struct Set {
    t: Vec<f64>,
    d: Vec<f64>,
    grid_points: usize,
    mesh_width: f64,
    initial_phi: f64,
    published_phi: Vec<f64>,
    published_step: Vec<f64>,
    continued: Continued,
}

#[derive(Deserialize)]
struct Continued {
    status: String,
    phi: Option<f64>,
}

impl Set {
    fn options(&self, published: bool) -> Graph {
        Graph { mesh: Mesh::Width(self.mesh_width), published, ..Graph::default() }
    }

    fn trace(&self, published: bool) -> GraphTrace {
        self.options(published).trace(&self.t, &self.d, |_| {}).unwrap()
    }
}

fn sets() -> BTreeMap<String, Set> {
    serde_json::from_str::<File>(include_str!("../../../tests/data/toms828.json")).unwrap().sets
}

#[test]
fn all_58_published_iterations_are_reproduced() {
    let (mut compared, mut worst) = (0, [0.0f64; 3]);
    for (name, set) in sets() {
        let trace = set.trace(true);
        assert_eq!(trace.ordinates.len(), set.grid_points, "set {name}");
        // The initial curve has no iteration behind it: only rounding separates the two.
        worst[0] = worst[0].max((trace.initial_phi / set.initial_phi - 1.0).abs());
        assert_eq!(trace.iterations.len(), set.published_phi.len(), "set {name}: the published rule stops there");
        for (k, ours) in trace.iterations.iter().enumerate() {
            let phi = (ours.phi / set.published_phi[k] - 1.0).abs();
            let step = (ours.step / set.published_step[k] - 1.0).abs();
            assert!(phi < 1e-6, "set {name}, iteration {}: φ {} is {phi:.1e} off", k + 1, ours.phi);
            // Printed with four digits.
            assert!(step < 1e-3, "set {name}, iteration {}: step {} is {step:.1e} off", k + 1, ours.step);
            assert_eq!(ours.kind, GraphMove::Conjugate);
            worst = [worst[0], worst[1].max(phi), worst[2].max(step)];
            compared += 1;
        }
        assert_eq!(trace.status, CurveStatus::NotConverged, "set {name}: the published rule is early");
    }
    println!("initial φ, φ, step off by at most {worst:?}");
    assert_eq!(compared, 58);
    assert!(worst[0] < 1e-12, "{worst:?}");
}

#[test]
fn descents_go_on_to_a_minimum_or_are_unbounded() {
    for (name, set) in sets() {
        let trace = set.trace(false);
        println!("set {name}: φ {} {} {:?}", trace.phi, trace.status.word(), trace.message);
        assert_eq!(trace.status.word(), set.continued.status, "set {name}");
        match (&name[..], set.continued.phi) {
            // The digits given are nine and ten after the point.
            ("1" | "3", Some(phi)) => {
                assert!((trace.phi - phi).abs() < 1e-9, "set {name}: {} and not {phi}", trace.phi)
            }
            // Two cliffs, and a minimum for every pair of places where the mesh may jump: the one
            // given is reached in a test beside the descent. Every descent ends in one of them,
            // whose energies are a few hundredths apart.
            ("4", Some(phi)) => {
                assert!((trace.phi - phi).abs() < 0.05, "{} is far from {phi}", trace.phi);
                assert!(trace.message.as_ref().unwrap().contains("a minimum for the mesh"), "{:?}", trace.message);
            }
            (_, phi) => assert_eq!(phi, None, "set {name}"),
        }
        if trace.status == CurveStatus::Unbounded {
            let message = trace.message.unwrap();
            assert!(
                message.contains("(the limit is 10) while its energy fell") && message.contains("add points"),
                "{message}"
            );
        }
        // Whatever the ending, φ fell at every step: by rounding at most it may rise where the
        // gradient decides.
        let phi: Vec<f64> =
            [trace.initial_phi].into_iter().chain(trace.iterations.iter().map(|step| step.phi)).collect();
        assert!(phi.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + 1e-12)), "set {name}: {phi:?}");
        assert!(set.published_phi.last().unwrap() > &trace.phi, "set {name}");
    }
}

#[test]
fn the_data_stay_where_they_were_moved_to() {
    for (name, set) in sets() {
        let mut seen = 0;
        let trace = set.options(false).trace(&set.t, &set.d, |y| seen += y.len()).unwrap();
        assert_eq!(seen, set.grid_points * (trace.iterations.len() + 1), "set {name}");
        for (k, &vertex) in trace.data.iter().enumerate() {
            assert_eq!(trace.ordinates[vertex], set.d[k], "set {name}, point {k}");
            let moved = set.t[k] - (trace.start + vertex as f64 * trace.width);
            assert!(
                moved.abs() <= 0.5 * set.mesh_width * (1.0 + 1e-9) || k + 1 == set.t.len(),
                "set {name}, point {k}"
            );
        }
    }
}

#[test]
fn finer_meshes_approach_the_curve_of_least_energy_as_the_width_squared() {
    let phi = |points: usize| {
        let graph = Graph { mesh: Mesh::Points(points), ..Graph::default() };
        let trace = graph.trace(&[0.0, 1.0, 2.0, 3.0], &[0.0, 0.6, 0.2, 0.5], |_| {}).unwrap();
        assert_eq!(trace.status, CurveStatus::Converged, "{points}: {:?}", trace.message);
        trace.phi
    };
    let [coarse, middle, fine] = [61, 121, 241].map(phi);
    let ratio = (coarse - middle) / (middle - fine);
    assert!((3.5..4.5).contains(&ratio), "{coarse} {middle} {fine}: {ratio}");
}

#[test]
fn points_that_have_no_graph_are_refused_with_a_sentence() {
    let bad: [(&[f64], &[f64], &str); 5] = [
        (&[0.0, 2.0, 1.0], &[0.0, 1.0, 0.0], "point 2: x goes from 2 to 1"),
        (&[0.0, 1.0, 1.0], &[0.0, 1.0, 2.0], "it must increase: sort the points"),
        (&[0.0, 1.0, 2.0], &[0.0, f64::NAN, 2.0], "point 1: (1, NaN) is no point"),
        (&[0.0], &[0.0], "a graph needs two points, and this curve has 1"),
        (&[0.0, 1.0, 1.001, 5.0], &[0.0, 0.0, 1.0, 0.0], "take 5002 mesh points"),
    ];
    for (t, y, sentence) in bad {
        let message = Graph::default().trace(t, y, |_| {}).unwrap_err().to_string();
        assert!(message.contains(sentence), "{message}");
    }
    // The remedy that a sentence names is one. The spline through these points is far longer than
    // their polygon.
    let fine = Graph { mesh: Mesh::Points(5002), max_iterations: 0, ..Graph::default() };
    let trace = fine.trace(bad[4].0, bad[4].1, |_| {}).unwrap();
    let message = trace.message.unwrap();
    assert_eq!(trace.status, CurveStatus::Unbounded, "{message}");
    assert!(message.contains("times as long as its data's polygon"), "{message}");
}

#[test]
fn options_out_of_range_are_refused_with_value_and_remedy() {
    let set = &sets()["1"];
    let refused = |graph: Graph| graph.trace(&set.t, &set.d, |_| {}).unwrap_err().to_string();
    let sentence = refused(Graph { mesh: Mesh::Points(2), ..Graph::default() });
    assert_eq!(sentence, "a mesh of 2 points has no curvature: take at least 3, such as 241");
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let sentence = refused(Graph { mesh: Mesh::Width(width), ..Graph::default() });
        assert_eq!(sentence, format!("the mesh width is {width}; it must be positive and finite"));
    }
    for tolerance in [0.0, 1.0, f64::NAN] {
        let sentence = refused(Graph { tolerance, ..Graph::default() });
        assert_eq!(sentence, format!("tolerance is {tolerance}; it must lie between 0 and 1, such as 1e-8"));
    }
    for width in [100.0, 1e-9] {
        let message = refused(Graph { mesh: Mesh::Width(width), ..Graph::default() });
        assert!(
            message.contains("does not suit a curve that is 6 long in x: take one from 6.00e-7 to 3.00e0"),
            "{message}"
        );
    }
    let uneven = Graph::default().trace(&[0.0, 1.0], &[0.0], |_| {}).unwrap_err().to_string();
    assert_eq!(uneven, "2 values of t and 1 of y: give one y a t");
    let nan = Graph::default().trace(&[0.0, f64::NAN], &[0.0, 1.0], |_| {}).unwrap_err().to_string();
    assert_eq!(nan, "point 1: (NaN, 1) is no point; coordinates must be finite");
}

#[test]
fn a_status_is_kept_by_the_curve_it_stands_for() {
    let seed = 828;
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    let t: Vec<f64> = (0..7).map(f64::from).collect();
    let length = |t: &dyn Fn(usize) -> f64, y: &[f64]| -> f64 {
        (1..y.len()).map(|k| (t(k) - t(k - 1)).hypot(y[k] - y[k - 1])).sum()
    };
    for height in [0.2, 1.0, 5.0] {
        let curves: Vec<Vec<f64>> =
            (0..60).map(|_| (0..7).map(|_| height * random.random_range(-1.0..1.0)).collect()).collect();
        let graph = Graph { mesh: Mesh::Points(121), ..Graph::default() };
        let traces: Vec<GraphTrace> = curves.par_iter().map(|y| graph.trace(&t, y, |_| {}).unwrap()).collect();
        let count = |status| traces.iter().filter(|trace| trace.status == status).count();
        let counts = [CurveStatus::Converged, CurveStatus::NotConverged, CurveStatus::Unbounded].map(count);
        println!("heights up to {height}: converged, not converged, unbounded {counts:?}");
        assert_eq!(counts.iter().sum::<usize>(), curves.len());
        for (i, (trace, y)) in traces.iter().zip(&curves).enumerate() {
            let (polygon, graph) = (length(&|k| t[k], y), length(&|k| k as f64 * trace.width, &trace.ordinates));
            match trace.status {
                CurveStatus::Converged => {
                    assert!(trace.gradient_norm <= 1e-8 * trace.phi.sqrt(), "curve {i}");
                    assert!(graph < 11.0 * polygon, "curve {i}");
                }
                CurveStatus::Unbounded => assert!(graph > 9.9 * polygon, "curve {i}"),
                _ => assert_eq!(trace.iterations.len(), 500, "curve {i}"),
            }
            assert!(trace.data.iter().zip(y).all(|(&k, y)| trace.ordinates[k] == *y), "curve {i} leaves its points");
        }
        // Gentle data have a minimum.
        assert!(height > 0.5 || counts[0] == curves.len(), "{counts:?}");
    }
}
