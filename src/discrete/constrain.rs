//! Constraints on tangents and curvature vectors at data points, imposed by short edges.
//!
//! A polygon has the tangent τ at a point if a very short edge along τ is inserted there. Each turn
//! next to that edge contributes |T − τ|²/(h/2) to the bending. This is the bending of the
//! curvature 2(T − τ)/h over half an edge. The energies themselves thus clamp the curve, as a
//! multiple knot clamps a spline, and steps need no projection.
//!
//! | constraint | short edges | effect |
//! |---|---|---|
//! | tangent τ | one, along τ | both ends of the edge are pinned |
//! | curvature vector k ⊥ τ as well | two of length ℓ, along τ ∓ ½ℓk | the turn between them is ℓk |
//!
//! Under bending the curvature may jump at the point; under variation it is continuous. A curvature
//! vector therefore needs an energy of order 3. Energies and curvatures are second-order accurate
//! in h.
//!
//! On a surface τ is projected onto the tangent plane.

use glam::DVec3;

use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::vector as in_space;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::status::CurveStatus;
use crate::surface::{Surface, normal};

/// A tangent and a curvature vector count as perpendicular if their cosine is at most this.
const PERPENDICULAR: f64 = 1e-6;

/// The length of the short edge of a tangent, in mean edges.
const SHORT: f64 = 1.0 / (1u64 << 30) as f64;

/// The length of each of the two short edges of a curvature vector, in mean edges. Half of the
/// digits of the turn between them remain significant.
const TURNING: f64 = 1.0 / (1u64 << 16) as f64;

/// The given tangent, and optionally the given curvature vector, at one data point.
#[derive(Clone, Debug)]
pub(crate) struct Constrained<const D: usize> {
    /// The index of the first vertex at the data point. Short edges lead from it to the last one.
    pub row: usize,
    /// The unit tangent.
    pub tangent: Vector<f64, D>,
    /// The curvature vector, perpendicular to `tangent`, in 1/length.
    pub curvature: Option<Vector<f64, D>>,
}

/// The constraints of curve `i` under an energy of this order, sorted by vertex index.
///
/// `rows` are the indices of the data points among the vertices `places`.
pub(super) fn constrained<const D: usize>(
    batch: &CurveBatch,
    i: usize,
    rows: &[u32],
    places: &[Vector<f64, D>],
    closed: bool,
    order: usize,
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
        let tangent = match surface {
            None => tangent,
            Some(surface) => {
                let normal = normal(surface, in_space(&places[row]));
                let flat = in_space(&tangent) - in_space(&tangent).dot(normal) * normal;
                if flat.length() <= PERPENDICULAR {
                    return refuse(format!(
                        "its tangent is along the normal of {}: give a direction in it",
                        surface.name()
                    ));
                }
                let flat: DVec3 = flat.normalize();
                std::array::from_fn(|c| flat[c])
            }
        };
        if let Some(what) = curvature.and_then(|curvature| wrong_curvature(curvature, tangent, order)) {
            return refuse(what);
        }
        // The edges between two clamped points have to turn from one tangent to the other.
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
        found.push(Constrained { row, tangent, curvature });
    }
    found.sort_unstable_by_key(|constraint| constraint.row);
    Ok(found)
}

/// The reason why a curvature vector is invalid with this unit tangent and an energy of this order.
fn wrong_curvature<const D: usize>(curvature: Vector<f64, D>, tangent: Vector<f64, D>, order: usize) -> Option<String> {
    let size = dot(curvature, curvature).sqrt();
    let cosine = dot(curvature, tangent).abs() / size.max(f64::MIN_POSITIVE);
    if !size.is_finite() || cosine > PERPENDICULAR {
        return Some(format!(
            "its curvature vector is not perpendicular to its tangent (cosine {cosine:.1e}, at most {PERPENDICULAR:e} is \
             possible): subtract its part along the tangent"
        ));
    }
    let what = "a curvature vector needs an energy that holds variation, since bending lets curvature jump: add some, such as \
                variation=0.1, or leave the vector out";
    (order < 3).then(|| what.into())
}

impl<const D: usize> Constrained<D> {
    /// The number of its short edges.
    pub fn edges(&self) -> usize {
        1 + usize::from(self.curvature.is_some())
    }

    /// Its short edges, for a mean edge length h.
    fn short(&self, h: f64) -> impl Iterator<Item = Vector<f64, D>> + use<D> {
        let (signs, length) =
            if self.curvature.is_some() { (&[-0.5, 0.5][..], TURNING * h) } else { (&[0.0][..], SHORT * h) };
        let (tangent, curvature) = (self.tangent, self.curvature.unwrap_or([0.0; D]));
        signs.iter().map(move |sign| {
            let way = add(tangent, scale(sign * length, curvature));
            scale(length / dot(way, way).sqrt(), way)
        })
    }

