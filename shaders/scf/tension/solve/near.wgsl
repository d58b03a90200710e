// Shapes near a known one, by Newton's method on the closure of the chord. Needs quadrature.wgsl.
// Twin: src/scf/tension/solve/near.rs, which gives the reasons.
// All kinds share a loop, and both arcs of a shape share the code of one: drivers inline every
// call, and quadratures are long.

const STEPS: u32 = 12u;
const ROUNDING: real = real(4.0);
const STUCK: real = real(0.1);
const SMALL: real = real(256.0);
const FARTHEST_LOGARITHM: real = real(2.0);
const FARTHEST_ANGLE: real = real(0.5);

//:if F64
const EPSILON: real = real(2.220446049250313e-16);
//:else
const EPSILON: real = real(1.1920929e-7);
//:end

// No twin: e.
const EULER: real = real(2.718281828459045);

// An end of a shape: its argument x from the axis, sin x, cos x, f, and the radius of curvature.
// Next to an inflection inside, the radius is in a scale in which it stays finite.
struct End {
    argument: real,
    sine: real,
    cosine: real,
    excess: real,
    radius: real,
}

// A shape that closes the chord.
struct Near {
    found: bool,
    // The unknowns: the gap or t, and the axis, its distance, or the power of the overshoot.
    u: real,
    v: real,
    lift: real,
    // The chord across and along the axis.
    sine: real,
    cosine: real,
    // The upper end: 1 if the turn comes back to it, −1 if it does not reach the axis, 0 if it is
    // free.
    side: real,
    length: real,
    // The ends at the lower and the upper angle.
    low: End,
    high: End,
    // The closure's derivatives by the unknowns.
    right_u: real,
    right_v: real,
    up_u: real,
    up_v: real,
    // d(overshoot)/dv
    moved: real,
    // (overshoot)^{1/ν}
    scale: real,
}

struct Pair {
    u: real,
    v: real,
}

// The solution of (a b; c d) x = (e, f), with scaled columns.
// Twin: src/scf/tension/hessian.rs, as `solve`.
fn solved(here: Near, e: real, f: real) -> Pair {
    let first = larger(abs(here.right_u), abs(here.up_u));
    let second = larger(abs(here.right_v), abs(here.up_v));
    let a = here.right_u / first;
    let c = here.up_u / first;
    let b = here.right_v / second;
    let d = here.up_v / second;
    let determinant = a * d - b * c;
    return Pair((e * d - b * f) / determinant / first, (a * f - e * c) / determinant / second);
}

fn shortened(step: Pair) -> Pair {
    let most = larger(larger(abs(step.u) / FARTHEST_LOGARITHM, abs(step.v) / FARTHEST_ANGLE), real(1));
    return Pair(step.u / most, step.v / most);
}

