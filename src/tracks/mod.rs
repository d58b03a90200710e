//! Tracks: curves whose parameters are times.
//!
//! [`clean`] drops points that are no fixes. [`separate`] parts things that bear one name. [`split`] cuts tracks at gaps in time. [`sample`] samples
//! fitted tracks at times or along their length, with interpolated columns
//! ([`Column`](crate::Column)) and quantities such as the speed ([`Quantity`]). [`smooth_column`] smooths
//! elevations and other columns. [`drive`] finds the speeds of the fastest drive.
//!
//! ```
//! use faircurve::{Column, CurveBatch, Device, Values, spline::Natural, tracks::{self, At, Quantity}};
//! // A walk: at 0, 2, 4, 30 and 31 hours.
//! let points = [[0.0, 0.0], [2.0, 0.0], [4.0, 1.0], [9.0, 5.0], [9.5, 5.5]];
//! let batch = CurveBatch::from_slices(&[&points[..]])?
//!     .with_parameters(vec![0.0, 2.0, 4.0, 30.0, 31.0])?
//!     .with_columns(vec![Column { name: "height".into(), values: Values::Numbers(vec![5.0, 7.0, 3.0, 4.0, 4.0]) }])?;
//! let parts = tracks::split(&batch, 12.0)?;
//! assert_eq!((parts.len(), parts.name(1).as_ref()), (2, "0.2"));
//! let fit = Natural::default().fit(&parts, &Device::cpu())?;
//! let hourly = tracks::sample(&parts, &fit, &At::Every(1.0), &[Quantity::Speed])?;
//! assert_eq!(hourly.parameters(0), Some(&[0.0, 1.0, 2.0, 3.0, 4.0][..]));
//! let Values::Numbers(heights) = &hourly.columns()[0].values else { panic!("numbers stay numbers") };
//! assert_eq!(heights[..5], [5.0, 6.0, 7.0, 5.0, 3.0]);
//! assert_eq!(hourly.columns()[1].name, "speed");
//! # Ok::<(), faircurve::Error>(())
//! ```

mod carried;
mod clean;
mod drive;
mod easing;
mod gaps;
mod jerk;
mod outliers;
mod quantities;
mod sample;
mod smooth;

pub use clean::{Cleaned, Cleaning, Dropped, Duplicates, Stops, clean, separate};
pub use drive::{ALONG_DRIVES, Vehicle, drive};
pub use easing::Easing;
pub use gaps::split;
pub use quantities::Quantity;
pub use sample::{At, sample, sample_eased};
#[cfg(feature = "cli")]
pub(crate) use sample::{check, columns_out, times};
pub use smooth::{ELEVATION, smooth_column};
