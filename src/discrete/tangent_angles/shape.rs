//! [`Shape`]: the fixed data of a planar curve, and [`Curve`]: the angles and lengths of its edges.

use std::ops::Range;

use crate::discrete::problem::Problem;
use crate::linalg::skyline::Skyline;

/// The unknowns of a span besides its angles: its length, and the two multipliers of its closure.
pub(super) const OF_SPAN: usize = 3;

/// The spans of a planar curve.
///
/// Unknowns are ordered span by span: its angles, the logarithm of its edge length, and the
/// multipliers of its two closure equations.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub closed: bool,
    /// The total turn of a closed curve, a multiple of 2π.
    pub turning: f64,
    /// The edges of each span.
    pub spans: Vec<Range<usize>>,
    /// The chord of each span, from its first point to its last.
    pub chords: Vec<[f64; 2]>,
    /// The span of each edge.
    span_of: Vec<usize>,
}

/// The angles and lengths of the edges of a planar curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    /// The direction of each edge in radians, without jumps of 2π.
    pub angles: Vec<f64>,
    /// The logarithm of the edge length of each span.
    pub sizes: Vec<f64>,
}

impl Shape {
    /// The spans of a problem and its base. `None` unless the problem only interpolates all its
    /// data points.
    pub fn of<const D: usize>(problem: &Problem<D>) -> Option<(Shape, Curve)> {
        let edges = problem.base.len();
        let plain = problem.attached.is_empty() && !problem.has_tangents && problem.pinned == problem.data;
        let last = problem.data.last().map_or(0, |&row| row as usize);
        let whole = problem.data.first() == Some(&0) && (problem.closed || last == edges);
        if D != 2 || !plain || !whole || edges < 3 {
            return None;
        }
        let mut ends: Vec<usize> = problem.data.iter().map(|&row| row as usize).collect();
        if problem.closed {
            ends.push(edges);
        }
        let spans: Vec<Range<usize>> = ends.windows(2).map(|pair| pair[0]..pair[1]).collect();
        let sum = |edges: &Range<usize>| {
            problem.base[edges.clone()].iter().fold([0.0; 2], |sum, edge| [sum[0] + edge[0], sum[1] + edge[1]])
        };
        let chords = spans.iter().map(sum).collect();
        let span_of = spans.iter().enumerate().flat_map(|(k, edges)| edges.clone().map(move |_| k)).collect();
        let turn = |j: usize| {
            let (e, f) = (problem.base[j], problem.base[(j + 1) % edges]);
            (e[0] * f[1] - e[1] * f[0]).atan2(e[0] * f[0] + e[1] * f[1])
        };
        let mut angles = vec![problem.base[0][1].atan2(problem.base[0][0])];
        for j in 0..edges - 1 {
            angles.push(angles[j] + turn(j));
        }
        let turning = if problem.closed { angles[edges - 1] + turn(edges - 1) - angles[0] } else { 0.0 };
        let mean = |edges: &Range<usize>| {
            let length: f64 = problem.base[edges.clone()].iter().map(|edge| edge[0].hypot(edge[1])).sum();
            (length / edges.len() as f64).ln()
        };
        let curve = Curve { angles, sizes: spans.iter().map(mean).collect() };
        let turning = (turning / std::f64::consts::TAU).round() * std::f64::consts::TAU;
        Some((Shape { closed: problem.closed, turning, spans, chords, span_of }, curve))
    }

    /// The number of edges.
    pub fn edges(&self) -> usize {
        self.span_of.len()
    }

    /// The number of unknowns, multipliers included.
    pub fn rows(&self) -> usize {
        self.edges() + OF_SPAN * self.spans.len()
    }

    /// The index of the unknown for an edge's angle.
    pub fn row(&self, edge: usize) -> usize {
        edge + OF_SPAN * self.span_of[edge]
    }

    /// The index of the unknown for an edge's length.
    pub fn row_of_length(&self, edge: usize) -> usize {
        let k = self.span_of[edge];
        self.spans[k].end + OF_SPAN * k
    }

    /// The indices of the two multipliers of a span.
    pub fn rows_of_closure(&self, k: usize) -> [usize; 2] {
        let row = self.spans[k].end + OF_SPAN * k + 1;
        [row, row + 1]
    }

    /// The number of windows of this many edges.
    pub fn windows(&self, width: usize) -> usize {
        if self.closed { self.edges() } else { (self.edges() + 1).saturating_sub(width) }
    }

    /// The turn from edge j to the next.
    pub fn turn(&self, curve: &Curve, j: usize) -> f64 {
        let turn = curve.angles[(j + 1) % self.edges()] - curve.angles[j];
        if j + 1 == self.edges() { turn + self.turning } else { turn }
    }

    /// The length of the data polygon.
    pub fn chord(&self) -> f64 {
        self.chords.iter().map(|chord| chord[0].hypot(chord[1])).sum()
    }

    /// An empty matrix with the profile of energies over three edges and of closures.
    pub fn matrix(&self) -> Skyline {
        let mut first: Vec<usize> = (0..self.rows()).collect();
        let mut couple = |rows: &[usize]| {
            let least = rows.iter().copied().min().unwrap_or(0);
            rows.iter().for_each(|&row| first[row] = first[row].min(least));
        };
        for j in 0..self.windows(3).max(self.windows(2)) {
            let edges =
                [0, 1, 2].map(|k| if self.closed { (j + k) % self.edges() } else { (j + k).min(self.edges() - 1) });
            couple(&edges.map(|edge| self.row(edge)));
            couple(&edges.map(|edge| self.row_of_length(edge)));
            edges
                .iter()
                .for_each(|&edge| couple(&edges.map(|other| [self.row(edge), self.row_of_length(other)]).concat()));
        }
        for (k, edges) in self.spans.iter().enumerate() {
            self.rows_of_closure(k).iter().for_each(|&row| couple(&[row, self.row(edges.start)]));
        }
        Skyline::new(first)
    }
}

impl Curve {
    /// The length of an edge.
    pub fn length(&self, shape: &Shape, edge: usize) -> f64 {
        self.sizes[shape.span_of[edge]].exp()
    }

    /// The length of the curve.
    pub fn total_length(&self, shape: &Shape) -> f64 {
        self.sizes.iter().zip(&shape.spans).map(|(size, edges)| edges.len() as f64 * size.exp()).sum()
    }

    /// The curve after a step along a direction of all unknowns.
    pub fn moved(&self, shape: &Shape, step: f64, p: &[f64]) -> Curve {
        let mut moved = self.clone();
        for (k, edges) in shape.spans.iter().enumerate() {
            edges.clone().for_each(|j| moved.angles[j] += step * p[shape.row(j)]);
            moved.sizes[k] += step * p[shape.row_of_length(edges.start)];
        }
        moved
    }

    /// The edges in order.
    pub fn edges<'a>(&'a self, shape: &'a Shape) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.angles.iter().enumerate().map(|(j, angle)| {
            let length = self.length(shape, j);
            [length * angle.cos(), length * angle.sin()]
        })
    }
}
