//! Energies of discrete curves: sums of local terms over a few consecutive edges.
//!
//! Edge j leads from vertex j to vertex j + 1; it has a length Δs and a unit tangent T. Every fairness energy here is
//! a function of the tangents and lengths of one, two or three consecutive edges, summed along the curve: that makes
//! it independent of where the curve lies. An energy states the value of its term, its partial derivatives, and its
//! second partial derivatives, all with respect to tangents and lengths *taken as independent*; the chain rule from
//! edges to tangents and lengths, and from vertices to edges, is the same for all of them and stands in
//! [`edges`](super::edges) and [`hessian`](super::hessian) once.
//!
//! | energy | of | formula | order |
//! |---|---|---|---|
//! | [`length`] | one edge | Σ Δs | 1 |
//! | [`tension`] | one edge | ½ m Σ Δs² (m edges) | 1 |
//! | [`bending`] | two | Σ \|K\|^ν Δa, K = (T' − T)/Δa, Δa the mean of both lengths | 2 |
//! | [`variation`] | three | Σ \|(I − T Tᵀ)(K' − K)\|²/Δs, T and Δs of the middle edge | 3 |
//! | [`torsion`] | three | Σ det(T, K̄, C)²/(\|K̄\|² + ε²) Δs | 3 |
//! | [`attachment`] | a data point | ½ Σ w \|f − p\|² | 0 |
//!
//! The order is that of the inner product that suits the energy. Energies are added and scaled as formulas are:
//! `bending(2.0) + 0.1 * length()`. [`Custom`] energies take part like the ones here.
//!
//! Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006), section 3, and *Constructing fair curves
//! and surfaces with a Sobolev gradient method*, CAGD 21 (2004).

mod attachment;
pub(super) mod bending;
mod curvatures;
pub(super) mod custom;
pub(super) mod gauge;
pub(super) mod length;
pub(super) mod tension;
pub(super) mod torsion;
pub(super) mod variation;

use std::ops::{Add, Mul};
use std::sync::Arc;

pub use attachment::attachment;
pub use bending::bending;
pub use custom::Custom;
pub use length::length;
pub use tension::tension;
pub use torsion::{TORSION_CURVATURE, torsion};
pub use variation::variation;

use crate::error::{Error, Result};
use crate::linalg::Scalar;
use crate::linalg::scalar::Vector;

/// W consecutive edges, as a term of an energy sees them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<S, const D: usize, const W: usize> {
    /// Unit tangents.
    pub tangent: [Vector<S, D>; W],
    /// Lengths.
    pub length: [S; W],
    /// Number of edges of the whole curve.
    pub segments: S,
    /// ε of torsion: a curvature.
    pub torsion_curvature: S,
    /// 1 where the vertex between the first two edges is free to move along the curve, 0 at a data point.
    pub free: S,
    /// The same of the vertex between the second and the third.
    pub free_after: S,
}

/// A term and its partial derivatives with respect to tangents and lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Partials<S, const D: usize, const W: usize> {
    pub value: S,
    pub tangent: [Vector<S, D>; W],
    pub length: [S; W],
}

/// Second partial derivatives of a term; symmetric, every entry given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondPartials<S, const D: usize, const W: usize> {
    /// `tangents[j][k][a][b]`: by component a of tangent j and component b of tangent k.
    pub tangents: [[[Vector<S, D>; D]; W]; W],
    /// `mixed[j][k][a]`: by component a of tangent j and by length k.
    pub mixed: [[Vector<S, D>; W]; W],
    /// `lengths[j][k]`: by the lengths j and k.
    pub lengths: [[S; W]; W],
}

impl<S: Scalar, const D: usize, const W: usize> SecondPartials<S, D, W> {
    pub const ZERO: Self = SecondPartials {
        tangents: [[[[S::ZERO; D]; D]; W]; W],
        mixed: [[[S::ZERO; D]; W]; W],
        lengths: [[S::ZERO; W]; W],
    };
}

/// The term of an energy over W edges.
pub(crate) trait Term<const W: usize> {
    /// The term.
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S;
    /// The term and its partial derivatives.
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W>;
    /// Its second partial derivatives.
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W>;
}

/// One functional, without its weight.
#[derive(Clone, Debug)]
pub(crate) enum Functional {
    Length,
    Tension,
    Bending { exponent: f64 },
    Variation,
    Torsion,
    Attachment,
    Custom(Arc<dyn Custom>),
}

