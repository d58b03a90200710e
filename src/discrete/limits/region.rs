//! [`Region`]: a region that curves stay within or out of.

use glam::DVec2;

use crate::discrete::energy::RegionPenalty;
use crate::error::{Error, Result};
use crate::linalg::scalar::{Vector, dot, scale, subtract};

/// A region of the plane or of space that curves stay within.
///
/// In the plane the third coordinate is 0 or NaN. Lengths are in units of the input.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Region {
    /// n·f ≤ b
    HalfSpace {
        /// n, of any length except 0.
        normal: [f64; 3],
        /// b, in units of n·f.
        offset: f64,
    },
    /// |f − o| ≤ r
    Inside {
        /// o
        center: [f64; 3],
        /// r > 0
        radius: f64,
    },
    /// |f − o| ≥ r
    Outside {
        /// o
        center: [f64; 3],
        /// r > 0
        radius: f64,
    },
}

impl Region {
    /// Checks the numbers of the region.
    ///
    /// # Errors
    /// A normal of length 0. A radius that is not positive. A number that is not finite. A third
    /// coordinate in the plane, or none in space.
    pub(super) fn check(&self, dimension: usize) -> Result<()> {
        let (Region::HalfSpace { normal: vector, offset: number }
        | Region::Inside { center: vector, radius: number }
        | Region::Outside { center: vector, radius: number }) = *self;
        let refuse = |why: String| Err(Error::argument(why));
        if dimension == 3 && vector[2].is_nan() {
            return refuse(format!("{self}: curves in space need a third coordinate"));
        }
        if !(vector[..dimension].iter().all(|x| x.is_finite()) && number.is_finite()) {
            return refuse(format!("{self}: its numbers must be finite"));
        }
        if dimension == 2 && vector[2] != 0.0 && !vector[2].is_nan() {
            return refuse(format!("{self}: planar curves have no third coordinate"));
        }
        let square: f64 = vector[..dimension].iter().map(|x| x * x).sum();
        match self {
            Region::HalfSpace { .. } if !(square > 0.0 && square.is_finite()) => {
                refuse(format!("{self}: a normal of length {} has no direction", square.sqrt()))
            }
            Region::Inside { radius, .. } | Region::Outside { radius, .. } if *radius <= 0.0 => {
                refuse(format!("{self}: the radius must be positive"))
            }
            _ => Ok(()),
        }
    }

    /// The signed distance of a point from the region, in units of the input; negative inside.
    pub(in crate::discrete) fn excess<const D: usize>(&self, point: Vector<f64, D>) -> f64 {
        match *self {
            Region::HalfSpace { normal, offset } => {
                let normal = first::<D>(normal);
                (dot(normal, point) - offset) / dot(normal, normal).sqrt()
            }
            Region::Inside { center, radius } => distance(point, first(center)) - radius,
            Region::Outside { center, radius } => radius - distance(point, first(center)),
        }
    }

    /// Whether it is a disc to stay out of that an edge cuts, by more than rounding.
    pub(super) fn is_cut_by(&self, [a, b]: [DVec2; 2]) -> bool {
        let Region::Outside { center: [x, y, _], radius } = *self else { return false };
        let (way, center) = (b - a, DVec2::new(x, y));
        let part = ((center - a).dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        center.distance(a + part * way) < radius * (1.0 - 1e-9)
    }

    /// The region as a constraint on a curve of size 1, relative to the point `from`.
    ///
    /// `unit` is the length that a half-space constraint is measured in.
    pub(in crate::discrete) fn form<const D: usize>(
        &self,
        from: Vector<f64, D>,
        size: f64,
        unit: f64,
    ) -> RegionConstraint<D> {
        let at = |center: [f64; 3]| scale(1.0 / size, subtract(first::<D>(center), from));
        let disc = |center: [f64; 3], bend: f64, offset: f64| RegionConstraint {
            penalty: RegionPenalty { foot: at(center), bend, ..RegionPenalty::NONE },
            offset,
        };
        match *self {
            Region::HalfSpace { normal, offset } => {
                let normal = first::<D>(normal);
                let length = dot(normal, normal).sqrt();
                let axis = scale(1.0 / length, normal);
                RegionConstraint::half_plane(scale((offset / length - dot(axis, from)) / size, axis), axis, unit)
            }
            Region::Inside { center, radius } => disc(center, (radius / size).powi(-2), 0.5),
            Region::Outside { center, radius } => disc(center, -(radius / size).powi(-2), -0.5),
        }
    }
}

impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = match *self {
            Region::HalfSpace { normal, .. } => normal,
            Region::Inside { center, .. } | Region::Outside { center, .. } => center,
        };
        let vector = if z == 0.0 || z.is_nan() { format!("({x}, {y})") } else { format!("({x}, {y}, {z})") };
        match *self {
            Region::HalfSpace { offset, .. } => write!(f, "the half-plane {vector}·f ≤ {offset}"),
            Region::Inside { radius, .. } => write!(f, "the disc of radius {radius} around {vector} to stay within"),
            Region::Outside { radius, .. } => write!(f, "the disc of radius {radius} around {vector} to stay out of"),
        }
    }
}

