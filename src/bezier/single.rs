//! [`Complete`]: every curve of a batch is the control polygon of one Bézier curve.

use super::complete::complete;
use super::completed::Completed;
use super::curves::Chains;
use super::energy::Energy;
use super::polygons::{Given, Polygons};
use crate::batch::CurveBatch;
use crate::constraint::Constraint;
use crate::device::Device;
use crate::error::Result;
use crate::report::CurveReport;
use crate::status::CurveStatus;
use crate::words::words;

/// What the tangents of a batch (columns `tx ty tz`) say of the ends of a Bézier curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum EndTangents {
    /// The derivatives X′(0) and X′(1), in units of length: d (P₁ − P₀) and d (P_d − P_{d−1}).
    #[default]
    Derivatives,
    /// Directions only. The speeds |X′| are those of least energy.
    Directions,
}

words!(EndTangents, "meaning of end tangents": [
    (Derivatives, "derivatives", "They are the curve's first derivatives"),
    (Directions, "directions", "Only their directions are, and their lengths are free"),
]);

/// Completes Bézier curves, each curve of the batch one control polygon.
///
/// The degree of a curve is one less than its number of points. The unknown points
/// ([`Constraints::known`](crate::Constraints)) are those of least energy. If the batch does not
/// say which are known, all are.
///
/// Tangents at the first and the last point are kept. A closed curve returns to its first point,
/// which must be known. Parameters and weights mean nothing here.
///
/// Fewer known points (and derivatives) than the order of the energy leave a curve undetermined.
/// Then the unknown points are those of least Σ|Pᵢ|², and the curve is `not_unique`.
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
    /// The energy that is made least. ∫|X″|² dt by default.
    pub energy: Energy,
    /// What tangents say. Derivatives by default.
    pub tangents: EndTangents,
}

impl Complete {
    /// Completes a batch. Each curve has a status. A curve that cannot be completed stays as it is.
    ///
    /// # Errors
    /// - An energy that weighs nothing.
    /// - Exponents or curvature vectors in the batch. They have no meaning here.
    /// - On a GPU the errors of submissions.
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
        let mut reports = Vec::with_capacity(batch.len());
        let mut coords = Vec::with_capacity(batch.coords().len());
        for i in 0..batch.len() {
            let refusal = refusals.next_if(|&&(refused, _)| refused == i);
            let trouble = own.troubles[i].clone().or_else(|| {
                let (_, refusal) = refusal?;
                let (point, what) = refusal.sentence(batch.count(i));
                Some((refusal.status(), batch.sentence(i, point, &what)))
            });
            match trouble {
                Some((status, message)) => {
                    reports.push(CurveReport::unfitted(status, message));
                    coords.extend_from_slice(batch.points(i));
                }
                None => {
                    let status = solved.statuses[i];
                    reports.push(CurveReport { status, ..CurveReport::solved(solved.energies[i]) });
                    let start = own.offsets[i] * batch.dimension();
                    coords.extend_from_slice(&solved.coords[start..start + batch.points(i).len()]);
                }
            }
        }
        let degrees = (0..batch.len())
            .map(|i| reports[i].status.is_usable().then(|| own.offsets[i + 1] - own.offsets[i] - 1))
            .collect();
        let control = batch.with_points(coords, batch.offsets().to_vec());
        device.finished(batch.len());
        let chains = Chains::new(control, degrees, None, &reports);
        Ok(Completed { chains, reports, device: device.report(true)? })
    }
}

/// Refuses the constraints that Béziers do not know.
pub(super) fn check_constraints(batch: &CurveBatch) -> Result<()> {
    batch.allows(&[Constraint::Tangents, Constraint::Known], "Bézier curves")
}

/// The batch as polygons.
///
/// Closed curves have their first point repeated. Curves with a problem have no points.
struct AsPolygons {
    coords: Vec<f64>,
    offsets: Vec<usize>,
    known: Vec<bool>,
    /// Tangents at the start and at the end, one a curve, NaN where there is none.
    tangents: [Option<Vec<f64>>; 2],
    troubles: Vec<Option<(CurveStatus, String)>>,
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
            troubles: Vec::with_capacity(batch.len()),
        };
        for i in 0..batch.len() {
            let trouble = trouble(batch, i);
            if trouble.is_none() {
                own.coords.extend_from_slice(batch.points(i));
                let (from, count) = (batch.offsets()[i], batch.count(i));
                let known = batch.constraints().known.as_ref();
                own.known.extend((from..from + count).map(|k| known.is_none_or(|known| known[k])));
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
            own.troubles.push(trouble);
            own.offsets.push(own.known.len());
        }
        own
    }
}

/// Why a curve cannot be tried at all.
fn trouble(batch: &CurveBatch, i: usize) -> Option<(CurveStatus, String)> {
    if let Some(problem) = batch.problem(i) {
        return Some((problem.status, problem.message.clone()));
    }
    let count = batch.count(i);
    let known = |k: usize| batch.constraints().known.as_ref().is_none_or(|known| known[batch.offsets()[i] + k]);
    if batch.is_closed(i) && count > 0 && !known(0) {
        let what = "a closed curve returns to its first control point, which must be known: mark it as known, or open the curve";
        return Some((CurveStatus::Invalid, batch.sentence(i, 0, what)));
    }
    let inner = if batch.is_closed(i) { 1..count } else { 1..count.saturating_sub(1) };
    let point = inner.into_iter().find(|&k| batch.tangent(i, k).is_some())?;
    let what =
        "it has a tangent, but only the ends of a Bézier curve may have one: leave it out, or divide the curve there";
    Some((CurveStatus::Invalid, batch.sentence(i, point, what)))
}
