//! Setup: turns the data points of a curve into a [`Problem`].
//!
//! The natural or periodic spline through the data points is divided into edges of equal arc
//! length.

use std::ops::Range;

use super::constrain::{Constrained, bends, constrained, lay_short, repeat};
use super::division::{components, divide};
use super::energy::{Energy, Functional, of_spans};
use super::fair::{Fair, Pins};
use super::onto::{local, lost_between};
use super::problem::{Attached, Outcome, Problem, order_of};
use crate::batch::CurveBatch;
use crate::bounds::Bounds;
use crate::curve::{Curve, vector};
use crate::device::Device;
use crate::error::Result;
use crate::ground::{Halved, lost};
use crate::linalg::scalar::{Vector, add, dot, scale, subtract};
use crate::report::{CurveReport, CurveSet};
use crate::spline::{CubicSplines, Natural, Parametrisation};
use crate::status::CurveStatus;
use crate::{Constraints, Unfitted};

/// The γ h³/w at which the tangential and the normal stiffness of a vertex are equal, for the
/// weight γ of the regularisation.
const REGULARISATION: f64 = 1.0;

/// An edge turns back if its cosine with the one before it is within this many roundings of −1.
const TURNS_BACK_EPSILONS: f64 = 8.0;

/// The least mean curvature, as a fraction of 1/size. Smaller values are raised to it.
///
/// Otherwise an exponent ν > 2 would make straight curves infinitely soft.
const LEAST_CURVATURE: f64 = 0.1;

/// The most edges per span for which f32 has enough digits for bending.
///
/// The condition number grows with the fourth power of the number of edges.
pub(super) const MOST_EDGES_IN_F32: u32 = 200;

/// A curve longer than this factor times its data polygon counts as unbounded.
///
/// A half circle through two points is 1.57 times as long as its chord. No curve that converged was
/// seen to exceed 1.23 on its way. All unbounded ones passed 5 within about a hundred iterations.
pub(super) const LONGEST: f64 = 5.0;

/// A curve prepared for a descent.
#[derive(Clone, Debug)]
pub(crate) struct PreparedCurve<const D: usize> {
    pub problem: Box<Problem<D>>,
    /// The base vertices in units of the input.
    ///
    /// The vertices at data points equal the data.
    pub vertices: Vec<Vector<f64, D>>,
    /// The vertex index of every data point.
    ///
    /// A closed curve has one more, one past its last vertex.
    pub rows: Vec<u32>,
    /// The given tangents and curvature vectors, in increasing order of vertex index.
    pub given: Vec<Constrained<D>>,
    /// The unit of length of [`problem`](Self::problem), in units of the input.
    pub size: f64,
    /// The unit of energy of the problem, in units of the input.
    pub energy_unit: f64,
}

/// The natural and periodic splines through the data points of a batch, from which its curves
/// start.
pub(super) struct SplineStarts<'a> {
    fair: &'a Fair,
    batch: &'a CurveBatch,
    halved: Option<Halved>,
    splines: CubicSplines,
    reports: Vec<CurveReport>,
}

impl<'a> SplineStarts<'a> {
    /// The splines of a batch.
    ///
    /// # Errors
    /// Constraints that splines do not support.
    pub fn new(fair: &'a Fair, batch: &'a CurveBatch) -> Result<Self> {
        let start = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
        let halved = fair.surface.as_ref().and_then(|surface| Halved::of(batch, &**surface));
        let points = match &halved {
            Some(halved) => halved.batch.clone(),
            None => batch.with_points(batch.coords().to_vec(), batch.offsets().to_vec()),
        };
        // On a surface the start ignores given tangents, whether a neighbour is halved or not.
        let points = if fair.surface.is_some() { points } else { points.with_constraints(end_tangents(batch))? };
        let (splines, reports) = start.fit_splines(&points, &Device::cpu())?;
        Ok(SplineStarts { fair, batch, halved, splines, reports })
    }

