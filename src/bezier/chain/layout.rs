//! [`Layout`]: a curve of the batch as a chain, with its lengths and known points.

use glam::DVec3;

use super::joint::{AGREES, Condition, Joint};
use super::options::{Joints, PieceLengths};
use crate::batch::CurveBatch;
use crate::curve::vector;
use crate::status::CurveStatus;

/// Why a curve is not completed: its status, the control point at fault, the problem and the
/// remedy.
pub(super) type Trouble = (CurveStatus, usize, String);

/// An `invalid` curve.
pub(super) fn invalid(point: usize, what: impl Into<String>) -> Trouble {
    (CurveStatus::Invalid, point, what.into())
}

/// A curve as a chain.
pub(super) struct Layout<'a> {
    batch: &'a CurveBatch,
    pub i: usize,
    pub degree: usize,
    pub closed: bool,
    /// Number of pieces.
    pub pieces: usize,
    /// h of each piece.
    pub lengths: Vec<f64>,
    /// The first known control point, or 0 if none is known. All points are taken relative to it.
    pub origin: DVec3,
    /// The largest coordinate of a known control point.
    pub largest: f64,
}

impl<'a> Layout<'a> {
    /// # Errors
    /// What is wrong with the curve.
    pub fn new(
        batch: &'a CurveBatch,
        i: usize,
        degree: usize,
        joints: Joints,
        lengths: PieceLengths,
    ) -> Result<Self, Trouble> {
        let (count, closed) = (batch.count(i), batch.is_closed(i));
        if count == 0 {
            let what = format!("a chain has {} control points at least: give some, or leave the curve out", degree + 1);
            return Err((CurveStatus::Degenerate, 0, what));
        }
        let spans = if closed { count } else { count - 1 };
        if spans == 0 || !spans.is_multiple_of(degree) {
            if count == 1 {
                let what = "it is a single point: there is nothing to complete".into();
                return Err((CurveStatus::Degenerate, 0, what));
            }
            let (kind, form) = if closed { ("a closed", "") } else { ("an open", " + 1") };
            let what = format!(
                "{count} control points make no chain of degree {degree}: {kind} one has {degree} n{form}, n pieces; \
                 give so many, or another degree"
            );
            return Err(invalid(count - 1, what));
        }
        let mut layout = Layout {
            batch,
            i,
            degree,
            closed,
            pieces: spans / degree,
            lengths: Vec::new(),
            origin: DVec3::ZERO,
            largest: 0.0,
        };
        let points = || (0..count).filter(|&k| layout.is_known(k));
        let largest = points().map(|k| layout.point(k).abs().max_element()).fold(0.0, f64::max);
        let origin = points().next().map_or(DVec3::ZERO, |k| layout.point(k));
        layout.check_tangents(joints)?;
        (layout.largest, layout.origin) = (largest, origin);
        layout.lengths = layout.chords(lengths).unwrap_or_else(|| vec![1.0; layout.pieces]);
        Ok(layout)
    }

    fn check_tangents(&self, joints: Joints) -> Result<(), Trouble> {
        for k in 0..self.batch.count(self.i) {
            let Some(tangent) = self.tangent(k) else { continue };
            if !tangent.is_finite() {
                return Err(invalid(k, "its tangent is not finite: mend it, or leave it out"));
            }
            if !k.is_multiple_of(self.degree) {
                let what = format!(
                    "it has a tangent, but is no joint, as only points with numbers {} n are: leave the tangent out",
                    self.degree
                );
                return Err(invalid(k, what));
            }
            if joints == Joints::Free {
                let what = "it has a tangent, but joints are free: leave it out, or take C1, C2 or G1 joints";
                return Err(invalid(k, what));
            }
        }
        Ok(())
    }

    /// The distances between joints, if all are known and none is 0.
    fn chords(&self, lengths: PieceLengths) -> Option<Vec<f64>> {
        if lengths == PieceLengths::Equal {
            return None;
        }
        let chord = |piece: usize| {
            let [from, to] = [0, self.degree].map(|j| self.place(piece, j));
            let chord = self.point(to).distance(self.point(from));
            (self.is_known(from) && self.is_known(to) && chord > 0.0 && chord.is_finite()).then_some(chord)
        };
        (0..self.pieces).map(chord).collect()
    }

    /// The index of control point j of a piece.
    pub fn place(&self, piece: usize, j: usize) -> usize {
        (piece * self.degree + j) % self.batch.count(self.i)
    }

    /// Number of joints, the ends included.
    pub fn joints(&self) -> usize {
        if self.closed { self.pieces } else { self.pieces + 1 }
    }

    /// The control point of a joint.
    pub fn joint_place(&self, joint: usize) -> usize {
        joint * self.degree
    }

    /// The joint where a piece ends.
    pub fn next(&self, piece: usize) -> usize {
        (piece + 1) % self.joints()
    }

    /// The pieces before and after a joint.
    pub fn around(&self, joint: usize) -> [Option<usize>; 2] {
        let before = if self.closed { Some((joint + self.pieces - 1) % self.pieces) } else { joint.checked_sub(1) };
        [before, (joint < self.pieces).then_some(joint)]
    }

    pub fn is_known(&self, k: usize) -> bool {
        self.batch.is_known(self.i, k)
    }

    /// A control point of the batch.
    pub fn point(&self, k: usize) -> DVec3 {
        vector(&self.batch.points(self.i)[k * self.dimension()..][..self.dimension()])
    }

    /// A control point relative to the origin.
    pub fn relative(&self, k: usize) -> DVec3 {
        self.point(k) - self.origin
    }

