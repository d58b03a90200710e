//! Nesting of rings. A fit that moves a coast over a small island crosses nothing, yet misplaces
//! the island.

use glam::DVec2;
use robust::{Coord, orient2d};
use rustc_hash::FxHashMap;

use super::Topology;
use super::samples::Samples;

/// Rows into which segments are sorted by height.
const ROWS: usize = 4096;

/// Connected boundaries and the rings around them in the data.
pub(super) struct Nesting<'a> {
    topology: &'a Topology,
    /// The part of each arc. Arcs that meet at junctions belong to one part.
    part_of: Vec<u32>,
    /// The first arc of every part.
    parts: Vec<u32>,
    /// The rings that pass along each arc an odd number of times.
    rings: Vec<Vec<u32>>,
    /// The rings around every part, in the data.
    around: Vec<Vec<u32>>,
}

/// A part, and a ring that it has entered or left.
pub(super) struct Misplaced {
    pub part: u32,
    pub ring: u32,
}

impl<'a> Nesting<'a> {
    /// The nesting of the data.
    pub fn new(topology: &'a Topology, data: &[Samples]) -> Self {
        let arcs = &topology.arcs;
        let mut rings = vec![Vec::new(); arcs.stops.len()];
        for (i, uses) in arcs.uses.iter().enumerate().filter(|&(i, _)| topology.is_ring(i)) {
            for way in uses {
                let of_arc: &mut Vec<u32> = &mut rings[way.arc as usize];
                match of_arc.last() {
                    Some(&last) if last == i as u32 => drop(of_arc.pop()),
                    _ => of_arc.push(i as u32),
                }
            }
        }
        let (part_of, parts) = parts(topology);
        let mut nesting = Nesting { topology, part_of, parts, rings, around: vec![] };
        nesting.around = nesting.around(data);
        nesting
    }

    /// The arcs of a part.
    pub fn arcs(&self, part: u32) -> impl Iterator<Item = usize> + '_ {
        (0..self.part_of.len()).filter(move |&arc| self.part_of[arc] == part)
    }

    /// A curve of every misplaced part.
    pub fn curves(&self, misplaced: &[Misplaced]) -> Vec<usize> {
        let mut parts: Vec<u32> = misplaced.iter().map(|misplaced| misplaced.part).collect();
        parts.dedup();
        let first = |part: u32| self.topology.arcs.stops[self.parts[part as usize] as usize][0].curve as usize;
        parts.into_iter().map(first).collect()
    }

    /// Parts that have entered or left rings.
    pub fn misplaced(&self, samples: &[Samples]) -> Vec<Misplaced> {
        let now = self.around(samples);
        let mut misplaced = Vec::new();
        for (part, (before, now)) in self.around.iter().zip(&now).enumerate() {
            let changed = before
                .iter()
                .filter(|ring| !now.contains(ring))
                .chain(now.iter().filter(|ring| !before.contains(ring)));
            misplaced.extend(changed.map(|&ring| Misplaced { part: part as u32, ring }));
        }
        misplaced
    }

    /// The rings around every part's first point, sorted: the rings that a ray to the right crosses
    /// an odd number of times. Arcs of the part do not count.
    fn around(&self, samples: &[Samples]) -> Vec<Vec<u32>> {
        let alone = &self.topology.arcs.alone;
        let counts = |arc: &usize| !alone[*arc] && !self.rings[*arc].is_empty();
        let heights = || (0..samples.len()).filter(counts).flat_map(|arc| &samples[arc].points).map(|point| point.y);
        let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        // Differences of halves do not overflow.
        let share = |y: f64| (0.5 * y - 0.5 * low) / (0.5 * high - 0.5 * low);
        let row = |y: f64| ((share(y) * ROWS as f64) as usize).min(ROWS - 1);
        // The first points of parts, by row.
        let mut asked = vec![Vec::new(); ROWS];
        let start = |part: usize| samples[self.parts[part] as usize].points.first().map(|point| point.truncate());
        for part in 0..self.parts.len() {
            if let Some(point) = start(part).filter(|point| (low..=high).contains(&point.y)) {
                asked[row(point.y)].push((part as u32, point));
            }
        }
        let mut around: Vec<FxHashMap<u32, bool>> = vec![FxHashMap::default(); self.parts.len()];
        for arc in (0..samples.len()).filter(counts) {
            let points = &samples[arc].points;
            let closed = self.topology.arcs.closed[arc];
            for k in 0..points.len() - usize::from(!closed) {
                let (p, q) = (points[k].truncate(), points[(k + 1) % points.len()].truncate());
                let (down, up) = if p.y <= q.y { (p, q) } else { (q, p) };
                for &(part, point) in asked[row(p.y).min(row(q.y))..=row(p.y).max(row(q.y))].iter().flatten() {
                    if self.part_of[arc] != part && is_right_of(point, down, up) {
                        for &ring in &self.rings[arc] {
                            *around[part as usize].entry(ring).or_default() ^= true;
                        }
                    }
                }
            }
        }
        let odd = |crossed: FxHashMap<u32, bool>| {
            let mut rings: Vec<u32> = crossed.into_iter().filter(|(_, odd)| *odd).map(|(ring, _)| ring).collect();
            rings.sort_unstable();
            rings
        };
        around.into_iter().map(odd).collect()
    }
}

/// Whether a ray from a point to the right crosses a segment that goes up.
fn is_right_of(point: DVec2, down: DVec2, up: DVec2) -> bool {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    down.y <= point.y && point.y < up.y && orient2d(coord(down), coord(up), coord(point)) > 0.0
}

/// The part of every arc, and the first arc of every part.
fn parts(topology: &Topology) -> (Vec<u32>, Vec<u32>) {
    let arcs = &topology.arcs;
    let mut root: Vec<u32> = (0..arcs.stops.len() as u32).collect();
    fn find(root: &mut [u32], mut arc: u32) -> u32 {
        while root[arc as usize] != arc {
            root[arc as usize] = root[root[arc as usize] as usize];
            arc = root[arc as usize];
        }
        arc
    }
    let mut first_at: FxHashMap<u32, u32> = FxHashMap::default();
    for (arc, stops) in arcs.stops.iter().enumerate().filter(|&(arc, _)| !arcs.closed[arc] && !arcs.alone[arc]) {
        for stop in [stops[0], stops[stops.len() - 1]] {
            let other = *first_at.entry(stop.vertex).or_insert(arc as u32);
            let [a, b] = [find(&mut root, other), find(&mut root, arc as u32)];
            root[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers = FxHashMap::default();
    let mut firsts = Vec::new();
    let mut part = |arc: u32| {
        *numbers.entry(find(&mut root, arc)).or_insert_with(|| {
            firsts.push(arc);
            (firsts.len() - 1) as u32
        })
    };
    let part_of = (0..arcs.stops.len() as u32).map(&mut part).collect();
    (part_of, firsts)
}
