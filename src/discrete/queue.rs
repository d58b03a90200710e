//! [`Queue`]: runs the strategies of all curves, and batches the descents that they request.
//!
//! ```text
//! curve ─ problem ─► desk ─► group of one energy ─► CPU lanes │ GPU kernel ─► outcome ─► curve …
//! ```
//!
//! A strategy (continuation, restarts, multipliers, …) is an `async fn` for one curve, compiled
//! into a state machine. Only the queue handles many curves. It polls every curve until it requests
//! a descent or is done, runs the requested descents side by side, and returns the outcomes. A GPU
//! gets all curves at once. On the CPU each thread runs a [part](parts) of them from the first poll
//! to the end, so no thread waits for others and memory stays with its thread.

use std::collections::BTreeMap;
use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::sync::Mutex;
use std::task::{Context, Poll, Waker};

use super::curve_limits::limit_terms;
use super::descent_gpu::descend_on_gpu;
use super::energy::Energy;
use super::fair::{Fair, Segments};
use super::groups::Groups;
use super::plan::{Plan, Solver};
use super::problem::{LANES, Outcome, Problem, Workspace, descend_here, descend_on_cpu};
use super::separation::SeparatingHalfPlanes;
use super::setup::MOST_EDGES_IN_F32;
use super::within::has_kernel;
use crate::batch::CurveBatch;
use crate::device::{Device, DeviceReport};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::parallel;
use crate::precision::Precision;
use crate::sort;

/// The most curves in progress on a GPU. Others start as these finish.
const MOST_UNDER_WAY: usize = 1 << 20;

/// The most curves of a part.
const MOST_AT_A_TIME: usize = 256;

/// The number of parts per CPU thread, if there are enough curves to fill lanes.
const PARTS: usize = 8;

/// What a descent minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Goal {
    /// The requested energy.
    Free,
    /// The energy of a stage of the [continuation](super::continuation).
    Stage(usize),
    /// The requested energy with the terms of limits.
    Limited,
}

/// An energy, with the plan and the device of its descents.
struct Descender<'a> {
    energy: Energy,
    plan: Plan,
    gpu: Option<(&'a Gpu, Precision)>,
}

/// The descents of a fit.
pub(super) struct Queue<'a> {
    device: &'a Device,
    free: Descender<'a>,
    /// The bound of the exponents of every stage, and its energy.
    stages: Vec<(f64, Descender<'a>)>,
    limited: Option<Descender<'a>>,
}

/// The running strategy of one curve.
pub(super) type Task<'t, T> = Pin<Box<dyn Future<Output = T> + Send + 't>>;

/// A slot for the request of one curve, and for the answer.
pub(super) struct Desk<const D: usize>(Mutex<State<D>>);

enum State<const D: usize> {
    Idle,
    Asked { problem: Box<Problem<D>>, goal: Goal, on_cpu: bool },
    Answered(Box<Problem<D>>, Outcome<D>),
}

impl<const D: usize> Desk<D> {
    /// A desk for each of n curves.
    pub fn of(n: usize) -> Vec<Self> {
        (0..n).map(|_| Desk(Mutex::new(State::Idle))).collect()
    }

    fn replace(&self, state: State<D>) -> State<D> {
        std::mem::replace(&mut *self.0.lock().expect("no thread panics at a desk"), state)
    }
}

/// The fit of one curve.
#[derive(Clone, Copy)]
pub(super) struct CurveFit<'a, const D: usize> {
    pub fair: &'a Fair,
    pub batch: &'a CurveBatch,
    /// The index of the curve in the batch.
    pub i: usize,
    /// Whether the curve keeps its first and its last point regardless of the pins.
    pub kept: [bool; 2],
    pub queue: &'a Queue<'a>,
    pub desk: &'a Desk<D>,
    /// Whether this is a repetition, which few curves need. The CPU descends these: a GPU takes
    /// about as long for a few curves as for all.
    pub is_repeated: bool,
}

