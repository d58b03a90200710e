//! R. J. Renka, Geometric Curve Modeling with Sobolev Gradients, 2006: theorem 3.1 and the figures
//! of section 4.

use faircurve::discrete::{Energy, bending, length, tension, variation};
use faircurve::spline::{Natural, Parametrisation};
use faircurve::{CurveBatch, Device, Sampling};
use faircurve_papers::renka::{Direction, Ending, InnerProduct, Minimisation, Minimised, Minimiser, Step};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// The paper's start: 201 vertices at equal arc lengths of the spline through four points, which
/// crosses itself.
fn start() -> Vec<[f64; 2]> {
    let points = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    let fit = by_chords.fit(&CurveBatch::from_slices(&[&points[..]]).unwrap(), &Device::cpu()).unwrap();
    let polylines = fit.polylines(Sampling::Spacing(fit.curve(0).length() / 199.5));
    let vertices = polylines.points(0).as_chunks::<2>().0.to_vec();
    assert_eq!((vertices.len(), vertices[0], vertices[200]), (201, [0.0, 0.0], [1.0, 0.0]));
    vertices
}

/// ψ as in the paper, without the constant m.
fn psi(m: usize) -> Energy {
    1.0 / m as f64 * tension()
}

fn steepest(product: InnerProduct, step: Step) -> Minimiser {
    Minimiser::Gradient { product, step, direction: Direction::Steepest }
}

fn run<const D: usize>(energy: Energy, method: Minimiser, most: u32, start: &[[f64; D]]) -> Minimised<D> {
    Minimisation { method, max_iterations: most, ..Minimisation::new(energy) }.run(start, |_| {}).unwrap()
}

fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn lengths<const D: usize>(vertices: &[[f64; D]]) -> Vec<f64> {
    vertices.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect()
}

/// f_0 + (s_i/s_m)(f_m − f_0)
fn segment<const D: usize>(start: &[[f64; D]]) -> Vec<[f64; D]> {
    let edges = lengths(start);
    let (total, first, last) = (edges.iter().sum::<f64>(), start[0], start[edges.len()]);
    let mut along = 0.0;
    let mut out = vec![first];
    for edge in edges {
        along += edge;
        out.push(std::array::from_fn(|c| first[c] + along / total * (last[c] - first[c])));
    }
    out
}

fn worst<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| distance(a, b)).fold(0.0, f64::max)
}

/// A random walk whose steps differ by a factor of a hundred, or points that know nothing of each
/// other.
fn random<const D: usize>(m: usize, walk: bool, rng: &mut StdRng) -> Vec<[f64; D]> {
    let mut at = [0.0; D];
    let mut vertices = Vec::new();
    for _ in 0..=m {
        let size = if walk { 10f64.powf(rng.random_range(-2.0..0.0)) } else { 1.0 };
        for x in &mut at {
            let before = if walk { *x } else { 0.0 };
            *x = before + size * rng.random_range(-1.0..1.0);
        }
        vertices.push(at);
    }
    vertices
}

