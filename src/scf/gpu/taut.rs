//! Newton's method on the slopes of curves under tension, on a GPU.
//!
//! A span is followed from trial to trial by the kernel. Where that fails, since its shape turns into one of
//! another kind or is none that the kernel knows, the kernel asks: the curve waits, and after the round the host
//! finds the span by nested roots, in f64, and the search goes on.

use std::sync::atomic::{AtomicUsize, Ordering};

use bytemuck::{Pod, Zeroable};

use super::search::{MOST_NARROW, Results, SlopesCurve, given, record_trials};
use super::{FOUND, GROUP, Segment, SlopesState, kernel_key, kind, limits};
use crate::error::Result;
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, Downloaded, Gpu, Interrupted, KernelKey, Recording, Rounds, kept, pipeline, plan};
use crate::parallel;
use crate::precision::Precision;
use crate::scf::evaluation::Evaluation;
use crate::scf::slopes::{Outcome, SlopesProblem, SlopesStanding, Until};
use crate::scf::tension::{Near, TensionLaw, TensionSpan};

/// Dots of a curve in the kernel at most: a tick takes twelve loop turns a dot, and llvmpipe ends a thread's
/// loops, without a word, after 65,535 all told. Longer curves are searched by the CPU.
pub(in crate::scf) const MOST_DOTS: usize = 4096;

/// Trials of every curve in a submission at most. A curve that asks waits for its end.
const MOST_TRIALS: usize = 4;

/// Segments evaluated in a submission at most, however many trials that are.
const MOST_EVALUATIONS: usize = 1 << 18;

/// The relative decrement that rounding in f32 lets most curves reach, in units of ε. The host ends the search
/// in f64.
const ROUNDINGS: f64 = 1024.0;

/// The shortest and the longest chord, in the unit in which λ is 1, that f32 is trusted with.
const NARROW_CHORDS: [f64; 2] = [1e-2, 1e4];

/// The smallest weight that f32 is trusted with. Spans are judged one by one, and dots let loose from the dearest
/// spans on: what is cheap beside them needs a normal number, no digits.
const LEAST_WEIGHT: f64 = 1e-30;

/// Numbers of a dot in `work`.
const WORK_TAUT_NUMBERS: usize = 11;

/// Numbers of a segment in `shapes`, and of an answer.
const SHAPE_NUMBERS: usize = 4;
const ANSWER_NUMBERS: usize = SHAPE_NUMBERS - 1 + FOUND;

/// `FLAG_ASKED` of `slopes/standing.wgsl`.
pub(super) const FLAG_ASKED: u32 = 16;

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

pub(super) fn tension_kernel(precision: Precision) -> KernelKey {
    kernel_key("scf/tension/evaluate.wgsl", "evaluate", precision)
}

pub(super) fn answer_kernel(precision: Precision) -> KernelKey {
    kernel_key("scf/tension/answer.wgsl", "answer", precision)
}

pub(super) fn taut_kernel(precision: Precision) -> KernelKey {
    let definitions = definitions([("GROUP", &GROUP), ("TENSION", &1)]);
    KernelKey { path: "scf/slopes.wgsl", entry: "advance", precision, definitions }
}

/// A curve to be searched: turns are 0 at the start.
pub(in crate::scf) struct TautSearch {
    pub problem: SlopesProblem<f64>,
    pub spans: Vec<TensionSpan>,
    /// What the spans are at the start.
    pub known: Vec<Near>,
    pub found: Vec<Evaluation<f64>>,
    /// The stage in which each dot is let loose, and how many there are.
    pub stages: Vec<usize>,
    pub count: usize,
}

impl TautSearch {
    /// The unit of costs in the kernel.
    fn unit(&self, laws: &[TensionLaw]) -> f64 {
        self.weights(laws).fold(0.0, f64::max)
    }

    /// The weights of costs in the unit in which λ is 1.
    fn weights(&self, laws: &[TensionLaw]) -> impl Iterator<Item = f64> {
        let spans = self.problem.spans.iter().zip(&self.spans);
        spans.map(|(span, taut)| span.weight * taut.units(&laws[usize::from(span.curve)])[1])
    }

