//! [`Completion`]: the unknown control points of a curve as a function of the known ones.

use num_rational::BigRational;
use num_traits::Zero;

use super::MOST_DEGREE;
use super::energy::{Energy, derivative_matrix};
use super::exact::{Matrix, ratio, solve};

/// The highest order of a derivative at an end.
pub const MOST_DERIVATIVE: usize = 3;

/// The known data of a Bézier curve: control points, and derivatives at its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pattern {
    degree: u8,
    /// Bit i: whether control point i is known.
    known: u32,
    /// Bit r − 1: whether X⁽ʳ⁾(0), and X⁽ʳ⁾(1), are given.
    ends: [u8; 2],
}

impl Pattern {
    /// A pattern with these known control points.
    ///
    /// # Panics
    /// Without control points, or with more than [`MOST_DEGREE`] + 1.
    pub fn new(known: &[bool]) -> Self {
        assert!((1..=MOST_DEGREE + 1).contains(&known.len()), "a curve of {} control points", known.len());
        let bits = known.iter().enumerate().fold(0, |bits, (i, &known)| bits | u32::from(known) << i);
        Pattern { degree: (known.len() - 1) as u8, known: bits, ends: [0; 2] }
    }

    /// Adds the derivative of order r (1, 2 or 3) at t = `end` (0 or 1).
    ///
    /// # Panics
    /// With another order or end.
    pub fn with_derivative(mut self, end: usize, r: usize) -> Self {
        assert!((1..=MOST_DERIVATIVE).contains(&r), "the order of a derivative is {r}; 1, 2 and 3 are possible");
        self.ends[end] |= 1 << (r - 1);
        self
    }

    /// d
    pub fn degree(&self) -> usize {
        usize::from(self.degree)
    }

    /// Whether control point `i` is known.
    pub fn is_known(&self, i: usize) -> bool {
        self.known >> i & 1 == 1
    }

    /// The known control points, in order.
    pub fn known(&self) -> impl Iterator<Item = usize> + '_ {
        (0..=self.degree()).filter(|&i| self.is_known(i))
    }

    /// The unknown control points, in order.
    pub fn unknown(&self) -> impl Iterator<Item = usize> + '_ {
        (0..=self.degree()).filter(|&i| !self.is_known(i))
    }

    /// The given derivatives: end (0, 1) and order, starting with end 0.
    pub fn derivatives(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let given = |&(end, r): &(usize, usize)| self.ends[end] >> (r - 1) & 1 == 1;
        (0..2).flat_map(|end| (1..=MOST_DERIVATIVE).map(move |r| (end, r))).filter(given)
    }

    /// Number of data: known points and derivatives.
    pub fn data(&self) -> usize {
        self.known().count() + self.derivatives().count()
    }

    /// X⁽ʳ⁾(end) as a combination of control points. All zeros for r > d.
    fn derivative_row(&self, end: usize, r: usize) -> Vec<BigRational> {
        let degree = self.degree();
        if r > degree {
            return vec![BigRational::zero(); degree + 1];
        }
        let matrix = derivative_matrix(degree, r);
        (0..=degree).map(|i| matrix.at(end * (degree - r), i).clone()).collect()
    }
}

/// The unknown control points of least energy as a combination of the given data: U = W G.
///
/// The rows of G are the known control points, the derivatives at the start, and the derivatives at
/// the end, each in order. With the unknown points first, M = (A B; Bᵀ C) and A U = −B K. Lagrange
/// multipliers enforce the derivatives. The system is solved in exact rationals and rounded once.
/// If A is singular, U is the minimiser with the least Σ|Uᵢ|².
///
/// ```
/// use faircurve::bezier::{Completion, Energy, Pattern};
///
/// // P₂ = (P₁ + P₃)/2
/// let cubic = Completion::new(Pattern::new(&[true, true, false, true]), &Energy::bending()).unwrap();
/// assert_eq!(cubic.weights().to_f64(), [0.0, 0.5, 0.5]);
/// ```
#[derive(Clone, Debug)]
pub struct Completion {
    pattern: Pattern,
    weights: Matrix,
    is_unique: bool,
}

