use std::f64::consts::{PI, TAU};

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::surface::{Quadric, Torus};

#[path = "../../../tests/common/meshes.rs"]
pub mod meshes;

use meshes::{Raw, icosphere, torus};

fn mesh((vertices, triangles): &Raw) -> Mesh {
    Mesh::new(vertices, triangles).unwrap()
}

/// The largest errors of place, normal and curvature at the feet of points.
fn errors(mesh: &Mesh, exact: &dyn Surface, points: &[DVec3]) -> [f64; 3] {
    let mut most = [0.0; 3];
    for &x in points {
        let y = mesh.project(x).unwrap();
        let shape = |surface: &dyn Surface| {
            let gradient = surface.gradient(y);
            let normal = gradient.normalize();
            let flat = DMat3::IDENTITY - jet::outer(normal, normal);
            (normal, flat * surface.hessian(y) * flat * (1.0 / gradient.length()))
        };
        let (own, wanted) = (shape(mesh), shape(exact));
        let place = exact.value(y) / exact.gradient(y).length();
        let bend = (own.1 - wanted.1).to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        for (most, error) in most.iter_mut().zip([place.abs(), own.0.distance(wanted.0), bend]) {
            *most = f64::max(*most, error);
        }
    }
    most
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let edges =
        (0..mesh.sheet.patches.len()).flat_map(|i| mesh.sheet.topology.neighbours[i].iter().map(move |&k| (i, k)));
    let lengths: Vec<f64> =
        edges.map(|(i, k)| mesh.sheet.patches[i].place.distance(mesh.sheet.patches[k].place)).collect();
    lengths.iter().sum::<f64>() / lengths.len() as f64
}

/// Points of the torus between these angles around its axis.
fn on_torus([from, to]: [f64; 2], count: usize) -> Vec<DVec3> {
    let mut rng = StdRng::seed_from_u64(6);
    let mut point = || {
        let (around, tube) = (rng.random_range(from..to), rng.random_range(0.0..TAU));
        let out = 1.0 + 0.5 * f64::cos(tube);
        DVec3::new(out * around.cos(), out * around.sin(), 0.5 * f64::sin(tube))
    };
    (0..count).map(|_| point()).collect()
}

/// Points of the unit sphere.
fn on_sphere(count: usize) -> Vec<DVec3> {
    let mut rng = StdRng::seed_from_u64(7);
    let mut number = || rng.random_range(-1.0..1.0);
    (0..count).map(|_| DVec3::new(number(), number(), number()).normalize()).collect()
}

/// Errors of place, normal and curvature fall by these orders as edges become a quarter.
fn fall(what: &str, found: &[[f64; 3]; 3]) {
    for [place, normal, bend] in found {
        println!("{what}: place {place:.1e}, normal {normal:.1e}, curvature {bend:.1e}");
    }
    let orders: [f64; 3] = std::array::from_fn(|k| (found[0][k] / found[2][k]).log2() / 2.0);
    println!("{what}: orders {orders:.2?}");
    // They are measured on shaken vertices, and the largest errors of few points.
    assert!(orders[0] > 3.6 && orders[1] > 2.7 && orders[2] > 1.8, "{what}: {orders:?}");
}

#[test]
fn places_are_of_fourth_order_normals_of_third_and_curvatures_of_second() {
    let exact = Torus::new(1.0, 0.5).unwrap();
    let (whole, half) = ([0.0, TAU], [0.0, PI]);
    let sizes = [20, 40, 80];
    for parts in sizes {
        println!("{parts} parts: mean edge {:.3}", mean_edge(&mesh(&torus(parts, whole, 0.25))));
    }
    let inside = sizes.map(|parts| errors(&mesh(&torus(parts, whole, 0.25)), &exact, &on_torus(whole, 150)));
    fall("torus", &inside);
    let at_rim = sizes.map(|parts| errors(&mesh(&torus(parts, half, 0.25)), &exact, &on_torus([0.0, 0.03], 100)));
    fall("torus at its rim", &at_rim);
    let axes = DVec3::new(1.5, 1.2, 1.0);
    let exact = Quadric::ellipsoid(axes);
    // Around the 12 vertices of five neighbours, at the same places in triangles of every size.
    let found = [3, 4, 5].map(|times| {
        let mesh = mesh(&icosphere(times, axes));
        let near =
            |t: &usize| mesh.sheet.topology.triangles[*t].iter().any(|&i| mesh.sheet.topology.neighbours[i].len() == 5);
        let points = (0..mesh.sheet.topology.triangles.len()).filter(near).flat_map(|t| {
            let [a, b, c] = mesh.sheet.topology.corners(t);
            [[0.34, 0.33, 0.33], [0.8, 0.1, 0.1], [0.2, 0.5, 0.3], [0.1, 0.3, 0.6]]
                .map(|[u, v, w]| u * a + v * b + w * c)
        });
        println!("divided {times} times: mean edge {:.3}", mean_edge(&mesh));
        errors(&mesh, &exact, &points.collect::<Vec<_>>())
    });
    fall("ellipsoid", &found);
}

