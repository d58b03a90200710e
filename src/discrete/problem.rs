//! [`Problem`]: the minimisation problem of one curve, and descents of many of them on the CPU.
//!
//! The CPU descends several curves side by side in lanes.

use std::f64::consts::TAU;

use super::descent::Descent;
use super::edges::Edges;
use super::enclosed::Enclosing;
use super::energy::{Anchor, Energy, Functional, LIMIT_KINDS, MOST_EDGES, Penalty, RegionPenalty};
use super::groups::Groups;
use super::lane::{Bounds, TerminationStatus};
use super::newton::{Newton, Weights};
use super::plan::{Plan, Solver};
use super::within::{Local, Within};
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};
use crate::linalg::{Lanes, Real, Scalar, has_wide_registers};
use crate::parallel;
use crate::sort;

/// The number of lanes on the CPU: the f64 numbers in one AVX2 register.
pub(super) const LANES: usize = 4;

/// Curves with more edges than this descend alone.
///
/// Side by side their arrays leave the caches, which costs more than lanes save.
const LONG: usize = 16_384;

/// A span of fewer edges may turn by more than 90° at a vertex without folding.
///
/// A loop in such a span turns by more than 45° at every vertex if all turns are equal.
const FEW: usize = 8;

/// The least λ of closed curves in surfaces without pins and attachments.
///
/// Sliding such a curve along itself and along symmetries of the surface does not change its
/// energy.
const SLIDING: f64 = 1e-7;

/// See [`Problem::rounding_in_f32`].
const ROUNDING_EPSILONS: f64 = 1.1;

/// See [`Outcome::rest`].
const AT_REST: f64 = 16.0;

/// One curve with everything that its descent needs, translated and scaled to size 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct Problem<const D: usize> {
    pub closed: bool,
    /// The edges of the base curve, from which displacements are measured.
    pub base: Vec<Vector<f64, D>>,
    /// The indices of the vertices at data points, in increasing order.
    pub data: Vec<u32>,
    /// The indices of the pinned vertices, in increasing order.
    pub pinned: Vec<u32>,
    /// Attached vertices.
    pub attached: Vec<Attached<D>>,
    /// The weight of each term of the energy at size 1.
    pub weights: Vec<f64>,
    pub regularisation: f64,
    /// The factors of edge-length differences in the regularisation at each vertex.
    ///
    /// 0 at data points.
    pub free: Vec<f64>,
    /// 1/w² of every edge, with w the width of its span at size 1; empty if the energy does not
    /// need it.
    pub taut: Vec<f64>,
    /// The penalties of each kind at each vertex; empty without limits.
    pub penalties: [Vec<Penalty<f64>>; LIMIT_KINDS],
    /// The region penalties of each vertex, one per layer; empty without regions.
    pub regions: Vec<Vec<RegionPenalty<f64, D>>>,
    /// The constraint on the enclosed area of a planar curve.
    pub enclosing: Enclosing<f64>,
    /// The position of each vertex of the base relative to the first vertex of the start; empty
    /// without region constraints and surface.
    pub places: Vec<Vector<f64, D>>,
    /// The surface in which the curve lies.
    pub surface: Option<Local>,
    /// The weight of the highest derivative in the inner product.
    pub highest: f64,
    /// The root mean square of |K| at the start, at which |κ|^ν and κ² weigh the same.
    pub curvature: f64,
    /// The tolerance of the gradient norm.
    pub tolerance: f64,
    /// The length beyond which the curve counts as unbounded.
    ///
    /// Infinite if the energy bounds the length.
    pub longest: f64,
    /// The largest number of accepted steps.
    pub most_iterations: u32,
    /// Whether tangents are given by [short edges](super::constrain).
    pub has_tangents: bool,
}

/// A vertex attached to a data point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attached<const D: usize> {
    pub row: u32,
    /// The data point, as a displacement of the vertex.
    pub target: Vector<f64, D>,
    /// The weight of the vertex in the inner product.
    pub stiffness: f64,
    pub anchor: Anchor<f64, D>,
}

impl<const D: usize> Attached<D> {
    /// A vertex attached by a spring.
    pub fn spring(row: u32, weight: f64, target: Vector<f64, D>) -> Self {
        Attached { row, target, stiffness: weight, anchor: Anchor { spring: weight, ..Anchor::NONE } }
    }
}

