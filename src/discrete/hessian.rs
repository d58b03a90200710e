//! [`BlockHessian`]: the Hessian of a sum of energies with respect to the vertices, in blocks.
//!
//! It follows from the second derivatives with respect to tangents and lengths by the chain rule,
//! with e = Δs T and P = I − T Tᵀ:
//!
//! - ∂Δs/∂e = T
//! - ∂T/∂e = P/Δs
//! - ∂²Δs/∂e² = P/Δs
//! - ∂²(g·T)/∂e² = −(T (P g)ᵀ + (P g) Tᵀ + (T·g) P)/Δs² for a fixed g
//!
//! An edge is the difference of its two vertices.

// Loops over edges by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

use std::ops::Range;

use super::block::{
    Block, add_block, add_curvature_of_edge, add_curvature_of_length, add_scaled, outer, pair, subtract_block,
    transpose,
};
use super::edges::Edges;
use super::energy::regularisation::{DifferenceRegularisation, RatioRegularisation, SmoothRegularisation};
use super::energy::{Functional, MOST_EDGES, Term, Visitor};
use super::stretches::Stretches;
#[cfg(test)]
use crate::linalg::scalar::Vector;
use crate::linalg::{Scalar, operation};

/// The number of following vertices that a vertex is coupled with.
///
/// A term depends on at most this many edges, and so on one vertex more.
pub(crate) const COUPLED: usize = MOST_EDGES;

/// The blocks of a vertex: with itself, and with each vertex that it is coupled with.
pub(crate) const BLOCKS: usize = COUPLED + 1;

/// The number of edges that are processed together.
///
/// Their sums stay in the nearest cache, however long the curve is.
const TILE: usize = 64;

/// The upper half of the Hessian of one curve, or of one curve per lane.
///
/// H is the sum over v and k of block (v, k), in the rows of vertex v and the columns of vertex
/// v + k. For k > 0 the transposed block is added in the transposed place. On closed curves v + k
/// is modulo the number of vertices.
///
/// On closed curves with few vertices several blocks share a place, or lie on the diagonal for
/// k > 0. They add up.
#[derive(Clone, Debug)]
pub(crate) struct BlockHessian<S, const D: usize> {
    closed: bool,
    /// The largest number of edges in a term of the sum.
    reach: usize,
    /// The number of vertices of each lane's curve.
    vertices: Vec<usize>,
    /// The second derivatives of energies of lengths only.
    stretches: Stretches<S>,
    /// Whether all blocks are 0 and have not been written.
    is_empty: bool,
    /// `at_edges[j][k]`: with respect to edges j and j + k of a tile, where j counts from its first
    /// edge.
    at_edges: Vec<[Block<S, D>; COUPLED]>,
    /// `blocks[v][k]`: with respect to vertices v and v + k.
    pub(super) blocks: Vec<[Block<S, D>; BLOCKS]>,
}

impl<S: Scalar, const D: usize> BlockHessian<S, D> {
    /// Storage for the Hessian of these curves.
    pub fn new(edges: &Edges<S, D>) -> Self {
        let mut hessian = BlockHessian {
            closed: false,
            reach: COUPLED,
            vertices: Vec::new(),
            stretches: Stretches::default(),
            is_empty: false,
            at_edges: Vec::new(),
            blocks: Vec::new(),
        };
        hessian.renew(edges);
        hessian
    }

    /// Reuses the storage for the Hessian of other curves.
    pub fn renew(&mut self, edges: &Edges<S, D>) {
        // Terms of closed curves run past the end, into edges and vertices that repeat the first
        // ones.
        let rows = edges.rows() + if edges.is_closed() { COUPLED - 1 } else { 0 };
        let zero = [[S::ZERO; D]; D];
        self.closed = edges.is_closed();
        self.vertices.clear();
        self.vertices.extend(edges.counts().iter().map(|&count| count + usize::from(!edges.is_closed())));
        self.stretches.renew(edges.most());
        self.at_edges.resize(TILE.min(edges.most()) + COUPLED - 1, [zero; COUPLED]);
        self.blocks.resize(rows, [zero; BLOCKS]);
    }

