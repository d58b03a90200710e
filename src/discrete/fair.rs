//! [`Fair`]: discrete fair curves.

use std::sync::Arc;

use super::energy::{Energy, bending, tautness};
use super::limits::Limits;
use super::plan::{Plan, Solver};
use crate::batch::CurveBatch;
use crate::deviation::Deviation;
use crate::surface::Surface;
use crate::words::words;

/// Bytes a vertex takes for each dimension while all curves are descended.
///
/// In the plane 110 bytes a vertex were measured, including its share of the samples.
pub(super) const VERTEX_BYTES: usize = 56;

/// How spans between data points are divided into edges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Segments {
    /// This many edges a span.
    PerSpan(usize),
    /// Edges of at most about this length, in units of the input.
    Spacing(f64),
}

impl Segments {
    /// The most vertices that a spacing may ask for, for all curves together.
    ///
    /// They take some 2 GB while they are fitted.
    pub const MOST_VERTICES: usize = 5_000_000;

    /// About how many edges a curve gets, by its chords. Chords of any length have a number.
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

/// Discrete fair curves: polygons of many vertices with the least energy.
///
/// A curve passes through its data points, or is attached to them. It starts from the natural or
/// periodic spline through the points. It then descends by Newton's method, damped in the Sobolev
/// metric that suits the energy (see [`Energy`] and [`Solver`]). A regularisation keeps edges between
/// data points equal, and does not change the shape.
///
/// Planar curves with tautness in their energy that cross themselves where the polygon of their points does not are
/// drawn tauter there, by rounds, until they do not, and their message says so. What crosses yet is drawn with
/// twice the edges, since within an edge no curve can turn, or from another start, and stays as it was where that does not
/// help either: 1 of 2,500 borders of countries.
///
/// Gentle curves of least bending take about 3 iterations, and rough ones 10, however many vertices
/// they have. Exponents of bending beyond 5 and below 1.5 are approached in stages.
///
/// The minimum is a local one, reached from the spline. Gentle data have no other minimum near.
/// Rough data do. Of 60 rough curves in bending and 0.1 of length, 12 [`starts`](Self::starts) find an energy lower by
/// more than 1 % for 39.
///
/// Curves of least variation through rough points are searched for in a second way, if they are planar, go through
/// all their points without given tangents, and the energy holds no more than variation, bending of exponent 2,
/// length, tautness and tension. Where Newton's method is not near a minimum after 6 iterations, or has not converged
/// after 16, or the curve is 1.5 times as long as its points' polygon, the unknowns become the angles of the edges, and their
/// length in every span. The curve found is finished by Newton's method, so that it is a minimum of the same energy. The host
/// does that search in f64, on every device. Of rough open curves with 0.1 of length 99 % converge within 60 iterations.
///
/// The curvature of variation is the sine of a turn over a length. A polygon that turns by more than 90° at a vertex
/// hides the curvature there: it is `not_converged`, unless it is beside a span of fewer than 8 segments. Rough rings grow loops in
/// which 16 segments a span turn so far.
///
/// The curve has the tangents and curvature vectors of the batch's [`Constraints`](crate::Constraints) to rounding. A tangent τ clamps the half edges beside it, whose curvature is 2(T − τ)/Δs. A curvature vector k ⊥ τ needs an
/// energy of order 3: bending lets curvature jump.
///
/// Curves whose points lie in a plane in space have, under [`variation`](super::variation()) and without limits, the curve of that plane.
///
/// # Accuracy
///
/// The polygon's energy is that of the smooth curve of least energy to O(h²), where h is the length
/// of an edge. On a GPU curves agree with those of the CPU to 1e-9 of their size in f64, and to
/// 1e-5 in f32 (1e-6 up to 64 edges); with a deviation to 1e-7 and 1e-3. Where the precision is left to the program, the CPU finishes
/// what f32 cannot.
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
/// Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006). The regularisation, the
/// metric at pins and the tangents by half edges are faircurve's.
#[derive(Clone, Debug)]
pub struct Fair {
    /// The energy to minimise, with weights in units of the input.
    ///
    /// [`bending`] and [`tautness`] by default: a least curve exists for every list of points, in any unit.
    pub energy: Energy,
    /// How spans are divided.
    ///
    /// 16 edges a span by default. More edges are closer to the smooth curve, by h².
    pub segments: Segments,
    /// Which points are passed through.
    ///
    /// All by default, unless the energy holds an [`attachment`](super::attachment).
    pub pins: Pins,
    /// The largest distance D > 0 between a data point and its vertex.
    ///
    /// `None`, the default, goes through the points. With a distance the curve is the fairest of all that
    /// pass within D of every point:
    ///
    /// ```text
    /// min E(f)  with  |f_i − p_i| ≤ D at every data point p_i
    /// ```
    ///
    /// Where it touches its discs it is held, each point by a force of its own; elsewhere it is free. The method of
    /// multipliers finds these forces in about eight rounds of Newton's method, on every device. The
    /// discs are smaller than D by 1e-4 of it, so that D is kept; in f32 by 1e-5 of the curve's size, if that is more.
    /// Ends of open curves are pinned, unless pins are [`Pins::None`].
    ///
    /// A vertex may move across the curve, and not along it. A curve has room in its discs besides that between its
    /// points: for tautness the widths are √(w² + D²).
    ///
    /// The descent starts from the smoothing spline that keeps the deviation, or, where tangents are given, from the
    /// natural spline. A ring could vanish within a D of half its width (area over length), an open curve within a
    /// quarter of its diagonal. Such a curve stays within 0.47 of that width or a quarter of that diagonal, however
    /// large D is, and its message says so.
    ///
    /// Planar curves with tautness that cross themselves where their points do not are drawn tauter there, as without a
    /// deviation. The reported energy is without what holds the curve. Iterations are those of all rounds.
    /// A curve that does not converge, or has loops, as with bending alone it may, is `not_converged`.
    ///
    /// Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex programming* (1973).
    pub deviation: Option<Deviation>,
    /// Inequalities that every curve keeps: a largest curvature, a side to turn to, a corridor and other regions, a longest
    /// length.
    ///
    /// None by default. A curve that keeps them without being asked stays as it is. Every other one goes on from the curve
    /// without limits: min E(f) with c ≥ 0 at every vertex, by the method of multipliers. With a deviation both are kept.
    ///
    /// A curve for which none is found near that keeps its limits is
    /// [`Infeasible`](crate::CurveStatus::Infeasible). That is a verdict of the search, and no proof. It comes out as the
    /// curve that breaks them least, and its message says where and by how much. So is a curve that only keeps them by
    /// loops: one of 1.5 times the length that it has without limits, or one that crosses itself as it did not. It stays
    /// as it is without limits, or, within a deviation, the spline near its points.
    /// [`CurveReport::limits`](crate::CurveReport::limits) has the violation, the vertices that a limit holds, what the limits cost, and the length
    /// over that of the points' polygon: a bound far below the natural curvature may be kept by loops.
    ///
    /// Limits are kept tighter by 2e-7 of them, so that rounding does not break them. Where ρ is at its largest the margin
    /// grows to 4e-5 at most. They hold at vertices. The curvature of the smooth curve between two vertices exceeds its bound
    /// where a limit begins to hold or edges of two lengths meet: of 40 rough curves with 16 edges a span by 4 % at the
    /// median and 20 % at most, and by less with more edges. No curve goes back along a direction between vertices either.
    /// Ends have no curvature. What lies between vertices of a region leaves it by κh²/8 at most, and no edge cuts a disc to stay out
    /// of, but for those at pinned points, which no region constrains.
    ///
    /// Iterations are those of all rounds. The descents are in f64. Kernels without f64 leave them to the CPU.
    ///
    /// The longest length is kept by a weight of the length, which is sought by secants. The area is
    /// kept to 1e-6 of itself by a multiplier of its own, and the host descends.
    ///
    /// Planar curves of [`length`](super::length) alone with a largest curvature κ are the shortest ones. They are chains of
    /// arcs of radius 1/κ and of lines, by Dubins' six words, and a span without a bound is straight. The host finds the
    /// directions at their points in f64, on every device. The energy is that of the exact path, on which the vertices lie at
    /// equal lengths in every span. Between two given directions none is shorter. Through 24 lists of 5 points, close ones too,
    /// none of 1,440 directions a point was. Such a path always exists, if need be with loops: where it is longer than the
    /// largest stretch allows, `infeasible` is certain. Other limits ask for an energy with bending or variation.
    ///
    /// Where no curve is found that keeps a largest curvature, planar curves of other energies start again from that path.
    /// What then becomes more than 1.5 times as long as the path, or crosses itself, is `infeasible`.
    ///
    /// Source: R. T. Rockafellar, *The multiplier method of Hestenes and Powell applied to convex programming* (1973).
    /// Shapes of discrete fair curves were first kept by R. J. Renka, *Shape-preserving interpolation by fair discrete G³
    /// space curves*, CAGD 22 (2005); which spans turn to which side is faircurve's rule. L. E. Dubins, *On curves of minimal length
    /// with a constraint on average curvature, and with prescribed initial and terminal positions and tangents*, American
    /// Journal of Mathematics 79 (1957).
    pub limits: Limits,
    /// The regular surface that curves lie in. `None`, the default, leaves them free.
    ///
    /// Every vertex lies in the surface, to rounding. Newton's method moves vertices in their tangent planes and then back
    /// along ∇F, so that an iteration solves the system of a planar curve. The start is the natural spline through the
    /// points, moved onto the surface. Curves are in space. Those in a [`Globe`](crate::surface::Globe) are planar: x and y
    /// are longitudes and latitudes in degrees, and lengths, distances and curvatures are those on the ground, in units of the globe. A
    /// third coordinate is a height: natural splines over the arc length on the ground go through the heights. Planar points of a
    /// [`HeightField`](crate::surface::HeightField) are those of the terrain over them, and its curves are in space.
    ///
    /// A curve that goes where its surface is not [defined](crate::surface::Surface::undefined), beyond a grid or at a hole of a
    /// mesh, is [`Infeasible`](crate::CurveStatus::Infeasible), and says where.
    ///
    /// [`geodesic_bending`](super::geodesic_bending) measures the bending within the surface, and
    /// [`bending`](super::bending) the whole. With geodesic bending alone a curve is a geodesic from point to point if it can
    /// be. Without pinned points and closed it descends to the closed geodesic near, also where that is not the shortest.
    ///
    /// Tangents are turned into the tangent plane at their point. Planar ones over a height field rise with it. In a globe they
    /// are directions to the east and to the north.
    ///
    /// Of limits a largest curvature is kept, which bounds the geodesic curvature at every vertex.
    /// Energies of order 3, other limits and curvature vectors are refused. Kernels know quadrics, and in f64 tori, terrain, meshes and the
    /// surfaces that bring their [kernel](crate::surface::Surface::kernel). In other surfaces, and where nothing holds a curve, the
    /// host descends in f64, on every device.
    ///
    /// Source: R. J. Renka, *A Sobolev gradient method for construction of elastic curves in regular surfaces*, Nonlinear
    /// Analysis 63 (2005). A. Linnér and R. J. Renka, *Discrete periodic geodesics in a surface*, Experimental Mathematics 14
    /// (2005). The projection of Hessians is that of P.-A. Absil, R. Mahony and R. Sepulchre, *Optimization Algorithms on
    /// Matrix Manifolds* (2008).
    pub surface: Option<Arc<dyn Surface>>,
    /// The largest distance of a data point from the surface, in units of the input.
    ///
    /// Nearer points are moved onto it, and the report's message says so. A curve with a point farther away is
    /// `invalid`. `None`, the default, is a thousandth of the curve's size.
    pub off_surface: Option<f64>,
    /// The angle above which corners are kept, in radians from 0 to π.
    ///
    /// `None`, the default, cuts nothing. With an angle, curves are cut at data points where the
    /// polygon of the data turns by more, unless the point has a tangent of its own. The pieces are
    /// fitted as open curves. A corner is pinned, and the pieces may leave it in any direction.
    ///
    /// The report has the worst status with its message, the sums of energies and iterations, and
    /// the largest of the other numbers. Curvatures do not contain the turn at a corner, where each
    /// side has its own.
    pub corners: Option<f64>,
    /// How curves descend: by Newton's method unless told otherwise.
    pub solver: Solver,
    /// The size of the gradient at which a curve has converged.
    ///
    /// 1e-8 by default, and smaller is stricter.
    ///
    /// By Newton's method it is the decrement √(gᵀH⁻¹g), whose square is twice what is left to
    /// gain. By Sobolev gradients it is √(gᵀL⁻¹g) in the Sobolev metric L, which is H at a straight
    /// curve. The curve is scaled to size 1, and the energy to weight 1 of its highest order. For
    /// |κ|^ν that is a weight of κ̄^(2 − ν), where κ̄ is the mean curvature of the start. In f32 the
    /// tolerance is at least 1.1 ε √E/h, which rounding leaves.
    pub tolerance: f64,
    /// The most iterations.
    ///
    /// 500 by default.
    pub max_iterations: u32,
    /// How many descents a curve makes, of which the cheapest is kept that keeps its limits.
    ///
    /// 1 by default. The first starts from the spline, the second from circles through neighbouring points, the third
    /// from the polygon rounded, and the others from long tangents at random. A curve that crosses
    /// itself does not take the place of one that does not. [`CurveReport::gain`](crate::CurveReport::gain) is what they saved, and the iterations
    /// are those of all.
    pub starts: u32,
    /// The seed of the starts at random.
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
    /// How its descents of an energy go.
    pub(super) fn plan(&self, energy: &Energy) -> Plan {
        let order = energy.order();
        let regularisation = match order {
            // Of weight 0 where nothing is attached.
            1 => 2,
            2 if self.surface.is_some() || energy.has_limits() => 1,
            _ => order,
        };
        let is_attached = self.deviation.is_some() || energy.is_attached();
        // Nothing spaces the edges of a shortest curve through its points.
        let solver = if order == 1 && !is_attached { Solver::Sobolev } else { self.solver };
        Plan { solver, order, regularisation }
    }
}
