//! Twin of `shaders/linalg/ring/lanes.wgsl`: one system by partition and cyclic reduction over a
//! ring of lanes.

use crate::linalg::Real;

/// A row (excess + left + right) x_i − left x_{i−1} − right x_{i+1} = rhs_i.
#[derive(Clone, Copy, Debug)]
pub struct Row<T> {
    /// Sum of the matrix row.
    pub excess: T,
    /// Weight of the edge to the row before.
    pub left: T,
    /// Weight of the edge to the row after.
    pub right: T,
    /// Right-hand side.
    pub rhs: T,
}

/// A chunk of rows reduced to its first, the kept row.
pub struct Reduced<T> {
    /// The kept row; `right` leads to the next chunk's kept row.
    pub kept: Row<T>,
    /// Last row eliminated: share of the kept unknown, own share, value when both neighbours vanish.
    pub last: (T, T, T),
    /// (alpha, gamma, delta) of every row eliminated, for the substitution.
    pub eliminated: Vec<(T, T, T)>,
}

/// Eliminates all rows of a chunk but the first.
pub fn eliminate<T: Real>(rows: &[Row<T>]) -> Reduced<T> {
    let mut kept = rows[0];
    let (mut alpha, mut share, mut delta) = (T::ONE, T::ZERO, T::ZERO);
    let mut eliminated = Vec::with_capacity(rows.len() - 1);
    for row in &rows[1..] {
        let own = row.excess + row.left * share;
        let link = row.left * alpha;
        let r = T::ONE / (own + link + row.right);
        delta = (row.rhs + row.left * delta) * r;
        alpha = link * r;
        share = own * r;
        let gamma = row.right * r;
        eliminated.push((alpha, gamma, delta));
        kept.excess += kept.right * share;
        kept.rhs += kept.right * delta;
        kept.right *= gamma;
    }
    Reduced { kept, last: (alpha, share, delta), eliminated }
}

impl<T: Real> Reduced<T> {
    /// Couples the kept row to the previous chunk's.
    pub fn coupled(&self, previous: &Self) -> Row<T> {
        let (alpha, share, delta) = previous.last;
        let Row { excess, left, right, rhs } = self.kept;
        Row { excess: excess + left * share, left: left * alpha, right, rhs: rhs + left * delta }
    }

    /// Substitutes back, from the chunk's own kept unknown and the next chunk's.
    pub fn substitute(&self, kept: T, next: T, x: &mut [T]) {
        let mut after = next;
        for (i, &(alpha, gamma, delta)) in self.eliminated.iter().enumerate().rev() {
            after = delta + alpha * kept + gamma * after;
            x[i + 1] = after;
        }
        x[0] = kept;
    }
}

/// Solves one system with up to `lanes` lanes (a power of two). The flag says whether it was
/// singular: then every constant could be added, and the kept unknowns are zero.
pub fn solve_lanes<T: Real>(rows: &[Row<T>], lanes: usize) -> (Vec<T>, bool) {
    let n = rows.len();
    let ring = 1 << lanes.min(n).ilog2();
    let from = |lane: usize| lane * n / ring;
    let chunks: Vec<Reduced<T>> = (0..ring).map(|lane| eliminate(&rows[from(lane)..from(lane + 1)])).collect();
    let mut kept: Vec<Row<T>> = (0..ring).map(|lane| chunks[lane].coupled(&chunks[(lane + ring - 1) % ring])).collect();

    let mut step = 1;
    while step < ring {
        let before = kept.clone();
        for (lane, row) in kept.iter_mut().enumerate() {
            let (l, r) = (before[(lane + ring - step) % ring], before[(lane + step) % ring]);
            let link_l = row.left * (T::ONE / (l.excess + l.left + l.right));
            let link_r = row.right * (T::ONE / (r.excess + r.left + r.right));
            row.excess += link_l * l.excess + link_r * r.excess;
            row.rhs += link_l * l.rhs + link_r * r.rhs;
            row.left = link_l * l.left;
            row.right = link_r * r.right;
        }
        step *= 2;
    }

    let singular = kept[0].excess == T::ZERO;
    let value = |row: &Row<T>| if row.excess == T::ZERO { T::ZERO } else { row.rhs / row.excess };
    let values: Vec<T> = kept.iter().map(value).collect();
    let mut x = vec![T::ZERO; n];
    for (lane, chunk) in chunks.iter().enumerate() {
        chunk.substitute(values[lane], values[(lane + 1) % ring], &mut x[from(lane)..from(lane + 1)]);
    }
    (x, singular)
}
