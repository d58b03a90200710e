//! Descents on a GPU: repeated dispatches of `shaders/discrete/descent.wgsl` until no curve is
//! running.

mod forms;
mod lanes;
mod packing;
#[cfg(all(test, feature = "gpu"))]
mod tests;
mod turns;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
pub(crate) use forms::descent_kernels;
use lanes::{fastest, open_lanes};
#[cfg(all(test, feature = "gpu"))]
pub(super) use packing::{DescentCurve, NUMBERS};
pub(super) use packing::{Form, GIVEN, LEFT, Layout, Shape};
pub(super) use turns::loop_turns;
use turns::tasks;

use super::compose::Composition;
use super::energy::{Energy, attachment};
use super::lane::TerminationStatus;
use super::plan::{Plan, Solver};
use super::problem::{Ended, Outcome, Problem, descend_on_cpu, order_of};
use super::within::has_kernel;
use crate::error::{Error, Result};
use crate::gpu::plan::{self, LOOP_TURNS};
use crate::gpu::{Buffer, Gpu, Interrupted, KernelKey, Recording, Rounds, kept, pipeline};
use crate::precision::Precision;
use crate::sort;
use crate::surface::{Surface, SurfaceKernel};

/// Threads per workgroup: a whole wave on the widest hardware.
pub(crate) const GROUP: usize = 64;

/// The most ticks per dispatch. A gentle curve in f32 needs no more than this in total.
///
/// Unfinished curves are compacted after each dispatch. On a software driver this is 10 % faster
/// than four times as many ticks.
const MOST_TICKS: u32 = 16;

/// `DescentParams` of `descent.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DescentParams {
    pub tasks: u32,
    pub numbers: u32,
    pub ticks: u32,
    pub lanes: u32,
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
    pub termination: u32,
    pub iterations: u32,
    pub evaluations: u32,
    pub flags: u32,
    pub since_best: u32,
    pub most_iterations: u32,
}

/// The termination statuses that the kernel reports, by their codes.
///
/// The code is 0 before the first tick.
const TERMINATIONS: [TerminationStatus; 6] = [
    TerminationStatus::Running,
    TerminationStatus::Converged,
    TerminationStatus::Stalled,
    TerminationStatus::Exhausted,
    TerminationStatus::Unbounded,
    TerminationStatus::Broken,
];

/// The arrays of a chunk that are downloaded.
const WANTED: [&str; 3] = ["states", "lanes", "displacements"];

/// The termination status of a code. A code that no kernel writes is a broken curve.
pub(super) fn termination(code: u32) -> TerminationStatus {
    TERMINATIONS.into_iter().find(|own| *own as u32 == code).unwrap_or(TerminationStatus::Broken)
}

/// The number of curves interleaved in memory: one per thread of a workgroup, or a single one if
/// several lanes share it.
fn side(lanes: usize) -> usize {
    if lanes == 1 { GROUP } else { 1 }
}

/// The kernel of a composition, with `lanes` threads per curve. The order of the plan is 1 to 3.
pub(crate) fn descent_kernel(composition: &Composition, plan: &Plan, lanes: usize, precision: Precision) -> KernelKey {
    let mut definitions = composition.definitions.clone();
    let mut define = |name: &str, value: usize| definitions.insert(name.into(), value.to_string());
    define("GROUP", GROUP);
    define("SIDE", side(lanes));
    define(["FIRST", "SECOND", "THIRD"][plan.order - 1], 1);
    if plan.solver == Solver::Sobolev {
        define("SOBOLEV", 1);
    }
    if lanes > 1 {
        define("LANES", 1);
        define("REACH", reach(plan));
    }
    KernelKey { path: "discrete/descent.wgsl", entry: "descend", precision, definitions }
}

/// The number of vertices on either side that a vertex is coupled with.
fn reach(plan: &Plan) -> usize {
    plan.order.max(2)
}

