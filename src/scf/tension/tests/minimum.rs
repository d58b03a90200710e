//! An independent minimiser: minimises the energy of a polygon of equal edges by Newton's method
//! with Lagrange multipliers.

use super::*;
use nalgebra::{DMatrix, DVector};

/// The unknowns are the edges' angles θ₁ … θ_N and the length L, on a chord of 1. The first and
/// last edge are half an edge from the ends.
struct Polygon {
    angles: [f64; 2],
    nu: f64,
    tension: f64,
}

impl Polygon {
    /// The turns, each with its length and the edges before and after it.
    fn turns(&self, x: &DVector<f64>) -> Vec<(f64, f64, Option<usize>, Option<usize>)> {
        let edges = x.len() - 1;
        let h = x[edges] / edges as f64;
        (0..=edges)
            .map(|index| {
                let before = index.checked_sub(1);
                let after = (index < edges).then_some(index);
                let from = before.map_or(self.angles[0], |edge| x[edge]);
                let to = after.map_or(self.angles[1], |edge| x[edge]);
                (to - from, if before.is_some() && after.is_some() { h } else { 0.5 * h }, before, after)
            })
            .collect()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        let bending: f64 =
            self.turns(x).iter().map(|(turn, length, ..)| turn.abs().powf(self.nu) * length.powf(1.0 - self.nu)).sum();
        bending + self.tension * x[x.len() - 1]
    }

    /// The vector by which the polygon misses the second point.
    fn missed(&self, x: &DVector<f64>) -> [f64; 2] {
        let edges = x.len() - 1;
        let h = x[edges] / edges as f64;
        let sum = (0..edges).fold([0.0; 2], |sum, edge| [sum[0] + x[edge].cos(), sum[1] + x[edge].sin()]);
        [h * sum[0] - 1.0, h * sum[1]]
    }

    /// The gradient and Hessian of the Lagrangian, and the constraints' gradients.
    fn derivatives(&self, x: &DVector<f64>, pull: [f64; 2]) -> (DVector<f64>, DMatrix<f64>, DMatrix<f64>) {
        let edges = x.len() - 1;
        let (length, share, nu) = (x[edges], 1.0 / edges as f64, self.nu);
        let h = length * share;
        let mut gradient = DVector::zeros(edges + 1);
        let mut hessian = DMatrix::zeros(edges + 1, edges + 1);
        let mut constraints = DMatrix::zeros(2, edges + 1);
        gradient[edges] = self.tension;
        for (turn, of, before, after) in self.turns(x) {
            let least = turn.abs().max(1e-7);
            let bend = least.powf(nu) * of.powf(1.0 - nu);
            let first = nu * bend / least * turn / least;
            let second = nu * (nu - 1.0) * bend / (least * least);
            let stretch = (1.0 - nu) / length;
            gradient[edges] += stretch * bend;
            hessian[(edges, edges)] += stretch * (-nu / length) * bend;
            for (edge, sign) in before.map(|edge| (edge, -1.0)).into_iter().chain(after.map(|edge| (edge, 1.0))) {
                gradient[edge] += sign * first;
                hessian[(edge, edge)] += second;
                hessian[(edge, edges)] += sign * stretch * first;
                hessian[(edges, edge)] += sign * stretch * first;
            }
            if let (Some(before), Some(after)) = (before, after) {
                hessian[(before, after)] -= second;
                hessian[(after, before)] -= second;
            }
        }
        for edge in 0..edges {
            let (sine, cosine) = x[edge].sin_cos();
            constraints[(0, edge)] = -h * sine;
            constraints[(1, edge)] = h * cosine;
            constraints[(0, edges)] += share * cosine;
            constraints[(1, edges)] += share * sine;
            hessian[(edge, edge)] += h * (pull[0] * cosine + pull[1] * sine);
            let mixed = share * (pull[0] * sine - pull[1] * cosine);
            hessian[(edge, edges)] += mixed;
            hessian[(edges, edge)] += mixed;
        }
        (gradient, hessian, constraints)
    }

    /// The local minimum next to a start; `None` if Newton's method does not reach it.
    fn minimise(&self, mut x: DVector<f64>) -> Option<DVector<f64>> {
        let size = x.len();
        let mut damping = 1e-3 * self.cost(&x);
        let mut pull = [0.0; 2];
        for _ in 0..3000 {
            let (gradient, hessian, constraints) = self.derivatives(&x, pull);
            let missed = self.missed(&x);
            let mut system = DMatrix::zeros(size + 2, size + 2);
            system.view_mut((0, 0), (size, size)).copy_from(&hessian);
            for index in 0..size {
                system[(index, index)] += damping;
            }
            system.view_mut((size, 0), (2, size)).copy_from(&constraints);
            system.view_mut((0, size), (size, 2)).copy_from(&constraints.transpose());
            let mut right = DVector::zeros(size + 2);
            right.rows_mut(0, size).copy_from(&-&gradient);
            right[size] = -missed[0];
            right[size + 1] = -missed[1];
            let step = system.lu().solve(&right)?;
            // The multipliers belong to cost − P·(missed).
            let next_pull = [-step[size], -step[size + 1]];
            let change = step.rows(0, size).into_owned();
            let weight = 2.0 * (next_pull[0].hypot(next_pull[1]) + 1e-3);
            let merit = |x: &DVector<f64>| {
                let [along, across] = self.missed(x);
                self.cost(x) + weight * (along.abs() + across.abs())
            };
            let next = &x + &change;
            let (before, after) = (merit(&x), merit(&next));
            if change.amax() < 1e-9 {
                return Some(next);
            }
            if next[size - 1] > 0.0 && after <= before + 1e-14 * before {
                (x, pull) = (next, next_pull);
                damping *= 0.2;
            } else {
                damping = 4.0 * damping.max(1e-8);
            }
        }
        None
    }
}

