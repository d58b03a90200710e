//! Layout of the page: the plane that a picture shows, the box of what is drawn, and the map from
//! data to pixels.

use crate::batch::CurveBatch;
use crate::curve::vector;
use crate::parallel;
use crate::report::Fit;
use crate::sort;
use glam::{DVec2, DVec3};

/// Larger coordinates are not drawn: their squares and differences would overflow.
const DRAWABLE: f64 = 1e150;

/// Samples a span that make the box.
///
/// The extremes of a cubic are closer to one of them than the margin is wide.
const BOX_SAMPLES: usize = 8;

/// The plane shown: that of the data in 2-D, that of the two widest principal axes in 3-D.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    origin: DVec3,
    axes: [DVec3; 2],
}

impl Plane {
    /// The plane of a batch: x to the right and y up for 2-D data.
    ///
    /// For 3-D data it has the eigenvectors of the points' covariance with the two largest
    /// eigenvalues. Curves with a problem do not count, unless all have one.
    pub fn of(batch: &CurveBatch) -> Self {
        let flat = Plane { origin: DVec3::ZERO, axes: [DVec3::X, DVec3::Y] };
        if batch.dimension() == 2 {
            return flat;
        }
        let good = |i: &usize| batch.problem(*i).is_none();
        let any = (0..batch.len()).any(|i| good(&i));
        let curves = || (0..batch.len()).filter(|i| !any || good(i));
        let points = || curves().flat_map(|i| batch.points(i).chunks_exact(3)).map(vector).filter(|&p| drawable(p));
        let (mut low, mut high, mut count) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0usize);
        points().for_each(|p| (low, high, count) = (low.min(p), high.max(p), count + 1));
        let size = (high - low).max_element();
        if count == 0 || size <= 0.0 {
            return flat;
        }
        // Scaled by the box, so that the squares neither overflow nor vanish.
        let middle = low + (high - low) * 0.5;
        let scaled = || points().map(|p| (p - middle) / size);
        let mean = scaled().sum::<DVec3>() / count as f64;
        let mut covariance = [[0.0; 3]; 3];
        for q in scaled().map(|p| (p - mean).to_array()) {
            for (i, row) in covariance.iter_mut().enumerate() {
                row.iter_mut().zip(q).for_each(|(entry, value)| *entry += q[i] * value);
            }
        }
        let [wide, second, _] = principal_axes(covariance);
        Plane { origin: middle + mean * size, axes: [wide, second] }
    }

    /// Orthographic projection. `None` for what cannot be drawn (NaN, infinite, beyond 1e150).
    pub fn project(&self, p: DVec3) -> Option<DVec2> {
        drawable(p).then(|| self.vector(p - self.origin))
    }

    /// The part of a free vector that lies in the plane.
    pub fn vector(&self, v: DVec3) -> DVec2 {
        DVec2::new(v.dot(self.axes[0]), v.dot(self.axes[1]))
    }
}

fn drawable(p: DVec3) -> bool {
    // False for NaN too.
    p.abs().to_array().iter().all(|&x| x < DRAWABLE)
}

/// Eigenvectors of a symmetric 3 × 3 matrix, largest eigenvalue first.
///
/// The method is cyclic Jacobi rotations (Golub & Van Loan, *Matrix Computations*, 8.5). The
/// largest component of each vector is positive.
fn principal_axes(mut a: [[f64; 3]; 3]) -> [DVec3; 3] {
    let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
    // Jacobi converges quadratically. A 3 × 3 matrix needs four or five sweeps. Later sweeps rotate
    // by nothing.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = tau.signum() / (tau.abs() + tau.hypot(1.0));
            let cos = 1.0 / t.hypot(1.0);
            let sin = t * cos;
            for row in &mut a {
                (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
            }
            let (rp, rq) = (a[p], a[q]);
            for k in 0..3 {
                (a[p][k], a[q][k]) = (cos * rp[k] - sin * rq[k], sin * rp[k] + cos * rq[k]);
            }
            (v[p], v[q]) = (v[p] * cos - v[q] * sin, v[p] * sin + v[q] * cos);
        }
    }
    let mut order = [0, 1, 2];
    sort::by(&mut order, |&i, &j| a[j][j].total_cmp(&a[i][i]));
    order.map(|i| {
        let widest = v[i].to_array().into_iter().max_by(|x, y| x.abs().total_cmp(&y.abs())).unwrap_or(1.0);
        v[i] * widest.signum()
    })
}