    /// Prepares a curve, or returns why it cannot be fitted.
    ///
    /// The start is `own` if that is given and passes through the pins. `kept` says whether the
    /// curve keeps its first and its last point regardless of the pins.
    pub fn prepare<const D: usize>(
        &self,
        i: usize,
        kept: [bool; 2],
        own: Option<Box<dyn Curve + '_>>,
    ) -> Result<PreparedCurve<D>, Unfitted> {
        let SplineStarts { fair, batch, .. } = *self;
        let report: &CurveReport = &self.reports[i];
        if report.status != CurveStatus::Converged {
            let message = report.message.clone().unwrap_or_default();
            return Err(Unfitted { status: report.status, message });
        }
        let own = own.and_then(|start| ready::<D>(fair, batch, i, kept, start.as_ref(), false).ok());
        match own.filter(|ready| ready.goes_through_its_pins(batch.points(i).as_chunks::<D>().0)) {
            Some(ready) => Ok(ready),
            None => {
                let spline = self.splines.curve(i);
                let spline = self.halved.iter().fold(spline, |spline, halved| halved.joined(i, spline));
                ready::<D>(fair, batch, i, kept, spline.as_ref(), true)
            }
        }
    }
}

/// [`SplineStarts::prepare`] for all curves of a batch.
#[cfg(test)]
pub(crate) fn set_up<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
) -> Result<Vec<Result<PreparedCurve<D>, Unfitted>>> {
    let starts = SplineStarts::new(fair, batch)?;
    Ok((0..batch.len()).map(|i| starts.prepare(i, [false; 2], None)).collect())
}

/// Prepares one curve of a batch on the spline through its points.
pub(super) fn set_up_on_spline<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    kept: [bool; 2],
) -> Result<PreparedCurve<D>, Unfitted> {
    let own = batch.select(&[i]);
    let starts = SplineStarts::new(fair, &own).expect("the batch has splines");
    starts.prepare(0, kept, None)
}

/// Prepares one curve of a batch on another curve through its points.
pub(super) fn set_up_on<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    kept: [bool; 2],
    start: &dyn Curve,
) -> Result<PreparedCurve<D>, Unfitted> {
    ready(fair, batch, i, kept, start, true)
}

impl<const D: usize> PreparedCurve<D> {
    /// The vertices at the end of a descent, in units of the input.
    pub fn vertices_of(&self, outcome: &Outcome<D>) -> Vec<Vector<f64, D>> {
        let place = |(vertex, u): (&Vector<f64, D>, &Vector<f64, D>)| add(*vertex, scale(self.size, *u));
        self.vertices.iter().zip(&outcome.displacements).map(place).collect()
    }

    /// Whether f32 has enough digits for the bending of this curve.
    pub fn suits_f32(&self) -> bool {
        self.rows.windows(2).all(|pair| pair[1] - pair[0] <= MOST_EDGES_IN_F32)
    }

    /// The index of a vertex from its index in the output, where a short edge is a single vertex.
    pub fn row_of_drawn(&self, drawn: usize) -> usize {
        self.given.iter().fold(drawn, |row, own| if row > own.row { row + own.edges() } else { row })
    }

    /// Sets the positions of the problem's vertices at the start.
    pub(super) fn place(&mut self) {
        let from = self.vertices[0];
        let place = |vertex: &Vector<f64, D>| scale(1.0 / self.size, subtract(*vertex, from));
        self.problem.places = self.vertices.iter().map(place).collect();
    }

    /// Whether every pinned data point equals its vertex.
    fn goes_through_its_pins(&self, points: &[Vector<f64, D>]) -> bool {
        let count = self.vertices.len() as u32;
        let is_there = |&row: &u32| {
            let of_row = self.rows[..points.len()].iter().position(|&own| own % count == row);
            // Other pinned vertices lie on a chord.
            of_row.is_none_or(|k| points[k] == self.vertices[row as usize])
        };
        self.problem.pinned.iter().all(is_there)
    }
}

/// The given tangents at the ends of open curves, as unit vectors.
///
/// Chord-length splines support only these.
fn end_tangents(batch: &CurveBatch) -> Constraints {
    let d = batch.dimension();
    let Some(given) = &batch.constraints().tangents else { return Constraints::default() };
    let mut tangents = vec![f64::NAN; given.len()];
    for i in (0..batch.len()).filter(|&i| !batch.is_closed(i) && batch.count(i) > 1) {
        for k in [0, batch.count(i) - 1] {
            let at = (batch.offsets()[i] + k) * d;
            let length = given[at..at + d].iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 && length.is_finite() {
                (0..d).for_each(|c| tangents[at + c] = given[at + c] / length);
            }
        }
    }
    Constraints { tangents: Some(tangents), ..Constraints::default() }
}

