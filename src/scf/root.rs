//! The chord condition of a segment: determines the piece of the universal curve that joins two
//! points with given tangents.
//!
//! By mirroring and reversal, every pair of end angles (from the chord) becomes **canonical**: a ≥
//! b and a + b ≤ 0, so that the curve ends at its more curved side. With t = |T|, the piece then
//! runs from T₀ to t₁ = |T₀| + (a − b) on the universal curve. κ < 0 where T > 0, and there is an
//! inflection at T = 0 if T₀ < 0. The force has the direction φ = a − π/2 + t₀, and the chord the
//! direction 0:
//!
//! ```text
//! along = J(t₁) ∓ J(t₀),   across = (S(t₁) ∓ S(t₀))/q,   g(t₀) = φ + atan2(across, along) = 0,   |φ| < π/2
//! ```
//!
//! The sign is − without and + with an inflection. If g ≥ 0 at t₀ = 0 there is exactly one root
//! without inflection, otherwise none. With an inflection there are up to two roots, since g is
//! concave, and the first from below is the cheaper one. Newton's method from below therefore
//! converges monotonically, in the variable in which g is nearest to linear. Without an inflection
//! this is the ratio of the moments (exactly linear for ν = 2 and small angles). With one it is
//! t₀^q, the moment at the start, or t₀. In t₀^q, for ν near 1, g may be convex: steps that lead
//! past what might be two roots are taken back, and g is followed in t₀, in which it is concave.
//! There is no root if a − b ≥ π, except the half arch a = −b = π/2, which is included as far as
//! angles can be distinguished.

use std::f64::consts::{FRAC_PI_2, PI};

use super::trig::{first_quadrant_angle, sine_cosine};
use super::universal::Universal;
use crate::linalg::{Real, Scalar};

/// The most Newton steps. The most ever seen are 15 (ν = 1.05).
const MOST_STEPS: usize = 60;

/// If h/m is less than this, differences come from series: see [`Universal::difference_series`].
pub(crate) const CLOSE: f64 = 0.125;

/// The largest g after a last, small step, relative to the angles. If g is larger, the step was
/// small for another reason.
const NEAR: f64 = 1e-3;

/// A Newton step s of this fraction of √ε is the last: it leaves an error of s².
const LAST_STEP: f64 = 0.1;

/// This many steps of that size suffice in any case. Each leaves at most a fraction 1/(ν − 1) of
/// the error, down to rounding.
const SMALL_STEPS: f64 = 6.0;

/// Below this cosine t₁ is within 1/16 rad of its end at π, and the digits that t₁ loses are those
/// of its moment.
const EDGE: f64 = -0.998;

/// The largest step, as a fraction of the distance to the end of the interval.
const REACH: f64 = 0.9;

/// The least sine: the smallest normal number of f32, also in f64.
const LEAST_SINE: f64 = 1.1754943508222875e-38;

/// A canonical pair of end angles, and how it was obtained.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Canonical<S> {
    /// a ≥ b, a + b ≤ 0
    pub angles: [S; 2],
    /// −1 if mirrored, else 1.
    pub mirrored: S,
    /// 1 if the ends were exchanged, else −1.
    pub swapped: S,
}

impl<S: Scalar> Canonical<S> {
    #[inline(always)]
    pub fn of(a: S, b: S) -> Self {
        let mirrored = (b - a).if_positive(-S::ONE, S::ONE);
        let (a, b) = (mirrored * a, mirrored * b);
        // A half turn is the limit, and may round to either side.
        let slack = 4.0 * <S::Number as Real>::EPSILON.to_f64();
        let beyond = a - b - S::of(PI * (1.0 - slack));
        let inside = beyond.if_positive(S::of(2.0 * slack * PI) - beyond, -S::ONE);
        let shrink = inside.if_positive(S::of(1.0 - 2.0 * slack), S::ONE);
        let (a, b) = (shrink * a, shrink * b);
        let swapped = (a + b).if_positive(S::ONE, -S::ONE);
        Canonical { angles: [swapped.if_positive(-b, a), swapped.if_positive(-a, b)], mirrored, swapped }
    }

