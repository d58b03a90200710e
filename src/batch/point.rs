//! [`Point`]: types of points.

/// A point of two or three coordinates: `[f64; 2]`, `[f64; 3]`, [`glam::DVec2`], [`glam::DVec3`].
pub trait Point: Copy {
    /// 2 or 3.
    const DIMENSION: usize;
    /// Appends the coordinates.
    fn push_to(self, coords: &mut Vec<f64>);
}

impl Point for [f64; 2] {
    const DIMENSION: usize = 2;
    fn push_to(self, coords: &mut Vec<f64>) {
        coords.extend(self);
    }
}

impl Point for [f64; 3] {
    const DIMENSION: usize = 3;
    fn push_to(self, coords: &mut Vec<f64>) {
        coords.extend(self);
    }
}

impl Point for glam::DVec2 {
    const DIMENSION: usize = 2;
    fn push_to(self, coords: &mut Vec<f64>) {
        coords.extend(self.to_array());
    }
}

impl Point for glam::DVec3 {
    const DIMENSION: usize = 3;
    fn push_to(self, coords: &mut Vec<f64>) {
        coords.extend(self.to_array());
    }
}
