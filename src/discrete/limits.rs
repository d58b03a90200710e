//! [`Limits`]: inequality constraints on fair curves.

mod along;
mod kinds;
mod obstacle;
mod region;
#[cfg(test)]
mod tests;

pub(super) use along::{Polygon, Span, spans};
pub(super) use kinds::{Broken, LimitKind, seven_digits};
pub use obstacle::Obstacle;
pub(super) use obstacle::way_round;
pub use region::Region;
pub(super) use region::RegionConstraint;

use glam::DVec2;

use super::energy::MOST_DIRECTIONS;
use crate::batch::CurveBatch;
use crate::constraint::Constraints;
use crate::error::{Error, Result};
use crate::linalg::scalar::{self, Vector};
use crate::parallel;

/// A pinned point may lie outside a region by this fraction of the largest coordinate, which is
/// rounding.
const TOUCHING: f64 = 1e-12;

/// The largest cosine between directions that count as perpendicular.
const PERPENDICULAR: f64 = 1e-9;

/// Limits that a fair curve satisfies at every vertex, in addition to passing through its points.
///
/// [`Fair::limits`](super::Fair::limits) describes the method. All limits can be combined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// The largest curvature κ > 0, in 1/length. `None`, the default, sets no bound.
    ///
    /// At every vertex |T′ − T|/Δa ≤ κ, where T and T′ are the unit tangents of the adjacent edges
    /// and Δa is their mean length. A regular polygon inscribed in a circle of radius R has
    /// curvature 1/R. The column `kmax` of
    /// [`Constraints::largest_curvatures`](crate::Constraints::largest_curvatures) bounds single
    /// spans. The smaller bound applies.
    pub curvature: Option<f64>,
    /// The largest rate of change of the curvature, |κ′| along the curve, in 1/length². `None`, the
    /// default, sets no bound.
    ///
    /// A vehicle at speed v turns its wheels at a rate of κ′v. At every edge between two interior
    /// vertices |(I − T Tᵀ)(K′ − K)|/Δs is at most this, for the curvature vectors K and K′ at its ends
    /// and its unit tangent T.
    pub curvature_rate: Option<f64>,
    /// The largest slope of spatial curves, |dz| by the length in the xy-plane. `None`, the default,
    /// sets no bound.
    ///
    /// Every edge keeps it: |T_z| ≤ g/√(1 + g²) for a slope g.
    pub climb: Option<f64>,
    /// Whether the curvature, or the torsion in space, keeps the sign that the data polygon has.
    ///
    /// In the plane, the sign of the curvature at a data point is the sign of the polygon's turn
    /// there. A span between two turns to the same side turns to that side, and a span at an end of
    /// the curve turns to the side of its interior point. A span between turns to different sides
    /// may turn to both. Collinear points (turns below 1e-9) are joined by straight spans if they
    /// are pinned and have no tangents. Otherwise they imply no limit.
    ///
    /// In space, the sign of the torsion is the sign of det(T, T′, T″) for three consecutive edges.
    /// In a span it is the sign for the span's chord and the two adjacent chords. A span at an end
    /// of the curve has the sign of its neighbour. Torsion is free at a data point between spans of
    /// different signs. The energy must contain variation or torsion. Where curvature vanishes this
    /// determinant has no gradient: of 200 rough curves of 5 points 14 to 18 are `not_converged`.
    pub shape: bool,
    /// Pairwise perpendicular directions n along which no curve turns back between two points. None
    /// by default.
    ///
    /// Every edge of a span goes along n if its chord does, and against n if its chord does: n·T
    /// keeps its sign. With (1, 0, 0), x is monotone from point to point. In the plane, a span
    /// whose chord is perpendicular to an n is straight if its points are pinned and have no
    /// tangents. Other such chords imply no limit. The length of n does not matter. In the plane
    /// its third coordinate is 0.
    pub monotone: Vec<[f64; 3]>,
    /// The half-width d > 0 of a corridor around the data polygon, in units of the input.
    ///
    /// `None`, the default, means no corridor. The curve between two points stays within d of their
    /// chord. The column `corridor` of [`Constraints::corridors`](crate::Constraints::corridors)
    /// has the half-widths of single spans. The smaller one applies. Points that are not pinned
    /// stay within the smaller half-width of their two spans. In the plane
    /// [`Constraints::widths`](crate::Constraints::widths) has the widths to both sides of every point.
    pub corridor: Option<f64>,
    /// Half-planes, discs and balls that all curves stay within or out of. None by default.
    ///
    /// A curve that crosses a disc to stay out of goes around it on the side where the disc's edge
    /// is nearer. Vertices next to edges of length h stay out of a disc of radius √(r² + h²/4), so
    /// that edges do not cut the original disc.
    pub regions: Vec<Region>,
    /// The largest length, as a multiple of the data polygon's length, more than 1. `None`, the
    /// default, sets no bound.
    ///
    /// With a bound, a minimiser exists even for bending alone.
    pub stretch: Option<f64>,
    /// Whether planar curves enclose the same area as their data polygon, to 1e-6 of it.
    ///
    /// An open curve is closed by the chord between its ends. Areas on different sides of the chord
    /// have opposite signs, and the tolerance is at least 1e-8 of the disc with the polygon's
    /// perimeter. The host computes these descents, on every device.
    pub area: bool,
    /// Whether planar curves of the batch must not cross each other: contour lines, lanes of a
    /// road.
    ///
    /// This holds for all pairs of curves whose data polygons do not meet: they neither cross nor
    /// touch. Curves that would cross are fitted again, in rounds, within half-planes at their
    /// vertices that separate them. All other curves keep their bits. A curve that crosses a
    /// neighbour after 12 rounds is [`Infeasible`](crate::CurveStatus::Infeasible), and its message
    /// names the neighbour and the place.
    ///
    /// Pairs whose data polygons already cross or touch (adjacent borders, say) are left
    /// unconstrained along their whole length. Both reports say so. Pieces of one curve that is cut
    /// at corners may cross each other, and a curve may cross itself.
    /// [`LimitReport::neighbours`](crate::LimitReport::neighbours) counts the separated neighbours,
    /// [`touching`](crate::LimitReport::touching) the unconstrained ones.
    pub no_crossing: bool,
    /// Polygons that planar curves stay out of. None by default.
    ///
    /// Where the data polygon meets one, the curve goes the shortest way around. Edges are kept out as
    /// curves are kept from [crossing](Self::no_crossing) each other, so the written polyline is outside,
    /// edges included. A curve with a pinned point or an end inside is
    /// [`Invalid`](crate::CurveStatus::Invalid). One that still meets an obstacle after 12 rounds is
    /// [`Infeasible`](crate::CurveStatus::Infeasible).
    pub obstacles: Vec<Obstacle>,
    /// A limit on the slope of edges, for tests only.
    #[cfg(test)]
    pub(crate) toy: bool,
}