    /// Whether a thread has the patience, and the precision the range, for it.
    pub fn is_for_kernel(&self, laws: &[TensionLaw], precision: Precision) -> bool {
        let fits = (2..=MOST_DOTS).contains(&self.problem.movable.len());
        let exists = self.found.iter().all(|found| found.exists > 0.0);
        let (unit, [least, most]) = (self.unit(laws), NARROW_CHORDS);
        let is_narrow = || {
            let mut spans = self.problem.spans.iter().zip(&self.spans);
            let is_of = |law: &TensionLaw, taut: &TensionSpan| {
                law.exponent() <= MOST_NARROW && (least..=most).contains(&taut.units(law)[0])
            };
            spans.all(|(span, taut)| is_of(&laws[usize::from(span.curve)], taut))
                && self.weights(laws).all(|weight| weight >= LEAST_WEIGHT * unit)
        };
        fits && exists && unit.is_normal() && (precision == Precision::F64 || is_narrow())
    }

    /// A span at its angles, turned: its shape, and what is found, as an answer.
    fn at(&self, laws: &[TensionLaw], k: usize, turns: &[f64]) -> [f64; ANSWER_NUMBERS] {
        let (span, taut) = (&self.problem.spans[k], &self.spans[k]);
        let law = &laws[usize::from(span.curve)];
        let [a, b] = span.angles;
        let mut known = Near::default();
        let found = taut.evaluate(law, [a + turns[k], b + turns[self.problem.after(k)]], &mut known);
        let [kind, u, v] = known.packed(law, taut);
        let [cost, by_a, by_b, aa, ab, bb, exists] = packed(&found, taut.units(law)[1]);
        [kind, u, v, cost, by_a, by_b, aa, ab, bb, exists]
    }
}

/// What the host was asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::scf) struct Asked {
    /// Trials of spans, and those of them that the kernel asked for.
    pub evaluations: usize,
    pub answers: usize,
}

/// Searches for the slopes of every curve. Turns are displacements, so that f32 keeps their digits.
///
/// Where the device is lost, what it had finished is kept, and the other curves come out as they came in.
///
/// # Errors
/// Those of compiling the kernels and of submissions, if nothing was finished.
pub(in crate::scf) fn search_taut_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    laws: &[TensionLaw],
    searches: &[TautSearch],
    until: &Until,
) -> Result<(Vec<Outcome>, Asked)> {
    let unfinished = |search: &TautSearch| Outcome {
        turns: vec![0.0; search.problem.movable.len()],
        cost: f64::INFINITY,
        decrement: f64::INFINITY,
        standing: SlopesStanding::Running,
        iterations: 0,
        evaluations: 0,
        culprit: None,
    };
    let mut outcomes: Vec<Outcome> = searches.iter().map(unfinished).collect();
    let mut order: Vec<usize> = (0..searches.len()).collect();
    order.sort_by_key(|&i| (searches[i].problem.movable.len(), i));
    let answers = AtomicUsize::new(0);
    if !order.is_empty() {
        let job = Job { gpu, precision, laws, searches, until, order: &order, answers: &answers };
        kept(job.run(&mut outcomes))?;
    }
    let evaluations = searches.iter().zip(&outcomes).map(|(search, own)| search.spans.len() * own.evaluations as usize);
    let asked = Asked { evaluations: evaluations.sum(), answers: answers.into_inner() };
    if !searches.is_empty() {
        let Asked { evaluations, answers } = asked;
        gpu.note(format!("{evaluations} trials of spans under tension, {answers} of them found by the host"));
    }
    Ok((outcomes, asked))
}

/// One run over many curves.
struct Job<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    laws: &'a [TensionLaw],
    searches: &'a [TautSearch],
    until: &'a Until,
    order: &'a [usize],
    answers: &'a AtomicUsize,
}

/// The curves of a chunk, and where they stand in its arrays.
type Table = (Vec<usize>, Vec<SlopesCurve>);