    /// The blocks of every vertex with itself and its next [`COUPLED`] vertices.
    ///
    /// Blocks beyond a lane's vertices are 0. The slice is empty if
    /// [all are 0](Self::assemble_by_tangents).
    pub fn blocks(&self) -> &[[Block<S, D>; BLOCKS]] {
        if self.is_empty { &[] } else { &self.blocks }
    }

    /// The second derivatives of energies of lengths only that the blocks
    /// [leave out](Self::assemble_by_tangents).
    pub fn stretches(&self) -> &Stretches<S> {
        &self.stretches
    }

    /// Assembles the blocks of the weighted sum of functionals and of the regularisation.
    ///
    /// The derivatives are taken at the curve where the edges were placed. The regularisation is
    /// given by its kind and weight.
    pub fn assemble(&mut self, edges: &Edges<S, D>, terms: &[(S, &Functional)], regularisation: Option<(usize, S)>) {
        let of_terms = terms.iter().map(|(_, functional)| functional.order()).max().unwrap_or(0);
        self.reach = of_terms.max(regularisation.map_or(0, |(order, _)| order.max(2)));
        self.is_empty = false;
        self.add_tiles::<true>(edges, terms, regularisation);
    }

    /// Assembles the blocks of functionals that depend on tangents, and collects functionals of
    /// lengths only in [`Stretches`].
    ///
    /// All are of order at most 2.
    pub fn assemble_by_tangents(
        &mut self,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        regularisation: Option<(usize, S)>,
    ) {
        self.reach = 2;
        self.stretches.gather(edges, terms, regularisation);
        self.is_empty = !terms.iter().any(|(_, functional)| functional.is_by_tangent());
        if !self.is_empty {
            self.add_tiles::<false>(edges, terms, None);
        }
    }

    /// Sums the terms over the edges, tile by tile, and writes the blocks. `LENGTHS` includes terms
    /// of lengths only.
    fn add_tiles<const LENGTHS: bool>(
        &mut self,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        regularisation: Option<(usize, S)>,
    ) {
        let zero = [[[S::ZERO; D]; D]; COUPLED];
        let most = edges.most();
        self.at_edges.fill(zero);
        for first in (0..most).step_by(TILE) {
            let tile = first..(first + TILE).min(most);
            for (weight, functional) in terms {
                if LENGTHS || functional.is_by_tangent() {
                    functional.visit(Assembling { hessian: self, edges, tile: tile.clone(), weight: *weight });
                }
            }
            self.add_regularisation(edges, tile.clone(), regularisation);
            self.scatter(tile.clone(), 0);
            // Windows of this tile have added to edges after it. Those sums move to the next tile.
            let (done, left) = self.at_edges.split_at_mut(tile.len());
            if tile.end < most {
                done[..COUPLED - 1].copy_from_slice(left);
                done[COUPLED - 1..].fill(zero);
                left.fill(zero);
            }
        }
        self.scatter(most..self.blocks.len() - 1, (most + TILE - 1) % TILE + 1);
        self.close();
    }

    fn add_regularisation(&mut self, edges: &Edges<S, D>, tile: Range<usize>, regularisation: Option<(usize, S)>) {
        match regularisation {
            Some((3.., weight)) => {
                Assembling { hessian: self, edges, tile: tile.clone(), weight }.visit(&SmoothRegularisation);
                self.add_regularisation_at_ends(edges, tile, weight);
            }
            Some((2, weight)) => Assembling { hessian: self, edges, tile, weight }.visit(&RatioRegularisation),
            Some((_, weight)) => Assembling { hessian: self, edges, tile, weight }.visit(&DifferenceRegularisation),
            None => (),
        }
    }

    /// Adds the regularisation of first differences at the ends of open curves.
    ///
    /// It is part of the regularisation of second differences.
    fn add_regularisation_at_ends(&mut self, edges: &Edges<S, D>, tile: Range<usize>, weight: S) {
        for start in tile.start..if self.closed { tile.start } else { tile.end.min(edges.windows::<2>()) } {
            self.add_window(edges, start, start - tile.start, weight * edges.ends(start), &DifferenceRegularisation);
        }
    }