/// The extrapolated minimum of polygons of 64 and 128 edges that start at the segment, bent and
/// lengthened.
fn polygon_cost(segment: &TensionSegment, polygon: &Polygon, amplitude: f64, rng: &mut StdRng) -> Option<f64> {
    let modes: Vec<f64> = (0..6).map(|_| amplitude * rng.random_range(-1.0..1.0)).collect();
    let [coarse, fine] = [64, 128].map(|edges| {
        let start = DVector::from_fn(edges + 1, |index, _| {
            if index == edges {
                return segment.length() * (1.0 + 0.5 * amplitude);
            }
            let share = (index as f64 + 0.5) / edges as f64;
            let bent: f64 = modes.iter().zip(1..).map(|(mode, k)| mode * (k as f64 * PI * share).sin()).sum();
            segment.at(share * segment.length()).angle + bent
        });
        polygon.minimise(start).map(|x| polygon.cost(&x))
    });
    Some((4.0 * fine? - coarse?) / 3.0)
}

#[test]
fn an_independent_minimiser_finds_the_same_cost() {
    let mut rng = StdRng::seed_from_u64(23);
    let mut inputs: Vec<([f64; 2], f64, f64)> = (0..60)
        .map(|index| {
            let (angles, ..) = random_input(&mut rng);
            (angles, [1.6, 2.0, 2.5, 3.0, 4.0][index % 5], 10f64.powf(rng.random_range(-1.0..2.0)))
        })
        .collect();
    // With a flat piece between arcs of the same and of opposite senses.
    inputs.extend([
        (degrees(40.0, -60.0), 3.0, 1000.0),
        (degrees(30.0, 20.0), 3.0, 1000.0),
        (degrees(20.0, -20.0), 4.0, 1e4),
    ]);
    let mut counts = [0; 4];
    for (angles, nu, tension) in inputs {
        let segment = solve(angles, nu, tension);
        let polygon = Polygon { angles, nu, tension };
        let what = format!("{angles:?}, nu {nu}, tension {tension}");
        let found = polygon_cost(&segment, &polygon, 0.15, &mut rng).unwrap_or_else(|| panic!("no minimum: {what}"));
        let tolerance = if segment.flat_length() > 0.0 { 2e-4 } else { 1e-4 };
        assert_near(found / segment.cost(), 1.0, tolerance, &what);
        counts[match segment.shape.course {
            _ if segment.flat_length() > 0.0 => 0,
            Course::Direct => 1,
            Course::Through(_) => 2,
            Course::Around(_) => 3,
        }] += 1;
    }
    assert!(counts[0] == 3 && counts[1..].iter().all(|count| *count > 10), "{counts:?}");
}

#[test]
fn no_polygon_from_a_random_start_is_cheaper_than_the_cheapest_segment() {
    let mut rng = StdRng::seed_from_u64(29);
    let edges = 64;
    let (mut found, mut same) = (0, 0);
    for index in 0..25 {
        let (angles, ..) = random_input(&mut rng);
        let nu = [1.6, 2.0, 2.5, 3.0, 4.0][index % 5];
        let tension = 10f64.powf(rng.random_range(-1.0..2.0));
        let cheapest = &TensionSegment::all_between(1.0, angles, nu, tension)[0];
        let polygon = Polygon { angles, nu, tension };
        for _ in 0..8 {
            let modes: Vec<f64> = (0..6).map(|_| 2.0 * rng.random_range(-1.0..1.0)).collect();
            let length = rng.random_range(1.0..4.0) * cheapest.length();
            let start = DVector::from_fn(edges + 1, |index, _| {
                if index == edges {
                    return length;
                }
                let share = (index as f64 + 0.5) / edges as f64;
                let bent: f64 = modes.iter().zip(1..).map(|(mode, k)| mode * (k as f64 * PI * share).sin()).sum();
                angles[0] + (angles[1] - angles[0]) * share + bent
            });
            let Some(x) = polygon.minimise(start) else { continue };
            let ratio = polygon.cost(&x) / cheapest.cost();
            assert!(ratio > 0.995, "{angles:?}, nu {nu}, tension {tension}: {ratio} of the cost");
            found += 1;
            same += (ratio < 1.01) as usize;
        }
    }
    // Most starts end in a minimum, and many in the cheapest.
    assert!(found > 120 && same > 40, "{found} minima, {same} of them the cheapest");
}
