//! [`FairCurves`]: fitted discrete curves as [`Curve`]s through their vertices, with tangents and
//! curvature vectors.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use crate::batch::Origin;
use crate::batch::{CurveBatch, Unfitted};
use crate::curve::measure::{self, BySpeed};
use crate::curve::{Curve, Input, Jet, Sampling, piece_at, vector};
use crate::device::DeviceReport;
use crate::ground::jet_onto;
use crate::linalg::scalar::Vector;
use crate::motion::Motion;
use crate::numbers::Numbers;
use crate::parallel;
use crate::ragged;
use crate::report::{CurveReport, CurveSet};
use crate::sort;
use crate::surface::Surface;
use glam::DVec3;

use super::constrain::Constrained;
use super::setup::PreparedCurve;

/// One fitted curve: its vertices, and the indices of the vertices at data points.
///
/// Without coordinates it is a curve of [`EvenVertices`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Vertices {
    /// Flat coordinates.
    pub coords: Vec<f64>,
    /// The vertex index of every data point.
    ///
    /// A closed curve has one more, one past its last vertex.
    pub rows: Vec<u32>,
    /// `None` for most curves.
    pub tangents: Option<Box<Tangents>>,
}

/// What is known about the tangents of a curve apart from its vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tangents {
    /// The indices of the vertices that are corners, in increasing order.
    ///
    /// The ends of open curves are not included.
    pub corners: Vec<u32>,
    /// The given tangents, in increasing order of vertex index.
    pub given: Vec<Given>,
    /// The tangent and the curvature vector at every vertex, or empty.
    pub frames: Vec<Frame>,
}

/// For most curves nothing more is known.
static FROM_VERTICES: Tangents = Tangents { corners: Vec::new(), given: Vec::new(), frames: Vec::new() };

impl Tangents {
    /// `None` if all fields are empty.
    pub fn boxed(self) -> Option<Box<Self>> {
        let is_known = !(self.corners.is_empty() && self.given.is_empty() && self.frames.is_empty());
        is_known.then(|| Box::new(self))
    }
}

/// A given tangent, and optionally a given curvature vector, at a vertex.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    pub row: u32,
    tangent: DVec3,
    curvature: Option<DVec3>,
}

impl Given {
    /// The same tangent after n vertices have been inserted before it.
    pub fn after(&self, vertices: u32) -> Self {
        Given { row: vertices + self.row, ..self.clone() }
    }
}

impl Vertices {
    /// The vertices of a curve. The two ends of a short edge become one vertex.
    pub fn of<const D: usize>(ready: &PreparedCurve<D>, vertices: Vec<Vector<f64, D>>) -> Self {
        if ready.given.is_empty() {
            return Vertices { coords: vertices.into_flattened(), rows: ready.rows.clone(), tangents: None };
        }
        let mut repeats = vec![false; vertices.len() + 1];
        for own in &ready.given {
            repeats[own.row + 1..=own.row + own.edges()].fill(true);
        }
        // A repeated vertex has the index of the vertex that it repeats.
        let mut count = 0;
        let numbers: Vec<u32> = repeats
            .iter()
            .map(|repeat| {
                count += u32::from(!repeat);
                count - 1
            })
            .collect();
        let coords = vertices.iter().zip(&repeats).filter(|(_, repeat)| !**repeat).flat_map(|(x, _)| *x).collect();
        let rows = ready.rows.iter().map(|&row| numbers[row as usize]).collect();
        let given = |own: &Constrained<D>| Given {
            row: numbers[own.row],
            tangent: vector(&own.tangent),
            curvature: own.curvature.map(|curvature| vector(&curvature)),
        };
        let given = ready.given.iter().map(given).collect();
        Vertices { coords, rows, tangents: Tangents { given, ..Tangents::default() }.boxed() }
    }

    /// What is known about its tangents.
    pub fn tangents(&self) -> &Tangents {
        self.tangents.as_deref().unwrap_or(&FROM_VERTICES)
    }

