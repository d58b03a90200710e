//! The layout of curves in the arrays of `shaders/discrete/descent.wgsl`, with packing and
//! unpacking.

use bytemuck::{Pod, Zeroable};

use super::{DescentState, Job, descent_kernel, reach, side, termination};
use crate::discrete::compose::Composition;
use crate::discrete::energy::Energy;
use crate::discrete::plan::Plan;
use crate::discrete::problem::{Outcome, Problem};
use crate::gpu::{Buffer, Downloaded, KernelKey, Recording};
use crate::linalg::block_ring::scratch_numbers;
use crate::parallel;
use crate::precision::Precision;

/// The numbers per curve in `lanes` before its weights, and how many of them the host writes.
pub(in crate::discrete) const NUMBERS: usize = 14;
pub(in crate::discrete) const GIVEN: usize = 4;

/// The numbers of a row that hold a vertex, except for the tangent: its stiffness and
/// [`Anchor`](crate::discrete::energy::Anchor).
const HELD: usize = 5;

/// The numbers of a [`Penalty`](crate::discrete::energy::Penalty).
const PENALTY: usize = 3;

/// The scalars of a [`RegionPenalty`](crate::discrete::energy::RegionPenalty).
const REGION: usize = 5;

/// The positions of the numbers that are read back: the energy without the regularisation, and the
/// squared gradient norm.
const REPORTED: usize = GIVEN + 1;
const NORM2: usize = GIVEN + 2;

/// `TERMINATION_STATUS_LEFT`: the kernel gave up and the host descends the curve.
pub(in crate::discrete) const LEFT: u32 = 7;

/// The number of curves that a thread unpacks at a time.
const UNPACKED_TOGETHER: usize = 32;

/// `DescentCurve` of `descent.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DescentCurve {
    pub fixed_start: u32,
    pub displacement_start: u32,
    pub work_start: u32,
    pub stride: u32,
    pub segments: u32,
    pub closed: u32,
}

/// The positions of the curves of a chunk in the arrays.
pub(in crate::discrete) struct Layout {
    pub table: Vec<DescentCurve>,
    pub fixed: usize,
    pub displacements: usize,
    pub work: usize,
}

/// What the layout of a curve depends on.
#[derive(Clone, Copy, Debug)]
pub(in crate::discrete) struct Shape {
    pub vertices: usize,
    pub closed: bool,
}

impl Shape {
    pub fn segments(&self) -> usize {
        self.vertices - usize::from(!self.closed)
    }
}

/// A form of the kernel, with the arrays that it needs.
pub(in crate::discrete) struct Form<'a> {
    pub plan: &'a Plan,
    pub energy: &'a Energy,
    pub composition: Composition,
    pub dimension: usize,
    pub lanes: usize,
}

