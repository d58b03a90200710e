//! Descents on a GPU: where curves stand in the arrays of `shaders/discrete/descent.wgsl`, and the dispatches until
//! none runs.

mod packing;
#[cfg(test)]
mod tests;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use packing::Layout;

use super::compose::Composition;
use super::energy::{Energy, attachment, bending, length, tension};
use super::lane::Standing;
use super::plan::{Direction, Plan, Step};
use super::problem::{Ended, Outcome, Problem, descend_on_cpu};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Downloaded, Gpu, Interrupted, KernelKey, Pending, Recording, pipeline, plan};
use crate::linalg::Real;
use crate::precision::Precision;

/// Threads a workgroup, whose curves stand side by side in memory.
pub(crate) const GROUP: usize = 32;

/// Ticks a dispatch at most: what a gentle curve needs in f32 in all. Curves that go on are then brought together,
/// and are faster by a tenth on a software driver than with four times as many.
const MOST_TICKS: u32 = 16;

/// Loop turns of a thread in one dispatch: llvmpipe ends a thread's loops, without a word, after 65,535 all told, and
/// watchdogs of hardware end what takes too long.
const LOOP_TURNS: usize = 60_000;

/// `DescentParams` of `descent.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DescentParams {
    pub tasks: u32,
    pub numbers: u32,
    pub most_iterations: u32,
    pub direction: u32,
    pub search: u32,
    pub padding: u32,
    pub padding_too: u32,
    pub padding_three: u32,
}

/// `DescentTask` of `descent.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DescentTask {
    pub slot: u32,
    pub ticks: u32,
}

/// `DescentState` of `descent.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DescentState {
    pub standing: u32,
    pub iterations: u32,
    pub evaluations: u32,
    pub flags: u32,
    pub since_best: u32,
    pub trials: u32,
    pub padding: u32,
    pub padding_too: u32,
}

/// Standing words, as the kernel writes them; 0 is what the host writes before the first tick.
const RUNNING: u32 = 1;

fn standing(word: u32) -> Option<Standing> {
    Some(match word {
        RUNNING => Standing::Running,
        2 => Standing::Converged,
        3 => Standing::Stalled,
        4 => Standing::Exhausted,
        5 => Standing::Unbounded,
        6 => Standing::Broken,
        _ => return None,
    })
}

/// The kernel of a composition with the inner product of an order, 0, 1 or 2; of order 2 it may be Newton's.
pub(crate) fn descent_kernel(
    composition: &Composition,
    order: usize,
    is_newton: bool,
    precision: Precision,
) -> KernelKey {
    let mut definitions = composition.definitions.clone();
    definitions.insert("GROUP".into(), GROUP.to_string());
    for name in [None, Some("FIRST"), Some("SECOND")][order].into_iter().chain(is_newton.then_some("NEWTON")) {
        definitions.insert(name.into(), "1".into());
    }
    KernelKey { path: "discrete/descent.wgsl", entry: "descend", precision, definitions }
}

/// Forms the kernel takes, a few of each order.
pub(crate) fn descent_kernels(precision: Precision) -> Vec<KernelKey> {
    let forms = [
        (length(), 0),
        (tension(), 1),
        (length() + attachment(), 1),
        (bending(2.0), 2),
        (bending(3.0) + length(), 2),
        (bending(2.7) + tension() + attachment(), 2),
    ];
    let mut keys = Vec::new();
    for (energy, order) in forms {
        for dimension in [2, 3] {
            let composition = Composition::of(&energy, order == 2, dimension, precision).expect("built in");
            keys.push(descent_kernel(&composition, order, false, precision));
            if order == 2 {
                keys.push(descent_kernel(&composition, order, true, precision));
            }
        }
    }
    keys
}

/// Descends every curve, from its base: by Newton's method, where the plan asks for it, if the inner product is of order 2, else by
/// conjugate gradients. Curves that are too long for a thread, that keep tangents or curvatures, or
/// whose inner product is of order 3, which f32 cannot hold, are descended by the CPU in f64.
///
/// Where the device is lost, what it had finished is kept, and the other curves come out as [`Standing::Running`] at
/// their bases.
///
/// # Errors
/// [`Error::Argument`] for an energy that no kernel can be made of; those of submissions, if nothing was finished.
pub(crate) fn descend_on_gpu<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    plan: &Plan,
    energy: &Energy,
    problems: &[Problem<D>],
    ended: Ended<'_, D>,
) -> Result<Vec<Outcome<D>>> {
    let run = Run { gpu, precision, plan, energy, problems, most_ticks: MOST_TICKS };
    run.descend(&mut |_| {}, ended)
}

/// One run over many curves.
pub(crate) struct Run<'a, const D: usize> {
    pub gpu: &'a Gpu,
    pub precision: Precision,
    pub plan: &'a Plan,
    pub energy: &'a Energy,
    pub problems: &'a [Problem<D>],
    pub most_ticks: u32,
}