    pub fn tangent(&self, k: usize) -> Option<DVec3> {
        self.batch.tangent(self.i, k).map(vector)
    }

    /// Bits of the known control points of a piece, between the handles of jets of order
    /// `smoothness`.
    pub fn inner(&self, piece: usize, smoothness: usize) -> u32 {
        let between = smoothness + 1..(self.degree - smoothness).max(smoothness + 1);
        between.filter(|&j| self.is_known(self.place(piece, j))).fold(0, |bits, j| bits | 1 << j)
    }

    /// The jets that remain possible at a joint.
    ///
    /// Conditions are the joint, its tangent and the handles within `smoothness` of it.
    pub fn joint(&self, joint: usize, smoothness: usize) -> Result<Joint, Trouble> {
        let around = self.around(joint);
        let lengths = around.map(|piece| piece.map(|piece| self.lengths[piece]));
        let scale = lengths.into_iter().flatten().fold(f64::INFINITY, f64::min);
        let place = self.joint_place(joint);
        let mut conditions = Vec::new();
        let mut add = |coefficients: [f64; 3], value: DVec3, point: usize| {
            conditions.push(Condition { coefficients: coefficients.into(), value, point });
        };
        if self.is_known(place) {
            add([1.0, 0.0, 0.0], self.relative(place), place);
        }
        let d = self.degree as f64;
        for i in 1..=smoothness {
            for (side, sign) in [(0, -1.0), (1, 1.0)] {
                let (Some(piece), Some(h)) = (around[side], lengths[side]) else { continue };
                let point = self.place(piece, if side == 0 { self.degree - i } else { i });
                if self.is_known(point) {
                    // P_i = Σ C(i,r) (d−r)!/d! hʳ p⁽ʳ⁾
                    let u = sign * h / scale;
                    let second = if i == 2 { u * u / (d * (d - 1.0)) } else { 0.0 };
                    add([1.0, i as f64 * u / d, second], self.relative(point), point);
                }
            }
            if i == 1
                && let Some(tangent) = self.tangent(place)
            {
                add([0.0, 1.0, 0.0], scale * tangent, place);
            }
        }
        Joint::new(smoothness, scale, &conditions, self.largest).map_err(|(point, off)| {
            let what = format!(
                "the known control points and the tangent around the joint at point {place} are not C{smoothness}: \
                 this one is off by {off:.3e}; mark it as unknown, mend it, or take joints G1 or free"
            );
            invalid(point, what)
        })
    }

    /// Checks that C2 joints are possible with cubics and quartics.
    ///
    /// The minimiser with C1 joints has C2 joints if every p′ is free and no point within pieces is
    /// known.
    pub fn check_second(&self) -> Result<(), Trouble> {
        let count = self.batch.count(self.i);
        if (0..count).all(|k| self.is_known(k)) {
            return self.check_all_second();
        }
        let remedy = "give degree 5 or more, or take C1 joints";
        for k in 0..count {
            let at_end = !self.closed && (k <= 1 || k + 2 >= count);
            if at_end {
                continue;
            }
            if !k.is_multiple_of(self.degree) && self.is_known(k) {
                let what = format!(
                    "it is known, but C2 pieces of degree {} have no freedom for known points between joints: mark \
                     it as unknown, {remedy}",
                    self.degree
                );
                return Err(invalid(k, what));
            }
            if self.tangent(k).is_some() {
                let what = format!(
                    "it has a tangent, but C2 joints of pieces of degree {} have none but at the ends: leave it out, \
                     {remedy}",
                    self.degree
                );
                return Err(invalid(k, what));
            }
        }
        Ok(())
    }

    /// Checks that p″ is continuous if all points are known. [`joint`](Self::joint) checks p′.
    fn check_all_second(&self) -> Result<(), Trouble> {
        let d = self.degree;
        for joint in 0..self.joints() {
            let [Some(before), Some(after)] = self.around(joint) else { continue };
            let second = |piece: usize, from: usize, step: isize| {
                let [a, b, c] = [0, 1, 2].map(|j| self.relative(self.place(piece, from.wrapping_add_signed(step * j))));
                let h = self.lengths[piece];
                let size = b.distance(a).max(c.distance(b)) / (h * h);
                ((a - 2.0 * b + c) / (h * h), size)
            };
            let ((left, a), (right, b)) = (second(before, d, -1), second(after, 0, 1));
            let jump = right.distance(left);
            let rounding = 64.0 * f64::EPSILON * self.largest / self.lengths[before].min(self.lengths[after]).powi(2);
            if jump > AGREES * (a + b) + rounding {
                let what = format!(
                    "all control points are known, but p″ jumps here by {:.3e}: mark handles as unknown, or take C1 \
                     joints",
                    (d * (d - 1)) as f64 * jump
                );
                return Err(invalid(self.joint_place(joint), what));
            }
        }
        Ok(())
    }

    /// The parameters of the joints.
    pub fn knots(&self) -> Vec<f64> {
        let mut knots = vec![0.0];
        for h in &self.lengths {
            knots.push(knots[knots.len() - 1] + h);
        }
        knots
    }

    /// The curve's coordinates, unknown ones included.
    pub fn coords(&self) -> Vec<f64> {
        self.batch.points(self.i).to_vec()
    }

    /// Writes a control point if it is unknown.
    pub fn put(&self, coords: &mut [f64], k: usize, point: DVec3) {
        let d = self.dimension();
        if !self.is_known(k) {
            coords[k * d..][..d].copy_from_slice(&point.to_array()[..d]);
        }
    }

    /// Coordinates of a point.
    pub fn dimension(&self) -> usize {
        self.batch.dimension()
    }
}
