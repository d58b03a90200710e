//! [`CurveBatch`]: a ragged batch of point lists, the input of methods and the result of sampling.

mod check;
#[cfg_attr(not(feature = "formats"), path = "no_clock.rs")]
mod clock;
mod closed;
mod columns;
mod cut;
mod left_out;
mod origin;
mod parameters;
mod point;
mod sampled;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use crate::constraint::{Constraint, Constraints, gather_rows, rows_of};
use crate::error::{Error, Result};
use crate::numbers::Numbers;
use crate::ragged;
use crate::sort;
use crate::status::CurveStatus;

pub(crate) use check::are_finite;
pub(crate) use clock::Clock;
pub(crate) use closed::distance;
pub use columns::{Column, Values};
pub(crate) use columns::{turned, way_round};
pub(crate) use cut::{Piece, Traced};
pub(crate) use origin::{Cut, Origin};
pub(crate) use parameters::Parameters;
pub use point::Point;

/// Why a curve of a batch cannot be fitted.
///
/// The message names the point, the value and the remedy.
#[derive(Clone, Debug, PartialEq)]
pub struct Unfitted {
    /// [`CurveStatus::Invalid`] or [`CurveStatus::Degenerate`].
    pub status: CurveStatus,
    /// The problem and the remedy.
    pub message: String,
}

/// A ragged batch of point lists: 2-D or 3-D, open or closed, with names, parameters, weights and
/// constraints.
///
/// Coordinates are flat, point after point (`x y x y …`). Curve `i` owns the points `offsets[i] ..
/// offsets[i + 1]`. A closed curve does not repeat its first point: [`closed`](Self::closed) and
/// [`closed_auto`](Self::closed_auto) drop a repeated last point.
///
/// Inconsistent arrays are an error. A curve that cannot be fitted (NaN, decreasing parameters …)
/// gets an [`Unfitted`], and every fit returns it as its input polyline.
///
/// ```
/// use faircurve::CurveBatch;
/// let zigzag = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
/// let corner = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [4.0, 1.0]];
/// let batch = CurveBatch::from_slices(&[&zigzag[..], &corner[..]])?;
/// assert_eq!((batch.len(), batch.total_points(), batch.count(1)), (2, 7, 4));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CurveBatch {
    dimension: usize,
    /// Shared with splines whose knots are these points.
    coords: Arc<Numbers>,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    parameters: Option<Parameters>,
    closing_spans: Option<Vec<f64>>,
    weights: Option<Vec<f64>>,
    constraints: Constraints,
    columns: Vec<Column>,
    problems: BTreeMap<usize, Unfitted>,
    origin: Arc<Origin>,
}

impl CurveBatch {
    /// Makes a batch of open curves from slices of points.
    ///
    /// # Errors
    /// None today. The signature leaves room for limits.
    pub fn from_slices<P: Point>(curves: &[&[P]]) -> Result<Self> {
        let offsets = ragged::offsets(curves.iter().map(|curve| curve.len()));
        let mut coords = Vec::with_capacity(offsets[curves.len()] * P::DIMENSION);
        for point in curves.iter().flat_map(|curve| *curve) {
            point.push_to(&mut coords);
        }
        Self::from_ragged(P::DIMENSION, coords, offsets)
    }

    /// Makes a batch of open curves from flat coordinates and offsets.
    ///
    /// Curve `i` has the points `offsets[i] .. offsets[i+1]`.
    ///
    /// # Errors
    /// - A dimension other than 2 or 3.
    /// - Offsets that are empty, do not start at 0, decrease, or do not end at the number of
    ///   points.
    pub fn from_ragged(dimension: usize, coords: Vec<f64>, offsets: Vec<usize>) -> Result<Self> {
        Self::from_file(dimension, coords, offsets, Arc::default())
    }

    /// The coordinates and the offsets, as [`from_ragged`](Self::from_ragged) takes them.
    pub fn into_ragged(self) -> (Vec<f64>, Vec<usize>) {
        (Arc::unwrap_or_clone(self.coords).into_vec(), self.offsets)
    }

