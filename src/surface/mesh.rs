//! [`Mesh`]: smooth surfaces through the vertices of triangles.

mod cells;
mod closest;
mod jet;
mod patch;
mod topology;
mod tree;

use glam::{DMat3, DVec3};

use self::cells::Cells;
use self::closest::Part;
use self::jet::Jet;
use self::patch::Patch;
use self::topology::Topology;
use self::tree::{Sides, Tree};
use super::{MOST_STEPS, Surface, straight_below, way_down};
use crate::error::{Error, Result};

/// The reach of a patch in mean edge lengths of its vertex.
///
/// On tori of regular and of shaken vertices, of 1.5, 2, 2.5 and 3 this and 3 have the least errors of normals and of
/// curvatures. The larger reach asks for sheets farther apart.
// Not in the kernel: the host fits patches and judges curves.
const REACH: f64 = 2.5;

/// At least this times the longest edge of a vertex is its reach: all triangles are within reach of their corners.
// Not in the kernel: see `REACH`.
const LONGEST: f64 = 1.25;

/// Rings of neighbours that are fitted at the most: the third where two have fewer than so many, as at rims.
const RINGS: usize = 3;
const ENOUGH: usize = 15;

/// Vertices that are fitted at the most. Poles of globes may have more around them.
const MOST_AROUND: usize = 200;

/// A point is beyond a rim by more than this part of the longest side there.
// Not in the kernel: see `REACH`.
const BEYOND: f64 = 0.1;

/// Normals with a cosine below this are those of two sheets.
// Not in the kernel: see `REACH`.
const OPPOSED: f64 = -0.5;

/// The smooth surface that a triangle mesh stands for.
///
/// Triangles have no curvature. So curves lie in a surface near them, which has: F = Σ wᵢ Fᵢ / Σ wᵢ, a partition of unity of
/// patches, one a vertex (after Y. Ohtake, A. Belyaev, M. Alexa, G. Turk, H.-P. Seidel, *Multi-level partition of unity
/// implicits*, SIGGRAPH 2003).
///
/// - Fᵢ = r φ(s) with s = (x − pᵢ)/r is zero at vertex pᵢ: φ = n·s + ½ sᵀS s and a cubic of the coordinates of s in the plane
///   across n. Normal, curvatures and cubic are fitted by least squares to the vertices of two rings of neighbours, and of
///   three where two are small. S has the mean curvature along n, so that the vertices of a sphere give the sphere, to
///   rounding. A vertex of fewer than 12 neighbours around has no cubic; one of fewer than 6 has a plane.
/// - wᵢ = (1 − |s|²)⁴ within the reach r, which is 2.5 mean edges of the vertex, or 1.25 of its longest if that is more.
///
/// F has three continuous derivatives, and all are exact, so that Newton's method converges as in other surfaces. F is of the
/// dimension of a length, and near the distance from the surface. Out of reach of all vertices it is NaN.
///
/// # Accuracy
///
/// For vertices in a smooth surface and edges of length h, places have errors of order h⁴, normals of h³ and curvatures of
/// h². Largest errors found, on the torus of radii 1 and ½ and vertices shaken by a quarter of an edge:
///
/// | h | place | normal | curvature | at a rim: place | normal | curvature |
/// |---|---|---|---|---|---|---|
/// | 0.18 | 5.5e-4 | 3.5e-3 | 8.7e-2 | 6.1e-4 | 4.9e-2 | 1.6 |
/// | 0.09 | 3.1e-5 | 3.9e-4 | 1.4e-2 | 5.0e-5 | 5.9e-3 | 0.38 |
/// | 0.046 | 2.8e-6 | 6.1e-5 | 5.2e-3 | 2.9e-6 | 5.1e-4 | 5.7e-2 |
///
/// So a curvature has two orders less than a place, and at rims it is ten to thirty times as wrong. Lengths of geodesics and
/// energies of fair curves have errors of about order h⁴, as places. The length of the torus's inner equator is off by 6e-3,
/// 3e-4 and 1.5e-5 of itself for h of 0.3, 0.15 and 0.08, and the energy of a fair curve in the ellipsoid of semi-axes 1.5, 1.2
/// and 1 by 6e-4, 6e-5 and 4e-6 for h of 0.37, 0.19 and 0.09.
///
/// Vertices are taken as they stand. Noise of a scan is in the surface too: smooth the mesh first. Creases are rounded within
/// about a reach, and the surface swings beside them: geodesics over the edge of a cube are too long by a part of about h/10.
///
/// # On GPUs
///
/// Fair curves run on GPUs with f64, with the patches in a table of 23 numbers a vertex and of 25 to 50 for the lists of those
/// that reach into a place. Fair curves there are within 1e-9 of their size of the CPU's. A curve of which a step leaves the
/// reach of all patches is left to the CPU.
///
/// # Where it is not known
///
/// - Beyond rims: the surface goes on for a reach.
/// - Where two sheets are within reach of each other, their patches mix. Smaller triangles keep them apart. Sheets mix
///   where the normals of vertices within reach are more than 120° apart, or where a vertex stands above another that edges
///   lead to by a detour.
///
/// ```
/// use faircurve::surface::{Mesh, Surface};
/// use glam::DVec3;
///
/// // A roof of 5 × 5 vertices, z = −x²/2, and a hole in it.
/// let place = |k: usize| [0.2 * (k % 5) as f64 - 0.4, 0.2 * (k / 5) as f64, -0.5 * (0.2 * (k % 5) as f64 - 0.4).powi(2)];
/// let vertices: Vec<[f64; 3]> = (0..25).map(place).collect();
/// let cell = |k: usize| {
///     let a = k / 4 * 5 + k % 4;
///     [[a, a + 1, a + 6], [a, a + 6, a + 5]]
/// };
/// let triangles: Vec<[usize; 3]> = (0..15).flat_map(cell).collect();
/// let roof = Mesh::new(&vertices, &triangles)?;
/// let top = roof.closest(DVec3::new(0.05, 0.3, 0.2)).unwrap();
/// assert!((top.z + 0.5 * top.x * top.x).abs() < 1e-4);
/// assert_eq!(roof.unknown(top), None);
/// assert_eq!(roof.unknown(DVec3::new(0.38, 0.75, -0.072)).unwrap(), "lies beyond the mesh, at a hole or its rim");
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mesh {
    topology: Topology,
    patches: Vec<Patch>,
    /// Whether patches of another sheet reach a vertex.
    mixed: Vec<bool>,
    reaches: Cells,
    triangles: Tree,
}

