use super::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};

mod arcs;
mod derivatives;
mod minimum;
mod near;

/// ν log-uniform in 1.2 … 20, λ·chord^ν in 1e-3 … 1e3, angles up to ±170°, chord 1.
fn random_input(rng: &mut StdRng) -> ([f64; 2], f64, f64) {
    let angles = [(); 2].map(|()| rng.random_range(-170.0..170.0f64).to_radians());
    let exponent = 1.2 * (20.0f64 / 1.2).powf(rng.random::<f64>());
    (angles, exponent, 10f64.powf(rng.random_range(-3.0..3.0)))
}

fn solve(angles: [f64; 2], exponent: f64, tension: f64) -> TensionSegment {
    TensionSegment::between(1.0, angles, exponent, tension)
        .unwrap_or_else(|| panic!("not solved: {angles:?}, nu {exponent}, tension {tension}"))
}

fn degrees(a: f64, b: f64) -> [f64; 2] {
    [a.to_radians(), b.to_radians()]
}

fn assert_near(got: f64, wanted: f64, tolerance: f64, what: &str) {
    assert!((got - wanted).abs() <= tolerance, "{what}: {got} for {wanted}, off by {:e}", (got - wanted).abs());
}

fn oracle(name: &str) -> serde_json::Value {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn every_one_of_a_thousand_random_segments_is_solved_and_closes() {
    let mut rng = StdRng::seed_from_u64(7);
    let mut shapes = [0; 4];
    for _ in 0..1000 {
        let (angles, exponent, tension) = random_input(&mut rng);
        let segment = solve(angles, exponent, tension);
        let end = segment.place_again();
        let missed = (end[0] - 1.0).hypot(end[1]);
        assert!(missed < 1e-10, "missed by {missed}: {angles:?}, nu {exponent}, tension {tension}");
        shapes[match segment.shape.course {
            Course::Direct => 0,
            Course::Through(_) if segment.shape.flat > 0.0 => 1,
            Course::Through(_) => 2,
            Course::Around(_) => 3,
        }] += 1;
    }
    assert!(shapes.iter().all(|count| *count > 5), "direct, flat, one inflection, loop: {shapes:?}");
}

#[test]
fn without_tension_it_becomes_the_tension_free_segment() {
    let rows = oracle("scf_segments.json");
    let mut compared = 0;
    for row in rows["unit_chord_segments"].as_array().unwrap() {
        let number = |key: &str| row[key].as_f64().unwrap();
        let angles = degrees(number("start_angle_degrees"), number("end_angle_degrees"));
        let nu = number("nu");
        if !row["exists"].as_bool().unwrap() {
            continue;
        }
        // The cost is concave in λ with the length as its slope: the remainder is of order λ².
        let scale = number("cost");
        let tension = 1e-7 * scale;
        let segment = solve(angles, nu, tension);
        let what = format!("nu {nu}, {angles:?}");
        assert_near((segment.cost() - tension * segment.length()) / scale, 1.0, 1e-11, &what);
        assert_eq!(segment.has_inflection(), row["inflection"].as_bool().unwrap(), "{what}");
        compared += 1;
    }
    assert_eq!(compared, 93);
}

#[test]
fn the_cost_has_the_moments_the_force_and_the_length_for_derivatives() {
    let mut rng = StdRng::seed_from_u64(11);
    for _ in 0..300 {
        let (angles, nu, tension) = random_input(&mut rng);
        let segment = solve(angles, nu, tension);
        let [a, b] = angles;
        let step = 1e-4;
        let cost = |chord: f64, a: f64, b: f64, tension: f64| {
            TensionSegment::between(chord, [a, b], nu, tension).unwrap().cost()
        };
        // Fourth-order differences.
        let slope = |at: &dyn Fn(f64) -> f64| {
            let [near, far] = [step, 2.0 * step].map(|step| (at(step) - at(-step)) / (2.0 * step));
            (4.0 * near - far) / 3.0
        };
        let [m0, m1] = segment.moments();
        // The second point moves across the chord as the chord grows and turns.
        let across = |h: f64| cost(1f64.hypot(h), a - h.atan(), b - h.atan(), tension);
        let [px, py] = segment.force();
        for (got, wanted, name) in [
            (slope(&|h| cost(1.0, a + h, b, tension)), -nu * m0, "first angle"),
            (slope(&|h| cost(1.0, a, b + h, tension)), nu * m1, "second angle"),
            (slope(&|h| cost(1.0 + h, a, b, tension)), px, "chord"),
            (slope(&across), py, "across the chord"),
            (slope(&|h| cost(1.0, a, b, tension * (1.0 + h))), tension * segment.length(), "tension"),
        ] {
            let what = format!("{name}, {angles:?}, nu {nu}, tension {tension}");
            assert_near(got / (nu * segment.cost()), wanted / (nu * segment.cost()), 1e-8, &what);
        }
    }
}

#[test]
fn sites_lie_on_one_curve_with_the_tangents_the_curvatures_and_the_first_integral() {
    let mut rng = StdRng::seed_from_u64(13);
    for _ in 0..60 {
        let (angles, nu, tension) = random_input(&mut rng);
        let segment = solve(angles, nu, tension);
        let (first, last) = (segment.at(0.0), segment.at(segment.length()));
        let what = format!("{angles:?}, nu {nu}, tension {tension}");
        assert_eq!(first.point, [0.0, 0.0], "{what}");
        assert_near((last.point[0] - 1.0).hypot(last.point[1]), 0.0, 1e-10, &what);
        for (site, angle, curvature) in
            [(first, angles[0], segment.curvatures()[0]), (last, angles[1], segment.curvatures()[1])]
        {
            assert_near(site.angle, angle, 1e-12, &what);
            assert_near(site.curvature, curvature, 1e-9 * (1.0 + curvature.abs()), &what);
        }
        let [px, py] = segment.force();
        let (steps, length) = (100, segment.length());
        let sites: Vec<Site> = (0..=steps).map(|k| segment.at(length * k as f64 / steps as f64)).collect();
        for site in &sites {
            let along = px * site.angle.cos() + py * site.angle.sin();
            let left = (nu - 1.0) * site.curvature.abs().powf(nu);
            assert_near((left - (tension - along)) / (tension + px.hypot(py)), 0.0, 1e-12, &what);
        }
        // Between two sites the mean tangent and the mean curvature are those of the ends, to
        // second order.
        for index in 0..20 {
            let at = length * (index as f64 + 0.37) / 20.0;
            let h = 1e-4 * length;
            let [before, here, after] = [at - h, at, at + h].map(|at| segment.at(at));
            let got = [0, 1].map(|axis| (after.point[axis] - before.point[axis]) / (2.0 * h));
            let bend = h * (before.curvature.abs() + after.curvature.abs());
            let second = 1e-9 + bend * bend + h * (after.curvature - before.curvature).abs();
            assert_near(got[0], here.angle.cos(), second, &what);
            assert_near(got[1], here.angle.sin(), second, &what);
            let turn = (after.angle - before.angle) / (2.0 * h);
            let (low, high) = (before.curvature.min(after.curvature), before.curvature.max(after.curvature));
            let slack = 1e-9 + 0.1 * (high - low) + 1e-3 * (turn.abs() + here.curvature.abs());
            assert!(turn >= low - slack && turn <= high + slack, "{what}: {turn} outside {low} … {high}");
        }
    }
}

#[test]
fn the_ends_perpendicular_to_the_chord_make_the_free_elastica() {
    let wanted = oracle("elastica.json");
    let tension: f64 = 1e-12;
    let segment = solve(degrees(90.0, -90.0), 2.0, tension);
    assert_near(segment.cost(), wanted["cost"].as_f64().unwrap(), 1e-10, "cost");
    // Its ends have no curvature. A tension gives them curvature in proportion to its square root.
    let shift = tension.sqrt();
    assert_near(segment.length(), wanted["length"].as_f64().unwrap(), shift, "length");
    let height = segment.at(0.5 * segment.length()).point[1];
    assert_near(height, wanted["height"].as_f64().unwrap(), shift, "height");
}

#[test]
fn a_full_turn_over_a_short_chord_is_nearly_the_circle_of_least_cost() {
    for nu in [1.5, 2.0, 3.0, 8.0] {
        // The least of 2πR(R^−ν + λ), at (ν − 1)R^−ν = λ.
        let radius = (nu - 1.0f64).powf(1.0 / nu);
        let circle = 2.0 * PI * radius * (radius.powf(-nu) + 1.0);
        let chord = 1e-6;
        let segment = TensionSegment::between(chord, [PI, -PI], nu, 1.0).unwrap();
        assert_near(segment.cost() / circle, 1.0, 1e-5, &format!("nu {nu}"));
        assert_near(segment.curvatures()[0] * radius, -1.0, 1e-5, &format!("nu {nu}"));
    }
}

#[test]
fn turns_without_a_tension_free_minimiser_have_one_that_grows_as_the_tension_falls() {
    for (a, b) in [(150.0, -20.0), (100.0, -90.0), (120.0, 60.0), (-180.0, 0.0), (180.0, 170.0), (180.0, -180.0)] {
        for nu in [1.5, 2.0, 3.0, 8.0] {
            let [strong, weak] = [1e-6, 1e-9].map(|tension| solve(degrees(a, b), nu, tension));
            // A loop of size λ^{−1/ν}, compared with which the chord is negligible.
            let grown = 1e3f64.powf(1.0 / nu);
            let what = format!("({a}, {b}), nu {nu}");
            let tolerance = 20.0 / strong.length();
            assert_near(weak.length() / strong.length() / grown, 1.0, tolerance, &what);
            assert_near(weak.cost() / strong.cost() * 1e3 / grown, 1.0, tolerance, &what);
        }
    }
}

#[test]
fn above_two_a_strong_tension_leaves_a_straight_piece_and_a_longer_chord_only_lengthens_it() {
    for (nu, a, b) in
        [(2.5, 60.0, -60.0), (3.0, 45.0, -120.0), (3.0, 50.0, 50.0), (8.0, -170.0, -90.0), (20.0, 10.0, 20.0)]
    {
        let what = format!("({a}, {b}), nu {nu}");
        let angles = degrees(a, b);
        let segment = TensionSegment::between(20.0, angles, nu, 3.0).unwrap();
        assert!(segment.flat_length() > 1.0 && segment.flat_length() < 20.0, "{what}: {}", segment.flat_length());
        let [px, py] = segment.force();
        assert_near(px.hypot(py), 3.0, 1e-12, &what);
        assert_eq!(segment.has_inflection(), a * b > 0.0, "{what}");
        // The flat piece lies along the pull and has no curvature. The arcs at its ends have
        // curvature.
        let flat: Vec<Site> = (0..=2000)
            .map(|k| segment.at(segment.length() * k as f64 / 2000.0))
            .filter(|site| site.curvature == 0.0)
            .collect();
        assert_near(flat.len() as f64 / 2000.0, segment.flat_length() / segment.length(), 2e-3, &what);
        assert!(flat.iter().all(|site| (site.angle - py.atan2(px)).abs() < 1e-12), "{what}");
        // The chord grows along the pull except for the arcs, which turn a little with it.
        let longer = TensionSegment::between(21.0, angles, nu, 3.0).unwrap();
        let [grown, dearer] = [longer.flat_length() - segment.flat_length(), longer.cost() - segment.cost()];
        assert_near(grown, 1.0, 0.1, &what);
        assert!(dearer > px - 1e-9 && dearer < longer.force()[0] + 1e-9, "{what}: {dearer} for {px}");
        // A symmetric arc does not turn with the chord.
        if a == -b {
            assert_near(grown, 1.0, 1e-12, &what);
        }
    }
    let none = TensionSegment::between(20.0, degrees(50.0, 50.0), 2.0, 3.0).unwrap();
    assert_eq!(none.flat_length(), 0.0);
    // Between two arcs of an elastica under tension the curvature falls as exp(−s√λ), to 2e−7 in
    // the middle.
    let middle = none.at(0.25 * none.length()).curvature.abs();
    assert!(middle > 1e-6 && middle < 1e-2, "{middle}");
}

#[test]
fn mirror_reversal_and_scale_change_nothing_else() {
    let mut rng = StdRng::seed_from_u64(17);
    for _ in 0..50 {
        let ([a, b], nu, tension) = random_input(&mut rng);
        let segment = solve([a, b], nu, tension);
        let ([k0, k1], [px, py]) = (segment.curvatures(), segment.force());
        let what = format!("({a}, {b}), nu {nu}, tension {tension}");
        let scaled = TensionSegment::between(2.0, [a, b], nu, tension * 2f64.powf(-nu)).unwrap();
        let scale = 2f64.powf(nu);
        for (other, curvatures, pull) in [
            (solve([-a, -b], nu, tension), [-k0, -k1], [px, -py]),
            (solve([b, a], nu, tension), [-k1, -k0], [px, py]),
            (scaled, [0.5 * k0, 0.5 * k1], [px / scale, py / scale]),
        ] {
            let factor = if pull[0] == px { 1.0 } else { 2.0 / scale };
            assert_near(other.cost() / segment.cost(), factor, 1e-11 * factor, &what);
            let size = k0.abs() + k1.abs();
            for (got, wanted) in other.curvatures().into_iter().zip(curvatures) {
                assert_near(got / size, wanted / size, 1e-7, &what);
            }
            for (got, wanted) in other.force().into_iter().zip(pull) {
                assert_near(got / pull[0].hypot(pull[1]), wanted / pull[0].hypot(pull[1]), 1e-8, &what);
            }
        }
    }
}

#[test]
fn all_segments_come_cheapest_first_and_a_weak_tension_prefers_the_loop() {
    let [a, b] = degrees(83.0, 38.0);
    let all = TensionSegment::all_between(1.0, [a, b], 4.0, 1.0);
    assert_eq!(all.len(), 2);
    assert!(all[0].cost() < 0.2 * all[1].cost() && all[0].length() > 5.0 * all[1].length());
    assert_eq!(solve([a, b], 4.0, 1.0).cost(), all[1].cost());
    let strong = TensionSegment::all_between(1.0, [a, b], 4.0, 1e3);
    assert_eq!(strong[0].cost(), solve([a, b], 4.0, 1e3).cost());
}

#[test]
fn a_chord_between_its_own_tangents_is_straight() {
    for nu in [1.5, 2.0, 3.0] {
        let segment = TensionSegment::between(2.0, [0.0, 0.0], nu, 0.7).unwrap();
        assert_near(segment.cost(), 1.4, 1e-14, "cost");
        assert_near(segment.force()[0], 0.7, 1e-15, "force");
        assert_eq!((segment.length(), segment.flat_length()), (2.0, 2.0));
        assert_eq!((segment.curvatures(), segment.moments(), segment.force()[1]), ([0.0; 2], [0.0; 2], 0.0));
        assert!(!segment.has_inflection());
        assert_eq!(segment.at(0.5), Site { point: [0.5, 0.0], angle: 0.0, curvature: 0.0 });
    }
}

#[test]
fn what_is_outside_the_domain_is_none() {
    let nan = f64::NAN;
    for (chord, angles, nu, tension) in [
        (0.0, [0.5, 0.5], 2.0, 1.0),
        (-1.0, [0.5, 0.5], 2.0, 1.0),
        (nan, [0.5, 0.5], 2.0, 1.0),
        (1.0, [nan, 0.5], 2.0, 1.0),
        (1.0, [0.5, 3.2], 2.0, 1.0),
        (1.0, [0.5, 0.5], 1.0, 1.0),
        (1.0, [0.5, 0.5], nan, 1.0),
        (1.0, [0.5, 0.5], f64::INFINITY, 1.0),
        (1.0, [0.5, 0.5], 2.0, 0.0),
        (1.0, [0.5, 0.5], 2.0, -1.0),
        (1.0, [0.5, 0.5], 2.0, nan),
        (1e200, [0.5, 0.5], 2.0, 1.0),
        (1e4, [0.5, 0.5], 2.0, 1.0),
    ] {
        assert!(TensionSegment::between(chord, angles, nu, tension).is_none(), "{chord} {angles:?} {nu} {tension}");
        assert!(TensionSegment::all_between(chord, angles, nu, tension).is_empty());
    }
}
