//! [`HeightField`]: terrain over a grid.

mod cell;
mod holes;

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use self::cell::{AxisPosition, Cell};
use self::holes::Holes;
use super::{Surface, SurfaceKernel};
use crate::device::Device;
use crate::error::{Error, Result};
use crate::linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch};

/// Positions this part of a spacing beyond the grid count as on its edge.
// Not in the kernel: the host judges curves.
const EDGE: f64 = 1e-9;

/// The most steps of a projection and of a descent to a closest point.
const DESCENT_STEPS: usize = 100;

/// Steps of a descent are halved this often at most.
const MOST_HALVINGS: usize = 40;

/// The surface z = h(x, y) through heights at the nodes of a rectangular grid.
///
/// h is the bicubic spline with natural ends: C², exact at the nodes, and of second derivative 0
/// across the edges of the grid. Two rows or two columns are joined by straight lines. Column j of
/// row i stands at x₀ + j Δx and y₀ + i Δy. A spacing may be negative, such as Δy of rows from
/// north to south.
///
/// F = z − h(x, y), with the normal upwards. x, y and z are in one unit.
///
/// Heights that are not finite are gaps. Cells next to a gap are holes in the terrain, where the
/// surface is [undefined](Surface::undefined). The spline goes through neighbours' means there, so
/// that descents do not break. Beyond the grid h continues along its tangents, C² too, for the same
/// reason. The surface is undefined there as well.
///
/// Fair curves run on GPUs with f64, with a table of 4 numbers per node. They are within 1e-9 of
/// their size of the CPU's.
///
/// **Accuracy** as an approximation of a smooth function: the errors of h, of its slopes and of its
/// second derivatives fall as D⁴, D³ and D² with the spacing D. For sin(2πx/L) sin(2πy/L) at L = 20
/// D they are 5.1e-5, 2.5e-4 and 8.2e-3 of the largest of each. If terrain bends across an edge of
/// the grid, natural ends spoil a strip along it: errors between the outermost nodes fall as D², D
/// and 1 only, and are 7.4e-3, 7.7e-2 and 0.84 there. They shrink by 2 + √3 = 3.7 from node to node
/// inwards, and are negligible from the fifth node on.
///
/// **Source**: C. de Boor, *Bicubic spline interpolation*, J. Math. Phys. 41 (1962).
///
/// ```
/// use faircurve::surface::{HeightField, Surface};
/// use glam::DVec3;
///
/// let heights = vec![0.0, 0.0, 0.0, 1.0, 3.0, 1.0, 0.0, 0.0, 0.0];
/// let hill = HeightField::new([3, 3], heights)?.with_spacing([10.0, 10.0])?;
/// assert_eq!(hill.height(10.0, 10.0), 3.0);
/// assert_eq!(hill.value(DVec3::new(10.0, 10.0, 5.0)), 2.0);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Rows, columns.
    shape: [usize; 2],
    /// h, h_uu, h_vv and h_uuvv of every node, by u = column and v = row.
    nodes: Arc<[[f64; 4]]>,
    /// The nodes without a height, if there are any.
    holes: Option<Arc<Holes>>,
    /// Δx, Δy
    spacing: [f64; 2],
    /// x₀, y₀
    origin: [f64; 2],
    name: String,
}

impl HeightField {
    /// The surface through heights, row after row. Spacings are 1, and the origin is 0.
    ///
    /// # Errors
    /// Fewer than two rows or columns. Another number of heights. No height that is finite.
    pub fn new(shape: [usize; 2], mut heights: Vec<f64>) -> Result<Self> {
        let [rows, columns] = shape;
        let refuse = |why: String| Err(Error::Argument(why));
        if rows < 2 || columns < 2 {
            return refuse(format!(
                "a height field of {rows} × {columns} heights is no surface: give 2 rows and 2 columns, or more"
            ));
        }
        if rows.checked_mul(columns) != Some(heights.len()) {
            return refuse(format!(
                "{} heights for a height field of {rows} rows and {columns} columns: give one for each of its nodes",
                heights.len()
            ));
        }
        let Some(holes) = holes::fill(shape, &mut heights) else {
            return refuse(format!(
                "none of the {rows} × {columns} heights of a height field is a finite number: give some"
            ));
        };
        let holes = holes.contains(&true).then(|| Arc::new(holes));
        let across = |values: &[f64]| transposed(&bends(&transposed(values, rows), rows), columns);
        let bends_v = bends(&heights, columns);
        let [bends_u, bends_uv] = [across(&heights), across(&bends_v)];
        let nodes = (0..heights.len()).map(|k| [heights[k], bends_u[k], bends_v[k], bends_uv[k]]).collect();
        let name = format!("the height field of {rows} × {columns} heights");
        Ok(HeightField { shape, nodes, holes, spacing: [1.0; 2], origin: [0.0; 2], name })
    }