/// The closest point of the triangles.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    place: DVec3,
    triangle: usize,
    part: Part,
}

impl Mesh {
    /// The surface of triangles of vertices that are counted from 0.
    ///
    /// Vertices at the same place are merged. Vertices of no triangle, and triangles with two vertices at one place are
    /// passed over. Triangles are turned over where neighbours have another orientation.
    ///
    /// # Errors
    /// - No triangles, or none with three corners and an area.
    /// - A vertex that is not there, or is not finite.
    /// - An edge of more than two triangles.
    /// - A mesh of one side, as a Möbius band.
    /// - Sheets that are within reach of each other everywhere, as those of a cube of 8 vertices.
    pub fn new(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> Result<Self> {
        let topology = Topology::new(vertices, triangles)?;
        let normals = normals(&topology);
        if normals.iter().all(|&normal| normal == DVec3::ZERO) {
            return Err(Error::Argument("the triangles of the mesh have no area: give others".into()));
        }
        let patches: Vec<Patch> = (0..topology.places.len())
            .map(|i| {
                let place = topology.places[i];
                let lengths = || topology.neighbours(i).iter().map(|&k| topology.places[k].distance(place));
                let mean = lengths().sum::<f64>() / topology.neighbours(i).len() as f64;
                let longest = lengths().fold(0.0, f64::max);
                let reach = if normals[i] == DVec3::ZERO { 0.0 } else { f64::max(REACH * mean, LONGEST * longest) };
                Patch::flat(place, reach, normals[i]).fitted(&ring(&topology, &normals, i))
            })
            .collect();
        let reaches = Cells::new(&patches.iter().map(|patch| (patch.place, patch.reach)).collect::<Vec<_>>());
        let corners = |t: usize| Sides::around(&topology.corners(t));
        let triangles = Tree::new(&(0..topology.triangles.len()).map(corners).collect::<Vec<_>>());
        let mut mesh = Mesh { mixed: vec![], topology, patches, reaches, triangles };
        mesh.mixed = (0..mesh.patches.len()).map(|i| mesh.is_mixed(i)).collect();
        if mesh.mixed.iter().all(|&is_mixed| is_mixed) {
            return Err(Error::Argument(format!(
                "all sheets of {} are as near to each other as its triangles are long: give smaller triangles",
                mesh.name()
            )));
        }
        Ok(mesh)
    }

    /// Whether a patch reaches the vertex from another sheet: one that faces away, or one above or below that no way of
    /// edges leads to nearby.
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
            for &k in self.topology.neighbours(at) {
                if places[from].distance(places[k]) <= most && !seen.contains(&k) {
                    seen.push(k);
                }
            }
        }
        false
    }

    /// Σ w F / Σ w, with derivatives up to an order. Numbers that are none where nothing reaches.
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

    /// Where the way along ∇F ends. `None` out of reach.
    fn below(&self, x: DVec3) -> Option<DVec3> {
        let size = self.reaches.at(x).0;
        let slope = |x: DVec3| {
            let jet = self.jet_to::<1>(x, DVec3::ZERO);
            (jet.value, jet.gradient)
        };
        way_down(slope, x, size)
    }

    fn nearest(&self, x: DVec3) -> Option<Nearest> {
        self.triangles.nearest(x, |triangle| {
            let (place, part) = closest::closest(self.topology.corners(triangle), x);
            (place.distance(x), Nearest { place, triangle, part })
        })
    }

    /// A point of the surface after steps along it that come closer to x.
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

