//! [`Topology`]: vertices and triangles of a mesh, merged, oriented, with their neighbours and
//! their rims.

use std::collections::HashMap;

use glam::DVec3;

use super::tree::Sides;
use crate::error::{Error, Result};

/// The adjacency of a mesh of one orientation.
#[derive(Clone, Debug)]
pub struct Topology {
    /// Every place once.
    pub places: Vec<DVec3>,
    /// Vertices of triangles, counterclockwise around their normals.
    pub triangles: Vec<[usize; 3]>,
    /// Whether side k of a triangle, from its vertex k to the next, has no other triangle.
    pub rims: Vec<[bool; 3]>,
    /// Whether a vertex lies on such a side.
    pub on_rim: Vec<bool>,
    /// The vertices that share a side with each vertex.
    pub neighbours: Vec<Vec<usize>>,
}

/// A side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Its vertices, the smaller number first.
    ends: [usize; 2],
    triangle: usize,
    /// Which side it is.
    k: usize,
    /// Whether it runs from the smaller number to the larger.
    forward: bool,
}

impl Topology {
    /// Merges vertices at the same place, drops triangles that have a vertex twice, and orients the
    /// others.
    ///
    /// # Errors
    /// See [`Mesh::new`](super::Mesh::new).
    pub fn new(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> Result<Self> {
        let refuse = |why: String| Err(Error::Argument(why));
        if triangles.is_empty() {
            return refuse("the mesh has no triangles: give some".into());
        }
        if triangles.len() > u32::MAX as usize / 4 {
            return refuse(format!("the mesh has {} triangles: give at most 2³⁰", triangles.len()));
        }
        let mut merged = Merged { own: HashMap::new(), places: vec![], of: vec![] };
        let mut all = Vec::with_capacity(triangles.len());
        for (t, triangle) in triangles.iter().enumerate() {
            let mut corners = [[0.0; 3]; 3];
            for (corner, &vertex) in corners.iter_mut().zip(triangle) {
                *corner = match vertices.get(vertex) {
                    Some(place) if place.iter().all(|x| x.is_finite()) => *place,
                    Some(place) => {
                        return refuse(format!(
                            "vertex {vertex} of triangle {t} lies at {place:?}: give finite numbers"
                        ));
                    }
                    None => {
                        return refuse(format!(
                            "triangle {t} has vertex {vertex}, but the mesh has {} vertices, counted from 0",
                            vertices.len()
                        ));
                    }
                };
            }
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                all.push(std::array::from_fn(|k| merged.vertex(triangle[k], corners[k])));
            }
        }
        if all.is_empty() {
            return refuse(format!(
                "all {} triangles of the mesh have two vertices at one place: give triangles of three corners",
                triangles.len()
            ));
        }
        let mut topology = Topology {
            rims: vec![[false; 3]; all.len()],
            on_rim: vec![false; merged.places.len()],
            triangles: all,
            neighbours: vec![vec![]; merged.places.len()],
            places: merged.places,
        };
        let sides = topology.sides();
        let pairs = topology.pairs(&sides, &merged.of)?;
        topology.orient(&pairs)?;
        for shared in sides.chunk_by(|a, b| a.ends == b.ends) {
            let [a, b] = shared[0].ends;
            topology.neighbours[a].push(b);
            topology.neighbours[b].push(a);
        }
        Ok(topology)
    }

    /// Moves the middle of the box around the vertices to the origin, and returns where it was.
    pub fn move_to_middle(&mut self) -> DVec3 {
        let middle = Sides::around(&self.places).middle();
        self.places.iter_mut().for_each(|place| *place -= middle);
        middle
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.places[vertex])
    }

    /// All sides, sorted by their ends.
    fn sides(&self) -> Vec<Side> {
        let of = |(triangle, vertices): (usize, &[usize; 3])| {
            let vertices = *vertices;
            (0..3).map(move |k| {
                let [from, to] = [vertices[k], vertices[(k + 1) % 3]];
                Side { ends: [from.min(to), from.max(to)], triangle, k, forward: from < to }
            })
        };
        let mut sides: Vec<Side> = self.triangles.iter().enumerate().flat_map(of).collect();
        sides.sort_unstable();
        sides
    }

    /// Triangles that share a side. Sides of one triangle become rims.
    fn pairs(&mut self, sides: &[Side], of: &[usize]) -> Result<Vec<[Side; 2]>> {
        let mut pairs = Vec::with_capacity(sides.len() / 2);
        for shared in sides.chunk_by(|a, b| a.ends == b.ends) {
            match *shared {
                [side] => {
                    self.rims[side.triangle][side.k] = true;
                    side.ends.iter().for_each(|&end| self.on_rim[end] = true);
                }
                [a, b] => pairs.push([a, b]),
                _ => {
                    let [a, b] = shared[0].ends.map(|end| (of[end], self.places[end]));
                    return Err(Error::Argument(format!(
                        "the edge from {} to {}, of vertices {} and {} counted from 0, has {} triangles: give a mesh whose \
                         edges have one or two",
                        a.1,
                        b.1,
                        a.0,
                        b.0,
                        shared.len()
                    )));
                }
            }
        }
        Ok(pairs)
    }

    /// Turns triangles over, so that all of a part have the orientation of its first.
    fn orient(&mut self, pairs: &[[Side; 2]]) -> Result<()> {
        let mut beside: Vec<Vec<(usize, bool)>> = vec![vec![]; self.triangles.len()];
        for [a, b] in pairs {
            let is_turned = a.forward == b.forward;
            beside[a.triangle].push((b.triangle, is_turned));
            beside[b.triangle].push((a.triangle, is_turned));
        }
        let mut turned: Vec<Option<bool>> = vec![None; self.triangles.len()];
        for first in 0..self.triangles.len() {
            if turned[first].is_some() {
                continue;
            }
            turned[first] = Some(false);
            let mut open = vec![first];
            while let Some(triangle) = open.pop() {
                let own = turned[triangle] == Some(true);
                for &(other, is_turned) in &beside[triangle] {
                    match turned[other] {
                        None => {
                            turned[other] = Some(own != is_turned);
                            open.push(other);
                        }
                        Some(found) if found != (own != is_turned) => {
                            let [a, b, c] = self.corners(other);
                            return Err(Error::Argument(format!(
                                "the mesh has one side only, as a Möbius band: the way around it comes back to the triangle \
                                 at {a}, {b}, {c} turned over; cut it open"
                            )));
                        }
                        Some(_) => {}
                    }
                }
            }
        }
        for (t, turned) in turned.into_iter().enumerate() {
            if turned == Some(true) {
                self.triangles[t].swap(1, 2);
                self.rims[t].swap(0, 2);
            }
        }
        Ok(())
    }
}

/// Vertices by their places.
struct Merged {
    own: HashMap<[u64; 3], usize>,
    places: Vec<DVec3>,
    /// The first number that each place was given by.
    of: Vec<usize>,
}

impl Merged {
    fn vertex(&mut self, vertex: usize, place: [f64; 3]) -> usize {
        // −0 is 0.
        let key = place.map(|x| (x + 0.0).to_bits());
        *self.own.entry(key).or_insert_with(|| {
            self.places.push(DVec3::from_array(place));
            self.of.push(vertex);
            self.places.len() - 1
        })
    }
}
