//! Newton's method on the slopes of many curves, on a GPU: their state stays there, and only
//! standings come back until none runs.

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};

use super::{
    EvaluationParams, FOUND, GROUP, Segment, SlopesState, evaluation_kernel, kind, limits, slopes_kernel, universals,
};
use crate::error::Result;
use crate::gpu::{Buffer, Downloaded, Gpu, Interrupted, KernelKey, Recording, Rounds, kept, pipeline, plan};
use crate::precision::Precision;
use crate::scf::slopes::{Ends, LONGEST, Outcome, Search, SlopesProblem, SlopesStanding, Until};
use crate::scf::taut::ROUGHLY;
use crate::scf::universal::Universal;
use crate::scf::workspace::Workspace;

/// Dots of a curve in the kernel at most: a tick takes seven loop turns a dot, and llvmpipe ends a
/// thread's loops, without a word, after 65,535 all told. Longer curves are searched by the CPU.
pub(super) const MOST_DOTS: usize = 8192;

/// Trials of every curve in a submission at most: what most curves need.
const MOST_TRIALS: usize = 8;

/// Segments evaluated in a submission at most, however many trials that are.
const MOST_EVALUATIONS: usize = 1 << 21;

/// The relative decrement that rounding in f32 lets every curve reach, in units of ε. An angle is
/// rounded to half an ε of up to π, its moment to some ε more, and at an inflection, where both
/// ends' moments all but cancel, to several times that. At the last steps convergence is quadratic,
/// so little more would be gained.
pub(super) const ROUNDINGS: f64 = 32.0;

/// The smallest weight, and the smallest cost of the most expensive segment, that f32 is trusted
/// with: their parts that matter are normal numbers still.
const LEAST_NARROW: f64 = 1e-18;

/// The largest ν in f32: costs are below (2π)^ν.
pub(super) const MOST_NARROW: f64 = 32.0;

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
    /// Under tension its dots are let loose in so many stages.
    pub stages: u32,
}

/// Numbers of a curve, and those of them that come back.
const SLOPES_NUMBERS: usize = 13;
const SLOPES_COST: usize = 4;
const SLOPES_DECREMENT: usize = 5;

/// Numbers of a dot in `work`.
const WORK_NUMBERS: usize = 8;

/// How the kernel says that a curve stands.
const STANDINGS: [SlopesStanding; 6] = [
    SlopesStanding::Running,
    SlopesStanding::Converged,
    SlopesStanding::Stalled,
    SlopesStanding::Unattained,
    SlopesStanding::Nowhere,
    SlopesStanding::Exhausted,
];

/// Searches for the slopes of every curve, from the turns given. Turns are displacements, so that
/// f32 keeps their digits, and the tolerance in f32 is 32 ε at least.
///
/// Searched by the CPU in f64 are curves of more than 8,192 dots, and in f32 those of an exponent
/// beyond 32, of a weight below 1e-18, or that cost less than 1e-18 at the start; and again, from
/// the start, those that do not converge in f32.
///
/// Where the device is lost, what it had finished is kept, and the other curves come out as they
/// came in.
///
/// # Errors
/// Those of compiling the kernel and of submissions, if nothing was finished.
pub(crate) fn search_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    curves: &[Universal],
    searches: Vec<(SlopesProblem<f64>, Vec<f64>)>,
    until: &Until,
) -> Result<Vec<Outcome>> {
    let mut outcomes: Vec<Outcome> = searches.iter().map(unfinished).collect();
    let (mut order, mut host): (Vec<usize>, Vec<usize>) =
        (0..searches.len()).partition(|&i| is_for_kernel(&searches[i], curves, precision));
    order.sort_by_key(|&i| (searches[i].0.movable.len(), i));
    if !order.is_empty() {
        let job = Job { gpu, precision, curves, searches: &searches, until, order: &order };
        kept(job.run(&mut outcomes))?;
    }
    if precision != Precision::F64 {
        let done = [SlopesStanding::Converged, SlopesStanding::Running];
        host.extend(order.into_iter().filter(|&i| !done.contains(&outcomes[i].standing)));
    }
    let mut left: Vec<Search<f64>> =
        host.iter().map(|&i| Search::new(searches[i].0.clone(), searches[i].1.clone())).collect();
    Workspace::new(curves.len()).run(curves, &mut left, until);
    host.into_iter().zip(left).for_each(|(i, search)| outcomes[i] = Outcome::from(search));
    Ok(outcomes)
}

/// What a search is before anything was found.
fn unfinished((_, turns): &(SlopesProblem<f64>, Vec<f64>)) -> Outcome {
    Outcome {
        turns: turns.clone(),
        cost: f64::INFINITY,
        decrement: f64::INFINITY,
        standing: SlopesStanding::Running,
        iterations: 0,
        evaluations: 0,
        culprit: None,
    }
}