/// The result of a descent.
#[derive(Clone, Debug)]
pub(crate) struct Outcome<const D: usize> {
    /// The displacements of the vertices from the base.
    pub displacements: Vec<Vector<f64, D>>,
    pub termination: TerminationStatus,
    /// The energy without the regularisation.
    pub energy: f64,
    /// The decrement √(−g·p).
    pub norm: f64,
    pub iterations: u32,
    /// The number of evaluations of the energy and its gradient.
    pub evaluations: u32,
    /// Whether the CPU did all or part of the descent.
    pub on_cpu: bool,
}

impl<const D: usize> Outcome<D> {
    /// A displacement without a descent.
    pub fn moved(displacements: Vec<Vector<f64, D>>) -> Self {
        Outcome {
            displacements,
            termination: TerminationStatus::Running,
            energy: f64::NAN,
            norm: f64::NAN,
            iterations: 0,
            evaluations: 0,
            on_cpu: false,
        }
    }

    /// Appends a descent that started from the result of this one.
    pub fn go_on(&mut self, after: Outcome<D>) {
        let sum = self.displacements.iter().zip(&after.displacements).map(|(before, after)| add(*before, *after));
        let displacements = sum.collect();
        let iterations = self.iterations + after.iterations;
        let evaluations = self.evaluations + after.evaluations;
        let on_cpu = self.on_cpu || after.on_cpu;
        *self = Outcome { displacements, iterations, evaluations, on_cpu, ..after };
    }

    /// Whether another descent can start from this result.
    pub fn leads_on(&self) -> bool {
        matches!(
            self.termination,
            TerminationStatus::Converged | TerminationStatus::Exhausted | TerminationStatus::Stalled
        )
    }

    /// Whether rounding or the number of iterations ended the descent.
    pub fn is_short(&self) -> bool {
        matches!(self.termination, TerminationStatus::Exhausted | TerminationStatus::Stalled)
    }

    /// Whether a descent by other means may improve the result.
    pub fn is_open(&self) -> bool {
        matches!(
            self.termination,
            TerminationStatus::Exhausted | TerminationStatus::Stalled | TerminationStatus::Unbounded
        )
    }

    /// Treats a stalled f32 descent as converged if its gradient is within [`AT_REST`] tolerances.
    ///
    /// Of 1,800 curves with bending in an ellipsoid, 14 stalled above the tolerance, within 4e-7 of
    /// their size of the f64 result. 13 of them were within 16 tolerances.
    pub fn rest(&mut self, tolerance: f64) {
        if self.termination == TerminationStatus::Stalled && self.norm <= AT_REST * tolerance {
            self.termination = TerminationStatus::Converged;
        }
    }
}

impl<const D: usize> Problem<D> {
    /// The number of vertices.
    pub fn vertices(&self) -> usize {
        self.base.len() + usize::from(!self.closed)
    }

    /// The stopping criteria of its descent.
    fn bounds(&self) -> Bounds {
        Bounds { tolerance: self.tolerance, longest: self.longest, most_iterations: self.most_iterations }
    }

    /// Whether the curve has neither pins nor attachments.
    pub fn is_loose(&self) -> bool {
        self.pinned.is_empty() && self.attached.is_empty()
    }

    /// The weight of |g|² at each vertex in the inner product of a curve without pins and
    /// attachments.
    ///
    /// A translation then weighs as much as the longest wave, 2w |D₂g|² for g″ = (2π/ℓ)² g.
    fn stiffness_of_all(&self) -> f64 {
        let length = self.length();
        2.0 * self.highest * (TAU / length).powi(4) * length / self.base.len() as f64
    }

    /// The length of the base.
    pub fn length(&self) -> f64 {
        self.base.iter().map(|edge| dot(*edge, *edge).sqrt()).sum()
    }

    /// Whether only its edges, pins and energy determine the curve.
    fn is_plain(&self) -> bool {
        self.attached.is_empty()
            && self.regions.is_empty()
            && self.penalties.iter().all(Vec::is_empty)
            && self.enclosing.stiffness == 0.0
            && self.surface.is_none()
    }

