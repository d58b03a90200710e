//! [`Within`]: Newton steps for curves that lie in a surface.
//!
//! A step moves every vertex in its tangent plane and then back to the surface:
//!
//! ```text
//! x ← R(x + B u),  g → Bᵀg,  H_ij → B_iᵀ (H_ij − δ_ij l_i ∇²F/|∇F|) B_j,  l = n·g
//! ```
//!
//! B holds two unit vectors orthogonal to n, and R moves along ∇F. No multipliers remain, and the
//! systems are those of planar curves: see [`Newton`](super::newton::Newton).

// Loops over coordinates and lanes by index match the formulas, and keep the code vectorised.
#![allow(clippy::needless_range_loop)]

mod form;
mod system;

use self::form::Implicit;
pub(crate) use self::form::Local;
pub(super) use self::form::has_kernel;
use self::system::{Bend, Link, Saddle, add_edge, add_edges, in_plane};
use super::block::{Block, times};
use super::edges::Edges;
use super::energy::Functional;
use super::energy::in_surface::{InSurface, Turn};
use super::newton::Newton;
use super::tangent_planes::{Basis, TangentSystem, add_own};
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};
use crate::linalg::{Scalar, operation};

/// The surfaces of all lanes, with their normals and second derivatives at the vertices.
pub(crate) struct Within<S, const D: usize> {
    form: Implicit<S, D>,
    /// The positions of the vertices of the bases. Closed curves repeat their first.
    places: Vec<Vector<S, D>>,
    /// n at the vertices of the last [`frame`](Self::frame).
    normals: Vec<Vector<S, D>>,
    /// W = ∇²F/|∇F| there. For quadrics, whose ∇²F is constant, `flatness` holds 1/|∇F| instead.
    shapes: Vec<Block<S, D>>,
    flatness: Vec<S>,
    /// Whether the last frame belongs to the current curves.
    is_framed: bool,
    /// The edges in the coordinates of their ends, at the last assembly.
    links: Vec<Link<S>>,
    /// The second derivatives of the surface at the vertices there.
    saddles: Vec<Saddle<S>>,
    /// The gradient of geodesic bending by the positions of vertices.
    by_place: Vec<Vector<S, D>>,
    /// n·g at the last evaluation, and at the current curves.
    pushes_there: Vec<S>,
    pushes: Vec<S>,
}

impl<S: Scalar, const D: usize> Within<S, D> {
    /// The surfaces of all lanes, and the positions of the vertices of their bases.
    pub fn new(lanes: &[(&Local, &[Vector<f64, D>])], edges: &Edges<S, D>) -> Self {
        let rows = edges.rows();
        let mut places = vec![[S::ZERO; D]; rows];
        for (lane, (_, own)) in lanes.iter().enumerate() {
            for (row, place) in places.iter_mut().enumerate() {
                // Rows beyond the last vertex repeat the first, as closed curves need.
                let own = own.get(row).unwrap_or(&own[0]);
                (0..D).for_each(|c| place[c].set_lane(lane, number::<S>(own[c])));
            }
        }
        let locals: Vec<&Local> = lanes.iter().map(|(local, _)| *local).collect();
        let form = Implicit::new(&locals);
        let shapes = if form.matrix().is_some() { 0 } else { rows };
        Within {
            places,
            normals: vec![[S::ZERO; D]; rows],
            shapes: vec![[[S::ZERO; D]; D]; shapes],
            flatness: vec![S::ZERO; rows - shapes],
            is_framed: false,
            links: Vec::with_capacity(rows),
            saddles: Vec::with_capacity(rows),
            by_place: vec![[S::ZERO; D]; rows],
            pushes_there: vec![S::ZERO; rows],
            pushes: vec![S::ZERO; rows],
            form,
        }
    }

    /// Moves movable vertices back to the surface.
    #[inline(always)]
    pub fn retract(&self, movable: &[S], u: &mut [Vector<S, D>]) {
        for row in 0..u.len() {
            let way = self.form.way(add(self.places[row], u[row]));
            for c in 0..D {
                u[row][c] = movable[row].if_positive(u[row][c] + way[c], u[row][c]);
            }
        }
    }

    /// Computes normals and second derivatives at the vertices.
    pub fn frame(&mut self, u: &[Vector<S, D>]) {
        S::run(Frame { within: self, u });
    }

    #[inline(always)]
    fn frame_inlined(&mut self, u: &[Vector<S, D>]) {
        self.is_framed = false;
        for row in 0..u.len() {
            let place = add(self.places[row], u[row]);
            match self.form.slope(place) {
                Some((normal, flatness)) => (self.normals[row], self.flatness[row]) = (normal, flatness),
                None => (self.normals[row], self.shapes[row]) = self.form.jet(place),
            }
        }
    }

