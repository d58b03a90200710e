//! [`Mesh`]: smooth surfaces through the vertices of triangles.

mod cells;
mod closest;
mod jet;
mod patch;
mod sheet;
mod topology;
mod tree;

use std::sync::Arc;

use glam::{DMat3, DVec3};

use self::sheet::Sheet;
use self::topology::Topology;
use super::Surface;
use crate::error::Result;

/// The smooth surface that a triangle mesh stands for.
///
/// Triangles have no curvature. So curves lie in a smooth surface near them: F = Σ wᵢ Fᵢ / Σ wᵢ, a
/// partition of unity with one patch per vertex (after Y. Ohtake, A. Belyaev, M. Alexa, G. Turk,
/// H.-P. Seidel, *Multi-level partition of unity implicits*, SIGGRAPH 2003).
///
/// - Fᵢ = r φ(s) with s = (x − pᵢ)/r is zero at vertex pᵢ: φ = n·s + ½ sᵀS s and a cubic of the
///   coordinates of s in the plane orthogonal to n. Normal, curvatures and cubic are least-squares
///   fits to the vertices of two rings of neighbours, or of three if two are small. S has the mean
///   curvature along n, so that the vertices of a sphere give the sphere, to rounding. A vertex
///   with fewer than 12 vertices around it has no cubic; with fewer than 6 it has a plane.
/// - wᵢ = (1 − |s|²)⁴ within the reach r, which is 2.5 mean edges of the vertex, or 1.25 of its
///   longest if that is more.
///
/// F has three continuous and exact derivatives, so Newton's method converges as in other surfaces.
/// F is a length, close to the distance from the surface. Out of reach of all vertices it is NaN.
///
/// # Accuracy
///
/// For vertices in a smooth surface and edges of length h, positions have errors of order h⁴,
/// normals of h³ and curvatures of h². Largest errors found, on the torus of radii 1 and ½ and
/// vertices shaken by a quarter of an edge:
///
/// | h | position | normal | curvature | at a rim: position | normal | curvature |
/// |---|---|---|---|---|---|---|
/// | 0.18 | 5.5e-4 | 3.5e-3 | 8.7e-2 | 6.1e-4 | 4.9e-2 | 1.6 |
/// | 0.09 | 3.1e-5 | 3.9e-4 | 1.4e-2 | 5.0e-5 | 5.9e-3 | 0.38 |
/// | 0.046 | 2.8e-6 | 6.1e-5 | 5.2e-3 | 2.9e-6 | 5.1e-4 | 5.7e-2 |
///
/// So a curvature has two orders less than a position, and at rims it is ten to thirty times as
/// wrong. Lengths of geodesics and energies of fair curves converge about as h⁴. The length of the
/// torus's inner equator is off by 6e-3, 3e-4 and 1.5e-5 of itself for h of 0.3, 0.15 and 0.08, and
/// the energy of a fair curve in the ellipsoid of semi-axes 1.5, 1.2 and 1 by 6e-4, 6e-5 and 4e-6
/// for h of 0.37, 0.19 and 0.09.
///
/// Vertices are interpolated. Noise of a scan is in the surface too: smooth the mesh first. Creases
/// are rounded within about a reach, and the surface oscillates near them: geodesics over the edge
/// of a cube are too long by about h/10 of their length.
///
/// # On GPUs
///
/// Fair curves run on GPUs with f64, with a table of 23 numbers per vertex for the patches and 25
/// to 50 for the lists of patches that reach into a cell. They are within 1e-9 of their size of the
/// CPU's. The CPU fits a curve if a step leaves the reach of all patches.
///
/// # Where it is undefined
///
/// - Beyond rims, although the surface continues for a reach.
/// - Where two sheets are within reach of each other, because their patches mix. Smaller triangles
///   keep them apart. Sheets mix where the normals of vertices within reach are more than 120°
///   apart, or where edges lead to a vertex above another only by a detour.
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
/// assert_eq!(roof.undefined(top), None);
/// assert_eq!(roof.undefined(DVec3::new(0.38, 0.75, -0.072)).unwrap(), "lies beyond the mesh, at a hole or its rim");
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mesh {
    sheet: Arc<Sheet>,
    /// The middle of the box around the vertices: the sheet's origin.
    middle: DVec3,
}

impl Mesh {
    /// The surface of triangles of vertices that are counted from 0.
    ///
    /// Coincident vertices are merged. Vertices without a triangle and triangles with two
    /// coincident vertices are ignored. Triangles are turned over until all have the same
    /// orientation.
    ///
    /// # Errors
    /// - No triangles, or none with three corners and an area.
    /// - A missing vertex, or one that is not finite.
    /// - An edge of more than two triangles.
    /// - A mesh of one side, such as a Möbius band.
    /// - Sheets that are within reach of each other everywhere, as in a cube of 8 vertices.
    pub fn new(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> Result<Self> {
        let mut topology = Topology::new(vertices, triangles)?;
        let middle = topology.move_to_middle();
        Ok(Mesh { sheet: Arc::new(Sheet::new(topology)?), middle })
    }
}

/// Its sheet's, moved to its middle.
impl Surface for Mesh {
    fn name(&self) -> String {
        self.sheet.name()
    }

    fn value(&self, x: DVec3) -> f64 {
        self.sheet.value(x - self.middle)
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        self.sheet.gradient(x - self.middle)
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        self.sheet.hessian(x - self.middle)
    }

    fn jet(&self, x: DVec3) -> (f64, DVec3, DMat3) {
        self.sheet.jet(x - self.middle)
    }

    /// Exact: differences would look for patches twice.
    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        self.sheet.third(x - self.middle, along)
    }

    /// Out of reach of the triangles it is the closest point: chords of few points pass there.
    fn project(&self, x: DVec3) -> Option<DVec3> {
        self.sheet.project(x - self.middle).map(|x| x + self.middle)
    }

    /// From the closest point of the triangles.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        self.sheet.closest(x - self.middle).map(|closest| closest + self.middle)
    }

    /// About the middle of the box around the vertices.
    fn local(&self) -> Option<(Arc<dyn Surface>, DVec3)> {
        Some((self.sheet.clone(), self.middle))
    }

    /// Beyond a rim by more than a tenth of the longest side there. Where sheets mix.
    fn undefined(&self, x: DVec3) -> Option<String> {
        self.sheet.undefined(x - self.middle)
    }
}

#[cfg(test)]
pub(super) mod tests;