    /// The indices of the vertices of its short edges.
    pub fn rows(&self) -> std::ops::RangeInclusive<usize> {
        self.row..=self.row + self.edges()
    }
}

/// The displacements after which the spans next to constrained points leave along the given
/// tangents.
///
/// A span of length L that leaves along T is displaced by L x (1 − x)² (τ − T) at its fraction x.
pub(super) fn bends<const D: usize>(
    constraints: &[Constrained<D>],
    vertices: &[Vector<f64, D>],
    rows: &[u32],
    closed: bool,
) -> Vec<Vector<f64, D>> {
    let count = vertices.len();
    let mut bends = vec![[0.0; D]; count];
    for constraint in constraints {
        for (sign, step) in [(1.0, 1), (-1.0, count - 1)] {
            let span = span_from(constraint.row, step, rows, count, closed);
            let edges: Vec<Vector<f64, D>> =
                span.windows(2).map(|pair| subtract(vertices[pair[1]], vertices[pair[0]])).collect();
            let lengths: Vec<f64> = edges.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
            let way = |k: usize| scale(1.0 / lengths[k], edges[k]);
            let Some(leaving) =
                (0..edges.len().min(2)).map(way).reduce(|one, two| subtract(scale(1.5, one), scale(0.5, two)))
            else {
                continue;
            };
            let turn = subtract(scale(sign, constraint.tangent), scale(1.0 / dot(leaving, leaving).sqrt(), leaving));
            let length: f64 = lengths.iter().sum();
            for (k, &row) in span.iter().enumerate() {
                let x = k as f64 / edges.len() as f64;
                bends[row] = add(bends[row], scale(length * x * (1.0 - x) * (1.0 - x), turn));
            }
        }
    }
    bends
}

/// The vertices from a data point to the next one. `step` is 1, or −1 modulo the number of
/// vertices.
fn span_from(row: usize, step: usize, rows: &[u32], count: usize, closed: bool) -> Vec<usize> {
    let end = if step == 1 { count - 1 } else { 0 };
    let mut span = vec![row];
    let mut at = row;
    while closed || at != end {
        at = (at + step) % count;
        span.push(at);
        if rows.binary_search(&(at as u32)).is_ok() {
            break;
        }
    }
    span
}

/// Repeats the vertices of constrained points, once per short edge.
///
/// Updates the vertex indices of data points and constraints. A data point keeps the first of its
/// vertices. Only the last point of an open curve keeps the last of them.
pub(super) fn repeat<const D: usize>(
    constraints: &mut [Constrained<D>],
    vertices: &mut Vec<Vector<f64, D>>,
    rows: &mut [u32],
    closed: bool,
) {
    if constraints.is_empty() {
        return;
    }
    let count = vertices.len();
    let mut all = Vec::with_capacity(count + 2 * constraints.len());
    let mut own = rows.iter_mut().peekable();
    let mut next = 0;
    for (row, vertex) in vertices.drain(..).enumerate() {
        let first = all.len();
        all.push(vertex);
        if let Some(constraint) = constraints.get_mut(next).filter(|constraint| constraint.row == row) {
            all.resize(first + 1 + constraint.edges(), vertex);
            constraint.row = first;
            next += 1;
        }
        let is_last = !closed && row + 1 == count;
        while let Some(data) = own.next_if(|data| **data as usize == row) {
            *data = if is_last { all.len() - 1 } else { first } as u32;
        }
    }
    // A closed curve has one more index, one past its last vertex.
    own.for_each(|data| *data = all.len() as u32);
    *vertices = all;
}

/// Sets the short edges, and returns their number.
pub(super) fn lay_short<const D: usize>(
    constraints: &[Constrained<D>],
    base: &mut [Vector<f64, D>],
    size: f64,
) -> usize {
    if constraints.is_empty() {
        return 0;
    }
    let count: usize = constraints.iter().map(Constrained::edges).sum();
    let length: f64 = base.iter().map(|edge| dot(*edge, *edge).sqrt()).sum();
    let h = length / (base.len() - count) as f64;
    for constraint in constraints {
        let sized = Constrained { curvature: constraint.curvature.map(|k| scale(size, k)), ..constraint.clone() };
        for (edge, short) in base[constraint.row..].iter_mut().zip(sized.short(h)) {
            *edge = short;
        }
    }
    count
}
