//! Tests of searches on the GPU against the CPU in f64, and of the kernels' constants against the
//! CPU's.

mod taut;

use std::f64::consts::TAU;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::bounds::{PLAIN, is_for_kernel};
use super::search::{SlopesCurve, SlopesParams};
use super::*;
use crate::gpu::reflect::assert_layout;
use crate::gpu::source;
use crate::gpu::testing::{gpu, precisions};
use crate::scf::family::SlopesSearch;
use crate::scf::problem::{Outcome, SlopesProblem, SlopesStanding, Span, Until};
use crate::scf::stages::search_plain_on_gpu;
use crate::scf::start::{Chords, Start, wrap};
use crate::scf::workspace::Workspace;

const EXPONENTS: [f64; 5] = [1.5, 2.0, 4.0, 20.0, 2.7];

/// f64 reaches this for ν = 20 too.
const UNTIL: Until = Until { tolerance: 1e-8, iterations: 100 };

fn curves() -> Vec<Universal> {
    EXPONENTS.map(Universal::new).to_vec()
}

type Given = SlopesProblem;

/// The problem of a curve with exponent `number` and fixed directions by dot. A segment between two
/// free ends is straight.
fn given(points: &[[f64; 2]], closed: bool, number: u16, fixed: &[(usize, f64)]) -> Given {
    let chords = Chords::of(points, closed);
    let (spans, dots) = (chords.lengths.len(), points.len());
    let directions: Vec<f64> = (0..dots)
        .map(|dot| match fixed.iter().find(|(own, _)| *own == dot) {
            Some((_, direction)) => *direction,
            None if !closed && (dot == 0 || dot == spans) => f64::NAN,
            None => chords.start(Start::Circle, (dot + spans - 1) % spans, dot % spans),
        })
        .collect();
    let exponent = EXPONENTS[usize::from(number)];
    let shortest = chords.lengths.iter().copied().fold(f64::INFINITY, f64::min);
    let span = |k: usize| {
        let [a, b] = [directions[k], directions[(k + 1) % dots]];
        let angle = |x: f64| if x.is_nan() { 0.0 } else { wrap(x - chords.directions[k]) };
        let weight = (chords.lengths[k] / shortest).powf(1.0 - exponent);
        Span { angles: [angle(a), angle(b)], weight, curve: number, ends: Ends::between(a, b) }
    };
    let is_fixed = |dot: usize| directions[dot].is_nan() || fixed.iter().any(|(own, _)| *own == dot);
    let movable = (0..dots).map(|dot| if is_fixed(dot) { 0.0 } else { 1.0 }).collect();
    SlopesProblem { closed, exponent, spans: (0..spans).map(span).collect(), movable }
}

/// Points along a line or around a circle, with noise.
fn points(dots: usize, closed: bool, noise: f64, random: &mut StdRng) -> Vec<[f64; 2]> {
    let mut move_by = |x: f64| x + random.random_range(-noise..noise);
    let at = |k: usize| {
        let angle = TAU * k as f64 / dots as f64;
        let radius = dots as f64 / TAU;
        if closed { [radius * angle.cos(), radius * angle.sin()] } else { [k as f64, 0.3 * (0.7 * k as f64).sin()] }
    };
    (0..dots).map(|k| at(k).map(&mut move_by)).collect()
}

/// Curves of 2 to 60 dots, open and closed, with free and fixed ends, of every exponent. Some have
/// no minimum, or no segment to start with.
fn ragged(seed: u64) -> Vec<Given> {
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    let mut all = Vec::new();
    for (i, dots) in [2, 3, 4, 5, 7, 8, 12, 17, 31, 60].into_iter().enumerate() {
        for closed in [false, true] {
            let number = ((2 * i + usize::from(closed)) % EXPONENTS.len()) as u16;
            let open = points(dots, closed && dots > 2, 0.2, &mut random);
            let turn = random.random_range(-0.6..0.6);
            let fixed: &[(usize, f64)] = match i % 3 {
                0 => &[],
                1 if closed => &[(1, turn + 1.5)],
                1 => &[(0, turn)],
                _ if closed => &[],
                _ => &[(0, turn), (dots - 1, -turn)],
            };
            all.push(given(&open, closed && dots > 2, number, fixed));
        }
    }
    // On a line: nothing bends.
    let line: Vec<[f64; 2]> = (0..6).map(|k| [k as f64, 0.5 * k as f64]).collect();
    all.push(given(&line, false, 1, &[]));
    // A scalene triangle, whose curve grows without end for ν = 1.5.
    all.push(given(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.5]], true, 0, &[]));
    // Ends that point back: no segment to start with.
    all.push(given(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.1]], false, 1, &[(0, 3.0), (1, -3.0)]));
    all
}