fn ready<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    kept: [bool; 2],
    curve: &dyn Curve,
    interpolates: bool,
) -> Result<PreparedCurve<D>, Unfitted> {
    let closed = batch.is_closed(i);
    let points = batch.points(i).as_chunks::<D>().0;
    let pinned_at = |k: usize| match fair.pins {
        Pins::All => true,
        Pins::Ends => !closed && (k == 0 || k + 1 == points.len()),
        Pins::None => (kept[0] && k == 0) || (kept[1] && k + 1 == points.len()),
    };
    let is_pinned = |&k: &usize| pinned_at(k) || batch.is_pinned(i, k);
    let start = start_polygon::<D>(fair, batch, i, curve, interpolates, &is_pinned)?;
    let StartPolygon { vertices, rows, given, .. } = &start;
    let size = Bounds::of(points.iter().copied()).diagonal();
    let scaled = |v: Vector<f64, D>| v.map(|x| x / size);
    let mut base: Vec<Vector<f64, D>> = vertices.windows(2).map(|ends| scaled(subtract(ends[1], ends[0]))).collect();
    base.extend(closed.then(|| scaled(subtract(vertices[0], vertices[vertices.len() - 1]))));
    let short = lay_short(given, &mut base, size);
    let lengths: Vec<f64> = base.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
    let length: f64 = lengths.iter().sum();
    let curvature = mean_curvature(&base, &lengths, closed).max(LEAST_CURVATURE);
    let (mut weights, energy_unit) = normalised_weights(&fair.energy, size, curvature);
    // Tension depends on the number of edges, and short ones do not count.
    let terms = weights.iter_mut().zip(fair.energy.terms());
    terms
        .filter(|(_, (_, own))| matches!(own, Functional::Tension(_)))
        .for_each(|(weight, _)| *weight *= 1.0 - short as f64 / base.len() as f64);
    let refuse =
        |k: usize, status: CurveStatus, what: &str| Err(Unfitted { status, message: batch.sentence(i, k, what) });
    let in_range = |x: f64| x > 0.0 && x.is_finite();
    if ![size, energy_unit, curvature].into_iter().all(in_range) {
        let what = "its energy leaves the range of the numbers: scale the curve, to a size nearer to 1";
        return refuse(0, CurveStatus::Invalid, what);
    }
    if closed && vertices.len() < 3 && fair.energy.order() > 1 {
        let what = "it goes there and back on one line, which has no side to turn to: give it more points, or more segments a span";
        return refuse(0, CurveStatus::Degenerate, what);
    }
    let Held { data, pinned, attached } = held(fair, batch, i, &start, [size, energy_unit], &is_pinned)?;
    let order = order_of(fair.energy.order(), closed, vertices.len());
    if order > 1
        && let Some(j) = fold(&base, &lengths, closed)
    {
        let k = rows.partition_point(|&row| row as usize <= j + 1).saturating_sub(1).min(points.len() - 1);
        let what = "the points around it lie on a line on which the curve turns back, with no side to turn to: move one \
                    aside, or give it a tangent";
        return refuse(k, CurveStatus::Degenerate, what);
    }
    let highest = highest_weight(&fair.energy, weights.iter().copied(), length, curvature);
    let h = length / base.len() as f64;
    let (regularisation, power) = regularisation_of(order, order < 3 && fair.surface.is_none(), highest, h);
    // With length alone the vertices of attached curves would merge. Interpolating curves take one
    // step.
    let has_regularisation = order > 1 || (order == 1 && fair.energy.attachment_weight() > 0.0);
    let chords: f64 = batch.chords(i).sum();
    let problem = Box::new(Problem {
        has_tangents: short > 0,
        closed,
        base,
        free: free(&lengths, &data, closed, power),
        data,
        pinned,
        attached,
        weights,
        regularisation: if has_regularisation { regularisation } else { 0.0 },
        taut: if fair.energy.is_taut() { of_spans(points, rows, closed, size) } else { Vec::new() },
        surface: local(fair, vertices, size),
        highest,
        curvature,
        tolerance: fair.tolerance,
        longest: if fair.energy.bounds_length() { f64::INFINITY } else { LONGEST * chords / size },
        most_iterations: fair.max_iterations,
        ..Problem::default()
    });
    let StartPolygon { vertices, rows, given, .. } = start;
    let mut ready = PreparedCurve { problem, vertices, rows, given, size, energy_unit };
    if ready.problem.surface.is_some() {
        ready.place();
    }
    Ok(ready)
}