    /// Lifts planar vertices into space.
    ///
    /// `place` lifts a position, given the data point there if there is one. `vector` lifts a
    /// direction.
    pub fn lifted(
        &self,
        points: &[DVec3],
        place: &dyn Fn([f64; 2], Option<DVec3>) -> DVec3,
        vector: &dyn Fn(DVec3) -> DVec3,
    ) -> Self {
        let count = self.coords.len() / 2;
        let mut of_row = vec![None; count];
        self.rows.iter().zip(points).for_each(|(&row, &point)| of_row[row as usize % count] = Some(point));
        let places = self.coords.as_chunks::<2>().0.iter().zip(of_row).map(|(x, point)| place(*x, point));
        let given = self.tangents().given.iter().map(|own| Given {
            row: own.row,
            tangent: vector(own.tangent),
            curvature: own.curvature.map(vector),
        });
        let tangents =
            Tangents { corners: self.tangents().corners.clone(), given: given.collect(), ..Tangents::default() };
        Vertices {
            coords: places.flat_map(|place| place.to_array()).collect(),
            rows: self.rows.clone(),
            tangents: tangents.boxed(),
        }
    }
}

/// The vertices of curves through all their points that have as many edges in every span, in flat
/// arrays.
#[derive(Default)]
pub(crate) struct EvenVertices {
    pub coords: Numbers,
    /// The start of each curve's coordinates, and the end of the last. Empty without curves.
    pub offsets: Vec<usize>,
    /// Edges per span.
    pub segments: usize,
}

impl EvenVertices {
    /// The coordinates of curve `i`.
    pub fn of(&self, i: usize) -> &[f64] {
        &self.coords[self.offsets[i]..self.offsets[i + 1]]
    }

    fn row(&self, knot: usize) -> u32 {
        (knot * self.segments) as u32
    }
}

/// The curves of a batch in their order, with their reports.
pub(crate) struct Fitted {
    /// The vertices of each curve. `None` if the result is its input.
    pub curves: Vec<Option<Vertices>>,
    /// Those of curves without own coordinates.
    pub even: EvenVertices,
    pub reports: Vec<CurveReport>,
    /// The device that did the work.
    pub device: DeviceReport,
}

impl Fitted {
    /// The same with coordinates and rows for every curve. A curve of `batch` has a knot at every
    /// point, and at its first one again if it is closed.
    pub fn owned(mut self, batch: &CurveBatch) -> Self {
        let even = std::mem::take(&mut self.even);
        for (i, own) in self.curves.iter_mut().enumerate() {
            if let Some(own) = own.as_mut().filter(|own| own.coords.is_empty()) {
                own.coords = even.of(i).to_vec();
                own.rows = (0..knots(batch, i)).map(|knot| even.row(knot)).collect();
            }
        }
        self
    }
}

fn knots(batch: &CurveBatch, i: usize) -> usize {
    batch.count(i) + usize::from(batch.is_closed(i))
}

/// The curves of a batch.
pub(crate) struct FairCurves {
    dimension: usize,
    /// The coordinates of the vertices of all curves that were fitted.
    coords: Numbers,
    /// The start of each curve's coordinates, and the end of the last.
    offsets: Vec<usize>,
    /// The parameters of the data points of every curve, from [`knots_of`].
    knots: Vec<f64>,
    /// The vertex index of the data point at every knot.
    rows: Vec<u32>,
    /// The start of each curve's knots, and the end of the last.
    first_knots: Vec<usize>,
    tangents: BTreeMap<usize, Tangents>,
    /// The points of the curves that were not fitted.
    inputs: BTreeMap<usize, Input>,
    closed: Vec<bool>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
    /// The surface that the curves lie in.
    surface: Option<Arc<dyn Surface>>,
    /// Orthogonal unit vectors. The curve along an edge goes backwards along one of them only if
    /// the edge does.
    ahead: Vec<DVec3>,
}

