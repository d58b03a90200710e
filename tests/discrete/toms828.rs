//! Graphs y(t) against R. J. Renka's published program: Algorithm 828, ACM TOMS 29(4), 2003.
//! `data/toms828.json` holds the inputs and the printed output of its five data sets.

use std::collections::BTreeMap;

use faircurve::papers::toms828::{Graph, GraphMove, GraphTrace, Mesh};
use faircurve::{CurveBatch, CurveStatus, Device, Precision, Sampling};
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
    serde_json::from_str::<File>(include_str!("../data/toms828.json")).unwrap().sets
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

/// The first data set, as points.
fn gentle() -> Vec<[f64; 2]> {
    let set = &sets()["1"];
    set.t.iter().zip(&set.d).map(|(&t, &d)| [t, d]).collect()
}

#[test]
fn a_fit_is_the_curve_of_its_trace_with_exact_derivatives() {
    let set = &sets()["1"];
    let batch = CurveBatch::from_slices(&[&gentle()[..]]).unwrap();
    let fit = Graph::default().fit(&batch, &Device::cpu()).unwrap();
    // 241 points are this set's own mesh.
    let trace = set.trace(false);
    let (curve, report) = (fit.curve(0), &fit.reports()[0]);
    assert_eq!((fit.device().is_gpu, fit.device().precision), (false, Precision::F64));
    assert_eq!((report.status, report.message.clone()), (CurveStatus::Converged, None));
    assert_eq!((report.energy, report.iterations as usize), (trace.phi, trace.iterations.len()));
    assert!(report.gradient_norm <= 1e-8 * report.energy.sqrt() && report.max_deviation < 1e-14);
    assert_eq!(fit.polylines(Sampling::PerSpan(40)).coords().len(), 2 * 241);
    for (k, point) in fit.polylines(Sampling::PerSpan(40)).points(0).chunks_exact(2).enumerate() {
        assert!(
            (point[0] - 0.025 * k as f64).abs() < 1e-14 && (point[1] - trace.ordinates[k]).abs() < 1e-14,
            "{k}: {point:?}"
        );
    }
    let samples = fit.polylines(Sampling::PerSpan(1));
    assert_eq!(samples.points(0).iter().skip(1).step_by(2).copied().collect::<Vec<_>>(), set.d);
    // Each derivative is that of the one before, by central differences inside one mesh cell.
    let h = 1e-4;
    for t in [0.51, 2.787, 5.96] {
        for order in 0..3 {
            let difference = (curve.derivative(t + h, order) - curve.derivative(t - h, order)) / (2.0 * h);
            let exact = curve.derivative(t, order + 1);
            assert!((difference - exact).length() < 1e-6, "order {order} at {t}: {difference} {exact}");
        }
    }
    // The mesh's energy is the curve's, ∫κ² ds, as its width squared. 240 · 20 midpoints.
    let steps = 4800;
    let integral: f64 = (0..steps)
        .map(|k| {
            let t = 6.0 * (k as f64 + 0.5) / f64::from(steps);
            curve.curvature(t).powi(2) * curve.derivative(t, 1).length() * 6.0 / f64::from(steps)
        })
        .sum();
    assert!((integral / report.energy - 1.0).abs() < 2e-3, "{integral} {}", report.energy);
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
fn a_curve_that_is_no_graph_says_why_and_leaves_its_neighbours_bits() {
    let bad: [(&[[f64; 2]], CurveStatus, &str); 5] = [
        (&[[0.0, 0.0], [2.0, 1.0], [1.0, 0.0]], CurveStatus::Invalid, "point 2: x goes from 2 to 1"),
        (&[[0.0, 0.0], [1.0, 1.0], [1.0, 2.0]], CurveStatus::Invalid, "it must increase: sort the points"),
        (&[[0.0, 0.0], [1.0, f64::NAN], [2.0, 2.0]], CurveStatus::Invalid, "y is NaN"),
        (&[[0.0, 0.0]], CurveStatus::Degenerate, "a graph needs two points, and this curve has 1"),
        (&[[0.0, 0.0], [1.0, 0.0], [1.001, 1.0], [5.0, 0.0]], CurveStatus::Invalid, "take 5002 mesh points"),
    ];
    let good = gentle();
    let alone = Graph::default().fit(&CurveBatch::from_slices(&[&good[..]]).unwrap(), &Device::cpu()).unwrap();
    let wanted = alone.polylines(Sampling::PerSpan(7));
    let mut curves = vec![&good[..]];
    bad.iter().for_each(|(points, ..)| curves.extend([points, &good[..]]));
    let fit = Graph::default().fit(&CurveBatch::from_slices(&curves).unwrap(), &Device::cpu()).unwrap();
    let polylines = fit.polylines(Sampling::PerSpan(7));
    assert_eq!(fit.len(), 2 * bad.len() + 1);
    for (i, report) in fit.reports().iter().enumerate() {
        if i % 2 == 0 {
            assert_eq!((polylines.points(i), report), (wanted.points(0), &alone.reports()[0]), "curve {i}");
            continue;
        }
        let (points, status, sentence) = bad[i / 2];
        let message = report.message.as_ref().unwrap();
        assert_eq!(report.status, status, "{message}");
        assert!(message.starts_with(&format!("curve {i}, point ")) && message.contains(sentence), "{message}");
        // Comes out as it went in, NaN included.
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(polylines.points(i)), bits(points.as_flattened()));
        assert!(report.energy.is_nan() && !fit.curve(i).is_fitted());
    }
    // The remedy that a sentence names is one.
    let close = CurveBatch::from_slices(&[bad[4].0]).unwrap();
    let fine = Graph { mesh: Mesh::Points(5002), max_iterations: 0, ..Graph::default() };
    // It is a graph now, whose spline is far longer than its points' polygon, as it says: that is
    // another matter.
    let fit = fine.fit(&close, &Device::cpu()).unwrap();
    let report = &fit.reports()[0];
    let message = report.message.as_ref().unwrap();
    assert_eq!(report.status, CurveStatus::Unbounded, "{message}");
    assert!(message.contains("times as long as its data's polygon") && !message.contains(bad[4].2), "{message}");
}