    /// The turn between the edges j and j + 1.
    #[inline(always)]
    fn turn(&self, edges: &Edges<S, D>, j: usize) -> Turn<S, D> {
        Turn {
            tangent: [edges.tangent[j], edges.tangent[j + 1]],
            measure: S::of(0.5) * (edges.length[j] + edges.length[j + 1]),
            normal: self.normals[j + 1],
            penalty: edges.penalty(0, j),
        }
    }

    /// W x at a vertex.
    #[inline(always)]
    fn bent(&self, row: usize, x: Vector<S, D>) -> Vector<S, D> {
        match self.form.matrix() {
            Some(matrix) => scale(self.flatness[row], times(matrix, x)),
            None => times(&self.shapes[row], x),
        }
    }

    /// The second derivatives of the surface at a vertex, in its coordinates.
    #[inline(always)]
    fn saddle(&self, row: usize, basis: &Basis<S, D>) -> Saddle<S> {
        let (first, second) = (self.bent(row, basis[0]), self.bent(row, basis[1]));
        let (normal, beside) = (self.normals[row], dot(basis[1], first));
        Saddle {
            shape: [[dot(basis[0], first), beside], [beside, dot(basis[1], second)]],
            across: [dot(normal, first), dot(normal, second)],
        }
    }

    /// Adds geodesic bending to the partial derivatives, and returns its value. The vertices must
    /// have been [framed](Self::frame).
    pub fn add(&mut self, edges: &mut Edges<S, D>, terms: &[(S, &Functional)]) -> S {
        self.by_place.fill([S::ZERO; D]);
        let mut value = S::ZERO;
        for (weight, functional) in terms {
            match functional {
                Functional::GeodesicBending(energy) => {
                    value += S::run(Add { within: self, energy, weight: *weight, edges });
                }
                Functional::GeodesicMaxCurvature(energy) => {
                    value += S::run(Add { within: self, energy, weight: *weight, edges });
                }
                _ => {}
            }
        }
        if edges.is_closed() {
            for (lane, &count) in edges.counts().iter().enumerate() {
                for c in 0..D {
                    let sum = self.by_place[0][c].lane(lane) + self.by_place[count][c].lane(lane);
                    self.by_place[0][c].set_lane(lane, sum);
                }
            }
        }
        value
    }

    #[inline(always)]
    fn add_of<E: InSurface>(&mut self, energy: &E, weight: S, edges: &mut Edges<S, D>) -> S {
        let mut value = S::ZERO;
        for j in 0..edges.windows::<2>() {
            let turn = self.turn(edges, j);
            let (bend, q) = turn.bend();
            let (partials, by_place) = energy.gradient(&turn, bend, q);
            let weight = weight * edges.starts::<2>(j);
            let slope = self.bent(j + 1, bend);
            self.by_place[j + 1] = add(self.by_place[j + 1], scale(weight * by_place, slope));
            value += edges.scatter_both(j, weight, &partials);
        }
        value
    }

    /// The value of geodesic bending and penalties at the last frame.
    pub fn value(&self, edges: &Edges<S, D>, terms: &[(S, &Functional)]) -> S {
        let mut value = S::ZERO;
        for (weight, functional) in terms {
            for j in 0..edges.windows::<2>() {
                let own = match functional {
                    Functional::GeodesicBending(bending) => bending.value(&self.turn(edges, j)),
                    Functional::GeodesicMaxCurvature(curb) => curb.value(&self.turn(edges, j)),
                    _ => break,
                };
                value += *weight * edges.starts::<2>(j) * own;
            }
        }
        value
    }

    /// Completes a gradient, and projects it onto the tangent planes.
    #[inline(always)]
    pub fn settle(&mut self, movable: &[S], gradient: &mut [Vector<S, D>]) {
        for row in 0..gradient.len() {
            let whole = add(gradient[row], scale(movable[row], self.by_place[row]));
            let push = dot(whole, self.normals[row]);
            self.pushes_there[row] = push;
            gradient[row] = subtract(whole, scale(push, self.normals[row]));
        }
    }

    /// Keeps the last evaluation in lanes where `accepted` is 1.
    #[inline(always)]
    pub fn accept(&mut self, accepted: S) {
        self.is_framed = true;
        for lane in 0..S::LANES {
            self.is_framed &= accepted.lane(lane) != S::ZERO.lane(0);
        }
        for row in 0..self.pushes.len() {
            self.pushes[row] = accepted.if_positive(self.pushes_there[row], self.pushes[row]);
        }
    }

    /// Sets the tangent planes of Newton's systems, and adds the parts of energies of lengths, of
    /// geodesic bending and of the surface, at the current curves. The edges must be placed there.
    pub fn assemble(
        &mut self,
        newton: &mut Newton<S, D>,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        u: &[Vector<S, D>],
    ) {
        if !self.is_framed {
            self.frame(u);
        }
        S::run(AddStretches { within: self, newton, edges });
        let (system, bases, _) = newton.in_tangent_planes();
        for (weight, functional) in terms {
            let (within, weight) = (&*self, *weight);
            match functional {
                Functional::GeodesicBending(energy) => {
                    S::run(AddBends { within, energy, system, bases, edges, weight, u });
                }
                Functional::GeodesicMaxCurvature(energy) => {
                    S::run(AddBends { within, energy, system, bases, edges, weight, u })
                }
                _ => {}
            }
        }
    }

