//! [`CurveLimits`]: the [limits](Limits) of one curve at its vertices.

use super::enclosed::Enclosed;
use super::energy::{Functional, LIMIT_KINDS, LimitTerms};
use super::limits::{LimitKind, Limits, Polygon, RegionConstraint, of_spans, spans};
use super::problem::Problem;
use super::region_constraints::{NeighbourConstraint, RegionConstraints};
use super::separation::{SeparatingHalfPlane, SeparatingHalfPlanes};
use super::setup::PreparedCurve;
use crate::batch::CurveBatch;
use crate::linalg::scalar::{Vector, add, scale, subtract};

/// The unit of length of a separating half-plane is the mean chord, or this factor times the gap to
/// the neighbour if that is less.
///
/// The margin of the constraint is then a small fraction of the gap.
const OF_ROOM: f64 = 1e3;

/// The limits of one curve, scaled to size 1.
#[derive(Clone, Debug)]
pub(super) struct CurveLimits<const D: usize> {
    /// The limited quantity of every kind.
    pub quantities: [Functional; LIMIT_KINDS],
    /// The slope β of every kind at each vertex, 0 where there is no limit. The array of an unused
    /// kind is empty.
    pub slopes: [Vec<f64>; LIMIT_KINDS],
    /// The region constraints.
    pub regions: Option<RegionConstraints<D>>,
    /// The largest length.
    pub longest: Option<f64>,
    /// The required area.
    pub enclosed: Option<Enclosed>,
}

impl<const D: usize> CurveLimits<D> {
    /// The limits of a curve at size 1. If there are region constraints, sets the positions in its
    /// problem.
    ///
    /// `separating` are the half-planes between the curve and its neighbours.
    pub fn of(
        own: &Limits,
        batch: &CurveBatch,
        i: usize,
        separating: &[SeparatingHalfPlane],
        ready: &mut PreparedCurve<D>,
    ) -> Self {
        let points = batch.points(i).as_chunks::<D>().0;
        let spans = spans(&ready.rows, points.len());
        let (closed, vertices, size) = (batch.is_closed(i), ready.problem.vertices(), ready.size);
        let polygon = Polygon { spans: &spans, points, closed, vertices, size };
        let slopes = LimitKind::slopes_of(&polygon, own, batch, i);
        let quantities = LimitKind::<D>::ALL.map(|kind| (kind.functional)(own, ready.problem.surface.is_some()));
        let has_regions = own.has_places(batch) || !separating.is_empty();
        let regions = has_regions.then(|| regions_of(own, batch, i, separating, ready, &polygon));
        if regions.is_some() {
            ready.place();
        }
        let chords: f64 = batch.chords(i).sum();
        let longest = own.stretch.map(|stretch| stretch * chords / size);
        let at_size_1 = |point: &Vector<f64, D>| scale(1.0 / size, *point);
        let enclosed = own.area.then(|| Enclosed::by(&points.iter().map(at_size_1).collect::<Vec<_>>()));
        CurveLimits { quantities, slopes, regions, longest, enclosed }
    }

    /// Measures the edges of the problem's base for the region constraints.
    pub fn measure(&mut self, problem: &Problem<D>) {
        self.regions.iter_mut().for_each(|regions| regions.measure(problem));
    }
}

fn regions_of<const D: usize>(
    limits: &Limits,
    batch: &CurveBatch,
    i: usize,
    separating: &[SeparatingHalfPlane],
    ready: &PreparedCurve<D>,
    polygon: &Polygon<'_, D>,
) -> RegionConstraints<D> {
    let Polygon { spans, points, vertices, size, .. } = *polygon;
    let column = batch.constraints().corridors.as_deref();
    let widths = of_spans(limits.corridor, column, batch, i, spans);
    // From here on lengths are scaled to size 1.
    let from = ready.vertices[0];
    let mut corridors = vec![None; if widths.is_some() { vertices } else { 0 }];
    for (k, span) in spans.iter().enumerate() {
        let chord = polygon.chord(span);
        let [at, chord] = [subtract(points[span.point], from), chord].map(|x| scale(1.0 / size, x));
        let Some(width) = widths.as_ref().map(|widths| widths[k] / size) else { continue };
        let within = |width: f64, chord| width.is_finite().then(|| RegionConstraint::corridor(at, chord, width));
        let before = if k > 0 || polygon.closed { (k + spans.len() - 1) % spans.len() } else { k };
        let least = widths.as_ref().map_or(width, |widths| width.min(widths[before] / size));
        corridors[span.rows[0]] = within(least, [0.0; D]);
        corridors[span.rows[0] + 1..span.rows[1]].fill(within(width, chord));
        if span.rows[1] < vertices {
            let end = RegionConstraint::corridor(add(at, chord), [0.0; D], width);
            corridors[span.rows[1]] = width.is_finite().then_some(end);
        }
    }
    let unit = polygon.mean_chord();
    let regions = limits.regions.iter().map(|region| region.form(from, size, unit)).collect();
    let side = |half_plane: &SeparatingHalfPlane| {
        let [foot, axis] = [half_plane.foot, half_plane.axis].map(|v| std::array::from_fn(|c| v[c]));
        let unit = unit.min(OF_ROOM * half_plane.gap / size);
        let form = RegionConstraint::half_plane(scale(1.0 / size, subtract(foot, from)), axis, unit);
        NeighbourConstraint { row: ready.row_of_drawn(half_plane.row), form, neighbour: half_plane.neighbour }
    };
    let sides = separating.iter().map(side).collect();
    let rows = spans.iter().map(|span| span.rows).collect();
    RegionConstraints::new(regions, corridors, sides, rows, &ready.problem.pinned, vertices)
}

/// The energy terms for the limits of a batch; `None` without limits. `separating` are the
/// half-planes between neighbours.
pub(super) fn limit_terms<const D: usize>(
    limits: &Limits,
    batch: &CurveBatch,
    separating: &SeparatingHalfPlanes,
    in_surface: bool,
) -> Option<LimitTerms> {
    if limits.is_empty(batch) {
        return None;
    }
    let asked = LimitKind::<D>::ALL.into_iter().filter(|kind| (kind.is_asked)(limits, batch));
    let quantities = asked.map(|kind| (kind.functional)(limits, in_surface)).collect();
    let corridors = usize::from(limits.corridor.is_some() || batch.constraints().corridors.is_some());
    let regions = RegionConstraints::<D>::most(limits.regions.len() + corridors + separating.most_at_a_vertex());
    Some(LimitTerms { quantities, regions, stretch: limits.stretch.is_some(), area: limits.area })
}
