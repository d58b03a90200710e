//! Tests of energies below the public evaluation: Hessians, the regularisation, lanes, single
//! precision.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::edges::Edges;
use super::energy::{
    Energy, Functional, LimitTerms, MOST_DIRECTIONS, MOST_EDGES, Penalty, RegionPenalty, bending, length, variation,
};
use super::hessian::{BlockHessian, dense};
use super::limits::{LimitKind, Limits};
use crate::linalg::scalar::{Vector, subtract};
use crate::linalg::{Lanes, Real, Scalar};

/// The value, the gradient at every vertex, and the dense Hessian for one curve.
struct Found<T> {
    value: T,
    gradient: Vec<T>,
    hessian: Vec<T>,
}

/// Evaluates the curves of all lanes at once. A functional of `None` stands for the regularisation.
fn evaluate<S: Scalar, const D: usize>(
    closed: bool,
    curves: &[Vec<Vector<f64, D>>],
    functional: Option<&Functional>,
) -> Vec<Found<S::Number>> {
    let bases: Vec<Vec<Vector<f64, D>>> = curves.iter().map(|curve| edges_of(closed, curve)).collect();
    let bases: Vec<&[Vector<f64, D>]> = bases.iter().map(Vec::as_slice).collect();
    // Every third vertex is a data point. Differences weigh more in spans of short edges.
    let mut edges = Edges::<S, D>::new(closed, &bases, |_, v| [0.0, 1.5, 0.4][v % 3]);
    for (lane, curve) in curves.iter().enumerate() {
        // Every penalty is active, since its second derivative jumps where it becomes active.
        let penalty =
            |slope: f64, v: usize| Penalty { slope: slope + 0.1 * (v % 3) as f64, reach: 40.0, stiffness: 0.02 };
        let slopes = [0.7, -0.4, 1.1, 0.3, 0.8, 0.9, -0.8, 0.6, 0.5];
        let penalties = slopes.map(|slope| (0..curve.len()).map(|v| penalty(slope, v)).collect());
        edges.set_penalties(lane, &penalties);
    }
    let rows = edges.rows();
    let zero = vec![[S::ZERO; D]; rows];
    let mut movable = vec![S::ZERO; rows];
    for (lane, curve) in curves.iter().enumerate() {
        movable[..curve.len()].iter_mut().for_each(|row| row.set_lane(lane, S::ONE.lane(lane)));
    }
    edges.place(&zero);
    edges.clear();
    let weight = S::of(0.7);
    let value = match functional {
        Some(functional) => edges.add(weight, functional),
        None => edges.add_regularisation(2, weight),
    };
    let mut hessian = BlockHessian::new(&edges);
    let terms: Vec<(S, &Functional)> = functional.map(|f| (weight, f)).into_iter().collect();
    hessian.assemble(&edges, &terms, functional.is_none().then_some((2, weight)));
    let mut gradient = zero.clone();
    edges.gradient(&movable, &mut gradient);
    let lane = |(lane, curve): (usize, &Vec<Vector<f64, D>>)| Found {
        value: value.lane(lane),
        gradient: gradient[..curve.len()].iter().flatten().map(|x| x.lane(lane)).collect(),
        hessian: dense::<_, D>(closed, &hessian.lane(lane)),
    };
    curves.iter().enumerate().map(lane).collect()
}

fn edges_of<const D: usize>(closed: bool, curve: &[Vector<f64, D>]) -> Vec<Vector<f64, D>> {
    let count = if closed { curve.len() } else { curve.len() - 1 };
    (0..count).map(|j| subtract(curve[(j + 1) % curve.len()], curve[j])).collect()
}

/// An arc or a circle with waves and noise.
fn curve<const D: usize>(closed: bool, count: usize, rng: &mut StdRng) -> Vec<Vector<f64, D>> {
    let turn = std::f64::consts::TAU * if closed { 1.0 } else { 0.7 } / count as f64;
    let at = |v: usize| [(turn * v as f64).cos(), (turn * v as f64).sin(), 0.5 * (2.0 * turn * v as f64).sin()];
    let shake = 0.5 * turn;
    (0..count).map(|v| std::array::from_fn(|c| at(v)[c] + shake * rng.random_range(-0.5..0.5))).collect()
}