    /// Adds a Hessian with respect to one vertex, such as that of
    /// [`attachment`](super::attachment).
    #[inline(always)]
    pub fn add_block(&mut self, vertex: usize, x: Block<S, D>) {
        self.fill();
        for (own, x) in self.blocks[vertex][0].iter_mut().flatten().zip(x.into_iter().flatten()) {
            *own += x;
        }
    }

    /// Adds a block for a vertex and the next one. Closed curves must have been
    /// [closed](Self::close).
    #[inline(always)]
    pub fn add_pair(&mut self, vertex: usize, x: &Block<S, D>) {
        self.fill();
        add_block(&mut self.blocks[vertex][1], x);
    }

    /// Sets all blocks to 0.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.is_empty = true;
        self.fill();
    }

    /// Writes blocks that have not been written.
    #[inline(always)]
    fn fill(&mut self) {
        if self.is_empty {
            self.blocks.fill([[[S::ZERO; D]; D]; BLOCKS]);
            self.is_empty = false;
        }
    }

    #[inline(always)]
    fn sweep<T: Term<W>, const W: usize>(&mut self, edges: &Edges<S, D>, tile: Range<usize>, weight: S, term: &T) {
        for start in tile.start..tile.end.min(edges.windows::<W>()) {
            self.add_window(edges, start, start - tile.start, weight * edges.share::<T, W>(start), term);
        }
    }

    /// Adds the window that starts at edge `start`, which is edge `at` of its tile.
    #[inline(always)]
    fn add_window<T: Term<W>, const W: usize>(
        &mut self,
        edges: &Edges<S, D>,
        start: usize,
        at: usize,
        weight: S,
        term: &T,
    ) {
        let window = edges.window(term, start);
        let first = term.gradient(&window);
        let mut inverse = [S::ZERO; W];
        inverse.copy_from_slice(&edges.inverse[start..start + W]);
        if !T::BY_TANGENT {
            let second = term.by_lengths(&window);
            for j in 0..W {
                for k in j..W {
                    let mut block = outer(second[j][k], window.tangent[j], window.tangent[k]);
                    if j == k {
                        add_curvature_of_length(&mut block, window.tangent[j], inverse[j] * first.length[j]);
                    }
                    add_scaled(&mut self.at_edges[at + j][k - j], weight, &block);
                }
            }
            return;
        }
        let second = term.hessian(&window);
        for j in 0..W {
            for k in j..W {
                let mut block = pair(&window.tangent, &inverse, &second, j, k);
                if j == k {
                    add_curvature_of_edge(&mut block, window.tangent[j], inverse[j], &first, j);
                }
                add_scaled(&mut self.at_edges[at + j][k - j], weight, &block);
            }
        }
    }

    /// Adds these edges, the first of which is edge `at` of a tile, to the vertices.
    fn scatter(&mut self, edges: Range<usize>, at: usize) {
        match self.reach {
            ..=2 => S::run(Scatter::<S, D, 2> { hessian: self, edges, at }),
            _ => S::run(Scatter::<S, D, COUPLED> { hessian: self, edges, at }),
        }
    }

    /// [`scatter`](Self::scatter) for terms of up to W edges.
    ///
    /// Edge j is vertex j + 1 minus vertex j.
    #[inline(always)]
    fn scatter_within<const W: usize>(&mut self, edges: Range<usize>, at: usize) {
        // The first vertex already holds the part of the edge before it.
        let fresh = if edges.start == 0 { 0 } else { edges.start + 1 };
        self.blocks[fresh..=edges.end].fill([[[S::ZERO; D]; D]; BLOCKS]);
        for j in edges.clone() {
            for k in 0..W {
                let block = self.at_edges[at + j - edges.start][k];
                add_block(&mut self.blocks[j][k], &block);
                subtract_block(&mut self.blocks[j][k + 1], &block);
                if k > 0 {
                    subtract_block(&mut self.blocks[j + 1][k - 1], &block);
                }
                if k == 1 {
                    subtract_block(&mut self.blocks[j + 1][0], &transpose(&block));
                }
                add_block(&mut self.blocks[j + 1][k], &block);
            }
        }
    }

    /// Moves the blocks beyond the last vertex of closed curves to the first vertices.
    pub fn close(&mut self) {
        if self.closed {
            for (lane, &count) in self.vertices.iter().enumerate() {
                // Backwards, because the vertices of a triangle may be repeated several times.
                for v in (0..COUPLED).rev() {
                    for (k, a, b) in indices::<D>() {
                        let over = self.blocks[count + v][k][a][b].lane(lane);
                        let sum = self.blocks[v][k][a][b].lane(lane) + over;
                        self.blocks[v][k][a][b].set_lane(lane, sum);
                        self.blocks[count + v][k][a][b].set_lane(lane, S::ZERO.lane(lane));
                    }
                }
            }
        }
    }

    /// Computes y = H x.
    ///
    /// Both have one vector per vertex.
    #[cfg(test)]
    pub fn multiply(&self, x: &[Vector<S, D>], y: &mut [Vector<S, D>]) {
        y.fill([S::ZERO; D]);
        for (lane, &count) in self.vertices.iter().enumerate() {
            for v in 0..count {
                for (k, a, b) in indices::<D>() {
                    if !self.closed && v + k >= count {
                        break;
                    }
                    let (w, h) = ((v + k) % count, self.blocks[v][k][a][b].lane(lane));
                    let sum = y[v][a].lane(lane) + h * x[w][b].lane(lane);
                    y[v][a].set_lane(lane, sum);
                    if k > 0 {
                        let sum = y[w][b].lane(lane) + h * x[v][a].lane(lane);
                        y[w][b].set_lane(lane, sum);
                    }
                }
            }
        }
    }

    /// The blocks of a lane's curve as a flat list of numbers.
    pub fn lane(&self, lane: usize) -> Vec<S::Number> {
        self.blocks[..self.vertices[lane]]
            .as_flattened()
            .as_flattened()
            .as_flattened()
            .iter()
            .map(|x| x.lane(lane))
            .collect()
    }
}

