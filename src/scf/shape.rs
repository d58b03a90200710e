//! Smooth connection functions that keep the shape of their points: checks the curves, and refits
//! those that do not.
//!
//! Computed in f64 on the host, on every device, because few curves need it.

mod mend;
mod room;

use mend::{Short, Sided};

use super::curves::{Chain, Piece};
use super::dots::{Dots, Exponents};
use super::problem::{SlopesStanding, Until};
use super::stages::{Found, Starts, search, search_on_cpu};
use super::start::{Start, wrap};
use super::workspace::Workspace;
use crate::batch::CurveBatch;
use crate::parallel;
use crate::report::{CurveReport, LimitReport};
use crate::sides::{self, Asked};
use crate::status::CurveStatus;

/// The jets per span at which curvature of the wrong sign is measured.
const JETS: usize = 32;

/// How well a curve keeps the shape of its points.
pub(super) struct Shaped {
    limits: LimitReport,
    /// The message about the shape, if any.
    said: Option<Said>,
}

/// The result for a curve, with its shape report.
pub(super) type Kept = (Found, Option<Chain>, Option<Shaped>);

/// A refitted curve.
struct Mended {
    found: Found,
    chain: Chain,
    /// The number of span ends at which the constraint is active.
    held: usize,
    said: Option<Said>,
}

/// A status, the dot that it concerns, and a sentence.
type Said = (CurveStatus, usize, String);

/// Refits curves that violate the shape of their points.
pub(super) struct ShapeSearch<'a> {
    pub starts: Starts,
    pub until: Until,
    pub exponents: &'a Exponents,
    /// Whether a GPU found the curves.
    pub is_gpu: bool,
}

