//! Tests of segments and curves under tension on the GPU against the CPU in f64.

use super::*;
use crate::scf::evaluation::Evaluation;
use crate::scf::gpu::bounds::UNDER_TENSION;
use crate::scf::gpu::search::{Answer, AnswerParams, FLAG_ASKED, search_on_gpu};
use crate::scf::problem::Stages;
use crate::scf::slopes::Search;
use crate::scf::tension::{Near, TensionLaw, TensionSpan};

const ENDS: [Ends; 3] = [Ends::Directed, Ends::FreeStart, Ends::FreeEnd];

/// ν of every law.
const LAWS: [f64; 6] = [1.3, 1.5, 2.0, 3.0, 8.0, 20.0];

type Followed = (u16, TensionSpan, [f64; 2], Near);

/// Random spans with known shapes at some angles, to be followed to angles up to `far` away.
fn spans(laws: &[TensionLaw], count: usize, far: f64, seed: u64) -> Vec<Followed> {
    println!("seed {seed}");
    let mut random = StdRng::seed_from_u64(seed);
    let mut all = Vec::new();
    while all.len() < count {
        let law = random.random_range(0..laws.len());
        let ends = ENDS[random.random_range(0..4usize).saturating_sub(1)];
        let tension = 10f64.powf(random.random_range(-2.0..3.0));
        let span = TensionSpan { chord: 1.0, tension, ends };
        let angles = [0; 2].map(|_| random.random_range(-2.5..2.5));
        let mut near = Near::default();
        if span.evaluate(&laws[law], angles, &mut near).exists > 0.0 {
            all.push((law as u16, span, angles.map(|angle| angle + random.random_range(-far..=far)), near));
        }
    }
    all
}

/// The evaluations of spans that the kernel follows to their angles; `None` if it asks the host.
fn followed_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    laws: &[TensionLaw],
    spans: &[Followed],
) -> Result<Vec<Option<Evaluation<f64>>>> {
    let mut recording = gpu.record(precision);
    let table: Vec<Segment> = spans
        .iter()
        .map(|(law, span, ..)| Segment { owner: 0, first: 0, last: 0, kind: kind(u32::from(*law), span.ends) })
        .collect();
    let units: Vec<[f64; 2]> = spans.iter().map(|(law, span, ..)| span.units(&laws[usize::from(*law)])).collect();
    let angles: Vec<f64> = spans.iter().zip(&units).flat_map(|((_, _, [a, b], _), [c, _])| [*a, *b, *c]).collect();
    let shape = |(law, span, _, known): &Followed| {
        let [kind, u, v] = known.packed(&laws[usize::from(*law)], span);
        [kind, u, v, 0.0]
    };
    let shapes: Vec<f64> = spans.iter().flat_map(shape).collect();
    let found = recording.storage_reals(FOUND * spans.len());
    let buffers = [
        ("params", &recording.uniform(&EvaluationParams { tasks: spans.len() as u32 })),
        ("tasks", &recording.upload(&(0..spans.len() as u32).collect::<Vec<u32>>())),
        ("exponents", &recording.upload_reals(&Family::UnderTension(laws).packed())),
        ("segments", &recording.upload(&table)),
        ("angles", &recording.upload_reals(&angles)),
        ("turns", &recording.upload_reals(&[0.0])),
        ("states", &recording.upload(&[SlopesState::zeroed()])),
        ("shapes", &recording.upload_reals(&shapes)),
        ("found", &found),
    ];
    let [evaluation_kernel, _] = search_kernels(Family::UnderTension(laws), precision);
    recording.dispatch(&evaluation_kernel, spans.len(), GROUP, &buffers)?;
    recording.download(&found);
    let results = recording.submit()?.wait()?;
    let all = results[0].reals();
    let known = all.as_chunks::<FOUND>().0.iter().map(evaluation).zip(&units);
    let on_chord_of_1 = |(found, [_, unit]): (Evaluation<f64>, &[f64; 2])| Evaluation {
        cost: found.cost * unit,
        gradient: found.gradient.map(|x| x * unit),
        hessian: found.hessian.map(|x| x * unit),
        exists: found.exists,
    };
    Ok(known.map(on_chord_of_1).map(|found| (found.exists > 0.0).then_some(found)).collect())
}

/// The largest difference, relative to the largest value.
fn relative(found: &[f64], wanted: &[f64]) -> f64 {
    let largest = wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let apart = largest_difference(found, wanted);
    if apart == 0.0 { 0.0 } else { apart / largest }
}

/// The rounding of costs, first and second derivatives, in ε. Newton's method stops when a chord is
/// closed to 256 ε of its arcs' lengths. Second derivatives are quotients of differences.
const ROUNDINGS_FOLLOWED: [f64; 3] = [1024.0, 1024.0, 4096.0];