impl<const D: usize> CurveFit<'_, D> {
    /// Descends once, on the device of the fit.
    pub async fn descend(&self, problem: Box<Problem<D>>, goal: Goal) -> (Box<Problem<D>>, Outcome<D>) {
        self.ask(problem, goal, self.is_repeated).await
    }

    /// Descends once, on the CPU in f64.
    pub async fn descend_on_cpu(&self, problem: Box<Problem<D>>, goal: Goal) -> Outcome<D> {
        self.ask(problem, goal, true).await.1
    }

    async fn ask(&self, problem: Box<Problem<D>>, goal: Goal, on_cpu: bool) -> (Box<Problem<D>>, Outcome<D>) {
        self.desk.replace(State::Asked { problem, goal, on_cpu });
        poll_fn(|_| match self.desk.replace(State::Idle) {
            State::Answered(problem, outcome) => Poll::Ready((problem, outcome)),
            asked => {
                self.desk.replace(asked);
                Poll::Pending
            }
        })
        .await
    }

    /// The energy that a descent minimises.
    pub fn energy(&self, goal: Goal) -> &Energy {
        &self.queue.descender(goal).energy
    }

    /// The stages of a continuation, with their bounds of the exponents.
    pub fn stages(&self) -> impl Iterator<Item = (f64, Goal)> {
        self.queue.stages.iter().enumerate().map(|(k, (bound, _))| (*bound, Goal::Stage(k)))
    }

    /// The same fit, repeated.
    pub fn repeated(&self) -> Self {
        CurveFit { is_repeated: true, ..*self }
    }

    /// Whether descents are in f32.
    pub fn is_in_f32(&self, goal: Goal) -> bool {
        !self.is_repeated && self.queue.is_in_f32(goal)
    }

    /// Whether the solver is Newton's method.
    pub fn is_newton(&self) -> bool {
        self.fair.solver == Solver::Newton
    }
}

impl<'a> Queue<'a> {
    /// A queue for fitting these curves on a device.
    ///
    /// # Errors
    /// A precision that the device does not support.
    pub fn new<const D: usize>(
        fair: &Fair,
        batch: &CurveBatch,
        separating: &SeparatingHalfPlanes,
        device: &'a Device,
    ) -> Result<Self> {
        let is_well_conditioned = match fair.segments {
            Segments::PerSpan(n) => n <= MOST_EDGES_IN_F32 as usize,
            Segments::Spacing(spacing) => {
                let suits = |chord: f64| chord <= f64::from(MOST_EDGES_IN_F32) * spacing;
                (0..batch.len()).all(|i| batch.chords(i).all(suits))
            }
        };
        let descender = |energy: Energy| Descender::new(fair, energy, is_well_conditioned, device);
        let stages = fair.energy.stages().into_iter();
        let stages = stages.map(|bound| Ok((bound, descender(fair.energy.within(bound))?)));
        let limit_terms = limit_terms::<D>(&fair.limits, batch, separating, fair.surface.is_some());
        let limited = limit_terms.map(|limit_terms| descender(fair.energy.with_limits(limit_terms)));
        let free = descender(fair.energy.clone())?;
        Ok(Queue { device, stages: stages.collect::<Result<_>>()?, limited: limited.transpose()?, free })
    }