impl Functional {
    /// The word of the command line and of the kernels.
    pub fn word(&self) -> &str {
        match self {
            Functional::Length => "length",
            Functional::Tension => "tension",
            Functional::Bending { .. } => "bending",
            Functional::Variation => "variation",
            Functional::Torsion => "torsion",
            Functional::Attachment => "attachment",
            Functional::Custom(custom) => custom.name(),
        }
    }

    /// E(c·f) = c^degree E(f).
    pub fn degree(&self) -> f64 {
        match self {
            Functional::Length => 1.0,
            Functional::Tension | Functional::Attachment => 2.0,
            Functional::Bending { exponent } => 1.0 - exponent,
            Functional::Variation | Functional::Torsion => -3.0,
            Functional::Custom(custom) => custom.degree(),
        }
    }

    /// Order of the inner product that suits it: the number of derivatives it holds.
    pub fn order(&self) -> usize {
        match self {
            Functional::Attachment => 0,
            Functional::Length | Functional::Tension => 1,
            Functional::Bending { .. } => 2,
            Functional::Variation | Functional::Torsion => 3,
            Functional::Custom(custom) => custom.edges(),
        }
    }
}

/// A weighted sum of energies.
///
/// ```
/// use faircurve::discrete::{bending, length};
/// let energy = bending(2.0) + 0.1 * length();
/// assert_eq!(energy.to_string(), "bending + 0.1 length");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Energy {
    terms: Vec<(f64, Functional)>,
}

impl Energy {
    /// One functional of weight 1.
    pub(crate) fn of(functional: Functional) -> Self {
        Energy { terms: vec![(1.0, functional)] }
    }

    /// An energy of your own.
    pub fn custom(custom: impl Custom + 'static) -> Self {
        Self::of(Functional::Custom(Arc::new(custom)))
    }

    /// Weights and functionals.
    pub(crate) fn terms(&self) -> &[(f64, Functional)] {
        &self.terms
    }

    pub(crate) fn terms_mut(&mut self) -> &mut [(f64, Functional)] {
        &mut self.terms
    }

    /// Whether every weight and exponent makes sense.
    ///
    /// # Errors
    /// A weight that is negative or not finite, an exponent below 1, a custom energy over no or too many edges.
    pub(crate) fn check(&self) -> Result<()> {
        for (weight, functional) in &self.terms {
            let word = functional.word();
            if !(*weight >= 0.0 && weight.is_finite()) {
                let why = format!("the weight of {word} is {weight}: give a finite number of at least 0");
                return Err(Error::argument(why));
            }
            match functional {
                Functional::Bending { exponent } if !(*exponent >= 1.0 && exponent.is_finite()) => {
                    let why = format!("the exponent of bending is {exponent}: give a finite number of at least 1");
                    return Err(Error::argument(why));
                }
                Functional::Custom(custom) if !(1..=3).contains(&custom.edges()) => {
                    let why =
                        format!("a term of the energy {word} is of {} edges; 1, 2 and 3 are possible", custom.edges());
                    return Err(Error::argument(why));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Weight of the attachment to data, 0 without.
    pub(crate) fn attachment_weight(&self) -> f64 {
        self.terms.iter().filter(|(_, f)| matches!(f, Functional::Attachment)).map(|(weight, _)| weight).sum()
    }

    /// Whether a lower energy cannot have ever longer curves: it holds their length, or its square.
    pub(crate) fn bounds_length(&self) -> bool {
        let holds = |functional: &Functional| matches!(functional, Functional::Length | Functional::Tension);
        self.terms.iter().any(|(weight, functional)| *weight > 0.0 && holds(functional))
    }

    /// The highest order among the functionals of positive weight.
    pub fn order(&self) -> usize {
        self.terms
            .iter()
            .filter(|(weight, _)| *weight > 0.0)
            .map(|(_, functional)| functional.order())
            .max()
            .unwrap_or(0)
    }
}

impl Add for Energy {
    type Output = Energy;

    fn add(mut self, other: Energy) -> Energy {
        self.terms.extend(other.terms);
        self
    }
}

impl Mul<Energy> for f64 {
    type Output = Energy;

    fn mul(self, mut energy: Energy) -> Energy {
        energy.terms.iter_mut().for_each(|(weight, _)| *weight *= self);
        energy
    }
}

impl std::fmt::Display for Energy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, (weight, functional)) in self.terms.iter().enumerate() {
            f.write_str(if k > 0 { " + " } else { "" })?;
            if *weight != 1.0 {
                write!(f, "{weight} ")?;
            }
            f.write_str(functional.word())?;
            if let Functional::Bending { exponent } = functional
                && *exponent != 2.0
            {
                write!(f, " (ν = {exponent})")?;
            }
        }
        Ok(())
    }
}
