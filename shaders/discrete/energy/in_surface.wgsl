// Energies f(|m|², Δa) of the bend m of a curve within a surface: the component d − (n·d) n of
// d = T′ − T in the tangent plane, with the normal n at the vertex. They also depend on the
// position of the vertex, because the normal changes with it by W = ∇²F/|∇F|.
// Twin: src/discrete/energy/in_surface.rs.

struct Bend {
    // n·d
    along_normal: real,
    m: vector,
    square: real,
    measure: real,
    // W m, the gradient of n·d by the position.
    slope: vector,
}

// f and its first derivatives: 2 ∂f/∂s with s = |m|², and ½ ∂f/∂Δa.
struct BendFirst {
    value: real,
    across: real,
    by_length: real,
}

// The second derivatives of f: 2 ∂f/∂s, 4 ∂²f/∂s², ∂²f/∂s∂Δa and ¼ ∂²f/∂Δa².
struct BendSecond {
    across: real,
    along: real,
    mixed: real,
    by_lengths: real,
}

fn bend_of(w: Window) -> Bend {
    let d = w.t1 - w.t0;
    let along_normal = dot(w.normal, d);
    let m = d - along_normal * w.normal;
    return Bend(along_normal, m, dot(m, m), real(0.5) * (w.s0 + w.s1), w.shape * m);
}

fn bend_gradient(b: Bend, f: BendFirst) -> Partials {
    var p = Partials();
    p.value = f.value;
    p.t1 = f.across * b.m;
    p.t0 = -p.t1;
    p.s0 = f.by_length;
    p.s1 = f.by_length;
    p.x = (-f.across * b.along_normal) * b.slope;
    return p;
}

// Derivatives by coordinates in space. The CPU has them by coordinates in tangent planes:
// src/discrete/within/system.rs.
fn bend_hessian(w: Window, b: Bend, f: BendSecond) -> SecondPartials {
    let n = w.normal;
    let q = b.along_normal;
    let wn = w.shape * n;
    var h = SecondPartials();
    h.t00 = f.across * (diagonal(real(1)) - outer(n, n));
    // ∂m/∂x = −(n ∇qᵀ + q P W)
    h.x0 = f.across * (outer(n, b.slope) + q * (w.shape - outer(n, wn)));
    // ∇²q = ∇³F[m]/|∇F| − (∇q wᵀ + w ∇qᵀ) − q (W² − w wᵀ) for w = W n. For quadrics ∇³F is 0.
    var curved = real(-1) * (outer(b.slope, wn) + outer(wn, b.slope) + q * (w.shape * w.shape - outer(wn, wn)));
//:if SURFACE_WGSL
    curved += w.unit * surface_third(w.place, b.m);
//:end
    h.xx = (-f.across) * (outer(b.slope, b.slope) + q * curved);
    // 0 for ν = 2.
    if (f.along != real(0)) {
        h.t00 += outer(f.along * b.m, b.m);
        h.x0 += outer((f.along * q) * b.m, b.slope);
        h.xx += outer((f.along * q * q) * b.slope, b.slope);
    }
    h.x1 = real(-1) * h.x0;
    h.t01 = real(-1) * h.t00;
    h.t11 = h.t00;
    h.m10 = f.mixed * b.m;
    h.m11 = h.m10;
    h.m00 = -h.m10;
    h.m01 = h.m00;
    h.sx = (-f.mixed * q) * b.slope;
    h.s00 = f.by_lengths;
    h.s01 = h.s00;
    h.s11 = h.s00;
    return h;
}
