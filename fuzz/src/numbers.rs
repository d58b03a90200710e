//! Numbers as people have them, and as they should never be.

use arbitrary::{Result, Unstructured};

/// Numbers at which arithmetic breaks.
const NASTY: [f64; 16] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    1e-300,
    1e-160,
    1e-9,
    1e9,
    1e12,
    1e160,
    1e300,
];

/// Mostly a small number of two digits, sometimes a nasty one, or any at all.
pub fn number(bytes: &mut Unstructured) -> Result<f64> {
    Ok(match bytes.arbitrary::<u8>()? {
        0..=199 => f64::from(bytes.arbitrary::<i8>()?) / 8.0,
        200..=239 => *bytes.choose(&NASTY)?,
        _ => bytes.arbitrary()?,
    })
}

/// One of a few good values, or any number.
pub fn option(bytes: &mut Unstructured, good: &[f64]) -> Result<f64> {
    if bytes.ratio(7, 8)? { Ok(*bytes.choose(good)?) } else { number(bytes) }
}