    fn descender(&self, goal: Goal) -> &Descender<'a> {
        match goal {
            Goal::Free => &self.free,
            Goal::Stage(k) => &self.stages[k].1,
            Goal::Limited => self.limited.as_ref().expect("a curve with limits"),
        }
    }

    /// The GPU that descends the requested energy, if one does.
    pub fn gpu(&self) -> Option<(&'a Gpu, Precision)> {
        self.free.gpu
    }

    /// Whether descents of this goal are in f32.
    fn is_in_f32(&self, goal: Goal) -> bool {
        self.descender(goal).gpu.is_some_and(|(_, precision)| precision == Precision::F32)
    }

    /// Whether the CPU finishes descents that f32 leaves short.
    pub fn may_finish_on_cpu(&self) -> bool {
        self.device.precision() == Precision::Auto
    }

    /// The device report, with the number of curves that the CPU finished.
    ///
    /// # Errors
    /// A precision that the device does not support.
    pub fn report(&self, finished_on_cpu: usize) -> Result<DeviceReport> {
        Ok(match self.free.gpu {
            Some((_, precision)) => DeviceReport { finished_on_cpu, ..self.device.report_of(precision) },
            None => Device::cpu().report(true)?,
        })
    }

    /// Runs the strategies of curves of these sizes to completion, and returns their results in
    /// order. Strategy k uses desk k.
    ///
    /// # Errors
    /// Errors of submissions to a GPU.
    pub fn run<'t, T: Send, const D: usize>(
        &self,
        desks: &[Desk<D>],
        size: impl Fn(usize) -> usize,
        strategy: impl Fn(usize) -> Task<'t, T> + Sync,
    ) -> Result<Vec<T>> {
        if self.free.gpu.is_some() {
            let all: Vec<usize> = (0..desks.len()).collect();
            return self.run_part(desks, &all, &strategy, None);
        }
        let parts = parts(&(0..desks.len()).map(size).collect::<Vec<_>>());
        let run = |kept: &mut Workspace<D>, p: usize| self.run_part(desks, parts.get(p), &strategy, Some(kept));
        let found = parallel::map_with(parts.len(), 1, Workspace::default, run);
        Ok(parts.restore(found.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten()))
    }

    /// Runs some strategies side by side: on this thread with its buffers, or on all threads or the
    /// GPU.
    fn run_part<'t, T: Send, const D: usize>(
        &self,
        desks: &[Desk<D>],
        curves: &[usize],
        strategy: &impl Fn(usize) -> Task<'t, T>,
        mut kept: Option<&mut Workspace<D>>,
    ) -> Result<Vec<T>> {
        let mut done: Vec<Option<T>> = curves.iter().map(|_| None).collect();
        let mut others = curves.iter().enumerate();
        let mut running: Vec<Running<'t, T>> = Vec::new();
        loop {
            let next = others.by_ref().take(MOST_UNDER_WAY - running.len());
            running.extend(next.map(|(place, &k)| Running { place, k, task: strategy(k) }));
            if running.is_empty() {
                return Ok(done.into_iter().map(|done| done.expect("every curve ends")).collect());
            }
            let all = std::mem::take(&mut running);
            let polled = match kept {
                Some(_) => all.into_iter().map(Running::poll).collect(),
                None => parallel::of(all, Running::poll),
            };
            for (own, polled) in polled {
                match polled {
                    Poll::Ready(found) => done[own.place] = Some(found),
                    Poll::Pending => running.push(own),
                }
            }
            self.answer(desks, &running, kept.as_deref_mut())?;
        }
    }

    /// Runs the descents that these curves have requested.
    fn answer<T, const D: usize>(
        &self,
        desks: &[Desk<D>],
        curves: &[Running<'_, T>],
        mut kept: Option<&mut Workspace<D>>,
    ) -> Result<()> {
        let mut groups = BTreeMap::new();
        for Running { k, .. } in curves {
            let State::Asked { problem, goal, on_cpu } = desks[*k].replace(State::Idle) else { continue };
            groups.entry((goal, on_cpu)).or_insert_with(Vec::new).push((*k, problem));
        }
        for ((goal, on_cpu), asked) in groups {
            let Descender { energy, plan, gpu } = self.descender(goal);
            let all: Vec<&Problem<D>> = asked.iter().map(|(_, problem)| &**problem).collect();
            // Checks the flag that cancels the fit.
            let ended = |_: usize, _: &Outcome<D>| self.device.finished(0);
            let outcomes = match (gpu.filter(|_| !on_cpu), kept.as_deref_mut()) {
                (Some((gpu, precision)), _) => descend_on_gpu(gpu, precision, plan, energy, &all, &ended)?,
                (None, Some(kept)) => descend_here(plan, energy, &all, &ended, kept),
                (None, None) => descend_on_cpu(plan, energy, &all, &ended),
            };
            for ((k, problem), outcome) in asked.into_iter().zip(outcomes) {
                desks[k].replace(State::Answered(problem, outcome));
            }
        }
        Ok(())
    }
}

/// A running strategy.
struct Running<'t, T> {
    /// Its index in its part.
    place: usize,
    /// The index of its desk.
    k: usize,
    task: Task<'t, T>,
}

impl<T> Running<'_, T> {
    fn poll(mut self) -> (Self, Poll<T>) {
        let polled = self.task.as_mut().poll(&mut Context::from_waker(Waker::noop()));
        (self, polled)
    }
}

/// Divides curves of these sizes into parts, one per task of a thread. A part has curves of similar
/// sizes.
fn parts(sizes: &[usize]) -> Groups {
    let order = sort::order(sizes.len(), &|i, j| sizes[i].cmp(&sizes[j]));
    let enough = sizes.iter().sum::<usize>() / (PARTS * parallel::threads());
    let mut sum = 0;
    Groups::of(order, |part, _| {
        sum += sizes[part[part.len() - 1]];
        let is_full = part.len() == MOST_AT_A_TIME || (part.len() >= LANES && sum >= enough);
        sum = if is_full { 0 } else { sum };
        is_full
    })
}

impl<'a> Descender<'a> {
    fn new(fair: &Fair, energy: Energy, is_well_conditioned: bool, device: &'a Device) -> Result<Self> {
        let plan = fair.plan(&energy);
        let Some(gpu) = device.as_gpu() else { return Ok(Descender { energy, plan, gpu: None }) };
        let has_kernel = |precision| match &fair.surface {
            None => true,
            Some(surface) => match surface.local() {
                Some((local, _)) => has_kernel(&*local, precision, gpu.limits()),
                None => has_kernel(&**surface, precision, gpu.limits()),
            },
        };
        // f32 has too few digits for order 3 and for limits. Some surfaces have kernels in f64
        // only.
        let needs_f64 = plan.order > 2 || energy.has_limits();
        let precision =
            device.kernel_precision(gpu, is_well_conditioned && !needs_f64 && has_kernel(Precision::F32))?;
        // No kernel has the inner product of order 3, or the area.
        let is_known = (plan.order < 3 || plan.solver == Solver::Newton) && !energy.has_area();
        let is_open = is_known && (!needs_f64 || precision == Precision::F64) && has_kernel(precision);
        Ok(Descender { energy, plan, gpu: is_open.then_some((gpu, precision)) })
    }
}