    /// Makes a batch from a file. Messages name the file, the line and the curve.
    pub(crate) fn from_file(
        dimension: usize,
        coords: Vec<f64>,
        offsets: Vec<usize>,
        origin: Arc<Origin>,
    ) -> Result<Self> {
        if dimension != 2 && dimension != 3 {
            return Err(Error::Batch(format!("points have {dimension} coordinates; 2 and 3 are possible")));
        }
        if !coords.len().is_multiple_of(dimension) {
            let length = coords.len();
            return Err(Error::Batch(format!("{length} coordinates are no whole number of {dimension}-D points")));
        }
        let points = coords.len() / dimension;
        if offsets.first() != Some(&0) {
            return Err(Error::Batch("offsets must start with 0 and hold one entry more than there are curves".into()));
        }
        if let Some(i) = offsets.windows(2).position(|pair| pair[1] < pair[0]) {
            let (from, to) = (offsets[i], offsets[i + 1]);
            return Err(Error::Batch(format!("offsets decrease at curve {i}: {from} is followed by {to}")));
        }
        let last = offsets[offsets.len() - 1];
        if last != points {
            return Err(Error::Batch(format!("offsets end at {last}, but there are {points} points")));
        }
        let curves = offsets.len() - 1;
        let mut batch = Self::bare(dimension, coords, offsets, vec![false; curves], origin);
        batch.check_coordinates();
        Ok(batch)
    }

    /// A batch of nothing but points, without checks.
    fn bare(
        dimension: usize,
        coords: impl Into<Numbers>,
        offsets: Vec<usize>,
        closed: Vec<bool>,
        origin: Arc<Origin>,
    ) -> Self {
        CurveBatch {
            dimension,
            coords: Arc::new(coords.into()),
            offsets,
            closed,
            parameters: None,
            closing_spans: None,
            weights: None,
            constraints: Constraints::default(),
            columns: Vec::new(),
            problems: BTreeMap::new(),
            origin,
        }
    }

    /// Sets the parameter of every point.
    ///
    /// Parameters must increase along a curve. Equal ones are allowed at equal points (and anywhere
    /// for smoothing). A closed curve may repeat its first point to state the length of the closing
    /// span: call this before [`closed`](Self::closed). A curve whose parameters are all NaN has
    /// none.
    ///
    /// # Errors
    /// If the number of parameters is not the number of points.
    pub fn with_parameters(mut self, parameters: Vec<f64>) -> Result<Self> {
        expect_length("parameters", parameters.len(), self.total_points(), "point")?;
        let lacks = |&i: &usize| parameters[self.offsets[i]..self.offsets[i + 1]].iter().all(|t| t.is_nan());
        let untimed: Vec<usize> = (0..self.len()).filter(|i| self.count(*i) > 0 && lacks(i)).collect();
        let timed = parameters.is_empty() || parameters.iter().any(|t| !t.is_nan());
        self.parameters = timed.then(|| Parameters::from(parameters));
        if self.origin.untimed != untimed || self.origin.timed != timed {
            let origin = Arc::make_mut(&mut self.origin);
            (origin.untimed, origin.timed) = (untimed, timed);
        }
        self.check_parameters();
        Ok(self)
    }

    /// Sets the parameter length of the closing span of every closed curve. The lengths of open
    /// curves are ignored.
    ///
    /// # Errors
    /// If the number of lengths is not the number of curves.
    pub fn with_closing_spans(mut self, lengths: Vec<f64>) -> Result<Self> {
        expect_length("closing spans", lengths.len(), self.len(), "curve")?;
        self.closing_spans = Some(lengths);
        Ok(self)
    }

    /// Sets the weight of every point, for smoothing. Weights must be positive and finite.
    ///
    /// # Errors
    /// If the number of weights is not the number of points.
    pub fn with_weights(mut self, weights: Vec<f64>) -> Result<Self> {
        expect_length("weights", weights.len(), self.total_points(), "point")?;
        self.weights = Some(weights);
        self.check_weights();
        Ok(self)
    }