    fn shape(&self) -> Shape<'_> {
        Shape {
            closed: self.closed,
            edges: self.base.len(),
            is_plain: self.is_plain(),
            is_attached: !self.attached.is_empty(),
            has_regularisation: self.regularisation != 0.0,
            pinned: &self.pinned,
        }
    }

    /// Replaces a finished curve of the same shape in a lane.
    fn take_place<S: Scalar>(&self, descent: &mut Descent<'_, S, D>, l: usize) {
        descent.edges.lay(l, &self.base, |row| self.free[row]);
        descent.edges.set_taut(l, &self.taut);
        descent.replace(l, &self.weights, [self.highest, self.regularisation], &self.bounds());
    }

    /// The largest turn of its data polygon, as |T′ − T|².
    ///
    /// Of six measures tried it predicts the number of iterations best. If curves side by side need
    /// the same number, no lane is idle.
    fn sharpest(&self) -> f64 {
        let chord = |from: u32, to: u32| {
            let chord = self.base[from as usize..to as usize].iter().fold([0.0; D], |sum, edge| add(sum, *edge));
            scale(1.0 / dot(chord, chord).sqrt(), chord)
        };
        let end = self.base.len() as u32;
        let ends = self.data.iter().copied().chain((self.data.last() != Some(&end)).then_some(end));
        let ways: Vec<Vector<f64, D>> = ends.clone().zip(ends.skip(1)).map(|(from, to)| chord(from, to)).collect();
        let turn = |pair: &[Vector<f64, D>]| {
            let turn = subtract(pair[1], pair[0]);
            dot(turn, turn)
        };
        ways.windows(2).map(turn).fold(0.0, f64::max)
    }

    /// Makes the curve with these displacements the new base.
    pub fn rebase(&mut self, u: &[Vector<f64, D>]) {
        let count = u.len();
        for (j, edge) in self.base.iter_mut().enumerate() {
            *edge = add(*edge, subtract(u[(j + 1) % count], u[j]));
        }
        for attached in &mut self.attached {
            attached.target = subtract(attached.target, u[attached.row as usize]);
        }
        for (row, u) in u.iter().enumerate() {
            self.places.get_mut(row).into_iter().for_each(|place| *place = add(*place, *u));
            self.regions.iter_mut().for_each(|regions| regions[row].foot = subtract(regions[row].foot, *u));
        }
    }

    /// The problem with these displacements as its new base.
    pub fn rebased(&self, u: &[Vector<f64, D>]) -> Self {
        let mut problem = self.clone();
        problem.rebase(u);
        problem
    }

    /// Whether the polygon with these displacements turns by more than 90° at a vertex.
    ///
    /// Turns next to spans of fewer than [`FEW`] edges come from the data and do not count.
    pub fn folds(&self, u: &[Vector<f64, D>]) -> bool {
        let (count, vertices) = (self.base.len(), self.vertices());
        let edge = |j: usize| add(self.base[j], subtract(u[(j + 1) % vertices], u[j]));
        let rows = |k: usize| self.data[k] as usize;
        let edges_beside = |j: usize| match self.data.partition_point(|&row| row as usize <= j) {
            0 => count,
            k if k < self.data.len() => rows(k) - rows(k - 1),
            k if self.closed => count - rows(k - 1) + rows(0),
            k => count - rows(k - 1),
        };
        (0..if self.closed { count } else { count.saturating_sub(1) }).any(|j| {
            let next = (j + 1) % count;
            dot(edge(j), edge(next)) < 0.0 && edges_beside(j).min(edges_beside(next)) >= FEW
        })
    }

    /// The gradient norm that rounding in f32 may leave.
    ///
    /// It is 1.1 ε √(w E)/h, with half the weight w of the inner product, the energy E of the base
    /// and the mean edge length h.
    ///
    /// Measured floors are 0.13 to 0.56 ε √(w E)/h, for 64 and for 256 edges. Twice the largest
    /// floor can be reached. Curves of 64 edges then end within 1e-6 of their size of the f64
    /// result.
    pub fn rounding_in_f32(&self, energy: &Energy) -> f64 {
        let (energy, length) = self.at_base(energy);
        // Projections onto a surface are rounded too: floors up to twice the bound without a
        // surface occurred.
        let feet = if self.surface.is_some() { 4.0 } else { 1.0 };
        feet * ROUNDING_EPSILONS
            * f64::from(f32::EPSILON)
            * (0.5 * self.highest * energy).sqrt()
            * self.base.len() as f64
            / length
    }

    /// The energy of the base at size 1, without regularisation and attachments.
    pub fn energy_of_base(&self, energy: &Energy) -> f64 {
        Problem { attached: vec![], regions: vec![], ..self.clone() }.at_base(energy).0
    }

    /// The energy of the attachments of the base.
    pub fn energy_of_holds(&self) -> f64 {
        self.attached.iter().map(|attached| attached.anchor.value(attached.target.map(|x| -x))).sum()
    }

    /// The energy without the regularisation, and the length of the base.
    fn at_base(&self, energy: &Energy) -> (f64, f64) {
        let functionals: Vec<&Functional> = energy.terms().iter().map(|(_, functional)| functional).collect();
        let plan = Plan { solver: Solver::default(), order: energy.order(), regularisation: 0 };
        let mut at_base = start::<f64, D>(&plan, &functionals, &[self]);
        (at_base.energy_without_regularisation(), at_base.edges.total_length())
    }

    /// Whether two curves can descend side by side.
    ///
    /// Both must be open or both closed, with similar numbers of edges. Their pins must have the
    /// same indices as far as both curves extend.
    fn suits(&self, other: &Self) -> bool {
        let (short, long) = if self.base.len() <= other.base.len() { (self, other) } else { (other, self) };
        let pins = short.pinned.len();
        let boundary = |problem: &Self| problem.pinned.get(pins).copied().unwrap_or(problem.base.len() as u32);
        self.closed == other.closed
            && 2 * short.base.len() >= long.base.len()
            && (!self.closed
                || order_of(MOST_EDGES, true, short.base.len()) == order_of(MOST_EDGES, true, long.base.len()))
            && self.attached.is_empty() == other.attached.is_empty()
            && pins <= long.pinned.len()
            && short.pinned[..] == long.pinned[..pins]
            && (!short.closed || short.base.len() == long.base.len() || boundary(long) == short.base.len() as u32)
    }
}

