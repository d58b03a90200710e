// Torsion: det(T, K̄, C)²/(|K̄|² + ε²) ℓ with the distance ℓ from K to K′, C = (K′ − K)/ℓ, and K̄
// the mean of K and K′ without its component along T.
// Twin: src/discrete/energy/torsion.rs.
//
// det(T, K̄, C) = r₀ r₂ δ/ℓ with δ = det(T₀, T, T₂), so the term is U B of U = δ² A, A = r₀² r₂²/ℓ,
// and B = 1/(Φ + ε²). δ and its derivatives are computed from differences of tangents, which keeps
// more digits.
//:once include discrete/energy/across.wgsl

//:if SPATIAL
struct Determinant {
    value: real,
    // The derivatives by tangents.
    d0: vector,
    d1: vector,
    d2: vector,
    // A, and its logarithmic derivatives by lengths.
    a: real,
    l0: real,
    l1: real,
    l2: real,
    // ½ r₀², ½ r₂²
    q0: real,
    q2: real,
    // The logarithmic derivatives of 1/ℓ.
    way: CurvatureDistance,
}

fn determinant_of(w: Window) -> Determinant {
    let before = w.t1 - w.t0;
    let after = w.t2 - w.t1;
    let r0 = real(2) / (w.s0 + w.s1);
    let r2 = real(2) / (w.s1 + w.s2);
    var x = Determinant();
    x.d0 = cross(w.t1, after);
    x.d2 = cross(w.t1, before);
    x.d1 = cross(before, after) - (x.d0 + x.d2);
    x.value = -dot(x.d0, before);
    x.way = way_of(w.s0, w.s1, w.s2);
    x.a = r0 * r0 * (r2 * r2) * x.way.inverse;
    x.l0 = x.way.beside - r0;
    x.l2 = x.way.beside - r2;
    x.l1 = x.way.middle - (r0 + r2);
    x.q0 = real(0.5) * r0 * r0;
    x.q2 = real(0.5) * r2 * r2;
    return x;
}

// The matrix of x ↦ a × x.
fn cross_matrix(a: vector) -> matrix {
    return matrix(real(0), a.z, -a.y, -a.z, real(0), a.x, a.y, -a.x, real(0));
}

fn torsion_value(w: Window) -> real {
    let x = determinant_of(w);
    let k = across_of(w, real(0.5), real(0.5));
    return x.value * x.value * x.a / (dot(k.across, k.across) + w.torsion_curvature * w.torsion_curvature);
}

fn torsion_gradient(w: Window) -> Partials {
    let x = determinant_of(w);
    let m = across_gradient(across_of(w, real(0.5), real(0.5)));
    let b = real(1) / (m.value + w.torsion_curvature * w.torsion_curvature);
    let by_delta = real(2) * x.value * x.a * b;
    let value = x.value * x.value * x.a * b;
    let by_m = -value * b;
    var p = scaled_partials(by_m, m);
    p.value = value;
    p.t0 += by_delta * x.d0;
    p.t1 += by_delta * x.d1;
    p.t2 += by_delta * x.d2;
    p.s0 += value * x.l0;
    p.s1 += value * x.l1;
    p.s2 += value * x.l2;
    return p;
}

fn torsion_hessian(w: Window) -> SecondPartials {
    let x = determinant_of(w);
    let k = across_of(w, real(0.5), real(0.5));
    let m = across_gradient(k);
    let b = real(1) / (m.value + w.torsion_curvature * w.torsion_curvature);
    let ab = x.a * b;
    let by_delta = real(2) * x.value * ab;
    let value = x.value * x.value * ab;
    // U_xy B − B² (U_x Φ_y + U_y Φ_x) + 2 U B³ Φ_x Φ_y − U B² Φ_xy, where m is Φ.
    var h = add_seconds(SecondPartials(), -value * b, across_hessian(k, w.t1));
    let both = real(2) * value * b * b;
    let mixed = -by_delta * b;
    h.t00 += outer(both * m.t0 + mixed * x.d0, m.t0) + outer(mixed * m.t0 + (real(2) * ab) * x.d0, x.d0);
    h.t01 += outer(both * m.t0 + mixed * x.d0, m.t1) + outer(mixed * m.t0 + (real(2) * ab) * x.d0, x.d1);
    h.t02 += outer(both * m.t0 + mixed * x.d0, m.t2) + outer(mixed * m.t0 + (real(2) * ab) * x.d0, x.d2);
    h.t11 += outer(both * m.t1 + mixed * x.d1, m.t1) + outer(mixed * m.t1 + (real(2) * ab) * x.d1, x.d1);
    h.t12 += outer(both * m.t1 + mixed * x.d1, m.t2) + outer(mixed * m.t1 + (real(2) * ab) * x.d1, x.d2);
    h.t22 += outer(both * m.t2 + mixed * x.d2, m.t2) + outer(mixed * m.t2 + (real(2) * ab) * x.d2, x.d2);
    // Second derivatives of the determinant.
    h.t01 -= by_delta * cross_matrix(w.t2);
    h.t02 += by_delta * cross_matrix(w.t1);
    h.t12 -= by_delta * cross_matrix(w.t0);
    // Derivatives by a tangent and a length: along the determinant's derivative, and along Φ's.
    let e0 = x.l0 - b * m.s0;
    let e1 = x.l1 - b * m.s1;
    let e2 = x.l2 - b * m.s2;
    let n0 = -value * b * (x.l0 - real(2) * b * m.s0);
    let n1 = -value * b * (x.l1 - real(2) * b * m.s1);
    let n2 = -value * b * (x.l2 - real(2) * b * m.s2);
//:unroll j 0..3
//:unroll k 0..3
    h.m$j$k += (by_delta * e$k) * x.d$j + n$k * m.t$j;
//:end
//:end
    let lm = value * b;
    let mm = real(2) * value * b * b;
    h.s00 += value * (x.l0 * x.l0 + x.q0) - lm * (real(2) * x.l0 * m.s0) + mm * m.s0 * m.s0;
    h.s01 += value * (x.l0 * x.l1 + x.q0) - lm * (x.l0 * m.s1 + x.l1 * m.s0) + mm * m.s0 * m.s1;
    h.s02 += value * (x.l0 * x.l2) - lm * (x.l0 * m.s2 + x.l2 * m.s0) + mm * m.s0 * m.s2;
    h.s11 += value * (x.l1 * x.l1 + x.q0 + x.q2) - lm * (real(2) * x.l1 * m.s1) + mm * m.s1 * m.s1;
    h.s12 += value * (x.l1 * x.l2 + x.q2) - lm * (x.l1 * m.s2 + x.l2 * m.s1) + mm * m.s1 * m.s2;
    h.s22 += value * (x.l2 * x.l2 + x.q2) - lm * (real(2) * x.l2 * m.s2) + mm * m.s2 * m.s2;
    let own = value * x.way.beside * x.way.beside;
    let across = value * x.way.beside * x.way.middle;
    h.s00 += own;
    h.s01 += across;
    h.s02 += own;
    h.s11 += value * x.way.middle * x.way.middle;
    h.s12 += across;
    h.s22 += own;
    return h;
}
//:else
// In the plane the torsion is 0.
fn torsion_value(w: Window) -> real {
    return real(0);
}

fn torsion_gradient(w: Window) -> Partials {
    return Partials();
}

fn torsion_hessian(w: Window) -> SecondPartials {
    return SecondPartials();
}
//:end
