//! [`RegionConstraints`]: the regions within which the vertices of one curve must lie.
//!
//! Each vertex is constrained by the few regions nearest to it. They are chosen again between
//! rounds. Active ones are kept.
//!
//! A curve that passes through an excluded disc would be pushed apart along itself. It is first
//! lifted out of the disc, on the side where it is nearer to the boundary.

use std::collections::BTreeMap;

use super::energy::RegionPenalty;
use super::limits::RegionConstraint;
use super::problem::Problem;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

/// The largest number of regions that constrain a vertex at once.
///
/// A vertex in the corner between two regions needs both, and a corridor as a third.
const MOST: usize = 3;

/// The factor by which an edge may grow after it was measured.
const UNEVEN: f64 = 1.01;

/// The region constraints of a curve at size 1.
#[derive(Clone, Debug)]
pub(super) struct RegionConstraints<const D: usize> {
    regions: Vec<RegionConstraint<D>>,
    /// The indices of the data points at both ends of each span, and the longest edge at each
    /// vertex.
    spans: Vec<[usize; 2]>,
    edges: Vec<f64>,
    /// The corridor of each vertex; empty without a corridor.
    corridors: Vec<Option<RegionConstraint<D>>>,
    /// The half-planes that separate the curve from its neighbours, and the indices of those of
    /// each vertex; empty without any.
    sides: Vec<NeighbourConstraint<D>>,
    own: Vec<Vec<usize>>,
    movable: Vec<bool>,
    /// The positions of the pinned vertex next to each vertex and of the vertex, if there is one.
    pinned: Vec<Option<[Vector<f64, D>; 2]>>,
    /// The regions that constrain each vertex, one per layer. Indices count regions first, then the
    /// corridor, then separating half-planes.
    chosen: Vec<Vec<Option<usize>>>,
}

/// A half-plane that separates one vertex from a neighbouring curve, or from a border of its corridor.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeighbourConstraint<const D: usize> {
    pub row: usize,
    pub form: RegionConstraint<D>,
    /// The index of the curve on the other side, if it is one.
    pub neighbour: Option<usize>,
}

impl<const D: usize> RegionConstraints<D> {
    pub fn new(
        regions: Vec<RegionConstraint<D>>,
        corridors: Vec<Option<RegionConstraint<D>>>,
        sides: Vec<NeighbourConstraint<D>>,
        spans: Vec<[usize; 2]>,
        pinned: &[u32],
        vertices: usize,
    ) -> Self {
        let mut movable = vec![true; vertices];
        pinned.iter().for_each(|&row| movable[row as usize] = false);
        let mut own = vec![vec![]; if sides.is_empty() { 0 } else { vertices }];
        sides.iter().enumerate().for_each(|(k, side)| own[side.row].push(k));
        let most = own.iter().map(Vec::len).max().unwrap_or(0);
        let layers = Self::most(regions.len() + usize::from(!corridors.is_empty()) + most);
        RegionConstraints {
            regions,
            spans,
            edges: vec![0.0; vertices],
            corridors,
            sides,
            own,
            pinned: vec![None; vertices],
            movable,
            chosen: vec![vec![None; vertices]; layers],
        }
    }

    /// The largest number of regions that constrain a vertex at once, out of this many.
    pub fn most(regions: usize) -> usize {
        MOST.min(regions)
    }

    /// The largest number of region penalties of a vertex.
    fn layers(&self) -> usize {
        self.chosen.len()
    }

    /// The indices and constraints of the regions of a vertex; none if it is pinned.
    fn of(&self, row: usize) -> impl Iterator<Item = (usize, RegionConstraint<D>)> {
        let beside = move |form: &RegionConstraint<D>| match self.pinned[row] {
            Some(ends) => form.next_to(self.edges[row], ends),
            None => form.beside(self.edges[row]),
        };
        let regions = self.regions.iter().map(beside).enumerate();
        let corridor = self.corridors.get(row).copied().flatten().map(|form| (self.regions.len(), form));
        let sides = self.own.get(row).into_iter().flatten();
        let sides = sides.map(|&k| (self.regions.len() + 1 + k, self.sides[k].form));
        regions.chain(corridor).chain(sides).filter(move |_| self.movable[row])
    }

    /// Whether all constraints are separating half-planes.
    pub fn has_sides_alone(&self) -> bool {
        self.regions.is_empty() && self.corridors.is_empty()
    }

    /// Whether there are separating half-planes.
    pub fn has_sides(&self) -> bool {
        !self.sides.is_empty()
    }

    /// The curve on the other side of a separating half-plane.
    pub fn neighbour(&self, region: usize) -> Option<usize> {
        self.sides.get(region.checked_sub(self.regions.len() + 1)?)?.neighbour
    }

    fn form(&self, row: usize, region: usize) -> Option<RegionConstraint<D>> {
        self.of(row).find(|(number, _)| *number == region).map(|(_, form)| form)
    }

    /// About the distance from a vertex at a position to the boundary of a region, negative outside.
    pub fn gap(&self, row: usize, region: usize, place: Vector<f64, D>) -> Option<f64> {
        Some(self.form(row, region)?.gap(place))
    }

