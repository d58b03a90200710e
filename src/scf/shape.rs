//! Smooth connection functions that keep the shape of their points: which do, and what the others become.
//!
//! Computed in f64 on the host, on every device: few curves need it.

mod mend;
mod room;

use mend::{Mended, Short, Sided};

use super::curves::{Chain, Piece};
use super::dots::{Dots, Exponents};
use super::slopes::{SlopesStanding, Until};
use super::smooth::Smooth;
use super::stages::{Found, search, search_on_cpu};
use super::start::{Start, wrap};
use super::workspace::Workspace;
use crate::batch::CurveBatch;
use crate::parallel;
use crate::report::{CurveReport, LimitReport};
use crate::sides::{self, Asked};
use crate::status::CurveStatus;

/// Jets a span by which curvature to the other side is measured.
const JETS: usize = 32;

/// How a curve keeps the shape of its points.
pub(super) struct Shaped {
    pub limits: LimitReport,
    /// What the search for its directions does not say: a status, a dot, and a sentence.
    pub said: Option<(CurveStatus, usize, String)>,
}

/// What was found of a curve, and how it keeps its shape.
pub(super) type Kept = (Found, Option<Chain>, Option<Shaped>);

impl Smooth {
    /// Mends the curves that break the shape of their points.
    pub(super) fn keep_shapes(
        &self,
        dots: &[&Dots],
        exponents: &Exponents,
        found: Vec<(Found, Option<Chain>)>,
        is_gpu: bool,
    ) -> Vec<Kept> {
        parallel::of(found.into_iter().zip(dots), |((found, chain), dots)| {
            self.shaped(dots, exponents, found, chain, is_gpu)
        })
    }

    fn shaped(&self, dots: &Dots, exponents: &Exponents, found: Found, chain: Option<Chain>, is_gpu: bool) -> Kept {
        let asked = sides::of_spans(&dots.points, dots.closed);
        let limits = |chain: &Chain, violation: f64, active: usize, cost: f64| LimitReport {
            violation,
            active,
            cost,
            stretch: chain.stretch(dots),
            neighbours: 0,
            touching: 0,
        };
        if chain.as_ref().is_some_and(|chain| chain.keeps(&asked, exponents)) {
            let shaped = chain.as_ref().map(|chain| Shaped { limits: limits(chain, 0.0, 0, 0.0), said: None });
            return (found, chain, shaped);
        }
        let until = Until { tolerance: self.tolerance, iterations: self.max_iterations };
        // Found here again, so that the result is the same bits whatever device found the curve.
        let (found, chain) =
            if is_gpu { self.found_here(dots, exponents, &until, found, chain) } else { (found, chain) };
        let is_minimum = found.standing == SlopesStanding::Converged;
        let mended = dots.along_lines(&asked).and_then(|lined| {
            let mended = match &lined {
                None => self.mended(dots, exponents, &asked, &found),
                Some(lined) => {
                    let (found, _) = self.found_here(lined, exponents, &until, found.clone(), None);
                    self.mended(lined, exponents, &asked, &found)
                }
            };
            mended.map_err(|short| infeasible(dots, &asked, short))
        });
        let said = match mended {
            // Where there is no minimum without sides, what is reached with them says no more.
            Ok((mended, ..)) if !is_minimum && mended.standing != SlopesStanding::Converged => None,
            Ok((mended, (kept, held), said)) => {
                let cost = if is_minimum { mended.cost / found.cost - 1.0 } else { f64::NAN };
                let shaped = Shaped { limits: limits(&kept, 0.0, held, cost), said };
                return (mended, Some(kept), Some(shaped));
            }
            Err((dot, what)) => Some((CurveStatus::Infeasible, dot, what)),
        };
        let shaped = chain.as_ref().map(|chain| {
            let violation = chain.violation(&asked, dots, exponents);
            Shaped { limits: limits(chain, violation, 0, if is_minimum { 0.0 } else { f64::NAN }), said }
        });
        (found, chain, shaped)
    }

    /// What the CPU finds of a curve.
    fn found_here(
        &self,
        dots: &Dots,
        exponents: &Exponents,
        until: &Until,
        found: Found,
        chain: Option<Chain>,
    ) -> (Found, Option<Chain>) {
        let mut workspace = Workspace::new(exponents.universal.len());
        let again = search(&self.where_to_start(), &[dots], exponents, &mut |dots, exponents, directions| {
            Ok(search_on_cpu(dots, exponents, directions, until, &mut workspace))
        });
        let Some(again) = again.ok().and_then(|mut again| again.pop()) else { return (found, chain) };
        let chain = again.directions.as_ref().and_then(|directions| dots.lay(directions, exponents, &[]));
        (Found { on_cpu: true, ..again }, chain)
    }