#[test]
fn meshes_of_spheres_are_spheres_to_rounding() {
    for times in [1, 2, 3] {
        let mesh = mesh(&icosphere(times, DVec3::splat(2.0)));
        let points: Vec<DVec3> = on_sphere(100).into_iter().map(|x| 2.0 * x).collect();
        let [place, normal, bend] = errors(&mesh, &Quadric::sphere(2.0), &points);
        println!("{}: {place:e} {normal:e} {bend:e}", mesh.name());
        assert!(place < 1e-13 && normal < 1e-12 && bend < 1e-11, "{place:e} {normal:e} {bend:e}");
    }
}

#[test]
fn globes_with_many_triangles_at_their_poles_are_spheres() {
    let (rows, columns) = (40, 300);
    let place = |k: usize| {
        let [lat, lon] = [PI * (k / columns + 1) as f64 / rows as f64, TAU * (k % columns) as f64 / columns as f64];
        [lat.sin() * lon.cos(), lat.sin() * lon.sin(), lat.cos()]
    };
    let count = (rows - 1) * columns;
    let mut places: Vec<[f64; 3]> = (0..count).map(place).collect();
    places.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    let mut triangles = Vec::new();
    for i in 0..columns {
        let next = (i + 1) % columns;
        triangles.extend([[count, i, next], [count + 1, count - columns + next, count - columns + i]]);
        for row in (0..count - columns).step_by(columns) {
            let [a, b] = [row + i, row + next];
            triangles.extend([[a, a + columns, b + columns], [a, b + columns, b]]);
        }
    }
    let globe = Mesh::new(&places, &triangles).unwrap();
    let mut points = on_sphere(50);
    points.extend([0.0, 0.01, 0.07, 0.1].map(|x| DVec3::new(x, 0.5 * x, 1.0).normalize()));
    let [place, normal, bend] = errors(&globe, &Quadric::sphere(1.0), &points);
    println!("{}: {place:e} {normal:e} {bend:e}", globe.name());
    // Slivers are fitted by systems whose pivots are above 1e-8: rounding ε may grow to ε/1e-8,
    // over edges of 0.08.
    let most = f64::EPSILON / 1e-8;
    assert!(place < 0.08 * most && normal < most && bend < most / 0.08, "{place:e} {normal:e} {bend:e}");
    assert!(points.iter().all(|&x| globe.undefined(x).is_none()));
}

#[test]
fn closest_points_are_straight_below_from_near_and_far() {
    let mesh = mesh(&torus(24, [0.0, TAU], 0.25));
    for x in on_torus([0.0, TAU], 60) {
        let normal = Torus::new(1.0, 0.5).unwrap().gradient(x).normalize();
        for height in [-0.2, 0.05, 0.4, 3.0] {
            let from = x + height * normal;
            // Farther in another part of the torus may be closer.
            if height > 0.4 && x.x.hypot(x.y) < 1.2 {
                continue;
            }
            let y = mesh.closest(from).unwrap();
            let away = from - y;
            assert!(mesh.value(y).abs() < 1e-15, "{:e}", mesh.value(y));
            let across = away.cross(mesh.gradient(y).normalize()).length();
            assert!(across < 1e-12, "{across:e} from {height}");
            assert!((away.length() - height.abs()).abs() < 1e-3);
            // What is closer than the surface to its triangles is not far.
            let on_triangles = mesh.sheet.nearest(from).unwrap().place;
            assert!(y.distance(on_triangles) < 0.1);
        }
    }
    let far = DVec3::new(50.0, 3.0, 8.0);
    assert!(mesh.value(far).is_nan() && mesh.gradient(far).is_nan());
    let exact = Torus::new(1.0, 0.5).unwrap().closest(far).unwrap();
    assert!(mesh.project(far).unwrap().distance(exact) < 1e-3);
    assert_eq!(mesh.project(far), mesh.closest(far));
    assert!(mesh.undefined(far).unwrap().contains("lies off the mesh"));
}