/// The start polygon of a curve, in units of the input.
struct StartPolygon<const D: usize> {
    vertices: Vec<Vector<f64, D>>,
    /// The vertex indices of the data points, with the first point's once more if the curve is
    /// closed.
    rows: Vec<u32>,
    given: Vec<Constrained<D>>,
    /// The vertices inside spans that must be straight.
    straight: Vec<u32>,
}

/// Divides the start into edges that satisfy the constraints.
fn start_polygon<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    curve: &dyn Curve,
    interpolates: bool,
    is_pinned: &dyn Fn(&usize) -> bool,
) -> Result<StartPolygon<D>, Unfitted> {
    let (closed, surface) = (batch.is_closed(i), fair.surface.as_deref());
    let points = batch.points(i).as_chunks::<D>().0;
    let (mut vertices, mut rows) = divide(curve, points, fair.segments, interpolates, surface);
    if let Some(surface) = surface
        && let Some(row) = lost_between(surface, &vertices)
    {
        let k = rows.partition_point(|&own| own as usize <= row).saturating_sub(1).min(points.len() - 1);
        return Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, &lost(surface)) });
    }
    let mut given = constrained::<D>(batch, i, &rows, &vertices, closed, fair.energy.order(), surface)?;
    if !given.is_empty() {
        let bends = bends(&given, &vertices, &rows, closed);
        for (vertex, bend) in vertices.iter_mut().zip(bends).filter(|(_, bend)| *bend != [0.0; D]) {
            let bent = add(*vertex, bend);
            *vertex = match surface {
                None => bent,
                Some(surface) => surface.project(vector(&bent)).map_or(*vertex, |foot| components(foot.to_array())),
            };
        }
    }
    repeat(&mut given, &mut vertices, &mut rows, closed);
    let straight = lay_straight(fair, batch, i, &rows, &mut vertices, &is_pinned);
    Ok(StartPolygon { vertices, rows, given, straight })
}

/// The pins and attachments of a curve at size 1.
struct Held<const D: usize> {
    /// The indices of the vertices at which edges may differ in length: data points and constrained
    /// vertices.
    data: Vec<u32>,
    pinned: Vec<u32>,
    attached: Vec<Attached<D>>,
}

/// Pins and attaches the vertices of a curve, for its size and its unit of energy.
fn held<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    start: &StartPolygon<D>,
    [size, energy_unit]: [f64; 2],
    is_pinned: &dyn Fn(&usize) -> bool,
) -> Result<Held<D>, Unfitted> {
    let StartPolygon { vertices, rows, given, straight } = start;
    let points = batch.points(i).as_chunks::<D>().0;
    let invalid =
        |k: usize, what: &str| Err(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, k, what) });
    let count = vertices.len() as u32;
    // The last points of a closed curve may repeat the first.
    let mut data: Vec<u32> = rows[..points.len()].iter().map(|&row| row % count).collect();
    let given_rows = given.iter().flat_map(Constrained::rows).map(|row| row as u32 % count);
    let fixed: Vec<u32> = given_rows.chain(straight.iter().copied()).collect();
    // A constraint at a point pins it.
    let of_points = (0..points.len()).filter(is_pinned).map(|k| data[k]);
    let pinned = increasing(of_points.chain(fixed.iter().copied()).collect());
    let point_of = |row: u32| rows[..points.len()].partition_point(|&own| own <= row).saturating_sub(1);
    let through: Vec<_> = pinned.iter().map(|&row| (point_of(row), vertices[row as usize])).collect();
    if let Some((point, what)) = fair.limits.problem::<D>(batch, i, rows, &through) {
        return invalid(point, &what);
    }
    let weight = fair.energy.attachment_weight();
    let mut attached: Vec<Attached<D>> = Vec::new();
    if weight > 0.0 {
        let own = |k: usize| batch.weights(i).map_or(1.0, |weights| weights[k]);
        for k in (0..points.len()).filter(|&k| pinned.binary_search(&data[k]).is_err()) {
            let at = subtract(points[k], vertices[data[k] as usize]).map(|x| x / size);
            attach(&mut attached, data[k], own(k) * weight * size * size / energy_unit, at);
        }
    }
    if fair.surface.is_some() && pinned.is_empty() && weight == 0.0 {
        if !batch.is_closed(i) {
            return invalid(0, "nothing holds an open curve in its surface: pin its ends, or attach it");
        }
        // It need not pass through its points, and all its edges are equal.
        data.truncate(1);
    }
    data.extend(fixed);
    Ok(Held { data: increasing(data), pinned, attached })
}

