//! Newton's method on the tangent angles of many curves, on a GPU. Their state stays on the device,
//! and only standings are downloaded until no curve is running.
//!
//! The kernel follows each segment under tension from trial to trial. This fails if the segment's
//! shape becomes one of another kind, or one that the kernel does not know. The kernel then asks
//! the host: the curve waits until the end of the round, the host finds the segment by nested roots
//! in f64, and the search continues.

use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytemuck::{Pod, Zeroable};

use super::bounds::{bounds, is_for_kernel};
use super::{EvaluationParams, FOUND, GROUP, Segment, SlopesState, answer_kernel, kind, limits, search_kernels};
use crate::error::Result;
use crate::gpu::{Buffer, Downloaded, Gpu, Interrupted, Recording, Rounds, kept, pipeline, plan};
use crate::parallel;
use crate::precision::Precision;
use crate::scf::evaluation::Evaluation;
use crate::scf::family::{Family, SlopesSearch};
use crate::scf::problem::{Outcome, SlopesStanding, Until};
use crate::scf::slopes::{LONGEST, ROUGHLY};
use crate::scf::tension::{Near, TensionLaw};

/// `SlopesParams` of `slopes.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SlopesParams {
    pub tasks: u32,
    pub dots: u32,
    pub most_iterations: u32,
}

/// `SlopesCurve` of `slopes.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct SlopesCurve {
    pub start: u32,
    pub dots: u32,
    pub closed: u32,
    pub stages: u32,
}

/// `AnswerParams` of `tension/answer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct AnswerParams {
    pub tasks: u32,
}

/// `Answer` of `tension/answer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Answer {
    pub segment: u32,
    pub owner: u32,
    pub is_first: u32,
}

/// `FLAG_ASKED` of `slopes/standing.wgsl`.
pub(super) const FLAG_ASKED: u32 = 16;

/// The numbers per curve, and those that are read back.
const SLOPES_NUMBERS: usize = 13;
const SLOPES_COST: usize = 4;
const SLOPES_DECREMENT: usize = 5;

/// The numbers per segment in `shapes`.
const SHAPE_NUMBERS: usize = 4;

/// The standings by the kernel's codes, from 1.
const STANDINGS: [SlopesStanding; 6] = [
    SlopesStanding::Running,
    SlopesStanding::Converged,
    SlopesStanding::Stalled,
    SlopesStanding::Unattained,
    SlopesStanding::Nowhere,
    SlopesStanding::Exhausted,
];

/// Searches for the tangent angles of every curve, and counts the segments for which the kernel
/// asked the host.
///
/// Unknowns are turns from reference directions, so that f32 keeps their digits. The outcome is
/// `None` for a curve with too many dots, or with costs beyond the range of f32. If the device is
/// lost, finished curves are kept, and the others are returned unfinished.
///
/// # Errors
/// Errors of compiling the kernels and of submissions, if no curve was finished.
pub(in crate::scf) fn search_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    family: Family<'_>,
    searches: &[&SlopesSearch],
    until: &Until,
) -> Result<(Vec<Option<Outcome>>, usize)> {
    let mut outcomes = vec![None; searches.len()];
    let mut order = Vec::new();
    for (i, is_for_kernel) in
        parallel::of(searches, |search| is_for_kernel(family, search, precision)).into_iter().enumerate()
    {
        if is_for_kernel {
            outcomes[i] = Some(Outcome::unfinished(&searches[i].problem));
            order.push(i);
        }
    }
    order.sort_by_key(|&i| (searches[i].problem.dots(), i));
    let answers = AtomicUsize::new(0);
    if !order.is_empty() {
        let job = SlopesJob { gpu, precision, family, searches, until, order: &order, answers: &answers };
        kept(job.run(&mut outcomes))?;
    }
    Ok((outcomes, answers.into_inner()))
}

/// One run over many curves.
struct SlopesJob<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    family: Family<'a>,
    searches: &'a [&'a SlopesSearch],
    until: &'a Until,
    order: &'a [usize],
    answers: &'a AtomicUsize,
}

/// The curves of a chunk.
struct Chunk {
    members: Vec<usize>,
    /// The positions of the curves in the chunk's arrays.
    table: Vec<SlopesCurve>,
}

