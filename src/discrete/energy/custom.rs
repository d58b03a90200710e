//! Energies of a user's own.

use glam::{DMat3, DVec3};

/// An energy Σ term(tangents, lengths) over every run of [`edges`](Self::edges) consecutive edges of a curve.
///
/// The term is a function of unit tangents T and lengths Δs, taken as independent variables; the chain rule to the
/// vertices is faircurve's. 2-D curves have z = 0 everywhere.
///
/// On a GPU the same three functions are needed in WGSL, see [`wgsl`](Self::wgsl); without them curves are fitted by the CPU.
pub trait Custom: Send + Sync + std::fmt::Debug {
    /// A name of letters, digits and underscores.
    fn name(&self) -> &str;

    /// 1, 2 or 3: how many edges a term sees, which is also the number of derivatives it holds.
    fn edges(&self) -> usize;

    /// E(c·f) = c^degree E(f): bending ∫κ² ds has −1.
    fn degree(&self) -> f64;

    /// The term; tangents and lengths have [`edges`](Self::edges) entries.
    fn value(&self, tangents: &[DVec3], lengths: &[f64]) -> f64;

    /// Partial derivatives of the term: written, not added.
    fn gradient(&self, tangents: &[DVec3], lengths: &[f64], by_tangent: &mut [DVec3], by_length: &mut [f64]);

    /// Second partial derivatives, written into arrays that hold 0: by two tangents (row: component of the first), by tangent and length, by two
    /// lengths; both of a symmetric pair are wanted.
    fn hessian(
        &self,
        tangents: &[DVec3],
        lengths: &[f64],
        by_tangents: &mut [[DMat3; 3]; 3],
        mixed: &mut [[DVec3; 3]; 3],
        by_lengths: &mut [[f64; 3]; 3],
    );

    /// The three functions in WGSL, over the alias `real` and the vector `vector` (2 or 3 components), by the names
    /// `NAME_value`, `NAME_gradient` and `NAME_hessian`, as the files in `shaders/discrete/energy` have them.
    fn wgsl(&self) -> Option<String> {
        None
    }
}
