//! [`Within`]: the surface that the curves of all lanes lie in.
//!
//! A step moves every vertex in its tangent plane, and then back to the surface:
//!
//! ```text
//! x ← R(x + B u),  g → Bᵀg,  H_ij → B_iᵀ (H_ij − δ_ij l_i ∇²F/|∇F|) B_j,  l = n·g
//! ```
//!
//! B holds two unit vectors across n, and R goes along ∇F. No multipliers are left, and the systems are those of planar
//! curves: see [`Newton`](super::newton::Newton).

// Loops over coordinates and lanes by index match the formulas, and stay within code for wide registers.
#![allow(clippy::needless_range_loop)]

mod form;

pub(crate) use self::form::Local;
pub(super) use self::form::has_kernel;
use self::form::{Form, lane_of};
use super::block::{Block, add_scaled, transpose};
use super::edges::Edges;
use super::energy::Functional;
use super::energy::geodesic_bending::{GeodesicCurb, InSurface, Turn};
use super::newton::Newton;
use super::onto::WITHIN_STEPS;
use crate::linalg::scalar::{Vector, add, dot, number, scale, subtract};
use crate::linalg::{Real, Scalar};

/// Two unit vectors across the normal.
pub(super) type Basis<S, const D: usize> = [Vector<S, D>; 2];

/// The surface of every lane, and what it does to its vertices.
pub(crate) struct Within<S, const D: usize> {
    form: Form<S, D>,
    /// Where the vertices of the bases lie. Closed curves repeat their first.
    places: Vec<Vector<S, D>>,
    /// n and W = ∇²F/|∇F| where the vertices were last framed.
    normals: Vec<Vector<S, D>>,
    shapes: Vec<Block<S, D>>,
    /// The gradient of geodesic bending by the places of vertices.
    by_place: Vec<Vector<S, D>>,
    /// n·g of the last evaluation, and of the curves as they stand.
    pushes_there: Vec<S>,
    pushes: Vec<S>,
}

impl<S: Scalar, const D: usize> Within<S, D> {
    /// The surfaces of all lanes, and where the vertices of their bases lie.
    pub fn new(lanes: &[(&Local, &[Vector<f64, D>])], edges: &Edges<S, D>) -> Self {
        let rows = edges.rows();
        let mut places = vec![[S::ZERO; D]; rows];
        for (lane, (_, own)) in lanes.iter().enumerate() {
            for (row, place) in places.iter_mut().enumerate() {
                // Rows beyond the last vertex repeat the first, which a closed curve asks for.
                let own = own.get(row).unwrap_or(&own[0]);
                (0..D).for_each(|c| place[c].set_lane(lane, number::<S>(own[c])));
            }
        }
        let locals: Vec<&Local> = lanes.iter().map(|(local, _)| *local).collect();
        Within {
            form: Form::new(&locals),
            places,
            normals: vec![[S::ZERO; D]; rows],
            shapes: vec![[[S::ZERO; D]; D]; rows],
            by_place: vec![[S::ZERO; D]; rows],
            pushes_there: vec![S::ZERO; rows],
            pushes: vec![S::ZERO; rows],
        }
    }

    /// Moves vertices that may move back to the surface, and those on rails within their planes.
    #[inline(always)]
    pub fn retract(&self, movable: &[S], rails: &[(usize, Vector<f64, D>)], u: &mut [Vector<S, D>]) {
        if !rails.is_empty() {
            self.retract_on_rails(rails, u);
        }
        for row in 0..u.len() {
            let way = self.form.way(add(self.places[row], u[row]));
            for c in 0..D {
                u[row][c] = movable[row].if_positive(u[row][c] + way[c], u[row][c]);
            }
        }
    }

    /// Moves the vertices on rails back. What has been moved is then left where it is.
    #[inline(never)]
    fn retract_on_rails(&self, rails: &[(usize, Vector<f64, D>)], u: &mut [Vector<S, D>]) {
        for (row, across) in rails {
            let mut b = u[*row];
            (0..D).for_each(|c| b[c] = S::of(across[c]));
            for _ in 0..WITHIN_STEPS {
                let (value, normal) = self.form.height(add(self.places[*row], u[*row]));
                let way = subtract(normal, scale(dot(normal, b), b));
                u[*row] = subtract(u[*row], scale(value / dot(way, way), way));
            }
        }
    }

