//! Keeps curves of a batch from crossing: each one stays on its side of its neighbours.
//!
//! ```text
//! curves ─► crossings ─► references ─► half-planes ─► constrained descents ─► curves …
//! ```
//!
//! If two curves cross although their data polygons do not, both are blended towards references
//! that do not cross, one span at a time and no further than necessary ([`course`](self::course)).
//! Both vertices of every edge there get a half-plane: orthogonal to the shortest connection from
//! the edge to the neighbour in the references, just before its midpoint. A segment lies on its own
//! side of the nearest point of a convex set, so the reference satisfies all half-planes and they
//! are feasible. Two edges that are each other's nearest are separated for good. Half-planes stay
//! in all later rounds. The next reference lies between the previous one and the curves found, and
//! both satisfy them.

mod course;

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::curves::Vertices;
use super::limits::{Limits, Obstacle};
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::report::{CurveReport, LimitReport};
use crate::sort;
use crate::status::CurveStatus;
use crate::topology::crossings::{Line, Place, contacts};
use course::{Course, Levels, WaysRound};

/// The largest number of rounds.
const MOST_ROUNDS: usize = 12;

/// The fraction of the distance to the neighbour that a vertex may use. A tenth is left between two
/// neighbours.
const SHARE: f64 = 0.45;

/// The fraction of the distance to an obstacle.
const SHARE_OF_OBSTACLE: f64 = 0.9;

/// A half-plane that constrains one vertex: axis·(f − foot) ≤ 0, in units of the input.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeparatingHalfPlane {
    pub row: usize,
    pub foot: [f64; 2],
    /// A unit vector towards the neighbour.
    pub axis: [f64; 2],
    /// The distance between the references there.
    pub gap: f64,
    /// The index of the curve on the other side.
    pub neighbour: usize,
}

impl SeparatingHalfPlane {
    /// An order of a curve's half-planes that does not depend on the order of the curves in the
    /// batch.
    fn by_place(&self, other: &Self) -> Ordering {
        let numbers = |half_plane: &Self| [half_plane.foot, half_plane.axis];
        let (own, others) = (numbers(self), numbers(other));
        let places = own.as_flattened().iter().zip(others.as_flattened());
        places.fold(self.row.cmp(&other.row), |order, (a, b)| order.then(a.total_cmp(b)))
    }
}

/// The half-planes of every curve that has any.
#[derive(Clone, Debug, Default)]
pub(super) struct SeparatingHalfPlanes(BTreeMap<usize, Vec<SeparatingHalfPlane>>);

impl SeparatingHalfPlanes {
    /// The half-planes of a curve.
    pub fn of(&self, i: usize) -> &[SeparatingHalfPlane] {
        self.0.get(&i).map_or(&[], Vec::as_slice)
    }

    /// The largest number of half-planes of a vertex.
    pub fn most_at_a_vertex(&self) -> usize {
        // They are sorted by vertex.
        let of_curve = |own: &Vec<SeparatingHalfPlane>| {
            own.chunk_by(|a, b| a.row == b.row).map(<[SeparatingHalfPlane]>::len).max()
        };
        self.0.values().filter_map(of_curve).max().unwrap_or(0)
    }
}

/// The report and the vertices of a curve. Without vertices the result is the input.
pub(super) type Found = (CurveReport, Option<Vertices>);