/// Whether a thread has the patience, and the precision the range, for a curve.
pub(super) fn is_for_kernel(
    (problem, turns): &(SlopesProblem<f64>, Vec<f64>),
    curves: &[Universal],
    precision: Precision,
) -> bool {
    let dots = problem.movable.len();
    if !(2..=MOST_DOTS).contains(&dots) {
        return false;
    }
    if precision == Precision::F64 {
        return true;
    }
    let (mut lightest, mut dearest, mut most, mut bent) = (1.0_f64, 0.0_f64, problem.exponent, false);
    for (k, span) in problem.spans.iter().enumerate().filter(|(_, span)| span.ends != Ends::Straight) {
        let after = if k + 1 == dots { 0 } else { k + 1 };
        let angle = (span.angles[0] + turns[k]).abs().max((span.angles[1] + turns[after]).abs());
        let exponent = curves[usize::from(span.curve)].exponent;
        lightest = lightest.min(span.weight);
        dearest = dearest.max(span.weight * angle.powf(exponent));
        most = most.max(exponent);
        bent |= angle > 0.0;
    }
    lightest >= LEAST_NARROW && most <= MOST_NARROW && (dearest >= LEAST_NARROW || !bent)
}

/// One run over many curves.
struct Job<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    curves: &'a [Universal],
    searches: &'a [(SlopesProblem<f64>, Vec<f64>)],
    until: &'a Until,
    order: &'a [usize],
}

/// Where the curves of a chunk stand in its arrays.
type Table = Vec<SlopesCurve>;

/// The arrays of a chunk that come back.
const WANTED: [&str; 3] = ["states", "numbers", "turns"];

impl<'a> Job<'a> {
    fn run(&self, outcomes: &mut [Outcome]) -> Result<(), Interrupted> {
        let real = self.precision.bytes();
        // Of a dot and its segment: work, what was found, turns (and to be read), angles, weight
        // and whether it moves; segment, task.
        let together = (WORK_NUMBERS + FOUND + 4 + 2 + 2) as u64 * real + 20;
        let dots = self.order.iter().map(|&i| self.searches[i].0.movable.len());
        let chunks = plan::chunks(dots, WORK_NUMBERS as u64 * real, together, &limits(self.gpu, together))?;
        pipeline(
            chunks,
            |chunk| self.start(&self.order[chunk.clone()]),
            |rounds: Rounds<Table>| rounds.advance(|r, t, a, s| self.round(r, t, a, s), &WANTED, |_| {}),
            |chunk, results| {
                unpack(&self.order[chunk.clone()], &results, outcomes);
                Ok(())
            },
        )
    }

    fn start(&self, members: &[usize]) -> Result<Rounds<'a, Table>> {
        let mut recording = self.gpu.record(self.precision);
        let problems = || members.iter().map(|&i| &self.searches[i].0);
        let mut dots = 0;
        let table: Table = problems()
            .map(|problem| {
                let (start, own) = (dots, problem.movable.len() as u32);
                dots += own;
                SlopesCurve { start, dots: own, closed: problem.closed.into(), stages: 1 }
            })
            .collect();
        let count = dots as usize;
        // An open curve has no segment where a closed one has its last.
        let mut segments = vec![Segment { owner: 0, first: 0, last: 0, kind: 0 }; count];
        let [mut angles, mut fixed, mut turns] = [0, 1, 2].map(|_| vec![0.0; 2 * count]);
        let mut numbers = vec![f64::NAN; SLOPES_NUMBERS * members.len()];
        for (slot, (&i, curve)) in members.iter().zip(&table).enumerate() {
            let (problem, start_turns) = &self.searches[i];
            let start = curve.start as usize;
            for (k, (&movable, &turn)) in problem.movable.iter().zip(start_turns).enumerate() {
                fixed[start + k] = movable;
                turns[start + k] = turn;
                turns[count + start + k] = turn;
            }
            for (k, span) in problem.spans.iter().enumerate() {
                let after = if k + 1 == problem.movable.len() { 0 } else { k + 1 };
                let [first, last] = [start + k, start + after].map(|at| at as u32);
                segments[start + k] =
                    Segment { owner: slot as u32, first, last, kind: kind(span.curve.into(), span.ends) };
                angles[2 * (start + k)] = span.angles[0];
                angles[2 * (start + k) + 1] = span.angles[1];
                fixed[count + start + k] = span.weight;
            }
            let own = &mut numbers[slot * SLOPES_NUMBERS..];
            own[..SLOPES_NUMBERS].copy_from_slice(&given(self.precision, self.until, problem.exponent, ROUNDINGS));
        }
        let arrays = vec![
            ("universals", recording.upload_reals(&universals(self.curves))),
            ("segments", recording.upload(&segments)),
            ("angles", recording.upload_reals(&angles)),
            ("turns", recording.upload_reals(&turns)),
            ("states", recording.upload(&vec![SlopesState::zeroed(); members.len()])),
            ("found", recording.storage_reals(FOUND * count)),
            ("curves", recording.upload(&table)),
            ("numbers", recording.upload_reals(&numbers)),
            ("fixed", recording.upload_reals(&fixed)),
            ("work", recording.storage_reals(WORK_NUMBERS * count)),
        ];
        let of_curves = ("scf/slopes", members.len());
        Rounds::start::<SlopesState>(of_curves, recording, (table, arrays), |r, t, a, s| self.round(r, t, a, s))
    }

    /// Some trials of the curves listed, each an evaluation of their segments and a step.
    fn round(
        &self,
        recording: &mut Recording<'a>,
        table: &Table,
        arrays: &[(&str, &Buffer)],
        slots: &[u32],
    ) -> Result<()> {
        let kernels = [evaluation_kernel(self.precision), slopes_kernel(self.precision)];
        let most_iterations = self.until.iterations;
        record_trials(recording, kernels, (table, slots), arrays, most_iterations, [MOST_EVALUATIONS, MOST_TRIALS])
    }
}

