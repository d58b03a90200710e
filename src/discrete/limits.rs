//! [`Limits`]: inequalities that fair curves keep.

mod along;
mod kinds;
mod region;
#[cfg(test)]
mod tests;

pub(super) use along::{Polygon, Span, spans};
pub(super) use kinds::{Broken, LimitKind};
pub use region::Region;
pub(super) use region::RegionConstraint;

use super::energy::MOST_DIRECTIONS;
use crate::batch::CurveBatch;
use crate::error::{Error, Result};
use crate::linalg::scalar::{self, Vector};

/// A point may lie outside of its region by this part of its largest coordinate: it is rounding.
const TOUCHING: f64 = 1e-12;

/// Directions are perpendicular up to this cosine.
const PERPENDICULAR: f64 = 1e-9;

/// Limits that a fair curve keeps at every vertex, besides passing through its points.
///
/// [`Fair::limits`](super::Fair::limits) says how they are kept. Any of them may be asked for together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// The largest curvature κ > 0, in 1/length. `None`, the default, bounds none.
    ///
    /// At every vertex |T′ − T|/Δa ≤ κ, for the unit tangents T, T′ of the edges beside it and their mean length Δa.
    /// A regular polygon in a circle of radius R has 1/R there. The column `kmax` of
    /// [`Constraints::largest_curvatures`](crate::Constraints::largest_curvatures) bounds single spans; the smaller
    /// bound holds.
    pub curvature: Option<f64>,
    /// Whether curves turn and twist only to the sides to which the polygon of their points does.
    ///
    /// Planar curves keep the sign of their curvature. At a data point that is the side of the turn there. Between two
    /// points that turn to one side it is that side, and between an end and its neighbour that of the neighbour. A span
    /// between turns to different sides may turn to both. Points in a line, of a turn below 1e-9, are joined by straight spans
    /// where they are pinned and without tangents; others ask for nothing.
    ///
    /// Spatial curves keep the sign of their torsion, that of det(T, T′, T″) for three edges that follow each other. In a
    /// span it is that of its chord with the chords beside it, and in a span at an end that of its neighbour. At a data
    /// point between spans of different sides it is free. The energy must hold variation or torsion. Where curvature
    /// vanishes this volume has no gradient: of 200 rough curves of 5 points 14 to 18 are `not_converged`.
    pub shape: bool,
    /// Directions n, perpendicular to each other, in which no curve goes back between two points. None by default.
    ///
    /// Every edge of a span goes along n if its chord does, and against n if its chord does: n·T keeps its sign. Along
    /// (1, 0, 0) x grows or falls from point to point, and has no bump between them. In the plane a span whose chord is
    /// across one n is straight, between points that are pinned and have no tangents. Other such chords ask for nothing.
    /// The length of n does not count. In the plane its third coordinate is 0.
    pub monotone: Vec<[f64; 3]>,
    /// The half-width d > 0 of a corridor about the polygon of the points, in units of the input.
    ///
    /// `None`, the default, asks for none. The part of a curve between two points stays within d of the chord between
    /// them. The column `corridor` of [`Constraints::corridors`](crate::Constraints::corridors) has widths of single
    /// spans; the smaller one holds. Points that are not pinned stay within the smaller of both sides.
    pub corridor: Option<f64>,
    /// Half-planes, discs and balls that all curves keep within or stay out of. None by default.
    ///
    /// A curve that passes through a disc to stay out of goes around it on the side where it is nearer to the edge. That
    /// an edge between two vertices does not cut the disc, these stay out of one of radius √(r² + h²/4), for edges of
    /// length h.
    pub regions: Vec<Region>,
    /// The longest curve, as a multiple of the length of its points' polygon, more than 1. `None` bounds none.
    ///
    /// With it bending alone has a least curve.
    pub stretch: Option<f64>,
    /// Whether planar curves enclose the area that the polygon of their points does, to 1e-6 of it.
    ///
    /// An open curve encloses it with the chord between its ends. Areas that an open curve has on
    /// both sides of its chord count against each other, and the tolerance is at least 1e-8 of the
    /// disc with the polygon's perimeter. The host descends, on every device.
    pub area: bool,
    /// Whether planar curves of the batch may not cross each other: contour lines, lanes of a road.
    ///
    /// Curves whose points' polygons do not meet are kept from crossing and from touching, all pairs of the batch. Those that
    /// would cross are fitted again, in rounds, within half-planes of their vertices that separate both, until none cross. All others
    /// keep their bits. A curve that crosses a neighbour after 12 rounds is
    /// [`Infeasible`](crate::CurveStatus::Infeasible), and its message names the neighbour and the place.
    ///
    /// Pairs whose polygons cross or touch, as borders do that meet at a point, are not asked to, at no place; the message of
    /// both says so. Neither are pieces of a curve cut at corners, and a curve that crosses itself.
    /// [`LimitReport::neighbours`](crate::LimitReport::neighbours) and
    /// [`touching`](crate::LimitReport::touching) count both.
    pub no_crossing: bool,
    /// Whether no edge is steep, in tests.
    #[cfg(test)]
    pub(crate) toy: bool,
}

