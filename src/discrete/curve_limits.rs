//! [`CurveLimits`]: the [limits](Limits) of one curve at its vertices.

use glam::DVec2;

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
        NeighbourConstraint { row: ready.row_of_drawn(half_plane.row), form, neighbour: Some(half_plane.neighbour) }
    };
    let mut sides: Vec<_> = separating.iter().map(side).collect();
    if let Some(widths) = &batch.constraints().widths {
        let own = &widths[2 * batch.offsets()[i]..2 * batch.offsets()[i + 1]];
        sides.extend(borders(polygon, own.as_chunks::<2>().0, from, unit));
    }
    let rows = spans.iter().map(|span| span.rows).collect();
    RegionConstraints::new(regions, corridors, sides, rows, &ready.problem.pinned, vertices)
}

/// The half-planes between the two borders of a planar corridor with these widths at the data points, for
/// the vertices of every span.
fn borders<const D: usize>(
    polygon: &Polygon<'_, D>,
    widths: &[[f64; 2]],
    from: Vector<f64, D>,
    unit: f64,
) -> Vec<NeighbourConstraint<D>> {
    let mut borders = Vec::new();
    let left = |v: DVec2| v.perp().normalize_or_zero();
    let chord = |k: usize| DVec2::from_slice(&polygon.chord(&polygon.spans[k]));
    // Along the bisector of the turn at the start of span k, or at its end.
    let across = |before: Option<usize>, after: Option<usize>| {
        let [a, b] = [before, after].map(|k| k.map_or(DVec2::ZERO, |k| left(chord(k))));
        (a + b).normalize_or_zero()
    };
    for (k, span) in polygon.spans.iter().enumerate() {
        let normals = [across(polygon.before(k), Some(k)), across(Some(k), polygon.after(k))];
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let corner = |end: usize| {
                let point = [span.point, span.next][end];
                DVec2::from_slice(&polygon.points[point]) + sign * widths[point][side] * normals[end]
            };
            let [mut start, end] = [corner(0), corner(1)];
            let mut along = end - start;
            // Inside a sharp turn the border may run back. It is parallel to the chord then, and near it.
            if along.dot(chord(k)) <= 0.0 {
                along = chord(k);
                start = if sign * along.perp_dot(end - start) < 0.0 { end } else { start };
            }
            if !(start.is_finite() && along.is_finite() && along != DVec2::ZERO) {
                continue;
            }
            let [foot, axis] = [start, sign * left(along)].map(|v| std::array::from_fn(|c| [v.x, v.y][c.min(1)]));
            let form = RegionConstraint::half_plane(scale(1.0 / polygon.size, subtract(foot, from)), axis, unit);
            let rows = (span.rows[0]..=span.rows[1]).map(|row| row % polygon.vertices);
            borders.extend(rows.map(|row| NeighbourConstraint { row, form, neighbour: None }));
        }
    }
    borders
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
    // A data point lies between two spans with two borders each.
    let borders = if batch.constraints().widths.is_some() { 4 } else { 0 };
    let all = limits.regions.len() + corridors + borders + separating.most_at_a_vertex();
    let regions = RegionConstraints::<D>::most(all);
    Some(LimitTerms { quantities, regions, stretch: limits.stretch.is_some(), area: limits.area })
}
