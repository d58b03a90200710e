// Bending: |T′ − T|^ν Δa^(1−ν). The host writes the powers of q = |T′ − T|², of c = max(q, rounding
// of tangents) and of a = Δa, because integers, halves and quarters need no pow.
// Twin: src/discrete/energy/bending.rs. A kernel may contain several of these terms, each with its
// exponent and its $NAME.
//:if POWER
//:once include linalg/power.wgsl
//:end

struct $NAME_Arguments {
    d: vector,
    q: real,
    // The base of powers of q other than the zeroth and the first.
    c: real,
    a: real,
}

fn $NAME_arguments(w: Window) -> $NAME_Arguments {
    let d = w.t1 - w.t0;
    let q = dot(d, d);
    // Written like this, NaN propagates.
    let c = select(q, real($ROUNDING), q < real($ROUNDING));
    return $NAME_Arguments(d, q, c, real(0.5) * (w.s0 + w.s1));
}

fn $NAME_value(w: Window) -> real {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    return ($POWER_0) * ($MEASURE_0) * end_share(w);
}

fn $NAME_gradient(w: Window) -> Partials {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let measure = ($MEASURE_0) * end_share(w);
    let slope = ($POWER_1) * measure;
    var p = Partials();
    p.value = ($POWER_0) * measure;
    // ν
    p.t1 = (real($EXPONENT) * slope) * b.d;
    p.t0 = -p.t1;
    // (1 − ν)/2
    p.s0 = real($BY_LENGTH) * p.value / a;
    p.s1 = p.s0;
    return p;
}

fn $NAME_hessian(w: Window) -> SecondPartials {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let share = end_share(w);
    let slope = real($EXPONENT) * ($POWER_1);
    let measure = ($MEASURE_0) * share;
    var h = SecondPartials();
    h.t00 = diagonal(slope * measure);
//:if ALONG
    // ν (ν − 2)
    let along = real($ALONG) * ($POWER_2) * measure;
    h.t00 += outer(along * b.d, b.d);
//:end
    h.t01 = real(-1) * h.t00;
    h.t11 = h.t00;
    h.m10 = (real($BY_LENGTH) * slope * ($MEASURE_1) * share) * b.d;
    h.m11 = h.m10;
    h.m00 = -h.m10;
    h.m01 = h.m00;
    // ν (ν − 1)/4
    h.s00 = real($BY_LENGTHS) * ($POWER_0) * ($MEASURE_2) * share;
    h.s01 = h.s00;
    h.s11 = h.s00;
    return h;
}
