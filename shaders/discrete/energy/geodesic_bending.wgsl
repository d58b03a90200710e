// Geodesic bending: |m|^ν Δa^(1−ν) for the part m = d − (n·d) n of d = T′ − T in the tangent plane of a surface with the
// normal n at the vertex. The powers are those of bending.wgsl, of q = |m|². Besides tangents and lengths it depends on the
// place of the vertex, where the normal changes by W = ∇²F/|∇F|.
// Twin: src/discrete/energy/geodesic_bending.rs.
//:if POWER
//:once include linalg/power.wgsl
//:end

struct $NAME_Arguments {
    // n·d
    along: real,
    m: vector,
    q: real,
    c: real,
    a: real,
    // W m, the gradient of n·d by the place.
    k: vector,
}

fn $NAME_arguments(w: Window) -> $NAME_Arguments {
    let d = w.t1 - w.t0;
    let along = dot(w.normal, d);
    let m = d - along * w.normal;
    let q = dot(m, m);
    let c = select(q, real($ROUNDING), q < real($ROUNDING));
    return $NAME_Arguments(along, m, q, c, real(0.5) * (w.s0 + w.s1), w.shape * m);
}

fn $NAME_value(w: Window) -> real {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    return ($POWER_0) * ($MEASURE_0);
}

fn $NAME_gradient(w: Window) -> Partials {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let measure = $MEASURE_0;
    let slope = real($EXPONENT) * (($POWER_1) * measure);
    var p = Partials();
    p.value = ($POWER_0) * measure;
    p.t1 = slope * b.m;
    p.t0 = -p.t1;
    // (1 − ν)/2
    p.s0 = real($BY_LENGTH) * p.value / a;
    p.s1 = p.s0;
    p.x = (-slope * b.along) * b.k;
    return p;
}

// By coordinates in space. The CPU has the same by those in tangent planes: src/discrete/within/system.rs.
fn $NAME_hessian(w: Window) -> SecondPartials {
    let b = $NAME_arguments(w);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let slope = real($EXPONENT) * ($POWER_1);
    let measure = $MEASURE_0;
    let across = slope * measure;
    let n = w.normal;
    let wn = w.shape * n;
    var h = SecondPartials();
    h.t00 = across * (diagonal(real(1)) - outer(n, n));
    // ∂m/∂x = −(n ∇qᵀ + q P W)
    h.x0 = across * (outer(n, b.k) + b.along * (w.shape - outer(n, wn)));
    // ∇²q = ∇³F[m]/|∇F| − (∇q wᵀ + w ∇qᵀ) − q (W² − w wᵀ) for w = W n; of a quadric ∇³F is 0.
    var curved = real(-1) * (outer(b.k, wn) + outer(wn, b.k) + b.along * (w.shape * w.shape - outer(wn, wn)));
//:if SURFACE_WGSL
    curved += w.unit * surface_third(w.place, b.m);
//:end
    h.xx = real(-across) * (outer(b.k, b.k) + b.along * curved);
//:if ALONG
    // ν (ν − 2)
    let along = real($ALONG) * ($POWER_2) * measure;
    h.t00 += outer(along * b.m, b.m);
    h.x0 += outer((along * b.along) * b.m, b.k);
    h.xx += outer((along * b.along * b.along) * b.k, b.k);
//:end
    h.x1 = real(-1) * h.x0;
    h.t01 = real(-1) * h.t00;
    h.t11 = h.t00;
    h.m10 = (real($BY_LENGTH) * slope * ($MEASURE_1)) * b.m;
    h.m11 = h.m10;
    h.m00 = -h.m10;
    h.m01 = h.m00;
    h.sx = (-real($BY_LENGTH) * slope * ($MEASURE_1) * b.along) * b.k;
    // ν (ν − 1)/4
    h.s00 = real($BY_LENGTHS) * ($POWER_0) * ($MEASURE_2);
    h.s01 = h.s00;
    h.s11 = h.s00;
    return h;
}
