//! Bounds on the exponents ν of bending, for a [continuation](crate::discrete::continuation) in ν.

use super::Energy;

/// Exponents from [`LEAST_EXPONENT`] to this one need no stages.
///
/// They take as long directly from the spline as through stages.
const MOST_EXPONENT: f64 = 5.0;

/// See [`MOST_EXPONENT`].
const LEAST_EXPONENT: f64 = 1.5;

/// ν − 1 at most doubles or halves from stage to stage.
const STAGE: f64 = 2.0;

impl Energy {
    /// The bounds on the exponents, one per stage before the energy itself.
    ///
    /// They bound large exponents from above and small ones from below.
    pub(crate) fn stages(&self) -> Vec<f64> {
        let weighed = self.terms().iter().filter(|(weight, _)| *weight > 0.0);
        let exponents = weighed.filter_map(|(_, functional)| functional.exponent());
        let farthest =
            exponents.fold(2.0, |far: f64, nu| if (nu - 1.0).ln().abs() > (far - 1.0).ln().abs() { nu } else { far });
        let mut stages = Vec::new();
        if farthest > MOST_EXPONENT {
            let mut nu = MOST_EXPONENT;
            while nu < farthest {
                stages.push(nu);
                nu = 1.0 + STAGE * (nu - 1.0);
            }
        } else if farthest > 1.0 {
            let mut nu = LEAST_EXPONENT;
            while nu > farthest {
                stages.push(nu);
                nu = 1.0 + (nu - 1.0) / STAGE;
            }
        }
        stages
    }

    /// The energy with the exponents of bending no farther from 2 than `bound`.
    pub(crate) fn within(&self, bound: f64) -> Energy {
        let mut energy = self.clone();
        for (_, functional) in energy.terms_mut() {
            if let Some(exponent) = functional.exponent() {
                functional.set_exponent(nearer(exponent, bound));
            }
        }
        energy
    }
}

/// The exponent, no farther from 2 than a bound.
pub(crate) fn nearer(exponent: f64, bound: f64) -> f64 {
    if bound > 2.0 { exponent.min(bound) } else { exponent.max(bound) }
}

#[cfg(test)]
mod tests {
    use super::super::{bending, length};

    #[test]
    fn exponents_near_two_need_no_stages_and_others_are_approached_by_doubling_and_halving() {
        let of = |nu: f64| (bending(nu) + length()).stages();
        for nu in [1.0, 1.5, 2.0, 3.0, 5.0] {
            assert!(of(nu).is_empty(), "{nu}");
        }
        assert_eq!(of(20.0), [5.0, 9.0, 17.0]);
        assert_eq!(of(1.2), [1.5, 1.25]);
        assert!(length().stages().is_empty());
    }
}