/// The order of the inner product.
///
/// It must be less than the number of vertices of a closed curve.
pub(super) fn order_of(order: usize, closed: bool, vertices: usize) -> usize {
    if closed { order.min(vertices - 1) } else { order }
}

/// The callback for every finished curve, with its index.
pub(crate) type Ended<'a, const D: usize> = &'a (dyn Fn(usize, &Outcome<D>) + Sync);

/// Descends every curve in f64, on all threads of the CPU.
///
/// `ended` is called for a curve when all curves beside it have finished too.
pub(crate) fn descend_on_cpu<const D: usize>(
    plan: &Plan,
    energy: &Energy,
    problems: &[&Problem<D>],
    ended: Ended<'_, D>,
) -> Vec<Outcome<D>> {
    let groups = groups(problems, LANES);
    let descend = |kept: &mut Workspace<D>, k: usize| kept.descend(plan, energy, problems, groups.get(k), ended);
    let found = parallel::map_with(groups.len(), 1, Workspace::default, descend);
    groups.restore(found.into_iter().flatten())
}

/// Descends every curve in f64, on this thread.
pub(super) fn descend_here<const D: usize>(
    plan: &Plan,
    energy: &Energy,
    problems: &[&Problem<D>],
    ended: Ended<'_, D>,
    kept: &mut Workspace<D>,
) -> Vec<Outcome<D>> {
    let groups = groups(problems, usize::MAX);
    groups.restore((0..groups.len()).flat_map(|k| kept.descend(plan, energy, problems, groups.get(k), ended)))
}

/// What plain curves must have in common to replace each other in a lane.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Shape<'a> {
    closed: bool,
    edges: usize,
    is_plain: bool,
    is_attached: bool,
    has_regularisation: bool,
    pinned: &'a [u32],
}

/// Groups of at most [`LANES`] curves, or of at most `most` curves that can replace each other.
fn groups<const D: usize>(problems: &[&Problem<D>], most: usize) -> Groups {
    let keys: Vec<_> = problems.iter().map(|problem| (problem.shape(), problem.sharpest())).collect();
    let order = sort::order(problems.len(), &|i, j| {
        let [(shape, sharpest), (other, other_sharpest)] = [i, j].map(|i| &keys[i]);
        shape.cmp(other).then_with(|| sharpest.total_cmp(other_sharpest))
    });
    Groups::of(order, |group, next| {
        let is_alike = keys[next].0.is_plain && keys[group[0]].0 == keys[next].0;
        let room = if is_alike { most } else { LANES };
        group.len() >= room || problems[next].base.len() > LONG || !problems[group[0]].suits(problems[next])
    })
}

/// Buffers of descents, which later descents reuse.
#[derive(Default)]
pub(super) struct Workspace<const D: usize> {
    in_lanes: Option<Newton<Lanes<f64, LANES>, D>>,
    alone: Option<Newton<f64, D>>,
}