#[test]
fn segments_are_followed_to_the_costs_and_derivatives_of_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let laws = LAWS.map(TensionLaw::new);
    for (far, seed) in [(0.0, 710), (1e-3, 711), (0.1, 712)] {
        let spans = spans(&laws, 1000, far, seed);
        for precision in precisions(&gpu) {
            let all = followed_on_gpu(&gpu, precision, &laws, &spans).unwrap();
            let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
            let (mut followed, mut on_cpu, mut worst) = (0, 0, [0.0f64; 3]);
            for ((law, span, angles, known), found) in spans.iter().zip(&all) {
                let law = &laws[usize::from(*law)];
                on_cpu += usize::from(span.is_followed(law, *angles, known));
                let Some(found) = found else { continue };
                followed += 1;
                let wanted = span.evaluate(law, *angles, &mut known.clone());
                let used = [
                    relative(&[found.cost], &[wanted.cost]),
                    relative(&found.gradient, &wanted.gradient),
                    relative(&found.hessian, &wanted.hessian),
                ];
                for k in 0..3 {
                    worst[k] = worst[k].max(used[k]);
                    let bound = ROUNDINGS_FOLLOWED[k] * epsilon;
                    assert!(
                        used[k] <= bound,
                        "ν = {}, {span:?} to {angles:?} in {precision:?}: {used:?}, {found:?} for {wanted:?}",
                        law.exponent()
                    );
                }
            }
            println!("by {far}, {precision:?}: {followed} followed, {on_cpu} by the CPU; {worst:?} apart");
            // The others are loops between two inflections.
            assert!(followed > 800 && followed + 10 > on_cpu, "by {far}, {precision:?}: {followed} for {on_cpu}");
        }
    }
}

/// Curves with λ = (2qτ)^ν on a chord of 1. Every second dot becomes movable in the second stage.
fn taut(problems: Vec<Given>, laws: &[TensionLaw]) -> Vec<SlopesSearch> {
    let one = |problem: Given| {
        let tension = |nu: f64| (2.0 * (1.0 - 1.0 / nu)).powf(nu);
        let law = |span: &Span| &laws[usize::from(span.curve)];
        let span = |span: &Span| TensionSpan { chord: 1.0, tension: tension(law(span).exponent()), ends: span.ends };
        let spans: Vec<TensionSpan> = problem.spans.iter().map(span).collect();
        let stages = Stages { of_dots: (0..problem.dots()).map(|dot| dot % 2).collect(), last: 1 };
        SlopesSearch { stages, ..SlopesSearch::under_tension(problem, spans, laws) }
    };
    problems.into_iter().map(one).collect()
}

/// The same search on the CPU.
fn taut_on_cpu(search: &SlopesSearch, laws: &[TensionLaw]) -> Outcome {
    let mut known = search.known.clone();
    let mut running = Search::new(search.problem.clone()).by_span(search.stages.clone());
    while running.standing == SlopesStanding::Running {
        running.receive(&search.evaluate(laws, &running.trial, &mut known), &UNTIL);
    }
    Outcome::from(running)
}

/// The outcomes of the kernel, and the number of segments for which it asked.
fn taut_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    laws: &[TensionLaw],
    searches: &[SlopesSearch],
    until: &Until,
) -> (Vec<Outcome>, usize) {
    let searches: Vec<&SlopesSearch> = searches.iter().collect();
    let (outcomes, answers) = search_on_gpu(gpu, precision, Family::UnderTension(laws), &searches, until).unwrap();
    let unfinished = searches.iter().map(|search| Outcome::unfinished(&search.problem));
    (outcomes.into_iter().zip(unfinished).map(|(outcome, unfinished)| outcome.unwrap_or(unfinished)).collect(), answers)
}

#[test]
fn curves_under_tension_are_let_loose_in_stages_and_end_as_on_the_cpu() {
    let Some(gpu) = gpu() else { return };
    let laws = EXPONENTS.map(TensionLaw::new);
    let searches = taut(ragged(713), &laws);
    let wanted: Vec<Outcome> = searches.iter().map(|search| taut_on_cpu(search, &laws)).collect();
    assert!(wanted.iter().filter(|own| own.standing == SlopesStanding::Converged && own.iterations > 2).count() > 15);
    for precision in precisions(&gpu) {
        let (found, answers) = taut_on_gpu(&gpu, precision, &laws, &searches, &UNTIL);
        let trials: usize =
            found.iter().zip(&searches).map(|(own, search)| own.evaluations as usize * search.spans.len()).sum();
        println!("{precision:?}: {answers} of {trials}");
        assert!(20 * answers < trials, "{answers} of {trials}");
        let mut left = 0;
        for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            if precision == Precision::F64 {
                assert_eq!(found.standing, wanted.standing, "curve {i}");
                assert!(found.iterations.abs_diff(wanted.iterations) <= 1, "curve {i}: {found:?} for {wanted:?}");
            }
            if found.standing != SlopesStanding::Converged {
                left += 1;
                continue;
            }
            // In f32 decrements end at 1e-4. The error of the cost is the square of that, plus its
            // own 1024 ε.
            let (turns, cost) = if precision == Precision::F64 { (1e-7, 1e-12) } else { (1e-2, 1.2e-4) };
            let apart = largest_difference(&found.turns, &wanted.turns);
            assert!(apart <= turns, "curve {i} in {precision:?}: turns {apart:e} apart");
            let apart = (found.cost / wanted.cost - 1.0).abs();
            assert!(apart <= cost, "curve {i} in {precision:?}: costs {apart:e} apart");
        }
        assert!(left <= 1, "{left} curves are left in {precision:?}");
    }
}