    /// Restores the order of first and last before the exchange of the ends.
    #[inline(always)]
    pub fn restore(&self, [first, last]: [S; 2]) -> [S; 2] {
        [self.swapped.if_positive(last, first), self.swapped.if_positive(first, last)]
    }
}

/// A piece of the universal curve, with the position of its chord.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<S> {
    /// t₀ and t₁
    pub t: [S; 2],
    /// 1 without an inflection, −1 with one.
    pub side: S,
    /// sin t₀, sin t₁
    pub sine: [S; 2],
    /// cos t₀, cos t₁
    pub cosine: [S; 2],
    /// S(t₀), S(t₁)
    pub moment: [S; 2],
    /// t₀^q, where t₀ ≤ π/2
    pub power: S,
    /// The displacement in the direction of the force, and orthogonal to it.
    pub along: S,
    pub across: S,
    /// The displacement orthogonal to and along the chord's required direction: D sin g, D cos g.
    pub miss: [S; 2],
    /// D, the chord's length.
    pub chord: S,
    /// e = sin^{1−q} t₀, which is finite even if dS/dt is not.
    pub soft: S,
    /// e dg/dt₀
    pub slope: S,
}

/// The given quantities of a problem: a and b canonical, η = (a + b)/2, 2h = a − b.
#[derive(Clone, Copy, Debug)]
struct Given<S> {
    sine_a: S,
    cosine_a: S,
    turning: S,
    sine_turning: S,
    cosine_turning: S,
    /// sin η, cos η
    mean: (S, S),
    /// sin h, cos h
    half: (S, S),
}

impl<S: Scalar> Given<S> {
    #[inline(always)]
    fn of([a, b]: [S; 2]) -> Self {
        let (sine_a, cosine_a) = sine_cosine(a);
        let turning = a - b;
        let half = sine_cosine(S::of(0.5) * turning);
        let mean = sine_cosine(S::of(0.5) * (a + b));
        let sine_turning = S::of(2.0) * half.0 * half.1;
        let cosine_turning = S::ONE - S::of(2.0) * half.0 * half.0;
        Given { sine_a, cosine_a, turning, sine_turning, cosine_turning, mean, half }
    }

    /// The piece that starts at t₀.
    #[inline(always)]
    fn piece(&self, curve: &Universal, t0: S, side: S) -> Piece<S> {
        let q = S::of(curve.q);
        let t1 = t0 + self.turning;
        let (sine0, cosine0) = sine_cosine(t0);
        let sine1 = (sine0 * self.cosine_turning + cosine0 * self.sine_turning).max(S::of(LEAST_SINE));
        let cosine1 = cosine0 * self.cosine_turning - sine0 * self.sine_turning;
        let (moment0, along0, power) = curve.moment_along_power(t0);
        let (moment1, along1) = curve.moment_along(t1);
        let along = along1 - side * along0;
        let across = (moment1 - side * moment0) / q;
        // φ = a − π/2 + t₀
        let sine_force = sine0 * self.sine_a - cosine0 * self.cosine_a;
        let cosine_force = sine0 * self.cosine_a + cosine0 * self.sine_a;
        let square = along * along + across * across;
        let soft = moment0.if_positive(sine0 / moment0, S::ZERO);
        let late = S::ONE + (along * cosine1 / sine1 - across) * moment1 / square;
        let piece = Piece {
            t: [t0, t1],
            side,
            sine: [sine0, sine1],
            cosine: [cosine0, cosine1],
            moment: [moment0, moment1],
            power,
            along,
            across,
            miss: [along * sine_force + across * cosine_force, along * cosine_force - across * sine_force],
            chord: square.sqrt(),
            soft,
            slope: soft * late - side * (along * cosine0 - across * sine0) / square,
        };
        // Only without an inflection do the values at both ends almost cancel.
        let close = S::of(CLOSE) * (t0 + S::of(0.5) * self.turning) - S::of(0.5) * self.turning;
        let close = side.if_positive(close, -S::ONE);
        if (0..S::LANES).any(|lane| close.lane(lane) > S::Number::ZERO) {
            return self.close(curve, &piece, close);
        }
        piece
    }

