//! Strokes: arcs that go straight on through junctions, fitted as one curve.

use rustc_hash::{FxHashMap, FxHashSet};

use super::arcs::Arcs;
use super::stop::Stop;
use super::vertices::Vertices;
use crate::batch::{CurveBatch, Traced};
use crate::constraint::Constraints;
use crate::sort;

/// The position of an arc in a stroke. `first` is its first span there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Place {
    pub stroke: u32,
    pub first: u32,
    /// Whether the stroke runs against the arc.
    pub reversed: bool,
    /// Whole turns of longitude from the arc's points to the stroke's.
    pub turn: i32,
}

/// The curves to fit.
#[derive(Clone)]
pub(super) struct Strokes {
    pub batch: CurveBatch,
    /// The place of every arc.
    pub places: Vec<Place>,
    /// The arcs of every stroke, in its order.
    pub arcs: Vec<Vec<u32>>,
    /// The junctions: vertices where three or more arcs meet, or two that are not joined.
    pub pinned: FxHashSet<u32>,
    /// The end that continues each end of an arc.
    partner: Vec<Option<End>>,
}

/// An end of an arc: 2·arc for the first stop, 2·arc + 1 for the last.
type End = u32;

impl Strokes {
    /// Joins arcs that meet at an angle within `straight` (radians) of 180°, the straightest first.
    pub fn new(batch: &CurveBatch, vertices: &Vertices, arcs: &Arcs, straight: f64) -> Self {
        let meeting = meeting(arcs);
        let mut partner = vec![None; 2 * arcs.stops.len()];
        for (&vertex, ends) in &meeting {
            let ends: Vec<End> = ends.iter().copied().filter(|&end| !arcs.stays(end as usize / 2)).collect();
            let pairs = match ends[..] {
                // Only a curve that turns back has cut the others there.
                [a, b] if arcs.turned[vertex as usize] => vec![[a, b]],
                _ if straight > 0.0 => pairs(vertices, arcs, &ends, straight),
                _ => continue,
            };
            for [a, b] in pairs {
                partner[a as usize] = Some(b);
                partner[b as usize] = Some(a);
            }
        }
        Self::joined(batch, vertices, arcs, &meeting, partner)
    }

    /// Divides the strokes `apart` into their arcs. Other strokes are kept, with other indices.
    pub fn divided(&self, batch: &CurveBatch, vertices: &Vertices, arcs: &Arcs, apart: impl Fn(usize) -> bool) -> Self {
        let mut partner = self.partner.clone();
        for (arc, _) in self.places.iter().enumerate().filter(|(_, place)| apart(place.stroke as usize)) {
            (partner[2 * arc], partner[2 * arc + 1]) = (None, None);
        }
        Self::joined(batch, vertices, arcs, &meeting(arcs), partner)
    }

    /// Joins the ends of arcs with their partners.
    fn joined(
        batch: &CurveBatch,
        vertices: &Vertices,
        arcs: &Arcs,
        meeting: &FxHashMap<u32, Vec<End>>,
        partner: Vec<Option<End>>,
    ) -> Self {
        // An end of a line is no junction, nor is a vertex where two arcs are joined.
        let goes_on = |ends: &[End]| ends.len() == 1 || (ends.len() == 2 && partner[ends[0] as usize].is_some());
        let pinned: FxHashSet<u32> =
            meeting.iter().filter(|(_, ends)| !goes_on(ends)).map(|(&vertex, _)| vertex).collect();
        let mut walk = Walk { arcs, partner: &partner, places: vec![None; arcs.stops.len()], strokes: vec![] };
        // Open strokes begin at ends without a partner. The remaining strokes are closed.
        for end in (0..2 * arcs.stops.len() as u32).filter(|&end| partner[end as usize].is_none()) {
            walk.from(end);
        }
        for arc in 0..arcs.stops.len() as u32 {
            walk.from(2 * arc);
        }
        let Walk { places, strokes, .. } = walk;
        let places = places.into_iter().map(|place| place.expect("every arc was walked")).collect();
        let mut batch = traced(batch, vertices, arcs, &strokes, |vertex| pinned.contains(&vertex));
        for (number, arc) in strokes.iter().map(|stroke| stroke.arcs[0] as usize).enumerate() {
            if arcs.frame[arc] {
                batch.refuse(number, 0, "it is a part of the map's frame, which stays straight");
            } else if arcs.kept[arc] {
                batch.refuse(number, 0, "it is not selected, and stays as it is");
            }
        }
        Strokes { batch, places, arcs: strokes.into_iter().map(|stroke| stroke.arcs).collect(), pinned, partner }
    }
}

/// The ends of arcs at every vertex where arcs end.
fn meeting(arcs: &Arcs) -> FxHashMap<u32, Vec<End>> {
    let mut meeting: FxHashMap<u32, Vec<End>> = FxHashMap::default();
    for (arc, stops) in arcs.stops.iter().enumerate() {
        if !arcs.closed[arc] && !arcs.alone[arc] {
            meeting.entry(stops[0].vertex).or_default().push(2 * arc as u32);
            meeting.entry(stops[stops.len() - 1].vertex).or_default().push(2 * arc as u32 + 1);
        }
    }
    meeting
}

