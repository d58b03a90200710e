//! An energy of a user's own that is known already.

use faircurve::discrete::Energy;

/// Σ ‖T₁ − T₀‖² 2/(s₀ + s₁), which is bending of exponent 2, as a user would write it.
pub fn elastica() -> Energy {
    Energy::custom("elastica", 2, -1.0, |t, s| 2.0 * (t[1] - t[0]).length_squared() / (s[0] + s[1]))
}