/// A limit c = o − q ≥ 0 on the q of a [`RegionPenalty`]. The penalty has no multiplier and no
/// stiffness yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::discrete) struct RegionConstraint<const D: usize> {
    /// Its foot is relative to the first vertex of the start.
    pub penalty: RegionPenalty<f64, D>,
    /// o
    pub offset: f64,
}

impl<const D: usize> RegionConstraint<D> {
    /// The constraint on a vertex next to an edge of length h = `edge`.
    ///
    /// A disc to stay out of grows to the radius √(r² + h²/4): an edge between two vertices at this
    /// distance touches the disc at its midpoint.
    pub fn beside(self, edge: f64) -> Self {
        let RegionPenalty { bend, .. } = self.penalty;
        match bend < 0.0 {
            true => RegionConstraint {
                penalty: RegionPenalty { bend: -1.0 / (0.25 * edge * edge - 1.0 / bend), ..self.penalty },
                ..self
            },
            false => self,
        }
    }

    /// [`beside`](Self::beside) for a vertex next to a pinned one. An edge from a pinned vertex within the grown
    /// disc must not cut the disc either: the vertex stays beyond the tangent to the disc through the pinned
    /// vertex that is nearer to it. `ends` are the positions of the pinned vertex and of this one.
    pub fn next_to(self, edge: f64, ends: [Vector<f64, D>; 2]) -> Self {
        let grown = self.beside(edge);
        let from_pinned = |x: Vector<f64, D>| subtract(x, ends[0]);
        let [to_center, to_own] = [from_pinned(self.penalty.foot), from_pinned(ends[1])];
        let square = dot(to_center, to_center);
        if !(self.penalty.bend < 0.0 && square < -1.0 / grown.penalty.bend && square > 0.0) {
            return grown;
        }
        let (distance, radius) = (square.sqrt(), (-1.0 / self.penalty.bend).sqrt());
        let across = subtract(to_own, scale(dot(to_own, to_center) / square, to_center));
        let width = dot(across, across).sqrt().max(f64::MIN_POSITIVE);
        let cos = (radius / distance).min(1.0);
        // Towards the centre, and away from the side on which the vertex is.
        let sin = (1.0 - cos * cos).sqrt();
        let axis = subtract(scale(cos / distance, to_center), scale(sin / width, across));
        RegionConstraint::half_plane(ends[0], axis, radius)
    }

    /// n·(f − p) ≤ 0, for a unit vector n and a point p of the boundary. `unit` is the length that
    /// it is measured in.
    pub fn half_plane(foot: Vector<f64, D>, axis: Vector<f64, D>, unit: f64) -> Self {
        RegionConstraint {
            penalty: RegionPenalty { foot, axis, plane: 1.0 / unit, ..RegionPenalty::NONE },
            offset: 0.0,
        }
    }

    /// The region within `width` of a chord.
    pub fn corridor(from: Vector<f64, D>, chord: Vector<f64, D>, width: f64) -> Self {
        let span = dot(chord, chord).sqrt();
        let axis = if span > 0.0 { scale(1.0 / span, chord) } else { [0.0; D] };
        RegionConstraint {
            penalty: RegionPenalty { foot: from, axis, span, bend: width.powi(-2), ..RegionPenalty::NONE },
            offset: 0.5,
        }
    }
}

fn first<const D: usize>(x: [f64; 3]) -> Vector<f64, D> {
    std::array::from_fn(|c| x[c])
}

fn distance<const D: usize>(a: Vector<f64, D>, b: Vector<f64, D>) -> f64 {
    let away = subtract(a, b);
    dot(away, away).sqrt()
}