    /// The normals of a curve alone.
    pub fn normals_of_one(&self) -> Vec<Vector<f64, D>> {
        self.normals.iter().map(|normal| lane_of(normal, 0)).collect()
    }

    /// Takes normals and second derivatives at the vertices.
    #[inline(always)]
    pub fn frame(&mut self, u: &[Vector<S, D>]) {
        for row in 0..u.len() {
            (self.normals[row], self.shapes[row]) = self.form.jet(add(self.places[row], u[row]));
        }
    }

    /// The vertex between the edges j and j + 1.
    #[inline(always)]
    fn turn(&self, edges: &Edges<S, D>, j: usize) -> Turn<S, D> {
        Turn {
            tangent: [edges.tangent[j], edges.tangent[j + 1]],
            length: [edges.length[j], edges.length[j + 1]],
            normal: self.normals[j + 1],
            shape: self.shapes[j + 1],
            fence: edges.fence(0, j),
        }
    }

    /// Adds geodesic bending to the partial derivatives, and returns its value. The vertices have been
    /// [framed](Self::frame).
    #[inline(always)]
    pub fn add(&mut self, edges: &mut Edges<S, D>, terms: &[(S, &Functional)]) -> S {
        self.by_place.fill([S::ZERO; D]);
        let mut value = S::ZERO;
        for (weight, functional) in terms {
            match functional {
                Functional::GeodesicBending(bending) => value += self.add_of(bending, *weight, edges),
                Functional::GeodesicCurb(curb) => value += self.add_apart(curb, *weight, edges),
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

    /// [`add_of`](Self::add_of), compiled apart from code for wide registers, which would take the compiler minutes.
    #[inline(never)]
    fn add_apart(&mut self, curb: &GeodesicCurb, weight: S, edges: &mut Edges<S, D>) -> S {
        self.add_of(curb, weight, edges)
    }

    #[inline(always)]
    fn add_of<E: InSurface>(&mut self, energy: &E, weight: S, edges: &mut Edges<S, D>) -> S {
        let mut value = S::ZERO;
        for j in 0..edges.windows::<2>() {
            let (partials, by_place) = energy.gradient(&self.turn(edges, j));
            let weight = weight * edges.starts::<2>(j);
            self.by_place[j + 1] = add(self.by_place[j + 1], scale(weight, by_place));
            value += edges.scatter_both(j, weight, &partials);
        }
        value
    }

    /// The value of geodesic bending and fences where the vertices were framed.
    pub fn value(&self, edges: &Edges<S, D>, terms: &[(S, &Functional)]) -> S {
        let mut value = S::ZERO;
        for (weight, functional) in terms {
            for j in 0..edges.windows::<2>() {
                let own = match functional {
                    Functional::GeodesicBending(bending) => bending.value(&self.turn(edges, j)),
                    Functional::GeodesicCurb(curb) => curb.value(&self.turn(edges, j)),
                    _ => break,
                };
                value += *weight * edges.starts::<2>(j) * own;
            }
        }
        value
    }

    /// Completes a gradient, and leaves its part in the tangent planes.
    #[inline(always)]
    pub fn settle(&mut self, movable: &[S], gradient: &mut [Vector<S, D>]) {
        for row in 0..gradient.len() {
            let whole = add(gradient[row], scale(movable[row], self.by_place[row]));
            let push = dot(whole, self.normals[row]);
            self.pushes_there[row] = push;
            gradient[row] = subtract(whole, scale(push, self.normals[row]));
        }
    }

    /// The part of a direction at a vertex that lies in its tangent plane.
    #[inline(always)]
    pub fn tangential(&self, row: usize, x: Vector<S, D>) -> Vector<S, D> {
        subtract(x, scale(dot(x, self.normals[row]), self.normals[row]))
    }

    /// Takes the forces of constraints from n·g of the last evaluation, of a curve alone.
    ///
    /// A plane b·x that a vertex stays in bends on the surface as (n·b) W.
    pub fn relieve(&mut self, forces: impl Iterator<Item = (usize, Vector<f64, D>)>) {
        for (row, force) in forces {
            let along: f64 = (0..D).map(|c| force[c] * self.normals[row][c].lane(0).to_f64()).sum();
            self.pushes_there[row] -= S::of(along);
        }
    }

    /// Keeps the last evaluation where `accepted` is 1.
    #[inline(always)]
    pub fn accept(&mut self, accepted: S) {
        for row in 0..self.pushes.len() {
            self.pushes[row] = accepted.if_positive(self.pushes_there[row], self.pushes[row]);
        }
    }

    /// Adds what the surface adds to the Hessian at the curves as they stand, where the edges are placed, and gives
    /// Newton's systems their tangent planes.
    #[inline(always)]
    pub fn assemble(
        &mut self,
        newton: &mut Newton<S, D>,
        edges: &Edges<S, D>,
        terms: &[(S, &Functional)],
        u: &[Vector<S, D>],
    ) {
        self.frame(u);
        for (weight, functional) in terms {
            match functional {
                Functional::GeodesicBending(bending) => self.add_hessians(bending, newton, edges, *weight, u),
                Functional::GeodesicCurb(curb) => self.add_hessians_apart(curb, newton, edges, *weight, u),
                _ => {}
            }
        }
        for row in 0..u.len() {
            let mut bent = self.shapes[row];
            for a in 0..D {
                bent[a] = scale(-self.pushes[row], bent[a]);
            }
            newton.hold(row, bent, S::ZERO);
            newton.set_basis(row, basis(self.normals[row]));
        }
        newton.close_bases(edges);
    }

    /// [`add_hessians`](Self::add_hessians), compiled apart.
    #[inline(never)]
    fn add_hessians_apart(
        &self,
        curb: &GeodesicCurb,
        newton: &mut Newton<S, D>,
        edges: &Edges<S, D>,
        weight: S,
        u: &[Vector<S, D>],
    ) {
        self.add_hessians(curb, newton, edges, weight, u);
    }

    #[inline(always)]
    fn add_hessians<E: InSurface>(
        &self,
        energy: &E,
        newton: &mut Newton<S, D>,
        edges: &Edges<S, D>,
        weight: S,
        u: &[Vector<S, D>],
    ) {
        for j in 0..edges.windows::<2>() {
            self.add_hessian(energy, newton, edges, j, weight * edges.starts::<2>(j), u);
        }
        newton.close();
    }

    /// Adds the second derivatives of an energy at the vertex between the edges j and j + 1.
    #[inline(always)]
    fn add_hessian<E: InSurface>(
        &self,
        energy: &E,
        newton: &mut Newton<S, D>,
        edges: &Edges<S, D>,
        j: usize,
        weight: S,
        u: &[Vector<S, D>],
    ) {
        let turn = self.turn(edges, j);
        let third = self.form.third(add(self.places[j + 1], u[j + 1]), turn.bend());
        let (first, _) = energy.gradient(&turn);
        let (second, by) = energy.hessian(&turn, &third);
        let inverse = [edges.inverse[j], edges.inverse[j + 1]];
        newton.add_turn(j, weight, &turn.tangent, &inverse, &first, &second);
        // By edge and place: ∂T/∂e = P/Δs, ∂Δs/∂e = T.
        let mut by_edges = by.tangents;
        for e in 0..2 {
            let (t, r) = (turn.tangent[e], inverse[e]);
            for b in 0..D {
                let mut along = S::ZERO;
                for a in 0..D {
                    along += t[a] * by.tangents[e][a][b];
                }
                for a in 0..D {
                    by_edges[e][a][b] = r * (by.tangents[e][a][b] - t[a] * along) + t[a] * by.lengths[b];
                }
            }
        }
        // The edges are v₁ − v₀ and v₂ − v₁, and the place is v₁.
        let [before, after] = &by_edges;
        newton.add_block(j, 1, -weight, before);
        newton.add_block(j + 1, 1, weight, &transpose(after));
        let mut own = by.place;
        add_scaled(&mut own, S::ONE, before);
        add_scaled(&mut own, S::ONE, &transpose(before));
        add_scaled(&mut own, -S::ONE, after);
        add_scaled(&mut own, -S::ONE, &transpose(after));
        newton.add_block(j + 1, 0, weight, &own);
    }
}

/// Two unit vectors across a unit vector in space, without a branch.
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