    /// Sets the tangent planes, and adds the parts of energies of lengths and of the surface's
    /// curvature.
    #[inline(always)]
    fn add_stretches(&mut self, newton: &mut Newton<S, D>, edges: &Edges<S, D>) {
        for (row, normal) in self.normals.iter().enumerate() {
            newton.set_basis(row, basis(*normal));
        }
        newton.close_bases(edges);
        let (system, bases, stretches) = newton.in_tangent_planes();
        // Closed curves have one more edge, which repeats their first.
        let rows = edges.most() + usize::from(edges.is_closed());
        self.links.clear();
        for j in 0..rows {
            self.links.push(Link::new(edges.tangent[j], [&bases[j], &bases[j + 1]]));
            add_edge(system, j, &self.links[j], stretches.of(j));
        }
        for j in 0..edges.windows::<2>() {
            add_edges(system, j, [&self.links[j], &self.links[j + 1]], stretches.of(j).along[1]);
        }
        self.saddles.clear();
        for row in 0..self.normals.len() {
            // −(n·g) W
            let saddle = self.saddle(row, &bases[row]);
            self.saddles.push(saddle);
            let mut shape = saddle.shape;
            for a in 0..2 {
                shape[a] = scale(-self.pushes[row], shape[a]);
            }
            add_own(system, row, &shape);
        }
    }

    /// Adds the second derivatives of an energy of the bends at vertices.
    #[inline(always)]
    fn add_bends<E: InSurface>(
        &self,
        energy: &E,
        system: &mut TangentSystem<S>,
        bases: &[Basis<S, D>],
        edges: &Edges<S, D>,
        weight: S,
        u: &[Vector<S, D>],
    ) {
        for j in 0..edges.windows::<2>() {
            let turn = self.turn(edges, j);
            let third = match self.form.matrix() {
                Some(_) => [[S::ZERO; 2]; 2],
                None => in_plane(&bases[j + 1], &self.form.third(add(self.places[j + 1], u[j + 1]), turn.bend().0)),
            };
            let bend = Bend {
                links: [&self.links[j], &self.links[j + 1]],
                bases: [&bases[j], &bases[j + 1], &bases[j + 2]],
                tangents: turn.tangent,
                inverses: [edges.inverse[j], edges.inverse[j + 1]],
                normal: turn.normal,
                saddle: self.saddles[j + 1],
                third,
            };
            let (measure, penalty) = (turn.measure, turn.penalty);
            bend.add_to(system, j, weight * edges.starts::<2>(j), energy, measure, &penalty);
        }
    }
}

operation! {
    /// [`Within::frame`]
    Frame<'a, S: Scalar; D> { within: &'a mut Within<S, D>, u: &'a [Vector<S, D>] } -> () { within.frame_inlined(u) }
}

operation! {
    /// [`Within::add_of`]
    Add<'a, S: Scalar, E: InSurface; D> {
        within: &'a mut Within<S, D>,
        energy: &'a E,
        weight: S,
        edges: &'a mut Edges<S, D>,
    } -> S { within.add_of(energy, weight, edges) }
}

operation! {
    /// [`Within::add_stretches`]
    AddStretches<'a, S: Scalar; D> {
        within: &'a mut Within<S, D>,
        newton: &'a mut Newton<S, D>,
        edges: &'a Edges<S, D>,
    } -> () { within.add_stretches(newton, edges) }
}

operation! {
    /// [`Within::add_bends`]
    AddBends<'a, S: Scalar, E: InSurface; D> {
        within: &'a Within<S, D>,
        energy: &'a E,
        system: &'a mut TangentSystem<S>,
        bases: &'a [Basis<S, D>],
        edges: &'a Edges<S, D>,
        weight: S,
        u: &'a [Vector<S, D>],
    } -> () { within.add_bends(energy, system, bases, edges, weight, u) }
}

/// Two orthonormal vectors orthogonal to a unit vector in space, without a branch.
///
/// Source: T. Duff et al., *Building an orthonormal basis, revisited*, JCGT 6 (2017).
#[inline(always)]
fn basis<S: Scalar, const D: usize>(n: Vector<S, D>) -> Basis<S, D> {
    let (x, y, z) = (n[0], n[1], n[D - 1]);
    let sign = z.if_positive(S::ONE, -S::ONE);
    let a = -S::ONE / (sign + z);
    let b = x * y * a;
    let (mut first, mut second) = (n, n);
    first[0] = S::ONE + sign * x * x * a;
    first[1] = sign * b;
    first[D - 1] = -sign * x;
    second[0] = b;
    second[1] = sign + y * y * a;
    second[D - 1] = -y;
    [first, second]
}

#[cfg(test)]
mod tests;
