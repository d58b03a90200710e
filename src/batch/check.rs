//! Checks of coordinates, parameters and weights.

use super::{CurveBatch, Unfitted};
use crate::error::short;
use crate::status::CurveStatus;

impl CurveBatch {
    /// Finds coordinates that are not finite, except those of unknown points.
    pub(super) fn check_coordinates(&mut self) {
        if are_finite(&self.coords) {
            return;
        }
        self.find_problems(|batch, i| {
            let (points, dimension) = (batch.points(i), batch.dimension);
            let bad = |&at: &usize| !points[at].is_finite() && batch.is_known(i, at / dimension);
            let bad = (0..points.len()).find(bad)?;
            let (point, axis, value) = (bad / dimension, ["x", "y", "z"][bad % dimension], short(points[bad]));
            Some((
                point,
                format!("{axis} is {value}; every coordinate must be a finite number: mend or remove the point"),
            ))
        });
    }

    /// Finds parameters that are not finite or decrease.
    pub(super) fn check_parameters(&mut self) {
        let increase = |i: usize| {
            let t = self.parameters(i).unwrap_or_default();
            // A fold vectorises, a search does not.
            t.iter().zip(t.get(1..).unwrap_or_default()).fold(true, |so_far, (from, to)| so_far & (from <= to))
        };
        if are_finite(self.shared_parameters().map_or(&[], |t| t)) && (0..self.len()).all(increase) {
            return;
        }
        self.find_problems(|batch, i| {
            let t = batch.parameters(i)?;
            if let Some(point) = t.iter().position(|t| !t.is_finite()) {
                return Some((point, format!("its parameter is {}; parameters must be finite", short(t[point]))));
            }
            let point = t.windows(2).position(|pair| pair[1] < pair[0])? + 1;
            let written = |t: f64| batch.origin.clock(i).map_or_else(|| short(t), |clock| clock.write(t));
            let (before, here) = (written(t[point - 1]), written(t[point]));
            Some((
                point,
                format!(
                    "its parameter decreases from {before} to {here}: sort the points (`ReadOptions::sorted`), or leave the parameters out"
                ),
            ))
        });
    }

    /// Finds weights that are not positive and finite.
    pub(super) fn check_weights(&mut self) {
        self.find_problems(|batch, i| {
            let weights = batch.weights(i)?;
            let point = weights.iter().position(|&w| !(w > 0.0 && w.is_finite()))?;
            let weight = short(weights[point]);
            Some((
                point,
                format!(
                    "its weight is {weight}; weights must be positive and finite: remove the point to give it none"
                ),
            ))
        });
    }

    /// Repeats the checks after other points became known.
    pub(super) fn check_again(&mut self) {
        let mut problems = std::mem::take(&mut self.problems);
        problems.retain(|&i, _| self.points(i).iter().all(|x| x.is_finite()));
        self.problems = problems;
        self.check_coordinates();
        self.check_parameters();
        self.check_weights();
    }

    /// Records a problem of curve `i` at a point.
    pub(crate) fn refuse(&mut self, i: usize, point: usize, what: &str) {
        let message = self.sentence(i, point, what);
        self.refuse_as(i, CurveStatus::Invalid, message);
    }

    /// Records a problem of curve `i`, as a sentence that names the place.
    pub(crate) fn refuse_as(&mut self, i: usize, status: CurveStatus, message: String) {
        self.problems.insert(i, Unfitted { status, message });
    }

    /// Records the problem that `find` returns, with its point, for curves without one.
    fn find_problems(&mut self, find: impl Fn(&Self, usize) -> Option<(usize, String)>) {
        for i in 0..self.len() {
            if self.problems.contains_key(&i) {
                continue;
            }
            if let Some((point, what)) = find(self, i) {
                self.refuse(i, point, &what);
            }
        }
    }
}

