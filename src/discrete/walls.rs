//! [`Walls`]: the regions that the vertices of one curve keep within.
//!
//! A vertex has the walls of the few regions that it is nearest to. They are chosen anew between rounds. Those that push
//! stay.
//!
//! A curve that passes through a disc to stay out of would be pushed apart along itself. So it is lifted out first, to the
//! side where it is nearer to the edge.

use super::energy::Wall;
use super::limits::Form;
use super::problem::Problem;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};

/// The most walls of a vertex.
///
/// A vertex in the corner between two regions has two, and a corridor as a third.
const MOST: usize = 3;

/// The regions of a curve at size 1.
#[derive(Clone, Debug)]
pub(super) struct Walls<const D: usize> {
    /// Of every region its form at each vertex.
    regions: Vec<Vec<Form<D>>>,
    /// The corridor of each vertex; empty without one.
    corridors: Vec<Option<Form<D>>>,
    movable: Vec<bool>,
    /// The regions whose walls stand, one a layer, for each vertex. The corridor comes after all regions.
    chosen: Vec<Vec<Option<usize>>>,
}

impl<const D: usize> Walls<D> {
    pub fn new(regions: Vec<Vec<Form<D>>>, corridors: Vec<Option<Form<D>>>, pinned: &[u32], vertices: usize) -> Self {
        let mut movable = vec![true; vertices];
        pinned.iter().for_each(|&row| movable[row as usize] = false);
        let layers = MOST.min(regions.len() + usize::from(!corridors.is_empty()));
        Walls { regions, corridors, movable, chosen: vec![vec![None; vertices]; layers] }
    }

    /// How many walls a vertex has at most.
    pub fn layers(&self) -> usize {
        self.chosen.len()
    }

    /// The numbers of the regions of a vertex with their forms; none where it is pinned.
    fn of(&self, row: usize) -> impl Iterator<Item = (usize, &Form<D>)> {
        let regions = self.regions.iter().map(move |forms| &forms[row]).enumerate();
        let corridor = self.corridors.get(row).and_then(Option::as_ref).map(|form| (self.regions.len(), form));
        regions.chain(corridor).filter(move |_| self.movable[row])
    }

    fn form(&self, row: usize, region: usize) -> Option<&Form<D>> {
        self.of(row).find(|(number, _)| *number == region).map(|(_, form)| form)
    }

    /// All limits of places: the vertex, the number of the region, and c there.
    pub fn all<'a>(&'a self, places: &'a [Vector<f64, D>]) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        places
            .iter()
            .enumerate()
            .flat_map(move |(row, place)| self.of(row).map(move |(region, form)| (row, region, form.room(*place))))
    }

    /// Every wall that stands, with o of its limit.
    pub fn standing<'a>(
        &'a self,
        walls: &'a mut [Vec<Wall<f64, D>>],
    ) -> impl Iterator<Item = (&'a mut Wall<f64, D>, f64)> {
        let all =
            walls.iter_mut().zip(&self.chosen).flat_map(|(walls, chosen)| walls.iter_mut().zip(chosen).enumerate());
        all.filter_map(|(row, (wall, region))| Some((wall, self.form(row, (*region)?)?.offset)))
    }

    /// Chooses the walls of every vertex where the problem's base stands.
    ///
    /// Walls that push stay. r of each is its push y/ρ so far, times `ratio`; then it is that of a wall of this stiffness
    /// and margin.
    pub fn choose(&mut self, problem: &mut Problem<D>, margin: f64, stiffness: f64, ratio: f64) {
        let layers = self.layers();
        problem.walls.resize(layers, Vec::new());
        problem.walls.iter_mut().for_each(|walls| walls.resize(self.movable.len(), Wall::NONE));
        for row in 0..self.movable.len() {
            let place = problem.places[row];
            let mut near: Vec<(f64, usize, f64)> = Vec::new();
            for (region, form) in self.of(row) {
                let before = (0..layers).find(|&layer| self.chosen[layer][row] == Some(region));
                let push = before.map_or(0.0, |layer| ratio * problem.walls[layer][row].reach);
                let gap = if push > 0.0 { f64::NEG_INFINITY } else { form.gap(place) };
                near.push((gap, region, push));
            }
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            for layer in 0..layers {
                self.chosen[layer][row] = near.get(layer).map(|(_, region, _)| *region);
                problem.walls[layer][row] = match near.get(layer) {
                    Some((_, region, push)) => {
                        let form = self.form(row, *region).expect("it is one of the vertex");
                        form.wall(place, push - form.offset + margin, stiffness)
                    }
                    None => Wall::NONE,
                };
            }
        }
    }

    /// The displacements that lift the curve at these places out of discs that it passes through; none if there are none.
    pub fn lift(&self, places: &[Vector<f64, D>], closed: bool) -> Option<Vec<Vector<f64, D>>> {
        let mut lifted = places.to_vec();
        for forms in self.regions.iter().filter(|forms| forms[0].bend < 0.0) {
            let is_within =
                |row: usize, lifted: &[Vector<f64, D>]| self.movable[row] && forms[row].room(lifted[row]) < 0.0;
            let count = lifted.len();
            // From a vertex outside on, so that no part of a closed curve is cut in two.
            let begin = (0..count).find(|&row| !closed || !is_within(row, &lifted)).unwrap_or(0);
            let mut at = 0;
            while at < count {
                let row = |at: usize| (begin + at) % count;
                let length = (at..count).take_while(|&at| is_within(row(at), &lifted)).count();
                if length > 0 {
                    let part: Vec<usize> = (at..at + length).map(row).collect();
                    let before = if at > 0 || closed { (row(at) + count - 1) % count } else { row(at) };
                    let after = if at + length < count || closed { row(at + length) } else { row(at + length - 1) };
                    lift_part(&mut lifted, forms, &part, [before, after]);
                }
                at += length + 1;
            }
        }
        let moves: Vec<Vector<f64, D>> = lifted.iter().zip(places).map(|(to, from)| subtract(*to, *from)).collect();
        moves.iter().any(|u| *u != [0.0; D]).then_some(moves)
    }
}