/// Every functional with a term, a user's functional, and the regularisation.
fn functionals() -> Vec<Option<Functional>> {
    let named = Energy::NAMES.iter().filter_map(|name| Energy::named(name));
    let named = named.filter(|energy| energy.order() > 0 && !energy.is_geodesic());
    let custom = (1..=MOST_EDGES).map(mixed).chain([every_operation()]);
    let limits = Limits { monotone: vec![[0.48, 0.6, -0.64]; MOST_DIRECTIONS], ..Limits::default() };
    let penalties = LimitKind::<3>::ALL.map(|kind| {
        let quantities = vec![(kind.functional)(&limits, false)];
        Energy::default().with_limits(LimitTerms { quantities, ..LimitTerms::default() })
    });
    let all = named.chain([1.0, 1.5, 3.0, 4.0].map(bending)).chain(custom).chain(penalties);
    all.map(|energy| Some(energy.terms()[0].1.clone())).chain([None]).collect()
}

/// Σ over edges j ≤ k of (T_j·T_k)² Δs_j Δs_k² + Δs_k x·T_j. The constant vector x makes it depend
/// on direction.
fn mixed(edges: usize) -> Energy {
    Energy::custom("mixed", edges, f64::NAN, |t, s| {
        let x = |k: usize| 0.3 * t[k].x - 1.1 * t[k].y + 0.7 * t[k].z;
        let pair = |j: usize, k: usize| t[j].dot(t[k]).powf(2.0) * s[j] * s[k] * s[k] + s[k] * x(j);
        let pairs = (0..edges).flat_map(|k| (0..=k).map(move |j| (j, k)));
        pairs.map(|(j, k)| pair(j, k)).reduce(|sum, term| sum + term).expect("an edge")
    })
}

/// A formula with every operation.
fn every_operation() -> Energy {
    Energy::custom("every_operation", 2, f64::NAN, |t, s| {
        let across = t[0].cross(t[1]);
        let quotient = (1.5 * s[0] / (s[1] + 0.1)).powf(1.7) - (s[0] * s[1]).sqrt();
        // Each branch occurs once, far from the boundary between the branches.
        let cases = (t[0].x + 2.0).if_positive(t[1].x * s[0], -t[1].y) + (t[0].x - 2.0).if_positive(s[0], s[1] * s[1]);
        let bounds = (s[0] + s[1]).max(s[1]) * (t[0].y - 2.0).abs().powf(3.0);
        quotient * (2.0 - across.length_squared()) + cases - bounds / (0.5 * t[1]).dot(t[1])
    })
}

fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// The largest difference relative to the largest magnitude, or to 1 if all are smaller: the
/// rounding of energies of curves of size 1.
fn apart(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let differences: Vec<f64> = found.iter().zip(wanted).map(|(a, b)| a - b).collect();
    assert!(differences.iter().all(|d| d.is_finite()));
    largest(&differences) / largest(wanted).max(1.0)
}

