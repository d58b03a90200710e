//! The surface F = 0 in the coordinates of problems: [`Local`] for one curve, and
//! [`Implicit`] for all lanes.

// Loops over coordinates and lanes by index match the formulas, and keep the code vectorised.
#![allow(clippy::needless_range_loop)]

use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::discrete::block::{Block, times};
use crate::discrete::compose::SURFACE_TABLE;
use crate::gpu::plan::Limits;
use crate::linalg::scalar::{Vector, add, dot, number, scale};
use crate::linalg::{Real, Scalar};
use crate::precision::Precision;
use crate::surface::{Surface, SurfaceKernel, normal};

/// A surface in the coordinates (x − origin)/size of one problem.
#[derive(Clone, Debug)]
pub(crate) struct Local {
    pub surface: Arc<dyn Surface>,
    pub origin: [f64; 3],
    pub size: f64,
}

/// The storage bindings of a kernel whose surface code reads a table.
const BINDINGS: u32 = 9;

/// Whether there are kernels for curves in a surface: for quadrics, and in f64 for surfaces with
/// WGSL code. If the code reads a table, the device must have enough bindings.
pub(in crate::discrete) fn has_kernel(surface: &dyn Surface, precision: Precision, limits: &Limits) -> bool {
    let is_bound = |text: String| !text.contains(SURFACE_TABLE) || limits.storage_bindings >= BINDINGS;
    surface.kind().quadric().is_some()
        || (precision == Precision::F64 && surface.kernel().map(SurfaceKernel::text).is_some_and(is_bound))
}

/// The implicit function F of every lane.
pub(super) enum Implicit<S, const D: usize> {
    /// ½ yᵀA y + b·y + c
    Quadric {
        matrix: Block<S, D>,
        linear: Vector<S, D>,
        constant: S,
    },
    Other(Vec<Local>),
}

impl Local {
    /// The position in space of a point of the problem.
    fn place<const D: usize>(&self, y: Vector<f64, D>) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|c| self.origin[c] + self.size * y[c]))
    }

    /// The numbers of a curve for kernels: the columns of A, b and c, or the origin and the size.
    pub fn numbers(&self) -> Vec<f64> {
        match self.quadric() {
            Some((matrix, linear, constant)) => [&matrix.to_cols_array()[..], &linear.to_array(), &[constant]].concat(),
            None => [&self.origin[..], &[self.size]].concat(),
        }
    }

    /// A, b and c of F at size 1, scaled so that the gradient at the origin has length 1.
    fn quadric(&self) -> Option<(DMat3, DVec3, f64)> {
        let quadric = self.surface.kind().quadric()?;
        let origin = DVec3::from_array(self.origin);
        let (gradient, size) = (quadric.gradient(origin), self.size);
        let unit = size * gradient.length();
        Some((quadric.matrix * (size * size / unit), gradient * (size / unit), quadric.value(origin) / unit))
    }

    /// n at a point of the problem.
    pub fn normal<const D: usize>(&self, y: Vector<f64, D>) -> Vector<f64, D> {
        let normal = normal(&*self.surface, self.place(y));
        std::array::from_fn(|c| normal[c])
    }

    /// n, W and F/|∇F| at a point of the problem.
    fn jet<const D: usize>(&self, y: Vector<f64, D>) -> (DVec3, DMat3, f64) {
        let x = self.place(y);
        let (value, gradient, hessian) = self.surface.jet(x);
        let length = gradient.length();
        (gradient / length, hessian * (self.size / length), value / (length * self.size))
    }

    /// The vector from a point of the problem to its projection onto the surface.
    fn way<const D: usize>(&self, y: Vector<f64, D>) -> Vector<f64, D> {
        let x = self.place(y);
        // If the projection fails the result is NaN, and the trial is rejected.
        let foot = self.surface.project(x).unwrap_or(DVec3::NAN);
        let way = ((foot - x) / self.size).to_array();
        std::array::from_fn(|c| way[c])
    }

    /// The derivative of ∇²F along a vector of the problem, over |∇F|.
    fn third<const D: usize>(&self, y: Vector<f64, D>, along: Vector<f64, D>) -> [[f64; 3]; 3] {
        let x = self.place(y);
        let along = DVec3::from_array(std::array::from_fn(|c| along[c]));
        let unit = self.size * self.size / self.surface.gradient(x).length();
        (self.surface.third(x, along) * unit).to_cols_array_2d()
    }
}

/// A vector of one lane in f64.
pub(super) fn lane_of<S: Scalar, const D: usize>(x: &Vector<S, D>, lane: usize) -> Vector<f64, D> {
    std::array::from_fn(|c| x[c].lane(lane).to_f64())
}