/// Records some trials of the curves listed: each is an evaluation of their segments and a step. Segments in all, and
/// trials of a curve, are so many at most.
pub(super) fn record_trials(
    recording: &mut Recording<'_>,
    [evaluation, advance]: [KernelKey; 2],
    (table, slots): (&[SlopesCurve], &[u32]),
    arrays: &[(&str, &Buffer)],
    most_iterations: u32,
    [most_evaluations, most_trials]: [usize; 2],
) -> Result<()> {
    let dots: u32 = table.iter().map(|curve| curve.dots).sum();
    let running = || slots.iter().map(|&slot| table[slot as usize]);
    let segments: Vec<u32> =
        running().flat_map(|curve| curve.start..curve.start + curve.dots - 1 + curve.closed).collect();
    let of_segments = recording.uniform(&EvaluationParams { tasks: segments.len() as u32 });
    let of_curves = recording.uniform(&SlopesParams { tasks: slots.len() as u32, dots, most_iterations });
    let trials = (most_evaluations / segments.len().max(1)).clamp(1, most_trials);
    let steps = [(evaluation, of_segments, &segments[..]), (advance, of_curves, slots)]
        .map(|(key, params, tasks)| (key, params, recording.upload(tasks), tasks.len()));
    for (key, params, tasks, count) in steps.iter().cycle().take(2 * trials) {
        let mut bound = vec![("params", params), ("tasks", tasks)];
        bound.extend(arrays);
        recording.dispatch(key, *count, GROUP, &bound)?;
    }
    Ok(())
}

/// The numbers of a curve at first: see `slopes.wgsl`. What the kernel must write before it reads it is NaN. In f32
/// the tolerance is so many ε at least.
pub(super) fn given(precision: Precision, until: &Until, exponent: f64, roundings: f64) -> [f64; SLOPES_NUMBERS] {
    let epsilon = if precision == Precision::F64 { 0.0 } else { f64::from(f32::EPSILON) };
    let (share, part) = (1.0 / exponent, 1.0 - 1.0 / exponent);
    let least = (exponent - 1.0).max(1.0).powf(-LONGEST);
    let tolerance = until.tolerance.max(roundings * epsilon);
    let (infinity, unknown) = (f64::INFINITY, f64::NAN);
    let roughly = tolerance.max(ROUGHLY);
    [share, part, least, tolerance, infinity, infinity, unknown, unknown, unknown, unknown, 0.0, roughly, 0.0]
}

fn unpack(members: &[usize], (table, results): &(Table, Vec<Downloaded>), outcomes: &mut [Outcome]) {
    let count: usize = table.iter().map(|curve| curve.dots as usize).sum();
    let results = Results::of(results);
    for (slot, (&i, curve)) in members.iter().zip(table).enumerate() {
        outcomes[i] = results.outcome(slot, curve, count);
    }
}

/// What came back of a chunk.
pub(super) struct Results<'a> {
    states: &'a [SlopesState],
    numbers: Cow<'a, [f64]>,
    turns: Cow<'a, [f64]>,
}

impl<'a> Results<'a> {
    /// Of the arrays that are wanted.
    pub fn of(arrays: &'a [Downloaded]) -> Self {
        Results { states: arrays[0].as_slice(), numbers: arrays[1].reals(), turns: arrays[2].reals() }
    }

    /// What became of the curve in a slot, of a chunk of so many dots.
    pub fn outcome(&self, slot: usize, curve: &SlopesCurve, count: usize) -> Outcome {
        let state = self.states[slot];
        let start = count + curve.start as usize;
        let own = &self.numbers[slot * SLOPES_NUMBERS..];
        Outcome {
            turns: self.turns[start..start + curve.dots as usize].to_vec(),
            cost: own[SLOPES_COST],
            decrement: own[SLOPES_DECREMENT],
            standing: STANDINGS
                .into_iter()
                .find(|own| *own as u32 == state.standing)
                .unwrap_or(SlopesStanding::Running),
            iterations: state.iterations,
            evaluations: state.evaluations,
            culprit: (state.culprit as usize).checked_sub(1),
        }
    }
}
