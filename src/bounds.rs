//! [`Bounds`]: an axis-aligned bounding box.

/// An axis-aligned bounding box, empty without points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds<const D: usize> {
    pub low: [f64; D],
    pub high: [f64; D],
}

impl<const D: usize> Bounds<D> {
    pub const EMPTY: Self = Bounds { low: [f64::INFINITY; D], high: [f64::NEG_INFINITY; D] };

    pub fn of(points: impl IntoIterator<Item = [f64; D]>) -> Self {
        let mut bounds = Self::EMPTY;
        for point in points {
            for (c, x) in point.into_iter().enumerate() {
                bounds.add(c, x);
            }
        }
        bounds
    }

    fn add(&mut self, axis: usize, x: f64) {
        (self.low[axis], self.high[axis]) = (self.low[axis].min(x), self.high[axis].max(x));
    }

    /// Lengths of the sides, 0 along an axis without numbers.
    pub fn sides(&self) -> [f64; D] {
        std::array::from_fn(|c| if self.low[c] <= self.high[c] { self.high[c] - self.low[c] } else { 0.0 })
    }

    /// The longest side.
    pub fn size(&self) -> f64 {
        self.sides().into_iter().fold(0.0, f64::max)
    }

    pub fn diagonal(&self) -> f64 {
        self.sides().into_iter().map(|side| side * side).sum::<f64>().sqrt()
    }

    /// The middle, without overflow. 0 along an axis without numbers.
    pub fn middle(&self) -> [f64; D] {
        std::array::from_fn(|c| if self.low[c] <= self.high[c] { 0.5 * self.low[c] + 0.5 * self.high[c] } else { 0.0 })
    }

    /// Half the longest side, without overflow.
    pub fn half_size(&self) -> f64 {
        (0..D).map(|c| 0.5 * self.high[c] - 0.5 * self.low[c]).fold(0.0, f64::max)
    }

    /// The bounds of flat coordinates in up to D dimensions. Numbers that are not finite are
    /// ignored.
    pub fn of_flat(coords: &[f64], dimension: usize) -> Self {
        let mut bounds = Self::EMPTY;
        for point in coords.chunks_exact(dimension) {
            for (c, &x) in point.iter().enumerate().filter(|(_, x)| x.is_finite()) {
                bounds.add(c, x);
            }
        }
        bounds
    }
}
