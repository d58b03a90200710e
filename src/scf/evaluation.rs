//! The cost of a segment of unit chord, with its first and second derivatives by its end angles.
//!
//! With D, S and J as in [`root`](super::root), σ = ±1 without and with an inflection, and
//! canonical angles,
//!
//! ```text
//! cost = D^{ν−1} along,   ∂cost/∂a = νσ D^{ν−1} S(t₀),   ∂cost/∂b = −ν D^{ν−1} S(t₁)
//! ```
//!
//! The derivatives are −ν and ν times the bending moments |κ|^{ν−1} sgn κ at the ends (envelope
//! theorem). The second derivatives follow from those of the chord condition. S′(t₀) is infinite at
//! an inflection, but always multiplies dt₀, which is 0 there.

use super::root::{Canonical, Piece, cheapest, from_inflection};
use super::universal::Universal;
use crate::linalg::{Operation, Real, Scalar};

/// The cost of a segment of unit chord, and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evaluation<S> {
    /// ∫|κ|^ν ds
    pub cost: S,
    /// ∂/∂a, ∂/∂b
    pub gradient: [S; 2],
    /// ∂²/∂a², ∂²/∂a∂b, ∂²/∂b²
    pub hessian: [S; 3],
    /// 1 if there is a minimiser, else 0.
    pub exists: S,
}

impl<S: Scalar> Evaluation<S> {
    /// A straight segment between free ends.
    pub fn straight() -> Self {
        Evaluation { cost: S::ZERO, gradient: [S::ZERO; 2], hessian: [S::ZERO; 3], exists: S::ONE }
    }

    /// A segment without minimiser.
    pub fn missing() -> Self {
        Evaluation { exists: S::ZERO, ..Self::straight() }
    }

    /// A segment with a free start, mirrored and reversed.
    pub fn reversed(self) -> Self {
        let zero = S::ZERO;
        Evaluation { gradient: [-self.gradient[1], zero], hessian: [self.hessian[2], zero, zero], ..self }
    }
}

/// [`evaluate`] as an operation: the universal curve and both angles.
pub(crate) struct Directed<'a, S>(pub &'a Universal, pub [S; 2]);

impl<S: Scalar> Operation for Directed<'_, S> {
    type Output = Evaluation<S>;

    #[inline(always)]
    fn run(self) -> Evaluation<S> {
        let Directed(curve, [a, b]) = self;
        evaluate(curve, a, b)
    }
}

/// [`evaluate_free`] as an operation: the universal curve and the angle.
pub(crate) struct FreeStart<'a, S>(pub &'a Universal, pub S);

impl<S: Scalar> Operation for FreeStart<'_, S> {
    type Output = Evaluation<S>;

    #[inline(always)]
    fn run(self) -> Evaluation<S> {
        evaluate_free(self.0, self.1)
    }
}

/// Replaces the angles of a straight segment, because lanes cannot branch.
/// Not in the kernel: threads can.
const STAND_IN: f64 = 0.5;

/// If both angles are below this they count as 0: their squares would lose precision.
fn straight<S: Scalar>() -> S {
    S::of(<S::Number as Real>::SMALLEST_NORMAL.to_f64().sqrt())
}

/// The cheapest segment with end angles a and b from its unit chord.
#[inline(always)]
fn evaluate<S: Scalar>(curve: &Universal, a: S, b: S) -> Evaluation<S> {
    let one = S::ONE;
    let bent = a.abs().max(b.abs()) - straight::<S>();
    let canonical = Canonical::of(bent.if_positive(a, S::of(STAND_IN)), bent.if_positive(b, S::of(-STAND_IN)));
    let (piece, found) = cheapest(curve, canonical.angles);
    let [a, b] = canonical.angles;
    let Evaluation { cost, gradient, hessian, .. } = at_piece(curve, &piece, a, b);
    let [first, last] = canonical.restore(gradient);
    let sign = canonical.mirrored * canonical.swapped.if_positive(-one, one);
    let [aa, bb] = canonical.restore([hessian[0], hessian[2]]);
    // Cost of a nearly straight segment for ν = 2: 4 (a² + ab + b²).
    let [flat_diagonal, flat_coupling] = if curve.exponent == 2.0 { [8.0, 4.0] } else { [0.0, 0.0] };
    let pick = |yes: S, no: f64| bent.if_positive(yes, S::of(no));
    Evaluation {
        cost: pick(cost, 0.0),
        gradient: [pick(sign * first, 0.0), pick(sign * last, 0.0)],
        hessian: [pick(aa, flat_diagonal), pick(hessian[1], flat_coupling), pick(bb, flat_diagonal)],
        exists: bent.if_positive(found, one),
    }
}