/// Pairs of ends that continue each other, the straightest first.
fn pairs(vertices: &Vertices, arcs: &Arcs, ends: &[End], straight: f64) -> Vec<[End; 2]> {
    let directions: Vec<[f64; 3]> = ends.iter().map(|&end| outward(vertices, arcs, end)).collect();
    let mut candidates = Vec::new();
    for b in 0..ends.len() {
        for a in 0..b {
            let (u, v) = (directions[a], directions[b]);
            let cosine = -(u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
            if cosine > libm::cos(straight) {
                candidates.push((cosine, a, b));
            }
        }
    }
    sort::by(&mut candidates, |a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut taken = vec![false; ends.len()];
    let mut pairs = Vec::new();
    for (_, a, b) in candidates {
        if !taken[a] && !taken[b] {
            (taken[a], taken[b]) = (true, true);
            pairs.push([ends[a], ends[b]]);
        }
    }
    pairs
}

/// The unit vector from an end along its arc.
fn outward(vertices: &Vertices, arcs: &Arcs, end: End) -> [f64; 3] {
    let stops = &arcs.stops[end as usize / 2];
    let n = stops.len();
    let (from, to) = if end.is_multiple_of(2) { (stops[0], stops[1]) } else { (stops[n - 1], stops[n - 2]) };
    let [p, q] = [from, to].map(|stop| vertices.position(stop.vertex, stop.turn));
    let chord = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
    let length = chord.iter().fold(0.0_f64, |sum, x| libm::hypot(sum, *x));
    chord.map(|x| x / length)
}

/// A chain of arcs.
struct Stroke {
    arcs: Vec<u32>,
    closed: bool,
    /// The stops, with the turns of longitude from the stop to the stroke.
    stops: Vec<(Stop, i32)>,
}

struct Walk<'a> {
    arcs: &'a Arcs,
    partner: &'a [Option<End>],
    places: Vec<Option<Place>>,
    strokes: Vec<Stroke>,
}

impl Walk<'_> {
    /// Follows partners from an end of an arc, unless the arc has a place.
    fn from(&mut self, start: End) {
        if self.places[start as usize / 2].is_some() {
            return;
        }
        let number = self.strokes.len() as u32;
        let mut stroke = Stroke { arcs: vec![], closed: self.arcs.closed[start as usize / 2], stops: vec![] };
        let (mut end, mut turn) = (start, 0);
        loop {
            let arc = end as usize / 2;
            let stops = &self.arcs.stops[arc];
            let reversed = !end.is_multiple_of(2);
            let along: Vec<Stop> = if reversed { stops.iter().rev().copied().collect() } else { stops.clone() };
            // The stroke's turn continues.
            if let Some((last, shift)) = stroke.stops.pop() {
                turn = last.turn + shift - along[0].turn;
            }
            let first = stroke.stops.len() as u32;
            self.places[arc] = Some(Place { stroke: number, first, reversed, turn });
            stroke.arcs.push(arc as u32);
            stroke.stops.extend(along.into_iter().map(|stop| (stop, turn)));
            match self.partner[(end ^ 1) as usize] {
                Some(next) if self.places[next as usize / 2].is_none() => end = next,
                Some(next) if next == start => {
                    let (first, last) = (stroke.stops[0], stroke.stops[stroke.stops.len() - 1]);
                    // A chain around a pole does not close.
                    if first.0.turn + first.1 == last.0.turn + last.1 {
                        stroke.closed = true;
                        stroke.stops.pop();
                    }
                    break;
                }
                _ => break,
            }
        }
        self.strokes.push(stroke);
    }
}

/// The strokes as a batch. Points of vertices that are `pinned` stay where they are.
fn traced(
    batch: &CurveBatch,
    vertices: &Vertices,
    arcs: &Arcs,
    strokes: &[Stroke],
    pinned: impl Fn(u32) -> bool,
) -> CurveBatch {
    let d = batch.dimension();
    // An arc without stops belongs to one curve, which has no points.
    let mut curves = vec![0; arcs.stops.len()];
    for (i, uses) in arcs.uses.iter().enumerate() {
        for use_of in uses {
            curves[use_of.arc as usize] = i as u32;
        }
    }
    let first = |stroke: &Stroke| match stroke.stops.first() {
        Some((stop, _)) => stop.curve,
        None => curves[stroke.arcs[0] as usize],
    };
    let (mut coords, mut offsets, mut points, mut pins) = (vec![], vec![0], vec![], vec![]);
    for stroke in strokes {
        for &(stop, turn) in &stroke.stops {
            coords.extend_from_slice(&vertices.position(stop.vertex, stop.turn + turn)[..d]);
            points.push((stop.curve, stop.point));
            pins.push(pinned(stop.vertex));
        }
        offsets.push(points.len());
    }
    let constraints = Constraints { pinned: pins.contains(&true).then_some(pins), ..Constraints::default() };
    let closed = strokes.iter().map(|stroke| stroke.closed).collect();
    let curves = strokes.iter().map(first).collect();
    batch.traced(Traced { coords, offsets, closed, constraints, curves, points })
}