impl Form<'_> {
    fn is_attached(&self) -> bool {
        self.composition.definitions.contains_key("ATTACHMENT")
    }

    /// The number of curves interleaved in memory.
    pub fn side(&self) -> usize {
        side(self.lanes)
    }

    /// Its kernel.
    pub fn kernel(&self, precision: Precision) -> KernelKey {
        descent_kernel(&self.composition, self.plan, self.lanes, precision)
    }

    /// The numbers per row in `fixed`.
    pub fn fixed_numbers(&self) -> usize {
        self.place_number() + if self.is_in_surfaces() { self.dimension } else { 0 }
    }

    /// The position of a vertex's coordinates in a row, for curves in surfaces.
    fn place_number(&self) -> usize {
        self.region_number() + self.energy.regions() * (2 * self.dimension + REGION)
    }

    fn is_in_surfaces(&self) -> bool {
        self.composition.definitions.contains_key("SURFACE")
    }

    /// The position of the penalties in a row, if there are any.
    fn penalty_number(&self) -> usize {
        self.taut_number() + usize::from(self.is_taut())
    }

    /// The position of the region penalties in a row, if there are any.
    fn region_number(&self) -> usize {
        self.penalty_number() + PENALTY * self.energy.penalties().into_iter().filter(|has| *has).count()
    }

    /// The position of 1/w² in a row, if the energy needs it.
    fn taut_number(&self) -> usize {
        if self.is_attached() { 3 * self.dimension + 2 + HELD } else { self.dimension + 2 }
    }

    fn is_taut(&self) -> bool {
        self.composition.definitions.contains_key("TAUT")
    }

    /// The places of curves of these shapes in the arrays.
    pub fn layout(&self, shapes: &[Shape]) -> Layout {
        let mut layout = Layout { table: vec![], fixed: 0, displacements: 0, work: 0 };
        let (side, d) = (self.side(), self.dimension);
        for group in shapes.chunks(side) {
            let rows = group.iter().map(|shape| shape.vertices).max().unwrap_or(0);
            let has_border = group.iter().any(|shape| shape.closed);
            layout.work += if has_border { self.border_numbers() * rows * side } else { 0 };
            for (place, shape) in group.iter().enumerate() {
                layout.table.push(DescentCurve {
                    fixed_start: (layout.fixed + place) as u32,
                    displacement_start: (layout.displacements + place) as u32,
                    work_start: (layout.work + place) as u32,
                    stride: rows as u32,
                    segments: shape.segments() as u32,
                    closed: shape.closed.into(),
                });
            }
            layout.fixed += rows * self.fixed_numbers() * side;
            layout.displacements += rows * d * side;
            layout.work += self.work_numbers(rows) * side;
        }
        layout
    }

    /// The numbers of one of many curves of a shape in `work`.
    pub fn work_of(&self, shape: Shape) -> usize {
        let border = if shape.closed { self.border_numbers() * shape.vertices } else { 0 };
        border + self.work_numbers(shape.vertices)
    }

    /// The numbers per row of a closed curve before all other sections.
    fn border_numbers(&self) -> usize {
        if self.lanes == 1 { 2 * self.dimension * self.dimension } else { 0 }
    }

    /// The numbers in all sections of a curve.
    fn work_numbers(&self, rows: usize) -> usize {
        // The matrices per row, and the numbers needed once: factors, or blocks with the shared
        // memory of lanes.
        let (order, d) = (reach(self.plan), self.dimension);
        let (matrices, once) = match self.lanes {
            1 => (2, 0),
            lanes => (order + 1, scratch_numbers(rows, order, d, lanes)),
        };
        let in_surface = if self.is_in_surfaces() { 2 + d } else { 0 };
        rows * (3 * d + 1 + in_surface + matrices * d * d) + once
    }

    /// The numbers per curve in `lanes`.
    pub fn numbers(&self) -> usize {
        NUMBERS + self.composition.width()
    }
}