impl Limits {
    /// These limits with obstacles and excluded discs that are larger by a distance on every side.
    #[must_use]
    pub fn with_clearance(mut self, distance: f64) -> Self {
        for obstacle in &mut self.obstacles {
            *obstacle = obstacle.grown(distance);
        }
        for region in &mut self.regions {
            if let Region::Outside { radius, .. } = region {
                *radius += distance;
            }
        }
        self
    }

    /// The planar curves of which an edge meets an obstacle or cuts an excluded disc.
    #[doc(hidden)]
    pub fn cut(&self, curves: &CurveBatch) -> Vec<usize> {
        let is_cut = |i: usize| {
            let (name, points) = (curves.name(i), curves.points(i).as_chunks::<2>().0);
            let own = self.obstacles.iter().filter(|obstacle| obstacle.is_for(&name));
            let meets = |edge: [DVec2; 2]| own.clone().any(|obstacle| obstacle.meets(edge));
            let cuts = |edge: [DVec2; 2]| self.regions.iter().any(|region| region.is_cut_by(edge));
            points.windows(2).map(|pair| [pair[0], pair[1]].map(DVec2::from)).any(|edge| meets(edge) || cuts(edge))
        };
        let all = if curves.dimension() == 2 { curves.len() } else { 0 };
        let cut = parallel::map(all, 1, is_cut);
        (0..all).filter(|&i| cut[i]).collect()
    }

    /// Whether a batch has no limits.
    pub(super) fn is_empty(&self, batch: &CurveBatch) -> bool {
        !self.keeps_apart() && self.asks_nothing_alone(batch)
    }

    /// Whether curves are kept from crossing each other or obstacles.
    pub(super) fn keeps_apart(&self) -> bool {
        self.no_crossing || !self.obstacles.is_empty()
    }

    /// Whether no limit applies to a curve by itself, without regard to other curves.
    pub(super) fn asks_nothing_alone(&self, batch: &CurveBatch) -> bool {
        let has_any = match batch.dimension() {
            2 => LimitKind::<2>::ALL.iter().any(|kind| (kind.is_asked)(self, batch)),
            _ => LimitKind::<3>::ALL.iter().any(|kind| (kind.is_asked)(self, batch)),
        };
        !has_any && self.stretch.is_none() && !self.area && !self.has_places(batch)
    }

