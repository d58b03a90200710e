//! Section 4 of Renka's paper on the GPU.

use super::*;
use crate::discrete::length;
use crate::linalg::scalar::subtract;
use crate::spline::{Natural, Parametrisation};
use crate::{Device, Sampling};

#[test]
fn one_sobolev_step_of_length_1_gives_the_segment_of_theorem_2_2() {
    let Some(gpu) = gpu() else { return };
    let points = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    let fit = by_chords.fit(&CurveBatch::from_slices(&[&points[..]]).unwrap(), &Device::cpu()).unwrap();
    let polylines = fit.polylines(Sampling::Spacing(fit.curve(0).length() / 199.5));
    let vertices = polylines.points(0).as_chunks::<2>().0;
    assert_eq!(vertices.len(), 201);
    let problem = Problem {
        closed: false,
        base: vertices.windows(2).map(|pair| subtract(pair[1], pair[0])).collect(),
        data: vec![0, 200],
        pinned: vec![0, 200],
        attached: Vec::new(),
        weights: vec![1.0],
        gauge: 0.0,
        free: vec![1.0; 201],
        taut: vec![1.0; 200],
        fences: Default::default(),
        walls: Vec::new(),
        places: Vec::new(),
        surface: None,
        ways: Default::default(),
        highest: 1.0,
        curvature: 1.0,
        tolerance: 1e-8,
        most_iterations: 1,
        longest: f64::INFINITY,
        has_tangents: false,
    };
    let (direction, step) = (Direction::Steepest, Step::Constant(1.0));
    let plan = Plan { direction, step, order: 1, gauge: 0 };
    let edges: Vec<f64> = problem.base.iter().map(|e| e[0].hypot(e[1])).collect();
    let total: f64 = edges.iter().sum();
    for precision in precisions(&gpu) {
        let outcomes = descend_on_gpu(&gpu, precision, &plan, &length(), &[&problem], &|_, _| {}).unwrap();
        assert_eq!(outcomes[0].iterations, 1, "{precision:?}");
        let (mut along, mut worst) = (0.0, 0.0f64);
        for (k, (vertex, u)) in vertices.iter().zip(&outcomes[0].displacements).enumerate() {
            worst = worst.max((vertex[0] + u[0] - along / total).hypot(vertex[1] + u[1]));
            along += edges.get(k).copied().unwrap_or(0.0);
        }
        println!("{precision:?}: {worst:e} from the segment");
        let bound = if precision == Precision::F64 { 1e-12 } else { 5e-5 };
        assert!(worst <= bound, "{precision:?}: {worst:e}");
    }
}
