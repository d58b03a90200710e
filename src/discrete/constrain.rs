//! Tangents and curvature vectors at data points.
//!
//! A tangent τ at vertex i keeps f_{i+1} − f_{i−1} parallel to τ. At an end f_{i+1} − f_i is kept
//! parallel to τ. With a curvature vector k ⊥ τ the neighbours lie on the circle of that curvature.
//! Both stand at the same angle θ from the vertex, at d = (2/|k|) tan(θ/2):
//!
//! ```text
//! f_{i±1} = f_i + (±d τ + ½ d² k)/(1 + ¼ d² |k|²)
//! ```
//!
//! The discrete curvature vector (T′ − T)/Δa is then exactly k for every d.
//!
//! In a surface τ lies in the tangent plane. The curve goes along it where b·f_{i+1} = b·f_{i−1} for the vector b = n × τ across
//! it, and the neighbours move back to the surface within their planes b·x.
//!
//! The point itself is pinned. With a curvature vector its neighbours are pinned too. Every d gives
//! the same shape, so the gauges of both spans would compete for a free d.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::vector as in_space;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::linalg::{Real, Scalar};
use crate::status::CurveStatus;
use crate::surface::{Surface, normal};

/// A tangent and a curvature vector are perpendicular if their cosine is below this.
const PERPENDICULAR: f64 = 1e-6;

/// The constraint at one vertex.
#[derive(Clone, Debug)]
pub(crate) struct Constrained<const D: usize> {
    /// The row of the vertex, which is pinned.
    pub row: usize,
    /// The rows of the neighbours.
    ///
    /// An end of an open curve has only one.
    before: Option<usize>,
    after: Option<usize>,
    /// The unit tangent.
    tangent: Vector<f64, D>,
    /// The curvature vector, perpendicular to `tangent`, in 1/length.
    curvature: Option<Vector<f64, D>>,
    /// b, in a surface.
    across: Option<Vector<f64, D>>,
}

/// The constraints of curve `i`, whose data points stand at `rows` among these vertices.
pub(super) fn constrained<const D: usize>(
    batch: &CurveBatch,
    i: usize,
    rows: &[u32],
    places: &[Vector<f64, D>],
    closed: bool,
    surface: Option<&dyn Surface>,
) -> Result<Vec<Constrained<D>>, Unfitted> {
    let vertices = places.len();
    let constraints = batch.constraints();
    let vector = |column: &Option<Vec<f64>>, k: usize| -> Option<Vector<f64, D>> {
        let start = (batch.offsets()[i] + k) * D;
        let given = &column.as_ref()?[start..start + D];
        (!given[0].is_nan()).then(|| std::array::from_fn(|c| given[c]))
    };
    let mut found: Vec<Constrained<D>> = Vec::new();
    for k in 0..batch.count(i) {
        let (tangent, curvature) = (vector(&constraints.tangents, k), vector(&constraints.curvatures, k));
        if tangent.is_none() && curvature.is_none() {
            continue;
        }
        let refuse =
            |what: String| Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &what) });
        let Some(tangent) = tangent else {
            return refuse("a curvature vector needs a tangent beside it: give tx, ty (and tz) too".into());
        };
        let length = dot(tangent, tangent).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return refuse(format!("its tangent has length {length}; give a direction, or leave it empty"));
        }
        let tangent = tangent.map(|x| x / length);
        let row = rows[k] as usize % vertices;
        let (tangent, across) = match surface {
            None => (tangent, None),
            Some(surface) => {
                let normal = normal(surface, in_space(&places[row]));
                let flat = in_space(&tangent) - in_space(&tangent).dot(normal) * normal;
                if flat.length() <= PERPENDICULAR {
                    return refuse(format!(
                        "its tangent is along the normal of {}: give a direction in it",
                        surface.name()
                    ));
                }
                let flat = flat.normalize();
                let components = |v: DVec3| std::array::from_fn(|c| v[c]);
                (components(flat), Some(components(normal.cross(flat))))
            }
        };
        if let Some(curvature) = curvature {
            let size = dot(curvature, curvature).sqrt();
            let cosine = dot(curvature, tangent).abs() / size.max(f64::MIN_POSITIVE);
            if !size.is_finite() || cosine > PERPENDICULAR {
                return refuse(format!(
                    "its curvature vector is not perpendicular to its tangent (cosine {cosine:.1e}, at most {PERPENDICULAR:e} is \
                     possible): subtract its part along the tangent"
                ));
            }
        }
        let wrap = |row: usize| if closed { row % vertices } else { row };
        let before = (closed || row > 0).then(|| wrap(row + vertices - 1) % vertices);
        let after = (closed || row + 1 < vertices).then(|| wrap(row + 1));
        // Data points must be far enough apart that no vertex is the neighbour of two.
        let gap =
            |other: usize| other.abs_diff(row).min(if closed { vertices - other.abs_diff(row) } else { usize::MAX });
        let nearest = rows.iter().map(|&other| other as usize % vertices).filter(|&other| other != row).map(gap).min();
        if nearest.is_some_and(|gap| gap < 4) {
            let gap = nearest.unwrap_or_default();
            return refuse(format!(
                "its span has {gap} segments; to meet a tangent it needs 4: ask for more samples, or a smaller spacing"
            ));
        }
        if let Some(other) = found.iter().find(|other| other.row == row) {
            if dot(other.tangent, tangent) < 1.0 - PERPENDICULAR || other.curvature != curvature {
                return refuse("the same point repeated before it asks for another tangent: leave one out".into());
            }
            continue;
        }
        found.push(Constrained { row, before, after, tangent, curvature, across });
    }
    Ok(found)
}

