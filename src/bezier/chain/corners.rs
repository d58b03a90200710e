//! Corners of chains: chains are cut where their handles turn sharply.
//!
//! The parts are completed as separate chains and joined again.

use std::ops::Range;

use super::super::completed::{Assembly, Completed};
use super::super::curves::Chains;
use crate::batch::{CurveBatch, Piece, Unfitted};
use crate::constraint::Constraints;
use crate::curve::handles::turn;
use crate::curve::vector;
use crate::error::Result;
use crate::report::CurveReport;
use glam::DVec3;

/// A batch of chains cut at their corners.
pub(super) struct Corners {
    /// The parts, in the order of the curves.
    pub batch: CurveBatch,
    parts: Vec<Piece>,
}

impl Corners {
    /// Cuts chains at the joints where their control polygon turns by more than `angle` (radians).
    /// Corners become known.
    pub fn cut(batch: &CurveBatch, degree: usize, angle: f64) -> Result<Self> {
        let (mut parts, mut known) = (Vec::new(), batch.constraints().known.clone());
        for curve in 0..batch.len() {
            let (count, closed) = (batch.count(curve), batch.is_closed(curve));
            let corners = corners(batch, curve, degree, angle);
            let whole = Piece { curve, first: 0, count, closed };
            let Some(&first) = corners.first() else {
                parts.push(whole);
                continue;
            };
            if let Some(known) = &mut known {
                for corner in &corners {
                    known[batch.offsets()[curve] + corner] = true;
                }
            }
            let mut ends = corners;
            match closed {
                true => ends.push(first + count),
                false => ends = [vec![0], ends, vec![count - 1]].concat(),
            }
            let part = |ends: &[usize]| Piece { first: ends[0], count: ends[1] - ends[0] + 1, closed: false, ..whole };
            parts.extend(ends.windows(2).map(part));
        }
        let batch = batch.clone().with_constraints(Constraints { known, ..batch.constraints().clone() })?;
        Ok(Corners { batch: batch.cut(parts.clone()), parts })
    }

    /// Joins the completed parts. A chain keeps its control points if one of its parts is not
    /// completed.
    pub fn join(&self, batch: &CurveBatch, completed: Completed) -> Completed {
        let Completed { chains, reports, device } = completed;
        let (mut assembly, mut next) = (Assembly::new(batch), 0);
        for pieces in self.parts.chunk_by(|a, b| a.curve == b.curve) {
            let (i, parts) = (pieces[0].curve, next..next + pieces.len());
            next = parts.end;
            let report = CurveReport::joined(reports[parts.clone()].to_vec());
            if parts.clone().all(|k| chains.degrees[k].is_some()) {
                let degree = chains.degrees[parts.start].expect("all parts have one");
                let (coords, knots) = joined_chain(&chains, parts, pieces[0].first, batch.is_closed(i), degree);
                assembly.push(&coords, degree, knots, report);
            } else {
                let message = report.message.unwrap_or_default();
                assembly.push_unfitted(Unfitted { status: report.status, message });
            }
        }
        assembly.finish(device)
    }
}

/// The control points and the knots of the parts of one curve.
///
/// Parts share their ends. The parts of a closed curve begin at its control point `first`.
fn joined_chain(
    chains: &Chains,
    parts: Range<usize>,
    first: usize,
    closed: bool,
    degree: usize,
) -> (Vec<f64>, Vec<f64>) {
    let d = chains.control.dimension();
    if parts.len() == 1 && chains.control.is_closed(parts.start) == closed {
        return (chains.control.points(parts.start).to_vec(), chains.knots[parts.start].clone());
    }
    let (mut coords, mut lengths) = (Vec::new(), Vec::new());
    for k in parts.clone() {
        let points = chains.control.points(k);
        coords.extend_from_slice(&points[..points.len() - d]);
        lengths.extend(chains.knots[k].windows(2).map(|pair| pair[1] - pair[0]));
    }
    if closed {
        coords.rotate_right(first * d);
        lengths.rotate_right(first / degree);
    } else {
        let points = chains.control.points(parts.end - 1);
        coords.extend_from_slice(&points[points.len() - d..]);
    }
    let ends = lengths.iter().scan(0.0, |end, length| {
        *end += length;
        Some(*end)
    });
    (coords, [0.0].into_iter().chain(ends).collect())
}

/// The control points of a chain that are corners: joints whose handles turn by more than an angle.
///
/// A joint with a tangent is not a corner.
fn corners(batch: &CurveBatch, i: usize, degree: usize, angle: f64) -> Vec<usize> {
    let (count, closed, spans) = (batch.count(i), batch.is_closed(i), batch.spans(i));
    if batch.problem(i).is_some() || spans == 0 || !spans.is_multiple_of(degree) {
        return vec![];
    }
    let points: Vec<DVec3> = batch.points(i).chunks_exact(batch.dimension()).map(vector).collect();
    let joints = (0..count).step_by(degree).filter(|&joint| closed || (joint > 0 && joint + 1 < count));
    let is_corner = |&joint: &usize| {
        let before = (0..=degree).map(|k| points[(joint + count - k) % count]);
        let after = (0..=degree).map(|k| points[(joint + k) % count]);
        batch.tangent(i, joint).is_none() && turn(before, after) > angle
    };
    joints.filter(is_corner).collect()
}