    /// With distances Δx of columns and Δy of rows.
    ///
    /// # Errors
    /// A spacing that is 0 or not finite.
    pub fn with_spacing(self, spacing: [f64; 2]) -> Result<Self> {
        for (what, spacing) in ["columns", "rows"].into_iter().zip(spacing) {
            if spacing == 0.0 || !spacing.is_finite() {
                return Err(Error::Argument(format!(
                    "the spacing of {what} is {spacing}: give a finite number other than 0, below 0 where they run \
                     towards smaller coordinates"
                )));
            }
        }
        Ok(HeightField { spacing, ..self })
    }

    /// With the place of row 0 and column 0.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn with_origin(self, origin: [f64; 2]) -> Result<Self> {
        match origin.iter().find(|x| !x.is_finite()) {
            Some(x) => Err(Error::Argument(format!("the origin of a height field is at {x}: give finite coordinates"))),
            None => Ok(HeightField { origin, ..self }),
        }
    }

    /// With a name for messages, such as `the heights of mountain.csv`.
    pub fn with_name(self, name: impl Into<String>) -> Self {
        HeightField { name: name.into(), ..self }
    }

    /// Rows and columns.
    pub fn shape(&self) -> [usize; 2] {
        self.shape
    }

    /// The least and the largest x, and the least and the largest y, of the grid.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let ends = |axis: usize, count: usize| {
            let [from, to] = [self.origin[axis], self.origin[axis] + (count - 1) as f64 * self.spacing[axis]];
            [from.min(to), from.max(to)]
        };
        [ends(0, self.shape[1]), ends(1, self.shape[0])]
    }

    /// h(x, y), NaN in a hole.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        if self.hole(x, y).is_some() { f64::NAN } else { self.laid(x, y) }
    }

    /// h(x, y), in holes too.
    fn laid(&self, x: f64, y: f64) -> f64 {
        Cell::of(self, x, y).derivative(0, 0)
    }

    /// The row and the column of a gap that makes a hole of a place.
    fn hole(&self, x: f64, y: f64) -> Option<[usize; 2]> {
        let [rows, columns] = self.shape;
        let x = AxisPosition::of(x, self.origin[0], self.spacing[0], columns);
        let y = AxisPosition::of(y, self.origin[1], self.spacing[1], rows);
        holes::beside(self.holes.as_ref()?, columns, &x, &y)
    }

    /// The point of the terrain straight below or above a place.
    fn plumb(&self, x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, self.laid(x, y))
    }
}

/// Second derivatives at the integers of natural cubic splines through the columns of a matrix:
/// rows of 1 4 1 for six times the second differences.
fn bends(values: &[f64], columns: usize) -> Vec<f64> {
    let rows = values.len() / columns;
    let (mut beside, mut diagonal, mut rhs) = (vec![1.0; rows], vec![4.0; rows], vec![0.0; values.len()]);
    for end in [0, rows - 1] {
        (beside[end], diagonal[end]) = (0.0, 1.0);
    }
    for k in columns..values.len() - columns {
        rhs[k] = 6.0 * ((values[k + columns] - values[k]) - (values[k] - values[k - columns]));
    }
    let systems = TridiagonalBatch {
        matrix: Matrix::Bands { lower: &beside, diagonal: &diagonal, upper: &beside },
        offsets: &[0, rows],
        cyclic: Cyclic::None,
    };
    solve_tridiagonal_batch(&systems, &rhs, columns, &Device::cpu()).expect("lengths that fit together").x
}

/// The columns of a matrix, one after the other.
fn transposed(values: &[f64], rows: usize) -> Vec<f64> {
    let columns = values.len() / rows;
    (0..values.len()).map(|k| values[k % rows * columns + k / rows]).collect()
}

/// Minus the symmetric matrix of h_xx, h_xy and h_yy, which has no part along z.
fn sheet([xx, xy, yy]: [f64; 3]) -> DMat3 {
    DMat3::from_cols(DVec3::new(-xx, -xy, 0.0), DVec3::new(-xy, -yy, 0.0), DVec3::ZERO)
}

impl Surface for HeightField {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn value(&self, x: DVec3) -> f64 {
        x.z - self.laid(x.x, x.y)
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        (-Cell::of(self, x.x, x.y).slope()).extend(1.0)
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        sheet(Cell::of(self, x.x, x.y).bend())
    }

    fn jet(&self, x: DVec3) -> (f64, DVec3, DMat3) {
        let cell = Cell::of(self, x.x, x.y);
        (x.z - cell.derivative(0, 0), (-cell.slope()).extend(1.0), sheet(cell.bend()))
    }

    /// It jumps where nodes are crossed.
    fn third(&self, x: DVec3, along: DVec3) -> DMat3 {
        let cell = Cell::of(self, x.x, x.y);
        let [xxx, xxy, xyy, yyy] = [3, 2, 1, 0].map(|i| cell.derivative(i, 3 - i));
        let change = |by_x: f64, by_y: f64| by_x * along.x + by_y * along.y;
        sheet([change(xxx, xxy), change(xxy, xyy), change(xyy, yyy)])
    }

