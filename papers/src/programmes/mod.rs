//! The report's linear programme, as data.
//!
//! [`Programme`] asks which sparse S makes the rows of E₂ₙS − UEₙ as small as possible.
//!
//! An infinity norm is made linear in the usual way. There is an unknown u ≥ |entry| for each entry
//! of a row, and t ≥ Σ u for each row, and t is minimised. Any solver of linear programmes solves
//! this one. For curves the same programme leads to natural cubic splines.

use std::collections::{BTreeMap, BTreeSet};

mod energies;

use energies::Axis;
pub use energies::Energy;
use faircurve::laplacian::Reproduces;
use faircurve::laplacian::unknowns::Unknowns;
pub use faircurve::laplacian::unknowns::{Class, Unknown};

/// Σ coefficient · unknown + constant.
///
/// Unknowns are given by their numbers, none twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Affine {
    /// Unknowns and their coefficients.
    pub terms: Vec<(usize, f64)>,
    /// The constant.
    pub constant: f64,
}

impl Affine {
    fn new(terms: BTreeMap<usize, f64>, constant: f64) -> Self {
        Affine { terms: terms.into_iter().filter(|&(_, coefficient)| coefficient != 0.0).collect(), constant }
    }

    /// Its value for these values of the unknowns.
    pub fn at(&self, values: &[f64]) -> f64 {
        self.terms.iter().fold(self.constant, |sum, &(unknown, coefficient)| sum + coefficient * values[unknown])
    }

    /// The rest once the first unknowns are known.
    ///
    /// The others are numbered from 0.
    fn with_known(&self, known: &[f64]) -> Self {
        let (before, after): (Vec<_>, Vec<_>) = self.terms.iter().partition(|&&(unknown, _)| unknown < known.len());
        let constant = Affine { terms: before, constant: self.constant }.at(known);
        Affine { terms: after.iter().map(|&(unknown, x)| (unknown - known.len(), x)).collect(), constant }
    }

    /// A key that is the same for both signs, bit by bit.
    ///
    /// All coefficients are multiples of powers of two, so equal ones have the same bits.
    fn key(&self) -> (Vec<(usize, u64)>, u64) {
        let first = self.terms.first().map_or(self.constant, |&(_, coefficient)| coefficient);
        let sign = if first < 0.0 { -1.0 } else { 1.0 };
        // Adding 0 turns −0 into 0.
        let bits = |x: f64| (sign * x + 0.0).to_bits();
        (self.terms.iter().map(|&(unknown, x)| (unknown, bits(x))).collect(), bits(self.constant))
    }
}

/// A linear programme in the form that solvers take.
///
/// c·x is minimised, with Ax = b for the equalities and Ax ≤ b for the inequalities.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardForm {
    /// The number of variables that are entries of masks.
    ///
    /// They come first. Bounds of absolute values follow, and the maximum comes last.
    pub unknowns: usize,
    /// c, one entry a variable.
    pub objective: Vec<f64>,
    /// Sparse rows of A, with b, for the equalities.
    pub equalities: Vec<(Vec<(usize, f64)>, f64)>,
    /// Sparse rows of A, with b, for the inequalities.
    pub inequalities: Vec<(Vec<(usize, f64)>, f64)>,
}

/// The linear programme for the sparse S that minimises ‖E₂ₙS − UEₙ‖∞.
///
/// It holds unknowns, residual rows and constraints, class after class. S has the symmetries of the
/// grid, and no entry further than `radius` from the place of its coarse point.
///
/// - Coarse points less than `own_rows` from a border have masks of their own. Near two borders the
///   mask is that of a corner.
/// - All other coarse points have the interior mask, with the symmetries of the square.
///
/// Unknowns are numbered class after class ([`Unknown`]), so those of earlier classes come first.
///
/// # Examples
///
/// The rule of natural cubic splines makes the bending energy of a curve right in every row:
///
/// ```
/// use faircurve::laplacian::Reproduces;
/// use faircurve_papers::programmes::{Class, Energy, Programme};
///
/// let programme = Programme::new(Energy::CurveBending, 2, Reproduces::Linear);
/// let interior = [0.75, 0.5, 0.125];
/// assert_eq!(programme.unknowns(Class::Interior).len(), interior.len());
/// assert!(programme.maximum(Class::Interior, &interior) < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Programme {
    energy: Energy,
    reproduces: Reproduces,
    unknowns: Unknowns,
}

impl Programme {
    /// The programme for masks of this radius (support 2 · radius + 1), with
    /// [`Programme::usual_own_rows`].
    pub fn new(energy: Energy, radius: usize, reproduces: Reproduces) -> Self {
        let unknowns = Unknowns::new(energy.dimension(), radius, Unknowns::usual_own_rows(radius));
        Programme { energy, reproduces, unknowns }
    }