/// The full matrix of a curve from its blocks, row by row and vertex by vertex.
pub(crate) fn dense<N: Scalar, const D: usize>(closed: bool, blocks: &[N]) -> Vec<N> {
    let count = blocks.len() / (BLOCKS * D * D);
    let width = count * D;
    let mut dense = vec![N::ZERO; width * width];
    for v in 0..count {
        for (k, a, b) in indices::<D>() {
            if !closed && v + k >= count {
                break;
            }
            let (row, column) = (v * D + a, (v + k) % count * D + b);
            let h = blocks[((v * BLOCKS + k) * D + a) * D + b];
            dense[row * width + column] += h;
            if k > 0 {
                dense[column * width + row] += h;
            }
        }
    }
    dense
}

/// [`BlockHessian::sweep`] with one functional's term.
struct Assembling<'a, S, const D: usize> {
    hessian: &'a mut BlockHessian<S, D>,
    edges: &'a Edges<S, D>,
    tile: Range<usize>,
    weight: S,
}

impl<S: Scalar, const D: usize> Visitor for Assembling<'_, S, D> {
    type Output = ();

    fn visit<T: Term<W>, const W: usize>(self, term: &T) {
        S::run(Sweep { sum: self, term });
    }
}

operation! {
    /// [`BlockHessian::sweep`]
    Sweep<'a, S: Scalar, T: Term<W>; D, W> { sum: Assembling<'a, S, D>, term: &'a T }
        -> () { sum.hessian.sweep(sum.edges, sum.tile, sum.weight, term) }
}

operation! {
    /// [`BlockHessian::scatter_within`]
    Scatter<'a, S: Scalar; D, W> { hessian: &'a mut BlockHessian<S, D>, edges: Range<usize>, at: usize }
        -> () { hessian.scatter_within::<W>(edges, at) }
}

/// The offset k to the other vertex, the row and the column of every entry of a vertex's blocks.
fn indices<const D: usize>() -> impl Iterator<Item = (usize, usize, usize)> {
    (0..=COUPLED).flat_map(|k| (0..D).flat_map(move |a| (0..D).map(move |b| (k, a, b))))
}
