//! Smooth connection functions on a GPU: the kernels, and single segments. [`search`] handles
//! curves.

mod bounds;
pub(super) mod search;
#[cfg(all(test, feature = "gpu"))]
mod tests;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::evaluation::Evaluation;
use super::family::Family;
use super::problem::Ends;
use super::universal::Universal;
use super::workspace::evaluate_all;
use crate::error::Result;
use crate::gpu::plan::{self, Limits};
use crate::gpu::source::definitions;
use crate::gpu::{Downloaded, Gpu, KernelKey, Pending, Recording, once, pipeline};
use crate::precision::Precision;

/// Threads per workgroup.
const GROUP: usize = 64;

/// The most segments, or dots of curves, per dispatch. On a software driver they take seconds.
const MOST_TOGETHER: u64 = 1 << 20;

/// Costs in f32 below this may have lost digits, as may their derivatives.
const LEAST_COST: f64 = 1e-30;

/// The numbers per segment in `found`.
const FOUND: usize = 7;

/// `EvaluationParams` of `evaluation.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct EvaluationParams {
    tasks: u32,
}

/// `Segment` of `evaluation.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Segment {
    owner: u32,
    first: u32,
    last: u32,
    kind: u32,
}

/// `SlopesState` of `slopes/standing.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
struct SlopesState {
    standing: u32,
    iterations: u32,
    evaluations: u32,
    flags: u32,
    culprit: u32,
}

/// The kernels that evaluate segments of a family and advance its curves.
fn search_kernels(family: Family, precision: Precision) -> [KernelKey; 2] {
    [("scf/evaluation.wgsl", "evaluate"), ("scf/slopes.wgsl", "advance")].map(|(path, entry)| {
        let mut definitions = definitions([("GROUP", &GROUP)]);
        if let Family::UnderTension(_) = family {
            definitions.insert("TENSION".into(), "1".into());
        }
        KernelKey { path, entry, precision, definitions }
    })
}

fn answer_kernel(precision: Precision) -> KernelKey {
    let definitions = definitions([("GROUP", &GROUP)]);
    KernelKey { path: "scf/tension/answer.wgsl", entry: "answer", precision, definitions }
}

/// All variants of the kernels.
pub(crate) fn scf_kernels(precision: Precision) -> Vec<KernelKey> {
    let searches = [Family::Plain(&[]), Family::UnderTension(&[])].map(|family| search_kernels(family, precision));
    [searches.as_flattened(), &[answer_kernel(precision)]].concat()
}

/// `Segment::kind`
fn kind(curve: u32, ends: Ends) -> u32 {
    4 * curve + ends as u32
}

/// The limits of a device for chunks of elements of this size, with at most [`MOST_TOGETHER`]
/// elements.
fn limits(gpu: &Gpu, total_bytes: u64) -> Limits {
    gpu.limits().with_chunks_of(MOST_TOGETHER * total_bytes)
}

/// Evaluates segments of unit chord, in one dispatch per chunk. Each segment is given by the index
/// of its universal curve and its end angles. The CPU evaluates again, in f64, the segments for
/// which f32 finds no minimiser or no accurate cost.
///
/// # Errors
/// Errors of compiling the kernel and of submissions.
pub(crate) fn evaluate_on_gpu(
    gpu: &Gpu,
    precision: Precision,
    curves: &[Universal],
    segments: &[(u32, [f64; 2])],
) -> Result<Vec<Evaluation<f64>>> {
    let real = precision.bytes();
    let (largest, together) = (FOUND as u64 * real, (2 * FOUND + 3) as u64 * real + 20);
    let chunks = plan::chunks(segments.iter().map(|_| 1), largest, together, &limits(gpu, together))?;
    let mut found = Vec::with_capacity(segments.len());
    pipeline(
        chunks,
        |chunk| record_segments(gpu.record(precision), curves, &segments[chunk.clone()])?.submit(),
        once(Pending::wait),
        |_: &Range<usize>, results: Vec<Downloaded>| {
            found.extend(results[0].reals().as_chunks::<FOUND>().0.iter().map(evaluation));
            Ok(())
        },
    )?;
    found.truncate(segments.len());
    if precision != Precision::F64 {
        let doubtful = (0..segments.len()).filter(|&i| is_doubtful(&found[i], segments[i].1)).collect::<Vec<_>>();
        for same in doubtful.chunk_by(|&i, &j| segments[i].0 == segments[j].0) {
            let angles: Vec<[f64; 2]> = same.iter().map(|&i| segments[i].1).collect();
            let mut evaluations = vec![found[same[0]]; same.len()];
            evaluate_all(&curves[segments[same[0]].0 as usize], false, &angles, &mut evaluations);
            for (&i, evaluation) in same.iter().zip(evaluations) {
                found[i] = evaluation;
            }
        }
    }
    Ok(found)
}

/// Whether f32 may be too coarse for a segment. It tends to fail for almost circular segments of
/// small angles.
fn is_doubtful(found: &Evaluation<f64>, angles: [f64; 2]) -> bool {
    let numbers = found.gradient.iter().chain(&found.hessian);
    let coarse = found.cost < LEAST_COST || !found.cost.is_finite() || numbers.into_iter().any(|x| !x.is_finite());
    found.exists == 0.0 || (angles != [0.0; 2] && coarse)
}

/// Records the evaluation of segments as those of a single curve whose directions do not turn.
fn record_segments<'g>(
    mut recording: Recording<'g>,
    curves: &[Universal],
    segments: &[(u32, [f64; 2])],
) -> Result<Recording<'g>> {
    let (plain, count) = (Family::Plain(curves), segments.len());
    let table: Vec<Segment> = segments
        .iter()
        .map(|&(curve, _)| Segment { owner: 0, first: 0, last: 0, kind: kind(curve, Ends::Directed) })
        .collect();
    let angles: Vec<f64> = segments.iter().flat_map(|&(_, [a, b])| [a, b, 1.0]).collect();
    let found = recording.storage_reals(FOUND * count);
    let params = EvaluationParams { tasks: count as u32 };
    let buffers = [
        ("params", &recording.uniform(&params)),
        ("tasks", &recording.upload(&(0..count as u32).collect::<Vec<u32>>())),
        ("exponents", &recording.upload_reals(&plain.packed())),
        ("segments", &recording.upload(&table)),
        ("angles", &recording.upload_reals(&angles)),
        ("turns", &recording.upload_reals(&[0.0])),
        ("states", &recording.upload(&[SlopesState::zeroed()])),
        ("found", &found),
    ];
    let [evaluation, _] = search_kernels(plain, recording.precision());
    recording.dispatch(&evaluation, count, GROUP, &buffers)?;
    recording.download(&found);
    Ok(recording)
}

fn evaluation(found: &[f64; FOUND]) -> Evaluation<f64> {
    let [cost, a, b, aa, ab, bb, exists] = *found;
    Evaluation { cost, gradient: [a, b], hessian: [aa, ab, bb], exists }
}
