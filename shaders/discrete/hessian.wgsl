// The Hessian of the terms that start at one edge, by the four vertices of their window: the chain rule from tangents and
// lengths to edges, and from edges to vertices. After energy/mod.wgsl. Twin: src/discrete/hessian.rs.

// v01: by vertex 0 (rows) and vertex 1 of the window.
struct VertexBlocks {
    v00: matrix,
    v01: matrix,
    v02: matrix,
    v03: matrix,
    v11: matrix,
    v12: matrix,
    v13: matrix,
    v22: matrix,
    v23: matrix,
    v33: matrix,
}

// By two edges: (P/Δs) F_TT (P′/Δs′) + (P/Δs) F_TΔs′ T′ᵀ + T (F_T′Δs P′/Δs′)ᵀ + T F_ΔsΔs′ T′ᵀ with P = I − T Tᵀ; `mixed`
// is by the first tangent and the second length, `mixed_back` the other way round.
fn edge_block(
    t: vector,
    r: real,
    t_other: vector,
    r_other: real,
    tangents: matrix,
    mixed: vector,
    mixed_back: vector,
    lengths: real,
) -> matrix {
    let left = tangents - outer(t, t * tangents);
    let both = left - outer(left * t_other, t_other);
    let along = r * (mixed - dot(t, mixed) * t) + lengths * t;
    let back = r_other * (mixed_back - dot(t_other, mixed_back) * t_other);
    return (r * r_other) * both + outer(along, t_other) + outer(t, back);
}

// What the first derivatives add at one edge, since P/Δs and T depend on it themselves.
fn edge_curvature(t: vector, r: real, by_tangent: vector, by_length: real) -> matrix {
    let along = dot(t, by_tangent);
    let across = (r * r) * (by_tangent - along * t);
    let rest = r * by_length - r * r * along;
    return diagonal(rest) - outer(rest * t + across, t) - outer(t, across);
}

fn vertex_blocks(w: Window, weights: Weights, edges: u32) -> VertexBlocks {
    let p = window_gradient(w, weights, edges);
    let h = window_hessian(w, weights, edges);
    let e00 = edge_block(w.t0, w.r0, w.t0, w.r0, h.t00, h.m00, h.m00, h.s00)
        + edge_curvature(w.t0, w.r0, p.t0, p.s0);
//:if EDGES_2
    let e01 = edge_block(w.t0, w.r0, w.t1, w.r1, h.t01, h.m01, h.m10, h.s01);
//:else
    let e01 = matrix();
//:end
//:if EDGES_3
    let e02 = edge_block(w.t0, w.r0, w.t2, w.r2, h.t02, h.m02, h.m20, h.s02);
//:else
    let e02 = matrix();
//:end
//:if EDGES_2
    let e11 = edge_block(w.t1, w.r1, w.t1, w.r1, h.t11, h.m11, h.m11, h.s11)
        + edge_curvature(w.t1, w.r1, p.t1, p.s1);
//:else
    let e11 = matrix();
//:end
//:if EDGES_3
    let e12 = edge_block(w.t1, w.r1, w.t2, w.r2, h.t12, h.m12, h.m21, h.s12);
//:else
    let e12 = matrix();
//:end
//:if EDGES_3
    let e22 = edge_block(w.t2, w.r2, w.t2, w.r2, h.t22, h.m22, h.m22, h.s22)
        + edge_curvature(w.t2, w.r2, p.t2, p.s2);
//:else
    let e22 = matrix();
//:end
    return VertexBlocks(
        e00,
        e01 - e00,
        e02 - e01,
        real(-1) * e02,
        e00 - e01 - transpose(e01) + e11,
        e01 - e02 - e11 + e12,
        e02 - e12,
        e11 - e12 - transpose(e12) + e22,
        e12 - e22,
        e22,
    );
}
