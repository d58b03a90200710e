//! [`Sheet`]: the surface of a mesh in local coordinates.

use glam::{DMat3, DVec3};

use super::cells::Cells;
use super::closest::{self, TrianglePart};
use super::jet::Jet;
use super::patch::Patch;
use super::topology::Topology;
use super::tree::{Sides, Tree};
use crate::error::{Error, Result};
use crate::surface::{MOST_STEPS, Surface, SurfaceKernel, closest_from, projected};

/// The reach of a patch in mean edge lengths of its vertex.
///
/// On tori of regular and of shaken vertices, of 1.5, 2, 2.5 and 3 this and 3 have the least errors
/// of normals and of curvatures. The larger reach needs sheets farther apart.
const REACH: f64 = 2.5;

/// At least this times the longest edge of a vertex is its reach: all triangles are within reach of
/// their corners.
const LONGEST: f64 = 1.25;

/// The most rings of neighbours in a fit.
const RINGS: usize = 3;

/// Two rings of more vertices suffice. Rims have fewer.
const ENOUGH: usize = 15;

/// The most vertices in a fit. Poles of globes may have more around them.
const MOST_AROUND: usize = 200;

/// A point is beyond a rim by more than this part of the longest side there.
const BEYOND: f64 = 0.1;

/// Normals with a cosine below this belong to two sheets.
const OPPOSED: f64 = -0.5;

/// A mesh in local coordinates.
#[derive(Clone, Debug)]
pub struct Sheet {
    pub topology: Topology,
    pub patches: Vec<Patch>,
    /// Whether patches of another sheet reach a vertex.
    mixed: Vec<bool>,
    pub reaches: Cells,
    triangles: Tree,
}

/// The closest point of the triangles.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    pub place: DVec3,
    pub triangle: usize,
    part: TrianglePart,
}

impl Sheet {
    /// The surface of vertices and triangles.
    ///
    /// # Errors
    /// See [`Mesh::new`](super::Mesh::new).
    pub fn new(topology: Topology) -> Result<Self> {
        let normals = normals(&topology);
        if normals.iter().all(|&normal| normal == DVec3::ZERO) {
            return Err(Error::Argument("the triangles of the mesh have no area: give others".into()));
        }
        let patches: Vec<Patch> = (0..topology.places.len())
            .map(|i| {
                let place = topology.places[i];
                let lengths = || topology.neighbours[i].iter().map(|&k| topology.places[k].distance(place));
                let mean = lengths().sum::<f64>() / topology.neighbours[i].len() as f64;
                let longest = lengths().fold(0.0, f64::max);
                let reach = if normals[i] == DVec3::ZERO { 0.0 } else { f64::max(REACH * mean, LONGEST * longest) };
                Patch::flat(place, reach, normals[i]).fitted(&ring(&topology, &normals, i))
            })
            .collect();
        let reaches = Cells::new(&patches.iter().map(|patch| (patch.place, patch.reach)).collect::<Vec<_>>());
        let corners = |t: usize| Sides::around(&topology.corners(t));
        let triangles = Tree::new(&(0..topology.triangles.len()).map(corners).collect::<Vec<_>>());
        let mut sheet = Sheet { mixed: vec![], topology, patches, reaches, triangles };
        sheet.mixed = (0..sheet.patches.len()).map(|i| sheet.is_mixed(i)).collect();
        if sheet.mixed.iter().all(|&is_mixed| is_mixed) {
            return Err(Error::Argument(format!(
                "all sheets of {} are as near to each other as its triangles are long: give smaller triangles",
                sheet.name()
            )));
        }
        Ok(sheet)
    }

    /// Whether a patch of another sheet reaches the vertex: one that faces away, or one above or
    /// below that edges lead to only by a detour.
    fn is_mixed(&self, i: usize) -> bool {
        let own = &self.patches[i];
        let (mut faces_away, mut above) = (false, vec![]);
        for &k in self.reaches.at(own.place).1 {
            let other = &self.patches[k as usize];
            let way = other.place - own.place;
            if way.length() < other.reach {
                faces_away |= own.normal.dot(other.normal) < OPPOSED;
                if own.normal.dot(way).abs() > 0.5 * way.length() {
                    above.push(k as usize);
                }
            }
        }
        faces_away || above.iter().any(|&k| !self.leads_to(i, k))
    }

    /// Whether edges lead from one vertex to another, and no farther than twice their distance.
    fn leads_to(&self, from: usize, to: usize) -> bool {
        let places = &self.topology.places;
        let most = 2.0 * places[from].distance(places[to]);
        let (mut seen, mut next) = (vec![from], 0);
        while let Some(&at) = seen.get(next) {
            if at == to {
                return true;
            }
            next += 1;
            for &k in &self.topology.neighbours[at] {
                if places[from].distance(places[k]) <= most && !seen.contains(&k) {
                    seen.push(k);
                }
            }
        }
        false
    }

    /// Σ w F / Σ w, with derivatives up to an order. NaN out of reach.
    fn jet_to<const ORDER: u8>(&self, x: DVec3, along: DVec3) -> Jet {
        let (mut weights, mut sum) = (Jet::ZERO, Jet::ZERO);
        for &i in self.reaches.at(x).1 {
            if let Some((weight, own)) = self.patches[i as usize].jets::<ORDER>(x, along) {
                weights += weight;
                sum += weight.times(&own, along);
            }
        }
        sum.over(&weights, along)
    }

    /// The projection by Newton steps along ∇F. `None` out of reach.
    fn below(&self, x: DVec3) -> Option<DVec3> {
        let size = self.reaches.at(x).0;
        let slope = |x: DVec3| {
            let jet = self.jet_to::<1>(x, DVec3::ZERO);
            (jet.value, jet.gradient)
        };
        projected(slope, x, size)
    }

