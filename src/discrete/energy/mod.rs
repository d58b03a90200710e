//! Energies of discrete curves: sums of local terms over a few consecutive edges.
//!
//! Each energy is a file here, a file of the same name in `shaders/discrete/energy`, and a line in
//! the list below.
//!
//! Edge j leads from vertex j to vertex j + 1. It has a length Δs and a unit tangent T. Every
//! fairness energy here is a function of the tangents and lengths of up to [`MOST_EDGES`]
//! consecutive edges, summed along the curve. It is therefore invariant under translations.
//!
//! An energy provides the value of its term and its first and second partial derivatives with
//! respect to tangents and lengths, *as if they were independent*. The chain rule from tangents and
//! lengths to edges, and from edges to vertices, is the same for all energies: see
//! [`edges`](super::edges) and [`hessian`](super::hessian).
//!
//! The number of edges in a term is the energy's order, and the order of the inner product for it.
//! Energies are added and scaled as in formulas: `bending(2.0) + 0.1 * length()`.
//! [Custom energies](Energy::custom) work like the ones here.
//!
//! Source: R. J. Renka, *Geometric Curve Modeling with Sobolev Gradients* (2006), section 3,
//! and *Constructing fair curves and surfaces with a Sobolev gradient method*, CAGD 21 (2004).

/// Declares the energies of edges, each by its file and its type.
///
/// The list generates [`Functional`], the enum of all energies, their names, and the only `match`
/// over their terms. Energies after `hidden` have no public name.
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
            /// The names that [`named`](Self::named) accepts.
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

            /// Its properties apart from the term.
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

            /// Calls a visitor with the functional's term.
            ///
            /// Functionals that depend on positions of vertices have no term.
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
    max_curvature_rate::MaxCurvatureRate,
    climb::Climb,
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
pub(crate) use tautness::{of_chords, of_spans};
pub use torsion::TORSION_CURVATURE;

use crate::linalg::Scalar;
use crate::linalg::scalar::Vector;
use geodesic_bending::GeodesicBending;

/// The largest number of consecutive edges in a term.
///
/// It can be raised to 5. The blocks and bands of Hessians, on the CPU and in kernels, follow from
/// it.
pub const MOST_EDGES: usize = 3;

/// The W consecutive edges that a term of an energy depends on.
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
    /// 1/w², where w is the width of the first edge's span.
    pub taut: S,
    /// The factor c of the regularisation at the vertex between the first two edges; 0 at a data
    /// point.
    pub free: S,
    /// The factor c at the vertex between the second and the third edge.
    pub free_after: S,
    /// The [penalty](Term::penalty) of this term at the end of the first edge.
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
/// They are symmetric, and all entries are stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SecondPartials<S, const D: usize, const W: usize> {
    /// `tangents[j][k][a][b]`: with respect to component a of tangent j and component b of tangent
    /// k.
    pub tangents: [[[Vector<S, D>; D]; W]; W],
    /// `mixed[j][k][a]`: with respect to component a of tangent j and to length k.
    pub mixed: [[Vector<S, D>; W]; W],
    /// `lengths[j][k]`: with respect to the lengths j and k.
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
    /// Whether the term depends on tangents, not only on lengths.
    const BY_TANGENT: bool = true;

    /// Whether the term next to a free end of an open curve also covers the half edge at that end,
    /// in energies of order 3.
    ///
    /// There the slope of the curvature vanishes at a free end, not the curvature itself.
    const AT_ENDS: bool = false;

    /// The index of the term's kind of penalty, if it is a penalty.
    #[inline(always)]
    fn penalty(&self) -> Option<usize> {
        None
    }

    /// The quantity that the penalty limits.
    #[inline(always)]
    fn quantity<S: Scalar, const D: usize>(&self, _: &Window<S, D, W>) -> Option<S> {
        None
    }

    /// The term.
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S;
    /// The term and its partial derivatives.
    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W>;
    /// The second partial derivatives with respect to lengths, for terms of lengths only. The
    /// default is for terms that are linear in them.
    #[inline(always)]
    fn by_lengths<S: Scalar, const D: usize>(&self, _: &Window<S, D, W>) -> [[S; W]; W] {
        [[S::ZERO; W]; W]
    }
    /// The second partial derivatives. The default is for terms of lengths only.
    #[inline(always)]
    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W> {
        SecondPartials { lengths: self.by_lengths(window), ..SecondPartials::ZERO }
    }
}

/// An operation on the term of a functional.
pub(crate) trait Visitor {
    type Output;

    fn visit<T: Term<W>, const W: usize>(self, term: &T) -> Self::Output;
}

/// The properties of an energy apart from its term.
pub(crate) trait Facts {
    /// The degree of E(c·f) = c^degree E(f).
    fn degree(&self) -> f64;

    /// The second derivative at a straight curve of this length, per unit of the highest derivative
    /// squared.
    ///
    /// If it depends on the curvature, this is its value at curvature 1.
    fn stiffness(&self, _length: f64) -> f64 {
        2.0
    }

    /// The exponent with which the second derivative grows with the curvature.
    fn stiffening(&self) -> f64 {
        0.0
    }

    /// Whether the energy bounds the length of the curve.
    fn bounds_length(&self) -> bool {
        false
    }

    /// Checks its parameters.
    ///
    /// The error is a sentence that explains what is wrong.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// The values of the `$NAME`s in its WGSL, for this machine epsilon and this dimension.
    fn definitions(&self, _epsilon: f64, _dimension: usize) -> BTreeMap<&'static str, String> {
        BTreeMap::new()
    }

    /// The text that follows its name in a formula.
    fn note(&self) -> String {
        String::new()
    }
}

impl Functional {
    /// The index of its kind of penalty, if it is a penalty.
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

    /// Whether it has a term that depends on tangents.
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

    /// The order of the energy: the number of edges in a term.
    ///
    /// This is also the order of the term's highest derivative, and of the inner product for it.
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

    /// The exponent ν, if it has one.
    pub fn exponent(&self) -> Option<f64> {
        match self {
            Functional::Bending(own) | Functional::GeodesicBending(GeodesicBending { bending: own }) => {
                Some(own.exponent)
            }
            _ => None,
        }
    }

    /// Sets the exponent ν, if it has one.
    pub fn set_exponent(&mut self, exponent: f64) {
        if let Functional::Bending(own) | Functional::GeodesicBending(GeodesicBending { bending: own }) = self {
            own.exponent = exponent;
        }
    }
}
