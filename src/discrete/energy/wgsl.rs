//! Numbers and powers in WGSL.

use std::fmt::Write as _;

/// A number in WGSL.
pub(super) fn literal(x: f64) -> String {
    format!("{x:?}")
}

/// base^exponent in WGSL.
///
/// Multiples of a quarter up to six become products and square roots. Other exponents become calls
/// of `power`.
pub(super) fn power(base: &str, exponent: f64) -> String {
    if exponent < 0.0 {
        return format!("real(1) / ({})", power(base, -exponent));
    }
    let quarters = 4.0 * exponent;
    if quarters != quarters.trunc() || exponent > 6.0 {
        return format!("power({base}, real({}))", literal(exponent));
    }
    let (whole, quarters) = (quarters as usize / 4, quarters as usize % 4);
    let mut factors = vec![base.to_string(); whole];
    if quarters & 2 != 0 {
        factors.push(format!("sqrt({base})"));
    }
    if quarters & 1 != 0 {
        factors.push(format!("sqrt(sqrt({base}))"));
    }
    let mut text = String::new();
    for (k, factor) in factors.iter().enumerate() {
        write!(text, "{}{factor}", if k > 0 { " * " } else { "" }).expect("writing to a string");
    }
    if text.is_empty() { "real(1)".into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::power;

    #[test]
    fn powers_of_quarters_are_products_and_roots() {
        let cases = [
            (0.0, "real(1)"),
            (1.0, "q"),
            (-1.0, "real(1) / (q)"),
            (2.25, "q * q * sqrt(sqrt(q))"),
            (-0.75, "real(1) / (sqrt(q) * sqrt(sqrt(q)))"),
            (1.35, "power(q, real(1.35))"),
            (-7.0, "real(1) / (power(q, real(7.0)))"),
        ];
        for (exponent, wanted) in cases {
            assert_eq!(power("q", exponent), wanted);
        }
    }
}