fn on_cpu(problems: &[Given], until: &Until) -> Vec<Outcome> {
    Workspace::new(EXPONENTS.len()).search(&curves(), problems.to_vec(), until)
}

fn on_gpu(gpu: &Gpu, precision: Precision, problems: &[Given]) -> Vec<Outcome> {
    search_plain_on_gpu(gpu, precision, &curves(), problems.to_vec(), &UNTIL).unwrap()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |worst, x| if x <= worst { worst } else { x })
}

#[test]
fn every_curve_of_a_ragged_batch_ends_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let searches = ragged(700);
    let wanted = on_cpu(&searches, &UNTIL);
    let count = |standing: SlopesStanding| wanted.iter().filter(|wanted| wanted.standing == standing).count();
    assert!(
        count(SlopesStanding::Converged) >= 15
            && count(SlopesStanding::Nowhere) >= 1
            && count(SlopesStanding::Unattained) >= 1
    );
    for precision in precisions(&gpu) {
        // The CPU with the tolerance of the GPU.
        let tolerance =
            if precision == Precision::F64 { UNTIL.tolerance } else { PLAIN.roundings * f64::from(f32::EPSILON) };
        let wanted = on_cpu(&searches, &Until { tolerance, ..UNTIL });
        let found = on_gpu(&gpu, precision, &searches);
        for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            let exponent = searches[i].exponent;
            assert_eq!(found.standing, wanted.standing, "curve {i} in {precision:?}");
            let apart = largest_difference(&found.turns, &wanted.turns);
            println!("curve {i}, {precision:?}, ν = {exponent}: {:?}, turns {apart:e} apart", found.standing);
            if wanted.standing != SlopesStanding::Converged {
                assert_eq!(found.culprit.is_some(), wanted.culprit.is_some(), "curve {i} in {precision:?}");
                continue;
            }
            // In f32 the error of a cost is about 200 ν ε, and turns have the error that a
            // decrement of 32 ε allows. The last step towards a segment's root is 3e-5 of it or
            // less. It leaves a tenth of that for almost circular segments, whose slope is
            // inaccurate.
            let (turns, cost) = match precision {
                Precision::F64 => (1e-9, 1e-12),
                _ => (1e-4, 200.0 * exponent * f64::from(f32::EPSILON)),
            };
            assert!(apart <= turns, "curve {i} in {precision:?}: turns {apart:e} apart");
            assert!((found.cost - wanted.cost).abs() <= cost * wanted.cost, "curve {i} in {precision:?}");
        }
    }
}

#[test]
fn a_curve_has_the_same_bits_whatever_its_neighbours_order_and_chunk() {
    let Some(gpu) = gpu() else { return };
    let searches = ragged(701);
    let reversed: Vec<Given> = searches.iter().rev().cloned().collect();
    let limits = Limits { chunk_bytes: 12_000, ..*gpu.limits() };
    for precision in precisions(&gpu) {
        let together = on_gpu(&gpu, precision, &searches);
        let mut other = on_gpu(&gpu, precision, &reversed);
        other.reverse();
        assert_eq!(together, other, "{precision:?}");
        let alone = on_gpu(&gpu, precision, &searches[5..6]);
        assert_eq!(together[5], alone[0], "{precision:?}");
    }
    let precision = precisions(&gpu).pop().unwrap();
    let together = on_gpu(&gpu, precision, &searches);
    let divided = on_gpu(&gpu.with_limits(limits), precision, &searches);
    assert_eq!(together, divided);
}