/// An axis-parallel box that grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub low: DVec2,
    pub high: DVec2,
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    pub fn with(self, p: DVec2) -> Self {
        Bounds { low: self.low.min(p), high: self.high.max(p) }
    }

    pub fn union(self, other: Self) -> Self {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The larger side. 0 if the box is empty.
    pub fn size(&self) -> f64 {
        (self.high - self.low).max_element().max(0.0)
    }

    /// The box of the points given and of the curves fitted, and for every curve whether it is
    /// outside.
    ///
    /// A curve is outside if it was not fitted and strays from the box of the fitted ones by more
    /// than the size of that box. It is not in the picture.
    pub fn of(batch: &CurveBatch, fit: &Fit, plane: &Plane) -> (Self, Vec<bool>) {
        let one = |i: usize| {
            let curve = fit.curve(i);
            let given = batch.points(i).chunks_exact(batch.dimension()).map(vector);
            let sampled = (0..curve.spans())
                .flat_map(|span| (0..=BOX_SAMPLES).map(move |k| (span, k)))
                .map(|(span, k)| curve.jet(span, k as f64 / BOX_SAMPLES as f64).point);
            given.chain(sampled).filter_map(|p| plane.project(p)).fold(Bounds::EMPTY, Bounds::with)
        };
        let boxes: Vec<(Bounds, bool)> = parallel::map(batch.len(), 1, |i| (one(i), fit.curve(i).is_fitted()));
        let of_fitted = boxes.iter().filter(|(_, fitted)| *fitted).fold(Bounds::EMPTY, |all, (own, _)| all.union(*own));
        let (low, high) = (of_fitted.low - of_fitted.size(), of_fitted.high + of_fitted.size());
        let outside = |(own, fitted): &(Bounds, bool)| {
            let strays = own.low.cmplt(low).any() || own.high.cmpgt(high).any();
            !fitted && of_fitted.size() > 0.0 && strays
        };
        let outside: Vec<bool> = boxes.iter().map(outside).collect();
        let drawn = boxes.iter().zip(&outside).filter(|(_, outside)| !**outside);
        (drawn.fold(Bounds::EMPTY, |all, ((own, _), _)| all.union(*own)), outside)
    }
}

/// The map from the plane to pixels (one scale for both axes, y up), and the page it fills.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Pixels per unit of the data.
    pub scale: f64,
    /// Left, top, right and bottom of the plot, in pixels.
    pub plot: [f64; 4],
    middle: DVec2,
}

impl Frame {
    /// Fits `bounds` into a plot `width` pixels wide that starts at `top`.
    ///
    /// The plot is between 0.15 times (flat data) and 1.25 times (tall data) as high as wide.
    pub fn fit(bounds: Bounds, width: f64, top: f64, margin: f64) -> Self {
        // An empty batch, or a single point, gets a box of its own.
        let empty = bounds.low.x > bounds.high.x;
        let middle = if empty { DVec2::ZERO } else { bounds.low + (bounds.high - bounds.low) * 0.5 };
        let side = if bounds.size() > 0.0 { bounds.size() } else { 1.0 };
        let extent = if empty { DVec2::ONE } else { (bounds.high - bounds.low).max(DVec2::splat(side * 1e-9)) };
        let inner = (width - 2.0 * margin).max(1.0);
        let height = (inner * extent.y / extent.x).clamp(0.15 * inner, 1.25 * inner);
        let scale = (inner / extent.x).min(height / extent.y);
        Frame { scale, plot: [0.0, top, width, top + height + 2.0 * margin], middle }
    }

