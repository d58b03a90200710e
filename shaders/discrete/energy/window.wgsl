// What a term of an energy sees, and what it answers. Tangents and lengths count as independent variables; the chain rule
// to edges and vertices is that of edges.wgsl and hessian.wgsl. Twin: src/discrete/energy/mod.rs.

alias vector = vec$DIM<real>;
alias matrix = mat$DIMx$DIM<real>;

// Three consecutive edges: unit tangents, lengths, their inverses. Terms over fewer edges see the first ones.
struct Window {
    t0: vector,
    t1: vector,
    t2: vector,
    s0: real,
    s1: real,
    s2: real,
    r0: real,
    r1: real,
    r2: real,
    // Number of edges of the whole curve.
    segments: real,
    // ε of torsion: a curvature.
    torsion_curvature: real,
    // 1 where the vertex between the first two edges is no data point, else 0.
    free: real,
}

// A term and its partial derivatives by tangents and lengths.
struct Partials {
    value: real,
    t0: vector,
    t1: vector,
    t2: vector,
    s0: real,
    s1: real,
    s2: real,
    // The gauge's part of a sum, which is no part of `value`.
    gauge: real,
}

// Second partial derivatives: by two tangents (rows: the first), by tangent and length, by two lengths.
struct SecondPartials {
    t00: matrix,
    t01: matrix,
    t02: matrix,
    t11: matrix,
    t12: matrix,
    t22: matrix,
    // m01: by tangent 0 and length 1.
    m00: vector,
    m01: vector,
    m02: vector,
    m10: vector,
    m11: vector,
    m12: vector,
    m20: vector,
    m21: vector,
    m22: vector,
    s00: real,
    s01: real,
    s02: real,
    s11: real,
    s12: real,
    s22: real,
}

// a bᵀ
fn outer(a: vector, b: vector) -> matrix {
//:if SPATIAL
    return matrix(b.x * a, b.y * a, b.z * a);
//:else
    return matrix(b.x * a, b.y * a);
//:end
}

// x I
fn diagonal(x: real) -> matrix {
//:if SPATIAL
    return matrix(x, real(0), real(0), real(0), x, real(0), real(0), real(0), x);
//:else
    return matrix(x, real(0), real(0), x);
//:end
}

// e₁, which stands where a curve has no edge.
fn unit_edge() -> vector {
//:if SPATIAL
    return vector(real(1), real(0), real(0));
//:else
    return vector(real(1), real(0));
//:end
}

// weight · p, without the gauge.
fn scaled_partials(weight: real, p: Partials) -> Partials {
    return Partials(
        weight * p.value,
        weight * p.t0,
        weight * p.t1,
        weight * p.t2,
        weight * p.s0,
        weight * p.s1,
        weight * p.s2,
        real(0),
    );
}

// sum + weight · p; the gauge stays that of the sum.
fn add_partials(sum: Partials, weight: real, p: Partials) -> Partials {
    return Partials(
        sum.value + weight * p.value,
        sum.t0 + weight * p.t0,
        sum.t1 + weight * p.t1,
        sum.t2 + weight * p.t2,
        sum.s0 + weight * p.s0,
        sum.s1 + weight * p.s1,
        sum.s2 + weight * p.s2,
        sum.gauge,
    );
}

// sum + weight · h
fn add_seconds(sum: SecondPartials, weight: real, h: SecondPartials) -> SecondPartials {
    return SecondPartials(
        sum.t00 + weight * h.t00,
        sum.t01 + weight * h.t01,
        sum.t02 + weight * h.t02,
        sum.t11 + weight * h.t11,
        sum.t12 + weight * h.t12,
        sum.t22 + weight * h.t22,
        sum.m00 + weight * h.m00,
        sum.m01 + weight * h.m01,
        sum.m02 + weight * h.m02,
        sum.m10 + weight * h.m10,
        sum.m11 + weight * h.m11,
        sum.m12 + weight * h.m12,
        sum.m20 + weight * h.m20,
        sum.m21 + weight * h.m21,
        sum.m22 + weight * h.m22,
        sum.s00 + weight * h.s00,
        sum.s01 + weight * h.s01,
        sum.s02 + weight * h.s02,
        sum.s11 + weight * h.s11,
        sum.s12 + weight * h.s12,
        sum.s22 + weight * h.s22,
    );
}