fn derivatives_are_differences<const D: usize>(seed: u64) {
    let mut rng = StdRng::seed_from_u64(seed);
    for functional in functionals() {
        for (closed, count) in
            [3, 4, 5, 6, 7, 11].map(|n| (true, n)).into_iter().chain([2, 3, 4, 5, 9].map(|n| (false, n)))
        {
            let what = format!("{functional:?}, {D}-D, closed {closed}, {count} vertices, seed {seed}");
            let points = curve::<D>(closed, count, &mut rng);
            let here = |points: &[Vector<f64, D>]| {
                evaluate::<f64, D>(closed, &[points.to_vec()], functional.as_ref()).remove(0)
            };
            let (step, found) = (1e-3 / count as f64, here(&points));
            let (mut gradient, mut hessian) = (vec![], vec![]);
            for (v, c) in (0..count).flat_map(|v| (0..D).map(move |c| (v, c))) {
                let moved = |steps: f64| {
                    let mut points = points.clone();
                    points[v][c] += steps * step;
                    here(&points)
                };
                // Sixth-order differences.
                let at = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0].map(moved);
                let slope = |x: &dyn Fn(&Found<f64>) -> f64| {
                    let [a, b, c] = [0, 2, 4].map(|k| x(&at[k]) - x(&at[k + 1]));
                    (45.0 * a - 9.0 * b + c) / (60.0 * step)
                };
                gradient.push(slope(&|found| found.value));
                hessian.extend((0..found.gradient.len()).map(|entry| slope(&|found| found.gradient[entry])));
            }
            // ε/step is at most 2e-12, and truncation is smaller.
            assert!(apart(&found.gradient, &gradient) < 1e-9, "{what}: gradient {}", apart(&found.gradient, &gradient));
            assert!(apart(&found.hessian, &hessian) < 1e-9, "{what}: Hessian {}", apart(&found.hessian, &hessian));
        }
    }
}

#[test]
fn derivatives_of_every_energy_are_differences_in_2d() {
    derivatives_are_differences::<2>(1);
}

#[test]
fn derivatives_of_every_energy_are_differences_in_3d() {
    derivatives_are_differences::<3>(2);
}

fn lanes_equal_curves_alone<const D: usize>(seed: u64) {
    let mut rng = StdRng::seed_from_u64(seed);
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    for (closed, counts) in [(false, [1, 9, 2, 3, 17, 4, 5, 8]), (true, [3, 9, 4, 5, 17, 6, 16, 15])] {
        let curves = counts.map(|count| curve::<D>(closed, count, &mut rng));
        for functional in functionals() {
            let together = evaluate::<Lanes<f64, 8>, D>(closed, &curves, functional.as_ref());
            for (lane, found) in together.iter().enumerate() {
                let alone = evaluate::<f64, D>(closed, &curves[lane..=lane], functional.as_ref()).remove(0);
                let what = format!("{functional:?}, {D}-D, closed {closed}, lane {lane}");
                assert_eq!(found.value.to_bits(), alone.value.to_bits(), "value of {what}");
                assert_eq!(bits(&found.gradient), bits(&alone.gradient), "gradient of {what}");
                assert_eq!(bits(&found.hessian), bits(&alone.hessian), "Hessian of {what}");
            }
        }
    }
}

#[test]
fn a_curve_has_the_same_bits_alone_and_beside_others() {
    lanes_equal_curves_alone::<2>(3);
    lanes_equal_curves_alone::<3>(4);
}

#[test]
fn single_precision_differs_by_rounding() {
    // Tangents have the error ε, curvature vectors 2 ε/Δs, and every derivative adds another 1/Δs,
    // as do the numbers themselves. The largest error found is 7.8.
    const FACTOR: f64 = 16.0;
    let mut worst = 0.0f64;
    let mut rng = StdRng::seed_from_u64(5);
    for closed in [false, true] {
        for count in [4, 9, 16] {
            let points = curve::<3>(closed, count, &mut rng);
            for functional in functionals() {
                let wide = evaluate::<f64, 3>(closed, std::slice::from_ref(&points), functional.as_ref()).remove(0);
                let narrow = evaluate::<f32, 3>(closed, std::slice::from_ref(&points), functional.as_ref()).remove(0);
                let of = |numbers: &[f32]| numbers.iter().map(|x| x.to_f64()).collect::<Vec<_>>();
                let differences = [
                    apart(&of(&[narrow.value]), &[wide.value]),
                    apart(&of(&narrow.gradient), &wide.gradient),
                    apart(&of(&narrow.hessian), &wide.hessian),
                ];
                let difference = largest(&differences) / f64::from(f32::EPSILON);
                worst = worst.max(difference);
                assert!(difference < FACTOR, "{functional:?}, closed {closed}, {count}: {difference} ε");
            }
        }
    }
    // The two results must not be the same numbers.
    assert!(worst > 0.1, "{worst}");
    println!("largest difference {worst} ε");
}

