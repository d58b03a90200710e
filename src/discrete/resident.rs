//! Plain curves that stay on a GPU from their data points to their vertices, in one submission per
//! chunk.
//!
//! ```text
//! points ─► splines ─► edges ─► regularisation ─► descents, each of the curves that run ─► vertices
//! ```
//!
//! A curve is plain if it interpolates points that are all different, in the plane or in space,
//! with as many edges in every span and without limits, surface and given tangents, and if its
//! energy is of order 2 and its stiffness does not depend on its curvature. Other curves, and plain
//! ones that run for more than [`MOST_TICKS`] ticks or cross themselves, are set up by the host.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::compose::Composition;
use super::curves::EvenVertices;
use super::descent_gpu::{
    DescentParams, DescentState, DescentTask, Form, GIVEN, GROUP, LEFT, Shape, choose, lanes_of, loop_turns,
    termination,
};
use super::energy::{Energy, of_chords};
use super::fair::{Fair, Pins, Segments};
use super::lane::TerminationStatus;
use super::minimise::COARSEST_IN_F32;
use super::plan::{Plan, Solver};
use super::problem::Outcome;
use super::self_intersections::{is_simple, tangled};
use super::setup::{LONGEST, PreparedCurve, energy_unit, highest_at};
use super::tally::Tally;
use super::verdict::Ending;
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::device::Device;
use crate::error::Result;
use crate::gpu::plan::{self, LOOP_TURNS, Limits};
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, Downloaded, Gpu, KernelKey, Pending, Recording, kept, once, pipeline, unwritten};
use crate::linalg::scalar::{Vector, scale, subtract};
use crate::numbers::Numbers;
use crate::parallel;
use crate::precision::Precision;
use crate::ragged;
use crate::report::CurveReport;
use crate::spline::ResidentSplines;
use crate::spline::knots::Knots;

/// The most ticks of a curve on the device. Of 5,000 rough random walks 6 take more, and few threads
/// would wait for these.
const MOST_TICKS: u32 = 64;

/// The most ticks between two lists of the curves that run.
const TICKS_TOGETHER: u32 = 16;

/// The most vertices of a plain curve, so that one thread of the device can take it.
const MOST_VERTICES: usize = 2_000;

/// The numbers of a curve's record: its tolerance, its energy, its squared decrement and its length.
const RECORD: usize = 4;

/// `NO_SLOT` of `resident.wgsl`.
const NO_SLOT: u32 = u32::MAX;

/// The curves that a thread packs or unpacks at a time.
const TOGETHER: usize = 64;

/// `ResidentParams` of `resident.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct ResidentParams {
    pub slots: u32,
    pub splines: u32,
    pub knots: u32,
    pub dimension: u32,
    pub segments: u32,
    pub side: u32,
    pub width: u32,
    pub given: u32,
    pub numbers: u32,
    pub regularisation: u32,
    pub most_iterations: u32,
    pub per_group: u32,
    pub ticks: u32,
}

/// What the device made of a curve.
pub(super) enum Attempt {
    /// The host sets it up for the device.
    ForHost,
    /// The CPU descends it.
    ForCpu,
    /// It crosses itself: energy and norm, iterations and evaluations.
    Tangled([f64; 2], [u32; 2]),
    /// Nothing: the device was lost.
    Lost,
    /// Its report, and whether it is fitted.
    Ended(CurveReport, bool),
}

impl Attempt {
    /// The outcome from which the host goes on, from the vertices of the device. `None` if the host
    /// begins.
    pub fn outcome<const D: usize>(&self, ready: &PreparedCurve<D>, vertices: &[f64]) -> Option<Outcome<D>> {
        match *self {
            Attempt::ForHost | Attempt::ForCpu | Attempt::Ended(..) => None,
            Attempt::Lost => Some(Outcome::moved(vec![[0.0; D]; ready.vertices.len()])),
            Attempt::Tangled([energy, norm], [iterations, evaluations]) => {
                let moved = vertices.as_chunks::<D>().0.iter().zip(&ready.vertices);
                let displacements = moved.map(|(to, from)| scale(1.0 / ready.size, subtract(*to, *from))).collect();
                let termination = TerminationStatus::Converged;
                Some(Outcome { termination, energy, norm, iterations, evaluations, ..Outcome::moved(displacements) })
            }
        }
    }
}

/// The kernels of `resident.wgsl`.
pub(crate) fn resident_kernels(precision: Precision) -> impl Iterator<Item = KernelKey> {
    ["divide", "prepare", "list", "place"].into_iter().map(move |entry| kernel(entry, precision))
}