#[test]
fn what_a_thread_or_f32_cannot_hold_is_searched_by_the_cpu() {
    let mut random = StdRng::seed_from_u64(702);
    let short = given(&points(20, false, 0.2, &mut random), false, 1, &[]);
    let long = given(&points(PLAIN.dots + 1, false, 0.05, &mut random), false, 1, &[]);
    // Chords of 1 and 1,000: weights of 1000^−19 for ν = 20.
    let uneven = given(&[[0.0, 0.0], [1.0, 0.1], [1000.0, 300.0], [1001.0, 299.0]], false, 3, &[]);
    // Angles of about 1e-3 to the power 20.
    let gentle: Vec<[f64; 2]> = (0..9).map(|k| [k as f64, 1e-3 * (k as f64).sin()]).collect();
    let gentle = given(&gentle, false, 3, &[]);
    let (f32, f64) = (Precision::F32, Precision::F64);
    for (given, precision, expected) in [
        (&short, f32, true),
        (&short, f64, true),
        (&long, f32, false),
        (&long, f64, false),
        (&uneven, f32, false),
        (&uneven, f64, true),
        (&gentle, f32, false),
        (&gentle, f64, true),
    ] {
        let is = is_for_kernel(Family::Plain(&curves()), &SlopesSearch::plain(given.clone()), precision);
        assert_eq!(is, expected, "{} dots, {precision:?}", given.dots());
    }
    let Some(gpu) = gpu() else { return };
    let searches = [gentle, uneven, short];
    let (found, wanted) = (on_gpu(&gpu, f32, &searches), on_cpu(&searches, &UNTIL));
    assert_eq!(found[..2], wanted[..2]);
    assert!(found[2] != wanted[2] && found[2].standing == SlopesStanding::Converged, "{:?}", found[2]);
}

#[test]
fn iterations_run_out_where_they_are_told_to() {
    let Some(gpu) = gpu() else { return };
    let mut random = StdRng::seed_from_u64(703);
    let searches = [given(&points(12, false, 0.3, &mut random), false, 2, &[])];
    let until = Until { tolerance: 1e-10, iterations: 2 };
    for precision in precisions(&gpu) {
        let found = search_plain_on_gpu(&gpu, precision, &curves(), searches.to_vec(), &until).unwrap();
        assert_eq!((found[0].standing, found[0].iterations), (SlopesStanding::Exhausted, 2), "{precision:?}");
    }
}

#[test]
fn host_structs_are_laid_out_as_the_kernels() {
    for precision in [Precision::F32, Precision::F64] {
        for family in [Family::Plain(&[]), Family::UnderTension(&[])] {
            let [evaluation, advance] = search_kernels(family, precision);
            assert_layout!(evaluation.clone(), EvaluationParams { tasks });
            assert_layout!(evaluation, Segment { owner, first, last, kind });
            assert_layout!(advance.clone(), SlopesParams { tasks, dots, most_iterations });
            assert_layout!(advance.clone(), SlopesCurve { start, dots, closed, stages });
            assert_layout!(advance, SlopesState { standing, iterations, evaluations, flags, culprit });
        }
    }
}

fn kernel(path: &str) -> &'static str {
    source::file(path).expect("a file of the room")
}

/// A constant of a kernel file.
fn number(path: &str, name: &str) -> usize {
    let (_, after) = kernel(path).split_once(&format!("const {name}: u32 = ")).expect("it is there");
    after.split_once("u;").expect("a number").0.parse().expect("a number")
}

#[test]
fn the_kernels_polynomials_and_blocks_are_the_cpus() {
    use crate::scf::trig::{ARCTANGENT, COSINE, SINE};
    let trig = kernel("scf/trig.wgsl");
    for (function, own) in
        [("sine_series", &SINE[..]), ("cosine_series", &COSINE[..]), ("arctangent_series", &ARCTANGENT[..])]
    {
        let body = trig.split_once(&format!("fn {function}(")).expect("it is there").1.split_once("\n}").unwrap().0;
        let there: Vec<f64> = body.split("real(").filter_map(|part| part.split_once(')')?.0.parse().ok()).collect();
        assert_eq!(there, own.iter().rev().copied().collect::<Vec<f64>>(), "{function}");
    }
    let curve = Universal::new(3.0);
    let block = curve.packed();
    let place = |name: &str| number("scf/universal.wgsl", name);
    assert_eq!(place("UNIVERSAL_NUMBERS"), block.len());
    for (name, own) in [
        ("UNIVERSAL_EXPONENT", curve.exponent),
        ("UNIVERSAL_Q", curve.q),
        ("UNIVERSAL_INVERSE_Q", 1.0 / curve.q),
        ("UNIVERSAL_HALF", curve.half),
        ("UNIVERSAL_MOMENT", curve.moment[0]),
        ("UNIVERSAL_ALONG", curve.along[0]),
        ("UNIVERSAL_DIFFERENCES", curve.differences[0]),
    ] {
        assert_eq!(block[place(name)], own, "{name}");
    }
}