impl Chunk {
    fn dots(&self) -> usize {
        self.table.iter().map(|curve| curve.dots as usize).sum()
    }
}

/// A segment for which the kernel asks the host.
struct Asked<'a> {
    answer: Answer,
    search: &'a SlopesSearch,
    span: usize,
    turns: &'a [f64],
}

impl Asked<'_> {
    /// The segment's shape and evaluation, by nested roots.
    fn found(&self, laws: &[TensionLaw]) -> Vec<f64> {
        let Asked { search, span, turns, .. } = *self;
        let law = &laws[usize::from(search.problem.spans[span].curve)];
        let mut known = Near::default();
        let found = search.spans[span].evaluate(law, search.problem.angles(span, turns), &mut known);
        let (shape, found) = packed(laws, search, span, &known, &found);
        shape.into_iter().chain(found).collect()
    }
}

/// The shape and the evaluation of a segment under tension, in the kernel's format.
fn packed(
    laws: &[TensionLaw],
    search: &SlopesSearch,
    k: usize,
    known: &Near,
    found: &Evaluation<f64>,
) -> ([f64; 3], [f64; FOUND]) {
    let (law, span) = (&laws[usize::from(search.problem.spans[k].curve)], &search.spans[k]);
    let unit = span.units(law)[1];
    let Evaluation { cost, gradient: [a, b], hessian: [aa, ab, bb], exists } = *found;
    let [cost, a, b, aa, ab, bb] = [cost, a, b, aa, ab, bb].map(|x| x / unit);
    (known.packed(law, span), [cost, a, b, aa, ab, bb, exists])
}

/// The arrays of a chunk that are downloaded at the end, and under tension after every round.
const WANTED: [&str; 3] = ["states", "numbers", "turns"];
const LOOKED_AT: [&str; 2] = ["found", "turns"];

impl<'a> SlopesJob<'a> {
    fn run(&self, outcomes: &mut [Option<Outcome>]) -> Result<(), Interrupted> {
        let real = self.precision.bytes();
        let work = bounds(self.family).work_numbers;
        // Per dot and segment: work, `found` and its download, turns and their download, angles and
        // chord, weight, stage and whether it moves, shape; segment, task.
        let together = (work + 2 * FOUND + 6 + 3 + 3 + SHAPE_NUMBERS) as u64 * real + 20;
        let dots = self.order.iter().map(|&i| self.searches[i].problem.dots());
        let chunks = plan::chunks(dots, work as u64 * real, together, &limits(self.gpu, together))?;
        pipeline(
            chunks,
            |chunk| self.start(&self.order[chunk.clone()]),
            |rounds: Rounds<Chunk>| rounds.answer(|r, c, a, s, seen| self.round(r, c, a, s, seen), &WANTED, |_| {}),
            |_, (chunk, results)| {
                self.unpack(&chunk, &results, outcomes);
                Ok(())
            },
        )
    }

