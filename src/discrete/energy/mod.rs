//! Energies of discrete curves: sums of local terms over a few consecutive edges.
//!
//! Each energy is a file here, a file of the same name in `shaders/discrete/energy`, and a line in
//! the list below.
//!
//! Edge j leads from vertex j to vertex j + 1. It has a length Δs and a unit tangent T. Every
//! fairness energy here is a function of the tangents and lengths of up to [`MOST_EDGES`]
//! consecutive edges, summed along the curve. It therefore does not depend on where the curve lies.
//!
//! An energy states the value of its term and its first and second partial derivatives. They are
//! with respect to tangents and lengths *taken as independent*. The chain rules from edges to
//! tangents and lengths, and from vertices to edges, are the same for all energies. They are in
//! [`edges`](super::edges) and [`hessian`](super::hessian).
//!
//! The number of edges is the energy's order, which is that of the inner product that suits it.
//! Energies are added and scaled as in formulas: `bending(2.0) + 0.1 * length()`.
//! [Custom energies](Energy::custom) take part like the ones here.
//!
//! Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006), section 3,
//! and *Constructing fair curves and surfaces with a Sobolev gradient method*, CAGD 21 (2004).

/// Declares the energies of edges, each by its file and its type.
///
/// The list yields [`Functional`], which is any of them, the names of the energies, and the one
/// place where their terms are told apart. Those after `hidden` have no name for users.
macro_rules! energies {
    ($($(#[$when:meta])? $word:ident::$Name:ident),+ $(,)?; hidden: $($(#[$for:meta])? $own:ident::$Own:ident),+ $(,)?) => {
        $(
            $(#[$when])?
            mod $word;

            $(#[$when])?
            pub use $word::$word;

            $(#[$when])?
            impl From<$word::$Name> for Energy {
                fn from(functional: $word::$Name) -> Energy {
                    Energy::of(Functional::$Name(functional))
                }
            }
        )+

        $(
            $(#[$for])?
            mod $own;
        )+

        impl Energy {
            /// The names of the energies, as [`named`](Self::named) takes them.
            pub const NAMES: &[&str] = &[$($(#[$when])? stringify!($word),)+ "attachment", "geodesic_bending"];

            /// The energy with this name and weight 1.
            ///
            /// Bending has exponent 2.
            pub fn named(name: &str) -> Option<Energy> {
                match name {
                    $($(#[$when])? stringify!($word) => Some($word::$Name::default().into()),)+
                    "attachment" => Some(attachment()),
                    "geodesic_bending" => Some(geodesic_bending(2.0)),
                    _ => None,
                }
            }
        }

        /// One functional, without its weight.
        #[derive(Clone, Debug)]
        pub(crate) enum Functional {
            $($(#[$when])? $Name($word::$Name),)+
            $($(#[$for])? $Own($own::$Own),)+
            Attachment,
            GeodesicBending(geodesic_bending::GeodesicBending),
            GeodesicMaxCurvature(geodesic_max_curvature::GeodesicMaxCurvature),
            Custom(Arc<Custom>),
        }

        impl Functional {
            /// The name on the command line and in kernels.
            pub fn word(&self) -> &str {
                match self {
                    $($(#[$when])? Functional::$Name(_) => stringify!($word),)+
                    $($(#[$for])? Functional::$Own(_) => stringify!($own),)+
                    Functional::Attachment => "attachment",
                    Functional::GeodesicBending(_) => "geodesic_bending",
                    Functional::GeodesicMaxCurvature(_) => "geodesic_max_curvature",
                    Functional::Custom(custom) => &custom.name,
                }
            }

            /// The facts about it besides its term.
            pub fn facts(&self) -> &dyn Facts {
                match self {
                    $($(#[$when])? Functional::$Name(functional) => functional,)+
                    $($(#[$for])? Functional::$Own(functional) => functional,)+
                    Functional::Attachment => &attachment::Attachment,
                    Functional::GeodesicBending(functional) => functional,
                    Functional::GeodesicMaxCurvature(functional) => functional,
                    Functional::Custom(custom) => custom,
                }
            }

            /// Shows the functional's term to a visitor.
            ///
            /// What depends on places of vertices has none.
            #[inline(always)]
            pub fn visit<V: Visitor>(&self, visitor: V) -> Option<V::Output> {
                match self {
                    $($(#[$when])? Functional::$Name(functional) => Some(visitor.visit(functional)),)+
                    $($(#[$for])? Functional::$Own(functional) => Some(visitor.visit(functional)),)+
                    Functional::Attachment | Functional::GeodesicBending(_) | Functional::GeodesicMaxCurvature(_) => None,
                    Functional::Custom(custom) => Some(custom::visit(custom.as_ref(), visitor)),
                }
            }
        }
    };
}

energies! {
    bending::Bending,
    length::Length,
    tension::Tension,
    tautness::Tautness,
    variation::Variation,
    torsion::Torsion,
    #[cfg(test)]
    toy::Toy;
    hidden: max_curvature::MaxCurvature,
    curvature_sign::CurvatureSign,
    monotone::Monotone,
    torsion_sign::TorsionSign,
    #[cfg(test)]
    toy_limit::ToyLimit,
}

mod attachment;
pub(super) mod curvatures;
mod custom;
mod exponents;
mod formula;
mod geodesic_bending;
pub(super) mod geodesic_max_curvature;
pub(super) mod in_surface;
mod penalty;
mod region_penalty;
pub(super) mod regularisation;
mod sum;
mod wgsl;

use std::collections::BTreeMap;
use std::sync::Arc;

pub(crate) use attachment::Anchor;
pub use attachment::attachment;
use custom::Custom;
pub(super) use exponents::nearer;
pub use formula::{Expression, ExpressionVector};
pub use geodesic_bending::geodesic_bending;
pub(crate) use monotone::Monotone;
pub(crate) use penalty::{LIMIT_KINDS, LimitTerms, MOST_DIRECTIONS, Penalty};
pub(crate) use region_penalty::RegionPenalty;
pub use sum::Energy;
pub(crate) use tautness::of_spans;
pub use torsion::TORSION_CURVATURE;

use crate::linalg::Scalar;
use crate::linalg::scalar::Vector;
use geodesic_bending::GeodesicBending;

/// The most consecutive edges that a term sees.
///
/// Up to 5 are possible. Blocks and bands of Hessians, on the CPU and in kernels, follow from this
/// number.
pub const MOST_EDGES: usize = 3;

/// W consecutive edges, as a term of an energy sees them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<S, const D: usize, const W: usize> {
    /// Unit tangents.
    pub tangent: [Vector<S, D>; W],
    /// Lengths.
    pub length: [S; W],
    /// The number of edges of the whole curve.
    pub segments: S,
    /// ε of torsion, a curvature.
    pub torsion_curvature: S,
    /// 1/w² for the width w of the span that the first edge lies in.
    pub taut: S,
    /// The regularisation's factor at the vertex between the first two edges.
    ///
    /// 0 at a data point.
    pub free: S,
    /// The regularisation's factor at the vertex between the second and the third edge.
    pub free_after: S,
    /// The term's own [`penalty`](Term::penalty) at the vertex that the first edge leads to.
    pub penalty: Penalty<S>,
}

/// A term and its partial derivatives with respect to tangents and lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Partials<S, const D: usize, const W: usize> {
    pub value: S,
    pub tangent: [Vector<S, D>; W],
    pub length: [S; W],
}

/// Second partial derivatives of a term.
///
/// They are symmetric, and every entry is given.
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
    /// Whether the term depends on tangents, and not on lengths alone.
    const BY_TANGENT: bool = true;

    /// Whether the term next to a free end of an open curve stands for the half edge there too, in energies of order 3.
    ///
    /// Under those the curvature does not vanish at the end, but its slope does.
    const AT_ENDS: bool = false;

    /// The kind of penalties that the term is of.
    #[inline(always)]
    fn penalty(&self) -> Option<usize> {
        None
    }

    /// The quantity that its penalties limit.
    #[inline(always)]
    fn quantity<S: Scalar, const D: usize>(&self, _: &Window<S, D, W>) -> Option<S> {
        None
    }

    /// The term.
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S;
    /// The term and its partial derivatives.
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W>;
    /// Its second partial derivatives by lengths, if it depends on lengths alone. By default it is linear in them.
    #[inline(always)]
    fn by_lengths<S: Scalar, const D: usize>(&self, _: &Window<S, D, W>) -> [[S; W]; W] {
        [[S::ZERO; W]; W]
    }
    /// Its second partial derivatives. By default those of lengths alone.
    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W> {
        SecondPartials { lengths: self.by_lengths(window), ..SecondPartials::ZERO }
    }
}

/// An operation on the term of some functional.
pub(crate) trait Visitor {
    type Output;

    fn visit<T: Term<W>, const W: usize>(self, term: &T) -> Self::Output;
}

/// The facts about an energy besides its term.
pub(crate) trait Facts {
    /// The degree of E(c·f) = c^degree E(f).
    fn degree(&self) -> f64;

    /// The second derivative at a straight curve of this length, per unit of the highest derivative
    /// squared.
    ///
    /// Where it depends on the curvature, it is taken at curvature 1.
    fn stiffness(&self, _length: f64) -> f64 {
        2.0
    }

    /// The power of the curvature with which the second derivative grows.
    fn stiffening(&self) -> f64 {
        0.0
    }

    /// Whether the energy bounds the length of the curve.
    fn bounds_length(&self) -> bool {
        false
    }

    /// Checks its parameters.
    ///
    /// The error is a sentence that says what is wrong.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// The values of `$NAME`s in its WGSL, for numbers of this rounding and curves of a dimension.
    fn definitions(&self, _epsilon: f64, _dimension: usize) -> BTreeMap<&'static str, String> {
        BTreeMap::new()
    }

    /// The text after its name in a formula.
    fn note(&self) -> String {
        String::new()
    }
}

impl Functional {
    /// The kind of penalties that it is of.
    pub fn penalty(&self) -> Option<usize> {
        struct Kind;
        impl Visitor for Kind {
            type Output = Option<usize>;

            fn visit<T: Term<W>, const W: usize>(self, term: &T) -> Option<usize> {
                term.penalty()
            }
        }
        match self {
            Functional::GeodesicMaxCurvature(_) => Some(0),
            other => other.visit(Kind).flatten(),
        }
    }

    /// Whether it depends on tangents, and has a term.
    pub fn is_by_tangent(&self) -> bool {
        struct ByTangent;
        impl Visitor for ByTangent {
            type Output = bool;

            fn visit<T: Term<W>, const W: usize>(self, _: &T) -> bool {
                T::BY_TANGENT
            }
        }
        self.visit(ByTangent).unwrap_or(false)
    }

    /// The order of the inner product that suits it.
    ///
    /// This is the number of edges that a term sees, and of derivatives that it holds.
    pub fn order(&self) -> usize {
        struct Order;
        impl Visitor for Order {
            type Output = usize;

            fn visit<T: Term<W>, const W: usize>(self, _: &T) -> usize {
                W
            }
        }
        match self {
            Functional::GeodesicBending(_) | Functional::GeodesicMaxCurvature(_) => 2,
            other => other.visit(Order).unwrap_or(0),
        }
    }

    /// The exponent ν, of those that have one.
    pub fn exponent(&self) -> Option<f64> {
        match self {
            Functional::Bending(own) | Functional::GeodesicBending(GeodesicBending { bending: own }) => {
                Some(own.exponent)
            }
            _ => None,
        }
    }

    /// Sets the exponent ν of those that have one.
    pub fn set_exponent(&mut self, exponent: f64) {
        if let Functional::Bending(own) | Functional::GeodesicBending(GeodesicBending { bending: own }) = self {
            own.exponent = exponent;
        }
    }
}
