// The chord condition of a segment: determines the piece of the universal curve that joins two
// points with given tangents. Needs universal.wgsl.
// Twin: src/scf/root.rs, which gives the formulas.

const MOST_STEPS: u32 = 60u;
const CLOSE: real = real(0.125);
const NEAR: real = real(1e-3);
const LAST_STEP: real = real(0.1);
const SMALL_STEPS: real = real(6);
const EDGE: real = real(-0.998);
const REACH: real = real(0.9);

const LEAST_SINE: real = real(1.1754943508222875e-38);

//:if F64
const EPSILON: real = real(2.220446049250313e-16);
const ROOT_EPSILON: real = real(1.4901161193847656e-8);
//:else
const EPSILON: real = real(1.1920928955078125e-7);
const ROOT_EPSILON: real = real(3.4526698300124393e-4);
//:end

// A canonical pair of end angles, and how it was obtained.
struct Canonical {
    // a ≥ b, a + b ≤ 0
    a: real,
    b: real,
    // −1 if mirrored, else 1.
    mirrored: real,
    // Whether the ends were exchanged.
    swapped: bool,
}

fn canonical_of(a: real, b: real) -> Canonical {
    let mirrored = select(real(1), real(-1), b - a > real(0));
    var c = mirrored * a;
    var d = mirrored * b;
    // A half turn is the limit, and may round to either side.
    let slack = real(4) * EPSILON;
    let beyond = c - d - PI * (real(1) - slack);
    if (beyond > real(0) && real(2) * slack * PI - beyond > real(0)) {
        c *= real(1) - real(2) * slack;
        d *= real(1) - real(2) * slack;
    }
    let swapped = c + d > real(0);
    return Canonical(select(c, -d, swapped), select(d, -c, swapped), mirrored, swapped);
}

// A piece of the universal curve, with the position of its chord.
struct Piece {
    t0: real,
    // Whether it has no inflection.
    plain: bool,
    sine0: real,
    sine1: real,
    cosine0: real,
    cosine1: real,
    moment0: real,
    moment1: real,
    // t₀^q, where t₀ ≤ π/2
    power: real,
    // The displacement in the direction of the force, and orthogonal to it.
    along: real,
    across: real,
    // The displacement orthogonal to and along the chord's required direction.
    miss: real,
    reach: real,
    // The chord's length.
    chord: real,
    // e = sin^{1−q} t₀, and e dg/dt₀
    soft: real,
    slope: real,
}

// The given quantities of a problem: a and b canonical, η = (a + b)/2, 2h = a − b.
struct Given {
    sine_a: real,
    cosine_a: real,
    turning: real,
    sine_turning: real,
    cosine_turning: real,
    // Of η.
    mean: SineCosine,
    // Of h.
    half: SineCosine,
}

fn given_of(a: real, b: real) -> Given {
    let first = sine_cosine(a);
    let turning = a - b;
    let half = sine_cosine(real(0.5) * turning);
    let mean = sine_cosine(real(0.5) * (a + b));
    let sine_turning = real(2) * half.sine * half.cosine;
    let cosine_turning = real(1) - real(2) * half.sine * half.sine;
    return Given(first.sine, first.cosine, turning, sine_turning, cosine_turning, mean, half);
}

// The piece that starts at t₀.
fn piece_at(curve: Universal, known: Given, t0: real, plain: bool) -> Piece {
    let side = select(real(-1), real(1), plain);
    let t1 = t0 + known.turning;
    let start = sine_cosine(t0);
    let sine0 = start.sine;
    let cosine0 = start.cosine;
    let sine1 = larger(sine0 * known.cosine_turning + cosine0 * known.sine_turning, LEAST_SINE);
    let cosine1 = cosine0 * known.cosine_turning - sine0 * known.sine_turning;
    let first = moment_along(curve, t0);
    let last = moment_along(curve, t1);
    let along = last.along - side * first.along;
    let across = (last.moment - side * first.moment) / curve.q;
    // φ = a − π/2 + t₀
    let sine_force = sine0 * known.sine_a - cosine0 * known.cosine_a;
    let cosine_force = sine0 * known.cosine_a + cosine0 * known.sine_a;
    let square = along * along + across * across;
    var soft = real(0);
    if (first.moment > real(0)) {
        soft = sine0 / first.moment;
    }
    let late = real(1) + (along * cosine1 / sine1 - across) * last.moment / square;
    let piece = Piece(
        t0,
        plain,
        sine0,
        sine1,
        cosine0,
        cosine1,
        first.moment,
        last.moment,
        first.power,
        along,
        across,
        along * sine_force + across * cosine_force,
        along * cosine_force - across * sine_force,
        sqrt(square),
        soft,
        soft * late - side * (along * cosine0 - across * sine0) / square,
    );
    // Only without an inflection do the values at both ends almost cancel.
    let close = CLOSE * (t0 + real(0.5) * known.turning) - real(0.5) * known.turning;
    if (plain && close > real(0)) {
        return closed_up(curve, known, piece);
    }
    return piece;
}

