//! Variants of the kernel `shaders/discrete/descent.wgsl` that the shader tests compose and
//! compile.

use super::descent_kernel;
use super::lanes::LANES;
use crate::discrete::compose::Composition;
use crate::discrete::energy::{
    Functional, LimitTerms, Monotone, attachment, bending, geodesic_bending, length, tautness, tension, torsion,
    variation,
};
use crate::discrete::plan::{Plan, Solver};
use crate::gpu::KernelKey;
use crate::precision::Precision;
use crate::surface::{HeightField, Mesh, Surface, SurfaceKernel, Torus};

fn newton(order: usize) -> Plan {
    Plan { solver: Solver::Newton, order, regularisation: 0 }
}

/// Some variants of the kernel, a few of each order and solver. They differ between one lane and
/// several, but not between numbers of several lanes.
pub(crate) fn descent_kernels(precision: Precision) -> Vec<KernelKey> {
    use Solver::{Newton, Sobolev};
    let with_limits = |quantities: Vec<Functional>| LimitTerms { quantities, ..LimitTerms::default() };
    let [curvature, side] =
        [Functional::MaxCurvature(Default::default()), Functional::CurvatureSign(Default::default())];
    let torsion_sign = Functional::TorsionSign(Default::default());
    let [rate, climb] = [Functional::MaxCurvatureRate(Default::default()), Functional::Climb(Default::default())];
    let monotone = Functional::Monotone(Monotone { direction: [0.6, 0.8, 0.0], number: 0 });
    let forms = [
        (length() + tension() + attachment(), 1, Sobolev),
        (bending(2.7) + tautness() + attachment(), 2, Sobolev),
        (bending(2.0) + tautness(), 2, Newton),
        (bending(3.0) + length(), 2, Newton),
        (bending(2.7) + tension() + attachment(), 2, Newton),
        ((bending(2.0) + tautness()).with_limits(with_limits(vec![curvature.clone(), side])), 2, Newton),
        (
            bending(2.0).with_limits(LimitTerms {
                regions: 2,
                stretch: true,
                ..with_limits(vec![curvature.clone(), monotone])
            }),
            2,
            Newton,
        ),
        (variation().with_limits(LimitTerms { regions: 1, ..with_limits(vec![torsion_sign]) }), 3, Newton),
        ((variation() + bending(2.0)).with_limits(with_limits(vec![rate, climb])), 3, Newton),
        (variation() + length(), 3, Newton),
        (torsion() + bending(2.0) + attachment(), 3, Newton),
    ];
    let mut keys = Vec::new();
    let curbed = with_limits(vec![Functional::GeodesicMaxCurvature(Default::default())]);
    let mut in_quadrics = vec![geodesic_bending(2.0) + tautness(), geodesic_bending(3.0) + length() + attachment()];
    if precision == Precision::F64 {
        in_quadrics.push((geodesic_bending(2.0) + tautness()).with_limits(curbed));
    }
    for energy in in_quadrics {
        let composition = Composition::of(&energy, 1, 3, precision).expect("built in").in_surfaces(None);
        keys.extend(LANES[..2].iter().map(|&lanes| descent_kernel(&composition, &newton(2), lanes, precision)));
    }
    if precision == Precision::F64 {
        let composition = Composition::of(&geodesic_bending(2.0), 1, 3, precision).expect("built in");
        let torus = Torus::new(2.0, 1.0).expect("R > r");
        let heights = HeightField::new([2, 2], vec![0.0; 4]).expect("two rows and columns");
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::new(&triangle, &[[0, 1, 2]]).expect("a triangle");
        let (sheet, _) = mesh.local().expect("a mesh has coordinates of its own");
        let surfaces: [&dyn Surface; 3] = [&torus, &heights, &*sheet];
        for surface in surfaces {
            let text = surface.kernel().map(SurfaceKernel::text);
            let composition = composition.clone().in_surfaces(text.as_deref());
            keys.extend(LANES[..2].iter().map(|&lanes| descent_kernel(&composition, &newton(2), lanes, precision)));
        }
    }
    if precision == Precision::F64 {
        // The toy limit, which only tests know, next to the penalty of another kind.
        let energy = bending(2.0).with_limits(with_limits(vec![curvature]));
        let mut composition = Composition::of(&energy, 1, 2, precision).expect("built in");
        let file = "discrete/energy/toy_limit.wgsl";
        let own = [("NAME", "toy_limit"), ("EDGES", "1"), ("WEIGHT", "0"), ("PENALTY", "0"), ("FILE", file)];
        composition.definitions.extend(own.map(|(name, value)| (format!("TERM.2.{name}"), value.to_string())));
        keys.push(descent_kernel(&composition, &newton(2), LANES[0], precision));
    }
    for (energy, order, solver) in forms {
        for dimension in [2, 3] {
            let regularisation = if energy.has_limits() && order == 2 { 1 } else { order.max(2) };
            let composition = Composition::of(&energy, regularisation, dimension, precision).expect("built in");
            // f32 has too few digits for order 3 and for penalties.
            let lanes: &[usize] = match order {
                _ if precision != Precision::F64 && (order == 3 || energy.has_limits()) => &[],
                3 => &LANES[1..2],
                _ => &LANES[..2],
            };
            let plan = Plan { solver, ..newton(order) };
            keys.extend(lanes.iter().map(|&lanes| descent_kernel(&composition, &plan, lanes, precision)));
        }
    }
    keys
}