    /// By Newton steps along ∇F, which are halved where they would lead up and down between slopes.
    fn project(&self, x: DVec3) -> Option<DVec3> {
        let (mut foot, mut value) = (x, self.value(x));
        for _ in 0..DESCENT_STEPS {
            let gradient = self.gradient(foot);
            let mut step = -value / gradient.length_squared() * gradient;
            if !step.is_finite() {
                return None;
            }
            let is_small = step.length() <= 4.0 * f64::EPSILON * foot.abs().max_element();
            // Along ∇F, which is never 0, |F| falls at first.
            let next = (0..MOST_HALVINGS).find_map(|_| {
                let next = self.value(foot + step);
                let falls = is_small || next.abs() <= 0.9 * value.abs();
                step = if falls { step } else { 0.5 * step };
                falls.then_some(next)
            });
            // Where it does not it is rounding.
            let Some(next) = next else { return Some(self.plumb(foot.x, foot.y)) };
            (foot, value) = (foot + step, next);
            if is_small {
                return Some(self.plumb(foot.x, foot.y));
            }
        }
        None
    }

    /// About the node in the middle.
    fn local(&self) -> Option<(Arc<dyn Surface>, DVec3)> {
        let [rows, columns] = self.shape;
        let way = [(columns / 2) as f64 * self.spacing[0], (rows / 2) as f64 * self.spacing[1]];
        let field = HeightField { origin: way.map(|x| -x), ..self.clone() };
        Some((Arc::new(field), DVec3::new(self.origin[0] + way[0], self.origin[1] + way[1], 0.0)))
    }

    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        Some(self)
    }

    /// The closest point of the terrain, by a descent from straight below x.
    ///
    /// The distance is a minimum, and no longer than straight down. High above a valley another
    /// place may be closer.
    fn closest(&self, x: DVec3) -> Option<DVec3> {
        let away = |at: DVec2| (at - x.truncate()).extend(self.laid(at.x, at.y) - x.z);
        let mut at = x.truncate();
        let mut from = away(at);
        for _ in 0..DESCENT_STEPS {
            let cell = Cell::of(self, at.x, at.y);
            let (slope, [xx, xy, yy]) = (cell.slope(), cell.bend());
            // ½|y − x|² has the gradient (a − x, b − y) + (h − z)∇h and the Hessian I + ∇h∇hᵀ + (h
            // − z)∇²h.
            let gradient = from.truncate() + from.z * slope;
            let hessian = |height: f64| {
                let (diagonal, beside) =
                    (DVec2::ONE + slope * slope + height * DVec2::new(xx, yy), slope.x * slope.y + height * xy);
                (diagonal, beside, diagonal.x * diagonal.y - beside * beside)
            };
            let newton = hessian(from.z);
            // Without its last part it is positive definite: Gauss and Newton's.
            let (diagonal, beside, determinant) =
                if newton.0.min_element() > 0.0 && newton.2 > 0.0 { newton } else { hessian(0.0) };
            let mut step = -DVec2::new(
                diagonal.y * gradient.x - beside * gradient.y,
                diagonal.x * gradient.y - beside * gradient.x,
            ) / determinant;
            if !step.is_finite() {
                return None;
            }
            let scale = 4.0 * f64::EPSILON * x.abs().max_element().max(from.length());
            let is_small = step.length() <= scale;
            let (fall, rounding) = (gradient.dot(step), scale * from.length());
            let mut part = 1.0;
            let next = (0..MOST_HALVINGS).find_map(|_| {
                let next = away(at + step);
                let falls = next.length_squared() <= from.length_squared() + 0.2 * part * fall + rounding;
                (step, part) = if falls { (step, part) } else { (0.5 * step, 0.5 * part) };
                falls.then_some(next)
            });
            let Some(next) = next else { break };
            (at, from) = (at + step, next);
            if is_small {
                break;
            }
        }
        let closest = self.plumb(at.x, at.y);
        closest.is_finite().then_some(closest)
    }

    fn over(&self, x: f64, y: f64) -> Option<DVec3> {
        Some(DVec3::new(x, y, self.height(x, y)))
    }

    fn undefined(&self, x: DVec3) -> Option<String> {
        let bounds = self.bounds();
        let is_within = |axis: usize| {
            let slack = EDGE * self.spacing[axis].abs();
            (bounds[axis][0] - slack..=bounds[axis][1] + slack).contains(&x[axis])
        };
        if is_within(0) && is_within(1) {
            let [row, column] = self.hole(x.x, x.y)?;
            return Some(format!(
                "lies in a hole of the grid: row {row} and column {column}, counted from 0, have no height"
            ));
        }
        let [[left, right], [lowest, highest]] = bounds;
        Some(format!("lies beyond the grid of x from {left} to {right} and y from {lowest} to {highest}"))
    }
}

impl SurfaceKernel for HeightField {
    fn text(&self) -> String {
        include_str!("../../shaders/surface/heights.wgsl").into()
    }

    /// Rows, columns, Δx, Δy, x₀, y₀, and the nodes.
    fn table(&self) -> Vec<f64> {
        let shape = self.shape.map(|count| count as f64);
        [&shape[..], &self.spacing, &self.origin, self.nodes.as_flattened()].concat()
    }

    /// A step of the projection that is halved takes two.
    fn loop_iterations(&self) -> usize {
        1
    }
}

#[cfg(test)]
mod tests;