/// Theorem 3.1 on random curves of m edges. Returns the largest error as a part of what is allowed.
///
/// Allowed is ε (4 max|f| + m s_m): a few roundings of the coordinates themselves; and unit
/// tangents and the sums over them err by about ε at each of m vertices, while no entry of the
/// inverse of L_f exceeds s_m/4 and the solve, without subtractions, adds nothing worse. The
/// condition of L_f, m² at least, does not enter.
fn theorem<const D: usize>(m: usize, seed: u64) -> f64 {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut largest = 0.0f64;
    for walk in [false, true] {
        let start = random::<D>(m, walk, &mut rng);
        let method = steepest(InnerProduct::Sobolev, Step::Constant(1.0));
        let found = run(length(), method, 1, &start);
        assert_eq!(found.iterations, 1);
        assert_eq!((found.vertices[0], found.vertices[m]), (start[0], start[m]), "m {m}, seed {seed}: the ends moved");
        let (wanted, total) = (segment(&start), lengths(&start).iter().sum::<f64>());
        let size = start.iter().map(|f| distance(f, &[0.0; D])).fold(0.0, f64::max);
        let allowed = f64::EPSILON * (4.0 * size + m as f64 * total);
        largest = largest.max(worst(&found.vertices, &wanted) / allowed);
        // Collinear, all edges the same way.
        let chord: [f64; D] = std::array::from_fn(|c| start[m][c] - start[0][c]);
        let chord_length = chord.iter().map(|x| x * x).sum::<f64>().sqrt();
        for (k, vertex) in found.vertices.iter().enumerate() {
            let away: [f64; D] = std::array::from_fn(|c| vertex[c] - start[0][c]);
            let along = away.iter().zip(&chord).map(|(a, c)| a * c / chord_length).sum::<f64>();
            let across = distance(&away, &chord.map(|x| x / chord_length * along));
            assert!(
                across <= allowed,
                "m {m}, seed {seed}: vertex {k} is {across:e} off the line, {allowed:e} allowed"
            );
        }
        assert!((found.length - chord_length).abs() <= m as f64 * allowed, "m {m}, seed {seed}: folded");
    }
    largest
}

#[test]
fn theorem_3_1_one_sobolev_step_of_length_1_gives_the_segment_with_the_same_vertex_distribution() {
    let mut largest = 0.0f64;
    let counts: Vec<usize> = (2..40).chain([50, 64, 100, 127, 200, 333, 500, 512, 777, 999, 1000]).collect();
    for (k, &m) in counts.iter().enumerate() {
        for seed in 0..4 {
            let seed = 1000 * seed + k as u64;
            let (planar, spatial) = (theorem::<2>(m, seed), theorem::<3>(m, seed));
            assert!(planar <= 1.0 && spatial <= 1.0, "m {m}, seed {seed}: {planar} and {spatial} of the allowed error");
            largest = largest.max(planar).max(spatial);
        }
    }
    println!("theorem 3.1: at most {largest:.2} of the allowed error");
    assert!(largest > 1e-6, "the bound says nothing");
}

#[test]
fn section_4_one_sobolev_step_lands_on_the_segment() {
    let start = start();
    for (step, direction) in [
        (Step::Constant(1.0), Direction::Steepest),
        (Step::Search, Direction::Steepest),
        (Step::Search, Direction::Conjugate),
    ] {
        let found = run(length(), Minimiser::Gradient { product: InnerProduct::Sobolev, step, direction }, 50, &start);
        assert_eq!((found.ending, found.iterations), (Ending::Converged, 1));
        let away = worst(&found.vertices, &segment(&start));
        println!("section 4: {away:.1e} from the segment");
        assert!(away <= 1e-12, "{away:e}");
        assert!((found.length - 1.0).abs() < 1e-13);
    }
}

#[test]
fn section_4_newton_minimises_psi_in_one_iteration() {
    let found = run(psi(200), Minimiser::Newton, 50, &start());
    assert_eq!((found.ending, found.iterations), (Ending::Converged, 1));
    for (k, vertex) in found.vertices.iter().enumerate() {
        assert!(distance(vertex, &[k as f64 / 200.0, 0.0]) < 1e-12, "vertex {k}: {vertex:?}");
    }
    assert!((found.energy - 0.0025).abs() < 1e-15);
}

#[test]
fn section_4_newton_finds_the_hessian_of_phi_singular_wherever_it_starts() {
    let bump = |off: f64| -> Vec<[f64; 2]> {
        (0..=200).map(|k| f64::from(k) / 200.0).map(|x| [x, off * (std::f64::consts::PI * x).sin()]).collect()
    };
    let mut starts = vec![start(), bump(0.0), bump(1e-9), bump(1e-6), bump(1e-3), bump(0.3)];
    let mut rng = StdRng::seed_from_u64(3);
    starts.extend((0..20).map(|_| random::<2>(200, true, &mut rng)));
    for (k, start) in starts.iter().enumerate() {
        let found = run(length(), Minimiser::Newton, 50, start);
        assert_eq!((found.ending, found.iterations), (Ending::Singular, 0), "start {k}");
        assert_eq!(&found.vertices, start);
        assert!(found.gradient_norm.is_nan() && (found.energy - found.length).abs() == 0.0);
    }
    // Of 3(m − 1) rows at most 2m are independent.
    let found = run(length(), Minimiser::Newton, 50, &random::<3>(100, false, &mut rng));
    assert_eq!((found.ending, found.iterations), (Ending::Singular, 0));
}