    /// Whether there are limits on positions: regions or corridors.
    pub(super) fn has_places(&self, batch: &CurveBatch) -> bool {
        let Constraints { corridors, widths, .. } = batch.constraints();
        self.corridor.is_some() || !self.regions.is_empty() || corridors.is_some() || widths.is_some()
    }

    /// Whether any span of curve `i` has a largest curvature.
    pub(super) fn bounds_curvature(&self, batch: &CurveBatch, i: usize) -> bool {
        let rows = batch.offsets()[i]..batch.offsets()[i + 1];
        let bounds = batch.constraints().largest_curvatures.as_ref();
        self.curvature.is_some() || bounds.is_some_and(|all| all[rows].iter().any(|bound| !bound.is_nan()))
    }

    /// Whether there are no limits other than those on the curvature and on the total length.
    pub(super) fn bounds_curvature_alone(&self, batch: &CurveBatch) -> bool {
        let Limits { curvature_rate: None, climb: None, shape: false, area: false, .. } = self else { return false };
        self.monotone.is_empty() && !self.keeps_apart() && !self.has_places(batch)
    }

    /// The spans of curve `i` that have edges, each with its largest curvature, infinite without a
    /// bound.
    ///
    /// `rows` are the vertex indices of its data points.
    pub(super) fn spans_of(&self, batch: &CurveBatch, i: usize, rows: &[u32]) -> Vec<(Span, f64)> {
        let spans = spans(rows, batch.count(i));
        let bounds = of_spans(self.curvature, batch.constraints().largest_curvatures.as_deref(), batch, i, &spans);
        let bounds = bounds.unwrap_or_else(|| vec![f64::INFINITY; spans.len()]);
        spans.into_iter().zip(bounds).collect()
    }

    /// Checks the limits.
    ///
    /// # Errors
    /// A curvature or corridor that is not positive and finite. A stretch of 1 or less. A direction
    /// of length 0, or two that are not perpendicular. `no_crossing` or `area` in space. An invalid
    /// region.
    pub(super) fn check(&self, dimension: usize) -> Result<()> {
        let refuse = |why: String| Err(Error::argument(why));
        let is_length = |x: &f64| *x > 0.0 && x.is_finite();
        if let Some(curvature) = self.curvature.filter(|curvature| !is_length(curvature)) {
            return refuse(format!(
                "the largest curvature is {curvature}; it must be positive and finite, in 1/length: a radius R has 1/R"
            ));
        }
        if let Some(rate) = self.curvature_rate.filter(|rate| !is_length(rate)) {
            return refuse(format!(
                "the largest rate of the curvature is {rate}; it must be positive and finite, in 1/length²"
            ));
        }
        if let Some(climb) = self.climb.filter(|climb| !is_length(climb)) {
            return refuse(format!("the largest slope is {climb}; it must be positive and finite, such as 0.1"));
        }
        if self.climb.is_some() && dimension == 2 {
            return refuse("planar curves have no slope: give points a third coordinate, or leave it out".into());
        }
        if let Some(width) = self.corridor.filter(|width| !is_length(width)) {
            return refuse(format!(
                "the half-width of the corridor is {width}; it must be positive and finite, in units of the input"
            ));
        }
        if let Some(stretch) = self.stretch.filter(|stretch| !(*stretch > 1.0 && stretch.is_finite())) {
            return refuse(format!(
                "the largest stretch is {stretch}; it must be more than 1, that of the points' polygon, such as 1.2"
            ));
        }
        for (k, direction) in self.monotone.iter().enumerate() {
            let square: f64 = direction[..dimension].iter().map(|x| x * x).sum();
            if !is_length(&square) || dimension == 2 && direction[2] != 0.0 {
                let [x, y, z] = direction;
                return refuse(format!("({x}, {y}, {z}) is no direction in {dimension} dimensions"));
            }
            let size = |v: &[f64; 3]| scalar::dot(*v, *v).sqrt();
            let is_aslant = |other: &&[f64; 3]| {
                scalar::dot(*direction, **other).abs() > PERPENDICULAR * size(direction) * size(other)
            };
            if let Some([a, b, c]) = self.monotone[..k].iter().find(is_aslant) {
                let [x, y, z] = direction;
                return refuse(format!(
                    "({a}, {b}, {c}) and ({x}, {y}, {z}) are not perpendicular: curves keep such directions as those of axes"
                ));
            }
        }
        if self.no_crossing && dimension == 3 {
            return refuse(
                "curves in space pass by each other without crossing: only planar curves can be kept from it; leave it out".into(),
            );
        }
        if self.area && dimension == 3 {
            return refuse("curves in space enclose no area: only planar curves can keep theirs; leave it out".into());
        }
        self.obstacles.iter().try_for_each(|obstacle| obstacle.check(dimension))?;
        self.regions.iter().try_for_each(|region| region.check(dimension))
    }

