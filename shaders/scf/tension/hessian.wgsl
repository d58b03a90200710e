// Second derivatives of the cost by the end angles. Needs solve/near.wgsl.
// Twin: src/scf/tension/hessian.rs, which gives the formulas.

const STRAIGHT: real = real(1e-7);

struct Hessian {
    low: real,
    both: real,
    high: real,
}

fn hessian_of(kind: u32, here: Near) -> Hessian {
    if (kind == FOLLOWED_BELOW) {
        return hessian_below(here);
    }
    if (kind == FOLLOWED_FLAT || kind == FOLLOWED_FREE_FLAT) {
        return hessian_flat(here);
    }
    return hessian_above(here);
}

// The product of two vectors with the inverse compliance. Both are divided by the roots of its
// diagonal.
fn product(share: real, u: Pair, v: Pair) -> real {
    return (u.u * v.u - share * (u.u * v.v + u.v * v.u) + u.v * v.v) / (real(1) - share * share);
}

// Between two angles, with a pull below the tension: no inflection.
fn hessian_below(here: Near) -> Hessian {
    let strength = real(1) - here.u;
    let scale = Pair(sqrt(here.right_u), sqrt(here.up_v));
    let share = here.right_v / scale.u / scale.v;
    // ρT at both ends, in the frame of the pull.
    let first_up = here.low.radius * here.low.sine;
    let last_up = here.high.radius * here.high.sine;
    let first = Pair(here.low.radius * here.low.cosine / scale.u, first_up / scale.v);
    let last = Pair(here.high.radius * here.high.cosine / scale.u, last_up / scale.v);
    return Hessian(
        product(share, first, first) - strength * first_up,
        -product(share, first, last),
        product(share, last, last) + strength * last_up,
    );
}

// With a straight piece.
fn hessian_flat(here: Near) -> Hessian {
    let first = moment(here.low);
    let last = moment(here.high);
    let stiffness = first + last - here.cosine;
    return Hessian(
        first * (real(1) - first / stiffness),
        -first * last / stiffness,
        last * (real(1) - last / stiffness),
    );
}

// One inflection: inside, beyond the upper end or, if that is free, at it.
fn hessian_above(here: Near) -> Hessian {
    let t = here.lift;
    let low = here.low;
    let high = here.high;
    let right = low.radius * low.cosine;
    let up = low.radius * low.sine;
    let by_low = solved(here, right, up);
    let by_high = solved(here, -right - here.sine, here.cosine - up);
    let slope = low.sine + t * low.cosine;
    let grown = t * low.sine;
    let slope_high = (high.sine + t * high.cosine) * here.side * high.radius;
    let radius_sine = select(real(0), high.radius / here.scale * high.sine, here.scale > real(0));
    return Hessian(
        -low.radius * (grown * by_low.u + slope * (here.moved * by_low.v - real(1))),
        -low.radius * (grown * by_high.u + slope * (here.moved * by_high.v + real(1))),
        -here.side * (radius_sine * t * by_high.u + slope_high * by_high.v),
    );
}