/// Writes the parameters of a curve's data points.
///
/// They are the given ones, or 0, 1, 2 … if none were given or all are equal. A closed curve has
/// one more, where it returns to its first point.
fn knots_of(batch: &CurveBatch, i: usize, knots: &mut [f64]) {
    match batch.given_knots(i) {
        Some(given) => knots.copy_from_slice(&given),
        None => knots.iter_mut().enumerate().for_each(|(k, knot)| *knot = k as f64),
    }
}

/// A curve through its vertices.
///
/// Between two data points the parameter grows by the same step per edge. If both data points have
/// the same parameter, derivatives are taken with respect to the fraction of the span.
///
/// - At a vertex between edges of lengths h and h′ with the tangents T and T′, the curvature vector
///   is K = (T′ − T)/Δa. The tangent is (h′T + hT′)/(h + h′) − hh′ (K₊ − K₋)/(6 (h + h′)) with the
///   curvature vectors K₋ and K₊ at the neighbouring vertices. It is the smooth curve's tangent to
///   fourth order.
/// - Along an edge the curve is the cubic with the tangents at both ends. Its curvature changes
///   linearly between the vectors K at both ends.
/// - At a corner each side has the tangent and the curvature of a free end. The turn of the corner
///   itself enters neither.
/// - A given tangent τ replaces the computed one. The curvature vector is then 2(T − τ)/h on the
///   side of each edge, or the given one.
struct FairCurve<'a> {
    dimension: usize,
    closed: bool,
    /// Flat coordinates of its vertices.
    coords: &'a [f64],
    rows: &'a [u32],
    tangents: &'a Tangents,
    /// The indices of the vertices at which smooth pieces meet, in increasing order: corners, and
    /// vertices with a given tangent.
    breaks: Vec<u32>,
    /// The cubic along every edge. Computed once on demand, because lengths and curvatures need it
    /// often.
    edges: OnceLock<Vec<Edge>>,
    /// The parameter of every data point.
    knots: &'a [f64],
    surface: Option<&'a dyn Surface>,
    /// See [`FairCurves`].
    ahead: &'a [DVec3],
}

/// The cubic p + v (a + v (c + v d)) along an edge, at the fraction v of the edge.
///
/// Curvatures are taken from the acceleration bend + v · bend_change.
struct Edge {
    ends: [DVec3; 2],
    a: DVec3,
    c: DVec3,
    d: DVec3,
    bend: DVec3,
    bend_change: DVec3,
}

/// A tangent and a curvature vector.
pub(crate) type Frame = (DVec3, DVec3);

/// A straight edge from one vertex to the next, its length, and its direction.
struct Chord {
    vector: DVec3,
    length: f64,
    direction: DVec3,
}

impl Edge {
    /// The curve between two vertices with the given frames.
    #[inline(always)]
    fn between([p, q]: [DVec3; 2], chord: &Chord, [(start, bend), (end, bend_after)]: [Frame; 2]) -> Self {
        let Chord { vector, length, .. } = *chord;
        let (a, b) = (length * start, length * end);
        let (c, d) = (3.0 * vector - 2.0 * a - b, a + b - 2.0 * vector);
        Edge { ends: [p, q], a, c, d, bend: length * length * bend, bend_change: length * length * (bend_after - bend) }
    }

    /// The position at a fraction of the edge.
    fn place(&self, v: f64) -> DVec3 {
        let Edge { ends: [p, q], a, c, d, .. } = *self;
        if v == 0.0 {
            p
        } else if v == 1.0 {
            q
        } else {
            p + v * (a + v * (c + v * d))
        }
    }
}