/// Whether all numbers are finite.
pub(crate) fn are_finite(numbers: &[f64]) -> bool {
    // Blocks vectorise.
    numbers.chunks(256).all(|some| some.iter().fold(true, |so_far, x| so_far & x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Constraints;

    const NAN: f64 = f64::NAN;
    const FINITE: &str = "every coordinate must be a finite number: mend or remove the point";

    /// Three curves with invalid numbers at points 1, 1 and 2.
    fn blanks() -> CurveBatch {
        let a = [[0.0, 0.0], [NAN, 1.0], [2.0, 0.0]];
        let b = [[0.0, 0.0], [1.0, f64::INFINITY], [2.0, 0.0]];
        let c = [[0.0, 0.0], [1.0, 1.0], [2.0, NAN]];
        CurveBatch::from_slices(&[&a[..], &b[..], &c[..]]).unwrap()
    }

    fn with_known(batch: CurveBatch, known: Option<[u8; 9]>) -> CurveBatch {
        let known = known.map(|flags| flags.map(|flag| flag == 1).to_vec());
        batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap()
    }

    fn messages(batch: &CurveBatch) -> [Option<&str>; 3] {
        [0, 1, 2].map(|i| batch.problem(i).map(|problem| problem.message.as_str()))
    }

    #[test]
    fn unknown_points_need_no_coordinates_and_known_ones_do() {
        let at = |text: &str| format!("{text}; {FINITE}");
        let [a, b, c] =
            [at("curve 0, point 1: x is NaN"), at("curve 1, point 1: y is inf"), at("curve 2, point 2: y is NaN")];
        let batch = blanks();
        assert_eq!(messages(&batch), [Some(&*a), Some(&*b), Some(&*c)]);
        let batch = with_known(batch, Some([1, 0, 1, 1, 0, 1, 1, 0, 1]));
        assert_eq!(messages(&batch), [None, None, Some(&*c)]);
        let batch = with_known(batch, Some([1, 1, 1, 1, 0, 1, 0, 0, 0]));
        assert_eq!(messages(&batch), [Some(&*a), None, None]);
        let batch = with_known(batch, None);
        assert_eq!(messages(&batch), [Some(&*a), Some(&*b), Some(&*c)]);
    }

    #[test]
    fn what_else_is_wrong_with_a_curve_of_unknown_points_is_found_in_any_order() {
        let t = vec![0.0, 1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 1.0, 2.0];
        let weights = vec![1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        let flags = Some([1, 0, 1, 1, 0, 1, 1, 1, 0]);
        let before =
            with_known(blanks(), flags).with_parameters(t.clone()).unwrap().with_weights(weights.clone()).unwrap();
        let after = with_known(blanks().with_parameters(t).unwrap().with_weights(weights).unwrap(), flags);
        let [weight, decrease, none] = messages(&after);
        assert!(weight.unwrap().starts_with("curve 0, point 2: its weight is 0"), "{weight:?}");
        assert!(decrease.unwrap().starts_with("curve 1, point 2: its parameter decreases from 2 to 1"), "{decrease:?}");
        assert_eq!(none, None);
        assert_eq!(messages(&before), messages(&after));
    }

    #[test]
    fn flags_stay_with_their_points_when_curves_are_chosen_and_closed() {
        let a = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]];
        let b = [[5.0, 5.0], [NAN, NAN], [6.0, 5.0], [5.0, 5.0]];
        let batch = CurveBatch::from_slices(&[&a[..], &b[..]]).unwrap();
        let known = Some([1, 0, 1, 1, 1, 0, 0, 1].map(|flag| flag == 1).to_vec());
        let batch = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap();
        let chosen = batch.select(&[1, 0]);
        let flags =
            |batch: &CurveBatch, i: usize| (0..batch.count(i)).map(|k| batch.is_known(i, k)).collect::<Vec<_>>();
        assert_eq!(flags(&chosen, 0), [true, false, false, true]);
        assert!(chosen.problem(0).is_none());
        let closed = chosen.closed_auto();
        assert_eq!((closed.count(0), closed.count(1)), (3, 3));
        assert_eq!((flags(&closed, 0), flags(&closed, 1)), (vec![true, false, false], vec![true, false, true]));
        assert_eq!(closed.constraints().known.as_ref().map(Vec::len), Some(6));
    }

    #[test]
    fn an_unknown_last_point_closes_no_curve() {
        let loop_ = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]];
        let batch = CurveBatch::from_slices(&[&loop_[..]]).unwrap();
        assert!(batch.clone().closed_auto().is_closed(0));
        let known = Some(vec![true, true, true, false]);
        let batch = batch.with_constraints(Constraints { known, ..Constraints::default() }).unwrap();
        assert!(!batch.clone().closed_auto().is_closed(0));
        assert_eq!(batch.closed(true).count(0), 4);
    }
}