#[test]
fn closed_and_spatial_curves_are_no_graphs() {
    let status = |batch: &CurveBatch| {
        let fit = Graph::default().fit(batch, &Device::cpu()).unwrap();
        assert_eq!(fit.polylines(Sampling::PerSpan(4)).points(0), batch.points(0));
        assert_eq!(fit.reports()[0].status, CurveStatus::Invalid);
        fit.reports()[0].message.clone().unwrap()
    };
    let closed = CurveBatch::from_slices(&[&gentle()[..]]).unwrap().closed(true);
    assert!(status(&closed).contains("a graph y(t) cannot close: open the curve"), "{}", status(&closed));
    let spatial = CurveBatch::from_slices(&[&[[0.0, 0.0, 1.0], [1.0, 2.0, 1.0]][..]]).unwrap();
    assert!(status(&spatial).contains("a graph y(t) is planar, and this curve has a z"), "{}", status(&spatial));
}

#[test]
fn options_out_of_range_are_refused_with_value_and_remedy() {
    let batch = CurveBatch::from_slices(&[&gentle()[..]]).unwrap();
    let refused = |graph: Graph| graph.fit(&batch, &Device::cpu()).expect_err("refused").to_string();
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
        let fit = Graph { mesh: Mesh::Width(width), ..Graph::default() }.fit(&batch, &Device::cpu()).unwrap();
        let message = fit.reports()[0].message.clone().unwrap();
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
    use rand::{RngExt, SeedableRng};
    let seed = 828;
    println!("seed {seed}");
    let mut random = rand::rngs::StdRng::seed_from_u64(seed);
    for height in [0.2, 1.0, 5.0] {
        let curves: Vec<Vec<[f64; 2]>> = (0..60)
            .map(|_| (0..7).map(|k| [f64::from(k), height * random.random_range(-1.0..1.0)]).collect())
            .collect();
        let slices: Vec<&[[f64; 2]]> = curves.iter().map(|curve| &curve[..]).collect();
        let graph = Graph { mesh: Mesh::Points(121), ..Graph::default() };
        let fit = graph.fit(&CurveBatch::from_slices(&slices).unwrap(), &Device::cpu()).unwrap();
        let count = |status| fit.reports().iter().filter(|report| report.status == status).count();
        let counts = [CurveStatus::Converged, CurveStatus::NotConverged, CurveStatus::Unbounded].map(count);
        println!("heights up to {height}: converged, not converged, unbounded {counts:?}");
        assert_eq!(counts.iter().sum::<usize>(), curves.len());
        let most = fit.reports().iter().map(|report| report.iterations).max().unwrap();
        println!("at most {most} iterations");
        for (i, (curve, report)) in fit.iter().enumerate() {
            let polygon: f64 = curves[i].windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum();
            match report.status {
                CurveStatus::Converged => {
                    assert!(report.gradient_norm <= 1e-8 * report.energy.sqrt(), "curve {i}: {report:?}");
                    assert!(curve.length() < 11.0 * polygon, "curve {i}");
                }
                // Comes out as it came in.
                CurveStatus::Unbounded => assert!((curve.length() - polygon).abs() < 1e-12 * polygon, "curve {i}"),
                _ => assert_eq!(report.iterations, 500, "curve {i}: {report:?}"),
            }
            assert!(curves[i].iter().all(|p| curve.point(p[0]).y == p[1]), "curve {i} leaves its points");
        }
        // Gentle data have a minimum.
        assert!(height > 0.5 || counts[0] == curves.len(), "{counts:?}");
    }
}