impl FairCurve<'_> {
    /// The index of the edge at a fraction of a span, and the fraction of the edge.
    ///
    /// `None` for a span between repeated points, which has no edge.
    fn locate_edge(&self, span: usize, u: f64) -> Option<(usize, f64)> {
        piece_at([self.rows[span], self.rows[span + 1]], u)
    }

    /// The position at a fraction of a span. At a vertex it is exactly the vertex.
    fn place(&self, span: usize, u: f64) -> DVec3 {
        match self.locate_edge(span, u) {
            None => self.vertex(self.rows[span] as usize),
            Some((row, 0.0)) => self.vertex(row),
            Some((row, 1.0)) => self.vertex(row + 1),
            Some((row, v)) => {
                let place = self.cubic(row).place(v);
                self.surface.and_then(|surface| surface.project(place)).unwrap_or(place)
            }
        }
    }

    fn count(&self) -> usize {
        self.coords.len() / self.dimension
    }

    /// Wraps an index that may exceed the last vertex of a closed curve.
    #[inline(always)]
    fn wrapped(&self, row: usize) -> usize {
        let count = self.count();
        if row < count { row } else { row - count }
    }

    #[inline(always)]
    fn vertex(&self, row: usize) -> DVec3 {
        vector(&self.coords[self.wrapped(row) * self.dimension..][..self.dimension])
    }

    /// The curve along the edge that begins at a vertex.
    fn cubic(&self, row: usize) -> &Edge {
        &self.edges.get_or_init(|| self.laid())[row]
    }

    /// The given tangent at a vertex.
    fn given(&self, row: usize) -> Option<&Given> {
        let (row, given) = (self.wrapped(row) as u32, &self.tangents.given);
        given.binary_search_by_key(&row, |own| own.row).ok().map(|k| &given[k])
    }

    /// The first and the last vertex of the smooth piece that contains the edge beginning at `row`.
    ///
    /// `None` for a closed curve without corners. On closed curves the last index may exceed the
    /// number of vertices.
    fn piece(&self, row: usize) -> Option<(usize, usize)> {
        let (count, corners) = (self.count(), &self.breaks[..]);
        let next = corners.partition_point(|&corner| corner as usize <= row);
        let corner = |k: usize| corners[k] as usize;
        match (self.closed, corners.len()) {
            (true, 0) => None,
            (true, all) if next == 0 => Some((corner(all - 1), corner(0) + count)),
            (true, all) => Some((corner(next - 1), if next < all { corner(next) } else { corner(0) + count })),
            (false, all) => {
                Some((if next > 0 { corner(next - 1) } else { 0 }, if next < all { corner(next) } else { count - 1 }))
            }
        }
    }

    /// The cubics along all edges.
    fn laid(&self) -> Vec<Edge> {
        let count = if self.closed { self.count() } else { self.count() - 1 };
        let chord = |row: usize| {
            let vector = self.vertex(row + 1) - self.vertex(row);
            let length = vector.length();
            Chord { vector, length, direction: vector / length }
        };
        let chords: Vec<Chord> = (0..count).map(chord).collect();
        let mut edges = Vec::with_capacity(count);
        let mut before = None;
        for row in 0..count {
            let piece = self.piece(row);
            // Edges of a closed curve before its first corner belong to the piece that began at its
            // last corner, one revolution earlier.
            let at = if piece.is_some_and(|(first, _)| first > row) { row + self.count() } else { row };
            // An edge begins with the frame at the end of the previous edge, except at corners.
            let start = match before {
                Some(end) if piece.is_none_or(|(first, _)| first != at) => end,
                _ => self.frame(&chords, at, piece),
            };
            let end = self.frame(&chords, at + 1, piece);
            edges.push(Edge::between([self.vertex(row), self.vertex(row + 1)], &chords[row], [start, end]));
            before = Some(end);
        }
        edges
    }

    /// The frame at a vertex of a smooth piece.
    #[inline(always)]
    fn frame(&self, chords: &[Chord], row: usize, piece: Option<(usize, usize)>) -> Frame {
        if let Some(frame) = self.tangents.frames.get(self.wrapped(row)) {
            return *frame;
        }
        let curvature = |row| self.curvature(chords, row, piece);
        let (before, after) = self.chords_at(chords, row);
        let own = curvature(row);
        let (tangent, otherwise) = match piece {
            Some((first, _)) if row == first => {
                (after.direction - after.length / 6.0 * (2.0 * own + curvature(row + 1)), after.direction)
            }
            Some((_, last)) if row == last => {
                (before.direction + before.length / 6.0 * (2.0 * own + curvature(row - 1)), before.direction)
            }
            _ => {
                let change = curvature(row + 1) - curvature(self.before(row));
                let mean = after.length * before.direction + before.length * after.direction;
                (mean - before.length * after.length / 6.0 * change, after.direction)
            }
        };
        let tangent = self.given(row).map_or_else(|| tangent.normalize_or(otherwise), |given| given.tangent);
        if self.ahead.is_empty() {
            return (tangent, own);
        }
        let beside = match piece {
            Some((first, _)) if row == first => [after, after],
            Some((_, last)) if row == last => [before, before],
            _ => [before, after],
        };
        let is_free = self.ahead.len() < self.dimension;
        (kept_ahead(tangent, self.ahead, beside.map(|chord| chord.direction), is_free), own)
    }

    /// The curvature vector at a vertex of a smooth piece. At the ends of the piece it is
    /// extrapolated.
    #[inline(always)]
    fn curvature(&self, chords: &[Chord], row: usize, piece: Option<(usize, usize)>) -> DVec3 {
        let within = |row: usize| {
            let (before, after) = self.chords_at(chords, row);
            (after.direction - before.direction) / (0.5 * (before.length + after.length))
        };
        let inner = |k: usize, (first, last): (usize, usize)| within(if row == first { first + k } else { last - k });
        match piece {
            Some(piece @ (first, last)) if row == first || row == last => match (self.given(row), last - first) {
                // Both T and τ point forwards: into the piece, or out of it.
                (Some(given), _) => given.curvature.unwrap_or_else(|| {
                    let (sign, edge) = if row == first { (2.0, first) } else { (-2.0, last - 1) };
                    let edge = &chords[self.wrapped(edge)];
                    sign * (edge.direction - given.tangent) / edge.length
                }),
                (None, 0 | 1) => DVec3::ZERO,
                (None, 2) => inner(1, piece),
                (None, _) => 2.0 * inner(1, piece) - inner(2, piece),
            },
            _ => within(row),
        }
    }

    /// The chords that end and begin at a vertex. At the end of an open curve both are the same
    /// chord.
    #[inline(always)]
    fn chords_at<'c>(&self, chords: &'c [Chord], row: usize) -> (&'c Chord, &'c Chord) {
        (&chords[self.before(row).min(chords.len() - 1)], &chords[self.wrapped(row).min(chords.len() - 1)])
    }

    /// The previous vertex on a closed curve.
    #[inline(always)]
    fn before(&self, row: usize) -> usize {
        if row == 0 { self.count() - 1 } else { self.wrapped(row - 1) }
    }
}

