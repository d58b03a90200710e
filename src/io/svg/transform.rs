//! The attribute `transform`, and what hides an element.

use kurbo::{Affine, Vec2};
use svgtypes::NumberListParser;

use super::path::largest_scale;
use crate::error::quoted;

/// Reads a list of transforms: `translate scale rotate matrix skewX skewY`, applied from right to
/// left.
pub(super) fn parse(text: &str) -> Result<Affine, String> {
    let mut whole = Affine::IDENTITY;
    let mut rest = text.trim_matches(separator);
    if rest == "none" {
        return Ok(whole);
    }
    while !rest.is_empty() {
        let (name, after) = rest.split_once('(').ok_or_else(|| unknown(rest))?;
        let (inner, after) = after.split_once(')').ok_or_else(|| format!("{} has no closing bracket", quoted(rest)))?;
        let numbers: Result<Vec<f64>, _> = NumberListParser::from(inner).collect();
        let numbers =
            numbers.map_err(|_| format!("{} is no list of numbers: give numbers without units", quoted(inner)))?;
        whole *= single(name.trim(), &numbers)?;
        rest = after.trim_start_matches(separator);
    }
    Ok(whole)
}

/// Transforms that lengthen some vectors by this much more than others leave no digits on the way back.
const MOST_CONDITION: f64 = 1e12;

/// The way back. `None` where there is none: what such a transform draws is not seen.
pub(super) fn inverse(affine: Affine) -> Option<Affine> {
    let inverse = affine.inverse();
    let condition = largest_scale(affine) * largest_scale(inverse);
    (inverse.is_finite() && (1.0..MOST_CONDITION).contains(&condition)).then_some(inverse)
}

fn separator(c: char) -> bool {
    c == ',' || c.is_ascii_whitespace()
}

fn unknown(name: &str) -> String {
    format!("there is no transform {}: translate, scale, rotate, matrix, skewX and skewY are possible", quoted(name))
}

fn single(name: &str, numbers: &[f64]) -> Result<Affine, String> {
    Ok(match (name, numbers) {
        ("translate", &[x]) => Affine::translate((x, 0.0)),
        ("translate", &[x, y]) => Affine::translate((x, y)),
        ("scale", &[s]) => Affine::scale(s),
        ("scale", &[x, y]) => Affine::scale_non_uniform(x, y),
        ("rotate", &[degrees]) => Affine::rotate(degrees.to_radians()),
        ("rotate", &[degrees, x, y]) => {
            Affine::translate((x, y)) * Affine::rotate(degrees.to_radians()) * Affine::translate(-Vec2::new(x, y))
        }
        ("matrix", &[a, b, c, d, e, f]) => Affine::new([a, b, c, d, e, f]),
        ("skewX", &[degrees]) => Affine::skew(degrees.to_radians().tan(), 0.0),
        ("skewY", &[degrees]) => Affine::skew(0.0, degrees.to_radians().tan()),
        ("translate" | "scale" | "rotate" | "matrix" | "skewX" | "skewY", _) => {
            return Err(format!("{name} has {} numbers, which is not how many it takes", numbers.len()));
        }
        _ => return Err(unknown(name)),
    })
}