#[test]
fn meshes_through_the_origin_have_feet_there() {
    let mut raw = icosphere(2, DVec3::ONE);
    let apex = raw.0[0];
    raw.0.iter_mut().for_each(|place| *place = std::array::from_fn(|k| place[k] - apex[k]));
    let mesh = mesh(&raw);
    let near = DVec3::new(1e-9, -2e-9, 1e-10);
    let foot = mesh.project(near).unwrap();
    assert!(foot.length() < 3e-9 && mesh.closest(near).unwrap().distance(foot) < 1e-15);
}

#[test]
fn trees_and_cells_find_what_all_triangles_and_patches_give() {
    let mesh = mesh(&torus(20, [0.0, PI], 0.25));
    let mut rng = StdRng::seed_from_u64(8);
    for _ in 0..200 {
        let x = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-2.0..2.0)));
        let corners = |t: usize| mesh.sheet.topology.corners(t);
        let least = (0..mesh.sheet.topology.triangles.len())
            .map(|t| closest::closest(corners(t), x).0.distance(x))
            .fold(f64::INFINITY, f64::min);
        let found = mesh.sheet.nearest(x).unwrap();
        assert_eq!(found.place.distance(x), least);
        // No point of a grid of the triangle is closer, and it lies in the plane.
        let [a, b, c] = corners(found.triangle);
        for i in 0..=20 {
            for k in 0..=20 - i {
                let point = a + i as f64 / 20.0 * (b - a) + k as f64 / 20.0 * (c - a);
                assert!(point.distance(x) >= least - 1e-15);
            }
        }
        let is_near = |&i: &usize| mesh.sheet.patches[i].place.distance(x) < mesh.sheet.patches[i].reach;
        let reached = mesh.sheet.reaches.at(x).1.iter().map(|&i| i as usize).filter(is_near);
        assert!(reached.eq((0..mesh.sheet.patches.len()).filter(is_near)), "{x}");
    }
}

#[test]
fn a_mesh_ends_at_its_rims() {
    let mesh = mesh(&torus(32, [0.0, PI], 0.25));
    let at = |around: f64, tube: f64| {
        let out = 1.0 + 0.5 * tube.cos();
        mesh.project(DVec3::new(out * around.cos(), out * around.sin(), 0.5 * tube.sin())).unwrap()
    };
    for k in 0..40 {
        let tube = TAU * k as f64 / 40.0;
        for around in [0.0, 0.01, 1.5, PI] {
            assert_eq!(mesh.undefined(at(around, tube)), None, "{around} {tube}");
        }
        for around in [-0.06, PI + 0.06] {
            let why = mesh.undefined(at(around, tube)).unwrap();
            assert_eq!(why, "lies beyond the mesh, at a hole or its rim");
        }
    }
}

#[test]
fn triangles_of_any_orientation_make_the_same_surface() {
    let raw = torus(20, [0.0, PI], 0.25);
    let own = mesh(&raw);
    let mut rng = StdRng::seed_from_u64(9);
    let mut turned = raw.clone();
    turned.1.iter_mut().skip(1).filter(|_| rng.random_range(0..2) == 0).for_each(|triangle| triangle.swap(0, 2));
    let turned = mesh(&turned);
    // A soup of triangles, each with vertices of its own.
    let corners = raw.1.iter().flatten().map(|&i| raw.0[i]);
    let soup = mesh(&(corners.collect(), (0..raw.1.len()).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()));
    assert_eq!((soup.name(), turned.name()), (own.name(), own.name()));
    for x in on_torus([0.0, PI], 50) {
        let x = 1.02 * x;
        for other in [&turned, &soup] {
            assert!((own.value(x) - other.value(x)).abs() < 1e-14);
            assert_eq!(own.undefined(x), other.undefined(x));
        }
    }
    assert_eq!(own.sheet.topology.on_rim.iter().filter(|&&is| is).count(), 40);
}