    pub fn nearest(&self, x: DVec3) -> Option<Nearest> {
        self.triangles.nearest(x, |triangle| {
            let (place, part) = closest::closest(self.topology.corners(triangle), x);
            (place.distance(x), Nearest { place, triangle, part })
        })
    }

    /// Descends along the surface towards x.
    fn slid(&self, x: DVec3, start: DVec3) -> DVec3 {
        let (mut y, mut part) = (start, 1.0);
        for _ in 0..MOST_STEPS {
            let normal = self.gradient(y).normalize();
            let away = x - y;
            let next = self.below(y + part * (away - away.dot(normal) * normal));
            (y, part) = match next {
                Some(next) if next.distance(x) < y.distance(x) => (next, f64::min(1.0, 2.0 * part)),
                _ => (y, 0.5 * part),
            };
        }
        y
    }

    /// The reach at a point of the triangles.
    fn reach(&self, nearest: &Nearest) -> f64 {
        self.topology.triangles[nearest.triangle].iter().map(|&i| self.patches[i].reach).fold(0.0, f64::max)
    }
}

impl Surface for Sheet {
    fn name(&self) -> String {
        format!("the mesh of {} vertices and {} triangles", self.patches.len(), self.topology.triangles.len())
    }

    fn value(&self, x: DVec3) -> f64 {
        self.jet_to::<0>(x, DVec3::ZERO).value
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        self.jet_to::<1>(x, DVec3::ZERO).gradient
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        self.jet_to::<2>(x, DVec3::ZERO).hessian
    }

    fn jet(&self, x: DVec3) -> (f64, DVec3, DMat3) {
        let jet = self.jet_to::<2>(x, DVec3::ZERO);
        (jet.value, jet.gradient, jet.hessian)
    }

    /// Exact: differences would look for patches twice.
    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        self.jet_to::<3>(x, along).third
    }

    /// Beyond the reach of the triangles it is the closest point: chords of few points pass there.
    fn project(&self, x: DVec3) -> Option<DVec3> {
        self.below(x).or_else(|| self.closest(x))
    }

    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        Some(self)
    }

    /// From the closest point of the triangles.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        let nearest = self.nearest(x)?;
        let reach = self.reach(&nearest);
        let start = self.below(nearest.place)?;
        let is_near = |y: &DVec3| y.distance(nearest.place) <= reach;
        let newton = |start| closest_from(self, x, start, reach).and_then(|y| self.below(y)).filter(is_near);
        newton(start).or_else(|| newton(self.slid(x, start))).or_else(|| self.below(x).filter(is_near)).or(Some(start))
    }

    /// Beyond a rim by more than a tenth of the longest side there. Where sheets mix.
    fn undefined(&self, x: DVec3) -> Option<String> {
        let nearest = self.nearest(x)?;
        let vertices = self.topology.triangles[nearest.triangle];
        if vertices.iter().any(|&i| self.mixed[i]) {
            return Some("lies where sheets of the mesh are as near to each other as its triangles are long".into());
        }
        let is_at_rim = match nearest.part {
            TrianglePart::Corner(k) => self.topology.on_rim[vertices[k]],
            TrianglePart::Side(k) => self.topology.rims[nearest.triangle][k],
            TrianglePart::Inside => false,
        };
        let corners = self.topology.corners(nearest.triangle);
        let longest = (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max);
        let (away, normal) = (x - nearest.place, self.gradient(x).normalize());
        // Out of reach the normal is NaN, and no point is near.
        let is_near = (away - away.dot(normal) * normal).length() <= BEYOND * longest;
        if is_at_rim && !is_near {
            return Some("lies beyond the mesh, at a hole or its rim".into());
        }
        (!normal.is_finite()).then(|| "lies off the mesh".into())
    }
}

/// The CPU fits curves that leave the reach.
impl SurfaceKernel for Sheet {
    fn text(&self) -> String {
        include_str!("../../../shaders/surface/mesh.wgsl").into()
    }

    fn table(&self) -> Vec<f64> {
        let mut table = self.reaches.table(Patch::NUMBERS);
        self.patches.iter().for_each(|patch| table.extend(patch.numbers()));
        table
    }

    fn loop_iterations(&self) -> usize {
        self.reaches.turns()
    }
}

/// Normals of triangles, weighted by their angles at a vertex. 0 where they cancel.
fn normals(topology: &Topology) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; topology.places.len()];
    for (t, vertices) in topology.triangles.iter().enumerate() {
        let corners = topology.corners(t);
        for k in 0..3 {
            let [to, back] = [1, 2].map(|step| (corners[(k + step) % 3] - corners[k]).normalize_or_zero());
            let normal = to.cross(back);
            normals[vertices[k]] += normal.length().atan2(to.dot(back)) * normal.normalize_or_zero();
        }
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}

/// The vertices around one: 2 rings of neighbours, and a third if these are few. A ring ends where
/// the normal has turned by 90°.
fn ring(topology: &Topology, normals: &[DVec3], i: usize) -> Vec<DVec3> {
    let (mut seen, mut from) = (vec![i], 0);
    for round in 0..RINGS {
        if round >= 2 && seen.len() > ENOUGH {
            break;
        }
        let to = seen.len();
        for at in from..to {
            for &k in &topology.neighbours[seen[at]] {
                if seen.len() <= MOST_AROUND && normals[k].dot(normals[i]) > 0.0 && !seen.contains(&k) {
                    seen.push(k);
                }
            }
        }
        from = to;
    }
    seen[1..].iter().map(|&k| topology.places[k]).collect()
}