/// Limits a tangent so that the cubics along both adjacent edges do not go backwards along the unit
/// vectors n, unless the edges themselves do.
///
/// A cubic is monotone along n if n·T at both ends is between 0 and three times the value of the
/// edge. If `is_free`, the component orthogonal to all n is scaled to make T a unit vector.
///
/// Source: F. N. Fritsch and R. E. Carlson, *Monotone piecewise cubic interpolation* (1980).
fn kept_ahead(tangent: DVec3, ahead: &[DVec3], directions: [DVec3; 2], is_free: bool) -> DVec3 {
    let (mut kept, mut across, mut is_kept) = (DVec3::ZERO, tangent, true);
    for n in ahead {
        let [before, after] = directions.map(|direction| n.dot(direction));
        let most = if before * after > 0.0 { 3.0 * before.abs().min(after.abs()) } else { 0.0 };
        let along = tangent.dot(*n);
        let own = if before < 0.0 { along.clamp(-most, 0.0) } else { along.clamp(0.0, most) };
        (kept, across, is_kept) = (kept + own * n, across - along * n, is_kept && own == along);
    }
    match across.try_normalize().filter(|_| is_free) {
        _ if is_kept => tangent,
        Some(across) => kept + (1.0 - kept.length_squared()).max(0.0).sqrt() * across,
        None => kept,
    }
}