/// Lifts vertices that follow each other out of a disc, across the way from the vertex before them to that after them.
fn lift_part<const D: usize>(
    places: &mut [Vector<f64, D>],
    forms: &[Form<D>],
    part: &[usize],
    [before, after]: [usize; 2],
) {
    let way = subtract(places[after], places[before]);
    let way = scale(1.0 / dot(way, way).sqrt().max(f64::MIN_POSITIVE), way);
    let across = |v: Vector<f64, D>| subtract(v, scale(dot(v, way), way));
    let sum = part.iter().fold([0.0; D], |sum, &row| add(sum, subtract(places[row], forms[row].foot)));
    let mut up = across(sum);
    let radius = (-1.0 / forms[part[0]].bend).sqrt();
    if dot(up, up).sqrt() < 1e-6 * radius * part.len() as f64 {
        // Through the middle: to the left, or in space across the coordinate that the way has the least of.
        up = match D {
            2 => std::array::from_fn(|c| [-way[1], way[0]][c]),
            _ => {
                let least = (0..D).min_by(|&a, &b| way[a].abs().total_cmp(&way[b].abs())).unwrap_or(0);
                across(std::array::from_fn(|c| f64::from(u8::from(c == least))))
            }
        };
    }
    let up = scale(1.0 / dot(up, up).sqrt().max(f64::MIN_POSITIVE), up);
    for &row in part {
        let o = subtract(places[row], forms[row].foot);
        let height = dot(o, up);
        let rest = dot(o, o) - height * height;
        let wanted = (-1.0 / forms[row].bend - rest).max(0.0).sqrt();
        places[row] = add(places[row], scale((wanted - height).max(0.0), up));
    }
}

impl<const D: usize> Form<D> {
    /// The wall of a vertex whose displacement is 0 at a place.
    fn wall(&self, place: Vector<f64, D>, reach: f64, stiffness: f64) -> Wall<f64, D> {
        let Form { foot, axis, span, plane, bend, .. } = *self;
        Wall { foot: subtract(foot, place), axis, span, plane, bend, reach, stiffness }
    }

    /// c at a place.
    pub fn room(&self, place: Vector<f64, D>) -> f64 {
        self.offset - self.wall(place, 0.0, 0.0).quantity([0.0; D]).0
    }

    /// About the distance from a place to the edge of the region, negative outside.
    fn gap(&self, place: Vector<f64, D>) -> f64 {
        self.room(place) / self.plane.max(self.bend.abs().sqrt())
    }
}