#[test]
fn a_curve_under_tension_has_the_same_bits_whatever_its_neighbours_order_and_chunk() {
    let Some(gpu) = gpu() else { return };
    let laws = EXPONENTS.map(TensionLaw::new);
    let all = |searches: Vec<Given>, gpu: &Gpu, precision: Precision| {
        taut_on_gpu(gpu, precision, &laws, &taut(searches, &laws), &UNTIL).0
    };
    let searches = ragged(714);
    let limits = Limits { chunk_bytes: 30_000, ..*gpu.limits() };
    let divided = gpu.with_limits(limits);
    let Some(gpu) = crate::gpu::testing::gpu() else { return };
    for precision in precisions(&gpu) {
        let together = all(searches.clone(), &gpu, precision);
        let mut other = all(searches.iter().rev().cloned().collect(), &divided, precision);
        other.reverse();
        assert_eq!(together, other, "{precision:?}");
        assert_eq!(together[5], all(searches[5..6].to_vec(), &gpu, precision)[0], "{precision:?}");
    }
}

#[test]
fn what_a_thread_or_f32_cannot_hold_under_tension_is_searched_by_the_cpu() {
    let mut random = StdRng::seed_from_u64(715);
    let laws = EXPONENTS.map(TensionLaw::new);
    let short = given(&points(20, false, 0.2, &mut random), false, 1, &[]);
    let long = given(&points(UNDER_TENSION.dots + 1, false, 0.05, &mut random), false, 1, &[]);
    let uneven = given(&[[0.0, 0.0], [1.0, 0.1], [1e5, 3e4], [1e5, 29_999.0]], false, 3, &[]);
    for (given, narrow, wide) in [(short, true, true), (long, false, false), (uneven, false, true)] {
        let search = taut(vec![given], &laws).remove(0);
        let family = Family::UnderTension(&laws);
        let is = [Precision::F32, Precision::F64].map(|precision| is_for_kernel(family, &search, precision));
        assert_eq!(is, [narrow, wide], "{} dots", search.problem.dots());
    }
}

#[test]
fn iterations_under_tension_run_out_where_they_are_told_to() {
    let Some(gpu) = gpu() else { return };
    let mut random = StdRng::seed_from_u64(716);
    let laws = EXPONENTS.map(TensionLaw::new);
    let searches = taut(vec![given(&points(12, false, 0.3, &mut random), false, 3, &[])], &laws);
    let until = Until { tolerance: 1e-10, iterations: 2 };
    for precision in precisions(&gpu) {
        let (found, _) = taut_on_gpu(&gpu, precision, &laws, &searches, &until);
        assert_eq!((found[0].standing, found[0].iterations), (SlopesStanding::Exhausted, 2), "{precision:?}");
    }
}

#[test]
fn host_structs_and_flags_of_tension_are_the_kernels() {
    for precision in [Precision::F32, Precision::F64] {
        assert_layout!(answer_kernel(precision), AnswerParams { tasks });
        assert_layout!(answer_kernel(precision), Answer { segment, owner, is_first });
    }
    assert_eq!(number("scf/slopes/standing.wgsl", "FLAG_ASKED"), FLAG_ASKED as usize);
    let law = TensionLaw::new(3.0).packed();
    assert_eq!(number("scf/tension/quadrature.wgsl", "LAW_NUMBERS"), law.len());
    let rules = ["LAW_LEGENDRE", "LAW_INFLECTION", "LAW_FLAT"].map(|name| number("scf/tension/quadrature.wgsl", name));
    // ∫ x dx, ∫ x^{2/3} dx and ∫ x^{1/3} dx over (0, 1): x times the weight of each rule.
    for (at, weight) in rules.into_iter().zip([0.0, -1.0 / 3.0, -2.0 / 3.0f64]) {
        let nodes = law[at..][..32].as_chunks::<2>().0;
        let sum: f64 = nodes.iter().map(|[x, w]| w * x.powf(weight + 1.0)).sum();
        assert!((sum - 1.0 / (weight + 2.0)).abs() < 1e-13, "{weight}: {sum}");
    }
}