// The same piece for ends that are close together, from the series at the midpoint m.
fn closed_up(curve: Universal, known: Given, rough: Piece) -> Piece {
    let sine = rough.sine0 * known.half.cosine + rough.cosine0 * known.half.sine;
    let cosine = rough.cosine0 * known.half.cosine - rough.sine0 * known.half.sine;
    let cotangent = cosine / sine;
    let h = real(0.5) * known.turning;
    let series = difference_series(curve, real(1) / (sine * sine), cotangent, h);
    let p = series.along;
    let u = series.excess;
    let across = p + u;
    let length = p * sine + across * cosine * cotangent;
    let bend = cosine * u;
    let ratio = bend / length;
    let length_slope = series.along_slope * sine + p * cosine
        + (series.along_slope + series.excess_slope) * cosine * cotangent
        - across * cosine * (real(2) + cotangent * cotangent);
    let ratio_slope = (cosine * series.excess_slope - sine * u - ratio * length_slope) / length;
    let scale = known.turning * power_of(curve, sine);
    var piece = rough;
    piece.along = scale * p;
    piece.across = scale * across * cotangent;
    piece.miss = scale * (known.mean.cosine * bend + known.mean.sine * length);
    piece.reach = scale * (known.mean.cosine * length - known.mean.sine * bend);
    piece.chord = scale * sqrt(p * p + across * across * cotangent * cotangent);
    piece.slope = rough.soft * ratio_slope / (real(1) + ratio * ratio);
    return piece;
}

// t₀ for the ratio R = S(t₀)/S(t₁) of the moments, with ρ = R^{1/q} = sin t₀/sin t₁.
fn start_of(known: Given, rho: real) -> real {
    return first_quadrant_angle(rho * known.sine_turning, real(1) - rho * known.cosine_turning);
}

struct Cheapest {
    piece: Piece,
    exists: bool,
}