    fn start(&self, members: &[usize]) -> Result<Rounds<'a, Chunk>> {
        let mut recording = self.gpu.record(self.precision);
        let chunk = Chunk { members: members.to_vec(), table: self.table(members) };
        let count = chunk.dots();
        let is_under_tension = matches!(self.family, Family::UnderTension(_));
        // An open curve has no segment in the place of a closed curve's last one.
        let mut segments = vec![Segment { owner: 0, first: 0, last: 0, kind: 0 }; count];
        let [mut angles, mut fixed] = [0, 1].map(|_| vec![0.0; 3 * count]);
        let [mut shapes, mut found] =
            [SHAPE_NUMBERS, FOUND].map(|n| vec![0.0; if is_under_tension { n * count } else { 0 }]);
        let mut numbers = Vec::with_capacity(SLOPES_NUMBERS * members.len());
        for (slot, (&i, curve)) in members.iter().zip(&chunk.table).enumerate() {
            let (search, start) = (self.searches[i], curve.start as usize);
            let (problem, unit) = (&search.problem, self.family.unit(search));
            fixed[start..start + problem.dots()].copy_from_slice(&problem.movable);
            for (k, &stage) in search.stages.of_dots.iter().enumerate() {
                fixed[2 * count + start + k] = stage as f64;
            }
            for (k, span) in problem.spans.iter().enumerate() {
                let at = start + k;
                let [first, last] = [at, start + problem.after(k)].map(|at| at as u32);
                segments[at] = Segment { owner: slot as u32, first, last, kind: kind(span.curve.into(), span.ends) };
                let [chord, cost] = self.family.units(search, k);
                angles[3 * at..][..3].copy_from_slice(&[span.angles[0], span.angles[1], chord]);
                fixed[count + at] = span.weight * cost / unit;
                if let Family::UnderTension(laws) = self.family {
                    let ([kind, u, v], evaluation) = packed(laws, search, k, &search.known[k], &search.found[k]);
                    shapes[SHAPE_NUMBERS * at..][..SHAPE_NUMBERS].copy_from_slice(&[kind, u, v, 1.0]);
                    found[FOUND * at..][..FOUND].copy_from_slice(&evaluation);
                }
            }
            numbers.extend(self.numbers(problem.exponent));
        }
        let mut arrays = vec![
            ("exponents", recording.upload_reals(&self.family.packed())),
            ("segments", recording.upload(&segments)),
            ("angles", recording.upload_reals(&angles)),
            ("turns", recording.upload_reals(&vec![0.0; 2 * count])),
            ("states", recording.upload(&vec![SlopesState::zeroed(); members.len()])),
            ("curves", recording.upload(&chunk.table)),
            ("numbers", recording.upload_reals(&numbers)),
            ("fixed", recording.upload_reals(&fixed)),
            ("work", recording.storage_reals(bounds(self.family).work_numbers * count)),
        ];
        let mut looked_at = &LOOKED_AT[..0];
        if is_under_tension {
            arrays.push(("shapes", recording.upload_reals(&shapes)));
            arrays.push(("found", recording.upload_reals(&found)));
            looked_at = &LOOKED_AT;
        } else {
            arrays.push(("found", recording.storage_reals(FOUND * count)));
        }
        let of_curves = ("scf/slopes", members.len());
        Rounds::looking::<SlopesState>(of_curves, recording, (chunk, arrays), looked_at, |r, c, a, s| {
            self.round(r, c, a, s, &[])
        })
    }

    fn table(&self, members: &[usize]) -> Vec<SlopesCurve> {
        let mut table = Vec::with_capacity(members.len());
        let mut start = 0;
        for &i in members {
            let SlopesSearch { problem, stages, .. } = self.searches[i];
            let dots = problem.dots() as u32;
            table.push(SlopesCurve { start, dots, closed: problem.closed.into(), stages: stages.last as u32 + 1 });
            start += dots;
        }
        table
    }

    /// The numbers of a curve at the start: see `slopes.wgsl`. NaN marks numbers that the kernel
    /// must write before it reads them.
    fn numbers(&self, exponent: f64) -> [f64; SLOPES_NUMBERS] {
        let epsilon = if self.precision == Precision::F64 { 0.0 } else { f64::from(f32::EPSILON) };
        let (share, part) = (1.0 / exponent, 1.0 - 1.0 / exponent);
        let least = (exponent - 1.0).max(1.0).powf(-LONGEST);
        let tolerance = self.until.tolerance.max(bounds(self.family).roundings * epsilon);
        let (infinity, unknown) = (f64::INFINITY, f64::NAN);
        let roughly = tolerance.max(ROUGHLY);
        [share, part, least, tolerance, infinity, infinity, unknown, unknown, unknown, unknown, 0.0, roughly, 0.0]
    }

    /// Answers the requests of the last round, and records trials of the listed curves. A trial is
    /// an evaluation of their segments and a step.
    fn round(
        &self,
        recording: &mut Recording<'a>,
        chunk: &Chunk,
        arrays: &[(&str, &Buffer)],
        slots: &[u32],
        seen: &[Downloaded],
    ) -> Result<()> {
        if let (Family::UnderTension(laws), [states, found, turns]) = (self.family, seen) {
            let (found, turns) = (found.reals(), turns.reals());
            let asked = self.asked(chunk, slots, states.as_slice(), [&found, &turns]);
            self.answer(recording, laws, arrays, &asked)?;
        }
        let bounds = bounds(self.family);
        let running = || slots.iter().map(|&slot| chunk.table[slot as usize]);
        let segments: Vec<u32> =
            running().flat_map(|curve| curve.start..curve.start + curve.dots - 1 + curve.closed).collect();
        let (dots, most_iterations) = (chunk.dots() as u32, self.until.iterations);
        let of_segments = recording.uniform(&EvaluationParams { tasks: segments.len() as u32 });
        let of_curves = recording.uniform(&SlopesParams { tasks: slots.len() as u32, dots, most_iterations });
        let trials = (bounds.evaluations / segments.len().max(1)).clamp(1, bounds.trials);
        let [evaluation, advance] = search_kernels(self.family, self.precision);
        let steps = [(evaluation, of_segments, &segments[..]), (advance, of_curves, slots)]
            .map(|(key, params, tasks)| (key, params, recording.upload(tasks), tasks.len()));
        for (key, params, tasks, count) in steps.iter().cycle().take(2 * trials) {
            let mut bound = vec![("params", params), ("tasks", tasks)];
            bound.extend(arrays);
            recording.dispatch(key, *count, GROUP, &bound)?;
        }
        Ok(())
    }

    /// The segments for which the kernel asks the host.
    fn asked<'b>(
        &'b self,
        chunk: &Chunk,
        slots: &[u32],
        states: &[SlopesState],
        [found, turns]: [&'b [f64]; 2],
    ) -> Vec<Asked<'b>> {
        let mut asked = Vec::new();
        for &owner in slots.iter().filter(|&&slot| states[slot as usize].flags & FLAG_ASKED != 0) {
            let (curve, search) = (&chunk.table[owner as usize], self.searches[chunk.members[owner as usize]]);
            let start = curve.start as usize;
            let turns = &turns[start..start + curve.dots as usize];
            let mut is_first = 1;
            for span in (0..search.problem.spans.len()).filter(|k| found[FOUND * (start + k) + FOUND - 1] < 0.0) {
                let answer = Answer { segment: (start + span) as u32, owner, is_first };
                asked.push(Asked { answer, search, span, turns });
                is_first = 0;
            }
        }
        asked
    }

    /// Finds the requested segments, and records their upload.
    fn answer(
        &self,
        recording: &mut Recording<'a>,
        laws: &[TensionLaw],
        arrays: &[(&str, &Buffer)],
        asked: &[Asked],
    ) -> Result<()> {
        if asked.is_empty() {
            return Ok(());
        }
        let answers: Vec<Answer> = asked.iter().map(|asked| asked.answer).collect();
        let given = parallel::of(asked, |asked| asked.found(laws)).concat();
        let params = recording.uniform(&AnswerParams { tasks: answers.len() as u32 });
        let (answers, given) = (recording.upload(&answers), recording.upload_reals(&given));
        let mut bound = vec![("params", &params), ("answers", &answers), ("given", &given)];
        bound.extend(arrays);
        self.answers.fetch_add(asked.len(), Ordering::Relaxed);
        recording.dispatch(&answer_kernel(self.precision), asked.len(), GROUP, &bound)
    }

    fn unpack(&self, chunk: &Chunk, results: &[Downloaded], outcomes: &mut [Option<Outcome>]) {
        let (states, numbers, turns): (&[SlopesState], Cow<[f64]>, Cow<[f64]>) =
            (results[0].as_slice(), results[1].reals(), results[2].reals());
        // The trials come first.
        let turns = &turns[chunk.dots()..];
        for (slot, (&i, curve)) in chunk.members.iter().zip(&chunk.table).enumerate() {
            let (state, start) = (&states[slot], curve.start as usize);
            let numbers = &numbers[slot * SLOPES_NUMBERS..];
            let standing = STANDINGS.get((state.standing as usize).wrapping_sub(1));
            outcomes[i] = Some(Outcome {
                turns: turns[start..start + curve.dots as usize].to_vec(),
                cost: numbers[SLOPES_COST] * self.family.unit(self.searches[i]),
                decrement: numbers[SLOPES_DECREMENT],
                standing: standing.copied().unwrap_or(SlopesStanding::Running),
                iterations: state.iterations,
                evaluations: state.evaluations,
                culprit: (state.culprit as usize).checked_sub(1),
            });
        }
    }
}