impl<const D: usize> Run<'_, D> {
    /// Descends; `progress` is told of every further number of curves that have ended on the device, `ended` of each curve
    /// when it is back.
    pub fn descend(&self, progress: &mut dyn FnMut(usize), ended: Ended<'_, D>) -> Result<Vec<Outcome<D>>> {
        let problems = self.problems;
        let (mut order, host): (Vec<usize>, Vec<usize>) = (0..problems.len()).partition(|&i| self.is_for_kernel(i));
        order.sort_by_key(|&i| (problems[i].vertices(), problems[i].closed, problems[i].pinned.len(), i));
        let mut outcomes: Vec<Outcome<D>> = problems.iter().map(unfinished).collect();
        if !order.is_empty() {
            let composition = self.composition(&order)?;
            let is_newton =
                self.plan.direction == Direction::Newton && self.plan.order == 2 && composition.edges() == 2;
            let job = Job { run: self, is_newton, composition };
            match job.descend(&order, &mut outcomes, progress, ended) {
                Err(Interrupted { error: Error::DeviceLost(_) | Error::Timeout { .. }, finished }) if finished > 0 => {}
                done => done?,
            }
        }
        let own: Vec<Problem<D>> = host.iter().map(|&i| problems[i].clone()).collect();
        let descended = descend_on_cpu(self.plan, self.energy, &own, &|k, outcome| ended(host[k], outcome));
        host.into_iter().zip(descended).for_each(|(i, outcome)| outcomes[i] = outcome);
        Ok(outcomes)
    }

    fn is_for_kernel(&self, i: usize) -> bool {
        let problem = &self.problems[i];
        self.plan.order <= 2
            && self.plan.gauge <= 2
            && problem.constraints.is_none()
            && loop_turns(self.plan.order, problem.vertices(), problem.pinned.len()) <= LOOP_TURNS
    }

    /// The energy as the kernel has it: attached to points wherever a curve is.
    fn composition(&self, curves: &[usize]) -> Result<Composition> {
        let mut energy = self.energy.clone();
        let names = energy.is_attached();
        if !names && curves.iter().any(|&i| !self.problems[i].attached.is_empty()) {
            energy = energy + attachment();
        }
        Composition::of(&energy, self.plan.gauge > 0, D, self.precision).map_err(Error::Argument)
    }
}

/// What a curve is before anything was found.
fn unfinished<const D: usize>(problem: &Problem<D>) -> Outcome<D> {
    Outcome {
        displacements: vec![[0.0; D]; problem.vertices()],
        standing: Standing::Running,
        energy: f64::NAN,
        norm: f64::NAN,
        iterations: 0,
        evaluations: 0,
    }
}

/// Loop turns of one tick at most: an accepted step and, in another lane of the same subgroup, a restart; loops over
/// the rows, counted in the kernel's text, a few turns more for the windows, and loops over the pins.
fn loop_turns(order: usize, rows: usize, pins: usize) -> usize {
    // The base (once), the sweep, the step, two directions or Newton's system there and back; then the inner product.
    let loops = 5 + [1, 3, 9][order];
    loops * (rows + 8) + if order == 2 { 4 * pins } else { 0 }
}

struct Job<'a, const D: usize> {
    run: &'a Run<'a, D>,
    composition: Composition,
    /// Whether directions are Newton's: not where a term of negative weight couples more vertices than the inner product does.
    is_newton: bool,
}

/// A chunk on the device.
struct UnderWay<'a> {
    pending: Pending<'a>,
    layout: Layout,
    buffers: Vec<(&'static str, Buffer)>,
}

impl<'a, const D: usize> Job<'a, D> {
    fn descend(
        &self,
        order: &[usize],
        outcomes: &mut [Outcome<D>],
        progress: &mut dyn FnMut(usize),
        ended: Ended<'_, D>,
    ) -> Result<(), Interrupted> {
        let gpu = self.run.gpu;
        let nothing = |error: Error| Interrupted { error, finished: 0 };
        let members = |groups: &Range<usize>| &order[groups.start * GROUP..(groups.end * GROUP).min(order.len())];
        let words = order.chunks(GROUP).map(|group| self.layout(group).work.max(1));
        let real = self.real_bytes();
        // All arrays together are less than twice the largest.
        let chunks = plan::chunks(words, real, 2 * real, gpu.limits()).map_err(nothing)?;
        let done = pipeline(
            chunks,
            |groups| match self.run.precision {
                Precision::F64 => self.start::<f64>(members(groups)),
                _ => self.start::<f32>(members(groups)),
            },
            |under_way| self.finish(under_way, progress),
            |groups, (layout, results)| {
                match self.run.precision {
                    Precision::F64 => self.unpack::<f64>(members(groups), &layout, &results, outcomes),
                    _ => self.unpack::<f32>(members(groups), &layout, &results, outcomes),
                }
                members(groups).iter().for_each(|&i| ended(i, &outcomes[i]));
                Ok(())
            },
        );
        done.map_err(|interrupted| Interrupted { finished: interrupted.finished * GROUP, ..interrupted })
    }