impl Curve for FairCurve<'_> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn knots(&self) -> &[f64] {
        self.knots
    }

    fn pace(&self, span: usize) -> f64 {
        let length = self.knots[span + 1] - self.knots[span];
        if length > 0.0 { length } else { 1.0 }
    }

    fn pieces(&self, span: usize) -> usize {
        (self.rows[span + 1] - self.rows[span]) as usize
    }

    fn motion(&self, span: usize, piece: usize) -> Option<Motion> {
        let edge = self.cubic(self.rows[span] as usize + piece);
        Some(Motion { velocity: [edge.a, 2.0 * edge.c, 3.0 * edge.d], acceleration: [edge.bend, edge.bend_change] })
    }

    fn jet(&self, span: usize, u: f64) -> Jet {
        let Some((row, v)) = self.locate_edge(span, u) else {
            return Jet { point: self.place(span, u), ..Jet::default() };
        };
        let n = self.pieces(span) as f64 / self.pace(span);
        let edge = self.cubic(row);
        let Edge { a, c, d, bend, bend_change, .. } = *edge;
        let jet = Jet {
            point: edge.place(v),
            first: n * (a + v * (2.0 * c + 3.0 * v * d)),
            second: n * n * (bend + v * bend_change),
            third: n * n * n * bend_change,
        };
        self.surface.map_or(jet, |surface| jet_onto(surface, jet))
    }

    fn length(&self) -> f64 {
        if self.surface.is_some() { BySpeed(self).length() } else { measure::length(&self) }
    }

    fn span_length(&self, span: usize) -> f64 {
        if self.surface.is_some() { BySpeed(self).span_length(span) } else { measure::span_length(&self, span) }
    }

    fn fraction_at(&self, span: usize, length: f64, target: f64) -> f64 {
        match self.surface {
            Some(_) => BySpeed(self).fraction_at(span, length, target),
            None => measure::fraction_at(&self, span, length, target),
        }
    }

    fn max_curvature(&self) -> f64 {
        measure::max_curvature(&self)
    }
}

impl FairCurves {
    /// The curves of a batch, from the vertices of the fitted ones.
    pub fn new(
        batch: &CurveBatch,
        mut curves: Vec<Option<Vertices>>,
        even: EvenVertices,
        problems: BTreeMap<usize, Unfitted>,
    ) -> Self {
        let of_curve = |i: usize| curves[i].as_ref();
        let is_even = |own: &Vertices| own.coords.is_empty();
        let of = |i: usize| match of_curve(i) {
            None => &[],
            Some(own) if is_even(own) => even.of(i),
            Some(own) => &own.coords[..],
        };
        let offsets = ragged::offsets((0..batch.len()).map(|i| of(i).len()));
        let first_knots = ragged::offsets((0..batch.len()).map(|i| knots(batch, i)));
        let (mut knots, mut rows) = (vec![0.0; first_knots[batch.len()]], vec![0; first_knots[batch.len()]]);
        parallel::parts(&mut rows, &first_knots, |i, rows| match of_curve(i) {
            None => {}
            Some(own) if is_even(own) => rows.iter_mut().enumerate().for_each(|(knot, row)| *row = even.row(knot)),
            Some(own) => rows.copy_from_slice(&own.rows),
        });
        let coords = if offsets == even.offsets && curves.iter().flatten().all(is_even) {
            even.coords
        } else {
            let mut coords = Numbers::room(offsets[batch.len()]);
            parallel::parts(&mut coords, &offsets, |i, coords| coords.copy_from_slice(of(i)));
            coords
        };
        parallel::parts(&mut knots, &first_knots, |i, knots| knots_of(batch, i, knots));
        let unfitted = (0..batch.len()).filter(|&i| curves[i].is_none());
        let inputs = sort::map(unfitted.map(|i| (i, Input::of(batch, i))));
        let known = curves.iter_mut().enumerate();
        let tangents = sort::map(known.filter_map(|(i, own)| Some((i, *own.as_mut()?.tangents.take()?))));
        // All threads take part in freeing what all have allocated.
        parallel::each(&mut curves, |own| *own = None);
        FairCurves {
            dimension: batch.dimension(),
            coords,
            offsets,
            knots,
            rows,
            first_knots,
            tangents,
            inputs,
            closed: (0..batch.len()).map(|i| batch.is_closed(i)).collect(),
            problems,
            origin: batch.origin().clone(),
            surface: None,
            ahead: vec![],
        }
    }