fn kernel(entry: &'static str, precision: Precision) -> KernelKey {
    KernelKey { path: "discrete/resident.wgsl", entry, precision, definitions: definitions([("GROUP", &GROUP)]) }
}

/// Fits the plain curves of a batch on a GPU. `None` if it has none, or no kernel.
///
/// # Errors
/// Errors of submissions, if no curve was finished.
pub(super) fn fit<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    (gpu, precision): (&Gpu, Precision),
    device: &Device,
    tally: &Tally<'_>,
) -> Result<Option<(Vec<Attempt>, EvenVertices)>> {
    let plan = fair.plan(&fair.energy);
    let (Segments::PerSpan(segments), true) = (fair.segments, is_plain(fair, batch, &plan)) else {
        return Ok(None);
    };
    let Ok(composition) = Composition::of(&fair.energy, plan.regularisation, D, precision) else { return Ok(None) };
    let possible = lanes_of::<D>(gpu, &plan, &fair.energy, composition.edges());
    let sizes = parallel::map(batch.len(), TOGETHER, |i| {
        Bounds::of(batch.points(i).as_chunks::<D>().0.iter().copied()).diagonal()
    });
    let splines = ResidentSplines::of(batch, &sizes)?;
    let plain = parallel::map(batch.len(), TOGETHER, |i| Plain::of(fair, batch, &splines.knots, i, segments, sizes[i]));
    let vertices: Vec<usize> = plain.iter().flatten().map(|plain| plain.shape.vertices).collect();
    if possible.is_empty() || vertices.is_empty() {
        return Ok(None);
    }
    let lanes = choose(gpu, &possible, plan.order, vertices.into_iter());
    let form = Form { plan: &plan, energy: &fair.energy, composition, dimension: D, lanes };
    let mut attempts: Vec<Attempt> =
        plain.iter().map(|plain| plain.as_ref().map_or(Attempt::ForHost, |_| Attempt::Lost)).collect();
    let offsets = ragged::offsets(plain.iter().map(|plain| plain.as_ref().map_or(0, |plain| plain.shape.vertices * D)));
    let mut coords = Numbers::room(offsets[batch.len()]);
    let [is_in_f32, may_finish_on_cpu] =
        [Precision::F32, Precision::Auto].map(|asked| precision == Precision::F32 && device.precision() == asked);
    let resident =
        Resident::<D> { fair, batch, segments, plain, splines, form, offsets: &offsets, is_in_f32, may_finish_on_cpu };
    let done = pipeline(
        resident.chunks(gpu.limits(), precision)?,
        |curves| resident.submit(gpu.record(precision), curves),
        once(|(slots, pending): (Vec<u32>, Pending<'_>)| Ok((slots, pending.wait()?))),
        |curves, (slots, results)| {
            resident.unpack(curves, &slots, &results, &mut coords)?;
            resident.judge(curves, &slots, &results, &coords, &mut attempts[curves.clone()]);
            let ended = curves.clone().filter(|&i| matches!(attempts[i], Attempt::Ended(..)));
            ended.for_each(|i| tally.finished(i));
            device.finished(0);
            Ok(())
        },
    );
    kept(done)?;
    Ok(Some((attempts, EvenVertices { coords, offsets, segments })))
}

/// Whether the curves of a batch are plain, apart from their points.
fn is_plain(fair: &Fair, batch: &CurveBatch, plan: &Plan) -> bool {
    let order = plan.order;
    let is_even =
        |energy: &Energy| energy.terms().iter().all(|(_, own)| own.order() < order || own.facts().stiffening() == 0.0);
    order == 2
        && plan.regularisation == 2
        && plan.solver == Solver::Newton
        && fair.pins == Pins::All
        && fair.starts == 1
        && fair.surface.is_none()
        && fair.limits.is_empty(batch)
        && !fair.energy.is_attached()
        && is_even(&fair.energy)
        && fair.energy.stages().is_empty()
}

/// A plain curve.
#[derive(Clone, Copy, Debug)]
struct Plain {
    shape: Shape,
    /// The unit of length, in units of the input.
    size: f64,
    /// The unit of energy, in units of the input.
    energy_unit: f64,
}

impl Plain {
    /// A curve of a batch, if its points make it plain.
    fn of(fair: &Fair, batch: &CurveBatch, knots: &Knots, i: usize, segments: usize, size: f64) -> Option<Self> {
        let (closed, spans) = (knots.closed[i], knots.range(i).len().checked_sub(1)?);
        let d = batch.dimension();
        let own = d * batch.offsets()[i]..d * batch.offsets()[i + 1];
        let constraints = batch.constraints();
        let is_given = |column: &Option<Vec<f64>>| {
            column.as_ref().is_some_and(|column| column[own.clone()].iter().any(|x| !x.is_nan()))
        };
        let vertices = spans * segments + usize::from(!closed);
        let energy_unit = energy_unit(&fair.energy, size, 1.0);
        let is_plain = (spans > 2 || !closed)
            && vertices <= MOST_VERTICES
            && !knots.repeats.contains_key(&i)
            && !is_given(&constraints.tangents)
            && !is_given(&constraints.curvatures)
            && [size, energy_unit].into_iter().all(|x| x > 0.0 && x.is_finite());
        is_plain.then_some(Plain { shape: Shape { vertices, closed }, size, energy_unit })
    }
}

struct Resident<'a, const D: usize> {
    fair: &'a Fair,
    batch: &'a CurveBatch,
    /// Edges per span.
    segments: usize,
    plain: Vec<Option<Plain>>,
    splines: ResidentSplines,
    form: Form<'a>,
    /// Of the coordinates of each curve's vertices.
    offsets: &'a [usize],
    /// Whether f32 was asked for, and the CPU finishes nothing.
    is_in_f32: bool,
    /// Whether f32 was not asked for, and the CPU finishes what it leaves short.
    may_finish_on_cpu: bool,
}

impl<const D: usize> Resident<'_, D> {
    /// Chunks whose arrays fit the device, and whose workgroups fit one dimension of a dispatch.
    fn chunks(&self, limits: &Limits, precision: Precision) -> Result<Vec<Range<usize>>> {
        let words = |plain: &Option<Plain>| plain.map_or(0, |plain| self.form.work_of(plain.shape).max(1));
        let real = precision.bytes();
        // All arrays together are smaller than three times the largest.
        let chunks = plan::chunks(self.plain.iter().map(words), real, 3 * real, limits)?;
        let most = limits.workgroups as usize * (GROUP / self.form.lanes);
        let divided =
            |curves: Range<usize>| curves.clone().step_by(most).map(move |from| from..curves.end.min(from + most));
        Ok(chunks.into_iter().flat_map(divided).collect())
    }

    /// Submits a chunk. Returns the slot of each curve.
    fn submit<'g>(&self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<(Vec<u32>, Pending<'g>)> {
        let (knots, form) = (&self.splines.knots, &self.form);
        let first = knots.offsets[curves.start];
        let shape = |i: usize| self.plain[i].map(|plain| plain.shape);
        let mut order: Vec<usize> = curves.clone().filter(|&i| self.plain[i].is_some()).collect();
        order.sort_by_key(|&i| shape(i).map(|shape| (shape.vertices, shape.closed)));
        let mut slots = vec![NO_SLOT; curves.len()];
        order.iter().enumerate().for_each(|(slot, &i)| slots[i - curves.start] = slot as u32);
        let layout = form.layout(&order.iter().filter_map(|&i| shape(i)).collect::<Vec<_>>());
        let splines: Vec<usize> = curves.clone().filter(|&i| !knots.range(i).is_empty()).collect();
        let mut starts: Vec<u32> = splines.iter().map(|&i| (knots.offsets[i] - first) as u32).collect();
        starts.push((knots.offsets[curves.end] - first) as u32);
        let slot_of: Vec<u32> = splines.iter().map(|&i| slots[i - curves.start]).collect();
        let entries = knots.offsets[curves.end] - first;
        let params = ResidentParams {
            slots: order.len() as u32,
            splines: splines.len() as u32,
            knots: entries as u32,
            dimension: D as u32,
            segments: self.segments as u32,
            side: form.side() as u32,
            width: form.fixed_numbers() as u32,
            given: (GIVEN + form.composition.width()) as u32,
            numbers: form.numbers() as u32,
            regularisation: form.composition.regularisation().expect("order 2 has one") as u32,
            most_iterations: self.fair.max_iterations,
            per_group: (GROUP / form.lanes) as u32,
            ticks: 0,
        };
        let [spans, edges, second] = self.splines.record(&mut recording, curves)?;
        let arrays = [
            ("spans", spans),
            ("edges", edges),
            ("second", second),
            ("starts", recording.upload(&starts)),
            ("slot_of", recording.upload(&slot_of)),
            ("taut", self.upload_taut(&mut recording, curves)),
            ("given", self.upload_given(&mut recording, &order)),
            ("curves", recording.upload(&layout.table)),
            ("fixed", recording.storage_reals(layout.fixed)),
            ("states", recording.storage((size_of::<DescentState>() * order.len()) as u64)),
            ("lanes", recording.storage_reals(form.numbers() * order.len())),
            ("displacements", recording.storage_reals(layout.displacements)),
            ("work", recording.storage_reals(layout.work)),
            ("tasks", recording.storage((size_of::<DescentTask>() * order.len()) as u64)),
            ("records", recording.storage_reals(RECORD * order.len())),
            ("vertices", recording.storage_reals((entries - splines.len()) * self.segments * D)),
        ];
        let arrays: Vec<(&str, &Buffer)> = arrays.iter().map(|(name, array)| (*name, array)).collect();
        dispatch(&mut recording, "divide", params, entries, &arrays)?;
        dispatch(&mut recording, "prepare", params, order.len(), &arrays)?;
        let rows = layout.table.iter().map(|curve| curve.stride as usize).max().unwrap_or(1);
        descend(&mut recording, form, params, rows, &arrays)?;
        dispatch(&mut recording, "place", params, entries, &arrays)?;
        let wanted = |name: &&str| ["states", "records", "vertices"].contains(name);
        arrays.iter().filter(|(name, _)| wanted(name)).for_each(|(_, array)| recording.download(array));
        Ok((slots, recording.submit()?))
    }

    /// Uploads 1/w² of every span, if the energy needs it.
    fn upload_taut(&self, recording: &mut Recording<'_>, curves: &Range<usize>) -> Buffer {
        if !self.fair.energy.is_taut() {
            return recording.upload_reals(&[]);
        }
        let knots = &self.splines.knots;
        recording.upload_parts(&knots.offsets[curves.start..=curves.end], |k, taut| {
            if let Some(Plain { size, .. }) = self.plain[curves.start + k] {
                let points = knots.values(curves.start + k).as_chunks::<D>().0;
                let chord = |pair: &[Vector<f64, D>]| scale(1.0 / size, subtract(pair[1], pair[0]));
                let of_spans = of_chords(points.windows(2).map(chord).collect(), knots.closed[curves.start + k]);
                taut.iter_mut().zip(of_spans).for_each(|(to, own)| *to = own);
            }
        })
    }

    /// Uploads the numbers and weights that a curve's descent begins with.
    fn upload_given(&self, recording: &mut Recording<'_>, order: &[usize]) -> Buffer {
        let (energy, width) = (&self.fair.energy, GIVEN + self.form.composition.width());
        let ends: Vec<usize> = (0..=order.len()).map(|slot| slot * width).collect();
        recording.upload_parts(&ends, |slot, given| {
            let Some(Plain { size, energy_unit, .. }) = self.plain[order[slot]] else { return };
            let longest = match energy.bounds_length() {
                true => f64::INFINITY,
                false => LONGEST * self.chords(order[slot]) / size,
            };
            let highest = highest_at(energy, size, energy_unit);
            // What rounding allows follows on the device.
            given[..GIVEN].copy_from_slice(&[highest, self.fair.tolerance, longest, f64::NAN]);
            let weights = self.form.composition.entries_at(size, energy_unit);
            given[GIVEN..].iter_mut().zip(weights).for_each(|(to, weight)| *to = weight);
        })
    }

    /// The length of the data polygon.
    fn chords(&self, i: usize) -> f64 {
        self.batch.chords(i).sum()
    }

    /// The vertices of the curves of a chunk.
    ///
    /// # Errors
    /// [`Error::Kernel`](crate::Error::Kernel) if no kernel wrote a curve's status.
    fn unpack(&self, curves: &Range<usize>, slots: &[u32], results: &[Downloaded], coords: &mut [f64]) -> Result<()> {
        let (states, vertices) = (results[0].as_slice::<DescentState>(), results[2].numbers());
        for &slot in slots.iter().filter(|slot| **slot != NO_SLOT) {
            let word = states[slot as usize].termination;
            if word == 0 || word > LEFT {
                return Err(unwritten("discrete/resident", format_args!("slot {slot}"), word));
            }
        }
        let knots = &self.splines.knots;
        let room = self.segments * D;
        let spans = |i: usize| knots.range(i).len().saturating_sub(1);
        let first = ragged::offsets(curves.clone().map(|i| spans(i) * room));
        let ends = &self.offsets[curves.start..=curves.end];
        parallel::parts(&mut coords[ends[0]..ends[curves.len()]], ends, |k, to| {
            let Some(Plain { size, .. }) = self.plain[curves.start + k] else { return };
            let points = self.batch.points(curves.start + k);
            for (span, (to, point)) in to.chunks_mut(room).zip(points.chunks_exact(D)).enumerate() {
                // The data points keep their bits.
                to[..D].copy_from_slice(point);
                let at = first[k] + span * room;
                for j in D..to.len() {
                    to[j] = point[j % D] + size * vertices.at(at + j);
                }
            }
        });
        Ok(())
    }

    /// The attempts of a chunk, from its vertices and records.
    fn judge(
        &self,
        curves: &Range<usize>,
        slots: &[u32],
        results: &[Downloaded],
        coords: &[f64],
        attempts: &mut [Attempt],
    ) {
        let (states, records) = (results[0].as_slice::<DescentState>(), results[1].numbers());
        let ends: Vec<usize> = (0..=curves.len()).collect();
        parallel::parts(attempts, &ends, |k, attempt| {
            let i = curves.start + k;
            let Some(Plain { shape, size, energy_unit }) = self.plain[i] else { return };
            let slot = slots[k] as usize;
            let DescentState { termination: code, iterations, evaluations, .. } = states[slot];
            let termination = termination(code);
            let record = |number: usize| records.at(slot * RECORD + number);
            let (tolerance, energy, norm) = (record(0), record(1), record(2).sqrt());
            let vertices = coords[self.offsets[i]..self.offsets[i + 1]].as_chunks::<D>().0;
            let is_watched = D == 2 && self.fair.energy.is_taut() && termination == TerminationStatus::Converged;
            let is_tangled = || {
                let rows: Vec<u32> = (0..=vertices.len()).step_by(self.segments).map(|row| row as u32).collect();
                !tangled(vertices, &rows, shape.closed).is_empty()
            };
            let is_unresolved = self.fair.tolerance < COARSEST_IN_F32 && tolerance >= f64::from(COARSEST_IN_F32 as f32);
            let is_short = matches!(termination, TerminationStatus::Exhausted | TerminationStatus::Stalled);
            let is_for_f64 = self.may_finish_on_cpu && (is_unresolved || is_short);
            attempt[0] = if termination == TerminationStatus::Running && self.is_in_f32 {
                Attempt::ForHost
            } else if code == LEFT || termination == TerminationStatus::Running || is_for_f64 {
                Attempt::ForCpu
            } else if is_watched && !is_simple(vertices, shape.closed) && is_tangled() {
                Attempt::Tangled([energy, norm], [iterations, evaluations])
            } else {
                let ending = Ending {
                    termination,
                    iterations,
                    energy: energy * energy_unit,
                    norm,
                    tolerance: self.fair.tolerance,
                    times: record(3) * size / self.chords(i),
                    deviation: 0.0,
                    is_attached: false,
                };
                let (report, is_fitted) = self.fair.report_of(self.batch, i, &ending);
                Attempt::Ended(report, is_fitted)
            };
        });
    }
}