impl<const D: usize> Workspace<D> {
    /// Descends the curves of a group.
    fn descend(
        &mut self,
        plan: &Plan,
        energy: &Energy,
        problems: &[&Problem<D>],
        group: &[usize],
        ended: Ended<'_, D>,
    ) -> Vec<Outcome<D>> {
        let functionals: Vec<&Functional> = energy.terms().iter().map(|(_, functional)| functional).collect();
        let members: Vec<&Problem<D>> = group.iter().map(|&i| problems[i]).collect();
        let outcomes = if members.len() > 1 && has_wide_registers() {
            descend::<Lanes<f64, LANES>, D>(plan, &functionals, &members, &mut self.in_lanes)
        } else {
            let own = |member| descend::<f64, D>(plan, &functionals, &[member], &mut self.alone);
            members.into_iter().flat_map(own).collect()
        };
        group.iter().zip(&outcomes).for_each(|(&i, outcome)| ended(i, outcome));
        outcomes
    }
}

/// Descends curves that can share lanes: up to S::LANES, or more if all have the same shape.
///
/// When half of the lanes have finished, waiting curves take their place. `kept` holds buffers of
/// earlier descents.
pub(crate) fn descend<S: Scalar, const D: usize>(
    plan: &Plan,
    functionals: &[&Functional],
    members: &[&Problem<D>],
    kept: &mut Option<Newton<S, D>>,
) -> Vec<Outcome<D>> {
    let mut in_lanes: Vec<usize> = (0..members.len().min(S::LANES)).collect();
    let mut waiting = in_lanes.len()..members.len();
    let mut outcomes: Vec<Option<Outcome<D>>> = members.iter().map(|_| None).collect();
    let mut descent = start::<S, D>(plan, functionals, &members[..in_lanes.len()]);
    let newton = descent.newton(kept);
    descent.begin();
    loop {
        let has_ended =
            |descent: &Descent<'_, S, D>, l: &usize| descent.lanes[*l].termination != TerminationStatus::Running;
        let ended: Vec<usize> = (0..in_lanes.len()).filter(|l| has_ended(&descent, l)).collect();
        if !descent.is_running() || (!waiting.is_empty() && 2 * ended.len() >= S::LANES) {
            let energy = descent.energy_without_regularisation();
            let is_last = waiting.is_empty();
            for l in ended {
                outcomes[in_lanes[l]].get_or_insert_with(|| outcome(&descent, l, energy));
                if let Some(next) = waiting.next() {
                    in_lanes[l] = next;
                    members[next].take_place(&mut descent, l);
                }
            }
            if is_last {
                return outcomes.into_iter().map(|outcome| outcome.expect("every curve has ended")).collect();
            }
            descent.begin();
        } else {
            descent.tick(newton);
        }
    }
}

fn outcome<S: Scalar, const D: usize>(descent: &Descent<'_, S, D>, l: usize, energy: S) -> Outcome<D> {
    let lane = &descent.lanes[l];
    Outcome {
        displacements: descent.displacements(l),
        termination: lane.termination,
        energy: energy.lane(l).to_f64(),
        norm: lane.norm2.to_f64().sqrt(),
        iterations: lane.iterations,
        evaluations: lane.evaluations,
        on_cpu: true,
    }
}

/// A number of every curve, each in its lane.
fn each<S: Scalar, const D: usize>(lanes: &[&Problem<D>], value: impl Fn(&Problem<D>) -> f64) -> S {
    let mut out = S::ZERO;
    for (l, problem) in lanes.iter().enumerate() {
        out.set_lane(l, number::<S>(value(problem)));
    }
    out
}