    /// Keeps the curves from going backwards along these directions between vertices, unless their
    /// edges do.
    pub fn keep_ahead(&mut self, directions: &[[f64; 3]]) {
        self.ahead = directions.iter().map(|direction| DVec3::from(*direction).normalize()).collect();
    }

    /// Projects all positions of the curves onto a surface. Unfitted curves become their given
    /// points.
    pub fn lie_in(&mut self, given: &CurveBatch, surface: &Arc<dyn Surface>) {
        self.surface = Some(surface.clone());
        self.inputs.iter_mut().for_each(|(i, input)| *input = Input::of(given, *i));
    }

    /// The vertices of curve `i` in space and the vertex indices of its data points, if it was
    /// fitted.
    pub fn vertices(&self, i: usize) -> Option<(Vec<DVec3>, Vec<u32>)> {
        let curve = self.fair(i)?;
        Some(((0..curve.count()).map(|row| curve.vertex(row)).collect(), curve.rows.to_vec()))
    }

    fn knots(&self, i: usize) -> &[f64] {
        &self.knots[self.first_knots[i]..self.first_knots[i + 1]]
    }

    fn fair(&self, i: usize) -> Option<FairCurve<'_>> {
        if self.inputs.contains_key(&i) {
            return None;
        }
        let tangents = self.tangents.get(&i).unwrap_or(&FROM_VERTICES);
        let mut breaks = tangents.corners.clone();
        breaks.extend(tangents.given.iter().map(|own| own.row));
        breaks.sort_unstable();
        Some(FairCurve {
            dimension: self.dimension,
            closed: self.closed[i],
            coords: &self.coords[self.offsets[i]..self.offsets[i + 1]],
            rows: &self.rows[self.first_knots[i]..self.first_knots[i + 1]],
            tangents,
            breaks,
            edges: OnceLock::new(),
            knots: self.knots(i),
            surface: self.surface.as_deref(),
            ahead: &self.ahead,
        })
    }

    /// The coordinates and parameters of the samples of curve `i`.
    fn sample(&self, i: usize, sampling: Sampling) -> (Vec<f64>, Vec<f64>) {
        let Some(curve) = self.fair(i) else {
            return self.inputs[&i].sample(self.dimension, self.closed[i], sampling);
        };
        let sites = curve.sites(sampling);
        let mut coords = Vec::with_capacity(sites.len() * self.dimension);
        let mut t = Vec::with_capacity(sites.len());
        for (span, u) in sites {
            coords.extend(&curve.place(span, u).to_array()[..self.dimension]);
            let (from, to) = (curve.knots[span], curve.knots[span + 1]);
            t.push((from + u * (to - from)).min(to));
        }
        (coords, t)
    }
}

impl CurveSet for FairCurves {
    fn curve(&self, i: usize) -> Box<dyn Curve + '_> {
        match self.fair(i) {
            Some(curve) => Box::new(curve),
            None => Box::new(self.inputs[&i].polygon(self.dimension, self.closed[i])),
        }
    }

    fn polylines(&self, sampling: Sampling) -> CurveBatch {
        let samples: Vec<(Vec<f64>, Vec<f64>)> = parallel::map(self.closed.len(), 16, |i| self.sample(i, sampling));
        let closing = |i: usize, last: f64| match self.inputs.get(&i) {
            None => self.knots[self.first_knots[i + 1] - 1] - last,
            Some(input) => input.closing_after(last),
        };
        let (closed, problems) = (self.closed.clone(), self.problems.clone());
        CurveBatch::from_samples(self.dimension, samples, closing, closed, problems, self.origin.clone())
    }
}
