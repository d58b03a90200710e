//! [`Rule`]: how new points are made. [`SparseRule`]: weights in a window of 3 to 11 points, from
//! tables computed by linear programming.

mod constants;
mod linear;

use super::unknowns::Unknowns;
use crate::error::{Error, Result};
use crate::words::words;

/// How new points are made.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Rule {
    /// Solves the equations E₂ₙp = UEₙp₀. Every point depends on all others.
    #[default]
    Exact,
    /// The closest rule to the exact one with weights in a small window.
    Sparse(SparseRule),
}

/// What a sparse rule reproduces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reproduces {
    /// Constants: the weights of each new point sum to 1.
    #[default]
    Constants,
    /// Linear functions too, also at the border and the corners.
    ///
    /// The exact rule does not reproduce them at a border, where the normal derivative is 0. So
    /// these rules differ from it there, whatever their support.
    Linear,
}

words!(Reproduces, "kind of functions": [
    (Constants, "constants", "The weights of each new point have sum 1"),
    (Linear, "linear", "Linear functions are kept, at the borders too"),
]);

/// The result of the linear programmes for one support.
#[derive(Debug, PartialEq)]
struct Table {
    /// The maxima of the three classes.
    residual: [f64; 3],
    /// Interior, border and corner masks, in the order of [`Unknowns::of_class`].
    entries: &'static [f64],
}

/// A sparse rule of subdivision.
///
/// S has the symmetries of the grid and entries within the radius. ‖E₂ₙS − UEₙ‖∞ is minimal, class
/// after class: interior, borders, corners. Of the minimisers, the rule has the masks closest to
/// the exact rule in least squares.
///
/// | support | least ‖E₂ₙS − UEₙ‖∞ in the interior | least own intervals |
/// |---|---|---|
/// | 3 | 4 (bilinear interpolation) | 3 |
/// | 5 | 4/9 | 6 |
/// | 7 | 0.150447 | 7 |
/// | 9 | 0.031202 | 10 |
/// | 11 | 0.016186 | 11 |
///
/// At borders and corners the norm is the same if constants are reproduced. For rules that
/// reproduce linear functions it is 1, 0.99, ½ and ½ for supports 5 to 11.
///
/// # Examples
///
/// ```
/// use faircurve::laplacian::{Reproduces, SparseRule};
///
/// let rule = SparseRule::of_support(5, Reproduces::Constants)?;
/// // In the middle of a grid of 20 × 20 intervals: in the middle of four coarse points a quarter of each.
/// assert!((rule.weight([21, 21], [10, 10], [20, 20]) - 0.25).abs() < 1e-6);
/// assert_eq!(rule.weight([20, 23], [10, 10], [20, 20]), 0.0);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SparseRule {
    reproduces: Reproduces,
    unknowns: Unknowns,
    table: &'static Table,
}

impl SparseRule {
    /// The rule whose masks are `support` × `support` fine points: 3, 5, 7, 9 or 11.
    ///
    /// # Errors
    /// [`Error::Argument`] for any other support.
    pub fn of_support(support: usize, reproduces: Reproduces) -> Result<Self> {
        use Reproduces::{Constants, Linear};
        let table = match (support, reproduces) {
            (3, Constants) => &constants::SUPPORT_3,
            (5, Constants) => &constants::SUPPORT_5,
            (7, Constants) => &constants::SUPPORT_7,
            (9, Constants) => &constants::SUPPORT_9,
            (11, Constants) => &constants::SUPPORT_11,
            (3, Linear) => &linear::SUPPORT_3,
            (5, Linear) => &linear::SUPPORT_5,
            (7, Linear) => &linear::SUPPORT_7,
            (9, Linear) => &linear::SUPPORT_9,
            (11, Linear) => &linear::SUPPORT_11,
            _ => {
                return Err(Error::argument(format!(
                    "a support of {support} points: sparse rules have a support of 3, 5, 7, 9 or 11; for more, take the exact rule"
                )));
            }
        };
        let radius = support / 2;
        let unknowns = Unknowns::new(2, radius, Unknowns::usual_own_rows(radius));
        Ok(SparseRule { reproduces, unknowns, table })
    }

    /// Fine points across a mask.
    pub fn support(&self) -> usize {
        2 * self.radius() + 1
    }

    #[doc(hidden)]
    /// The radius of a mask, in fine steps.
    pub fn radius(&self) -> usize {
        self.unknowns.radius
    }

    /// What the rule reproduces.
    pub fn reproduces(&self) -> Reproduces {
        self.reproduces
    }

    #[doc(hidden)]
    /// The fewest intervals along both axes with which a grid has border and corner masks.
    ///
    /// Then no row of E₂ₙS − UEₙ involves masks of two opposite borders.
    pub fn least_intervals(&self) -> usize {
        2 * (self.unknowns.own_rows - 1) + self.radius() + 2
    }

    #[doc(hidden)]
    /// The largest Σ |entry| of the rows of E₂ₙS − UEₙ: rows with interior masks only, rows with a
    /// border mask, and rows with a corner mask. Given the masks of the previous classes, each is
    /// within a relative 1e-7 of the minimum.
    pub fn residual(&self) -> [f64; 3] {
        self.table.residual
    }