/// The arrays of a chunk that come back: at the end, and after every round beside the states.
const WANTED: [&str; 3] = ["states", "numbers", "turns"];
const LOOKED_AT: [&str; 2] = ["found", "turns"];

impl<'a> Job<'a> {
    fn run(&self, outcomes: &mut [Outcome]) -> Result<(), Interrupted> {
        let real = self.precision.bytes();
        // Of a dot and its segment: work, what was found (and comes back), turns (to be read twice), angles and
        // tension, weight, stage and whether it moves, shape; segment, task.
        let together = (WORK_TAUT_NUMBERS + 2 * FOUND + 6 + 3 + 3 + SHAPE_NUMBERS) as u64 * real + 20;
        let dots = self.order.iter().map(|&i| self.searches[i].problem.movable.len());
        let chunks = plan::chunks(dots, WORK_TAUT_NUMBERS as u64 * real, together, &limits(self.gpu, together))?;
        pipeline(
            chunks,
            |chunk| self.start(&self.order[chunk.clone()]),
            |rounds: Rounds<Table>| rounds.answer(|r, t, a, s, seen| self.answer(r, t, a, s, seen), &WANTED, |_| {}),
            |_, ((members, table), results)| {
                let count: usize = table.iter().map(|curve| curve.dots as usize).sum();
                let results = Results::of(&results);
                for (slot, (&i, curve)) in members.iter().zip(&table).enumerate() {
                    let own = results.outcome(slot, curve, count);
                    outcomes[i] = Outcome { cost: own.cost * self.searches[i].unit(self.laws), ..own };
                }
                Ok(())
            },
        )
    }

