//! [`Arcs`]: the distinct chains of vertices between junctions.

use rustc_hash::FxHashMap;

use super::edges;
use super::stop::Stop;
use super::vertices::Vertices;
use super::{Fitted, frame};
use crate::batch::CurveBatch;

/// One passage of a curve along an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Use {
    pub arc: u32,
    /// Whether the curve runs against the arc.
    pub reversed: bool,
    /// Whole turns of longitude from the arc to the curve.
    pub turn: i32,
}

/// The distinct chains of vertices between junctions.
#[derive(Clone, Default)]
pub(super) struct Arcs {
    /// The stops of every arc. An arc that is a closed curve does not repeat its first.
    pub stops: Vec<Vec<Stop>>,
    /// Whether an arc is a whole closed curve.
    pub closed: Vec<bool>,
    /// The arcs along every curve.
    pub uses: Vec<Vec<Use>>,
    /// Number of times that curves go along each arc.
    pub visits: Vec<u32>,
    /// Whether an arc is a whole curve that shares nothing.
    pub alone: Vec<bool>,
    /// Whether an arc is a part of the map's frame, which stays straight.
    pub frame: Vec<bool>,
    /// Whether an arc stays as it is, bit for bit.
    pub kept: Vec<bool>,
    /// Whether curves are cut at each vertex only because one of them reverses there along the
    /// border.
    pub turned: Vec<bool>,
}

impl Arcs {
    /// Cuts the curves at junctions: where curves part, meet or end, and where the [`frame`] of a
    /// map of longitudes begins.
    ///
    /// Curves in `alone` and curves of one point stay whole and share nothing. An edge takes over
    /// the vertices of other curves that lie on it, within `snap` or rounding. Without `snap` it
    /// does not.
    pub fn new(
        batch: &CurveBatch,
        vertices: &Vertices,
        geographic: bool,
        mut alone: Vec<bool>,
        snap: Option<f64>,
    ) -> Self {
        let is_frame = |a: &Stop, b: &Stop| {
            geographic && frame::holds([a, b].map(|stop| vertices.position(stop.vertex, stop.turn)))
        };
        let mut paths = Vec::with_capacity(batch.len());
        for (i, alone) in alone.iter_mut().enumerate() {
            let whole = whole(batch, vertices, i);
            let path = without_repeats(&whole, batch.is_closed(i));
            *alone |= path.len() < 2;
            paths.push(if *alone { whole } else { path });
        }
        if let Some(snap) = snap {
            edges::complete(&mut paths, batch, vertices, &alone, snap);
        }
        let Cuts { junctions, turned } = cuts(&paths, batch, vertices.positions.len(), &alone, &is_frame);
        let is_cut = |vertex: usize| junctions[vertex] || turned[vertex];
        let mut arcs = Arcs::default();
        let mut known = FxHashMap::default();
        for (i, path) in paths.into_iter().enumerate() {
            let closed = batch.is_closed(i);
            let uses = if alone[i] {
                vec![arcs.add(path, closed, true)]
            } else {
                let pieces = cut(path, closed, is_cut);
                pieces.into_iter().map(|(stops, closed)| arcs.use_of(stops, closed, &mut known)).collect()
            };
            arcs.uses.push(uses);
        }
        arcs.frame =
            arcs.stops.iter().zip(&arcs.alone).map(|(stops, alone)| !alone && is_frame(&stops[0], &stops[1])).collect();
        arcs.turned = turned;
        arcs
    }

    /// Keeps the arcs of the curves that were not selected, and those that are not to be fitted.
    pub fn keep(&mut self, fitted: Fitted, unselected: &[usize]) {
        let is_kept = |&visits: &u32| match fitted {
            Fitted::All => false,
            Fitted::Outer => visits > 1,
            Fitted::Shared => visits < 2,
        };
        self.kept = self.visits.iter().map(is_kept).collect();
        for way in unselected.iter().flat_map(|&i| &self.uses[i]) {
            self.kept[way.arc as usize] = true;
        }
    }

    /// Whether an arc is not fitted.
    pub fn stays(&self, arc: usize) -> bool {
        self.frame[arc] || self.kept[arc]
    }

    /// Number of spans of an arc.
    pub fn spans(&self, arc: usize) -> usize {
        (self.stops[arc].len() + usize::from(self.closed[arc])).saturating_sub(1)
    }

    fn add(&mut self, stops: Vec<Stop>, closed: bool, alone: bool) -> Use {
        self.alone.push(alone);
        self.stops.push(stops);
        self.closed.push(closed);
        self.visits.push(1);
        Use { arc: (self.stops.len() - 1) as u32, reversed: false, turn: 0 }
    }