/// Moves the vertices of spans that must be straight onto their chords, if both ends are pinned and
/// have no constraints.
///
/// Returns the indices of the vertices.
fn lay_straight<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    i: usize,
    rows: &[u32],
    vertices: &mut [Vector<f64, D>],
    is_pinned: &dyn Fn(&usize) -> bool,
) -> Vec<u32> {
    let points = batch.points(i).as_chunks::<D>().0;
    let asks = |column: &Option<Vec<f64>>, k: usize| {
        column.as_ref().is_some_and(|column| !column[(batch.offsets()[i] + k) * D].is_nan())
    };
    let constraints = batch.constraints();
    let stays = |k: usize| is_pinned(&k) && !asks(&constraints.tangents, k) && !asks(&constraints.curvatures, k);
    let mut lined = Vec::new();
    for span in fair.limits.straight(points, rows).into_iter().filter(|span| stays(span.point) && stays(span.next)) {
        let [from, to] = span.rows;
        let chord = subtract(points[span.next], points[span.point]);
        for (k, vertex) in vertices[from + 1..to].iter_mut().enumerate() {
            let part = (k + 1) as f64 / (to - from) as f64;
            *vertex = add(points[span.point], scale(part, chord));
        }
        lined.extend((from + 1..to).map(|row| row as u32));
    }
    lined
}

/// Sorts indices and removes duplicates.
fn increasing(mut rows: Vec<u32>) -> Vec<u32> {
    rows.sort_unstable();
    rows.dedup();
    rows
}

/// Attaches a vertex to a data point by a spring. Springs of several points at one vertex add up.
fn attach<const D: usize>(targets: &mut Vec<Attached<D>>, row: u32, weight: f64, at: Vector<f64, D>) {
    // The points of one vertex are consecutive. Only the last points of a closed curve may repeat
    // its first.
    let first = targets.first().is_some_and(|target| target.row == row);
    let same = if first { targets.first_mut() } else { targets.last_mut() };
    match same.filter(|target| target.row == row) {
        Some(target) => *target = Attached::spring(row, target.stiffness + weight, at),
        None => targets.push(Attached::spring(row, weight, at)),
    }
}

/// The weight of the regularisation of an order for edges of length h, and the power of h/h_s in
/// the factor of a span.
///
/// The regularisation of ratios, for orders 1 and 2, has no unit of length.
fn regularisation_of(order: usize, is_of_ratios: bool, highest: f64, h: f64) -> (f64, f64) {
    let (of_h, of_ratio) = (1 - 2 * order as i32, order.max(2) as f64 - 0.5);
    let (of_h, of_ratio) = if is_of_ratios { (of_h + 2, of_ratio - 1.0) } else { (of_h, of_ratio) };
    (REGULARISATION * highest * h.powi(of_h), of_ratio)
}

impl<const D: usize> Problem<D> {
    /// Resets the regularisation of order 3 for the edges of the base, whose spans may have grown.
    pub(super) fn reset_regularisation(&mut self) {
        let lengths: Vec<f64> = self.base.iter().map(|edge| dot(*edge, *edge).sqrt()).collect();
        let h = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let (regularisation, power) = regularisation_of(3, false, self.highest, h);
        self.regularisation = regularisation;
        self.free = free(&lengths, &self.data, self.closed, power);
    }

    /// Replaces the regularisation of ratios of order 2 by one of differences. Both have the same
    /// stiffness for the edges that it was set for.
    pub(super) fn regularise_differences(&mut self) {
        let inverse = self.regularisation / (REGULARISATION * self.highest);
        self.regularisation *= inverse * inverse;
        self.free.iter_mut().for_each(|free| *free = free.powi(3));
    }
}