    /// The first point of curve `i` at which its limits are invalid or cannot be satisfied, and
    /// why.
    ///
    /// `rows` are the vertex indices of the data points. `pinned` are the positions of the pinned
    /// vertices, each with the index of the data point at or before it.
    pub(super) fn problem<const D: usize>(
        &self,
        batch: &CurveBatch,
        i: usize,
        rows: &[u32],
        pinned: &[(usize, Vector<f64, D>)],
    ) -> Option<(usize, String)> {
        let constraints = batch.constraints();
        let own = batch.offsets()[i]..batch.offsets()[i + 1];
        let columns = [
            (&constraints.largest_curvatures, "largest curvature", "in 1/length"),
            (&constraints.corridors, "corridor", "in units of the input"),
        ];
        for (column, name, unit) in columns {
            let Some(column) = column.as_ref().map(|column| &column[own.clone()]) else { continue };
            if let Some(point) = column.iter().position(|bound| *bound <= 0.0) {
                let bound = column[point];
                return Some((
                    point,
                    format!("its {name} is {bound}; give a positive number {unit}, or leave it empty"),
                ));
            }
        }
        if let Some(widths) = &constraints.widths
            && let Some(entry) = widths[2 * own.start..2 * own.end].iter().position(|width| *width < 0.0)
        {
            let (side, width) = (["left", "right"][entry % 2], widths[2 * own.start + entry]);
            return Some((
                entry / 2,
                format!("its corridor is {width} to the {side}; give 0 or more, or leave it empty"),
            ));
        }
        if let Some(point) = self.turning_back(batch.points(i).as_chunks::<D>().0, rows, pinned) {
            let what =
                "its points turn back here along all directions of monotone, which no smooth curve does: leave one out";
            return Some((point, what.into()));
        }
        let (planar, count) = (batch.points(i).as_chunks::<D>().0, batch.count(i));
        for obstacle in self.obstacles.iter().filter(|obstacle| obstacle.is_for(&batch.name(i))) {
            let ends = [0, count - 1].map(|k| (k, planar[k]));
            let inside = |(_, place): &(usize, Vector<f64, D>)| obstacle.contains([place[0], place[1]]);
            if let Some((point, _)) = pinned.iter().copied().chain(ends).find(inside) {
                let name = &obstacle.name;
                return Some((
                    point,
                    format!(
                        "it lies in obstacle {name}, or within its clearance, and the curve must stay out: move it, or the obstacle"
                    ),
                ));
            }
        }
        let scale = batch.points(i).iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let outside = self.regions.iter().flat_map(|region| pinned.iter().map(move |(k, place)| (region, *k, place)));
        let mut outside = outside.map(|(region, k, place)| (region, k, region.excess(*place)));
        let (region, point, excess) = outside.find(|(.., excess)| *excess > TOUCHING * scale)?;
        let by = seven_digits(excess);
        Some((point, format!("it breaks {region}, by {by}, and the curve must go through it: move it, or the region")))
    }

    /// Unit vectors along the directions of [`monotone`](Self::monotone), then zeros.
    pub(super) fn directions(&self) -> [[f64; 3]; MOST_DIRECTIONS] {
        let mut directions = [[0.0; 3]; MOST_DIRECTIONS];
        for (unit, direction) in directions.iter_mut().zip(&self.monotone) {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            *unit = direction.map(|x| x / length);
        }
        directions
    }
}

/// The bound of every span: the smaller one of `all` and of the column, infinite without either.
pub(super) fn of_spans(
    all: Option<f64>,
    column: Option<&[f64]>,
    batch: &CurveBatch,
    i: usize,
    spans: &[Span],
) -> Option<Vec<f64>> {
    if all.is_none() && column.is_none() {
        return None;
    }
    let of_column = |point: usize| column.map_or(f64::NAN, |column| column[batch.offsets()[i] + point]);
    // `min` ignores NaN, which stands for a blank entry.
    let bound = |span: &Span| f64::INFINITY.min(of_column(span.point)).min(all.unwrap_or(f64::INFINITY));
    Some(spans.iter().map(bound).collect())
}
