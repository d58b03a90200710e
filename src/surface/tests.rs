use super::mesh::tests::meshes::icosphere;
use super::*;

/// Surfaces of every kind with points near them.
fn surfaces() -> Vec<(Box<dyn Surface>, DVec3)> {
    let at = DVec3::new;
    let (vertices, triangles) = icosphere(2, at(1.5, 1.2, 1.0));
    vec![
        (Box::new(Quadric::plane(at(1.0, 2.0, -0.5), 0.3)), at(0.2, 0.1, 0.4)),
        (Box::new(Quadric::sphere(1.3)), at(0.7, -0.8, 0.6)),
        (Box::new(Quadric::spheroid(6378137.0, 6356752.3)), at(4e6, 3e6, 4e6)),
        (Box::new(Quadric::ellipsoid(at(3.0, 2.0, 1.0))), at(1.5, 1.0, 0.6)),
        (Box::new(Quadric::cylinder(0.5)), at(0.3, 0.45, 2.0)),
        (Box::new(Quadric::cone(0.4)), at(0.3, -0.3, 1.1)),
        (Box::new(Torus::new(2.0, 1.0).unwrap()), at(1.2, 1.9, 0.9)),
        (Box::new(terrain()), at(5.7, 4.2, 1.9)),
        (Box::new(Mesh::new(&vertices, &triangles).unwrap()), at(0.8, 0.9, -0.5)),
    ]
}

/// Hills of 8 × 10 heights.
fn terrain() -> HeightField {
    let heights = (0..80).map(|k| (0.7 * f64::from(k % 10)).sin() * (0.5 * f64::from(k / 10)).cos() + 1.0);
    HeightField::new([8, 10], heights.collect()).unwrap()
}

fn error(found: DMat3, wanted: DMat3) -> f64 {
    (found - wanted).to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn derivatives_are_those_of_differences() {
    for (surface, x) in surfaces() {
        let (scale, name) = (x.length(), surface.name());
        let h = 1e-5 * scale;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let slope = DVec3::from_array(axes.map(|e| (surface.value(x + h * e) - surface.value(x - h * e)) / (2.0 * h)));
        let gradient = surface.gradient(x);
        assert!((slope - gradient).length() < 1e-9 * gradient.length(), "{name}: {slope} {gradient}");
        let bend = axes.map(|e| (surface.gradient(x + h * e) - surface.gradient(x - h * e)) / (2.0 * h));
        let hessian = surface.hessian(x);
        let size = error(hessian, DMat3::ZERO);
        assert!(error(DMat3::from_cols(bend[0], bend[1], bend[2]), hessian) <= 1e-9 * size, "{name}");
        let (value, at_once, bent) = surface.jet(x);
        assert!((value - surface.value(x)).abs() <= 1e-14 * scale * gradient.length(), "{name}");
        assert!(
            (at_once - gradient).length() <= 1e-14 * gradient.length() && error(bent, hessian) <= 1e-13 * size,
            "{name}"
        );
        let along = DVec3::new(0.3, -0.5, 0.8);
        let third = (surface.hessian(x + h * along) - surface.hessian(x - h * along)) * (0.5 / h);
        assert!(error(third, surface.third(x, along)) <= 1e-8 * size / scale, "{name}");
    }
}

#[test]
fn closest_points_are_on_the_surface_and_straight_below() {
    for (surface, x) in surfaces() {
        let name = surface.name();
        let closest = surface.closest(x).unwrap_or_else(|| panic!("{name}"));
        let normal = normal(&*surface, closest);
        let away = x - closest;
        assert!(away.length() > 1e-3 * x.length(), "{name} is tried off the surface");
        assert!(away.cross(normal).length() < 1e-13 * x.length(), "{name}");
        let height = surface.value(closest) / surface.gradient(closest).length();
        assert!(height.abs() < 1e-15 * x.length(), "{name}: {height}");
        let foot = surface.project(x).unwrap();
        // To second order in the distance.
        assert!((foot - closest).length() < 2.0 * away.length_squared() / x.length(), "{name}");
    }
}

#[test]
fn feet_of_many_points_are_those_of_each() {
    for (surface, x) in surfaces() {
        let point = |k: usize| x * (1.0 + 0.01 * (k as f64).sin()) + x.length() * 0.02 * DVec3::new(0.3, -0.2, 0.1);
        let mut points: Vec<DVec3> = (0..7).map(point).collect();
        points[5] = DVec3::NAN;
        surface.project_all(&mut points);
        let same = |k: usize| points[k] == surface.project(point(k)).unwrap();
        assert!((0..7).all(|k| if k == 5 { points[k].is_nan() } else { same(k) }), "{}", surface.name());
    }
}

#[test]
fn singular_points_have_no_closest_point() {
    assert_eq!(Quadric::sphere(1.0).closest(DVec3::ZERO), None);
    assert_eq!(Torus::new(2.0, 1.0).unwrap().closest(DVec3::Z), None);
}

#[test]
fn tori_that_meet_themselves_are_refused_with_a_sentence() {
    for (major, minor, what) in [(1.0, 1.0, "meets itself"), (0.0, 1.0, "radius R"), (1.0, f64::NAN, "radius r")] {
        assert!(Torus::new(major, minor).unwrap_err().to_string().contains(what));
    }
}

#[test]
fn globes_are_mapped_onto_a_sphere_with_one_scale_at_a_place() {
    for globe in [Globe::WGS84, Globe::sphere(2.0).unwrap(), Globe { equatorial: 1.0, polar: 1.3 }] {
        for [longitude, latitude] in [[10.0, 0.0], [-170.0, 52.0], [80.0, -89.99999], [30.0, 90.0], [0.0, -90.0]] {
            let place = globe.place(longitude, latitude);
            let (point, scale) = globe.onto_sphere(place);
            let (again, _) = globe.place_of(point, DVec3::ZERO);
            assert!(
                (point.length() - 1.0).abs() < 1e-15 && again.distance(place) < 3e-9 * place.length(),
                "{again} {place}"
            );
            for across in [point.any_orthonormal_pair().0, point.any_orthonormal_pair().1] {
                let h = 1e-5;
                let at = |h: f64| globe.place_of((point + h * across).normalize(), DVec3::ZERO).0;
                let wanted = (at(h) - at(-h)) / (2.0 * h);
                let (_, velocity) = globe.place_of(point, across);
                assert!((wanted.length() / scale - 1.0).abs() < 1e-7, "{latitude}: {} {scale}", wanted.length());
                let is_pole = latitude.abs() == 90.0;
                assert!(is_pole || wanted.distance(velocity) < 1e-6 * scale, "{latitude}: {wanted} {velocity}");
            }
        }
    }
}
