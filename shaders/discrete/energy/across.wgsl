// Φ = |c|² − (c·T)², the square of the component of c perpendicular to the middle tangent T, for a
// sum c = α₀K + α₂K′ of both curvature vectors of three edges: K = (T − T₀) r₀, K′ = (T₂ − T) r₂,
// r₀ = 2/(Δs₀ + Δs₁), r₂ = 2/(Δs₁ + Δs₂). Variation and torsion use it.

struct Across {
    c: vector,
    // c·T and c − (c·T) T
    along: real,
    across: vector,
    // ∂c/∂T is g0, g1, g2 times the unit matrix; ∂c/∂Δs is u0, u0 + u2, u2.
    g0: real,
    g1: real,
    g2: real,
    u0: vector,
    u2: vector,
    // ∂g0/∂Δs₀ = ∂g0/∂Δs₁ and ∂g2/∂Δs₁ = ∂g2/∂Δs₂; ∂²c/∂Δs₀² and ∂²c/∂Δs₂².
    h0: real,
    h2: real,
    v0: vector,
    v2: vector,
}

fn across_of(w: Window, alpha0: real, alpha2: real) -> Across {
    let r0 = real(2) / (w.s0 + w.s1);
    let r2 = real(2) / (w.s1 + w.s2);
    var x = Across();
    x.g0 = -alpha0 * r0;
    x.g2 = alpha2 * r2;
    x.g1 = -(x.g0 + x.g2);
    let c0 = (alpha0 * r0) * (w.t1 - w.t0);
    let c2 = (alpha2 * r2) * (w.t2 - w.t1);
    x.c = c2 + c0;
    x.along = dot(x.c, w.t1);
    x.across = x.c - x.along * w.t1;
    x.u0 = (real(-0.5) * r0) * c0;
    x.u2 = (real(-0.5) * r2) * c2;
    x.h0 = real(-0.5) * r0 * x.g0;
    x.h2 = real(-0.5) * r2 * x.g2;
    x.v0 = -r0 * x.u0;
    x.v2 = -r2 * x.u2;
    return x;
}

fn across_gradient(x: Across) -> Partials {
    let by_c = real(2) * x.across;
    var p = Partials();
    p.value = dot(x.across, x.across);
    p.t0 = x.g0 * by_c;
    p.t1 = x.g1 * by_c - (real(2) * x.along) * x.c;
    p.t2 = x.g2 * by_c;
    p.s0 = dot(by_c, x.u0);
    p.s2 = dot(by_c, x.u2);
    p.s1 = p.s0 + p.s2;
    return p;
}

fn across_hessian(x: Across, t: vector) -> SecondPartials {
    let by_c = real(2) * x.across;
    // Second derivatives of Φ by c twice, by c (rows) and T, and by T twice, without the T in c.
    let cc = diagonal(real(2)) - outer(real(2) * t, t);
    let ct = diagonal(real(-2) * x.along) - outer(real(2) * t, x.c);
    let tc = transpose(ct);
    let tt = outer(real(-2) * x.c, x.c);
    let u1 = x.u0 + x.u2;
    var h = SecondPartials();
    h.t00 = (x.g0 * x.g0) * cc;
    h.t01 = (x.g0 * x.g1) * cc + x.g0 * ct;
    h.t02 = (x.g0 * x.g2) * cc;
    h.t11 = (x.g1 * x.g1) * cc + x.g1 * (ct + tc) + tt;
    h.t12 = (x.g1 * x.g2) * cc + x.g2 * tc;
    h.t22 = (x.g2 * x.g2) * cc;
    let q0 = cc * x.u0;
    let q1 = cc * u1;
    let q2 = cc * x.u2;
    h.m00 = x.g0 * q0 + x.h0 * by_c;
    h.m01 = x.g0 * q1 + x.h0 * by_c;
    h.m02 = x.g0 * q2;
    h.m10 = x.g1 * q0 - x.h0 * by_c + tc * x.u0;
    h.m11 = x.g1 * q1 - (x.h0 + x.h2) * by_c + tc * u1;
    h.m12 = x.g1 * q2 - x.h2 * by_c + tc * x.u2;
    h.m20 = x.g2 * q0;
    h.m21 = x.g2 * q1 + x.h2 * by_c;
    h.m22 = x.g2 * q2 + x.h2 * by_c;
    let b0 = dot(by_c, x.v0);
    let b2 = dot(by_c, x.v2);
    h.s00 = dot(x.u0, q0) + b0;
    h.s01 = dot(x.u0, q1) + b0;
    h.s02 = dot(x.u0, q2);
    h.s11 = dot(u1, q1) + (b0 + b2);
    h.s12 = dot(u1, q2) + b2;
    h.s22 = dot(x.u2, q2) + b2;
    return h;
}

// The distance ℓ between both curvature vectors of three edges: the slopes of ln(1/ℓ) by the length
// of the middle edge and by the lengths of its neighbours, and 1/ℓ.
struct CurvatureDistance {
    middle: real,
    beside: real,
    inverse: real,
}

// ℓ is Δs₁, or (Δs₀ + 2Δs₁ + Δs₂)/4 if an edge is short.
// Twin: src/discrete/energy/curvatures.rs.
fn way_of(s0: real, s1: real, s2: real) -> CurvatureDistance {
    let is_long = min(min(s0, s1), s2) > SHORT_EDGE * (s0 + s1 + s2);
    let inverse = real(1) / select(real(0.25) * (s0 + real(2) * s1 + s2), s1, is_long);
    return CurvatureDistance(select(real(-0.5), real(-1), is_long) * inverse, select(real(-0.25), real(0), is_long) * inverse, inverse);
}
