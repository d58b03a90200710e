//! Fair curves by the thousand: fits smooth curves to ragged batches of point lists.
//!
//! A fit runs on all threads of the CPU in f64, or on a GPU through wgpu in f32 or f64.
//!
//! ```text
//! file ─ io::read ─► CurveBatch ─► a method's fit ─► Fit: curves + one CurveReport a curve
//!                                   on a Device          │
//!                                     polylines, beziers ▼
//!                                      CurveBatch ─ io::write ─► file
//! ```
//!
//! * [`CurveBatch`]: many point lists, 2-D or 3-D, each of its own length, open or closed, with
//!   names, parameters, weights and [`Constraints`]. [`io`] reads and writes CSV, GeoJSON, SVG and
//!   NPZ.
//! * A method is a struct of options. Its `fit` returns a [`Fit`]. Its `fit_sampled` returns the
//!   samples too, taken by the same device.
//! * [`spline::Natural`] goes through every point, [`spline::Smoothing`] near them.
//!   [`discrete::Fair`] makes an energy of your choice least (length, bending, variation of
//!   curvature, …). [`scf::Smooth`] makes ∫|κ|^ν ds least, exactly.
//! * [`bezier::Complete`] finds the control points that a Bézier curve lacks, those of least
//!   energy. [`bezier::Chain`] does so for chains of Béziers. [`bezier`] elevates, reduces,
//!   divides, evaluates and measures millions of control polygons in one call.
//! * [`laplacian::Subdivide`] refines grids of control points to the surfaces of least Dirichlet
//!   energy, exactly or by rules of small support. [`io::grids`] reads and writes grids.
//! * A [`Fit`] holds [`Curve`]s and a [`CurveReport`] each. Curves are sampled, differentiated and
//!   measured alike, whatever the method. A curve that cannot be fitted has a [`CurveStatus`] and a
//!   sentence, comes out as its input and changes no bit of its neighbours. An [`Error`] is for
//!   what concerns the whole run.
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
//! // 16 segments a span: three spans make 49 points, two make 33, and what was not fitted is its input.
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
//! // The CPU, or a hardware GPU where there is one and it is sooner for so many points, read and written together.
//! let device = Device::choose(Choice::Auto, &Work::splines(20_000))?.with_precision(Precision::Auto);
//! println!("{}: {}", device.name(), device.reason());
//!
//! // A GPU that was asked for and is not there is an error, never a silent fallback.
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
//! The CPU path in f64 is the reference. Its splines agree with SciPy's on the same knots to 1e-12
//! of the numbers' size.
//!
//! A GPU normalises every curve in f64 first. It is held to these errors against the reference:
//!
//! - Splines through the points: 2e-6 of the curve's size in f32 and 1e-12 in f64. The largest
//!   errors found on the data in `examples/data`, on a software driver, are 2.1e-7 and 2.3e-13.
//! - Smoothing splines in f64: the same 1e-12. Smoothing by a deviation in f32 may take the
//!   neighbouring λ of a grid 0.14 % apart, and then differs from f64 by up to about 2e-4 of the
//!   size. [`Precision::Auto`] takes f64 for smoothing where the adapter has it.
//! - Fair curves and smooth connection functions: 1e-5 of the curve's size and of the energy in
//!   f32, 1e-9 of the size and 1e-10 of the energy in f64. Both are iterated until their gradient
//!   is small. Smooth connection functions have no other error.
//! - Completed Béziers: 2e-6 of the curve's size in f32 and 1e-12 in f64. On the CPU control points
//!   come from matrices that are solved in exact rationals and rounded once. They are within some
//!   1e-15 of the largest sum that makes them up, at every degree up to 30.
//! - Exact Laplacian subdivision: 2e-6 of the grid's size in f32 and 1e-12 in f64. On the CPU it
//!   holds its equations to rounding, whatever the grid.
//!
//! Arc lengths have relative errors of 1e-9, near cusps too. Largest curvatures are those of the
//! curve, to 1e-9 of themselves. See [`Curve::length`] and [`Curve::max_curvature`].
//!
//! The same batch on the same device gives the same bits. A curve's bits do not depend on its
//! neighbours.
//!
//! # Limits
//!
//! - An NVIDIA H200 and an H100 take as long for a fit as 16 threads of a CPU, or longer.
//!   [`Costs::estimated`] are estimates.
//! - The host finds samples at equal arc lengths, and the device evaluates them.
//! - The host fits smoothing curves of more than 1,024 knots in f64, and those beyond what the
//!   device's precision can resolve.
//! - The host fits some fair curves in f64: those with energies of order 3 (variation, torsion) in f32 or by
//!   another method than Newton's, and on software those of some thousand vertices.
//! - The host evaluates a segment of a smooth connection function again in f64, if f32 finds no
//!   minimiser of it or no cost of full precision.
//! - The host finds the spans of curves under tension in f64 at the start and at the end of a
//!   search, and where they become spans of another kind.
#![warn(missing_docs)]

// The program is written as its users write theirs.
#[cfg(feature = "cli")]
extern crate self as faircurve;

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
pub use device::{Choice, Costs, Device, DeviceReport, Stopped, Work};
pub use error::{Error, Result};
pub use grids::Grids;
pub use motion::Motion;
pub use precision::Precision;
pub use report::{CurveReport, CurveSet, Fit, LimitReport};
pub use status::CurveStatus;

/// The example of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