    fn real_bytes(&self) -> u64 {
        if self.run.precision == Precision::F64 { 8 } else { 4 }
    }

    fn start<S: Real + Pod>(&self, curves: &[usize]) -> Result<UnderWay<'a>> {
        let layout = self.layout(curves);
        let (given, fixed) = self.pack::<S>(curves, &layout);
        let real = self.real_bytes();
        let mut recording = self.run.gpu.record();
        let buffers = vec![
            ("curves", recording.upload(&layout.table)),
            ("fixed", recording.upload(&fixed)),
            ("pins", recording.upload(&layout.pins)),
            ("states", recording.upload(&vec![DescentState::zeroed(); curves.len()])),
            ("lanes", recording.upload(&given)),
            ("displacements", recording.storage(layout.displacements as u64 * real)),
            ("work", recording.storage(layout.work as u64 * real)),
        ];
        let all: Vec<u32> = (0..curves.len() as u32).collect();
        let pending = self.dispatch(recording, &layout, &buffers, &all)?;
        Ok(UnderWay { pending, layout, buffers })
    }

    /// Lets the curves listed descend by as many ticks as fit, and asks for the states.
    fn dispatch(
        &self,
        mut recording: Recording<'a>,
        layout: &Layout,
        buffers: &[(&'static str, Buffer)],
        slots: &[u32],
    ) -> Result<Pending<'a>> {
        let run = self.run;
        let kernel =
            run.gpu.kernel(&descent_kernel(&self.composition, run.plan.order, self.is_newton, run.precision))?;
        let params = recording.uniform(&DescentParams {
            tasks: slots.len() as u32,
            numbers: self.numbers() as u32,
            most_iterations: run.plan.most_iterations,
            direction: match run.plan.direction {
                Direction::Steepest => 0,
                Direction::PolakRibiere => 1,
                Direction::Hybrid | Direction::Newton => 2,
            },
            search: (run.plan.step == Step::Search).into(),
            padding: 0,
            padding_too: 0,
            padding_three: 0,
        });
        let tasks = recording.upload(&tasks(slots, &layout.turns, run.most_ticks));
        let mut bound = vec![("params", &params), ("tasks", &tasks)];
        bound.extend(buffers.iter().map(|(name, buffer)| (*name, buffer)));
        let groups = plan::workgroups(slots.len(), GROUP, run.gpu.limits())?;
        recording.dispatch(&kernel, groups, &bound)?;
        recording.download(named(buffers, "states"));
        recording.submit()
    }

    /// Dispatches until no curve of a chunk runs; states, numbers and displacements.
    fn finish(&self, under_way: UnderWay<'a>, progress: &mut dyn FnMut(usize)) -> Result<(Layout, Vec<Downloaded>)> {
        let UnderWay { mut pending, layout, buffers } = under_way;
        let mut running = layout.table.len();
        loop {
            let results = pending.wait()?;
            let states = results[0].as_slice::<DescentState>();
            let mut slots = Vec::new();
            for (slot, state) in states.iter().enumerate().take(layout.table.len()) {
                match standing(state.standing) {
                    Some(Standing::Running) => slots.push(slot as u32),
                    Some(_) => {}
                    None => {
                        let message = format!("slot {slot} has the standing {}: no kernel wrote it", state.standing);
                        return Err(Error::Kernel { kernel: "discrete/descent".into(), message });
                    }
                }
            }
            if slots.len() < running {
                progress(running - slots.len());
                running = slots.len();
            }
            let mut recording = self.run.gpu.record();
            if slots.is_empty() {
                ["states", "lanes", "displacements"].iter().for_each(|name| recording.download(named(&buffers, name)));
                return Ok((layout, recording.submit()?.wait()?));
            }
            pending = self.dispatch(recording, &layout, &buffers, &slots)?;
        }
    }
}

fn named<'b>(buffers: &'b [(&'static str, Buffer)], name: &str) -> &'b Buffer {
    &buffers.iter().find(|(own, _)| *own == name).expect("a name of the list").1
}

/// Ticks of the curves listed: the same for all threads of a workgroup, whose loops turn together.
fn tasks(slots: &[u32], turns: &[usize], most_ticks: u32) -> Vec<DescentTask> {
    let mut tasks = Vec::with_capacity(slots.len());
    for group in slots.chunks(GROUP) {
        let longest = group.iter().map(|&slot| turns[slot as usize]).max().unwrap_or(1);
        let ticks = ((LOOP_TURNS / longest) as u32).clamp(1, most_ticks);
        tasks.extend(group.iter().map(|&slot| DescentTask { slot, ticks }));
    }
    tasks
}
