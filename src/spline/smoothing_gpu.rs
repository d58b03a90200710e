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
use super::smoother::{Outcome, Slot, Smoother, octave};
use super::smoothing::{OfCurve, SmoothingTarget};
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::gpu::{Downloaded, Gpu, KernelKey, Pending, Recording, kept, once, pipeline, plan, unwritten};
use crate::numbers::Numbers;
use crate::precision::Precision;
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
        let mut smoother = Smoother::default();
        // Packing the next chunk and unpacking the last one take turns on this thread.
        let run = std::cell::RefCell::new(SmoothingRun {
            own,
            epsilon: precision.epsilon(),
            batch,
            knots,
            smoother: &mut smoother,
            values: &mut values,
            second: &mut second,
            reports: &mut reports,
        });
        kept(pipeline(
            chunks,
            |curves| run.borrow_mut().record(gpu.record(precision), curves),
            once(|(pending, sent): (Pending<'_>, _)| Ok((pending.wait()?, sent))),
            |_, (results, sent)| run.borrow_mut().unpack(&sent, &results),
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
    smoother: &'a mut Smoother,
    values: &'a mut [f64],
    second: &'a mut [f64],
    reports: &'a mut [Option<CurveReport>],
}

/// A curve on its way: its index and where its knots start in the chunk's arrays.
type Sent = (usize, usize);

impl SmoothingRun<'_> {
    fn slot(&mut self, i: usize) -> (Slot<'_>, &mut Smoother) {
        let d = self.knots.dimension;
        let range = self.knots.offsets[i] * d..self.knots.offsets[i + 1] * d;
        let slot = Slot {
            batch: self.batch,
            knots: self.knots,
            curve: i,
            values: &mut self.values[range.clone()],
            second: &mut self.second[range],
        };
        (slot, self.smoother)
    }

    fn fit_on_host(&mut self, i: usize) {
        let options = (self.own)(i);
        let (slot, smoother) = self.slot(i);
        let report = smoother.fit(slot, &options);
        self.reports[i] = Some(report);
    }

    fn record<'g>(&mut self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<(Pending<'g>, Vec<Sent>)> {
        let d = self.knots.dimension;
        let (mut table, mut searches, mut sent) = (Vec::new(), Vec::new(), Vec::new());
        let (mut spans, mut inverse_weights, mut data) = (Vec::new(), Vec::new(), Vec::new());
        let mut most_solves = 1;
        for i in curves.clone() {
            // A chunk comes twice when it had to be halved; what the host fitted stays.
            if self.reports[i].is_some() {
                continue;
            }
            self.reports[i] = self.knots.report_unfitted(i);
            if self.reports[i].is_some() {
                continue;
            }
            let (options, epsilon) = ((self.own)(i), self.epsilon);
            let (slot, smoother) = self.slot(i);
            let prepared = (slot.knots.range(i).len() <= MOST_KNOTS)
                .then(|| smoother.prepare_for_kernel(&slot, &options, epsilon))
                .flatten();
            let Some(amount) = prepared else {
                self.fit_on_host(i);
                continue;
            };
            let problem = smoother.problem();
            let start = inverse_weights.len();
            spans.extend_from_slice(&problem.spans);
            inverse_weights.extend_from_slice(&problem.inverse_weights);
            data.extend_from_slice(&problem.data);
            // An open curve has one span fewer than knots.
            spans.resize(inverse_weights.len(), 0.0);
            let is_search = matches!(options.target, SmoothingTarget::Deviation(_));
            let mut flags = if problem.closed { FLAG_CLOSED } else { 0 };
            flags |= if is_search { FLAG_DEVIATION } else { 0 };
            most_solves = if is_search { MOST_SOLVES } else { most_solves };
            table.push(SmoothingCurve { start: start as u32, count: problem.count as u32, flags, padding: 0 });
            searches.push(amount);
            searches.resize(SEARCH * table.len(), 0.0);
            sent.push((i, start));
        }
        let (count, dimension) = (table.len() as u32, d as u32);
        let params = recording.uniform(&SmoothingParams { curves: count, dimension });
        let status = recording.storage(4 * u64::from(count));
        let scratch = recording.storage_reals(inverse_weights.len() * (5 + 3 * d));
        let searches = recording.upload_reals(&searches);
        let buffers = [
            ("params", &params),
            ("curves", &recording.upload(&table)),
            ("status", &status),
            ("octave", &recording.upload_reals(&octave().collect::<Vec<f64>>())),
            ("spans", &recording.upload_reals(&spans)),
            ("inverse_weights", &recording.upload_reals(&inverse_weights)),
            ("data", &recording.upload_reals(&data)),
            ("scratch", &scratch),
            ("searches", &searches),
        ];
        let kernel = kernel(recording.precision(), d);
        // One solve a dispatch; curves that are done sit the rest out.
        for _ in 0..most_solves {
            recording.dispatch(&kernel, table.len(), GROUP, &buffers)?;
        }
        [&status, &searches, &scratch].into_iter().for_each(|buffer| recording.download(buffer));
        Ok((recording.submit()?, sent))
    }

    fn unpack(&mut self, sent: &[Sent], results: &[Downloaded]) -> Result<()> {
        let d = self.knots.dimension;
        let (status, searches, scratch) = (results[0].as_slice::<u32>(), results[1].reals(), results[2].reals());
        for (k, &(i, start)) in sent.iter().enumerate() {
            let accepted = match status[k] {
                STATUS_SOLVED => {
                    let count = self.knots.range(i).len() - usize::from(self.knots.closed[i]);
                    let moments = start * (5 + 3 * d) + 5 * count;
                    let correction = moments + 2 * count * d;
                    let [step, solves] = [4, 5].map(|field| searches[SEARCH * k + field]);
                    let outcome = Outcome { step: step as i32, solves: solves as u32 };
                    let (options, epsilon) = ((self.own)(i), self.epsilon);
                    let (mut slot, smoother) = self.slot(i);
                    let numbers = |from: usize| scratch[from..from + count * d].iter().copied();
                    smoother.accept(&mut slot, &options, outcome, epsilon, numbers(moments), numbers(correction))
                }
                STATUS_FAILED | STATUS_PENDING => None,
                word => return Err(unwritten("spline/reinsch", format_args!("curve {i}"), word)),
            };
            match accepted {
                Some(report) => self.reports[i] = Some(report),
                None => self.fit_on_host(i),
            }
        }
        Ok(())
    }
}