impl Limits {
    /// Whether there is nothing to keep in a batch.
    pub(super) fn is_empty(&self, batch: &CurveBatch) -> bool {
        !self.no_crossing && self.asks_nothing_alone(batch)
    }

    /// Whether there is nothing that a curve keeps without regard to others.
    pub(super) fn asks_nothing_alone(&self, batch: &CurveBatch) -> bool {
        let has_any = match batch.dimension() {
            2 => LimitKind::<2>::ALL.iter().any(|kind| (kind.is_asked)(self, batch)),
            _ => LimitKind::<3>::ALL.iter().any(|kind| (kind.is_asked)(self, batch)),
        };
        !has_any && self.stretch.is_none() && !self.area && !self.has_places(batch)
    }

    /// Whether there are limits of places.
    pub(super) fn has_places(&self, batch: &CurveBatch) -> bool {
        self.corridor.is_some() || !self.regions.is_empty() || batch.constraints().corridors.is_some()
    }

    /// Whether there is a largest curvature somewhere on curve `i`.
    pub(super) fn bounds_curvature(&self, batch: &CurveBatch, i: usize) -> bool {
        let rows = batch.offsets()[i]..batch.offsets()[i + 1];
        let bounds = batch.constraints().largest_curvatures.as_ref();
        self.curvature.is_some() || bounds.is_some_and(|all| all[rows].iter().any(|bound| !bound.is_nan()))
    }

    /// Whether there is no limit besides those of curvature and of the whole length.
    pub(super) fn bounds_curvature_alone(&self, batch: &CurveBatch) -> bool {
        !self.shape && !self.area && self.monotone.is_empty() && !self.no_crossing && !self.has_places(batch)
    }

    /// The spans of curve `i` that have edges, each with its largest curvature, infinite where there is none.
    ///
    /// `rows` are the vertices of its data points.
    pub(super) fn spans_of(&self, batch: &CurveBatch, i: usize, rows: &[u32]) -> Vec<(Span, f64)> {
        let spans = spans(rows, batch.count(i));
        let bounds = of_spans(self.curvature, batch.constraints().largest_curvatures.as_deref(), batch, i, &spans);
        let bounds = bounds.unwrap_or_else(|| vec![f64::INFINITY; spans.len()]);
        spans.into_iter().zip(bounds).collect()
    }

    /// Checks that the limits make sense.
    ///
    /// # Errors
    /// A curvature or a corridor that is not positive and finite. A stretch of 1 or less. A direction of length 0, or two that are not perpendicular. A region that is none.
    pub(super) fn check(&self, dimension: usize) -> Result<()> {
        let refuse = |why: String| Err(Error::argument(why));
        let is_length = |x: &f64| *x > 0.0 && x.is_finite();
        if let Some(curvature) = self.curvature.filter(|curvature| !is_length(curvature)) {
            return refuse(format!(
                "the largest curvature is {curvature}; it must be positive and finite, in 1/length: a radius R has 1/R"
            ));
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
        self.regions.iter().try_for_each(|region| region.check(dimension))
    }

    /// The first point of curve `i` at which its limits are none or cannot be kept, with what is wrong.
    ///
    /// `rows` are the vertices of the data points. `pinned` are the vertices that the curve goes through, each with the
    /// number of the point at or before it.
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
        if let Some(point) = self.turning_back(batch.points(i).as_chunks::<D>().0, rows, pinned) {
            let what =
                "its points turn back here along all directions of monotone, which no smooth curve does: leave one out";
            return Some((point, what.into()));
        }
        let scale = batch.points(i).iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let outside = self.regions.iter().flat_map(|region| pinned.iter().map(move |(k, place)| (region, *k, place)));
        let mut outside = outside.map(|(region, k, place)| (region, k, region.excess(*place)));
        let (region, point, excess) = outside.find(|(.., excess)| *excess > TOUCHING * scale)?;
        Some((
            point,
            format!("it breaks {region}, by {excess:.3e}, and the curve must go through it: move it, or the region"),
        ))
    }

    /// The unit vectors along the directions of [`monotone`](Self::monotone) curves, then zeros.
    pub(super) fn directions(&self) -> [[f64; 3]; MOST_DIRECTIONS] {
        let mut directions = [[0.0; 3]; MOST_DIRECTIONS];
        for (unit, direction) in directions.iter_mut().zip(&self.monotone) {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            *unit = direction.map(|x| x / length);
        }
        directions
    }
}

/// A bound for every span, infinite where there is none: the smaller one of all and of a column.
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
    // `min` passes over NaN, which stands for a blank.
    let bound = |span: &Span| f64::INFINITY.min(of_column(span.point)).min(all.unwrap_or(f64::INFINITY));
    Some(spans.iter().map(bound).collect())
}