    /// The same piece for ends that are close together, from the series at the midpoint m. The
    /// angle from the force to the chord is −η at tan = u = cos m (Q − P)/(P sin m + Q cos² m / sin
    /// m).
    #[inline(never)]
    fn close(&self, curve: &Universal, piece: &Piece<S>, close: S) -> Piece<S> {
        let [sine0, cosine0] = [piece.sine[0], piece.cosine[0]];
        let (half_sine, half_cosine) = self.half;
        let sine = close.if_positive(sine0 * half_cosine + cosine0 * half_sine, S::ONE);
        let cosine = close.if_positive(cosine0 * half_cosine - sine0 * half_sine, S::ZERO);
        let cotangent = cosine / sine;
        let h = close.if_positive(S::of(0.5) * self.turning, S::ZERO);
        let series = curve.difference_series(S::ONE / (sine * sine), cotangent, h);
        let [excess_slope, along_slope] = series.slopes;
        let (p, u) = (series.along, series.excess);
        let across = p + u;
        let (sine_mean, cosine_mean) = self.mean;
        let length = p * sine + across * cosine * cotangent;
        let bend = cosine * u;
        let ratio = bend / length;
        let length_slope = along_slope * sine + p * cosine + (along_slope + excess_slope) * cosine * cotangent
            - across * cosine * (S::of(2.0) + cotangent * cotangent);
        let ratio_slope = (cosine * excess_slope - sine * u - ratio * length_slope) / length;
        let scale = self.turning * curve.power(sine);
        let pick = |yes: S, no: S| close.if_positive(yes, no);
        Piece {
            along: pick(scale * p, piece.along),
            across: pick(scale * across * cotangent, piece.across),
            miss: [
                pick(scale * (cosine_mean * bend + sine_mean * length), piece.miss[0]),
                pick(scale * (cosine_mean * length - sine_mean * bend), piece.miss[1]),
            ],
            chord: pick(scale * (p * p + across * across * cotangent * cotangent).sqrt(), piece.chord),
            slope: pick(piece.soft * ratio_slope / (S::ONE + ratio * ratio), piece.slope),
            ..*piece
        }
    }
}

#[inline(always)]
fn smaller<S: Scalar>(x: S, y: S) -> S {
    (y - x).if_positive(x, y)
}

