// The arguments and results of a term of an energy. Tangents and lengths count as independent
// variables; edges.wgsl and hessian.wgsl apply the chain rule to edges and vertices.
// Twin: src/discrete/energy/mod.rs.

alias vector = vec$DIM<real>;
alias matrix = mat$DIMx$DIM<real>;

// Twin: curvatures.rs.
const SHORT_EDGE: real = real(1e-4);

// The penalty at a vertex, for penalty.wgsl: β, r and ρ.
struct Penalty {
    slope: real,
    reach: real,
    stiffness: real,
}

// $MOST_EDGES consecutive edges: unit tangents, lengths and inverse lengths. Terms over fewer edges
// use the first ones.
struct Window {
//:unroll k 0..$MOST_EDGES
    t$k: vector,
    s$k: real,
    r$k: real,
//:end
    // The number of edges of the whole curve.
    segments: real,
    // ε of torsion: a curvature.
    torsion_curvature: real,
    // 1/w², where w is the width of the first edge's span.
    taut: real,
    // The factors of the regularisation at the vertex between the first two edges and at the next
    // vertex; 0 at a data point.
    free: real,
    free_after: real,
//:if PENALTIES
    // The penalties at the vertex between the first two edges, in the order of their kinds.
//:unroll k 0..$PENALTIES
    penalty$k: Penalty,
//:end
//:end
    // The number of free ends of an open curve that the first two edges touch.
    ends: real,
//:if SURFACE
    // The normal n of the surface at the vertex between the first two edges, and W = ∇²F/|∇F|
    // there.
    normal: vector,
    shape: matrix,
//:if SURFACE_WGSL
    // The position of that vertex in units of the input, and the unit of third derivatives there.
    place: vector,
    unit: real,
//:end
//:end
}

// A term and its partial derivatives by tangents and lengths.
struct Partials {
    value: real,
//:unroll k 0..$MOST_EDGES
    t$k: vector,
    s$k: real,
//:end
    // The value of the regularisation in a sum; `value` excludes it.
    regularisation: real,
//:if SURFACE
    // The derivative by the position of the vertex between the first two edges.
    x: vector,
//:end
}

// Second partial derivatives: t01 by the tangents 0 (rows) and 1, m01 by tangent 0 and length 1,
// s01 by the lengths 0 and 1.
struct SecondPartials {
//:unroll j 0..$MOST_EDGES
//:unroll k 0..$MOST_EDGES
    m$j$k: vector,
//:end
//:unroll k $j..$MOST_EDGES
    t$j$k: matrix,
    s$j$k: real,
//:end
//:end
//:if SURFACE
    // Derivatives by tangents (rows) and the position of the vertex between the first two edges, by
    // either length and the position, and by the position twice.
    x0: matrix,
    x1: matrix,
    sx: vector,
    xx: matrix,
//:end
}

// The weight of the turn between the first two edges. In energies of order 3, where the curvature
// does not vanish at a free end, the turn next to that end also covers the half edge there.
fn end_share(w: Window) -> real {
//:if SMOOTH_REGULARISATION
    return real(1) + real(0.5) * w.ends;
//:else
    return real(1);
//:end
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

// e₁, which replaces edges that do not exist.
fn unit_edge() -> vector {
//:if SPATIAL
    return vector(real(1), real(0), real(0));
//:else
    return vector(real(1), real(0));
//:end
}

// weight · p, without the regularisation.
fn scaled_partials(weight: real, p: Partials) -> Partials {
    return Partials(
        weight * p.value,
//:unroll k 0..$MOST_EDGES
        weight * p.t$k,
        weight * p.s$k,
//:end
        real(0),
//:if SURFACE
        weight * p.x,
//:end
    );
}

// sum + weight · p; the regularisation stays the sum's.
fn add_partials(sum: Partials, weight: real, p: Partials) -> Partials {
    return Partials(
        sum.value + weight * p.value,
//:unroll k 0..$MOST_EDGES
        sum.t$k + weight * p.t$k,
        sum.s$k + weight * p.s$k,
//:end
        sum.regularisation,
//:if SURFACE
        sum.x + weight * p.x,
//:end
    );
}

// sum + weight · h
fn add_seconds(sum: SecondPartials, weight: real, h: SecondPartials) -> SecondPartials {
    return SecondPartials(
//:unroll j 0..$MOST_EDGES
//:unroll k 0..$MOST_EDGES
        sum.m$j$k + weight * h.m$j$k,
//:end
//:unroll k $j..$MOST_EDGES
        sum.t$j$k + weight * h.t$j$k,
        sum.s$j$k + weight * h.s$j$k,
//:end
//:end
//:if SURFACE
        sum.x0 + weight * h.x0,
        sum.x1 + weight * h.x1,
        sum.sx + weight * h.sx,
        sum.xx + weight * h.xx,
//:end
    );
}