/// The factors of the regularisation at each vertex.
///
/// They are (h/h_s)^power, with the mean edge h_s of the vertex's span and the mean h of all edges.
/// In every span the tangential stiffness then equals the normal stiffness. Factors are 0 at data
/// points.
fn free(lengths: &[f64], data: &[u32], closed: bool, power: f64) -> Vec<f64> {
    let vertices = lengths.len() + usize::from(!closed);
    let mean = |edges: Range<usize>| {
        let count = edges.len() as f64;
        edges.map(|j| lengths[j % lengths.len()]).sum::<f64>() / count
    };
    let h = mean(0..lengths.len());
    let mut free = vec![0.0; vertices];
    for (k, &from) in data.iter().enumerate() {
        // The last span of a closed curve ends at its first data point.
        let to = match data.get(k + 1) {
            Some(&next) => next as usize,
            None if closed => data[0] as usize + vertices,
            None => break,
        };
        let ratio = (h / mean(from as usize..to)).powf(power);
        (from as usize + 1..to).for_each(|row| free[row % vertices] = ratio);
    }
    free
}

/// The weight of every term at size 1, and the unit that divides the weights.
///
/// The highest order has weight 1. |κ|^ν weighs as much as κ² at the given curvature, so that
/// tolerances mean the same for every exponent.
fn normalised_weights(energy: &Energy, size: f64, curvature: f64) -> (Vec<f64>, f64) {
    let unit = energy_unit(energy, size, curvature);
    (energy.terms().iter().map(|term| at_size_1(term, size) / unit).collect(), unit)
}

/// The weight of a term for a curve that has been divided by its size.
fn at_size_1((weight, functional): &(f64, Functional), size: f64) -> f64 {
    weight * size.powf(functional.facts().degree())
}

/// The unit of energy of a curve at size 1, in units of the input.
pub(super) fn energy_unit(energy: &Energy, size: f64, curvature: f64) -> f64 {
    let order = energy.order();
    let leading = energy.terms().iter().filter(|(weight, functional)| *weight > 0.0 && functional.order() == order);
    leading.map(|term| at_size_1(term, size) * curvature.powf(term.1.facts().stiffening())).sum()
}

/// The [highest weight](highest_weight) of an energy whose stiffness depends on neither length nor
/// curvature, for a curve that has been divided by its size.
pub(super) fn highest_at(energy: &Energy, size: f64, unit: f64) -> f64 {
    highest_weight(energy, energy.terms().iter().map(|term| at_size_1(term, size) / unit), 1.0, 1.0)
}

/// The second derivative of the energy's highest-order terms by the highest derivative of the
/// curve.
///
/// It is taken at a straight curve, or at the given curvature for energies whose stiffness depends
/// on it.
fn highest_weight(energy: &Energy, weights: impl Iterator<Item = f64>, length: f64, curvature: f64) -> f64 {
    let order = energy.order();
    let leading = weights.zip(energy.terms()).filter(|(_, (_, functional))| functional.order() == order);
    leading
        .map(|(weight, (_, functional))| {
            let facts = functional.facts();
            weight * (facts.stiffness(length) * curvature.powf(facts.stiffening()))
        })
        .sum()
}

/// The index of the edge after which the curve turns back exactly.
///
/// Such a curve is a saddle. By symmetry no gradient leads off the line.
fn fold<const D: usize>(base: &[Vector<f64, D>], lengths: &[f64], closed: bool) -> Option<usize> {
    let turns_back = |j: &usize| {
        let next = if j + 1 < base.len() { j + 1 } else { 0 };
        dot(base[*j], base[next]) <= (TURNS_BACK_EPSILONS * f64::EPSILON - 1.0) * (lengths[*j] * lengths[next])
    };
    (0..if closed { base.len() } else { base.len() - 1 }).find(turns_back)
}

/// The root mean square of |K| over the arc length.
fn mean_curvature<const D: usize>(base: &[Vector<f64, D>], lengths: &[f64], closed: bool) -> f64 {
    let mut edges = base.iter().zip(lengths).map(|(edge, &length)| (scale(1.0 / length, *edge), length));
    let (mut sum, mut length) = (0.0, 0.0);
    let last = base.len() - 1;
    let closing = closed.then(|| (scale(1.0 / lengths[last], base[last]), lengths[last]));
    let mut before = closing.or_else(|| edges.next()).expect("a curve has an edge");
    for here in edges {
        let (turn, shared) = (subtract(here.0, before.0), before.1 + here.1);
        sum += dot(turn, turn) * 2.0 / shared;
        length += 0.5 * shared;
        before = here;
    }
    if length > 0.0 { (sum / length).sqrt() } else { 0.0 }
}

pub(super) fn distance<const D: usize>(a: Vector<f64, D>, b: Vector<f64, D>) -> f64 {
    let away = subtract(b, a);
    dot(away, away).sqrt()
}