// The shape of a kind on a chord between ends at `low` and `high`, from unknowns near the solution.
fn near(law: Law, chord: real, kind: u32, low: real, high: real, u: real, v: real) -> Near {
    let is_below = kind == FOLLOWED_BELOW;
    let is_flat = kind == FOLLOWED_FLAT || kind == FOLLOWED_FREE_FLAT;
    let is_free = kind == FOLLOWED_FREE_FLAT || kind == FOLLOWED_FREE_ABOVE;
    var here: Near;
    here.found = false;
    here.u = u;
    here.v = v;
    var before = real(1e30);
    for (var step = 0u; step < STEPS; step++) {
        // The ends' distances from the axis: signed without an inflection, otherwise both positive.
        var axis = here.v;
        var short = real(0);
        var first = low - axis;
        var last = high - axis;
        here.side = real(0);
        if (is_free) {
            axis = low + here.v;
            first = here.v;
            last = real(0);
        } else if (is_flat) {
            first = -first;
            here.side = select(real(1), real(-1), last > real(0));
            last = abs(last);
        } else if (!is_below) {
            let raised = law.q * abs(here.v);
            short = power(raised, law.inverse_q);
            here.scale = select(real(0), short / raised, short > real(0));
            here.side = select(real(1), real(-1), here.v < real(0));
            axis = high + short;
            first = high - low + short;
            last = short;
        }
        var pull = pull_critical();
        here.lift = real(0);
        if (is_below) {
            pull = pull_below(here.u);
        } else if (!is_flat) {
            pull = pull_above(here.u);
            here.lift = here.u;
        }
        let half_axis = sine_cosine(real(0.5) * axis);
        here.sine = chord * real(2) * half_axis.sine * half_axis.cosine;
        here.cosine = chord * (half_axis.cosine - half_axis.sine) * (half_axis.cosine + half_axis.sine);
        var arcs: array<Integrals, 2>;
        var ends: array<End, 2>;
        // Arcs begin at the axis if it lies between the ends or beyond, and are mirrored before it.
        let is_crossed = !is_below || (first < real(0) && last > real(0));
        let is_mirrored = is_below && first < real(0);
        for (var k = 0u; k < 2u; k++) {
            let x = select(first, last, k == 1u);
            var bounds = Pair(real(0), abs(x));
            if (!is_crossed) {
                let nearest = smaller(abs(first), abs(last));
                bounds = Pair(nearest, select(larger(abs(first), abs(last)), nearest, k == 1u));
            }
            arcs[k] = integrals(law, pull, bounds.u, bounds.v);
            let half = sine_cosine(real(0.5) * x);
            let excess = excess_at_half(pull, half);
            var measured = excess;
            if (k == 1u && kind == FOLLOWED_ABOVE) {
                measured = select(here.lift, excess / short, short > real(0));
            }
            let sine = real(2) * half.sine * half.cosine;
            let cosine = (half.cosine - half.sine) * (half.cosine + half.sine);
            ends[k] = End(x, sine, cosine, excess, real(1) / bent(law, measured));
        }
        here.low = ends[0];
        here.high = ends[1];
        // The second arc's sign: a shape that does not come back subtracts it.
        let part = select(here.side, real(1), is_below);
        let sign = select(real(1), real(-1), is_mirrored);
        let along = arcs[0].along + part * arcs[1].along;
        let across = sign * arcs[0].across + part * arcs[1].across;
        let cosine_sine = sign * arcs[0].cosine_sine + part * arcs[1].cosine_sine;
        let sine_sine = arcs[0].sine_sine + part * arcs[1].sine_sine;
        let right = here.cosine - along;
        let up = select(here.sine, -here.sine, is_below) - across;
        let size = larger(arcs[0].length + arcs[1].length, chord);
        here.length = arcs[0].length + select(part, abs(part), is_flat) * arcs[1].length;
        if (is_below) {
            here.right_u = arcs[0].cosine_cosine + arcs[1].cosine_cosine;
            here.right_v = cosine_sine;
            here.up_u = cosine_sine;
            here.up_v = sine_sine;
        } else {
            let scaled = select(here.high.radius, real(0), is_free);
            here.moved = select(here.side * here.scale, real(1), is_free);
            here.right_u = -here.lift * cosine_sine;
            here.up_u = -here.lift * sine_sine;
            here.right_v = (here.low.radius * here.low.cosine + here.sine) * here.moved + scaled * here.high.cosine;
            here.up_v = (here.low.radius * here.low.sine - here.cosine) * here.moved + scaled * here.high.sine;
        }
        let missing = select(sqrt(right * right + up * up), abs(up), is_flat);
        let rounding = EPSILON * size;
        if (is_no_number(missing) || !arcs[0].whole || !arcs[1].whole) {
            return here;
        }
        if (missing <= ROUNDING * rounding || (missing <= SMALL * rounding && missing >= STUCK * before)) {
            // If the piece that would close the chord grows with the overshoot, the shape is a
            // saddle.
            let minimum = here.right_u * here.up_v - here.right_v * here.up_u > real(0);
            let flat = here.cosine - arcs[0].along - arcs[1].along;
            here.found = select(minimum || kind != FOLLOWED_ABOVE || here.v <= real(0), flat >= real(0), is_flat);
            here.length += select(real(0), flat, is_flat);
            return here;
        }
        before = missing;
        var move_by = Pair(real(0), real(0));
        if (is_flat) {
            let slope = here.cosine - moment(here.low) - select(moment(here.high), real(0), is_free);
            move_by = shortened(Pair(real(0), -up / slope));
        } else {
            move_by = solved(here, right, up);
        }
        if (is_below) {
            let ahead = real(1) - here.u + move_by.u;
            let aside = move_by.v;
            if (here.u < real(0.1)) {
                // Near the critical pull the length depends on the logarithm of the gap.
                let logarithm = shortened(Pair(-move_by.u / here.u, real(0))).u;
                move_by = Pair(logarithm, shortened(Pair(real(0), aside / (real(1) - here.u))).v);
            } else {
                if (!(ahead > real(0))) {
                    return here;
                }
                let angle = first_quadrant_angle(abs(aside), ahead);
                here.u = real(1) - sqrt(ahead * ahead + aside * aside);
                move_by = Pair(real(0), select(angle, -angle, aside < real(0)));
            }
        } else if (!is_flat) {
            move_by = shortened(move_by);
        }
        here.u *= power(EULER, move_by.u);
        here.v += move_by.v;
        let is_lost = is_below && !(here.u > real(0) && here.u <= real(1));
        let bends_back = (is_flat && !is_free && !(here.v > low)) || (is_free && !(here.v > -low));
        if (is_no_number(here.u) || is_no_number(here.v) || is_lost || bends_back) {
            return here;
        }
    }
    return here;
}

// ρ sin x, 0 if the end is on the axis.
fn moment(end: End) -> real {
    if (!(end.argument > real(0))) {
        return real(0);
    }
    return end.sine * end.radius;
}
