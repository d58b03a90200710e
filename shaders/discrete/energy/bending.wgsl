// Bending: |T′ − T|^ν Δa^(1−ν). The host writes the powers of q = |T′ − T|², of c = max(q, what rounding of tangents
// leaves), and of a = Δa, since integers, halves and quarters need no pow. Twin: src/discrete/energy/bending.rs.

struct BendingArguments {
    d: vector,
    q: real,
    // Powers of q but the first and the zeroth are taken of this.
    c: real,
    a: real,
}

fn bending_arguments(w: Window) -> BendingArguments {
    let d = w.t1 - w.t0;
    let q = dot(d, d);
    // In this form NaN stays NaN.
    let c = select(q, real($BENDING_ROUNDING), q < real($BENDING_ROUNDING));
    return BendingArguments(d, q, c, real(0.5) * (w.s0 + w.s1));
}

fn bending_value(w: Window) -> real {
    let b = bending_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    return ($BENDING_POWER_0) * ($BENDING_MEASURE_0);
}

fn bending_gradient(w: Window) -> Partials {
    let b = bending_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let measure = $BENDING_MEASURE_0;
    let slope = ($BENDING_POWER_1) * measure;
    var p = Partials();
    p.value = ($BENDING_POWER_0) * measure;
    // ν
    p.t1 = (real($BENDING_EXPONENT) * slope) * b.d;
    p.t0 = -p.t1;
    // (1 − ν)/2
    p.s0 = real($BENDING_BY_LENGTH) * p.value / a;
    p.s1 = p.s0;
    return p;
}

fn bending_hessian(w: Window) -> SecondPartials {
    let b = bending_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let slope = real($BENDING_EXPONENT) * ($BENDING_POWER_1);
    let measure = $BENDING_MEASURE_0;
    var h = SecondPartials();
    h.t00 = diagonal(slope * measure);
//:if BENDING_ALONG
    // ν (ν − 2)
    let along = real($BENDING_ALONG) * ($BENDING_POWER_2) * measure;
    h.t00 += outer(along * b.d, b.d);
//:end
    h.t01 = real(-1) * h.t00;
    h.t11 = h.t00;
    h.m10 = (real($BENDING_BY_LENGTH) * slope * ($BENDING_MEASURE_1)) * b.d;
    h.m11 = h.m10;
    h.m00 = -h.m10;
    h.m01 = h.m00;
    // ν (ν − 1)/4
    h.s00 = real($BENDING_BY_LENGTHS) * ($BENDING_POWER_0) * ($BENDING_MEASURE_2);
    h.s01 = h.s00;
    h.s11 = h.s00;
    return h;
}