#[test]
fn products_are_those_of_the_full_matrix() {
    let mut rng = StdRng::seed_from_u64(6);
    for (closed, count) in [(true, 3), (true, 4), (true, 6), (true, 12), (false, 2), (false, 4), (false, 12)] {
        let points = curve::<3>(closed, count, &mut rng);
        let base = edges_of(closed, &points);
        let mut edges = Edges::<f64, 3>::new(closed, &[&base], |_, _| 1.0);
        let zero = vec![[0.0; 3]; edges.rows()];
        edges.place(&zero);
        let mut hessian = BlockHessian::new(&edges);
        let energy = variation() + 0.5 * length();
        let terms: Vec<_> = energy.terms().iter().map(|(weight, functional)| (*weight, functional)).collect();
        hessian.assemble(&edges, &terms, Some((2, 2.0)));
        hessian.add_block(1, [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.25]]);
        let x: Vec<[f64; 3]> =
            (0..edges.rows()).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
        let mut y = zero;
        hessian.multiply(&x, &mut y);
        let (dense, flat) = (dense::<_, 3>(closed, &hessian.lane(0)), x[..count].concat());
        let wanted: Vec<f64> =
            dense.chunks(3 * count).map(|row| row.iter().zip(&flat).map(|(h, x)| h * x).sum()).collect();
        // Rows of tens of entries, summed in a different order.
        let difference = largest(&y[..count].concat().iter().zip(&wanted).map(|(a, b)| a - b).collect::<Vec<_>>());
        assert!(difference <= 1e-14 * largest(&dense), "closed {closed}, {count}: {difference}");
    }
}

#[test]
fn derivatives_of_regions_are_differences() {
    let penalty = RegionPenalty { stiffness: 3.0, ..RegionPenalty::NONE };
    let regions = [
        // A half-space, a disc to stay within, one to stay out of, and a corridor at its side and
        // at its end.
        RegionPenalty { axis: [0.6, 0.8], plane: 2.0, ..penalty },
        RegionPenalty { foot: [1.0, 1.0], bend: 2.0, reach: -0.3, ..penalty },
        RegionPenalty { foot: [0.5, 0.1], bend: -2.0, reach: 0.9, ..penalty },
        RegionPenalty { foot: [0.0, 1.0], axis: [0.8, -0.6], span: 2.0, bend: 5.0, reach: -0.01, ..penalty },
        RegionPenalty { foot: [0.0, 1.0], axis: [0.8, -0.6], span: 0.1, bend: 5.0, reach: -0.05, ..penalty },
    ];
    for penalty in regions {
        let u: Vector<f64, 2> = [0.7, 0.3];
        assert!(penalty.value(u) > 0.0, "{penalty:?}");
        let step = 1e-6;
        for c in 0..2 {
            let moved = |by: f64| {
                let mut u = u;
                u[c] += by;
                u
            };
            let slope = (penalty.value(moved(step)) - penalty.value(moved(-step))) / (2.0 * step);
            assert!((slope - penalty.gradient(u)[c]).abs() < 1e-8, "{penalty:?}");
            for d in 0..2 {
                let bend = (penalty.gradient(moved(step))[d] - penalty.gradient(moved(-step))[d]) / (2.0 * step);
                let (bends, largest) = (penalty.hessian(u), penalty.stiffness * (1.0 + penalty.bend * penalty.bend));
                assert!((bend - bends[c][d]).abs() < 1e-7 * largest, "{penalty:?}: {bend} {bends:?}");
            }
        }
        let away = RegionPenalty { reach: penalty.reach - 10.0, ..penalty };
        assert_eq!((away.value(u), away.gradient(u), away.hessian(u)), (0.0, [0.0; 2], [[0.0; 2]; 2]));
    }
}