/// A grid of so many cells a side in the plane at a height, from vertex `first` on.
fn sheet(cells: usize, height: f64, first: usize) -> Raw {
    let rows = cells + 1;
    let places = (0..rows * rows).map(|k| [(k % rows) as f64, (k / rows) as f64, height]).collect();
    let cell = |k: usize| {
        let a = first + k / cells * rows + k % cells;
        [[a, a + 1, a + rows + 1], [a, a + rows + 1, a + rows]]
    };
    (places, (0..cells * cells).flat_map(cell).collect())
}

#[test]
fn sheets_nearer_than_their_triangles_are_long_are_not_known() {
    let (mut places, mut triangles) = sheet(12, 0.0, 0);
    let above = sheet(4, 0.5, places.len());
    places.extend(above.0);
    triangles.extend(above.1);
    let why = "lies where sheets of the mesh are as near to each other as its triangles are long";
    // The upper sheet faces either way.
    for _ in 0..2 {
        let mesh = Mesh::new(&places, &triangles).unwrap();
        assert_eq!(mesh.undefined(DVec3::new(2.2, 2.1, 0.0)).as_deref(), Some(why));
        assert_eq!(mesh.undefined(DVec3::new(9.2, 9.1, 0.0)), None);
        triangles.iter_mut().skip(288).for_each(|triangle| triangle.swap(0, 1));
    }
    let far = sheet(4, 4.0, 169);
    places.truncate(169);
    places.extend(far.0);
    assert_eq!(Mesh::new(&places, &triangles).unwrap().undefined(DVec3::new(2.2, 2.1, 0.0)), None);
}

#[test]
fn what_is_no_mesh_is_refused_with_a_sentence() {
    let square =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 1.0], [1.0, 0.0, -0.0]];
    let refused = |vertices: &[[f64; 3]], triangles: &[[usize; 3]], what: &str| {
        let error = Mesh::new(vertices, triangles).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    };
    refused(&square, &[], "the mesh has no triangles");
    refused(&square, &[[0, 1, 2], [0, 2, 6]], "triangle 1 has vertex 6, but the mesh has 6 vertices, counted from 0");
    refused(&[[0.0; 3], [f64::NAN; 3], [1.0; 3]], &[[0, 1, 2]], "vertex 1 of triangle 0 lies at [NaN, NaN, NaN]");
    refused(&square, &[[0, 1, 5], [2, 2, 3]], "all 2 triangles of the mesh have two vertices at one place");
    refused(
        &square,
        &[[0, 1, 2], [0, 2, 3], [0, 2, 4]],
        "the edge from [0, 0, 0] to [1, 1, 0], of vertices 0 and 2 counted from 0, has 3 triangles",
    );
    refused(&[[0.0; 3], [1.0; 3], [2.0; 3]], &[[0, 1, 2]], "the triangles of the mesh have no area");
    // A band of a half turn.
    let place = |k: usize, side: f64| {
        let (sin, cos) = (TAU * k as f64 / 30.0).sin_cos();
        let (up, out) = (PI * k as f64 / 30.0).sin_cos();
        [(2.0 + side * out) * cos, (2.0 + side * out) * sin, side * up]
    };
    let band: Vec<[f64; 3]> = (0..30).flat_map(|k| [place(k, -0.3), place(k, 0.3)]).collect();
    let next = |k: usize| if k == 29 { [1, 0] } else { [2 * k + 2, 2 * k + 3] };
    let strips = (0..30).flat_map(|k| [[2 * k, 2 * k + 1, next(k)[0]], [2 * k + 1, next(k)[1], next(k)[0]]]);
    refused(&band, &strips.collect::<Vec<_>>(), "the mesh has one side only, as a Möbius band");
    // A tetrahedron is no more than its corners.
    let solid = [[0, 2, 1], [0, 1, 4], [1, 2, 4], [2, 0, 4]];
    refused(&square, &solid, "all sheets of the mesh of 4 vertices and 4 triangles are as near to each other");
}

#[test]
fn single_triangles_are_planes() {
    let mesh = Mesh::new(&[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], &[[0, 1, 2]]).unwrap();
    assert_eq!(mesh.closest(DVec3::new(0.2, 0.3, 1.4)), Some(DVec3::new(0.2, 0.3, 1.0)));
    assert_eq!(mesh.undefined(DVec3::new(0.2, 0.3, 1.0)), None);
    assert!(mesh.undefined(DVec3::new(0.6, 0.8, 1.0)).unwrap().contains("beyond the mesh"));
}
