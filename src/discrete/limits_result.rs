//! [`LimitsResult`]: how well a curve satisfies its limits, for its report and message.

use super::curve_limits::CurveLimits;
use super::fair::Fair;
use super::limit_multipliers::{Limit, Worst};
use super::limits::{Broken, LimitKind, Obstacle, Region, seven_digits};
use super::setup::PreparedCurve;
use crate::batch::CurveBatch;
use crate::linalg::scalar::{add, scale};
use crate::report::{CurveReport, LimitReport};
use crate::status::CurveStatus;

/// −c of a limit that counts as violated.
const VIOLATED: f64 = 1e-6;

/// How well a curve satisfies its limits.
pub(super) struct LimitsResult {
    pub report: LimitReport,
    /// The data point at or before the most violated limit.
    point: usize,
    /// How the curve violates that limit, and which change of the options would help.
    broken: String,
    remedy: String,
    ending: Ending,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ending {
    Kept,
    /// Further rounds do not reduce the violation.
    GivenUp,
    /// Only loops satisfy the limits. The curve is the one without limits.
    Loops,
    /// The rounds were used up, or a round failed.
    Unsettled,
}

impl LimitsResult {
    /// The result for a curve at its base. `energies` are its own energy and the energy without
    /// limits.
    pub fn of<const D: usize>(
        fair: &Fair,
        batch: &CurveBatch,
        ready: &PreparedCurve<D>,
        limits: &CurveLimits<D>,
        i: usize,
        [energy, free]: [f64; 2],
        ending: Ending,
    ) -> LimitsResult {
        let problem = &ready.problem;
        let worst = problem.worst(limits).expect("it has limits");
        let points = batch.points(i).as_chunks::<D>().0;
        let chords: f64 = batch.chords(i).sum();
        let length = problem.length() * ready.size;
        let report = LimitReport {
            violation: worst.excess.max(0.0),
            active: problem.held(limits),
            cost: energy / free - 1.0,
            stretch: length / chords,
            neighbours: 0,
            touching: 0,
        };
        // A quantity of a single edge belongs to the edge before the vertex.
        let count = problem.base.len();
        let is_of_edge = |kind: usize| limits.quantities[kind].order() == 1;
        let row = match worst.limit {
            Limit::Quantity(kind) if is_of_edge(kind) => (worst.row + count - 1) % count,
            _ => worst.row,
        };
        let point = ready.rows[..points.len()].partition_point(|&own| own as usize <= row).saturating_sub(1);
        let (broken, remedy) = match ending {
            Ending::Kept => Default::default(),
            _ => {
                // What this curve breaks is feasible if all of it is allowed at once.
                let words = |worst: &Worst| words(fair, batch, ready, limits, worst, ending);
                let of_each = problem.worst_of_each(limits);
                let broken = of_each.iter().filter(|own| own.excess > VIOLATED.min(0.5 * worst.excess));
                (words(&worst).0, broken.map(|own| words(own).1).collect::<Vec<_>>().join(" and "))
            }
        };
        LimitsResult { report, point, broken, remedy, ending }
    }

    /// Whether the curve satisfies all limits.
    pub fn is_kept(&self) -> bool {
        self.ending == Ending::Kept
    }

    /// Writes the result into the report of a curve within a deviation.
    pub fn judge_within(&self, report: &mut CurveReport, batch: &CurveBatch, i: usize, allowed: f64) {
        // The report of a curve left as its spline has no gradient.
        let is_spline = report.status == CurveStatus::NotConverged && report.gradient_norm.is_nan();
        if self.ending != Ending::Kept || !is_spline || self.report.cost.is_nan() {
            // The curve may have left what the deviation allows, too.
            let farther = match report.max_deviation {
                own if own > allowed * (1.0 + VIOLATED) => format!(" and a deviation of {own:.6}"),
                _ => ", or a larger deviation".into(),
            };
            return self.judge_with(report, batch, i, &farther);
        }
        report.limits = Some(self.report);
        let what = format!(
            "no curve near keeps its limits and the deviation of {allowed} without loops: it is the spline that keeps the deviation; \
             allow a larger one, or wider limits"
        );
        (report.status, report.message) = (CurveStatus::Infeasible, Some(batch.sentence(i, self.point, &what)));
    }

    /// Writes the result into the report of the curve.
    pub fn judge(&self, report: &mut CurveReport, batch: &CurveBatch, i: usize) {
        self.judge_with(report, batch, i, ", or a deviation from the points");
    }

