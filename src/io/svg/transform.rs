//! The attribute `transform`, and what hides an element.

use kurbo::Affine;
use svgtypes::Transform;

use super::path::{largest_scale, unread};

/// Reads a list of transforms, applied from right to left.
pub(super) fn parse(text: &str) -> Result<Affine, String> {
    if text.trim() == "none" {
        return Ok(Affine::IDENTITY);
    }
    let Transform { a, b, c, d, e, f } = text.parse().map_err(|error| {
        let possible = "translate, scale, rotate, matrix, skewX and skewY are possible, with numbers without units";
        unread("transform", text, &error, possible)
    })?;
    Ok(Affine::new([a, b, c, d, e, f]))
}

/// Transforms that lengthen some vectors by this much more than others leave no digits on the way
/// back.
const MOST_CONDITION: f64 = 1e12;

/// The inverse. `None` if there is none: what such a transform draws is not seen.
pub(super) fn inverse(affine: Affine) -> Option<Affine> {
    let inverse = affine.inverse();
    let condition = largest_scale(affine) * largest_scale(inverse);
    (inverse.is_finite() && (1.0..MOST_CONDITION).contains(&condition)).then_some(inverse)
}