impl<S: Scalar, const D: usize> Implicit<S, D> {
    pub(super) fn new(lanes: &[&Local]) -> Self {
        let quadrics: Option<Vec<_>> = lanes.iter().map(|local| local.quadric()).collect();
        let Some(quadrics) = quadrics else {
            return Implicit::Other(lanes.iter().map(|local| (*local).clone()).collect());
        };
        let (mut matrix, mut linear, mut constant) = ([[S::ZERO; D]; D], [S::ZERO; D], S::ZERO);
        for (lane, (a, b, c)) in quadrics.into_iter().enumerate() {
            constant.set_lane(lane, number::<S>(c));
            for row in 0..D {
                linear[row].set_lane(lane, number::<S>(b[row]));
                (0..D).for_each(|column| matrix[row][column].set_lane(lane, number::<S>(a.col(column)[row])));
            }
        }
        Implicit::Quadric { matrix, linear, constant }
    }

    /// A, for quadrics.
    #[inline(always)]
    pub(super) fn matrix(&self) -> Option<&Block<S, D>> {
        match self {
            Implicit::Quadric { matrix, .. } => Some(matrix),
            Implicit::Other(_) => None,
        }
    }

    /// n and 1/|∇F| at a position, for quadrics.
    #[inline(always)]
    pub(super) fn slope(&self, y: Vector<S, D>) -> Option<(Vector<S, D>, S)> {
        let Implicit::Quadric { matrix, linear, .. } = self else { return None };
        let gradient = add(times(matrix, y), *linear);
        let inverse = S::ONE / dot(gradient, gradient).sqrt();
        Some((scale(inverse, gradient), inverse))
    }

    /// n and W at a position, for surfaces other than quadrics.
    pub(super) fn jet(&self, y: Vector<S, D>) -> (Vector<S, D>, Block<S, D>) {
        match self {
            Implicit::Quadric { .. } => unreachable!("quadrics have a slope"),
            Implicit::Other(lanes) => Self::jet_of_any(lanes, y),
        }
    }

    #[inline(never)]
    fn jet_of_any(lanes: &[Local], y: Vector<S, D>) -> (Vector<S, D>, Block<S, D>) {
        let (mut normal, mut shape) = (y, [y; D]);
        for (lane, local) in lanes.iter().enumerate() {
            let (n, w, _) = local.jet(lane_of(&y, lane));
            for a in 0..D {
                normal[a].set_lane(lane, number::<S>(n[a]));
                (0..D).for_each(|b| shape[a][b].set_lane(lane, number::<S>(w.col(b)[a])));
            }
        }
        (normal, shape)
    }

    /// The vector from a position to the surface along ∇F.
    #[inline(always)]
    pub(super) fn way(&self, y: Vector<S, D>) -> Vector<S, D> {
        match self {
            Implicit::Quadric { matrix, linear, constant } => {
                let product = times(matrix, y);
                let gradient = add(product, *linear);
                let value = dot(y, add(scale(S::of(0.5), product), *linear)) + *constant;
                // Solves ½ a t² + s t + F = 0 along y + t ∇F. Without a root the result is NaN, and
                // the trial is rejected.
                let square = dot(gradient, gradient);
                let bend = dot(gradient, times(matrix, gradient));
                let root = (square * square - S::of(2.0) * bend * value).sqrt();
                scale(-S::of(2.0) * value / (square + root), gradient)
            }
            Implicit::Other(lanes) => Self::way_of_any(lanes, y),
        }
    }

    #[inline(never)]
    fn way_of_any(lanes: &[Local], y: Vector<S, D>) -> Vector<S, D> {
        let mut way = y;
        for (lane, local) in lanes.iter().enumerate() {
            let own = local.way(lane_of(&y, lane));
            (0..D).for_each(|c| way[c].set_lane(lane, number::<S>(own[c])));
        }
        way
    }

    /// The derivative of ∇²F along a vector, over |∇F|.
    #[inline(always)]
    pub(super) fn third(&self, y: Vector<S, D>, along: Vector<S, D>) -> Block<S, D> {
        match self {
            Implicit::Quadric { .. } => [[S::ZERO; D]; D],
            Implicit::Other(lanes) => Self::third_of_any(lanes, y, along),
        }
    }

    #[inline(never)]
    fn third_of_any(lanes: &[Local], y: Vector<S, D>, along: Vector<S, D>) -> Block<S, D> {
        let mut third = [y; D];
        for (lane, local) in lanes.iter().enumerate() {
            let own = local.third(lane_of(&y, lane), lane_of(&along, lane));
            for a in 0..D {
                (0..D).for_each(|b| third[a][b].set_lane(lane, number::<S>(own[b][a])));
            }
        }
        third
    }
}