impl ShapeSearch<'_> {
    /// Refits the curves that violate the shape of their points.
    pub fn mend_all(&self, dots: &[&Dots], found: Vec<(Found, Option<Chain>)>) -> Vec<Kept> {
        parallel::of(found.into_iter().zip(dots), |((found, chain), dots)| self.shaped(dots, found, chain))
    }

    fn shaped(&self, dots: &Dots, found: Found, chain: Option<Chain>) -> Kept {
        let exponents = self.exponents;
        let asked = sides::of_spans(&dots.points, dots.closed);
        let limits = |chain: &Chain, violation: f64, active: usize, cost: f64| LimitReport {
            violation,
            active,
            cost,
            stretch: stretch(chain, dots),
            neighbours: 0,
            touching: 0,
        };
        if chain.as_ref().is_some_and(|chain| keeps(chain, &asked, exponents)) {
            let shaped = chain.as_ref().map(|chain| Shaped { limits: limits(chain, 0.0, 0, 0.0), said: None });
            return (found, chain, shaped);
        }
        // The CPU repeats the search, so that the result has the same bits on every device.
        let (found, chain) = if self.is_gpu { self.found_here(dots, found, chain) } else { (found, chain) };
        let is_minimum = found.standing == SlopesStanding::Converged;
        let mended = along_lines(dots, &asked).and_then(|lined| {
            let mended = match &lined {
                None => self.mended(dots, &asked, &found),
                Some(lined) => {
                    let (found, _) = self.found_here(lined, found.clone(), None);
                    self.mended(lined, &asked, &found)
                }
            };
            mended.map_err(|short| infeasible(dots, &asked, short))
        });
        let said = match mended {
            // Without a minimum for the unconstrained curve, the result with constraints gives no
            // more information.
            Ok(mended) if !is_minimum && mended.found.standing != SlopesStanding::Converged => None,
            Ok(Mended { found: mended, chain, held, said }) => {
                let cost = if is_minimum { mended.cost / found.cost - 1.0 } else { f64::NAN };
                let shaped = Shaped { limits: limits(&chain, 0.0, held, cost), said };
                return (mended, Some(chain), Some(shaped));
            }
            Err((dot, what)) => Some((CurveStatus::Infeasible, dot, what)),
        };
        let shaped = chain.as_ref().map(|chain| {
            let violation = violation(chain, &asked, dots, exponents);
            Shaped { limits: limits(chain, violation, 0, if is_minimum { 0.0 } else { f64::NAN }), said }
        });
        (found, chain, shaped)
    }

    /// The CPU's result for a curve.
    fn found_here(&self, dots: &Dots, found: Found, chain: Option<Chain>) -> (Found, Option<Chain>) {
        let exponents = self.exponents;
        let mut workspace = Workspace::new(exponents.universal.len());
        let again = search(&self.starts, &[dots], exponents, &mut |dots, exponents, directions| {
            Ok(search_on_cpu(dots, exponents, directions, &self.until, &mut workspace))
        });
        let Some(again) = again.ok().and_then(|mut again| again.pop()) else { return (found, chain) };
        let chain = again.directions.as_ref().and_then(|directions| Chain::lay(dots, directions, exponents, &[]));
        (Found { on_cpu: true, ..again }, chain)
    }

    /// The least-energy curve that keeps its shape.
    ///
    /// # Errors
    /// The end of a span that does not turn to its side in any curve found.
    fn mended(&self, dots: &Dots, asked: &[Asked], found: &Found) -> Result<Mended, Short> {
        let exponents = self.exponents;
        let sizes: Vec<f64> = (0..asked.len()).map(|k| size_of_turns(dots, k)).collect();
        let free = found.directions.clone().filter(|_| found.standing == SlopesStanding::Converged);
        let others = [Start::Circle, Start::Bisector].map(|start| dots.directions(start));
        let mut short = None;
        for from in free.into_iter().chain(others) {
            let (problem, scale) = dots.problem(&from, exponents);
            let sided = Sided { problem: &problem, curves: &exponents.universal, asked, sizes: &sizes };
            let inside = match sided.inside() {
                Ok(inside) => inside,
                Err(lacks) => {
                    short.get_or_insert(lacks);
                    continue;
                }
            };
            let left = self.until.iterations.saturating_sub(found.iterations);
            let Some(mended) = sided.least(inside, left) else { continue };
            let held = mended.held;
            let mended = Found {
                iterations: found.iterations + mended.outcome.iterations,
                evaluations: found.evaluations + mended.outcome.evaluations,
                on_cpu: true,
                ..Found::of(mended.outcome, scale, from)
            };
            let chain = mended.directions.as_ref().and_then(|directions| Chain::lay(dots, directions, exponents, &[]));
            let Some(chain) = chain.filter(|chain| keeps(chain, asked, exponents)) else { continue };
            let after = format!("after {} iterations", mended.iterations);
            let said = match mended.standing {
                SlopesStanding::Unattained => {
                    let what = format!(
                        "{after} cheaper curves that keep their shape have a segment without minimiser, that from this point to the \
                         next, which turns too far: the curve is the best one reached; add points where it turns, fix a tangent, or \
                         choose an exponent nearer to 1"
                    );
                    Some((CurveStatus::NoMinimiser, mended.culprit.unwrap_or(0), what))
                }
                SlopesStanding::Stalled => {
                    let what = format!(
                        "{after} no step leads further down: it keeps its shape, and may bend more than it needs to; remove points \
                         that almost coincide, or choose an exponent nearer to 1"
                    );
                    Some((CurveStatus::NotConverged, 0, what))
                }
                _ => None,
            };
            return Ok(Mended { found: mended, chain, held, said });
        }
        Err(short.unwrap_or(Short { span: 0, end: 0 }))
    }
}

/// The dot whose side no curve keeps, and the message.
fn infeasible(dots: &Dots, asked: &[Asked], short: Short) -> (usize, String) {
    let Short { span, end } = short;
    let side = if asked[span].ends[end] > 0.0 { "left" } else { "right" };
    let way = ["from here to the next point", "from the point before to here"][end];
    let dot = (span + end) % dots.points.len();
    let given = [span, (span + 1) % dots.points.len()].into_iter().any(|dot| dots.fixed[dot].is_finite());
    let remedy = if given { "turn the tangent, or leave it out" } else { "add points where it turns most" };
    let what = format!(
        "no curve is found that keeps its shape: {way} it has to turn {side} here, and the turns at the points beside leave no \
         directions for that; {remedy}, choose an exponent nearer to 1, or choose `discrete::Fair`"
    );
    (dot, what)
}

