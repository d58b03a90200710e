//! [`Complete`]: every curve of a batch is the control polygon of one Bézier curve.

use super::complete::complete;
use super::completed::{Assembly, Completed};
use super::energy::Energy;
use super::polygons::{Given, Polygons};
use crate::batch::{CurveBatch, Unfitted};
use crate::constraint::Constraint;
use crate::device::Device;
use crate::error::Result;
use crate::report::CurveReport;
use crate::status::CurveStatus;
use crate::words::words;

/// The meaning of a batch's tangents (columns `tx ty tz`) at the ends of a Bézier curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EndTangents {
    /// The derivatives X′(0) and X′(1), in units of length: d (P₁ − P₀) and d (P_d − P_{d−1}).
    #[default]
    Derivatives,
    /// Directions only. The speeds |X′| minimise the energy.
    Directions,
}

words!(EndTangents, "meaning of end tangents": [
    (Derivatives, "derivatives", "They are the curve's first derivatives"),
    (Directions, "directions", "Only their directions are, and their lengths are free"),
]);

/// Completes Bézier curves, each curve of the batch one control polygon.
///
/// The degree of a curve is one less than its number of points. Unknown points
/// ([`Constraints::known`](crate::Constraints)) minimise the energy. By default all are known.
///
/// Tangents at the first and the last point are kept. A closed curve returns to its first point,
/// which must be known. Parameters and weights are ignored.
///
/// With fewer known points and derivatives than the order of the energy, the curve is `not_unique`:
/// the unknown points are the minimisers with the least Σ|Pᵢ|².
///
/// ```
/// use faircurve::{Constraints, CurveBatch, Device, bezier::Complete};
///
/// let points = [[0.0, 0.0], [1.0, 2.0], [f64::NAN; 2], [3.0, 0.0]];
/// let known = Constraints { known: Some(vec![true, true, false, true]), ..Constraints::default() };
/// let batch = CurveBatch::from_slices(&[&points[..]])?.with_constraints(known)?;
/// let completed = Complete::default().fit(&batch, &Device::cpu())?;
/// assert_eq!(completed.control_points().points(0)[4..6], [2.0, 1.0]);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complete {
    /// The energy to minimise. ∫|X″|² dt by default.
    pub energy: Energy,
    /// The meaning of tangents. Derivatives by default.
    pub tangents: EndTangents,
}

impl Complete {
    /// Completes a batch. A curve that cannot be completed keeps its control points.
    ///
    /// # Errors
    /// - An energy without a positive weight.
    /// - Constraints other than tangents and known points.
    /// - On a GPU, errors of submissions.
    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Completed> {
        check_constraints(batch)?;
        let own = AsPolygons::of(batch);
        let polygons = Polygons { dimension: batch.dimension(), coords: &own.coords, offsets: &own.offsets };
        let [first, last] = &own.tangents;
        let given = Given {
            known: Some(&own.known),
            derivatives: [[first.as_deref(), None, None], [last.as_deref(), None, None]],
            directions: self.tangents == EndTangents::Directions,
        };
        let solved = complete(&polygons, &given, &self.energy, device)?;
        let mut refusals = solved.refusals.iter().peekable();
        let mut assembly = Assembly::new(batch);
        for i in 0..batch.len() {
            let refused = refusals.next_if(|&&(refused, _)| refused == i).map(|(_, refusal)| {
                let (point, what) = refusal.sentence(batch.count(i));
                Unfitted { status: refusal.status(), message: batch.sentence(i, point, &what) }
            });
            if let Some(problem) = own.problems[i].clone().or(refused) {
                assembly.push_unfitted(problem);
                continue;
            }
            let start = own.offsets[i] * batch.dimension();
            let coords = &solved.coords[start..start + batch.points(i).len()];
            let report = CurveReport { status: solved.statuses[i], ..CurveReport::solved(solved.energies[i]) };
            assembly.push(coords, own.offsets[i + 1] - own.offsets[i] - 1, Vec::new(), report);
        }
        device.finished(batch.len());
        Ok(assembly.finish(device.report(true)?))
    }
}

/// Refuses constraints other than tangents and known points.
pub(super) fn check_constraints(batch: &CurveBatch) -> Result<()> {
    batch.allows(&[Constraint::Tangents, Constraint::Known], "Bézier curves")
}

/// The batch as polygons.
///
/// Closed curves repeat their first point. Curves with a problem have no points.
struct AsPolygons {
    coords: Vec<f64>,
    offsets: Vec<usize>,
    known: Vec<bool>,
    /// Tangents at the start and at the end, one per curve. NaN stands for none.
    tangents: [Option<Vec<f64>>; 2],
    problems: Vec<Option<Unfitted>>,
}

impl AsPolygons {
    fn of(batch: &CurveBatch) -> Self {
        let d = batch.dimension();
        let column = || batch.constraints().tangents.as_ref().map(|_| vec![f64::NAN; batch.len() * d]);
        let mut own = AsPolygons {
            coords: Vec::with_capacity(batch.coords().len()),
            offsets: vec![0],
            known: Vec::with_capacity(batch.total_points()),
            tangents: [column(), column()],
            problems: Vec::with_capacity(batch.len()),
        };
        for i in 0..batch.len() {
            let problem = problem(batch, i);
            if problem.is_none() {
                own.coords.extend_from_slice(batch.points(i));
                let count = batch.count(i);
                own.known.extend((0..count).map(|k| batch.is_known(i, k)));
                if batch.is_closed(i) && count > 0 {
                    own.coords.extend_from_slice(&batch.points(i)[..d]);
                    own.known.push(true);
                }
                let last = if batch.is_closed(i) { None } else { count.checked_sub(1) };
                for (column, point) in own.tangents.iter_mut().zip([(count > 0).then_some(0), last]) {
                    if let (Some(column), Some(tangent)) = (column, point.and_then(|k| batch.tangent(i, k))) {
                        column[i * d..(i + 1) * d].copy_from_slice(tangent);
                    }
                }
            }
            own.problems.push(problem);
            own.offsets.push(own.known.len());
        }
        own
    }
}

/// Why a curve cannot be completed, whatever its values.
fn problem(batch: &CurveBatch, i: usize) -> Option<Unfitted> {
    if let Some(problem) = batch.problem(i) {
        return Some(problem.clone());
    }
    let count = batch.count(i);
    let invalid = |point: usize, what: &str| {
        Some(Unfitted { status: CurveStatus::Invalid, message: batch.sentence(i, point, what) })
    };
    if batch.is_closed(i) && count > 0 && !batch.is_known(i, 0) {
        let what = "a closed curve returns to its first control point, which must be known: mark it as known, or open the curve";
        return invalid(0, what);
    }
    let inner = if batch.is_closed(i) { 1..count } else { 1..count.saturating_sub(1) };
    let point = inner.into_iter().find(|&k| batch.tangent(i, k).is_some())?;
    let what =
        "it has a tangent, but only the ends of a Bézier curve may have one: leave it out, or divide the curve there";
    invalid(point, what)
}