impl<const D: usize> Constrained<D> {
    /// Moves the neighbours of the vertex to where the constraint holds.
    pub fn meet(&self, vertices: &mut [Vector<f64, D>]) {
        let here = vertices[self.row];
        let distance = |row: usize| {
            let away = subtract(vertices[row], here);
            dot(away, away).sqrt()
        };
        let distances: Vec<f64> = [self.before, self.after].into_iter().flatten().map(distance).collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        for (row, sign) in self.neighbours() {
            vertices[row] = add(here, self.place(sign, mean));
        }
    }

    fn neighbours(&self) -> impl Iterator<Item = (usize, f64)> + use<D> {
        [(self.before, -1.0), (self.after, 1.0)].into_iter().filter_map(|(row, sign)| Some((row?, sign)))
    }

    /// The position of a neighbour relative to the vertex, at distance d.
    fn place(&self, sign: f64, d: f64) -> Vector<f64, D> {
        let k = self.curvature.unwrap_or([0.0; D]);
        let share = 1.0 / (1.0 + 0.25 * d * d * dot(k, k));
        scale(share, add(scale(sign * d, self.tangent), scale(0.5 * d * d, k)))
    }

    /// Rows that stay in place.
    pub fn pinned(&self) -> impl Iterator<Item = usize> + use<D> {
        let neighbours = self.neighbours().filter(|_| self.curvature.is_some()).map(|(row, _)| row);
        std::iter::once(self.row).chain(neighbours.collect::<Vec<_>>())
    }

    /// The neighbours that move back to a surface within a plane, with the vector across it.
    pub fn rails(&self) -> impl Iterator<Item = (usize, Vector<f64, D>)> + use<'_, D> {
        self.across.into_iter().flat_map(|across| self.neighbours().map(move |(row, _)| (row, across)))
    }

    /// The directions in which the neighbours must not move, as rows and vectors.
    fn normals(&self) -> Vec<Normal<D>> {
        let neighbours: Vec<(usize, f64)> = self.neighbours().collect();
        if let Some(across) = self.across {
            let share = 1.0 / (neighbours.len() as f64).sqrt();
            return vec![neighbours.into_iter().map(|(row, sign)| (row, scale(sign * share, across))).collect()];
        }
        let width = neighbours.len() * D;
        let mut allowed: Vec<DVector<f64>> = Vec::new();
        // The neighbours may move together, or apart along the tangent.
        if neighbours.len() == 2 {
            for c in 0..D {
                allowed.push(DVector::from_fn(width, |row, _| if row % D == c { 0.5f64.sqrt() } else { 0.0 }));
            }
        }
        let apart = neighbours.iter().flat_map(|&(_, sign)| self.tangent.map(|x| sign * x));
        allowed.push(DVector::from_iterator(width, apart).normalize());
        let mut normals: Vec<DVector<f64>> = Vec::new();
        for axis in 0..width {
            let mut rest = DVector::from_fn(width, |row, _| f64::from(u8::from(row == axis)));
            // Done twice, so that the rest is orthogonal to rounding.
            for _ in 0..2 {
                for known in allowed.iter().chain(&normals) {
                    rest -= known * known.dot(&rest);
                }
            }
            if normals.len() + allowed.len() < width && rest.norm() > 0.1 {
                normals.push(rest.normalize());
            }
        }
        let of_rows = |normal: &DVector<f64>| {
            let part = |(n, &(row, _)): (usize, &(usize, f64))| (row, std::array::from_fn(|c| normal[n * D + c]));
            neighbours.iter().enumerate().map(part).collect()
        };
        normals.iter().map(of_rows).collect()
    }
}

/// A direction across a constraint, as rows and vectors.
type Normal<const D: usize> = Vec<(usize, Vector<f64, D>)>;

