//! Smoothing splines on the GPU: `reinsch.wgsl` solves them. The CPU's code normalises them and maps
//! them back.
//!
//! The host fits the other curves: curves whose solution is the regression line, averaged points under
//! a deviation, and, in f64, curves that the device's precision cannot resolve.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::gpu::GROUP;
use super::knots::Knots;
use super::reinsch::Reinsch;
use super::smoother::{Outcome, Slot, Smoother, octave};
use super::smoothing::{OfCurve, SmoothingTarget};
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::gpu::{Buffer, Downloaded, Gpu, KernelKey, Pending, Recording, kept, once, pipeline, plan, unwritten};
use crate::linalg::{take, tasks};
use crate::numbers::Numbers;
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;
use crate::report::CurveReport;

const FLAG_CLOSED: u32 = 1;
const FLAG_DEVIATION: u32 = 2;
const STATUS_SOLVED: u32 = 1;
const STATUS_FAILED: u32 = 2;
const STATUS_PENDING: u32 = 3;

/// `SmoothingParams` of `reinsch.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SmoothingParams {
    pub curves: u32,
    pub dimension: u32,
}

/// `SmoothingCurve` of `reinsch.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SmoothingCurve {
    pub start: u32,
    pub count: u32,
    pub flags: u32,
    pub padding: u32,
}

/// The most solves of a search for a deviation: the start, up to six strides, eleven bisections of a
/// stride's 1,536 steps, and the last. The host takes searches that need more.
const MOST_SOLVES: usize = 19;

/// The most knots of a thread's curve. Its loops pass over them up to 58 times in a solve, and llvmpipe
/// ends a thread's loops after 65,535 iterations in all. The host is faster for longer curves anyway.
const MOST_KNOTS: usize = 1024;

/// Numbers of a curve in `searches`.
const SEARCH: usize = 8;

/// The kernel in a precision, for points of a dimension.
pub(crate) fn kernel(precision: Precision, dimension: usize) -> KernelKey {
    let definitions = crate::gpu::source::definitions([("GROUP", &GROUP), ("D", &dimension)]);
    KernelKey { path: "spline/reinsch.wgsl", entry: "fit", precision, definitions }
}