    /// The curve that keeps its shape, laid, with the dots that a side holds, and what there is to say of it.
    ///
    /// # Errors
    /// The end of a span whose side none has that was found.
    #[allow(clippy::type_complexity)]
    fn mended(
        &self,
        dots: &Dots,
        exponents: &Exponents,
        asked: &[Asked],
        found: &Found,
    ) -> Result<(Found, (Chain, usize), Option<(CurveStatus, usize, String)>), Short> {
        let sizes: Vec<f64> = (0..asked.len()).map(|k| dots.size_of_turns(k)).collect();
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
            let left = self.max_iterations.saturating_sub(found.iterations);
            let Some(mended) = sided.least(inside, left) else { continue };
            let held = mended.held;
            let mended = found_of(mended, from, scale, found);
            let chain = mended.directions.as_ref().and_then(|directions| dots.lay(directions, exponents, &[]));
            let Some(chain) = chain.filter(|chain| chain.keeps(asked, exponents)) else { continue };
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
            return Ok((mended, (chain, held), said));
        }
        Err(short.unwrap_or(Short { span: 0, end: 0 }))
    }
}

/// What was found, from the directions that the turns are those from.
fn found_of(mended: Mended, mut directions: Vec<f64>, scale: f64, free: &Found) -> Found {
    directions.iter_mut().zip(&mended.turns).for_each(|(direction, turn)| *direction += turn);
    Found {
        directions: Some(directions),
        cost: mended.cost * scale.exp(),
        decrement: mended.decrement,
        standing: mended.standing,
        iterations: free.iterations + mended.iterations,
        evaluations: free.evaluations + mended.evaluations,
        culprit: mended.culprit,
        known: Vec::new(),
        on_cpu: true,
    }
}

/// At which dot no curve is found that has its side, and why.
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

impl CurveReport {
    /// The same with how the curve keeps its shape.
    pub(super) fn shaped(mut self, shaped: Option<Shaped>, batch: &CurveBatch, i: usize, dots: &Dots) -> Self {
        let Some(Shaped { limits, said }) = shaped else { return self };
        self.limits = Some(limits);
        if let Some((status, dot, what)) = said {
            (self.status, self.message) = (status, Some(batch.sentence(i, dots.entries[dot], &what)));
        }
        self
    }
}

impl Dots {
    /// The same with the directions of lines of points for tangents; `None` where there is no line.
    ///
    /// # Errors
    /// The dot at which no direction is that of every line, and a sentence.
    fn along_lines(&self, asked: &[Asked]) -> Result<Option<Self>, (usize, String)> {
        if !asked.iter().any(|asked| asked.straight) {
            return Ok(None);
        }
        let mut lined = self.clone();
        for (span, _) in asked.iter().enumerate().filter(|(_, asked)| asked.straight) {
            let direction = self.chords.directions[span];
            for dot in [span, (span + 1) % self.points.len()] {
                let fixed = &mut lined.fixed[dot];
                if fixed.is_finite() && wrap(*fixed - direction).abs() > sides::STRAIGHT {
                    let what = match self.fixed[dot].is_finite() {
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

    /// The smaller turn of the polygon at the ends of a span, where there is one; 1 where there is none.
    fn size_of_turns(&self, span: usize) -> f64 {
        let (chords, n) = (&self.chords.directions, self.points.len());
        let turn = |dot: usize| {
            let before = if self.closed { (dot + n - 1) % n } else { dot.checked_sub(1)? };
            let [before, after] = [chords.get(before)?, chords.get(dot)?];
            Some(wrap(after - before).abs()).filter(|turn| *turn > sides::STRAIGHT)
        };
        [span, (span + 1) % n].into_iter().filter_map(turn).reduce(f64::min).unwrap_or(1.0)
    }
}

impl Chain {
    /// Whether all spans have the sides asked for at their ends, which have all there are: with one inflection at most,
    /// ends that agree leave none.
    fn keeps(&self, asked: &[Asked], exponents: &Exponents) -> bool {
        let arcs = self.segments.iter().filter_map(|laid| match &laid.arc {
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

    /// The largest curvature to another side than asked for, in units of 1 over the mean chord.
    fn violation(&self, asked: &[Asked], dots: &Dots, exponents: &Exponents) -> f64 {
        let mean = dots.chords.lengths.iter().sum::<f64>() / dots.chords.lengths.len() as f64;
        let mut worst = 0.0f64;
        let spans = self.segments.iter().filter(|laid| laid.chord != [0.0; 2]);
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

    /// The length over that of the polygon.
    fn stretch(&self, dots: &Dots) -> f64 {
        self.knots[self.knots.len() - 1] / dots.chords.lengths.iter().sum::<f64>()
    }
}