    fn start(&self, members: &[usize]) -> Result<Rounds<'a, Table>> {
        let mut recording = self.gpu.record(self.precision);
        let searches = || members.iter().map(|&i| &self.searches[i]);
        let mut dots = 0;
        let table: Vec<SlopesCurve> = searches()
            .map(|search| {
                let (start, own) = (dots, search.problem.movable.len() as u32);
                dots += own;
                SlopesCurve { start, dots: own, closed: search.problem.closed.into(), stages: search.count as u32 }
            })
            .collect();
        let count = dots as usize;
        // An open curve has no segment where a closed one has its last.
        let mut segments = vec![Segment { owner: 0, first: 0, last: 0, kind: 0 }; count];
        let [mut angles, mut fixed] = [0, 1].map(|_| vec![0.0; 3 * count]);
        let mut shapes = vec![0.0; SHAPE_NUMBERS * count];
        let mut found = vec![0.0; FOUND * count];
        let mut numbers = Vec::new();
        for (slot, (search, curve)) in searches().zip(&table).enumerate() {
            let (problem, start, unit) = (&search.problem, curve.start as usize, search.unit(self.laws));
            for (k, (&movable, &stage)) in problem.movable.iter().zip(&search.stages).enumerate() {
                fixed[start + k] = movable;
                fixed[2 * count + start + k] = stage as f64;
            }
            for (k, (span, taut)) in problem.spans.iter().zip(&search.spans).enumerate() {
                let at = start + k;
                let [first, last] = [at, start + problem.after(k)].map(|at| at as u32);
                segments[at] = Segment { owner: slot as u32, first, last, kind: kind(span.curve.into(), taut.ends) };
                let law = &self.laws[usize::from(span.curve)];
                let [chord, cost] = taut.units(law);
                angles[3 * at..][..3].copy_from_slice(&[span.angles[0], span.angles[1], chord]);
                fixed[count + at] = span.weight * cost / unit;
                let [kind, u, v] = search.known[k].packed(law, taut);
                shapes[SHAPE_NUMBERS * at..][..SHAPE_NUMBERS].copy_from_slice(&[kind, u, v, 1.0]);
                found[FOUND * at..][..FOUND].copy_from_slice(&packed(&search.found[k], cost));
            }
            numbers.extend(given(self.precision, self.until, problem.exponent, ROUNDINGS));
        }
        let laws: Vec<f64> = self.laws.iter().flat_map(TensionLaw::packed).collect();
        let arrays = vec![
            ("laws", recording.upload_reals(&laws)),
            ("segments", recording.upload(&segments)),
            ("angles", recording.upload_reals(&angles)),
            ("turns", recording.upload_reals(&vec![0.0; 2 * count])),
            ("states", recording.upload(&vec![SlopesState::zeroed(); members.len()])),
            ("shapes", recording.upload_reals(&shapes)),
            ("found", recording.upload_reals(&found)),
            ("curves", recording.upload(&table)),
            ("numbers", recording.upload_reals(&numbers)),
            ("fixed", recording.upload_reals(&fixed)),
            ("work", recording.storage_reals(WORK_TAUT_NUMBERS * count)),
        ];
        let of_curves = ("scf/slopes", members.len());
        let chunk = ((members.to_vec(), table), arrays);
        Rounds::looking::<SlopesState>(of_curves, recording, chunk, &LOOKED_AT, |r, t, a, s| self.round(r, t, a, s))
    }

    /// Answers what the last round has asked, and records the next.
    fn answer(
        &self,
        recording: &mut Recording<'a>,
        table: &Table,
        arrays: &[(&str, &Buffer)],
        slots: &[u32],
        seen: &[Downloaded],
    ) -> Result<()> {
        let states = seen[0].as_slice::<SlopesState>();
        let (found, turns) = (seen[1].reals(), seen[2].reals());
        let mut asked = Vec::new();
        for &slot in slots.iter().filter(|&&slot| states[slot as usize].flags & FLAG_ASKED != 0) {
            let (curve, search) = (table.1[slot as usize], &self.searches[table.0[slot as usize]]);
            let start = curve.start as usize;
            let spans = (0..search.spans.len()).filter(|k| found[FOUND * (start + k) + FOUND - 1] < 0.0);
            asked.extend(spans.enumerate().map(|(number, k)| {
                let answer = Answer { segment: (start + k) as u32, owner: slot, is_first: u32::from(number == 0) };
                (answer, search, k, &turns[start..start + curve.dots as usize])
            }));
        }
        if !asked.is_empty() {
            let given = parallel::of(&asked, |&(_, search, k, turns)| search.at(self.laws, k, turns)).concat();
            let answers: Vec<Answer> = asked.iter().map(|(answer, ..)| *answer).collect();
            let params = recording.uniform(&AnswerParams { tasks: answers.len() as u32 });
            let own = [("answers", recording.upload(&answers)), ("given", recording.upload_reals(&given))];
            let mut bound = vec![("params", &params)];
            bound.extend(own.iter().map(|(name, array)| (*name, array)));
            bound.extend(arrays);
            recording.dispatch(&answer_kernel(self.precision), answers.len(), GROUP, &bound)?;
            self.answers.fetch_add(answers.len(), Ordering::Relaxed);
        }
        self.round(recording, table, arrays, slots)
    }

    /// Some trials of the curves listed, each an evaluation of their segments and a step.
    fn round(
        &self,
        recording: &mut Recording<'a>,
        (_, table): &Table,
        arrays: &[(&str, &Buffer)],
        slots: &[u32],
    ) -> Result<()> {
        let kernels = [tension_kernel(self.precision), taut_kernel(self.precision)];
        let most_iterations = self.until.iterations;
        record_trials(recording, kernels, (table, slots), arrays, most_iterations, [MOST_EVALUATIONS, MOST_TRIALS])
    }
}

/// What is found of a segment, in a unit of costs, as the kernels have it: see [`evaluation`](super::evaluation).
fn packed(found: &Evaluation<f64>, unit: f64) -> [f64; FOUND] {
    let Evaluation { cost, gradient: [a, b], hessian: [aa, ab, bb], exists } = *found;
    let [cost, a, b, aa, ab, bb] = [cost, a, b, aa, ab, bb].map(|x| x / unit);
    [cost, a, b, aa, ab, bb, exists]
}