/// Descends every curve from its base.
///
/// The CPU descends some curves in f64, among them:
///
/// - curves too long for one thread, if lanes do not share them;
/// - curves in surfaces whose WGSL code gives up or needs too many loop turns;
/// - curves of order 3, if the precision is f32 (too few digits) or the solver uses Sobolev
///   gradients;
/// - curves whose energy has terms that couple more vertices than the inner product.
///
/// If the device is lost, finished curves are kept. The others are [`TerminationStatus::Running`]
/// at their bases.
///
/// # Errors
/// [`Error::Argument`] for an energy that cannot be compiled into a kernel. Errors of submissions,
/// if no curve was finished.
pub(crate) fn descend_on_gpu<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    plan: &Plan,
    energy: &Energy,
    problems: &[&Problem<D>],
    ended: Ended<'_, D>,
) -> Result<Vec<Outcome<D>>> {
    let run = Run { gpu, precision, plan, energy, problems, most_ticks: MOST_TICKS, lanes: None };
    run.descend(&mut |_| {}, ended)
}

/// One run over many curves.
pub(crate) struct Run<'a, const D: usize> {
    pub gpu: &'a Gpu,
    pub precision: Precision,
    pub plan: &'a Plan,
    pub energy: &'a Energy,
    pub problems: &'a [&'a Problem<D>],
    pub most_ticks: u32,
    /// The number of lanes per curve; `None` to choose it.
    pub lanes: Option<usize>,
}

impl<const D: usize> Run<'_, D> {
    /// Descends all curves.
    ///
    /// `progress` receives the number of curves that have just ended on the device. `ended`
    /// receives each curve when it has been downloaded.
    pub fn descend(&self, progress: &mut dyn FnMut(usize), ended: Ended<'_, D>) -> Result<Vec<Outcome<D>>> {
        let problems = self.problems;
        let open = self.open_lanes(self.composition(&[])?.edges());
        let takes = |lanes: usize, i: usize| self.turns(lanes, i) <= LOOP_TURNS;
        let table = self.table();
        let is_taken = |i: usize| table.is_some() && self.is_for_kernel(i) && open.iter().any(|&lanes| takes(lanes, i));
        let (mut order, mut host): (Vec<usize>, Vec<usize>) = (0..problems.len()).partition(|&i| is_taken(i));
        let kind = |i: usize| (problems[i].vertices(), problems[i].closed, problems[i].pinned.len(), i);
        sort::by(&mut order, |&i, &j| kind(i).cmp(&kind(j)));
        let mut outcomes: Vec<Option<Outcome<D>>> = problems.iter().map(|_| None).collect();
        if let Some(table) = table.filter(|_| !order.is_empty()) {
            let composition = self.composition(&order)?;
            let possible: Vec<usize> =
                open.into_iter().filter(|&lanes| order.iter().all(|&i| takes(lanes, i))).collect();
            let lanes = choose(self.gpu, &possible, reach(self.plan), order.iter().map(|&i| problems[i].vertices()));
            let form = Form { plan: self.plan, energy: self.energy, composition, dimension: D, lanes };
            let job = Job { run: self, form, table };
            kept(job.descend(&order, &mut outcomes, progress, (&mut host, ended)))?;
        }
        let own: Vec<&Problem<D>> = host.iter().map(|&i| problems[i]).collect();
        let descended = descend_on_cpu(self.plan, self.energy, &own, &|k, outcome| ended(host[k], outcome));
        host.into_iter().zip(descended).for_each(|(i, outcome)| outcomes[i] = Some(outcome));
        let unfinished = |(outcome, problem): (Option<Outcome<D>>, &&Problem<D>)| {
            outcome.unwrap_or_else(|| Outcome::moved(vec![[0.0; D]; problem.vertices()]))
        };
        Ok(outcomes.into_iter().zip(problems).map(unfinished).collect())
    }

    /// The numbers of lanes that curves of this run may have, in increasing order.
    ///
    /// `edges` is the largest number of edges that a term depends on.
    fn open_lanes(&self, edges: usize) -> Vec<usize> {
        match self.lanes {
            Some(lanes) if edges == reach(self.plan) => vec![lanes],
            _ => lanes_of::<D>(self.gpu, self.plan, self.energy, edges),
        }
    }

    /// The surface of all curves.
    fn surface(&self) -> Option<&dyn Surface> {
        let local = self.problems.iter().find_map(|problem| problem.surface.as_ref()).filter(|_| D == 3);
        local.map(|local| &*local.surface)
    }

    /// The table of the surface. `None` if it exceeds the device's largest binding.
    fn table(&self) -> Option<Vec<f64>> {
        let table = self.surface().and_then(Surface::kernel).map(SurfaceKernel::table).unwrap_or_default();
        let bytes = table.len() as u64 * self.precision.bytes();
        (bytes <= self.gpu.limits().array_bytes()).then_some(table)
    }

    fn is_for_kernel(&self, i: usize) -> bool {
        let (order, problem) = (self.plan.order, self.problems[i]);
        // A triangle has no third derivative, and the regularisation is of order 2.
        let has_order = order_of(order.max(2), problem.closed, problem.vertices()) == order.max(2);
        // A curve without pins and attachments slides along itself. Only the CPU damps this.
        let is_in_surface = problem.surface.as_ref().is_none_or(|surface| {
            has_kernel(&*surface.surface, self.precision, self.gpu.limits())
                && order == 2
                && self.plan.solver == Solver::Newton
                && !problem.is_loose()
        });
        (order < 3 || self.precision == Precision::F64 && self.plan.solver == Solver::Newton)
            && has_order
            && (problem.regularisation != 0.0 || self.plan.solver == Solver::Sobolev)
            && is_in_surface
    }

    /// The energy for the kernel, with an attachment if any curve has attached points.
    fn composition(&self, curves: &[usize]) -> Result<Composition> {
        let mut energy = self.energy.clone();
        let names = energy.is_attached();
        if !names && curves.iter().any(|&i| !self.problems[i].attached.is_empty()) {
            energy = energy + attachment();
        }
        let composition =
            Composition::of(&energy, self.plan.regularisation, D, self.precision).map_err(Error::Argument)?;
        Ok(match self.surface() {
            Some(surface) if surface.kind().quadric().is_some() => composition.in_surfaces(None),
            Some(surface) => composition.in_surfaces(surface.kernel().map(SurfaceKernel::text).as_deref()),
            None => composition,
        })
    }
}