impl Completion {
    /// Solves a pattern. `None` if the data are contradictory or redundant, such as two points and
    /// the derivative between them.
    pub fn new(pattern: Pattern, energy: &Energy) -> Option<Self> {
        Self::of_matrix(pattern, &energy.matrix(pattern.degree()).whole())
    }

    /// Solves a pattern, given a multiple of M.
    pub(super) fn of_matrix(pattern: Pattern, matrix: &Matrix) -> Option<Self> {
        let (unknown, known): (Vec<usize>, Vec<usize>) = (pattern.unknown().collect(), pattern.known().collect());
        let rows: Vec<Vec<BigRational>> =
            pattern.derivatives().map(|(end, r)| pattern.derivative_row(end, r)).collect();
        let (m, n, c) = (unknown.len(), known.len(), rows.len());
        // (A Rᵀ; R 0) (U; multipliers) = (−B 0; −R 1) (K; derivatives)
        let system = Matrix::from_fn(m + c, m + c + n + c, |i, j| match (i < m, j) {
            (true, j) if j < m => matrix.at(unknown[i], unknown[j]).clone(),
            (true, j) if j < m + c => rows[j - m][unknown[i]].clone(),
            (true, j) if j < m + c + n => -matrix.at(unknown[i], known[j - m - c]).clone(),
            (false, j) if j < m => rows[i - m][unknown[j]].clone(),
            (false, j) if j >= m + c && j < m + c + n => -rows[i - m][known[j - m - c]].clone(),
            (false, j) if j == i + c + n => ratio(1, 1),
            _ => BigRational::zero(),
        });
        let solutions = solve(&system, m + c)?;
        let top = |matrix: &Matrix| Matrix::from_fn(m, matrix.columns(), |i, j| matrix.at(i, j).clone());
        let weights = smallest(top(&solutions.particular), &top(&solutions.free));
        let is_unique = solutions.free.columns() == 0;
        Some(Completion { pattern, weights, is_unique })
    }

    /// The pattern.
    pub fn pattern(&self) -> Pattern {
        self.pattern
    }

    /// W, with one row per unknown control point and one column per datum.
    pub fn weights(&self) -> Matrix {
        self.weights.reduced()
    }

    /// W with fractions that are not reduced.
    pub(super) fn raw_weights(&self) -> &Matrix {
        &self.weights
    }

    /// Whether this is the only minimiser.
    pub fn is_unique(&self) -> bool {
        self.is_unique
    }

    /// All control points as a combination of the given data.
    pub fn all(&self) -> Matrix {
        let place = |i: usize, known: bool| (0..i).filter(|&before| self.pattern.is_known(before) == known).count();
        Matrix::from_fn(self.pattern.degree() + 1, self.weights.columns(), |i, j| match self.pattern.is_known(i) {
            true => ratio(i32::from(place(i, true) == j), 1),
            false => self.weights.at(place(i, false), j).clone(),
        })
    }
}

/// The smallest solution x + N y, column by column: x − N (NᵀN)⁻¹ Nᵀ x.
fn smallest(particular: Matrix, free: &Matrix) -> Matrix {
    let count = free.columns();
    if count == 0 {
        return particular;
    }
    let transposed = free.transposed();
    let (gram, projected) = (transposed.times(free), transposed.times(&particular));
    let system = Matrix::from_fn(count, count + particular.columns(), |i, j| match j.checked_sub(count) {
        None => gram.at(i, j).clone(),
        Some(j) => projected.at(i, j).clone(),
    });
    let solved = solve(&system, count).expect("what is free is independent").particular;
    particular.plus(&ratio(-1, 1), &free.times(&solved))
}