#[test]
fn section_4_ordinary_gradients_get_stuck_far_from_the_shortest_curve() {
    let start = start();
    for step in [Step::Constant(0.01), Step::Constant(0.001), Step::Search] {
        let found = run(length(), steepest(InnerProduct::Ordinary, step), 39_000, &start);
        println!("{step:?}: {} iterations, length {}", found.iterations, found.length);
        assert_eq!(found.ending, Ending::Stalled, "{step:?}");
        assert!(found.length > 1.5 && found.length < 4.05, "{step:?}: {}", found.length);
    }
}

#[test]
fn section_4_ordinary_gradients_on_psi_take_tens_of_thousands_of_iterations() {
    let start = start();
    let mut crossed = None;
    let mut last = (0, f64::INFINITY);
    let descent = Minimisation {
        method: steepest(InnerProduct::Ordinary, Step::Constant(0.5)),
        max_iterations: 39_000,
        ..Minimisation::new(psi(200))
    };
    let found = descent
        .run(&start, |iterate| {
            assert!(iterate.iteration == 0 || iterate.iteration == last.0 + 1 && iterate.energy < last.1);
            last = (iterate.iteration, iterate.energy);
            if iterate.length < 1.001 && crossed.is_none() {
                crossed = Some(iterate.iteration);
            }
        })
        .unwrap();
    let crossed = crossed.unwrap();
    println!("ψ: below 1.001 after {crossed}, {} after {}", found.length, found.iterations);
    assert!((31_000..=32_200).contains(&crossed), "{crossed}");
    assert_eq!((found.ending, found.iterations, last.0), (Ending::Exhausted, 39_000, 39_000));
    assert_eq!(format!("{:.5}", found.length), "1.00016");
    // A longer step raises ψ in the end.
    let longer = run(psi(200), steepest(InnerProduct::Ordinary, Step::Constant(0.51)), 39_000, &start);
    println!("step 0.51: {:?} after {}, length {}", longer.ending, longer.iterations, longer.length);
    assert_eq!(longer.ending, Ending::Stalled);
    assert!(longer.length > 1.5);
}

#[test]
fn newton_converges_quadratically_on_energies_of_every_order() {
    fn check<const D: usize>() {
        let m = 24;
        let arch: Vec<[f64; D]> = (0..=m)
            .map(|k| k as f64 / m as f64)
            .map(|x| std::array::from_fn(|c| if c == 0 { x } else { 0.05 * c as f64 * (4.0 * x * (1.0 - x)) }))
            .collect();
        let straight: Vec<[f64; D]> =
            (0..=m).map(|k| std::array::from_fn(|c| if c == 0 { k as f64 / m as f64 } else { 0.0 })).collect();
        for energy in [tension() + 0.01 * bending(2.0), tension() + 1e-3 * bending(2.0) + 1e-5 * variation()] {
            let mut away = Vec::new();
            let newton = Minimisation { method: Minimiser::Newton, ..Minimisation::new(energy.clone()) };
            let found = newton.run(&arch, |iterate| away.push(worst(iterate.vertices, &straight))).unwrap();
            println!("{D}-D, {energy}: {away:?}");
            assert_eq!(found.ending, Ending::Converged, "{D}-D, {energy}: {away:?}");
            assert!(found.iterations >= 2 && found.iterations <= 8, "{D}-D, {energy}: {away:?}");
            assert!(away[away.len() - 1] < 1e-10);
        }
    }
    check::<2>();
    check::<3>();
}
