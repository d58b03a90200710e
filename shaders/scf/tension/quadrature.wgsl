// Lengths and displacements of arcs under a pull, by Gauss rules on panels graded towards the
// integrand's singularities. Needs trig.wgsl, linalg/power.wgsl and an array `exponents` with a
// block per exponent.
// Twin: src/scf/tension/quadrature.rs, which gives the formulas.
// Lengths are in the unit in which λ is 1, for which f32 has enough range: for ν = 20, λ is up to
// 1e45 on a chord of 1.

// No twin: the host writes a block in this order: ν, q, 1/q, 1/ν, and of each rule 16 pairs of a
// node and a weight.
const LAW_NU: u32 = 0u;
const LAW_Q: u32 = 1u;
const LAW_INVERSE_Q: u32 = 2u;
const LAW_INVERSE_NU: u32 = 3u;
const LAW_LEGENDRE: u32 = 4u;
const LAW_INFLECTION: u32 = 36u;
const LAW_FLAT: u32 = 68u;
const LAW_NUMBERS: u32 = 100u;

const POINTS: u32 = 16u;
const ELLIPSE: real = real(3.2);

// No twin: the most panels of an arc. The host may use more, and llvmpipe ends a thread's loops
// after 65,535 turns in total.
const MOST_PANELS: u32 = 64u;

struct Law {
    nu: real,
    q: real,
    inverse_q: real,
    inverse_nu: real,
    // The position of its block.
    at: u32,
}

fn law_of(number: u32) -> Law {
    let at = number * LAW_NUMBERS;
    return Law(exponents[at + LAW_NU], exponents[at + LAW_Q], exponents[at + LAW_INVERSE_Q], exponents[at + LAW_INVERSE_NU], at);
}

// The pull of all three kinds: f = level + 2 sin(x/2) (hold sin(x/2) + lift cos(x/2)).
struct Pull {
    // ε below the tension, else 0.
    level: real,
    // 1 − ε below the tension, else 1.
    hold: real,
    // t above the tension, else 0.
    lift: real,
    // The angle of an inflection from the pull; 0 without an inflection.
    opening: real,
    // The distance of the zeros of f from the real axis.
    height: real,
    // The rule at a zero of f.
    rule: u32,
}

// |P| = λ(1 − gap)
fn pull_below(gap: real) -> Pull {
    // Since tanh ≤ 1, never above the true distance 2 artanh √(ε/(2 − ε)).
    let height = real(2) * sqrt(gap / (real(2) - gap));
    return Pull(gap, real(1) - gap, real(0), real(0), height, LAW_LEGENDRE);
}

fn pull_critical() -> Pull {
    return Pull(real(0), real(1), real(0), real(0), real(0), LAW_FLAT);
}

// |P|² = λ² + t²
fn pull_above(t: real) -> Pull {
    return Pull(real(0), real(1), t, first_quadrant_angle(t, real(1)), real(0), LAW_INFLECTION);
}

// f from the sine and the cosine of x/2; 0 ≤ x above the tension.
fn excess_at_half(pull: Pull, half: SineCosine) -> real {
    let sine = abs(half.sine);
    return larger(pull.level + real(2) * sine * (pull.hold * sine + pull.lift * half.cosine), real(0));
}

// |κ| for this f.
fn bent(law: Law, excess: real) -> real {
    let x = excess / (law.nu - real(1));
    if (law.nu == real(2)) {
        return sqrt(x);
    }
    // The base of the power is at most 1: `power` does not support values beyond the range of f32.
    let is_large = x > real(1);
    let root = power(select(x, real(1) / x, is_large), law.inverse_nu);
    return select(root, real(1) / root, is_large);
}

// Integrals with the weight ρ: ∫1, ∫cos x, ∫sin x; and with ρ/(νf): ∫cos² x, ∫cos x sin x, ∫sin² x.
struct Integrals {
    length: real,
    along: real,
    across: real,
    cosine_cosine: real,
    cosine_sine: real,
    sine_sine: real,
    // Whether there were enough panels.
    whole: bool,
}

// The integrals over `first … last`, 0 ≤ first.
fn integrals(law: Law, pull: Pull, first: real, last: real) -> Integrals {
    var sums = Integrals(real(0), real(0), real(0), real(0), real(0), real(0), true);
    var start = first;
    for (var panel = 0u; panel <= MOST_PANELS; panel++) {
        if (!(start < last)) {
            break;
        }
        sums.whole = panel < MOST_PANELS;
        var rule = LAW_LEGENDRE;
        var length = last - start;
        var offset = real(0);
        var distance = real(0);
//:unroll k 0..3
        // The real parts of the zeros of f: 0, −2o and 2π − 2o.
//:if $k == 0
        offset = -start;
//:end
//:if $k == 1
        offset = real(-2) * pull.opening - start;
//:end
//:if $k == 2
        offset = real(2) * (PI - pull.opening) - start;
//:end
        distance = sqrt(offset * offset + pull.height * pull.height);
        if (distance == real(0)) {
            rule = pull.rule;
        } else {
            // The ellipse with foci at the panel's ends passes through the zero.
            length = smaller(
                (ELLIPSE * distance - real(2) * offset) / (real(0.25) * ELLIPSE * ELLIPSE - real(1)),
                length,
            );
        }
//:end
        let end = select(start + length, last, start + length >= last);
        if (!(end > start)) {
            break;
        }
        length = end - start;
        for (var k = 0u; k < POINTS; k++) {
            let at = law.at + rule + 2u * k;
            let half = sine_cosine(real(0.5) * (start + length * exponents[at]));
            let excess = excess_at_half(pull, half);
            let sine = real(2) * half.sine * half.cosine;
            let cosine = (half.cosine - half.sine) * (half.cosine + half.sine);
            let radius = length * exponents[at + 1u] / bent(law, excess);
            let change = radius / (law.nu * excess);
            sums.length += radius;
            sums.along += radius * cosine;
            sums.across += radius * sine;
            sums.cosine_cosine += change * cosine * cosine;
            sums.cosine_sine += change * sine * cosine;
            sums.sine_sine += change * sine * sine;
        }
        start = end;
    }
    return sums;
}