/// A descent of up to S::LANES curves that can share lanes, at their bases.
///
/// Unused lanes repeat the first curve, and count as finished.
pub(crate) fn start<'a, S: Scalar, const D: usize>(
    plan: &Plan,
    functionals: &[&'a Functional],
    members: &[&Problem<D>],
) -> Descent<'a, S, D> {
    let lanes: Vec<&Problem<D>> = (0..S::LANES).map(|l| *members.get(l).unwrap_or(&members[0])).collect();
    let edges = edges_of::<S, D>(plan, &lanes);
    let mut movable = vec![S::ZERO; edges.rows()];
    for (l, problem) in lanes.iter().enumerate() {
        (0..problem.vertices()).for_each(|row| movable[row].set_lane(l, S::ONE.lane(0)));
        problem.pinned.iter().for_each(|&row| movable[row as usize].set_lane(l, S::ZERO.lane(0)));
    }
    let (anchors, vertices) = anchors_of(&lanes, edges.rows());
    let layers = members.iter().map(|problem| problem.regions.len()).max().unwrap_or(0);
    let mut regions = vec![vec![RegionPenalty::<S, D>::NONE; if layers > 0 { edges.rows() } else { 0 }]; layers];
    for (l, problem) in lanes.iter().enumerate() {
        for (to, regions) in regions.iter_mut().zip(&problem.regions) {
            to.iter_mut().zip(regions).for_each(|(to, penalty)| to.set_lane(l, penalty));
        }
    }
    let is_sliding = |problem: &Problem<D>| problem.is_loose() && problem.surface.is_some();
    let attached = !anchors.is_empty() || lanes.iter().any(|problem| is_sliding(problem));
    let weights = Weights { highest: each(&lanes, |problem| problem.highest), vertices, attached };
    let terms = functionals.iter().enumerate().map(|(k, f)| (each(&lanes, |problem| problem.weights[k]), *f)).collect();
    let regularisation = each(&lanes, |problem| problem.regularisation);
    let bounds: Vec<Bounds> = lanes.iter().map(|problem| problem.bounds()).collect();
    let limited = |order: usize| order_of(order, lanes[0].closed, lanes[0].vertices());
    // A triangle has no third derivative.
    let order = limited(plan.order);
    // Two vertices are too few for the regularisation. Without it edges can share a length
    // arbitrarily, and H is singular.
    let wanted = plan.order.max(2);
    let has_hessian = limited(wanted) == wanted && lanes[0].regularisation != 0.0;
    let solver = if has_hessian { plan.solver } else { Solver::Sobolev };
    let plan = Plan { solver, order, regularisation: limited(plan.regularisation) };
    let mut descent = Descent::new(plan, edges, movable, weights, terms, regularisation, anchors, &bounds);
    descent.regions = regions;
    for (l, problem) in lanes.iter().enumerate() {
        descent.enclosing.set_lane(l, &problem.enclosing);
        descent.is_enclosing |= problem.enclosing.stiffness > 0.0;
    }
    if const { D == 3 } && lanes[0].surface.is_some() {
        let surfaces: Vec<_> =
            lanes.iter().filter_map(|own| own.surface.as_ref().map(|surface| (surface, &own.places[..]))).collect();
        descent.within = Some(Within::new(&surfaces, &descent.edges));
        descent.least_damping = each(&lanes, |problem| if problem.is_loose() { SLIDING } else { 0.0 });
    }
    descent.lanes[members.len()..].iter_mut().for_each(|lane| lane.termination = TerminationStatus::Exhausted);
    descent
}

/// The edges of curves side by side.
fn edges_of<S: Scalar, const D: usize>(plan: &Plan, lanes: &[&Problem<D>]) -> Edges<S, D> {
    let bases: Vec<&[Vector<f64, D>]> = lanes.iter().map(|problem| &problem.base[..]).collect();
    let mut edges = Edges::<S, D>::new(lanes[0].closed, &bases, |l, v| lanes[l].free[v]);
    for (l, problem) in lanes.iter().enumerate() {
        edges.set_taut(l, &problem.taut);
        edges.set_penalties(l, &problem.penalties);
    }
    if plan.order > 2 {
        edges.stand_for_ends();
    }
    edges
}

/// The anchors of curves side by side (empty if nothing is attached), and the weight of |g|² at
/// each vertex in the inner product.
#[allow(clippy::type_complexity)]
fn anchors_of<S: Scalar, const D: usize>(
    lanes: &[&Problem<D>],
    rows: usize,
) -> (Vec<(Vector<S, D>, Anchor<S, D>)>, Vec<S>) {
    let attached = lanes.iter().any(|problem| !problem.attached.is_empty());
    let mut anchors = vec![([S::ZERO; D], Anchor::<S, D>::NONE); if attached { rows } else { 0 }];
    let mut weights = vec![S::ZERO; rows];
    for (l, problem) in lanes.iter().enumerate() {
        if problem.is_loose() && problem.surface.is_some() {
            let whole = number::<S>(problem.stiffness_of_all());
            weights[..problem.vertices()].iter_mut().for_each(|weight| weight.set_lane(l, whole));
        }
        for attached in &problem.attached {
            let row = attached.row as usize;
            weights[row].set_lane(l, number::<S>(attached.stiffness));
            let (target, anchor) = &mut anchors[row];
            (0..D).for_each(|c| target[c].set_lane(l, number::<S>(attached.target[c])));
            anchor.set_lane(l, &attached.anchor);
        }
    }
    (anchors, weights)
}
