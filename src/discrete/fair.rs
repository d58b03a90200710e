//! [`Fair`]: discrete fair curves.

use std::sync::Arc;

use super::energy::{Energy, bending, tautness};
use super::limits::Limits;
use super::plan::{Plan, Solver};
use crate::batch::CurveBatch;
use crate::deviation::Deviation;
use crate::surface::Surface;
use crate::words::words;

/// Bytes per vertex and dimension while all curves are descended.
///
/// In the plane 110 bytes per vertex were measured, including its share of the samples.
pub(super) const VERTEX_BYTES: usize = 56;

/// How spans between data points are divided into edges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Segments {
    /// This many edges per span.
    PerSpan(usize),
    /// Edges of at most about this length, in units of the input.
    Spacing(f64),
}

impl Segments {
    /// The largest number of vertices that a spacing may produce, for all curves together.
    ///
    /// They take some 2 GB during a fit.
    pub const MOST_VERTICES: usize = 5_000_000;

    /// The approximate number of edges of curve `i`, from its chords.
    pub(super) fn edges(self, batch: &CurveBatch, i: usize) -> usize {
        let most = Self::MOST_VERTICES;
        match self {
            Segments::PerSpan(n) => n.min(most) * batch.spans(i),
            Segments::Spacing(spacing) => {
                batch.chords(i).map(|chord| (chord / spacing).ceil().min(most as f64) as usize).sum()
            }
        }
    }
}

/// Which data points the curve passes through exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pins {
    /// All data points.
    #[default]
    All,
    /// The first and the last point of open curves.
    ///
    /// The energy attaches the others.
    Ends,
    /// No data point.
    ///
    /// The energy attaches them all.
    None,
}

words!(Pins, "choice of points": [
    (All, "all", "Every point stays where it is"),
    (Ends, "ends", "The first and the last point of open curves stay where they are"),
    (None, "none", "Every point may move"),
]);