/// The tangents to keep while a curve descends.
///
/// Points with a curvature vector are pinned with their neighbours and need no more.
#[derive(Clone, Debug)]
pub(crate) struct Constraints<const D: usize> {
    normals: Vec<Normal<D>>,
    /// See [`Constrained::rails`].
    pub rails: Vec<(usize, Vector<f64, D>)>,
}

impl<const D: usize> Constraints<D> {
    /// The constraints that are more than pins, if any.
    pub fn new(all: &[Constrained<D>]) -> Option<Self> {
        let tangents = all.iter().filter(|constraint| constraint.curvature.is_none());
        let normals: Vec<_> = tangents.flat_map(Constrained::normals).collect();
        let rails = all.iter().flat_map(Constrained::rails).collect();
        (!normals.is_empty()).then_some(Constraints { normals, rails })
    }

    /// The pairs of rows, the one k after the other on a curve of so many vertices, at which v vᵀ of a direction v has blocks.
    ///
    /// They are (the first row, k, v there, v at the second).
    pub fn stiffnesses(&self, count: usize) -> Vec<(usize, usize, Vector<f64, D>, Vector<f64, D>)> {
        let mut blocks = Vec::new();
        for normal in &self.normals {
            for (a, v) in normal {
                let after = |(b, _): &&(usize, Vector<f64, D>)| (b + count - a) % count <= 2;
                blocks.extend(normal.iter().filter(after).map(|(b, w)| (*a, (b + count - a) % count, *v, *w)));
            }
        }
        blocks
    }

    /// Σ λ v at the rows of the directions v, for these multipliers λ.
    pub fn forces<'a>(&'a self, multipliers: &'a [f64]) -> impl Iterator<Item = (usize, Vector<f64, D>)> + 'a {
        let of = |(normal, &multiplier): (&'a Normal<D>, &'a f64)| {
            normal.iter().map(move |(row, v)| (*row, scale(multiplier, *v)))
        };
        self.normals.iter().zip(multipliers).flat_map(of)
    }

    /// The same with directions in the tangent planes of a surface, whose normals are these.
    pub fn in_planes(&self, normals: &[Vector<f64, D>]) -> Self {
        let flat = |(row, v): &(usize, Vector<f64, D>)| {
            let n = normals[*row];
            (*row, subtract(*v, scale(dot(*v, n), n)))
        };
        let normals = self.normals.iter().map(|normal| normal.iter().map(flat).collect()).collect();
        Constraints { normals, rails: self.rails.clone() }
    }

    /// Projects z = L⁻¹g onto the constraints, in the metric that `solve` solves for.
    ///
    /// The constraint forces are removed from `g`. They are removed first, and the rest is solved
    /// for again. Near a minimum the forces are large, and ⟨g, z⟩ would otherwise be a small
    /// difference of large numbers.
    ///
    /// Returns the multiplier of each direction in what was removed.
    pub fn project<S: Scalar>(
        &self,
        solve: &mut dyn FnMut(&mut [Vector<S, D>]),
        g: &mut [Vector<S, D>],
        z: &mut [Vector<S, D>],
    ) -> Vec<f64> {
        let number = |x: f64| S::of(x);
        let mut responses = Vec::with_capacity(self.normals.len());
        for normal in &self.normals {
            let mut response = vec![[S::ZERO; D]; z.len()];
            for (row, vector) in normal {
                response[*row] = vector.map(number);
            }
            solve(&mut response);
            responses.push(response);
        }
        let along = |normal: &Normal<D>, x: &[Vector<S, D>]| -> f64 {
            normal.iter().map(|(row, v)| (0..D).map(|c| v[c] * x[*row][c].lane(0).to_f64()).sum::<f64>()).sum()
        };
        let count = self.normals.len();
        let gram = DMatrix::from_fn(count, count, |a, b| along(&self.normals[a], &responses[b])).lu();
        let mut all = vec![0.0; count];
        for again in [true, false] {
            let excess = DVector::from_fn(count, |a, _| along(&self.normals[a], z));
            let Some(multipliers) = gram.solve(&excess) else {
                // Two constraints share a vertex. Such curves are refused earlier, so this is never
                // reached. NaN ends the curve.
                z.iter_mut().for_each(|z| *z = [number(f64::NAN); D]);
                return all;
            };
            all.iter_mut().zip(multipliers.iter()).for_each(|(sum, multiplier)| *sum += multiplier);
            for ((normal, response), &multiplier) in self.normals.iter().zip(&responses).zip(multipliers.iter()) {
                for (row, vector) in normal {
                    g[*row] = subtract(g[*row], vector.map(|x| number(multiplier * x)));
                }
                for (z, response) in z.iter_mut().zip(response) {
                    *z = subtract(*z, scale(number(multiplier), *response));
                }
            }
            if again {
                z.copy_from_slice(g);
                solve(z);
            }
        }
        all
    }
}