    /// Sets the constraints. Coordinates of unknown points may be NaN or infinite.
    ///
    /// # Errors
    /// If the length of a column is not the number of points (times the dimension, for vectors).
    pub fn with_constraints(mut self, constraints: Constraints) -> Result<Self> {
        let points = self.total_points();
        for (what, column) in [("tangents", &constraints.tangents), ("curvature vectors", &constraints.curvatures)] {
            if let Some(column) = column {
                expect_length(what, column.len(), points * self.dimension, "coordinate")?;
            }
        }
        let lengths = [
            ("exponents", constraints.exponents.as_ref().map(Vec::len)),
            ("known flags", constraints.known.as_ref().map(Vec::len)),
            ("pinned flags", constraints.pinned.as_ref().map(Vec::len)),
            ("largest curvatures", constraints.largest_curvatures.as_ref().map(Vec::len)),
            ("corridors", constraints.corridors.as_ref().map(Vec::len)),
        ];
        if let Some(widths) = &constraints.widths {
            expect_length("widths of corridors, two per point,", widths.len(), 2 * points, "width")?;
        }
        for (what, length) in lengths {
            expect_length(what, length.unwrap_or(points), points, "point")?;
        }
        let other_points = self.constraints.known != constraints.known;
        self.constraints = constraints;
        if other_points {
            self.check_again();
        }
        Ok(self)
    }

    /// Sets the names of the curves, for reports, errors and files.
    ///
    /// # Errors
    /// If the number of names is not the number of curves.
    pub fn with_names(self, names: Vec<String>) -> Result<Self> {
        expect_length("names", names.len(), self.len(), "curve")?;
        let mut origin = (*self.origin).clone();
        origin.names = Some(names);
        Ok(self.with_origin(Arc::new(origin)))
    }

    /// The same curves of longitudes x and latitudes y in degrees, as of WGS84.
    #[must_use]
    pub fn in_degrees(mut self) -> Self {
        Arc::make_mut(&mut self.origin).geographic = true;
        self
    }

    /// The same curves in a unit of so many metres.
    ///
    /// # Errors
    /// A number that is not positive and finite.
    pub fn in_metres(mut self, metres: f64) -> Result<Self> {
        if !(metres > 0.0 && metres.is_finite()) {
            let sentence = format!("a unit of {metres} metres is given; it must be positive and finite");
            return Err(Error::argument(sentence));
        }
        Arc::make_mut(&mut self.origin).metres = Some(metres);
        Ok(self)
    }

    /// Sets the provenance.
    pub(crate) fn with_origin(mut self, origin: Arc<Origin>) -> Self {
        self.origin = origin;
        self
    }

    /// The provenance.
    pub(crate) fn origin(&self) -> &Arc<Origin> {
        &self.origin
    }

    /// Number of curves.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Whether there are no curves.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of points of all curves together.
    pub fn total_points(&self) -> usize {
        self.offsets[self.len()]
    }

    /// Number of points of curve `i` (a closed curve does not repeat its first).
    pub fn count(&self, i: usize) -> usize {
        self.offsets[i + 1] - self.offsets[i]
    }

    /// Number of spans of curve `i`: one less than its points, or equal for a closed curve.
    pub fn spans(&self, i: usize) -> usize {
        if self.closed[i] { self.count(i) } else { self.count(i).saturating_sub(1) }
    }

    /// All coordinates, point by point.
    pub fn coords(&self) -> &[f64] {
        &self.coords
    }

    /// All coordinates, shared.
    pub(crate) fn shared_coords(&self) -> &Arc<Numbers> {
        &self.coords
    }

