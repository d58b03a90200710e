//! The Dirichlet energy of a grid, and the residual of the equations E₂ₙp = UEₙp₀.

/// Points of a grid, `dimension` values each, row by row.
#[derive(Clone, Copy)]
pub(super) struct Grid<'a> {
    pub dimension: usize,
    pub shape: [usize; 2],
    pub values: &'a [f64],
}

impl Grid<'_> {
    fn at(&self, row: usize, column: usize, c: usize) -> f64 {
        self.values[(row * self.shape[1] + column) * self.dimension + c]
    }

    /// Weight of the edges along a row (column): ½ at a border, else 1.
    ///
    /// A grid of one row has no borders along it.
    fn weight(&self, axis: usize, line: usize) -> f64 {
        let last = self.shape[axis] - 1;
        if last > 0 && (line == 0 || line == last) { 0.5 } else { 1.0 }
    }

    /// An entry of Ep.
    fn force(&self, row: usize, column: usize, c: usize) -> f64 {
        let here = self.at(row, column, c);
        let (along_row, along_column) = (self.weight(0, row), self.weight(1, column));
        let mut force = 0.0;
        if row > 0 {
            force += along_column * (here - self.at(row - 1, column, c));
        }
        if row + 1 < self.shape[0] {
            force += along_column * (here - self.at(row + 1, column, c));
        }
        if column > 0 {
            force += along_row * (here - self.at(row, column - 1, c));
        }
        if column + 1 < self.shape[1] {
            force += along_row * (here - self.at(row, column + 1, c));
        }
        force
    }

    /// The factor of U: 1 for surfaces, ½ for a grid of one row.
    ///
    /// The energy of a line doubles with its number of points.
    fn upsampling(&self) -> f64 {
        if self.shape.contains(&1) { 0.5 } else { 1.0 }
    }
}

/// The Dirichlet energy pᵀEp of a grid.
///
/// It is Σ w · |difference|² over all edges between neighbours, with w = 1, or ½ at the border,
/// summed over the `dimension` values of a point. Its unit is the squared unit of the values. For a
/// piecewise linear function on triangles it is ∫|∇p|².
///
/// ```
/// use faircurve::laplacian::energy;
/// // A plane that rises by 1 a column over two squares: ∫|∇p|² = 2.
/// assert_eq!(energy(1, [2, 3], &[0.0, 1.0, 2.0, 0.0, 1.0, 2.0]), 2.0);
/// ```
///
/// # Panics
/// If there are not `dimension` values per point.
pub fn energy(dimension: usize, shape: [usize; 2], values: &[f64]) -> f64 {
    assert_eq!(values.len(), dimension * shape[0] * shape[1], "values of a grid of {shape:?}");
    let grid = Grid { dimension, shape, values };
    let edges = |axis: usize| {
        let mut sum = 0.0;
        for row in 0..shape[0] - usize::from(axis == 0 && shape[0] > 0) {
            for column in 0..shape[1] - usize::from(axis == 1 && shape[1] > 0) {
                let next = if axis == 0 { [row + 1, column] } else { [row, column + 1] };
                let weight = grid.weight(1 - axis, [row, column][1 - axis]);
                let square = |c| (grid.at(next[0], next[1], c) - grid.at(row, column, c)).powi(2);
                sum += weight * (0..dimension).map(square).sum::<f64>();
            }
        }
        sum
    };
    edges(0) + edges(1)
}

/// The residual of a grid p as a subdivision of p₀ in r `rounds`: the largest entry of |E p − UʳE
/// p₀|.
///
/// p has (rows − 1) · 2ʳ + 1 rows, and columns likewise. Rounding alone gives some ε times the
/// largest value.
///
/// # Panics
/// If the shapes or the numbers of values do not match.
pub fn residual(dimension: usize, shape: [usize; 2], coarse: &[f64], fine: &[f64], rounds: u32) -> f64 {
    let fine_shape = super::refine::refined(shape, rounds).expect("grids that are in memory have a shape");
    assert_eq!(coarse.len(), dimension * shape[0] * shape[1], "values of the coarse grid");
    assert_eq!(fine.len(), dimension * fine_shape[0] * fine_shape[1], "values of the fine grid");
    let coarse = Grid { dimension, shape, values: coarse };
    let fine = Grid { dimension, shape: fine_shape, values: fine };
    let step = 1 << rounds;
    let factor = coarse.upsampling().powi(rounds as i32);
    let mut largest = 0.0f64;
    for row in 0..fine_shape[0] {
        for column in 0..fine_shape[1] {
            let is_old = row % step == 0 && column % step == 0;
            for c in 0..dimension {
                let wanted = if is_old { factor * coarse.force(row / step, column / step, c) } else { 0.0 };
                let difference = fine.force(row, column, c) - wanted;
                // A NaN stays.
                largest = if difference.abs() > largest || difference.is_nan() { difference.abs() } else { largest };
            }
        }
    }
    largest
}
