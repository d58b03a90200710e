//! [`Graph`]: nonlinear splines y(t) on a uniform mesh, by Sobolev gradients.
//!
//! The energy is the discrete ∫κ² ds of the graph over a mesh of width H. Its data points are moved
//! to the nearest mesh points:
//!
//! ```text
//! φ(y) = H Σ y″_i² / (1 + y′_i²)^{5/2},   y′_i = (y_{i+1} − y_{i−1}) / 2H,   y″_i = (y_{i−1} − 2 y_i + y_{i+1}) / H²
//! ```
//!
//! The method is that of R. J. Renka, *Algorithm 828: DNSPLIN1*, ACM Transactions on Mathematical
//! Software 29(4), 2003. It uses nonlinear conjugate gradients in the metric of the current curve.
//! The paper's printed results stop early. Newton's method, damped in the same metric, goes on to
//! the minimum.

mod descent;
mod energy;
mod mesh;
mod search;

use faircurve::{CurveStatus, Error, Result};

pub use descent::{GraphIteration, GraphMove};
pub use mesh::Mesh;

/// Nonlinear interpolating splines as graphs.
///
/// Among all y(t) through the data points the graph is a local minimum of ∫κ² ds.
///
/// Data points are moved to the nearest points of a uniform mesh, by at most half its width. The y
/// at the other mesh points is found. The graph starts as the natural cubic spline through the
/// moved data.
///
/// | status | when |
/// |---|---|
/// | `converged` | √⟨g, L⁻¹g⟩ ≤ `tolerance`·√φ, or below what rounding of the ordinates alone makes of it |
/// | `not_converged` | `max_iterations`, or with [`published`](Self::published) its rule, came first |
/// | `unbounded` | the graph has grown longer than 10 times its data's polygon, with φ still falling: there is no minimiser |
///
/// Most rough data have no minimiser. Steep data may have several that belong to the mesh alone.
/// The graph jumps within a mesh width or two, and there is a minimum for every place to jump at.
/// The path decides which is reached. It is `converged` with a message that says so.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    /// The mesh.
    ///
    /// 241 points from the first data point to the last by default.
    pub mesh: Mesh,
    /// Whether to stop where the printed results of the published program do.
    ///
    /// False by default.
    ///
    /// This is after the first iteration that lowers φ by less than 10⁻³ (1 + φ), which is early.
    /// The status is `not_converged` unless the gradient has become small too.
    pub published: bool,
    /// The size of the gradient at which a graph has converged, as a fraction of √φ.
    ///
    /// 10⁻⁸ by default.
    ///
    /// It has no unit. Smaller is stricter.
    pub tolerance: f64,
    /// The most iterations a curve, conjugate gradients and Newton steps together.
    ///
    /// 500 by default.
    pub max_iterations: u32,
}

impl Default for Graph {
    fn default() -> Self {
        Graph { mesh: Mesh::Points(241), published: false, tolerance: 1e-8, max_iterations: 500 }
    }
}

/// The history of the fit of one graph, iteration by iteration.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphTrace {
    /// The t of the first mesh point.
    pub start: f64,
    /// The width H of the mesh.
    pub width: f64,
    /// The mesh point to which each data point was moved.
    pub data: Vec<usize>,
    /// φ of the natural cubic spline from which the descent starts.
    pub initial_phi: f64,
    /// One entry an iteration.
    pub iterations: Vec<GraphIteration>,
    /// The y at the mesh points at the end.
    pub ordinates: Vec<f64>,
    /// φ at the end, in 1/(unit of the input).
    pub phi: f64,
    /// √⟨g, L⁻¹g⟩ at the end, with L the matrix of H Σ (Dh)_i².
    pub gradient_norm: f64,
    /// `converged`, `not_converged` or `unbounded`.
    pub status: CurveStatus,
    /// Why the status is not `converged`, or that the mesh does not resolve the curve.
    pub message: Option<String>,
}

/// The reason why points have no graph, as point and sentence.
type Refusal = (usize, String);

impl Graph {
    /// Fits one graph through the points (t, y), and keeps its history.
    ///
    /// `observe` is shown the ordinates at all mesh points, first of the initial curve and then
    /// after each iteration.
    ///
    /// ```
    /// use faircurve::CurveStatus;
    /// use faircurve_papers::toms828::Graph;
    /// let trace = Graph::default().trace(&[0.0, 1.0, 2.0], &[0.0, 0.3, 0.1], |_| {})?;
    /// assert_eq!((trace.status, trace.ordinates.len(), trace.data), (CurveStatus::Converged, 241, vec![0, 120, 240]));
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Errors
    /// - Options out of range.
    /// - Different numbers of t and y.
    /// - Fewer than two points, t that do not increase, and two points at one mesh point.
    pub fn trace(&self, t: &[f64], y: &[f64], observe: impl FnMut(&[f64])) -> Result<GraphTrace> {
        self.check()?;
        if t.len() != y.len() {
            return Err(Error::argument(format!("{} values of t and {} of y: give one y a t", t.len(), y.len())));
        }
        if let Some(k) = (0..t.len()).find(|&k| !(t[k].is_finite() && y[k].is_finite())) {
            let (t, y) = (t[k], y[k]);
            return Err(Error::argument(format!("point {k}: ({t}, {y}) is no point; coordinates must be finite")));
        }
        let trace = self.descend(t, y, observe);
        trace.map_err(|(point, what)| Error::argument(format!("point {point}: {what}")))
    }

    fn check(&self) -> Result<()> {
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            let given = self.tolerance;
            return Err(Error::argument(format!("tolerance is {given}; it must lie between 0 and 1, such as 1e-8")));
        }
        self.mesh.check()
    }

    fn descend(&self, t: &[f64], y: &[f64], observe: impl FnMut(&[f64])) -> Result<GraphTrace, Refusal> {
        let (mesh, ordinates) = mesh::set_up(self.mesh, t, y)?;
        descent::run(self, mesh, ordinates, observe).ok_or_else(|| {
            let what = "its energy leaves the range of the numbers: scale the curve, or take a wider mesh";
            (0, what.into())
        })
    }
}
