//! Meshes whose vertices lie on known surfaces.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::DVec3;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Vertices and triangles.
pub type Raw = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// The icosahedron in the unit sphere, its triangles divided by 4 so many times, in an ellipsoid of these semi-axes.
pub fn icosphere(times: usize, axes: DVec3) -> Raw {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut places: Vec<DVec3> = Vec::new();
    for [a, b] in [[1.0, golden], [-1.0, golden], [1.0, -golden], [-1.0, -golden]] {
        places.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(DVec3::from_array));
    }
    let meet = |i: usize, k: usize| (places[i].distance(places[k]) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if meet(i, j) && meet(j, k) && meet(i, k) {
                    let out = (places[j] - places[i]).cross(places[k] - places[i]).dot(places[i]);
                    triangles.push(if out > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    let mut places: Vec<DVec3> = places.into_iter().map(DVec3::normalize).collect();
    for _ in 0..times {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                places.push((places[a] + places[b]).normalize());
                places.len() - 1
            })
        };
        let divide = |[a, b, c]: [usize; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(divide).collect();
    }
    (places.iter().map(|place| (*place * axes).to_array()).collect(), triangles)
}

/// The torus of radii 1 and ½ from this angle around its axis to that one, in so many parts around the tube, whose
/// vertices are off their places in the grid by up to a part of its cells.
pub fn torus(parts: usize, [from, to]: [f64; 2], off: f64) -> Raw {
    let mut rng = StdRng::seed_from_u64(5);
    let is_closed = to - from == TAU;
    let columns = ((to - from) / TAU * 2.0 * parts as f64).round() as usize;
    let rows = columns + usize::from(!is_closed);
    let mut places = Vec::new();
    for i in 0..rows {
        for k in 0..parts {
            let mut random = || off * rng.random_range(-1.0..1.0);
            // The rims are circles.
            let inside = f64::from(is_closed || (i > 0 && i < columns));
            let around = from + (to - from) * (i as f64 + inside * random()) / columns as f64;
            let (sin, cos) = (TAU * (k as f64 + random()) / parts as f64).sin_cos();
            let out = 1.0 + 0.5 * cos;
            places.push([out * around.cos(), out * around.sin(), 0.5 * sin]);
        }
    }
    let at = |i: usize, k: usize| i % rows * parts + k % parts;
    let cell = |i: usize, k: usize| {
        let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..columns).flat_map(|i| (0..parts).flat_map(move |k| cell(i, k))).collect();
    (places, triangles)
}
