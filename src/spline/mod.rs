//! Cubic splines of a whole batch.
//!
//! | | |
//! |---|---|
//! | [`Natural`] | through every point, on each curve's own knots; ends natural, clamped or periodic (de Boor, *A Practical Guide to Splines*, chapter IV) |
//! | [`Smoothing`] | near the points, by λ or by a largest deviation (Reinsch 1967) |
//! | [`uniform`] | on the integers, as a subdivision system (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6) |
//!
//! The first two return [`CubicSplines`], knots with points and second derivatives, behind a
//! [`Fit`](crate::Fit). Each runs on the CPU in f64, or on a GPU in f32 or f64 with every curve
//! normalised, in f64, to its own centre and size. The host computes numbers beyond the range of
//! the GPU's floats, samples' parameters at equal arc lengths, and smoothing of curves that are
//! long (more than 1,024 knots) or beyond the GPU's precision.
//!
//! | file | idea |
//! |---|---|
//! | `knots` | parameters and distinct knots of a batch |
//! | `natural` | the tridiagonal systems |
//! | `shape` | refits of splines that turn to other sides than their polygon |
//! | `smoothing`, `smoothing_fit`, `smoother` | options; batches; one curve, normalised and back |
//! | `reinsch` | the normalised system of one λ, the twin of the kernel |
//! | `tube`, `tube_rows` | the least curve within a distance: interior-point method, and its linear algebra |
//! | `cubic`, `sample`, `polylines` | the result, its polynomials, its samples |
//! | `in_surface` | splines in a surface |
//! | `piecewise` | polynomials of any number of columns and any conditions at the ends |

mod band;
mod costs;
mod cubic;
mod ends;
mod energy;
mod gpu;
mod in_surface;
pub(crate) mod knots;
mod natural;
mod packing;
mod piecewise;
mod polylines;
mod reinsch;
mod sample;
mod shape;
mod smoother;
mod smoothing;
mod smoothing_fit;
mod smoothing_gpu;
mod subdivide;
mod tube;
mod tube_rows;
pub mod uniform;
mod uniform_gpu;

pub use band::{Band, Corners};
pub use cubic::CubicSplines;
pub use ends::{EndCondition, Ends};
pub(crate) use gpu::{GROUP, ResidentSplines};
pub use in_surface::SurfaceSpline;
pub use knots::Parametrisation;
pub use natural::Natural;
pub use piecewise::{Extrapolate, Knotted, Piecewise};
pub use smoothing::{LAMBDA_CAP, LEAST_SHARE, LEAST_SHARE_OF_LAMBDA, Smoothing, SmoothingTarget};
pub(crate) use smoothing_gpu::kernel as smoothing_kernel;

/// The shader file of this room that gives the ring kernels their rows.
pub(crate) const ROW_SOURCE: &str = "spline/natural.wgsl";

/// The other kernels of this room: files and entry points.
pub(crate) const KERNELS: [(&str, &[&str]); 4] = [
    ("spline/rate.wgsl", &["rate", "stream"]),
    ("spline/sample.wgsl", &["per_span", "evenly", "at_sites"]),
    ("spline/subdivide.wgsl", &["subdivide", "interpolated"]),
    ("spline/energy.wgsl", &["discrete_energy", "exact_product"]),
];

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::costs::RateParams;
    use super::gpu::SampleParams;
    use super::smoothing_gpu::{SmoothingCurve, SmoothingParams};
    use super::uniform_gpu::{Block, UniformCurve, UniformParams};
    use super::*;
    use crate::gpu::KernelKey;
    use crate::gpu::reflect::assert_layout;
    use crate::gpu::source::definitions;
    use crate::precision::Precision;

    #[test]
    fn structs_shared_with_the_kernels_have_their_layout() {
        let key = |path, entry| {
            let definitions = definitions([("GROUP", &GROUP)]);
            KernelKey { path, entry, precision: Precision::F32, definitions }
        };
        let sample = key("spline/sample.wgsl", "per_span");
        assert_layout!(sample, SampleParams { count, each, dimension });
        let rate = key("spline/rate.wgsl", "rate");
        assert_layout!(rate, RateParams { count, turns });
        let energy = key("spline/energy.wgsl", "discrete_energy");
        assert_layout!(energy, UniformParams { curves, points, dimension, blocks });
        assert_layout!(energy, Block { curve, begin, end, padding });
        assert_layout!(energy, UniformCurve { start, count, closed, padding });
        let smoothing = smoothing_kernel(Precision::F32, 2);
        assert_layout!(smoothing, SmoothingParams { curves, dimension });
        assert_layout!(smoothing, SmoothingCurve { start, count, flags, padding });
    }
}
