//! Fair curves by the thousand: fits smooth curves to ragged batches of point lists.
//!
//! A fit runs on all threads of the CPU in f64, or on a GPU through wgpu in f32 or f64.
//!
//! ```text
//! file ─ io::read ─► CurveBatch ─► a method's fit ─► Fit: curves + one CurveReport per curve
//!                                   on a Device          │
//!                                     polylines, beziers ▼
//!                                      CurveBatch ─ io::write ─► file
//! ```
//!
//! * [`CurveBatch`]: point lists of any lengths, 2-D or 3-D, open or closed, with names,
//!   parameters, weights and [`Constraints`]. [`io`] reads and writes CSV, GeoJSON, SVG and NPZ.
//! * A method is a struct of options. Its `fit` returns a [`Fit`]. Its `fit_sampled` also returns
//!   samples, taken by the same device.
//! * [`spline::Natural`] goes through every point, [`spline::Smoothing`] near them.
//!   [`discrete::Fair`] minimises an energy of your choice (length, bending, variation of
//!   curvature, …). [`scf::Smooth`] minimises ∫|κ|^ν ds, exactly.
//! * [`bezier::Complete`] finds missing control points of Bézier curves by least energy.
//!   [`bezier::Chain`] does so for chains of Béziers. [`bezier`] elevates, reduces, divides,
//!   evaluates and measures millions of control polygons in one call.
//! * [`laplacian::Subdivide`] refines grids of control points to surfaces of least Dirichlet
//!   energy, exactly or by rules of small support. [`io::grids`] reads and writes grids.
//! * A [`Fit`] holds a [`Curve`] and a [`CurveReport`] for each curve, whatever the method. A curve
//!   that cannot be fitted gets a [`CurveStatus`] and a sentence, is returned as its input and does
//!   not affect its neighbours. An [`Error`] concerns the whole run.
//! * [`linalg`] has the solvers underneath, [`picture`] draws a fit, [`gpu`] opens adapters.
//!
//! # A fit
//!
//! ```
//! use faircurve::{CurveBatch, CurveStatus, Device, Sampling, spline::Natural};
//!
//! let zigzag = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]];
//! let corner = [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]];
//! let point = [[5.0, 5.0]];
//! let batch = CurveBatch::from_slices(&[&zigzag[..], &corner[..], &point[..]])?;
//! let fit = Natural::default().fit(&batch, &Device::cpu())?;
//! assert_eq!(fit.reports()[2].status, CurveStatus::Degenerate);
//!
//! // 16 segments per span: three spans make 49 points, two make 33. The single point is returned as it is.
//! let polylines = fit.polylines(Sampling::PerSpan(16));
//! assert_eq!([polylines.count(0), polylines.count(1), polylines.count(2)], [49, 33, 1]);
//! assert!(fit.curve(0).length() > 3.0 * 2f64.sqrt());
//! # Ok::<(), faircurve::Error>(())
//! ```
//!
//! # Tridiagonal systems
//!
//! ```
//! use faircurve::{Device, linalg::{Cyclic, Matrix, TridiagonalBatch, solve_tridiagonal_batch}};
//!
//! // Two systems, of three rows and of two: −1 2 −1.
//! let systems = TridiagonalBatch {
//!     matrix: Matrix::Bands { lower: &[-1.0; 5], diagonal: &[2.0; 5], upper: &[-1.0; 5] },
//!     offsets: &[0, 3, 5],
//!     cyclic: Cyclic::None,
//! };
//! let solutions = solve_tridiagonal_batch(&systems, &[1.0; 5], 1, &Device::cpu())?;
//! let wanted = [1.5, 2.0, 1.5, 1.0, 1.0];
//! assert!(solutions.x.iter().zip(wanted).all(|(x, wanted): (&f64, _)| (x - wanted).abs() < 1e-14));
//! # Ok::<(), faircurve::Error>(())
//! ```
//!
//! # Devices
//!
//! ```
//! use faircurve::{Choice, Device, Precision, Work};
//!
//! // The CPU, or a hardware GPU if it is faster for this number of points, read and written together.
//! let device = Device::choose(Choice::Auto, &Work::splines(20_000))?.with_precision(Precision::Auto);
//! println!("{}: {}", device.name(), device.reason());
//!
//! // A missing GPU is an error, never a silent fallback.
//! match Device::gpu(0) {
//!     Ok(gpu) => println!("{}", gpu.name()),
//!     Err(error) => println!("{error}"),
//! }
//! # Ok::<(), faircurve::Error>(())
//! ```
//!
//! # Units and signs
//!
//! - Coordinates, lengths, deviations and tolerances are in the units of the input. Curvatures are
//!   in 1/length.
//! - Parameters t are the batch's own, or else sums of chord lengths. Derivatives are with respect
//!   to t. The energy of a spline is ∫|p″|² dt.
//! - The curvature of a planar curve is positive where the curve turns left (x right, y up). The
//!   curvature of a 3-D curve is not signed.
//! - Offsets count points. Coordinates are flat: point k of curve i starts at `(offsets[i] + k) ·
//!   dimension`.
//!
//! # Accuracy
//!
//! The CPU path in f64 is the reference. GPUs are held to 2e-6 of a curve's size in f32 and 1e-12
//! in f64 for splines, Béziers and grids, and to 1e-5 and 1e-9 for fair curves and smooth
//! connection functions. Arc lengths and largest curvatures have relative errors of 1e-9: see
//! [`Curve::length`] and [`Curve::max_curvature`]. `docs/accuracy.md` has the details, and
//! `docs/limits.md` the limits of devices.
//!
//! The same batch on the same device gives the same bits. A curve's bits do not depend on its
//! neighbours.
#![warn(missing_docs)]

// The program is written as its users write theirs.
#[cfg(feature = "cli")]
extern crate self as faircurve;

#[doc(hidden)]
pub mod arclength;
mod batch;
pub mod bezier;
mod bounds;
mod catalogue;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
mod constraint;
mod curve;
mod damping;
mod deviation;
mod device;
pub mod discrete;
mod error;
pub mod gpu;
mod grids;
mod ground;
#[cfg(feature = "formats")]
pub mod io;
pub mod laplacian;
pub mod linalg;
mod memory;
mod motion;
mod numbers;
mod parallel;
#[cfg(feature = "picture")]
pub mod picture;
mod precision;
mod ragged;
mod report;
pub mod scf;
mod sides;
mod sort;
pub mod spline;
mod status;
pub mod surface;
pub mod topology;
pub mod tracks;
mod width;
mod words;

pub use batch::{Column, CurveBatch, Point, Unfitted, Values};
#[doc(hidden)]
pub use catalogue::kernels;
pub use constraint::{Constraint, Constraints};
pub use curve::{Curve, Jet, Sampling};
pub use deviation::Deviation;
#[doc(hidden)]
pub use device::Costs;
pub use device::{Choice, Device, DeviceReport, Stopped, Work};
pub use error::{Error, Result};
pub use grids::Grids;
#[doc(hidden)]
pub use motion::Motion;
pub use precision::Precision;
pub use report::{CurveReport, CurveSet, Fit, LimitReport};
pub use status::CurveStatus;

/// The examples of the README and of the site's page on Rust compile.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/rust.md")]
    struct Page;
}