/// Adds the shape result to a report.
pub(super) fn with_shape(
    mut report: CurveReport,
    shaped: Option<Shaped>,
    batch: &CurveBatch,
    i: usize,
    dots: &Dots,
) -> CurveReport {
    let Some(Shaped { limits, said }) = shaped else { return report };
    report.limits = Some(limits);
    if let Some((status, dot, what)) = said {
        (report.status, report.message) = (status, Some(batch.sentence(i, dots.entries[dot], &what)));
    }
    report
}

/// The dots with the directions of collinear points as tangents. `None` if there are no collinear
/// points.
///
/// # Errors
/// A dot at which no direction keeps all lines, and a message.
fn along_lines(dots: &Dots, asked: &[Asked]) -> Result<Option<Dots>, (usize, String)> {
    if !asked.iter().any(|asked| asked.straight) {
        return Ok(None);
    }
    let mut lined = dots.clone();
    for (span, _) in asked.iter().enumerate().filter(|(_, asked)| asked.straight) {
        let direction = dots.chords.directions[span];
        for dot in [span, (span + 1) % dots.points.len()] {
            let fixed = &mut lined.fixed[dot];
            if fixed.is_finite() && wrap(*fixed - direction).abs() > sides::STRAIGHT {
                let what = match dots.fixed[dot].is_finite() {
                    true => {
                        "no curve with its tangent keeps its shape: the points lie in a line here, and the tangent leads off it; turn \
                         the tangent along the line, or leave it out"
                    }
                    false => {
                        "no smooth curve keeps its shape: two lines of points meet here at an angle; leave out a point of one of \
                         them, or choose `spline::Natural`, which has a corner there"
                    }
                };
                return Err((dot, what.into()));
            }
            *fixed = direction;
        }
    }
    Ok(Some(lined))
}

/// The smaller turn of the polygon at the ends of a span; 1 if there is no turn.
fn size_of_turns(dots: &Dots, span: usize) -> f64 {
    let (chords, n) = (&dots.chords.directions, dots.points.len());
    let turn = |dot: usize| {
        let before = if dots.closed { (dot + n - 1) % n } else { dot.checked_sub(1)? };
        let [before, after] = [chords.get(before)?, chords.get(dot)?];
        Some(wrap(after - before).abs()).filter(|turn| *turn > sides::STRAIGHT)
    };
    [span, (span + 1) % n].into_iter().filter_map(turn).reduce(f64::min).unwrap_or(1.0)
}

/// Whether all spans have the required sign of curvature at both ends. This suffices: a segment has
/// at most one inflection, so ends of equal sign leave none.
fn keeps(chain: &Chain, asked: &[Asked], exponents: &Exponents) -> bool {
    let arcs = chain.segments.iter().filter_map(|laid| match &laid.arc {
        Piece::Arc(arc) if arc.chord > 0.0 => {
            Some((arc.chord, arc.curvatures(&exponents.universal[laid.curve as usize])))
        }
        _ => None,
    });
    let keeps = |((chord, curvatures), asked): ((f64, [f64; 2]), &Asked)| {
        let is_flat = |curvature: &f64| !asked.straight || (curvature * chord).abs() <= sides::STRAIGHT;
        curvatures.iter().zip(asked.ends).all(|(curvature, side)| side * curvature >= 0.0 && is_flat(curvature))
    };
    arcs.zip(asked).all(keeps)
}

/// The largest curvature of the wrong sign, in units of 1 over the mean chord.
fn violation(chain: &Chain, asked: &[Asked], dots: &Dots, exponents: &Exponents) -> f64 {
    let mean = dots.chords.lengths.iter().sum::<f64>() / dots.chords.lengths.len() as f64;
    let mut worst = 0.0f64;
    let spans = chain.segments.iter().filter(|laid| laid.chord != [0.0; 2]);
    for (laid, asked) in spans.zip(asked) {
        for number in 0..=JETS {
            let side = match number {
                0 => asked.ends[0],
                JETS => asked.ends[1],
                _ => asked.within,
            };
            let jet = laid.jet(&exponents.universal, number as f64 / JETS as f64);
            let curvature = jet.first.cross(jet.second).z;
            worst = worst.max(if asked.straight { curvature.abs() } else { -side * curvature } * mean);
        }
    }
    worst
}

/// The length of a curve divided by the length of its polygon.
fn stretch(chain: &Chain, dots: &Dots) -> f64 {
    chain.knots[chain.knots.len() - 1] / dots.chords.lengths.iter().sum::<f64>()
}