/// Fits every curve. The values of the knots become the curves' values. Returns second derivatives at
/// the knots, and reports.
///
/// # Errors
/// Errors of submissions. [`Error::Limit`] for a curve larger than the device's largest array.
pub(super) fn fit_on_gpu(
    own: OfCurve<'_>,
    gpu: &Gpu,
    precision: Precision,
    batch: &CurveBatch,
    knots: &mut Knots,
) -> Result<(Numbers, Vec<CurveReport>)> {
    let d = knots.dimension;
    let mut values = Arc::unwrap_or_clone(std::mem::take(&mut knots.values));
    let mut second = Numbers::from(vec![0.0; values.len()]);
    let mut reports: Vec<Option<CurveReport>> = vec![None; knots.len()];
    let real = precision.bytes();
    let scratch = real * (5 + 3 * d) as u64;
    let counts = (0..knots.len()).map(|i| knots.range(i).len());
    let done = plan::chunks(counts, scratch, 2 * scratch + real * (2 + d) as u64, gpu.limits()).and_then(|chunks| {
        // Packing the next chunk and unpacking the last one take turns on this thread.
        let run = std::cell::RefCell::new(SmoothingRun {
            own,
            epsilon: precision.epsilon(),
            batch,
            knots,
            values: &mut values,
            second: &mut second,
            reports: &mut reports,
        });
        kept(pipeline(
            chunks,
            |curves| run.borrow_mut().record(gpu.record(precision), curves),
            once(|(pending, sent): (Pending<'_>, _)| Ok((pending.wait()?, sent))),
            |curves, (results, sent)| run.borrow_mut().unpack(curves, &sent, &results),
        ))
    });
    knots.values = Arc::new(values);
    if let Some(lost) = done? {
        for (i, report) in reports.iter_mut().enumerate().filter(|(_, report)| report.is_none()) {
            knots.leave_unfitted(batch, i, &lost.why);
            *report = knots.report_unfitted(i);
        }
    }
    Ok((second, reports.into_iter().map(|report| report.expect("every curve was fitted or refused")).collect()))
}

struct SmoothingRun<'a> {
    own: OfCurve<'a>,
    /// Of the device's precision.
    epsilon: f64,
    batch: &'a CurveBatch,
    knots: &'a Knots,
    values: &'a mut [f64],
    second: &'a mut [f64],
    reports: &'a mut [Option<CurveReport>],
}

/// A curve on its way.
struct Sent {
    curve: usize,
    /// Where its knots start in the chunk's arrays.
    start: usize,
}

/// Some curves of a chunk, packed by one thread.
#[derive(Default)]
struct Packed {
    table: Vec<SmoothingCurve>,
    searches: Vec<f64>,
    spans: Vec<f64>,
    inverse_weights: Vec<f64>,
    data: Vec<f64>,
    sent: Vec<Sent>,
}

impl Packed {
    /// Adds a curve's problem, with its normalised λ or its allowed deviation.
    fn push(&mut self, curve: usize, problem: &Reinsch<f64>, amount: f64, is_search: bool) {
        let start = self.inverse_weights.len();
        self.spans.extend_from_slice(&problem.spans);
        self.inverse_weights.extend_from_slice(&problem.inverse_weights);
        self.data.extend_from_slice(&problem.data);
        // An open curve has one span fewer than knots.
        self.spans.resize(self.inverse_weights.len(), 0.0);
        let flags = if problem.closed { FLAG_CLOSED } else { 0 } | if is_search { FLAG_DEVIATION } else { 0 };
        self.table.push(SmoothingCurve { start: start as u32, count: problem.count as u32, flags, padding: 0 });
        self.searches.push(amount);
        self.searches.resize(SEARCH * self.table.len(), 0.0);
        self.sent.push(Sent { curve, start });
    }
}

/// Uploads the numbers of all parts, one part after the other.
fn upload(recording: &mut Recording<'_>, parts: &[Packed], numbers: impl Fn(&Packed) -> &[f64] + Sync) -> Buffer {
    let ends = ragged::offsets(parts.iter().map(|part| numbers(part).len()));
    recording.upload_parts(&ends, |k, to| to.copy_from_slice(numbers(&parts[k])))
}

impl SmoothingRun<'_> {
    /// Takes `work` to the curves of a chunk, on all threads. Those that it reports are done.
    fn each<T: Default + Send>(
        &mut self,
        curves: &Range<usize>,
        work: impl Fn(&mut Smoother, Slot<'_>, &mut T) -> Option<CurveReport> + Sync,
    ) -> Vec<T> {
        let (knots, batch, d) = (self.knots, self.batch, self.knots.dimension);
        let own = knots.offsets[curves.start] * d..knots.offsets[curves.end] * d;
        let (mut values, mut second) = (&mut self.values[own.clone()], &mut self.second[own]);
        let mut reports = &mut self.reports[curves.clone()];
        let mut parts = Vec::new();
        for part in tasks(&knots.offsets[curves.start..=curves.end]) {
            let part = curves.start + part.start..curves.start + part.end;
            let numbers = (knots.offsets[part.end] - knots.offsets[part.start]) * d;
            let rooms = (take(&mut values, numbers), take(&mut second, numbers), take(&mut reports, part.len()));
            parts.push((part, rooms));
        }
        parallel::of(parts, |(curves, (mut values, mut second, reports))| {
            let (mut smoother, mut found) = (Smoother::default(), T::default());
            for (curve, report) in curves.zip(reports) {
                let numbers = knots.range(curve).len() * d;
                let (values, second) = (take(&mut values, numbers), take(&mut second, numbers));
                // A chunk comes twice when it had to be halved; what the host fitted stays.
                if report.is_none() {
                    *report = work(&mut smoother, Slot { batch, knots, curve, values, second }, &mut found);
                }
            }
            found
        })
    }

    fn record<'g>(&mut self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<(Pending<'g>, Vec<Sent>)> {
        let (own, epsilon, knots, d) = (self.own, self.epsilon, self.knots, self.knots.dimension);
        let parts = self.each(curves, |smoother, slot, packed: &mut Packed| {
            let curve = slot.curve;
            if let Some(report) = knots.report_unfitted(curve) {
                return Some(report);
            }
            let options = own(curve);
            let is_short = knots.range(curve).len() <= MOST_KNOTS;
            match is_short.then(|| smoother.prepare_for_kernel(&slot, &options, epsilon)).flatten() {
                Some(amount) => {
                    let is_search = matches!(options.target, SmoothingTarget::Deviation(_));
                    packed.push(curve, smoother.problem(), amount, is_search);
                    None
                }
                None => Some(smoother.fit(slot, &options)),
            }
        });
        let rows = ragged::offsets(parts.iter().map(|part| part.inverse_weights.len()));
        let (mut table, mut sent) = (Vec::new(), Vec::new());
        for (part, &first) in parts.iter().zip(&rows) {
            table.extend(part.table.iter().map(|own| SmoothingCurve { start: first as u32 + own.start, ..*own }));
            sent.extend(part.sent.iter().map(|own| Sent { curve: own.curve, start: first + own.start }));
        }
        let is_search = table.iter().any(|curve| curve.flags & FLAG_DEVIATION != 0);
        let (count, dimension) = (table.len() as u32, d as u32);
        let params = recording.uniform(&SmoothingParams { curves: count, dimension });
        let status = recording.storage(4 * u64::from(count));
        let scratch = recording.storage_reals(rows[parts.len()] * (5 + 3 * d));
        let searches = upload(&mut recording, &parts, |part| &part.searches);
        let buffers = [
            ("params", &params),
            ("curves", &recording.upload(&table)),
            ("status", &status),
            ("octave", &recording.upload_reals(&octave().collect::<Vec<f64>>())),
            ("spans", &upload(&mut recording, &parts, |part| &part.spans)),
            ("inverse_weights", &upload(&mut recording, &parts, |part| &part.inverse_weights)),
            ("data", &upload(&mut recording, &parts, |part| &part.data)),
            ("scratch", &scratch),
            ("searches", &searches),
        ];
        let kernel = kernel(recording.precision(), d);
        // One solve a dispatch; curves that are done sit the rest out.
        for _ in 0..if is_search { MOST_SOLVES } else { 1 } {
            recording.dispatch(&kernel, table.len(), GROUP, &buffers)?;
        }
        [&status, &searches, &scratch].into_iter().for_each(|buffer| recording.download(buffer));
        Ok((recording.submit()?, sent))
    }

    fn unpack(&mut self, curves: &Range<usize>, sent: &[Sent], results: &[Downloaded]) -> Result<()> {
        let (own, epsilon, knots, d) = (self.own, self.epsilon, self.knots, self.knots.dimension);
        let (status, searches, scratch) = (results[0].as_slice::<u32>(), results[1].numbers(), results[2].numbers());
        let is_written = |word: &u32| [STATUS_SOLVED, STATUS_FAILED, STATUS_PENDING].contains(word);
        if let Some(k) = status[..sent.len()].iter().position(|word| !is_written(word)) {
            return Err(unwritten("spline/reinsch", format_args!("curve {}", sent[k].curve), status[k]));
        }
        self.each(curves, |smoother, mut slot, (): &mut ()| {
            let k = sent.binary_search_by_key(&slot.curve, |own| own.curve).expect("what has no report was sent");
            let (options, Sent { curve, start }) = (own(slot.curve), &sent[k]);
            let accepted = if status[k] == STATUS_SOLVED {
                let count = knots.range(*curve).len() - usize::from(knots.closed[*curve]);
                let moments = start * (5 + 3 * d) + 5 * count;
                let correction = moments + 2 * count * d;
                let [step, solves] = [4, 5].map(|field| searches.at(SEARCH * k + field));
                let outcome = Outcome { step: step as i32, solves: solves as u32 };
                let numbers = |from: usize| (from..from + count * d).map(|at| scratch.at(at));
                smoother.accept(&mut slot, &options, outcome, epsilon, numbers(moments), numbers(correction))
            } else {
                None
            };
            Some(accepted.unwrap_or_else(|| smoother.fit(slot, &options)))
        });
        Ok(())
    }
}
