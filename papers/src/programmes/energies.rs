//! [`Energy`]: the rows of energy matrices of surfaces and curves, far from all borders or near
//! some.

use std::collections::BTreeMap;

use faircurve::laplacian::unknowns::Class;

/// The energy whose subdivision is looked for.
///
/// It is a matrix E with one row a point, on a grid or on a curve with free ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Energy {
    /// Σ w |difference|² over the edges of a grid.
    ///
    /// A row is 4 −1 −1 −1 −1 inside, 2 −½ −½ −1 at the border and 1 −½ −½ at a corner.
    #[default]
    Dirichlet,
    /// Σ |difference|² of a curve.
    ///
    /// A row is −1 2 −1 inside, and 1 −1 at an end.
    CurveDirichlet,
    /// Σ |second difference|² of a curve.
    ///
    /// A row is 1 −4 6 −4 1 inside. At an end rows are 1 −2 1 and −2 5 −4 1.
    CurveBending,
}

/// The end of a grid along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    /// The grid has no end.
    Endless,
    /// The grid ends at 0.
    HalfLine,
    /// The grid is the point 0.
    ///
    /// This is the second axis of a curve.
    Point,
}

/// One-dimensional factors of the energies.
///
/// E is a sum of products: Σ factor ⊗ factor.
#[derive(Clone, Copy, Debug)]
enum Factor {
    /// −1 2 −1 inside, 1 −1 at an end.
    Difference,
    /// The factor 1 inside, ½ at an end.
    Mass,
    /// 1 −4 6 −4 1 inside, 1 −2 1 and −2 5 −4 1 at an end.
    Bending,
    /// The factor 1.
    One,
}

impl Factor {
    /// The places and entries of row `i`.
    fn row(self, i: isize, axis: Axis) -> Vec<(isize, f64)> {
        let end = axis == Axis::HalfLine && i == 0;
        match self {
            Factor::Difference if end => vec![(0, 1.0), (1, -1.0)],
            Factor::Difference => vec![(i - 1, -1.0), (i, 2.0), (i + 1, -1.0)],
            Factor::Mass if end => vec![(0, 0.5)],
            Factor::Mass | Factor::One => vec![(i, 1.0)],
            Factor::Bending => {
                // The second differences around i − 1, i and i + 1, where their points exist.
                let mut row = BTreeMap::new();
                for (centre, weight) in [(i - 1, 1.0), (i, -2.0), (i + 1, 1.0)] {
                    if axis == Axis::Endless || centre >= 1 {
                        for (place, entry) in [(centre - 1, 1.0), (centre, -2.0), (centre + 1, 1.0)] {
                            *row.entry(place).or_insert(0.0) += weight * entry;
                        }
                    }
                }
                row.into_iter().collect()
            }
        }
    }
}

impl Energy {
    /// 1 for curves, 2 for grids.
    pub fn dimension(self) -> usize {
        if self == Energy::Dirichlet { 2 } else { 1 }
    }

    /// The distance that a row of E reaches.
    pub(super) fn reach(self) -> isize {
        if self == Energy::CurveBending { 2 } else { 1 }
    }

    /// c in E₂ₙS = c UEₙ.
    ///
    /// It is the factor by which halving the spacing changes the energy of a function of
    /// `dimension` variables and its derivatives.
    pub(super) fn scale(self) -> f64 {
        match self {
            Energy::Dirichlet => 1.0,
            Energy::CurveDirichlet => 0.5,
            Energy::CurveBending => 0.125,
        }
    }

    /// The ends of the grid along its axes, as far as the rows of this class see them.
    pub(super) fn axes(self, class: Class) -> [Axis; 2] {
        match (self.dimension(), class) {
            (1, Class::Interior) => [Axis::Endless, Axis::Point],
            (1, _) => [Axis::HalfLine, Axis::Point],
            (_, Class::Interior) => [Axis::Endless, Axis::Endless],
            (_, Class::Border) => [Axis::HalfLine, Axis::Endless],
            (_, Class::Corner) => [Axis::HalfLine, Axis::HalfLine],
        }
    }

    fn terms(self) -> &'static [[Factor; 2]] {
        match self {
            Energy::Dirichlet => &[[Factor::Difference, Factor::Mass], [Factor::Mass, Factor::Difference]],
            Energy::CurveDirichlet => &[[Factor::Difference, Factor::One]],
            Energy::CurveBending => &[[Factor::Bending, Factor::One]],
        }
    }

    /// The places and entries of the row of E of a point.
    pub(super) fn row(self, point: [isize; 2], axes: [Axis; 2]) -> BTreeMap<[isize; 2], f64> {
        let mut row = BTreeMap::new();
        for [first, second] in self.terms() {
            for (a, x) in first.row(point[0], axes[0]) {
                for (b, y) in second.row(point[1], axes[1]) {
                    *row.entry([a, b]).or_insert(0.0) += x * y;
                }
            }
        }
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(energy: Energy, point: [isize; 2], axes: [Axis; 2]) -> Vec<([isize; 2], f64)> {
        energy.row(point, axes).into_iter().collect()
    }

    #[test]
    fn rows_of_grids_are_those_of_the_report() {
        use Axis::{Endless, HalfLine};
        let row = |point, axes| entries(Energy::Dirichlet, point, axes);
        let inside = [([0, 1], -1.0), ([1, 0], -1.0), ([1, 1], 4.0), ([1, 2], -1.0), ([2, 1], -1.0)];
        assert_eq!(row([1, 1], [HalfLine, HalfLine]), inside);
        let border = [([0, -1], -0.5), ([0, 0], 2.0), ([0, 1], -0.5), ([1, 0], -1.0)];
        assert_eq!(row([0, 0], [HalfLine, Endless]), border);
        assert_eq!(row([0, 0], [HalfLine, HalfLine]), [([0, 0], 1.0), ([0, 1], -0.5), ([1, 0], -0.5)]);
    }

    #[test]
    fn rows_of_curves_are_sums_of_squared_differences() {
        let row = |i, axis| {
            let row = entries(Energy::CurveBending, [i, 0], [axis, Axis::Point]);
            row.into_iter().map(|([place, _], entry)| (place, entry)).collect::<Vec<_>>()
        };
        assert_eq!(row(0, Axis::HalfLine), [(0, 1.0), (1, -2.0), (2, 1.0)]);
        assert_eq!(row(1, Axis::HalfLine), [(0, -2.0), (1, 5.0), (2, -4.0), (3, 1.0)]);
        for axis in [Axis::HalfLine, Axis::Endless] {
            assert_eq!(row(2, axis), [(0, 1.0), (1, -4.0), (2, 6.0), (3, -4.0), (4, 1.0)]);
        }
        let ends = entries(Energy::CurveDirichlet, [0, 0], [Axis::HalfLine, Axis::Point]);
        assert_eq!(ends, [([0, 0], 1.0), ([1, 0], -1.0)]);
    }
}