    #[doc(hidden)]
    /// The entry of S: the weight of a coarse point in a fine one.
    ///
    /// The grid has `intervals` (at least 1) along both axes, with 0 ≤ fine ≤ 2 · intervals and 0 ≤
    /// coarse ≤ intervals.
    ///
    /// Grids with fewer than [`least_intervals`](Self::least_intervals) along an axis have the
    /// interior mask everywhere, summed over all reflections: even ones for constants, p(−a) =
    /// 2p(0) − p(a) for linear functions.
    ///
    /// Symmetric entries have the same bits.
    pub fn weight(&self, fine: [usize; 2], coarse: [usize; 2], intervals: [usize; 2]) -> f64 {
        let [first, second] = [0, 1].map(|axis| Place::of(fine[axis], coarse[axis], intervals[axis]));
        if intervals.iter().all(|&n| n >= self.least_intervals()) {
            let [fine, coarse] = [[first.fine, second.fine], [first.coarse, second.coarse]];
            return self.unknowns.entry(fine, coarse, [true, true]).map_or(0.0, |unknown| self.table.entries[unknown]);
        }
        // One order gives symmetric entries the same bits.
        let [first, second] = [first.min(second), first.max(second)].map(|place| self.images(place));
        let products = first.iter().flat_map(|&(i, x)| second.iter().map(move |&(j, y)| x * y * self.interior(i, j)));
        products.sum()
    }

    /// The interior mask at a distance.
    fn interior(&self, i: isize, j: isize) -> f64 {
        self.unknowns.entry([i, j], [0, 0], [false, false]).map_or(0.0, |unknown| self.table.entries[unknown])
    }

    /// The images of the coarse point in the window of a fine point: fine distance and weight.
    fn images(&self, place: Place) -> Vec<(isize, f64)> {
        let radius = self.radius() as isize;
        let window = (place.fine - radius + 1).div_euclid(2)..=(place.fine + radius).div_euclid(2);
        let images = window.map(|x| (place.fine - 2 * x, place.share(x, self.reproduces)));
        images.filter(|&(_, share)| share != 0.0).collect()
    }
}

/// A fine and a coarse point along one axis.
///
/// They are counted from the nearer end of the fine point, or of the coarse point if the fine point
/// is in the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    intervals: isize,
    fine: isize,
    coarse: isize,
}

impl Place {
    fn of(fine: usize, coarse: usize, intervals: usize) -> Self {
        let [intervals, fine, coarse] = [intervals, fine, coarse].map(|x| x as isize);
        let (fine, coarse) = (fine, coarse).min((2 * intervals - fine, intervals - coarse));
        Place { intervals, fine, coarse }
    }

    /// The coefficient of the coarse point in the reflected value at the integer `x`.
    fn share(&self, x: isize, reproduces: Reproduces) -> f64 {
        let (turns, rest) = (x.div_euclid(2 * self.intervals), x.rem_euclid(2 * self.intervals));
        let is = |place: isize| if place == self.coarse { 1.0 } else { 0.0 };
        let folded = is(rest.min(2 * self.intervals - rest));
        match reproduces {
            Reproduces::Constants => folded,
            Reproduces::Linear => {
                let (start, end) = (is(0), is(self.intervals));
                let within = if rest <= self.intervals { folded } else { 2.0 * end - folded };
                within + 2.0 * turns as f64 * (end - start)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laplacian::unknowns::Class;

    #[test]
    fn reflections_continue_values_as_they_say() {
        // p = 1, 3, 2 on two intervals. Beyond the ends it is mirrored, or turned about the end
        // points.
        let p = [1.0, 3.0, 2.0];
        let extended = |x: isize, reproduces: Reproduces| -> f64 {
            (0..3).map(|coarse| p[coarse as usize] * Place { intervals: 2, fine: 0, coarse }.share(x, reproduces)).sum()
        };
        let all = |reproduces| (-5..=7).map(|x| extended(x, reproduces)).collect::<Vec<_>>();
        assert_eq!(all(Reproduces::Constants), [3.0, 1.0, 3.0, 2.0, 3.0, 1.0, 3.0, 2.0, 3.0, 1.0, 3.0, 2.0, 3.0]);
        // Each period of 4 adds 2 (p₂ − p₀) = 2.
        assert_eq!(all(Reproduces::Linear), [-3.0, -1.0, 1.0, 0.0, -1.0, 1.0, 3.0, 2.0, 1.0, 3.0, 5.0, 4.0, 3.0]);
    }

    #[test]
    fn tables_have_an_entry_for_each_unknown() {
        for support in [3, 5, 7, 9, 11] {
            for reproduces in [Reproduces::Constants, Reproduces::Linear] {
                let rule = SparseRule::of_support(support, reproduces).unwrap();
                assert_eq!(rule.table.entries.len(), rule.unknowns.count_to(Class::Corner));
                assert_eq!(rule.support(), support);
            }
        }
    }
}