/// The cheapest piece for canonical angles, and 1 if there is one, else 0. At most one of the
/// angles may be 0.
#[inline(always)]
pub(crate) fn cheapest<S: Scalar>(curve: &Universal, angles: [S; 2]) -> (Piece<S>, S) {
    let given = Given::of(angles);
    let [a, b] = angles;
    let (zero, one, q) = (S::ZERO, S::ONE, S::of(curve.q));
    let at_inflection = given.piece(curve, zero, one);
    // 1 without, −1 with an inflection: from a < 0, a curve that turns right never returns to its
    // chord.
    let side = (-a).max(-at_inflection.miss[0]).if_positive(-one, one);
    // Without: t₀ from the ratio of moments R of splines. With: from below, where φ > −π/2.
    let ratio = ((S::of(2.0) * a + b) / (-(a + S::of(2.0) * b))).max(zero);
    let ratio = smaller(ratio, one);
    let mut t0 = side.if_positive(given.start_of(curve.root(ratio)), (-a).max(zero));
    // The interval: t₁ < π and φ < π/2.
    let room = S::of(PI) - given.turning.max(a).max(zero);
    let mut low = t0;
    let tolerance = <S::Number as Real>::EPSILON.to_f64();
    let last_step = S::of(LAST_STEP * tolerance.sqrt());
    let noise = S::of(0.5 * tolerance) * b.abs();
    let near = S::of(NEAR) * b.abs();
    let half_way = S::of(0.5f64.powf(1.0 / curve.q));
    let edge_noise = S::of(8.0 * tolerance);
    let mut found = zero;
    let mut live = room;
    let (mut last, mut small_steps) = (zero, zero);
    // Steps in t₀ never overshoot the root. Steps in w may.
    let mut careful = (-a).if_positive(one, -one);
    let mut piece;
    let mut step = 0;
    loop {
        piece = given.piece(curve, t0, side);
        if step == MOST_STEPS {
            break;
        }
        step += 1;
        // 2 tan(g/2) agrees with g near 0, and needs no arctangent.
        let miss = S::of(2.0) * piece.miss[0] / (piece.chord + piece.miss[1]);
        let enough = last.if_positive(near, noise);
        // Near the end of the interval sin t₁ has lost digits.
        let edge = (S::of(EDGE) - piece.cosine[1])
            .if_positive(edge_noise * piece.moment[1] / (piece.sine[1] * piece.chord), zero);
        let done = enough.max(edge) - miss.abs();
        found = live.if_positive(done.if_positive(one, found), found);
        live = done.if_positive(-one, live);
        let stretch = one + S::of(0.25) * miss * miss;
        // Without: in R.
        let ratio = piece.moment[0] / piece.moment[1];
        let by_ratio = stretch * piece.slope * piece.moment[1] * piece.sine[1] / (q * given.sine_turning);
        let next_ratio = (ratio - miss / by_ratio).max(zero);
        let next_ratio = smaller(next_ratio, one);
        // With: in t₀, or in w = t₀^q where t₀ may be near 0.
        let by_start = stretch * piece.slope / piece.soft;
        let w = piece.power;
        let lift = t0.if_positive(piece.moment[0] * t0 / (w * piece.sine[0]), one);
        let by_moment = stretch * piece.slope * lift / q;
        let rises = piece.slope;
        low = (-miss).if_positive(rises.if_positive(t0, low), low);
        let late = careful.max(t0 - S::of(FRAC_PI_2));
        let moved = late.if_positive(miss / by_start, miss / by_moment);
        let root = curve.root(side.if_positive(next_ratio, (w - moved).max(zero)));
        let newton = late.if_positive(t0 - moved, root);
        let most = t0 + S::of(REACH) * (room - t0);
        let newton = smaller(newton, most);
        let inflected = rises.if_positive(newton, S::of(0.5) * (low + t0));
        // If g is below 0 and falling, or at the end of the interval, it never reaches 0, since it
        // is concave.
        let ended = (t0 - (one - last_step) * room).max(-rises);
        let past = ended.if_positive((-miss).if_positive(one, -one), -one);
        // A step from beyond the root back to where g already rose would oscillate.
        let returns = careful.if_positive(-one, miss.if_positive((newton - low).if_positive(-one, rises), -one));
        let past = side.if_positive(-one, past.max(returns));
        let hopeless = careful.if_positive(past, -one);
        live = hopeless.if_positive(-one, live);
        // Continues in t₀ from where g last rose below 0. If that is only t₀ = 0, where t₀ does not
        // move, halves w first.
        let back = low.if_positive(low, half_way * t0);
        let inflected = past.if_positive(back, inflected);
        let next = side.if_positive(given.start_of(root), inflected);
        // Moments are relative to the larger one, at the end.
        let scale = side.if_positive(one, late.if_positive(t0, piece.moment[1]));
        let moved = side.if_positive(next_ratio - ratio, moved);
        let small = past.if_positive(zero, (last_step * scale - moved.abs()).if_positive(one, zero));
        small_steps = live.if_positive(small_steps + small, small_steps);
        // For ν > 2, an inflection near an end leaves g without a second derivative there. The
        // error is then s²/R, or s² R.
        let bend = if curve.exponent > 2.0 { smaller(ratio, one / ratio).sqrt() } else { one };
        let small = small * (last_step * scale * bend - moved.abs()).if_positive(one, zero);
        let small = small.max((small_steps - S::of(SMALL_STEPS - 0.5)).if_positive(one, zero));
        last = live.if_positive(small, last);
        careful = past.if_positive(low.if_positive(one, careful), careful);
        t0 = live.if_positive(next, t0);
        if !(0..S::LANES).any(|lane| live.lane(lane) > S::Number::ZERO) {
            break;
        }
    }
    let apart = S::of(PI) - given.turning;
    (piece, apart.if_positive(found, zero))
}