    /// The passage along the arc with these stops, which is added if it is new.
    fn use_of(&mut self, stops: Vec<Stop>, closed: bool, known: &mut FxHashMap<Vec<(u32, i32)>, (u32, bool)>) -> Use {
        let (key, reversed, start) = key(&stops, closed);
        let turn = stops[start].turn;
        let (arc, first_reversed) = match known.get(&key) {
            Some(&found) => found,
            None => {
                known.insert(key, (self.stops.len() as u32, reversed));
                return self.add(stops, closed, false);
            }
        };
        self.visits[arc as usize] += 1;
        let first = &self.stops[arc as usize];
        // The stop of the first arc that has the key's first vertex.
        let there = first[self::key(first, closed).2];
        Use { arc, reversed: reversed != first_reversed, turn: turn - there.turn }
    }
}

/// The stops of a curve's points.
fn whole(batch: &CurveBatch, vertices: &Vertices, i: usize) -> Vec<Stop> {
    let start = batch.offsets()[i];
    let stop = |k: usize| Stop {
        vertex: vertices.of[start + k],
        turn: vertices.turns[start + k],
        curve: i as u32,
        point: k as u32,
    };
    (0..batch.count(i)).map(stop).collect()
}

/// A path without repeated stops.
fn without_repeats(path: &[Stop], closed: bool) -> Vec<Stop> {
    let same = |a: &Stop, b: &Stop| (a.vertex, a.turn) == (b.vertex, b.turn);
    let mut path = path.to_vec();
    path.dedup_by(|a, b| same(a, b));
    if closed && path.len() > 1 && same(&path[0], &path[path.len() - 1]) {
        path.pop();
    }
    path
}

/// Where curves are cut, by vertex.
struct Cuts {
    /// A line ends there, curves come from or go to different vertices, or the frame of the map
    /// begins.
    junctions: Vec<bool>,
    /// A curve reverses there, along the border of other curves if there are any. The others go on.
    turned: Vec<bool>,
}

fn cuts(
    paths: &[Vec<Stop>],
    batch: &CurveBatch,
    count: usize,
    alone: &[bool],
    is_frame: &dyn Fn(&Stop, &Stop) -> bool,
) -> Cuts {
    const NONE: u32 = u32::MAX;
    let mut neighbours = vec![[NONE; 2]; count];
    let (mut junctions, mut turned, mut turns) = (vec![false; count], vec![false; count], Vec::new());
    for (i, path) in paths.iter().enumerate().filter(|(i, _)| !alone[*i]) {
        let (n, closed) = (path.len(), batch.is_closed(i));
        for k in 0..n {
            let here = path[k].vertex as usize;
            if !closed && (k == 0 || k + 1 == n) {
                junctions[here] = true;
                continue;
            }
            let (before, after) = (path[(k + n - 1) % n], path[(k + 1) % n]);
            if is_frame(&before, &path[k]) != is_frame(&path[k], &after) {
                junctions[here] = true;
            }
            let pair = [before.vertex.min(after.vertex), before.vertex.max(after.vertex)];
            if before.vertex == after.vertex {
                turns.push((here, before.vertex));
            } else if neighbours[here][0] == NONE {
                neighbours[here] = pair;
            } else if neighbours[here] != pair {
                junctions[here] = true;
            }
        }
    }
    for (here, neighbour) in turns {
        if neighbours[here][0] == NONE {
            neighbours[here] = [neighbour; 2];
        }
        turned[here] = true;
        junctions[here] |= !neighbours[here].contains(&neighbour);
    }
    for (turned, junction) in turned.iter_mut().zip(&junctions) {
        *turned &= !junction;
    }
    Cuts { junctions, turned }
}

/// Cuts a path at vertices.
fn cut(mut path: Vec<Stop>, closed: bool, is_cut: impl Fn(usize) -> bool) -> Vec<(Vec<Stop>, bool)> {
    let is_junction = |stop: &Stop| is_cut(stop.vertex as usize);
    if closed {
        match path.iter().position(is_junction) {
            None => return vec![(path, true)],
            Some(first) => path.rotate_left(first),
        }
        path.push(path[0]);
    }
    let mut pieces = Vec::new();
    let mut from = 0;
    for k in 1..path.len() {
        if is_junction(&path[k]) {
            pieces.push((path[from..=k].to_vec(), false));
            from = k;
        }
    }
    pieces
}

/// The canonical key of an arc: vertices and turns relative to the first, in one of both
/// directions.
///
/// Also returns whether the direction is reversed, and the stop at which the key begins.
fn key(stops: &[Stop], closed: bool) -> (Vec<(u32, i32)>, bool, usize) {
    let n = stops.len();
    let walk = |start: usize, reversed: bool| {
        let at = move |k: usize| if reversed { (start + n - k % n) % n } else { (start + k) % n };
        (0..n).map(move |k| (stops[at(k)].vertex, stops[at(k)].turn - stops[start].turn))
    };
    let candidates = match closed {
        // The key of a closed curve begins with its least vertex.
        true => {
            let least = (0..n).min_by_key(|&k| stops[k].vertex).unwrap_or(0);
            [(least, false), (least, true)]
        }
        false => [(0, false), (n - 1, true)],
    };
    let [forward, backward] = candidates;
    let is_backward = walk(backward.0, true).lt(walk(forward.0, false));
    let (start, reversed) = if is_backward { backward } else { forward };
    (walk(start, reversed).collect(), reversed, start)
}
