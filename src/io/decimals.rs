//! How many decimals the coordinates of a file need.

use crate::batch::CurveBatch;

/// The most decimals: numbers of magnitude 1 have no more.
const MOST: u8 = 15;

/// The fewest significant digits: rounding moves curves by less than 10⁻⁹ of the largest
/// coordinate.
const SIGNIFICANT: i32 = 10;

/// The most decimals of longitudes and latitudes: 10⁻⁹ degrees are 0.1 mm on the ground.
const OF_DEGREES: u8 = 9;

/// The decimals that curves through these points need, for
/// [`WriteOptions::decimals`](super::WriteOptions::decimals).
///
/// - The points themselves are written as they came. Where they have more than 15 decimals, every
///   digit is needed: `None`.
/// - At least ten significant digits of the largest coordinate are written.
/// - Longitudes and latitudes have at most nine decimals, which is 0.1 mm on the ground.
///
/// ```
/// use faircurve::{CurveBatch, io};
///
/// let metres = CurveBatch::from_slices(&[&[[512_030.25, 5_403_120.5], [512_031.75, 5_403_125.0]][..]])?;
/// assert_eq!(io::decimals_of(&metres), Some(3));
/// # Ok::<(), faircurve::Error>(())
/// ```
pub fn decimals_of(batch: &CurveBatch) -> Option<u8> {
    let mut largest = 0.0_f64;
    let mut own = Some(0);
    for &x in batch.coords().iter().filter(|x| x.is_finite()) {
        largest = largest.max(x.abs());
        own = own.and_then(|least| (least..=MOST).find(|&decimals| has(x, decimals)));
    }
    let magnitude = if largest > 0.0 { largest.log10().floor() as i32 + 1 } else { 0 };
    let least = (SIGNIFICANT - magnitude).max(0);
    let needed = own.map_or(i32::MAX, i32::from).max(least);
    let most = if batch.is_geographic() { OF_DEGREES } else { u8::MAX };
    Some(needed.min(most.into()) as u8).filter(|&needed| needed <= MOST)
}

/// Whether a number has at most this many decimals.
fn has(x: f64, decimals: u8) -> bool {
    let by = 10_f64.powi(decimals.into());
    (x * by).round() / by == x
}