    /// The default number of rows of coarse points with border masks, radius / 2 + 1.
    ///
    /// These are all rows whose window of fine points meets the border. With fewer rows, reflection
    /// of the interior mask is not among the possible rules.
    pub fn usual_own_rows(radius: usize) -> usize {
        radius / 2 + 1
    }

    /// The same programme with another number of rows of border masks, at least 1.
    pub fn with_own_rows(self, rows: usize) -> Self {
        Programme { unknowns: Unknowns::new(self.energy.dimension(), self.radius(), rows.max(1)), ..self }
    }

    /// The distance that masks reach.
    pub fn radius(&self) -> usize {
        self.unknowns.radius
    }

    /// The number of unknowns of a class and those before it.
    pub fn known_after(&self, class: Class) -> usize {
        self.unknowns.count_to(class)
    }

    /// The unknowns of a class, in the order of their numbers.
    ///
    /// Curves have no corners.
    pub fn unknowns(&self, class: Class) -> Vec<Unknown> {
        self.unknowns.of_class(class)
    }

    /// The number of the unknown that is the entry of S for a fine and a coarse point.
    ///
    /// Points are counted from the border where `axes` end. `None` where the entry is 0.
    fn entry(&self, fine: [isize; 2], coarse: [isize; 2], axes: [Axis; 2]) -> Option<usize> {
        let [border_0, border_1] = [0, 1].map(|axis| axes[axis] == Axis::HalfLine);
        self.unknowns.entry(fine, coarse, [border_0, border_1])
    }

    /// The first unknown of a class, and the one after its last.
    fn range(&self, class: Class) -> std::ops::Range<usize> {
        let before = Class::ALL.into_iter().rev().find(|&other| other < class);
        before.map_or(0, |class| self.known_after(class))..self.known_after(class)
    }

    /// Fine points that stand for all rows of a class.
    ///
    /// They reach up to the border and its neighbourhood. Elsewhere there is one of each parity.
    fn fine_points(&self, class: Class) -> Vec<[isize; 2]> {
        let last = 2 * (self.unknowns.own_rows as isize - 1) + self.radius() as isize + self.energy.reach();
        let [first, second] = self.energy.axes(class).map(|axis| match axis {
            Axis::Endless => 0..=1,
            Axis::HalfLine => 0..=last,
            Axis::Point => 0..=0,
        });
        first.flat_map(|i| second.clone().map(move |j| [i, j])).collect()
    }

    /// The coarse coordinates along an axis that are at most `distance` from a fine one, in fine
    /// steps.
    fn coarse_near(fine: isize, distance: isize, axis: Axis) -> std::ops::RangeInclusive<isize> {
        let first = (fine - distance + 1).div_euclid(2);
        match axis {
            Axis::Endless => first..=(fine + distance).div_euclid(2),
            Axis::HalfLine => first.max(0)..=(fine + distance).div_euclid(2),
            Axis::Point => 0..=0,
        }
    }

    /// The row of E₂ₙS − UEₙ of a fine point, without entries that are 0 for every S.
    fn residual_row(&self, fine: [isize; 2], axes: [Axis; 2]) -> Vec<Affine> {
        let reach = self.energy.reach();
        let energy = self.energy.row(fine, axes);
        let coarse_energy = match fine.iter().all(|i| i % 2 == 0) {
            true => self.energy.row(fine.map(|i| i / 2), axes),
            false => BTreeMap::new(),
        };
        let distance = reach + reach.max(self.radius() as isize);
        let [first, second] = [0, 1].map(|axis| Self::coarse_near(fine[axis], distance, axes[axis]));
        let coarse_points = first.flat_map(|a| second.clone().map(move |b| [a, b]));
        let entries = coarse_points.map(|coarse| {
            let mut terms = BTreeMap::new();
            for (&place, weight) in &energy {
                if let Some(unknown) = self.entry(place, coarse, axes) {
                    *terms.entry(unknown).or_insert(0.0) += weight;
                }
            }
            Affine::new(terms, -self.energy.scale() * coarse_energy.get(&coarse).unwrap_or(&0.0))
        });
        entries.filter(|entry| !entry.terms.is_empty() || entry.constant != 0.0).collect()
    }