    /// The same, where `farther` is the remedy in terms of the deviation.
    fn judge_with(&self, report: &mut CurveReport, batch: &CurveBatch, i: usize, farther: &str) {
        report.limits = Some(self.report);
        let LimitsResult { broken, remedy, .. } = self;
        let is_open = matches!(report.status, CurveStatus::Converged | CurveStatus::NotConverged);
        let (status, what) = match self.ending {
            Ending::GivenUp if is_open => {
                (CurveStatus::Infeasible, format!("no curve near keeps its limits: {broken}; allow {remedy}{farther}"))
            }
            Ending::Loops if is_open => (
                CurveStatus::Infeasible,
                format!(
                    "loops alone were found to keep its limits, and it stays as it is without them: {broken}; allow \
                     {remedy}{farther}"
                ),
            ),
            Ending::Unsettled if report.status == CurveStatus::Converged => (
                CurveStatus::NotConverged,
                format!("the rounds did not end at a curve that keeps its limits: {broken}"),
            ),
            _ => return,
        };
        (report.status, report.message) = (status, Some(batch.sentence(i, self.point, &what)));
    }
}

/// How a curve violates its worst limit, and which change of the options would help.
fn words<const D: usize>(
    fair: &Fair,
    batch: &CurveBatch,
    ready: &PreparedCurve<D>,
    limits: &CurveLimits<D>,
    worst: &Worst,
    ending: Ending,
) -> (String, String) {
    match worst.limit {
        Limit::Quantity(kind) => {
            let [what, remedy] = (LimitKind::<D>::ALL[kind].words)(&Broken {
                limits: &fair.limits,
                dimension: D,
                in_surface: fair.surface.is_some(),
                quantity: worst.quantity,
                slope: limits.slopes[kind][worst.row],
                size: ready.size,
                is_least: ending == Ending::GivenUp,
            });
            (what, remedy)
        }
        Limit::Length => {
            let most = fair.limits.stretch.unwrap_or_default();
            let length = worst.quantity * ready.size;
            (
                format!("its length is {length:.6}, where {most} times that of its polygon is the largest"),
                "a longer curve".into(),
            )
        }
        Limit::Area => {
            let square = ready.size * ready.size;
            let [own, wanted] =
                [worst.quantity, limits.enclosed.map_or(f64::NAN, |enclosed| enclosed.area)].map(|area| area * square);
            (format!("its area is {own:.6}, where its points enclose {wanted:.6}"), "another area".into())
        }
        Limit::Region(k) => {
            let place = ready.problem.places[worst.row];
            let at = add(scale(ready.size, place), ready.vertices[0]);
            let at: Vec<String> = at.iter().map(|x| format!("{x:.6}")).collect();
            let at = at.join(", ");
            if let Some(neighbour) = limits.regions.as_ref().and_then(|regions| regions.neighbour(k)) {
                // Obstacles come after all curves.
                if let Some(Obstacle { name, .. }) =
                    neighbour.checked_sub(batch.len()).and_then(|k| fair.limits.obstacles.get(k))
                {
                    return (format!("it cannot pass obstacle {name}, near ({at})"), "a smaller one".into());
                }
                let label = batch.label(neighbour);
                return (format!("it leaves its side of curve {label} at ({at})"), "curves to cross".into());
            }
            match fair.limits.regions.get(k) {
                // c = ½(d²/R² − 1), for a vertex at the distance d.
                Some(region @ Region::Outside { radius, .. }) => {
                    let smaller = match ending {
                        Ending::GivenUp if worst.excess < 0.5 => {
                            format!("a radius of {:.6}", radius * (1.0 - 2.0 * worst.excess).sqrt())
                        }
                        _ => "a smaller one".into(),
                    };
                    (format!("it cuts {region}, near ({at})"), smaller)
                }
                Some(region) => {
                    let excess = seven_digits(region.excess(add(scale(ready.size, place), ready.vertices[0])));
                    (format!("it breaks {region} at ({at}), by {excess}"), "a larger one".into())
                }
                None => {
                    let gap = limits.regions.as_ref().and_then(|regions| regions.gap(worst.row, k, place));
                    let by = seven_digits(-gap.unwrap_or(f64::NAN) * ready.size);
                    let wider = match ending {
                        Ending::GivenUp => format!("a corridor that is wider by {by}"),
                        _ => "a wider corridor".into(),
                    };
                    (format!("it leaves its corridor at ({at}), by {by}"), wider)
                }
            }
        }
    }
}