/// The numbers of lanes that curves may have, in increasing order.
///
/// `edges` is the largest number of edges that a term of the energy depends on.
pub(super) fn lanes_of<const D: usize>(gpu: &Gpu, plan: &Plan, energy: &Energy, edges: usize) -> Vec<usize> {
    let order = reach(plan);
    // A term of weight 0 may couple more vertices than the inner product.
    if edges != order {
        return vec![];
    }
    // Penalties need as many registers as spatial curves: hardware has them only if lanes share a
    // curve.
    let dimension = if energy.has_limits() { 3 } else { D };
    match gpu.lanes() {
        Some(lanes) => vec![lanes],
        None => open_lanes(gpu.summary(), order, dimension).to_vec(),
    }
}

/// Chooses and notes the number of lanes that takes the least time for curves of these sizes.
pub(super) fn choose(
    gpu: &Gpu,
    possible: &[usize],
    order: usize,
    vertices: impl ExactSizeIterator<Item = usize>,
) -> usize {
    let (count, longest) = (vertices.len(), vertices.max().unwrap_or(0));
    let lanes = fastest(possible, order, gpu.summary(), count, longest);
    let each = if lanes == 1 { "a thread each".into() } else { format!("{lanes} threads each") };
    let held = format!("of some {} that the adapter works on at once", gpu.summary().threads());
    gpu.note(format!("{count} curves of up to {longest} vertices have {each}, {held}"));
    lanes
}

struct Job<'a, const D: usize> {
    run: &'a Run<'a, D>,
    form: Form<'a>,
    /// The table that the WGSL code of the surface reads.
    table: Vec<f64>,
}

/// The curves of a chunk in their arrays.
struct Placed {
    layout: Layout,
    /// The loop turns per tick of each curve.
    turns: Vec<usize>,
}