    /// The distinct rows of E₂ₙS − UEₙ of a class, with entries as functions of the unknowns.
    ///
    /// Rows that differ in sign or in the order of entries count as one.
    pub fn rows(&self, class: Class) -> Vec<Vec<Affine>> {
        let own = self.range(class);
        let axes = self.energy.axes(class);
        let mut seen = BTreeSet::new();
        let rows = self.fine_points(class).into_iter().map(|fine| self.residual_row(fine, axes));
        let of_class =
            rows.filter(|row| row.iter().flat_map(|entry| &entry.terms).any(|(unknown, _)| own.contains(unknown)));
        of_class
            .filter(|row| {
                let mut key: Vec<_> = row.iter().map(Affine::key).collect();
                key.sort_unstable();
                seen.insert(key)
            })
            .collect()
    }

    /// The expressions that must be 0 so that the rule reproduces its functions.
    ///
    /// They are Σ weights − 1, and for linear functions Σ weight · coordinate − coordinate.
    pub fn constraints(&self, class: Class) -> Vec<Affine> {
        let own = self.range(class);
        let axes = self.energy.axes(class);
        let radius = self.radius() as isize;
        // The constant, and the coordinates along both axes.
        let moments: &[Option<usize>] = match self.reproduces {
            Reproduces::Constants => &[None],
            Reproduces::Linear => &[None, Some(0), Some(1)],
        };
        let mut constraints = Vec::new();
        let mut seen = BTreeSet::new();
        for fine in self.fine_points(class) {
            let [first, second] = [0, 1].map(|axis| Self::coarse_near(fine[axis], radius, axes[axis]));
            let weights: Vec<_> = first
                .flat_map(|a| second.clone().map(move |b| [a, b]))
                .filter_map(|coarse| Some((self.entry(fine, coarse, axes)?, coarse)))
                .collect();
            for moment in moments {
                // The function at a coarse point, and its required value at the fine one.
                let of = |coarse: [isize; 2]| moment.map_or(1.0, |axis| coarse[axis] as f64);
                let value = moment.map_or(1.0, |axis| fine[axis] as f64 / 2.0);
                let mut terms = BTreeMap::new();
                for &(unknown, coarse) in &weights {
                    *terms.entry(unknown).or_insert(0.0) += of(coarse);
                }
                let constraint = Affine::new(terms, -value);
                if constraint.terms.iter().any(|(unknown, _)| own.contains(unknown)) && seen.insert(constraint.key()) {
                    constraints.push(constraint);
                }
            }
        }
        constraints
    }

    /// The largest Σ |entry| over the rows of a class, for these values of the unknowns up to it.
    pub fn maximum(&self, class: Class, values: &[f64]) -> f64 {
        let sum = |row: &Vec<Affine>| row.iter().map(|entry| entry.at(values).abs()).sum();
        self.rows(class).iter().map(sum).fold(0.0, f64::max)
    }

    /// The programme of one class, where `known` are the values of the unknowns of all classes
    /// before it.
    ///
    /// The variables are:
    ///
    /// - the unknowns of the class;
    /// - one u for each distinct entry, with −u ≤ entry ≤ u;
    /// - t, with Σ u ≤ t for each row.
    ///
    /// t is minimised.
    pub fn standard_form(&self, class: Class, known: &[f64]) -> StandardForm {
        let unknowns = self.range(class).len();
        let mut numbers = BTreeMap::new();
        let mut inequalities = Vec::new();
        let mut sums = Vec::new();
        for row in self.rows(class) {
            let mut counts = BTreeMap::new();
            let mut constant = 0.0;
            for entry in row {
                let key = entry.key();
                let entry = entry.with_known(known);
                if entry.terms.is_empty() {
                    constant += entry.constant.abs();
                    continue;
                }
                let next = unknowns + numbers.len();
                let bound = *numbers.entry(key).or_insert_with(|| {
                    for sign in [1.0, -1.0] {
                        let mut terms: Vec<_> = entry.terms.iter().map(|&(unknown, x)| (unknown, sign * x)).collect();
                        terms.push((next, -1.0));
                        inequalities.push((terms, -sign * entry.constant));
                    }
                    next
                });
                *counts.entry(bound).or_insert(0.0) += 1.0;
            }
            sums.push((counts, constant));
        }
        let maximum = unknowns + numbers.len();
        inequalities.extend(sums.into_iter().map(|(counts, constant)| {
            let terms = counts.into_iter().chain([(maximum, -1.0)]).collect();
            (terms, -constant)
        }));
        let mut objective = vec![0.0; maximum];
        objective.push(1.0);
        let equalities = self.constraints(class).into_iter().map(|constraint| {
            let constraint = constraint.with_known(known);
            (constraint.terms, -constraint.constant)
        });
        StandardForm { unknowns, objective, equalities: equalities.collect(), inequalities }
    }
}