impl<const D: usize> Job<'_, D> {
    /// Uploads the numbers that the host writes.
    pub(super) fn upload_given(&self, recording: &mut Recording<'_>, curves: &[usize]) -> Buffer {
        let ends: Vec<usize> = (0..=curves.len()).map(|slot| slot * self.form.numbers()).collect();
        recording.upload_parts(&ends, |slot, given| self.give(self.run.problems[curves[slot]], given))
    }

    /// Uploads the rows that do not change.
    pub(super) fn upload_fixed(&self, recording: &mut Recording<'_>, curves: &[usize], layout: &Layout) -> Buffer {
        let side = self.form.side();
        // A group begins with its first curve.
        let starts = layout.table.iter().step_by(side).map(|table| table.fixed_start as usize);
        let ends: Vec<usize> = starts.chain([layout.fixed]).collect();
        recording.upload_parts(&ends, |group, fixed| {
            for (place, &i) in curves.chunks(side).nth(group).expect("a group of the layout").iter().enumerate() {
                self.fix(self.run.problems[i], place, fixed);
            }
        })
    }

    fn give(&self, problem: &Problem<D>, given: &mut [f64]) {
        // Numbers that the kernel must write first are NaN, so that a premature read shows.
        given.fill(f64::NAN);
        // The tolerance allows for rounding already.
        given[..GIVEN].copy_from_slice(&[problem.highest, problem.tolerance, problem.longest, 0.0]);
        let weights = self.form.composition.entries(&problem.weights, problem.regularisation);
        given[NUMBERS..].iter_mut().zip(weights).for_each(|(to, x)| *to = x);
        if let Some(surface) = &problem.surface {
            let numbers = surface.numbers();
            let first = given.len() - numbers.len();
            given[first..].copy_from_slice(&numbers);
        }
    }

    /// Writes the rows of a curve at its place in the group.
    fn fix(&self, problem: &Problem<D>, place: usize, fixed: &mut [f64]) {
        let (width, side, rows) = (self.form.fixed_numbers(), self.form.side(), problem.vertices());
        let at = |row: usize, number: usize| place + (row * width + number) * side;
        for (j, edge) in problem.base.iter().enumerate() {
            (0..D).for_each(|c| fixed[at(j, c)] = edge[c]);
            fixed[at(j, D)] = problem.free[(j + 1) % rows];
        }
        if self.form.is_taut() {
            let number = self.form.taut_number();
            problem.taut.iter().enumerate().for_each(|(j, &taut)| fixed[at(j, number)] = taut);
        }
        let kinds = (0..problem.penalties.len()).filter(|&kind| self.run.energy.penalties()[kind]);
        for (place, penalties) in
            kinds.map(|kind| &problem.penalties[kind]).enumerate().filter(|(_, all)| !all.is_empty())
        {
            let number = self.form.penalty_number() + PENALTY * place;
            for j in 0..problem.base.len() {
                let penalty = penalties[(j + 1) % rows];
                let numbers = [penalty.slope, penalty.reach, penalty.stiffness];
                numbers.iter().enumerate().for_each(|(k, x)| fixed[at(j, number + k)] = *x);
            }
        }
        for (layer, regions) in problem.regions.iter().enumerate() {
            let number = self.form.region_number() + layer * (2 * D + REGION);
            for (row, penalty) in regions.iter().enumerate() {
                let scalars = [penalty.span, penalty.plane, penalty.bend, penalty.reach, penalty.stiffness];
                let numbers = penalty.foot.iter().chain(&penalty.axis).chain(&scalars);
                numbers.enumerate().for_each(|(k, x)| fixed[at(row, number + k)] = *x);
            }
        }
        if self.form.is_in_surfaces() {
            let number = self.form.place_number();
            let places = problem.places.iter().enumerate();
            places.for_each(|(row, place)| (0..D).for_each(|c| fixed[at(row, number + c)] = place[c]));
        }
        (0..rows).for_each(|row| fixed[at(row, D + 1)] = 1.0);
        problem.pinned.iter().for_each(|&row| fixed[at(row as usize, D + 1)] = 0.0);
        for attached in &problem.attached {
            let row = attached.row as usize;
            (0..D).for_each(|c| fixed[at(row, D + 2 + c)] = attached.target[c]);
            let anchor = attached.anchor;
            let numbers = [attached.stiffness, anchor.spring, anchor.stiffness, anchor.reach, anchor.along];
            numbers.iter().chain(&anchor.tangent).enumerate().for_each(|(k, x)| fixed[at(row, 2 * D + 2 + k)] = *x);
        }
    }

    /// Writes the outcomes of curves, and returns which curves are left to the host.
    pub(super) fn unpack(
        &self,
        curves: &[usize],
        layout: &Layout,
        results: &[Downloaded],
        outcomes: &mut [Option<Outcome<D>>],
    ) -> Vec<bool> {
        let states = results[0].as_slice::<DescentState>();
        let (lanes, displacements) = (results[1].numbers(), results[2].numbers());
        let found = parallel::map(curves.len(), UNPACKED_TOGETHER, |slot| {
            let (state, table) = (&states[slot], &layout.table[slot]);
            let lane = |number: usize| lanes.at(slot * self.form.numbers() + number);
            let word = |row: usize, c: usize| table.displacement_start as usize + (row * D + c) * self.form.side();
            let row = |row: usize| std::array::from_fn(|c| displacements.at(word(row, c)));
            Outcome {
                displacements: (0..self.run.problems[curves[slot]].vertices()).map(row).collect(),
                termination: termination(state.termination),
                energy: lane(REPORTED),
                norm: lane(NORM2).sqrt(),
                iterations: state.iterations,
                evaluations: state.evaluations,
                on_cpu: false,
            }
        });
        curves.iter().zip(found).for_each(|(&i, outcome)| outcomes[i] = Some(outcome));
        (0..curves.len()).map(|slot| states[slot].termination == LEFT).collect()
    }
}