// The cheapest piece for canonical angles. At most one of the angles may be 0.
fn cheapest(curve: Universal, a: real, b: real) -> Cheapest {
    let known = given_of(a, b);
    var plain = true;
    var t0 = real(0);
    var room = real(0);
    var low = real(0);
    var found = false;
    var live = true;
    var last = false;
    var small_steps = real(0);
    // Steps in t₀ never overshoot the root. Steps in w may.
    var careful = -a > real(0);
    let last_step = LAST_STEP * ROOT_EPSILON;
    let noise = real(0.5) * EPSILON * abs(b);
    let near = NEAR * abs(b);
    let half_way = root_of(curve, real(0.5));
    let edge_noise = real(8) * EPSILON;
    var piece: Piece;
    // The first turn evaluates g with an inflection at the start.
    for (var step = 0u; step <= MOST_STEPS; step++) {
        piece = piece_at(curve, known, t0, plain);
        if (step == 0u) {
            plain = !(larger(-a, -piece.miss) > real(0));
            let ratio = smaller(larger((real(2) * a + b) / (-(a + real(2) * b)), real(0)), real(1));
            if (plain) {
                t0 = start_of(known, root_of(curve, ratio));
            } else {
                t0 = larger(-a, real(0));
            }
            room = PI - larger(larger(known.turning, a), real(0));
            low = t0;
            live = room > real(0);
            continue;
        }
        // 2 tan(g/2) agrees with g near 0, and needs no arctangent.
        let miss = real(2) * piece.miss / (piece.chord + piece.reach);
        let enough = select(noise, near, last);
        // Near the end of the interval sin t₁ has lost digits.
        var edge = real(0);
        if (EDGE - piece.cosine1 > real(0)) {
            edge = edge_noise * piece.moment1 / (piece.sine1 * piece.chord);
        }
        let done = larger(enough, edge) - abs(miss) > real(0);
        found = found || (live && done);
        live = live && !done;
        if (!live) {
            break;
        }
        let stretch = real(1) + real(0.25) * miss * miss;
        let ratio = piece.moment0 / piece.moment1;
        var moved = real(0);
        var scale = real(1);
        var past = false;
        if (plain) {
            // In R.
            let by_ratio = stretch * piece.slope * piece.moment1 * piece.sine1 / (curve.q * known.sine_turning);
            let next_ratio = smaller(larger(ratio - miss / by_ratio, real(0)), real(1));
            moved = next_ratio - ratio;
            t0 = start_of(known, root_of(curve, next_ratio));
        } else {
            // In t₀, or in w = t₀^q where t₀ may be near 0.
            let rises = piece.slope > real(0);
            if (-miss > real(0) && rises) {
                low = t0;
            }
            var newton = real(0);
            if (careful || t0 - FRAC_PI_2 > real(0)) {
                let by_start = stretch * piece.slope / piece.soft;
                moved = miss / by_start;
                newton = t0 - moved;
                scale = t0;
            } else {
                let w = piece.power;
                var lift = real(1);
                if (t0 > real(0)) {
                    lift = piece.moment0 * t0 / (w * piece.sine0);
                }
                let by_moment = stretch * piece.slope * lift / curve.q;
                moved = miss / by_moment;
                newton = root_of(curve, larger(w - moved, real(0)));
                // Moments are relative to the larger one, at the end.
                scale = piece.moment1;
            }
            newton = smaller(newton, t0 + REACH * (room - t0));
            var next = select(real(0.5) * (low + t0), newton, rises);
            // If g is below 0 and falling, or at the end of the interval, it never reaches 0, since
            // it is concave.
            let ended = t0 - (real(1) - last_step) * room > real(0) || -piece.slope > real(0);
            past = ended && -miss > real(0);
            // A step from beyond the root back to where g already rose would oscillate.
            let returns = !careful && miss > real(0) && !(newton - low > real(0)) && rises;
            past = past || returns;
            if (careful && past) {
                break;
            }
            if (past) {
                // Continues in t₀ from where g last rose below 0. If that is only t₀ = 0, where t₀
                // does not move, halves w first.
                next = select(half_way * t0, low, low > real(0));
                careful = low > real(0);
            }
            t0 = next;
        }
        let small = !past && last_step * scale - abs(moved) > real(0);
        small_steps += select(real(0), real(1), small);
        // For ν > 2, an inflection near an end leaves g without a second derivative there. The
        // error is then s²/R, or s² R.
        var fine = scale;
        if (curve.exponent > real(2)) {
            fine = scale * sqrt(smaller(ratio, real(1) / ratio));
        }
        last = (small && last_step * fine - abs(moved) > real(0)) || small_steps - (SMALL_STEPS - real(0.5)) > real(0);
    }
    return Cheapest(piece, found && PI - known.turning > real(0));
}

// The piece that starts at an inflection (a free end, without moment) and ends at the angle b < 0.
fn from_inflection(curve: Universal, b: real) -> Cheapest {
    let end = sine_cosine(b);
    let noise = real(2) * EPSILON;
    // b = −t₁/(q + 1) for small angles.
    var t = smaller(-(b * (real(1) + curve.q)), FRAC_PI_2);
    var last = false;
    var found = false;
    var piece: Piece;
    for (var step = 0u; step <= MOST_STEPS; step++) {
        let at = sine_cosine(t);
        let sine = larger(at.sine, LEAST_SINE);
        let cosine = at.cosine;
        let own = moment_along(curve, t);
        let across = own.moment / curve.q;
        // φ = b − π/2 + t₁
        let sine_force = sine * end.sine - cosine * end.cosine;
        let cosine_force = sine * end.cosine + cosine * end.sine;
        let square = own.along * own.along + across * across;
        let slope = real(1) + (own.along * cosine / sine - across) * own.moment / square;
        piece = Piece(
            real(0),
            true,
            real(0),
            sine,
            real(1),
            cosine,
            real(0),
            own.moment,
            real(0),
            own.along,
            across,
            own.along * sine_force + across * cosine_force,
            own.along * cosine_force - across * sine_force,
            sqrt(square),
            real(0),
            slope,
        );
        let miss = real(2) * piece.miss / (piece.chord + piece.reach);
        let rises = slope > real(0);
        if (last || noise * t - abs(miss) > real(0)) {
            found = rises;
            break;
        }
        // If g does not increase with t any more, there is no root beyond.
        if (!rises) {
            break;
        }
        let step_to = t - miss / ((real(1) + real(0.25) * miss * miss) * slope);
        let next = larger(smaller(step_to, t + real(0.5) * (PI - t)), real(0.1) * t);
        last = LAST_STEP * ROOT_EPSILON * t - abs(next - t) > real(0);
        t = next;
    }
    return Cheapest(piece, found);
}