    /// Puts the middle of `bounds` in the middle of `plot`.
    ///
    /// At this scale something `extent` large fills the plot up to `margin`. So frames of one
    /// extent and one size of plot show their data at one scale.
    pub fn inside(bounds: Bounds, extent: DVec2, plot: [f64; 4], margin: f64) -> Self {
        let middle = if bounds.low.x > bounds.high.x { DVec2::ZERO } else { bounds.low.midpoint(bounds.high) };
        let inner = (DVec2::new(plot[2] - plot[0], plot[3] - plot[1]) - 2.0 * margin).max(DVec2::ONE);
        Frame { scale: (inner / extent).min_element(), plot, middle }
    }

    /// A point of the plane in pixels.
    pub fn map(&self, p: DVec2) -> DVec2 {
        let [left, top, right, bottom] = self.plot;
        let centre = DVec2::new(0.5 * (left + right), 0.5 * (top + bottom));
        centre + (p - self.middle) * DVec2::new(self.scale, -self.scale)
    }

    /// Width times height of the plot, in square pixels.
    pub fn area(&self) -> f64 {
        (self.plot[2] - self.plot[0]) * (self.plot[3] - self.plot[1])
    }

    /// Lines of a light grid: the multiples of a round step among the values of x (or of y) in
    /// view.
    pub fn grid(&self, axis: usize, step: f64) -> Vec<f64> {
        let half = 0.5 * (self.plot[axis + 2] - self.plot[axis]) / self.scale;
        let (from, to) = (self.middle[axis] - half, self.middle[axis] + half);
        // Far from the origin a step can be below the spacing of the numbers. Then there is no
        // grid.
        let count = (to / step).floor() - (from / step).ceil();
        if !(0.0..100.0).contains(&count) || (from + step) - from < 0.5 * step {
            return Vec::new();
        }
        (0..=count as i64).map(|k| ((from / step).ceil() + k as f64) * step).collect()
    }

    /// The round step at which grid lines are at least `apart` pixels from each other.
    ///
    /// It is 1, 2 or 5 times a power of ten, or 30, which divides a circle.
    pub fn grid_step(&self, apart: f64) -> f64 {
        let least = apart / self.scale;
        let power = 10f64.powf(least.log10().floor());
        if (20.0..=30.0).contains(&least) {
            return 30.0;
        }
        [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|&step| step >= least).unwrap_or(10.0 * power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_of_a_long_flat_cloud_are_its_length_and_its_width() {
        let (long, wide) = (DVec3::new(1.0, 2.0, 2.0) / 3.0, DVec3::new(2.0, 1.0, -2.0) / 3.0);
        let thin = long.cross(wide);
        let mut points = Vec::new();
        for (a, b, c) in (0..1000).map(|k| (k % 10, k / 10 % 10, k / 100)) {
            let [a, b, c] = [a, b, c].map(|k| f64::from(k) - 4.5);
            points.push(((long * 30.0 * a + wide * 10.0 * b + thin * c) + DVec3::new(1e3, -5.0, 7.0)).to_array());
        }
        let plane = Plane::of(&CurveBatch::from_slices(&[&points[..]]).unwrap());
        assert!((plane.axes[0].dot(long).abs() - 1.0).abs() < 1e-12, "{:?}", plane.axes);
        assert!((plane.axes[1].dot(wide).abs() - 1.0).abs() < 1e-12, "{:?}", plane.axes);
    }

    #[test]
    fn the_aspect_is_kept_and_y_points_up() {
        let bounds = Bounds { low: DVec2::new(-10.0, 0.0), high: DVec2::new(10.0, 5.0) };
        let frame = Frame::fit(bounds, 420.0, 30.0, 10.0);
        assert_eq!(frame.scale, 20.0);
        assert_eq!(frame.plot, [0.0, 30.0, 420.0, 150.0]);
        assert_eq!(frame.map(DVec2::new(-10.0, 0.0)), DVec2::new(10.0, 140.0));
        assert_eq!(frame.map(DVec2::new(10.0, 5.0)), DVec2::new(410.0, 40.0));
        assert_eq!(frame.grid(0, 5.0), [-10.0, -5.0, 0.0, 5.0, 10.0]);
    }
}