#[inline(always)]
fn at_piece<S: Scalar>(curve: &Universal, piece: &Piece<S>, a: S, b: S) -> Evaluation<S> {
    let (one, nu, q) = (S::ONE, S::of(curve.exponent), S::of(curve.q));
    let Piece { side, moment: [moment0, moment1], chord, soft, slope, .. } = *piece;
    let (sine_a, cosine_a) = super::trig::sine_cosine(a);
    let (sine_b, cosine_b) = super::trig::sine_cosine(b);
    // dS(t₁)/dt₁ = q stiff cos t₁
    let stiff = moment1 / piece.sine[1];
    let late = stiff * sine_b / chord;
    let early = side * sine_a / chord;
    // S(t₀)/sin t₀ · dt₀, and dt₁, for da and db.
    let start = [-(one + late) / slope, late / slope];
    let end = [-early / slope, -(soft - early) / slope];
    // d ln D
    let stretch = |k: usize| (stiff * cosine_b * end[k] - side * cosine_a * start[k]) / chord;
    let nu_less = S::of(curve.exponent - 1.0);
    let power = chord.powf(curve.exponent - 1.0);
    let at_start = |k: usize| nu * side * power * (nu_less * moment0 * stretch(k) + q * piece.cosine[0] * start[k]);
    let at_end = |k: usize| -(nu * power * (nu_less * moment1 * stretch(k) + q * stiff * piece.cosine[1] * end[k]));
    Evaluation {
        cost: power * piece.along,
        gradient: [nu * side * power * moment0, -(nu * power * moment1)],
        hessian: [at_start(0), at_start(1), at_end(1)],
        exists: one,
    }
}

/// The segment with a free start that ends at the angle b from its unit chord. The derivatives by b
/// are in the second places.
#[inline(always)]
fn evaluate_free<S: Scalar>(curve: &Universal, b: S) -> Evaluation<S> {
    let (zero, one, nu, q) = (S::ZERO, S::ONE, S::of(curve.exponent), S::of(curve.q));
    let bent = b.abs() - straight::<S>();
    let mirrored = b.if_positive(-one, one);
    let b = bent.if_positive(mirrored * b, S::of(-STAND_IN));
    let (piece, found) = from_inflection(curve, b);
    let (sine_b, cosine_b) = super::trig::sine_cosine(b);
    let Piece { moment: [_, moment], chord, .. } = piece;
    let stiff = moment / piece.sine[1];
    let end = -(one / (one + stiff * sine_b / chord));
    let stretch = stiff * cosine_b / chord * end;
    let power = chord.powf(curve.exponent - 1.0);
    let nu_less = S::of(curve.exponent - 1.0);
    let hessian = -(nu * power * (nu_less * moment * stretch + q * stiff * piece.cosine[1] * end));
    let flat = if curve.exponent == 2.0 { 6.0 } else { 0.0 };
    let pick = |yes: S, no: f64| bent.if_positive(yes, S::of(no));
    Evaluation {
        cost: pick(power * piece.along, 0.0),
        gradient: [zero, pick(-(mirrored * nu * power * moment), 0.0)],
        hessian: [zero, zero, pick(hessian, flat)],
        exists: bent.if_positive(found, one),
    }
}