/// Discrete fair curves: polygons with many vertices and the least energy.
///
/// A curve passes through its data points, or is attached to them. It starts from the natural or
/// periodic spline through the points and descends by Newton's method, damped in the Sobolev metric
/// of the energy (see [`Energy`] and [`Solver`]). A regularisation makes edges between data points
/// equally long, and does not change the shape.
///
/// If a planar curve with tautness in its energy intersects itself where its data polygon does not,
/// the fit is repeated with more tautness in the spans involved, up to eight times. If that does
/// not help, the curve gets twice the edges, since no curve can turn within an edge, or another
/// start. If nothing helps, it stays as it was: 1 of 2,500 borders of countries. The report says
/// so.
///
/// Gentle curves of least bending take about 3 iterations, and rough ones 10, independent of the
/// number of vertices. Exponents of bending above 5 or below 1.5 are reached by continuation.
///
/// The minimum is a local one, reached from the spline. Gentle data have no other minimum nearby,
/// but rough data do. For 39 of 60 rough curves in bending and 0.1 of length, 12
/// [`starts`](Self::starts) find an energy that is lower by more than 1 %.
///
/// Rough curves of least variation have a second solver, with the angles of the edges and their
/// length in every span as unknowns. It handles planar curves through all their points without
/// given tangents, if the energy contains only variation, bending of exponent 2, length, tautness
/// and tension. It runs if Newton's method is not near a minimum after 6 iterations, if it has not
/// converged after 16, or if the curve is 1.5 times as long as its data polygon. Newton's method
/// then finishes the curve, so the result is a minimum of the same energy. The second solver runs
/// on the host in f64, on every device. Of rough open curves with 0.1 of length 99 % converge
/// within 60 iterations.
///
/// Variation measures the curvature at a vertex as the sine of the turn over a length, so a turn of
/// more than 90° hides curvature. A curve with such a turn is `not_converged`, unless the vertex is
/// next to a span of fewer than 8 segments. Rough rings grow loops that turn so far even with 16
/// segments per span.
///
/// The curve has the tangents and curvature vectors of the batch's
/// [`Constraints`](crate::Constraints) to rounding. A tangent τ clamps the adjacent half edges,
/// whose curvature is 2(T − τ)/Δs. A curvature vector k ⊥ τ needs an energy of order 3, because
/// under bending the curvature may jump.
///
/// In space, coplanar points under [`variation`](super::variation()) without limits give the planar
/// curve.
///
/// # Accuracy
///
/// The energy of the polygon approximates the least energy of smooth curves to O(h²), where h is
/// the edge length. GPU results agree with the CPU to 1e-9 of the curve's size in f64, and to 1e-5
/// in f32 (1e-6 up to 64 edges); with a deviation to 1e-7 and 1e-3. If the program chooses the
/// precision, the CPU finishes what f32 cannot.
///
/// # Examples
///
/// ```
/// use faircurve::discrete::{Fair, bending, length};
/// use faircurve::{CurveBatch, CurveStatus, Device};
///
/// let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]];
/// let batch = CurveBatch::from_slices(&[&points[..]])?;
/// let fair = Fair { energy: bending(2.0) + 0.1 * length(), ..Fair::default() };
/// let fit = fair.fit(&batch, &Device::cpu())?;
/// assert_eq!(fit.reports()[0].status, CurveStatus::Converged);
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006). The
/// regularisation, the metric at pins and the tangents by half edges are faircurve's.
#[derive(Clone, Debug)]
pub struct Fair {
    /// The energy to minimise, with weights in units of the input.
    ///
    /// [`bending`] and [`tautness`] by default: a minimiser exists for all points, in any unit.
    pub energy: Energy,
    /// How spans are divided into edges.
    ///
    /// 16 edges per span by default. The error decreases as h² with the edge length h.
    pub segments: Segments,
    /// Which points the curve passes through.
    ///
    /// All by default, unless the energy contains an [`attachment`](super::attachment).
    pub pins: Pins,
    /// The largest distance D > 0 between a data point and its vertex.
    ///
    /// With `None`, the default, the curve goes through the points. With a distance, it is the
    /// fairest curve of all that pass within D of every point:
    ///
    /// ```text
    /// min E(f)  with  |f_i − p_i| ≤ D at every data point p_i
    /// ```
    ///
    /// The method of multipliers finds the forces that hold the curve at the discs it touches, in
    /// about eight rounds of Newton's method, on every device. So that no deviation exceeds D, the
    /// discs are smaller than D by 1e-4 of it; in f32 by 1e-5 of the curve's size, if that is more.
    /// Ends of open curves are pinned, unless pins are [`Pins::None`].
    ///
    /// Vertices of data points move across the curve only, not along it. The discs give the curve
    /// more room than its points leave, so the widths of tautness are √(w² + D²).
    ///
    /// The descent starts from the smoothing spline with this deviation or, if tangents are given,
    /// from the natural spline. A ring could vanish within a D of half its width (area over
    /// length), an open curve within a quarter of its diagonal. The deviation of such a curve is
    /// capped at 0.47 of that width or a quarter of that diagonal, and its message says so.
    ///
    /// Self-intersections of planar curves with tautness are removed as without a deviation. The
    /// reported energy excludes the terms of the constraints. Iterations are summed over all
    /// rounds. A curve that does not converge, or has loops, as can happen with bending alone, is
    /// `not_converged`.
    ///
    /// Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex
    /// programming* (1973).
    pub deviation: Option<Deviation>,
    /// Inequality constraints on every curve: a largest curvature, a turning direction, a corridor
    /// and other regions, a largest length.
    ///
    /// None by default. A curve that satisfies them anyway stays as it is. Every other curve
    /// continues from the unconstrained one: min E(f) with c ≥ 0 at every vertex, by the method of
    /// multipliers. With a deviation both are satisfied.
    ///
    /// If no curve nearby satisfies the limits, the status is
    /// [`Infeasible`](crate::CurveStatus::Infeasible). This is a verdict of the search, not a
    /// proof. The result is the curve with the smallest violation found, and its message says where
    /// and how large it is. A curve that satisfies the limits only by loops is `infeasible` too: it
    /// is 1.5 times as long as without limits, or it has a new self-intersection. The result is
    /// then the unconstrained curve or, with a deviation, the spline near the points.
    /// [`CurveReport::limits`](crate::CurveReport::limits) has the violation, the number of
    /// vertices with an active limit, the increase of the energy, and the length over the data
    /// polygon's: loops may satisfy a bound far below the natural curvature.
    ///
    /// Limits are tightened by 2e-7 of them, so that rounding does not violate them. Where ρ is at
    /// its largest, the margin grows to 4e-5 at most. Limits hold at vertices. Between two
    /// vertices, the curvature of the smooth curve exceeds its bound where a limit becomes active
    /// or edges of two lengths meet: for 40 rough curves with 16 edges per span by 4 % at the
    /// median and 20 % at most, and by less with more edges. Monotone curves do not turn back
    /// between vertices either. Ends have no curvature. Between vertices the curve may leave a
    /// region by at most κh²/8. Edges never cut an excluded disc, except next to pinned points,
    /// which are not constrained.
    ///
    /// Iterations are summed over all rounds. The descents are in f64. On a GPU without f64 the CPU
    /// computes them.
    ///
    /// A largest length is enforced by a weight on the length, which a secant method finds. The
    /// area has its own multiplier, which enforces it to 1e-6 of itself in descents on the host.
    ///
    /// With [`length`](super::length) as the only energy and a largest curvature κ, planar curves
    /// are the shortest of bounded curvature: chains of arcs of radius 1/κ and of lines, by Dubins'
    /// six words. A span without a bound is straight. The host finds the directions at the points
    /// in f64, on every device. The energy is the exact path's, on which the vertices lie at equal
    /// arc lengths in every span. Between two given directions no path is shorter. For 24 lists of
    /// 5 points, close ones too, a search over 1,440 directions per point found no shorter path.
    /// Such a path always exists, if necessary with loops: if it is longer than the largest stretch
    /// allows, `infeasible` is certain. Other limits need an energy with bending or variation.
    ///
    /// If no curve is found that satisfies a largest curvature, planar curves of other energies
    /// start again from that path. A result that is more than 1.5 times as long as the path, or
    /// crosses itself, is `infeasible`.
    ///
    /// Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex
    /// programming* (1973). R. J. Renka first preserved the shape of discrete fair curves,
    /// *Shape-preserving interpolation by fair discrete G³ space curves*, CAGD 22 (2005); the rule
    /// for which spans turn to which side is faircurve's. L. E. Dubins, *On curves of minimal
    /// length with a constraint on average curvature, and with prescribed initial and terminal
    /// positions and tangents*, American Journal of Mathematics 79 (1957).
    pub limits: Limits,
    /// The regular surface that curves lie in. `None`, the default, leaves them free.
    ///
    /// Every vertex lies in the surface, to rounding. Newton's method moves vertices in their
    /// tangent planes and then back along ∇F, so an iteration solves a system as large as a planar
    /// curve's. The start is the natural spline through the points, moved onto the surface. Curves
    /// are in space, with one exception. In a [`Globe`](crate::surface::Globe) they are planar: x
    /// and y are longitudes and latitudes in degrees, and lengths, distances and curvatures are
    /// those on the ground, in units of the globe. A third coordinate is a height: natural splines
    /// over the arc length on the ground go through the heights. Planar points of a
    /// [`HeightField`](crate::surface::HeightField) are lifted onto the terrain, and its curves are
    /// in space.
    ///
    /// A curve that leaves the domain of its surface, beyond a grid or at a hole of a mesh, is
    /// [`Infeasible`](crate::CurveStatus::Infeasible), and its message says where: see
    /// [`undefined`](crate::surface::Surface::undefined).
    ///
    /// [`geodesic_bending`](super::geodesic_bending) measures the bending within the surface,
    /// [`bending`](super::bending) the bending in space. With geodesic bending alone a curve is a
    /// geodesic from point to point, if possible. A closed curve without pinned points descends to
    /// the closed geodesic nearby, even if that is not the shortest.
    ///
    /// Tangents are turned into the tangent plane at their point. Planar tangents over a height
    /// field rise with it. In a globe they are directions to the east and to the north.
    ///
    /// The only limit available is a largest curvature, which bounds the geodesic curvature at
    /// every vertex. Energies of order 3, other limits and curvature vectors are errors. Kernels
    /// exist for quadrics and, in f64, for tori, terrain, meshes and surfaces with their own
    /// [kernel](crate::surface::Surface::kernel). For other surfaces, and for curves that are
    /// neither pinned nor attached, the host computes in f64, on every device.
    ///
    /// Source: R. J. Renka, *A Sobolev gradient method for construction of elastic curves in
    /// regular surfaces*, Nonlinear Analysis 63 (2005). A. Linnér and R. J. Renka, *Discrete
    /// periodic geodesics in a surface*, Experimental Mathematics 14 (2005). Hessians are projected
    /// as in P.-A. Absil, R. Mahony and R. Sepulchre, *Optimization Algorithms on Matrix Manifolds*
    /// (2008).
    pub surface: Option<Arc<dyn Surface>>,
    /// The largest distance of a data point from the surface, in units of the input.
    ///
    /// Nearer points are moved onto it, and the report's message says so. A curve with a point
    /// farther away is `invalid`. `None`, the default, is a thousandth of the curve's size.
    pub off_surface: Option<f64>,
    /// The turn above which data points are corners, in radians from 0 to π.
    ///
    /// `None`, the default, means no corners. With an angle, curves are cut at data points where
    /// the data polygon turns by more, unless the point has its own tangent. The pieces are fitted
    /// as open curves. A corner is pinned, and the pieces may leave it in any direction.
    ///
    /// The report has the worst status with its message, the sums of energies and iterations, and
    /// the largest of the other numbers. Curvatures exclude the turn at a corner, where each side
    /// has its own curvature.
    pub corners: Option<f64>,
    /// How curves descend: by Newton's method by default.
    pub solver: Solver,
    /// The size of the gradient at which a curve has converged.
    ///
    /// 1e-8 by default. Smaller is stricter.
    ///
    /// For Newton's method it is the decrement √(gᵀH⁻¹g), whose square is twice the remaining
    /// decrease of the energy. For Sobolev gradients it is √(gᵀL⁻¹g) in the Sobolev metric L, which
    /// is H at a straight curve. The curve is scaled to size 1, and the energy to weight 1 of its
    /// highest order. For |κ|^ν that is a weight of κ̄^(2 − ν), where κ̄ is the mean curvature of
    /// the start. In f32 the tolerance is at least 1.1 ε √E/h, the level of rounding.
    pub tolerance: f64,
    /// The largest number of iterations.
    ///
    /// 500 by default.
    pub max_iterations: u32,
    /// The number of descents per curve. The cheapest result that satisfies the limits is kept.
    ///
    /// 1 by default. The first descent starts from the spline, the second from circles through
    /// neighbouring points, the third from the rounded polygon, and the others from long random
    /// tangents. A curve that intersects itself never replaces one that does not.
    /// [`CurveReport::gain`](crate::CurveReport::gain) is the energy saved by further starts.
    /// Iterations are summed over all descents.
    pub starts: u32,
    /// The seed of the random starts.
    ///
    /// 0 by default. The same seed gives the same curves.
    pub seed: u64,
}

impl Default for Fair {
    fn default() -> Self {
        Fair {
            energy: bending(2.0) + tautness(),
            segments: Segments::PerSpan(16),
            pins: Pins::default(),
            deviation: None,
            limits: Limits::default(),
            surface: None,
            off_surface: None,
            corners: None,
            solver: Solver::default(),
            tolerance: 1e-8,
            max_iterations: 500,
            starts: 1,
            seed: 0,
        }
    }
}

impl Fair {
    /// The plan for descents of an energy.
    pub(super) fn plan(&self, energy: &Energy) -> Plan {
        let order = energy.order();
        let regularisation = match order {
            // The weight is 0 if no point is attached.
            1 => 2,
            2 if self.surface.is_some() || energy.has_limits() => 1,
            _ => order,
        };
        let is_attached = self.deviation.is_some() || energy.is_attached();
        // The spacing of a shortest curve through its points is undetermined.
        let solver = if order == 1 && !is_attached { Solver::Sobolev } else { self.solver };
        Plan { solver, order, regularisation }
    }
}