impl Surface for Mesh {
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
    fn foot(&self, x: DVec3) -> Option<DVec3> {
        self.below(x).or_else(|| self.closest(x))
    }

    /// Curves that come out of reach are left to the CPU.
    fn wgsl(&self) -> Option<String> {
        Some(include_str!("../../shaders/surface/mesh.wgsl").into())
    }

    fn wgsl_table(&self) -> Vec<f64> {
        let mut table = self.reaches.table(Patch::NUMBERS);
        self.patches.iter().for_each(|patch| table.extend(patch.numbers()));
        table
    }

    fn wgsl_turns(&self) -> usize {
        self.reaches.turns()
    }

    /// From the closest point of the triangles.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        let nearest = self.nearest(x)?;
        let reach = self.reach(&nearest);
        let start = self.below(nearest.place)?;
        let is_near = |y: &DVec3| y.distance(nearest.place) <= reach;
        let newton = |start| straight_below(self, x, start, reach).and_then(|y| self.below(y)).filter(is_near);
        newton(start).or_else(|| newton(self.slid(x, start))).or_else(|| self.below(x).filter(is_near)).or(Some(start))
    }

    /// Beyond a rim by more than a tenth of the longest side there. Where sheets mix.
    fn unknown(&self, x: DVec3) -> Option<String> {
        let nearest = self.nearest(x)?;
        let vertices = self.topology.triangles[nearest.triangle];
        if vertices.iter().any(|&i| self.mixed[i]) {
            return Some("lies where sheets of the mesh are as near to each other as its triangles are long".into());
        }
        let is_at_rim = match nearest.part {
            Part::Corner(k) => self.topology.on_rim[vertices[k]],
            Part::Side(k) => self.topology.rims[nearest.triangle][k],
            Part::Inside => false,
        };
        let corners = self.topology.corners(nearest.triangle);
        let longest = (0..3).map(|k| corners[k].distance(corners[(k + 1) % 3])).fold(0.0, f64::max);
        let (away, normal) = (x - nearest.place, self.gradient(x).normalize());
        // Out of reach the normal is no number, and nothing is near.
        let is_near = (away - away.dot(normal) * normal).length() <= BEYOND * longest;
        if is_at_rim && !is_near {
            return Some("lies beyond the mesh, at a hole or its rim".into());
        }
        (!normal.is_finite()).then(|| "lies off the mesh".into())
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

/// The places of the vertices around one: of 2 rings of neighbours, and of the next as long as there are few. Where the
/// normal has turned by 90° a ring ends.
fn ring(topology: &Topology, normals: &[DVec3], i: usize) -> Vec<DVec3> {
    let (mut seen, mut from) = (vec![i], 0);
    for round in 0..RINGS {
        if round >= 2 && seen.len() > ENOUGH {
            break;
        }
        let to = seen.len();
        for at in from..to {
            for &k in topology.neighbours(seen[at]) {
                if seen.len() <= MOST_AROUND && normals[k].dot(normals[i]) > 0.0 && !seen.contains(&k) {
                    seen.push(k);
                }
            }
        }
        from = to;
    }
    seen[1..].iter().map(|&k| topology.places[k]).collect()
}

#[cfg(test)]
pub(super) mod tests;
