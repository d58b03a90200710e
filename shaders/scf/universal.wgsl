// The universal curves, whose pieces are segments: S(t), J(t) and differences between close places.
// Needs trig.wgsl, linalg/power.wgsl (t ≥ 2.3e−308 in f64 and 1.2e−38 in f32, or 0) and an array
// `exponents` with a block per exponent: ν, q, 1/q, J(π/2), the coefficients of S(t)/t^q and of
// J(t)/t^{q+1}, and those of the series of differences.
// Twin: src/scf/universal.rs, which gives the formulas.

// No twin: the host writes a block in this order.
const UNIVERSAL_EXPONENT: u32 = 0u;
const UNIVERSAL_Q: u32 = 1u;
const UNIVERSAL_INVERSE_Q: u32 = 2u;
const UNIVERSAL_HALF: u32 = 3u;
const UNIVERSAL_MOMENT: u32 = 4u;
const UNIVERSAL_ALONG: u32 = 18u;
const UNIVERSAL_DIFFERENCES: u32 = 32u;
const UNIVERSAL_NUMBERS: u32 = 60u;

const TO_UNIT: real = real(0.8105694691387022);

struct Universal {
    exponent: real,
    q: real,
    inverse_q: real,
    // J(π/2)
    half: real,
    // The position of its block.
    at: u32,
}

fn universal_of(number: u32) -> Universal {
    let at = number * UNIVERSAL_NUMBERS;
    return Universal(
        exponents[at + UNIVERSAL_EXPONENT],
        exponents[at + UNIVERSAL_Q],
        exponents[at + UNIVERSAL_INVERSE_Q],
        exponents[at + UNIVERSAL_HALF],
        at,
    );
}

// t^q
fn power_of(curve: Universal, t: real) -> real {
    if (curve.q == real(0.5)) {
        return sqrt(t);
    }
    return power(t, curve.q);
}

// t^{1/q}
fn root_of(curve: Universal, t: real) -> real {
    if (curve.q == real(0.5)) {
        return t * t;
    }
    return power(t, curve.inverse_q);
}

struct MomentAlong {
    moment: real,
    along: real,
    // t^q, where t ≤ π/2
    power: real,
}

// S(t) and J(t) for 0 ≤ t ≤ π, and t^q for t ≤ π/2.
fn moment_along(curve: Universal, t: real) -> MomentAlong {
    let folds = t > FRAC_PI_2;
    let near = larger(select(t, PI - t, folds), real(0));
    let x = near * near * TO_UNIT - real(1);
    let lift = power_of(curve, near);
    var moment = exponents[curve.at + UNIVERSAL_MOMENT + 13u];
    var along = exponents[curve.at + UNIVERSAL_ALONG + 13u];
//:unroll k 13..0
    moment = moment * x + exponents[curve.at + UNIVERSAL_MOMENT + $ku];
    along = along * x + exponents[curve.at + UNIVERSAL_ALONG + $ku];
//:end
    along = near * lift * along;
    return MomentAlong(lift * moment, select(along, real(2) * curve.half - along, folds), lift);
}

struct Differences {
    // P
    along: real,
    // Q − P
    excess: real,
    // d(Q − P)/dm, dP/dm
    excess_slope: real,
    along_slope: real,
}

// The series at m, for given 1/sin² m, cot m and h.
fn difference_series(curve: Universal, inverse_square: real, cotangent: real, h: real) -> Differences {
    let step = h * h;
    let x = inverse_square;
    let at = curve.at + UNIVERSAL_DIFFERENCES;
    var p = real(0);
    var u = real(0);
    var p_slope = real(0);
    var u_slope = real(0);
    var row = real(0);
    var row_u = real(0);
    var row_slope = real(0);
    var row_u_slope = real(0);
    var c = real(0);
    var share = real(0);
    // Row n has n coefficients.
//:unroll n 8..1
    row = real(0);
    row_u = real(0);
    row_slope = real(0);
    row_u_slope = real(0);
//:unroll j $n..0
    c = exponents[at + $nu * ($nu - 1u) / 2u + $ju];
    share = real(-2) * real($j) / curve.q;
    row = row * x + c;
    row_u = row_u * x + c * share;
    row_slope = row_slope * x + c * real($j);
    row_u_slope = row_u_slope * x + c * share * real($j);
//:end
    p = p * step + row;
    u = u * step + row_u;
    p_slope = p_slope * step + row_slope;
    u_slope = u_slope * step + row_u_slope;
//:end
    let factor = real(-2) * cotangent;
    return Differences(p, u, factor * u_slope, factor * p_slope);
}