impl<'a, const D: usize> Job<'a, D> {
    fn descend(
        &self,
        order: &[usize],
        outcomes: &mut [Option<Outcome<D>>],
        progress: &mut dyn FnMut(usize),
        (host, ended): (&mut Vec<usize>, Ended<'_, D>),
    ) -> Result<(), Interrupted> {
        let gpu = self.run.gpu;
        let side = self.form.side();
        let members = |groups: &Range<usize>| &order[groups.start * side..(groups.end * side).min(order.len())];
        let words = order.chunks(side).map(|group| self.form.layout(&self.shapes(group)).work.max(1));
        let real = self.run.precision.bytes();
        // All arrays together are smaller than twice the largest.
        let chunks = plan::chunks(words, real, 2 * real, gpu.limits())?;
        let done = pipeline(
            chunks,
            |groups| self.start(members(groups)),
            |rounds: Rounds<Placed>| rounds.advance(|r, l, a, s| self.round(r, l, a, s), &WANTED, &mut *progress),
            |groups, (Placed { layout, .. }, results)| {
                let left = self.unpack(members(groups), &layout, &results, outcomes);
                for (&i, left) in members(groups).iter().zip(left) {
                    match &outcomes[i] {
                        Some(outcome) if !left => ended(i, outcome),
                        _ => host.push(i),
                    }
                }
                Ok(())
            },
        );
        done.map_err(|interrupted| Interrupted { finished: interrupted.finished * side, ..interrupted })
    }

    fn shapes(&self, curves: &[usize]) -> Vec<Shape> {
        let shape = |problem: &Problem<D>| Shape { vertices: problem.vertices(), closed: problem.closed };
        curves.iter().map(|&i| shape(self.run.problems[i])).collect()
    }

    fn start(&self, curves: &[usize]) -> Result<Rounds<'a, Placed>> {
        let layout = self.form.layout(&self.shapes(curves));
        let most = |&i: &usize| self.run.problems[i].most_iterations;
        let state = |i| DescentState { most_iterations: most(i), ..DescentState::zeroed() };
        let states: Vec<DescentState> = curves.iter().map(state).collect();
        let mut recording = self.run.gpu.record(self.run.precision);
        let mut arrays = vec![
            ("curves", recording.upload(&layout.table)),
            ("fixed", self.upload_fixed(&mut recording, curves, &layout)),
            ("states", recording.upload(&states)),
            ("lanes", self.upload_given(&mut recording, curves)),
            ("displacements", recording.storage_reals(layout.displacements)),
            ("work", recording.storage_reals(layout.work)),
        ];
        if self.form.composition.definitions.contains_key("SURFACE_TABLE") {
            arrays.push(("surface_table", recording.upload_reals(&self.table)));
        }
        let of_curves = ("discrete/descent", curves.len());
        let turns = curves.iter().map(|&i| self.run.turns(self.form.lanes, i)).collect();
        let placed = Placed { layout, turns };
        Rounds::start::<DescentState>(of_curves, recording, (placed, arrays), &WANTED, |r, l, a, s| {
            self.round(r, l, a, s)
        })
    }

    /// Descends the listed curves by as many ticks as fit.
    fn round(
        &self,
        recording: &mut Recording<'a>,
        placed: &Placed,
        arrays: &[(&str, &Buffer)],
        slots: &[u32],
    ) -> Result<()> {
        let run = self.run;
        let kernel = self.form.kernel(run.precision);
        let listed = tasks(slots, &placed.turns, run.most_ticks);
        let params = recording.uniform(&DescentParams {
            tasks: slots.len() as u32,
            numbers: self.form.numbers() as u32,
            ticks: listed.iter().map(|task| task.ticks).min().unwrap_or(0),
            lanes: self.form.lanes as u32,
        });
        let tasks = recording.upload(&listed);
        let mut bound = vec![("params", &params), ("tasks", &tasks)];
        bound.extend(arrays);
        recording.dispatch(&kernel, slots.len(), GROUP / self.form.lanes, &bound)
    }
}
