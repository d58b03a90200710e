use std::sync::Arc;

use glam::DVec3;

use super::super::descent::Descent;
use super::super::energy::{Energy, Functional, LimitTerms, Penalty, bending, geodesic_bending, length};
use super::super::plan::{Plan, Solver};
use super::super::problem::{Problem, start};
use super::*;
use crate::surface::{Quadric, Surface, Torus};

/// A curve of unequal edges around each surface, at size 1.
fn problems(closed: bool) -> Vec<Problem<3>> {
    let at = DVec3::new;
    let surfaces: Vec<(Arc<dyn Surface>, DVec3)> = vec![
        (Arc::new(Quadric::sphere(1.3)), DVec3::splat(1.3)),
        (Arc::new(Quadric::ellipsoid(at(3.0, 2.0, 1.0))), at(3.0, 2.0, 1.0)),
        (Arc::new(Quadric::cone(0.5)), at(1.0, 1.0, 2.0)),
        (Arc::new(Torus::new(2.0, 1.0).unwrap()), at(3.0, 3.0, 1.0)),
    ];
    let curve = |(surface, size): (Arc<dyn Surface>, DVec3)| {
        let place = |k: usize| {
            let s = 0.6 * k as f64 + 0.05 * (k * k % 7) as f64;
            let x = size * at(s.cos(), s.sin(), 0.4 + 0.2 * (2.0 * s).cos());
            surface.closest(x).unwrap().to_array()
        };
        let vertices: Vec<[f64; 3]> = (0..9).map(place).collect();
        let size = 2.5;
        let scaled = |a: [f64; 3], b: [f64; 3]| subtract(b, a).map(|x| x / size);
        let mut base: Vec<[f64; 3]> = vertices.windows(2).map(|pair| scaled(pair[0], pair[1])).collect();
        base.extend(closed.then(|| scaled(vertices[8], vertices[0])));
        Problem {
            closed,
            base,
            data: vec![0],
            weights: vec![1.0, 0.3, 0.2, 1.0],
            // Of ψ = ½ ρ (r + κ_g/κ)², which is active at every vertex.
            penalties: std::array::from_fn(|kind| match kind {
                0 => vec![Penalty { slope: 0.7, reach: 0.2, stiffness: 0.4 }; 9],
                _ => vec![],
            }),
            regularisation: 0.1,
            free: vec![1.0; 9],
            places: vertices.iter().map(|v| scaled(vertices[0], *v)).collect(),
            surface: Some(Local { surface, origin: vertices[0], size }),
            highest: 2.0,
            longest: f64::INFINITY,
            ..Problem::default()
        }
    };
    surfaces.into_iter().map(curve).collect()
}

/// The energy after a step of ε along p.
fn stepped(descent: &mut Descent<'_, f64, 3>, p: &[[f64; 3]], epsilon: f64) -> f64 {
    for (x, p) in descent.x.iter_mut().zip(p) {
        *x = scale(epsilon, *p);
    }
    descent.retract();
    descent.evaluate().0
}

#[test]
fn gradients_and_hessians_in_surfaces_are_those_of_differences() {
    let plan = Plan { solver: Solver::Newton, order: 2, regularisation: 2 };
    for (nu, closed) in [(2.0, false), (2.0, true), (3.0, false), (1.7, true)] {
        let energy: Energy = geodesic_bending(nu) + bending(2.0) + length();
        let quantities = vec![Functional::GeodesicMaxCurvature(Default::default())];
        let energy = energy.with_limits(LimitTerms { quantities, ..LimitTerms::default() });
        let functionals: Vec<&Functional> = energy.terms().iter().map(|(_, functional)| functional).collect();
        for problem in problems(closed) {
            let name = problem.surface.as_ref().unwrap().surface.name();
            let mut descent = start::<f64, 3>(&plan, &functionals, &[&problem]);
            let mut kept = None;
            let newton = descent.newton(&mut kept);
            descent.begin();
            let count = problem.vertices();
            // Before the first trial λ = 0. The step for a gradient r is then p = H⁻¹ r in the
            // tangent planes, so that pᵀH p = r·p.
            descent.least_damping = 0.0;
            descent.newton_direction(newton);
            let wave = |row: usize| -> [f64; 3] { [1.0, 1.7, 2.9].map(|f: f64| (f * row as f64 + f).sin()) };
            let r: Vec<[f64; 3]> =
                (0..descent.u.len()).map(|row| if row < count { wave(row) } else { [0.0; 3] }).collect();
            let mut p = r.clone();
            newton.solve(&mut p);
            let (bend, largest) = (0..count).fold((0.0, 0.0), |(bend, largest), row| {
                (bend + dot(r[row], p[row]), p[row].iter().fold(largest, |largest: f64, x| largest.max(x.abs())))
            });
            let bend = bend / (largest * largest);
            p.iter_mut().for_each(|p| *p = scale(1.0 / largest, *p));
            descent.edges.close(&mut p);
            let slope: f64 = (0..count).map(|row| dot(descent.g[row], p[row])).sum();
            let h = 1e-4;
            let at = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|steps| stepped(&mut descent, &p, steps * h));
            let first = (8.0 * (at[3] - at[1]) - (at[4] - at[0])) / (12.0 * h);
            let second = (16.0 * (at[1] + at[3]) - (at[0] + at[4]) - 30.0 * at[2]) / (12.0 * h * h);
            assert!((first - slope).abs() < 1e-7 * slope.abs(), "{name}, ν {nu}: {first} {slope}");
            assert!((second - bend).abs() < 1e-5 * bend.abs(), "{name}, ν {nu}, closed {closed}: {second} {bend}");
        }
    }
}

#[test]
fn bases_are_orthonormal_everywhere() {
    for normal in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.6, -0.64, -0.48], [-0.6, 0.64, 0.48]] {
        let [a, b] = basis::<f64, 3>(normal);
        for (x, y, wanted) in [(a, a, 1.0), (b, b, 1.0), (a, b, 0.0), (a, normal, 0.0), (b, normal, 0.0)] {
            assert!((dot(x, y) - wanted).abs() < 1e-15, "{normal:?}");
        }
    }
}
