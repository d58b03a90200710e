//! Tangents and curvature vectors at data points, as short edges.
//!
//! A polygon has the tangent τ at a point if a vanishingly short edge along τ stands there. Each turn next to that edge
//! contributes |T − τ|²/(h/2) to the bending, which is the bending of the curvature 2(T − τ)/h over half an edge. The energies
//! themselves thus clamp the curve, as a multiple knot clamps a spline, and steps need no projection.
//!
//! | asked for | short edges | to |
//! |---|---|---|
//! | tangent τ | one, along τ | the point stays, and so does the other end |
//! | curvature vector k ⊥ τ too | two of length ℓ, along τ ∓ ½ℓk | the turn between them is ℓk |
//!
//! Under bending the curvature may jump at the point. Under variation it is continuous. Energies and curvatures are second
//! order accurate in h. A curvature vector needs an energy of order 3, since under bending alone the curvature may jump to it.
//!
//! In a surface τ is taken in the tangent plane.

use glam::DVec3;

use crate::Unfitted;
use crate::batch::CurveBatch;
use crate::curve::vector as in_space;
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::status::CurveStatus;
use crate::surface::{Surface, normal};

/// A tangent and a curvature vector are perpendicular if their cosine is below this.
const PERPENDICULAR: f64 = 1e-6;

/// The length of an edge that gives a tangent, in mean edges.
const SHORT: f64 = 1.0 / (1u64 << 30) as f64;

/// The length of each of two edges that give a curvature: the turn between them is to have half of all digits.
const TURNING: f64 = 1.0 / (1u64 << 16) as f64;

/// The tangent, and perhaps the curvature vector, at one vertex.
#[derive(Clone, Debug)]
pub(crate) struct Constrained<const D: usize> {
    /// The first of the vertices at the data point, from which its short edges lead to the last.
    pub row: usize,
    /// The unit tangent.
    pub tangent: Vector<f64, D>,
    /// The curvature vector, perpendicular to `tangent`, in 1/length.
    pub curvature: Option<Vector<f64, D>>,
}

/// The constraints of curve `i`, whose data points stand at `rows` among these vertices, under an energy of this order.
///
/// They are in the order of rows.
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
        // Edges between two clamped points have to turn from one tangent to the other.
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

/// What is wrong with a curvature vector beside a unit tangent, under an energy of this order.
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

    /// Its short edges, where the mean edge is h long.
    fn short(&self, h: f64) -> impl Iterator<Item = Vector<f64, D>> + use<D> {
        let (signs, length) =
            if self.curvature.is_some() { (&[-0.5, 0.5][..], TURNING * h) } else { (&[0.0][..], SHORT * h) };
        let (tangent, curvature) = (self.tangent, self.curvature.unwrap_or([0.0; D]));
        signs.iter().map(move |sign| {
            let way = add(tangent, scale(sign * length, curvature));
            scale(length / dot(way, way).sqrt(), way)
        })
    }

    /// The rows of the vertices between which its short edges lie.
    pub fn rows(&self) -> std::ops::RangeInclusive<usize> {
        self.row..=self.row + self.edges()
    }
}

/// The displacements by which the spans next to constrained points leave along the given tangents.
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

/// The vertices from a data point to the next one, in steps of 1, or of −1 modulo the number of vertices.
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

/// Repeats the vertices of constrained points, once for each short edge.
///
/// Rows of data points and of constraints become those among all vertices. A data point keeps the first of its vertices,
/// but for the last point of an open curve, which keeps the last.
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
    // A closed curve has one more, the row after its last.
    own.for_each(|data| *data = all.len() as u32);
    *vertices = all;
}

/// Gives the short edges their directions, and returns their number.
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