impl<S: Scalar> Given<S> {
    /// t₀ for the ratio R = S(t₀)/S(t₁) of the moments: tan t₀ = ρ sin 2h / (1 − ρ cos 2h) with ρ =
    /// R^{1/q} = sin t₀/sin t₁.
    #[inline(always)]
    fn start_of(&self, rho: S) -> S {
        first_quadrant_angle(rho * self.sine_turning, S::ONE - rho * self.cosine_turning)
    }
}

/// The piece that starts at an inflection (a free end, without moment) and ends at the angle b < 0,
/// and 1 if there is one, else 0.
#[inline(always)]
pub(crate) fn from_inflection<S: Scalar>(curve: &Universal, b: S) -> (Piece<S>, S) {
    let (zero, one, q) = (S::ZERO, S::ONE, S::of(curve.q));
    let (sine_b, cosine_b) = sine_cosine(b);
    let tolerance = <S::Number as Real>::EPSILON.to_f64();
    let (last_step, noise) = (S::of(LAST_STEP * tolerance.sqrt()), S::of(2.0 * tolerance));
    // b = −t₁/(q + 1) for small angles.
    let mut t = -(b * (one + q));
    t = smaller(t, S::of(FRAC_PI_2));
    let (mut live, mut found, mut last) = (one, zero, zero);
    let mut piece;
    let mut step = 0;
    loop {
        let (sine, cosine) = sine_cosine(t);
        let sine = sine.max(S::of(LEAST_SINE));
        let (moment, along) = curve.moment_along(t);
        let across = moment / q;
        // φ = b − π/2 + t₁
        let sine_force = sine * sine_b - cosine * cosine_b;
        let cosine_force = sine * cosine_b + cosine * sine_b;
        let square = along * along + across * across;
        let slope = one + (along * cosine / sine - across) * moment / square;
        piece = Piece {
            t: [zero, t],
            side: one,
            sine: [zero, sine],
            cosine: [one, cosine],
            moment: [zero, moment],
            power: zero,
            along,
            across,
            miss: [along * sine_force + across * cosine_force, along * cosine_force - across * sine_force],
            chord: square.sqrt(),
            soft: zero,
            slope,
        };
        let miss = S::of(2.0) * piece.miss[0] / (piece.chord + piece.miss[1]);
        let done = last.if_positive(one, noise * t - miss.abs());
        let rises = slope.if_positive(one, -one);
        found = live.if_positive(done.if_positive(rises, found), found).max(zero);
        live = done.if_positive(-one, live);
        step += 1;
        if step > MOST_STEPS || !(0..S::LANES).any(|lane| live.lane(lane) > S::Number::ZERO) {
            return (piece, found);
        }
        let next = t - miss / ((one + S::of(0.25) * miss * miss) * slope);
        let most = t + S::of(0.5) * (S::of(PI) - t);
        let next = smaller(next, most);
        let next = next.max(S::of(0.1) * t);
        // If g does not increase with t any more, there is no root beyond.
        live = slope.if_positive(live, -one);
        last = live.if_positive((last_step * t - (next - t).abs()).if_positive(one, zero), last);
        t = live.if_positive(next, t);
    }
}

/// The other piece with an inflection for canonical angles, if there is one beyond the piece that
/// starts at t₀: g has risen there, and falls below 0 again within the interval.
pub(crate) fn second(curve: &Universal, angles: [f64; 2], t0: f64) -> Option<Piece<f64>> {
    let given = Given::of(angles);
    let room = PI - given.turning.max(angles[0]).max(0.0);
    let miss = |t: f64| {
        let piece = given.piece(curve, t, -1.0);
        piece.miss[0].atan2(piece.miss[1])
    };
    // The first root may be double: starts where g has certainly risen, or falls at once.
    let step = (room - t0) * f64::EPSILON.sqrt();
    let (mut low, mut high) = (t0 + step, room * (1.0 - f64::EPSILON));
    if !(low < high && miss(low) > 0.0 && miss(high) < 0.0) {
        return None;
    }
    while high - low > f64::EPSILON * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if miss(middle) > 0.0 { low = middle } else { high = middle }
    }
    Some(given.piece(curve, 0.5 * (low + high), -1.0))
}