/// Refits curves that cross curves of other owners, until none cross whose data polygons do not.
///
/// Obstacles are curves that nobody fits. `again` fits the curves with these indices within their half-planes. The reports state the
/// result.
pub(super) fn keep_apart(
    batch: &CurveBatch,
    limits: &Limits,
    owners: &[usize],
    curves: &mut [Option<Vertices>],
    reports: &mut [CurveReport],
    mut again: impl FnMut(&[usize], &SeparatingHalfPlanes) -> Result<Vec<Found>>,
) -> Result<()> {
    let ways: Vec<WaysRound> = (0..curves.len()).map(|i| course::ways_round(batch, i, &limits.obstacles)).collect();
    let mut courses: Vec<Course> =
        (0..curves.len()).map(|i| Course::of(batch, i, curves[i].as_ref(), &ways[i])).collect();
    courses.extend(limits.obstacles.iter().map(Course::of_obstacle));
    let apart = Apart::new(batch, limits, owners);
    let mut separating = SeparatingHalfPlanes::default();
    let mut crossing = apart.crossings(&courses, |_| true);
    for _ in 0..MOST_ROUNDS {
        if crossing.is_empty() {
            break;
        }
        let pairs = apart.references(&mut courses, &crossing);
        let parted = apart.part(&courses, &pairs, &mut separating);
        if parted.is_empty() {
            break;
        }
        for (&i, fitted) in parted.iter().zip(again(&parted, &separating)?) {
            (reports[i], curves[i]) = fitted;
            let reference = std::mem::take(&mut courses[i].reference);
            courses[i] = Course::of(batch, i, curves[i].as_ref(), &ways[i]);
            // A curve whose result is the input lies in its data polygon.
            if reference.len() == courses[i].points.len() {
                courses[i].reference = reference;
            }
        }
        let is_new = |arc: u32| parted.binary_search(&(arc as usize)).is_ok();
        crossing.retain(|[a, b]| !is_new(a.0) && !is_new(b.0));
        crossing.extend(apart.crossings(&courses, is_new));
    }
    apart.report(batch, &courses, &separating, &crossing, reports);
    Ok(())
}

/// The pairs of owners whose data polygons cross or touch, the lower owner first, with one place of
/// contact.
fn touching(batch: &CurveBatch, owners: &[usize]) -> BTreeMap<[usize; 2], [Place; 2]> {
    let polygons: Vec<_> = (0..batch.len()).map(|i| course::polygon(batch, i)).collect();
    let line = |i: usize| Line { points: &polygons[i], closed: batch.is_closed(i) };
    let lines: Vec<Line> = (0..batch.len()).map(line).collect();
    let mut touching = BTreeMap::new();
    for [a, b] in contacts(&lines, owners, |_| true) {
        touching.entry(ordered([owners[a.0 as usize], owners[b.0 as usize]])).or_insert([a, b]);
    }
    touching
}