/// Dispatches an entry of `resident.wgsl`.
fn dispatch(
    recording: &mut Recording<'_>,
    entry: &'static str,
    params: ResidentParams,
    tasks: usize,
    arrays: &[(&str, &Buffer)],
) -> Result<()> {
    let params = recording.uniform(&params);
    let bound: Vec<(&str, &Buffer)> = [("params", &params)].iter().chain(arrays).copied().collect();
    recording.dispatch(&kernel(entry, recording.precision()), tasks, GROUP, &bound)
}

/// Descends by at most [`MOST_TICKS`] ticks. Before each dispatch the curves that run are listed.
/// The longest curve has `rows` vertices.
fn descend(
    recording: &mut Recording<'_>,
    form: &Form<'_>,
    params: ResidentParams,
    rows: usize,
    arrays: &[(&str, &Buffer)],
) -> Result<()> {
    let most = (LOOP_TURNS / loop_turns(form.plan.order, form.lanes, rows)) as u32;
    let mut left = MOST_TICKS;
    while left > 0 {
        let ticks = left.min(most.clamp(1, TICKS_TOGETHER));
        left -= ticks;
        let descent = DescentParams { tasks: 0, numbers: params.numbers, ticks, lanes: form.lanes as u32 };
        let listed = recording.upload_control(&descent);
        let workgroups = recording.upload_control(&[0u32, 1, 1]);
        let bound: Vec<(&str, &Buffer)> =
            [("listed", &listed), ("workgroups", &workgroups)].iter().chain(arrays).copied().collect();
        dispatch(recording, "list", ResidentParams { ticks, ..params }, params.slots as usize, &bound)?;
        let bound: Vec<(&str, &Buffer)> = [("params", &listed)].iter().chain(arrays).copied().collect();
        recording.dispatch_listed(&form.kernel(recording.precision()), &workgroups, &bound)?;
    }
    Ok(())
}

#[cfg(all(test, feature = "gpu"))]
mod tests;
