//! [`Vertices`]: the distinct positions of a batch.

use rustc_hash::FxHashMap;

use super::TURN;
use crate::batch::CurveBatch;

/// Longitudes within this distance are one: adding whole turns rounds them.
const ROUNDED: f64 = 1e-11;

/// The width of cells over the distance within which points are one. Few points then search a
/// neighbouring cell.
const CELL: f64 = 64.0;

/// The distinct positions of a batch, and the position of every point.
#[derive(Clone)]
pub(super) struct Vertices {
    /// The vertex of every point of the batch.
    pub of: Vec<u32>,
    /// Whole turns of longitude from the vertex to the point, 0 if x is not a longitude.
    pub turns: Vec<i32>,
    /// The position of every vertex, longitudes from −180 to 180.
    pub positions: Vec<[f64; 3]>,
}

impl Vertices {
    /// Finds points within `snap` of each other, or equal points if `snap` is 0.
    ///
    /// With `turning` x is a longitude, and points whole turns apart are equal. Points of curves in
    /// `alone` equal no others. With `apart` points equal no points of other curves.
    pub fn new(batch: &CurveBatch, snap: f64, turning: bool, apart: bool, alone: &[bool]) -> Self {
        let d = batch.dimension();
        let snap = if turning { snap.max(ROUNDED) } else { snap };
        let mut found = Found { snap, d, exact: FxHashMap::default(), cells: FxHashMap::default(), positions: vec![] };
        let (mut of, mut turns) = (Vec::with_capacity(batch.total_points()), Vec::with_capacity(batch.total_points()));
        for (i, &alone) in alone.iter().enumerate() {
            if apart {
                found.exact.clear();
                found.cells.clear();
            }
            for point in batch.points(i).chunks_exact(d) {
                let turn = if turning && !alone { (point[0] / TURN).round() } else { 0.0 };
                let mut position = [point[0] - TURN * turn, point[1], point.get(2).copied().unwrap_or(0.0)];
                let mut turn = turn as i32;
                // Both sides of the antimeridian are the same position.
                if turning && position[0] >= 0.5 * TURN - snap {
                    position[0] -= TURN;
                    turn += 1;
                }
                of.push(if alone { found.add(position) } else { found.vertex(position) });
                turns.push(turn);
            }
        }
        Vertices { of, turns, positions: found.positions }
    }

    /// The position of a vertex, shifted by `turn` turns.
    pub fn position(&self, vertex: u32, turn: i32) -> [f64; 3] {
        let [x, y, z] = self.positions[vertex as usize];
        [if turn == 0 { x } else { x + TURN * f64::from(turn) }, y, z]
    }
}

/// The vertices found so far.
struct Found {
    snap: f64,
    d: usize,
    exact: FxHashMap<[u64; 3], u32>,
    cells: FxHashMap<[i64; 2], Vec<u32>>,
    positions: Vec<[f64; 3]>,
}

impl Found {
    fn add(&mut self, position: [f64; 3]) -> u32 {
        self.positions.push(position);
        (self.positions.len() - 1) as u32
    }

    /// The vertex of a position, added if it is new.
    fn vertex(&mut self, position: [f64; 3]) -> u32 {
        if self.snap == 0.0 {
            // 0 and −0 are one.
            let key = position.map(|x| (x + 0.0).to_bits());
            let next = self.positions.len() as u32;
            let vertex = *self.exact.entry(key).or_insert(next);
            return if vertex == next { self.add(position) } else { vertex };
        }
        let cell = |x: f64| (x / (CELL * self.snap)).floor() as i64;
        let [low, high] = [-self.snap, self.snap].map(|by| [cell(position[0] + by), cell(position[1] + by)]);
        let mut nearest: Option<(f64, u32)> = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for &vertex in self.cells.get(&[x, y]).into_iter().flatten() {
                    let other = self.positions[vertex as usize];
                    let apart = (0..self.d).map(|c| (position[c] - other[c]).powi(2)).sum::<f64>().sqrt();
                    if apart <= self.snap && nearest.is_none_or(|(least, _)| apart < least) {
                        nearest = Some((apart, vertex));
                    }
                }
            }
        }
        if let Some((_, vertex)) = nearest {
            return vertex;
        }
        let own = [cell(position[0]), cell(position[1])];
        let vertex = self.add(position);
        self.cells.entry(own).or_default().push(vertex);
        vertex
    }
}
