//! [`power_of_two`]: the divisor of numbers that a device gets.

/// The power of two at or below the largest magnitude; 1 where all numbers are 0.
pub(crate) fn power_of_two(numbers: &[f64]) -> f64 {
    let largest = numbers.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    // Without its mantissa; subnormal numbers share an exponent.
    let power = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    if largest == 0.0 { 1.0 } else { power.max(f64::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_powers_of_two() {
        let sizes =
            [[0.0, -0.0], [1.0, -1.9], [-3.0, 2.0], [1e-310, 0.0], [f64::MAX, 0.0]].map(|own| power_of_two(&own));
        assert_eq!(sizes, [1.0, 1.0, 2.0, f64::MIN_POSITIVE, 2_f64.powi(1023)]);
    }
}
