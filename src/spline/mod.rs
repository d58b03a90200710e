//! Natural cubic splines (Warren & Weimer, *Subdivision Methods for Geometric Design*, chapter 6).

mod cubic;
mod energy;
mod gpu;
pub(crate) mod knots;
mod natural;
mod polylines;
mod reinsch;
mod sample;
mod smoother;
mod smoothing;
mod smoothing_gpu;
mod subdivide;
pub mod uniform;
mod uniform_gpu;

pub use cubic::CubicSplines;
pub(crate) use gpu::GROUP;
pub use knots::Parametrisation;
pub use natural::{Ends, Natural};
pub use smoothing::{Amount, LAMBDA_CAP, Smoothing};
pub(crate) use smoothing_gpu::kernel as smoothing_kernel;

use crate::gpu::source::Definitions;

/// Shader files of this room that give the ring kernels their rows.
pub(crate) fn row_sources() -> Vec<(&'static str, Definitions)> {
    ["spline/natural.wgsl", "spline/uniform.wgsl"].map(|path| (path, Definitions::new())).to_vec()
}

/// The other kernels of this room: files and entry points.
pub(crate) const KERNELS: [(&str, &[&str]); 3] = [
    ("spline/sample.wgsl", &["per_span", "at_sites"]),
    ("spline/subdivide.wgsl", &["subdivide", "interpolated"]),
    ("spline/energy.wgsl", &["discrete_energy", "exact_product"]),
];