    /// The least c at these positions of each region, of the corridor, and of the half-planes to each neighbour:
    /// the vertex, the index of the region, and c.
    pub fn least(&self, places: &[Vector<f64, D>]) -> Vec<(usize, usize, f64)> {
        let mut least = BTreeMap::new();
        for (row, place) in places.iter().enumerate() {
            for (region, form) in self.of(row) {
                let room = form.room(*place);
                let own = least
                    .entry((region.min(self.regions.len()), self.neighbour(region)))
                    .or_insert((row, region, room));
                if room < own.2 {
                    *own = (row, region, room);
                }
            }
        }
        least.into_values().collect()
    }

    /// Every penalty in use, with o of its constraint.
    pub fn standing<'a>(
        &'a self,
        regions: &'a mut [Vec<RegionPenalty<f64, D>>],
    ) -> impl Iterator<Item = (&'a mut RegionPenalty<f64, D>, f64)> {
        let all = regions
            .iter_mut()
            .zip(&self.chosen)
            .flat_map(|(regions, chosen)| regions.iter_mut().zip(chosen).enumerate());
        all.filter_map(|(row, (penalty, region))| Some((penalty, self.form(row, (*region)?)?.offset)))
    }

    /// Chooses the regions that constrain every vertex of the problem's base.
    ///
    /// Active regions are kept. Each push y/ρ so far is multiplied by `ratio`. The new penalties
    /// have this stiffness and margin.
    pub fn choose(&mut self, problem: &mut Problem<D>, margin: f64, stiffness: f64, ratio: f64) {
        let layers = self.layers();
        self.measure(problem);
        problem.regions.resize(layers, Vec::new());
        problem.regions.iter_mut().for_each(|regions| regions.resize(self.movable.len(), RegionPenalty::NONE));
        for row in 0..self.movable.len() {
            let place = problem.places[row];
            let mut near: Vec<(f64, usize, f64)> = Vec::new();
            for (region, form) in self.of(row) {
                let before = (0..layers).find(|&layer| self.chosen[layer][row] == Some(region));
                let push = before.map_or(0.0, |layer| ratio * problem.regions[layer][row].reach);
                let gap = if push > 0.0 { f64::NEG_INFINITY } else { form.gap(place) };
                near.push((gap, region, push));
            }
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for layer in 0..layers {
                self.chosen[layer][row] = near.get(layer).map(|(_, region, _)| *region);
                problem.regions[layer][row] = match near.get(layer) {
                    Some((_, region, push)) => {
                        let form = self.form(row, *region).expect("it is one of the vertex");
                        form.region_at(place, push - form.offset + margin, stiffness)
                    }
                    None => RegionPenalty::NONE,
                };
            }
        }
    }

    /// Measures the edges of the base.
    pub fn measure(&mut self, problem: &Problem<D>) {
        let (places, count) = (&problem.places, self.movable.len());
        for edge in 0..problem.base.len() {
            let ends = [edge, (edge + 1) % count];
            for [from, to] in [ends, [ends[1], ends[0]]] {
                if !self.movable[from] {
                    self.pinned[to] = Some([places[from], places[to]]);
                }
            }
        }
        self.edges.fill(0.0);
        for (row, edge) in problem.base.iter().enumerate() {
            let length = UNEVEN * dot(*edge, *edge).sqrt();
            for row in [row, (row + 1) % self.movable.len()] {
                self.edges[row] = self.edges[row].max(length);
            }
        }
    }

    /// The excluded discs that contain a vertex.
    fn around(&self, row: usize, place: Vector<f64, D>) -> impl Iterator<Item = RegionConstraint<D>> {
        self.of(row).map(|(_, form)| form).filter(move |form| form.penalty.bend < 0.0 && form.room(place) < 0.0)
    }

    /// The displacements that lift a curve at these positions out of the discs that it passes
    /// through. `None` if there are none.
    pub fn lift(&self, places: &[Vector<f64, D>], closed: bool) -> Option<Vec<Vector<f64, D>>> {
        let count = places.len();
        let is_within = |row: usize| self.around(row, places[row]).next().is_some();
        // Starts at a vertex outside, so that no part of a closed curve is cut in two.
        let begin = if closed { (0..count).find(|&row| !is_within(row))? } else { 0 };
        let row = |at: usize| (begin + at) % count;
        let mut moves = vec![[0.0; D]; count];
        let mut at = 0;
        while at < count {
            let length = (at..count).take_while(|&at| is_within(row(at))).count();
            if length > 0 {
                let part: Vec<usize> = (at..at + length).map(row).collect();
                let before = if at > 0 || closed { (row(at) + count - 1) % count } else { row(at) };
                let after = if at + length < count || closed { row(at + length) } else { row(at + length - 1) };
                self.lift_part(places, &part, subtract(places[after], places[before]), &mut moves);
            }
            at += length + 1;
        }
        moves.iter().any(|u| *u != [0.0; D]).then_some(moves)
    }

    /// Lifts consecutive vertices out of all discs, orthogonally to `way` and to the side with the
    /// lower lift.
    fn lift_part(&self, places: &[Vector<f64, D>], part: &[usize], way: Vector<f64, D>, moves: &mut [Vector<f64, D>]) {
        let way = scale(1.0 / dot(way, way).sqrt().max(f64::MIN_POSITIVE), way);
        let across = |v: Vector<f64, D>| subtract(v, scale(dot(v, way), way));
        let offsets = part.iter().flat_map(|&row| {
            self.around(row, places[row])
                .map(move |form| (subtract(places[row], form.penalty.foot), (-1.0 / form.penalty.bend).sqrt()))
        });
        let (sum, radius) = offsets.fold(([0.0; D], 0.0), |(sum, radius), (o, r)| (add(sum, o), radius + r));
        let mut up = across(sum);
        if dot(up, up).sqrt() < 1e-6 * radius {
            // Through the centre: to the left, or in space along the coordinate axis most nearly
            // orthogonal to `way`.
            up = match D {
                2 => std::array::from_fn(|c| [-way[1], way[0]][c]),
                _ => {
                    let least = (0..D).min_by(|&a, &b| way[a].abs().total_cmp(&way[b].abs())).unwrap_or(0);
                    across(std::array::from_fn(|c| f64::from(u8::from(c == least))))
                }
            };
        }
        let up = scale(1.0 / dot(up, up).sqrt().max(f64::MIN_POSITIVE), up);
        let [first, second] = [up, scale(-1.0, up)].map(|up| {
            let lifts: Vec<f64> = part.iter().map(|&row| self.height(row, places[row], up)).collect();
            (lifts.iter().copied().fold(0.0, f64::max), lifts, up)
        });
        let (most, lifts, up) = if second.0 < first.0 { second } else { first };
        let peak = lifts.iter().position(|lift| *lift == most).unwrap_or(0);
        // An arch from the previous pinned vertex to the next, without a kink at the boundary of a
        // disc.
        let arch = self.arch(part[peak]);
        let height = |row: usize| arch.iter().find(|(own, _)| *own == row).map_or(1.0, |(_, height)| *height);
        let steep = part.iter().zip(&lifts).map(|(&row, lift)| lift / height(row)).fold(most, f64::max);
        for (row, height) in arch {
            moves[row] = add(moves[row], scale(steep * height, up));
        }
    }

    /// The vertices between the pinned ones around a vertex, with heights from 0 at the pinned ones
    /// to 1 at the vertex.
    fn arch(&self, peak: usize) -> Vec<(usize, f64)> {
        let count = self.movable.len();
        let side = |step: usize| -> Vec<usize> {
            let rows = (1..count).map(|k| (peak + k * step) % count);
            // Stops at an end of an open curve, even if it may move.
            let is_in = |row: &usize| self.movable[*row] && (self.is_closed() || (*row > peak) == (step == 1));
            rows.take_while(is_in).collect()
        };
        let rise = |rows: Vec<usize>| {
            let steps = rows.len() as f64 + 1.0;
            rows.into_iter().enumerate().map(move |(k, row)| {
                let part = std::f64::consts::FRAC_PI_2 * (k as f64 + 1.0) / steps;
                (row, part.cos())
            })
        };
        [(peak, 1.0)].into_iter().chain(rise(side(1))).chain(rise(side(count - 1))).collect()
    }

    /// Whether the last span ends at the first vertex.
    fn is_closed(&self) -> bool {
        self.spans.last().is_some_and(|span| span[1] == self.movable.len())
    }

    /// The distance along `up` at which a vertex is outside of every disc.
    fn height(&self, row: usize, place: Vector<f64, D>, up: Vector<f64, D>) -> f64 {
        let mut lift = 0.0;
        // Leaving one disc may lead into the next.
        for _ in 0..self.regions.len() {
            let at = add(place, scale(lift, up));
            let Some(form) = self.around(row, at).next() else { break };
            let o = subtract(at, form.penalty.foot);
            let height = dot(o, up);
            let half = (-1.0 / form.penalty.bend - (dot(o, o) - height * height)).max(0.0).sqrt();
            lift += (half - height).max(0.0) * (1.0 + 1e-9) + 1e-12;
        }
        lift
    }
}

impl<const D: usize> RegionConstraint<D> {
    /// The penalty of a vertex whose displacement is 0 at a position.
    fn region_at(&self, place: Vector<f64, D>, reach: f64, stiffness: f64) -> RegionPenalty<f64, D> {
        RegionPenalty { foot: subtract(self.penalty.foot, place), reach, stiffness, ..self.penalty }
    }

    /// c at a position.
    pub fn room(&self, place: Vector<f64, D>) -> f64 {
        self.offset - self.penalty.quantity(place).0
    }

    /// About the distance from a position to the region's boundary, negative outside.
    fn gap(&self, place: Vector<f64, D>) -> f64 {
        self.room(place) / self.penalty.plane.max(self.penalty.bend.abs().sqrt())
    }
}