    /// First point of every curve, and the number of all points at the end.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// The coordinates of curve `i`, point by point.
    pub fn points(&self, i: usize) -> &[f64] {
        &self.coords[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }

    /// Whether curve `i` is closed.
    pub fn is_closed(&self, i: usize) -> bool {
        self.closed[i]
    }

    /// Whether some curve has parameters.
    pub(crate) fn has_parameters(&self) -> bool {
        !self.is_empty() && self.parameters.is_some()
    }

    /// The parameters of curve `i`, if it has any.
    pub fn parameters(&self, i: usize) -> Option<&[f64]> {
        let all = self.parameters.as_ref().filter(|_| self.origin.untimed.binary_search(&i).is_err())?;
        Some(&all.get()[self.offsets[i]..self.offsets[i + 1]])
    }

    /// All parameters, shared, with placeholders for curves without parameters.
    pub(crate) fn shared_parameters(&self) -> Option<&Arc<Vec<f64>>> {
        self.parameters.as_ref().map(Parameters::get)
    }

    /// The given parameter length of the closing span of curve `i`.
    pub fn closing_span(&self, i: usize) -> Option<f64> {
        self.closing_spans.as_ref().map(|spans| spans[i]).filter(|span| !span.is_nan())
    }

    /// The weights of curve `i`, if the batch has any.
    pub fn weights(&self, i: usize) -> Option<&[f64]> {
        Some(&self.weights.as_ref()?[self.offsets[i]..self.offsets[i + 1]])
    }

    /// Whether point `k` of curve `i` is known. By default all are.
    pub fn is_known(&self, i: usize, k: usize) -> bool {
        self.constraints.known.as_ref().is_none_or(|known| known[self.offsets[i] + k])
    }

    /// Refuses constraints that a method does not support.
    ///
    /// Every method calls this first, so that no constraint is ignored, including kinds that a
    /// later version adds. `method` names its curves, in the plural.
    ///
    /// ```
    /// use faircurve::{Constraint, CurveBatch};
    /// let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0]][..]])?;
    /// batch.allows(&[Constraint::Tangents], "arcs")?;
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`], which lists the given kinds of constraints that are not in `known`.
    pub fn allows(&self, known: &[Constraint], method: &str) -> Result<()> {
        self.constraints.expect_only(known, method)
    }

    /// The constraints of the whole batch.
    pub fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    /// The tangent at point `k` of curve `i`, if there is one.
    pub fn tangent(&self, i: usize, k: usize) -> Option<&[f64]> {
        let start = (self.offsets[i] + k) * self.dimension;
        let tangent = &self.constraints.tangents.as_ref()?[start..start + self.dimension];
        (!tangent[0].is_nan()).then_some(tangent)
    }

    /// Whether curve `i` passes exactly through its point `k`, whatever the method.
    pub fn is_pinned(&self, i: usize, k: usize) -> bool {
        self.constraints.pinned.as_ref().is_some_and(|pinned| pinned[self.offsets[i] + k])
    }

    /// Whether the curves come from a file with polygons, which may share borders: see
    /// [`topology`](crate::topology).
    pub fn is_map(&self) -> bool {
        self.origin.is_map
    }

    /// Whether a part of the file was not [selected](crate::io::ReadOptions::selected).
    pub fn has_unselected(&self) -> bool {
        !self.origin.unselected.is_empty()
    }

    /// Whether x and y are longitudes and latitudes in degrees.
    pub fn is_geographic(&self) -> bool {
        self.origin.geographic
    }

    /// Metres in a unit of the coordinates, if the file says so: of SVG by its size, and of
    /// streamlines, which are in millimetres. `None` for longitudes and latitudes.
    pub fn metres(&self) -> Option<f64> {
        self.origin.metres
    }

    /// Notes about the batch's file, such as skipped elements.
    pub fn notes(&self) -> &[String] {
        &self.origin.notes
    }

    #[doc(hidden)]
    /// Whether the parameters are dates: seconds since 1970, UTC.
    pub fn has_dates(&self) -> bool {
        self.origin.clock.is_some()
    }

    /// The name of curve `i`, or its number counted from 0.
    pub fn name(&self, i: usize) -> Cow<'_, str> {
        self.origin.name(i)
    }

    #[doc(hidden)]
    /// The name of curve `i` for a message, cut to 80 characters.
    pub fn label(&self, i: usize) -> String {
        self.origin.label(i)
    }

    /// Why curve `i` cannot be fitted, if so.
    pub fn problem(&self, i: usize) -> Option<&Unfitted> {
        self.problems.get(&i)
    }

    /// The curves that cannot be fitted.
    pub(crate) fn problems(&self) -> &BTreeMap<usize, Unfitted> {
        &self.problems
    }

    /// A message about point `k` of curve `i`, which starts with the file, line, curve and point.
    pub fn sentence(&self, i: usize, k: usize, what: &str) -> String {
        let (mut origin, mut curve, mut k) = (&*self.origin, i, k);
        while let Some(cut) = &origin.cut {
            (curve, k) = cut.given(curve, k);
            origin = &cut.whole;
        }
        let place = origin.place(curve, k);
        format!("{place}curve {}, point {k}: {what}", origin.label(curve))
    }

    /// The listed curves in this order, with names and constraints, but without the document.
    pub fn select(&self, curves: &[usize]) -> Self {
        // Destructured by name, so that a new column cannot be forgotten.
        let CurveBatch {
            dimension,
            coords,
            offsets: _,
            closed,
            parameters,
            closing_spans,
            weights,
            constraints,
            columns,
            problems,
            origin: _,
        } = self;
        let offsets = ragged::offsets(curves.iter().map(|&i| self.count(i)));
        let points: Vec<usize> = curves.iter().flat_map(|&i| self.offsets[i]..self.offsets[i + 1]).collect();
        let names = curves.iter().map(|&i| self.name(i).into_owned()).collect();
        let problems = curves.iter().enumerate().filter_map(|(to, i)| Some((to, problems.get(i)?.clone())));
        let untimed = (0..curves.len()).filter(|&to| self.origin.untimed.contains(&curves[to])).collect();
        CurveBatch {
            dimension: *dimension,
            coords: Arc::new(rows_of(coords, *dimension, &points).into()),
            offsets,
            closed: curves.iter().map(|&i| closed[i]).collect(),
            parameters: parameters.as_ref().map(|t| rows_of(t.get(), 1, &points).into()),
            closing_spans: closing_spans.as_ref().map(|spans| curves.iter().map(|&i| spans[i]).collect()),
            weights: gather_rows(weights, 1, &points),
            constraints: constraints.gather(*dimension, &points),
            columns: columns::gather(columns, &points),
            problems: sort::map(problems),
            origin: Arc::new(Origin { names: Some(names), untimed, ..Origin::default() }),
        }
    }

    /// Replaces the points. Names, closedness, problems and the document are kept. Parameters,
    /// weights, constraints and columns are dropped.
    ///
    /// # Errors
    /// Offsets that do not match the points or the number of curves.
    pub fn replaced(&self, coords: Vec<f64>, offsets: Vec<usize>) -> Result<Self> {
        let other = Self::from_ragged(self.dimension, coords, offsets)?;
        expect_length("curves", other.len(), self.len(), "curve")?;
        Ok(self.with_points(Arc::unwrap_or_clone(other.coords).into_vec(), other.offsets))
    }

    /// Replaces the points by the same number of points of this dimension, and adds problems.
    ///
    /// There must be no constraints that are vectors if the dimension changes.
    pub(crate) fn moved(&self, dimension: usize, coords: Vec<f64>, problems: Vec<(usize, Unfitted)>) -> Self {
        debug_assert_eq!(coords.len(), dimension * self.total_points());
        let mut moved = CurveBatch { dimension, coords: Arc::new(coords.into()), ..self.clone() };
        moved.problems.extend(problems);
        moved
    }

    /// [`replaced`](Self::replaced) without checks.
    pub(crate) fn with_points(&self, coords: Vec<f64>, offsets: Vec<usize>) -> Self {
        debug_assert_eq!((offsets.len(), offsets[self.len()] * self.dimension), (self.offsets.len(), coords.len()));
        let bare = Self::bare(self.dimension, coords, offsets, self.closed.clone(), self.origin.clone());
        CurveBatch { problems: self.problems.clone(), ..bare }
    }
}

fn expect_length(what: &str, found: usize, wanted: usize, unit: &str) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    Err(Error::Batch(format!("{found} {what} for {wanted} {unit}s: give one per {unit}")))
}
