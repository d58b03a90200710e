use super::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};

mod minimum;

/// ν log-uniform over 1.2 … 20, λ·chord^ν over 1e-3 … 1e3, angles up to ±170°, chord 1.
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
    let started = std::time::Instant::now();
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
    println!("direct, flat, one inflection, loop: {shapes:?} in {:?}", started.elapsed());
    assert!(shapes.iter().all(|count| *count > 5), "{shapes:?}");
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
        // The cost is concave in λ with the length for a slope: what is left over is of order λ².
        let scale = number("cost");
        let tension = 1e-7 * scale;
        let segment = solve(angles, nu, tension);
        let what = format!("nu {nu}, {angles:?}");
        assert_near((segment.cost() - tension * segment.length()) / scale, 1.0, 1e-11, &what);
        assert_eq!(segment.has_inflection(), row["inflection"].as_bool().unwrap(), "{what}");
        compared += 1;
    }
    println!("{compared} rows");
    assert_eq!(compared, 93);
}

#[test]
fn the_cost_has_the_moments_the_force_and_the_length_for_derivatives() {
    let mut rng = StdRng::seed_from_u64(11);
    let mut worst: f64 = 0.0;
    for _ in 0..300 {
        let (angles, nu, tension) = random_input(&mut rng);
        let segment = solve(angles, nu, tension);
        let [a, b] = angles;
        let step = 1e-4;
        let cost = |chord: f64, a: f64, b: f64, tension: f64| {
            TensionSegment::between(chord, [a, b], nu, tension).map(|segment| segment.cost())
        };
        let slope = |at: &dyn Fn(f64) -> Option<f64>| -> Option<f64> {
            let [near, far] = [step, 2.0 * step].map(|step| Some((at(step)? - at(-step)?) / (2.0 * step)));
            Some((4.0 * near? - far?) / 3.0)
        };
        let [m0, m1] = segment.moments();
        let [px, _] = segment.force();
        let scale = segment.cost() * nu;
        for (got, wanted, name) in [
            (slope(&|h| cost(1.0, a + h, b, tension)), -nu * m0, "a"),
            (slope(&|h| cost(1.0, a, b + h, tension)), nu * m1, "b"),
            (slope(&|h| cost(1.0 + h, a, b, tension)), px, "chord"),
            (slope(&|h| cost(1.0, a, b, tension * (1.0 + h))), tension * segment.length(), "tension"),
        ] {
            let error = (got.unwrap() - wanted).abs() / scale;
            if error > 1e-7 {
                eprintln!("{name} {error:e} {angles:?} nu {nu} tension {tension} {:?} {:?}", segment.shape, got);
            }
            worst = worst.max(error);
        }
    }
    println!("worst {worst:e}");
}

#[test]
fn stress() {
    let mut rng = StdRng::seed_from_u64(99);
    let special = [0.0, 1e-9, 1e-3, 30.0, 45.0, 60.0, 90.0, 120.0, 150.0, 179.0, 180.0f64];
    let mut counts = std::collections::BTreeMap::new();
    for nu in [1.2, 1.5, 2.0, 2.1, 2.5, 3.0, 5.0, 20.0] {
        for log in [-6, -3, -1, 0, 1, 3, 5] {
            let mut bad = 0;
            for a in special {
                for b in special {
                    for b in [b, -b] {
                        if TensionSegment::between(1.0, degrees(a, b), nu, 10f64.powi(log)).is_none() {
                            bad += 1;
                            if log >= -3 && log <= 3 && (1.2..=20.0).contains(&nu) { eprintln!("nu {nu} lambda 1e{log} {a} {b}"); }
                        }
                    }
                }
            }
            for _ in 0..100 {
                let (angles, _, _) = random_input(&mut rng);
                if TensionSegment::between(1.0, angles, nu, 10f64.powi(log)).is_none() { bad += 1; if log >= -3 && log <= 3 && (1.2..=20.0).contains(&nu) { eprintln!("nu {nu} lambda 1e{log} {angles:?}"); } }
            }
            *counts.entry(((nu * 1000.0) as i64, log)).or_insert(0) += bad;
        }
    }
    for ((nu, log), bad) in counts { if bad > 0 { eprintln!("nu {} lambda 1e{log}: {bad}", nu as f64 / 1000.0); } }
    let mut bad = 0;
    for _ in 0..20000 {
        let (angles, exponent, tension) = random_input(&mut rng);
        if TensionSegment::between(1.0, angles, exponent, tension).is_none() { bad += 1; eprintln!("{angles:?} {exponent} {tension}"); }
    }
    eprintln!("random bad {bad}");
}