fn ordered([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// The pairs of curves that must not cross.
struct Apart<'a> {
    batch: &'a CurveBatch,
    obstacles: &'a [Obstacle],
    owners: &'a [usize],
    /// The owners, or one for all curves that may cross each other, and one for all obstacles.
    groups: Vec<usize>,
    touching: BTreeMap<[usize; 2], [Place; 2]>,
}

/// A span of a curve and a span of another.
type Spans = [(usize, usize); 2];

impl<'a> Apart<'a> {
    fn new(batch: &'a CurveBatch, limits: &'a Limits, owners: &'a [usize]) -> Self {
        let mut groups = if limits.no_crossing { owners.to_vec() } else { vec![0; owners.len()] };
        let obstacles = &limits.obstacles[..];
        groups.extend(obstacles.iter().map(|_| usize::MAX));
        let touching = if limits.no_crossing { touching(batch, owners) } else { BTreeMap::new() };
        Apart { batch, obstacles, owners, groups, touching }
    }

    /// The obstacle that a course is, if it is one.
    fn obstacle(&self, course: usize) -> Option<&Obstacle> {
        self.obstacles.get(course.checked_sub(self.owners.len())?)
    }

    /// The forbidden crossings in which at least one curve satisfies `new`.
    fn crossings(&self, courses: &[Course], new: impl Fn(u32) -> bool) -> Vec<[Place; 2]> {
        let lines: Vec<Line> = courses.iter().map(|course| course.line(&course.points)).collect();
        let mut found = contacts(&lines, &self.groups, new);
        found.retain(|pair| self.is_asked(pair));
        found
    }

    fn is_asked(&self, pair: &[Place; 2]) -> bool {
        // Obstacles come after all curves.
        let [a, b] = pair.map(|(arc, _)| arc as usize);
        match self.obstacle(b) {
            Some(obstacle) => obstacle.is_for(&self.batch.name(a)),
            None => !self.touching.contains_key(&ordered([self.owners[a], self.owners[b]])),
        }
    }

    /// Moves crossing spans towards their references until none cross, and then one step further
    /// for room. The results are the next references.
    ///
    /// Returns every pair of spans that crossed on the way.
    fn references(&self, courses: &mut [Course], crossing: &[[Place; 2]]) -> BTreeSet<Spans> {
        let mut levels = Levels::default();
        let mut pairs = BTreeSet::new();
        let mut drawn: Vec<Vec<DVec3>> = Vec::new();
        let mut crossing = crossing.to_vec();
        let mut has_room = false;
        loop {
            let spans = |pair: &[Place; 2]| pair.map(|(arc, edge)| (arc as usize, courses[arc as usize].span(edge)));
            let crossed: BTreeSet<Spans> = crossing.iter().map(spans).collect();
            let at: BTreeSet<(usize, usize)> = crossed.iter().flatten().copied().collect();
            pairs.extend(crossed);
            let raised = match (at.is_empty(), has_room) {
                (true, true) => break,
                (true, false) => {
                    has_room = true;
                    levels.all()
                }
                _ => at.into_iter().collect(),
            };
            let mut changed: Vec<usize> =
                raised.into_iter().filter(|&(i, span)| levels.raise(&courses[i], i, span)).map(|(i, _)| i).collect();
            changed.dedup();
            if changed.is_empty() {
                break;
            }
            if drawn.is_empty() {
                drawn = courses.iter().map(|course| course.points.clone()).collect();
            }
            changed.iter().for_each(|&i| drawn[i] = courses[i].drawn(levels.of(i)));
            let lines: Vec<Line> = courses.iter().zip(&drawn).map(|(course, points)| course.line(points)).collect();
            let is_new = |arc: u32| changed.binary_search(&(arc as usize)).is_ok();
            crossing.retain(|[a, b]| !is_new(a.0) && !is_new(b.0));
            crossing.extend(contacts(&lines, &self.groups, is_new).into_iter().filter(|pair| self.is_asked(pair)));
        }
        for (course, drawn) in courses.iter_mut().zip(drawn) {
            course.reference = drawn;
        }
        pairs
    }

    /// Adds half-planes between the references at these spans and at their adjacent spans. Returns
    /// the curves with new ones.
    fn part(&self, courses: &[Course], pairs: &BTreeSet<Spans>, separating: &mut SeparatingHalfPlanes) -> Vec<usize> {
        // The spans of neighbours for every span.
        let mut across: BTreeMap<(usize, usize), BTreeSet<(usize, usize)>> = BTreeMap::new();
        for &[(a, s), (b, t)] in pairs {
            let [of_a, of_b] = [courses[a].beside(s), courses[b].beside(t)];
            for &s in &of_a {
                across.entry((a, s)).or_default().extend(of_b.iter().map(|&t| (b, t)));
            }
            for &t in &of_b {
                across.entry((b, t)).or_default().extend(of_a.iter().map(|&s| (a, s)));
            }
        }
        let mut curves: Vec<usize> = Vec::new();
        for ((i, span), neighbours) in across {
            if !courses[i].is_fitted {
                continue;
            }
            let neighbours: Vec<(usize, usize)> = neighbours.into_iter().collect();
            let follow = |a: &(usize, usize), b: &(usize, usize)| a.0 == b.0 && a.1 + 1 == b.1;
            for part in neighbours.chunk_by(follow) {
                let (neighbour, spans) = (part[0].0, part[0].1..part[part.len() - 1].1 + 1);
                for edge in courses[i].edges_of(span) {
                    let ends = courses[i].edge(edge);
                    let Some([own, other]) = courses[neighbour].nearest(ends, spans.clone()) else { continue };
                    let (way, gap) = (other - own, other.distance(own));
                    if !(gap > 0.0 && gap.is_finite()) {
                        continue;
                    }
                    let share = if self.obstacle(neighbour).is_some() { SHARE_OF_OBSTACLE } else { SHARE };
                    let [foot, axis] = [own + share * way, way / gap].map(|v| [v.x, v.y]);
                    let rows = [edge, (edge + 1) % courses[i].points.len()];
                    let both = rows.map(|row| SeparatingHalfPlane { row, foot, axis, gap, neighbour });
                    separating.0.entry(i).or_default().extend(both);
                }
            }
            curves.push(i);
        }
        curves.dedup();
        for i in &curves {
            let own = separating.0.entry(*i).or_default();
            sort::by(own, SeparatingHalfPlane::by_place);
            // Two adjacent edges may share a half-plane at the vertex between them.
            own.dedup_by(|a, b| a.by_place(b).is_eq());
        }
        curves
    }

    /// Writes into the reports which curves were separated, which were exempt, and which still
    /// cross.
    fn report(
        &self,
        batch: &CurveBatch,
        courses: &[Course],
        separating: &SeparatingHalfPlanes,
        crossing: &[[Place; 2]],
        reports: &mut [CurveReport],
    ) {
        // The first crossing of every curve.
        let mut crossed: BTreeMap<usize, (Place, usize)> = BTreeMap::new();
        for &[a, b] in crossing {
            crossed.entry(a.0 as usize).or_insert((a, b.0 as usize));
            crossed.entry(b.0 as usize).or_insert((b, a.0 as usize));
        }
        let mut touched: BTreeMap<usize, Vec<(Place, usize)>> = BTreeMap::new();
        for &[a, b] in self.touching.values() {
            touched.entry(a.0 as usize).or_default().push((a, b.0 as usize));
            touched.entry(b.0 as usize).or_default().push((b, a.0 as usize));
        }
        for (i, report) in reports.iter_mut().enumerate().filter(|(i, _)| courses[*i].is_fitted) {
            let sides = separating.of(i).iter();
            let mut apart: Vec<usize> =
                sides.filter_map(|half_plane| self.owners.get(half_plane.neighbour).copied()).collect();
            apart.sort_unstable();
            apart.dedup();
            let (neighbours, touching) = (apart.len(), touched.get(&i).map_or(0, Vec::len));
            report.limits = Some(match report.limits {
                Some(limits) => LimitReport { neighbours, touching, ..limits },
                None => {
                    let stretch = courses[i].stretch(batch, i);
                    LimitReport { violation: 0.0, active: 0, cost: 0.0, stretch, neighbours, touching }
                }
            });
            let is_told = matches!(report.status, CurveStatus::Converged | CurveStatus::Infeasible);
            if let (Some(&(place, neighbour)), true) = (crossed.get(&i), is_told) {
                let at = courses[i].points[place.1 as usize];
                let what = match self.obstacle(neighbour) {
                    Some(Obstacle { name, .. }) => format!(
                        "it meets obstacle {name} near ({:.6}, {:.6}): {MOST_ROUNDS} rounds did not find a way around; give more \
                         points there, or allow a deviation from them or sharper turns",
                        at.x, at.y
                    ),
                    None => format!(
                        "it crosses curve {} near ({:.6}, {:.6}), which their points do not: {MOST_ROUNDS} rounds did not part them; \
                         give both more points there, or allow a deviation from them",
                        batch.label(neighbour),
                        at.x,
                        at.y
                    ),
                };
                let point = courses[i].span(place.1);
                (report.status, report.message) = (CurveStatus::Infeasible, Some(batch.sentence(i, point, &what)));
            } else if let (Some(touched), None, CurveStatus::Converged) =
                (touched.get(&i), &report.message, report.status)
            {
                let ((_, edge), neighbour) = touched[0];
                let others = match touched.len() - 1 {
                    0 => String::new(),
                    1 => " and 1 other curve".into(),
                    count => format!(" and {count} other curves"),
                };
                let what = format!(
                    "from here to the next point its polygon meets that of curve {}{others}: curves whose points do are not kept from \
                     crossing",
                    batch.label(neighbour)
                );
                report.message = Some(batch.sentence(i, edge as usize, &what));
            }
        }
    }
}
